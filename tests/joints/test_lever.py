"""The noise of the parent's frame, against points seen in frames whose markers are noisy.

Tolerances are standard deviations of what is compared, four or five of them; each test says which.
"""

import numpy as np
from centres import CENTRE, EXACT, TEMPLATE, centre_of, frame_on, noisy_frames, on_sphere

from mocap_skel.joints.lever import Lever
from mocap_skel.segments.pose import least_squares_pose
from mocap_skel.spherefit import mgdk, sphere_moments


class TestFrameNoise:
    """The parent's frame has noise of its own; it grows with the distance from the frame."""

    def test_its_covariance_is_what_noisy_markers_make(self):
        rng, sigma, runs = np.random.default_rng(11), 0.001, 20_000
        places = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [-0.1, 0.4, 0.2]])
        points = np.broadcast_to(places, (runs, 3, 3))
        noise = noisy_frames(points, TEMPLATE, sigma, rng) - places
        lever = Lever.of(frame_on().shape)
        expected = sigma**2 * lever.covariance(sphere_moments(np.swapaxes(points, 0, 1)))
        for m in range(3):
            found = noise[:, m].T @ noise[:, m] / runs
            # A covariance of N samples is known to √(2/N) of the variances: 1 %, five of which.
            scale = 5 * np.sqrt(2 / runs) * np.trace(expected[m])
            np.testing.assert_allclose(found, expected[m], rtol=0, atol=scale)
        # At the frame's own centre there is no lever: σ²/M.
        np.testing.assert_allclose(expected[0], sigma**2 / 4 * np.eye(3), rtol=0, atol=1e-18)

    def test_noise_of_any_shape_makes_its_own_turns(self):
        """Along z ten times the noise: the frame turns about x and y, hardly about z."""
        rng, sigma, runs = np.random.default_rng(21), 0.001, 20_000
        place = np.array([0.3, -0.1, 0.2])
        matrix = np.diag([1.0, 0.5, 10.0])
        noise = sigma * rng.standard_normal((runs, *TEMPLATE.shape)) @ np.sqrt(matrix)
        pose = least_squares_pose(TEMPLATE + noise, TEMPLATE, np.ones(4))
        seen = pose.to_segment(np.broadcast_to(place, (runs, 1, 3)))[:, 0] - place
        lever = Lever.of(frame_on().shape, matrix)
        law = sigma**2 * lever.covariance(sphere_moments(place[None, None]))[0]
        # As above: 1 % of the variances, five of which.
        np.testing.assert_allclose(
            seen.T @ seen / runs, law, rtol=0, atol=5 * np.sqrt(2 / runs) * np.trace(law)
        )

    def test_its_covariance_is_averaged_over_the_places_of_a_marker(self):
        points = on_sphere(1.0, 200, np.random.default_rng(12))
        lever = Lever.of(frame_on().shape)
        at_once = lever.covariance(sphere_moments(np.swapaxes(points, 0, 1)))[0]
        each = [lever.covariance(sphere_moments(p[None, None])) for p in points[:, 0]]
        # C divides by N - 1, the average by N.
        np.testing.assert_allclose(
            at_once, np.mean(each, axis=0)[0], rtol=0, atol=np.trace(at_once) / 199
        )

    def test_its_third_moment_is_what_noisy_markers_add(self):
        rng, sigma, runs = np.random.default_rng(13), 0.002, 4000
        points = on_sphere(0.8, 60, rng, markers=2)
        clean = sphere_moments(np.swapaxes(points, 0, 1))
        lever = Lever.of(frame_on().shape)
        expected = sigma**2 * lever.third_moment(clean, points)
        noise = sigma * rng.standard_normal((runs * len(points), *TEMPLATE.shape))
        third = []
        # What is odd in the noise vanishes on average; with each noise its negative it vanishes at once.
        for one in (noise, -noise):
            seen = least_squares_pose(TEMPLATE + one, TEMPLATE, np.ones(4))
            noisy = seen.to_segment(np.tile(points, (runs, 1, 1))).reshape(runs, *points.shape)
            third.append(sphere_moments(noisy.swapaxes(1, 2)).third)
        third = np.mean(third, axis=0)
        added = third.mean(axis=0) - clean.third
        chance = third.std(axis=0) / np.sqrt(runs)
        # Four standard deviations of the mean; 1/N for the sums' own mean, which has noise too; and a
        # frame that turns to and fro by ω sees everything nearer by ω²/2, S by three times that. The
        # centre comes nearer with it, which is no concern of the sphere fit.
        shrinking = 1.5 * sigma**2 * lever.turns.sum() * np.abs(clean.third).max()
        np.testing.assert_array_less(
            np.abs(added - expected),
            4 * chance + np.abs(expected).max() / len(points) + shrinking,
        )
        # It is no small print: far more than chance.
        assert np.abs(expected).max() > 40 * chance.max()

    def test_isotropic_noise_adds_nothing_to_the_third_moment(self):
        rng, sigma, runs = np.random.default_rng(14), 0.005, 4000
        points = on_sphere(0.8, 60, rng)
        clean = sphere_moments(np.swapaxes(points, 0, 1)).third
        noise = sigma * rng.standard_normal((runs, *points.shape))
        third = np.stack([sphere_moments(np.swapaxes(points + e, 0, 1)).third for e in noise])
        chance = third.std(axis=0) / np.sqrt(runs)
        np.testing.assert_array_less(np.abs(third.mean(axis=0) - clean), 4 * chance)

    def test_a_centre_in_a_noisy_frame_is_not_pulled_to_one_side(self):
        rng, sigma, runs = np.random.default_rng(15), 0.002, 200
        errors, plain = [], []
        for _ in range(runs):
            points = on_sphere(0.7, 300, rng)
            seen = noisy_frames(points, TEMPLATE, sigma, rng)
            seen = seen + sigma * rng.standard_normal(seen.shape)
            found = centre_of(seen, sigma, frame_on(sigma=sigma))
            errors.append(found.centre - CENTRE)
            moments = sphere_moments(np.swapaxes(seen, 0, 1))
            plain.append(mgdk(moments, sigma).centre - CENTRE)
        mean, chance = np.mean(errors, axis=0), np.std(errors, axis=0) / np.sqrt(runs)
        bias, its_chance = np.mean(plain, axis=0), np.std(plain, axis=0) / np.sqrt(runs)
        assert (np.abs(bias) > 6 * its_chance).any()
        # Four standard deviations, and a tenth of what plain MGDK is off: the correction is the
        # noise's expectation to first order, applied with the places of the noisy points.
        assert (np.abs(mean) <= 4 * chance + 0.1 * np.abs(bias).max()).all()

    def test_a_frame_on_one_marker_has_no_lever(self):
        assert Lever.of(EXACT.shape) is None

"""One joint's centre and the evidence for it, against points made on spheres of known cap and noise.

Tolerances are standard deviations of what is compared, four or five of them; each test says which.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mocap_skel.joints.centre import (
    SAFE_ERROR,
    Frame,
    JointFit,
    fit_centre,
    unfitted,
)
from mocap_skel.joints.lever import Lever
from mocap_skel.segments.pose import least_squares_pose
from mocap_skel.segments.shape import Shape
from mocap_skel.spherefit import mgdk, sphere_moments

LAWS = settings(derandomize=True, deadline=None, max_examples=15, database=None)
EPS = np.finfo(float).eps
# A frame that is exact: on one marker, whose noise nothing tells of.
EXACT = Frame(None)
CENTRE = np.array([0.1, -0.2, 0.3])
RADIUS = 0.4


def cap(half_angle, count, axis=(0.0, 0.0, 1.0)):
    """Unit vectors (count, 3) spread evenly over a cap: a golden spiral."""
    i = np.arange(count) + 0.5
    z = 1 - i / count * (1 - np.cos(half_angle))
    turn = np.pi * (1 + np.sqrt(5)) * i
    ring = np.sqrt(1 - z**2)
    points = np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)
    return points @ Rotation.align_vectors([axis], [[0.0, 0.0, 1.0]])[0].as_matrix().T


def on_sphere(half_angle, count, rng, sigma=0.0, markers=1):
    """(count, markers, 3) about CENTRE, in random order of time, with white noise."""
    points = np.stack(
        [
            CENTRE + RADIUS * (1 + 0.2 * m) * cap(half_angle, count)[rng.permutation(count)]
            for m in range(markers)
        ],
        axis=1,
    )
    return points + sigma * rng.standard_normal(points.shape)


TEMPLATE = np.array(
    [[0.1, 0.1, 0.0], [-0.12, 0.08, 0.02], [-0.05, -0.15, 0.04], [0.08, -0.06, -0.1]]
)
TEMPLATE = TEMPLATE - TEMPLATE.mean(axis=0)


def frame_on(template=TEMPLATE, sigma=0.0):
    return Frame(Shape(template, np.ones(len(template)), (0, 1, 2), sigma))


def noisy_frames(points, template, sigma, rng):
    """Points (frames, M, 3) of a frame as they look from the pose of its noisy markers."""
    seen = template + sigma * rng.standard_normal((len(points), *template.shape))
    return least_squares_pose(seen, template, np.ones(len(template))).to_segment(points)


class TestEvidence:
    @pytest.mark.parametrize("degrees", [20, 45, 90, 150])
    def test_a_cap_is_told_by_its_half_angle(self, degrees):
        theta = np.radians(degrees)
        points = CENTRE + RADIUS * cap(theta, 4000)[:, None]
        found = fit_centre(points, 0.0, 0.0, EXACT)
        np.testing.assert_allclose(found.centre, CENTRE, rtol=0, atol=1e-10)
        np.testing.assert_allclose(found.radius, [RADIUS], rtol=0, atol=1e-10)
        # A uniform cap has λ_min = r² sin⁴(θ/2) / 3; the spiral is uniform to about 1/N.
        weakest = RADIUS * np.sin(theta / 2) ** 2 / np.sqrt(3)
        assert found.weakest_sd == pytest.approx(weakest, rel=2e-3)
        assert found.angle == pytest.approx(theta, rel=2e-3)
        assert found.residual <= 1e-10
        assert (found.samples, found.method, found.hinge) == (4000, "UGDK", False)
        assert (found.shown, found.reason) == ("yes", "")

    def test_two_markers_share_a_centre_and_have_a_radius_each(self):
        found = fit_centre(on_sphere(1.0, 500, np.random.default_rng(1), markers=2), 0, 0, EXACT)
        np.testing.assert_allclose(found.centre, CENTRE, rtol=0, atol=1e-12)
        np.testing.assert_allclose(found.radius, [RADIUS, 1.2 * RADIUS], rtol=0, atol=1e-12)
        assert (found.samples, found.method) == (1000, "MGDK")

    @pytest.mark.parametrize("sigma", [0.0005, 0.002, 0.005])
    def test_the_residual_is_the_noise(self, sigma):
        count = 3000
        points = on_sphere(1.2, count, np.random.default_rng(2), sigma)
        found = fit_centre(points, sigma, sigma, EXACT)
        # A standard deviation of N numbers is known to 1/√(2N); what the fit takes is less.
        assert found.residual == pytest.approx(sigma, rel=5 / np.sqrt(2 * count))
        # The smallest root of Pratt's polynomial is the same noise.
        assert found.sigma == pytest.approx(sigma, rel=5 / np.sqrt(2 * count))
        # White noise: all samples count. The autocorrelation's first lags are chance, 1/√N each, and
        # only positive ones are summed, so at most a few.
        assert 1 - 5 * 2 / np.sqrt(count) <= found.effective / count <= 1
        assert found.radius[0] == pytest.approx(RADIUS, abs=5 * sigma / np.sqrt(count) * 4)

    def test_no_more_noise_is_taken_away_than_the_points_show(self):
        points = on_sphere(1.2, 1000, np.random.default_rng(3), 0.001)
        found = fit_centre(points, 0.02, 0.02, EXACT)
        assert found.sigma == pytest.approx(0.001, rel=5 / np.sqrt(2 * 1000))

    def test_missing_samples_are_left_out(self):
        rng = np.random.default_rng(4)
        points = on_sphere(1.0, 400, rng, 0.001, markers=2)
        points[rng.random((400, 2)) < 0.3] = np.nan
        found = fit_centre(points, 0.001, 0.001, EXACT)
        assert found.samples == np.isfinite(points[..., 0]).sum()
        error = found.centre - CENTRE
        # χ² of three degrees of freedom is below 21.1 in 99.99 % of all cases.
        assert error @ np.linalg.solve(found.covariance, error) <= 21.1

    def test_too_few_samples_show_nothing(self):
        points = on_sphere(1.0, 10, np.random.default_rng(5))
        assert fit_centre(points[:3], 0.0, 0.0, EXACT) is None
        assert fit_centre(np.full((10, 2, 3), np.nan), 0.0, 0.0, EXACT) is None

    def test_a_marker_that_is_never_seen_changes_nothing(self):
        points = on_sphere(1.0, 400, np.random.default_rng(6), 0.001, markers=2)
        alone = fit_centre(points, 0.001, 0.001, frame_on())
        never = np.full((400, 1, 3), np.nan)
        more = fit_centre(np.concatenate([points, never], axis=1), 0.001, 0.001, frame_on())
        np.testing.assert_allclose(more.centre, alone.centre, rtol=0, atol=1e-12)
        np.testing.assert_allclose(more.covariance, alone.covariance, rtol=1e-9)
        np.testing.assert_allclose(more.radius[:2], alone.radius, rtol=1e-12)
        assert (more.samples, more.shown) == (alone.samples, alone.shown)
        assert more.angle == pytest.approx(alone.angle, rel=1e-9)

    @LAWS
    @given(st.integers(0, 2**32 - 1))
    def test_turning_the_frame_turns_the_centre_and_its_covariance(self, seed):
        rng = np.random.default_rng(seed)
        turn = Rotation.random(random_state=rng).as_matrix()
        points = on_sphere(0.9, 200, rng, 0.001, markers=2)
        lever = TEMPLATE @ turn.T
        a = fit_centre(points, 0.001, 0.001, frame_on())
        b = fit_centre(points @ turn.T, 0.001, 0.001, frame_on(lever))
        # eps times the condition of the cap, r²/λ_min = 80, times metres; generously.
        np.testing.assert_allclose(turn @ a.centre, b.centre, rtol=0, atol=1e-12)
        np.testing.assert_allclose(
            turn @ a.covariance @ turn.T, b.covariance, rtol=0, atol=1e-9 * np.trace(a.covariance)
        )
        assert abs(abs(turn @ a.axis @ b.axis) - 1) <= 1e-9
        for name in ("samples", "shown", "method", "hinge"):
            assert getattr(a, name) == getattr(b, name)
        for name in ("residual", "sigma", "weakest_sd", "angle", "effective"):
            assert getattr(a, name) == pytest.approx(getattr(b, name), rel=1e-9)


class TestStandardErrors:
    def test_they_are_what_repetition_shows(self):
        rng = np.random.default_rng(7)
        runs, sigma = 300, 0.002
        found = [
            fit_centre(on_sphere(1.0, 200, rng, sigma, markers=2), sigma, sigma, EXACT)
            for _ in range(runs)
        ]
        errors = np.array([f.centre - CENTRE for f in found])
        # In each of the bound's principal directions: a variance of 300 runs is known to √(2/300) =
        # 8 %, four of which are allowed; the noise is small enough for the bound to be reached
        # (method.md, section 2: UGDK has 1.04 to 1.05 of it at σ/r = 0.01 and 45 degrees).
        values, vectors = np.linalg.eigh(np.mean([f.covariance for f in found], axis=0))
        ratio = ((errors @ vectors) ** 2).mean(axis=0) / values
        assert (ratio >= 1 - 4 * np.sqrt(2 / runs)).all()
        assert (ratio <= 1.05**2 * (1 + 4 * np.sqrt(2 / runs))).all()
        # And there is no bias: the mean of 300 is known to 1/√300 of the spread.
        mean = errors.mean(axis=0) @ vectors
        assert (np.abs(mean) <= 4 * np.sqrt(values / runs)).all()

    def test_white_noise_shrinks_them_with_the_root_of_the_count(self):
        rng, sigma = np.random.default_rng(8), 0.002
        error = {
            count: np.mean(
                [
                    np.trace(
                        fit_centre(
                            on_sphere(1.0, count, rng, sigma), sigma, sigma, EXACT
                        ).covariance
                    )
                    for _ in range(30)
                ]
            )
            for count in (250, 1000, 4000)
        }
        # Lags of chance, 1/√N each, are summed while positive: 2/√N too much variance on average,
        # 13 % for 250, 6 % for 1000. That varies by as much again, over 30 runs by a fifth of it.
        assert error[250] / error[1000] == pytest.approx(4, rel=0.13 + 0.03)
        assert error[1000] / error[4000] == pytest.approx(4, rel=0.06 + 0.02)

    @pytest.mark.parametrize("times", [2, 5, 10])
    def test_frames_that_are_repeated_are_no_new_evidence(self, times):
        sigma, count = 0.002, 400
        points = on_sphere(1.0, count, np.random.default_rng(9), sigma)
        once = fit_centre(points, sigma, sigma, EXACT)
        again = fit_centre(np.repeat(points, times, axis=0), sigma, sigma, EXACT)
        # Means over N differ from those over times N in the divisor N - 1 only.
        np.testing.assert_allclose(again.centre, once.centre, rtol=0, atol=sigma / count)
        assert again.samples == times * count
        # The autocorrelation of held values falls off in a straight line, and its sum is `times`;
        # chance adds a few lags of 1/√400 = 5 %.
        assert again.effective == pytest.approx(count, rel=0.2)
        # Errors that last over frames are taken for skin, which more frames do not mend.
        assert (np.diag(again.covariance) >= np.diag(once.covariance) * (1 - 0.2 - 2 / count)).all()

    @pytest.mark.parametrize("memory", [0.5, 0.9])
    def test_slow_noise_counts_for_fewer_samples_than_fast_noise(self, memory):
        rng, count, sigma = np.random.default_rng(10), 16_000, 0.002
        noise = rng.standard_normal(count)
        for i in range(1, count):
            noise[i] = memory * noise[i - 1] + np.sqrt(1 - memory**2) * noise[i]
        rays = cap(1.2, count)[rng.permutation(count)]
        points = CENTRE + (RADIUS + sigma * noise)[:, None] * rays
        found = fit_centre(points[:, None], sigma, sigma, EXACT)
        # First-order noise: 1 + 2 Σ memory^k = (1 + memory) / (1 - memory) frames a sample. Such a sum
        # over M lags is known to √(2 (2M + 1) / N) (Sokal 1997), for its first zero at seven of
        # these times 8 and 18 %; two of it.
        time = (1 + memory) / (1 - memory)
        chance = np.sqrt(2 * (2 * 7 * time + 1) / count)
        assert found.effective == pytest.approx(count / time, rel=2 * chance)


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
            found = fit_centre(seen, sigma, sigma, frame_on(sigma=sigma))
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


def arc(half_angle, count, sigma, rng):
    """One marker, (count, 1, 3), on a circle about CENTRE."""
    bend = half_angle * (2 * (rng.permutation(count) + 0.5) / count - 1)
    ring = np.stack([np.sin(bend), np.zeros(count), np.cos(bend)], axis=1)
    return (CENTRE + RADIUS * ring + sigma * rng.standard_normal((count, 3)))[:, None]


class TestVerdict:
    @pytest.mark.parametrize(
        ("half_angle", "count", "sigma", "verdict", "word"),
        [
            # λ_min = r² sin⁴(θ/2) / 3: √λ_min is 58 mm for 60 degrees, 16 for 30, 7 for 20, 1.8 for 10.
            (60, 500, 0.001, "yes", ""),
            (60, 500, 0.005, "yes", ""),
            (60, 500, 0.015, "weak", "distance"),
            (60, 12, 0.005, "weak", "standard error"),
            (30, 500, 0.008, "weak", "above its noise"),
            (20, 500, 0.009, "no", ""),
            (10, 500, 0.0001, "no", "skin"),
            (0.1, 500, 0.003, "no", "moves"),
        ],
    )
    def test_a_cap_gets_the_one_that_it_deserves_with_a_reason(
        self, half_angle, count, sigma, verdict, word
    ):
        rng = np.random.default_rng(20)
        points = on_sphere(np.radians(half_angle), count, rng, sigma)
        found = fit_centre(points, sigma, sigma, EXACT)
        assert (found.shown, found.reason == "") == (verdict, verdict == "yes")
        assert word in found.reason

    def test_a_residual_counts_whatever_the_noise_is_said_to_be(self):
        points = on_sphere(np.radians(30), 500, np.random.default_rng(22), 0.008)
        assert fit_centre(points, 0.001, 0.001, EXACT).shown == "weak"

    def test_noise_of_the_frame_that_explains_the_spread_counts(self):
        points = on_sphere(np.radians(30), 500, np.random.default_rng(23), 0.001)
        # Along the cap's axis, where it spreads least (16 mm), the points are 0.2 m off the middle of
        # the frame's markers, which stand 0.14 m around it: there noise of σ in them makes 1.3 σ.
        verdicts = [
            fit_centre(points, 0.001, 0.001, frame_on(sigma=skin)).shown
            for skin in (0.0005, 0.005, 0.02)
        ]
        assert verdicts == ["yes", "weak", "no"]

    @pytest.mark.parametrize(("half_angle", "word"), [(40, "one axis"), (4, "one line")])
    def test_an_arc_does_not_show_a_centre(self, half_angle, word):
        # r (1 - cos θ) is 94 mm for the one, 1 mm for the other: no more than a line in noise of 2 mm.
        points = arc(np.radians(half_angle), 500, 0.002, np.random.default_rng(21))
        found = fit_centre(points, 0.002, 0.002, EXACT)
        assert (found.shown, found.method) == ("no", "SGDK")
        assert word in found.reason
        assert found.hinge == (word == "one axis")

    def test_more_noise_never_makes_a_verdict_better(self):
        rank = {"no": 0, "weak": 1, "yes": 2}
        for theta in (0.1, 0.3, 0.8):
            verdicts = []
            for sigma in (0.0001, 0.001, 0.005, 0.02, 0.05):
                points = on_sphere(theta, 500, np.random.default_rng(16), sigma)
                verdicts.append(rank[fit_centre(points, sigma, sigma, EXACT).shown])
            assert verdicts == sorted(verdicts, reverse=True)
            assert verdicts[-1] == 0

    def test_a_hinge_is_no_and_gives_its_axis(self):
        rng = np.random.default_rng(17)
        axis = np.array([0.6, 0.0, 0.8])
        bend = rng.uniform(-1.2, 1.2, 600)
        spin = Rotation.from_rotvec(bend[:, None] * axis).as_matrix()
        arms = np.array([[0.0, 0.3, 0.0], [0.08, 0.2, -0.06]])
        points = CENTRE + np.einsum("fij,mj->fmi", spin, arms)
        sigma = 0.001
        found = fit_centre(points + sigma * rng.standard_normal(points.shape), sigma, sigma, EXACT)
        assert (found.shown, found.method, found.hinge) == ("no", "SGDK", True)
        assert "one axis" in found.reason
        # The plane's normal: σ over the spread in the plane (0.06 m in its shorter direction) and √N.
        assert abs(found.axis @ axis) >= np.cos(5 * sigma / 0.06 / np.sqrt(1200))
        # On the axis; along it level with the markers.
        across = found.centre - CENTRE
        along = across @ axis
        assert np.linalg.norm(across - along * axis) <= 5 * sigma * 3 / np.sqrt(1200) * 4
        middle = (points.reshape(-1, 3).mean(axis=0) - CENTRE) @ axis
        assert along == pytest.approx(middle, abs=5 * sigma)

    def test_along_a_hinge_nothing_is_known_but_the_reach(self):
        axis = np.array([0.6, 0.0, 0.8])
        for seed in range(5):
            rng = np.random.default_rng(seed)
            spin = Rotation.from_rotvec(rng.uniform(-1.2, 1.2, 600)[:, None] * axis).as_matrix()
            arms = np.array([[0.0, 0.3, 0.0], [0.08, 0.2, -0.06]]) + 0.2 * axis
            points = CENTRE + np.einsum("fij,mj->fmi", spin, arms)
            noisy = points + 0.001 * rng.standard_normal(points.shape)
            found = fit_centre(noisy, 0.001, 0.001, EXACT)
            # How far the markers are from the frame's origin is all that bounds it.
            reach = np.sqrt((points.mean(axis=0) ** 2).sum(axis=1).mean())
            assert np.sqrt(axis @ found.covariance @ axis) == pytest.approx(reach, rel=0.05)

    def test_a_joint_in_a_frame_on_one_marker_is_limited(self):
        points = on_sphere(1.0, 500, np.random.default_rng(18), 0.001)
        free = fit_centre(points, 0.001, 0.001, EXACT)
        assert free.shown == "yes"
        for limit in ("weak", "no"):
            frame = Frame(None, limit, "stands on one marker")
            found = fit_centre(points, 0.001, 0.001, frame)
            assert (found.shown, found.reason) == (limit, "stands on one marker")
            np.testing.assert_array_equal(found.centre, free.centre)
        # A worse verdict of its own comes first.
        still = CENTRE + 0.001 * np.random.default_rng(19).standard_normal((500, 1, 3))
        found = fit_centre(still, 0.001, 0.001, Frame(None, "weak", "stands on one marker"))
        assert found.shown == "no"
        assert found.reason != "stands on one marker"


def test_an_unfitted_joint_is_all_nan_and_says_why():
    joint = unfitted("Knee", "Thigh", "Shank", 7, "no marker on Shank")
    assert not joint.fitted
    assert (joint.shown, joint.reason, joint.samples) == ("no", "no marker on Shank", 0)
    assert joint.track.shape == (7, 3) and np.isnan(joint.track).all()
    assert np.isnan(joint.standard_error).all()
    assert isinstance(replace(joint, centre=np.zeros(3)), JointFit)


def test_the_safe_error_is_that_of_the_documents():
    assert SAFE_ERROR == 0.01


class TestMarkersOfDifferentNoise:
    """Radii of 20 and 40 cm, a cap of 60°; the fit weighs them alike unless it is told not to."""

    @pytest.mark.parametrize("each", [False, True])
    def test_the_standard_error_is_that_of_the_fit_that_was_made(self, each):
        quiet, loud, trials = 0.001, 0.005, 200
        rng = np.random.default_rng(77)
        centres, errors = [], []
        for _ in range(trials):
            points = np.concatenate(
                [
                    on_sphere(np.pi / 3, 500, rng, quiet),
                    2 * on_sphere(np.pi / 3, 500, rng, loud / 2) - CENTRE,
                ],
                axis=1,
            )
            found = fit_centre(points, quiet, quiet, Frame(None), each=each)
            centres.append(found.centre)
            errors.append(found.covariance)
        seen = np.cov(np.array(centres).T)
        told = np.mean(errors, axis=0)
        worst = np.linalg.eigh(seen)[1][:, -1]
        # A variance from T trials is known to √(2 / T) of itself; four of that.
        assert worst @ seen @ worst == pytest.approx(
            worst @ told @ worst, rel=4 * np.sqrt(2 / trials)
        )

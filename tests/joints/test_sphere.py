"""The sphere step: the noise that is taken away, the error of what was solved, and the names of fits."""

from dataclasses import replace

import numpy as np
import pytest
from centres import CENTRE, RADIUS, cap, frame_on, on_sphere, sphere_of

from mocap_skel.joints.choices import Estimation
from mocap_skel.joints.samples import Frame, JointSamples
from mocap_skel.joints.sphere import fit_markers, noise_of_each
from mocap_skel.spherefit import marker_noise


def quiet_and_loud(rng, quiet=0.001, loud=0.005, count=3000):
    """Two markers of different noise, radii of 40 cm: (count, 2, 3)."""
    return np.concatenate(
        [on_sphere(1.2, count, rng, quiet), on_sphere(1.2, count, rng, loud)], axis=1
    )


class TestNoiseOfEach:
    def test_it_is_the_markers_own_and_weighs_their_samples(self):
        points = quiet_and_loud(np.random.default_rng(0))
        sphere = sphere_of(points, 0.001, each=True)
        found = noise_of_each(sphere.evidence)
        # A standard deviation of 3000 is known to 1/√6000; five of it.
        chance = 5 / np.sqrt(6000)
        own = 0.001 * np.sqrt(np.trace(found.shape, axis1=1, axis2=2) / 3)
        assert own == pytest.approx([0.001, 0.005], rel=chance)
        assert found.weights == pytest.approx([1, 1 / 25], rel=3 * chance)
        # What is said of the fit is the mean of the squares.
        assert float(sphere.fit.sigma) == pytest.approx(0.001 * np.sqrt(13), rel=0.1)

    def test_it_makes_the_centre_better(self):
        """Weighed alike, the loud marker decides: variances 25 + 1 over 4 against 1 / (1 + 1 / 25)."""
        rng = np.random.default_rng(1)
        errors = {True: [], False: []}
        for _ in range(100):
            points = quiet_and_loud(rng, count=200)
            for each, found in errors.items():
                found.append(sphere_of(points, 0.001, each=each).fit.centre - CENTRE)
        alike, weighed = (np.mean(np.square(errors[each])) for each in (False, True))
        # Means of 300 squares: √(2/300) = 8 % each, four of which together are half.
        assert alike / weighed == pytest.approx(26 / 4 * (1 + 1 / 25), rel=0.5)

    @pytest.mark.parametrize(
        ("share", "left"), [(0.0, 1.0), (0.75, 0.25), (1.0, 0.01), (2.0, 0.01)]
    )
    def test_what_the_frame_explains_is_not_the_markers(self, share, left):
        """And a hundredth of the variance is left to it, whatever the frame explains."""
        points = on_sphere(1.2, 500, np.random.default_rng(2), 0.004)
        seen = JointSamples(points, 0.001, 0.001, Frame(None)).evidence()
        whole = marker_noise(seen.moments).sigma[0]
        frame = share * (whole / 0.001) ** 2 * np.eye(3)[None]
        found = noise_of_each(replace(seen, leverage=frame))
        # Both are taken away.
        assert 0.001**2 * found.shape[0] == pytest.approx(
            (left + share) * whole**2 * np.eye(3), rel=1e-9
        )
        assert found.level == pytest.approx(np.sqrt(left) * whole / 0.001)


class TestError:
    def test_it_is_that_of_the_linear_system_by_hand(self):
        """A⁻¹ B A⁻¹ with A = Σ W C and B = Σ W² r² σ² C / N: two markers, of 200 and 800 samples."""
        rng = np.random.default_rng(3)
        points = on_sphere(1.0, 800, rng, 0.002, markers=2)
        points[200:, 0] = np.nan
        sphere = sphere_of(points, 0.002)
        seen, counts = sphere.evidence, np.array([200, 800])
        moved = seen.moments.covariance - 0.002**2 * np.eye(3)
        weights = counts - 1.0
        a = np.einsum("p,pij->ij", weights, moved)
        variance = np.maximum(
            np.nanvar(np.linalg.norm(points - sphere.fit.centre, axis=-1), axis=0), 0.002**2
        )
        cost = (weights * sphere.fit.radius) ** 2 * variance / seen.effective
        b = np.einsum("p,pij->ij", cost, moved)
        law = np.linalg.solve(a, np.linalg.solve(a, b).T)
        # Variances from moments are of first order in σ/r; the reach of 0.5 m adds nothing to 0.1 mm.
        assert sphere.covariance(shown=True) == pytest.approx(law, rel=0.02, abs=0.02 * law.max())

    def test_noise_that_was_measured_is_the_least_there_is(self):
        """Exact points, noise of 1 mm: N C / (r σ)²."""
        points = on_sphere(1.0, 500, np.random.default_rng(4))
        sphere = sphere_of(points, 0.001, own=0.0)
        known = sphere.evidence.effective[0] * sphere.evidence.moments.covariance[0]
        np.testing.assert_allclose(
            np.linalg.inv(sphere.covariance(shown=True)), known / (RADIUS * 0.001) ** 2, rtol=2e-3,
            atol=1e-3 * known.max() / (RADIUS * 0.001) ** 2,
        )  # fmt: skip

    def test_what_noise_at_rest_spreads_is_no_movement(self):
        """Along the axis of a narrow cap the spread is 16 mm; 10 mm of it at rest leave √(16² - 10²)."""
        points = on_sphere(np.radians(30), 500, np.random.default_rng(5), 0.0005)
        sphere = sphere_of(points, 0.0005)
        still = replace(sphere.evidence, still=0.01**2 * np.eye(3)[None])
        less = replace(sphere, seen=replace(sphere.seen, own=still))
        along = [s.covariance(shown=True)[2, 2] for s in (sphere, less)]
        spread = sphere.weakest_sd**2
        assert along[1] / along[0] == pytest.approx(spread / (spread - 0.01**2), rel=0.02)

    def test_a_radius_that_is_not_shown_is_no_nearer_than_the_reach(self):
        points = on_sphere(1.0, 500, np.random.default_rng(6), 0.001) - CENTRE + [0.0, 0.0, 2.0]
        sphere = sphere_of(points, 0.001)
        reach = np.linalg.norm(points.mean(axis=0))
        ratio = sphere.covariance(shown=False) / sphere.covariance(shown=True)
        assert reach > 4 * RADIUS
        np.testing.assert_allclose(np.diag(ratio), (reach / sphere.fit.radius[0]) ** 2, rtol=1e-3)

    def test_mle_weighs_distances_and_not_their_squares(self):
        sphere = sphere_of(
            on_sphere(1.0, 100, np.random.default_rng(7), 0.001, markers=2), method="mle"
        )
        assert sphere.weights * sphere.fit.radius**2 == pytest.approx([1, 1])
        assert sphere.fit.radius == pytest.approx([RADIUS, 1.2 * RADIUS], rel=0.01)


def test_the_frames_skew_is_taken_off_the_third_moment():
    """The centre follows ½ (C - N)⁻¹ S: with less of S it comes nearer by that."""
    points = on_sphere(1.0, 400, np.random.default_rng(8), 0.001)
    sphere = sphere_of(points, 0.001)
    skew = np.array([[0.0, 30.0, 0.0]])
    plain = sphere.seen
    skewed = replace(plain, own=replace(plain.own, skew=skew))
    other = fit_markers(skewed, Estimation())
    system = plain.own.moments.covariance[0] - float(sphere.fit.sigma) ** 2 * np.eye(3)
    law = -0.5 * np.linalg.solve(system, float(sphere.fit.sigma) ** 2 * skew[0])
    # The level that the points allow changes with it, to second order.
    size = np.linalg.norm(law)
    np.testing.assert_allclose(other.fit.centre - sphere.fit.centre, law, rtol=0, atol=0.05 * size)
    assert size > 1e-4


class TestAxis:
    def test_without_a_hinge_it_is_most_square_to_the_lines_to_the_markers(self):
        """A cap that is wide along x and narrow along y, about z: y."""
        rays = cap(1.0, 500, axis=(0.0, 0.0, 1.0)) * [1.0, 0.3, 1.0]
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        sphere = sphere_of((CENTRE + RADIUS * rays)[:, None], own=0.001)
        assert not sphere.hinge
        assert abs(sphere.axis[1]) > 0.999

    @pytest.mark.parametrize(
        ("method", "markers", "name"),
        [("best", 1, "UGDK"), ("mgdk", 1, "UGDK"), ("ugdk", 2, "MGDK"), ("gdke", 2, "GDKE")],
    )
    def test_a_fit_is_called_by_its_markers(self, method, markers, name):
        points = on_sphere(1.0, 100, np.random.default_rng(9), 0.001, markers=markers)
        assert sphere_of(points, 0.001, frame_on(), method=method).name == name

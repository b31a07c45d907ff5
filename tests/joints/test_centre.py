"""One joint's centre and the evidence for it, against points made on spheres of known cap and noise.

Tolerances are standard deviations of what is compared, four or five of them; each test says which.
"""

import numpy as np
import pytest
from centres import CENTRE, RADIUS, TEMPLATE, cap, centre_of, frame_on, on_sphere
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

LAWS = settings(derandomize=True, deadline=None, max_examples=15, database=None)


class TestEvidence:
    @pytest.mark.parametrize("degrees", [20, 45, 90, 150])
    def test_a_cap_is_told_by_its_half_angle(self, degrees):
        theta = np.radians(degrees)
        points = CENTRE + RADIUS * cap(theta, 4000)[:, None]
        found = centre_of(points, 0.0)
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
        found = centre_of(on_sphere(1.0, 500, np.random.default_rng(1), markers=2), 0)
        np.testing.assert_allclose(found.centre, CENTRE, rtol=0, atol=1e-12)
        np.testing.assert_allclose(found.radius, [RADIUS, 1.2 * RADIUS], rtol=0, atol=1e-12)
        assert (found.samples, found.method) == (1000, "MGDK")

    @pytest.mark.parametrize("sigma", [0.0005, 0.002, 0.005])
    def test_the_residual_is_the_noise(self, sigma):
        count = 3000
        points = on_sphere(1.2, count, np.random.default_rng(2), sigma)
        found = centre_of(points, sigma)
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
        found = centre_of(points, 0.02)
        assert found.sigma == pytest.approx(0.001, rel=5 / np.sqrt(2 * 1000))

    def test_missing_samples_are_left_out(self):
        rng = np.random.default_rng(4)
        points = on_sphere(1.0, 400, rng, 0.001, markers=2)
        points[rng.random((400, 2)) < 0.3] = np.nan
        found = centre_of(points, 0.001)
        assert found.samples == np.isfinite(points[..., 0]).sum()
        error = found.centre - CENTRE
        # χ² of three degrees of freedom is below 21.1 in 99.99 % of all cases.
        assert error @ np.linalg.solve(found.covariance, error) <= 21.1

    def test_too_few_samples_show_nothing(self):
        points = on_sphere(1.0, 10, np.random.default_rng(5))
        assert centre_of(points[:3], 0.0) is None
        assert centre_of(np.full((10, 2, 3), np.nan), 0.0) is None

    def test_a_marker_that_is_never_seen_changes_nothing(self):
        points = on_sphere(1.0, 400, np.random.default_rng(6), 0.001, markers=2)
        alone = centre_of(points, 0.001, frame_on())
        never = np.full((400, 1, 3), np.nan)
        more = centre_of(np.concatenate([points, never], axis=1), 0.001, frame_on())
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
        a = centre_of(points, 0.001, frame_on())
        b = centre_of(points @ turn.T, 0.001, frame_on(lever))
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
        found = [centre_of(on_sphere(1.0, 200, rng, sigma, markers=2), sigma) for _ in range(runs)]
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
                    np.trace(centre_of(on_sphere(1.0, count, rng, sigma), sigma).covariance)
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
        once = centre_of(points, sigma)
        again = centre_of(np.repeat(points, times, axis=0), sigma)
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
        found = centre_of(points[:, None], sigma)
        # First-order noise: 1 + 2 Σ memory^k = (1 + memory) / (1 - memory) frames a sample. Such a sum
        # over M lags is known to √(2 (2M + 1) / N) (Sokal 1997), for its first zero at seven of
        # these times 8 and 18 %; two of it.
        time = (1 + memory) / (1 - memory)
        chance = np.sqrt(2 * (2 * 7 * time + 1) / count)
        assert found.effective == pytest.approx(count / time, rel=2 * chance)


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
            found = centre_of(points, quiet, each=each)
            centres.append(found.centre)
            errors.append(found.covariance)
        seen = np.cov(np.array(centres).T)
        told = np.mean(errors, axis=0)
        worst = np.linalg.eigh(seen)[1][:, -1]
        # A variance from T trials is known to √(2 / T) of itself; four of that.
        assert worst @ seen @ worst == pytest.approx(
            worst @ told @ worst, rel=4 * np.sqrt(2 / trials)
        )

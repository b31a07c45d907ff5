"""How well a centre can be known: coverage, the criterion, Cramér-Rao bounds, effective samples.

The bounds are compared with the Fisher information itself. A point at the unit direction u from the
centre has the radial residual |x - c| - r, whose derivative by (c, r) is -(u, 1): N of them spread
evenly have the information N ⟨(u, 1)(u, 1)ᵀ⟩ / σ², a mean that quadrature gives to rounding.
"""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from spheres import EPS, LAWS, arc, bound, cap, cap_law, even_cap, fisher_bound, markers_on_spheres

from mocap_skel.spherefit import (
    centre_covariance,
    common_markers,
    coverage_angle,
    crlb_circle,
    crlb_sphere,
    effective_counts,
    gdke,
    largest_noise,
    pratt,
    sphere_moments,
)

# Coverage and the criterion


@pytest.mark.parametrize("degrees", [1, 10, 45, 90, 135, 179, 180])
def test_coverage_angle_inverts_the_spread_of_a_uniform_cap(degrees):
    _, variance = cap_law(degrees)
    radius = 0.3
    angle = coverage_angle(radius * np.sqrt(variance), radius)
    # The arcsine near 1 turns rounding into its root.
    assert np.degrees(angle) == pytest.approx(degrees, rel=1e-12, abs=1e-5 if degrees > 170 else 0)


def test_coverage_angle_stays_in_its_range():
    np.testing.assert_array_equal(
        coverage_angle([0.0, 1.0, 0.1], [1.0, 1.0, 0.0]), [0, np.pi, np.pi]
    )


def test_coverage_angle_of_points_is_their_half_angle():
    m = sphere_moments(cap(np.random.default_rng(31), (20, 4000), 60, 0.2))[:, None]
    fit = gdke(m)
    angle = np.degrees(coverage_angle(np.sqrt(fit.spread[:, 0]), fit.radius[:, 0]))
    # θ is as the fourth root of λ, whose relative standard deviation for a uniform height (kurtosis
    # 1.8) is √(0.8/N); tan(θ/2)·2 turns a relative error of sin² to one of θ.
    error = np.degrees(np.tan(np.pi / 6)) * 0.5 * np.sqrt(0.8 / 4000)
    assert np.abs(angle - 60).max() <= 4 * error


@given(degrees=st.floats(1, 170), radius=st.floats(1e-3, 1e3))
@LAWS
def test_the_largest_noise_is_that_whose_coverage_is_the_angle(degrees, radius):
    theta = np.radians(degrees)
    noise = largest_noise(radius, theta)
    # The sine of 85° turns a relative rounding into one of the angle by its tangent, 11.
    assert coverage_angle(noise, radius) == pytest.approx(theta, rel=16 * EPS)
    assert largest_noise(radius, coverage_angle(noise, radius)) == pytest.approx(
        noise, rel=16 * EPS
    )


@pytest.mark.parametrize("degrees", [5, 45, 90, 135, 180])
def test_the_largest_noise_is_the_weakest_standard_deviation_of_an_even_cap(degrees):
    radius = 0.3
    weakest = np.sqrt(np.linalg.eigvalsh(np.cov(radius * even_cap(degrees).T))[0])
    # The even cap's heights have a variance short of the uniform one's by 1/rings²; N - 1 of N.
    assert largest_noise(radius, np.radians(degrees)) == pytest.approx(
        weakest, rel=1 / 200**2 + 1 / 200**2
    )


def test_the_largest_noise_of_several_joints_is_each_ones_own():
    got = largest_noise([[0.1], [0.4]], [np.pi, np.pi / 2, 0.0])
    expected = np.outer([0.1, 0.4], [1, 0.5, 0]) / np.sqrt(3)
    np.testing.assert_allclose(got, expected, rtol=4 * EPS)


# Cramér-Rao bounds of even caps and arcs


def inverse(information):
    """An inverse and its error: that of the information, times its condition.

    A mean of 24 x 24 products is rounded to √576 ulps.
    """
    found = np.linalg.inv(information)
    return found, 24 * EPS * np.linalg.cond(information) * np.linalg.norm(found, 2)


def sphere_information(theta):
    """⟨(u, 1)(u, 1)ᵀ⟩ over a cap about z, by Gauss and Legendre in height, evenly in longitude."""
    node, weight = np.polynomial.legendre.leggauss(24)
    z = np.cos(theta) + (node + 1) / 2 * (1 - np.cos(theta))
    turn = 2 * np.pi * np.arange(24) / 24
    z, turn = np.meshgrid(z, turn, indexing="ij")
    side = np.sqrt(np.maximum(1 - z**2, 0.0))
    row = np.stack([side * np.cos(turn), side * np.sin(turn), z, np.ones_like(z)])
    return np.einsum("iab,jab,a->ij", row, row, weight / 2 / 24)


def circle_information(theta):
    """⟨(u, 1)(u, 1)ᵀ⟩ over an arc about the second axis; its ends, ± θ, are where the points end."""
    node, weight = np.polynomial.legendre.leggauss(32)
    row = np.stack([np.sin(theta * node), np.cos(theta * node), np.ones_like(node)])
    return np.einsum("ia,ja,a->ij", row, row, weight / 2)


BOUNDS = {
    "circle": (crlb_circle, circle_information),
    "sphere": (crlb_sphere, sphere_information),
}


@pytest.mark.parametrize("theta", [0.3, 0.5, 1.0, 1.2, np.pi / 2, 2.0, 2.5, 3.0, np.pi])
@pytest.mark.parametrize("name", BOUNDS)
def test_the_bounds_are_the_inverse_of_the_fisher_information(name, theta):
    crlb, information = BOUNDS[name]
    count, sigma = 250, 0.002
    expected, error = inverse(information(theta) * count / sigma**2)
    np.testing.assert_allclose(crlb(count, sigma, theta), expected, rtol=0, atol=error)


@pytest.mark.parametrize("name", BOUNDS)
@given(theta=st.floats(0.3, np.pi), count=st.integers(4, 10**6), sigma=st.floats(1e-6, 1.0))
@LAWS
def test_the_bounds_are_so_at_every_angle_count_and_noise(name, theta, count, sigma):
    crlb, information = BOUNDS[name]
    expected, error = inverse(information(theta) * count / sigma**2)
    got = crlb(count, sigma, theta)
    np.testing.assert_allclose(got, expected, rtol=0, atol=error)
    np.testing.assert_array_equal(got, got.T)


@pytest.mark.parametrize(("name", "size"), [("circle", 3), ("sphere", 4)])
def test_the_bounds_of_a_batch_are_each_members_own(name, size):
    crlb, _ = BOUNDS[name]
    counts, sigmas = np.array([[10], [1000]]), np.array([0.1, 0.2, 0.3])
    thetas = np.array([0.01, 1.0, 3.0])
    got = crlb(counts, sigmas, thetas)
    assert got.shape == (2, 3, size, size)
    for i in range(2):
        for j in range(3):
            one = crlb(counts[i, 0], sigmas[j], thetas[j])
            assert one.shape == (size, size)
            np.testing.assert_allclose(got[i, j], one, rtol=8 * EPS)
    assert crlb(counts, 0.1, 1.0).shape == (2, 1, size, size)


@pytest.mark.parametrize("degrees", [5, 45, 135])
def test_the_sphere_s_bound_is_the_matrix_that_the_thesis_prints(degrees):
    got = crlb_sphere(400, 0.01, np.radians(degrees))
    variance = bound(0.01, degrees, 400) ** 2
    np.testing.assert_allclose(np.diag(got)[:3], variance, rtol=16 * EPS)
    # Centre along the axis and radius make up for each other: with θ → 0 entirely so.
    correlation = got[2, 3] / np.sqrt(got[2, 2] * got[3, 3])
    assert -1 < correlation < 0


def test_a_whole_sphere_and_a_whole_circle_know_their_centre_equally_well_in_all_directions():
    sphere, circle = crlb_sphere(100, 0.1, np.pi), crlb_circle(100, 0.1, np.pi)
    # ⟨u uᵀ⟩ is I / D and ⟨u⟩ zero. The sine of the nearest number to π is its rounding.
    np.testing.assert_allclose(sphere, np.diag([3, 3, 3, 1]) * 1e-4, rtol=0, atol=16 * EPS * 1e-4)
    np.testing.assert_allclose(circle, np.diag([2, 2, 1]) * 1e-4, rtol=0, atol=16 * EPS * 1e-4)


def exact_sine_and_cosine(theta):
    """Of a floating-point number, as fractions: 30 terms of the series, below 1e-40 for 3 rad."""
    x = Fraction(theta)
    term, terms = Fraction(1), []
    for k in range(1, 61):
        terms.append(term)
        term = term * x / k
    cosine = sum((-1) ** k * t for k, t in enumerate(terms[::2]))
    sine = sum((-1) ** k * t for k, t in enumerate(terms[1::2]))
    return sine, cosine


def exact_circle(theta):
    """The thesis's matrix for N = σ = 1, in fractions, rounded at the end."""
    s, c = exact_sine_and_cosine(theta)
    t = Fraction(theta)
    below = 2 * t * (t + c * s) - 4 * s * s
    rows = [[below / (t - c * s), 0, 0], [0, 2 * t, -2 * s], [0, -2 * s, t + c * s]]
    return np.array([[float(2 * t / below * v) for v in row] for row in rows])


def circle_error(theta):
    """Relative error of the circle's bound in double precision.

    2θ (θ + cos θ sin θ) and 4 sin² θ are both x² for small x = 2θ, rounded to eps, and x⁶/720 apart.
    Below x = 0.1 a series takes over, which must be no worse than the difference is there.
    """
    x = max(2 * theta, 0.1)
    return 16 * EPS + 2 * EPS * 720 / x**4


@pytest.mark.parametrize(
    "theta", [1e-6, 1e-3, 0.01, 0.03, 0.049999, 0.05, 0.050001, 0.06, 0.1, 0.2, 0.5, 1, 2, 3]
)
def test_the_bound_of_a_short_arc_is_that_of_exact_arithmetic(theta):
    got, expected = crlb_circle(1, 1.0, theta), exact_circle(theta)
    np.testing.assert_allclose(got, expected, rtol=circle_error(theta))


@given(theta=st.floats(1e-5, 1.0))
@LAWS
def test_the_bound_of_an_arc_is_that_of_exact_arithmetic_at_every_angle(theta):
    got, expected = crlb_circle(1, 1.0, theta), exact_circle(theta)
    np.testing.assert_allclose(got, expected, rtol=circle_error(theta))


def test_the_bound_of_an_arc_has_no_step_where_a_series_takes_over():
    # Over steps of a millionth its logarithm is a straight line, to the square of a millionth. Four
    # terms of a second difference are rounded.
    theta = 0.05 * (1 + 1e-6 * np.arange(-5, 6))
    along = np.log(crlb_circle(1, 1.0, theta)[:, 1, 1])
    assert np.abs(np.diff(along, 2)).max() <= 4 * circle_error(0.05)
    # And smaller angles only ever know less.
    wide = np.linspace(0.001, np.pi, 1000)
    for crlb in (crlb_circle, crlb_sphere):
        assert (np.diff(np.trace(crlb(1, 1.0, wide), axis1=1, axis2=2)) < 0).all()


@pytest.mark.parametrize("crlb", [crlb_circle, crlb_sphere])
@pytest.mark.parametrize(
    "angle", [0.0, -0.5, np.nextafter(np.pi, 4), 180.0, np.nan, np.inf, [1.0, 0.0], [[1.0], [-1.0]]]
)
def test_an_angle_that_is_no_half_angle_is_an_error(crlb, angle):
    with pytest.raises(ValueError, match=r"in \(0, π\] radians, got"):
        crlb(100, 0.1, angle)


@pytest.mark.parametrize("degrees", [45, 90, 180])
def test_circles_of_pratts_reach_their_bound(degrees):
    trials, count, sigma = 1000, 500, 0.01
    rng = np.random.default_rng(51)
    x = arc(rng, (trials, count), degrees)[..., :2]  # its middle is along x
    x = x + sigma * rng.normal(size=x.shape)
    fit = pratt(sphere_moments(x)[:, None])
    law = np.sqrt(np.diag(crlb_circle(count, sigma, np.radians(degrees))))
    spread = [fit.centre[:, 1].std(), fit.centre[:, 0].std(), fit.radius[:, 0].std()]
    # A standard deviation is known to 1/√(2T); the bound is that of the first order in σ, here
    # beside the arc's weakest standard deviation, and holds to 1/N.
    weakest = np.sqrt(gdke(sphere_moments(x)[:, None]).spread[:, 0].mean())
    tolerance = 4 / np.sqrt(2 * trials) + (sigma / weakest) ** 2 + 4 / count
    assert (np.abs(spread / law - 1) <= tolerance).all()


@pytest.mark.parametrize("degrees", [60, 120])
def test_radii_of_pratts_reach_their_bound_and_make_up_for_the_centre(degrees):
    trials, count, sigma = 1000, 500, 0.01
    rng = np.random.default_rng(52)
    x = cap(rng, (trials, count), degrees) + sigma * rng.normal(size=(trials, count, 3))
    fit = pratt(sphere_moments(x)[:, None])
    law = crlb_sphere(count, sigma, np.radians(degrees))
    parameters = np.column_stack([fit.centre, fit.radius])
    got = np.cov(parameters.T)
    # An entry of a sample covariance varies by √((s_ii s_jj + s_ij²) / T), s the true one.
    diagonal = np.diag(law)
    error = np.sqrt((np.outer(diagonal, diagonal) + law**2) / trials)
    second = (
        2 * (sigma**2 / cap_law(degrees)[1] + 4 / count) * np.sqrt(np.outer(diagonal, diagonal))
    )
    assert (np.abs(got - law) <= 4 * error + second).all()


# The bound of measured points


@pytest.mark.parametrize("degrees", [20, 45, 90, 135, 180])
def test_centre_covariance_is_the_thesis_bound_for_a_uniform_cap(degrees):
    x, sigma, radius = even_cap(degrees), 0.002, 0.3
    m = sphere_moments(radius * x[None])
    got = centre_covariance(m.covariance, m.count, np.array([radius]), np.array([sigma**2]), 1e6)
    # The even cap has a variance of height short of the uniform one's by a share of 1/rings².
    half = bound(sigma, degrees, len(x)) ** 2
    np.testing.assert_allclose(
        got, np.diag(half), rtol=2 / 200**2 + 2 / len(x), atol=1e-12 * half[2]
    )


@pytest.mark.parametrize("counts", [(30,), (30, 200), (500, 500, 500)])
@pytest.mark.parametrize("degrees", [20, 60, 150])
def test_centre_covariance_is_the_inverse_fisher_information(counts, degrees):
    points, m = markers_on_spheres(np.random.default_rng(32), counts, 0.0, degrees)
    sigma = 0.001 * (1 + np.arange(len(counts)))
    radius = 0.1 + 0.1 * np.arange(len(counts))
    # Exactly so where N C is the sum of squares; C is divided by N - 1.
    got = centre_covariance(m.covariance, m.count - 1, radius, sigma**2, 1e6)
    exact = fisher_bound(points, sigma)
    np.testing.assert_allclose(got, exact, rtol=0, atol=1e-9 * np.trace(exact))
    full = centre_covariance(m.covariance, m.count, radius, sigma**2, 1e6)
    ratio = np.trace(full) / np.trace(exact)
    assert 1 - 1 / min(counts) - 1e-9 <= ratio < 1


def test_a_known_radius_would_say_more_about_the_centre():
    # The bound is that of unknown radii: on a small cap, centre and radius go together.
    x = even_cap(20)
    sigma = 0.01
    known = np.linalg.inv(x.T @ x / sigma**2)
    m = sphere_moments(x[None])
    free = centre_covariance(m.covariance, m.count, np.ones(1), np.array([sigma**2]), 1e6)
    # Across the axis both are the same, but that C is divided by N - 1.
    assert np.linalg.eigvalsh(free - known)[0] >= -2 * known.trace() / len(x)
    half = np.sin(np.radians(10)) ** 2
    # ⟨cos²⟩ of the cap over its variance, (1 - h)² + h²/3 over h²/3.
    law = ((1 - half) ** 2 + half**2 / 3) / (half**2 / 3)
    assert free[2, 2] / known[2, 2] == pytest.approx(law, rel=1e-3)


def test_nothing_is_known_beyond_reach_in_a_direction_not_shown():
    flat = np.diag([0.01, 0.01, 0.0])[None]
    got = centre_covariance(flat, np.array([1000.0]), np.array([0.2]), np.array([1e-6]), 0.4)
    assert got[2, 2] == pytest.approx(0.16, rel=4 * EPS)
    assert got[0, 0] == pytest.approx(0.2**2 * 1e-6 / (1000 * 0.01), rel=1e-4)
    none = centre_covariance(flat, np.zeros(1), np.array([0.2]), np.array([1e-6]), 0.4)
    np.testing.assert_allclose(none, 0.16 * np.eye(3), rtol=1e-12)


def test_weights_that_markers_do_not_deserve_cost_what_the_sandwich_says():
    """A⁻¹ B A⁻¹ of the system that was solved, and no more than reach where neither shows anything."""
    rng = np.random.default_rng(34)
    half = rng.normal(size=(2, 3, 3))
    covariance = half @ half.swapaxes(1, 2)
    counts, radius, noise = np.array([50.0, 200.0]), np.array([0.1, 0.3]), np.array([1e-6, 9e-6])
    weights = np.array([1.0, 3.0])
    a = np.einsum("p,pde->de", weights, covariance)
    b = np.einsum("p,pde->de", weights**2 * radius**2 * noise / counts, covariance)
    got = centre_covariance(covariance, counts, radius, noise, 1e6, weights)
    expected = np.linalg.inv(a) @ b @ np.linalg.inv(a)
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-9 * np.trace(expected))
    # Only ratios count, and those that are deserved are what there is without weights.
    same = centre_covariance(covariance, counts, radius, noise, 1e6, 7 * weights)
    np.testing.assert_allclose(same, got, rtol=0, atol=1e-9 * np.trace(got))
    deserved = counts / (radius**2 * noise)
    best = centre_covariance(covariance, counts, radius, noise, 1e6)
    told = centre_covariance(covariance, counts, radius, noise, 1e6, deserved)
    np.testing.assert_allclose(told, best, rtol=0, atol=1e-9 * np.trace(best))
    assert np.trace(best) < np.trace(got)
    # A hinge: in its plane the same law, along its axis the reach.
    flat = covariance.copy()
    flat[:, 2], flat[:, :, 2] = 0.0, 0.0
    got = centre_covariance(flat, counts, radius, noise, 0.4, weights)
    plane = np.linalg.inv(a[:2, :2]) @ b[:2, :2] @ np.linalg.inv(a[:2, :2])
    np.testing.assert_allclose(got[:2, :2], plane, rtol=0, atol=1e-3 * np.trace(plane))
    assert got[2, 2] == pytest.approx(0.16, rel=1e-9)


# Effective samples


def ar1(rng, phi, frames, series):
    """Autoregressive series (frames, series) in their steady state."""
    shocks = rng.normal(size=(frames, series))
    shocks[0] /= np.sqrt(1 - phi**2)
    rows = [shocks[0]]
    for shock in shocks[1:]:
        rows.append(phi * rows[-1] + shock)
    return np.array(rows)


@pytest.mark.parametrize("gaps", [0.0, 0.3])
@pytest.mark.parametrize("phi", [0.0, 0.5, 0.9])
def test_effective_counts_follow_the_memory_of_the_noise(phi, gaps):
    rng = np.random.default_rng(33)
    frames, series = 4000, 50
    x = ar1(rng, phi, frames, series)
    x[rng.random(x.shape) < gaps] = np.nan
    got = effective_counts(x + 0.01)
    seen = np.isfinite(x).sum(axis=0)
    time = (1 + phi) / (1 - phi)
    # Sokal 1997: an autocorrelation time summed over W lags is known to √((4 W + 2) / N); the sum
    # to the first zero of the estimate runs over some three times the memory. Gaps cost pairs.
    window = 3 * time
    error = np.sqrt((4 * window + 2) / frames) / (1 - gaps)
    assert (np.abs(got / (seen / time) - 1) <= 4 * error).all()
    # A sum that stops at the first zero runs on by chance: the mean is off by some of that error.
    assert abs(got.mean() / (seen / time).mean() - 1) <= error
    assert (got <= seen).all()


@pytest.mark.parametrize("frames", [3, 20, 64, 65, 300])
@pytest.mark.parametrize("gaps", [0.0, 0.3])
def test_effective_counts_are_the_direct_sum_of_autocorrelations(frames, gaps):
    rng = np.random.default_rng(41)
    x = ar1(rng, 0.8, frames, 30) + np.linspace(0, 2, frames)[:, None]
    x[rng.random(x.shape) < gaps] = np.nan
    for series, got in zip(x.T, effective_counts(x), strict=True):
        n = np.isfinite(series).sum()
        e = series - np.nanmean(series) if n else series
        time, variance = 1.0, np.nanmean(e**2) if n else 0.0
        for lag in range(1, max(frames // 10, 2)):
            products = e[lag:] * e[:-lag]
            if not np.isfinite(products).any() or not np.nanmean(products) > 1e-12 * variance:
                break
            time += 2 * np.nanmean(products) / variance
        # Rounding of a Fourier transform of 300 numbers.
        assert got == pytest.approx(np.clip(n / time, min(n, 1), n), rel=1e-10)


def test_effective_counts_of_series_without_information():
    x = np.zeros((100, 4))
    x[:, 1] = np.nan
    x[:99, 2] = np.nan
    x[50:, 3] = np.nan
    np.testing.assert_array_equal(effective_counts(x), [100, 0, 1, 50])
    np.testing.assert_array_equal(effective_counts(np.full((2, 1), 0.5)), [2])


def test_effective_counts_of_a_constant_do_not_depend_on_it():
    np.testing.assert_array_equal(effective_counts(np.full((100, 2), [0.5, 0.1])), [100, 100])


@pytest.mark.parametrize("frames", [0, 1])
def test_effective_counts_of_hardly_any_frames(frames):
    np.testing.assert_array_equal(effective_counts(np.zeros((frames, 2))), [frames, frames])


# Markers that share their noise


@pytest.mark.parametrize("markers", [1, 2, 5])
def test_markers_with_one_noise_tell_as_little_as_one(markers):
    rng = np.random.default_rng(6)
    noise, away = rng.normal(size=(300, 1)), rng.normal(size=(300, 1, 3))
    same = [np.repeat(part, markers, axis=1) for part in (noise, away)]
    assert common_markers(*same) == pytest.approx(markers, rel=1e-12)


def test_markers_with_noise_of_their_own_are_independent():
    rng = np.random.default_rng(7)
    noise, away = rng.normal(size=(3000, 4)), rng.normal(size=(3000, 4, 3))
    noise[::7, 1] = np.nan
    # The sum of products of independent markers, against 3000 frames of it.
    assert 1.0 <= common_markers(noise, away) < 1.0 + 4 * np.sqrt(2 / 3000)


def test_no_residuals_are_no_common_noise():
    assert common_markers(np.zeros((5, 2)), np.ones((5, 2, 3))) == 1.0

"""Every estimator through `fit_sphere`, and those that look at the points one by one: LLS, MLE, IGDK.

θ is the half-angle of the cap that the points cover. Tolerances are those of `test_spherefit`:
rounding, which a cap makes 1 / sin²(θ/2) of; four standard errors of what is random; and for the two
that solve a system of the points themselves, the condition of that system (LLS) and where
Levenberg and Marquardt's iteration stops (MLE).
"""

import inspect
import itertools
import sys

import numpy as np
import pytest
import scipy.optimize
from hypothesis import given
from hypothesis import strategies as st
from spheres import (
    DEGENERATE,
    EPS,
    LAWS,
    SEEDS,
    arc,
    assert_same,
    bound,
    cap,
    cap_law,
    direction,
    fisher_bound,
    rotation,
    rounding,
)

from mocap_skel.errors import MissingExtraError, MocapSkelError
from mocap_skel.spherefit import (
    METHODS,
    DegenerateSphereError,
    fit_sphere,
    gdke,
    igdk,
    lls,
    mgdk,
    mle,
    moments,
    pratt,
    running_centres,
    sgdk,
    sphere_moments,
    ugdk,
)

# MLE stops where the sum of squares would fall by less than this share of it.
STOP = 1e-13
# Samples that `running_centres` works on at once.
BLOCK = moments.CHUNK // 8
# sgdk has an answer to all that has two points: it leaves out what is not determined.
STRICT = tuple(name for name in METHODS if name != "sgdk")


def markers(rng, count, size, degrees=60.0, dimension=3, noise=0.0):
    """Caps (M, N, D) of radii 0.1, 0.2, ... about the origin, that look in any direction."""
    x = np.stack(
        [
            cap(rng, (size,), degrees, 0.1 + 0.1 * p, dimension) @ rotation(rng, dimension).T
            for p in range(count)
        ]
    )
    return x + noise * rng.normal(size=x.shape)


def linear_error(x):
    """Error of the linear least-squares sphere of points (M, N, D): of its unknowns, in their norm.

    For a system A y = b with condition κ and residual ρ, rounding of ε moves y by
    ε (2 κ |y| + κ² |ρ| / |A|) (Golub & Van Loan 5.3.8). N-fold sums make ε some ulps.
    """
    count = len(x)
    rows = [
        np.column_stack([2 * p, np.tile(np.eye(count)[k], (len(p), 1))]) for k, p in enumerate(x)
    ]
    system, right = np.concatenate(rows), (np.concatenate(x) ** 2).sum(axis=1)
    there = np.isfinite(right)
    system, right = system[there], right[there]
    answer = np.linalg.lstsq(system, right, rcond=None)[0]
    residual = np.linalg.norm(system @ answer - right)
    condition, size = np.linalg.cond(system), np.linalg.norm(system, 2)
    return 8 * EPS * (2 * condition * np.linalg.norm(answer) + condition**2 * residual / size)


def error(name, x, degrees=60.0, noise=0.0):
    """How far a method's centre may be from where exact arithmetic puts it, metres.

    Of points (M, N, D) on caps of noise; the largest radius counts where radii differ.
    """
    if name == "lls":
        return linear_error(x)
    distance = np.linalg.norm(np.nanmean(x, axis=(0, 1)))
    radius = 0.1 * len(x)
    plain = 4 * radius * rounding(degrees, distance, 0.1)
    if name != "mle":
        return plain
    # The sum of squares is N σ² + (c - ĉ)ᵀ (σ² CRLB⁻¹) (c - ĉ): a share STOP of it is √(STOP N)
    # standard deviations away from its minimum.
    count = x.shape[1]
    return plain + np.sqrt(STOP * count) * np.linalg.norm(bound(noise, degrees, count))


# Laws of every method


@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("dimension", [2, 3, 4])
@pytest.mark.parametrize("name", METHODS)
def test_a_perfect_sphere_is_exact(name, dimension, count):
    rng = np.random.default_rng(1)
    for degrees in (30.0, 60.0, 180.0):
        for distance in (0.0, 1.0, 10.0):
            centre = distance * direction(rng, dimension)
            x = markers(rng, count, 300, degrees, dimension) + centre
            fit = fit_sphere(x, name)
            tolerance = error(name, x, degrees)
            np.testing.assert_allclose(fit.centre, centre, rtol=0, atol=tolerance)
            # |x - c| - r is off by no more than the centre; LLS knows r² and has to be told c²,
            # which is the larger error by c / r.
            tolerance *= (1 + distance) / 0.1 if name == "lls" else 1
            radius = 0.1 + 0.1 * np.arange(count)
            np.testing.assert_allclose(fit.radius, radius, rtol=0, atol=tolerance)
            assert fit.rank == dimension and np.isnan(fit.null).all()
            assert fit.converged.all()


@pytest.mark.parametrize("name", METHODS)
def test_one_marker_may_come_without_an_axis_for_it(name):
    rng = np.random.default_rng(2)
    x = markers(rng, 1, 100, noise=0.001)
    alone, listed = fit_sphere(x[0], name), fit_sphere(x, name)
    assert alone.centre.shape == (3,) and alone.radius.shape == () and listed.radius.shape == (1,)
    np.testing.assert_array_equal(alone.centre, listed.centre)
    np.testing.assert_array_equal(alone.radius, listed.radius[0])
    # And as a list of lists.
    np.testing.assert_array_equal(fit_sphere(x[0].tolist(), name).centre, alone.centre)


@pytest.mark.parametrize("name", METHODS)
@given(seed=SEEDS, degrees=st.floats(40, 180), distance=st.floats(0, 3), count=st.integers(1, 3))
@LAWS
def test_a_rigid_motion_of_the_points_moves_the_centre(name, seed, degrees, distance, count):
    rng = np.random.default_rng(seed)
    x = markers(rng, count, 150, degrees, noise=0.001)
    turn, shift = rotation(rng), distance * direction(rng)
    moved = x @ turn.T + shift
    here, there = fit_sphere(x, name), fit_sphere(moved, name)
    tolerance = error(name, x, degrees, 0.001) + error(name, moved, degrees, 0.001)
    np.testing.assert_allclose(there.centre, turn @ here.centre + shift, rtol=0, atol=tolerance)
    tolerance *= (1 + distance) / 0.1 if name == "lls" else 1
    np.testing.assert_allclose(there.radius, here.radius, rtol=0, atol=tolerance)


@pytest.mark.parametrize("unit", [1e-3, 1e3])
@pytest.mark.parametrize("name", METHODS)
def test_a_change_of_unit_scales_everything(name, unit):
    x = markers(np.random.default_rng(3), 2, 200, noise=0.002) + 0.3
    here, there = fit_sphere(x, name), fit_sphere(unit * x, name)
    tolerance = error(name, x, noise=0.002)
    if name == "lls":
        # The column of ones keeps its unit, and the condition changes.
        tolerance += linear_error(unit * x) / unit
    np.testing.assert_allclose(there.centre, unit * here.centre, rtol=0, atol=unit * tolerance)
    tolerance *= (1 + 0.3 * np.sqrt(3)) / 0.1 if name == "lls" else 1
    np.testing.assert_allclose(there.radius, unit * here.radius, rtol=0, atol=unit * tolerance)
    # Pratt's σ² is a difference of numbers about r² σ², to relative rounding; 4e-6 m² of 0.04.
    np.testing.assert_allclose(there.sigma, unit * here.sigma, rtol=1e4 * EPS)


@pytest.mark.parametrize("name", METHODS)
@given(seed=SEEDS)
@LAWS
def test_the_order_of_markers_and_of_points_is_nothing(name, seed):
    rng = np.random.default_rng(seed)
    x = markers(rng, 3, 60, 90.0, noise=0.001)
    order = rng.permutation(3)
    one, other = fit_sphere(x, name), fit_sphere(rng.permutation(x, axis=1)[order], name)
    tolerance = error(name, x, 90.0, 0.001)
    np.testing.assert_allclose(other.centre, one.centre, rtol=0, atol=tolerance)
    tolerance *= 1 / 0.1 if name == "lls" else 1
    np.testing.assert_allclose(other.radius, one.radius[order], rtol=0, atol=tolerance)


@pytest.mark.parametrize("name", METHODS)
@given(seed=SEEDS, count=st.integers(1, 3), coordinate=st.integers(0, 2))
@LAWS
def test_a_point_with_a_nan_is_as_good_as_absent(name, seed, count, coordinate):
    rng = np.random.default_rng(seed)
    x = markers(rng, count, 60, 90.0, noise=0.001)
    # Forty gaps in other places for each marker, and the points in their order around them.
    y = rng.normal(size=(count, 100, 3))
    y[..., coordinate] = np.nan
    for p in range(count):
        y[p, np.sort(rng.choice(100, 60, replace=False))] = x[p]
    full, gaps = fit_sphere(x, name), fit_sphere(y, name)
    tolerance = error(name, x, 90.0, 0.001)
    np.testing.assert_allclose(gaps.centre, full.centre, rtol=0, atol=tolerance)
    tolerance *= 1 / 0.1 if name == "lls" else 1
    np.testing.assert_allclose(gaps.radius, full.radius, rtol=0, atol=tolerance)


@pytest.mark.parametrize("name", METHODS)
def test_markers_may_have_points_in_any_number(name):
    # 4 of one marker, 5, and 60: two know little, and the centre is exact from all of them.
    x = markers(np.random.default_rng(4), 3, 60, 90.0) + [0.5, 0.0, 0.0]
    x[0, 4:], x[1, :55] = np.nan, np.nan
    fit = fit_sphere(x, name)
    tolerance = error(name, x, 90.0)
    np.testing.assert_allclose(fit.centre, [0.5, 0.0, 0.0], rtol=0, atol=tolerance)
    tolerance *= 1.5 / 0.1 if name == "lls" else 1
    np.testing.assert_allclose(fit.radius, [0.1, 0.2, 0.3], rtol=0, atol=tolerance)


@pytest.mark.parametrize("name", [name for name in METHODS if name not in ("lls", "mle")])
def test_a_marker_that_was_never_seen_has_no_radius_and_changes_no_centre(name):
    x = markers(np.random.default_rng(5), 2, 100, noise=0.001)
    x[1] = np.nan
    fit, alone = fit_sphere(x, name), fit_sphere(x[:1], name)
    np.testing.assert_allclose(fit.centre, alone.centre, rtol=0, atol=error(name, x))
    assert np.isfinite(fit.radius[0]) and np.isnan(fit.radius[1])


@pytest.mark.parametrize("name", ["lls", "mle"])
def test_a_radius_without_a_point_is_an_unknown_without_an_equation(name):
    x = markers(np.random.default_rng(5), 2, 100, noise=0.001)
    x[1] = np.nan
    with pytest.raises(DegenerateSphereError, match="marker 1 has no point"):
        fit_sphere(x, name)


@pytest.mark.parametrize("sigma", [None, 0.0, 0.002])
def test_ugdk_of_one_marker_is_mgdk(sigma):
    x = markers(np.random.default_rng(6), 1, 100, noise=0.002)[0]
    one, other = fit_sphere(x, "ugdk", sigma=sigma), fit_sphere(x, "mgdk", sigma=sigma)
    np.testing.assert_array_equal(one.centre, other.centre)
    np.testing.assert_array_equal(one.radius, other.radius)
    np.testing.assert_array_equal(ugdk(sphere_moments(x), one.sigma).centre, one.centre)


@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("distance", [0.0, 1.0, 10.0])
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_gdke_is_lls_to_the_condition_of_its_system(count, distance, noise):
    rng = np.random.default_rng(7)
    x = markers(rng, count, 200, noise=noise) + distance * direction(rng)
    x[0, ::5] = np.nan
    one, other = fit_sphere(x, "gdke"), fit_sphere(x, "lls")
    tolerance = linear_error(x) + error("gdke", x)
    np.testing.assert_allclose(other.centre, one.centre, rtol=0, atol=tolerance)
    tolerance *= (1 + distance) / 0.1
    np.testing.assert_allclose(other.radius, one.radius, rtol=0, atol=tolerance)
    assert tolerance < 1e-6  # ten metres cost four digits of the centre, and two of the radius


def test_lls_loses_the_digits_of_the_distance_and_gdke_does_not():
    # Table 4's "loss of significant figures": squares of ten metres hold a radius of 0.1 in the
    # last of their digits.
    rng = np.random.default_rng(8)
    centre = 10.0 * direction(rng)
    x = markers(rng, 1, 200, 20.0) + centre
    lost, kept = (np.linalg.norm(fit_sphere(x, name).centre - centre) for name in ("lls", "gdke"))
    assert kept <= 0.1 * rounding(20, 10, 0.1)
    assert kept < lost <= linear_error(x)


@pytest.mark.parametrize("name", ["ugdk", "mgdk", "igdk"])
def test_a_noise_that_is_not_given_is_pratts(name):
    x = markers(np.random.default_rng(9), 2, 200, noise=0.002)
    expected = fit_sphere(x, "pratt")
    fit = fit_sphere(x, name)
    np.testing.assert_allclose(fit.centre, expected.centre, rtol=0, atol=error(name, x))
    np.testing.assert_allclose(fit.sigma, expected.sigma, rtol=4 * EPS)
    other = fit_sphere(x, name, sigma=0.004)
    np.testing.assert_allclose(
        other.centre, mgdk(sphere_moments(x), 0.004).centre, atol=error(name, x)
    )
    assert np.linalg.norm(other.centre - fit.centre) > 1e-5 and other.sigma == 0.004


@pytest.mark.parametrize("name", ["ugdk", "mgdk", "igdk"])
def test_no_noise_is_a_noise_that_is_given_and_leaves_gdke(name):
    x = markers(np.random.default_rng(45), 2, 200, noise=0.005)
    fit = fit_sphere(x, name, sigma=0.0)
    np.testing.assert_allclose(fit.centre, fit_sphere(x, "gdke").centre, atol=error(name, x))
    assert fit.sigma == 0


def test_sgdk_is_what_is_taken_without_a_name():
    x = arc(np.random.default_rng(10), (100,), 60) + 1.0
    fit = fit_sphere(x)
    assert fit.rank == 2
    np.testing.assert_allclose(np.abs(fit.null), [0, 0, 1], rtol=0, atol=rounding(60, 2, 1))
    np.testing.assert_array_equal(fit.centre, sgdk(sphere_moments(x)).centre)


def test_what_the_estimators_take_is_passed_on():
    rng = np.random.default_rng(11)
    x = markers(rng, 3, 100, noise=0.005)
    half = rng.normal(size=(3, 3, 3))
    noise = half @ half.swapaxes(1, 2) / 3
    weights = np.array([1.0, 0.2, 0.05])
    m = sphere_moments(x)
    for name, call in (("ugdk", mgdk), ("mgdk", mgdk), ("sgdk", sgdk)):
        fit = fit_sphere(x, name, sigma=0.002, noise=noise, weights=weights)
        expected = call(m, 0.002, noise, weights)
        np.testing.assert_array_equal(fit.centre, expected.centre)
        np.testing.assert_array_equal(fit.radius, expected.radius)
        plain = fit_sphere(x, name, sigma=0.002)
        assert np.linalg.norm(plain.centre - fit.centre) > 1e-5


@pytest.mark.parametrize("name", ["gdke", "ugdk", "mgdk", "sgdk", "pratt"])
def test_moments_that_are_known_are_not_taken_again(name):
    rng = np.random.default_rng(12)
    x, other = markers(rng, 2, 100, noise=0.002), markers(rng, 2, 100, noise=0.002)
    fit = fit_sphere(x, name, moments=sphere_moments(other))
    np.testing.assert_array_equal(fit.centre, fit_sphere(other, name).centre)


def test_an_unknown_method_is_an_error_that_names_those_there_are():
    with pytest.raises(ValueError, match=r"'gdke', .*'pratt'.*, got 'best'"):
        fit_sphere(np.zeros((10, 3)), "best")


@pytest.mark.parametrize("sigma", [None, 0.0, 0.001])
@pytest.mark.parametrize("case", DEGENERATE)
@pytest.mark.parametrize("name", STRICT)
def test_degenerate_points_are_an_error_in_words(name, case, sigma):
    points, message = DEGENERATE[case]
    with pytest.raises(
        DegenerateSphereError, match=r"needs at least|do not span a sphere"
    ) as caught:
        fit_sphere(points, name, sigma=sigma)
    assert isinstance(caught.value, MocapSkelError) and isinstance(caught.value, ValueError)
    if sigma is None:
        assert message in caught.value.message


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("shape", [(0, 3), (2, 0, 3)])
def test_an_array_without_points_is_degenerate_to_every_method(name, shape):
    for sigma in (None, 0.001):
        with pytest.raises(DegenerateSphereError, match="needs"):
            fit_sphere(np.empty(shape), name, sigma=sigma)


@pytest.mark.parametrize("name", STRICT)
def test_planes_and_lines_however_turned_are_an_error(name):
    rng = np.random.default_rng(13)
    for _ in range(20):
        turn, place = rotation(rng), direction(rng)
        plane = arc(rng, (100,), 60, 0.2) @ turn.T + place
        line = rng.uniform(-0.2, 0.2, (100, 1)) * turn[:, 0] + place
        for points in (plane, line, np.stack([line, line + turn[:, 0]])):
            with pytest.raises(DegenerateSphereError):
                fit_sphere(points, name)


@pytest.mark.parametrize("name", ["ugdk", "mgdk", "igdk"])
@pytest.mark.parametrize("shape", ["a cap", "a flat piece", "nearly a line"])
def test_noise_as_large_as_the_spread_is_an_error(name, shape):
    # One, two or all three of the directions are lost in the noise.
    x = cap(np.random.default_rng(14), (200,), 30)
    x = (
        x
        * {"a cap": [1, 1, 1], "a flat piece": [1, 1, 0.01], "nearly a line": [1, 0.01, 0.01]}[
            shape
        ]
    )
    with pytest.raises(DegenerateSphereError, match="noise"):
        fit_sphere(x, name, sigma=0.1)


@pytest.mark.parametrize("dimension", [2, 3, 4])
@pytest.mark.parametrize("name", STRICT)
def test_a_sphere_takes_one_point_more_than_dimensions(name, dimension):
    rng = np.random.default_rng(15)
    x = cap(rng, (dimension + 1,), 180, 1.0, dimension)
    # As many equations as unknowns: whatever the points, their condition is what counts.
    tolerance = max(linear_error(x[None]), 1e5 * EPS)
    np.testing.assert_allclose(fit_sphere(x, name, sigma=0.0).centre, 0.0, atol=tolerance)
    with pytest.raises(
        DegenerateSphereError, match=rf"at least {dimension + 1} points|do not span"
    ):
        fit_sphere(x[:-1], name, sigma=0.0)


# Bias and spread by name (method.md, section 2)


def noisy_caps(trials, count, degrees, sigma, seed):
    rng = np.random.default_rng(seed)
    return cap(rng, (trials, count), degrees) + sigma * rng.normal(size=(trials, count, 3))


def test_gdke_is_drawn_to_noisy_points_and_ugdk_is_not():
    trials, count, degrees, sigma = 200, 500, 60.0, 0.03
    x = noisy_caps(trials, count, degrees, sigma, 16)
    height, variance = cap_law(degrees)
    law = height * sigma**2 / (variance + sigma**2)  # along the axis, towards the cap
    # A mean over T trials at four standard errors. The mean of a quotient is not the quotient of
    # means: a share of 4/N of what the noise takes is left (see test_spherefit).
    for name, bias in (("gdke", law), ("lls", law), ("ugdk", 0.0), ("mgdk", 0.0), ("igdk", 0.0)):
        centre = np.array([fit_sphere(p, name, sigma=sigma).centre for p in x])
        tolerance = 4 * centre.std(axis=0) / np.sqrt(trials) + 4 / count * law
        assert (np.abs(centre.mean(axis=0) - [0, 0, bias]) <= tolerance).all(), name
        assert law > 8 * tolerance[2]  # there to be seen


def rmse(centres):
    return np.sqrt((centres**2).sum(axis=-1).mean())


def test_all_but_gdke_reach_the_bound_on_a_small_cap():
    trials, count, degrees, sigma = 2000, 1000, 45.0, 0.01
    m = sphere_moments(noisy_caps(trials, count, degrees, sigma, 17))[:, None]
    crlb = np.linalg.norm(bound(sigma, degrees, count))
    ratio = {
        name: rmse(fit.centre) / crlb
        for name, fit in (("gdke", gdke(m)), ("ugdk", ugdk(m, sigma)), ("pratt", pratt(m)))
    }
    # An RMSE of T trials is known to 1/√(2T), 1.6 percent; GDKE's is mostly bias, which is the
    # analytic one, and the spread in quadrature with it.
    error = 4 / np.sqrt(2 * trials)
    height, variance = cap_law(degrees)
    bias = height * sigma**2 / (variance + sigma**2)
    assert ratio["gdke"] == pytest.approx(np.hypot(bias / crlb, 1), rel=error)
    assert ratio["gdke"] == pytest.approx(3.2, rel=error)
    # Four hundredths above the bound is what the noise leaves at second order (method.md).
    for name in ("ugdk", "pratt"):
        assert 1 - error <= ratio[name] <= 1.05 + error < 1.15, name


def test_mle_and_pratt_are_equally_near():
    # The same points for both: most of what is random in their errors is common to them.
    trials, degrees, sigma = 200, 45.0, 0.01
    x = noisy_caps(trials, 1000, degrees, sigma, 18)
    best = np.array([fit_sphere(p, "mle").centre for p in x])
    closed = np.array([fit_sphere(p, "pratt").centre for p in x])
    difference = (closed**2).sum(axis=1) - (best**2).sum(axis=1)
    error = 4 * difference.std() / np.sqrt(trials)
    # Both are the same to first order in σ; the next is by σ² over the cap's variance smaller.
    second = sigma**2 / cap_law(degrees)[1] * rmse(best) ** 2
    assert abs(difference.mean()) <= error + second
    assert rmse(closed - best) < 0.2 * rmse(best)


def test_on_most_of_a_sphere_all_methods_are_at_the_bound():
    trials, count, degrees, sigma = 200, 300, 135.0, 0.01
    x = noisy_caps(trials, count, degrees, sigma, 19)
    crlb = np.linalg.norm(bound(sigma, degrees, count))
    for name in METHODS:
        centres = np.array([fit_sphere(p, name).centre for p in x])
        # 1/√(2T) at four standard errors; 1/N for what the bound leaves out.
        assert abs(rmse(centres) / crlb - 1) <= 4 / np.sqrt(2 * trials) + 4 / count, name


# MLE


def by_finite_differences(x, sigma, start):
    """The same sum of squares, minimised with a numeric Jacobian: centre (D,) and radii (M,)."""
    dimension = x.shape[-1]

    def residuals(y):
        away = np.linalg.norm(x - y[:dimension], axis=-1) - y[dimension:, None]
        away = away / np.reshape(sigma, (-1, 1))
        return away[np.isfinite(away)]

    radius = np.nanmean(np.linalg.norm(x - start, axis=-1), axis=1)
    answer = scipy.optimize.least_squares(
        residuals, np.append(start, radius), jac="3-point", ftol=1e-15, xtol=1e-15, gtol=1e-15
    )
    return answer.x[:dimension], answer.x[dimension:]


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("sigma", [(1.0,), (1.0, 3.0), (0.5, 2.0, 1.0)])
def test_mle_is_the_minimum_that_a_numeric_jacobian_finds(sigma, dimension):
    x = markers(np.random.default_rng(20), len(sigma), 150, 70.0, dimension, noise=0.003)
    x[0, ::9] = np.nan
    fit = mle(x, sigma)
    centre, radius = by_finite_differences(x, sigma, np.full(dimension, 0.02))
    tolerance = error("mle", x, 70.0, 0.003)
    np.testing.assert_allclose(fit.centre, centre, rtol=0, atol=tolerance)
    np.testing.assert_allclose(fit.radius, radius, rtol=0, atol=tolerance)
    assert fit.converged


@pytest.mark.parametrize("sigma", [(1.0,), (1.0, 4.0)])
def test_the_residuals_of_mle_are_orthogonal_to_what_it_may_change(sigma):
    x = markers(np.random.default_rng(21), len(sigma), 200, 50.0, noise=0.003)
    fit = mle(x, sigma)
    away = x - fit.centre
    distance = np.linalg.norm(away, axis=-1)
    residual = (distance - fit.radius[:, None]) / np.array(sigma)[:, None] ** 2
    # At the minimum the gradient is zero: √STOP of its size, the norms of residual and Jacobian.
    scale = np.sqrt(STOP) * np.sqrt((residual**2).sum() * residual.size)
    assert np.abs(residual.sum(axis=1)).max() <= scale
    assert (
        np.abs((residual[..., None] * away / distance[..., None]).sum(axis=(0, 1))).max() <= scale
    )


def test_the_jacobian_of_mle_is_the_derivative_of_its_residuals(monkeypatch):
    rng = np.random.default_rng(22)
    x = markers(rng, 2, 30, noise=0.003)
    x[0, ::4] = np.nan
    seen = []
    real = scipy.optimize.leastsq

    def look(residuals, start, **options):
        y = start + 0.05 * rng.normal(size=len(start))
        step = EPS ** (1 / 3)
        columns = [
            (residuals(y + step * e) - residuals(y - step * e)) / (2 * step)
            for e in np.eye(len(start))
        ]
        seen.append((np.array(columns), options["Dfun"](y).copy()))
        return real(residuals, start, **options)

    monkeypatch.setattr(scipy.optimize, "leastsq", look)
    mle(x, [0.5, 2.0])
    ((numeric, analytic),) = seen
    assert analytic.shape == numeric.shape == (5, 22 + 30)
    # Central differences: step² times the third derivative, 1/d² of the distance d ≥ 0.02 with the
    # weight 2, and eps / step of the residuals.
    np.testing.assert_allclose(analytic, numeric, rtol=0, atol=EPS ** (2 / 3) * (2 / 0.02**2 + 2))


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("degrees", [60.0, 120.0])
def test_mle_recovers_from_a_bad_start(count, degrees):
    rng = np.random.default_rng(23)
    x = markers(rng, count, 200, degrees, noise=0.001)
    # On the other side than the points, where no step turns the fit inside out; on a point; and half
    # a radius away on any side.
    outwards = -x.mean(axis=(0, 1)) / np.linalg.norm(x.mean(axis=(0, 1)))
    starts = [0.5 * outwards, 5.0 * outwards, x[0, 0], *(0.05 * direction(rng) for _ in range(5))]
    expected = mle(x)
    for start in starts:
        fit = mle(x, start=start)
        tolerance = 2 * error("mle", x, degrees, 0.001)
        np.testing.assert_allclose(fit.centre, expected.centre, rtol=0, atol=tolerance)
        np.testing.assert_allclose(fit.radius, expected.radius, rtol=0, atol=tolerance)
        assert fit.converged


def test_a_fit_that_runs_away_to_a_plane_has_not_converged():
    # From beyond the cap every step makes the sphere larger and flatter, and none is the last.
    x = cap(np.random.default_rng(24), (300,), 90) + 0.01 * np.random.default_rng(25).normal(
        size=(300, 3)
    )
    fit = mle(x, start=[0.0, 0.0, 5.0])
    assert np.linalg.norm(fit.centre) > 1000 or np.linalg.norm(fit.centre) < 0.01
    assert fit.converged == (np.linalg.norm(fit.centre) < 0.01)


def test_only_the_ratios_of_sigmas_count_to_mle():
    x = markers(np.random.default_rng(26), 2, 150, noise=0.002)
    tolerance = 2 * error("mle", x, noise=0.002)
    one, other = mle(x, [1.0, 3.0]), mle(x, [0.002, 0.006])
    np.testing.assert_allclose(other.centre, one.centre, rtol=0, atol=tolerance)
    alike = mle(x, 0.01)
    np.testing.assert_allclose(alike.centre, mle(x).centre, rtol=0, atol=tolerance)
    assert np.linalg.norm(one.centre - alike.centre) > 100 * tolerance


def test_mle_with_each_markers_own_sigma_reaches_the_bound():
    trials, size, sigma = 300, 100, np.array([0.001, 0.008])
    rng = np.random.default_rng(27)
    truth = markers(rng, 2, size, 70.0)
    x = truth + sigma[:, None, None] * rng.normal(size=(trials, *truth.shape))
    weighted, alike = (np.array([mle(p, s).centre for p in x]) for s in (sigma, [1.0, 1.0]))
    crlb = np.sqrt(np.trace(fisher_bound(truth, sigma)))
    # 1/√(2T) at four standard errors; the largest noise is 6 % of the smaller cap's depth, squared.
    assert abs(rmse(weighted) / crlb - 1) <= 4 / np.sqrt(2 * trials) + 0.06**2
    difference = (alike**2).sum(axis=1) - (weighted**2).sum(axis=1)
    assert difference.mean() > 4 * difference.std() / np.sqrt(trials)


@pytest.mark.parametrize("away", [None, 0.5])
def test_mle_says_when_it_has_not_converged(away):
    x = markers(np.random.default_rng(28), 1, 100, 40.0, noise=0.002)
    middle = x.mean(axis=(0, 1))
    start = None if away is None else -away * middle / np.linalg.norm(middle)
    short, long = mle(x, start=start, most=2), mle(x, start=start)
    assert not short.converged and long.converged
    assert np.isfinite(short.centre).all() and np.isfinite(short.radius).all()


@pytest.mark.parametrize("case", DEGENERATE)
def test_a_start_does_not_make_degenerate_points_a_sphere(case):
    points, message = DEGENERATE[case]
    with pytest.raises(DegenerateSphereError, match=message):
        mle(points, start=[1.0, 1.0, 1.0])


def test_mle_without_scipy_is_an_error_that_says_what_to_install(monkeypatch):
    x = markers(np.random.default_rng(29), 1, 50)
    # None in the table of modules is an import that fails.
    for module in [name for name in sys.modules if name.partition(".")[0] == "scipy"]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "scipy", None)
    with pytest.raises(MissingExtraError, match="scipy, which is not installed") as caught:
        fit_sphere(x, "mle")
    assert caught.value.hint == "pip install 'mocap-skel[mle]'"
    for name in METHODS:
        if name != "mle":
            assert np.isfinite(fit_sphere(x, name).centre).all()


@pytest.mark.parametrize("fit", [lls, mle])
def test_points_of_a_batch_are_no_points_of_lls_and_mle(fit):
    with pytest.raises(ValueError, match=r"shape \(M, N, D\) or \(N, D\), got \(2, 3, 10, 3\)"):
        fit(np.zeros((2, 3, 10, 3)))


# IGDK


def running_error(x, sigma=0.0):
    """Error of the centre of running sums over points (M, n, D): nan where there is no centre.

    S is a running sum of terms up to (2 r)³ about the first sample and C of (2 r)²; each is rounded
    √n times, and the centre is their quotient by the weakest variance without its noise.
    """
    m = sphere_moments(x)
    fit = mgdk(m, sigma, strict=False)
    width = np.nanmax(x, axis=(0, 1)) - np.nanmin(x, axis=(0, 1))
    weakest = fit.spread[0] - sigma**2
    reach = np.abs(m.mean).max()
    away = np.linalg.norm(fit.centre - m.mean, axis=-1).max()
    sums = np.linalg.norm(width) ** 2 * (np.linalg.norm(width) + away) / weakest
    return 8 * EPS * (np.sqrt(m.count.sum()) * sums + reach)


def test_igdk_gives_one_centre_for_each_sample():
    x = markers(np.random.default_rng(30), 1, 25)[0]
    running = igdk(x)
    assert inspect.isgenerator(running)
    fits = list(running)
    assert len(fits) == 25
    assert [int(fit.count[0]) for fit in fits] == list(range(1, 26))
    for fit in fits:
        assert fit.centre.shape == (3,)


def test_igdk_takes_a_sample_when_it_is_asked_for_a_centre_and_not_before():
    rng = np.random.default_rng(31)
    taken = []

    def stream():
        for k in itertools.count():
            taken.append(k)
            yield cap(rng, (), 180) + [1.0, 2.0, 3.0]

    running = igdk(stream())
    assert not taken
    for k in range(1, 50):
        fit = next(running)
        assert len(taken) == k
    np.testing.assert_allclose(fit.centre, [1.0, 2.0, 3.0], rtol=0, atol=10 * rounding(90, 4, 1))


def test_the_state_of_igdk_does_not_grow():
    x = markers(np.random.default_rng(32), 2, 10)
    cycle = itertools.cycle(x.swapaxes(0, 1))

    def size(fit):
        arrays = (fit.centre, fit.place, fit.count, fit.sums)
        # What a view keeps alive is part of the state.
        return sum((a if a.base is None else a.base).nbytes for a in arrays)

    fits = list(itertools.islice(igdk(cycle), 500))
    assert size(fits[9]) == size(fits[-1])
    assert fits[-1].count.tolist() == [500, 500]
    # D of centre and place, M counts and (D + 2) (D + 1) sums a marker.
    assert size(fits[-1]) <= 8 * (3 + 2 * 3 + 2 + 2 * 5 * 4)


@pytest.mark.parametrize("sigma", [0.0, 0.001, 0.004])
@pytest.mark.parametrize("count", [1, 3])
def test_every_centre_of_igdk_is_the_batch_answer_of_the_samples_so_far(count, sigma):
    rng = np.random.default_rng(33)
    x = markers(rng, count, 60, 70.0, noise=0.002) + [0.5, 1.0, 1.5]
    x[rng.random((count, 60)) < 0.2] = np.nan
    for k, fit in enumerate(igdk(x.swapaxes(0, 1), sigma), start=1):
        seen = x[:, :k]
        batch = mgdk(sphere_moments(seen), sigma, strict=False)
        np.testing.assert_array_equal(np.isnan(fit.centre), np.isnan(batch.centre), f"sample {k}")
        np.testing.assert_array_equal(fit.count, np.isfinite(seen).all(axis=2).sum(axis=1))
        if np.isfinite(batch.centre).all():
            tolerance = running_error(seen, sigma)
            np.testing.assert_allclose(fit.centre, batch.centre, rtol=0, atol=tolerance)
    assert np.isfinite(fit.centre).all()


@given(
    seed=SEEDS, count=st.integers(1, 3), sigma=st.sampled_from([0.0, 0.003]), lost=st.floats(0, 0.7)
)
@LAWS
def test_running_centres_are_those_of_igdk(seed, count, sigma, lost):
    rng = np.random.default_rng(seed)
    x = markers(rng, count, 40, 70.0, noise=0.002) + direction(rng)
    x[rng.random((count, 40)) < lost] = np.nan
    one = running_centres(x, sigma)
    other = np.array([fit.centre for fit in igdk(x.swapaxes(0, 1), sigma)])
    assert one.shape == other.shape == (40, 3)
    np.testing.assert_array_equal(np.isnan(one), np.isnan(other))
    for k in np.flatnonzero(np.isfinite(one[:, 0])):
        tolerance = running_error(x[:, : k + 1], sigma)
        np.testing.assert_allclose(one[k], other[k], rtol=0, atol=tolerance)


@pytest.mark.parametrize("extra", [-1, 0, 1, 70])
def test_running_centres_do_not_notice_the_end_of_a_block(extra):
    rng = np.random.default_rng(34)
    size = BLOCK + extra
    x = markers(rng, 3, size, 70.0, noise=0.002) + direction(rng)
    x[0, 100:300] = np.nan
    x[1, : BLOCK - 5] = np.nan  # seen for the first time where a block ends
    x[2] = np.nan  # never
    got = running_centres(x, 0.002)
    assert got.shape == (size, 3)
    for k in {50, BLOCK - 10, BLOCK - 5, BLOCK - 2, BLOCK - 1, BLOCK, BLOCK + 1, size - 1}:
        if k < size:
            expected = mgdk(sphere_moments(x[:, : k + 1]), 0.002).centre
            tolerance = running_error(x[:, : k + 1], 0.002)
            np.testing.assert_allclose(got[k], expected, rtol=0, atol=tolerance)


def test_the_last_centre_of_igdk_is_mgdk_of_all_samples():
    rng = np.random.default_rng(35)
    x = markers(rng, 1, 1000, 45.0, noise=0.001) + 10.0 * direction(rng)
    *_, last = igdk(x[0], 0.001)
    expected = mgdk(sphere_moments(x), 0.001)
    np.testing.assert_allclose(last.centre, expected.centre, rtol=0, atol=running_error(x, 0.001))
    np.testing.assert_allclose(
        running_centres(x[0], 0.001)[-1], expected.centre, rtol=0, atol=running_error(x, 0.001)
    )
    fit = fit_sphere(x, "igdk", sigma=0.001)
    np.testing.assert_allclose(fit.radius, expected.radius, rtol=0, atol=running_error(x, 0.001))


def test_the_moments_of_igdk_are_those_of_the_samples_so_far():
    rng = np.random.default_rng(36)
    x = markers(rng, 2, 200, noise=0.001) + direction(rng)
    x[1, ::3] = np.nan
    fits = list(igdk(x.swapaxes(0, 1)))
    for k in (1, 4, 50, 199):
        # Running sums are rounded √n times, of numbers as wide as the larger sphere.
        assert_same(
            fits[k].moments,
            sphere_moments(x[:, : k + 1]),
            8 * np.sqrt(k + 1) * EPS * (1 + 1 / 0.4),
            0.4,
        )
    # So that any other estimator may go on from there.
    expected = pratt(sphere_moments(x))
    np.testing.assert_allclose(
        pratt(fits[-1].moments).centre, expected.centre, rtol=0, atol=running_error(x)
    )


def test_a_marker_that_igdk_has_not_seen_yet_has_the_moments_of_no_points():
    x = markers(np.random.default_rng(44), 2, 50, 90.0)
    x[1] = np.nan
    *_, last = igdk(x.swapaxes(0, 1))
    assert_same(last.moments[1], sphere_moments(x[1]), 0.0, 1.0)
    np.testing.assert_allclose(gdke(last.moments).centre, 0.0, atol=running_error(x))


def test_there_is_no_centre_before_the_samples_determine_one():
    x = markers(np.random.default_rng(37), 1, 20)[0]
    centres = np.array([fit.centre for fit in igdk(x)])
    assert np.isnan(centres[:3]).all() and np.isfinite(centres[3:]).all()
    # Samples that are missing, on one place, on a line and in a plane determine nothing.
    still, line = (
        np.tile(x[0], (5, 1)),
        x[0] + np.linspace(0, 0.1, 5)[:, None] * direction(np.random.default_rng(38)),
    )
    plane = arc(np.random.default_rng(39), (300,), 60) @ rotation(np.random.default_rng(40)).T
    for points in (np.full((5, 3), np.nan), still, line, plane):
        got = np.array([fit.centre for fit in igdk(points)])
        assert np.isnan(got).all()
        np.testing.assert_array_equal(running_centres(points), got)
    # And what comes later counts.
    both = running_centres(np.concatenate([still, x]))
    assert np.isnan(both[:5]).all() and np.isfinite(both[-1]).all()


@pytest.mark.parametrize("size", [BLOCK - 1, 5 * BLOCK])
def test_a_plane_determines_no_running_centre_however_long_it_is(size):
    rng = np.random.default_rng(41)
    for distance in (0.0, 1.0, 10.0):
        x = arc(rng, (size,), 60, 0.2) @ rotation(rng).T + distance * direction(rng)
        assert np.isnan(running_centres(x)).all()


@pytest.mark.parametrize("lost", [1, 2, 3])
def test_directions_that_are_lost_in_noise_leave_no_running_centre(lost):
    # Two of them make a determinant positive again.
    depth = np.array([0.1, 0.2, 0.3])
    depth[:lost] = 0.001
    x = depth * np.random.default_rng(42).normal(size=(200, 3))
    assert np.isnan(mgdk(sphere_moments(x), 0.01, strict=False).centre).all()
    assert np.isnan(running_centres(x, 0.01)[-1]).all()
    *_, last = igdk(x, 0.01)
    assert np.isnan(last.centre).all()


def test_samples_of_several_markers_come_as_rows():
    rng = np.random.default_rng(43)
    x = markers(rng, 2, 30, 90.0)
    x[0, :10], x[1, 10:20] = np.nan, np.nan
    *_, last = igdk([sample.tolist() for sample in x.swapaxes(0, 1)])
    assert last.place.shape == (2, 3) and last.count.tolist() == [20, 20]
    np.testing.assert_array_equal(last.place, [x[0, 10], x[1, 0]])
    np.testing.assert_allclose(last.centre, 0.0, atol=running_error(x))
    # One marker as a row is the same as without.
    *_, row = igdk(x[1, :10, None])
    *_, plain = igdk(x[1, :10])
    np.testing.assert_array_equal(row.centre, plain.centre)


def test_no_samples_have_no_centres():
    assert list(igdk([])) == []
    assert running_centres(np.empty((0, 3))).shape == (0, 3)
    assert running_centres(np.empty((2, 0, 3))).shape == (0, 3)

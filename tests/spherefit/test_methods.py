"""Every estimator through `fit_sphere`, by the laws that all of them keep.

θ is the half-angle of the cap that the points cover. How far each may be from exact arithmetic is
`spheres.method_error`: rounding, which a cap makes 1 / sin²(θ/2) of; the condition of its system for LLS;
and for the MLE where Levenberg and Marquardt's iteration stops.
"""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from spheres import (
    EPS,
    LAWS,
    SEEDS,
    arc,
    direction,
    linear_error,
    markers,
    method_error,
    rotation,
    rounding,
)

from mocap_skel.spherefit import (
    METHODS,
    DegenerateSphereError,
    fit_sphere,
    gdke,
    mgdk,
    sgdk,
    sphere_moments,
    ugdk,
)


@pytest.mark.parametrize("name", METHODS)
def test_a_perfect_sphere_is_exact(name):
    """Circles and hyperspheres too, of one marker and of several, near the origin and far from it."""
    rng = np.random.default_rng(1)
    for dimension, count in ((2, 1), (2, 3), (3, 1), (3, 3), (4, 2)):
        for degrees, distance in product((30.0, 60.0, 180.0), (0.0, 1.0, 10.0)):
            centre = distance * direction(rng, dimension)
            x = markers(rng, count, 300, degrees, dimension) + centre
            fit = fit_sphere(x, name)
            tolerance = method_error(name, x, degrees)
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
    for dimension in (2, 3, 4):
        x = markers(rng, 1, 100, 60.0, dimension, noise=0.001)
        alone, listed = fit_sphere(x[0], name), fit_sphere(x, name)
        assert alone.centre.shape == (dimension,) and alone.radius.shape == ()
        assert listed.radius.shape == (1,)
        np.testing.assert_array_equal(alone.centre, listed.centre)
        np.testing.assert_array_equal(alone.radius, listed.radius[0])
        # And as a list of lists.
        np.testing.assert_array_equal(fit_sphere(x[0].tolist(), name).centre, alone.centre)


@pytest.mark.parametrize("name", METHODS)
@given(seed=SEEDS, degrees=st.floats(30, 180), distance=st.floats(0, 10), count=st.integers(1, 3))
@LAWS
def test_a_rigid_motion_of_the_points_moves_the_centre(name, seed, degrees, distance, count):
    rng = np.random.default_rng(seed)
    x = markers(rng, count, 150, degrees, noise=0.001)
    turn, shift = rotation(rng), distance * direction(rng)
    moved = x @ turn.T + shift
    here, there = fit_sphere(x, name), fit_sphere(moved, name)
    tolerance = method_error(name, x, degrees, 0.001) + method_error(name, moved, degrees, 0.001)
    np.testing.assert_allclose(there.centre, turn @ here.centre + shift, rtol=0, atol=tolerance)
    np.testing.assert_array_equal(there.rank, here.rank)
    tolerance *= (1 + distance) / 0.1 if name == "lls" else 1
    np.testing.assert_allclose(there.radius, here.radius, rtol=0, atol=tolerance)


@pytest.mark.parametrize("name", METHODS)
def test_a_change_of_unit_scales_everything(name):
    x = markers(np.random.default_rng(3), 2, 200, noise=0.002) + 0.3
    for unit in (1e-3, 1e3):
        here, there = fit_sphere(x, name), fit_sphere(unit * x, name)
        tolerance = method_error(name, x, noise=0.002)
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
    tolerance = method_error(name, x, 90.0, 0.001)
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
    tolerance = method_error(name, x, 90.0, 0.001)
    np.testing.assert_allclose(gaps.centre, full.centre, rtol=0, atol=tolerance)
    tolerance *= 1 / 0.1 if name == "lls" else 1
    np.testing.assert_allclose(gaps.radius, full.radius, rtol=0, atol=tolerance)


@pytest.mark.parametrize("name", METHODS)
def test_markers_may_have_points_in_any_number(name):
    # 4 of one marker, 5, and 60: two know little, and the centre is exact from all of them.
    x = markers(np.random.default_rng(4), 3, 60, 90.0) + [0.5, 0.0, 0.0]
    x[0, 4:], x[1, :55] = np.nan, np.nan
    fit = fit_sphere(x, name)
    tolerance = method_error(name, x, 90.0)
    np.testing.assert_allclose(fit.centre, [0.5, 0.0, 0.0], rtol=0, atol=tolerance)
    tolerance *= 1.5 / 0.1 if name == "lls" else 1
    np.testing.assert_allclose(fit.radius, [0.1, 0.2, 0.3], rtol=0, atol=tolerance)


@pytest.mark.parametrize("name", [name for name in METHODS if name not in ("lls", "mle")])
def test_a_marker_that_was_never_seen_has_no_radius_and_changes_no_centre(name):
    x = markers(np.random.default_rng(5), 2, 100, noise=0.001)
    x[1] = np.nan
    fit, alone = fit_sphere(x, name), fit_sphere(x[:1], name)
    np.testing.assert_allclose(fit.centre, alone.centre, rtol=0, atol=method_error(name, x))
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
def test_gdke_is_lls_to_the_condition_of_its_system(count):
    for distance, noise in product((0.0, 1.0, 10.0), (0.0, 0.01)):
        rng = np.random.default_rng(7)
        x = markers(rng, count, 200, noise=noise) + distance * direction(rng)
        x[0, ::5] = np.nan
        one, other = fit_sphere(x, "gdke"), fit_sphere(x, "lls")
        tolerance = linear_error(x) + method_error("gdke", x)
        np.testing.assert_allclose(other.centre, one.centre, rtol=0, atol=tolerance)
        tolerance *= (1 + distance) / 0.1
        np.testing.assert_allclose(other.radius, one.radius, rtol=0, atol=tolerance)
        # Ten metres cost four digits of the centre, and two of the radius.
        assert tolerance < 1e-6


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
    np.testing.assert_allclose(fit.centre, expected.centre, rtol=0, atol=method_error(name, x))
    np.testing.assert_allclose(fit.sigma, expected.sigma, rtol=4 * EPS)
    other = fit_sphere(x, name, sigma=0.004)
    np.testing.assert_allclose(
        other.centre, mgdk(sphere_moments(x), 0.004).centre, atol=method_error(name, x)
    )
    assert np.linalg.norm(other.centre - fit.centre) > 1e-5 and other.sigma == 0.004


@pytest.mark.parametrize("name", ["ugdk", "mgdk", "igdk"])
def test_no_noise_is_a_noise_that_is_given_and_leaves_gdke(name):
    x = markers(np.random.default_rng(45), 2, 200, noise=0.005)
    fit = fit_sphere(x, name, sigma=0.0)
    np.testing.assert_allclose(fit.centre, fit_sphere(x, "gdke").centre, atol=method_error(name, x))
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


@pytest.mark.parametrize("name", ["igdk", "lls", "mle"])
def test_what_the_points_are_asked_for_themselves_has_the_spread_of_the_moments_that_are_given(
    name,
):
    rng = np.random.default_rng(12)
    x, other = markers(rng, 2, 100, noise=0.002), markers(rng, 2, 100, noise=0.002)
    fit = fit_sphere(x, name, moments=sphere_moments(other), sigma=0.002)
    np.testing.assert_allclose(fit.spread, gdke(sphere_moments(other)).spread, rtol=64 * EPS)
    # The centre is that of the points.
    tolerance = method_error(name, x, noise=0.002)
    np.testing.assert_allclose(
        fit.centre, fit_sphere(x, name, sigma=0.002).centre, rtol=0, atol=tolerance
    )


def test_an_unknown_method_is_an_error_that_names_those_there_are():
    with pytest.raises(ValueError, match=r"'gdke', .*'pratt'.*, got 'best'"):
        fit_sphere(np.zeros((10, 3)), "best")

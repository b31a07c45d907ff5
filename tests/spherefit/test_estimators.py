"""The closed forms against their formulas: least squares, thesis 6.6, noise with a shape, batches.

θ is the half-angle of the cap that the points cover. Rounding: points at a distance d from the origin carry
errors of eps d, and a cap lets the centre move by 1 / sin²(θ/2) of the error of its points (the
Cramér-Rao bound has the same factor).
"""

import numpy as np
import pytest
from spheres import EPS, cap, direction, markers_on_spheres, rotation, rounding, stack

from mocap_skel.spherefit import (
    DegenerateSphereError,
    allowed_sigma,
    gdke,
    mgdk,
    pratt,
    radial_variance,
    sgdk,
    sphere_moments,
    ugdk,
)


@pytest.mark.parametrize("degrees", [1, 5, 20])
def test_a_perfect_sphere_is_exact_from_the_smallest_cap_on(degrees):
    """Twenty of them at once, ten metres away; `test_methods` has caps of 30 degrees and more."""
    rng = np.random.default_rng(5)
    radius, distance = 0.1, 10.0
    centres = np.stack([distance * direction(rng) for _ in range(20)])
    x = np.stack([cap(rng, (200,), degrees, radius) @ rotation(rng).T + c for c in centres])
    for estimator in (gdke, pratt, sgdk):
        fit = estimator(sphere_moments(x)[:, None])
        error = np.linalg.norm(fit.centre - centres, axis=-1).max() / radius
        assert error <= rounding(degrees, distance, radius)
        assert np.abs(fit.radius / radius - 1).max() <= rounding(degrees, distance, radius)
        if degrees >= 20:
            assert error <= 1e-9
        assert (fit.rank == 3).all() and np.isnan(fit.null).all()


@pytest.mark.parametrize("dimension", [2, 3, 4])
def test_gdke_is_the_linear_least_squares_sphere(dimension):
    rng = np.random.default_rng(7)
    x = cap(rng, (60,), 70, 1.0, dimension) + 0.1 * rng.normal(size=(60, dimension))
    system = np.column_stack([2 * x, np.ones(60)])
    solution = np.linalg.lstsq(system, (x**2).sum(axis=1), rcond=None)[0]
    fit = gdke(sphere_moments(x))
    centre = solution[:-1]
    # Both are exact up to rounding times the condition number of the system, below 100 here.
    np.testing.assert_allclose(fit.centre, centre, rtol=0, atol=100 * 8 * EPS)
    radius = np.sqrt(solution[-1] + centre @ centre)
    np.testing.assert_allclose(fit.radius, radius, rtol=0, atol=100 * 8 * EPS)


def test_several_markers_are_the_least_squares_sphere_with_a_radius_each():
    # Gamage & Lasenby 2002 as a plain linear system; the markers' counts differ.
    points, m = markers_on_spheres(np.random.default_rng(8), (40, 90, 200), 0.01)
    rows = [
        np.column_stack([2 * x, np.tile(np.eye(3)[p], (len(x), 1))]) for p, x in enumerate(points)
    ]
    right = np.concatenate([(x**2).sum(axis=1) for x in points])
    solution = np.linalg.lstsq(np.concatenate(rows), right, rcond=None)[0]
    np.testing.assert_allclose(gdke(m).centre, solution[:3], rtol=0, atol=1000 * EPS)


@pytest.mark.parametrize("sigma", [0.0, 0.01])
def test_several_markers_follow_the_formula_of_thesis_6_6(sigma):
    _, m = markers_on_spheres(np.random.default_rng(9), (100, 100, 100), 0.01)
    clean = m.covariance - sigma**2 * np.eye(3)
    right = np.einsum("pde,pe->d", clean, m.mean) + m.third.sum(axis=0) / 2
    centre = np.linalg.solve(clean.sum(axis=0), right)
    fit = mgdk(m, sigma)
    np.testing.assert_allclose(fit.centre, centre, rtol=0, atol=1000 * EPS)
    np.testing.assert_array_equal(ugdk(m, sigma).centre, fit.centre)
    trace = np.trace(clean, axis1=1, axis2=2)
    radius = np.sqrt(99 / 100 * trace + ((m.mean - fit.centre) ** 2).sum(axis=1))
    np.testing.assert_allclose(fit.radius, radius, rtol=10 * EPS)
    assert fit.sigma == pytest.approx(sigma, rel=4 * EPS)


def test_noise_with_a_shape_follows_the_formula_of_thesis_6_6():
    rng = np.random.default_rng(35)
    _, m = markers_on_spheres(rng, (100, 100, 100), 0.01)
    half = rng.normal(size=(3, 3, 3))
    each = half @ half.swapaxes(1, 2)  # Σ̂_p / σ², full and another for every marker
    each *= 3 / np.trace(each, axis1=1, axis2=2)[:, None, None]
    sigma = 0.005
    clean = m.covariance - sigma**2 * each
    right = np.einsum("pde,pe->d", clean, m.mean) + m.third.sum(axis=0) / 2
    centre = np.linalg.solve(clean.sum(axis=0), right)
    for fit in (mgdk(m, sigma, each), sgdk(m, sigma, each)):
        np.testing.assert_allclose(fit.centre, centre, rtol=0, atol=1000 * EPS)
        trace = np.trace(clean, axis1=1, axis2=2)
        radius = np.sqrt(99 / 100 * trace + ((m.mean - centre) ** 2).sum(axis=1))
        np.testing.assert_allclose(fit.radius, radius, rtol=1000 * EPS)


def test_the_unit_matrix_is_the_shape_of_plain_noise():
    _, m = markers_on_spheres(np.random.default_rng(36), (100, 150), 0.01)
    plain = mgdk(m, 0.01)
    for fit in (mgdk(m, 0.01, np.eye(3)), ugdk(m, 0.02, np.eye(3) / 4)):
        np.testing.assert_allclose(fit.centre, plain.centre, rtol=0, atol=100 * EPS)
        np.testing.assert_allclose(fit.radius, plain.radius, rtol=100 * EPS)


@pytest.mark.parametrize("sigma", [0.0, 0.01])
def test_a_member_whose_noise_is_not_known_has_no_answer_and_the_others_do_not_pay(sigma):
    x = cap(np.random.default_rng(36), (3, 2, 100), 60)
    m = sphere_moments(x + 0.01 * np.random.default_rng(37).normal(size=x.shape))
    shape = np.tile(np.eye(3), (3, 2, 1, 1))
    shape[1, 0, 2, 2] = np.nan
    fit = mgdk(m, sigma, shape, strict=False)
    np.testing.assert_array_equal(np.isnan(fit.centre).all(axis=1), [False, True, False])
    for k in (0, 2):
        np.testing.assert_array_equal(fit.centre[k], mgdk(m[k], sigma, shape[k]).centre)
    with pytest.raises(DegenerateSphereError, match="noise"):
        mgdk(m, sigma, shape)


def test_points_far_from_any_sphere_allow_no_more_noise_than_their_weakest_spread():
    """Many points in the middle and few far out, alike along all axes: a residual without end."""
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    m = sphere_moments(np.concatenate([0.1 * axes] * 10 + [3.0 * axes]))
    weakest = np.sqrt(np.linalg.eigvalsh(m.covariance)[0])
    for sigma in (0.5 * weakest, 1.05 * weakest, 1.2 * weakest, 10 * weakest):
        assert allowed_sigma(m, sigma) == pytest.approx(min(sigma, weakest), rel=1e-6)


@pytest.mark.parametrize("share", [0.5, 2.0])
def test_sgdk_knows_the_noise_by_sigma_and_shape_together(share):
    # Noise of 4 I and σ is noise of I and 2 σ, below and above Pratt's noise alike.
    _, m = markers_on_spheres(np.random.default_rng(37), (300, 300), 0.01)
    sigma = share * float(pratt(m).sigma)
    one, other = sgdk(m, sigma), sgdk(m, sigma / 2, 4 * np.eye(3))
    np.testing.assert_allclose(other.centre, one.centre, rtol=0, atol=1000 * EPS)
    unknown = sgdk(m, None, 4 * np.eye(3))
    np.testing.assert_allclose(unknown.centre, sgdk(m).centre, rtol=0, atol=1000 * EPS)


def test_every_member_of_a_batch_has_its_own_noise():
    rng = np.random.default_rng(11)
    x = cap(rng, (4, 2, 100), 60) + 0.02 * rng.normal(size=(4, 2, 100, 3))
    sigma = np.array([0.0, 0.01, 0.02, 0.03])
    m = sphere_moments(x)
    fit = mgdk(m, sigma)
    assert fit.centre.shape == (4, 3) and fit.radius.shape == (4, 2)
    for k in range(4):
        one = mgdk(m[k], sigma[k])
        np.testing.assert_allclose(fit.centre[k], one.centre, rtol=0, atol=100 * EPS)
        np.testing.assert_allclose(fit.radius[k], one.radius, rtol=100 * EPS)


@pytest.mark.parametrize("counts", [(50,), (200,), (80, 80), (50, 120)])
def test_radial_variance_is_that_of_the_residuals(counts):
    points, m = markers_on_spheres(np.random.default_rng(16), counts, 0.001)
    fit = pratt(m)
    alone = len(counts) == 1
    got = radial_variance(m[0], pratt(m[0])) if alone else radial_variance(m, fit)
    for p, x in enumerate(points):
        away = np.linalg.norm(x - fit.centre, axis=1)
        residual = away - away.mean()
        # |x - c|² is linear in the residual to first order: the next is residual / r, squared. The
        # residual of the moments is a variance, with N - 1.
        direct = residual.var(ddof=1)
        tolerance = 4 * residual.std() / away.mean()
        assert (got if alone else got[p]) == pytest.approx(direct, rel=tolerance)
    assert got.shape == (() if alone else (len(counts),))


@pytest.mark.parametrize("unit", [1e-3, 1e3])
def test_spread_and_radial_variance_go_with_the_square_of_the_unit(unit):
    points, m = markers_on_spheres(np.random.default_rng(4), (200, 200), 0.002)
    scaled = stack([sphere_moments(unit * x) for x in points])
    here, there = pratt(m), pratt(scaled)
    np.testing.assert_allclose(there.spread, unit**2 * here.spread, rtol=rounding(60, 0.3, 0.1))
    # A residual's square is a difference of numbers about r² times it, to relative rounding.
    np.testing.assert_allclose(
        radial_variance(scaled, there), unit**2 * radial_variance(m, here), rtol=1e4 * EPS
    )


def test_radial_variance_of_a_perfect_sphere_is_rounding():
    m = sphere_moments(cap(np.random.default_rng(17), (100,), 60, 0.1) + 10.0)
    # A difference of terms r⁴, whose points carry eps · 17 m, over 4 r².
    assert radial_variance(m, gdke(m)) <= 16 * EPS * 0.1 * 17

"""Bias and spread of the estimators under noise, against their laws and the Cramér-Rao bound.

At named levels (σ / r, θ) with r = 1, the cap's axis along z. A mean over T trials is known to its standard
error, spread / √T, and everything random is asserted at four of them; a term of order 1/N that the law
of large numbers leaves out is allowed for by name.
"""

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize
from hypothesis import given
from hypothesis import strategies as st
from spheres import EPS, LAWS, SEEDS, bound, cap, cap_law, markers_on_spheres, rmse, rounding

from mocap_skel.spherefit import (
    fit_sphere,
    gdke,
    mgdk,
    pratt,
    sgdk,
    sphere_moments,
    ugdk,
)

LEVELS = {
    "low noise, half a sphere": (0.01, 90.0, 300),
    "low noise, small cap": (0.01, 45.0, 300),
    "noisy, half a sphere": (0.05, 90.0, 300),
    "noisy, small cap": (0.03, 45.0, 300),
}
TRIALS = 400


def caps_at(level, seed=13):
    sigma, degrees, count = LEVELS[level]
    rng = np.random.default_rng(seed)
    x = cap(rng, (TRIALS, count), degrees) + sigma * rng.normal(size=(TRIALS, count, 3))
    return sphere_moments(x)[:, None]


@pytest.mark.parametrize("level", LEVELS)
def test_the_bias_of_gdke_is_the_analytic_one(level):
    sigma, degrees, count = LEVELS[level]
    centre = gdke(caps_at(level)).centre
    height, variance = cap_law(degrees)
    # E[C] = C₀ + σ² I and E[S] = S₀, so that c - x̄ shrinks by C₀ (C₀ + σ² I)⁻¹.
    shrunk = variance / (variance + sigma**2)
    law = np.array([0.0, 0.0, height * (1 - shrunk)])
    # The mean of a quotient is not the quotient of the means: c - x̄ is off by the relative variance
    # of C, 2/N, in the part that the noise takes; twice, for that of S.
    nonlinear = 4 / count * height * (1 - shrunk)
    error = 4 * centre.std(axis=0) / np.sqrt(TRIALS) + nonlinear
    assert (np.abs(centre.mean(axis=0) - law) <= error).all()
    if level == "noisy, small cap":
        assert law[2] > 10 * error[2]  # the bias is there to be seen


@pytest.mark.parametrize("level", LEVELS)
def test_the_spread_of_gdke_is_that_of_a_regression(level):
    sigma, degrees, count = LEVELS[level]
    spread = gdke(caps_at(level)).centre.std(axis=0)
    # |x|² is regressed on x: with residuals ρ, the covariance of half the slope is
    # C⁻¹ ⟨d dᵀ ρ²⟩ C⁻¹ / 4N. A large sample gives it to 1/√(its size), the trials give the spread
    # to 1/√(2T), and the law holds to 1/N.
    rng = np.random.default_rng(34)
    large = 100_000
    x = cap(rng, (large,), degrees) + sigma * rng.normal(size=(large, 3))
    d = x - x.mean(axis=0)
    inverse = np.linalg.inv(d.T @ d / large)
    square = (d**2).sum(axis=1)
    rho = square - square.mean() - d @ inverse @ (d.T @ square / large)
    covariance = inverse @ (d.T * rho**2) @ d @ inverse / (4 * large * count)
    law = np.sqrt(np.diag(covariance))
    tolerance = 4 / np.sqrt(2 * TRIALS) + 4 / np.sqrt(large) + 4 / count
    assert (np.abs(spread / law - 1) <= tolerance).all()


@pytest.mark.parametrize("estimator", [lambda m, s: ugdk(m, s), lambda m, s: pratt(m)])
@pytest.mark.parametrize("level", LEVELS)
def test_ugdk_with_the_true_noise_and_pratt_have_no_bias(level, estimator):
    sigma, degrees, count = LEVELS[level]
    centre = estimator(caps_at(level), sigma).centre
    _, variance = cap_law(degrees)
    # As for GDKE: what is left is of the order of the noise's share times 1/N.
    nonlinear = 4 / count * sigma**2 / variance
    assert (
        np.abs(centre.mean(axis=0)) <= 4 * centre.std(axis=0) / np.sqrt(TRIALS) + nonlinear
    ).all()


def test_noise_that_differs_by_direction_leaves_no_bias_to_its_own_shape():
    degrees, count = 60.0, 300
    rng = np.random.default_rng(38)
    # The largest noise at 30° to the cap's axis.
    turn = np.array([[np.sqrt(0.75), 0, 0.5], [0, 1, 0], [-0.5, 0, np.sqrt(0.75)]])
    shape = turn @ np.diag([0.25, 1.0, 4.0]) @ turn.T
    sigma = 0.03
    noise = rng.normal(size=(TRIALS, count, 3)) * [0.5, 1.0, 2.0] @ turn.T
    m = sphere_moments(cap(rng, (TRIALS, count), degrees) + sigma * noise)[:, None]
    plain, shaped = mgdk(m, sigma).centre, mgdk(m, sigma, shape).centre
    # As for plain noise, with its largest variance for σ².
    height, variance = cap_law(degrees)
    error = 4 * shaped.std(axis=0) / np.sqrt(TRIALS) + 4 / count * 4 * sigma**2 / variance
    assert (np.abs(shaped.mean(axis=0)) <= error).all()
    # Plain noise for it takes too little: a bias to first order of C₀⁻¹ (Σ - σ² I) (x̄ - c).
    across = (1 - height**2 - variance) / 2
    law = (shape - np.eye(3))[:, 2] * sigma**2 * height / [across, across, variance]
    bias = plain.mean(axis=0)
    # The next order is by the noise's share of the variance smaller again.
    second = np.abs(law).max() * 4 * sigma**2 / variance
    assert (np.abs(bias - law) <= 4 * plain.std(axis=0) / np.sqrt(TRIALS) + second).all()
    assert np.abs(bias).max() > 4 * error.max()


@pytest.mark.parametrize("level", LEVELS)
def test_pratt_reaches_the_bound(level):
    sigma, degrees, count = LEVELS[level]
    spread = pratt(caps_at(level)).centre.std(axis=0)
    # A standard deviation is known to 1/√(2T).
    ratio = spread / bound(sigma, degrees, count)
    assert (np.abs(ratio - 1) <= 4 / np.sqrt(2 * TRIALS)).all()


def test_pratt_stays_near_the_bound_where_gdke_is_lost():
    # RMSE over the CRLB, of 10,000 trials: GDKE 13.18 (all of it bias), UGDK with the true σ 3.02,
    # Pratt 1.10; an RMSE of 200 trials varies by 0.016, 0.23 and 0.058.
    sigma, degrees, count, trials = 0.03, 20.0, 1000, 200
    rng = np.random.default_rng(14)
    x = cap(rng, (trials, count), degrees) + sigma * rng.normal(size=(trials, count, 3))
    m = sphere_moments(x)[:, None]
    crlb = np.linalg.norm(bound(sigma, degrees, count))
    ratio = {
        name: np.sqrt((fit.centre**2).sum(axis=1).mean()) / crlb
        for name, fit in (("gdke", gdke(m)), ("ugdk", ugdk(m, sigma)), ("pratt", pratt(m)))
    }
    assert abs(ratio["gdke"] - 13.18) <= 4 * 0.016
    assert abs(ratio["ugdk"] - 3.02) <= 4 * 0.23
    assert abs(ratio["pratt"] - 1.10) <= 4 * 0.058


@pytest.mark.parametrize("level", LEVELS)
def test_pratts_noise_is_the_true_one(level):
    sigma, _, count = LEVELS[level]
    fit = pratt(caps_at(level))
    # N residuals with four parameters: a relative standard deviation of 1/√(2N), and the mean over
    # trials low by a share of 2/N (the degrees of freedom) and 1/(4N) (the root of a variance).
    assert abs(fit.sigma.mean() / sigma - 1) <= 4 / np.sqrt(2 * count * TRIALS) + 3 / count
    assert abs(fit.sigma.std() * np.sqrt(2 * count) / sigma - 1) <= 4 / np.sqrt(2 * TRIALS)


@given(seed=SEEDS, degrees=st.floats(1, 180), sigma=st.floats(0, 2), count=st.integers(5, 100))
@LAWS
def test_pratts_noise_never_runs_away(seed, degrees, sigma, count):
    rng = np.random.default_rng(seed)
    x = cap(rng, (count,), degrees) + sigma * rng.normal(size=(count, 3))
    fit = pratt(sphere_moments(x))
    assert 0 <= fit.sigma < np.sqrt(fit.spread[0])
    assert np.isfinite(fit.centre).all()


def pratt_by_eigenvectors(points):
    """Pratt's fit as it is written: minimise Σ_p Σ_i (a |x|² + b·x + c_p)² at a fixed
    Σ_p N_p (|b|² - 4 a c_p), a generalised eigenproblem in (a, b, c_1 .. c_M); σ² is its root.
    """
    count, markers = sum(map(len, points)), len(points)
    shift = np.concatenate(points).mean(axis=0)
    rows = []
    for p, x in enumerate(points):
        y = x - shift
        own = np.tile(np.eye(markers)[p], (len(x), 1))
        rows.append(np.column_stack([(y**2).sum(axis=1), y, own]))
    design = np.concatenate(rows)
    constraint = np.zeros((4 + markers, 4 + markers))
    constraint[1:4, 1:4] = np.eye(3)
    constraint[0, 4:] = constraint[4:, 0] = [-2 * len(x) / count for x in points]
    roots, vectors = scipy.linalg.eig(design.T @ design / count, constraint)
    # Roots without bound belong to the constraint's own null space.
    real = np.isfinite(roots) & (np.abs(roots.imag) < 1e-12) & (roots.real > 0)
    best = np.flatnonzero(real)[np.argmin(roots[real].real)]
    a, b = vectors[0, best].real, vectors[1:4, best].real
    return shift - b / (2 * a), np.sqrt(roots[best].real)


@pytest.mark.parametrize("counts", [(300,), (300, 300), (200, 200, 200, 200)])
@pytest.mark.parametrize("noise", [0.001, 0.01])
@pytest.mark.parametrize("degrees", [30, 90])
def test_pratt_is_the_generalised_eigenproblem(counts, noise, degrees):
    points, m = markers_on_spheres(np.random.default_rng(15), counts, noise, degrees)
    centre, sigma = pratt_by_eigenvectors(points)
    fit = pratt(m)
    count = counts[0]
    # C, S and the variance of |x|² are divided by N - 1, the eigenproblem's Gram matrix by N: η
    # differs by N / (N - 1), and by the same share of the term 4 η² of Pratt's equation.
    eta = fit.sigma**2
    second = 2 * eta**2 / count / np.trace(m.covariance, axis1=1, axis2=2).mean()
    assert abs(eta * (count - 1) / count - sigma**2) <= second + 1e4 * EPS * eta
    moved = second * np.linalg.norm(fit.centre - m.mean.mean(axis=0)) / (fit.spread[0] - eta)
    np.testing.assert_allclose(fit.centre, centre, rtol=0, atol=moved + rounding(degrees, 1, 0.1))


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
    # means: a share of 4/N of what the noise takes is left (see GDKE's bias above).
    for name, bias in (("gdke", law), ("lls", law), ("ugdk", 0.0), ("mgdk", 0.0), ("igdk", 0.0)):
        centre = np.array([fit_sphere(p, name, sigma=sigma).centre for p in x])
        tolerance = 4 * centre.std(axis=0) / np.sqrt(trials) + 4 / count * law
        assert (np.abs(centre.mean(axis=0) - [0, 0, bias]) <= tolerance).all(), name
        assert law > 8 * tolerance[2]  # there to be seen


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
    """LLS is GDKE, IGDK is UGDK (`test_methods`): what each has of its own is tried."""
    trials, count, degrees, sigma = 200, 300, 135.0, 0.01
    x = noisy_caps(trials, count, degrees, sigma, 19)
    m = sphere_moments(x)[:, None]
    crlb = np.linalg.norm(bound(sigma, degrees, count))
    for name, centres in (
        ("gdke", gdke(m).centre),
        ("ugdk", ugdk(m, sigma).centre),
        ("sgdk", sgdk(m).centre),
        ("pratt", pratt(m).centre),
        ("mle", np.array([fit_sphere(p, "mle").centre for p in x])),
    ):
        # 1/√(2T) at four standard errors; 1/N for what the bound leaves out.
        assert abs(rmse(centres) / crlb - 1) <= 4 / np.sqrt(2 * trials) + 4 / count, name

"""The geometric fit (MLE): its minimum, its Jacobian, its start, when it has converged; and what LLS and MLE refuse."""

import sys

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize
from spheres import DEGENERATE, EPS, STOP, cap, direction, fisher_bound, markers, method_error, rmse

from mocap_skel.errors import MissingExtraError
from mocap_skel.spherefit import (
    METHODS,
    DegenerateSphereError,
    fit_sphere,
    lls,
    mle,
)


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
    tolerance = method_error("mle", x, 70.0, 0.003)
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
        tolerance = 2 * method_error("mle", x, degrees, 0.001)
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
    tolerance = 2 * method_error("mle", x, noise=0.002)
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

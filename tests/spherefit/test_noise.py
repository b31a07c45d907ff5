"""The noise from the points themselves: a level a marker, and what its samples are worth.

A standard deviation from N residuals is known to 1/√(2N) of itself, and one from T trials of them
to 1/√(2NT); everything random is asserted at four standard errors.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from spheres import EPS, LAWS, SEEDS, arc, bound, cap, cap_law, fisher_bound, noisy_markers, rmse

from mocap_skel.spherefit import (
    isotropic,
    marker_noise,
    marker_weights,
    mgdk,
    pratt,
    sphere_moments,
)

# A level for each marker

NOISES = {
    "one marker": ([0.3], [0.003]),
    "alike": ([0.1, 0.2, 0.3], [0.002, 0.002, 0.002]),
    "the nearest is the worst": ([0.1, 0.2, 0.3], [0.006, 0.002, 0.001]),
    "the furthest is the worst": ([0.1, 0.2, 0.3], [0.0005, 0.002, 0.006]),
}


@pytest.mark.parametrize("bounded", [True, False])
@pytest.mark.parametrize("case", NOISES)
def test_each_markers_noise_is_recovered(case, bounded):
    radius, sigma = map(np.array, NOISES[case])
    trials, size = 100, 1000
    x = noisy_markers(np.random.default_rng(1), trials, size, radius, sigma)
    found = marker_noise(sphere_moments(x), bounded=bounded)
    assert found.sigma.shape == (trials, len(radius)) and found.converged.all()
    # Residuals are radial to first order; the next is by (σ/r)² smaller. N residuals and four
    # parameters leave a share of 4/N open.
    second = (sigma / radius) ** 2 + 4 / size
    m = sphere_moments(x)
    fit = mgdk(m, 1.0, isotropic(found.sigma, 3), found.weights if bounded else None)
    # An error e of the centre adds uᵀe to the residuals. Without weights a quiet marker has it from
    # the others: the mean of its variance beside σ², and as it is a square, √2 of that for a spread.
    drift = np.einsum("td,tpde,te->tp", fit.centre, m.covariance, fit.centre).mean(axis=0)
    drift = drift / radius**2 / (2 * sigma**2)
    mean = found.sigma.mean(axis=0) / sigma
    assert (np.abs(mean - 1) <= 4 / np.sqrt(2 * size * trials) + second + drift).all()
    spread = found.sigma.std(axis=0) / sigma * np.sqrt(2 * size)
    wider = np.sqrt(2) * drift * np.sqrt(2 * size)
    assert (np.abs(spread - 1) <= 4 / np.sqrt(2 * trials) + second + wider).all()
    if bounded:
        assert (drift < 0.01).all()  # weights let the quiet ones have their say


def test_more_of_a_markers_points_tell_more_of_its_noise():
    # Markers that are seen 100 and 4000 times: each has the spread of its own count.
    trials, size = 200, 4000
    x = noisy_markers(np.random.default_rng(2), trials, size, [0.2, 0.3], [0.004, 0.002])
    x[:, 0, 100:] = np.nan
    found = marker_noise(sphere_moments(x)).sigma / [0.004, 0.002]
    law = 1 / np.sqrt(2 * np.array([100, size]))
    assert (np.abs(found.std(axis=0) / law - 1) <= 4 / np.sqrt(2 * trials) + 4 / 100).all()


@pytest.mark.parametrize("unit", [1e-3, 1e3])
def test_a_change_of_unit_scales_the_noise_and_no_weight(unit):
    x = noisy_markers(np.random.default_rng(3), 1, 500, [0.1, 0.3], [0.004, 0.002])[0]
    here, there = marker_noise(sphere_moments(x)), marker_noise(sphere_moments(unit * x))
    # A fixed point that is reached to 1e-10 of its squares, a few turns from where it stops.
    np.testing.assert_allclose(there.sigma, unit * here.sigma, rtol=1e-9)
    np.testing.assert_allclose(there.weights, here.weights, rtol=1e-8)


@pytest.mark.parametrize("bounded", [True, False])
def test_the_noise_of_a_batch_is_each_members_own(bounded):
    rng = np.random.default_rng(4)
    x = noisy_markers(rng, 6, 200, [0.1, 0.2, 0.3], [0.004, 0.001, 0.002])
    x = x.reshape(2, 3, 3, 200, 3)
    x[0, 1, 2, ::3] = np.nan
    m = sphere_moments(x)
    found = marker_noise(m, bounded=bounded)
    assert found.sigma.shape == found.weights.shape == (2, 3, 3)
    assert found.converged.shape == (2, 3) and found.converged.all()
    for i in range(2):
        for j in range(3):
            one = marker_noise(m[i, j], bounded=bounded)
            assert one.sigma.shape == (3,) and one.converged.shape == ()
            # The batch goes on until its last member has arrived at 1e-10 of its squares.
            np.testing.assert_allclose(found.sigma[i, j], one.sigma, rtol=1e-9)


@pytest.mark.parametrize("dimension", [2, 4])
def test_circles_and_hyperspheres_have_noise_as_well(dimension):
    rng = np.random.default_rng(5)
    size, sigma = 4000, np.array([0.002, 0.01])
    x = cap(rng, (2, size), 120, 0.5, dimension)
    x = x + sigma[:, None, None] * rng.normal(size=x.shape)
    found = marker_noise(sphere_moments(x)).sigma
    assert (
        np.abs(found / sigma - 1) <= 4 / np.sqrt(2 * size) + (sigma / 0.5) ** 2 + 4 / size
    ).all()


@pytest.mark.parametrize("bounded", [True, False])
def test_perfect_spheres_have_no_noise(bounded):
    x = noisy_markers(np.random.default_rng(6), 1, 200, [0.1, 0.2, 0.3], [0, 0, 0])[0] + 10.0
    found = marker_noise(sphere_moments(x), bounded=bounded)
    # The residual's square is a difference of terms r⁴, of points with eps · 17 m, over 4 r².
    assert (found.sigma**2 <= 16 * EPS * 0.3 * 17).all()
    assert np.isfinite(found.weights).all() and (found.weights.max(axis=-1) == 1).all()
    fit = mgdk(sphere_moments(x), 1.0, isotropic(found.sigma, 3), found.weights)
    # Noise as large as rounding is allowed to be, beside the weakest variance r² sin⁴(θ/2) / 3.
    tolerance = 16 * EPS * 17 / 0.1 / cap_law(60)[1]
    np.testing.assert_allclose(fit.centre, 10.0, rtol=0, atol=tolerance)


def test_it_says_when_the_fixed_point_was_not_reached(monkeypatch):
    x = noisy_markers(np.random.default_rng(16), 1, 200, [0.1, 0.3], [0.004, 0.002])
    assert marker_noise(sphere_moments(x)).converged.all()
    monkeypatch.setattr("mocap_skel.spherefit.noise._MOST_TURNS", 2)
    assert not marker_noise(sphere_moments(x)).converged.any()


def test_a_marker_without_noise_among_others_with_it():
    size, sigma = 2000, np.array([0.0, 0.004])
    x = noisy_markers(np.random.default_rng(7), 1, size, [0.2, 0.3], sigma)[0]
    found = marker_noise(sphere_moments(x))
    # Its residuals are what the other's noise does to the centre: that marker's bound at the most.
    assert found.sigma[0] <= 4 * np.linalg.norm(bound(0.004, 60, size))
    assert abs(found.sigma[1] / 0.004 - 1) <= 4 / np.sqrt(2 * size) + 4 / size


def test_a_marker_that_was_never_seen_has_no_noise_and_no_weight():
    x = noisy_markers(np.random.default_rng(8), 1, 500, [0.2, 0.3], [0.004, 0.002])[0]
    absent = np.concatenate([x, np.full_like(x[:1], np.nan)])
    found, without = marker_noise(sphere_moments(absent)), marker_noise(sphere_moments(x))
    np.testing.assert_allclose(found.sigma[:2], without.sigma, rtol=1e-9)
    assert found.sigma[2] == 0 and found.weights[2] == 0


@pytest.mark.parametrize("bounded", [True, False])
def test_degenerate_members_leave_the_others_alone(bounded):
    rng = np.random.default_rng(9)
    good = noisy_markers(rng, 1, 200, [0.2, 0.3], [0.004, 0.002])[0]
    plane, few, none = np.zeros_like(good), good.copy(), np.full_like(good, np.nan)
    plane[:] = arc(rng, (2, 200), 60)
    few[:, 3:] = np.nan
    m = sphere_moments(np.stack([good, plane, few, none, np.ones_like(good)]))
    found = marker_noise(m, bounded=bounded)
    np.testing.assert_allclose(found.sigma[0], marker_noise(m[0], bounded=bounded).sigma, rtol=1e-9)
    # Nothing is known of the rest, and nothing is made up.
    np.testing.assert_array_equal(np.nan_to_num(found.sigma[1:]), 0.0)


@given(
    seed=SEEDS,
    degrees=st.floats(5, 180),
    sigma=st.floats(0, 0.2),
    size=st.integers(5, 60),
    bounded=st.booleans(),
)
@LAWS
def test_no_noise_exceeds_its_markers_weakest_spread(seed, degrees, sigma, size, bounded):
    x = noisy_markers(np.random.default_rng(seed), 1, size, [0.1, 0.4], [sigma, 0.01], degrees)[0]
    m = sphere_moments(x)
    found = marker_noise(m, bounded=bounded)
    weakest = np.linalg.eigvalsh(m.covariance)[:, 0]
    assert (found.sigma >= 0).all() and (found.sigma**2 < weakest).all()
    fit = mgdk(m, 1.0, isotropic(found.sigma, 3))
    assert np.isfinite(fit.centre).all()


def test_with_little_coverage_the_bound_keeps_the_noise_from_running_away():
    trials, size, degrees, sigma = 400, 100, 20.0, 0.03
    x = noisy_markers(np.random.default_rng(10), trials, size, [1.0], [sigma], degrees)
    m = sphere_moments(x)
    ratio, found = {}, {}
    for bounded in (True, False):
        found[bounded] = marker_noise(m, bounded=bounded)
        fit = mgdk(m, 1.0, isotropic(found[bounded].sigma, 3))
        ratio[bounded] = rmse(fit.centre) / np.linalg.norm(bound(sigma, degrees, size))
    limit = np.sqrt(np.linalg.eigvalsh(m.covariance)[..., 0])
    gone = found[False].sigma > 0.99 * limit
    assert 0 < gone.mean() < 0.1  # now and then all of the cap's depth is taken for noise
    assert ratio[False] > 10
    # With the bound it is Pratt's fit, whose own ratio is 1.2 here.
    closed = rmse(pratt(m).centre) / np.linalg.norm(bound(sigma, degrees, size))
    assert ratio[True] == pytest.approx(closed, rel=1e-3)
    assert ratio[True] < 2
    # Never above Pratt's; its mean is the true noise to 1/√(2NT), and low by 4/N.
    assert (found[True].sigma[:, 0] <= pratt(m).sigma * (1 + 1e-9)).all()
    assert abs(found[True].sigma.mean() / sigma - 1) <= 4 / np.sqrt(2 * size * trials) + 4 / size


# What a marker's samples are worth


def test_the_weight_is_the_inverse_variance_of_what_is_regressed():
    # |x - c|² - r² of N samples has the standard deviation 2 r σ, to first order in σ / r.
    rng = np.random.default_rng(11)
    size, radius, sigma = 20_000, np.array([0.1, 0.2, 0.4]), np.array([0.001, 0.004, 0.001])
    x = noisy_markers(rng, 1, size, radius, sigma, 180.0)[0]
    deviation = (x**2).sum(axis=-1).std(axis=1)
    weights = marker_weights(radius, sigma)
    law = (deviation.min() / deviation) ** 2
    # Two standard deviations are compared, each known to 1/√(2N), in a square.
    assert (np.abs(weights / law - 1) <= 4 * 2 * np.sqrt(2 / (2 * size)) + 1e-3).all()
    np.testing.assert_allclose(weights, [1, 1 / 64, 1 / 16], rtol=8 * EPS)


@given(seed=SEEDS, count=st.integers(1, 5), scale=st.floats(1e-6, 1e6))
@LAWS
def test_only_ratios_count_to_a_weight_and_the_best_has_one(seed, count, scale):
    rng = np.random.default_rng(seed)
    radius, sigma = rng.uniform(0.01, 1, (2, 4, count))
    weights = marker_weights(radius, sigma)
    assert weights.shape == (4, count)
    np.testing.assert_array_equal(weights.max(axis=1), 1.0)
    assert (weights > 0).all()
    np.testing.assert_allclose(marker_weights(radius, scale * sigma), weights, rtol=16 * EPS)


WEIGHTS = {
    "alike": ([0.2, 0.2], [0.01, 0.01], [1, 1]),
    "one level for all": ([0.1, 0.2], 0.01, [1, 1 / 4]),
    "one marker": ([0.3], [0.02], [1]),
    # It would have all the weight: it counts like the best of the others.
    "one without noise": ([0.1, 0.1, 0.1], [0.0, 0.01, 0.02], [1, 1, 1 / 4]),
    "all without noise": ([0.1, 0.2], [0.0, 0.0], [1, 1]),
    "one without a radius": ([0.1, np.nan, 0.2], [0.01, 0.01, 0.01], [1, 0, 1 / 4]),
    "one without a radius, one without noise": ([np.nan, 0.1], [0.01, 0.0], [0, 1]),
    "the only one with a radius has noise": ([np.nan, 0.1], [0.0, 0.01], [0, 1]),
    "none with a radius": ([np.nan, np.nan], [0.01, 0.02], [0, 0]),
    "a batch": ([[0.1, 0.2], [np.nan, 0.2]], [0.01, 0.01], [[1, 1 / 4], [0, 1]]),
}


@pytest.mark.parametrize("case", WEIGHTS)
def test_weights_of_named_cases(case):
    radius, sigma, expected = WEIGHTS[case]
    np.testing.assert_allclose(marker_weights(radius, sigma), expected, rtol=8 * EPS)


@pytest.mark.parametrize("known", [True, False])
def test_weights_by_noise_make_the_centre_better(known):
    # Markers of 1 mm and 6 mm about one centre, their noise known or found from the points.
    rng = np.random.default_rng(12)
    trials, size, radius, sigma = 400, 300, np.array([0.2, 0.2]), np.array([0.001, 0.006])
    x = noisy_markers(rng, trials, size, radius, sigma)
    m = sphere_moments(x)
    if known:
        shape, weights = isotropic(sigma, 3), marker_weights(radius, sigma)
    else:
        found = marker_noise(m)
        shape, weights = isotropic(found.sigma, 3), found.weights
        assert found.weights.shape == (trials, 2)
    weighted, plain = mgdk(m, 1.0, shape, weights).centre, mgdk(m, 1.0, shape).centre
    # The same points for both: the mean difference of squared errors at four standard errors.
    difference = (plain**2).sum(axis=1) - (weighted**2).sum(axis=1)
    assert difference.mean() > 4 * difference.std() / np.sqrt(trials)
    # And it is as good as can be: 1/√(2T) at four standard errors, and 6 mm of a cap's depth of
    # 29 mm, squared, in the little weight that this marker has.
    x = noisy_markers(np.random.default_rng(12), 1, size, radius, [0, 0])[0]
    crlb = np.sqrt(np.trace(fisher_bound(x, sigma)))
    sampling = 4 / np.sqrt(size)  # the bound is that of one sample of points
    assert abs(rmse(weighted) / crlb - 1) <= 4 / np.sqrt(2 * trials) + (6 / 29) ** 2 + sampling


def test_a_weight_of_zero_is_a_marker_that_is_not_there():
    x = noisy_markers(np.random.default_rng(13), 1, 200, [0.2, 0.3], [0.002, 0.004])[0]
    m = sphere_moments(x)
    none, alone = mgdk(m, 0.002, weights=[1.0, 0.0]), mgdk(m[:1], 0.002)
    np.testing.assert_allclose(none.centre, alone.centre, rtol=0, atol=100 * EPS)
    np.testing.assert_allclose(none.radius[0], alone.radius[0], rtol=100 * EPS)
    assert np.isfinite(none.radius[1])
    # Only ratios count, and equal weights are none.
    for weights in ([1, 1], [7.0, 7.0]):
        np.testing.assert_allclose(
            mgdk(m, 0.002, weights=weights).centre, mgdk(m, 0.002).centre, rtol=0, atol=100 * EPS
        )


def test_weighted_markers_follow_the_formula_of_thesis_6_6_with_their_share():
    rng = np.random.default_rng(14)
    x = noisy_markers(rng, 1, 100, [0.1, 0.2, 0.3], [0.005] * 3)[0] + 0.5
    x[0, 60:] = np.nan
    m, weights, sigma = sphere_moments(x), np.array([0.2, 1.0, 0.5]), 0.004
    part = weights * (m.count - 1)
    clean = part[:, None, None] * (m.covariance - sigma**2 * np.eye(3))
    right = np.einsum("pde,pe->d", clean, m.mean) + part @ m.third / 2
    centre = np.linalg.solve(clean.sum(axis=0), right)
    np.testing.assert_allclose(mgdk(m, sigma, weights=weights).centre, centre, atol=1000 * EPS)


def test_isotropic_noise_is_a_unit_matrix_times_the_variance():
    got = isotropic([[0.1, 0.2], [0.0, 3.0]], 4)
    assert got.shape == (2, 2, 4, 4)
    np.testing.assert_array_equal(got[0, 1], 0.2**2 * np.eye(4))
    m = sphere_moments(noisy_markers(np.random.default_rng(15), 1, 100, [0.2], [0.01])[0])
    np.testing.assert_allclose(
        mgdk(m, 1.0, isotropic([0.01], 3)).centre, mgdk(m, 0.01).centre, rtol=0, atol=100 * EPS
    )

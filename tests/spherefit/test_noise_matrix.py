"""The whole noise matrix from the radial residuals about a fit.

Everything random is asserted at four standard errors.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from spheres import EPS, LAWS, SEEDS, cap, cap_law, even_cap, rotation

from mocap_skel.spherefit import (
    gdke,
    mgdk,
    pratt,
    radial_noise_matrix,
    sphere_moments,
)


def about(points, centre):
    """A fit of these points that is told the centre, so that only the residuals are to be seen."""
    return replace(gdke(sphere_moments(points)), centre=np.asarray(centre, dtype=float))


def skewed(rng, scale=(0.001, 0.002, 0.004)):
    """A noise matrix with axes in any direction, and its root."""
    root = rotation(rng) * scale
    return root @ root.T, root


def matrix_error(u, sigma):
    """Standard errors of the entries of Σ̂ from squared residuals along unit vectors u (N, 3), (3, 3).

    The square of normal noise with the variance v = uᵀΣu varies by √2 v; a regression on the six
    products of u passes that on by its inverse.
    """
    i, j = np.triu_indices(3)
    products = u[:, i] * u[:, j] * np.where(i == j, 1, 2)
    variance = np.einsum("ni,ij,nj->n", u, sigma, u)
    inverse = np.linalg.inv(products.T @ products)
    covariance = inverse @ (products.T * (2 * variance**2)) @ products @ inverse
    result = np.zeros((3, 3))
    result[i, j] = np.sqrt(np.diag(covariance))
    return np.maximum(result, result.T)


@pytest.mark.parametrize("degrees", [100, 180])
@pytest.mark.parametrize("count", [1, 3])
def test_noise_that_differs_by_direction_is_recovered_on_a_wide_cap(degrees, count):
    rng = np.random.default_rng(16)
    sigma, root = skewed(rng)
    truth = np.stack([cap(rng, (30_000 // count,), degrees, 0.2 + 0.1 * p) for p in range(count)])
    x = truth + rng.normal(size=truth.shape) @ root.T
    x[:, ::50] = np.nan
    there = truth[np.isfinite(x).all(axis=-1)]
    u = there / np.linalg.norm(there, axis=-1, keepdims=True)
    error = matrix_error(u, sigma)
    # The pull to the isotropic level: a hundredth of the points for all nine entries, against what
    # they weigh, for an evenly covered sphere 2/15 of the points at least.
    i, j = np.triu_indices(3)
    products = u[:, i] * u[:, j] * np.where(i == j, 1, 2)
    weakest = np.linalg.eigvalsh(products.T @ products / len(u))[0]
    pull = 0.01 / 9 / weakest * np.linalg.norm(sigma - np.trace(sigma) / 3 * np.eye(3))
    # Residuals are radial to first order, and their mean takes one of N.
    second = np.trace(sigma) * (np.trace(sigma) / 0.2**2 + 4 / len(u))
    for fit in (about(x, [0, 0, 0]), pratt(sphere_moments(x))):
        got = radial_noise_matrix(x, fit)
        assert (np.abs(got - sigma) <= 4 * error + pull + second).all()
    assert np.abs(sigma - np.trace(sigma) / 3 * np.eye(3)).max() > 5 * (4 * error + pull).max()


@pytest.mark.parametrize("degrees", [90, 180])
def test_squares_that_are_exactly_those_of_a_matrix_give_it_but_for_the_pull(degrees):
    sigma, _ = skewed(np.random.default_rng(24))
    u = even_cap(degrees, 60, 60)
    size = np.sqrt(np.einsum("ni,ij,nj->n", u, sigma, u))[:, None]
    x = np.concatenate([u * (0.2 + size), u * (0.2 - size)])
    got = radial_noise_matrix(x, about(x, [0, 0, 0]))
    # As above, to the level of these points: a hundredth of them for nine entries.
    i, j = np.triu_indices(3)
    products = u[:, i] * u[:, j] * np.where(i == j, 1, 2)
    weakest = np.linalg.eigvalsh(products.T @ products / len(u))[0]
    away = np.linalg.norm(sigma - (size**2).mean() * np.eye(3))
    assert 0 < np.abs(got - sigma).max() <= 0.01 / 9 / weakest * away < 0.03 * away


def test_noise_that_is_the_same_in_all_directions_is_the_unit_matrix():
    rng = np.random.default_rng(17)
    truth = cap(rng, (20_000,), 180, 0.2)
    x = truth + 0.002 * rng.normal(size=truth.shape)
    got = radial_noise_matrix(x, about(x, [0, 0, 0]))
    error = matrix_error(truth / 0.2, 0.002**2 * np.eye(3))
    second = 3 * 0.002**2 * 0.01**2
    assert (np.abs(got - 0.002**2 * np.eye(3)) <= 4 * error + second).all()


@given(seed=SEEDS, degrees=st.floats(1, 180), size=st.integers(4, 60), noise=st.floats(0, 0.1))
@LAWS
def test_the_matrix_is_symmetric_and_never_negative(seed, degrees, size, noise):
    rng = np.random.default_rng(seed)
    _, root = skewed(rng, noise * np.array([0.0, 1.0, 3.0]))
    x = cap(rng, (size,), degrees, 0.2)
    x = x + rng.normal(size=x.shape) @ root.T
    got = radial_noise_matrix(x, about(x, [0, 0, 0]))
    np.testing.assert_allclose(got, got.T, rtol=0, atol=4 * EPS * np.abs(got).max())
    values = np.linalg.eigvalsh((got + got.T) / 2)
    assert (values >= -16 * EPS * values[-1]).all()


@pytest.mark.parametrize("degrees", [5, 30, 90, 180])
def test_the_matrix_turns_with_the_points(degrees):
    rng = np.random.default_rng(18)
    _, root = skewed(rng)
    x = cap(rng, (500,), degrees, 0.2)
    x = x + rng.normal(size=x.shape) @ root.T
    here = radial_noise_matrix(x, about(x, [0, 0, 0]))
    for _ in range(5):
        turn = rotation(rng)
        there = radial_noise_matrix(x @ turn.T, about(x @ turn.T, [0, 0, 0]))
        # Rounding of the distances, 0.2 m, beside residuals of 1 mm; and of the regression, which
        # the pull keeps to a condition of 1000.
        tolerance = 1000 * EPS * (0.2 / 0.001) * np.abs(here).max()
        np.testing.assert_allclose(there, turn @ here @ turn.T, rtol=0, atol=tolerance)


def test_the_matrix_moves_with_no_shift_and_scales_with_the_square_of_the_unit():
    rng = np.random.default_rng(19)
    _, root = skewed(rng)
    x = cap(rng, (500,), 120, 0.2)
    x = x + rng.normal(size=x.shape) @ root.T
    here = radial_noise_matrix(x, about(x, [0, 0, 0]))
    shifted = radial_noise_matrix(x + [1.0, 2.0, 3.0], about(x, [1.0, 2.0, 3.0]))
    # Points are rounded to eps · 4 m, of residuals of 1 mm.
    np.testing.assert_allclose(shifted, here, rtol=0, atol=100 * EPS * 4000 * np.abs(here).max())
    scaled = radial_noise_matrix(1000 * x, about(1000 * x, [0, 0, 0]))
    np.testing.assert_allclose(
        scaled, 1e6 * here, rtol=0, atol=1e6 * 1e4 * EPS * np.abs(here).max()
    )


@pytest.mark.parametrize("degrees", [2, 5])
def test_along_what_a_small_cap_does_not_show_noise_is_at_the_level_of_what_it_shows(degrees):
    rng = np.random.default_rng(20)
    size = 5000
    # Three times as much noise across as along the axis, and turned so that nothing is along x, y, z.
    turn = rotation(rng)
    x = cap(rng, (size,), degrees, 0.2) + rng.normal(size=(size, 3)) * [0.003, 0.003, 0.001]
    got = turn.T @ radial_noise_matrix(x @ turn.T, about(x, [0, 0, 0])) @ turn
    # Of N squares the mean is known to √(2/N) of it; the noise across is 8 more, seen by sin² θ at most.
    level, sine = 0.001**2, np.sin(np.radians(degrees))
    known = 4 * np.sqrt(2 / size)
    axial = known + 8 * sine**2
    # What is across is told by u_x², in the mean sin² θ / 4 and its square sin⁴ θ / 8, and by
    # 2 u_x u_z, whose square is sin² θ: beside a pull of a hundredth for nine entries.
    pull = 0.01 / 9
    across = axial + (known * sine**2 / np.sqrt(8) + 8 * sine**4 / 8) / pull
    mixed = known * sine / (sine**2 + pull)
    tolerance = np.full((3, 3), across)
    tolerance[2], tolerance[:, 2], tolerance[2, 2] = mixed, mixed, axial
    assert (np.abs(got / level - np.eye(3)) <= tolerance).all()
    assert np.trace(got) < 0.5 * (9 + 9 + 1) * level


def test_a_perfect_sphere_has_no_matrix():
    x = cap(np.random.default_rng(21), (200,), 60, 0.1)
    got = radial_noise_matrix(x, gdke(sphere_moments(x)))
    assert np.abs(got).max() <= (64 * EPS * 0.1) ** 2 / cap_law(60)[1]


def test_points_that_are_missing_or_on_the_centre_say_nothing_of_the_matrix():
    rng = np.random.default_rng(22)
    x = cap(rng, (2, 300), 120, 0.2)
    x = x + 0.002 * rng.normal(size=x.shape)
    expected = radial_noise_matrix(x, about(x, [0, 0, 0]))
    gaps = np.concatenate([x, np.full((2, 40, 3), np.nan)], axis=1)
    order = rng.permutation(340)
    got = radial_noise_matrix(gaps[:, order], about(x, [0, 0, 0]))
    tolerance = 1e4 * EPS * np.abs(expected).max()
    np.testing.assert_allclose(got, expected, rtol=0, atol=tolerance)
    # A marker that was never seen.
    never = np.concatenate([x, np.full_like(x[:1], np.nan)])
    got = radial_noise_matrix(never, about(x, [0, 0, 0]))
    np.testing.assert_allclose(got, expected, rtol=0, atol=tolerance)
    # One marker with its axis and without.
    one = radial_noise_matrix(x[:1], about(x[:1], [0, 0, 0]))
    alone = radial_noise_matrix(x[0], about(x[0], [0, 0, 0]))
    np.testing.assert_array_equal(alone, one)


def test_mgdk_with_the_matrix_of_the_points_has_less_bias_than_with_a_level():
    rng = np.random.default_rng(23)
    trials, size, degrees = 60, 2000, 90.0
    scale = np.array([0.01, 0.01, 0.05])
    x = cap(rng, (trials, size), degrees) + rng.normal(size=(trials, size, 3)) * scale
    plain, shaped = [], []
    for points in x:
        m = sphere_moments(points)
        first = pratt(m)
        plain.append(first.centre)
        shaped.append(mgdk(m, 1.0, radial_noise_matrix(points, first)).centre)
    plain, shaped = np.array(plain), np.array(shaped)
    difference = (plain**2).sum(axis=1) - (shaped**2).sum(axis=1)
    assert difference.mean() > 4 * difference.std() / np.sqrt(trials)

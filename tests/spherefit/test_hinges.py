"""Directions that stand above the noise or do not: hinges, lines, points at rest (SGDK).

Rounding is as in `test_estimators`; what is random is asserted at four standard errors.
"""

import numpy as np
import pytest
from spheres import EPS, cap, direction, hinge, markers_on_spheres, rounding

from mocap_skel.spherefit import (
    gdke,
    mgdk,
    pratt,
    sgdk,
    sphere_moments,
)


def off_axis(centre, axis, place):
    away = centre - place
    return np.linalg.norm(away - (away * axis).sum(axis=-1, keepdims=True) * axis, axis=-1)


@pytest.mark.parametrize("sigma", [None, 0.0, 0.001])
@pytest.mark.parametrize("heights", [(0.0,), (-0.1, 0.1), (0.0, 0.05, 0.2)])
def test_an_exact_hinge_has_rank_two_and_its_axis_as_null_vector(heights, sigma):
    x, axis, place = hinge(np.random.default_rng(18), 100, heights)
    fit = sgdk(sphere_moments(x), sigma)
    assert (fit.rank == 2).all()
    # Rounding for an arc that covers 45°, at a distance of a metre.
    tolerance = rounding(45, 1.0, 0.2)
    assert (1 - np.abs((fit.null * axis).sum(axis=1)) <= tolerance).all()
    assert (off_axis(fit.centre, axis, place) <= tolerance).all()
    level = ((fit.centre - x.mean(axis=(1, 2))) * axis).sum(axis=1)
    assert (np.abs(level) <= tolerance).all()


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("heights", [(0.0,), (-0.1, 0.1), (0.0, 0.05, 0.2)])
def test_a_noisy_hinge_has_rank_two_with_its_noise_given_or_not(heights, known):
    noise, count, markers = 0.002, 500, len(heights)
    x, axis, place = hinge(np.random.default_rng(19), 200, heights, noise, count=count)
    fit = sgdk(sphere_moments(x), noise if known else None)
    assert (fit.rank == 2).all()
    # Circle CRLB along the arc's axis (thesis 6.6), θ = 45°; radii differ, the smallest bounds it.
    theta = np.pi / 4
    below = 2 * theta * (theta + np.cos(theta) * np.sin(theta)) - 4 * np.sin(theta) ** 2
    along = noise * np.sqrt(4 * theta**2 / below / (count * markers))
    error = off_axis(fit.centre, axis, place)
    assert np.sqrt((error**2).mean()) <= 2 * along
    # The tilt of a plane through points of standard deviation s is known to noise / (s √N).
    tilt = noise * np.sqrt((1 / fit.spread[:, 1:]).sum(axis=1) / (count * markers))
    sine = np.linalg.norm(np.cross(fit.null, axis), axis=1)
    assert np.sqrt(((sine / tilt) ** 2).mean()) <= 1.5
    level = ((fit.centre - x.mean(axis=(1, 2))) * fit.null).sum(axis=1)
    # The mean of numbers of a metre, summed in another order.
    assert (np.abs(level) <= 100 * EPS).all()


@pytest.mark.parametrize("markers", [1, 2])
def test_points_on_a_line_have_rank_one(markers):
    rng = np.random.default_rng(20)
    line = np.stack([direction(rng) for _ in range(100)])
    x = rng.uniform(-0.2, 0.2, (100, markers, 50))[..., None] * line[:, None, None]
    x = x + rng.normal(size=(100, markers, 1, 3))
    fit = sgdk(sphere_moments(x))
    assert (fit.rank == 1).all()
    assert (np.abs((fit.axes[:, :, 2] * line).sum(axis=1)) >= 1 - 1e-9).all()
    # Across the line the centre stays level with the mean of the points.
    away = fit.centre - x.mean(axis=(1, 2))
    assert (np.linalg.norm(np.cross(away, line), axis=1) <= 1e-9).all()


@pytest.mark.parametrize("sigma", [None, 0.001])
def test_points_that_do_not_move_have_rank_none_and_their_mean(sigma):
    rng = np.random.default_rng(21)
    place = 10 * rng.normal(size=(100, 2, 1, 3))
    x = np.repeat(place, 50, axis=2)
    # The second half moves by rounding, a unit in the last place at a time.
    x[50:] = np.nextafter(x[50:], rng.choice([-np.inf, np.inf], x[50:].shape))
    fit = sgdk(sphere_moments(x), sigma)
    assert (fit.rank == 0).all()
    np.testing.assert_allclose(fit.centre, place.mean(axis=(1, 2)), rtol=4 * EPS, atol=40 * EPS)


def test_well_covered_points_are_no_case_for_sgdk():
    _, m = markers_on_spheres(np.random.default_rng(22), (300, 300), 0.002)
    given_noise, plain = sgdk(m, 0.001), mgdk(m, 0.001)
    np.testing.assert_array_equal(given_noise.centre, plain.centre)
    np.testing.assert_array_equal(given_noise.radius, plain.radius)
    np.testing.assert_array_equal(sgdk(m).centre, pratt(m).centre)
    assert given_noise.rank == 3 and np.isnan(given_noise.null).all()


def test_noise_larger_than_the_points_allow_gives_way_to_pratts():
    _, m = markers_on_spheres(np.random.default_rng(23), (300, 300), 0.002)
    fit = sgdk(m, 0.05)
    assert fit.sigma == pratt(m).sigma < 0.003
    np.testing.assert_array_equal(fit.centre, pratt(m).centre)


def test_a_direction_is_dropped_where_noise_makes_half_of_its_variance():
    # The thesis's criterion: σ < √λ_min of the points without their noise, so σ² < half of what
    # they have with it. More noise than the cap has depth, so that Pratt's lets σ come that far.
    rng = np.random.default_rng(24)
    m = sphere_moments(cap(rng, (1000,), 30) + 0.06 * rng.normal(size=(1000, 3)))
    limit = np.sqrt(gdke(m).spread[0] / 2)
    assert limit < 0.9 * pratt(m).sigma
    assert sgdk(m, 0.999 * limit).rank == 3
    assert sgdk(m, 1.001 * limit).rank == 2


def hemisphere_with_noise_along_x():
    """A direction with more noise than motion that has still more motion left than another.

    A hemisphere cut at |x| < 0.92, where heights are even, has a variance of 0.92²/3 along x and
    1/12 or less along its axis z. With another 0.08 for noise and 0.19 of it in the shape, 0.172 is
    left along x, less than the noise there, and 0.16 along z, far more than its 0.002.
    """
    rng = np.random.default_rng(39)
    x = cap(rng, (20000,), 90)
    x = x[np.abs(x[:, 0]) < 0.92]
    x = x + np.sqrt(0.08) * rng.normal(size=x.shape)
    # Mirror images of them all, so that x, y and z are the axes of the sample as well.
    x = np.concatenate([x * [a, b, 1] for a in (1, -1) for b in (1, -1)])
    noise = np.array([0.19, 0.002, 0.002])
    sigma = np.sqrt(noise.mean())
    assert sigma < pratt(sphere_moments(x)).sigma  # which would take its place
    return x, sgdk(sphere_moments(x), sigma, np.diag(noise) / sigma**2)


def test_a_direction_is_dropped_for_the_noise_in_that_direction():
    x, fit = hemisphere_with_noise_along_x()
    assert fit.rank == 2
    # Level with the mean along the direction that was left out; the null vector is that direction.
    assert abs(fit.null[0]) == pytest.approx(1, abs=1e-9)
    assert abs((fit.centre - x.mean(axis=0)) @ fit.null) <= 100 * EPS

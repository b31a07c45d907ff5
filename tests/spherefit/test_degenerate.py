"""Points that do not determine a sphere: an error in words for each method, NaN in a batch."""

import numpy as np
import pytest
from spheres import DEGENERATE, EPS, STRICT, arc, cap, direction, hinge, linear_error, rotation

from mocap_skel.errors import MocapSkelError
from mocap_skel.spherefit import (
    METHODS,
    DegenerateSphereError,
    fit_sphere,
    gdke,
    mgdk,
    sgdk,
    sphere_moments,
)


def test_planes_and_lines_however_turned_are_degenerate():
    rng = np.random.default_rng(40)
    plane, _, _ = hinge(rng, 200, (0.0,))
    turn = np.stack([rotation(rng) for _ in range(200)])
    line = rng.uniform(-1, 1, (200, 50, 1)) * turn[:, None, :, 0] + turn[:, None, :, 1]
    for sigma in (0.0, 0.001):
        assert np.isnan(mgdk(sphere_moments(plane), sigma, strict=False).centre).all()
        assert np.isnan(mgdk(sphere_moments(line)[:, None], sigma, strict=False).centre).all()


def test_noise_as_large_as_the_spread_is_an_error_with_a_remedy():
    m = sphere_moments(cap(np.random.default_rng(28), (100,), 30))
    weakest = np.sqrt(gdke(m).spread[0])
    assert np.isfinite(mgdk(m, 0.99 * weakest).centre).all()
    with pytest.raises(DegenerateSphereError, match="noise is no smaller") as caught:
        mgdk(m, 1.01 * weakest)
    assert "sgdk" in caught.value.hint
    assert isinstance(caught.value, ValueError)


def test_fewer_than_two_points_are_an_error_even_of_sgdk():
    with pytest.raises(DegenerateSphereError, match="fewer than two"):
        sgdk(sphere_moments(np.ones((1, 3))))


def test_bad_members_of_a_batch_are_nan_and_only_they():
    rng = np.random.default_rng(29)
    good = cap(rng, (50,), 90) + 0.01 * rng.normal(size=(50, 3))
    sets = [good]
    for points, _ in DEGENERATE.values():
        full = np.full((50, 3), np.nan)
        full[: len(points)] = points
        sets.append(full)
    m = sphere_moments(np.stack(sets))[:, None]
    bad = np.arange(len(sets)) > 0
    for sigma in (0.0, 0.01):
        fit = mgdk(m, sigma, strict=False)
        np.testing.assert_array_equal(np.isnan(fit.centre), np.repeat(bad[:, None], 3, axis=1))
        np.testing.assert_array_equal(np.isnan(fit.radius[:, 0]), bad)
        np.testing.assert_array_equal(fit.rank == 3, ~bad)
        np.testing.assert_allclose(fit.centre[0], mgdk(m[0], sigma).centre, atol=10 * EPS)
    with pytest.raises(DegenerateSphereError):
        gdke(m)


def test_too_much_noise_is_nan_for_that_member_only():
    m = sphere_moments(cap(np.random.default_rng(30), (2, 100), 30))[:, None]
    fit = mgdk(m, [0.001, 1.0], strict=False)
    assert np.isfinite(fit.centre[0]).all() and np.isnan(fit.centre[1]).all()
    assert np.isnan(mgdk(m[0, 0], 1.0, strict=False).radius)


# A noise level changes only what these methods are asked.
LEVELS = dict.fromkeys(("ugdk", "mgdk", "igdk"), (None, 0.0, 0.001))


@pytest.mark.parametrize("name", STRICT)
def test_degenerate_points_are_an_error_in_words(name):
    rng = np.random.default_rng(26)
    for case, (points, message) in DEGENERATE.items():
        for sigma in LEVELS.get(name, (None,)):
            for x in (points, points @ rotation(rng).T):
                with pytest.raises(DegenerateSphereError, match=message) as caught:
                    fit_sphere(x, name, sigma=sigma)
                assert isinstance(caught.value, MocapSkelError), case
                assert isinstance(caught.value, ValueError), case


@pytest.mark.parametrize("name", METHODS)
def test_an_array_without_points_is_degenerate_to_every_method(name):
    for shape in ((0, 3), (2, 0, 3)):
        for sigma in LEVELS.get(name, (None,)):
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
def test_noise_as_large_as_the_spread_is_an_error(name):
    x = cap(np.random.default_rng(14), (200,), 30)
    # One, two or all three of the directions are lost in the noise: a cap, a flat piece, nearly a line.
    for scale in ([1, 1, 1], [1, 1, 0.01], [1, 0.01, 0.01]):
        with pytest.raises(DegenerateSphereError, match="noise"):
            fit_sphere(x * scale, name, sigma=0.1)


@pytest.mark.parametrize("name", STRICT)
def test_a_sphere_takes_one_point_more_than_dimensions(name):
    for dimension in (2, 3, 4):
        rng = np.random.default_rng(15)
        x = cap(rng, (dimension + 1,), 180, 1.0, dimension)
        # As many equations as unknowns: whatever the points, their condition is what counts.
        tolerance = max(linear_error(x[None]), 1e5 * EPS)
        np.testing.assert_allclose(fit_sphere(x, name, sigma=0.0).centre, 0.0, atol=tolerance)
        with pytest.raises(DegenerateSphereError, match=f"at least {dimension + 1} points"):
            fit_sphere(x[:-1], name, sigma=0.0)

"""IGDK: a centre after each sample, those of many samples at once, and a state that does not grow."""

import inspect
import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from spheres import EPS, LAWS, SEEDS, arc, assert_same, cap, direction, markers, rotation, rounding

from mocap_skel.spherefit import (
    fit_sphere,
    gdke,
    igdk,
    mgdk,
    moments,
    pratt,
    running_centres,
    sphere_moments,
)

# Samples that `running_centres` works on at once.
BLOCK = moments.CHUNK // 8


def running_error(x, sigma=0.0):
    """Error of the centre of running sums over points (..., M, n, D): nan where there is no centre.

    S is a running sum of terms up to (2 r)³ about the first sample and C of (2 r)²; each is rounded
    √n times, and the centre is their quotient by the weakest variance without its noise.
    """
    m = sphere_moments(x)
    fit = mgdk(m, sigma, strict=False)
    seen = np.isfinite(x)
    most, least = (np.where(seen, x, far) for far in (-np.inf, np.inf))
    width = most.max(axis=(-3, -2)) - least.min(axis=(-3, -2))
    width = np.linalg.norm(np.where(np.isfinite(width), width, np.nan), axis=-1)
    weakest = fit.spread[..., 0] - sigma**2
    reach = np.abs(m.mean).max(axis=(-2, -1))
    away = np.linalg.norm(fit.centre[..., None, :] - m.mean, axis=-1).max(axis=-1)
    with np.errstate(divide="ignore"):
        sums = width**2 * (width + away) / weakest
    return 8 * EPS * (np.sqrt(m.count.sum(axis=-1)) * sums + reach)


def assert_same_path(one, other, tolerance):
    """Centres (N, D) agree to their tolerances (N,), and are missing at the same samples."""
    np.testing.assert_array_equal(np.isnan(one), np.isnan(other))
    known = np.isfinite(other[:, 0])
    assert (np.abs(one - other)[known] <= tolerance[known, None]).all()


def so_far(x):
    """Points (M, N, D) as N sets (N, M, N, D): those of the first sample, of the first two, ..."""
    later = np.arange(x.shape[1]) > np.arange(x.shape[1])[:, None]
    return np.where(later[:, None, :, None], np.nan, x)


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
    fits = list(igdk(x.swapaxes(0, 1), sigma))
    seen = so_far(x)
    batch = mgdk(sphere_moments(seen), sigma, strict=False)
    np.testing.assert_array_equal(
        [fit.count for fit in fits], np.isfinite(seen).all(axis=3).sum(axis=2)
    )
    assert_same_path(
        np.array([fit.centre for fit in fits]), batch.centre, running_error(seen, sigma)
    )
    assert np.isfinite(fits[-1].centre).all()


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
    assert_same_path(one, other, running_error(so_far(x), sigma))


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

"""Moments of points: the direct sums, merged, in chunks, in any order, layout and kind of number.

Tolerances come from rounding: points at a distance d from the origin carry errors of eps d, and a sum of N
terms is rounded √N times.
"""

import tracemalloc
from fractions import Fraction
from functools import reduce

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from spheres import EPS, LAWS, SEEDS, assert_same, cap, direction, rotation, rounding

from mocap_skel.spherefit import (
    Moments,
    gdke,
    merge_moments,
    moments,
    moved_moments,
    pratt,
    sphere_moments,
)


@pytest.mark.parametrize("dimension", [2, 3, 4])
@pytest.mark.parametrize(("width", "distance"), [(0.1, 0.0), (0.1, 10.0), (1e-6, 10.0)])
def test_moments_are_the_direct_sums(dimension, width, distance):
    rng = np.random.default_rng(1)
    x = width * rng.normal(size=(200, dimension)) + distance * direction(rng, dimension)
    exact = np.array([[Fraction(v) for v in row] for row in x])
    mean = exact.sum(axis=0) / 200
    d = exact - mean
    square = (d**2).sum(axis=1)
    expected = Moments(
        np.array(200.0),
        mean.astype(float),
        (d.T @ d / 199).astype(float),
        (d.T @ square / 199).astype(float),
        np.array(float(square @ square / 199)),
    )
    got = sphere_moments(x)
    np.testing.assert_allclose(got.mean, expected.mean, rtol=0, atol=2 * EPS * (width + distance))
    # The digits of the distance are gone before anything is squared: deviations from a mean that is
    # as near as rounding allows are exact but for that, and what is left of it is taken out again.
    # ⟨|d|⁴⟩ is 24 widths⁴ in 4D, and its error that of d times the power: 4 · 24.
    got = Moments(got.count, expected.mean, got.covariance, got.third, got.fourth)
    assert_same(got, expected, 100 * EPS, width)


@given(
    seed=SEEDS,
    sizes=st.lists(st.integers(0, 30), min_size=2, max_size=5),
    dimension=st.integers(2, 4),
    distance=st.sampled_from([0.0, 1.0, 10.0]),
)
@LAWS
def test_merged_moments_are_those_of_all_points(seed, sizes, dimension, distance):
    rng = np.random.default_rng(seed)
    shift = distance * direction(rng, dimension)
    parts = [0.1 * rng.normal(size=(n, dimension)) + shift for n in sizes]
    moments = [sphere_moments(p) for p in parts]
    whole = sphere_moments(np.concatenate(parts))
    forth = reduce(merge_moments, moments)
    back = reduce(lambda a, b: merge_moments(b, a), moments[::-1])
    # As above; each merge shifts the sums once more, and |d|⁴ may be 10 times its mean.
    tolerance = 1000 * len(sizes) * EPS * (1 + distance / 0.1)
    assert_same(forth, whole, tolerance, 0.1)
    assert_same(back, whole, tolerance, 0.1)


def test_merging_works_along_batch_axes():
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(2, 3, 20, 3)), rng.normal(size=(2, 3, 30, 3)) + 5.0
    both = merge_moments(sphere_moments(a), sphere_moments(b))
    assert both.covariance.shape == (2, 3, 3, 3)
    assert_same(both, sphere_moments(np.concatenate([a, b], axis=2)), 1000 * EPS * 6, 5.0)
    one = merge_moments(sphere_moments(a[1, 2]), sphere_moments(b[1, 2]))
    assert_same(both[1, 2], one, 100 * EPS, 5.0)


@given(seed=SEEDS, dimension=st.integers(2, 4), distance=st.floats(0, 10))
@LAWS
def test_moved_moments_are_those_of_the_moved_points(seed, dimension, distance):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(2, 30, dimension)) + 1.0
    turn, shift = rotation(rng, dimension), distance * direction(rng, dimension)
    moved = moved_moments(sphere_moments(x), turn, shift)
    # Rounding at the distance, and sums of fourth powers up to 10³.
    tolerance = 1e4 * EPS * (1 + distance)
    assert_same(moved, sphere_moments(x @ turn.T + shift), tolerance, 1.0)


def test_pooled_clips_give_the_fit_of_their_concatenation():
    rng = np.random.default_rng(3)
    x = cap(rng, (400,), 50, 0.3) + 0.002 * rng.normal(size=(400, 3)) + [1.0, 2.0, 3.0]
    pooled = merge_moments(sphere_moments(x[:150]), sphere_moments(x[150:]))
    whole = pratt(sphere_moments(x))
    np.testing.assert_allclose(pratt(pooled).centre, whole.centre, atol=rounding(50, 4, 0.3))


@given(seed=SEEDS, dimension=st.integers(2, 4))
@LAWS
def test_points_with_a_nan_are_as_good_as_absent(seed, dimension):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(3, 40, dimension)) + 3.0
    lost = rng.random((3, 40)) < rng.uniform(0, 1, (3, 1))
    x[lost, rng.integers(0, dimension)] = np.nan
    got = sphere_moments(x)
    for p in range(3):
        # The sum of the same numbers in other groups: a few roundings of |d|⁴, up to 10³.
        assert_same(got[p], sphere_moments(x[p][~lost[p]]), 1e4 * EPS, 1.0)


@given(seed=SEEDS)
@LAWS
def test_the_order_of_points_is_nothing(seed):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(50, 3)) + 3.0
    assert_same(sphere_moments(x), sphere_moments(rng.permutation(x)), 1e4 * EPS, 1.0)


def test_fewer_than_two_points_have_no_spread():
    one, none = sphere_moments([[1.0, 2.0, 3.0]]), sphere_moments(np.full((4, 3), np.nan))
    assert one.count == 1 and none.count == 0
    np.testing.assert_array_equal(one.mean, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(none.mean, 0.0)
    for m in (one, none, sphere_moments(np.empty((0, 3)))):
        assert not m.covariance.any() and not m.third.any() and m.fourth == 0


def test_a_single_point_is_no_array_of_points():
    with pytest.raises(ValueError, match=r"shape \(\.\.\., N, D\), got \(3,\)"):
        sphere_moments([1.0, 2.0, 3.0])


# Moments of many points, which are summed in chunks


def direct_moments(x):
    """The definition in two passes and more digits, of the points (N, D) without a NaN."""
    x = np.asarray(x, dtype=np.longdouble)
    x = x[np.isfinite(x).all(axis=1)]
    below = max(len(x) - 1, 1)
    mean = x.mean(axis=0)
    d = x - mean
    square = (d**2).sum(axis=1)
    sums = (d.T @ d / below, d.T @ square / below, square @ square / below)
    return Moments(np.array(float(len(x))), *(np.asarray(v, dtype=float) for v in (mean, *sums)))


def summing(count):
    """Relative error of a running sum of N terms.

    Each addition is rounded by half an ulp at most, at random: eps √(N/12) of the mean sum, which is
    half the last one, and four standard deviations of that. The product of a small fourth moment's
    rounding with the four times that the mean takes part in it is some eight eps more.
    """
    return EPS * (8 + np.sqrt(count / 3))


def width_from_place(x, looked_at=32):
    """Root mean square distance of the points from the mean of those that are looked at first."""
    x = x[np.isfinite(x).all(axis=1)]
    some = x[:: max(len(x) // looked_at, 1)]
    return np.sqrt(((x - some.mean(axis=0)) ** 2).sum(axis=1).mean())


@pytest.mark.parametrize(
    "size", [moments.CHUNK - 1, moments.CHUNK, moments.CHUNK + 1, 3 * moments.CHUNK + 123]
)
@pytest.mark.parametrize("dimension", [2, 3])
def test_chunks_of_many_points_add_up_to_the_direct_sums(size, dimension):
    rng = np.random.default_rng(42)
    x = cap(rng, (size,), 60, 0.1, dimension) + 10.0 * direction(rng, dimension)
    got, expected = sphere_moments(x), direct_moments(x)
    np.testing.assert_allclose(got.mean, expected.mean, rtol=0, atol=2 * EPS * 10.1)
    got = Moments(got.count, expected.mean, got.covariance, got.third, got.fourth)
    assert_same(got, expected, summing(size), width_from_place(x))


@given(
    seed=SEEDS,
    chunk=st.integers(1, 60),
    sets=st.integers(1, 7),
    size=st.integers(0, 40),
    dimension=st.integers(1, 4),
    lost=st.sampled_from([0.0, 0.1, 0.9]),
)
@LAWS
def test_no_size_of_chunks_changes_the_moments(seed, chunk, sets, size, dimension, lost):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(sets, size, dimension)) + 3.0
    # Some sets only miss points, and one misses all of them.
    gone = rng.random((sets, size)) < lost * (np.arange(sets) % 2)[:, None]
    gone[-1] |= lost > 0.5
    x[gone, 0] = np.nan
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(moments, "CHUNK", chunk)
        got = sphere_moments(x)
    for p in range(sets):
        if gone[p].all():
            assert_same(got[p], sphere_moments(x[p, :0]), 0.0, 1.0)
        else:
            width = width_from_place(x[p]) + 1.0  # a single point has none, but is 3 m away
            assert_same(got[p], direct_moments(x[p]), summing(size), width)


MISSING = {
    "nothing": np.s_[:0],
    "the first point": np.s_[:1],
    "the first chunk and more": np.s_[: moments.CHUNK + 5],
    "every third point": np.s_[::3],
    "all but the last three": np.s_[:-3],
    "everything": np.s_[:],
}


@pytest.mark.parametrize("coordinate", [0, 2])
@pytest.mark.parametrize("what", MISSING)
def test_points_missing_from_some_sets_of_many_points_leave_the_others_alone(what, coordinate):
    rng = np.random.default_rng(43)
    size = moments.CHUNK + 1000
    x = cap(rng, (3, size), 60, 0.1) + 10.0 * direction(rng)
    x[1, MISSING[what], coordinate] = np.nan
    got = sphere_moments(x)
    for p in (0, 2):
        assert_same(got[p], sphere_moments(x[p]), summing(size), width_from_place(x[p]))
    there = np.isfinite(x[1]).all(axis=1)
    assert got.count.tolist() == [size, there.sum(), size]
    if not there.any():
        np.testing.assert_array_equal(got.mean[1], 0.0)
        assert not got.covariance[1].any() and got.fourth[1] == 0
        return
    expected = direct_moments(x[1])
    np.testing.assert_allclose(got.mean[1], expected.mean, rtol=0, atol=2 * EPS * 10.1)
    one = got[1]
    one = Moments(one.count, expected.mean, one.covariance, one.third, one.fourth)
    assert_same(one, expected, summing(size), width_from_place(x[1]))


def test_an_infinite_coordinate_is_a_missing_point():
    x = np.random.default_rng(44).normal(size=(50, 3))
    x[3, 1], x[7, 0], x[0, 2] = np.inf, -np.inf, np.nan
    seen = np.isfinite(x).all(axis=1)
    assert_same(sphere_moments(x), sphere_moments(x[seen]), summing(50), width_from_place(x))


@pytest.mark.parametrize("kind", ["f4", "f8", ">f8", "i2", "i8", "u1", "list", "bool"])
def test_any_kind_of_number_is_worked_on_in_double_precision(kind):
    x = np.random.default_rng(45).integers(0, 200, (100, 3))
    points = x.tolist() if kind == "list" else x.astype(kind)
    # The same values in the same order: the same sums to the last digit.
    expected = sphere_moments(np.asarray(points, dtype=np.float64))
    assert_same(sphere_moments(points), expected, 0.0, 1.0)


def test_single_precision_loses_no_more_than_its_own_digits():
    rng = np.random.default_rng(46)
    x = (cap(rng, (1000,), 60, 0.1) + [1.0, 2.0, 3.0]).astype(np.float32)
    x[::7, 1] = np.nan
    got, expected = sphere_moments(x), sphere_moments(x.astype(np.float64))
    assert got.covariance.dtype == np.float64
    assert_same(got, expected, 0.0, 1.0)


LAYOUTS = {
    "frames first": lambda x: np.ascontiguousarray(x.swapaxes(0, 1)).swapaxes(0, 1),
    "Fortran's order": np.asfortranarray,
    "every second row of a larger array": lambda x: np.repeat(x, 2, axis=1)[:, ::2],
    "a part of a wider array": lambda x: np.concatenate([x, x], axis=2)[..., :3],
    "backwards in memory": lambda x: x[:, ::-1].copy()[:, ::-1],
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_the_layout_in_memory_is_nothing_and_the_points_are_only_read(layout):
    rng = np.random.default_rng(47)
    x = cap(rng, (4, 300), 60) + 3.0
    x[1, ::4] = np.nan
    points = LAYOUTS[layout](x)
    points.flags.writeable = False
    np.testing.assert_array_equal(points, x)
    assert not points.flags.c_contiguous
    assert_same(sphere_moments(points), sphere_moments(x), summing(300), 1.0)


def most_memory(call):
    """Bytes that a call holds at once, beyond what was there before it."""
    tracemalloc.start()
    try:
        before, _ = tracemalloc.get_traced_memory()
        call()
        return tracemalloc.get_traced_memory()[1] - before
    finally:
        tracemalloc.stop()


SEEN = {
    "all of them": lambda x: x,
    "one of a thousand is missing": lambda x: np.put(x, np.arange(0, x.size, 3000), np.nan),
    "one of a thousand is there": lambda x: np.copyto(
        x, np.nan, where=(np.arange(len(x)) % 1000 != 7)[:, None]
    ),
}


@pytest.mark.parametrize("seen", SEEN)
def test_memory_does_not_grow_with_the_points(seen):
    x = np.random.default_rng(48).random((2_000_000, 3))
    SEEN[seen](x)
    # 48 MB of points. A chunk of five features is 0.7 MB; a mask of bytes for all points would be 2.
    most, tenth = (most_memory(lambda n=n: sphere_moments(x[:n])) for n in (2_000_000, 200_000))
    assert most < 4e6
    assert most - tenth < 1e5


def test_memory_does_not_grow_with_frames_that_come_first():
    # A clip's own order, (frames, markers, 3), looked at marker by marker.
    x = np.random.default_rng(49).random((500_000, 4, 3)).swapaxes(0, 1)
    most, tenth = (most_memory(lambda n=n: sphere_moments(x[:, :n])) for n in (500_000, 50_000))
    assert most < 4e6
    assert most - tenth < 1e5


@pytest.mark.parametrize("size", [1000, 200_000])
@pytest.mark.parametrize("degrees", [20, 180])
def test_a_sphere_of_ten_centimetres_ten_metres_away_is_exact(degrees, size):
    rng = np.random.default_rng(50)
    for _ in range(5):
        centre = 10.0 * direction(rng)
        x = cap(rng, (size,), degrees, 0.1) @ rotation(rng).T + centre
        error = np.linalg.norm(gdke(sphere_moments(x)).centre - centre) / 0.1
        assert error <= rounding(degrees, 10, 0.1) < 1e-9


def orders(x, looked_at):
    """Arrangements in which the points that are looked at first say little of the rest."""
    height = np.argsort(x[:, 2])
    stride = len(x) // looked_at
    odd = np.arange(len(x)) % stride == 0
    best, worst = x.copy(), x.copy()
    best[odd] = x[height[-1]]  # all the same point, on top
    worst[odd] = -x[height[-1]]  # and the opposite pole, which no other point is near
    return {
        "sorted": x[height],
        "the same point again and again": best,
        "the opposite pole of the sphere": worst,
    }


@pytest.mark.parametrize("size", [32_000, 100_000])
@pytest.mark.parametrize(
    "order", ["sorted", "the same point again and again", "the opposite pole of the sphere"]
)
def test_a_place_that_is_not_representative_costs_rounding_only(order, size):
    rng = np.random.default_rng(51)
    shift = 10.0 * direction(rng)
    x = orders(cap(rng, (size,), 20, 0.1), 32)[order]
    spread = np.sqrt(np.linalg.eigvalsh(np.cov(x.T))[0])
    got, expected = sphere_moments(x + shift), direct_moments(x + shift)
    np.testing.assert_allclose(got.mean, expected.mean, rtol=0, atol=2 * EPS * 10.1)
    same = Moments(got.count, expected.mean, got.covariance, got.third, got.fourth)
    width = width_from_place(x)
    assert_same(same, expected, summing(size), width)
    # C is off by that share of the width² and S of its cube: the centre by them over the weakest λ.
    # Its points were rounded at 10 m, which a cap turns into 1 / sin²(θ/2) of it.
    tolerance = summing(size) * width**3 / spread**2 + 0.1 * rounding(20, 10, 0.1)
    np.testing.assert_allclose(gdke(got).centre, shift, rtol=0, atol=tolerance)

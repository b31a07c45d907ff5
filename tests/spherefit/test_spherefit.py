"""Sphere fits against their laws: moments, exactness, bias and spread under noise, hinges.

θ is the half-angle of the cap that the points cover. Tolerances come from three laws:

- rounding: points at a distance d from the origin carry errors of eps d, and a cap lets the centre
  move by 1 / sin²(θ/2) of the error of its points (the Cramér-Rao bound has the same factor);
- noise: a mean over T trials is known to its standard error, spread / √T, and everything random is
  asserted at four of them;
- samples: a term of order 1/N that the law of large numbers leaves out is allowed for by name.
"""

import tracemalloc
from fractions import Fraction
from functools import reduce

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st
from spheres import (
    DEGENERATE,
    EPS,
    LAWS,
    SEEDS,
    arc,
    assert_same,
    bound,
    cap,
    cap_law,
    direction,
    markers_on_spheres,
    rotation,
    rounding,
    stack,
)

from mocap_skel.spherefit import (
    DegenerateSphereError,
    Moments,
    gdke,
    merge_moments,
    mgdk,
    moments,
    pratt,
    radial_variance,
    sgdk,
    sphere_moments,
    ugdk,
)

ESTIMATORS = {
    "gdke": gdke,
    "mgdk": lambda m: mgdk(m, 0.001),
    "pratt": pratt,
    "sgdk": sgdk,
}


# Moments


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


# Laws of every estimator


@pytest.mark.parametrize("name", ESTIMATORS)
@given(seed=SEEDS, degrees=st.floats(30, 180), distance=st.floats(0, 10))
@LAWS
def test_a_rigid_motion_of_the_points_moves_the_centre(name, seed, degrees, distance):
    rng = np.random.default_rng(seed)
    _, m = markers_on_spheres(rng, (150, 150), 0.001, degrees)
    points, _ = markers_on_spheres(np.random.default_rng(seed), (150, 150), 0.001, degrees)
    turn, shift = rotation(rng), distance * direction(rng)
    moved = stack([sphere_moments(x @ turn.T + shift) for x in points])
    here, there = ESTIMATORS[name](m), ESTIMATORS[name](moved)
    # The two caps look in different directions, so that coverage is no worse than one cap's.
    tolerance = 4 * rounding(degrees, distance, 0.1)
    np.testing.assert_allclose(there.centre, turn @ here.centre + shift, atol=tolerance)
    np.testing.assert_allclose(there.radius, here.radius, atol=tolerance)
    np.testing.assert_array_equal(there.rank, here.rank)


@pytest.mark.parametrize("unit", [1e-3, 1e3])
@pytest.mark.parametrize("name", ["gdke", "pratt", "sgdk"])
def test_a_change_of_unit_scales_everything(name, unit):
    _, m = markers_on_spheres(np.random.default_rng(4), (200, 200), 0.002)
    points, _ = markers_on_spheres(np.random.default_rng(4), (200, 200), 0.002)
    scaled = stack([sphere_moments(unit * x) for x in points])
    here, there = ESTIMATORS[name](m), ESTIMATORS[name](scaled)
    tolerance = rounding(60, 0.3, 0.1)
    np.testing.assert_allclose(there.centre, unit * here.centre, atol=unit * tolerance)
    np.testing.assert_allclose(there.radius, unit * here.radius, rtol=tolerance)
    np.testing.assert_allclose(there.spread, unit**2 * here.spread, rtol=tolerance)
    # η is a difference of numbers about r² η, to relative rounding; η is 4e-6 m² of 0.04.
    np.testing.assert_allclose(there.sigma, unit * here.sigma, rtol=1e4 * EPS)
    np.testing.assert_allclose(
        radial_variance(scaled, there), unit**2 * radial_variance(m, here), rtol=1e4 * EPS
    )


@pytest.mark.parametrize("name", ["gdke", "pratt", "sgdk"])
@pytest.mark.parametrize("degrees", [1, 2, 5, 10, 20, 45, 90, 135, 180])
def test_a_perfect_sphere_is_exact_at_every_coverage(name, degrees):
    rng = np.random.default_rng(5)
    radius, distance = 0.1, 10.0
    centres = np.stack([distance * direction(rng) for _ in range(20)])
    x = np.stack([cap(rng, (200,), degrees, radius) @ rotation(rng).T + c for c in centres])
    fit = ESTIMATORS[name](sphere_moments(x)[:, None])
    error = np.linalg.norm(fit.centre - centres, axis=-1).max() / radius
    assert error <= rounding(degrees, distance, radius)
    assert np.abs(fit.radius / radius - 1).max() <= rounding(degrees, distance, radius)
    if degrees >= 20:
        assert error <= 1e-9
    assert (fit.rank == 3).all() and np.isnan(fit.null).all()


@pytest.mark.parametrize("name", ["gdke", "pratt", "sgdk"])
@pytest.mark.parametrize("dimension", [2, 4])
@pytest.mark.parametrize("degrees", [20, 60, 180])
def test_circles_and_hyperspheres_are_exact_as_well(name, dimension, degrees):
    rng = np.random.default_rng(6)
    centre = 10.0 * direction(rng, dimension)
    x = cap(rng, (300,), degrees, 0.1, dimension) @ rotation(rng, dimension).T + centre
    fit = ESTIMATORS[name](sphere_moments(x))
    tolerance = 0.1 * rounding(degrees, 10.0, 0.1)
    assert fit.centre.shape == (dimension,) and fit.radius.shape == () and fit.rank == dimension
    np.testing.assert_allclose(fit.centre, centre, rtol=0, atol=tolerance)
    np.testing.assert_allclose(fit.radius, 0.1, rtol=0, atol=tolerance)


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


@pytest.mark.parametrize("share", [0.5, 2.0])
def test_sgdk_knows_the_noise_by_sigma_and_shape_together(share):
    # Noise of 4 I and σ is noise of I and 2 σ, below and above Pratt's noise alike.
    _, m = markers_on_spheres(np.random.default_rng(37), (300, 300), 0.01)
    sigma = share * float(pratt(m).sigma)
    one, other = sgdk(m, sigma), sgdk(m, sigma / 2, 4 * np.eye(3))
    np.testing.assert_allclose(other.centre, one.centre, rtol=0, atol=1000 * EPS)
    unknown = sgdk(m, None, 4 * np.eye(3))
    np.testing.assert_allclose(unknown.centre, sgdk(m).centre, rtol=0, atol=1000 * EPS)


def test_one_marker_needs_no_marker_axis():
    x = cap(np.random.default_rng(10), (100,), 60)
    alone, listed = gdke(sphere_moments(x)), gdke(sphere_moments(x[None]))
    np.testing.assert_array_equal(alone.centre, listed.centre)
    np.testing.assert_array_equal(alone.radius, listed.radius[0])
    assert alone.centre.shape == (3,) and alone.radius.shape == () and listed.radius.shape == (1,)


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


def test_a_marker_that_was_never_seen_has_no_radius():
    x = cap(np.random.default_rng(12), (2, 100), 90) + [5.0, 0.0, 0.0]
    x[1] = np.nan
    fit = gdke(sphere_moments(x))
    np.testing.assert_allclose(fit.centre, [5.0, 0.0, 0.0], atol=rounding(90, 5, 1))
    assert np.isnan(fit.radius[1])


def test_a_marker_that_was_never_seen_changes_no_centre():
    rng = np.random.default_rng(12)
    x = cap(rng, (2, 100), 90) + [5.0, 0.0, 0.0] + 0.01 * rng.normal(size=(2, 100, 3))
    x[1] = np.nan
    for fit in ESTIMATORS.values():
        both, seen = fit(sphere_moments(x)), fit(sphere_moments(x[:1]))
        np.testing.assert_allclose(both.centre, seen.centre, rtol=0, atol=rounding(90, 5, 1))


# Noise: bias and spread, at named levels (σ / r, θ) with r = 1, the cap's axis along z

LEVELS = {
    "low noise, half a sphere": (0.01, 90.0, 300),
    "low noise, small cap": (0.01, 45.0, 300),
    "noisy, half a sphere": (0.05, 90.0, 300),
    "noisy, small cap": (0.03, 45.0, 300),
}
TRIALS = 400


def noisy_caps(level, seed=13):
    sigma, degrees, count = LEVELS[level]
    rng = np.random.default_rng(seed)
    x = cap(rng, (TRIALS, count), degrees) + sigma * rng.normal(size=(TRIALS, count, 3))
    return sphere_moments(x)[:, None]


@pytest.mark.parametrize("level", LEVELS)
def test_the_bias_of_gdke_is_the_analytic_one(level):
    sigma, degrees, count = LEVELS[level]
    centre = gdke(noisy_caps(level)).centre
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
    spread = gdke(noisy_caps(level)).centre.std(axis=0)
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
    centre = estimator(noisy_caps(level), sigma).centre
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
    spread = pratt(noisy_caps(level)).centre.std(axis=0)
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
    fit = pratt(noisy_caps(level))
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


def test_radial_variance_of_a_perfect_sphere_is_rounding():
    m = sphere_moments(cap(np.random.default_rng(17), (100,), 60, 0.1) + 10.0)
    # A difference of terms r⁴, whose points carry eps · 17 m, over 4 r².
    assert radial_variance(m, gdke(m)) <= 16 * EPS * 0.1 * 17


# Hinges and other degenerate motion


def hinge(rng, members, heights, noise=0.0, degrees=45.0, count=200, distance=1.0):
    """A batch of hinges (members, M, N, 3), their axes (members, 3) and points on the axes."""
    turn = np.stack([rotation(rng) for _ in range(members)])
    place = np.stack([distance * direction(rng) for _ in range(members)])
    x = np.stack(
        [arc(rng, (members, count), degrees, 0.2 + 0.05 * p, h) for p, h in enumerate(heights)],
        axis=1,
    )
    x = np.einsum("bij,bpnj->bpni", turn, x) + place[:, None, None]
    return x + noise * rng.normal(size=x.shape), turn[:, :, 2], place


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


@pytest.mark.parametrize("case", DEGENERATE)
@pytest.mark.parametrize("name", ["gdke", "mgdk"])
def test_degenerate_points_are_an_error(name, case):
    points, message = DEGENERATE[case]
    with pytest.raises(DegenerateSphereError, match=message):
        ESTIMATORS[name](sphere_moments(points))


def test_planes_and_lines_however_turned_are_degenerate():
    rng = np.random.default_rng(40)
    plane, _, _ = hinge(rng, 200, (0.0,))
    turn = np.stack([rotation(rng) for _ in range(200)])
    line = rng.uniform(-1, 1, (200, 50, 1)) * turn[:, None, :, 0] + turn[:, None, :, 1]
    for sigma in (0.0, 0.001):
        assert np.isnan(mgdk(sphere_moments(plane), sigma, strict=False).centre).all()
        assert np.isnan(mgdk(sphere_moments(line)[:, None], sigma, strict=False).centre).all()


def test_degenerate_points_are_an_error_of_pratts_too():
    rng = np.random.default_rng(26)
    for points, message in DEGENERATE.values():
        for _ in range(20):
            with pytest.raises(DegenerateSphereError, match=message):
                pratt(sphere_moments(points @ rotation(rng).T))


@pytest.mark.parametrize("dimension", [2, 3, 4])
def test_a_sphere_takes_one_point_more_than_dimensions(dimension):
    rng = np.random.default_rng(27)
    x = cap(rng, (dimension + 1,), 180, 1.0, dimension)
    np.testing.assert_allclose(gdke(sphere_moments(x)).centre, 0.0, atol=1e5 * EPS)
    with pytest.raises(DegenerateSphereError, match=f"at least {dimension + 1} points"):
        gdke(sphere_moments(x[:-1]))


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

"""Rigid shapes out of noisy, gappy points, against the truth that made them.

Tolerances. Without noise: rounding, eps times coordinates of a few metres, over an extent of 0.1 m
where an angle is meant. With noise σ: a median over F frames is known to 1.25 σ/√F, and the noise
estimate, a root of a median of χ² with 3M - 6 degrees of freedom, to the share `sigma_error` (one
standard deviation); four of either are allowed.
"""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from poses import SEEDS
from rigid_points import moved_with_noise as moved
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from mocap_skel.segments.pose import LINE, least_squares_pose
from mocap_skel.segments.shape import WEIGHT_RATIO, find_shape, median

LAWS = settings(derandomize=True, deadline=None, max_examples=30, database=None)

TEMPLATES = {
    3: np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.05, 0.1, 0.0]]),
    4: np.array([[0.1, 0, 0], [-0.1, 0.02, 0], [0.03, 0.12, 0], [0, 0.01, 0.08]]),
    7: 0.1 * np.random.default_rng(1).normal(size=(7, 3)),
}
PLANE = np.array([[0.1, 0.1, 0], [-0.1, 0.12, 0], [-0.1, -0.1, 0], [0.13, -0.1, 0], [0, 0, 0]])


def random_template(rng, count):
    """Points that stand off a line and, from four on, off a plane."""
    while True:
        t = 0.1 * rng.normal(size=(count, 3))
        extent = np.linalg.svd(t - t.mean(axis=0), compute_uv=False)
        if extent[1] > 3 * LINE * extent[0] and (count == 3 or extent[2] > 3 * LINE * extent[0]):
            return t


def distances(t):
    return np.linalg.norm(t[:, None] - t[None], axis=-1)


def same_hand(a, b):
    """Whether b is a itself, turned, rather than its mirror image: both off a plane."""
    return np.linalg.det((a - a.mean(axis=0)).T @ (b - b.mean(axis=0))) > 0


def template_error(shape, truth):
    """Largest distance of a template's point from its true place, after the best rigid motion."""
    pose = least_squares_pose(shape.template[None], truth, np.ones(len(truth)))
    placed = np.stack([pose.to_lab(t)[0] for t in truth])
    return np.linalg.norm(placed - shape.template, axis=1).max()


def lab_tracks(shape, pose):
    """The template's points in the lab, (frames, M, 3): what does not depend on the axes."""
    return pose.origin[:, None] + shape.template @ pose.rotation.swapaxes(1, 2)


def sigma_error(count, frames):
    """Relative standard deviation of a noise estimate from the median of F sums of squares."""
    freedom = 3 * count - 6
    middle = chi2.median(freedom)
    return 1 / (2 * np.sqrt(frames) * chi2.pdf(middle, freedom) * middle) / 2


# Exact data


@given(seed=SEEDS, count=st.integers(3, 8), frames=st.integers(1, 60))
@LAWS
def test_a_rigid_shape_is_found_exactly(seed, count, frames):
    rng = np.random.default_rng(seed)
    t = random_template(rng, count)
    x, _ = moved(rng, t, frames)
    found = find_shape(x)
    assert found is not None
    shape, pose = found
    np.testing.assert_allclose(distances(shape.template), distances(t), rtol=0, atol=1e-9)
    if count > 3:
        assert same_hand(shape.template, t)
    # The weakest extent is 3 LINE of the largest, so that a turn is known to rounding over 0.01 m.
    np.testing.assert_allclose(lab_tracks(shape, pose), x, rtol=0, atol=1e-9)
    assert shape.sigma <= 1e-9
    assert shape.weights.max() == 1.0 and (shape.weights > 0).all()
    product = pose.rotation.swapaxes(1, 2) @ pose.rotation
    assert np.abs(product - np.eye(3)).max() <= 1e-12
    assert np.abs(np.linalg.det(pose.rotation) - 1).max() <= 1e-12


@pytest.mark.parametrize("name", [*TEMPLATES, "plane"])
def test_the_axes_are_the_thesis_frame_of_the_chosen_three_about_the_centroid(name):
    t = PLANE if name == "plane" else TEMPLATES[name]
    x, _ = moved(np.random.default_rng(2), t, 50)
    shape, _ = find_shape(x)
    a, b, c = shape.template[list(shape.chosen)]
    tolerance = 1e-12
    np.testing.assert_allclose(shape.template.mean(axis=0), 0.0, atol=tolerance)
    # x̂ along the first side; ẑ ∝ (c - a) × x̂ has no part of c - a, and ŷ = ẑ × x̂ is away from c.
    np.testing.assert_allclose((b - a)[1:], 0.0, atol=tolerance)
    assert (b - a)[0] > 0
    assert abs((c - a)[2]) <= tolerance and (c - a)[1] < 0


@pytest.mark.parametrize("name", [*TEMPLATES, "plane"])
def test_the_chosen_three_stand_farthest_from_a_line(name):
    t = PLANE if name == "plane" else TEMPLATES[name]
    x, _ = moved(np.random.default_rng(3), t, 50)
    shape, _ = find_shape(x)

    def height(three):
        a, b, c = t[list(three)]
        area = np.linalg.norm(np.cross(b - a, c - a)) / 2
        return area / max(np.linalg.norm(v) for v in (b - a, c - a, c - b))

    best = max(height(three) for three in combinations(range(len(t)), 3))
    # Scores within 1e-6 of each other count as the same.
    assert height(shape.chosen) >= (1 - 1e-5) * best


def test_the_chosen_three_are_among_those_that_are_seen():
    x, _ = moved(np.random.default_rng(4), TEMPLATES[7], 60)
    shape, _ = find_shape(x)
    x[:40, shape.chosen[0]] = np.nan
    other, _ = find_shape(x)
    assert shape.chosen[0] not in other.chosen


@pytest.mark.parametrize("count", [3, 4, 7])
def test_both_poses_of_a_shape_are_exact_for_rigid_points(count):
    rng = np.random.default_rng(5)
    x, truth = moved(rng, TEMPLATES[count], 40)
    shape, pose = find_shape(x)
    for other in (shape.pose(x), shape.triad_pose(x)):
        np.testing.assert_allclose(other.rotation, pose.rotation, rtol=0, atol=1e-12)
        np.testing.assert_allclose(other.origin, pose.origin, rtol=0, atol=1e-12)
    # A point that is fixed in the segment is fixed in the true segment too.
    lab = pose.to_lab([0.1, 0.2, 0.3])
    inside = truth.to_segment(lab[:, None])[:, 0]
    np.testing.assert_allclose(inside, np.broadcast_to(inside[0], inside.shape), atol=1e-12)


@pytest.mark.parametrize("count", [3, 4, 7])
def test_the_pose_is_the_least_squares_one_onto_the_final_shape(count):
    rng = np.random.default_rng(18)
    x, _ = moved(rng, TEMPLATES[count], 40, noise=0.005)
    x[rng.random((40, count)) < 0.1] = np.nan
    shape, pose = find_shape(x)
    again = shape.pose(x)
    np.testing.assert_allclose(again.rotation, pose.rotation, rtol=0, atol=1e-12)
    np.testing.assert_allclose(again.origin, pose.origin, rtol=0, atol=1e-12)


def test_points_left_out_do_not_count_in_the_pose():
    rng = np.random.default_rng(6)
    x, _ = moved(rng, TEMPLATES[7], 40)
    shape, pose = find_shape(x)
    wild = x.copy()
    used = np.ones((40, 7), dtype=bool)
    used[:, 2] = False
    wild[:, 2] += 0.5
    kept = shape.pose(np.where(used[..., None], wild, np.nan))
    np.testing.assert_allclose(kept.rotation, pose.rotation, rtol=0, atol=1e-12)
    assert np.abs(shape.pose(wild).rotation - pose.rotation).max() > 0.01


# Order, motion of the lab, units


@given(seed=SEEDS, count=st.integers(3, 7), share=st.sampled_from([0.0, 0.2]))
@LAWS
def test_the_order_of_frames_is_nothing(seed, count, share):
    rng = np.random.default_rng(seed)
    x, _ = moved(rng, random_template(rng, count), 101, noise=0.002)
    x[rng.random(x.shape[:2]) < share] = np.nan
    order = rng.permutation(101)
    shape, pose = find_shape(x)
    other, turned = find_shape(x[order])
    # Medians do not know the order; only sums over frames inside BLAS may round differently.
    np.testing.assert_allclose(other.template, shape.template, rtol=0, atol=1e-12)
    np.testing.assert_allclose(other.weights, shape.weights, rtol=1e-9)
    assert other.chosen == shape.chosen
    assert other.sigma == pytest.approx(shape.sigma, rel=1e-9)
    np.testing.assert_array_equal(turned.known, pose.known[order])
    known = turned.known
    np.testing.assert_allclose(
        turned.rotation[known], pose.rotation[order][known], rtol=0, atol=1e-9
    )


@given(seed=SEEDS, count=st.integers(3, 7))
@LAWS
def test_the_order_of_markers_is_nothing_but_a_choice_of_axes(seed, count):
    rng = np.random.default_rng(seed)
    # An odd number of frames: the upper median of an even one is the lower one of a mirrored axis.
    x, _ = moved(rng, random_template(rng, count), 101, noise=0.002)
    order = rng.permutation(count)
    shape, pose = find_shape(x)
    other, turned = find_shape(x[:, order])
    np.testing.assert_allclose(
        distances(other.template), distances(shape.template[order]), rtol=0, atol=1e-9
    )
    np.testing.assert_allclose(other.weights, shape.weights[order], rtol=1e-6)
    assert other.sigma == pytest.approx(shape.sigma, rel=1e-6)
    np.testing.assert_allclose(
        lab_tracks(other, turned), lab_tracks(shape, pose)[:, order], rtol=0, atol=1e-9
    )


@given(seed=SEEDS, count=st.integers(3, 7), unit=st.sampled_from([1.0, 1e-3, 1e3]))
@LAWS
def test_motion_of_the_lab_and_units_leave_the_shape_alone(seed, count, unit):
    rng = np.random.default_rng(seed)
    x, _ = moved(rng, random_template(rng, count), 101, noise=0.002)
    turn = Rotation.from_quat(rng.normal(size=4)).as_matrix()
    shift = rng.normal(size=3)
    shape, pose = find_shape(x)
    other, there = find_shape(unit * (x @ turn.T + shift))
    np.testing.assert_allclose(other.template, unit * shape.template, rtol=0, atol=1e-9 * unit)
    np.testing.assert_allclose(other.weights, shape.weights, rtol=1e-6)
    assert other.sigma == pytest.approx(unit * shape.sigma, rel=1e-6)
    assert other.chosen == shape.chosen
    np.testing.assert_allclose(there.rotation, turn @ pose.rotation, rtol=0, atol=1e-9)
    origin = unit * (pose.origin @ turn.T + shift)
    np.testing.assert_allclose(there.origin, origin, rtol=0, atol=1e-9 * unit)


# Gaps


@given(seed=SEEDS, count=st.integers(4, 7))
@LAWS
def test_gaps_at_random_do_not_change_the_shape(seed, count):
    rng = np.random.default_rng(seed)
    t = random_template(rng, count)
    x, _ = moved(rng, t, 100)
    lost = rng.random(x.shape[:2]) < 0.2
    holes = np.where(lost[..., None], np.nan, x)
    shape, pose = find_shape(holes)
    np.testing.assert_allclose(distances(shape.template), distances(t), rtol=0, atol=1e-9)
    assert same_hand(shape.template, t)
    assert not pose.known[(~lost).sum(axis=1) < 3].any()
    # Where there is a pose, the lost points are where they truly were.
    np.testing.assert_allclose(lab_tracks(shape, pose)[pose.known], x[pose.known], atol=1e-8)


@pytest.mark.parametrize("count", [5, 6, 7])
def test_two_markers_that_are_never_seen_together_still_have_their_places(count):
    rng = np.random.default_rng(7)
    t = random_template(rng, count)
    x, _ = moved(rng, t, 60)
    holes = x.copy()
    holes[:30, 0] = np.nan
    holes[30:, 1] = np.nan
    shape, pose = find_shape(holes)
    np.testing.assert_allclose(distances(shape.template), distances(t), rtol=0, atol=1e-9)
    assert same_hand(shape.template, t)
    np.testing.assert_allclose(lab_tracks(shape, pose), x, rtol=0, atol=1e-9)


def test_the_hand_is_right_though_no_frame_shows_every_marker():
    rng = np.random.default_rng(8)
    for _ in range(40):
        t = random_template(rng, 5)
        x, _ = moved(rng, t, 100)
        x[np.arange(100), np.arange(100) % 5] = np.nan
        shape, _ = find_shape(x)
        assert same_hand(shape.template, t)
        np.testing.assert_allclose(distances(shape.template), distances(t), rtol=0, atol=1e-9)


def test_frames_that_show_three_points_say_nothing_of_the_hand():
    """Three points are as well their mirror image: a hundred such frames do not outvote one of all."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        t = random_template(rng, 5)
        x, _ = moved(rng, t, 101)
        for frame in range(1, 101):
            x[frame, rng.choice(5, 2, replace=False)] = np.nan
        shape, _ = find_shape(x)
        assert same_hand(shape.template, t)


def test_of_three_points_that_stand_equally_well_the_first_are_always_chosen():
    """Any three of a square's corners: rounding must not choose."""
    square = 0.1 * np.array([[1.0, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])
    for seed in range(20):
        x, _ = moved(np.random.default_rng(seed), square, 30)
        shape, _ = find_shape(x)
        assert shape.chosen == (0, 1, 2)


@pytest.mark.parametrize("frames", [0, 2])
def test_a_marker_that_cannot_be_placed_does_not_spoil_the_others(frames):
    # Seen never, or only in frames in which two others are lost.
    x, _ = moved(np.random.default_rng(9), TEMPLATES[4], 50)
    x[frames:, 3] = np.nan
    x[:frames, :2] = np.nan
    shape, pose = find_shape(x)
    np.testing.assert_array_equal(np.isnan(shape.template[:, 0]), [False, False, False, True])
    assert shape.weights[3] == 0 and 3 not in shape.chosen
    noisy, _ = find_shape(x + 0.001 * np.random.default_rng(19).normal(size=x.shape))
    np.testing.assert_allclose(np.nanmean(noisy.template, axis=0), 0.0, atol=1e-12)
    alone, other = find_shape(x[:, :3])
    np.testing.assert_allclose(shape.template[:3], alone.template, rtol=0, atol=1e-12)
    for got in (pose, shape.pose(x)):
        np.testing.assert_array_equal(got.known, np.arange(50) >= frames)
        np.testing.assert_allclose(got.rotation, other.rotation, rtol=0, atol=1e-12)
        np.testing.assert_allclose(got.origin, other.origin, rtol=0, atol=1e-12)


def test_frames_without_three_markers_have_no_pose():
    x, _ = moved(np.random.default_rng(10), TEMPLATES[4], 10)
    x[3, :2] = np.nan
    x[5] = np.nan
    _, pose = find_shape(x)
    np.testing.assert_array_equal(np.flatnonzero(~pose.known), [3, 5])


# No shape


def no_shapes():
    rng = np.random.default_rng(11)
    x, _ = moved(rng, TEMPLATES[4], 20)
    alternate = x[:, :3].copy()
    alternate[::2, 0] = np.nan
    alternate[1::2, 1] = np.nan
    line = np.outer([0.0, 0.1, 0.2, 0.5], [1.0, 2.0, 3.0])
    return {
        "no frame": x[:0],
        "no marker": x[:, :0],
        "one marker": x[:, :1],
        "two markers": x[:, :2],
        "nothing seen": np.full((20, 4, 3), np.nan),
        "never three together": alternate,
        "three on a line": moved(rng, line[:3], 20)[0],
        "four on a line": moved(rng, line, 20)[0],
        "all in one place": np.zeros((20, 4, 3)),
    }


NO_SHAPES = no_shapes()


@pytest.mark.parametrize("case", NO_SHAPES)
def test_what_has_no_shape_is_none(case):
    assert find_shape(NO_SHAPES[case]) is None


@pytest.mark.parametrize(("height", "found"), [(0.052, True), (0.048, False)])
def test_a_line_is_the_same_line_as_of_a_pose(height, found):
    t = 0.2 * np.array([[1.0, 0, 0], [-1, 0, 0], [0, height, 0], [0, -height, 0]])
    x, _ = moved(np.random.default_rng(12), t, 20)
    assert (find_shape(x) is not None) == found


# Noise


@pytest.mark.parametrize("share", [0.0, 0.2])
@pytest.mark.parametrize("sigma", [0.0005, 0.003])
@pytest.mark.parametrize("count", [3, 4, 7])
def test_the_noise_of_rigid_points_is_found(count, sigma, share):
    rng = np.random.default_rng(13)
    frames = 20_000
    x, _ = moved(rng, TEMPLATES[count], frames, noise=sigma)
    x[rng.random((frames, count)) < share] = np.nan
    shape, _ = find_shape(x)
    usable = frames * ((1 - share) ** 3 if count == 3 else 1)
    # Wilson & Hilferty's median of χ² is good to 1 % for three degrees of freedom; a marker that is
    # lost costs three of them, and the shape itself 3M - 6 of F (3M - 6).
    error = 4 * sigma_error(count - (count > 3) * 2 * share, usable) + 0.005 + 1 / frames
    assert shape.sigma == pytest.approx(sigma, rel=error)


@pytest.mark.parametrize("count", [3, 4, 7])
def test_the_shape_is_known_to_the_error_of_a_median(count):
    rng = np.random.default_rng(14)
    frames, sigma = 2000, 0.002
    t = TEMPLATES[count]
    x, _ = moved(rng, t, frames, noise=sigma)
    shape, _ = find_shape(x)
    # Four of 1.25 σ/√F along each of three axes; three points stay with their median distances,
    # which noise across them lengthens by 2 σ²/d, d = 0.1 m at the least.
    error = 4 * 1.25 * sigma * np.sqrt(3 / frames) + 2 * sigma**2 / 0.1
    assert template_error(shape, t) <= error


@pytest.mark.parametrize("count", [3, 4, 7])
def test_the_noise_is_robust_to_one_frame_in_twenty_with_an_outlier(count):
    rng = np.random.default_rng(15)
    frames, sigma, bad = 2000, 0.002, 100
    x, _ = moved(rng, TEMPLATES[count], frames, noise=sigma)
    away = rng.normal(size=(bad, 3))
    away *= 0.3 / np.linalg.norm(away, axis=1, keepdims=True)
    x[rng.choice(frames, bad, replace=False), rng.integers(0, count, bad)] += away
    shape, _ = find_shape(x)
    # The median of all frames is the 0.5/0.95 quantile of the good ones.
    freedom = 3 * count - 6
    law = np.sqrt(chi2.ppf(0.5 / 0.95, freedom) / chi2.median(freedom))
    assert shape.sigma / sigma == pytest.approx(law, rel=4 * sigma_error(count, frames) + 0.005)
    # Places are medians as well; distances, of which two in M of the markers' are spoilt, no worse.
    error = 4 * 1.25 * sigma * np.sqrt(3 / frames) + 2 * sigma**2 / 0.1
    quantile = 0.5 / 0.95 - 0.5  # moves a median by that over the density, √(2π) σ
    assert (
        template_error(shape, TEMPLATES[count]) <= error + 2 * np.sqrt(2 * np.pi) * quantile * sigma
    )


def test_a_shaky_marker_gets_less_weight():
    rng = np.random.default_rng(16)
    sigma = 0.001
    for shaky in range(7):
        x, truth = moved(rng, TEMPLATES[7], 1001, noise=sigma)
        x[:, shaky] += 4 * sigma * rng.normal(size=(1001, 3))
        shape, pose = find_shape(x)
        others = np.delete(shape.weights, shaky)
        # Its variance is 17 times the others', more than the largest ratio allowed.
        assert shape.weights[shaky] < others.min()
        assert shape.weights[shaky] == pytest.approx(1 / WEIGHT_RATIO, rel=1e-9)
        # The weights do what they are for: the pose of the body is the better for them. A point of
        # the segment, 0.1 m off, against its true track.
        plain = least_squares_pose(x, shape.template, np.ones(7))
        y = np.array([0.05, 0.05, 0.05])
        place = least_squares_pose(shape.template[None], TEMPLATES[7], np.ones(7)).to_lab(y)[0]
        track = truth.to_lab(y)
        weighted, equal = (
            np.sqrt(((p.to_lab(place) - track) ** 2).sum(axis=1).mean()) for p in (pose, plain)
        )
        assert weighted < equal


def test_weights_that_white_noise_makes_uneven_cost_little():
    # Markers of equal noise get uneven weights (a far one carries the turn and is left with little
    # residual): that must stay cheap.
    rng = np.random.default_rng(17)
    ratios = []
    for count in (4, 4, 4, 4, 5, 5, 5, 5, 7, 7, 7, 7):
        t = random_template(rng, count)
        x, _ = moved(rng, t, 1001)
        noisy = x + 0.001 * rng.normal(size=x.shape)
        shape, weighted = find_shape(noisy)
        equal = least_squares_pose(noisy, shape.template, np.ones(count))
        errors = [((lab_tracks(shape, pose) - x) ** 2).mean() for pose in (weighted, equal)]
        ratios.append(np.sqrt(errors[0] / errors[1]))
    # Of 180 such shapes the mean is 1.02 and the worst 1.10; each is known to 1 % (1001 frames of
    # six degrees of freedom).
    assert max(ratios) <= 1.2 and np.mean(ratios) <= 1.05


# The median


def test_median_is_the_upper_one():
    assert median(np.array([3.0, 1.0, 2.0])) == 2.0
    assert median(np.array([4.0, 1.0, 3.0, 2.0])) == 3.0
    assert median(np.array([4.0, np.nan, 1.0])) == 4.0
    assert median(np.array([np.nan, 5.0, np.nan])) == 5.0


def test_median_of_no_numbers_is_nan():
    values = np.array([[np.nan, np.nan], [1.0, np.nan], [2.0, 3.0]])
    np.testing.assert_array_equal(median(values), [np.nan, 1.0, 3.0])
    np.testing.assert_array_equal(median(np.full((2, 3), np.nan)), [np.nan, np.nan])
    assert np.isnan(median(np.array([np.nan])))


@given(seed=SEEDS, length=st.integers(1, 40), share=st.floats(0, 1))
@LAWS
def test_median_is_numpys_up_to_the_middle_of_an_even_row(seed, length, share):
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(4, 5, length)).round(1)  # with ties
    values[rng.random(values.shape) < share] = np.nan
    before = values.copy()
    got = median(values)
    np.testing.assert_array_equal(values, before)
    assert got.shape == (4, 5)
    for row, value in zip(values.reshape(-1, length), got.ravel(), strict=True):
        numbers = np.sort(row[np.isfinite(row)])
        if not len(numbers):
            assert np.isnan(value)
            continue
        assert value == numbers[len(numbers) // 2]
        if len(numbers) % 2:
            assert value == np.nanmedian(row)
        else:
            assert value >= np.nanmedian(row)

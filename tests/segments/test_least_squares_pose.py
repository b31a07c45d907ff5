"""Least-squares poses against SVD, their laws, lost markers.

Two sources of tolerance. Rounding: a coordinate d metres from the origin is off by eps d, which
turns a frame by eps d over the extent of its points. Conditioning: the least-squares rotation moves
by 1 / (s₂ + s₃) of a change of B (s its singular values over s₁, s₃ with the sign of det B).
"""

from time import perf_counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from poses import EPS, LAWS, SEEDS, assert_proper, moved, rotations
from rigid_points import TEMPLATES
from scipy.spatial.transform import Rotation

from mocap_skel.segments.pose import (
    LINE,
    Pose,
    by_rows,
    least_squares_pose,
    nearest_rotation,
    triad_pose,
    wahba,
)

NOISE = {"rigid": 0.0, "1 mm": 0.001, "5 cm": 0.05, "1 m, no shape left": 1.0}


def svd_pose(points, template, weights):
    """Kabsch by SVD, with the signed singular values relative to the first; weights (frames, M)."""
    total = weights.sum(axis=1)[:, None]
    x = np.where(weights[..., None] > 0, points, 0.0)
    here = np.einsum("fm,fmi->fi", weights, x) / total
    there = weights @ template / total
    b = np.einsum("fm,fmi,fmj->fij", weights, x - here[:, None], template - there[:, None])
    u, s, v = np.linalg.svd(b)
    sign = np.sign(np.linalg.det(u @ v))
    u[:, :, 2] *= sign[:, None]
    s[:, 2] *= sign
    rotation = u @ v
    origin = here - np.einsum("fij,fj->fi", rotation, there)
    return Pose(rotation, origin), s / s[:, :1], np.linalg.det(b)


def squares_left(points, template, pose):
    """What the pose leaves: squares summed over markers, (frames,)."""
    left = points - pose.origin[:, None] - template @ pose.rotation.swapaxes(1, 2)
    return (left**2).sum(axis=(1, 2))


@pytest.mark.parametrize("noise", NOISE)
@pytest.mark.parametrize("name", TEMPLATES)
def test_least_squares_is_the_svd_solution(name, noise):
    rng = np.random.default_rng(4)
    t = TEMPLATES[name]
    x, _ = moved(rng, t, 1000)
    x = x + NOISE[noise] * rng.normal(size=x.shape)
    weights = rng.uniform(0.1, 1.0, x.shape[:2])
    pose = least_squares_pose(x, t, weights)
    best, s, determinant = svd_pose(x, t, weights)
    # Noise may put the points themselves on a line, which for a shape has s₂ + s₃ below LINE².
    known = pose.known
    assert (known | (s[:, 1] + s[:, 2] < LINE**2)).all() and known.mean() > 0.95
    assert_proper(pose.rotation[known])
    error = np.abs(pose.rotation - best.rotation).max(axis=(1, 2))[known]
    # Conditioning: relative rounding of B (3 m over 0.1 m) by 1 / (s₂ + s₃).
    assert (error <= 64 * EPS * 30 / (s[:, 1] + s[:, 2])[known]).all()
    assert error.max() <= 1e-9
    assert np.abs(pose.origin - best.origin)[known].max() <= 1e-9
    if noise == "1 m, no shape left" and np.linalg.matrix_rank(t - t.mean(axis=0)) == 3:
        assert 0.3 < (determinant < 0).mean() < 0.7  # mirror images are among the data


@pytest.mark.parametrize("name", TEMPLATES)
def test_least_squares_is_scipys_align_vectors(name):
    rng = np.random.default_rng(5)
    t = TEMPLATES[name]
    x, _ = moved(rng, t, 20)
    x = x + 0.01 * rng.normal(size=x.shape)
    weights = rng.uniform(0.1, 1.0, x.shape[:2])
    pose = least_squares_pose(x, t, weights)
    for f, w in enumerate(weights):
        here, there = w @ x[f] / w.sum(), w @ t / w.sum()
        rotation = Rotation.align_vectors(x[f] - here, t - there, weights=w)[0].as_matrix()
        np.testing.assert_allclose(pose.rotation[f], rotation, rtol=0, atol=1e-9)
        np.testing.assert_allclose(pose.origin[f], here - rotation @ there, rtol=0, atol=1e-9)


def test_the_mirror_image_of_a_template_still_gets_a_proper_rotation():
    rng = np.random.default_rng(6)
    t = TEMPLATES["four points"]
    x, _ = moved(rng, t * [1, 1, -1], 200)
    pose = least_squares_pose(x, t, np.ones(4))
    assert_proper(pose.rotation)
    best, _, determinant = svd_pose(x, t, np.ones((200, 4)))
    assert (determinant < 0).all()
    # The rotation may not be unique by symmetry of the points, but its residual is.
    got, least = squares_left(x, t, pose), squares_left(x, t, best)
    np.testing.assert_allclose(got, least, rtol=1e-9)


@pytest.mark.parametrize("distance", [0.0, 1.0, 10.0])
@pytest.mark.parametrize("name", TEMPLATES)
def test_rigid_points_give_their_pose_exactly(name, distance):
    t = TEMPLATES[name]
    x, truth = moved(np.random.default_rng(7), t, 300, distance)
    pose = least_squares_pose(x, t, np.ones(len(t)))
    assert_proper(pose.rotation)
    # Rounding of the coordinates over the smaller extent of the points, 0.02 m at the least.
    turn = 64 * EPS * (0.2 + 3 * distance) / 0.02
    assert np.abs(pose.rotation - truth.rotation).max() <= turn
    assert np.abs(pose.origin - truth.origin).max() <= turn


def test_weights_may_differ_from_frame_to_frame():
    rng = np.random.default_rng(8)
    t = TEMPLATES["seven points"]
    x, _ = moved(rng, t, 30)
    x = x + 0.01 * rng.normal(size=x.shape)
    weights = rng.uniform(0.1, 1.0, (30, 7))
    together = least_squares_pose(x, t, weights)
    for f in range(30):
        alone = least_squares_pose(x[f : f + 1], t, weights[f])
        np.testing.assert_allclose(together.rotation[f], alone.rotation[0], rtol=0, atol=1e-12)
        np.testing.assert_allclose(together.origin[f], alone.origin[0], rtol=0, atol=1e-12)


@given(seed=SEEDS, factor=st.floats(1e-6, 1e6))
@LAWS
def test_only_the_ratio_of_weights_counts(seed, factor):
    rng = np.random.default_rng(seed)
    t = TEMPLATES["four points"]
    x, _ = moved(rng, t, 10)
    x = x + 0.002 * rng.normal(size=x.shape)
    weights = rng.uniform(0.1, 1.0, 4)
    a, b = least_squares_pose(x, t, weights), least_squares_pose(x, t, factor * weights)
    np.testing.assert_allclose(a.rotation, b.rotation, rtol=0, atol=1e-12)
    np.testing.assert_allclose(a.origin, b.origin, rtol=0, atol=1e-12)


@given(seed=SEEDS, share=st.floats(0, 0.7))
@LAWS
def test_missing_points_zero_weights_and_absent_points_are_the_same(seed, share):
    rng = np.random.default_rng(seed)
    t = TEMPLATES["seven points"]
    x, _ = moved(rng, t, 20)
    x = x + 0.002 * rng.normal(size=x.shape)
    lost = rng.random((20, 7)) < share
    holes = x.copy()
    holes[lost, rng.integers(0, 3)] = np.nan  # one coordinate is enough
    weights = rng.uniform(0.1, 1.0, 7)
    missing = least_squares_pose(holes, t, weights)
    unused = least_squares_pose(x, t, weights * ~lost)
    np.testing.assert_allclose(missing.rotation, unused.rotation, rtol=0, atol=1e-12)
    np.testing.assert_allclose(missing.origin, unused.origin, rtol=0, atol=1e-12)
    for f in range(20):
        left = ~lost[f]
        if left.sum() < 3:
            assert not missing.known[f]
            continue
        absent = least_squares_pose(x[f : f + 1, left], t[left], weights[left])
        # Three points that happen to be near a line have a poor condition, or no pose.
        np.testing.assert_allclose(missing.rotation[f], absent.rotation[0], rtol=0, atol=1e-9)
    known = missing.known
    np.testing.assert_array_equal(known, np.isfinite(missing.rotation).all(axis=(1, 2)))
    if known.any():
        assert_proper(missing.rotation[known])


def test_too_few_points_and_points_on_a_line_are_nan():
    t = np.array([[-0.1, 0, 0], [0.0, 0, 0], [0.1, 0, 0], [0.2, 0.2, 0.0]])
    x, truth = moved(np.random.default_rng(9), t, 6)
    x[1, 3] = np.nan  # three left, on a line
    x[2, :2] = np.nan  # two left
    x[3, 1:] = np.nan  # one left
    x[4] = np.nan  # none
    pose = least_squares_pose(x, t, np.ones(4))
    np.testing.assert_array_equal(pose.known, [True, False, False, False, False, True])
    np.testing.assert_array_equal(np.isnan(pose.rotation).all(axis=(1, 2)), ~pose.known)
    np.testing.assert_array_equal(np.isnan(pose.origin).all(axis=1), ~pose.known)
    np.testing.assert_allclose(pose.rotation[[0, 5]], truth.rotation[[0, 5]], atol=1e-12)
    weights = np.array([1.0, 1.0, 1.0, 0.0])
    assert not least_squares_pose(x, t, weights).known.any()
    assert not least_squares_pose(x, t, np.zeros(4)).known.any()
    assert not least_squares_pose(x[:, :2], t[:2], np.ones(2)).known.any()


@pytest.mark.parametrize(("height", "known"), [(0.051, True), (0.049, False)])
def test_a_line_is_a_second_extent_below_a_twentieth_of_the_first(height, known):
    # Two points at ± 1, two at ± height across: singular values √2 and √2 height.
    t = 0.2 * np.array([[1.0, 0, 0], [-1, 0, 0], [0, height, 0], [0, -height, 0]])
    x, _ = moved(np.random.default_rng(10), t, 5)
    np.testing.assert_array_equal(least_squares_pose(x, t, np.ones(4)).known, known)


def test_points_that_coincide_in_the_lab_have_no_pose():
    t = TEMPLATES["four points"]
    pose = least_squares_pose(np.zeros((3, 4, 3)), t, np.ones(4))
    assert not pose.known.any() and np.isnan(pose.rotation).all()


def test_points_that_lie_on_a_line_in_the_lab_have_no_pose():
    t = TEMPLATES["four points"]
    rng = np.random.default_rng(11)
    x = rng.normal(size=(50, 4, 1)) * rng.normal(size=(50, 1, 3))
    assert not least_squares_pose(x, t, np.ones(4)).known.any()


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e3, 1e6])
def test_the_rotation_does_not_ask_whether_points_and_template_share_a_unit(scale):
    rng = np.random.default_rng(12)
    t = TEMPLATES["seven points"]
    x, _ = moved(rng, t, 50)
    x = x + 0.002 * rng.normal(size=x.shape)
    here = least_squares_pose(x, t, np.ones(7)).rotation
    there = least_squares_pose(scale * x, t, np.ones(7)).rotation
    np.testing.assert_allclose(there, here, rtol=0, atol=1e-11)


@given(seed=SEEDS, noise=st.floats(0, 0.01), name=st.sampled_from(list(TEMPLATES)))
@LAWS
def test_a_turn_of_the_lab_turns_the_pose(seed, noise, name):
    rng = np.random.default_rng(seed)
    t = TEMPLATES[name]
    x, _ = moved(rng, t, 10)
    x = x + noise * rng.normal(size=x.shape)
    turn, shift = rotations(rng, 1)[0], rng.normal(size=3)
    weights = np.ones(len(t))
    here = least_squares_pose(x, t, weights)
    there = least_squares_pose(x @ turn.T + shift, t, weights)
    _, s, _ = svd_pose(x, t, np.ones(x.shape[:2]))
    # Conditioning, as against SVD above.
    tolerance = (256 * EPS * 30 / (s[:, 1] + s[:, 2]))[:, None, None]
    assert (np.abs(there.rotation - turn @ here.rotation) <= tolerance).all()
    moved_origin = here.origin @ turn.T + shift
    assert (np.abs(there.origin - moved_origin) <= tolerance[:, 0]).all()


@given(seed=SEEDS, unit=st.sampled_from([1e-3, 0.0254, 1e3]))
@LAWS
def test_a_change_of_unit_scales_the_origin_only(seed, unit):
    rng = np.random.default_rng(seed)
    t = TEMPLATES["seven points"]
    x, _ = moved(rng, t, 10)
    x = x + 0.002 * rng.normal(size=x.shape)
    for pose in (
        lambda x, t: least_squares_pose(x, t, np.ones(7)),
        lambda x, t: triad_pose(x, t, (0, 1, 2)),
    ):
        here, there = pose(x, t), pose(unit * x, unit * t)
        np.testing.assert_allclose(there.rotation, here.rotation, rtol=0, atol=1e-12)
        np.testing.assert_allclose(there.origin, unit * here.origin, rtol=0, atol=1e-12 * unit)


@given(seed=SEEDS)
@LAWS
def test_other_coordinates_of_the_template_describe_the_same_segment(seed):
    rng = np.random.default_rng(seed)
    t = TEMPLATES["seven points"]
    x, _ = moved(rng, t, 10)
    x = x + 0.002 * rng.normal(size=x.shape)
    turn, shift = rotations(rng, 1)[0], rng.normal(size=3)
    y = np.array([0.1, 0.2, 0.3])
    here = least_squares_pose(x, t, np.ones(7)).to_lab(y)
    there = least_squares_pose(x, t @ turn.T + shift, np.ones(7)).to_lab(turn @ y + shift)
    np.testing.assert_allclose(there, here, rtol=0, atol=1e-12)


def test_wahba_is_the_same_by_rows():
    rng = np.random.default_rng(13)
    t = TEMPLATES["seven points"]
    x, _ = moved(rng, t, 12)
    x[rng.random((12, 7)) < 0.2] = np.nan
    weights = rng.uniform(0.1, 1.0, (12, 7))
    pose = least_squares_pose(x, t, weights)
    rows = by_rows(x)
    assert rows.shape == (7, 3, 12) and rows.flags.c_contiguous
    rotation, origin = wahba(rows, t, weights.T)
    np.testing.assert_array_equal(rotation.transpose(2, 0, 1), pose.rotation)
    np.testing.assert_array_equal(origin.T, pose.origin)


def test_noise_turns_the_pose_by_its_law():
    # Wahba's problem, to first order: cov of the turn is σ² (tr(H) I - H)⁻¹ with H = Σ t tᵀ, that
    # of the centroid σ²/M. A variance over F frames is known to √(2/F).
    rng = np.random.default_rng(14)
    frames, sigma = 4000, 0.001
    t = TEMPLATES["seven points"] - TEMPLATES["seven points"].mean(axis=0)
    x, truth = moved(rng, t, frames)
    pose = least_squares_pose(x + sigma * rng.normal(size=x.shape), t, np.ones(7))
    turn = Rotation.from_matrix(truth.rotation.swapaxes(1, 2) @ pose.rotation).as_rotvec()
    scatter = t.T @ t
    law = sigma**2 * np.linalg.inv(np.trace(scatter) * np.eye(3) - scatter)
    error = 4 * np.sqrt(2 / frames) * np.trace(law)
    np.testing.assert_allclose(turn.T @ turn / frames, law, rtol=0, atol=error)
    assert (np.abs(turn.mean(axis=0)) <= 4 * np.sqrt(np.diag(law) / frames)).all()
    away = pose.origin - truth.origin
    assert away.var() == pytest.approx(sigma**2 / 7, rel=4 * np.sqrt(2 / (3 * frames)))


def test_many_frames_at_once():
    rng = np.random.default_rng(15)
    t = TEMPLATES["seven points"]
    x, truth = moved(rng, t, 5000)
    x[rng.random((5000, 7)) < 0.1] = np.nan
    start = perf_counter()
    pose = least_squares_pose(x, t, np.ones(7))
    print(f"5,000 frames of 7 markers with gaps: {1000 * (perf_counter() - start):.1f} ms")
    seen = np.isfinite(x[..., 0]).sum(axis=1) >= 4
    assert pose.known[seen].all()
    assert np.abs(pose.rotation - truth.rotation)[seen].max() <= 1e-11


# The nearest rotation


def test_the_nearest_rotation_of_a_stretched_one_is_that_one():
    """tr(Rᵀ U diag(s) Vᵀ) is largest for R = U Vᵀ; where that mirrors, the least s counts against it."""
    rng = np.random.default_rng(16)
    turns, axes = rotations(rng, 50), rotations(rng, 50)
    for stretch in ([3.0, 2.0, 1.0], [3.0, 2.0, -1.0], [2.0, 1.0, 0.0]):
        stretched = turns @ (axes * stretch) @ axes.swapaxes(1, 2)
        got = nearest_rotation(stretched)
        assert_proper(got)
        np.testing.assert_allclose(got, turns, rtol=0, atol=1e-12)

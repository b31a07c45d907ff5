"""Poses from three points, the thesis's frame; `test_cases` has those from fewer.

Rounding: a coordinate d metres from the origin is off by eps d, which turns a frame by eps d over the extent
of its points.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from poses import EPS, LAWS, SEEDS, assert_proper, moved
from rigid_points import TEMPLATES

from mocap_skel.segments.pose import (
    least_squares_pose,
    triad,
    triad_pose,
)

# The three-point frame


def test_triad_is_the_frame_of_the_thesis_with_its_erratum():
    pose = triad([[1.0, 1.0, 1.0]], [[3.0, 1.0, 1.0]], [[2.0, 4.0, 1.0]])
    # (235), (236); (237) with the difference: (1, 3, 0) × (1, 0, 0) = (0, 0, -3); (238) ŷ = ẑ × x̂
    np.testing.assert_array_equal(pose.origin, [[1.0, 1.0, 1.0]])
    np.testing.assert_array_equal(pose.rotation[0].T, [[1, 0, 0], [0, -1, 0], [0, 0, -1]])


@given(seed=SEEDS, distance=st.floats(0, 100))
@LAWS
def test_triad_of_random_points_follows_the_formulas(seed, distance):
    rng = np.random.default_rng(seed)
    p, q, r = rng.normal(size=(3, 20, 3)) + distance * rng.normal(size=3)
    pose = triad(p, q, r)
    assert_proper(pose.rotation, 1e-12)
    x = (q - p) / np.linalg.norm(q - p, axis=1, keepdims=True)
    z = np.cross(r - p, x)
    sine = np.linalg.norm(z, axis=1, keepdims=True) / np.linalg.norm(r - p, axis=1, keepdims=True)
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    expected = np.stack([x, np.cross(z, x), z], axis=2)
    # The direction across suffers where the three points are near a line.
    assert (np.abs(pose.rotation - expected).max(axis=(1, 2)) <= 16 * EPS / sine[:, 0]).all()
    np.testing.assert_array_equal(pose.origin, p)


@given(seed=SEEDS, shift=st.floats(-100, 100))
@LAWS
def test_the_place_of_the_labs_origin_changes_no_frame(seed, shift):
    rng = np.random.default_rng(seed)
    t = TEMPLATES["seven points"]
    x, _ = moved(rng, t, 10)
    there = x + shift * rng.normal(size=3)
    # Rounding of coordinates of up to 400 m over an extent of 0.1 m; FOAM's sums add some more.
    tolerance = 64 * EPS * (1 + 4 * abs(shift)) / 0.1
    for pose in (
        lambda x: triad(x[:, 0], x[:, 1], x[:, 2]),
        lambda x: triad_pose(x, t, (0, 1, 2)),
        lambda x: least_squares_pose(x, t, np.ones(7)),
    ):
        np.testing.assert_allclose(pose(there).rotation, pose(x).rotation, rtol=0, atol=tolerance)


@pytest.mark.parametrize(
    ("q", "r"),
    [
        ([1.0, 0.0, 0.0], [2.0, 0.0, 0.0]),
        ([0.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        ([1.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ([np.nan, 0.0, 0.0], [0.0, 1.0, 0.0]),
    ],
    ids=["collinear", "first two equal", "first and third equal", "missing"],
)
def test_triad_without_a_plane_is_nan(q, r):
    points = np.array([[[0.0, 0.0, 0.0], q, r], [[0.0, 0, 0], [1.0, 0, 0], [0.0, 1, 0]]])
    pose = triad_pose(points, TEMPLATES["three points"], (0, 1, 2))
    assert np.isnan(pose.rotation[0]).all() and np.isnan(pose.origin[0]).all()
    np.testing.assert_array_equal(pose.known, [False, True])
    assert_proper(pose.rotation[1])
    frame = triad(points[:, 0], points[:, 1], points[:, 2])
    assert np.isnan(frame.rotation[0, :, 1:]).all()


def test_three_points_on_a_line_have_no_frame_whatever_rounding_makes_of_them():
    rng = np.random.default_rng(4)
    p, along = rng.normal(size=(2, 200, 3))
    assert not triad(p, p + 0.1 * along, p + 0.37 * along).known.any()


@pytest.mark.parametrize("chosen", [(0, 1, 2), (6, 2, 4), (3, 0, 5)])
def test_triad_pose_is_exact_in_the_coordinates_of_the_template(chosen):
    t = TEMPLATES["seven points"]
    x, truth = moved(np.random.default_rng(2), t, 50)
    pose = triad_pose(x, t, chosen)
    assert_proper(pose.rotation)
    # Coordinates of some 3 m, an extent of 0.1 m.
    np.testing.assert_allclose(pose.rotation, truth.rotation, rtol=0, atol=64 * EPS * 3 / 0.1)
    np.testing.assert_allclose(pose.origin, truth.origin, rtol=0, atol=64 * EPS * 3)


def test_to_segment_undoes_to_lab():
    rng = np.random.default_rng(3)
    _, pose = moved(rng, TEMPLATES["four points"], 20)
    points = rng.normal(size=(5, 3))
    lab = np.stack([pose.to_lab(y) for y in points], axis=1)
    expected = pose.origin[:, None] + np.einsum("fij,mj->fmi", pose.rotation, points)
    np.testing.assert_allclose(lab, expected, rtol=0, atol=64 * EPS)
    back = pose.to_segment(lab)
    np.testing.assert_allclose(back, np.broadcast_to(points, back.shape), rtol=0, atol=64 * EPS)

"""A segment's pose by the number of its markers: with the joint where two are left, with an axis where one is."""

import numpy as np
import pytest
from hypothesis import given
from poses import EPS, LAWS, SEEDS, assert_proper, moved

from mocap_skel.segments.cases import (
    Link,
    by_markers,
    by_markers_and_joint,
    by_one_marker,
    turned_with,
)
from mocap_skel.segments.pose import LINE, one_marker_pose
from mocap_skel.segments.shape import find_shape

# Case 3: one marker, the joint and the hinge's axis


def one_marker_tracks(rng, template, frames=40):
    points, truth = moved(rng, template[:2], frames)
    return points[:, 0], points[:, 1], truth.rotation @ template[2], truth


@given(seed=SEEDS)
@LAWS
def test_one_marker_a_joint_and_an_axis_give_the_pose_exactly(seed):
    rng = np.random.default_rng(seed)
    template = rng.normal(size=(3, 3))
    bone, axis = template[1] - template[0], template[2]
    sine = np.linalg.norm(np.cross(bone, axis)) / np.linalg.norm(bone) / np.linalg.norm(axis)
    marker, joint, vector, truth = one_marker_tracks(rng, template)
    pose = one_marker_pose(marker, joint, vector, *template)
    if sine < LINE:
        assert not pose.known.any()
        return
    assert_proper(pose.rotation, 1e-12)
    # Coordinates of a few metres; the direction of ẑ suffers where the axis is near the bone.
    tolerance = 64 * EPS * 5 / min(sine, np.linalg.norm(bone), 1)
    np.testing.assert_allclose(pose.rotation, truth.rotation, rtol=0, atol=tolerance)
    np.testing.assert_allclose(pose.origin, truth.origin, rtol=0, atol=5 * tolerance)
    np.testing.assert_allclose(pose.to_lab(template[0]), marker, rtol=0, atol=64 * EPS * 5)


def test_one_marker_frame_follows_the_thesis():
    # (249)-(255) with the erratum of (252): the marker at the template's origin, the joint along x̂,
    # the vector in the xz plane, so that ẑ is what is left of it across x̂.
    marker, joint = np.array([[1.0, 2.0, 3.0]]), np.array([[1.0, 2.5, 3.0]])
    axis = np.array([[0.0, 1.0, 1.0]])
    x, z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    pose = one_marker_pose(marker, joint, axis, np.zeros(3), x, z)
    np.testing.assert_allclose(pose.origin, marker, rtol=0, atol=4 * EPS)
    # Columns x̂ = (0, 1, 0), ŷ = ẑ × x̂ = (0, 0, 1) × (0, 1, 0) = (-1, 0, 0) and ẑ
    expected = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(pose.rotation[0], expected, rtol=0, atol=4 * EPS)


def test_the_length_of_the_axis_and_its_part_along_the_bone_are_nothing():
    rng = np.random.default_rng(16)
    template = np.array([[0.1, 0, 0], [0.4, 0, 0], [0.0, 0.2, 1.0]])
    marker, joint, axis, truth = one_marker_tracks(rng, template)
    longer = 3.0 * axis + 0.7 * (joint - marker)
    pose = one_marker_pose(marker, joint, longer, *template)
    np.testing.assert_allclose(pose.rotation, truth.rotation, rtol=0, atol=64 * EPS * 5 / 0.3)


@pytest.mark.parametrize(("degrees", "known"), [(0, False), (2, False), (4, True), (180, False)])
def test_an_axis_along_the_bone_gives_no_pose(degrees, known):
    a = np.radians(degrees)
    template = np.array([[0.0, 0, 0], [0.3, 0, 0], [np.cos(a), 0, np.sin(a)]])
    marker, joint, axis, _ = one_marker_tracks(np.random.default_rng(17), template)
    straight = np.array([0.0, 0.0, 1.0])
    pose = one_marker_pose(marker, joint, axis, template[0], template[1], straight)
    # LINE is the sine of 2.9 degrees.
    np.testing.assert_array_equal(pose.known, known)
    np.testing.assert_array_equal(np.isfinite(pose.rotation).all(axis=(1, 2)), known)


@pytest.mark.parametrize("lost", ["marker", "joint", "axis", "no bone", "no axis"])
def test_a_frame_without_one_of_the_three_is_nan(lost):
    template = np.array([[0.1, 0, 0], [0.4, 0, 0], [0.0, 0.2, 1.0]])
    marker, joint, axis, _ = one_marker_tracks(np.random.default_rng(18), template, 3)
    if lost == "no bone":
        joint[1] = marker[1]
    elif lost == "no axis":
        axis[1] = 0.0
    else:
        {"marker": marker, "joint": joint, "axis": axis}[lost][1] = np.nan
    pose = one_marker_pose(marker, joint, axis, *template)
    np.testing.assert_array_equal(pose.known, [True, False, True])
    assert np.isnan(pose.rotation[1, :, 1:]).all()


# Whole segments: markers, and what the joint adds in frames that have too few of them

PLACES = np.array([[0.05, 0.03, -0.1], [-0.04, 0.05, -0.2], [0.02, -0.06, -0.25], [0.0, 0.0, 0.0]])
AXIS = np.array([0.0, 0.6, 0.8])
SOME = slice(10, 20)


def segment(frames=40):
    """Points of three markers and their joint (frames, 4, 3), the joint's axis in the lab, the true pose."""
    points, truth = moved(np.random.default_rng(21), PLACES, frames)
    return points, truth.rotation @ AXIS, truth


def assert_rigid(pose, points, known):
    """Every point keeps its place in the frames of which the pose is known, and those are these."""
    np.testing.assert_array_equal(pose.known, known)
    inside = pose.to_segment(points)[known]
    np.testing.assert_allclose(inside, inside[:1].repeat(len(inside), axis=0), atol=1e-12)


def known_but(frames, *gone):
    found = np.ones(frames, dtype=bool)
    for some in gone:
        found[some] = False
    return found


@pytest.mark.parametrize("hinge", [False, True])
@pytest.mark.parametrize("seen", [3, 2, 1, 0])
def test_three_markers_of_which_some_are_missing_for_a_while(seen, hinge):
    points, axis, _ = segment()
    full = points.copy()
    points[SOME, seen:3] = np.nan
    shape, pose = find_shape(points[:, :3])
    found = by_markers(points[:, :3], shape, pose, Link(points[:, 3], axis, hinge))
    # Two markers and the joint are three points; one and the joint need an axis that is fixed in the segment.
    there = known_but(40, *([SOME] if seen == 0 or (seen == 1 and not hinge) else []))
    assert_rigid(found.pose, full, there)
    np.testing.assert_allclose(
        found.pose.to_lab(found.joint)[there], full[there, 3], rtol=0, atol=1e-12
    )
    # The segment's own axes are those of its markers, whatever fills the gaps.
    assert found.shape is shape
    np.testing.assert_array_equal(found.pose.rotation[pose.known], pose.rotation[pose.known])


@pytest.mark.parametrize("hinge", [False, True])
@pytest.mark.parametrize("seen", [2, 1, 0])
def test_two_markers_and_the_joint(seen, hinge):
    points, axis, _ = segment()
    full = points.copy()
    points[SOME, seen:2] = np.nan
    found = by_markers_and_joint(points[:, :2], Link(points[:, 3], axis, hinge))
    there = known_but(40, *([SOME] if seen == 0 or (seen == 1 and not hinge) else []))
    assert_rigid(found.pose, full, there)
    np.testing.assert_array_equal(found.joint, found.shape.template[2])
    np.testing.assert_allclose(found.pose.to_lab(found.joint)[there], full[there, 3], atol=1e-12)


def test_two_markers_and_the_joint_by_the_three_point_frame():
    rng = np.random.default_rng(22)
    points, axis, _ = segment()
    points += 0.001 * rng.normal(size=points.shape)
    link = Link(points[:, 3], axis)
    least, three = (by_markers_and_joint(points[:, :2], link, triad) for triad in (False, True))
    np.testing.assert_array_equal(least.template, three.template)
    expected = three.shape.triad_pose(points[:, [0, 1, 3]])
    np.testing.assert_array_equal(three.pose.rotation, expected.rotation)
    assert (three.pose.rotation != least.pose.rotation).any()


def test_one_marker_or_markers_in_line_with_the_joint_are_no_three_points():
    points, axis, _ = segment()
    link = Link(points[:, 3], axis)
    assert by_markers_and_joint(points[:, :1], link) is None
    on_line = points[:, 3:] + np.array([[0.5], [1.0]]) * (points[:, :1] - points[:, 3:])
    assert by_markers_and_joint(on_line, link) is None


def test_one_marker_is_the_origin_its_joint_ahead_and_the_axis_upwards():
    points, axis, _ = segment()
    marker, joint = points[:, 0], points[:, 3]
    bone = joint - marker
    length = np.linalg.norm(PLACES[0])
    found = by_one_marker(marker, Link(joint, axis), length)
    np.testing.assert_array_equal(found.template, [[0.0, 0.0, 0.0]])
    assert found.shape is None
    np.testing.assert_allclose(found.joint, [length, 0.0, 0.0])
    np.testing.assert_allclose(found.pose.origin, marker)
    np.testing.assert_allclose(found.pose.to_lab(found.joint), joint, atol=1e-12)
    x, _, z = found.pose.rotation.transpose(2, 0, 1)
    np.testing.assert_allclose(x, bone / length, atol=1e-12)
    across = axis - np.einsum("fi,fi->f", axis, x)[:, None] * x
    np.testing.assert_allclose(
        z, across / np.linalg.norm(across, axis=1, keepdims=True), atol=1e-12
    )


def test_a_segment_that_turns_with_its_parent_has_its_turn_and_its_own_place():
    points, _, truth = segment()
    points[3, 0] = np.nan
    truth.origin[5], truth.rotation[5] = np.nan, np.nan
    found = turned_with(truth, points[:, 0], points[:, 3])
    there = known_but(40, 3, 5)
    np.testing.assert_array_equal(found.pose.known, there)
    np.testing.assert_array_equal(np.isfinite(found.pose.rotation).all(axis=(1, 2)), there)
    np.testing.assert_array_equal(found.pose.rotation[there], truth.rotation[there])
    np.testing.assert_array_equal(found.pose.origin[there], points[there, 0])
    # The joint is where the parent's axes have it from the marker.
    np.testing.assert_allclose(found.joint, PLACES[3] - PLACES[0], atol=1e-12)

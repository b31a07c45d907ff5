"""A segment's pose by the number of its markers: with the joint where two are left, with an axis where one is."""

import numpy as np
import pytest
from hypothesis import given
from poses import EPS, LAWS, SEEDS, assert_proper, moved

from mocap_skel.segments.pose import LINE, one_marker_pose

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

"""A segment's turn about its length: its own markers', and that of the plane in which the limb below it bends."""

import numpy as np
import pytest

from mocap_skel.artificial.rotations import from_vector
from mocap_skel.joints.twist import Plane, about, turned
from mocap_skel.segments.cases import by_swing
from mocap_skel.segments.pose import Pose

X = np.array([1.0, 0.0, 0.0])
FRAMES = 400
ERROR = 0.1


def bone(angles):
    """A pose that lies along x, somewhere in the lab, and turns about its length by angles (frames,)."""
    lab = from_vector(np.tile([[0.3, -1.1, 0.7]], (len(angles), 1)))
    return Pose(lab @ about(X, angles), np.tile([[1.0, 2.0, 3.0]], (len(angles), 1)))


def plane_of(pose, error=ERROR, rng=None):
    """The plane of a limb whose inward direction is y of a bone, off by an error about the bone, radians."""
    error = np.broadcast_to(error, len(pose.rotation))
    off = np.zeros(len(error)) if rng is None else error * rng.normal(size=len(error))
    inward = (pose.rotation @ about(X, off))[:, :, 1]
    return Plane(0, inward, error[:, None, None] ** 2 * np.eye(3))


def apart(pose, other):
    """Radians (frames,) by which two poses turn otherwise about x, less the mean."""
    between = pose.rotation.transpose(0, 2, 1) @ other.rotation
    angle = np.arctan2(between[:, 2, 1], between[:, 1, 1])
    return angle - angle.mean()


def test_markers_that_move_with_the_plane_are_left_as_they_are():
    truth = bone(np.sin(np.linspace(0, 20, FRAMES)))
    found = turned(truth, X, np.zeros(3), plane_of(truth))
    assert found.wander == 0.0
    assert found.pose is truth


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_skin_that_follows_half_of_a_turn_is_found_and_put_right(seed):
    rng = np.random.default_rng(seed)
    angle = 1.2 * np.sin(np.linspace(0, 40, FRAMES))
    truth, skin = bone(angle), bone(0.5 * angle)
    found = turned(skin, X, np.zeros(3), plane_of(truth, rng=rng))
    # What the markers are off, by its law: the error of a mean of squares of 400 frames.
    assert found.wander == pytest.approx(np.std(0.5 * angle), rel=0.1)
    left = apart(found.pose, truth)
    assert np.std(left) < 1.1 * ERROR < 0.3 * np.std(apart(skin, truth))
    # And the error that is said is the one that is there.
    assert np.std(left) == pytest.approx(found.error.mean(), rel=0.15)


def test_a_limb_that_is_straight_says_nothing_of_the_turn():
    angle = np.linspace(-0.8, 0.8, FRAMES)
    truth, skin = bone(angle), bone(0.0 * angle)
    blind = np.arange(FRAMES) >= FRAMES // 2
    found = turned(skin, X, np.zeros(3), plane_of(truth, np.where(blind, 30.0, 0.05)))
    by = np.abs(apart(found.pose, skin) - apart(found.pose, skin)[-1])
    assert by[blind].max() < 0.05
    np.testing.assert_allclose(found.error[blind], found.wander, rtol=1e-3)
    assert found.error[~blind].max() < 0.05


def test_the_length_and_the_place_on_it_stay_where_they_are():
    angle = np.linspace(-0.8, 0.8, FRAMES)
    place = np.array([0.4, 0.1, 0.0])
    skin = bone(0.0 * angle)
    found = turned(skin, X, place, plane_of(bone(angle)))
    for along in (0.0, 0.3):
        there = place + along * X
        np.testing.assert_allclose(found.pose.to_lab(there), skin.to_lab(there), atol=1e-12)


def test_frames_without_the_limb_below_keep_the_markers_turn():
    angle = np.linspace(-0.8, 0.8, FRAMES)
    skin, plane = bone(0.0 * angle), plane_of(bone(angle))
    plane.inward[5] = np.nan
    found = turned(skin, X, np.zeros(3), plane)
    np.testing.assert_allclose(found.pose.rotation[5], skin.rotation[5], atol=1e-12)
    assert np.isfinite(found.pose.rotation).all()


def test_a_plane_that_is_hardly_ever_seen_is_none():
    skin = bone(np.zeros(3))
    nothing = Plane(0, np.full((3, 3), np.nan), np.tile(np.eye(3), (3, 1, 1)))
    assert turned(skin, X, np.zeros(3), nothing) is None


@pytest.mark.parametrize("seed", [0, 1])
def test_a_segment_on_one_marker_swings_with_its_parent_the_shortest_way(seed):
    rng = np.random.default_rng(seed)
    parent = Pose(from_vector(rng.normal(size=(50, 3))), rng.normal(size=(50, 3)))
    ends = np.array([0.1, 0.2, -1.0]) + 0.4 * rng.normal(size=(50, 3))
    ends = 0.3 * ends / np.linalg.norm(ends, axis=1, keepdims=True)
    joint = parent.to_lab([0.0, 0.2, 0.4])
    marker = joint + np.einsum("fij,fj->fi", parent.rotation, ends)
    arm = by_swing(marker, joint, parent, 0.3)
    np.testing.assert_allclose(arm.pose.to_lab(arm.joint), joint, atol=1e-12)
    # From its mean direction to any other the turn has no part about either of them.
    inside = parent.rotation.transpose(0, 2, 1) @ arm.pose.rotation
    mean = -(ends / 0.3).mean(axis=0)
    mean = mean / np.linalg.norm(mean)
    for turn, end in zip(inside, -ends / 0.3, strict=True):
        axis = np.cross(mean, end)
        rest = turn @ inside[0].T
        assert np.linalg.det(turn) == pytest.approx(1.0)
        np.testing.assert_allclose(turn[:, 0], end, atol=1e-12)
        # The axis of the turn keeps its place in the segment.
        first = _shortest_of(mean, -ends[0] / 0.3)
        np.testing.assert_allclose(rest @ first @ axis, axis, atol=1e-9)


def _shortest_of(start, end):
    axis = np.cross(start, end)
    size = np.linalg.norm(axis)
    return from_vector((axis / size * np.arctan2(size, start @ end))[None])[0]

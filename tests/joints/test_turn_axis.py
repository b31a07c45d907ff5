"""The axis on which a joint turns, against that of generated clips: its error is what it says, no more, no less."""

import numpy as np
import pytest
from recordings import clip_of, fit_recording

from mocap_skel import fit_skeleton
from mocap_skel.artificial import (
    Faults,
    circumduct,
    human,
    marker_set,
    range_of_motion,
    record,
    still,
    walk,
)
from mocap_skel.artificial.others import figure_of, markers_of, ranges_of
from mocap_skel.artificial.rotations import from_vector
from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.joints.turn_axis import Wobble, best_axis, by_plane, by_turns
from mocap_skel.labels.association import Assignment
from mocap_skel.segments.pose import Pose
from mocap_skel.spherefit import sphere_moments

# 95 % of a chi-squared with two degrees of freedom.
LIMIT = 5.99
HINGES = ("RightElbow", "RightKnee", "LeftElbow", "LeftKnee")


def turned(turns):
    return Pose(turns, np.zeros((len(turns), 3)))


def off(axis, true):
    """(degrees, squared standard errors) between an axis and the true one."""
    away = true - axis.direction
    away -= axis.direction * (away @ axis.direction)
    values, ways = np.linalg.eigh(axis.covariance)
    squared = float((((ways[:, 1:].T @ away) ** 2) / values[1:]).sum())
    return np.degrees(np.arccos(np.clip(axis.direction @ true, -1, 1))), squared


def shown(motion, faults, seed):
    """Joint → its axis and the true one, in the frame of the fit."""
    recording = record(human(), marker_set("cmu"), motion(10, 60, seed=seed), faults, seed=seed)
    fit = fit_recording(recording)
    for joint in fit.joints:
        # The generated knee bends about y, and the elbow about -y, as anatomy has it.
        bend = np.array([0.0, 1.0 if "Knee" in joint.joint else -1.0, 0.0])
        there = recording.poses[joint.parent].rotation @ bend
        own = np.einsum("fji,fj->fi", fit.segments[joint.parent].pose.rotation, there)
        true = np.nanmean(own, axis=0)
        yield joint, true / np.linalg.norm(true)


@pytest.mark.parametrize(
    ("motion", "faults", "least"),
    [
        (range_of_motion, Faults(sigma=0.001), 8),
        (range_of_motion, Faults(sigma=0.0005, correlated=0.002), 6),
        (range_of_motion, Faults(sigma=0.001, slide=0.01), 4),
        (walk, Faults(sigma=0.001, wobble=0.004), 2),
    ],
    ids=["white", "correlated", "slide", "walk on skin"],
)
def test_the_true_axis_lies_within_the_error(motion, faults, least):
    found = [
        (joint.turns_on, true)
        for seed in range(2)
        for joint, true in shown(motion, faults, seed)
        if joint.joint in HINGES and joint.turns_on is not None
    ]
    assert len(found) >= least
    degrees, squared = np.array([off(axis, true) for axis, true in found]).T
    # To the side of the bend, so never near 180 degrees.
    assert (degrees < 15).all() and (squared < LIMIT).all()
    assert np.median(degrees) < 8


def test_balls_have_none_and_neither_has_a_person_who_stands_still():
    rows = {j.joint: j.turns_on for j, _ in shown(range_of_motion, Faults(sigma=1e-3), 0)}
    assert all(rows[name] is None for name in ("RightHip", "LeftShoulder", "Neck", "RightWrist"))
    assert all(joint.turns_on is None for joint, _ in shown(still, Faults(sigma=1e-3), 0))


def test_turns_about_two_axes_are_no_hinge():
    rng = np.random.default_rng(0)
    fixed = turned(np.tile(np.eye(3), (200, 1, 1)))
    hinge = rng.uniform(0, 1.5, (200, 1)) * [0.6, 0.0, 0.8]
    found = by_turns(fixed, turned(from_vector(hinge)), [])
    assert abs(found.direction @ [0.6, 0.0, 0.8]) == pytest.approx(1.0)
    ball = hinge + rng.normal(0, 0.4, (200, 3))
    assert by_turns(fixed, turned(from_vector(ball)), []) is None
    # What goes with the bend tilts the axis unseen: half as much bend, twice the error.
    skin = [Wobble(0.01**2, 0.0)]
    wide, narrow = (by_turns(fixed, turned(from_vector(s * hinge)), skin) for s in (0.2, 0.1))
    assert narrow.standard_error == pytest.approx(2 * wide.standard_error, rel=0.01)
    assert best_axis([narrow, None, wide]) is wide and best_axis([None]) is None


def test_turns_about_the_childs_own_bone_do_not_tilt_the_plane():
    bend = np.linspace(0.3, 2.0, 100)
    turns = from_vector(bend[:, None] * [0.0, -1.0, 0.0])
    # The forearm turns as it bends: the turns' own axis is tilted by that, the plane is not.
    twist = from_vector(0.7 * bend[:, None] * [0.0, 0.0, 1.0])
    wrist = np.einsum("fij,j->fi", turns @ twist, [0.0, 0.0, -0.25])
    found = by_plane(sphere_moments(wrist), np.zeros(3), np.array([0.0, 0.0, 0.2]), [])
    assert found.direction == pytest.approx([0.0, -1.0, 0.0], abs=1e-6)
    tilted = by_turns(turned(np.tile(np.eye(3), (100, 1, 1))), turned(turns @ twist), [])
    assert tilted is None or abs(tilted.direction[1]) < 0.95


def test_a_finger_that_bends_shows_its_axis():
    skeleton = read_skeleton("hand")
    figure = figure_of(skeleton)
    ranges = {
        name: ((0, 0), (0, 80), (0, 0)) if name[-1] in "23" else limits
        for name, limits in ranges_of(skeleton).items()
    }
    motion = circumduct(ranges, 12, 60, seed=0)
    recording = record(figure, markers_of(skeleton, figure), motion, Faults(sigma=0.0003), seed=0)
    columns = {
        s.name: {m: recording.labels.index(m) for m in s.markers if m in recording.labels}
        for s in skeleton.segments
    }
    fit = fit_skeleton(clip_of(recording), Assignment("", columns, (), ()), skeleton)
    joints = {joint.joint: joint for joint in fit.joints}
    for name in ("IndexPIP", "MiddlePIP", "RingPIP", "LittlePIP"):
        joint = joints[name]
        there = recording.poses[joint.parent].rotation @ [0.0, 1.0, 0.0]
        own = np.einsum("fji,fj->fi", fit.segments[joint.parent].pose.rotation, there)
        degrees, _ = off(joint.turns_on, own.mean(axis=0) / np.linalg.norm(own.mean(axis=0)))
        assert min(degrees, 180 - degrees) < 5 and joint.turns_on.standard_error < 0.2
    # Its base bends and spreads, as a ball does.
    assert joints["IndexMCP"].turns_on is None

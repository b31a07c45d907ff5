"""The rigid figure through generated clips: near the truth, through gaps, and never too fast.

A marker that is lost for a second must move no joint by more than 20 mm, in the median by no more than 2 mm.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from recordings import fit_recording
from rigs import motion_of

from mocap_skel.artificial import Faults, human, marker_set, record, walk
from mocap_skel.rig.bridging import steps
from mocap_skel.rig.motion import residuals

RATE = 100


@cache
def recording():
    faults = Faults(sigma=0.001, slide=0.003)
    return record(human(), marker_set("cmu"), walk(5, RATE), faults, seed=4)


def lost(labels, frames):
    points = recording().points.copy()
    for label in labels:
        points[frames, recording().labels.index(label)] = np.nan
    return replace(recording(), points=points)


@cache
def whole():
    return motion_of(fit_recording(recording()))


def apart(motion, frames):
    """Joint → how far (frames,) it is from where it is without the gap, metres."""
    ours, theirs = (m.poses.joints(m.model.bones)[:, :, frames] for m in (motion, whole()))
    away = np.linalg.norm(ours - theirs, axis=0)
    return dict(zip([s.joint or s.name for s in motion.model.segments], away, strict=True))


def test_it_explains_the_markers_and_its_bones_are_constant():
    motion = whole()
    residual = np.concatenate([r.ravel() for r in residuals(motion.model, motion.poses)])
    # 1 mm of noise in three directions, 3 mm of skin.
    assert np.sqrt(np.nanmean(residual**2)) < 0.005
    joints = motion.poses.joints(motion.model.bones)
    for s, parent in enumerate(motion.model.bones.parents[1:], 1):
        length = np.linalg.norm(joints[:, s] - joints[:, parent], axis=0)
        assert np.ptp(length) < 1e-12
    assert not motion.bridges and not motion.absent.any()


def test_joints_are_near_the_truth():
    motion = whole()
    for s, segment in enumerate(motion.model.segments):
        if segment.joint:
            track = motion.poses.joints(motion.model.bones)[:, s].T
            away = np.linalg.norm(track - recording().truth[segment.joint], axis=1)
            assert np.median(away) < 0.03, segment.joint


@pytest.mark.parametrize(
    "labels", [["LKNE"], ["LTHI"], ["RELB"], ["RFIN"], ["LANK"], ["RSHO"], ["LFWT"]]
)
def test_a_marker_lost_for_a_second_moves_no_joint_far(labels):
    gap = slice(200, 300)
    found = apart(motion_of(fit_recording(lost(labels, gap))), gap)
    for joint, away in found.items():
        assert away.max() < 0.02, joint
    assert np.median(np.concatenate(list(found.values()))) < 0.002


def test_a_gap_is_said_with_how_it_was_bridged():
    fit = fit_recording(lost(["LKNE", "LTHI"], slice(200, 250)))
    motion = motion_of(fit)
    names = [s.name for s in motion.model.segments]
    (thigh,) = [b for b in motion.bridges if names[b.segment] == "UpperLeftLeg"]
    # The hip is on the pelvis and the knee on the shank: they show how the thigh turns.
    assert (thigh.start, thigh.stop, thigh.by) == (200, 250, "markers")
    assert 0 < thigh.residual < 0.02


def hand_and_forearm():
    return [
        label for label, (s, _) in marker_set("cmu").items() if s in ("RightHand", "LowerRightArm")
    ]


def test_what_nothing_shows_follows_the_motion_for_so_long_and_no_longer():
    fit = fit_recording(lost(hand_and_forearm(), slice(200, 240)))
    bridged, refused = motion_of(fit), motion_of(fit, gap=0.3)
    names = [s.name for s in bridged.model.segments]
    (arm,) = [b for b in bridged.bridges if names[b.segment] == "LowerRightArm"]
    assert arm.by == "motion" and bridged.stretches == [(0, 500)]
    (arm,) = [b for b in refused.bridges if names[b.segment] == "LowerRightArm"]
    assert arm.by == "" and refused.stretches == [(240, 500), (0, 200)]


def test_a_clip_that_walks_into_the_volume_is_held_for_a_moment_then_trimmed():
    legs = [
        label
        for label, (s, _) in marker_set("cmu").items()
        if "Left" in s and "Arm" not in s and "Hand" not in s
    ]
    short, long = (motion_of(fit_recording(lost(legs, slice(0, n)))) for n in (20, 60))
    assert short.stretches == [(0, 500)] and {b.by for b in short.bridges} == {"hold"}
    assert long.stretches == [(60, 500)]


def test_a_branch_that_is_hardly_ever_there_is_left_out():
    motion = motion_of(fit_recording(lost(hand_and_forearm(), slice(60, 500))))
    names = {s.name for s in motion.model.segments}
    assert "LowerRightArm" not in names and "RightHand" not in names and "UpperRightArm" in names
    assert motion.stretches == [(0, 500)]
    assert set(motion.model.ends) == {
        i for i in range(len(names)) if i not in motion.model.bones.parents
    }


def test_no_joint_turns_faster_than_the_limit():
    points = recording().points.copy()
    points[250, recording().labels.index("RFIN")] += 0.03
    fit = fit_recording(replace(recording(), points=points), search=False)
    motion = motion_of(fit, speed=600.0)
    for s in range(len(motion.model.segments)):
        turn = motion.poses.local(motion.model.bones, s)
        assert np.degrees(steps(turn).max()) * RATE <= 600.0 + 1e-6
    assert motion.repaired.any()

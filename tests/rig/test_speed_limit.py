"""No joint turns faster than the limit, whatever is done to the motion after the fit, and markers are not left for it."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from recordings import fit_recording
from scipy.spatial.transform import Rotation

from mocap_skel.artificial import Faults, human, marker_set, record, walk
from mocap_skel.pipeline.job import Job, fit_file
from mocap_skel.rig.animation import Choice, animate
from mocap_skel.rig.bridging import steps
from mocap_skel.rig.feet import point_track
from mocap_skel.rig.motion import Limits, residuals

LIMIT = Limits.speed * (1.0 + 1e-9)


@cache
def recording():
    faults = Faults(sigma=0.001, slide=0.003)
    return record(human(), marker_set("cmu"), walk(5, 100), faults, seed=4)


@cache
def fit():
    return fit_recording(recording())


def fastest(made):
    """Degrees a second, of all joints and frames."""
    poses, model = made.motion.poses, made.motion.model
    turns = (steps(poses.local(model.bones, s)).max() for s in range(len(model.segments)))
    return np.degrees(max(turns)) * made.rate


def bent(made, side):
    """(F,) degrees by which toes are bent against their foot."""
    model = made.motion.model
    s = [one.name for one in model.segments].index(f"{side}Toes")
    local = made.motion.poses.local(model.bones, s)
    return np.degrees(np.arccos(np.clip((np.trace(local) - 1) / 2, -1, 1)))


@pytest.mark.parametrize("full", [False, True])
def test_holding_feet_turns_no_joint_too_fast_and_adds_no_jumps(full):
    free, held = (
        animate(fit(), Choice(smooth=0.0, lock=lock, full=full)) for lock in (False, True)
    )
    assert fastest(held) < LIMIT
    # Hands are far from the floor: what holds a foot does not shake them.
    for name in ("LeftHand", "RightHand", "Head"):
        s = [one.name for one in held.motion.model.segments].index(name)
        hurried = (
            np.degrees(np.abs(np.diff(steps(m.motion.poses.local(m.motion.model.bones, s))))).max()
            for m in (free, held)
        )
        before, after = hurried
        assert after < before + 0.5, name


def test_a_limit_that_holding_feet_would_break_is_kept_and_told():
    """The limit is a little over what the free figure has, so that only the hold can break it."""
    free = animate(fit(), Choice(smooth=0.0))
    limits = Limits(speed=1.001 * fastest(free))
    held = animate(fit(), Choice(limits, smooth=0.0, lock=True))
    assert fastest(held) <= limits.speed * (1.0 + 1e-9)
    assert not free.motion.repaired.any()


def test_toes_bend_and_straighten_slowly_and_never_go_through_the_floor():
    made = animate(fit(), Choice(smooth=0.0, full=True))
    for side in ("Left", "Right"):
        angle = bent(made, side)
        speed = np.abs(np.diff(angle)) * made.rate
        # The bend is the mean over a tenth of a second of a maximum: it cannot change by more than all of it in that.
        assert angle.max() > 10.0 and speed.max() < angle.max() / 0.1
        model = made.motion.model
        s = [one.name for one in model.segments].index(f"{side}Toes")
        end = made.vertical @ point_track(model.bones, made.motion.poses, s, model.ends[s])
        joint = made.vertical @ made.motion.poses.joints(model.bones)[:, s]
        # A joint that is under the floor itself has level toes.
        assert (end > np.minimum(joint, made.feet.floor) - 1e-6).all()


def served():
    """The recording with its right forearm and hand turned about the upper arm's axis, there and back, faster than the limit."""
    made = recording()
    angle = np.radians(100.0) * np.exp(-0.5 * ((np.arange(len(made.points)) - 250) / 3.0) ** 2)
    elbow = made.truth["RightElbow"]
    axis = elbow - made.truth["RightShoulder"]
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    turn = Rotation.from_rotvec(angle[:, None] * axis)
    points = made.points.copy()
    for label, (where, _) in marker_set("cmu").items():
        if where in ("LowerRightArm", "RightHand"):
            at = made.labels.index(label)
            points[:, at] = elbow + turn.apply(points[:, at] - elbow)
    return fit_recording(replace(made, points=points))


def test_joints_beside_one_that_is_slowed_keep_the_markers():
    made = animate(served(), Choice(smooth=0.0, even=False))
    assert fastest(made) < LIMIT
    names = [one.name for one in made.motion.model.segments]
    assert made.motion.repaired.any()
    away = residuals(made.motion.model, made.motion.poses)
    # Of a hand whose elbow is slowed by itself the marker is 33 mm off.
    assert float(away[names.index("RightHand")].max()) < 0.01


@pytest.mark.real
@pytest.mark.parametrize("smooth", [0.0, "auto"])
def test_holding_feet_keeps_01_01_calm(shared_clips, smooth):
    done = fit_file(Path(shared_clips) / "cmu" / "01_01.c3d", Job(None, prior="skeleton"))
    assert fastest(animate(done.subjects[0][1], Choice(smooth=smooth, lock=True))) < LIMIT


@pytest.mark.real
def test_a_serve_keeps_its_hand_at_its_marker(shared_clips):
    path = Path(shared_clips) / "two_subjects" / "kinematics_tennis_serve_2players.c3d"
    for _, one in fit_file(path, Job(None, prior="skeleton")).subjects:
        made = animate(one)
        assert fastest(made) < LIMIT
        hand = [s.name for s in made.motion.model.segments].index("RightHand")
        assert np.nanmax(residuals(made.motion.model, made.motion.poses)[hand]) < 0.1

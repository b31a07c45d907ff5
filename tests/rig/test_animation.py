"""The figure to animate: feet on the floor, both sides alike, and as a fit again."""

from functools import cache

import numpy as np
import pytest
from recordings import fit_recording

from mocap_skel.artificial import Faults, human, marker_set, record, walk
from mocap_skel.rig.animation import Choice, animate, animation_notes
from mocap_skel.rig.feet import point_track, speed
from mocap_skel.rig.rigid_fit import rigid_fit

UP = np.array([0.0, 0.0, 1.0])
LEVEL = np.diag([1.0, 1.0, 0.0])


@cache
def fit():
    faults = Faults(sigma=0.001, slide=0.003)
    return fit_recording(record(human(), marker_set("cmu"), walk(5, 100), faults, seed=4))


@cache
def animation(**told):
    return animate(fit(), Choice(**told))


def standing(sole, frames):
    flags = np.zeros(frames, bool)
    for start, stop in sole.stands:
        flags[start + 1 : stop - 1] = True
    return flags


def heights_and_skating(made):
    """Of each standing sole: mean distance from the floor, metres, and median speed along it, m/s."""
    for sole in made.feet.soles:
        track = point_track(made.motion.model.bones, made.motion.poses, sole.segment, sole.place)
        flags = standing(sole, track.shape[1])
        away = np.abs(UP @ track - made.feet.floor)[flags].mean()
        yield sole, away, np.median(speed(LEVEL @ track, made.rate)[flags])


def test_both_feet_stand_and_their_soles_are_on_the_floor():
    made = animation(smooth=0.0)
    assert made.feet.floor == 0.0
    sides = {sole.marker[0] for sole in made.feet.soles}
    assert sides == {"L", "R"}
    for sole, away, _ in heights_and_skating(made):
        assert away < 0.01, sole.marker
        # The sole lies under its marker, not beside it.
        assert 0.0 < np.linalg.norm(sole.place - sole.above) < 0.12


def test_a_locked_foot_does_not_skate():
    free = {s.marker: skate for s, _, skate in heights_and_skating(animation(smooth=0.0))}
    for sole, away, skate in heights_and_skating(animation(smooth=0.0, lock=True)):
        assert away < 0.002 and skate < 0.01 <= max(free.values()), sole.marker


def test_holding_a_foot_leaves_the_frames_far_from_a_stand_as_they_are():
    free, held = animation(smooth=0.0), animation(smooth=0.0, lock=True)
    joints = [m.motion.poses.joints(m.motion.model.bones) for m in (free, held)]
    away = np.linalg.norm(joints[0] - joints[1], axis=0)
    assert away.max() < 0.06
    hands = [i for i, s in enumerate(free.motion.model.segments) if "Hand" in s.name]
    assert away[hands].max() < 0.01


@pytest.mark.parametrize("even", [True, False])
def test_left_and_right_bones_are_equal_unless_asked_otherwise(even):
    made = animation(smooth=0.0, even=even)
    model = made.motion.model
    names = [s.name for s in model.segments]
    places = {
        n: made.rest[model.bones.parents[i]] @ model.bones.offsets[i]
        for i, n in enumerate(names)
        if i
    }
    for name, place in places.items():
        if "Left" in name:
            other = places[name.replace("Left", "Right")] * [-1, 1, 1]
            alike = np.isclose(np.linalg.norm(place), np.linalg.norm(other), rtol=0, atol=1e-9)
            assert alike == even, name
            # The rest pose is found again for the even bones, a little turned.
            assert not even or np.allclose(place, other, atol=1e-3), name


def test_the_filter_is_chosen_and_said():
    made = animation()
    assert 4.0 <= made.cutoff <= 20.0
    assert any("Hz is taken away" in note for note in animation_notes(made))
    assert animation(smooth=0.0).cutoff is None


def test_as_a_fit_again_it_has_constant_bones_and_the_evidence_of_the_fit():
    made = rigid_fit(fit(), animation(smooth=0.0, even=False).motion)
    tracks = dict(made.tracks())
    thigh = np.linalg.norm(tracks["LeftHip"] - tracks["LeftKnee"], axis=1)
    assert np.ptp(thigh) < 1e-9
    free = dict(fit().tracks())
    for name, track in tracks.items():
        assert np.nanmedian(np.linalg.norm(track - free[name], axis=1)) < 0.015, name
    assert [j.shown for j in made.joints] == [j.shown for j in fit().joints]

"""The figure measured by itself, against the same numbers found another way."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from recordings import fit_recording

from mocap_skel.artificial import Faults, human, marker_set, record, walk
from mocap_skel.rig.animation import Choice, animate
from mocap_skel.rig.feet import point_track
from mocap_skel.rig.motion import Bridge
from mocap_skel.rig.quality import FLOOR, GUESSED, quality_of

LEVEL = np.diag([1.0, 1.0, 0.0])


@cache
def fit():
    faults = Faults(sigma=0.001, slide=0.003)
    recording = record(human(), marker_set("cmu"), walk(5, 100), faults, seed=4, first_frame=201)
    return fit_recording(recording)


def animation(smooth="auto"):
    return animate(fit(), Choice(smooth=smooth))


def segment(quality, name):
    (found,) = (one for one in quality.segments if one.segment == name)
    return found


def more_to_look_at(made, before):
    """The segments of a figure that are to be looked at, but not those of another that have the same reason."""
    already = {one.segment: one.look_at for one in quality_of(before).look_at}
    return [one for one in quality_of(made).look_at if one.look_at != already.get(one.segment)]


def distances(made, points):
    """Of each segment (F, M): how far points of its markers are from the figure's, metres."""
    bones, poses = made.motion.model.bones, made.motion.poses
    joints = poses.joints(bones)
    return {
        one.name: np.linalg.norm(
            np.einsum("ijf,mj->fmi", poses.turn[:, :, s], bones.places[s])
            + joints[:, s].T[:, None]
            - points[one.name],
            axis=2,
        )
        for s, one in enumerate(made.motion.model.segments)
    }


def test_markers_are_measured_as_they_were_recorded_and_as_they_were_fitted():
    made = animation()
    found = quality_of(made)
    recorded = distances(made, {name: own.points for name, own in fit().segments.items()})
    model = made.motion.model
    filtered = distances(
        made, {one.name: own for one, own in zip(model.segments, model.points, strict=True)}
    )
    for one in found.segments:
        away = recorded[one.segment]
        np.testing.assert_allclose(one.marker_rms, np.sqrt((away**2).mean()), rtol=1e-9)
        np.testing.assert_allclose(
            one.filtered_rms, np.sqrt((filtered[one.segment] ** 2).mean()), rtol=1e-9
        )
        frame, marker = np.unravel_index(away.argmax(), away.shape)
        assert one.worst == pytest.approx(away.max(), rel=1e-9)
        assert one.worst_frame == 201 + frame
        assert one.worst_marker == list(fit().segments[one.segment].template)[marker]
    every = np.concatenate([away.ravel() for away in recorded.values()])
    assert found.marker_rms == pytest.approx(np.sqrt((every**2).mean()), rel=1e-9)
    # The filter took noise away, which is still in what was recorded.
    assert found.filtered_rms < found.marker_rms


def test_without_a_filter_there_is_one_number():
    found = quality_of(animation(0.0))
    assert found.filtered_rms is None and found.marker_rms > 0.0
    assert {one.filtered_rms for one in found.segments} == {None}


def test_a_marker_that_was_far_off_in_one_frame_is_named():
    made = animation()
    s = [one.name for one in made.motion.model.segments].index("LowerLeftLeg")
    moved = [own.copy() for own in made.recorded]
    moved[s][77, 1] += [0.0, 0.3, 0.0]
    (found,) = more_to_look_at(replace(made, recorded=tuple(moved)), made)
    assert (found.segment, found.look_at, found.worst_frame) == ("LowerLeftLeg", ("worst",), 278)
    assert found.worst_marker == made.motion.model.markers[s][1]
    assert found.worst == pytest.approx(0.3, abs=0.02)


def test_the_fastest_turn_is_that_between_two_frames_and_too_fast_is_marked():
    made = animation(0.0)
    model, poses = made.motion.model, made.motion.poses
    for s, one in enumerate(quality_of(made).segments):
        at = one.turn_frame - 201
        turn = poses.local(model.bones, s)[..., [at - 1, at]]
        cosine = (np.trace(turn[..., 0].T @ turn[..., 1]) - 1) / 2
        np.testing.assert_allclose(
            np.degrees(np.arccos(cosine)) * 100, one.turn_speed, rtol=1e-5, atol=1e-3
        )
        assert one.joint == model.segments[s].joint and "turn_speed" not in one.look_at
    # The same motion in a quarter of the time.
    fast = quality_of(replace(made, rate=400.0))
    too_fast = [one.turn_speed > 1500.0 for one in fast.segments]
    assert ["turn_speed" in one.look_at for one in fast.segments] == too_fast
    assert any(too_fast) and not all(too_fast)


def test_feet_are_measured_where_they_stand():
    made = animation(0.0)
    found = quality_of(made)
    model, poses = made.motion.model, made.motion.poses
    for side in ("Left", "Right"):
        one = segment(found, f"{side}Foot")
        heights, skating, own = [], [], []
        for sole in made.feet.soles:
            if sole.marker[0] != side[0]:
                continue
            track = point_track(model.bones, poses, sole.segment, sole.place)
            marker = model.markers[sole.segment].index(sole.marker)
            above = model.points[sole.segment][:, marker].T
            for start, stop in sole.stands:
                heights += np.abs(track[2, start:stop]).tolist()
                for way, speeds in ((track, skating), (above, own)):
                    # Central differences, of which both ends stand.
                    step = LEVEL @ (way[:, start + 2 : stop] - way[:, start : stop - 2])
                    speeds += (np.linalg.norm(step, axis=0) * 100 / 2).tolist()
        assert one.floor_distance == pytest.approx(np.mean(heights))
        assert one.skating == pytest.approx(np.median(skating))
        assert one.marker_skating == pytest.approx(np.median(own))
    assert segment(found, "Hips").floor_distance is None
    # The same feet over a floor that is elsewhere.
    low = quality_of(replace(made, feet=replace(made.feet, floor=-2 * FLOOR)))
    floating = [one.segment for one in low.segments if "floor_distance" in one.look_at]
    assert sorted(floating) == ["LeftFoot", "RightFoot"]
    assert not any("floor_distance" in one.look_at for one in found.segments)
    # It skates where it is faster than its markers by 2 cm a second.
    for one in found.segments:
        faster = (one.skating or 0.0) > (one.marker_skating or 0.0) + 0.02
        assert ("skating" in one.look_at) == faster
    assert low.floor_distance == pytest.approx(2 * FLOOR, abs=FLOOR / 2)


def test_what_is_filled_guessed_repaired_and_lost_is_counted():
    made = animation(0.0)
    names = [one.name for one in made.motion.model.segments]
    hand, arm, head = (names.index(name) for name in ("LeftHand", "LowerLeftArm", "Head"))
    absent, repaired = made.motion.absent.copy(), made.motion.repaired.copy()
    absent[head, 100:140] = True
    repaired[arm, 50:53] = True
    long = int(GUESSED * 100) + 1
    bridges = (
        Bridge(hand, 10, 30, "markers", 0.001),
        Bridge(hand, 40, 40 + long, "motion", np.nan),
        Bridge(arm, 0, 5, "hold", np.nan),
        Bridge(head, 100, 140, "", np.nan),
    )
    motion = replace(made.motion, absent=absent, repaired=repaired, bridges=bridges)
    found = quality_of(replace(made, motion=motion))
    counts = {
        one.segment: (one.filled, one.guessed, one.repaired, one.absent, one.look_at)
        for one in found.segments
        if one.filled or one.repaired or one.absent
    }
    assert counts == {
        "LeftHand": (20 + long, long / 100, 0, 0, ("guessed",)),
        "LowerLeftArm": (5, 0.05, 3, 0, ("repaired",)),
        "Head": (0, 0.0, 0, 40, ("absent",)),
    }
    assert (found.frames, found.figure) == (len(fit().frame_numbers), len(fit().frame_numbers) - 40)

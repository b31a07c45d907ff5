"""A segment that loses all its markers for a second, against the same clip without the gap."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from recordings import fit_recording

from mocap_skel.artificial import Faults, human, marker_set, record, walk
from mocap_skel.fit import fit_skeleton
from mocap_skel.labels.association import associate
from mocap_skel.pipeline.job import Job, fit_file
from mocap_skel.readers import read_clip
from mocap_skel.rig import motion as rig_motion
from mocap_skel.rig.model import model_of
from mocap_skel.rig.motion import rigid_motion
from mocap_skel.rig.solver import Poses

START, STOP = 200, 300


@cache
def columns(*segments):
    return [
        made().labels.index(label)
        for label, (where, _) in marker_set("cmu").items()
        if where in segments
    ]


@cache
def made():
    return record(human(), marker_set("cmu"), walk(5, 100), Faults(sigma=0.001), seed=4)


def slid(*lost):
    """The rigid motion of a pelvis whose skin slides up and down by 3 cm, again and again; some segments lost for a second.

    The figure is that of the whole clip, so that the gap changes nothing but what is seen.
    """
    points = made().points.copy()
    slide = 0.03 * np.sin(2 * np.pi * np.arange(len(points)) / 400)
    points[:, columns("Hips"), 2] += slide[:, None]
    model = model_of(fit_recording(replace(made(), points=points)))
    turn, seen = model.start.turn.copy(), [own.copy() for own in model.points]
    for s, segment in enumerate(model.segments):
        if segment.name in lost:
            turn[:, :, s, START:STOP] = seen[s][START:STOP] = np.nan
    start = Poses(turn, model.start.root)
    return rigid_motion(replace(model, start=start, points=tuple(seen)), 100.0)


def away(one, other):
    """(S, F) millimetres between the joints of two motions."""
    a, b = (m.poses.joints(m.model.bones) for m in (one, other))
    return 1e3 * np.linalg.norm(a - b, axis=0)


def test_what_lost_markers_would_change_is_known_at_the_edges(monkeypatch):
    whole = slid()
    ours = away(slid("Hips"), whole)
    monkeypatch.setattr(rig_motion, "carried_in", lambda *told: told[2])
    plain = away(slid("Hips"), whole)
    inside = slice(START, STOP)
    # They weigh less than seen ones, and skin does not slide in a straight line: a quarter is made good.
    assert ours[0, inside].mean() < 0.8 * plain[0, inside].mean()
    # Frames beside the gap stay as they are.
    np.testing.assert_allclose(ours[:, START - 50], plain[:, START - 50], atol=1e-9)


@pytest.mark.parametrize("segment", ["UpperLeftLeg", "LowerLeftLeg", "LeftFoot", "Head"])
def test_a_second_without_a_segment_moves_joints_by_millimetres(segment):
    points = made().points.copy()
    points[START:STOP, columns(segment)] = np.nan
    with_gap, whole = (
        rigid_motion(model_of(fit_recording(one)), 100.0)
        for one in (replace(made(), points=points), made())
    )
    off = away(with_gap, whole)[:, START:STOP]
    assert off.max() < 20.0 and np.median(off) < 2.0


@pytest.mark.real
def test_a_second_without_the_pelvis_of_01_01(shared_clips):
    """The thighs and the thorax tell of it: a median of 2 mm, and no joint farther than 3 cm (20 mm are not reached)."""
    path = Path(shared_clips) / "cmu" / "01_01.c3d"
    known = fit_file(path, Job(None, prior="skeleton")).association
    clip = read_clip(path)

    def motion(points):
        moved = replace(clip, points=points)
        (one,) = associate(moved, known)
        return rigid_motion(
            model_of(fit_skeleton(moved, one, known.skeleton, prior="skeleton")), clip.rate
        )

    hips = {rule.label for rule in known.rules if rule.segment == "Hips"}
    at = [i for i, label in enumerate(clip.labels) if label.split(":")[-1] in hips]
    for start in (900, 2000):
        points = clip.points.copy()
        points[start : start + 120, at] = np.nan
        off = away(motion(points), motion(clip.points))[:, start : start + 120]
        assert len(at) >= 4 and np.median(off) < 2.0 and off.max() < 30.0

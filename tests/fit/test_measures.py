"""A person whose knees are wider than the table's: without the width they are misplaced, with it they are not."""

from dataclasses import replace

import numpy as np
import pytest
from recordings import clip_of, fit_clip

from mocap_skel.artificial import Faults, human, marker_set, range_of_motion, record, still

# Metres by which the knee's markers lie farther outside than the generated person has them.
WIDER = 0.015
# The width of the generated person's knees: their outer markers lie 53 mm beside the joint, 7 mm of it are the marker's.
OWN = 2 * (0.053 - 0.007)
KNEES = ("RightKnee", "LeftKnee")


def filmed(wider=WIDER):
    """A person who stands, so that anatomy alone tells the joints."""
    markers = dict(marker_set("cmu"))
    for label, out in (("LKNE", wider), ("RKNE", -wider)):
        segment, (x, y, z) = markers[label]
        markers[label] = (segment, (x, y + out, z))
    motion = still(4, 60, seed=0)
    return record(human(), markers, motion, Faults(sigma=1e-4), seed=0)


def errors(clip, recording, **options):
    fit = fit_clip(clip, **options)
    tracks = {j.joint: j.track for j in fit.joints}
    away = [np.nanmedian(np.linalg.norm(tracks[k] - recording.truth[k], axis=1)) for k in KNEES]
    return np.array(away), fit


@pytest.fixture(scope="module")
def scene():
    recording = filmed()
    return recording, clip_of(recording)


def test_a_width_moves_the_knee_by_half_of_what_it_is_wider(scene):
    recording, clip = scene
    plain, alone = errors(clip, recording)
    narrow = {f"{side}_knee_width": OWN for side in ("left", "right")}
    base, _ = errors(clip_of(filmed(0.0)), filmed(0.0), measures=narrow)
    known = {f"{side}_knee_width": OWN + 2 * WIDER for side in ("left", "right")}
    told, fit = errors(clip, recording, measures=known)
    assert (plain > WIDER - 0.006).all() and (plain > told + 0.006).all()
    # As good as for a person whose knees are not wider.
    assert told == pytest.approx(base, abs=0.004)
    assert any("left knee width 12.2 cm, right knee width 12.2 cm" in note for note in fit.notes)
    assert not any("measures of the person" in note for note in alone.notes)


def test_the_clips_own_measures_are_used_and_given_ones_count_before_them(scene):
    _, clip = scene
    known = {f"{side}_knee_width": OWN + 2 * WIDER for side in ("left", "right")}
    in_file = replace(clip, measures=known)
    expected = [j.anatomy for j in fit_clip(clip, measures=known).joints if j.joint in KNEES]
    found = [j.anatomy for j in fit_clip(in_file).joints if j.joint in KNEES]
    assert np.array_equal(expected, found)
    other = fit_clip(replace(clip, measures=dict.fromkeys(known, 0.08)), measures=known)
    assert np.array_equal(expected, [j.anatomy for j in other.joints if j.joint in KNEES])
    pure = fit_clip(in_file, prior="none")
    assert not any("measures" in note for note in pure.notes)


@pytest.mark.parametrize(
    ("measures", "said"),
    [
        ({"left_knee_width": 0.19}, "left knee width is said to be 19 cm; a person whose limbs"),
        ({"inter_asis": 0.44}, "inter-ASIS distance is said to be 44 cm, but its markers are"),
        ({"height": 0.9}, "height is said to be 90 cm, the limbs measure like those of"),
    ],
)
def test_a_measure_that_the_markers_contradict_is_named_and_not_used(scene, measures, said):
    _, clip = scene
    fit = fit_clip(clip, measures=measures)
    assert any(said in note for note in fit.notes), fit.notes
    plain = fit_clip(clip)
    for a, b in zip(fit.joints, plain.joints, strict=True):
        assert np.array_equal(a.centre, b.centre, equal_nan=True)


def test_larger_markers_lie_farther_outside():
    # Of a straight leg the markers' depth also turns the way inward; a bent one shows it.
    moves = record(human(), marker_set("cmu"), range_of_motion(10, 50), Faults(sigma=1e-4), seed=0)
    clip = clip_of(moves)
    small, large = (fit_clip(clip, measures={"marker_diameter": d}) for d in (0.014, 0.034))
    knees = [next(j.anatomy for j in fit.joints if j.joint == "LeftKnee") for fit in (small, large)]
    assert np.linalg.norm(knees[0] - knees[1]) == pytest.approx(0.01, rel=0.05)

"""Markers in line with their segment's others and its joint keep their places, and the joint below its anatomy."""

from dataclasses import replace

import numpy as np
import pytest
from recordings import clip_of, fit_clip

from mocap_skel.artificial import Faults, human, marker_set, record, still, walk

SIGMA = 0.001
# A marker between the joint above and the marker beside the joint below: those two, the joint, the segment.
LIMBS = {
    "RUPA": ("RightShoulder", "RELB", "RightElbow", "UpperRightArm"),
    "LTHI": ("LeftHip", "LKNE", "LeftKnee", "UpperLeftLeg"),
}
MOTIONS = {"walk": walk(5, 60, 3), "still": still(3, 60, 3)}


def in_line(marker, motion, off=0.0):
    """A recording and its clip, the marker on the line or so many metres in front of it."""
    markers = marker_set("plug_in_gait")
    recording = record(human(), markers, MOTIONS[motion], Faults(sigma=SIGMA), seed=3)
    upper, lower, _, segment = LIMBS[marker]
    points = recording.points.copy()
    noise = np.random.default_rng(0).normal(scale=SIGMA, size=(len(points), 3))
    on = 0.45 * recording.truth[upper] + 0.55 * points[:, recording.labels.index(lower)]
    front = recording.poses[segment].rotation[:, :, 0]
    points[:, recording.labels.index(marker)] = on + off * front + noise
    return recording, replace(clip_of(recording), points=points)


def fitted(marker, motion, off=0.0):
    """The fit, the joint below, and its median distance from the truth in metres."""
    recording, clip = in_line(marker, motion, off)
    fit = fit_clip(clip, "plug_in_gait")
    joint = next(j for j in fit.joints if j.joint == LIMBS[marker][2])
    away = np.linalg.norm(joint.track - recording.truth[joint.joint], axis=1)
    return fit, joint, float(np.nanmedian(away))


@pytest.mark.parametrize("marker", LIMBS)
@pytest.mark.parametrize("motion", MOTIONS)
def test_the_joint_below_has_its_anatomy(marker, motion):
    fit, joint, error = fitted(marker, motion)
    _, lower, _, segment = LIMBS[marker]
    assert joint.landmarks[0] == lower
    # An arm that hangs straight says little of which way is inward, wherever its markers are.
    assert error < (0.05 if (marker, motion) == ("RUPA", "still") else 0.03)
    assert set(fit.segments[segment].template) == {marker, lower}


@pytest.mark.parametrize("marker", LIMBS)
def test_a_marker_a_little_beside_the_line_is_as_good(marker):
    for off in (0.005, 0.03):
        assert fitted(marker, "walk", off)[2] < 0.03


@pytest.mark.parametrize("marker", LIMBS)
def test_where_one_marker_of_the_line_is_missing_the_other_stands_in(marker):
    _, clip = in_line(marker, "walk")
    points, gone = clip.points.copy(), slice(100, 130)
    points[gone, clip.labels.index(marker)] = np.nan
    fit = fit_clip(replace(clip, points=points), "plug_in_gait")
    assert fit.segments[LIMBS[marker][3]].pose.known[gone].all()

"""What is said of a fit as a whole, sentence by sentence."""

from dataclasses import replace

import numpy as np
import pytest

from mocap_skel.figure.skeleton import Segment, Skeleton
from mocap_skel.joints.choices import Estimation
from mocap_skel.joints.joint_fit import PRIOR, unfitted
from mocap_skel.joints.notes import fit_notes
from mocap_skel.joints.task import Task
from mocap_skel.segments.noise import ClipNoise
from mocap_skel.segments.prepare import Prepared

FIGURE = Skeleton("s", (Segment("Root", None, None, ("A", "B", "C")),))
TASK = Task(
    FIGURE, Estimation(), triad=False, search=True, anatomy=True, size=1.0, calibration=None
)
MARKERS = Prepared({}, {}, {}, {}, ClipNoise(0.001), 10, {}, 0)


def joint(name, shown="yes", **more):
    found = replace(unfitted(name, "Root", f"{name}Part", 10, ""), centre=np.zeros(3), shown=shown)
    return replace(found, **more)


def said(*joints, calibrated=None, prepared=MARKERS, **task):
    return list(fit_notes(joints, calibrated or {}, prepared, replace(TASK, **task)))


def test_of_a_fit_without_anything_odd_nothing_is_said():
    assert said(joint("Hip"), joint("Knee", "weak")) == []


def test_joints_are_named_by_what_is_wrong_with_them():
    *first, last = said(
        joint("Hip"),
        unfitted("Knee", "Root", "Shank", 10, "no marker on Shank"),
        joint("Ankle", "no", method=PRIOR, reason="no marker on Foot", landmarks=("A",)),
        joint("Waist", "no"),
        joint("Neck", "no", landmarks=("A",)),
    )
    assert first == [
        "joints not fitted: Knee (no marker on Shank)",
        "joints from anatomy alone: Ankle (no marker on Foot)",
    ]
    # What anatomy places is an estimate, and one that is not fitted is no place holder either.
    assert last.startswith("place holders, no joint centres")
    assert last.endswith(": Waist")


def test_lost_markers_stand_with_their_segments():
    lost = {"Root": ("A", "B"), "Shank": ("D",)}
    assert said(prepared=replace(MARKERS, lost=lost)) == [
        "markers missing in every frame: A, B (Root); D (Shank)"
    ]


@pytest.mark.parametrize(("size", "cm"), [(0.29, 51), (0.31, None), (1.59, None), (1.61, 282)])
def test_no_one_is_half_a_metre_or_three_metres_tall(size, cm):
    expected = f"the subject measures as {cm} cm tall: is the clip's unit right? (--unit says it)"
    assert said(size=size) == ([expected] if cm else [])


def test_the_noise_and_the_method_have_their_say():
    noise = ClipNoise(0.001, note="no noise matrix")
    assert said(prepared=replace(MARKERS, noise=noise)) == ["no noise matrix"]
    (sentence,) = said(estimation=Estimation("pratt"))
    assert sentence.startswith("PRATT leaves in the noise of the segments' frames")
    assert said(estimation=Estimation("sgdk")) == []


def test_a_calibration_is_used_or_it_is_said_that_it_is_not():
    other = object()
    assert said(calibration=other, calibrated={"Hip": "calibration (1 clip) 75 %"}) == [
        "from the calibration: Hip: calibration (1 clip) 75 %"
    ]
    (sentence,) = said(calibration=other)
    assert sentence.startswith("nothing of the calibration could be used")

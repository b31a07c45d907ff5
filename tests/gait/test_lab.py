"""What the page for labs says of its bundled clips."""

import re

import numpy as np
import pytest
from recordings import ROOT, SAMPLES

from mocap_skel.artificial import human
from mocap_skel.artificial.gait import gait
from mocap_skel.labels.association import read_association
from mocap_skel.pipeline.calibrate import calibrate
from mocap_skel.pipeline.cycles import Wanted, add_up
from mocap_skel.pipeline.job import Job


@pytest.fixture(scope="module")
def knees(tmp_path_factory):
    """The cycles of both knees as the page makes them."""
    cmu = read_association("cmu")
    actor = calibrate([SAMPLES / "range_of_motion.c3d"], Job(cmu)).calibration
    job = Job(cmu, calibration=actor, static=SAMPLES / "lab_static.c3d")
    wanted = Wanted(
        ("LeftKnee", "RightKnee"), "Knee", folder=tmp_path_factory.mktemp("lab"), kind=""
    )
    return add_up([SAMPLES / "lab_walk.c3d"], job, wanted).means


def test_the_line_is_as_far_from_the_truth_as_the_page_says(knees):
    page = (ROOT / "docs" / "lab.md").read_text()
    left, right = map(
        float, re.search(r"is (\d\.\d) degrees from it .* one (\d\.\d)", page).groups()
    )
    motion = gait(5, 60).motion
    poses = human().poses(motion)
    for mean, said in zip(knees, (left, right), strict=True):
        side = mean.side.title()
        thigh, shank = (poses[f"{part}{side}Leg"].rotation for part in ("Upper", "Lower"))
        knee = thigh.transpose(0, 2, 1) @ shank
        # The generated knee is a hinge about y, and straight in the static pose to a tenth of a degree.
        bend = np.degrees(np.arctan2(knee[:, 0, 2], knee[:, 0, 0]))
        away = []
        for cycle in mean.cycles:
            frames = np.linspace(cycle.stride.start.frame - 1, cycle.stride.stop.frame - 1, 101)
            away.append(cycle.degrees[:, 0] - np.interp(frames, np.arange(300), bend))
        assert abs(np.mean(away)) == pytest.approx(said, abs=0.06)
        assert np.std(away) < 0.5


def test_the_static_pose_and_the_walk_are_of_the_person_who_calibrates():
    shown = (SAMPLES / "make.py").read_text()
    for name in ("full_range", "lab_static", "lab_walk"):
        body = shown[shown.index(f"def {name}") :].split("\ndef ")[0]
        assert "human()" in body and 'marker_set("cmu")' in body

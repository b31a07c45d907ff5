"""Real recordings, where the folder with them is there. Limits are what was reached, with room for rounding."""

import re
import subprocess
import sys

import numpy as np
import pytest

from mocap_skel import associate, fit_skeleton, joint_angles, read_association, read_clip
from mocap_skel.segments.pose import least_squares_pose

pytestmark = pytest.mark.real


def fits(path, association):
    known = read_association(association)
    clip = read_clip(path)
    return clip, [fit_skeleton(clip, one, known.skeleton) for one in associate(clip, known)]


def verdicts(fit):
    return {joint.joint: joint.shown for joint in fit.joints}


def test_01_01_against_the_studios_skeleton(shared_clips, tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "mocap_skel", "fit", shared_clips / "cmu" / "01_01.c3d"]
        + ["--assoc", "cmu", "-o", tmp_path],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0
    assert "14 of 14 joints fitted" in done.stdout
    score = subprocess.run(
        [sys.executable, shared_clips.parent / "tools" / "compare_asf_amc.py"]
        + [tmp_path / "01_01.skeleton.csv", shared_clips / "cmu" / "01.asf"]
        + [shared_clips / "cmu" / "01_01.amc"],
        capture_output=True,
        text=True,
        check=True,
    )
    error = {j: float(cm) for j, cm in re.findall(r"^(\w+) +([\d.]+) cm", score.stdout, re.M)}

    def both(joint):
        return (error[f"Left{joint}"] + error[f"Right{joint}"]) / 2

    # A prototype of the plain method: hips 5.0, ankles 4.9, shoulders 4.9 cm.
    assert both("Ankle") < 4.9
    assert both("Shoulder") < 4.9
    assert both("Hip") < 5.3


def test_the_functional_hip_is_where_published_methods_put_it(shared_clips):
    folder = shared_clips / "functional_hip"
    _, (calibration,) = fits(folder / "FunctionalLHip.c3d", "plug_in_gait_clusters")
    walk, (walking,) = fits(folder / "FunctionalWalk.c3d", "plug_in_gait_clusters")
    hip = next(j for j in calibration.joints if j.joint == "LeftHip")
    assert hip.shown == "yes"
    # From the pelvis of one clip to that of the other by the markers that both have.
    here, there = (fit.segments["Hips"] for fit in (calibration, walking))
    common = [m for m in here.template if m in there.template]
    ours = np.array([here.template[m] for m in common])
    theirs = np.array([there.template[m] for m in common])
    place = least_squares_pose(theirs[None], ours, np.ones(len(common))).to_lab(hip.centre)[0]
    track = there.pose.to_lab(place)
    published = walk.points[:, walk.labels.index("LeftHipCenterGamage")]
    away = np.linalg.norm(track - published, axis=1)
    assert np.sqrt(np.nanmean(away**2)) < 0.010


def test_a_short_game_shows_few_joints_and_says_so(shared_clips):
    _, (fit,) = fits(shared_clips / "cmu" / "basketball.c3d", "cmu")
    found = verdicts(fit)
    assert len(found) == 14 and all(j.fitted for j in fit.joints)
    for joint in ("LeftShoulder", "RightShoulder", "LeftWrist", "RightWrist", "RightElbow"):
        assert found[joint] == "no", joint
    assert "yes" not in found.values()


def test_two_subjects_are_two_skeletons(shared_clips):
    path = shared_clips / "two_subjects" / "kinematics_tennis_serve_2players.c3d"
    clip, both = fits(path, "plug_in_gait")
    assert [fit.subject for fit in both] == ["Derrick", "Viktor"]
    assert clip.unit == "m"
    for fit in both:
        assert sum(j.fitted for j in fit.joints) == 14
        # In a serve the upper arm turns far about its length under its skin. The forearm shows it: an elbow has no
        # other way than to bend. By its own markers, its carrying angle was up to 70 degrees, and gimbal lock.
        assert any(note.startswith("UpperRightArm turns about its length") for note in fit.notes)
        elbow = joint_angles(fit)["RightElbow"]
        flexion, carrying, _ = np.nanpercentile(elbow.degrees, [1, 99], axis=0).T
        assert np.abs(carrying).max() < 15
        assert flexion[0] > 0 and 100 < flexion[1] < 120
        assert not elbow.locked.any()


@pytest.mark.parametrize(
    ("clip", "association"),
    [
        ("hdm05/HDM_dg_06-03_03_120.c3d", "cmu"),
        ("plug_in_gait/HC055A34.c3d", "plug_in_gait"),
        ("plug_in_gait/HC055A01.c3d", "plug_in_gait"),
        ("functional_hip/FunctionalLHip.c3d", "plug_in_gait"),
        ("odd_files/sub_labels.c3d", "plug_in_gait"),
    ],
)
def test_every_clip_runs_and_its_numbers_are_sane(shared_clips, clip, association):
    _, found = fits(shared_clips / clip, association)
    for fit in found:
        for joint in (j for j in fit.joints if j.fitted):
            # A joint that is said to be known has bones of a person around it.
            if joint.shown == "yes":
                assert joint.radius.min() > 0.02 and joint.radius.max() < 0.7, joint.joint
            rotation = fit.segments[joint.parent].pose.rotation
            rotation = rotation[np.isfinite(rotation[:, 0, 0])]
            turned = rotation @ rotation.transpose(0, 2, 1)
            np.testing.assert_allclose(turned, np.broadcast_to(np.eye(3), turned.shape), atol=1e-12)


def test_elbows_of_a_walk_are_known_by_the_measured_width(shared_clips):
    """A child with the width of the elbows in the file, whose arms hang: the depth is the width's, and motion adds none."""
    _, (fit,) = fits(shared_clips / "plug_in_gait" / "HC055A01.c3d", "plug_in_gait")
    clip = read_clip(shared_clips / "plug_in_gait" / "HC055A01.c3d")
    for side in ("Left", "Right"):
        track = next(j.track for j in fit.joints if j.joint == f"{side}Elbow")
        inward = track - clip.points[:, clip.labels.index(f"{side[0]}ELB")]
        half = (clip.measures[f"{side.lower()}_elbow_width"] + clip.measures["marker_diameter"]) / 2
        assert np.nanmedian(np.linalg.norm(inward, axis=1)) == pytest.approx(half, abs=0.003)

"""Joint angles of generated clips against the turns that they were made of."""

from functools import cache

import anatomy
import numpy as np
import pytest
from anatomy import JOINTS, MARKERS, association_of, filmed
from recordings import fit_recording
from scipy.spatial.transform import Rotation

from mocap_skel import joint_angles
from mocap_skel.artificial import Faults

# Degrees.
EXACT = 0.01
INSIDE = ("LKNM", "RKNM", "LMED", "RMED", "LMEP", "RMEP")
SEEN = [(name, part) for name in (*JOINTS, "Hips") for part in range(3)]
# One marker on a hand shows no turn about its length.
SEEN = [(name, part) for name, part in SEEN if not (name.endswith("Wrist") and part == 2)]


@pytest.fixture(scope="module")
def association(tmp_path_factory):
    return association_of(tmp_path_factory.mktemp("anatomy"))


@cache
def clean():
    return filmed()


@pytest.fixture(scope="module")
def exact(association):
    return joint_angles(fit_recording(clean()[0], association))


def away(angles, truth, name, part):
    """Difference in degrees, (frames,), without whole turns."""
    difference = angles[name].degrees[:, part] - truth[name][:, part]
    return (difference + 180) % 360 - 180


@pytest.mark.parametrize(("name", "part"), SEEN)
def test_without_noise_every_angle_is_the_one_that_the_clip_was_made_of(exact, name, part):
    assert np.abs(away(exact, clean()[1], name, part)).max() < EXACT


def test_only_the_hand_has_a_turn_that_nothing_shows(exact):
    unseen = {
        title
        for joint in exact.joints
        for title, column in zip(joint.rule.titles, joint.degrees.T, strict=True)
        if np.isnan(column).any()
    }
    assert unseen == {"LeftWrist_pronation", "RightWrist_pronation"}
    (note,) = exact.notes
    assert "RightHand, LeftHand: one marker" in note


def test_a_heading_goes_on_past_half_a_turn(association):
    frames = 1200
    heading = np.linspace(0, 700, frames)
    still = np.zeros(frames)
    recording, truth = filmed(joints={"Hips": np.stack([heading, still, still + 10], axis=1)})
    angles = joint_angles(fit_recording(recording, association))["Hips"]
    np.testing.assert_allclose(angles.degrees, truth["Hips"], atol=EXACT)


def standing(association, degrees=None, frames=120):
    """The fit of somebody who stands with noise of 0.05 mm, in constant angles."""
    still = {name: np.zeros((frames, 3)) for name in (*JOINTS, "Hips")}
    still |= {
        name: np.tile(np.array(angles, float), (frames, 1))
        for name, angles in (degrees or {}).items()
    }
    recording, _ = filmed(frames, joints=still, faults=Faults(sigma=0.00005))
    return fit_recording(recording, association)


def test_landmarks_of_a_static_clip_give_the_axes_of_one_that_lacks_them(association, tmp_path):
    markers = {label: place for label, place in MARKERS.items() if label not in INSIDE}
    recording, truth = filmed(markers=markers)
    fit = fit_recording(recording, association_of(tmp_path, markers))
    angles = joint_angles(fit, standing(association))
    for side in ("Right", "Left"):
        for joint in ("Hip", "Knee", "Ankle", "Elbow"):
            for part in range(3):
                off = np.abs(away(angles, truth, f"{side}{joint}", part)).max()
                # The static clip's noise, averaged over its frames, over the breadth of a joint.
                assert off < 0.05, (side, joint, part)
    without = joint_angles(fit)
    assert any("outward is from the joint's centre" in note for note in without.notes)
    assert not any("outward is from the joint's centre" in note for note in angles.notes)


NEUTRAL = {"RightKnee": (12, 1, 0), "LeftHip": (-9, 4, 3), "RightElbow": (20, 2, 30)}


@pytest.mark.parametrize("name", NEUTRAL)
def test_the_pose_of_a_static_clip_is_neutral(association, name):
    angles = joint_angles(fit_recording(clean()[0], association), standing(association, NEUTRAL))
    _, sequence, signs = JOINTS[name]
    moved = anatomy.in_turn(sequence, clean()[1][name], signs)
    rest = anatomy.in_turn(sequence, np.array([NEUTRAL[name]], dtype=float), signs)
    # From the generator's axes to forward, up, right; then by a reader of its own.
    basis = np.stack([anatomy.FORWARD, anatomy.UP, anatomy.RIGHT], axis=1)
    between = Rotation.from_matrix(basis.T @ moved @ rest.transpose(0, 2, 1) @ basis)
    want = between.as_euler(sequence, degrees=True) * signs
    np.testing.assert_allclose(angles[name].degrees, want, atol=0.05)


def test_a_segment_in_the_lab_keeps_its_heading_and_loses_its_tilt(association):
    bent = {"Hips": (30, 4, 7)}
    angles = joint_angles(fit_recording(clean()[0], association), standing(association, bent))
    upright = joint_angles(fit_recording(clean()[0], association))
    moved = anatomy.in_turn("YXZ", clean()[1]["Hips"], (1, -1, -1))
    rest = anatomy.in_turn("YXZ", np.array([[0.0, 4.0, 7.0]]), (1, -1, -1))
    basis = np.stack([anatomy.FORWARD, anatomy.UP, anatomy.RIGHT], axis=1)
    between = Rotation.from_matrix(basis.T @ moved @ rest.transpose(0, 2, 1) @ basis)
    want = between.as_euler("YXZ", degrees=True) * (1, -1, -1)
    off = (angles["Hips"].degrees - want + 180) % 360 - 180
    assert np.abs(off).max() < 0.05
    assert np.abs(angles["Hips"].degrees - upright["Hips"].degrees)[:, 2].max() > 5


def test_a_static_clip_against_itself_is_zero(association):
    fit = standing(association, {"RightKnee": (12, 1, 2), "LeftElbow": (20, 3, 30)})
    angles = joint_angles(fit, fit)
    for joint in angles.joints:
        if joint.rule.sequence == "ZXY" and "Wrist" not in joint.rule.name:
            assert np.abs(joint.degrees.mean(axis=0)).max() < 0.3, joint.rule.name

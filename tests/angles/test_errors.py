"""Standard errors of angles against what wrong centres and landmarks do to them, and axes of hinges."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from anatomy import MARKERS, association_of, filmed
from recordings import fit_recording

from mocap_skel import joint_angles
from mocap_skel.angles.joint_angles import anatomical_frames
from mocap_skel.artificial import Faults
from mocap_skel.figure.angle_table import angle_table

REPEATS = 250
FRAMES = slice(0, 600, 200)
OUTSIDE = {label: place for label, place in MARKERS.items() if label not in ("RKNM", "LKNM")}


@pytest.fixture(scope="module")
def fit(tmp_path_factory):
    recording, _ = filmed(600, faults=Faults(sigma=0.001))
    found = fit_recording(recording, association_of(tmp_path_factory.mktemp("errors"), OUTSIDE))
    segments = {
        name: replace(s, pose=type(s.pose)(s.pose.rotation[FRAMES], s.pose.origin[FRAMES]))
        for name, s in found.segments.items()
    }
    # Errors of a few millimetres, other in each direction, so that first order holds and none counts for nothing.
    spread = np.diag([0.002, 0.003, 0.004]) ** 2
    joints = tuple(replace(joint, covariance=spread) for joint in found.joints)
    return replace(
        found, segments=segments, joints=joints, frame_numbers=found.frame_numbers[FRAMES]
    )


def shaken(fit, rng, landmark_sd):
    """The fit with joint centres and landmarks off by their errors."""
    joints = tuple(
        replace(joint, centre=rng.multivariate_normal(joint.centre, joint.covariance))
        for joint in fit.joints
    )
    segments = {
        name: replace(s, template={m: p + landmark_sd * rng.standard_normal(3) for m, p in s.template.items()})
        for name, s in fit.segments.items()
    }  # fmt: skip
    return replace(fit, joints=joints, segments=segments)


def test_standard_errors_are_the_spread_of_angles_with_wrong_centres_and_landmarks(
    fit, monkeypatch
):
    rng = np.random.default_rng(5)
    table = replace(angle_table(), landmark_sd=0.002)
    monkeypatch.setattr("mocap_skel.angles.joint_angles.angle_table", lambda: table)
    told = joint_angles(fit)
    made = [joint_angles(shaken(fit, rng, table.landmark_sd)) for _ in range(REPEATS)]
    compared = 0
    for joint in told.joints:
        seen = np.isfinite(joint.standard_error) & ~joint.locked[:, None]
        drawn = np.stack([one[joint.rule.name].degrees for one in made])
        spread = np.radians(drawn - joint.degrees)
        spread = np.degrees(np.std(np.angle(np.exp(1j * spread)), axis=0))
        # The spread of so many draws is itself known to 1 / sqrt(2 n): 4.5 %, five times of it.
        np.testing.assert_allclose(
            spread[seen],
            joint.standard_error[seen],
            rtol=5 / np.sqrt(2 * REPEATS),
            err_msg=joint.rule.name,
        )
        compared += seen.sum()
    assert compared > 100


@dataclass(frozen=True)
class Hinge:
    direction: np.ndarray
    covariance: np.ndarray


def hinge_at(direction, sd=0.01):
    direction = np.array(direction, dtype=float) / np.linalg.norm(direction)
    return Hinge(direction, sd**2 * (np.eye(3) - np.outer(direction, direction)))


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_the_axis_of_a_hinge_goes_before_landmarks_whatever_its_sense(fit, sense):
    plain = anatomical_frames(fit)["UpperLeftLeg"]
    # The axis of the landmarks, turned by 0.1 rad about the thigh.
    right, forward = plain.axes[:, 2], plain.axes[:, 0]
    axis = np.cos(0.1) * right + np.sin(0.1) * forward
    found = anatomical_frames(fit, hinges={"LeftKnee": hinge_at(sense * axis)})["UpperLeftLeg"]
    assert found.way.hinge == "LeftKnee" and not found.way.says
    np.testing.assert_allclose(found.axes[:, 2], axis, atol=1e-9)
    np.testing.assert_allclose(found.axes[:, 1], plain.axes[:, 1], atol=1e-12)


def test_the_axis_of_a_hinge_that_is_known_worse_than_landmarks_is_not_taken(fit):
    axis = anatomical_frames(fit)["UpperLeftLeg"].axes[:, 2]
    vague = anatomical_frames(fit, hinges={"LeftKnee": hinge_at(axis, 0.5)})["UpperLeftLeg"]
    assert not vague.way.hinge
    np.testing.assert_array_equal(vague.axes, anatomical_frames(fit)["UpperLeftLeg"].axes)


def test_a_sharp_hinge_axis_makes_the_rotations_on_both_sides_of_the_thigh_sharper(fit):
    axis = anatomical_frames(fit)["UpperLeftLeg"].axes[:, 2]
    plain = joint_angles(fit)
    sharp = joint_angles(fit, hinges={"LeftKnee": hinge_at(axis, np.radians(1))})
    rotation = plain["LeftHip"].rule.parts.index("rotation")
    before, after = (one["LeftHip"].typical_error[rotation] for one in (plain, sharp))
    assert after < 0.6 * before
    np.testing.assert_allclose(
        sharp["LeftHip"].degrees[:, rotation], plain["LeftHip"].degrees[:, rotation], atol=0.01
    )

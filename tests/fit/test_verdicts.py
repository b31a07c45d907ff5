"""Which joints a fit says that the movement shows, and that it keeps its word."""

from dataclasses import replace

import numpy as np
import pytest
from arms import (
    ARM,
    ARM_MARKERS,
    BALL,
    HINGE,
    TWO,
    TWO_ARMS,
    TWO_ARMS_MARKERS,
    arm_recording,
    association,
    two_arms_moving,
)
from fitted import GAPS, JOINTS, NOISE, SHORT, columns, joints
from recordings import constant_error, fit_clip, fit_recording, fit_sample
from scipy.spatial.transform import Rotation

from mocap_skel import read_clip
from mocap_skel.artificial import (
    Faults,
    dance,
    human,
    marker_set,
    range_of_motion,
    record,
    still,
    swing_twist,
    walk,
)
from mocap_skel.joints.verdicts import SAFE_ERROR


def knee_as_hinge(seed):
    motion = range_of_motion(1400 / 60, 60, seed=seed)
    turned = dict(motion.rotations)
    for name in ("LowerLeftLeg", "LowerRightLeg"):
        bend = np.arctan2(turned[name][:, 0, 2], turned[name][:, 2, 2])
        turned[name] = swing_twist(bend[:, None] * [0.0, 1.0, 0.0])
    return replace(motion, rotations=turned)


class TestVerdicts:
    @pytest.mark.parametrize(
        "faults",
        [Faults(sigma=0.0002), NOISE, Faults(sigma=0.003), GAPS, Faults(sigma=0.001, slide=0.005)],
        ids=["0.2 mm", "1 mm", "3 mm", "gaps", "skin"],
    )
    def test_a_knee_that_turned_about_one_axis_only_is_never_a_yes(self, faults):
        for seed in range(2):
            recording = record(human(), marker_set("cmu"), knee_as_hinge(seed), faults, seed=seed)
            found = joints(fit_recording(recording))
            for name in ("LeftKnee", "RightKnee"):
                assert found[name].shown in ("no", "weak")
                assert "one" in found[name].reason
                if not faults.slide:
                    assert (found[name].method, found[name].hinge) == ("SGDK", True)
            assert found["LeftHip"].shown == "yes"

    def test_an_exact_hinge_is_no_number_from_rounding(self):
        for seed in (2, 11):
            recording = record(human(), marker_set("cmu"), knee_as_hinge(seed))
            found = joints(fit_recording(recording))
            for name in ("LeftKnee", "RightKnee"):
                assert found[name].shown == "no"
                assert np.isfinite(found[name].standard_error).all()

    @pytest.mark.parametrize("sigma", [0.0005, 0.001, 0.002])
    def test_someone_who_stands_still_shows_no_joint(self, sigma):
        for seed in range(3):
            recording = record(
                human(), marker_set("cmu"), still(5, 60, seed=seed), Faults(sigma=sigma), seed=seed
            )
            # The trunk sways by a degree, 5 mm at the chest's markers: at 0.2 mm of noise it is seen.
            for joint in fit_recording(recording).joints:
                assert joint.shown != "yes"
                assert joint.reason

    def test_the_bundled_still_clip_shows_no_joint(self):
        verdicts = [joint.shown for joint in fit_sample("nearly_still").joints]
        assert "yes" not in verdicts
        assert verdicts.count("no") >= 10

    @pytest.mark.parametrize("move", [dance, walk, range_of_motion])
    def test_a_yes_keeps_its_word(self, move):
        """In short takes, ones not made for it among them, with a tenth of the samples missing."""
        counted = 0
        for seed in range(3):
            recording = record(human(), marker_set("cmu"), move(8, 50, seed=seed), SHORT, seed=seed)
            fit = fit_recording(recording)
            for joint in fit.joints:
                if joint.shown != "yes":
                    continue
                counted += 1
                error = constant_error(fit, recording, joint)
                # A yes has a standard error below SAFE_ERROR in its worst direction: 95 % are
                # within two of them, and of some 100 joints none is beyond three.
                assert np.linalg.norm(error) <= 3 * SAFE_ERROR
                # Its own standard error is a lower bound, true within a factor of two (above).
                worst = np.sqrt(np.linalg.eigvalsh(joint.covariance)[-1])
                assert np.linalg.norm(error) <= 2 * 3 * worst
        assert counted >= 6

    def test_what_hangs_on_an_unknown_joint_is_unknown(self):
        """Arms that only swing: the shoulder is a hinge, and the upper arm's frame rests on it."""
        for seed in range(3):
            recording = record(human(), marker_set("cmu"), walk(8, 50, seed=seed), NOISE, seed=seed)
            fit = fit_recording(recording)
            found = joints(fit)
            for side in ("Left", "Right"):
                assert found[f"{side}Shoulder"].shown == "no"
            for joint in fit.joints:
                if joint.shown != "no":
                    # The standard error of a "weak" is worth its word too, as that of a "yes" is.
                    worst = np.sqrt(np.linalg.eigvalsh(joint.covariance)[-1])
                    error = np.linalg.norm(constant_error(fit, recording, joint))
                    assert error <= 2 * 3 * worst, joint.joint

    def test_a_reason_stands_with_every_verdict_but_yes(self):
        for name in ("range_of_motion", "gaps", "two_dancers", "nearly_still"):
            for joint in fit_sample(name).joints:
                assert (joint.shown == "yes") == (joint.reason == "")


@pytest.fixture(scope="module")
def fits(tmp_path_factory):
    """Fits of an arm of which the upper arm has two markers, by what the shoulder can do."""
    arm = association(ARM, ARM_MARKERS, tmp_path_factory.mktemp("arm"))
    return {
        name: fit_recording(arm_recording(TWO, shoulder, 0.0003), arm)
        for name, shoulder in (("ball", BALL), ("hinge", HINGE))
    }


class TestBelowAnUnknownJoint:
    """The frame of a segment of two markers stands on its joint as well."""

    def test_a_joint_below_is_weak_and_says_on_what_it_rests(self, fits):
        shoulder, elbow, wrist = fits["hinge"].joints
        assert shoulder.shown == "no"
        assert elbow.shown == "weak"
        assert (
            elbow.reason == "the frame of Upper rests on Shoulder, which the movement does not show"
        )
        # The forearm has three markers of its own.
        assert (wrist.shown, wrist.reason) == ("yes", "")

    def test_the_same_movement_below_a_known_joint_is_a_yes(self, fits):
        assert [(joint.shown, joint.reason) for joint in fits["ball"].joints] == [("yes", "")] * 3

    def test_a_place_holder_is_named_as_one(self, fits):
        (note,) = (note for note in fits["hinge"].notes if note.startswith("place holders"))
        assert note.endswith(": Shoulder")
        assert not any("place holders" in note for note in fits["ball"].notes)


def test_skin_that_slides_about_a_joint_at_rest_shows_nothing(tmp_path):
    """Each marker for itself, by 5 degrees and at its distance: it is no rigid segment that moves."""
    recording = two_arms_moving(((0, 0),) * 3, 0.0003)
    points, rng = recording.points.copy(), np.random.default_rng(1)
    for at in columns(recording, "R1", "R2", "R3"):
        slide = Rotation.from_rotvec(rng.normal(0, np.radians(5), (len(points), 3))).as_matrix()
        centre = recording.truth["RightJoint"]
        points[:, at] = centre + np.einsum("fij,fj->fi", slide, points[:, at] - centre)
    arms = association(TWO_ARMS, TWO_ARMS_MARKERS, tmp_path)
    left, right = fit_recording(replace(recording, points=points), arms).joints
    assert left.shown == "yes"
    # All of them lie on spheres about the joint, which is all that a fit of spheres asks.
    assert right.residual < 0.001 < 0.005 < right.weakest_sd
    assert (right.shown, right.reason) == ("no", "moves less than its noise in one direction")


@pytest.mark.real
class TestRealClips:
    def test_all_joints_of_cmu_01_01_are_fitted(self, shared_clips):
        fit = fit_clip(read_clip(shared_clips / "cmu" / "01_01.c3d"))
        assert all(joint.fitted for joint in fit.joints)
        assert [joint.joint for joint in fit.joints] == JOINTS

    def test_joints_that_hardly_move_are_flagged(self, shared_clips):
        (path,) = (shared_clips / "cmu").glob("*asketball*.c3d")
        found = joints(fit_clip(read_clip(path)))
        # The clip's description: elbows, hips and wrists hardly move.
        for name in ("Hip", "Elbow", "Wrist"):
            assert {found[f"{side}{name}"].shown for side in ("Left", "Right")} != {"yes"}

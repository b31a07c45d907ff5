"""Segments of three markers, two, one; some of the time or always (thesis 5.5.1.1 to 5.5.1.3)."""

from dataclasses import replace

import numpy as np
import pytest
from arms import (
    ALL,
    ARM,
    ARM_MARKERS,
    BALL,
    HINGE,
    ONE,
    TWO,
    arm_recording,
    association,
)
from fitted import (
    NOISE,
    ROUNDING,
    columns,
    full_range,
    full_range_fit,
    joints,
    seen,
    without_markers,
)
from recordings import SAMPLES, constant_error, fit_clip, fit_recording

from mocap_skel import read_clip
from mocap_skel.artificial import Faults, circumduct, human, marker_set, range_of_motion, record


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """The association of an arm, a figure of its own."""
    return association(ARM, ARM_MARKERS, tmp_path_factory.mktemp("arm"))


class TestCases:
    """Three markers, two, one; some of the time or always (thesis 5.5.1.1 to 5.5.1.3)."""

    @pytest.mark.parametrize("labels", [ALL, TWO], ids=["three", "two"])
    @pytest.mark.parametrize("pose", ["least-squares", "triad"])
    def test_three_markers_or_two_and_the_joint_are_exact(self, arm, labels, pose):
        recording = arm_recording(labels)
        fit = fit_recording(recording, arm, pose=pose)
        for joint in fit.joints:
            np.testing.assert_allclose(
                joint.track, recording.truth[joint.joint], rtol=0, atol=ROUNDING
            )
        assert [joint.method for joint in fit.joints] == ["MGDK"] * 3
        # Every segment is rigid: its markers keep their places in it.
        for name, segment in fit.segments.items():
            for marker, place in segment.template.items():
                (at,) = columns(recording, marker)
                np.testing.assert_allclose(
                    segment.pose.to_lab(place), recording.clean[:, at], rtol=0, atol=ROUNDING,
                    err_msg=f"{marker} on {name}",
                )  # fmt: skip

    def test_one_marker_on_a_ball_joint_leaves_the_turn_open_and_says_so(self, arm):
        recording = arm_recording(ONE, sigma=0.0003)
        shoulder, elbow, wrist = fit_recording(recording, arm).joints
        assert (shoulder.shown, shoulder.method) == ("yes", "UGDK")
        assert elbow.shown == "no"
        assert "one marker" in elbow.reason or "moves" in elbow.reason
        # The forearm has three markers: its frame, and with it the wrist, rests on nothing else.
        assert wrist.shown == "yes"

    def test_one_marker_on_a_hinge_turns_with_the_hinges_axis(self, arm):
        recording = arm_recording(ONE, shoulder=HINGE, sigma=0.0003)
        fit = fit_recording(recording, arm)
        shoulder, elbow, _ = fit.joints
        assert (shoulder.shown, shoulder.method, shoulder.hinge) == ("no", "SGDK", True)
        # The segment's own joint is where the fit has it, but for noise in each frame.
        upper = fit.segments["Upper"]
        np.testing.assert_allclose(upper.pose.to_lab(upper.joint), shoulder.track, atol=0.002)
        axis = np.einsum("fij,j->fi", fit.segments["Trunk"].pose.rotation, shoulder.axis)
        true = recording.poses["Trunk"].rotation[:, :, 1]
        cosine = np.abs(np.einsum("fi,fi->f", axis, true))
        # The marker swings with r = 0.1 m through ±60°, N = 400: the plane's normal is known to
        # σ/(r sin 60° √(N/2)) and the trunk's frame in each frame to σ over 0.1 m; five of the sum.
        assert np.degrees(np.arccos(cosine.min())) <= np.degrees(5 * 0.0003 * (1 / 1.2 + 1 / 0.1))
        assert elbow.shown in ("weak", "no")
        assert "one marker" in elbow.reason
        error = np.linalg.norm(constant_error(fit, recording, elbow))
        # The frame's x axis is 0.1 m long, the elbow 0.3 m away: 3 σ of noise in each frame, less
        # in the constant; the fit's own error bar comes on top.
        assert error <= 3 * 0.0003 + 3 * np.sqrt(np.trace(elbow.covariance))

    def test_two_markers_in_line_with_the_joint_both_keep_their_places(self, tmp_path):
        """They and the joint are no three points, so the pose is of one; the other stands on the same line."""
        line = {**ARM_MARKERS, "U1": ("Upper", (0.02, 0, -0.10)), "U2": ("Upper", (0.04, 0, -0.20))}
        del line["U3"]
        ranges = {"Trunk": ((-20, 20),) * 3, "Upper": BALL, "Fore": BALL, "Hand": BALL}
        recording = record(
            ARM, line, circumduct(ranges, 8, 50, seed=3), Faults(sigma=0.0003), seed=3
        )
        part = np.arange(400) % 3 > 0
        for rare, often in (("U1", "U2"), ("U2", "U1")):
            seen_less = without_markers(recording, rare, frames=part)
            fit = fit_recording(seen_less, association(ARM, line, tmp_path))
            upper = fit.segments["Upper"]
            assert set(upper.template) == {rare, often}
            # By the generator: 10.2 and 20.4 cm from the joint.
            for marker, away in (("U1", 0.1), ("U2", 0.2)):
                distance = np.linalg.norm(upper.template[marker] - upper.joint)
                assert distance == pytest.approx(np.hypot(away, away / 5), abs=0.001)
            assert upper.pose.known.all()

    def test_drop_outs_that_leave_two_markers_change_nothing_without_noise(self, arm):
        gone = slice(100, 150)
        recording = without_markers(arm_recording(ALL), "U2", frames=gone)
        fit = fit_recording(recording, arm)
        for joint in fit.joints:
            np.testing.assert_allclose(
                joint.track, recording.truth[joint.joint], rtol=0, atol=ROUNDING
            )
        assert fit.segments["Upper"].pose.known.all()

    def test_drop_outs_that_leave_one_marker_are_missing_unless_the_joint_is_a_hinge(self, arm):
        gone = np.zeros(400, dtype=bool)
        gone[100:150] = True
        for shoulder in (BALL, HINGE):
            recording = without_markers(
                arm_recording(ALL, shoulder, 0.0003), "U2", "U3", frames=gone
            )
            fit = fit_recording(recording, arm)
            elbow = joints(fit)["Elbow"]
            if shoulder is BALL:
                np.testing.assert_array_equal(fit.segments["Upper"].pose.known, ~gone)
                np.testing.assert_array_equal(seen(elbow.track), ~gone)
            else:
                assert fit.segments["Upper"].pose.known.all()
                away = elbow.track - recording.truth["Elbow"]
                # The marker is 0.1 m from the joint, the elbow 0.3: three times its noise, and the
                # same again from the joint's and the axis's own; four standard deviations.
                assert np.linalg.norm(away[gone], axis=1).max() <= 4 * 2 * 3 * np.sqrt(3) * 0.0003

    def test_a_frame_without_a_case_is_missing_there_and_below(self, arm):
        labels = tuple(name for name in ALL if name != "F3")
        gone = np.zeros(400, dtype=bool)
        gone[200:220] = True
        recording = without_markers(arm_recording(labels), "U1", "U2", "U3", frames=gone)
        fit = fit_recording(recording, arm)
        tracks = dict(fit.tracks())
        # The shoulder is fixed in the trunk; the elbow in the upper arm, which is not seen; the
        # forearm has two markers only and needs the elbow; wrist and hand hang from it.
        assert seen(tracks["Shoulder"]).all()
        for name in ("Elbow", "Wrist", "Hand"):
            np.testing.assert_array_equal(seen(tracks[name]), ~gone, err_msg=name)
        for name in ("Shoulder", "Elbow", "Wrist"):
            there = seen(tracks[name])
            np.testing.assert_allclose(
                tracks[name][there], recording.truth[name][there], rtol=0, atol=ROUNDING
            )

    def test_the_root_is_missing_where_fewer_than_three_markers_are_seen(self, arm):
        gone = np.zeros(400, dtype=bool)
        gone[30:40] = True
        recording = without_markers(arm_recording(ALL), "T1", "T2", frames=gone)
        tracks = dict(fit_recording(recording, arm).tracks())
        for name in ("Trunk", "Shoulder"):
            np.testing.assert_array_equal(seen(tracks[name]), ~gone, err_msg=name)
        # The arm's own three markers do not need the trunk.
        assert seen(tracks["Elbow"]).all()

    def test_a_segment_that_is_never_seen_with_its_joint_still_has_its_pose(self, arm):
        """The forearm's three markers are seen in the first half, its elbow in the second; but for
        one forearm marker, by which the elbow can be fitted."""
        half = np.arange(400) < 200
        recording = without_markers(arm_recording(ALL, sigma=0.0003), "U2", "U3", frames=half)
        recording = without_markers(recording, "F2", "F3", frames=~half)
        fit = fit_recording(recording, arm)
        np.testing.assert_array_equal(fit.segments["Fore"].pose.known, half)
        assert joints(fit)["Elbow"].fitted

    def test_heavy_drop_outs_end_in_a_fit(self):
        """A third of the samples missing in a short clip, markers and whole segments for seconds."""
        for seed in range(4):
            faults = Faults(sigma=0.001, dropout=0.35, burst=30)
            motion = range_of_motion(4, 60, seed=seed)
            fit = fit_recording(record(human(), marker_set("cmu"), motion, faults, seed=seed))
            assert len(fit.joints) == 14
            for joint in fit.joints:
                assert joint.shown in ("yes", "weak", "no")
                assert joint.fitted == bool(seen(joint.track).any())
                if joint.fitted:
                    assert np.isfinite(joint.standard_error).all()

    def test_a_shape_of_which_one_marker_is_always_missing_is_not_its_mirror_image(self):
        base = full_range(NOISE, 3)
        chest = [i for i, name in enumerate(base.labels) if marker_set("cmu")[name][0] == "Chest"]
        whole = joints(full_range_fit(NOISE, 3))
        for seed in range(3):
            lost = np.random.default_rng(seed).integers(len(chest), size=len(base.points))
            points = base.points.copy()
            points[np.arange(len(points)), np.array(chest)[lost]] = np.nan
            recording = replace(base, points=points)
            fit = fit_recording(recording)
            for name in ("Waist", "Neck", "LeftShoulder", "RightShoulder"):
                joint = joints(fit)[name]
                assert joint.shown == "yes"
                # One marker of seven less: no worse than the project's limit with drop-outs.
                assert np.linalg.norm(constant_error(fit, recording, joint)) <= 0.004
                assert joint.residual == pytest.approx(whole[name].residual, rel=0.25)


def test_a_marker_in_its_joints_noise_turns_with_the_parent():
    """A hand that hardly moves: the wrist comes out beside the finger marker, the line between them noise."""
    fit = fit_clip(read_clip(SAMPLES / "nearly_still.c3d"), "cmu", prior="none")
    hand, forearm = fit.segments["LeftHand"].pose, fit.segments["LowerLeftArm"].pose
    np.testing.assert_array_equal(hand.rotation, forearm.rotation)
    assert any(note.startswith("LeftHand turns with LowerLeftArm") for note in fit.notes)
    # The end point stays where the marker is.
    end = dict(fit.tracks())["LeftHand"]
    np.testing.assert_array_equal(end, hand.origin)


def test_one_marker_at_a_hinge_turns_with_the_hinge_below_where_anatomy_knows_one():
    """The thigh has its knee marker alone: the axis of the knee, by the bones on both sides, gives its turn."""
    motion = range_of_motion(12, 50, seed=2)
    recording = record(human(), marker_set("cmu"), motion, Faults(sigma=0.0003), seed=2)
    recording = without_markers(recording, "LTHI")
    both, pure = (fit_recording(recording, prior=prior) for prior in ("skeleton", "none"))
    knee, unseen = joints(both)["LeftKnee"], joints(pure)["LeftKnee"]
    assert (knee.shown, knee.reason) == ("weak", "UpperLeftLeg stands on one marker")
    assert unseen.shown == "no"
    assert unseen.reason == "the turn of UpperLeftLeg is not seen: one marker"
    # The marker is 5 cm beside the knee: a turn that is off by 10 degrees moves the knee by 9 mm.
    assert np.linalg.norm(constant_error(both, recording, knee)) < 0.01
    segment = both.segments["UpperLeftLeg"]
    assert list(segment.template) == ["LKNE"]
    assert segment.drawn_through == ()
    # The axis goes from the marker on the outside to the inside: from left to right, against the lab's y.
    cosine = np.einsum(
        "fi,fi->f",
        segment.pose.rotation[..., 2],
        -recording.poses["UpperLeftLeg"].rotation[..., 1],
    )
    assert np.degrees(np.arccos(np.median(cosine))) < 10

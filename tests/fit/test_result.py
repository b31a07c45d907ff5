"""What a fit gives: tracks, frames, segments, evidence; for the human figure and for any other tree."""

import numpy as np
import pytest
from arms import ALL, BALL, arm_recording
from fitted import (
    ENDS,
    EPS,
    JOINTS,
    ROUNDING,
    columns,
    full_range,
    full_range_fit,
    short,
    short_fit,
)
from recordings import clip_of, constant_error, fit_recording, known

from mocap_skel import associate, fit_skeleton, read_association
from mocap_skel.artificial import Faults, Figure, Segment, circumduct, record


class TestResult:
    def test_frame_numbers_and_time_are_the_files(self):
        fit = short_fit()
        np.testing.assert_array_equal(fit.frame_numbers, np.arange(51, 351))
        # (frame - 1) / rate: a clip that was cut out keeps its place.
        np.testing.assert_allclose(fit.time, np.arange(50, 350) / 30, rtol=4 * EPS)

    def test_tracks_are_the_joints_then_the_root_then_the_ends(self):
        tracks = list(short_fit().tracks())
        assert [name for name, _ in tracks] == [*JOINTS, "Hips", *ENDS]
        assert all(track.shape == (300, 3) for _, track in tracks)

    def test_root_and_ends_are_where_their_markers_say(self):
        recording = full_range(None, 1)
        tracks = dict(full_range_fit(None, 1).tracks())
        for name, markers in {
            "Hips": ("RFWT", "LFWT", "RBWT", "LBWT"),
            "Head": ("RFHD", "LFHD", "RBHD", "LBHD"),
            "RightHand": ("RFIN",),
            "LeftHand": ("LFIN",),
            # The heel is no part of a foot's end.
            "RightFoot": ("RTOE", "RMT5"),
            "LeftFoot": ("LTOE", "LMT5"),
        }.items():
            middle = recording.clean[:, columns(recording, *markers)].mean(axis=1)
            np.testing.assert_allclose(tracks[name], middle, rtol=0, atol=ROUNDING, err_msg=name)

    def test_a_joint_is_where_its_segments_poses_say(self):
        """A track is the constant in the parent's frame; in the child's it is a constant as well."""
        for joint in full_range_fit(None, 1).joints:
            segments = full_range_fit(None, 1).segments
            np.testing.assert_array_equal(
                joint.track, segments[joint.parent].pose.to_lab(joint.centre)
            )
            np.testing.assert_allclose(
                joint.track, segments[joint.child].pose.to_lab(segments[joint.child].joint),
                rtol=0, atol=ROUNDING,
            )  # fmt: skip

    def test_every_segments_frame_is_rigid_and_right_handed(self):
        for name, segment in short_fit().segments.items():
            rotation = segment.pose.rotation[segment.pose.known]
            assert len(rotation) > 100, name
            unit = rotation.swapaxes(1, 2) @ rotation
            np.testing.assert_allclose(unit, np.broadcast_to(np.eye(3), unit.shape), atol=1e-12)
            assert (np.linalg.det(rotation) > 0).all()

    def test_evidence_adds_up(self):
        recording, fit = short(), short_fit()
        for joint in fit.joints:
            there = fit.segments[joint.parent].pose.known
            assert len(joint.radius) == len(joint.markers)
            assert joint.standard_error.shape == (3,)
            assert 1 <= joint.effective <= joint.samples
            labels = {"RTIB": "RSHN", "LTIB": "LSHN", "RARM": "RFRM", "LARM": "LFRM"}
            at = columns(recording, *(labels.get(m, m) for m in joint.markers))
            points = recording.points[:, at]
            assert joint.samples == np.isfinite(points[there, :, 0]).sum()
            away = np.linalg.norm(points - joint.track[:, None], axis=2)[there]
            errors = away - np.nanmean(away, axis=0)
            assert joint.residual == pytest.approx(np.sqrt(np.nanmean(errors**2)), rel=1e-9)


HAND_TOML = """
name = "paw"
[[segment]]
name = "Toe B"
parent = "Palm"
joint = "Knuckle B"
markers = ["B1", "B2"]
[[segment]]
name = "Palm"
markers = ["P1", "P2", "P3"]
[[segment]]
name = "Toe A"
parent = "Palm"
joint = "Knuckle A"
markers = ["A1", "A2"]
[[segment]]
name = "Claw A"
parent = "Toe A"
joint = "Tip A"
markers = ["C1"]
"""


def test_any_other_tree_is_a_file(tmp_path):
    """A dog's paw, a tenth of a human in size: two toes, one of them with a claw."""
    (tmp_path / "paw.toml").write_text(HAND_TOML)
    (tmp_path / "paw.txt").write_text(
        '@skeleton paw.toml\nP1 P1\nP2 P2\nP3 P3\n"palm four" P4 Palm\n'
        "A1 A1\nA2 A2\nB1 B1\nB2 B2\nC1 C1\n"
    )
    figure = Figure(
        (
            Segment("Palm", offset=(1.0, 2.0, 0.5)),
            Segment("Toe A", "Palm", "Knuckle A", (0.04, 0.015, 0.0)),
            Segment("Claw A", "Toe A", "Tip A", (0.05, 0.0, 0.0), end=(0.03, 0.0, 0.0)),
            Segment("Toe B", "Palm", "Knuckle B", (0.04, -0.015, 0.0), end=(0.05, 0.0, 0.0)),
        )
    )
    markers = {
        "P1": ("Palm", (0.03, 0.02, 0.01)), "P2": ("Palm", (0.03, -0.02, 0.01)),
        "P3": ("Palm", (-0.02, 0.0, 0.012)), "palm four": ("Palm", (0.0, 0.025, -0.01)),
        "A1": ("Toe A", (0.02, 0.004, 0.008)), "A2": ("Toe A", (0.04, -0.006, 0.007)),
        "C1": ("Claw A", (0.025, 0.0, 0.005)),
        "B1": ("Toe B", (0.02, -0.004, 0.008)), "B2": ("Toe B", (0.04, 0.006, 0.007)),
    }  # fmt: skip
    ranges = {"Palm": ((-30, 30),) * 3, "Toe A": BALL, "Claw A": BALL, "Toe B": BALL}
    paw = read_association(tmp_path / "paw.txt")
    assert [s.name for s in paw.skeleton.segments] == ["Palm", "Toe B", "Toe A", "Claw A"]
    exact = record(figure, markers, circumduct(ranges, 10, 50, seed=2))
    noisy = record(figure, markers, circumduct(ranges, 10, 50, seed=2), Faults(sigma=1e-4), seed=2)
    fit = fit_recording(exact, paw)
    assert [name for name, _ in fit.tracks()] == [
        "Knuckle B", "Knuckle A", "Tip A", "Palm", "Toe B", "Claw A"
    ]  # fmt: skip
    assert set(fit.segments["Palm"].template) == {"P1", "P2", "P3", "P4"}
    for joint in fit.joints:
        np.testing.assert_allclose(joint.track, exact.truth[joint.joint], rtol=0, atol=ROUNDING)
    fit = fit_recording(noisy, paw)
    for joint in fit.joints:
        assert joint.shown == "yes"
        # 0.1 mm on a tenth of the size: a tenth of the human's limit.
        assert np.linalg.norm(constant_error(fit, noisy, joint)) <= 0.0002


def test_a_figure_of_one_segment_has_one_track(tmp_path):
    (tmp_path / "box.toml").write_text('[[segment]]\nname = "Box"\nmarkers = ["T1", "T2", "T3"]\n')
    (tmp_path / "box.txt").write_text("@skeleton box.toml\nT1 T1\nT2 T2\nT3 T3\n")
    fit = fit_recording(arm_recording(ALL), read_association(tmp_path / "box.txt"))
    assert fit.joints == ()
    assert [name for name, _ in fit.tracks()] == ["Box"]


class TestDrawnThrough:
    @pytest.mark.parametrize("pose", ["least-squares", "triad"])
    def test_a_segments_axes_go_through_three_points_that_it_names(self, pose):
        """The thesis's frame (235) to (238): x̂ to the second, ẑ ∝ (third - first) × x̂."""
        fit = fit_recording(full_range(None), pose=pose)
        assert fit.segments["Hips"].drawn_through == ("RFWT", "LFWT", "RBWT")
        for segment in fit.segments.values():
            if not segment.drawn_through:
                assert len(segment.template) == 1
                continue
            joint = next((j.joint for j in fit.joints if j.child == segment.name), "")
            places = {**segment.template, joint: segment.joint}
            first, second, third = (places[name] for name in segment.drawn_through)
            along, beside = second - first, third - first
            np.testing.assert_allclose(along[1:], 0.0, rtol=0, atol=ROUNDING)
            assert along[0] > 0
            # Of beside × x̂ only a ẑ of the right sign is left: beside lies at -ŷ.
            np.testing.assert_allclose(beside[2], 0.0, rtol=0, atol=ROUNDING)
            assert beside[1] < 0

    def test_a_segment_of_two_markers_is_drawn_through_its_joint(self):
        fit = full_range_fit()
        assert set(fit.segments["UpperLeftLeg"].drawn_through) == {"LTHI", "LKNE", "LeftHip"}
        assert fit.segments["LeftHand"].drawn_through == ()


def test_an_assignment_knows_nothing_of_methods():
    """A fit by the library alone: the clip, who is who, the skeleton, and how."""
    clip = clip_of(full_range())
    (subject,) = associate(clip, known("cmu"))
    fit = fit_skeleton(clip, subject, known("cmu").skeleton, method="pratt", noise="rigid")
    for a, b in zip(fit.joints, full_range_fit(method="pratt").joints, strict=True):
        np.testing.assert_array_equal(a.centre, b.centre)

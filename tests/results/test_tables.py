"""The numbers of the joint table and of the long table, each by hand."""

from dataclasses import replace

import numpy as np
import pytest
from recordings import fit_sample, gappy

from mocap_skel.results.tables import axis_ends, joint_row, joint_rows, point_columns, track_kinds


def with_tracks(**tracks):
    """A fit in which some joints are elsewhere."""
    fit = fit_sample("nearly_still")
    joints = tuple(replace(j, track=tracks.get(j.joint, j.track)) for j in fit.joints)
    return replace(fit, joints=joints)


def along(axis, *lengths):
    """A track of 300 frames on one axis, its lengths over and over."""
    track = np.zeros((300, 3))
    track[:, axis] = np.tile(lengths, 300 // len(lengths))
    return track


def rows_of(fit):
    return {row["joint"]: row for row in joint_rows(fit)}


class TestBones:
    def test_lengths_spread_and_sides_are_those_of_the_tracks(self):
        """Left: 0.40, 0.40, 0.46 m: the median is 0.40, the mean 0.42, the variance 0.0024 / 3. Right: 0.50 m."""
        fit = with_tracks(
            LeftHip=along(0, 0.0), LeftKnee=along(2, 0.40, 0.40, 0.46),
            RightHip=along(0, 1.0), RightKnee=along(0, 1.5),
        )  # fmt: skip
        rows = rows_of(fit)
        left, right = rows["LeftKnee"], rows["RightKnee"]
        assert (left["bone"], right["bone"]) == (0.40, 0.50)
        assert left["bone_sd"] == pytest.approx(np.sqrt(0.0008), abs=5e-7)
        assert right["bone_sd"] == 0.0
        # How much longer than the other, as a share of their mean, 0.45 m.
        assert left["side_difference"] == pytest.approx(-0.10 / 0.45, abs=5e-7)
        assert right["side_difference"] == pytest.approx(+0.10 / 0.45, abs=5e-7)

    def test_frames_that_are_missing_do_not_count(self):
        knee = along(2, 0.40)
        knee[10:20] = np.nan
        row = rows_of(with_tracks(LeftHip=along(0, 0.0), LeftKnee=knee))["LeftKnee"]
        assert (row["bone"], row["bone_sd"]) == (0.40, 0.0)

    def test_a_joint_without_a_bone_or_another_side_has_none(self):
        rows = rows_of(fit_sample("nearly_still"))
        # The hips are on the root, which has no joint of its own.
        assert rows["LeftHip"]["bone"] is rows["LeftHip"]["bone_sd"] is None
        assert rows["Neck"]["side_difference"] is None and rows["Neck"]["bone"] > 0.3

    def test_a_joint_apart_from_a_skeleton_has_no_bone(self):
        joint = fit_sample("nearly_still").joints[1]
        assert joint_row(joint)["bone"] is None
        assert joint_row(joint)["x"] == round(joint.centre[0], 6)


class TestEvidence:
    def test_each_number_is_in_its_own_column(self):
        joint = replace(
            fit_sample("nearly_still").joints[0],
            centre=np.array([0.1, -0.2, 0.3]), covariance=np.diag([1e-6, 4e-6, 9e-6]),
            angle=np.radians(30.0), share=0.25, landmarks=("pelvis", "LTHI"), source="Bell 1990",
            residual=0.004, sigma=0.001, weakest_sd=0.02, effective=12.34, samples=600,
            radius=np.array([0.5, 0.25]),
        )  # fmt: skip
        row = joint_row(joint)
        assert [row[c] for c in "xyz"] == [0.1, -0.2, 0.3]
        assert [row[f"se_{c}"] for c in "xyz"] == [0.001, 0.002, 0.003]
        assert (row["theta_deg"], row["from_motion"]) == (30.0, 0.25)
        assert row["prior"] == "pelvis LTHI (Bell 1990)"
        assert (row["residual"], row["sigma"], row["weakest_sd"]) == (0.004, 0.001, 0.02)
        assert (row["samples"], row["effective_samples"]) == (600, 12.3)
        assert row["radius"] == [0.5, 0.25]

    def test_what_is_no_number_is_none_and_zero_has_no_sign(self):
        joint = replace(
            fit_sample("nearly_still").joints[0], centre=np.array([-1e-9, np.nan, np.inf])
        )
        row = joint_row(joint)
        assert str(row["x"]) == "0.0" and row["y"] is row["z"] is None


class TestLongTable:
    def test_a_row_is_a_frame_and_a_point_frame_by_frame(self):
        fit = gappy()
        columns = point_columns(fit)
        tracks = list(fit.tracks())
        assert columns["point"][: len(tracks)].tolist() == [name for name, _ in tracks]
        assert columns["frame"][: len(tracks) + 1].tolist() == [101] * len(tracks) + [102]
        # The third frame's fifth point; times are (frame - 1) / rate.
        at = 2 * len(tracks) + 4
        assert columns["time"][at] == 102 / 60
        place = [columns[axis][at] for axis in "xyz"]
        np.testing.assert_array_equal(place, tracks[4][1][2])

    def test_kinds_are_joint_origin_and_end(self):
        kinds = [(name, kind) for name, kind, _ in track_kinds(gappy())]
        assert [kind for _, kind in kinds] == ["joint"] * 14 + ["origin"] + ["end"] * 5
        assert kinds[14] == ("Hips", "origin") and kinds[15] == ("Head", "end")


def test_a_hinges_axis_stands_in_its_row_and_its_line_goes_through_the_joint():
    fit = fit_sample("range_of_motion")
    rows = {row["joint"]: row for row in joint_rows(fit)}
    elbow = next(j for j in fit.joints if j.joint == "LeftElbow")
    cells = [rows["LeftElbow"][f"axis_{name}"] for name in ("x", "y", "z", "se_deg")]
    assert cells[:3] == pytest.approx(elbow.turns_on.direction, abs=1e-4)
    assert 0 < cells[3] < 20
    assert [rows["LeftHip"][f"axis_{name}"] for name in ("x", "y", "z", "se_deg")] == [None] * 4
    first, second = axis_ends(fit, elbow, 0.1)
    assert np.allclose(0.5 * (first + second), elbow.track, equal_nan=True)
    long = np.linalg.norm(second - first, axis=1)
    assert np.allclose(long[np.isfinite(long)], 0.2)

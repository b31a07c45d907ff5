"""The rows of joints.csv and the columns of skeleton.csv, on fits made by hand."""

from dataclasses import replace

import numpy as np
import pytest
from handmade import fit_of, joint, leg

from mocap_skel.joints.joint_fit import unfitted
from mocap_skel.results.tables import (
    JOINT_COLUMNS,
    joint_row,
    joint_rows,
    point_columns,
    track_columns,
)


def with_lengths(side, *lengths):
    """A knee and an ankle, in each frame so far below it; NaN = the ankle is not seen."""
    knee, ankle = leg(side, 0.0)
    below = np.zeros((len(lengths), 3))
    below[:, 2] = lengths
    return knee, replace(ankle, track=knee.track - below)


def test_a_bones_length_is_its_median_and_its_scatter_the_standard_deviation():
    left = with_lengths("Left", 0.40, 0.42, 0.46, np.nan, 0.42)
    right = with_lengths("Right", 0.40, 0.40, 0.40, 0.40, 0.40)
    rows = {row["joint"]: row for row in joint_rows(fit_of(*left, *right))}
    ankle, other = rows["LeftAnkle"], rows["RightAnkle"]
    # Of 40, 42, 46 and 42 cm the median is 42 and the mean 42.5: √((2.5² + 0.5² + 3.5² + 0.5²) / 4) = 2.179449 cm.
    assert (ankle["bone"], ankle["bone_sd"]) == (0.42, 0.021794)
    assert (other["bone"], other["bone_sd"]) == (0.40, 0.0)
    # 2 cm of the mean 41 cm; the longer side is the positive one.
    assert ankle["side_difference"] == 0.04878 == -other["side_difference"]
    # Nothing is above a knee that hangs on the root.
    assert [rows["LeftKnee"][name] for name in ("bone", "bone_sd", "side_difference")] == [None] * 3


def test_a_bone_that_is_never_seen_has_no_length_and_differs_from_nothing():
    gone = with_lengths("Left", *[np.nan] * 5)
    rows = {row["joint"]: row for row in joint_rows(fit_of(*gone, *leg("Right", 0.4)))}
    assert [rows["LeftAnkle"][name] for name in ("bone", "bone_sd", "side_difference")] == [
        None
    ] * 3
    assert (rows["RightAnkle"]["bone"], rows["RightAnkle"]["side_difference"]) == (0.4, None)


def test_a_row_has_the_joints_own_values():
    shown = replace(
        joint("LeftHip", landmarks=("LASI", "RASI"), at=(0.1, -0.0000001, 0.3)),
        covariance=np.diag([0.01**2, 0.02**2, 0.03**2]), effective=12.34, radius=np.array([0.2, np.nan]),
        residual=0.0021, sigma=0.0013, weakest_sd=0.0342, angle=np.radians(37.2), share=0.2504,
        shown="weak", reason="little", method="MGDK", source="Harrington 2007", markers=("A", "B"),
    )  # fmt: skip
    row = joint_row(shown)
    assert row == {
        "joint": "LeftHip", "parent": "Root", "child": "LeftHipPart", "x": 0.1, "y": 0.0, "z": 0.3,
        "se_x": 0.01, "se_y": 0.02, "se_z": 0.03, "markers": ["A", "B"], "samples": 100,
        "effective_samples": 12.3, "radius": [0.2, None], "residual": 0.0021, "sigma": 0.0013,
        "weakest_sd": 0.0342, "theta_deg": 37.2, "shown": "weak", "method": "MGDK", "reason": "little",
        "from_motion": 0.25, "prior": "LASI RASI (Harrington 2007)", "bone": None, "bone_sd": None,
        "side_difference": None, "determined": "weak",
        "axis_x": None, "axis_y": None, "axis_z": None, "axis_se_deg": None,
        "angles": [], "angles_se_deg": [],
    }  # fmt: skip
    assert tuple(row) == JOINT_COLUMNS
    # A place of minus nothing would be written as -0.
    assert np.copysign(1.0, row["y"]) == 1.0


def test_what_an_unfitted_joint_has_no_value_for_is_none():
    row = joint_row(unfitted("Neck", "Chest", "Head", 5, "no marker on Head"))
    there = {"joint", "parent", "child", "markers", "samples", "effective_samples", "radius", "shown",
             "method", "reason", "prior", "angles", "angles_se_deg", "determined"}  # fmt: skip
    assert {name for name, value in row.items() if value is not None} == there
    assert (row["shown"], row["samples"], row["prior"]) == ("no", 0, "")


def test_long_form_has_every_point_of_a_frame_before_the_next_frame():
    fit = fit_of(*with_lengths("Left", 0.1, 0.2, 0.3, np.nan, 0.5), segments=("LeftAnklePart",))
    fit = replace(fit, subject="Anna", frame_numbers=np.arange(101, 106), rate=50.0)
    names, values = track_columns(fit)
    long = point_columns(fit)
    points = ["LeftKnee", "LeftAnkle", "Root", "LeftAnklePart"]
    assert list(long["point"][:4]) == points and list(long["point"][4:8]) == points
    assert list(long["kind"][:4]) == ["joint", "joint", "origin", "end"]
    assert names == [f"{point}_{axis}" for point in points for axis in "xyz"]
    np.testing.assert_array_equal(long["frame"], np.repeat([101, 102, 103, 104, 105], 4))
    # Frame 101 at 50 Hz is 2 seconds into the take.
    np.testing.assert_allclose(long["time"][::4], [2.0, 2.02, 2.04, 2.06, 2.08])
    np.testing.assert_allclose(long["z"][1::4], 1.0 - np.array([0.1, 0.2, 0.3, np.nan, 0.5]))
    assert {*long["clip"]} == {"c"} and {*long["subject"]} == {"Anna"}
    # The wide form has the same numbers.
    xyz = np.stack([long[axis] for axis in "xyz"], axis=1)
    np.testing.assert_array_equal(xyz.reshape(5, 12), values)
    assert {len(column) for column in long.values()} == {20}


@pytest.mark.parametrize("share", [0.0, 0.4999, 1.0])
def test_the_share_of_the_movement_has_three_digits(share):
    assert joint_row(joint("Hip", share=share))["from_motion"] == round(share, 3)

"""The tables of a fit, as CSV and as pandas has them."""

import csv
import io
import re
from dataclasses import replace

import numpy as np
from recordings import fit_sample, gappy

from mocap_skel import joints_table, tracks_table
from mocap_skel.export.tables_csv import joints_csv, rows_csv, skeleton_csv

MICROMETRE = 1e-6
# Values are rounded to the micrometre: half of one, and the rounding of that.
HALF = 0.5 * MICROMETRE * (1 + 1e-9)


def rows(text):
    return list(csv.reader(io.StringIO(text)))


def numbers(cells):
    return np.array([float(cell) if cell else np.nan for cell in cells])


class TestSkeletonCsv:
    def test_one_column_triple_a_track_in_the_skeletons_order(self):
        head = rows(str(skeleton_csv(gappy())))[0]
        names = [name for name, _ in gappy().tracks()]
        assert head == ["frame", "time", *(f"{name}_{axis}" for name in names for axis in "xyz")]
        assert len(names) == 14 + 1 + 5
        assert names[14:] == ["Hips", "Head", "RightHand", "LeftHand", "RightFoot", "LeftFoot"]

    def test_frame_is_the_files_own_number_and_time_goes_with_it(self):
        table = rows(str(skeleton_csv(gappy())))[1:]
        assert [row[0] for row in table] == [str(n) for n in range(101, 401)]
        # Six decimals of seconds.
        np.testing.assert_allclose(
            numbers(row[1] for row in table), np.arange(100, 400) / 60, rtol=0, atol=0.5e-6 + 1e-12
        )

    def test_values_are_the_tracks_to_the_micrometre_and_missing_is_empty(self):
        table = rows(str(skeleton_csv(gappy())))[1:]
        tracks = np.hstack([track for _, track in gappy().tracks()])
        found = np.array([numbers(row[2:]) for row in table])
        np.testing.assert_array_equal(np.isnan(found), np.isnan(tracks))
        np.testing.assert_allclose(found, tracks, rtol=0, atol=HALF)
        # Some frames, a whole branch, and most are there.
        missing = np.isnan(tracks).mean(axis=0)
        assert ((missing > 0) & (missing < 0.5)).any() and (missing == 1).sum() >= 6
        assert missing.mean() < 0.3

    def test_cells_are_plain_numbers(self):
        text = str(skeleton_csv(gappy()))
        assert text.isascii() and text.endswith("\n") and "\r" not in text
        for row in rows(text)[1:]:
            assert row[0].isdigit()
            assert all(re.fullmatch(r"-?\d+\.\d{6}|", cell) for cell in row[1:])

    def test_zero_has_no_sign(self):
        fit = gappy()
        near = np.array([-1e-9, -0.0, -4.9e-7])
        tiny = replace(
            fit, joints=(replace(fit.joints[0], track=np.tile(near, (300, 1))), *fit.joints[1:])
        )
        text = str(skeleton_csv(tiny))
        assert rows(text)[1][2:5] == ["0.000000"] * 3
        assert "-0.000000" not in text

    def test_a_comma_in_a_name_does_not_move_the_columns(self):
        fit = gappy()
        named = replace(fit, joints=(replace(fit.joints[0], joint="Waist, low"), *fit.joints[1:]))
        head, first = rows(str(skeleton_csv(named)))[:2]
        assert len(head) == len(first)
        assert head[2] == "Waist, low_x"


class TestJointsCsv:
    COLUMNS = (
        "joint", "parent", "child", "x", "y", "z", "se_x", "se_y", "se_z", "markers", "samples",
        "effective_samples", "radius", "residual", "sigma", "weakest_sd", "theta_deg",
        "shown", "method", "reason",
        "from_motion", "prior", "bone", "bone_sd", "side_difference", "determined",
        "axis_x", "axis_y", "axis_z", "axis_se_deg",
        "angles", "angles_se_deg",
    )  # fmt: skip

    def test_one_row_a_joint_with_the_columns_of_the_format(self):
        table = rows(joints_csv(gappy()))
        assert tuple(table[0]) == self.COLUMNS
        assert [row[0] for row in table[1:]] == [joint.joint for joint in gappy().joints]
        assert {len(row) for row in table} == {len(self.COLUMNS)}

    def test_values_are_the_joints(self):
        for row, joint in zip(
            csv.DictReader(io.StringIO(joints_csv(gappy()))), gappy().joints, strict=True
        ):
            assert (row["joint"], row["parent"], row["child"]) == (
                joint.joint,
                joint.parent,
                joint.child,
            )
            assert (row["shown"], row["method"], row["reason"]) == (
                joint.shown, joint.method, joint.reason,
            )  # fmt: skip
            assert row["determined"] == joint.shown
            assert row["markers"].split() == list(joint.markers)
            assert row["samples"] == str(joint.samples)
            if not joint.fitted:
                assert {
                    row[c] for c in ("x", "y", "z", "se_x", "residual", "sigma", "theta_deg")
                } == {""}
                continue
            for columns, values, half in (
                ("xyz", joint.centre, HALF),
                (("se_x", "se_y", "se_z"), joint.standard_error, HALF),
                (("residual",), [joint.residual], HALF),
                (("sigma",), [joint.sigma], HALF),
                (("weakest_sd",), [joint.weakest_sd], HALF),
                (("theta_deg",), [np.degrees(joint.angle)], 0.005 * (1 + 1e-9)),
                (("effective_samples",), [joint.effective], 0.05 * (1 + 1e-9)),
            ):
                np.testing.assert_allclose(
                    [float(row[c]) for c in columns], values, rtol=0, atol=half, err_msg=joint.joint
                )
            np.testing.assert_allclose(
                numbers(row["radius"].split()), joint.radius, rtol=0, atol=HALF
            )

    def test_what_is_not_known_is_empty(self):
        table = {row["joint"]: row for row in csv.DictReader(io.StringIO(joints_csv(gappy())))}
        wrist = table["LeftWrist"]
        assert (wrist["shown"], wrist["samples"], wrist["method"]) == ("no", "0", "")
        assert wrist["reason"] == "no marker on LeftHand"
        assert "nan" not in joints_csv(gappy()).lower()

    def test_a_reason_with_a_comma_is_one_cell(self):
        (weak, *_) = (j for j in fit_sample("two_dancers").joints if "," in j.reason)
        table = {
            r["joint"]: r
            for r in csv.DictReader(io.StringIO(joints_csv(fit_sample("two_dancers"))))
        }
        assert table[weak.joint]["reason"] == weak.reason

    def test_a_figure_without_joints_has_a_header_only(self):
        assert rows(joints_csv(replace(gappy(), joints=()))) == [list(self.COLUMNS)]


class TestPandas:
    def test_the_tracks_are_those_of_the_csv(self):
        table = tracks_table(gappy())
        head, *body = rows(str(skeleton_csv(gappy())))
        assert [table.index.name, *table.columns] == head
        assert table.index.tolist() == [int(row[0]) for row in body]
        found = np.array([numbers(row[1:]) for row in body])
        np.testing.assert_array_equal(np.isnan(found), table.isna().to_numpy())
        np.testing.assert_allclose(found, table.to_numpy(), rtol=0, atol=HALF)

    def test_the_joints_are_those_of_the_csv(self):
        table = joints_table(gappy())
        head, *body = rows(joints_csv(gappy()))
        assert [table.index.name, *table.columns] == head
        assert table.index.tolist() == [row[0] for row in body]
        for row in body:
            for name, cell in zip(head[1:], row[1:], strict=True):
                value = table.loc[row[0], name]
                if isinstance(value, list):
                    kind = str if name in ("markers", "angles") else float
                    assert [kind(part) for part in cell.split()] == value
                elif isinstance(value, str):
                    assert cell == value
                elif cell == "":
                    assert value is None or np.isnan(value)
                else:
                    # Both are the same rounded number.
                    assert float(cell) == float(value)


def test_rows_of_a_study_have_nine_digits_and_no_word_for_what_is_not_known():
    rows_ = [{"a": 1 / 3, "b": None}, {"a": np.nan, "b": "x, y"}, {"a": 123456.789012, "b": 7}]
    assert rows_csv(rows_) == 'a,b\n0.333333333,\n,"x, y"\n123456.789,7\n'
    assert rows_csv([]) == "\n"

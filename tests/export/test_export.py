"""Tables, their turning, and files that are written whole or not at all."""

import csv
import io
import os
import re
import stat
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings import clip_of, fit_clip, fit_recording, fit_sample

from mocap_skel import joints_table, read_association, read_clip, tracks_table
from mocap_skel.artificial import Faults, human, marker_set, range_of_motion, record
from mocap_skel.errors import ExportError, MocapSkelError, OutputError
from mocap_skel.export import WRITERS, Options
from mocap_skel.export.files import check_free, safe_name, write_all
from mocap_skel.export.tables_csv import joints_csv, skeleton_csv
from mocap_skel.pipeline.clip_files import process
from mocap_skel.pipeline.job import Job
from mocap_skel.results.axes import turned

MICROMETRE = 1e-6
# Values are rounded to the micrometre: half of one, and the rounding of that.
HALF = 0.5 * MICROMETRE * (1 + 1e-9)
AXES = ("x", "y", "z")


@cache
def gappy():
    """A fit with everything missing that can be: frames, a joint's branch, a number near zero."""
    motion = range_of_motion(5, 60, seed=2)
    faults = Faults(sigma=0.001, dropout=0.1, lost=("LFIN",))
    recording = record(
        human(), marker_set("cmu"), motion, faults, seed=2, first_frame=101, place=(-0.2, 0.1, 0.0)
    )
    return fit_recording(recording, prior="none")


def rows(text):
    return list(csv.reader(io.StringIO(text)))


def numbers(cells):
    return np.array([float(cell) if cell else np.nan for cell in cells])


class TestSkeletonCsv:
    def test_one_column_triple_a_track_in_the_skeletons_order(self):
        head = rows(skeleton_csv(gappy()))[0]
        names = [name for name, _ in gappy().tracks()]
        assert head == ["frame", "time", *(f"{name}_{axis}" for name in names for axis in "xyz")]
        assert len(names) == 14 + 1 + 5
        assert names[14:] == ["Hips", "Head", "RightHand", "LeftHand", "RightFoot", "LeftFoot"]

    def test_frame_is_the_files_own_number_and_time_goes_with_it(self):
        table = rows(skeleton_csv(gappy()))[1:]
        assert [row[0] for row in table] == [str(n) for n in range(101, 401)]
        # Six decimals of seconds.
        np.testing.assert_allclose(
            numbers(row[1] for row in table), np.arange(100, 400) / 60, rtol=0, atol=0.5e-6 + 1e-12
        )

    def test_values_are_the_tracks_to_the_micrometre_and_missing_is_empty(self):
        table = rows(skeleton_csv(gappy()))[1:]
        tracks = np.hstack([track for _, track in gappy().tracks()])
        found = np.array([numbers(row[2:]) for row in table])
        np.testing.assert_array_equal(np.isnan(found), np.isnan(tracks))
        np.testing.assert_allclose(found, tracks, rtol=0, atol=HALF)
        # Some frames, a whole branch, and most are there.
        missing = np.isnan(tracks).mean(axis=0)
        assert ((missing > 0) & (missing < 0.5)).any() and (missing == 1).sum() >= 6
        assert missing.mean() < 0.3

    def test_cells_are_plain_numbers(self):
        text = skeleton_csv(gappy())
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
        text = skeleton_csv(tiny)
        assert rows(text)[1][2:5] == ["0.000000"] * 3
        assert "-0.000000" not in text

    def test_a_comma_in_a_name_does_not_move_the_columns(self):
        fit = gappy()
        named = replace(fit, joints=(replace(fit.joints[0], joint="Waist, low"), *fit.joints[1:]))
        head, first = rows(skeleton_csv(named))[:2]
        assert len(head) == len(first)
        assert head[2] == "Waist, low_x"


class TestJointsCsv:
    COLUMNS = (
        "joint", "parent", "child", "x", "y", "z", "se_x", "se_y", "se_z", "markers", "samples",
        "effective_samples", "radius", "residual", "sigma", "weakest_sd", "theta_deg",
        "shown", "method", "reason",
        "from_motion", "prior", "bone", "bone_sd", "side_difference", "determined",
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
        head, *body = rows(skeleton_csv(gappy()))
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
                    kind = str if name == "markers" else float
                    assert [kind(part) for part in cell.split()] == value
                elif isinstance(value, str):
                    assert cell == value
                elif cell == "":
                    assert value is None or np.isnan(value)
                else:
                    # Both are the same rounded number.
                    assert float(cell) == float(value)


class TestTurned:
    @pytest.mark.parametrize("up", AXES)
    def test_a_turned_fit_is_the_same_figure_with_another_axis_up(self, up):
        fit, other = gappy(), turned(gappy(), up)
        assert other.up == up
        # The vertical coordinate goes where it should, and the others keep their turn: right-handed.
        move = [AXES.index("z"), (AXES.index("z") + 1) % 3, (AXES.index("z") + 2) % 3]
        to = [AXES.index(up), (AXES.index(up) + 1) % 3, (AXES.index(up) + 2) % 3]
        for (name, before), (_, after) in zip(fit.tracks(), other.tracks(), strict=True):
            # A pose turned and then applied rounds otherwise than a track that is turned: by a few
            # eps of metres.
            np.testing.assert_allclose(
                after[:, to], before[:, move], rtol=0, atol=1e-14, equal_nan=True, err_msg=name
            )
        for name, segment in other.segments.items():
            rotation = segment.pose.rotation[segment.pose.known]
            np.testing.assert_allclose(np.linalg.det(rotation), 1.0, rtol=0, atol=1e-12)
            for joint in other.joints:
                if joint.parent == name and joint.fitted:
                    np.testing.assert_allclose(
                        segment.pose.to_lab(joint.centre),
                        joint.track,
                        rtol=0,
                        atol=1e-14,
                        equal_nan=True,
                    )
        # The constants and the evidence are in segments' frames, which do not know of the lab.
        for before, after in zip(fit.joints, other.joints, strict=True):
            for name in set(vars(before)) - {"track"}:
                np.testing.assert_array_equal(getattr(before, name), getattr(after, name))

    def test_there_and_back_is_where_it_was(self):
        for up in AXES:
            back = turned(turned(gappy(), up), "z")
            for (name, a), (_, b) in zip(gappy().tracks(), back.tracks(), strict=True):
                np.testing.assert_array_equal(a, b, err_msg=name)

    def test_the_clips_own_axis_is_no_turn(self):
        assert turned(gappy(), None) is gappy()
        assert turned(gappy(), "z") is gappy()

    def test_the_csv_is_turned_on_request_only(self):
        as_is, y_up = (WRITERS["csv"](gappy(), Options(up)) for up in (None, "y"))
        assert as_is.files[".skeleton.csv"] == skeleton_csv(gappy())
        z, y = (rows(r.files[".skeleton.csv"]) for r in (as_is, y_up))
        assert z[0] == y[0]
        at = z[0].index("Hips_x")
        for a, b in zip(z[1:], y[1:], strict=True):
            # (x, y, z) with z up is (y, z, x) with y up.
            assert b[at : at + 3] == [a[at + 1], a[at + 2], a[at]]
        assert as_is.files[".joints.csv"] == y_up.files[".joints.csv"]

    def test_bvh_is_y_up_unless_told(self):
        fit = fit_sample("nearly_still")
        default, y, z = (WRITERS["bvh"](fit, Options(up)).files[".bvh"] for up in (None, "y", "z"))
        assert default == y != z


def files(folder):
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())


class TestWriteAll:
    def test_contents_are_there_to_the_byte(self, tmp_path):
        write_all({tmp_path / "a.csv": "x\ny\n", tmp_path / "new" / "b.csv": "ü"}, overwrite=False)
        assert (tmp_path / "a.csv").read_bytes() == b"x\ny\n"
        assert (tmp_path / "new" / "b.csv").read_bytes() == "ü".encode()
        assert files(tmp_path) == ["a.csv", "new/b.csv"]

    def test_an_existing_file_stays_and_nothing_else_is_written(self, tmp_path):
        (tmp_path / "b").write_text("mine")
        with pytest.raises(OutputError, match="b: exists already") as caught:
            write_all({tmp_path / "a": "1", tmp_path / "b": "2"}, overwrite=False)
        assert "--overwrite" in caught.value.hint
        assert files(tmp_path) == ["b"]
        assert (tmp_path / "b").read_text() == "mine"
        write_all({tmp_path / "a": "1", tmp_path / "b": "2"}, overwrite=True)
        assert (tmp_path / "b").read_text() == "2"

    def test_a_folder_in_the_way_is_refused_even_with_overwrite(self, tmp_path):
        (tmp_path / "b").mkdir()
        with pytest.raises(OutputError, match="b: is a folder"):
            write_all({tmp_path / "a": "1", tmp_path / "b": "2"}, overwrite=True)
        assert files(tmp_path) == []

    def test_a_file_in_place_of_the_folder_is_refused(self, tmp_path):
        (tmp_path / "out").write_text("mine")
        with pytest.raises(OutputError, match="out"):
            write_all({tmp_path / "a": "1", tmp_path / "out" / "b": "2"}, overwrite=True)
        assert files(tmp_path) == ["out"]

    @pytest.mark.parametrize("overwrite", [False, True])
    def test_a_second_file_that_cannot_be_written_takes_the_first_with_it(
        self, tmp_path, monkeypatch, overwrite
    ):
        import mocap_skel.export.files as module

        if overwrite:
            (tmp_path / "a").write_text("old")
        original, made = module.NamedTemporaryFile, []

        def full_disk(*args, **options):
            made.append(options.get("prefix"))
            if len(made) == 2:
                raise OSError(28, "No space left on device", str(tmp_path / "b"))
            return original(*args, **options)

        monkeypatch.setattr(module, "NamedTemporaryFile", full_disk)
        with pytest.raises(OutputError, match="b: No space left on device"):
            write_all({tmp_path / "a": "1", tmp_path / "b": "2"}, overwrite)
        assert len(made) == 2
        assert files(tmp_path) == (["a"] if overwrite else [])
        if overwrite:
            assert (tmp_path / "a").read_text() == "old"

    def test_a_second_file_that_cannot_be_renamed_takes_the_first_with_it(
        self, tmp_path, monkeypatch
    ):
        original, moved = Path.replace, []

        def refused(self, target):
            moved.append(target)
            if len(moved) == 2:
                raise OSError(13, "Permission denied", str(target))
            return original(self, target)

        monkeypatch.setattr(Path, "replace", refused)
        with pytest.raises(OutputError, match="b: Permission denied"):
            write_all({tmp_path / "a": "1", tmp_path / "b": "2"}, overwrite=False)
        assert files(tmp_path) == []

    def test_an_interrupt_leaves_nothing_behind(self, tmp_path, monkeypatch):
        def interrupted(self, target):
            raise KeyboardInterrupt

        monkeypatch.setattr(Path, "replace", interrupted)
        with pytest.raises(KeyboardInterrupt):
            write_all({tmp_path / "a": "1", tmp_path / "b": "2"}, overwrite=False)
        assert files(tmp_path) == []

    def test_a_name_too_long_is_one_clear_error(self, tmp_path):
        with pytest.raises(OutputError):
            write_all({tmp_path / ("x" * 300): "1"}, overwrite=False)
        assert files(tmp_path) == []

    @pytest.mark.parametrize("mask", [0o022, 0o077, 0o002])
    def test_permissions_are_what_the_umask_allows(self, tmp_path, mask):
        old = os.umask(mask)
        try:
            write_all({tmp_path / "a": "1"}, overwrite=False)
            # It looks at the mask by setting it; it has to set it back.
            assert os.umask(mask) == mask
        finally:
            os.umask(old)
        assert stat.S_IMODE((tmp_path / "a").stat().st_mode) == 0o666 & ~mask

    def test_check_free_writes_nothing(self, tmp_path):
        check_free([tmp_path / "deep" / "a"], overwrite=False)
        assert list(tmp_path.iterdir()) == []


class TestSafeName:
    @pytest.mark.parametrize(
        ("name", "safe"),
        [
            ("Derrick", "Derrick"),
            ("../../x", "x"),
            ("..", "subject"),
            ("", "subject"),
            ("   ", "subject"),
            ("/etc/passwd", "etc_passwd"),
            ("C:\\temp\\x", "C_temp_x"),
            (".hidden", "hidden"),
            ("Jürgen Groß", "Jürgen_Groß"),
            ("花子", "花子"),
            ("a\0b\nc", "a_b_c"),
            ("Player 1 (left)", "Player_1_left"),
        ],
    )
    def test_known_names(self, name, safe):
        assert safe_name(name) == safe

    @settings(derandomize=True, deadline=None, max_examples=60, database=None)
    @given(st.text(max_size=30))
    def test_no_name_leaves_the_folder(self, name):
        safe = safe_name(name)
        assert safe
        assert Path(safe).name == safe
        assert not safe.startswith(".")
        assert not re.search(r"[\s/\\:\0*?\"<>|]", safe)
        assert safe_name(safe) == safe


class TestProcess:
    """The whole way of one clip, as the commands go it."""

    def job(self, folder, **options):
        return Job(read_association("cmu"), folder=folder, **options)

    def test_files_are_named_after_the_clip_and_the_subject(self, samples, tmp_path):
        done = process(samples / "two_dancers.c3d", self.job(tmp_path, formats=("csv", "bvh")))
        assert files(tmp_path) == sorted(
            f"two_dancers.{who}{suffix}"
            for who in ("Anna", "Ben")
            for suffix in (".skeleton.csv", ".joints.csv", ".bvh")
        )
        assert set(done.files) == set(tmp_path.iterdir())
        assert [fit.subject for fit in done.fits] == ["Anna", "Ben"]
        for path, text in done.files.items():
            assert path.read_text() == text
        anna = (tmp_path / "two_dancers.Anna.skeleton.csv").read_text()
        assert anna == skeleton_csv(fit_sample("two_dancers", "Anna"))

    def test_without_a_folder_nothing_is_written(self, samples, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        done = process(samples / "nearly_still.c3d", self.job(None))
        assert [path.name for path in done.files] == [
            "nearly_still.skeleton.csv", "nearly_still.joints.csv"
        ]  # fmt: skip
        assert files(tmp_path) == []

    def test_a_format_that_cannot_hold_the_clip_leaves_no_file_at_all(self, samples, tmp_path):
        job = Job(read_association("plug_in_gait"), ("csv", "bvh"), tmp_path)
        with pytest.raises(ExportError):
            process(samples / "gaps.c3d", job)
        assert files(tmp_path) == []

    def test_an_existing_result_is_refused_and_stays(self, samples, tmp_path):
        (tmp_path / "nearly_still.joints.csv").write_text("mine")
        with pytest.raises(OutputError, match="exists already"):
            process(samples / "nearly_still.c3d", self.job(tmp_path))
        assert files(tmp_path) == ["nearly_still.joints.csv"]
        assert (tmp_path / "nearly_still.joints.csv").read_text() == "mine"
        process(samples / "nearly_still.c3d", self.job(tmp_path, overwrite=True))
        assert files(tmp_path) == ["nearly_still.joints.csv", "nearly_still.skeleton.csv"]
        assert (tmp_path / "nearly_still.joints.csv").read_text().startswith("joint,")

    def test_a_clip_that_is_not_there_is_one_clear_error(self, tmp_path):
        with pytest.raises(MocapSkelError, match="No such file"):
            process(tmp_path / "clip.c3d", self.job(tmp_path))
        assert files(tmp_path) == []

    def test_subjects_whose_safe_names_agree_do_not_overwrite_each_other(
        self, tmp_path, monkeypatch
    ):
        from mocap_skel.artificial import merge
        from mocap_skel.pipeline import job

        one = record(
            human(), marker_set("cmu"), range_of_motion(2, 30, seed=1), Faults(sigma=0.001), seed=1
        )
        clip = clip_of(merge({"A/B": one, "A B": one}))
        monkeypatch.setattr(job, "read_clip", lambda *args, **options: clip)
        with pytest.raises(MocapSkelError, match="A_B"):
            process(tmp_path / "x.c3d", self.job(tmp_path))
        assert files(tmp_path) == []
        done = process(tmp_path / "x.c3d", self.job(tmp_path, subject="A/B"))
        assert {path.parent for path in done.files} == {tmp_path}
        assert files(tmp_path) == ["x.A_B.joints.csv", "x.A_B.skeleton.csv"]

    def test_options_reach_the_fit(self, samples, tmp_path):
        path = samples / "nearly_still.c3d"
        done = process(path, self.job(tmp_path, sigma=0.002, pose="triad", rate=30.0))
        (fit,) = done.fits
        assert (fit.sigma, fit.rate) == (0.002, 30.0)
        again = fit_clip(read_clip(path, rate=30.0), sigma=0.002, pose="triad")
        assert done.files[tmp_path / "nearly_still.skeleton.csv"] == skeleton_csv(again)

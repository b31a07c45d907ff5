"""How calls end and what they refuse: exit codes, before any work, and the values of options."""

import json
import re

import click
import pytest
from commands import ROM, STILL, call, files
from recordings import ROOT, SAMPLES

from mocap_skel.cli import COMMANDS, main
from mocap_skel.cli.options import Folder, Length, Lengths, Named

DANCERS = SAMPLES / "two_dancers.c3d"


@pytest.fixture
def half_a_map(tmp_path):
    """An association file with which Anna can be fitted and Ben cannot."""
    text = (ROOT / "association_files" / "cmu.txt").read_text()
    for label in ("LFWT", "RFWT"):
        text = text.replace(f"{label}  {label}", f"Anna:{label}  {label}")
    path = tmp_path / "half.txt"
    path.write_text(text)
    return path


class TestExitCodes:
    def test_wrong_calls_alone_are_2_and_any_other_reason_makes_3(self, tmp_path):
        bad = tmp_path / "bad.c3d"
        bad.write_bytes(b"no C3D at all")
        (tmp_path / "nearly_still.joints.csv").write_text("mine")
        there = call("fit", STILL, "-a", "cmu", cwd=tmp_path)
        assert (there.returncode, "exists already" in there.stderr) == (2, True)
        both = call("fit", STILL, bad, "-a", "cmu", cwd=tmp_path)
        assert (both.returncode, "exists already" in both.stderr) == (3, True)

    @pytest.mark.parametrize("command", ["fit", "report", "draw"])
    def test_a_subject_that_cannot_be_fitted_is_1(self, tmp_path, half_a_map, command):
        done = call(command, DANCERS, "-a", half_a_map, "-q", cwd=tmp_path)
        assert done.returncode == 1
        assert done.stderr.startswith("mocap-skel: error: Ben: ")
        assert "wrote two_dancers." in done.stdout

    def test_a_calibration_without_one_of_its_clips_is_1(self, tmp_path):
        call_ = ("calibrate", ROM, "gone.c3d", "-a", "cmu", "-q", "-o", "a.json")
        done = call(*call_, cwd=tmp_path)
        assert (done.returncode, files(tmp_path)) == (1, ["a.json"])
        assert done.stderr.startswith("mocap-skel: error: gone.c3d: No such file")
        alone = call("calibrate", "gone.c3d", "-a", "cmu", "-o", "b.json", cwd=tmp_path)
        assert (alone.returncode, files(tmp_path)) == (3, ["a.json"])

    def test_a_clip_that_cannot_be_read_is_3_and_a_wrong_file_beside_it_2(self, tmp_path):
        for command in ("inspect", "draw", "report"):
            assert call(command, "gone.c3d", "-a", "cmu", cwd=tmp_path).returncode == 3
            assert call(command, ROM, "-a", "cmuu", cwd=tmp_path).returncode == 2


class TestBeforeAnyWork:
    """A clip that is not there would be missed first, had the work begun."""

    @pytest.mark.parametrize(
        "words",
        [
            ["calibrate", "gone.c3d", "-a", "cmu", "-o", "there.png"],
            ["draw", "gone.c3d", "-a", "cmu", "-o", "there.png"],
            ["assoc", "guess", "gone.c3d", "-o", "there.png"],
        ],
    )
    def test_a_file_that_is_there_is_refused(self, tmp_path, words):
        (tmp_path / "there.png").write_text("mine")
        done = call(*words, cwd=tmp_path)
        assert done.returncode == 2 and "there.png: exists already" in done.stderr
        assert (tmp_path / "there.png").read_text() == "mine"

    @pytest.mark.parametrize(
        ("words", "what"),
        [
            (
                ["fit", "a/x.c3d", "b/x.C3D", "-a", "cmu"],
                "a/x.c3d and b/x.C3D would write the same",
            ),
            (["report", "x.c3d", "y/x.c3d", "-a", "cmu"], "would write the same files"),
            (["report", "x.c3d", "-a", "cmu", "-o", "-", "--json"], "and nothing else"),
            (["report", "x.c3d", "y.c3d", "-a", "cmu", "-o", "-"], "and nothing else"),
            (["report", "x.c3d", "-a", "cmu", "-o", "x.html"], "-o - > x.html"),
            (["fit", "x.c3d", "-a", "cmu", "-o", "new/x.bvh"], "give a folder, or - for"),
            (["fit", "x.c3d", "-a", "cmu", "-o", "x.CSV", "-f", "glb"], "give a folder, or - for"),
            (["draw", "x.c3d", "-a", "cmu", "--plot", "bones", "--sheet", "4"], "--sheet is for"),
            (["draw", "x.c3d", "-a", "cmu", "--plot", "bones", "--frame", "4"], "--frame is for"),
            (["calibrate", "x.c3d", "-a", "cmu", "--method", "lls"], "needs every sample"),
            (["fit", "x.c3d", "-a", "cmu", "--sigma", "100mm"], "is no length here"),
            (["fit", "x.c3d", "-a", "cmu", "--sigma", "1mm", "--noise", "matrix"], "sigma"),
            (["fit", "x.c3d", "--calibration", "a.json"], "a.json: No such file"),
        ],
    )
    def test_a_wrong_call_is_2(self, tmp_path, words, what):
        done = call(*words, cwd=tmp_path)
        assert (done.returncode, done.stdout, files(tmp_path)) == (2, "", [])
        assert what in done.stderr


class TestOneSubject:
    def test_inspect_shows_its_labels_alone(self, tmp_path):
        done = call("inspect", DANCERS, "--subject", "Ben", cwd=tmp_path)
        *rows, guessed = done.stdout.splitlines()[4:]
        assert "it is guessed from names and motion: 41 of 41 labels placed" in guessed
        assert len(rows) == 41 and all(row.startswith("Ben ") for row in rows)

    def test_check_checks_it_alone(self, tmp_path):
        done = call(
            "assoc", "check", DANCERS, "-a", "cmu", "--subject", "Ben", "--json", cwd=tmp_path
        )
        rows = [json.loads(line) for line in done.stdout.splitlines()]
        assert len(rows) == 41 and {row["subject"] for row in rows} == {"Ben"}
        assert done.returncode == 0

    def test_check_says_which_lines_match_nothing(self, tmp_path):
        done = call("assoc", "check", SAMPLES / "gaps.c3d", "-a", "plug_in_gait", cwd=tmp_path)
        assert re.search(
            r"^mocap-skel: .*gaps\.c3d: .*3 labels not in the clip: LFRA", done.stderr, re.M
        )


def test_a_figure_keeps_the_dots_of_its_name(tmp_path):
    done = call("assoc", "guess", ROM, "--by-motion", "-o", "lab.v2", "-q", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert files(tmp_path) == ["lab.v2.toml", "lab.v2.txt"]
    call("assoc", "guess", ROM, "--by-motion", "-o", "fig.toml", "-q", cwd=tmp_path)
    assert files(tmp_path) == ["fig.toml", "fig.txt", "lab.v2.toml", "lab.v2.txt"]


def test_a_wide_table_is_printed_on_demand_only(tmp_path):
    for command in ("fit", "report", "calibrate"):
        narrow, wide = (
            call(
                command,
                STILL,
                "-a",
                "cmu",
                "-q",
                "-o",
                f"{command}{len(more)}",
                *more,
                cwd=tmp_path,
            )
            for more in ([], ["--wide"])
        )
        assert "weakest cm" in wide.stdout and "weakest cm" not in narrow.stdout
        lines = [line for line in narrow.stdout.splitlines() if not line.startswith("wrote ")]
        # The first line has the clip's path, however long that is.
        assert max(map(len, lines[1:])) <= 100


def test_debug_may_stand_anywhere_before_the_command(monkeypatch, capsys):
    monkeypatch.setattr("mocap_skel.pipeline.job.read_clip", lambda *_, **__: 1 / 0)
    for words, shown in ((["--debug"], True), ([], False)):
        with pytest.raises(SystemExit) as end:
            main([*words, "inspect", "x.c3d"])
        said = capsys.readouterr().err
        assert end.value.code == 1
        assert "this is a bug: ZeroDivisionError: division by zero" in said
        assert ("Traceback" in said) == shown


class TestValues:
    @pytest.mark.parametrize(
        ("text", "metres"),
        [("1mm", 0.001), ("0.1cm", 0.001), ("0.5 dm", 0.05), ("0.01m", 0.01), ("2E-1 MM", 0.0002)],
    )
    def test_a_length_is_metres(self, text, metres):
        assert Length().convert(text, None, None) == pytest.approx(metres)
        assert Lengths().convert(text, None, None) == pytest.approx(metres)

    @pytest.mark.parametrize("text", ["1", "100mm", "-1mm", "1km", "mm", "1.2.3mm", "nanmm", ""])
    def test_what_is_no_length_of_a_noise_is_refused(self, text):
        with pytest.raises(click.BadParameter, match="no length here"):
            Length().convert(text, None, None)

    def test_three_lengths_are_those_along_x_y_and_z(self):
        assert Lengths().convert("1mm,2mm,0.3cm", None, None) == pytest.approx(
            (0.001, 0.002, 0.003)
        )
        for text in ("1mm,2mm", "1mm,1mm,1mm,1mm"):
            with pytest.raises(click.BadParameter, match="one length, or three"):
                Lengths().convert(text, None, None)

    def test_a_dash_is_no_folder(self):
        with pytest.raises(click.BadParameter, match="give a folder"):
            Folder().convert("-", None, None)

    def test_shipped_names_are_completed_and_so_are_files(self):
        offered = Named(("association_files", "../association_files"), ".txt").shell_complete(
            click.Context(click.Command("x")), click.Option(["--assoc"]), "plug"
        )
        names = [item.value for item in offered if item.type == "plain"]
        assert names == sorted(names) and {"plug_in_gait"} <= {*names}
        assert [item.type for item in offered][-1] == "file"


def test_every_command_has_the_line_that_help_shows_for_it():
    assert set(COMMANDS) == {path.stem for path in (ROOT / "docs" / "commands").glob("*.md")}

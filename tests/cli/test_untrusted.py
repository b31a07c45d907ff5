"""What comes from elsewhere: nothing of it reaches a terminal, a path, a formula or a page as more than a text."""

import csv
import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest
from c3d_bytes import c3d_file
from commands import call, files, tiny
from recordings import ROOT

from mocap_skel.errors import CallError, SkeletonError
from mocap_skel.export.tables_csv import rows_csv
from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.labels.association import read_association
from mocap_skel.readers import read_clip
from mocap_skel.text import visible

ESC = "\x1b[31mred\x1b]0;title\x07\u202e"
CMU = (ROOT / "association_files" / "cmu.txt").read_text()
DEEP = "[" * 10_000 + "]" * 10_000
DIGITS = "9" * 400
HUMAN = (ROOT / "mocap_skel/figure/skeletons/human.toml").read_text()


def said(done):
    """All that a call has printed, in which a terminal finds nothing to obey."""
    text = done.stdout + done.stderr
    assert "bug" not in text
    for line in text.splitlines():
        assert line.isprintable(), ascii(line)
    return text


def one_line(done, code=2):
    assert done.returncode == code, done.stderr
    said(done)
    (line,) = done.stderr.splitlines()
    assert len(line) < 600
    return line


@pytest.fixture
def here(tmp_path):
    shutil.copy(tiny(), tmp_path / "walk.c3d")
    return tmp_path


def hostile(path):
    """A C3D file in which everything that has a name has a hostile one; its labels are those of cmu but one."""
    clip = read_clip(tiny())
    subject = f"=Zoe{ESC}/../x"
    labels = [f"{subject}:{label}" for label in (*clip.labels[:-1], f"=1+1{ESC}")]
    return c3d_file(
        path, 1e3 * clip.points, rate=60.0, LABELS=labels,
        EVENT__USED=1, EVENT__TIMES=np.array([0.0, 0.1], "f4"), EVENT__LABELS=["=Foot Strike"],
        EVENT__CONTEXTS=[f"Left{ESC}"], EVENT__SUBJECTS=[subject],
    )  # fmt: skip


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hostile")
    hostile(folder / "walk.c3d")
    (folder / "map.txt").write_text(f'{CMU}\n"=1+1{ESC}"  =A{ESC}  RightFoot\nx{ESC}  @b  Head\n')
    formats = ("csv", "bvh", "glb", "osim", "trc", "c3d", "events", "parquet")
    options = [x for name in formats for x in ("-f", name)]
    done = call("fit", "walk.c3d", "-a", "map.txt", *options, "-o", "out", cwd=folder)
    return folder, done


class TestNamesInFiles:
    def test_no_terminal_obeys_them(self, fitted):
        folder, done = fitted
        assert done.returncode == 0, done.stderr
        # Two labels are not in the clip: the one that is not cmu's there, and the map's last.
        assert "2 labels not in the clip" in said(done)
        for words in (["inspect"], ["assoc", "guess"], ["assoc", "check", "-a", "map.txt"]):
            found = call(*words, "walk.c3d", cwd=folder)
            assert found.returncode == 0 and "?[31mred?]0;title??" in said(found)

    def test_nor_those_of_parameters(self, tmp_path):
        c3d_file(tmp_path / "p.c3d", 1e3 * read_clip(tiny()).points, **{f"N{ESC}": 3.0})
        done = call("inspect", "p.c3d", cwd=tmp_path)
        assert "parameter N?[31MRED" in said(done)

    def test_no_path_no_formula_and_no_cell_holds_them(self, fitted):
        folder, _ = fitted
        for name in files(folder / "out"):
            assert name.isprintable() and name.startswith("walk.") and "/" not in name
        for path in (folder / "out").glob("*.csv"):
            for row in csv.reader(path.read_text().splitlines()):
                assert all(cell.isprintable() for cell in row)
                assert not [c for c in row if c[:1] in "=+@" and len(c) > 1], row
        (events,) = csv.DictReader((folder / "out" / "walk.events.csv").read_text().splitlines())
        assert events["event"] == "'=Foot Strike"

    def test_no_page_holds_them(self, fitted):
        folder, _ = fitted
        done = call("report", "walk.c3d", "-a", "map.txt", "-q", "-o", "page", cwd=folder)
        assert done.returncode == 0
        page = (folder / "page" / "walk.report.html").read_text()
        assert not {*"\x1b\x07\u202e"} & set(page)

    def test_a_map_has_them_as_the_clip_has_them(self, fitted):
        folder, _ = fitted
        rules = {rule.label: rule.marker for rule in read_association(folder / "map.txt").rules}
        assert rules["=1+1?[31mred?]0;title??"] == "=A?[31mred?]0;title??"


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(os.fsdecode(b"w\xe4lk\xff"), id="no UTF-8"),
        pytest.param("a\nmocap-skel: error: x" + ESC, id="lines and escapes"),
        pytest.param("l" * 236, id="long"),
    ],
)
def test_names_of_files(tmp_path, name):
    """All commands take them, and show them on one line."""
    clip = f"{name}.c3d"
    try:
        shutil.copy(tiny(), tmp_path / clip)
    except OSError:
        pytest.skip("a disk without such names")
    formats = [x for one in ("csv", "bvh", "c3d", "parquet") for x in ("-f", one)]
    for words in (
        ["fit", clip, "-a", "cmu", "-o", "out", *formats],
        ["fit", clip, "-a", "cmu", "-o", "json", "--json"],
        ["report", clip, "-a", "cmu", "-o", "out"],
        ["draw", clip, "-a", "cmu", "-o", "pose.svg"],
        ["calibrate", clip, "-a", "cmu"],
        ["fit", clip, "-a", "cmu", "--calibration", "actor.json", "-o", "-"],
        ["inspect", clip],
        ["assoc", "guess", clip, "-o", "map.txt"],
        ["batch", ".", "-a", "cmu", "--jobs", "1", "-o", "many"],
    ):
        done = call(*words, cwd=tmp_path)
        assert done.returncode == 0, (words, done.stderr)
        shown = said(done)
        assert "ezc3d cannot" not in shown
        if words[0] in ("fit", "report", "calibrate", "inspect") and "-" not in words:
            assert visible(name) in shown or json.dumps(name)[1:-1] in shown, words
        # A line of its own would be a message of ours.
        assert "\nmocap-skel: error" not in shown
    assert {f"{name}.{end}" for end in ("bvh", "joints.csv", "report.html")} <= set(
        files(tmp_path / "out")
    )
    assert f"{name}.joints.csv" in files(tmp_path / "many")
    (line,) = (tmp_path / "many" / "manifest.jsonl").read_text().splitlines()
    assert json.loads(line)["name"] == name
    (row,) = csv.DictReader((tmp_path / "many" / "manifest.csv").read_text().splitlines())
    assert row["name"] == visible(name)


def test_letters_that_the_locale_does_not_have(here):
    """A process: the locale is Python's from its start."""
    shutil.copy(tiny(), here / "gehen_ä日.c3d")
    locale = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    done = subprocess.run(
        [sys.executable, "-m", "mocap_skel", "fit", *sorted(files(here)), "-a", "cmu", "-o", "out"],
        cwd=here, env={**os.environ, **locale}, capture_output=True, timeout=120,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, b"")
    assert rb"gehen_\xc3\xa4\xe6\x97\xa5.c3d: 60 frames" in done.stdout
    assert "gehen_ä日.joints.csv" in files(here / "out")


class TestFilesThatAreNone:
    @pytest.fixture
    def pipe(self, here):
        if not hasattr(os, "mkfifo"):
            pytest.skip("no pipes with names")
        os.mkfifo(here / "pipe")
        return "pipe"

    @pytest.mark.parametrize(
        "words",
        [
            ["fit", "walk.c3d", "-a", "cmu", "--skeleton", "pipe"],
            ["fit", "walk.c3d", "-a", "cmu", "--calibration", "pipe"],
            ["fit", "walk.c3d", "-a", "cmu", "--measures", "pipe"],
            ["fit", "walk.c3d", "-a", "skeleton.txt"],
            ["batch", "walk.c3d", "-a", "cmu", "-o", "out", "--job", "pipe"],
            ["fit", "walk.c3d", "-a", "cmu", "-f", "angles", "--static", "pipe"],
            ["fit", "pipe", "-a", "cmu"],
            ["batch", "pipe", "-a", "cmu", "-o", "out"],
        ],
    )
    def test_a_pipe(self, here, pipe, words):
        (here / "skeleton.txt").write_text(f"@skeleton {pipe}\n")
        line = one_line(
            call(*words, "-q", cwd=here), 3 if "pipe" in words[1] or "--static" in words else 2
        )
        assert "pipe: a pipe or a device, and no file" in line

    @pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="no /dev/zero")
    def test_a_device_without_end(self, here):
        (here / "map.txt").write_text("@skeleton /dev/zero\n")
        line = one_line(call("fit", "walk.c3d", "-a", "map.txt", cwd=here))
        assert "/dev/zero: a pipe or a device" in line and "map.txt:1: " in line

    def test_a_text_without_end(self, here):
        with (here / "map.txt").open("wb") as file:
            file.truncate(1 << 40)
        line = one_line(call("fit", "walk.c3d", "-a", "map.txt", cwd=here))
        assert (
            line == "mocap-skel: error: map.txt: a text of more than 16 MB, which no such file has"
        )

    def test_a_manifest_that_is_a_pipe(self, here, pipe):
        (here / "out").mkdir()
        (here / pipe).rename(here / "out" / "manifest.jsonl")
        done = call("batch", "walk.c3d", "-a", "cmu", "-o", "out", cwd=here)
        assert "a pipe or a device is no manifest" in one_line(done)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (f"sizes = {DEEP}", "lists in lists without end"),
        (f"x = {'[' * 50}{']' * 50}", "lists in lists without end"),
        (HUMAN.replace("looseness = ", f"looseness = {DIGITS} # ", 1), "too many digits"),
        (HUMAN + f"rest = [{DIGITS}, 0, 0]", "too many digits"),
        (f"x = {'9' * 5000}", "it cannot be read: Exceeds the limit"),
        ('name = "a\\u001b[31m"', "a text that cannot be printed: 'a\\x1b[31m'"),
        ('[[segment]]\nname = "a\\nb"', ":2:1: name 'a\\nb' cannot be printed"),
        (f'[[segment]]\nname = "{"n" * 9999}"\nkey = 1', "unknown key 'key'"),
        (f"{'k' * 9999} = 1", "unknown key 'kkk"),
    ],
)
def test_skeleton_files(here, text, message):
    (here / "figure.toml").write_text(text)
    with pytest.raises(SkeletonError) as error:
        read_skeleton(here / "figure.toml")
    assert message in error.value.message
    done = call("fit", "walk.c3d", "-a", "cmu", "--skeleton", "figure.toml", cwd=here)
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1
    assert len(done.stderr) < 4500 and "figure.toml" in said(done)


@pytest.mark.parametrize("name", ["measures", "job"])
@pytest.mark.parametrize(
    "text", [f"x = {DEEP}", f"jobs = {DIGITS}", f"knee_width = {DIGITS}", 'x = "\\u0000"']
)
def test_other_toml_files(here, name, text):
    (here / "f.toml").write_text(text)
    line = one_line(
        call("batch", "walk.c3d", "-a", "cmu", "-o", "out", f"--{name}", "f.toml", cwd=here)
    )
    assert "f.toml: " in line


def test_more_jobs_than_any_machine_has(here):
    done = call("batch", "walk.c3d", "-a", "cmu", "-o", "out", "-q", "-j", DIGITS, cwd=here)
    assert done.returncode == 0, done.stderr


def test_an_association_of_one_endless_line_takes_no_longer_than_its_length(tmp_path):
    (tmp_path / "map.txt").write_text("a " * 200_000 + "\n")
    with pytest.raises(CallError, match="200000 words where"):
        read_association(tmp_path / "map.txt")


def test_cells():
    rows = [{"a": "=1", "b": "-1 2.5", "c": "@x", "d": -0.5, "e": "+-"}]
    assert rows_csv(rows) == "a,b,c,d,e\n'=1,-1 2.5,'@x,-0.5,'+-\n"


LINE = {
    "clip": "walk.c3d", "name": "walk", "status": "done", "reason": None, "notes": [], "seconds": 1.0,
    "sha256": "0", "joints": [], "files": {}, "options": {"version": "0", "formats": {}},
}  # fmt: skip


class TestManifests:
    @pytest.mark.parametrize(
        "change",
        [
            {"status": "?"}, {"files": {"../../x": 1}}, {"files": {"/etc/passwd": 1}}, {"files": 5},
            {"files": {"a": "b"}}, {"notes": [1]}, {"seconds": int(DIGITS)}, {"options": []},
            {"options": {"version": "0", "formats": {"csv": 1}}}, {"name": ["walk"]}, {"reason": 1},
            {"joints": [{"subject": "", "joint": "J", "shown": "yes", "x": 1, "y": "1", "z": 1, "bone": 1}]},
            {"joints": [1]},
        ],
    )  # fmt: skip
    def test_a_line_that_no_batch_wrote(self, here, change):
        (here / "out").mkdir()
        (here / "out" / "manifest.jsonl").write_text(json.dumps(LINE | change) + "\n")
        line = one_line(call("batch", "walk.c3d", "-a", "cmu", "-o", "out", cwd=here))
        assert "out/manifest.jsonl:1: no line of a batch" in line

    def test_lists_without_end(self, here):
        (here / "out").mkdir()
        (here / "out" / "manifest.jsonl").write_text(DEEP + "\n")
        line = one_line(call("batch", "walk.c3d", "-a", "cmu", "-o", "out", cwd=here))
        assert "out/manifest.jsonl:1: no line of a batch" in line

    def test_what_a_killed_batch_left_takes_nothing_away_elsewhere(self, here):
        (here / "victim").write_text("mine")
        for i, name in enumerate(["../victim", str(here / "victim"), 5, None]):
            stage = here / "out" / f".batch-{i}"
            stage.mkdir(parents=True)
            entry = {"line": LINE, "new": [name], "parts": {name: "gone"}}
            (stage / "moving.json").write_text(json.dumps(entry))
        done = call("batch", "walk.c3d", "-a", "cmu", "-o", "out", "-q", "-j", "1", cwd=here)
        assert done.returncode == 0, done.stderr
        assert (here / "victim").read_text() == "mine"
        assert not list((here / "out").glob(".*"))


@pytest.fixture(scope="module")
def calibration(tmp_path_factory):
    folder = tmp_path_factory.mktemp("calibration")
    assert call("calibrate", tiny(), "-a", "cmu", "-q", "-o", "a.json", cwd=folder).returncode == 0
    return (folder / "a.json").read_text()


class TestCalibrations:
    @pytest.mark.parametrize(
        ("key", "value", "message"),
        [
            ("covariance", [[1, 0, 0], [0, 1, 0], [0.1, 0, 1]], "must be symmetric"),
            ("noise", [[1, 0, 0], [0, -1, 0], [0, 0, 1]], "must have no negative eigenvalue"),
            ("still", [[1, 2, 0], [2, 1, 0], [0, 0, 1]], "must have no negative eigenvalue"),
            ("leverage", [1, 2, 3], "must be numbers of shape (3, 3)"),
            ("mean", [1e300, 0, 0], "must be numbers of shape (3,)"),
            ("mean", [float("nan"), 0, 0], "must be numbers of shape (3,)"),
            ("third", [int(DIGITS), 0, 0], "too many digits"),
            ("count", -1, "must not be negative"),
            ("smooth", 1.5, "must be 1 at most"),
            ("effective", 1e9, "must not be more than its"),
        ],
    )
    def test_a_wrong_number_is_named(self, here, calibration, key, value, message):
        content = json.loads(calibration)
        joint = content["clips"][0]["joints"]["LeftKnee"]
        joint["markers"]["LTIB"][key] = value
        (here / "a.json").write_text(json.dumps(content))
        words = ["fit", "walk.c3d", "-a", "cmu", "--calibration", "a.json"]
        line = one_line(call(*words, cwd=here))
        assert message in line and "a.json: " in line
        assert "digits" in message or f"joints.LeftKnee.markers.LTIB.{key}" in line

    @pytest.mark.parametrize("text", [DEEP, f"[{DIGITS}]", "[" * 60 + "]" * 60, '{"a": ', "\ud800"])
    def test_what_is_none(self, here, text):
        (here / "a.json").write_text(text, errors="surrogatepass")
        words = ["fit", "walk.c3d", "-a", "cmu", "--calibration", "a.json"]
        assert "a.json: " in one_line(call(*words, cwd=here))

    def test_what_the_program_writes_passes(self, here, calibration):
        (here / "a.json").write_text(calibration)
        words = ["fit", "walk.c3d", "-a", "cmu", "--calibration", "a.json", "-q"]
        assert call(*words, cwd=here).returncode == 0

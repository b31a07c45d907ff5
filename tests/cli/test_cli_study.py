"""`mocap-skel study` and `mocap-skel methods` as a user runs them: processes, exit codes, streams, files."""

import json
import re

import pytest
from commands import STILL, call, files, program, run, without
from recordings import ROOT, SAMPLES

from mocap_skel.artificial import Faults, human, marker_set, range_of_motion, record, write_c3d

RESAMPLE = [
    f"short.resample.{name}"
    for name in ("answers.csv", "deviations.csv", "figure24.png", "means.csv", "power_law.csv")
]
TABLES = [name for name in RESAMPLE if name.endswith(".csv")]
SPEED = [f"speed.{name}" for name in ("figure26.png", "figure27.png", "ratios.csv", "trials.csv")]
ACCURACY = [f"accuracy.{name}" for name in ("map.png", "markers.csv", "noise.csv", "scores.csv")]


def strict(line):
    """One line of JSON by the standard, which knows no NaN."""

    def none(name):
        raise AssertionError(f"{name} is no JSON: {line}")

    return json.loads(line, parse_constant=none)


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    """A clip of 300 frames, every joint through its range."""
    path = tmp_path_factory.mktemp("clips") / "short.c3d"
    motion = range_of_motion(10, 30, seed=1)
    write_c3d(record(human(), marker_set("cmu"), motion, Faults(sigma=0.001), seed=1), path)
    return path


def resample(clip, *more, cwd, passes=1, levels=3, workers=1):
    words = ["study", "resample", clip, "--assoc", "cmu", "--passes", passes, "--levels", levels]
    # Workers are processes of their own, which start from a program.
    start = run if workers > 1 else call
    return start(*words, "--workers", workers, *more, cwd=cwd)


class TestResample:
    def test_it_writes_tables_and_a_figure_and_prints_what_they_say(self, short, tmp_path):
        done = resample(short, "-o", "out", "--seed", 7, cwd=tmp_path, passes=2)
        assert (done.returncode, done.stderr) == (0, "")
        assert files(tmp_path) == [f"out/{name}" for name in RESAMPLE]
        assert "6 refits" in done.stdout and "seed 7" in done.stdout
        for title in ("thesis table 2", "thesis table 3", "thesis figure 24"):
            assert title in done.stdout
        assert re.search(r"^LeftKnee +1 +6 +-?0\.\d+ ", done.stdout, re.M)
        last = done.stdout.splitlines()[-1]
        assert last.startswith("wrote out/short.resample.") and "out/" + RESAMPLE[2] in last
        png = (tmp_path / "out" / RESAMPLE[2]).read_bytes()
        assert png.startswith(b"\x89PNG\r\n\x1a\n") and len(png) > 10_000

    def test_a_seed_gives_the_same_bytes_with_one_worker_or_two(self, short, tmp_path):
        """Eleven levels are two tasks, of ten and of one."""
        for workers in (1, 2):
            words = ["-o", str(workers), "--seed", 3, "--no-figures", "-q"]
            done = resample(short, *words, cwd=tmp_path, levels=11, workers=workers)
            assert (done.returncode, done.stderr) == (0, "")
        for name in TABLES:
            assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "2" / name).read_bytes()

    def test_json_is_one_object_a_line_that_names_its_table(self, short, tmp_path):
        done = resample(short, "--json", "--no-figures", cwd=tmp_path, levels=1)
        assert (done.returncode, done.stderr) == (0, "")
        rows = [strict(line) for line in done.stdout.splitlines()]
        assert {row["table"] for row in rows} == {"means", "deviations", "power_law"}
        (law,) = (r for r in rows if r["table"] == "power_law" and r["joint"] == "all")
        # One answer a joint: no deviation, no law.
        assert law["answers"] == 14 and law["slope"] is None
        assert files(tmp_path) == TABLES

    def test_a_file_that_is_there_stops_it_before_any_work(self, short, tmp_path):
        (tmp_path / TABLES[0]).write_text("mine")
        # Hours, had it begun.
        done = resample(short, "--no-figures", cwd=tmp_path, passes=10_000, levels=100)
        assert done.returncode == 2
        assert len(done.stderr.splitlines()) == 1
        assert "exists already" in done.stderr and "--overwrite" in done.stderr
        assert files(tmp_path) == [TABLES[0]]
        done = resample(short, "--no-figures", "--overwrite", cwd=tmp_path, levels=2)
        assert (done.returncode, files(tmp_path)) == (0, TABLES)
        assert (tmp_path / TABLES[0]).read_text().startswith("pass,level,frames,joint,")

    def test_one_subject_of_two_has_to_be_named(self, tmp_path):
        clip = SAMPLES / "two_dancers.c3d"
        both = resample(clip, cwd=tmp_path)
        assert both.returncode == 2
        assert "--subject: Anna, Ben" in both.stderr
        one = resample(clip, "--subject", "Ben", "--no-figures", cwd=tmp_path)
        assert one.returncode == 0
        assert files(tmp_path) == [name.replace("short", "two_dancers.Ben") for name in TABLES]

    def test_a_clip_that_cannot_be_fitted_is_3_and_leaves_nothing_behind(self, short, tmp_path):
        text = (ROOT / "association_files" / "cmu.txt").read_text()
        hips = re.sub(r"^[LR]FWT .*$", "", text, flags=re.M)
        (tmp_path / "map.txt").write_text(hips)
        words = ["study", "resample", short, "--assoc", "map.txt", "-o", "out"]
        done = call(*words, cwd=tmp_path)
        assert done.returncode == 3
        assert "root segment Hips needs three markers" in done.stderr
        assert [p.name for p in tmp_path.iterdir()] == ["map.txt"]

    @pytest.mark.parametrize(
        ("words", "code", "what"),
        [
            (["{clip}"], 2, "--assoc is missing"),
            (["{clip}", "--assoc", "cmuu"], 2, "did you mean cmu?"),
            (["gone.c3d", "--assoc", "cmu"], 3, "gone.c3d: No such file"),
            (["--assoc", "cmu"], 2, "Missing argument 'CLIP'"),
            (["{clip}", "--assoc", "cmu", "--passes", "0"], 2, "'--passes': 0 is not in the range"),
            (["{clip}", "--assoc", "cmu", "--levels", "101"], 2, "101 is not in the range"),
            (["{clip}", "--assoc", "cmu", "--workers", "0"], 2, "0 is not in the range"),
            (["{clip}", "--assoc", "cmu", "--seed", "-1"], 2, "-1 is not in the range"),
            (["{clip}", "--assoc", "cmu", "--sigma", "1mm,2mm"], 2, "one length, or three"),
            (
                ["{clip}", "--assoc", "cmu", "--method", "lls", "--noise", "matrix"], 2,
                "lls takes no noise matrix",
            ),
        ],
    )  # fmt: skip
    def test_a_wrong_call_is_one_clear_message(self, short, tmp_path, words, code, what):
        done = call("study", "resample", *(word.format(clip=short) for word in words), cwd=tmp_path)
        assert done.returncode == code
        assert what in done.stderr
        assert (done.stdout, files(tmp_path)) == ("", [])

    def test_how_it_is_estimated_is_passed_on(self, short, tmp_path):
        more = ["--method", "sgdk", "--pose", "triad", "--sigma", "1mm,1mm,3mm", "--no-figures"]
        done = resample(short, *more, "--json", cwd=tmp_path, levels=1)
        assert done.returncode == 0
        means = [row for row in map(strict, done.stdout.splitlines()) if row["table"] == "means"]
        assert {row["method"] for row in means} == {"SGDK"}

    def test_one_refit_is_no_law_and_needs_no_matplotlib_without_a_figure(self, short, tmp_path):
        words = ["study", "resample", short, "--assoc", "cmu", "--passes", 1, "--levels", 1]
        done = without("matplotlib", *words, "--no-figures", cwd=tmp_path)
        assert (done.returncode, done.stderr, files(tmp_path)) == (0, "", TABLES)
        assert "1 refit of" in done.stdout and "nan" not in done.stdout
        assert re.search(r"^all +14 +- +- +- +- +", done.stdout, re.M)

    @pytest.mark.usefixtures("interruptible")
    def test_interrupted_it_is_130_and_the_same_call_goes_on(self, short, tmp_path):
        words = ["study", "resample", short, "--assoc", "cmu", "--passes", 2, "--levels", 2]
        words += ["--workers", 1, "--no-figures", "-o", "out"]
        start = (
            "import os, signal, mocap_skel.pipeline.study as r\n"
            "first = r.refits\n"
            "def refits(clip, fit, passed, levels, seed):\n"
            "    if passed == 1:\n"
            "        os.kill(os.getpid(), signal.SIGINT)\n"
            "    return first(clip, fit, passed, levels, seed)\n"
            "r.refits = refits\n"
        )
        done = program(start, *words, cwd=tmp_path)
        assert (done.returncode, done.stdout) == (130, "")
        assert done.stderr.strip() == "mocap-skel: interrupted"
        (store,) = (tmp_path / "out").iterdir()
        assert store.name.startswith(".short.resample-")
        assert call(*words, cwd=tmp_path).returncode == 0
        assert files(tmp_path / "out") == TABLES
        assert not store.exists()


class TestSpeed:
    CALL = ("study", "speed", "--trials", 2, "--most-points", 200, "--seed", 1)

    def test_it_writes_tables_and_two_figures(self, tmp_path):
        done = run(*self.CALL, "-o", "out", cwd=tmp_path)
        assert (done.returncode, done.stderr) == (0, "")
        assert files(tmp_path) == [f"out/{name}" for name in SPEED]
        assert "seed 1" in done.stdout and "Time against GDKE's" in done.stdout
        assert re.search(r"^GDKE +1 +1 +1 ", done.stdout, re.M)
        assert re.search(r"^LLS .* 11\.05$", done.stdout, re.M)
        for name in SPEED[:2]:
            assert (tmp_path / "out" / name).read_bytes().startswith(b"\x89PNG")
        trials = (tmp_path / "out" / "speed.trials.csv").read_text().splitlines()
        assert trials[0].startswith("points,noise,angle_deg,radius,gdke_seconds,")
        assert len(trials) == 3

    def test_a_file_that_is_there_stops_it_before_any_work(self, tmp_path):
        (tmp_path / "speed.trials.csv").write_text("mine")
        done = run("study", "speed", "--trials", 1_000_000, "--no-figures", cwd=tmp_path)
        assert done.returncode == 2
        assert "exists already" in done.stderr and "--overwrite" in done.stderr
        assert (tmp_path / "speed.trials.csv").read_text() == "mine"


class TestAccuracy:
    CALL = ("study", "accuracy", "--trials", 2, "--points", 30, "--workers", 1)
    # The whole grid takes some seconds; what it holds is the library's.
    ONE_CELL = (
        "from functools import partial\n"
        "import mocap_skel.studies.accuracy as a\n"
        "a.Plan = partial(a.Plan, noises=(0.01,), angles=(45.0,))\n"
    )

    def test_it_writes_tables_and_the_map_and_the_small_tables_as_json(self, tmp_path):
        done = program(self.ONE_CELL, *self.CALL, "--json", "-o", "out", cwd=tmp_path)
        assert (done.returncode, done.stderr) == (0, "")
        assert files(tmp_path) == [f"out/{name}" for name in ACCURACY]
        assert (tmp_path / "out" / "accuracy.map.png").read_bytes().startswith(b"\x89PNG")
        rows = [strict(line) for line in done.stdout.splitlines()]
        tables = [row["table"] for row in rows]
        assert (tables.count("noise"), tables.count("markers")) == (45, 45)
        assert {row["matrix_error"] is None for row in rows if row["table"] == "noise"} == {
            True,
            False,
        }


class TestMethods:
    def test_it_prints_table_4(self, tmp_path):
        done = run("methods", "--trials", 2, "--seed", 9, cwd=tmp_path)
        assert (done.returncode, done.stderr) == (0, "")
        names = [line.split()[0] for line in done.stdout.splitlines()[1:9]]
        assert names == ["MLE", "LLS", "GDKE", "UGDK", "SGDK", "MGDK", "IGDK", "Pratt"]
        assert re.search(r"^GDKE +26N +1\.00 ", done.stdout, re.M)
        assert "708 operations" in done.stdout and "seed 9, 2 trials" in done.stdout
        assert files(tmp_path) == []

    def test_without_scipy_the_mle_is_a_dash_and_a_hint(self, tmp_path):
        done = without("scipy", "methods", "--trials", 2, cwd=tmp_path)
        assert (done.returncode, done.stderr) == (0, "")
        mle = next(line for line in done.stdout.splitlines() if line.startswith("MLE"))
        assert mle.split()[1:7] == ["-"] * 6
        assert re.search(r"^LLS +236N +\d", done.stdout, re.M)
        assert "pip install 'mocap-skel[mle]'" in done.stdout

    def test_json_is_one_method_a_line_and_null_where_scipy_is_missing(self, tmp_path):
        done = without("scipy", "methods", "--trials", 2, "--json", cwd=tmp_path)
        rows = {row["name"]: row for row in map(strict, done.stdout.splitlines())}
        assert len(rows) == 8
        assert rows["LLS"]["flops"] == 236 and len(rows["Pratt"]["errors"]) == 3
        assert [rows["MLE"][key] for key in ("flops", "time", "errors", "digits")] == [None] * 4

    def test_a_wrong_call_is_2(self, tmp_path):
        done = call("methods", "--trials", 1, cwd=tmp_path)
        assert done.returncode == 2
        assert "1 is not in the range" in done.stderr


@pytest.mark.parametrize(
    ("library", "extra", "words"),
    [
        ("scipy", "mle", ["study", "speed", "--trials", "1000000"]),
        ("scipy", "mle", ["study", "resample", STILL, "--assoc", "cmu", "--method", "mle"]),
        ("matplotlib", "plot", ["study", "accuracy", "--trials", "1000000"]),
        ("matplotlib", "plot", ["study", "resample", STILL, "--assoc", "cmu", "--passes", "9999"]),
    ],
)
def test_a_library_that_is_missing_is_one_line_before_any_work(tmp_path, library, extra, words):
    done = without(library, *words, "-o", "out", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith(f"mocap-skel: error: this needs {library}")
    assert f"pip install 'mocap-skel[{extra}]'" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert done.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_notes_on_the_clip_go_to_standard_error_and_quiet_silences_them(tmp_path):
    """Of a clip that shows no joint there is much to say."""
    loud = resample(STILL, "-o", "a", "--no-figures", cwd=tmp_path, levels=1)
    assert loud.returncode == 0
    assert "place holders, no joint centres" in loud.stderr
    assert all(line.startswith(f"mocap-skel: {STILL}: ") for line in loud.stderr.splitlines())
    assert re.search(r"^LeftKnee .* no ", loud.stdout, re.M)
    quiet = resample(STILL, "-q", "-o", "b", "--no-figures", cwd=tmp_path, levels=1)
    assert (quiet.returncode, quiet.stderr) == (0, "")
    assert "wrote b/nearly_still.resample." in quiet.stdout
    assert files(tmp_path / "b") == [name.replace("short", "nearly_still") for name in TABLES]


def test_a_folder_that_cannot_be_made_is_one_line_before_any_work(tmp_path):
    (tmp_path / "out").write_text("a file")
    words = ["study", "accuracy", "--trials", 1_000_000, "--no-figures", "-o", "out"]
    done = call(*words, cwd=tmp_path)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert (done.stdout, files(tmp_path)) == ("", ["out"])


@pytest.mark.parametrize(
    "words",
    [
        ["resample", STILL, "--assoc", "cmu", "--passes", 1, "--levels", 1, "--workers", 1],
        ["speed", "--trials", 1, "--most-points", 100],
    ],
)
def test_standard_output_is_no_folder(tmp_path, words):
    done = call("study", *words, "--no-figures", "-o", "-", cwd=tmp_path)
    assert done.returncode == 2
    assert "folder" in done.stderr
    assert (done.stdout, files(tmp_path)) == ("", [])


def test_the_study_commands_are_told_with_their_chapter(tmp_path):
    done = call("study", "--help", cwd=tmp_path)
    for name, chapter in (("resample", "6.1"), ("speed", "6.4"), ("accuracy", "6.6")):
        assert re.search(rf"^  {name} .*\({chapter}\)", done.stdout, re.M)
    assert "pip install 'mocap-skel[studies]'" in done.stdout

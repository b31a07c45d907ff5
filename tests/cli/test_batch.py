"""mocap-skel batch as a user runs it: what it fits, what it keeps, what it says."""

import csv
import hashlib
import json
import shutil
import statistics

import pytest
from commands import ROM, STILL, call, files, run
from recordings import ROOT, SAMPLES

DANCERS, GAPS = SAMPLES / "two_dancers.c3d", SAMPLES / "gaps.c3d"


def lines(folder):
    return [json.loads(line) for line in (folder / "manifest.jsonl").read_text().splitlines()]


def table(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def batch(*arguments, cwd):
    """In this process; its children are processes anyway."""
    return call("batch", *arguments, "-o", "out", cwd=cwd)


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """Folders of two people with clips of one name, one that is no clip, and names that are no plain words."""
    data = tmp_path_factory.mktemp("batch") / "data"
    for name, clip in {
        "anna ü/walk.c3d": STILL,
        "ben/walk.c3d": ROM,
        "ben/=it's ok.c3d": DANCERS,
        "gait/gaps.c3d": GAPS,
    }.items():
        (data / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(clip, data / name)
    (data / "bad.c3d").write_bytes(b"no C3D at all")
    (data / "ben" / "notes.txt").write_text("no clip by its suffix")
    (data / ".trash.c3d").write_bytes(b"hidden")
    return data


OPTIONS = ("-a", "cmu", "--assoc-for", "gait/*=plug_in_gait")


@pytest.fixture(scope="module")
def done(recordings):
    """A batch of them, as a process."""
    ended = run("batch", "data", *OPTIONS, "-o", "out", "--jobs", 2, cwd=recordings.parent)
    return recordings.parent / "out", ended


class TestABatch:
    def test_its_files_are_those_of_fit_in_mirrored_folders(self, done, tmp_path):
        out, ended = done
        assert ended.returncode == 1
        assert [line for line in ended.stderr.splitlines() if "error" in line] == [
            "mocap-skel: error: data/bad.c3d: not a C3D file"
        ]
        for clip, association, folder in (
            (ROM, "cmu", "ben"), (STILL, "cmu", "anna ü"), (GAPS, "plug_in_gait", "gait"), (DANCERS, "cmu", "ben"),
        ):  # fmt: skip
            call("fit", clip, "-a", association, "-o", tmp_path / folder, "-q", cwd=tmp_path)
        for one in files(tmp_path):
            name = one.replace("range_of_motion", "walk").replace("nearly_still", "walk")
            name = name.replace("two_dancers", "=it's ok")
            assert (out / name).read_bytes() == (tmp_path / one).read_bytes(), name
        assert len(files(out)) == len(files(tmp_path)) + 3
        assert not list(out.glob(".*"))

    def test_its_manifest_is_true(self, done, recordings):
        out, _ = done
        told = {line["name"]: line for line in lines(out)}
        assert set(told) == {"anna ü/walk", "ben/walk", "ben/=it's ok", "gait/gaps", "bad"}
        for name, line in told.items():
            content = (recordings / f"{name}.c3d").read_bytes()
            assert line["sha256"] == hashlib.sha256(content).hexdigest()
            assert line["clip"] == f"data/{name}.c3d" and line["seconds"] > 0
            assert line["files"] == {f: (out / f).stat().st_size for f in line["files"]}
            assert (line["status"], bool(line["files"])) == (
                ("failed", False) if name == "bad" else ("done", True)
            )
        listed = sorted(name for line in told.values() for name in line["files"])
        assert listed == [name for name in files(out) if "/" in name]
        assert told["bad"]["reason"] == "data/bad.c3d: not a C3D file"
        assert any("LTHI" in note for note in told["gait/gaps"]["notes"])
        assert told["gait/gaps"]["options"]["assoc"] == "plug_in_gait.txt"
        rows = table(out / "manifest.csv")
        assert [row["name"] for row in rows] == [line["name"] for line in lines(out)]
        assert {row["name"]: row["yes"] for row in rows}["ben/walk"] == "14"

    def test_its_summary_is_that_of_the_joint_tables(self, done):
        out, ended = done
        rows = {(row["actor"], row["joint"]): row for row in table(out / "summary.csv")}
        assert {actor for actor, _ in rows} == {"", "anna ü", "ben", "gait", "Anna", "Ben"}
        joints = [table(path) for path in sorted(out.rglob("*.joints.csv"))]
        assert len(joints) == 5
        own = [row for rows in joints for row in rows if row["joint"] == "LeftKnee"]
        bones = [float(row["bone"]) for row in own]
        whole = rows["", "LeftKnee"]
        assert whole["clips"] == "5"
        assert float(whole["bone_mean"]) == pytest.approx(statistics.mean(bones), abs=1e-5)
        assert float(whole["bone_sd"]) == pytest.approx(statistics.stdev(bones), abs=1e-5)
        assert float(whole["x_sd"]) == pytest.approx(
            statistics.stdev(float(row["x"]) for row in own), abs=1e-5
        )
        shown = [row["shown"] for row in own]
        assert [float(whole[w]) for w in ("yes", "weak", "no")] == [
            shown.count(w) / 5 for w in ("yes", "weak", "no")
        ]
        assert rows["ben", "LeftKnee"]["clips"] == "1" and rows["ben", "LeftKnee"]["bone_sd"] == ""
        assert f"LeftKnee           5  {20 * shown.count('yes'):>5}" in ended.stdout

    def test_the_same_call_again_does_only_what_failed(self, done, recordings):
        out, _ = done
        before = {path: path.stat().st_mtime_ns for path in out.rglob("*.*.csv")}
        again = call("batch", "data", *OPTIONS, "-o", "out", "--json", cwd=recordings.parent)
        assert again.returncode == 1
        assert {path: path.stat().st_mtime_ns for path in out.rglob("*.*.csv")} == before
        rows = [json.loads(line) for line in again.stdout.splitlines()]
        told = {row["name"]: row["status"] for row in rows if row["table"] == "clips"}
        assert told == {
            "anna ü/walk": "kept", "ben/walk": "kept", "ben/=it's ok": "kept", "gait/gaps": "kept", "bad": "failed"
        }  # fmt: skip
        assert "4 kept, 1 failed" in again.stderr
        assert next(row["joint"] for row in rows if row["table"] == "summary") == "Waist"


class TestResults:
    """Of two clips, what is done again and what is refused."""

    @pytest.fixture
    def folder(self, tmp_path):
        for name in ("a", "b"):
            shutil.copy(STILL, tmp_path / f"{name}.c3d")
        assert batch("[ab].c3d", "-a", "cmu", cwd=tmp_path).returncode == 0
        return tmp_path

    def test_what_is_broken_is_refused_or_done_again(self, folder):
        whole = (folder / "out" / "a.joints.csv").read_bytes()
        (folder / "out" / "a.joints.csv").write_bytes(whole[:100])
        told = batch("[ab].c3d", "-a", "cmu", cwd=folder)
        # Somebody may have changed it on purpose.
        assert (told.returncode, "exists already" in told.stderr) == (1, True)
        assert (folder / "out" / "a.joints.csv").read_bytes() == whole[:100]
        (folder / "out" / "a.joints.csv").unlink()
        (folder / "out" / "a.skeleton.csv").unlink()
        done = batch("[ab].c3d", "-a", "cmu", cwd=folder)
        assert (done.returncode, "1 kept, 1 fitted" in done.stderr) == (0, True)
        assert (folder / "out" / "a.joints.csv").read_bytes() == whole

    def test_another_content_under_the_name_is_seen(self, folder):
        shutil.copy(ROM, folder / "a.c3d")
        refused = batch("[ab].c3d", "-a", "cmu", cwd=folder)
        assert refused.returncode == 1
        assert "the clip was another when it was fitted" in refused.stderr
        skipped = batch("[ab].c3d", "-a", "cmu", "--skip-existing", cwd=folder)
        assert (skipped.returncode, "skipped" in skipped.stderr) == (0, True)
        fitted = batch("[ab].c3d", "-a", "cmu", "--overwrite", cwd=folder)
        assert (fitted.returncode, "1 kept" in fitted.stderr) == (0, True)
        last = {line["name"]: line for line in lines(folder / "out")}["a"]
        assert last["sha256"] == hashlib.sha256(ROM.read_bytes()).hexdigest()
        (folder / "a.c3d").write_bytes(b"no more a C3D")
        assert batch("[ab].c3d", "-a", "cmu", "--overwrite", cwd=folder).returncode == 1
        shutil.copy(ROM, folder / "a.c3d")
        # Its results were never touched, and the manifest says so again.
        assert batch("[ab].c3d", "-a", "cmu", cwd=folder).returncode == 0
        assert {row["status"] for row in table(folder / "out" / "manifest.csv")} == {"done"}

    def test_other_options_are_seen_before_any_fit(self, folder, monkeypatch):
        with monkeypatch.context() as patched:
            patched.setattr("mocap_skel.pipeline.engine.begin", None)
            refused = batch("[ab].c3d", "-a", "cmu", "--sigma", "1mm", cwd=folder)
        assert refused.returncode == 2 and "this is a bug" not in refused.stderr
        assert refused.stderr.count("fitted with other options") == 2
        # Another file of the same rules is the same; another format is added.
        shutil.copy(ROOT / "association_files" / "cmu.txt", folder / "cmu.txt")
        more = batch("[ab].c3d", "-a", "cmu.txt", "-f", "bvh", cwd=folder)
        assert more.returncode == 0
        both = batch("[ab].c3d", "-a", "cmu", "-f", "bvh", "-f", "csv", cwd=folder)
        assert "2 kept" in both.stderr
        # Two children end in any order.
        last = {name for line in lines(folder / "out")[-2:] for name in line["files"]}
        assert last == {f"{n}.{end}" for n in "ab" for end in ("bvh", "joints.csv", "skeleton.csv")}

    def test_a_part_that_failed_is_told_again(self, tmp_path):
        text = (ROOT / "association_files" / "cmu.txt").read_text()
        for label in ("LFWT", "RFWT"):
            text = text.replace(f"{label}  {label}", f"Anna:{label}  {label}")
        (tmp_path / "half.txt").write_text(text)
        for kept in (False, True):
            done = batch(DANCERS, "-a", "half.txt", cwd=tmp_path)
            assert (done.returncode, "1 kept" in done.stderr) == (1, kept)
            assert "Ben: " in done.stderr and "Hips needs three markers" in done.stderr
        (line,) = lines(tmp_path / "out")
        assert (line["status"], len(line["files"])) == ("partly", 2)
        assert line["reason"].startswith("Ben: ")

    def test_results_are_no_inputs(self, folder):
        again = call("batch", ".", "-a", "cmu", "-o", ".", "-f", "c3d", cwd=folder)
        assert (again.returncode, "2 clips: 2 fitted" in again.stderr) == (0, True)
        again = call("batch", ".", "-a", "cmu", "-o", ".", "-f", "c3d", cwd=folder)
        assert (again.returncode, "2 clips: 2 kept" in again.stderr) == (0, True)


class TestTheCall:
    def test_a_list_may_come_on_standard_input(self, tmp_path):
        shutil.copy(STILL, tmp_path / "a\nb.c3d")
        told = run(
            "batch", "-", "-a", "cmu", "-o", "out", "--root", ".", "--fail-fast", "-q",
            cwd=tmp_path, input="gone.c3d\0a\nb.c3d\0",
        )  # fmt: skip
        # With one child, what comes first would be all; a second one may have been quicker.
        assert told.returncode in (1, 3)
        assert told.stderr == "mocap-skel: error: gone.c3d: No such file or directory\n"
        done = run(
            "batch", "-", "-a", "cmu", "-o", "out", "-q", cwd=tmp_path, input="a\nb.c3d\0"
        )  # fmt: skip
        assert (done.returncode, done.stderr) == (0, "")
        assert lines(tmp_path / "out")[-1]["name"] == "a\nb"

    def test_a_job_file_has_options_and_the_command_line_goes_before(self, tmp_path):
        shutil.copy(STILL, tmp_path / "a.c3d")
        (tmp_path / "job.toml").write_text(
            'assoc = "nix"\nassoc-for = ["a=cmu"]\nformat = ["bvh", "trc"]\nrotation_order = "xyz"\n'
            'sigma = "1mm"\njobs = 1\nquiet = true\n'
        )
        done = batch("a.c3d", "--job", "job.toml", "-a", "cmu", "--sigma", "2mm", cwd=tmp_path)
        assert (done.returncode, done.stderr) == (0, "")
        (line,) = lines(tmp_path / "out")
        assert sorted(line["files"]) == ["a.bvh", "a.skeleton.trc"]
        assert line["options"]["sigma"] == 0.002
        assert line["options"]["formats"] == {"bvh": {"rotation_order": "XYZ"}, "trc": {}}

    @pytest.mark.parametrize(
        ("job", "what"),
        [
            ('asoc = "cmu"', "asoc is no option of batch (did you mean assoc"),
            ("quiet = 1", "quiet is true or false"),
            ('sigma = ["1mm", "2mm"]', "sigma takes one value"),
            ("sigma = {x = 1}", "sigma takes no value of this kind"),
            ("jobs = 0", "is not in the range"),
            ("jobs = ", "job.toml:1:8: Invalid value"),
        ],
    )
    def test_a_wrong_job_file_is_2(self, tmp_path, job, what):
        (tmp_path / "job.toml").write_text(job)
        done = batch(STILL, "-a", "cmu", "--job", "job.toml", cwd=tmp_path)
        assert (done.returncode, what in done.stderr) == (2, True), done.stderr
        assert files(tmp_path) == ["job.toml"]

    @pytest.mark.parametrize(
        ("words", "what"),
        [
            (["x*.c3d"], "x*.c3d: no file is named like this"),
            (["empty"], "empty: no clip in this folder"),
            (["a/x.c3d", "a/x.C3D"], "a/x.c3d and a/x.C3D would write the same files"),
            (["a/x.c3d", "--root", "empty"], "it does not lie below the --root"),
            (["a", "--assoc-for", "cmu"], "give a pattern of clips"),
            (["a", "--assoc-for", "x=cmuu"], "did you mean cmu?"),
            (["a/x.c3d", "--rate", "inf"], "a frame rate is a number from"),
            (["a", "--engine", "dask"], "--engine dask and --scheduler ADDRESS go together"),
            (["a", "--calibration", "c.json", "--assoc-for", "x=cmu"], "goes with one --assoc"),
        ],
    )
    def test_a_wrong_call_is_2_before_any_work(self, tmp_path, words, what):
        (tmp_path / "empty").mkdir()
        (tmp_path / "a").mkdir()
        for name in ("x.c3d", "x.C3D"):
            (tmp_path / "a" / name).write_bytes(b"")
        done = batch(*words, "-a", "cmu", cwd=tmp_path)
        assert (done.returncode, what in done.stderr, done.stdout) == (2, True, ""), done.stderr
        assert files(tmp_path) == ["a/x.C3D", "a/x.c3d"]

    def test_a_name_too_long_for_the_system_does_not_stop_the_others(self, tmp_path):
        shutil.copy(STILL, tmp_path / "a.c3d")
        done = batch("y" * 5000, "a.c3d", "-a", "cmu", cwd=tmp_path)
        assert done.returncode == 1
        assert "bug" not in done.stderr
        assert len(done.stderr.splitlines()) == 2
        assert [(line["name"], line["status"]) for line in lines(tmp_path / "out")] == [
            ("a", "done")
        ]

    def test_tables_of_somebody_else_stay(self, tmp_path):
        (tmp_path / "out").mkdir()
        for name, text in (("summary.csv", "mine"), ("manifest.jsonl", '{"my": "lines"}\n')):
            (tmp_path / "out" / name).write_text(text)
            done = batch(STILL, "-a", "cmu", cwd=tmp_path)
            assert done.returncode == 2
            assert (tmp_path / "out" / name).read_text() == text
            (tmp_path / "out" / name).unlink()

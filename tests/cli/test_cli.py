"""The command line as a user runs it: a process, its exit code, its two streams, its files."""

import csv
import json
import os
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from commands import ROM, STILL, call, files, run
from recordings import ROOT, SAMPLES


def test_fit_writes_both_tables_and_prints_the_joint_table(tmp_path):
    done = run("fit", STILL, "--assoc", "cmu", cwd=tmp_path)
    assert done.returncode == 0
    assert files(tmp_path) == ["nearly_still.joints.csv", "nearly_still.skeleton.csv"]
    assert "14 of 14 joints fitted" in done.stdout
    for joint in ("Waist", "LeftAnkle"):
        assert re.search(rf"^{joint} +(yes|weak|no) ", done.stdout, re.M)
    with (tmp_path / "nearly_still.skeleton.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 300
    assert rows[0]["frame"] == "1"
    assert list(rows[0])[:5] == ["frame", "time", "Waist_x", "Waist_y", "Waist_z"]


def test_json_is_one_object_a_joint_on_standard_output_alone(tmp_path):
    done = run("fit", ROM, "--assoc", "cmu", "--json", cwd=tmp_path)
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert [row["joint"] for row in rows][:3] == ["Waist", "Neck", "RightShoulder"]
    assert len(rows) == 14
    assert all(row["shown"] == "yes" for row in rows)
    assert rows[0]["clip"] == str(ROM)


def test_a_dash_sends_one_clips_format_to_standard_output(tmp_path):
    done = call("fit", STILL, "--assoc", "cmu", "-o", "-", "--format", "bvh", cwd=tmp_path)
    assert done.returncode == 0
    assert done.stdout.startswith("HIERARCHY\nROOT Hips\n")
    assert files(tmp_path) == []
    both = call("fit", STILL, ROM, "--assoc", "cmu", "-o", "-", cwd=tmp_path)
    assert (both.returncode, both.stdout) == (2, "")
    for more in (["--json"], ["--format", "csv", "--format", "bvh"]):
        assert call("fit", STILL, "--assoc", "cmu", "-o", "-", *more, cwd=tmp_path).returncode == 2
    two = call("fit", SAMPLES / "two_dancers.c3d", "--assoc", "cmu", "-o", "-", cwd=tmp_path)
    assert (two.returncode, two.stdout) == (2, "")
    assert "--subject: Anna, Ben" in two.stderr


def test_an_existing_file_stays_unless_overwrite_is_given(tmp_path):
    old = tmp_path / "nearly_still.joints.csv"
    old.write_text("mine")
    done = call("fit", STILL, "--assoc", "cmu", cwd=tmp_path)
    assert done.returncode == 2
    assert "exists already" in done.stderr and "--overwrite" in done.stderr
    assert old.read_text() == "mine"
    assert files(tmp_path) == ["nearly_still.joints.csv"]
    assert call("fit", STILL, "--assoc", "cmu", "--overwrite", cwd=tmp_path).returncode == 0
    assert old.read_text().startswith("joint,parent,child,")


def test_each_subject_gets_its_own_files(tmp_path):
    clip = SAMPLES / "two_dancers.c3d"
    done = call("fit", clip, "--assoc", "cmu", "-o", "out", cwd=tmp_path)
    assert done.returncode == 0
    assert files(tmp_path) == [
        f"out/two_dancers.{who}.{what}.csv"
        for who in ("Anna", "Ben")
        for what in ("joints", "skeleton")
    ]
    one = call("fit", clip, "--assoc", "cmu", "-o", "one", "--subject", "Ben", cwd=tmp_path)
    assert one.returncode == 0
    assert files(tmp_path / "one") == ["two_dancers.Ben.joints.csv", "two_dancers.Ben.skeleton.csv"]
    wrong = call("fit", clip, "--assoc", "cmu", "--subject", "Bem", cwd=tmp_path)
    assert wrong.returncode == 2
    assert "did you mean Ben?" in wrong.stderr


def test_one_bad_clip_does_not_take_the_others_with_it(tmp_path):
    bad = tmp_path / "bad.c3d"
    bad.write_bytes(b"no C3D at all")
    done = run("fit", bad, STILL, "gone.c3d", "--assoc", "cmu", cwd=tmp_path)
    assert done.returncode == 1
    assert "nearly_still.skeleton.csv" in files(tmp_path)
    errors = [line for line in done.stderr.splitlines() if line.startswith("mocap-skel: error: ")]
    assert len(errors) == 2
    assert "bad.c3d: not a C3D file" in errors[0]
    assert "gone.c3d: No such file" in errors[1]
    assert "2 of 3 clips failed" in done.stderr
    told = run("fit", bad, "gone.c3d", "--assoc", "cmu", "--json", cwd=tmp_path)
    rows = [json.loads(line) for line in told.stdout.splitlines()]
    assert [(row["clip"], row["table"]) for row in rows] == [
        (str(bad), "failures"), ("gone.c3d", "failures")
    ]  # fmt: skip
    assert rows[1]["failure"] == "gone.c3d: No such file or directory"


def test_nothing_fitted_is_3_and_leaves_nothing_behind(tmp_path):
    bad = tmp_path / "bad.c3d"
    bad.write_bytes(b"\x02\x50" + bytes(510))
    done = call("fit", bad, "--assoc", "cmu", "-o", "out", cwd=tmp_path)
    assert done.returncode == 3
    assert len(done.stderr.splitlines()) == 1
    assert files(tmp_path) == ["bad.c3d"]


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (["fit"], "Missing argument"),
        (["fit", ROM, "--assoc", "cmuu"], "did you mean cmu?"),
        (["fit", ROM, "--assoc", "map.txt"], "map.txt:1:6: 'LFTW' is no marker"),
        (["fit", ROM, "--assoc", "cmu", "--skeleton", "nix"], "nix: no such skeleton file"),
        (["fit", ROM, "--assoc", "cmu", "--sigma", "1"], "with its unit"),
        (["fit", ROM, "--assoc", "cmu", "--unit", "parsec"], "no length unit"),
        (["fit", ROM, "--assoc", "cmu", "--format", "fbx"], "'fbx' is not one of"),
        (["fit", ROM, ROM, "--assoc", "cmu"], "would write the same files"),
        (["fti"], "No such command"),
        (["study", "sped"], "No such command"),
        (["study", "speed", "-o", "-"], "give a folder"),
        (["methods", "--seed", "-1"], "is not in the range"),
        (["inspect", ROM, "--assoc", "cmu", "--rate", "0"], "a frame rate is a number from 0.01"),
    ],
)
def test_a_wrong_call_is_2_with_one_clear_message(tmp_path, arguments, what):
    (tmp_path / "map.txt").write_text("LFWT LFTW\n")
    done = call(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert what in done.stderr
    assert done.stdout == ""
    assert files(tmp_path) == ["map.txt"]


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path):
    (tmp_path / "out").write_text("a file")
    done = call("fit", STILL, "--assoc", "cmu", "-o", "out", cwd=tmp_path)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert files(tmp_path) == ["out"]


def test_a_reader_that_has_seen_enough_is_no_error(tmp_path):
    command = f"{sys.executable} -m mocap_skel fit {ROM} --assoc cmu -o - | head -n 1"
    done = subprocess.run(command, shell=True, cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout.startswith("frame,time,")
    assert done.stderr == ""


def shell(command, cwd):
    command = command.replace("mocap-skel", f"{sys.executable} -m mocap_skel")
    return subprocess.run(
        command, shell=True, executable="/bin/bash", cwd=cwd, capture_output=True, text=True
    )


def test_a_table_that_nobody_reads_does_not_stop_the_work(tmp_path):
    command = f"mocap-skel fit {STILL} {ROM} --assoc cmu -q | true; exit ${{PIPESTATUS[0]}}"
    done = shell(command, tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert len(files(tmp_path)) == 4


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")
def test_an_output_that_cannot_be_written_is_one_line(tmp_path):
    done = shell(f"mocap-skel fit {STILL} --assoc cmu -q -o - > /dev/full", tmp_path)
    assert done.returncode == 1
    assert done.stderr == "mocap-skel: error: standard output: No space left on device\n"


def test_a_truncated_clip_without_a_joint_is_no_success(tmp_path):
    short = tmp_path / "short.c3d"
    short.write_bytes(ROM.read_bytes()[:3000])
    done = call("fit", short, "--assoc", "cmu", cwd=tmp_path)
    assert done.returncode == 3
    assert files(tmp_path) == ["short.c3d"]


def test_a_subject_that_cannot_be_fitted_is_a_failure_even_in_silence(tmp_path):
    whole = (ROOT / "association_files" / "cmu.txt").read_text()
    hips = whole.replace("LFWT  LFWT", "Anna:LFWT  LFWT").replace("RFWT  RFWT", "Anna:RFWT  RFWT")
    (tmp_path / "map.txt").write_text(hips)
    clip = SAMPLES / "two_dancers.c3d"
    done = call("fit", clip, "--assoc", "map.txt", "-q", "-o", "out", cwd=tmp_path)
    assert done.returncode == 1
    assert "Ben: " in done.stderr and "root segment Hips needs three markers" in done.stderr
    assert files(tmp_path / "out") == [
        "two_dancers.Anna.joints.csv",
        "two_dancers.Anna.skeleton.csv",
    ]


def test_a_dash_sends_who_could_be_fitted_and_fails_for_who_could_not(tmp_path):
    whole = (ROOT / "association_files" / "cmu.txt").read_text()
    hips = whole.replace("LFWT  LFWT", "Anna:LFWT  LFWT").replace("RFWT  RFWT", "Anna:RFWT  RFWT")
    (tmp_path / "map.txt").write_text(hips)
    clip = SAMPLES / "two_dancers.c3d"
    done = call("fit", clip, "--assoc", "map.txt", "-q", "-o", "-", cwd=tmp_path)
    assert done.returncode == 1
    assert done.stdout.startswith("frame,time,Waist_x,") and len(done.stdout.splitlines()) == 701
    assert len(done.stderr.splitlines()) == 1 and "Ben: " in done.stderr
    assert files(tmp_path) == ["map.txt"]


def test_one_call_never_replaces_its_own_results(tmp_path):
    shutil.copy(SAMPLES / "two_dancers.c3d", tmp_path / "a.c3d")
    shutil.copy(STILL, tmp_path / "a.Anna.c3d")
    done = run("fit", "a.c3d", "a.Anna.c3d", "--assoc", "cmu", "--overwrite", cwd=tmp_path)
    assert done.returncode == 1
    assert "is the result of another clip" in done.stderr
    assert len((tmp_path / "a.Anna.skeleton.csv").read_text().splitlines()) == 701


def test_swapped_markers_are_not_called_shown(tmp_path):
    text = (ROOT / "association_files" / "cmu.txt").read_text()
    swapped = text.replace("LTHI  LTHI", "RTHI  LTHI").replace("RTHI  RTHI", "LTHI  RTHI")
    (tmp_path / "map.txt").write_text(swapped)
    for options, said in (
        ((), "in doubt: {side}THI is left out, it looks exchanged"),
        (("--trust-labels", "--overwrite"), "swapped or wrongly assigned?"),
    ):
        done = call("fit", ROM, "--assoc", "map.txt", "--json", *options, cwd=tmp_path)
        assert "LTHI and RTHI look exchanged" in done.stderr
        told = [json.loads(line) for line in done.stdout.splitlines()]
        rows = {row["joint"]: row for row in told if "joint" in row}
        notes = [row["note"] for row in told if row.get("table") == "notes"]
        assert any("LTHI and RTHI look exchanged" in note for note in notes)
        for joint in ("LeftHip", "RightHip"):
            assert rows[joint]["shown"] == "weak"
            assert said.format(side=joint[0]) in rows[joint]["reason"]


def test_a_wrong_sigma_cannot_run_away(tmp_path):
    call("fit", ROM, "--assoc", "cmu", "-o", "right", cwd=tmp_path)
    call("fit", ROM, "--assoc", "cmu", "-o", "wrong", "--sigma", "5mm", cwd=tmp_path)
    right, wrong = (
        np.genfromtxt(tmp_path / folder / "range_of_motion.skeleton.csv", delimiter=",", names=True)
        for folder in ("right", "wrong")
    )
    for name in right.dtype.names[2:44]:
        # 4 mm: what five times the noise does to a knee that is capped by its own residual.
        assert np.abs(right[name] - wrong[name]).max() < 0.008, name


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_is_130(tmp_path):
    # The interpreter turns SIGINT into KeyboardInterrupt, as Ctrl-C in a terminal does.
    program = (
        "import os, signal, mocap_skel.pipeline.clip_files as b\n"
        "b.process = lambda *a: os.kill(os.getpid(), signal.SIGINT)\n"
        "from mocap_skel.cli import main\n"
        f"main(['fit', {str(ROM)!r}, '--assoc', 'cmu'])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 130
    assert done.stderr.strip() == "mocap-skel: interrupted"


def test_notes_go_to_standard_error_and_quiet_silences_them(tmp_path):
    clip = SAMPLES / "gaps.c3d"
    loud = call("fit", clip, "--assoc", "plug_in_gait", "-o", "a", cwd=tmp_path)
    assert "markers missing in every frame: LTHI (UpperLeftLeg)" in loud.stderr
    assert "LTHI" not in loud.stdout
    quiet = call("fit", clip, "--assoc", "plug_in_gait", "-o", "b", "-q", cwd=tmp_path)
    assert quiet.stderr == ""


def test_up_turns_the_results(tmp_path):
    call("fit", STILL, "--assoc", "cmu", "-o", "z", cwd=tmp_path)
    call("fit", STILL, "--assoc", "cmu", "-o", "y", "--up", "y", cwd=tmp_path)
    z, y = (
        np.genfromtxt(tmp_path / up / "nearly_still.skeleton.csv", delimiter=",", names=True)
        for up in "zy"
    )
    np.testing.assert_array_equal(z["Head_z"], y["Head_y"])
    np.testing.assert_array_equal(z["Head_x"], y["Head_z"])


def test_an_unexpected_error_is_one_line_and_debug_shows_more(tmp_path):
    program = (
        "import sys, mocap_skel.pipeline.clip_files as b\n"
        "def broken(*a): raise RuntimeError('oops')\n"
        "b.process = broken\n"
        "from mocap_skel.cli import main\n"
        f"main(sys.argv[1:] + ['fit', {str(ROM)!r}, '--assoc', 'cmu'])\n"
    )
    plain, debug = (
        subprocess.run(
            [sys.executable, "-c", program, *flag], cwd=tmp_path, capture_output=True, text=True
        )
        for flag in ([], ["--debug"])
    )
    assert plain.returncode == 3
    assert "this is a bug: RuntimeError: oops" in plain.stderr
    assert "Traceback" not in plain.stderr
    assert "Traceback" in debug.stderr


def test_inspect_shows_what_is_in_a_clip(tmp_path):
    done = call("inspect", SAMPLES / "gaps.c3d", "--assoc", "plug_in_gait", cwd=tmp_path)
    assert done.returncode == 0
    assert "1440 frames at 60 Hz, first frame 1, unit mm, z up" in done.stdout
    assert re.search(r"^- +LTHI +100\.0 % +LTHI +UpperLeftLeg$", done.stdout, re.M)
    assert "labels not in the clip: LFRA (line" in done.stdout


def test_inspect_as_json(tmp_path):
    done = call("inspect", SAMPLES / "two_dancers.c3d", "--json", cwd=tmp_path)
    facts = json.loads(done.stdout)
    assert facts["subjects"] == ["Anna", "Ben"]
    assert (facts["frames"], facts["first_frame"], facts["rate"]) == (700, 101, 50.0)
    assert len(facts["markers"]) == 82
    assert facts["markers"][0]["segment"] == "Head"


def test_inspect_is_the_place_to_see_why_nothing_matches(tmp_path):
    (tmp_path / "map.txt").write_text("X LFWT\n")
    done = call("inspect", STILL, "--assoc", "map.txt", cwd=tmp_path)
    assert done.returncode == 0
    assert "no label of the clip is in map.txt" in done.stdout
    assert "LFHD" in done.stdout


def test_inspect_refuses_an_unknown_subject(tmp_path):
    clip = SAMPLES / "two_dancers.c3d"
    done = call("inspect", clip, "--subject", "Bem", cwd=tmp_path)
    assert done.returncode == 2
    assert "did you mean Ben?" in done.stderr


@pytest.mark.parametrize(
    "command",
    [
        [], ["fit"], ["inspect"], ["methods"], ["study"], ["study", "resample"], ["study", "speed"],
        ["study", "accuracy"],
    ],
)  # fmt: skip
def test_help_has_an_example_and_loads_no_numpy(tmp_path, command):
    done = run(*command, "--help", cwd=tmp_path)
    assert done.returncode == 0
    assert "Example: mocap-skel " in done.stdout
    program = (
        "import sys\nfrom mocap_skel.cli import main\n"
        f"try: main({[*command, '--help']!r})\nexcept SystemExit: pass\n"
        "print('numpy' in sys.modules, 'pandas' in sys.modules)"
    )
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert loaded.stdout.splitlines()[-1] == "False False"


def test_fit_loads_no_pandas(tmp_path):
    program = (
        "import sys\nfrom mocap_skel.cli import main\n"
        f"try: main(['fit', {str(STILL)!r}, '--assoc', 'cmu'])\nexcept SystemExit: pass\n"
        "print('pandas' in sys.modules, 'tqdm' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.stdout.splitlines()[-1] == "False False"


def test_the_choices_of_the_options_are_those_of_the_library():
    """They are written again in the command, so that help need not load the library."""
    from mocap_skel.cli.fit import command
    from mocap_skel.fit import POSES
    from mocap_skel.joints.choices import BEST
    from mocap_skel.segments.noise import NOISES
    from mocap_skel.spherefit import METHODS

    choices = {o.name: tuple(getattr(o.type, "choices", ())) for o in command.params}
    assert choices["pose"] == POSES
    assert choices["method"] == (BEST, *METHODS)
    assert choices["noise"] == NOISES

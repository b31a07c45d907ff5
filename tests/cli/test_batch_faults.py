"""A batch that is ended at any moment, whose children die, or that is not alone: its manifest is true."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from commands import STILL, files, run, tiny

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals are those of POSIX")
HERE = Path(__file__).parents[1]
# What a loaded machine may need for anything.
ENOUGH = 60.0


def lines(folder):
    path = folder / "manifest.jsonl"
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def clips(folder, count, clip=STILL):
    folder.mkdir()
    for i in range(count):
        shutil.copy(clip, folder / f"c{i}.c3d")
    return folder


def start(*words, cwd):
    return subprocess.Popen(
        [sys.executable, "-m", "mocap_skel", "batch", *map(str, words)], cwd=cwd, start_new_session=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def until(true):
    end = time.monotonic() + ENOUGH
    while not true():
        assert time.monotonic() < end
        time.sleep(0.01)


def ended(group):
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return True
    return False


def check_manifest(out):
    """Every line is about files that are there, and every file has a line."""
    told = {}
    for line in lines(out):
        assert line["status"] == "done"
        assert line["name"] not in told, "fitted twice"
        told[line["name"]] = line["files"]
    known = {name: size for sizes in told.values() for name, size in sizes.items()}
    assert {name: (out / name).stat().st_size for name in known} == known
    tables = {"manifest.jsonl", "manifest.csv", "summary.csv"}
    assert set(files(out)) - tables == set(known)
    return told


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize(
    ("sign", "code", "word"),
    [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")],
)
def test_a_signal_ends_it_and_its_children_and_leaves_nothing_half(tmp_path, sign, code, word):
    clips(tmp_path / "data", 60)
    running = start("data", "-a", "cmu", "-o", "out", "--jobs", 2, cwd=tmp_path)
    until(lambda: len(lines(tmp_path / "out")) > 2)
    # Ctrl-C goes to all processes of a terminal, `kill` to one.
    (os.killpg if sign == signal.SIGINT else os.kill)(running.pid, sign)
    _, told = running.communicate(timeout=ENOUGH)
    assert (running.returncode, told.strip()) == (code, f"mocap-skel: {word}")
    until(lambda: ended(running.pid))
    assert 2 < len(check_manifest(tmp_path / "out")) < 60
    assert not list((tmp_path / "out").glob(".*"))


def test_it_goes_on_from_wherever_it_was_killed(tmp_path):
    clips(tmp_path / "data", 12)
    out = tmp_path / "out"
    for least in (1, 5):
        running = start("data", "-a", "cmu", "-o", "out", "--jobs", 2, cwd=tmp_path)
        until(lambda: len(lines_so_far(out)) > least)  # noqa: B023
        running.kill()
        running.communicate(timeout=ENOUGH)
    # As if it had been killed between a file and its line, and within a line.
    (line,) = [line for line in lines_so_far(out) if line["name"] == "c0"]
    stage = out / ".batch-x"
    (stage / "own").mkdir(parents=True)
    shutil.copy(out / "c0.skeleton.csv", stage / "own" / "1")
    moved = {**line, "name": "new", "files": {"new.joints.csv": 3, "new.skeleton.csv": 3}}
    (out / "new.joints.csv").write_text("abc")
    parts = {"new.joints.csv": "own/0", "new.skeleton.csv": "own/1"}
    entry = {"line": moved, "new": list(parts), "parts": parts}
    (stage / "moving.json").write_text(json.dumps(entry))
    with (out / "manifest.jsonl").open("a") as file:
        file.write('{"clip": "data/c9.c3d", "na')
    done = run("batch", "data", "-a", "cmu", "-o", "out", "--jobs", 2, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = lines(out)
    assert [line["status"] for line in told if line["name"] == "new"] == ["broken"]
    (out / "manifest.jsonl").write_text(
        "".join(json.dumps(line) + "\n" for line in told if line["name"] != "new")
    )
    assert set(check_manifest(out)) == {f"c{i}" for i in range(12)}
    assert not list(out.glob(".*"))


def lines_so_far(folder):
    """Those that are whole."""
    path = folder / "manifest.jsonl"
    text = path.read_text() if path.exists() else ""
    return [json.loads(line) for line in text.splitlines(keepends=True) if line.endswith("\n")]


KILLS = int(os.environ.get("MOCAP_SKEL_KILLS", "3"))
# Kills from one whole run to the next, which has to mend what they left.
ROUND = 4


def check_killed(out):
    """What a killed batch leaves: no line is about a file that is not there; a file without a line was being put."""
    told, announced = {}, set()
    for line in lines_so_far(out):
        told |= line["files"]
    for moving in out.glob(".batch-*/moving.json"):
        with suppress(ValueError):
            announced |= set(json.loads(moving.read_text())["parts"])
    assert {name: (out / name).stat().st_size for name in told} == told
    there = {name for name in files(out) if not name.startswith(".")}
    assert there - {"manifest.jsonl", "manifest.csv", "summary.csv"} <= set(told) | announced


def test_killed_at_random_moments(tmp_path):
    """`make kills N=50` tries so many; a failure names the kill."""
    clips(tmp_path / "data", 4, tiny())
    out = tmp_path / "out"
    call = ("data", "-a", "cmu", "-o", "out", "--jobs", 2, "-q")
    since = time.monotonic()
    assert run("batch", *call, cwd=tmp_path).returncode == 0
    whole = time.monotonic() - since
    rng = np.random.default_rng(0)
    for kill in range(KILLS):
        if kill % ROUND == 0:
            shutil.rmtree(out)
        running = start(*call, cwd=tmp_path)
        time.sleep(rng.uniform(0.2, 1.0) * whole)
        running.kill()
        running.communicate(timeout=ENOUGH)
        if out.exists():
            check_killed(out)
        if kill % ROUND == ROUND - 1 or kill == KILLS - 1:
            done = run("batch", *call, cwd=tmp_path)
            assert (done.returncode, done.stderr) == (0, ""), kill
            last = {line["name"]: line for line in lines(out) if line["status"] != "broken"}
            assert set(last) == {f"c{i}" for i in range(4)}, kill
            # None that had a line was fitted again.
            assert len(last) == sum(line["status"] == "done" for line in lines(out)), kill
            check_killed(out)
            assert not list(out.glob(".*")), kill


def test_a_second_batch_into_one_folder_is_refused(tmp_path):
    clips(tmp_path / "data", 30)
    running = start("data", "-a", "cmu", "-o", "out", "--jobs", 1, cwd=tmp_path)
    until(lambda: lines(tmp_path / "out"))
    second = run("batch", "data", "-a", "cmu", "-o", "out", cwd=tmp_path)
    assert running.poll() is None, "too quick for this test"
    assert second.returncode == 2
    assert "out/manifest.jsonl: another batch is writing there" in second.stderr
    running.terminate()
    running.communicate(timeout=ENOUGH)
    assert check_manifest(tmp_path / "out")


def test_children_that_die_are_told_in_the_manifest_and_the_others_go_on(tmp_path):
    data = clips(tmp_path / "data", 4)
    for name in ("crash", "hang", "hungry"):
        shutil.copy(STILL, data / f"{name}.c3d")
    call = ["3", "batch", "data", "-a", "cmu", "-o", "out", "--jobs", "2", "--json"]
    done = subprocess.run(
        [sys.executable, HERE / "brittle.py", *call],
        cwd=tmp_path, capture_output=True, text=True, timeout=ENOUGH,
    )  # fmt: skip
    assert done.returncode == 1, done.stderr
    told = {line["name"]: line["reason"] for line in lines(tmp_path / "out")}
    memory = {"hungry": "data/hungry.c3d: needs more than 2 GB of memory"}
    assert told == {
        **{f"c{i}": None for i in range(4)},
        "crash": "data/crash.c3d: the process that read it was ended by SIGSEGV",
        "hang": "data/hang.c3d: took longer than 3 s",
        **(memory if sys.platform == "linux" else {"hungry": told["hungry"]}),
    }
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert {r["name"]: r["reason"] for r in rows if r["table"] == "clips"} == told


def test_a_folder_that_goes_away_ends_it_with_one_line(tmp_path):
    clips(tmp_path / "data", 40)
    running = start("data", "-a", "cmu", "-o", "out", "--jobs", 1, "-q", cwd=tmp_path)
    until(lambda: lines(tmp_path / "out"))
    (tmp_path / "out").rename(tmp_path / "elsewhere")
    shutil.rmtree(tmp_path / "elsewhere")
    _, told = running.communicate(timeout=ENOUGH)
    assert running.returncode == 1
    assert "manifest.jsonl: it has gone, or its folder has" in told.splitlines()[-1]
    assert len(told.splitlines()) <= 2

"""A batch on a real scheduler and two workers, which are processes of their own; one is killed in the middle."""

import json
import os
import shutil
import subprocess
import sys
import time

import pytest
from commands import STILL, run, without
from recordings import ROOT

HERE = {**os.environ, "PYTHONPATH": str(ROOT)}
ENOUGH = 60.0
CLIPS = 14


def test_without_dask_it_is_one_line(tmp_path):
    call = (
        "batch",
        STILL,
        "-a",
        "cmu",
        "-o",
        "out",
        "--engine",
        "dask",
        "--scheduler",
        "tcp://127.0.0.1:1",
    )
    done = without("distributed", *call, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr == (
        "mocap-skel: error: this needs distributed, which is not installed "
        "(pip install 'mocap-skel[cluster]')\n"
    )
    assert list(tmp_path.iterdir()) == []


def until(true):
    end = time.monotonic() + ENOUGH
    while not (found := true()):
        assert time.monotonic() < end
        time.sleep(0.05)
    return found


@pytest.fixture
def cluster(tmp_path):
    """The scheduler's address, and the processes of two workers: one by itself, one watched by Dask's nanny."""
    pytest.importorskip("distributed")
    started = []

    def start(kind, *words):
        log = (tmp_path / f"{kind}{len(started)}.log").open("w")
        call = [sys.executable, "-m", f"distributed.cli.{kind}", *words, "--host", "127.0.0.1"]
        process = subprocess.Popen(call, cwd=tmp_path, env=HERE, stdout=log, stderr=log)
        log.close()
        started.append(process)
        return process

    about = tmp_path / "scheduler.json"
    start("dask_scheduler", "--port", "0", "--no-dashboard", "--no-show", "--scheduler-file", about)

    def address():
        try:
            return json.loads(about.read_text())["address"]
        except (OSError, ValueError):
            return None

    found = until(address)
    # The workers' own folder is not that of the call.
    (tmp_path / "elsewhere").mkdir()
    where = ("--nthreads", "1", "--no-dashboard", "--local-directory", str(tmp_path / "elsewhere"))
    workers = [start("dask_worker", found, *where, *more) for more in (["--no-nanny"], ["--nanny"])]
    yield found, workers
    for process in reversed(started):
        # Dask's own way of ending takes its time; the nanny's worker ends with the nanny.
        process.kill()
    for process in started:
        process.wait(ENOUGH)


def test_a_worker_that_is_killed_loses_nothing_and_doubles_nothing(cluster, tmp_path):
    scheduler, (victim, _) = cluster
    data, out = tmp_path / "data", tmp_path / "out"
    data.mkdir()
    for i in range(CLIPS):
        shutil.copy(STILL, data / f"c{i}.c3d")
    (data / "bad.c3d").write_bytes(b"no C3D at all")
    call = ["batch", "data", "-a", "cmu", "-o", "out", "--engine", "dask", "--scheduler", scheduler]
    running = subprocess.Popen(
        [sys.executable, "-m", "mocap_skel", *call], cwd=tmp_path, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    manifest = out / "manifest.jsonl"
    until(lambda: manifest.exists() and manifest.read_text().count("\n") > 2)
    victim.kill()
    _, said = running.communicate(timeout=ENOUGH)
    lines = [json.loads(line) for line in manifest.read_text().splitlines()]
    assert running.returncode == 1
    assert "data/bad.c3d: not a C3D file" in said and "Traceback" not in said
    told = {line["name"]: line["status"] for line in lines}
    assert len(lines) == len(told) == CLIPS + 1
    assert told == {**{f"c{i}": "done" for i in range(CLIPS)}, "bad": "failed"}
    for line in lines:
        assert {f: (out / f).stat().st_size for f in line["files"]} == line["files"]
    assert not list(out.glob(".*"))
    again = run(*call, cwd=tmp_path)
    assert f"{CLIPS} kept, 1 failed" in again.stderr


def test_no_address_is_one_line(tmp_path):
    call = ("--engine", "dask", "--scheduler", "127.0.0.1:8786")
    done = run("batch", STILL, "-a", "cmu", "-o", "out", *call, cwd=tmp_path)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert "127.0.0.1:8786: no address of a scheduler (give tcp://HOST:PORT)" in done.stderr
    assert list(tmp_path.iterdir()) == []

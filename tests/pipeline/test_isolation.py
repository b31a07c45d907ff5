"""A child's death, sleep or hunger is one failed task; so it is for the clips of one call."""

from __future__ import annotations

import errno
import multiprocessing
import os
import pickle
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from mutations import whole

from mocap_skel.errors import ClipError
from mocap_skel.export.files import staging
from mocap_skel.export.registry import choose
from mocap_skel.labels.association import read_association
from mocap_skel.pipeline import engine
from mocap_skel.pipeline.clip_files import process, put
from mocap_skel.pipeline.engine import Local, Task
from mocap_skel.pipeline.isolation import GIGABYTE, TaskError, Worker
from mocap_skel.pipeline.job import Job


@pytest.fixture
def no_child_is_left():
    before = {child.pid for child in multiprocessing.active_children()}
    yield
    assert {child.pid for child in multiprocessing.active_children()} == before


@pytest.fixture(scope="module")
def worker():
    with Worker() as worker:
        yield worker


# What a child may take that is to come to an end: a loaded machine may need it to start one.
ENOUGH = 120.0


def ask(worker, function, *arguments, seconds=ENOUGH, memory=GIGABYTE):
    worker.start(function, *arguments, memory=memory, seconds=seconds)
    return worker.result()


def fails(message):
    raise ClipError(message, "a hint")


def hungry(size):
    return len(np.ones(size, np.uint8))


def unsendable():
    return lambda: None


def chatter(text):
    os.write(1, text)
    os.write(2, text)
    return len(text)


def test_results_and_errors_come_back(worker):
    assert ask(worker, divmod, 7, 2) == (3, 1)
    with pytest.raises(ClipError, match="walk") as error:
        ask(worker, fails, "walk.c3d: no")
    assert error.value.hint == "a hint"
    with pytest.raises(ZeroDivisionError) as error:
        ask(worker, divmod, 1, 0)
    assert "Traceback" in error.value.__notes__[0]
    with pytest.raises(RuntimeError, match="function"):
        ask(worker, unsendable)


def test_what_a_library_prints_is_not_shown(worker, capfd):
    assert ask(worker, chatter, b"terminate called") == 16
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("function", "arguments", "seconds", "why"),
    [
        (os.abort, (), ENOUGH, "ended by SIGABRT"),
        (signal.raise_signal, (signal.SIGSEGV,), ENOUGH, "ended by SIGSEGV"),
        (os._exit, (7,), ENOUGH, "ended with code 7"),
        (time.sleep, (3600,), 1.0, "took longer than 1 s"),
    ],
)
def test_a_child_that_dies_or_hangs_is_one_failed_task(worker, function, arguments, seconds, why):
    ask(worker, divmod, 1, 1)
    with pytest.raises(TaskError, match=why):
        ask(worker, function, *arguments, seconds=seconds)
    assert ask(worker, divmod, 7, 2) == (3, 1)


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is limited on Linux only")
def starve(seconds):
    """Work for so long, with a core for a fifth of the time."""
    end = time.process_time() + seconds
    while (now := time.process_time()) < end:
        while time.process_time() < now + 0.01:
            pass
        time.sleep(0.04)
    return time.process_time()


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux says how long a child had a core")
def test_a_child_that_waits_for_a_core_has_more_time(worker):
    ask(worker, starve, 0.0)
    since = time.monotonic()
    assert ask(worker, starve, 0.2, seconds=0.5) > 0
    assert time.monotonic() - since > 0.5
    with pytest.raises(TaskError, match="took longer than 0 s"):
        ask(worker, starve, 5.0, seconds=0.4)


def test_a_child_gets_no_more_memory_than_its_limit(worker):
    with pytest.raises(TaskError, match=r"needs more than 0\.5 GB of memory"):
        ask(worker, hungry, GIGABYTE, memory=GIGABYTE // 2)
    # The next task has a limit of its own.
    assert ask(worker, hungry, GIGABYTE // 4) == GIGABYTE // 4


kept = []


def hoards(size):
    kept.append(np.ones(size, np.uint8))
    return os.getpid()


def cannot_load(error):
    raise error


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is known on Linux only")
def test_a_child_that_keeps_what_a_large_clip_took_is_replaced(worker):
    small, large = GIGABYTE // 100, GIGABYTE // 2
    first = ask(worker, hoards, small)
    assert ask(worker, hoards, large) == first
    # It would have no room at all for the next: that one's limit is less than what it holds.
    assert ask(worker, hoards, GIGABYTE // 5, memory=large) != first


@pytest.mark.parametrize(
    ("error", "starved"),
    [
        (ImportError("_ezc3d.so: failed to map segment from shared object"), True),
        (OSError(errno.ENOMEM, os.strerror(errno.ENOMEM)), True),
        (ImportError("no module named ezc3d"), False),
        (OSError(errno.ENOENT, "No such file"), False),
    ],
)
def test_want_of_memory_has_many_names(worker, error, starved):
    with pytest.raises(TaskError if starved else type(error)) as raised:
        ask(worker, cannot_load, error)
    assert ("needs more than 1 GB of memory" in str(raised.value)) == starved


sound_work = engine.work


def brittle(task):
    """`work`, but for clips whose name says what happens."""
    if "crash" in task.path.name:
        os.abort()
    if "hang" in task.path.name:
        time.sleep(3600)
    return sound_work(task)


@pytest.mark.parametrize("jobs", [1, 2])
def test_clips_that_kill_their_child_do_not_take_the_others(
    tmp_path, monkeypatch, no_child_is_left, jobs
):
    monkeypatch.setattr(engine, "work", brittle)
    sound = whole("nearly_still").data
    paths = [tmp_path / f"{name}.c3d" for name in ("a", "crash", "b", "hang", "c", "none")]
    for path in paths[:-1]:
        path.write_bytes(sound)
    job = Job(read_association("cmu"), folder=tmp_path / "out")

    def tasks(stage):
        for path in paths:
            # Only the one that hangs is short of time, however busy the machine is.
            monkeypatch.setattr(engine, "SECONDS", 3.0 if path.stem == "hang" else ENOUGH)
            yield Task(path, job, stage)

    found = {}
    with staging(tmp_path) as stage, Local(jobs) as local:
        for outcome in local.run(tasks(stage)):
            known = isinstance(outcome.result, ClipError)
            found[outcome.task.path.stem] = (
                outcome.result.message if known else len(outcome.result.parts)
            )
    assert jobs > 1 or list(found) == [path.stem for path in paths]
    assert found == {
        "a": 2,
        "crash": f"{paths[1]}: the process that read it was ended by SIGABRT",
        "b": 2,
        "hang": f"{paths[3]}: took longer than 3 s",
        "c": 2,
        "none": f"{paths[5]}: No such file or directory",
    }


def test_a_clip_in_a_child_gives_what_it_gives_by_itself(tmp_path):
    paths = [tmp_path / "one.c3d", tmp_path / "two.c3d"]
    for path, name in zip(paths, ("nearly_still", "range_of_motion"), strict=True):
        path.write_bytes(whole(name).data)
    inside, alone = (
        Job(read_association("cmu"), choose(["csv", "bvh"]), tmp_path / name)
        for name in ("in", "alone")
    )
    with staging(tmp_path) as stage, Local() as local:
        for path, outcome in zip(
            paths, local.run(Task(path, inside, stage) for path in paths), strict=True
        ):
            ours, theirs = outcome.result, process(path, alone)
            assert ours.notes == theirs.notes
            # Rows and text come back, no fits.
            assert len(pickle.dumps(ours)) < 10_000
            put(path, inside, ours.parts, ())
            assert [one.name for one in ours.parts] == [one.name for one in theirs.files]
            for one in ours.parts:
                assert one.read_text() == (tmp_path / "alone" / one.name).read_text()
    assert not list(tmp_path.glob(".*"))


def ended(group):
    until = time.monotonic() + ENOUGH
    while time.monotonic() < until:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.05)
    return False


@pytest.mark.usefixtures("interruptible")
def test_ctrl_c_is_130_and_leaves_no_child(tmp_path, samples):
    for i in range(40):
        shutil.copy(samples / "range_of_motion.c3d", tmp_path / f"c{i}.c3d")
    call = [sys.executable, "-m", "mocap_skel", "fit", *[f"c{i}.c3d" for i in range(40)]]
    running = subprocess.Popen(
        [*call, "--assoc", "cmu", "-o", "out"], cwd=tmp_path, start_new_session=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert "c0.c3d" in running.stdout.readline()
    # As a terminal does it: to all processes of the group.
    os.killpg(running.pid, signal.SIGINT)
    _, told = running.communicate(timeout=ENOUGH)
    assert (running.returncode, told.strip()) == (130, "mocap-skel: interrupted")
    # multiprocessing's own tracker ends a moment after its parent; a child that is left would not.
    assert ended(running.pid)
    written = list((tmp_path / "out").iterdir())
    assert written and not [path for path in written if path.suffix == ".part"]


def test_one_clip_by_itself_loads_nothing_for_children(samples, tmp_path):
    code = (
        "import sys\nfrom mocap_skel.cli import main\ntry:\n    main(sys.argv[1:])\n"
        "except SystemExit as end:\n    print(end.code, 'multiprocessing' in sys.modules)"
    )
    clip = samples / "nearly_still.c3d"
    call = ["fit", clip, "--assoc", "cmu", "-o", tmp_path]
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, call)], capture_output=True, text=True
    )
    assert done.stdout.splitlines()[-1] == "0 False"

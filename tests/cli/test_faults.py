"""What a system can do to a call: each ends with whole files, a true manifest, the right code, a line at most."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest
from commands import files, tiny

from mocap_skel.errors import ExistsError
from mocap_skel.export import files as result_files
from mocap_skel.export.files import write_all

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="shells, limits and disks of POSIX")
FIT = "fit data/a.c3d -a cmu -o out -q"
BATCH = "batch data -a cmu -o out --jobs 1 -q"
TABLES = {"manifest.jsonl", "manifest.csv", "summary.csv"}


@pytest.fixture
def here(tmp_path):
    """A folder with two clips in `data`."""
    (tmp_path / "data").mkdir()
    for name in "ab":
        shutil.copy(tiny(), tmp_path / "data" / f"{name}.c3d")
    return tmp_path


def shell(line, cwd, **options):
    """A line of a shell, in which MS is the program: its code, and the lines of its standard error."""
    program = f'"{sys.executable}" -m mocap_skel'
    done = subprocess.run(
        ["bash", "-c", line.replace("MS", program)], cwd=cwd, capture_output=True, timeout=120, **options,
    )  # fmt: skip
    told = (done.stderr + done.stdout).decode()
    assert "Traceback" not in told and "bug" not in told
    lines = done.stderr.decode().splitlines()
    assert all(line.isprintable() for line in lines)
    return done.returncode, lines


def check_true(out):
    """Every line of the manifest is about files that are there, every file has a line; the status of each clip."""
    said = {}
    for text in (out / "manifest.jsonl").read_text().splitlines():
        line = json.loads(text)
        said[line["name"]] = line
    known = {name: size for line in said.values() for name, size in line["files"].items()}
    assert {name: (out / name).stat().st_size for name in known} == known
    assert set(files(out)) - TABLES == set(known)
    return {name: line["status"] for name, line in said.items()}


class TestStreams:
    def test_all_three_closed(self, here):
        assert shell(f"MS {BATCH} >&- 2>&- <&-", here) == (0, [])
        assert check_true(here / "out") == {"a": "done", "b": "done"}
        assert set(files(here / "out")) > TABLES

    def test_standard_output_closed(self, here):
        assert shell(f"MS {FIT} >&-", here) == (0, [])
        assert files(here / "out") == ["a.joints.csv", "a.skeleton.csv"]
        code, (line,) = shell("MS fit data/a.c3d -a cmu -o - >&-", here)
        assert (code, line[:52]) == (2, "mocap-skel: error: -o -: standard output is closed (")

    @pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full")
    def test_a_full_disk_behind_standard_output_ends_it(self, here):
        code, lines = shell(f"MS {BATCH} --json > /dev/full", here)
        assert code == 1
        assert lines == ["mocap-skel: error: standard output: No space left on device"]
        assert check_true(here / "out") == {"a": "done"}

    def test_readers_that_go_away_are_no_reason_to_end(self, here):
        line = "(MS fit data/a.c3d gone.c3d data/b.c3d -a cmu -o out; echo $? > code) 2>&1 | true"
        assert shell(line, here) == (0, [])
        assert (here / "code").read_text() == "1\n"
        assert len(files(here / "out")) == 4


class TestLimits:
    def test_open_files(self, here):
        code, lines = shell(f"ulimit -n 5; MS {BATCH}", here)
        assert (code, len(lines)) == (3, 1)
        assert "Too many open files" in lines[0]
        assert not (here / "out").exists()

    def test_memory(self, here):
        code, lines = shell(f"ulimit -v 60000; MS {FIT}", here)
        assert (code, lines) == (1, ["mocap-skel: error: not enough memory for this call"])
        assert not (here / "out").exists()

    def test_the_size_of_files(self, here):
        code, lines = shell(f"ulimit -f 8; MS {BATCH}", here)
        assert code == 2
        assert lines == [
            f"mocap-skel: error: out/{name}.skeleton.csv: File too large" for name in "ab"
        ]
        assert check_true(here / "out") == {"a": "failed", "b": "failed"}


@contextmanager
def disk(folder, options):
    """A small disk of its own."""
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", options, "none", str(folder)]
    if sys.platform != "linux" or not shutil.which("mount") or os.getuid():
        pytest.skip("only root of Linux can mount a disk")
    done = subprocess.run(mount, capture_output=True, text=True)
    if done.returncode:
        pytest.skip(f"no disk can be mounted: {done.stderr.strip()}")
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)


class TestDisks:
    def test_one_that_is_full_and_then_is_not(self, here):
        with disk(here / "out", "size=64k"):
            code, lines = shell(f"MS {BATCH}", here)
            assert (code, len(lines)) == (1, 1)
            assert "out/b." in lines[0] and "No space left on device" in lines[0]
            assert check_true(here / "out") == {"a": "done", "b": "failed"}
            assert not list((here / "out").glob(".*"))
            subprocess.run(["mount", "-o", "remount,size=1m", str(here / "out")], check=True)
            assert shell(f"MS {BATCH}", here) == (0, [])
            assert check_true(here / "out") == {"a": "done", "b": "done"}

    def test_one_that_is_read_only(self, here):
        with disk(here / "out", "ro"):
            for call in (BATCH, FIT):
                code, (line,) = shell(f"MS {call}", here)
                assert code == 2 and "Read-only file system" in line


WRITER = """
import sys, time
from pathlib import Path
from mocap_skel.errors import ExistsError
from mocap_skel.export.files import write_all
while time.time() < float(sys.argv[2]):
    pass
try:
    write_all({Path("r.csv"): sys.argv[1] * 9, Path("r.bvh"): sys.argv[1] * 9}, overwrite=False)
except ExistsError:
    sys.exit(2)
"""


class TestTwoAtOnce:
    def test_one_of_many_writes_and_the_others_say_so(self, tmp_path):
        at = str(time.time() + 1.0)
        running = [
            subprocess.Popen([sys.executable, "-c", WRITER, str(i), at], cwd=tmp_path)
            for i in range(6)
        ]
        codes = [one.wait(timeout=60) for one in running]
        assert sorted(codes) == [0, 2, 2, 2, 2, 2]
        winner = str(codes.index(0)) * 9
        assert [(tmp_path / name).read_text() for name in files(tmp_path)] == [winner, winner]

    @pytest.mark.parametrize("links", [True, False])
    def test_a_file_that_comes_in_between_stays(self, tmp_path, monkeypatch, links):
        first, second = tmp_path / "a", tmp_path / "b"
        monkeypatch.setattr(result_files, "check_free", lambda *_: second.write_text("theirs"))
        if not links:

            def refused(*_):
                raise PermissionError(1, "Operation not permitted")

            monkeypatch.setattr(os, "link", refused)
        with pytest.raises(ExistsError, match="b: exists already"):
            write_all({first: "mine", second: "mine"}, overwrite=False)
        assert files(tmp_path) == ["b"] and second.read_text() == "theirs"
        second.unlink()
        monkeypatch.setattr(result_files, "check_free", lambda *_: None)
        write_all({first: "mine", second: "mine"}, overwrite=False)
        assert files(tmp_path) == ["a", "b"] and second.read_text() == "mine"


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize("sign", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("place", ["_bytes", "_put_new"])
def test_a_signal_waits_until_files_are_whole(tmp_path, monkeypatch, sign, place):
    """One that comes while files are written or put into their places."""
    before = signal.signal(sign, lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    own = getattr(result_files, place)

    def struck(*arguments):
        os.kill(os.getpid(), sign)
        return own(*arguments)

    monkeypatch.setattr(result_files, place, struck)
    try:
        with pytest.raises(KeyboardInterrupt):
            write_all({tmp_path / "a": "x", tmp_path / "b": "y"}, overwrite=False)
    finally:
        signal.signal(sign, before)
    assert files(tmp_path) == ["a", "b"]

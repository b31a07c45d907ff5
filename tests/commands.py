"""The program as a user runs it: a process, its exit code, its streams, its files."""

import atexit
import io
import shutil
import subprocess
import sys
import tempfile
from contextlib import chdir, redirect_stderr, redirect_stdout
from functools import cache
from pathlib import Path

import pytest
from recordings import SAMPLES

from mocap_skel.cli import main

ROM = SAMPLES / "range_of_motion.c3d"
STILL = SAMPLES / "nearly_still.c3d"
PARTS = {
    "distributed": ("distributed",),
    "scipy": ("scipy", "scipy.optimize"),
    "matplotlib": ("matplotlib", "matplotlib.figure", "matplotlib.colors"),
}


def run(*arguments, cwd, **options):
    """Run mocap-skel; whatever happens, nobody may see a traceback."""
    done = subprocess.run(
        [sys.executable, "-m", "mocap_skel", *map(str, arguments)],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=120,
        **options,
    )
    assert "Traceback" not in done.stderr + done.stdout
    return done


def files(folder):
    return sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file())


def program(start, *arguments, cwd):
    """Run the command in a Python that something was done to first."""
    code = f"{start}\nimport sys\nfrom mocap_skel.cli import main\nmain(sys.argv[1:])\n"
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        cwd=cwd, capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert "Traceback" not in done.stderr + done.stdout
    return done


def without(library, *arguments, cwd):
    """Run the command where a library is not installed."""
    start = f"import sys\nsys.modules |= dict.fromkeys({PARTS[library]!r})"
    return program(start, *arguments, cwd=cwd)


def call(*arguments, cwd):
    """As `run`, in this process: faster, for calls whose only point is what they say and how they end."""
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8") for _ in range(2))
    with chdir(cwd), redirect_stdout(out), redirect_stderr(err), pytest.raises(SystemExit) as end:
        main([str(argument) for argument in arguments])
    out.flush()
    err.flush()
    said, complained = (stream.buffer.getvalue().decode() for stream in (out, err))
    assert "Traceback" not in said + complained
    return subprocess.CompletedProcess(arguments, end.value.code, said, complained)


@cache
def tiny():
    """A clip of a second, for calls of which only the ends count."""
    from mocap_skel import artificial as art
    from mocap_skel.artificial.write import write_c3d

    folder = Path(tempfile.mkdtemp(prefix="mocap-skel-tiny-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    motion = art.range_of_motion(1, 60, seed=0)
    clip = art.record(art.human(), art.marker_set("cmu"), motion, art.Faults(sigma=0.001), seed=0)
    write_c3d(clip, folder / "tiny.c3d", "mm")
    return folder / "tiny.c3d"

"""Timings of `mocap-skel`, side by side in one run: `make bench` or `python benchmarks/bench_fit.py [CLIP [MAP]]`.

Prints (a) the cold command against a bare read of the same file in a cold Python, (b) the fit alone against ezc3d's
read, both warm, (c) one call on many clips against a shell's loop of calls. Ratios are what counts: the machine's load
moves the rest. Behind each ratio stands what it should be.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from timing import aimed, alternate

ROOT = Path(__file__).parent.parent
REAL = ROOT.parent / "shared" / "clips" / "cmu" / "01_01.c3d"
SAMPLE = ROOT / "sample_data" / "range_of_motion.c3d"
ROUNDS = 9
# Clips of one call, each as short as a trial of gait.
CLIPS = 100
SHORT = ROOT / "sample_data" / "nearly_still.c3d"
PROGRAM = [sys.executable, "-m", "mocap_skel"]
# A program that is installed has its modules compiled; some machines keep Python from that.
PLACE = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
PLACE["PYTHONPATH"] = str(ROOT)


def call(*words: str | Path) -> None:
    """A call of the program, in a process of its own."""
    folder = tempfile.gettempdir()
    said = [*PROGRAM, *map(str, words)]
    subprocess.run(said, check=True, capture_output=True, env=PLACE, cwd=folder)


def cold(clip: Path, association: str) -> None:
    bare = [sys.executable, "-c", f"import ezc3d; ezc3d.c3d({str(clip)!r})"]
    with tempfile.TemporaryDirectory() as folder:
        options = ("--assoc", association, "-o", folder, "--overwrite")
        whole, read, start = alternate(
            lambda: call("fit", clip, *options),
            lambda: subprocess.run(bare, check=True, env=PLACE),
            lambda: subprocess.run([sys.executable, "-c", "import numpy"], check=True, env=PLACE),
            rounds=ROUNDS,
        )
    print("cold, a new process each time, best of", ROUNDS)
    print(f"  mocap-skel fit (read, fit, two CSV files)   {1e3 * whole:7.0f} ms")
    print(f"  python -c 'import ezc3d; ezc3d.c3d(...)'    {1e3 * read:7.0f} ms")
    print(f"  python -c 'import numpy'                    {1e3 * start:7.0f} ms")
    print(f"  ratio of the first two                      {aimed(whole / read, most=1.5)}")


def warm(clip: Path, association: str) -> None:
    import ezc3d

    from mocap_skel import associate, fit_skeleton, read_association, read_clip

    known = read_association(association)
    recording = read_clip(clip)
    assignment = associate(recording, known)[0]
    fit, ours, read = alternate(
        lambda: fit_skeleton(recording, assignment, known.skeleton),
        lambda: read_clip(clip),
        lambda: ezc3d.c3d(str(clip)),
        rounds=ROUNDS,
    )
    frames, markers = recording.points.shape[:2]
    print(f"warm, {frames} frames x {markers} markers, best of", ROUNDS)
    print(f"  fit_skeleton                                {1e3 * fit:7.0f} ms")
    print(f"  read_clip                                   {1e3 * ours:7.0f} ms")
    print(f"  ezc3d.c3d(...)                              {1e3 * read:7.0f} ms")
    print(f"  ratio of the first and the last             {aimed(fit / read, most=1.2)}")


def many() -> None:
    """One call on many clips, with one job and with two, against a loop that calls the program for each."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "clips").mkdir()
        for number in range(CLIPS):
            shutil.copy(SHORT, folder / "clips" / f"{number:03d}.c3d")
        few = sorted((folder / "clips").iterdir())[: CLIPS // 10]

        def batch(jobs: int) -> None:
            options = ("--assoc", "cmu", "--jobs", str(jobs), "-o", folder / "out")
            call("batch", folder / "clips", *options)
            shutil.rmtree(folder / "out")

        def loop() -> None:
            for clip in few:
                call("fit", clip, "--assoc", "cmu", "-o", folder / "out")
            shutil.rmtree(folder / "out")

        one, two, tenth = alternate(lambda: batch(1), lambda: batch(2), loop, rounds=2)
    print(f"{CLIPS} clips of 300 frames, best of 2")
    print(f"  batch --jobs 1                              {one:7.1f} s")
    print(f"  batch --jobs 2                              {two:7.1f} s")
    print(f"  a loop of calls (ten times {len(few)} clips)         {10 * tenth:7.1f} s")
    print(f"  the loop / one job                          {aimed(10 * tenth / one, least=3.0)}")
    print(f"  one job / two                               {aimed(one / two, least=1.8)}")


def main() -> None:
    clip = Path(sys.argv[1]) if len(sys.argv) > 1 else REAL if REAL.exists() else SAMPLE
    association = sys.argv[2] if len(sys.argv) > 2 else "cmu"
    print(clip)
    cold(clip, association)
    warm(clip, association)
    many()


if __name__ == "__main__":
    main()

"""How time and memory of a fit grow with the clip: `make bench` or `python benchmarks/bench_growth.py [FRAMES ...]`.

The bundled range of motion, there and back as often as it takes, with new noise, is fitted and written as CSV, each
length in a process of its own. The slope is that of log time over log frames, of processor time less what a call on
a short clip takes; memory is the most that the process held, less the same, as a multiple of the points (24 bytes a
marker and frame).
"""

from __future__ import annotations

import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from bench_fit import PLACE, SAMPLE
from timing import aimed

from mocap_skel.readers.formats.c3d.survey import survey

FRAMES = (30_000, 100_000, 300_000)
# Millimetres.
NOISE = 0.3
CALL = """
import resource, sys
from mocap_skel.cli import main
try:
    main()
except SystemExit as end:
    used = resource.getrusage(resource.RUSAGE_SELF)
    sys.stderr.write(f"{end.code or 0} {used.ru_utime + used.ru_stime} {used.ru_maxrss}")
"""


def long_clip(path: Path, frames: int) -> int:
    """Write the bundled clip with so many frames; returns how many points it has."""
    found, raw = survey(SAMPLE), SAMPLE.read_bytes()
    layout, rng = found.layout, np.random.default_rng(0)
    head = bytearray(raw[: layout.start])
    # A count that 16 bits cannot hold is left to the size of the file, as -1.
    count = min(frames, 0xFFFF)
    struct.pack_into("<HH", head, 6, 1, count)
    at = head.index(b"FRAMES") + 6
    struct.pack_into("<H", head, at + 4 + head[at + 3], count)
    there = found.read(0, layout.declared)
    both = np.concatenate([there, there[-2:0:-1]])
    with path.open("wb") as file:
        file.write(head)
        for first in range(0, frames, len(both)):
            some = both[: frames - first].copy()
            seen = some[..., 3:] >= 0
            noise = rng.normal(0, NOISE, some[..., :3].shape).astype("<f4")
            some[..., :3] += noise * seen
            file.write(some.astype("<f4").tobytes())
    return layout.points


def used(clip: Path, folder: Path) -> tuple[float, float]:
    """Processor seconds and bytes of a fit of a clip."""
    options = ["--assoc", "cmu", "-o", str(folder), "--overwrite", "--quiet"]
    call = [sys.executable, "-c", CALL, "fit", str(clip), *options]
    done = subprocess.run(call, capture_output=True, text=True, env=PLACE, cwd=folder, check=True)
    code, seconds, kilobytes = done.stderr.split()[-3:]
    if code != "0":
        raise RuntimeError(done.stderr)
    return float(seconds), 1024 * float(kilobytes)


def main() -> None:
    lengths = [int(word) for word in sys.argv[1:]] or list(FRAMES)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        clip = folder / "walk.c3d"
        long_clip(clip, 100)
        least, rest = used(clip, folder)
        print("growth of a fit with two CSV files")
        print(f"{'frames':>10s} {'seconds':>8s} {'MB':>7s} {'/ points':>9s}")
        seconds, shares = [], []
        for frames in lengths:
            points = 24.0 * frames * long_clip(clip, frames)
            time, memory = used(clip, folder)
            seconds.append(time - least)
            shares.append((memory - rest) / points)
            print(f"{frames:10,d} {time:8.2f} {memory / 2**20:7.0f} {shares[-1]:9.2f}")
        slope = np.polyfit(np.log(lengths), np.log(seconds), 1)[0] if len(lengths) > 1 else np.nan
    print(f"  slope                                       {aimed(float(slope), most=1.05)}")
    print(f"  memory / points                             {aimed(max(shares), most=3.0)}")


if __name__ == "__main__":
    main()

"""Thousands of generated clips through `mocap-skel batch`, some of them damaged: `make soak` or `python soak.py [N]`.

Prints wall time, rate, and the memory of the program and of its children in tenths of the run. Exits with 1 if a clip
is lost, a sound one fails, a line of the manifest is not true, a damaged one gives a result that is told as whole, or
memory grows.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path

import numpy as np

from mocap_skel import artificial as art
from mocap_skel.artificial.write import write_c3d

CLIPS = 2600
JOBS = 2
DAMAGED = 0.02
RATE = 60.0
# Seconds of a clip: the middle half of the CMU database's trials is 3 to 15 s long.
SHORTEST, LONGEST = 2.0, 10.0
# Bytes by which the program may grow from the second tenth to the last, for each clip: what it knows of one is its name,
# its hash and its files. For the children, a share.
GROWTH, CHILDREN_GROWTH = 20_000, 0.2
MOTIONS = (art.range_of_motion, art.dance, art.walk, art.still)


def make(folder: Path, clips: int) -> set[str]:
    """Write the clips; the names of the damaged ones. The same number makes the same clips."""
    damaged = set()
    for i in range(clips):
        rng = np.random.default_rng(i)
        motion = MOTIONS[i % len(MOTIONS)](rng.uniform(SHORTEST, LONGEST), RATE, i)
        faults = art.Faults(sigma=0.001, slide=0.005, dropout=0.02 * (i % 3))
        clip = art.record(art.human(), art.marker_set("cmu"), motion, faults, seed=i)
        path = folder / f"{i % 40:02}" / f"{i:05}.c3d"
        path.parent.mkdir(exist_ok=True)
        write_c3d(clip, path, "mm")
        if rng.random() < DAMAGED:
            damaged.add(f"{path.parent.name}/{path.stem}")
            path.write_bytes(_damage(path.read_bytes(), rng))
    return damaged


def _damage(data: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(data)))
    match rng.integers(4):
        case 0:
            return data[:at]
        case 1:
            return data[:at] + bytes(4096) + data[at + 4096 :]
        case 2:
            return data[:at] + rng.bytes(64) + data[at + 64 :]
        case _:
            return rng.bytes(600)


def resident(process: int) -> int:
    """Bytes of memory that a process uses, 0 where there is none."""
    try:
        pages = Path(f"/proc/{process}/statm").read_text().split()[1]
    except (OSError, IndexError):
        return 0
    return int(pages) * os.sysconf("SC_PAGE_SIZE")


def children(process: int) -> list[int]:
    """The processes that a process has started, the tracker of multiprocessing among them."""
    try:
        return [
            int(i) for i in Path(f"/proc/{process}/task/{process}/children").read_text().split()
        ]
    except OSError:
        return []


def watched(call: list[str], folder: Path) -> tuple[int, float, list[tuple[int, int, int]]]:
    """Run a program: its code, seconds, and how many lines the manifest and bytes it and its children had over time."""
    seen: list[tuple[int, int, int]] = []
    since = time.monotonic()
    with subprocess.Popen(call, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as running:
        lines: list[bytes] = []
        reading = threading.Thread(target=lambda: lines.extend(running.stderr or []))
        reading.start()
        while running.poll() is None:
            manifest = folder / "manifest.jsonl"
            size = manifest.stat().st_size if manifest.exists() else 0
            most = max(map(resident, children(running.pid)), default=0)
            seen.append((size, resident(running.pid), most))
            time.sleep(0.5)
        reading.join()
        print(b"".join(lines[-1:]).decode().strip())
    return running.returncode, time.monotonic() - since, seen


def grown(name: str, bytes_: list[int], allowed: float) -> list[str]:
    """Print the median of each tenth; what is wrong if the last one is larger than the second by more than is allowed."""
    tenths = [part.tolist() for part in np.array_split(bytes_, 10)]
    medians = [statistics.median(part) if part else 0.0 for part in tenths]
    print(f"  {name:9}", *(f"{m / 1e6:5.0f}" for m in medians), " MB")
    more = medians[-1] - medians[1]
    return [f"{name} grew by {more / 1e6:.0f} MB"] if more > allowed else []


def check(out: Path, sound: set[str], damaged: set[str]) -> list[str]:
    """What is wrong with a folder of results."""
    wrong = []
    last = {}
    for text in (out / "manifest.jsonl").read_text(encoding="utf-8").splitlines():
        line = json.loads(text)
        last[line["name"]] = line
    told = Counter("damaged" if name in damaged else "sound" for name in last)
    status = Counter(
        ((n in damaged and "damaged") or "sound", x["status"]) for n, x in last.items()
    )
    print(
        "  clips    ", ", ".join(f"{c} {kind} {what}" for (kind, what), c in sorted(status.items()))
    )
    lost = (sound | damaged) - set(last)
    wrong += [f"{len(lost)} lost: {sorted(lost)[:3]}"] if lost else []
    failed = [name for name in sound if name in last and last[name]["status"] != "done"]
    wrong += [f"{name}: {last[name]['reason']}" for name in failed]
    silent = [
        n for n in damaged if n in last and last[n]["status"] == "done" and not last[n]["notes"]
    ]
    print(f"  {len(silent)} of {told['damaged']} damaged clips are fitted without a note")
    known = {name: size for line in last.values() for name, size in line["files"].items()}
    wrong += [
        f"{name}: not as its line says"
        for name, size in known.items()
        if not (out / name).exists() or (out / name).stat().st_size != size
    ]
    there = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    wrong += [
        f"{name}: of no line"
        for name in there - set(known) - {"manifest.jsonl", "manifest.csv", "summary.csv"}
    ]
    return wrong


def main() -> None:
    clips = int(sys.argv[1]) if len(sys.argv) > 1 else CLIPS
    with tempfile.TemporaryDirectory(prefix="soak-") as name:
        data, out = Path(name) / "data", Path(name) / "out"
        data.mkdir()
        damaged = make(data, clips)
        found = {p.relative_to(data).with_suffix("").as_posix() for p in data.rglob("*.c3d")}
        size = sum(path.stat().st_size for path in data.rglob("*.c3d"))
        print(f"{clips} clips, {len(damaged)} damaged, {size / 1e6:.0f} MB; --jobs {JOBS}")
        call = [
            sys.executable, "-m", "mocap_skel", "batch", str(data), "--assoc", "cmu", "--jobs", str(JOBS),
            "-o", str(out), "--json",
        ]  # fmt: skip
        code, seconds, seen = watched(call, out)
        rate = clips / seconds
        print(
            f"  exit code {code}, {seconds:.0f} s, {rate:.2f} clips a second, {rate / JOBS:.2f} for each job"
        )
        wrong = check(out, found - damaged, damaged)
        # What is there before the first clip is done is the start of the program.
        begun = [row for row in seen if row[0]]
        wrong += grown("program", [row[1] for row in begun], GROWTH * clips)
        most = [row[2] for row in begun]
        wrong += grown("children", most, CHILDREN_GROWTH * statistics.median(most))
        code, seconds, _ = watched(call, out)
        print(f"  the same call again: exit code {code}, {seconds:.0f} s")
        wrong += check(out, found - damaged, damaged)
    print(*(wrong or ["nothing lost, every line true, memory flat"]), sep="\n")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()

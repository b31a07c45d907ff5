"""How much hangs on each number by which foot contacts are found (`mocap_skel/gait/contacts.py`).

    python benchmarks/gait.py [FOLDER]

Each number is made smaller (x 0.7) and larger (x 1.4) alone. A line says what becomes of the contacts that the numbers as
they are find: how many of them are lost, how many are new, and how far the others move; and how many are found where
nobody walks. The walks are generated ones (floor, treadmill, 50 to 250 Hz, slow, two marker sets, a small person) and, of
the folder of real clips, those whose files have foot events; nobody walks in the bundled clips and in other real ones.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from validation.folder import clips_in

from mocap_skel.artificial import Faults, human, marker_set, record
from mocap_skel.artificial.gait import gait
from mocap_skel.artificial.write import write_c3d
from mocap_skel.errors import MocapSkelError
from mocap_skel.events import Event
from mocap_skel.gait import contacts
from mocap_skel.pipeline.job import Job, fit_file
from mocap_skel.skeleton_fit import SkeletonFit

CLIPS = Path(os.environ.get("MOCAP_SKEL_CLIPS", Path(__file__).parents[2] / "shared" / "clips"))
SAMPLES = Path(__file__).parents[1] / "sample_data"
# Seconds and frames a second, marker set, treadmill, metres a second, metres of the subject.
WALKS = (
    (6.0, 100.0, "cmu", False, 1.2, 1.75), (6.0, 100.0, "cmu", True, 1.2, 1.75),
    (6.0, 50.0, "cmu", False, 1.2, 1.75), (5.0, 250.0, "cmu", True, 1.2, 1.75),
    (6.0, 100.0, "plug_in_gait", False, 1.2, 1.75), (6.0, 100.0, "cmu", False, 0.6, 1.75),
    (6.0, 100.0, "cmu", True, 0.9, 1.3),
)  # fmt: skip
NO_WALKS = ("range_of_motion", "nearly_still", "gaps", "two_dancers")
NUMBERS = (
    "LEAST_STEP", "LEAST_TURN", "SHORTEST", "LONGEST", "OTHER", "AVERAGED", "SMOOTH", "GAP", "BEFORE", "AFTER",
    "SHOWN", "MIDDLE", "MOSTLY", "SLOW", "LOW", "LOWEST",
)  # fmt: skip
PARTS = ("MOSTLY", "LOWEST")
FACTORS = (0.7, 1.4)
# Seconds: a contact of the same side and kind within it is the same one.
SAME = 0.2


def walks(folder: Path) -> Iterator[SkeletonFit]:
    """The generated walks."""
    for i, (seconds, rate, markers, treadmill, speed, stature) in enumerate(WALKS):
        walk = gait(seconds, rate, stature=stature, treadmill=treadmill, speed=speed)
        recording = record(
            human(stature), marker_set(markers), walk.motion, Faults(sigma=0.001), seed=i
        )
        path = folder / f"{i}.c3d"
        write_c3d(recording, path)
        yield from fits_of(path)


def fits_of(path: Path) -> list[SkeletonFit]:
    """The fits of a clip; none, and why, where it cannot be fitted."""
    try:
        return [fit for _, fit in fit_file(path, Job(None)).subjects]
    except MocapSkelError as error:
        print(error, file=sys.stderr)
        return []


def changed(name: str, factor: float) -> float | tuple[float, ...]:
    """A number of `contacts` made smaller or larger; parts of a stance or a clip from 0 to 1."""
    value: float | tuple[float, ...] = getattr(contacts, name)
    if isinstance(value, tuple):
        middle = sum(value) / len(value)
        return tuple(round(min(max(middle + factor * (v - middle), 0.0), 1.0), 6) for v in value)
    return round(min(value * factor, 1.0 if name in PARTS else np.inf), 6)


def compared(before: tuple[Event, ...], after: tuple[Event, ...]) -> tuple[int, int, list[float]]:
    """How many contacts are lost, how many are new, and how far the others moved, seconds."""
    moved = []
    left = list(after)
    for event in before:
        near = [e for e in left if (e.side, e.foot) == (event.side, event.foot)]
        best = min(near, key=lambda e: abs(e.time - event.time), default=None)
        if best is not None and abs(best.time - event.time) < SAME:
            moved.append(abs(best.time - event.time))
            left.remove(best)
    return len(before) - len(moved), len(left), moved


def main() -> None:
    from tempfile import TemporaryDirectory

    with TemporaryDirectory() as folder:
        walking = list(walks(Path(folder)))
    still = [fit for name in NO_WALKS for fit in fits_of(SAMPLES / f"{name}.c3d")]
    for path in clips_in(Path(sys.argv[1]) if len(sys.argv) > 1 else CLIPS):
        for fit in fits_of(path):
            (walking if contacts.find_contacts(fit).events else still).append(fit)
    base = [contacts.find_contacts(fit).events for fit in walking]
    count = sum(map(len, base))
    print(f"{len(walking)} walks with {count} contacts, {len(still)} clips in which nobody walks")
    print("number            value        lost   new  median  most ms  without walking")
    for name in NUMBERS:
        own = getattr(contacts, name)
        for factor, value in [(factor, changed(name, factor)) for factor in FACTORS]:
            setattr(contacts, name, value)
            lost, new, moved = 0, 0, []
            for fit, before in zip(walking, base, strict=True):
                one = compared(before, contacts.find_contacts(fit).events)
                lost, new, moved = lost + one[0], new + one[1], [*moved, *one[2]]
            false = sum(len(contacts.find_contacts(fit).events) for fit in still)
            shown = (
                f"{value:g}" if isinstance(value, float) else " to ".join(f"{v:g}" for v in value)
            )
            far = 1e3 * np.array(moved or [0.0])
            print(
                f"{name:12} x {factor:g}  {shown:14} {lost:4d}  {new:4d}  {np.median(far):6.0f}  {far.max():7.0f}  {false:15d}",
                flush=True,
            )
        setattr(contacts, name, own)


if __name__ == "__main__":
    main()

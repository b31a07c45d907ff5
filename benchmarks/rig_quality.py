"""How good the rigid figure is, on the bundled clips or on clips of your own.

    python benchmarks/rig_quality.py [CLIP.c3d ...]

One line a subject: milliseconds a frame for the rigid fit, root mean square of the markers with both kinds of rig, the fastest turn of a joint, frames
that had to be slowed, how far hinges stray from their axis, skating of standing soles (of their markers, free, locked), and how
far standing soles are from the floor.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

import numpy as np

from mocap_skel.errors import MocapSkelError
from mocap_skel.pipeline.job import Job, fit_file
from mocap_skel.rig.animation import Animation, Choice, animate
from mocap_skel.rig.blocks import apply
from mocap_skel.rig.bridging import steps
from mocap_skel.rig.feet import point_track, speed
from mocap_skel.rig.freedoms import Hinge
from mocap_skel.rig.model import model_of
from mocap_skel.rig.motion import RigidMotion, residuals, rigid_motion

ROOT = Path(__file__).parent.parent
HEAD = "clip  frames  ms/frame  rms mm markers/full  fastest deg/s  slowed  stray deg  skate mm/s marker/free/locked  floor mm"


def line(name: str, fit) -> str:
    start = perf_counter()
    motion = rigid_motion(model_of(fit), fit.rate)
    spent = perf_counter() - start
    free, locked = (animate(fit, Choice(smooth=0.0, lock=lock)) for lock in (False, True))
    fuller = animate(fit, Choice(smooth=0.0, even=False, full=True)).motion
    off = [off_markers(one) for one in (motion, fuller)]
    turns = [motion.poses.local(motion.model.bones, s) for s in range(len(motion.model.segments))]
    fastest = max(np.degrees(steps(turn).max()) * fit.rate for turn in turns)
    stray = [
        np.degrees(
            np.sqrt(
                np.mean(np.sum(np.cross(apply(turns[h.segment], h.below).T, h.above) ** 2, axis=1))
            )
        )
        for h in motion.model.freedoms
        if isinstance(h, Hinge)
    ]
    marker, unlocked, floor = soles(free, marked=True)
    _, held, _ = soles(locked)
    frames = motion.poses.frames
    return (
        f"{name}  {frames}  {1e3 * spent / frames:.2f}  {off[0]:.1f}/{off[1]:.1f}  {fastest:.0f}  "
        f"{int(motion.repaired.any(axis=0).sum())}  {max(stray, default=0.0):.1f}  "
        f"{marker:.0f}/{unlocked:.0f}/{held:.0f}  {floor:.1f}"
    )


def off_markers(motion: RigidMotion) -> float:
    """Root mean square distance of the markers from where the figure has them, mm."""
    away = np.concatenate([r.ravel() for r in residuals(motion.model, motion.poses)])
    return 1e3 * float(np.sqrt(np.nanmean(away**2)))


def soles(made: Animation, *, marked: bool = False) -> tuple[float, float, float]:
    """Median speeds of the soles' markers and of the soles while they stand, mm/s; mean distance from the floor, mm."""
    level = np.eye(3) - np.outer(made.vertical, made.vertical)
    model = made.motion.model
    found = []
    for sole in made.feet.soles:
        flags = np.zeros(made.motion.poses.frames, dtype=bool)
        for start, stop in sole.stands:
            flags[start + 1 : stop - 1] = True
        track = point_track(model.bones, made.motion.poses, sole.segment, sole.place)
        seen = model.points[sole.segment][:, model.markers[sole.segment].index(sole.marker)].T
        with np.errstate(invalid="ignore"):
            raw = np.nanmedian(speed(level @ seen, made.rate)[flags]) if marked else np.nan
        own = np.median(speed(level @ track, made.rate)[flags])
        off = np.abs(made.vertical @ track - made.feet.floor)[flags].mean()
        found.append((raw, own, off))
    return tuple(1e3 * np.mean(found, axis=0)) if found else (np.nan, np.nan, np.nan)


def main() -> None:
    print(HEAD)
    for path in sys.argv[1:] or sorted(map(str, (ROOT / "sample_data").glob("*.c3d"))):
        try:
            done = fit_file(Path(path), Job(None, prior="skeleton"))
        except MocapSkelError as error:
            print(f"{path}: {error}")
            continue
        for _, fit in done.subjects:
            print(line(f"{Path(path).stem} {fit.subject}".strip(), fit))


if __name__ == "__main__":
    main()

"""From what a file says to a `Clip`: every decision about what it means."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mocap_skel.clip import UPS, Clip
from mocap_skel.errors import CallError, ClipError
from mocap_skel.readers.events import events
from mocap_skel.readers.filled import FILLED, filled
from mocap_skel.readers.markers import UNLABELLED, doubles, markers, names_and_subjects, told_apart
from mocap_skel.readers.raw import FARTHEST, FASTEST, SLOWEST, RawClip
from mocap_skel.readers.repeated import REPEATED, repeated, sentences
from mocap_skel.readers.two_scales import second_scale
from mocap_skel.readers.units import SIGN_OF, scale
from mocap_skel.text import counted, listed, printable

# So many samples, or numbers, that cannot be coordinates are an oddity; more are damage.
_ODD = 2
# Frames beside such samples that are no better than they.
_NEAR = 2


def clean(
    raw: RawClip,
    name: str,
    unit: str | None,
    rate: float | None,
    salvage: bool = False,
    up: str | None = None,
) -> Clip:
    """Decide what a file holds; every decision that is not plain becomes a note.

    Args:
        raw: what a reader took out of it.
        name: the file's name.
        unit: the length unit, in place of what the file says.
        rate: frames a second, in place of what the file says.
        salvage: frames with coordinates that cannot be count as missing.
        up: what points up, in place of what the file says.

    Raises:
        ClipError: no points, no markers, or coordinates that cannot be; the message does not name the file.
        CallError: `unit` is no unit, `rate` out of its range, `up` no axis, or the file has no rate that may be;
            the last names the file.
    """
    frames, count = raw.points.shape[:2]
    if not frames or not count:
        raise ClipError(f"no points in it (points: {count}, frames: {frames})")
    # They name what is in the file.
    notes = [printable(note) for note in raw.notes]
    names, subjects = names_and_subjects(raw)
    keep, left_out = markers(names, subjects, raw)
    for reason, out in left_out.items():
        if reason == UNLABELLED:
            many = counted(len(out), "unlabelled trajectory is", "unlabelled trajectories are")
            notes.append(f"{many} set aside: {listed(out)}")
        else:
            notes.append(f"points that are no markers ({reason}): {len(out)}: {listed(out)}")
    if not len(keep):
        raise ClipError(f"no marker among its points, {count} of them")
    subjects = [subjects[i] for i in keep]
    names = [names[i] for i in keep]
    labels = told_apart(names, subjects, keep, notes)
    points = np.take(raw.points, keep, axis=1)
    points[_missing(points, raw, salvage, notes)] = np.nan
    hertz = _rate(raw, name, rate)
    whose = [f"{s}:{x}" if s else x for x, s in zip(labels, subjects, strict=True)]
    again = repeated(points, subjects, hertz)
    _leave_out(again, REPEATED, points, whose, raw.first_frame, notes)
    if not np.isfinite(points).any():
        raise ClipError("every marker is missing in every frame")
    points *= second_scale(points, unit, raw, notes)
    metres = scale(points, unit, raw, notes)
    measures = raw.measures
    if measures and len(set(subjects)) > 1:
        notes.append("the file has the measures of one person, and several in it: not used")
        measures = {}
    points *= metres
    fill = filled(points, subjects, hertz)
    _leave_out(fill, FILLED, points, whose, raw.first_frame, notes)
    upward, said_by = _up(raw, up, notes)
    zero = min(1, raw.first_frame) if raw.zero_frame is None else raw.zero_frame
    moments = events(raw.events, hertz, raw.first_frame, frames, notes)
    return Clip(
        name=name,
        points=points,
        labels=tuple(labels),
        subjects=tuple(subjects),
        rate=hertz,
        first_frame=raw.first_frame,
        unit=SIGN_OF[metres],
        up=upward,
        up_by=said_by,
        left_out=left_out,
        notes=tuple(notes),
        doubles=doubles(names, subjects),
        measures=measures,
        events=moments,
        zero_frame=zero,
    )


def _missing(
    points: NDArray[np.float64], raw: RawClip, salvage: bool, notes: list[str]
) -> NDArray[np.bool_]:
    """(frames, markers): no number, exactly (0, 0, 0), or farther off than anything on Earth.

    Raises:
        ClipError: what is nowhere is damage.
    """
    # One coordinate at a time: numpy is slow at reducing an axis of three.
    x, y, z = (points[..., axis] for axis in range(3))
    zero = (x == 0) & (y == 0) & (z == 0)
    if zero.any():
        notes.append(f"samples at exactly (0, 0, 0) that count as missing: {int(zero.sum())}")
    missing = zero | ~(np.isfinite(x) & np.isfinite(y) & np.isfinite(z))
    far = ~missing & ((abs(x) > FARTHEST) | (abs(y) > FARTHEST) | (abs(z) > FARTHEST))
    if far.any():
        damaged = _damaged(points, far)
        if damaged.any():
            return np.asarray(missing | _refused(points, far, damaged, raw, salvage, notes))
        notes.append(f"samples farther off than {FARTHEST:.0e} that count as missing: {far.sum()}")
    return np.asarray(missing | far)


def _leave_out(
    out: NDArray[np.bool_] | None,
    kind: tuple[str, str],
    points: NDArray[np.float64],
    names: list[str],
    first_frame: int,
    notes: list[str],
) -> None:
    """Samples (frames, markers) that nobody measured become missing in (frames, markers, 3); a note says which."""
    if out is not None:
        seen = int(np.isfinite(points[..., 0]).sum())
        notes += sentences(out, names, seen, first_frame, kind)
        points[out] = np.nan


def _damaged(points: NDArray[np.float64], far: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(frames,): those which hold what no program writes.

    A program that has one number for what it did not see writes the same everywhere, and a sample
    or two may be anything. Many different numbers that no coordinate can be are damage, and what
    stands among and right beside them is no better where it looks like a coordinate.
    """
    coordinates = points[far]
    values = np.unique(coordinates[np.abs(coordinates) > FARTHEST])
    frames = far.any(axis=1)
    if len(values) <= _ODD or far.sum() <= _ODD:
        return np.zeros(len(points), dtype=bool)
    near = np.convolve(frames, np.ones(2 * _NEAR + 1))[_NEAR:-_NEAR]
    return np.asarray(near > 0)


def _refused(
    points: NDArray[np.float64],
    far: NDArray[np.bool_],
    damaged: NDArray[np.bool_],
    raw: RawClip,
    salvage: bool,
    notes: list[str],
) -> NDArray[np.bool_]:
    """(frames, 1), the damaged frames, which count as missing where somebody asked for the rest.

    Raises:
        ClipError: nobody did, or nothing is left.
    """
    coordinates = points[far]
    worst = coordinates.flat[np.abs(coordinates).argmax()]
    at = np.flatnonzero(damaged) + raw.first_frame
    where = f"frame {at[0]}" if len(at) == 1 else f"{len(at)} frames from {at[0]} to {at[-1]}"
    what = f"damaged: coordinates such as {worst:.3g} in it, {where}"
    if not salvage or damaged.all():
        hint = None if damaged.all() else "--salvage reads the other frames"
        raise ClipError(what, hint)
    notes.append(f"{what}, where every marker counts as missing")
    return damaged[:, None]


def _rate(raw: RawClip, name: str, rate: float | None) -> float:
    if rate is not None:
        if not 0.01 <= rate <= 1e5:
            raise CallError(f"a frame rate is a number from 0.01 to 100000, not {rate:g}")
        return rate
    found = raw.rate
    if not (np.isfinite(found) and found > 0):
        raise CallError(f"{name}: no frame rate in it", "give it with --rate")
    if not SLOWEST <= found <= FASTEST:
        raise CallError(
            f"{name}: its frame rate is {found:g} Hz, which no recording has",
            "give the right one with --rate",
        )
    return float(found)


def _up(raw: RawClip, stated: str | None, notes: list[str]) -> tuple[str, str]:
    """The vertical axis, and who says so: what is stated, or what the file says, otherwise that of its format.

    Raises:
        CallError: what is stated is no axis.
    """
    if stated is not None:
        if stated not in UPS:
            raise CallError(f"what points up is one of {', '.join(UPS)}, not {stated!r}")
        return stated, "call"
    said = raw.up
    sign, axis = said[:-1], said[-1:].lower()
    known = axis in ("x", "y", "z") and sign in ("", "+", "-")
    up = axis if known else raw.usual_up
    # C3D files that write -Z there hold heads above feet all the same.
    if said and (not known or sign == "-"):
        notes.append(f"{raw.up_name} is {said!r}: {up} is taken to point up")
    return up, "file" if known else ""

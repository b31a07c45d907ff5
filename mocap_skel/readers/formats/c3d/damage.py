"""Damage among the points of a file that says nothing wrong of itself: a tail of zeros, lost bytes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mocap_skel.errors import ClipError
from mocap_skel.readers.formats.c3d.contents import Contents
from mocap_skel.readers.formats.c3d.shifts import shifted_at
from mocap_skel.readers.formats.c3d.survey import Survey

# Blank frames at the end that no one has to explain: so many, or such a part of all.
_FEW, _PART = 10, 0.02
_CHUNK = 1 << 24


def checked(raw: Contents, found: Survey, salvage: bool) -> Contents:
    """The clip, or what there is of it before the damage.

    Raises:
        ClipError: there is damage, and nobody asked for what is before it.
    """
    frames = min(len(raw.points), found.layout.frames)
    blank = _blank_from(found, frames)
    if frames - blank > max(_FEW, _PART * frames):
        said = f"nothing but zeros from frame {raw.first_frame + blank} on"
        if not blank or _writes_zeros(found, blank):
            raw = replace(raw, notes=(*raw.notes, f"{said}: is the file cut off there?"))
        else:
            # The last frame before them may be cut in the middle of a point.
            raw = _before(raw, blank - 1, f"{said}, as in a file that is cut off", salvage)
    with np.errstate(invalid="ignore"):
        at = shifted_at(found, min(blank, len(raw.points)))
    if at is None:
        return raw
    if not at:
        raise ClipError("damaged: bytes are lost or inserted before its second frame")
    why = f"damaged: bytes are lost or inserted at frame {raw.first_frame + at}"
    return _before(
        raw, at, f"{why}, from where on the points stand in each other's places", salvage
    )


def _before(raw: Contents, at: int, what: str, salvage: bool) -> Contents:
    """The frames before `at`."""
    if not salvage or not at:
        hint = f"--salvage reads the {at} frames before" if at else None
        raise ClipError(what, hint)
    note = f"{what}: the {at} frames before are read"
    return replace(
        raw,
        points=raw.points[:at],
        invalid=raw.invalid[:at],
        notes=(*raw.notes, note),
    )


def _blank_from(found: Survey, frames: int) -> int:
    """The frame from which on all is zero, points, residuals and analog values; `frames` if none."""
    step, end = 1, frames
    while end:
        start = max(0, end - step)
        used = np.flatnonzero(found.raw(start, end - start).any(axis=1))
        if len(used):
            return start + int(used[-1]) + 1
        step, end = min(2 * step, 1 + _CHUNK // found.layout.stride), start
    return 0


def _writes_zeros(found: Survey, blank: int) -> bool:
    """Whether zeros are how this file says that it did not see a point: then they tell nothing.

    Analog channels that are alive and stop with the points tell all the same; the last frame
    before the blank ones may be cut itself.
    """
    layout = found.layout
    count = min(blank - 1, max(1, _CHUNK // layout.stride))
    if count < 1:
        return False
    frames = found.raw(blank - 1 - count, count)
    points = 4 * layout.points * layout.width
    if frames[:, points:].any(axis=1).mean() > 0.5:
        return False
    return not frames[:, :points].reshape(count, layout.points, -1).any(axis=2).all()

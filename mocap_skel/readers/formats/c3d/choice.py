"""Which library reads a C3D file: ezc3d where it reads it right, otherwise py-c3d or numpy.

Every check comes before native code runs, and a second reader stands behind the first.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from mocap_skel.errors import ClipError
from mocap_skel.readers.formats.c3d.contents import Contents
from mocap_skel.readers.formats.c3d.damage import checked
from mocap_skel.readers.formats.c3d.events import events_of
from mocap_skel.readers.formats.c3d.layout import relative_step
from mocap_skel.readers.formats.c3d.section import BLOCK
from mocap_skel.readers.formats.c3d.survey import Survey, survey


def read_contents(path: Path, salvage: bool) -> Contents:
    """Read a file with the first library that reads it right.

    Args:
        path: the file.
        salvage: read the whole frames that a file holds which is cut off or damaged.

    Raises:
        ClipError: none does, it is cut off or damaged, or holds no point; the message does not name it.
        OSError: it cannot be opened.
    """
    found = survey(path)
    if not found.layout.points and found.rotations:
        raise ClipError(
            "it holds rotations of segments and no markers", "export the markers' places as well"
        )
    if not found.layout.points:
        raise ClipError(f"no points in it (points: 0, frames: {found.layout.declared})")
    # ezc3d has no way to read them.
    mips = ("MIPS numbers",) if found.section.machine == "MIPS" else ()
    reasons = (*_cut_off(found, salvage), *mips, *found.doubts, *found.contradictions)
    raw = _without_ezc3d(path, "; ".join(reasons)) if reasons else _with_ezc3d(path, found)
    raw = checked(raw, found, salvage)
    person = {"PROCESSING": found.section.groups.get("PROCESSING", {})}
    moments, about_them = events_of(found)
    raw = replace(
        raw,
        notes=(*raw.notes, *found.remarks(), *about_them),
        parameters={**raw.parameters, **person},
        events=moments,
        rescale=found.rescale,
        scale_names=found.scale_names,
    )
    if found.layout.tail < found.layout.stride + BLOCK:
        return raw
    note = f"the file goes on after the {found.layout.declared} frames that it says it has"
    return replace(raw, notes=(*raw.notes, note))


def _cut_off(found: Survey, salvage: bool) -> tuple[str, ...]:
    """What to say of a file that ends before the frames that it says it has.

    Raises:
        ClipError: there is such a thing, and nobody asked for what is left.
    """
    said, whole = found.layout.declared, found.layout.room
    if whole >= said:
        return ()
    what = f"cut off: it says {said} frames and ends after {whole} whole ones"
    if not salvage or not whole:
        raise ClipError(what, "--salvage reads those" if whole else None)
    return (f"{what}, which are read",)


def _without_ezc3d(path: Path, why: str) -> Contents:
    """The second reader's clip."""
    from mocap_skel.readers.formats.c3d import with_c3d

    try:
        raw = with_c3d.read(path)
    except ClipError as refusal:
        raise ClipError(f"{why}; {refusal}") from refusal
    return replace(raw, notes=(f"{why}; read with {raw.reader}", *raw.notes))


def _with_ezc3d(path: Path, found: Survey) -> Contents:
    """The first reader's clip, or the second's where the first refuses, is short, or misreads."""
    from mocap_skel.readers.formats.c3d import with_ezc3d

    try:
        raw = with_ezc3d.read(path, found)
    except ClipError as refusal:
        return _without_ezc3d(path, str(refusal))
    if raw.invalid.size and raw.invalid.all():
        return _without_ezc3d(path, "no residual is above zero")
    if raw.length > len(raw.points):
        return _short(raw, path)
    return raw if _agrees(raw, found) else _smoother(raw, path)


def _short(raw: Contents, path: Path) -> Contents:
    """The second reader's clip where it is longer than the first's."""
    from mocap_skel.readers.formats.c3d import with_c3d

    try:
        whole = with_c3d.read(path)
    except ClipError as refusal:
        lost = f"only {len(raw.points)} of the file's {raw.length} frames are read: {refusal}"
        return replace(raw, notes=(*raw.notes, lost))
    if len(whole.points) <= len(raw.points):
        return raw
    note = (
        f"ezc3d reads {len(raw.points)} of its {len(whole.points)} frames; read with {whole.reader}"
    )
    return replace(whole, notes=(note, *whole.notes))


def _agrees(raw: Contents, found: Survey) -> bool:
    """Whether a few frames are what stands in the file: ezc3d takes some files for others."""
    count, points = raw.points.shape[:2]
    if points != found.layout.points:
        return False
    for at in {0, count // 2, count - 1} if count else ():
        with np.errstate(invalid="ignore"):
            there = found.read(at, 1)[0, :, :3].astype(np.float64)
        if found.layout.width == 2:
            there = there * found.scale
        seen = ~raw.invalid[at] & np.isfinite(there).all(axis=1)
        # ezc3d calculates with 32 bits.
        if not np.allclose(raw.points[at][seen], there[seen], rtol=1e-5, atol=0):
            return False
    return True


def _smoother(raw: Contents, path: Path) -> Contents:
    """Of two readers that do not agree, the one whose points move less from frame to frame."""
    from mocap_skel.readers.formats.c3d import with_c3d

    try:
        other = with_c3d.read(path)
    except ClipError:
        return raw
    far, near = (relative_step(one.points[:-1], one.points[1:]) for one in (raw, other))
    if far < near:
        return raw
    note = f"ezc3d takes it for something else: its points jump; read with {other.reader}"
    return replace(other, notes=(note, *other.notes))

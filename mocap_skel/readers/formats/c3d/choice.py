"""How a C3D file is read: what is sound as the survey found it, the rest with py-c3d's parameters."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from mocap_skel.errors import ClipError
from mocap_skel.readers.formats.c3d.contents import Contents
from mocap_skel.readers.formats.c3d.damage import checked
from mocap_skel.readers.formats.c3d.events import events_of
from mocap_skel.readers.formats.c3d.points import contents
from mocap_skel.readers.formats.c3d.section import BLOCK
from mocap_skel.readers.formats.c3d.survey import Survey, survey


def read_contents(path: Path, salvage: bool) -> Contents:
    """Read a file.

    Args:
        path: the file.
        salvage: read the whole frames that a file holds which is cut off or damaged.

    Raises:
        ClipError: it is cut off or damaged, or holds no point; the message does not name it.
        OSError: it cannot be opened.
    """
    found = survey(path)
    if not found.layout.points and found.rotations:
        raise ClipError(
            "it holds rotations of segments and no markers", "export the markers' places as well"
        )
    if not found.layout.points:
        raise ClipError(f"no points in it (points: 0, frames: {found.layout.declared})")
    reasons = (*_cut_off(found, salvage), *found.doubts, *found.contradictions)
    raw = _with_c3d(path, found, "; ".join(reasons)) if reasons else contents(found)
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


def _with_c3d(path: Path, found: Survey, why: str) -> Contents:
    """A file that is not sound; the note says why it is not."""
    from mocap_skel.readers.formats.c3d import with_c3d

    raw = with_c3d.read(path, found)
    return replace(raw, notes=(f"{why}; read with {raw.reader}", *raw.notes))

"""C3D in, `Clip` out. All reading goes through one door, `read_clip`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from mocap_skel.clip import Clip
from mocap_skel.errors import ClipError
from mocap_skel.readers.clean import clean
from mocap_skel.readers.raw import RawClip

__all__ = ["read_clip"]

# A C3D file starts with a block of 512 bytes whose second byte is 0x50.
_BLOCK, _KEY = 512, 0x50


def read_clip(path: str | Path, *, unit: str | None = None, rate: float | None = None) -> Clip:
    """Read a C3D file.

    Args:
        path: the file.
        unit: the file's length unit (mm, cm, dm, m, in, ft), in place of what it says.
        rate: frames a second, in place of what the file says.

    Raises:
        ClipError: the file cannot be read or holds no marker.
        CallError: `unit` is no length unit, or `rate` not above zero.
    """
    return clean(_read_raw(Path(path)), unit, rate)


def _read_raw(path: Path) -> RawClip:
    """The door for every check before native code runs, and for the second reader behind the first."""
    try:
        with path.open("rb") as file:
            head = file.read(_BLOCK)
    except OSError as error:
        raise ClipError(f"{path}: {error.strerror or error}") from error
    if len(head) < _BLOCK or head[1] != _KEY:
        raise ClipError(f"{path}: not a C3D file" if head else f"{path}: an empty file")
    from mocap_skel.readers import with_ezc3d

    try:
        raw = with_ezc3d.read(path)
    except ClipError as refusal:
        return _refused(path, refusal)
    return _short(path, raw) if raw.length > len(raw.points) else raw


def _refused(path: Path, refusal: ClipError) -> RawClip:
    """The second reader's clip in place of the first's refusal."""
    from mocap_skel.readers import with_c3d

    try:
        raw = with_c3d.read(path)
    except ClipError as second:
        raise ClipError(f"{path}: {refusal}; {second}") from refusal
    return replace(raw, notes=(f"{refusal}; read with py-c3d", *raw.notes))


def _short(path: Path, raw: RawClip) -> RawClip:
    """The second reader's clip where it is longer than the first's."""
    from mocap_skel.readers import with_c3d

    try:
        whole = with_c3d.read(path)
    except ClipError as refusal:
        lost = f"only {len(raw.points)} of the file's {raw.length} frames are read: {refusal}"
        return replace(raw, notes=(*raw.notes, lost))
    if len(whole.points) <= len(raw.points):
        return raw
    note = f"ezc3d reads {len(raw.points)} of its {len(whole.points)} frames; read with py-c3d"
    return replace(whole, notes=(note, *whole.notes))

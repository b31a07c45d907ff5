"""Plain tables with columns label_x, label_y, label_z: how they are known."""

from __future__ import annotations

from pathlib import Path

from mocap_skel.readers.raw import RawClip
from mocap_skel.readers.registry import register
from mocap_skel.readers.tables.beginning import beginning


def is_plain(head: bytes) -> bool | None:
    """Whether a file is a table with columns of x, y and z, by its first bytes; None if it does not seem so."""
    lines = beginning(head)
    if not lines:
        return None
    from mocap_skel.readers.tables.plain import has_markers

    return has_markers(lines) or None


@register("plain table", suffixes=(".csv", ".tsv", ".txt"), sniff=is_plain, salvages=True)
def read(path: Path, salvage: bool = False) -> RawClip:
    """Read a plain table.

    Args:
        path: the file.
        salvage: read the frames that are whole.

    Raises:
        ClipError: its columns or a row cannot be read; the message does not name the file.
        OSError: it cannot be opened.
    """
    # Only here, because every call imports this module to know its kind of file.
    from mocap_skel.readers.tables.plain import read_plain

    return read_plain(path, salvage)

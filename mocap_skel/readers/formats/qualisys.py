"""TSV files of Qualisys Track Manager: how they are known."""

from __future__ import annotations

from pathlib import Path

from mocap_skel.readers.raw import RawClip
from mocap_skel.readers.registry import register
from mocap_skel.readers.tables.beginning import beginning

_FIRST = ("NO_OF_FRAMES", "FILE_VERSION", "NO_OF_CAMERAS", "NO_OF_MARKERS")


def is_qualisys(head: bytes) -> bool | None:
    """Whether a file is a TSV of Qualisys Track Manager, by its first bytes."""
    first = next(iter(beginning(head)), "")
    return first.startswith(_FIRST)


@register("QTM TSV", suffixes=(".tsv",), sniff=is_qualisys, salvages=True)
def read(path: Path, salvage: bool = False) -> RawClip:
    """Read a TSV file of Qualisys Track Manager.

    Args:
        path: the file.
        salvage: read the frames that are whole.

    Raises:
        ClipError: its header or a row cannot be read, or it has no markers; the message does not name the file.
        OSError: it cannot be opened.
    """
    # Only here, because every call imports this module to know its kind of file.
    from mocap_skel.readers.tables.qualisys import read_qualisys

    return read_qualisys(path, salvage)

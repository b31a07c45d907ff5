"""CSV files of Motive (OptiTrack): how they are known."""

from __future__ import annotations

from pathlib import Path

from mocap_skel.readers.raw import RawClip
from mocap_skel.readers.registry import register
from mocap_skel.readers.tables.beginning import beginning


def is_motive(head: bytes) -> bool | None:
    """Whether a file is a CSV of Motive, by its first bytes."""
    first = next(iter(beginning(head)), "")
    return first.lstrip('"').lower().startswith("format version")


@register("Motive CSV", suffixes=(".csv",), sniff=is_motive, salvages=True)
def read(path: Path, salvage: bool = False) -> RawClip:
    """Read a CSV file of Motive.

    Args:
        path: the file.
        salvage: read the frames that are whole.

    Raises:
        ClipError: its header or a row cannot be read, or it has no markers; the message does not name the file.
        OSError: it cannot be opened.
    """
    # Only here, because every call imports this module to know its kind of file.
    from mocap_skel.readers.tables.motive import read_motive

    return read_motive(path, salvage)

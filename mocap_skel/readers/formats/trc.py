"""TRC files, the markers of OpenSim and Cortex: how they are known."""

from __future__ import annotations

from pathlib import Path

from mocap_skel.readers.raw import RawClip
from mocap_skel.readers.registry import register
from mocap_skel.readers.tables.beginning import beginning


def is_trc(head: bytes) -> bool | None:
    """Whether a file is TRC, by its first bytes."""
    first = next(iter(beginning(head)), "")
    return first.lstrip('"').lower().startswith("pathfiletype")


@register("TRC", suffixes=(".trc",), sniff=is_trc, salvages=True)
def read(path: Path, salvage: bool = False) -> RawClip:
    """Read a TRC file.

    Args:
        path: the file.
        salvage: read the frames that are whole.

    Raises:
        ClipError: its header or a row cannot be read; the message does not name the file.
        OSError: it cannot be opened.
    """
    # Only here, because every call imports this module to know its kind of file.
    from mocap_skel.readers.tables.trc import read_trc

    return read_trc(path, salvage)

"""CSV files of Vicon Nexus: how they are known."""

from __future__ import annotations

from pathlib import Path

from mocap_skel.readers.raw import RawClip
from mocap_skel.readers.registry import register
from mocap_skel.readers.tables.beginning import NEXUS_TITLES, beginning


def is_nexus(head: bytes) -> bool | None:
    r"""Whether a file is an ASCII export of Vicon Nexus, by its first bytes: the title of a block alone in a line.

    >>> is_nexus(b"Trajectories\n100\n"), is_nexus(b"LASI_x,LASI_y,LASI_z\n")
    (True, False)
    """
    found = (line.rstrip(",;\t ").strip('" ').lower() for line in beginning(head))
    return any(title in NEXUS_TITLES for title in found)


@register("Nexus CSV", suffixes=(".csv", ".txt"), sniff=is_nexus, salvages=True)
def read(path: Path, salvage: bool = False) -> RawClip:
    """Read an ASCII export of Vicon Nexus.

    Args:
        path: the file.
        salvage: read the frames that are whole.

    Raises:
        ClipError: its header or a row cannot be read, or it has no trajectories; the message does not name the file.
        OSError: it cannot be opened.
    """
    # Only here, because every call imports this module to know its kind of file.
    from mocap_skel.readers.tables.nexus import read_nexus

    return read_nexus(path, salvage)

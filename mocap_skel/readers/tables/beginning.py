"""The first lines of a file by its first bytes. Every file is looked at: nothing large is imported here."""

from __future__ import annotations

BOMS = ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))
"""How texts begin that say their encoding, and what it is called."""
NEXUS_TITLES = (
    "trajectories", "model outputs", "devices", "joints", "segments", "events", "analog",
)  # fmt: skip
"""With what a block of an ASCII export of Vicon Nexus begins, in small letters; any of them may be the first."""


def beginning(head: bytes) -> list[str]:
    """The first lines of a file by its first bytes, for a sniff; none of a file that is no text."""
    encoding = next((name for bom, name in BOMS if head.startswith(bom)), "")
    if not encoding and b"\0" in head[:1024]:
        return []
    return head.decode(encoding or "utf-8", "replace").lstrip("\n\r\t ").splitlines()

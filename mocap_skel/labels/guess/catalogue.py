"""Lists for people: the shipped association files with what they are for, and the standard markers."""

from __future__ import annotations

import tomllib
from pathlib import Path

from mocap_skel.errors import AssociationError
from mocap_skel.figure.skeleton import STANDARD, shipped_skeletons
from mocap_skel.labels.association import SHIPPED
from mocap_skel.text import read_text

_TABLE_1 = Path(__file__).parent / "table1.toml"


def shipped_associations() -> dict[str, str]:
    """The shipped association files: name → what the comment at the head of the file says.

    >>> shipped_associations()["plug_in_gait"]
    'Vicon Plug-in Gait, full body, with the common variants of its forearm and back markers.'
    """
    found = {}
    for path in sorted(SHIPPED.glob("*.txt")):
        said = []
        for line in read_text(path, AssociationError).splitlines():
            if not line.startswith("#"):
                break
            words = line.lstrip("#").strip()
            if words.startswith("LABEL"):
                break
            said.append(words)
        found[path.stem] = " ".join(said)
    return found


def standard_markers() -> list[dict[str, str]]:
    """The markers of the standard human, each with its segment and its place there (thesis, Table 1).

    >>> standard_markers()[0]
    {'marker': 'RFWT', 'segment': 'Hips', 'location': 'anterior right top'}
    """
    places = tomllib.loads(_TABLE_1.read_text(encoding="utf-8"))["location"]
    return [
        {"marker": marker, "segment": segment, "location": places.get(marker, "")}
        for marker, segment in shipped_skeletons()[STANDARD].segment_of.items()
    ]

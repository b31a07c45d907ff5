"""The shipped association files with what they are for, and the standard markers."""

from __future__ import annotations

import tomllib
from pathlib import Path

from mocap_skel.errors import AssociationError
from mocap_skel.figure.skeleton import STANDARD, read_skeleton
from mocap_skel.labels.association import SHIPPED
from mocap_skel.text import read_text

_TABLE_1 = Path(__file__).parent / "table1.toml"


def shipped_associations() -> dict[str, str]:
    """Name → what the file's head comment says, without the line that names the columns."""
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
    """The markers of the standard human with segment and place on it, as the thesis's Table 1 has them."""
    places = tomllib.loads(_TABLE_1.read_text(encoding="utf-8"))["location"]
    return [
        {"marker": marker, "segment": segment, "location": places.get(marker, "")}
        for marker, segment in read_skeleton(STANDARD).segment_of.items()
    ]

"""CSV files of Motive (OptiTrack): markers among rigid bodies, bones, rotations and qualities.

Format: OptiTrack documentation, Data Export: CSV; versions 1.2 to 1.25 of the format. A line of settings stands first, then
rows that say of each column its type, name, ID, parent and property, then the axes, then a row a frame. Motive's y is up.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mocap_skel.errors import ClipError
from mocap_skel.readers.raw import RawClip
from mocap_skel.readers.tables.layout import Layout
from mocap_skel.readers.tables.raw_table import raw_table
from mocap_skel.readers.tables.source import (
    cells,
    delimiter_of,
    number,
    read_text,
    shown,
)
from mocap_skel.text import listed

_HEAD = 40
_ROWS = ("type", "name", "id", "parent")
_TYPES = ("marker", "rigid body", "bone", "skeleton", "trained markerset")


@dataclass(frozen=True)
class _Columns:
    """The x, y, z of one trajectory.

    Attributes:
        kind: its type in small letters: "marker", "rigid body marker", "bone".
        name: as the file has it.
        places: of x, y and z, from 0.
    """

    kind: str
    name: str
    places: tuple[int, int, int]

    @property
    def body(self) -> str:
        """The rigid body or skeleton that it belongs to, "" for none."""
        return self.name.rpartition(":")[0]


def read_motive(path: Path, salvage: bool) -> RawClip:
    """Read a CSV file of Motive.

    Args:
        path: the file.
        salvage: read the frames that are whole.

    Raises:
        ClipError: its header or a row cannot be read, or it has no markers; the message does not name the file.
        OSError: it cannot be opened.
    """
    text = read_text(path)
    lines = text.head(_HEAD)
    delimiter = delimiter_of(next(line for line in lines if line.strip()))
    table = [cells(line, delimiter) for line in lines]
    at = next((i for i, row in enumerate(table) if row and row[0].lower() == "frame"), None)
    if at is None:
        raise ClipError("no line of columns in its header, which begins with Frame")
    said, told = _header(table[:at])
    found = list(_trajectories(told, table[at - 1], table[at]))
    taken, notes = _measured(found)
    if not taken:
        kinds = sorted({kind for kind in (kind.strip() for kind in told["type"]) if kind})
        raise ClipError(
            f"no markers in it, only {listed(map(shown, kinds)) or 'columns without a type'}",
            "export it from Motive with Markers switched on",
        )
    axes = [cell.lower() for cell in table[at]]
    layout = Layout(
        skip=at + 1,
        delimiter=delimiter,
        comma=False,
        columns=np.array([one.places for one in taken], dtype=np.int64),
        titles=[one.name for one in taken],
        frame=0,
        time=next((i for i, axis in enumerate(axes) if axis.startswith("time (")), None),
        header=max(len(row) for row in table[: at + 1]),
        said=int(number(said.get("total exported frames", ""))),
    )
    rate = number(said.get("export frame rate", "")) or number(said.get("capture frame rate", ""))
    return raw_table(
        text, layout, salvage,
        rate=rate, unit=said.get("length units", ""), usual_up="y", notes=tuple(notes),
    )  # fmt: skip


def _header(table: list[list[str]]) -> tuple[dict[str, str], dict[str, list[str]]]:
    """The settings, by names in small letters, and the rows that tell of the columns, by what they tell."""
    said: dict[str, str] = {}
    told: dict[str, list[str]] = {}
    for row in table:
        label = row[1].lower() if len(row) > 1 and not row[0] else ""
        kinds = {cell.lower() for cell in row[2:] if cell}
        # Old versions have no names for these rows: type, name and ID in this order.
        if label in _ROWS:
            told[label] = row
        elif row and row[0]:
            said.update({k.lower(): v for k, v in zip(row[::2], row[1::2], strict=False) if k})
        elif kinds and ("type" not in told and all(kind.startswith(_TYPES) for kind in kinds)):
            told["type"] = row
        elif kinds and "type" in told and "name" not in told:
            told["name"] = row
    if "type" not in told or "name" not in told:
        raise ClipError("no lines of types and names in its header")
    return said, told


def _trajectories(
    told: dict[str, list[str]], properties: list[str], axes: list[str]
) -> Iterable[_Columns]:
    """Everything with the property position, in the order of the columns.

    Raises:
        ClipError: a column of a position has no partners.
    """
    groups: dict[tuple[str, str, str], dict[str, list[int]]] = defaultdict(
        lambda: defaultdict(list)
    )
    ids = told.get("id", [])
    count = min(len(told["type"]), len(told["name"]), len(properties), len(axes))
    for i in range(1, count):
        axis = axes[i].lower()
        if properties[i].lower() == "position" and axis in ("x", "y", "z") and told["type"][i]:
            key = (told["type"][i].lower(), told["name"][i], ids[i] if i < len(ids) else "")
            groups[key][axis].append(i)
    found = []
    for (kind, name, _), by_axis in groups.items():
        lengths = {len(by_axis[axis]) for axis in "xyz"}
        if len(lengths) != 1:
            first = min(place for places in by_axis.values() for place in places)
            raise ClipError(
                f"column {first + 1}: {shown(name)} has no x, y and z beside each other"
            )
        of_axes = (by_axis[axis] for axis in "xyz")
        found += [_Columns(kind, name, (x, y, z)) for x, y, z in zip(*of_axes, strict=True)]
    return sorted(found, key=lambda one: one.places)


def _measured(found: list[_Columns]) -> tuple[list[_Columns], list[str]]:
    """The markers as they were seen, or where their body has them if nothing else is there; and notes."""
    seen = [one for one in found if one.kind == "marker"]
    # Motive numbers the two in different ways: that one marker of a body was measured tells it.
    bodies = {one.body for one in seen if one.body}
    placed = [one for one in found if one.kind != "marker" and one.kind.endswith("marker")]
    twins = [one for one in placed if one.body in bodies]
    alone = [one for one in placed if one.body not in bodies]
    notes = []
    if twins:
        notes.append(
            f"markers that stand twice in it, as measured and as Motive's rigid body or bone places them: "
            f"{len(twins)}; those measured are read"
        )
    if alone:
        which = listed(one.name for one in alone)
        notes.append(
            f"markers only as Motive's rigid body or bone places them: {len(alone)}: {which}"
        )
    taken = {one.places for one in (*seen, *alone)}
    return [one for one in found if one.places in taken], notes

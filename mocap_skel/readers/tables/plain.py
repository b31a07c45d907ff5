"""Plain tables: CSV with the columns label_x, label_y and label_z, a row a frame.

There is no such format by name; people make it with pandas, R, MATLAB or a spreadsheet. A column may say its unit
(`LKNE_x [mm]`), a row below the names may, or a column `unit`; frame and time may stand beside the coordinates.
"""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mocap_skel.errors import ClipError
from mocap_skel.readers.raw import RawClip
from mocap_skel.readers.tables.layout import Layout
from mocap_skel.readers.tables.raw_table import raw_table
from mocap_skel.readers.tables.source import (
    cells,
    delimiter_of,
    read_text,
    shown,
    unit_in,
)
from mocap_skel.readers.units import metres_in
from mocap_skel.text import counted, listed

_HEAD = 50
_BRACKETS = re.compile(r"\s*[\[(][^\])]*[\])]\s*")
_COLUMN = re.compile(r"(.*[^\s_.:-])([\s_.:-]*)([xyz])", re.IGNORECASE)
# A unit behind the axis: LKNE_x_mm.
_TAIL = re.compile(r"(.*[\s_.:-][xyz])[\s_.-]+([a-z]+)", re.IGNORECASE)
_FRAMES = re.compile(r"(frame|frames|field|sample)[\s_]*(#|no\.?|nr\.?|number|index|id)?", re.I)
_TIMES = re.compile(
    r"(t|time|times|timestamp|seconds)[\s_]*(s|sec|seconds?|ms|milliseconds?)?", re.I
)
_MILLI = ("ms", "millisecond", "milliseconds")
# What `mocap-skel fit` writes, and what its generator of clips does.
_OWN = (".skeleton.csv", ".joints.csv", ".angles.csv", ".truth.csv")
_EXPECTED = "a table of markers has columns such as LKNE_x, LKNE_y, LKNE_z"


@dataclass
class _Head:
    """What the names of the columns say.

    Attributes:
        labels: of the points, in the order of their first columns.
        columns: of each, the places of x, y and z.
        units: that the columns name.
        frame, time, unit: the places of these columns, None without.
        seconds: in a unit of the times.
        others: names of columns that are none of these.
    """

    labels: list[str] = field(default_factory=list)
    columns: list[tuple[int, int, int]] = field(default_factory=list)
    units: set[str] = field(default_factory=set)
    frame: int | None = None
    time: int | None = None
    unit: int | None = None
    seconds: float = 1.0
    others: list[str] = field(default_factory=list)


def has_markers(lines: list[str]) -> bool:
    """Whether the first line that is no comment names columns of x, y and z."""
    at = _names_at(lines[:_HEAD])
    if at is None:
        return False
    try:
        return bool(_head(cells(lines[at], delimiter_of(lines[at]))).columns)
    except ClipError:
        return False


def _names_at(lines: list[str]) -> int | None:
    """Which line has the names of the columns: the first that is neither blank nor a comment."""
    told = (i for i, x in enumerate(lines) if x.strip() and not x.startswith(("#", "%", "//")))
    return next(told, None)


def read_plain(path: Path, salvage: bool) -> RawClip:
    """Read a plain table.

    Args:
        path: the file.
        salvage: read the frames that are whole.

    Raises:
        ClipError: its columns or a row cannot be read; the message does not name the file.
        OSError: it cannot be opened.
    """
    if path.name.lower().endswith(_OWN):
        what = "it holds joints that mocap-skel found, no markers"
        raise ClipError(what, "give the file of the markers that they were found in")
    text = read_text(path)
    lines = text.head(_HEAD)
    at = _names_at(lines)
    if at is None:
        raise ClipError("no line of columns' names in it")
    delimiter = delimiter_of(lines[at])
    head = _head(cells(lines[at], delimiter))
    if not head.columns:
        first = [shown(name) for name in cells(lines[at], delimiter) if name][:4]
        raise ClipError(f"no columns of markers in line {at + 1}: {listed(first)} ...", _EXPECTED)
    below = cells(lines[at + 1], delimiter) if at + 1 < len(lines) else []
    row = _unit_row(below, head)
    units = {*head.units, *row} or _unit_column(below, head)
    if len({metres_in(unit) for unit in units}) > 1:
        raise ClipError(f"columns in different units: {listed(sorted(units))}", "give all in one")
    notes = []
    if head.others:
        many = counted(len(head.others), "column that is", "columns that are")
        notes.append(f"{many} no coordinates of a marker: {listed(head.others)}")
    layout = Layout(
        skip=at + (2 if row else 1),
        delimiter=delimiter,
        comma=False,
        columns=np.array(head.columns, dtype=np.int64),
        titles=head.labels,
        frame=head.frame,
        time=head.time,
        header=len(cells(lines[at], delimiter)),
    )
    return raw_table(
        text, layout, salvage,
        seconds=head.seconds, unit=next(iter(sorted(units)), ""), notes=tuple(notes),
    )  # fmt: skip


def _head(names: list[str]) -> _Head:
    """What the names of the columns say.

    Raises:
        ClipError: a marker lacks a coordinate.
    """
    head = _Head()
    found: dict[str, dict[str, list[int]]] = defaultdict(lambda: {"x": [], "y": [], "z": []})
    parted: set[str] = set()
    for place, name in enumerate(names):
        unit = unit_in(name)
        bare = _BRACKETS.sub(" ", name).strip() if unit or "[" in name or "(" in name else name
        if not unit and (tail := _TAIL.fullmatch(bare)) and metres_in(tail[2]) is not None:
            bare, unit = tail[1], tail[2]
        if _aside(head, place, name, bare):
            continue
        axis = _COLUMN.fullmatch(bare)
        if axis is None:
            head.others += [name] if name else []
            continue
        found[axis[1]][axis[3].lower()].append(place)
        if axis[2]:
            parted.add(axis[1])
        if unit:
            head.units.add(unit)
    points: list[tuple[tuple[int, int, int], str]] = []
    every = {name.lower() for name in names}
    for label, axes in found.items():
        counts = {len(places) for places in axes.values()}
        # Without a blank or the like before the axis they may be anything (Fx, Fy, Fz): taken if nothing has one. Four
        # of them are a rotation.
        loose = bool(parted) and label not in parted
        turned = any(f"{label}{mark}w".lower() in every for mark in ("", *"_. :-"))
        if len(counts) == 1 and not loose and not turned:
            points += [(xyz, label) for xyz in zip(axes["x"], axes["y"], axes["z"], strict=True)]
            continue
        if label in parted and sum(bool(places) for places in axes.values()) == 2:
            lacks = next(axis for axis, places in axes.items() if not places)
            raise ClipError(f"{shown(label)} has no column of {lacks}", _EXPECTED)
        head.others += [names[place] for places in axes.values() for place in places]
    for xyz, label in sorted(points):
        head.columns.append(xyz)
        head.labels.append(label)
    return head


def _aside(head: _Head, place: int, name: str, bare: str) -> bool:
    """Whether a column is that of the frames, the times or the unit, which it then becomes."""
    if head.frame is None and _FRAMES.fullmatch(bare):
        head.frame = place
        return True
    if head.unit is None and bare.lower() in ("unit", "units"):
        head.unit = place
        return True
    if head.time is None and (time := _TIMES.fullmatch(bare)):
        head.time = place
        inside = re.findall(r"[\[(]\s*(\w+)", name)
        head.seconds = 1e-3 if {*inside, (time[2] or "").lower()} & {*_MILLI} else 1.0
        return True
    return False


def _unit_row(below: list[str], head: _Head) -> set[str]:
    """The units in the row below the names; none where that is a row of numbers."""
    places = [place for xyz in head.columns for place in xyz]
    words = [below[place] if place < len(below) else "" for place in places]
    return {*words} if words and all(metres_in(word) is not None for word in words) else set()


def _unit_column(below: list[str], head: _Head) -> set[str]:
    """The unit in the first row of a column `unit`."""
    word = below[head.unit] if head.unit is not None and head.unit < len(below) else ""
    return {word} if metres_in(word) is not None else set()

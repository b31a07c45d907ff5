"""CSV and TXT files of Vicon Nexus (Export ASCII): trajectories among devices, joints and model outputs.

Format: such files of Nexus 1.8 to 2.16, as programs that read them describe it. A file has blocks with a blank line
between them, in any order. A block has its title, its frames a second, a line of names (`Ann:LASI` over x of each marker), a line
of axes that begins with Frame and Sub Frame, a line of units, and a row a frame; where velocities and accelerations were
asked for, X', Y', Z', X'' ... stand beside X, Y, Z. Vicon Workstation wrote the same with `TRAJECTORIES`, `120,Hz` and `Field #`.
The block of events has a line for each. Nexus's z is up.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from mocap_skel.errors import ClipError
from mocap_skel.readers.raw import RawClip, RawEvent
from mocap_skel.readers.tables.beginning import NEXUS_TITLES
from mocap_skel.readers.tables.layout import Layout
from mocap_skel.readers.tables.raw_table import raw_table
from mocap_skel.readers.tables.source import Text, cells, delimiter_of, number, read_text, shown
from mocap_skel.readers.units import metres_in
from mocap_skel.text import listed

# One of the titles alone in a line, or other words above a line that has a rate.
_END = rb'[ "]*[,;\t ]*$'
_TITLE = re.compile(
    rb'^[ \t"]*(?:(' + "|".join(NEXUS_TITLES).encode() + rb")" + _END
    + rb"|([a-z][a-z _-]*)" + _END + rb'(?=\n[ \t"]*\d+(?:[.,]\d+)?(?:,Hz)?' + _END + rb"))",
    re.IGNORECASE | re.MULTILINE,
)  # fmt: skip
_RATE = re.compile(r'[ \t"]*(\d+([.,]\d+)?)')
_TRAJECTORIES, _EVENTS = "trajectories", "events"
_FRAME = re.compile(r"(frame|field)\b.*", re.IGNORECASE)
# Lines between the title of a block and its first row, blank ones counted.
_HEAD = 12
# More events in one file are none.
_MOST_EVENTS = 10_000
_TIME = re.compile(r"\d+([.,]\d*)?")


def read_nexus(path: Path, salvage: bool) -> RawClip:
    """Read an ASCII export of Vicon Nexus.

    Args:
        path: the file.
        salvage: read the frames that are whole.

    Raises:
        ClipError: its header or a row cannot be read, or it has no trajectories; the message does not name the file.
        OSError: it cannot be opened.
    """
    text = read_text(path)
    blocks = list(_blocks(text.data))
    found = [(start, stop) for title, start, stop in blocks if title == _TRAJECTORIES]
    others = list(dict.fromkeys(t.capitalize() for t, _, _ in blocks if t != _TRAJECTORIES))
    if not found:
        raise ClipError(
            f"no block Trajectories in it, only {listed(others)}",
            "export it from Nexus with Trajectories switched on",
        )
    (start, stop), *more = found
    if more:
        line = text.data.count(b"\n", 0, more[0][0]) + 1
        raise ClipError(f"a second block Trajectories in line {line}", "give each as a file")
    # What stands before keeps its lines, so that messages count them.
    above = text.data.count(b"\n", 0, start)
    lines = Text(text.data[start:stop]).head(_HEAD)
    skip, layout, rate, unit = _header(lines, above)
    left = [title for title in others if title.lower() != _EVENTS]
    notes = [f"blocks that hold no markers, which are not read: {listed(left)}"] if left else []
    raw = raw_table(
        Text(text.data[:stop], text.notes), replace(layout, skip=above + skip), salvage,
        rate=rate, unit=unit, notes=tuple(notes),
    )  # fmt: skip
    events = [one for title, a, b in blocks if title == _EVENTS for one in _events(text.data[a:b])]
    return replace(raw, events=tuple(events))


def _blocks(data: bytes) -> Iterator[tuple[str, int, int]]:
    """Each block's title in small letters, and where it begins and ends."""
    found = list(_TITLE.finditer(data))
    ends = [one.start() for one in found[1:]] + [len(data)]
    for one, end in zip(found, ends, strict=True):
        yield (one[1] or one[2]).strip().decode().lower(), one.start(), end


def _header(lines: list[str], above: int) -> tuple[int, Layout, float, str]:
    """Lines before the first row of a block, where its numbers stand, its rate and its unit.

    Raises:
        ClipError: it cannot be read.
    """
    told = [i for i, line in enumerate(lines) if line.strip(" ,;\t")]
    at = next(
        (i for i in told if _FRAME.fullmatch(cells(lines[i], delimiter_of(lines[i]))[0])), None
    )
    # Title, rate and names stand before it.
    if at is None or told.index(at) < 2:
        raise ClipError(
            f"no line of axes below its Trajectories (line {above + 1}), which begins with Frame"
        )
    delimiter = delimiter_of(lines[at])
    axes = cells(lines[at], delimiter)
    before = told[: told.index(at)]
    names = cells(lines[before[-1]], delimiter) if len(before) > 2 else []
    said = _RATE.match(lines[before[1]])
    rate = number(said[1]) if said else 0.0
    columns, labels = _trajectories(names, axes, above + at + 1)
    below = cells(lines[at + 1], delimiter) if at + 1 < len(lines) else []
    words = [below[i] if i < len(below) else "" for xyz in columns for i in xyz]
    units = {word for word in words if word}
    has_units = bool(units) and all(metres_in(word) is not None for word in units)
    if has_units and len({metres_in(word) for word in units}) > 1:
        raise ClipError(f"trajectories in different units: {listed(sorted(units))}")
    skip = at + (2 if has_units else 1)
    layout = Layout(
        skip=skip,
        delimiter=delimiter,
        comma=False,
        columns=np.array(columns, dtype=np.int64).reshape(-1, 3),
        titles=labels,
        frame=0,
        header=max(len(axes), len(names)),
    )
    return skip, layout, rate, min(units) if has_units else ""


def _trajectories(
    names: list[str], axes: list[str], line: int
) -> tuple[list[tuple[int, int, int]], list[str]]:
    """The columns of x, y and z of each trajectory, and its name, "" for none.

    Raises:
        ClipError: there is none, or one lacks a coordinate.
    """
    names = names + [""] * (len(axes) - len(names))
    starts = [i for i, axis in enumerate(axes) if axis.upper() == "X"]
    if not starts:
        raise ClipError(f"line {line}: no columns X, Y, Z of trajectories")
    columns = []
    for start, stop in zip(starts, [*starts[1:], len(axes)], strict=True):
        places = [
            next((i for i in range(start, stop) if axes[i].upper() == axis), -1) for axis in "XYZ"
        ]
        if min(places) < 0:
            raise ClipError(f"line {line}: {shown(names[start]) or 'a trajectory'} lacks y or z")
        columns.append((places[0], places[1], places[2]))
    return columns, [names[start] for start in starts]


def _events(block: bytes) -> Iterator[RawEvent]:
    """The events of a block, whose columns are Subject, Context, Name, Time (s), Description."""
    lines = [line for line in Text(block).head(_MOST_EVENTS) if line.strip(" ,;\t")]
    heads = (i for i, line in enumerate(lines) if "context" in line.lower())
    at = next(heads, None)
    if at is None:
        return
    delimiter = delimiter_of(lines[at])
    titles = [cell.lower().split("(")[0].strip() for cell in cells(lines[at], delimiter)]
    for line in lines[at + 1 :]:
        row = dict(zip(titles, cells(line, delimiter), strict=False))
        if _TIME.fullmatch(row.get("time", "")) and row.get("name"):
            yield RawEvent(
                number(row["time"]), row["name"], row.get("context", ""), row.get("subject", "")
            )

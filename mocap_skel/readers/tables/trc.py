"""TRC files: track, row, column, the marker file of OpenSim and Cortex.

Format: OpenSim documentation, Marker (.trc) Files. Five lines stand before the rows: the kind of file, keys, their
values, the markers' names, the axes. OpenSim's models have y up, and other programs write TRC in the axes of the lab.
"""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np

from mocap_skel.errors import ClipError
from mocap_skel.readers.raw import RawClip
from mocap_skel.readers.tables.layout import Layout
from mocap_skel.readers.tables.raw_table import raw_table
from mocap_skel.readers.tables.source import cells, delimiter_of, number, read_text

# Lines in which the header has to be.
_HEAD = 30
_AXIS = re.compile(r"[xyz]\d*", re.IGNORECASE)
_EACH = re.compile(r"(.+)[ _.:-]([xyz])", re.IGNORECASE)
_FRAME = re.compile(r"frame ?#?", re.IGNORECASE)


def read_trc(path: Path, salvage: bool) -> RawClip:
    """Read a TRC file.

    Args:
        path: the file.
        salvage: read the frames that are whole.

    Raises:
        ClipError: its header or a row cannot be read; the message does not name the file.
        OSError: it cannot be opened.
    """
    text = read_text(path)
    lines = text.head(_HEAD)
    found = (i for i, line in enumerate(lines) if _FRAME.match(line.strip().strip('"')))
    at = next(found, None)
    if at is None:
        raise ClipError("no line of marker names in its header, which begins with Frame#")
    delimiter = delimiter_of(lines[at])
    said = _keys(lines[:at], delimiter)
    names = cells(lines[at], delimiter)[2:]
    # The axes stand in the next line, of a file that has them.
    axes = cells(lines[at + 1], delimiter) if at + 1 < len(lines) else []
    axes = [axis for axis in axes if axis]
    has_axes = bool(axes) and all(_AXIS.fullmatch(axis) for axis in axes)
    labels = _labels(names, len(axes) // 3 if has_axes else 0)
    notes = []
    claimed = int(number(said.get("nummarkers", "")))
    if claimed and claimed != len(labels):
        notes.append(f"NumMarkers is {claimed}, and {len(labels)} markers have columns")
    columns = 2 + np.arange(3 * len(labels), dtype=np.int64).reshape(-1, 3)
    layout = Layout(
        skip=at + (2 if has_axes else 1),
        delimiter=delimiter,
        comma=False,
        columns=columns,
        titles=labels,
        frame=0,
        time=1,
        said=int(number(said.get("numframes", ""))),
    )
    rate = number(said.get("datarate", "")) or number(said.get("camerarate", ""))
    return raw_table(
        text,
        layout,
        salvage,
        rate=rate,
        unit=said.get("units", ""),
        usual_up="y",
        notes=tuple(notes),
    )


def _keys(lines: list[str], delimiter: str) -> dict[str, str]:
    """The header's keys in small letters, with their values."""
    table = [cells(line, delimiter) for line in lines if line.strip()]
    for keys, values in pairwise(table):
        if any(key.lower() in ("datarate", "nummarkers", "units") for key in keys):
            return {key.lower(): value for key, value in zip(keys, values, strict=False) if key}
    return {}


def _labels(names: list[str], count: int) -> list[str]:
    """The markers' names, "" for one without, given how many markers the line of axes has (0: none).

    A name stands over its x, and the cells over y and z are empty; some programs leave those out.

    Raises:
        ClipError: names and axes do not fit together.
    """
    while names and not names[-1]:
        names = names[:-1]
    over_x = [names[i] for i in range(0, len(names), 3)]
    apart = not any(name for i, name in enumerate(names) if i % 3)
    if apart and (not count or len(over_x) <= count):
        return over_x + [""] * (count - len(over_x))
    given = [name for name in names if name]
    # Without the line of axes, some programs have a name for each coordinate: LKNE_x, LKNE_y, LKNE_z.
    each = [(one[1], one[2].lower()) for one in map(_EACH.fullmatch, given) if one]
    stems = [stem for stem, _ in each[::3]]
    if (
        stems
        and each == [(stem, axis) for stem in stems for axis in "xyz"]
        and len(each) == len(given)
    ):
        return stems
    if not count or len(given) == count:
        return given
    raise ClipError(f"{len(given)} marker names in its header, and axes of {count} markers")

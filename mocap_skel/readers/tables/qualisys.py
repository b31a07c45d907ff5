"""TSV files of Qualisys Track Manager.

Format: QTM documentation, Motion data (.tsv). Lines of a word and its values stand before the rows; a row has x, y, z of
each marker in mm, and before them the frame and its time if those were asked for. A line EVENT has the name of a moment,
its frame and its time. QTM's z is up unless told otherwise.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from mocap_skel.errors import ClipError
from mocap_skel.readers.raw import RawClip, RawEvent
from mocap_skel.readers.tables.layout import Layout
from mocap_skel.readers.tables.raw_table import raw_table
from mocap_skel.readers.tables.source import (
    cells,
    delimiter_of,
    number,
    read_text,
    shown,
)

_HEAD = 2000
_WORD = re.compile(r"[A-Z]+(_[A-Z0-9]+)+|FREQUENCY|DESCRIPTION|EVENT")
_NUMBER = re.compile(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?")


def read_qualisys(path: Path, salvage: bool) -> RawClip:
    """Read a TSV file of Qualisys Track Manager.

    Args:
        path: the file.
        salvage: read the frames that are whole.

    Raises:
        ClipError: its header or a row cannot be read, or it has no markers; the message does not name the file.
        OSError: it cannot be opened.
    """
    text = read_text(path)
    lines = text.head(_HEAD)
    delimiter = delimiter_of(next((line for line in lines if line.strip()), ""))
    said: dict[str, list[str]] = {}
    moments: list[list[str]] = []
    skip = 0
    for line in lines:
        word, *values = cells(line, delimiter) or [""]
        if line.strip() and not _WORD.fullmatch(word):
            break
        if word == "EVENT":
            moments.append(values)
        elif word:
            said[word] = values
        skip += 1
    kind = next(iter(said.get("DATA_INCLUDED", [])), "")
    if kind and kind.upper() != "3D":
        raise ClipError(f"it holds {shown(kind)} data, no markers", "export 3D data from QTM")
    labels = said.get("MARKER_NAMES", [])
    while labels and not labels[-1]:
        labels = labels[:-1]
    if not labels:
        raise ClipError("no line MARKER_NAMES in its header")
    # A line of columns' names may stand before the first row.
    titles = cells(lines[skip], delimiter) if skip < len(lines) else []
    if any(title and not _NUMBER.fullmatch(title) for title in titles[:1]):
        skip += 1
    else:
        titles = []
    rows = [cells(line, delimiter) for line in lines[skip:] if line.strip()]
    frame, time, first = _before(rows, titles, 3 * len(labels))
    claimed = int(_first_number(said, "NO_OF_MARKERS"))
    notes = []
    if claimed and claimed != len(labels):
        notes.append(f"NO_OF_MARKERS is {claimed}, and {len(labels)} markers have a name")
    events = tuple(_events(moments))
    if len(events) < len(moments):
        lost = len(moments) - len(events)
        notes.append(f"events that cannot be read: {lost} of {len(moments)}")
    layout = Layout(
        skip=skip,
        delimiter=delimiter,
        comma=False,
        columns=first + np.arange(3 * len(labels), dtype=np.int64).reshape(-1, 3),
        titles=labels,
        frame=frame,
        time=time,
        said=int(_first_number(said, "NO_OF_FRAMES")),
    )
    raw = raw_table(
        text, layout, salvage,
        rate=_first_number(said, "FREQUENCY"), unit="mm", notes=tuple(notes),
    )  # fmt: skip
    return replace(raw, events=events)


def _events(moments: list[list[str]]) -> Iterable[RawEvent]:
    """The events whose lines are whole: name, frame, time."""
    for moment in moments:
        if len(moment) > 2 and moment[0] and _NUMBER.fullmatch(moment[2]):
            yield RawEvent(number(moment[2]), moment[0])


def _first_number(said: dict[str, list[str]], word: str) -> float:
    return number(next(iter(said.get(word, [])), ""))


def _before(
    rows: list[list[str]], titles: list[str], coordinates: int
) -> tuple[int | None, int | None, int]:
    """The places of the frame and of its time in a row, None for none, and that of the first coordinate.

    Raises:
        ClipError: the rows have another number of cells.
    """
    words = [title.split()[0].lower() if title else "" for title in titles[:2]]
    if words:
        frame = words.index("frame") if "frame" in words else None
        time = words.index("time") if "time" in words else None
        return frame, time, (frame is not None) + (time is not None)
    # Rows that end early are seldom: most rows tell.
    widths = [len(row) for row in rows]
    usual = max(set(widths), key=widths.count, default=coordinates)
    rows = [row for row in rows if len(row) == usual]
    more = usual - coordinates
    counted = all(row[0].isdigit() for row in rows)
    if more and all(not row[-1] for row in rows) and not (counted and more == 1):
        # A tab ends every row, unless the last marker is never seen in a row that has its time.
        more -= more != 2 or not _even([row[1] for row in rows])
    if more == 0:
        return None, None, 0
    if more == 1:
        return (0, None, 1) if counted else (None, 0, 1)
    if more == 2:
        return 0, 1, 2
    raise ClipError(
        f"its rows have {usual} cells, and {coordinates // 3} markers need {coordinates}, with a frame and "
        f"a time {coordinates + 2}"
    )


def _even(texts: list[str]) -> bool:
    """Whether these are times: numbers that rise by even steps."""
    times = [number(text) for text in texts]
    steps = [b - a for a, b in pairwise(times)]
    return all(step > 0 and abs(step - steps[0]) < 0.5 * steps[0] for step in steps)

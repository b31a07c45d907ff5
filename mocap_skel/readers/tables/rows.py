"""The numbers of a table: read by pandas, and looked at where a row is not as it should be."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mocap_skel.errors import ClipError, reason
from mocap_skel.readers.tables.source import shown
from mocap_skel.text import counted

if TYPE_CHECKING:
    import pandas

Array = NDArray[np.float64]

MOST_POINTS = 20_000
"""Trajectories of a file; a C3D has at most 65,535."""
MOST_CELLS = 1 << 27
"""Coordinates of a file, 1 GB of memory."""
# Beside those that pandas knows (empty, NaN, NULL, N/A, #N/A, None ...).
_MISSING = ["-", "--", ".", "NAN", "Nan", "nan(ind)", "-nan(ind)", "nan(snan)", "1.#INF", "-1.#INF",
            "#DIV/0!", "#VALUE!", "none", "NONE", "missing", "Missing", "-NaN", "NULL", "Null"]  # fmt: skip
# What pandas takes for numbers, 1 and 0.
_TRUTHS = re.compile(rb"true|false", re.IGNORECASE)
_CHUNK = 4096
# Bytes at the end of a file that tell how its last column is written.
_TAIL = 1 << 16
_FIXED = re.compile(rb"[-+]?\d*[.,](\d+)")
SALVAGE = "--salvage reads the frames that are whole"


@dataclass(frozen=True)
class Layout:
    """Where the numbers of a table stand.

    Attributes:
        skip: lines before its first row.
        delimiter: what parts its cells, " " for any blanks.
        comma: whether numbers have a decimal comma.
        columns: (points, 3), the places of x, y and z of each point in a row, from 0.
        titles: what each of these columns is called, for messages: (points,), the point's name.
        frame: the place of the frame's number, None without.
        time: the place of its time, None without.
        header: cells of the header's lines, 0 for as many as are read.
        said: how many frames the header says there are, 0 where it does not.
    """

    skip: int
    delimiter: str
    comma: bool
    columns: NDArray[np.int64]
    titles: Sequence[str]
    frame: int | None = None
    time: int | None = None
    header: int = 0
    said: int = 0

    @property
    def width(self) -> int:
        """Cells of a row up to the last that is read."""
        aside = [place for place in (self.frame, self.time) if place is not None]
        return int(max([*self.columns.ravel().tolist(), *aside], default=-1)) + 1

    def column(self, place: int) -> str:
        """A column as messages call it."""
        points, axes = np.nonzero(self.columns == place)
        if not len(points):
            return f"column {place + 1}"
        title = shown(self.titles[points[0]])
        return f"column {place + 1} ({f'{title} ' if title else ''}{'xyz'[axes[0]]})"


@dataclass(frozen=True)
class Rows:
    """The rows of a table.

    Attributes:
        points: (rows, points, 3), NaN = missing.
        frames: (rows,) their numbers, NaN where a cell holds none; None without such a column.
        times: (rows,) likewise, in the file's unit.
        lines: (rows,) where they stand in the file, from 1.
        notes: what was decided about them.
    """

    points: Array
    frames: Array | None
    times: Array | None
    lines: NDArray[np.int64]
    notes: tuple[str, ...]


def read_rows(body: bytes, layout: Layout, salvage: bool) -> Rows:
    """Read the rows of a table.

    Args:
        body: the rows, without the header.
        layout: where the numbers stand in them.
        salvage: rows that are not whole count as missing, and one that is cut off is left out.

    Raises:
        ClipError: a cell is no number, a row has too few cells or too many, the last row is cut off, or there is
            too much of it; the message says where.
    """
    if len(layout.columns) > MOST_POINTS:
        raise ClipError(f"{len(layout.columns)} trajectories; more than {MOST_POINTS} are not read")
    notes: list[str] = []
    body, delimiter = _plain(body, layout.delimiter)
    if body.endswith(b"\n\n"):
        body = body.rstrip(b"\n") + b"\n"
    if (count := body.count(delimiter.encode()) + body.count(b"\n")) > MOST_CELLS:
        raise ClipError(f"a table of {count / 1e6:.0f} million cells", "cut it into several clips")
    whole, most = _whole_rows(body, delimiter, layout, salvage, notes)
    lines, body, broken = whole
    if len(lines) * max(layout.columns.size, most) > MOST_CELLS:
        raise ClipError(
            f"{len(lines)} rows of {most} cells: more than {MOST_CELLS / 1e6:.0f} million numbers",
            "cut it into several clips",
        )
    if not len(lines):
        return Rows(np.empty((0, len(layout.columns), 3)), None, None, lines, tuple(notes))
    values, aside, bad = _numbers(body, delimiter, most, layout, lines, salvage)
    broken |= bad
    if broken.any():
        at = lines[broken]
        many = counted(len(at), "row that is", "rows that are")
        notes.append(f"{many} not whole, first in line {at[0]}: every marker counts as missing")
    values[broken] = np.nan
    return Rows(
        points=values.reshape(-1, len(layout.columns), 3),
        frames=None if layout.frame is None else aside[layout.frame],
        times=None if layout.time is None else aside[layout.time],
        lines=lines,
        notes=tuple(notes),
    )


def _plain(body: bytes, delimiter: str) -> tuple[bytes, str]:
    """Rows whose cells are parted by one character and have no quotes."""
    if b'"' in body:
        point = delimiter == ","

        def bare(found: re.Match[bytes]) -> bytes:
            return found[1].replace(b",", b".") if point else found[1]

        body = re.sub(rb'"([^"\n]*)"', bare, body)
    if delimiter == " ":
        return b"\n".join(b"\t".join(line.split()) for line in body.split(b"\n")), "\t"
    return body, delimiter


def _whole_rows(
    body: bytes, delimiter: str, layout: Layout, salvage: bool, notes: list[str]
) -> tuple[tuple[NDArray[np.int64], bytes, NDArray[np.bool_]], int]:
    """The lines of the rows, the rows without a cut one, which are broken, and the most cells of one.

    Raises:
        ClipError: a row is cut off or has another number of cells, and nobody asked for the rest.
    """
    count, blank, spaced = _cells_a_line(
        body, delimiter, layout.frame is None and layout.time is None
    )
    at = np.flatnonzero(~blank)
    if len(at) and not body.endswith(b"\n") and not blank[-1]:
        why = _cut(body, delimiter, count, layout, len(at))
        if why:
            line, left = int(at[-1]) + layout.skip + 1, len(at) - 1
            what = f"cut off in line {line}, {why}: {counted(left, 'whole frame')} before it"
            if not salvage or not left:
                raise ClipError(what, SALVAGE if left else None)
            notes.append(f"{what}, which {'is' if left == 1 else 'are'} read")
            body = body[: body.rfind(b"\n") + 1]
            at, count, blank = at[:-1], count[:-1], blank[:-1]
    lines, count = at + layout.skip + 1, count[at]
    notes += _frames_said(layout.said, len(at))
    short = count < layout.width
    broken = short & ~_at_whole_points(count, layout)
    if broken.any() and not salvage:
        first = int(np.flatnonzero(broken)[0])
        raise ClipError(
            f"line {lines[first]}: {counted(int(count[first]), 'cell')} where the header has "
            f"{counted(layout.width, 'column')}",
            SALVAGE,
        )
    short &= ~broken
    if short.any():
        notes.append(
            f"{counted(int(short.sum()), 'row')} with fewer cells than the header has columns, first in "
            f"line {lines[short][0]}: what is not there counts as missing"
        )
    most = max(int(count.max(initial=0)), layout.width)
    if most > layout.width:
        broken |= _too_long(body, delimiter, at, lines, count, layout, salvage)
    # Blank lines go, so that a row of the table is an entry of `lines`.
    if blank.any():
        if not spaced:
            body = re.sub(rb"\n{2,}", b"\n", body).lstrip(b"\n")
        else:
            split = body.split(b"\n")
            body = b"\n".join(split[i] for i in at) + b"\n"
    return (lines.astype(np.int64), body, broken), most


def _cells_a_line(
    body: bytes, delimiter: str, always: bool
) -> tuple[NDArray[np.int64], NDArray[np.bool_], bool]:
    """(lines,): how many cells each has, and whether it is blank; and whether a blank one has blanks in it.

    Args:
        body: the lines.
        delimiter: what parts the cells.
        always: a line of delimiters is not blank.
    """
    if not body:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=bool), False
    every = np.frombuffer(body, dtype=np.uint8)
    ends = np.flatnonzero(every == 10)
    if not body.endswith(b"\n"):
        ends = np.append(ends, len(body))
    marks = np.flatnonzero(every == ord(delimiter))
    before = np.searchsorted(marks, ends)
    count = np.diff(before, prepend=0) + 1
    starts = np.concatenate([[0], ends[:-1] + 1])
    blank = ends == starts
    # A spreadsheet writes blank lines as delimiters; without a frame or a time these may be a frame without markers.
    few = count == 1 if always else ends - starts <= 2 * count
    spaced = False
    for i in np.flatnonzero(few & ~blank).tolist():
        blank[i] = not body[starts[i] : ends[i]].replace(delimiter.encode(), b"").strip()
        spaced |= bool(blank[i])
    return count.astype(np.int64), blank, spaced


def _cut(body: bytes, delimiter: str, count: NDArray[np.int64], layout: Layout, rows: int) -> str:
    """Why the last line, which does not end, is cut off; "" where it seems whole."""
    if count[-1] < layout.width:
        return f"after {counted(int(count[-1]), 'cell')} of {layout.width}"
    if count[-1] > layout.width:
        return ""
    mark = delimiter.encode()
    tail = max(_TAIL, 4 * (len(body) - body.rfind(b"\n")))
    table = [line.split(mark) for line in body[-tail:].split(b"\n") if line.strip()]
    # The first of them may have lost its beginning.
    *others, last = (
        row[layout.width - 1].strip() for row in table[len(table) > 1 :] if len(row) >= layout.width
    )
    if not last:
        return "in its last point" if table[-1][-2].strip() else ""
    # A program writes as many decimals into every row of a column.
    decimals = {_decimals(cell) for cell in others if cell}
    if len(others) > 2 and len(decimals) == 1 and (usual := min(decimals)):
        return "in its last number" if _decimals(last) < usual else ""
    return f"of {layout.said} frames that the header says" if layout.said > rows else ""


def _decimals(cell: bytes) -> int:
    found = _FIXED.fullmatch(cell)
    return len(found[1]) if found else 0


def _frames_said(said: int, rows: int) -> list[str]:
    if not said or said == rows:
        return []
    there = (
        f"the header says {counted(said, 'frame')}, and there {'is' if rows == 1 else 'are'} {rows}"
    )
    return [f"{there}: those are read"]


def _at_whole_points(count: NDArray[np.int64], layout: Layout) -> NDArray[np.bool_]:
    """Whether a row of so many cells ends behind a whole point, and has its frame and its time."""
    widths = np.unique(count)
    aside = [place for place in (layout.frame, layout.time) if place is not None]
    first, last = layout.columns.min(axis=1), layout.columns.max(axis=1)
    fine = [
        width
        for width in widths.tolist()
        if all(place < width for place in aside)
        and not ((first < width) & (last >= width)).any()
        # Of a file without either, a short row may lack anything.
        and aside
    ]
    return np.isin(count, fine)


def _too_long(
    body: bytes,
    delimiter: str,
    at: NDArray[np.int64],
    lines: NDArray[np.int64],
    count: NDArray[np.int64],
    layout: Layout,
    salvage: bool,
) -> NDArray[np.bool_]:
    """Rows that have something behind the last column that the header tells of.

    Raises:
        ClipError: one has, and nobody asked for the rest.
    """
    broken = np.zeros(len(lines), dtype=bool)
    allowed = max(layout.width, layout.header)
    longer = np.flatnonzero(count > allowed)
    split = body.split(b"\n") if len(longer) else []
    for i in longer.tolist():
        row = split[at[i]].split(delimiter.encode())
        broken[i] = any(cell.strip() for cell in row[allowed:])
        if broken[i] and not salvage:
            raise ClipError(
                f"line {lines[i]}: {counted(len(row), 'cell')} where the header has "
                f"{counted(allowed, 'column')}",
                SALVAGE,
            )
    return broken


def _numbers(
    body: bytes,
    delimiter: str,
    most: int,
    layout: Layout,
    lines: NDArray[np.int64],
    salvage: bool,
) -> tuple[Array, dict[int, Array], NDArray[np.bool_]]:
    """Coordinates (rows, 3 points), the columns of frame and time, and which rows hold what is no number.

    Raises:
        ClipError: a coordinate is no number, and nobody asked for the rest.
    """
    places = layout.columns.ravel()
    aside = [place for place in (layout.frame, layout.time) if place is not None]
    needed = np.unique([*places.tolist(), *aside])
    told: dict[str, Any] = {
        "sep": delimiter, "decimal": "," if layout.comma else ".", "header": None,
        "names": range(most), "skip_blank_lines": False, "skipinitialspace": True, "engine": "c",
        "low_memory": False, "quoting": 3, "encoding": "utf-8", "encoding_errors": "replace",
        "index_col": False, "na_values": _MISSING, "usecols": needed.tolist(),
    }  # fmt: skip
    bad = np.zeros(len(lines), dtype=bool)
    table = None if _TRUTHS.search(body) else _all_numbers(body, told)
    if table is None:
        table = _some_numbers(body, told, layout, lines, salvage, bad)
    if len(table) != len(lines):
        raise ClipError(f"no sound table: {len(table)} rows in {len(lines)} lines")
    at = np.searchsorted(needed, aside)
    found = {place: table[:, i] for place, i in zip(aside, at.tolist(), strict=True)}
    return table[:, np.searchsorted(needed, places)], found, bad


def _all_numbers(body: bytes, told: dict[str, Any]) -> Array | None:
    """The cells of the columns that are needed; None where one is no number."""
    import pandas

    kinds = dict.fromkeys(told["usecols"], np.float64)
    try:
        table = pandas.read_csv(BytesIO(body), dtype=kinds, **told)
    except ValueError:
        return None
    return np.asarray(table.to_numpy(np.float64))


def _some_numbers(
    body: bytes,
    told: dict[str, Any],
    layout: Layout,
    lines: NDArray[np.int64],
    salvage: bool,
    bad: NDArray[np.bool_],
) -> Array:
    """As `_all_numbers`; `bad` takes the rows in which a coordinate is no number.

    Raises:
        ClipError: there is one, and nobody asked for the rest.
    """
    needed = told["usecols"]
    coordinates = {*layout.columns.ravel().tolist()}
    blocks: list[Array] = []
    row = 0
    for table in _chunks(body, told):
        block = np.empty((len(table), len(needed)))
        for i, place in enumerate(needed):
            block[:, i], wrong = _to_numbers(table[place], layout.comma)
            # A frame or a time that is no number does not matter as much.
            if place not in coordinates or not wrong.any():
                continue
            bad[row : row + len(table)] |= wrong
            if not salvage:
                at = int(np.flatnonzero(wrong)[0])
                where = f"line {lines[row + at]}, {layout.column(place)}"
                cell = shown(str(table[place].iloc[at]))
                raise ClipError(f"{where}: {cell!r} is no number", SALVAGE)
        blocks.append(block)
        row += len(table)
    return np.concatenate(blocks) if blocks else np.empty((0, len(needed)))


def _chunks(body: bytes, told: dict[str, Any]) -> Iterator[pandas.DataFrame]:
    """The columns that are needed as texts, some thousand rows at a time.

    Raises:
        ClipError: pandas finds no table.
    """
    import pandas

    try:
        with pandas.read_csv(BytesIO(body), dtype=str, chunksize=_CHUNK, **told) as tables:
            yield from tables
    except ValueError as error:
        raise ClipError(f"no sound table: {reason(error)}") from error


def _to_numbers(texts: pandas.Series[Any], comma: bool) -> tuple[Array, NDArray[np.bool_]]:
    """(rows,): numbers, NaN for what is missing or none; and which are none."""
    import pandas

    seen = texts.notna().to_numpy(np.bool_)
    plain = texts.str.strip()
    if comma:
        plain = plain.str.replace(",", ".", regex=False)
    numbers = pandas.to_numeric(plain.where(plain != ""), errors="coerce").to_numpy(np.float64)
    words = plain.str.lower().isin(("true", "false")).to_numpy(np.bool_, na_value=False)
    numbers = np.where(words, np.nan, numbers)
    empty = (plain == "").to_numpy(np.bool_, na_value=False)
    return numbers, seen & ~empty & (np.isnan(numbers) | words)

"""The lines of a table: which are rows, which of them are not whole, and whether the last is cut off."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from mocap_skel.errors import ClipError
from mocap_skel.readers.tables.layout import SALVAGE, Layout
from mocap_skel.text import counted

# Bytes at the end of a file that tell how its last column is written.
_TAIL = 1 << 16
_FIXED = re.compile(rb"[-+]?\d*[.,](\d+)")


def plain_lines(body: bytes, delimiter: str) -> tuple[bytes, str]:
    """Rows whose cells are parted by one character and have no quotes."""
    if b'"' in body:
        point = delimiter == ","

        def bare(found: re.Match[bytes]) -> bytes:
            return found[1].replace(b",", b".") if point else found[1]

        body = re.sub(rb'"([^"\n]*)"', bare, body)
    if delimiter == " ":
        return b"\n".join(b"\t".join(line.split()) for line in body.split(b"\n")), "\t"
    return body, delimiter


def whole_rows(
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
        why = "; blanks part them, so nothing tells which are missing"
        raise ClipError(
            f"line {lines[first]}: {counted(int(count[first]), 'cell')} where the header has "
            f"{counted(layout.width, 'column')}{why if layout.delimiter == ' ' else ''}",
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
        # Of a file without either, a short row may lack anything; so may one in which blanks part the cells.
        and aside
        and layout.delimiter != " "
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

"""The numbers of a table: read by pandas, and looked at where a row is not as it should be."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mocap_skel.errors import ClipError, reason
from mocap_skel.readers.tables.layout import SALVAGE, Layout
from mocap_skel.readers.tables.lines import plain_lines, whole_rows
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
    body, delimiter = plain_lines(body, layout.delimiter)
    if body.endswith(b"\n\n"):
        body = body.rstrip(b"\n") + b"\n"
    if (count := body.count(delimiter.encode()) + body.count(b"\n")) > MOST_CELLS:
        raise ClipError(f"a table of {count / 1e6:.0f} million cells", "cut it into several clips")
    whole, most = whole_rows(body, delimiter, layout, salvage, notes)
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

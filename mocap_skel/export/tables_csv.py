"""skeleton.csv, joints.csv and angles.csv."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain

import numpy as np

from mocap_skel.angles.joint_angles import Angles
from mocap_skel.export.decimals import frame_rows
from mocap_skel.export.files import Pieces
from mocap_skel.results.angle_tables import angle_columns
from mocap_skel.results.tables import JOINT_COLUMNS, joint_rows
from mocap_skel.segments.pose import Array
from mocap_skel.skeleton_fit import SkeletonFit
from mocap_skel.text import visible


def skeleton_csv(fit: SkeletonFit) -> Pieces:
    """One row a frame: frame, time, three columns a track; metres to the micrometre, missing = empty."""
    names, tracks = zip(*fit.tracks(), strict=True)
    titles = [f"{name}_{axis}" for name in names for axis in "xyz"]
    return _frames_csv(fit, titles, tracks, digits=6)


def angles_csv(angles: Angles) -> Pieces:
    """One row a frame: frame, time, three columns a joint; degrees to four digits, missing = empty."""
    names, values = angle_columns(angles)
    return _frames_csv(angles, names, [values], digits=4)


def _frames_csv(
    of: SkeletonFit | Angles, names: Sequence[str], columns: Sequence[Array], *, digits: int
) -> Pieces:
    head = _csv([["frame", "time", *names]])
    return Pieces(
        lambda: chain([head], frame_rows(of.frame_numbers, of.time, columns, digits, ","))
    )


def joints_csv(fit: SkeletonFit) -> str:
    """One row a joint; lists are separated by blanks, what is not known is empty."""
    rows = ([_cell(value) for value in row.values()] for row in joint_rows(fit))
    return _csv([JOINT_COLUMNS, *rows])


def rows_csv(rows: Sequence[Mapping[str, object]], columns: Sequence[str] = ()) -> str:
    """Rows that all have these columns, or those of the first; numbers to nine digits, None and NaN empty."""
    head = list(columns) or (list(rows[0]) if rows else [])
    return _csv([head, *([_exact(row[name]) for name in head] for row in rows)])


def _exact(value: object) -> object:
    if isinstance(value, float):
        return f"{value:.9g}" if np.isfinite(value) else ""
    return "" if value is None else value


def _csv(rows: Iterable[Iterable[object]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(
        [_harmless(cell) for cell in row] for row in rows
    )
    return text.getvalue()


def _harmless(cell: object) -> object:
    r"""A cell that no spreadsheet takes for a formula, and no terminal for a command: names come out of files.

    >>> _harmless("=1+1"), _harmless("-1.5"), _harmless("-"), _harmless("Left\x1b[2J")
    ("'=1+1", '-1.5', '-', 'Left\\x1b[2J')
    """
    if not isinstance(cell, str):
        return cell
    formula = cell[:1] in _FORMULA and len(cell) > 1 and not _numbers(cell)
    return visible(f"'{cell}" if formula else cell)


# What a cell begins with that spreadsheets calculate (OWASP, "CSV Injection").
_FORMULA = ("=", "+", "-", "@")


def _numbers(cell: str) -> bool:
    try:
        return all(math.isfinite(float(word)) for word in cell.split())
    except ValueError:
        return False


def _cell(value: object) -> object:
    if isinstance(value, list):
        return " ".join(str(_cell(v)) for v in value)
    if isinstance(value, float):
        return f"{value:.6f}".rstrip("0").rstrip(".")
    return "" if value is None else value

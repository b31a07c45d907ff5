"""From a text with a table to a raw clip."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mocap_skel.readers.raw import RawClip
from mocap_skel.readers.tables.layout import Layout
from mocap_skel.readers.tables.rows import read_rows
from mocap_skel.readers.tables.source import Text, comma_is_decimal
from mocap_skel.readers.tables.timing import timing

# Rows that tell whether numbers have a decimal comma.
_SOME = 50


def raw_table(
    text: Text,
    layout: Layout,
    salvage: bool,
    *,
    rate: float = 0.0,
    seconds: float = 1.0,
    unit: str = "",
    usual_up: str = "z",
    notes: tuple[str, ...] = (),
) -> RawClip:
    """Read a table's rows into a raw clip.

    Args:
        text: the file.
        layout: where the numbers stand; whether they have decimal commas is found here.
        salvage: read the frames that are whole.
        rate: frames a second by the header, 0 where it does not say.
        seconds: in a unit of the column of times.
        unit: the file's word for its length unit.
        usual_up: the axis that files of its format mostly have vertical.
        notes: what was decided about the header.

    Raises:
        ClipError: a row cannot be read; the message says which.
    """
    some = [line for line in text.head(layout.skip + _SOME)[layout.skip :] if line.strip()]
    comma = comma_is_decimal(some, layout.delimiter)
    rows = read_rows(text.after(layout.skip), replace(layout, comma=comma), salvage)
    when = timing(rows, rate, seconds)
    points = rows.points
    if len(points) and when.places[-1] + 1 > len(points):
        points = np.full((int(when.places[-1]) + 1, *points.shape[1:]), np.nan)
        points[when.places] = rows.points
    return RawClip(
        points=points,
        labels=tuple(layout.titles),
        rate=when.rate,
        unit=unit,
        first_frame=when.first,
        zero_frame=when.zero,
        usual_up=usual_up,
        notes=(*text.notes, *notes, *rows.notes, *when.notes),
    )

"""Where the numbers of a table stand, as its header tells it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mocap_skel.readers.tables.source import shown

SALVAGE = "--salvage reads the frames that are whole"
"""What to do about a row that is not."""


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

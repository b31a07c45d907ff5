"""A table over time as the text of OpenSim's storage files, .sto and .mot.

Format: OpenSim documentation, Storage (.sto) Files and Motion (.mot) Files; the readers are OpenSim's Storage and
STOFileAdapter. Both kinds of file have the same head and the same table: OpenSim knows them by their names.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mocap_skel.segments.pose import Array


def storage_text(
    name: str,
    titles: Sequence[str],
    values: Array,
    time: Array,
    *,
    said: Sequence[str] = (),
    digits: int = 8,
) -> str:
    """Columns over time as a storage file; angles in degrees.

    Args:
        name: of the table, its first line.
        titles: of the columns, one word each.
        values: (frames, columns), all known: not all of OpenSim reads nan.
        time: (frames,), seconds.
        said: lines for people, without "=".
        digits: behind the point, of the values.

    >>> print(storage_text("walk", ["LeftKnee_flexion"], np.array([[12.5]]), np.array([0.0]), digits=2))
    walk
    version=1
    nRows=1
    nColumns=2
    inDegrees=yes
    <BLANKLINE>
    Angles are in degrees.
    <BLANKLINE>
    endheader
    time	LeftKnee_flexion
    0.00000000	12.50
    <BLANKLINE>
    """
    head = [
        name, "version=1", f"nRows={len(values)}", f"nColumns={len(titles) + 1}", "inDegrees=yes", "",
        *said, "Angles are in degrees.", "", "endheader", "\t".join(["time", *titles]),
    ]  # fmt: skip
    row = "%.8f" + f"\t%.{digits}f" * len(titles) + "\n"
    cells = np.column_stack([time, np.round(values, digits) + 0.0])
    body: str = (row * len(values)) % tuple(cells.ravel().tolist())
    return "\n".join(head) + "\n" + body

"""Tracks as the text of a TRC file.

Format: OpenSim documentation, Marker (.trc) Files; the reader is OpenSim's TRCFileAdapter.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from mocap_skel.clip import UPS, turn_between
from mocap_skel.export.decimals import frame_rows
from mocap_skel.export.files import Pieces
from mocap_skel.segments.pose import Array


def one_word(name: str) -> str:
    """A name as a column's: tabs and blanks part the columns for some readers.

    >>> one_word(" right shoulder ")
    'right_shoulder'
    """
    return re.sub(r"\s+", "_", name.strip())


def axes_note(before: str, after: str) -> str:
    """What points up in a file whose axes are turned, and where its axes are in the clip.

    >>> axes_note("z", "y")
    "y up, its x, y, z are the clip's y, z, x"
    """
    turn = turn_between(before, after)
    axes = ", ".join(UPS[int(np.concatenate([row, -row]).argmax())] for row in turn)
    return f"{after} up, its x, y, z are the clip's {axes}"


def trc_text(
    name: str,
    titles: Sequence[str],
    tracks: Sequence[Array],
    numbers: NDArray[np.int64],
    times: Array,
    rate: float,
) -> Pieces:
    """Tracks as TRC: metres, missing = empty.

    Args:
        name: of the file.
        titles: of the tracks, one word each.
        tracks: (frames, 3) each, metres, NaN = missing.
        numbers: (frames,) the frames' own.
        times: (frames,) seconds.
        rate: frames a second.
    """
    frames, count = len(numbers), len(titles)
    first, speed = int(numbers[0]), f"{rate:.10g}"
    head = {
        "DataRate": speed, "CameraRate": speed, "NumFrames": frames, "NumMarkers": count,
        "Units": "m", "OrigDataRate": speed, "OrigDataStartFrame": first, "OrigNumFrames": frames,
    }  # fmt: skip
    axes = (f"{axis}{at}" for at in range(1, count + 1) for axis in "XYZ")
    lines = [
        ["PathFileType", "4", "(X/Y/Z)", one_word(name)],
        head,
        map(str, head.values()),
        ["Frame#", "Time", *(cell for title in titles for cell in (title, "", ""))],
        ["", "", *axes],
        [],
    ]
    text = "".join("\t".join(line) + "\n" for line in lines)

    def pieces() -> Iterator[str]:
        yield text
        for some in frame_rows(numbers, times, tracks, 6, "\t"):
            # OpenSim does not count the last cell of a row that is empty.
            yield some.replace("\t\n", "\t\t\n")

    return Pieces(pieces)

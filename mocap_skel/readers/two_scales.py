"""Which of two scales holds where a file gives two for its coordinates: by the size of the body."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mocap_skel.readers.raw import RawClip
from mocap_skel.readers.units import extent_of, metres_in

# Diagonal in metres of the box around a person's markers: sitting, up to a tall one with the arms stretched out.
SMALLEST, LARGEST = 1.1, 2.9
# Fewer markers may be those of a limb.
WHOLE_BODY = 20


def second_scale(
    points: NDArray[np.float64], unit: str | None, raw: RawClip, notes: list[str]
) -> float:
    """What to multiply coordinates with: 1 where the file's first scale holds, otherwise `raw.rescale`.

    The second is taken where only that gives a whole body the size of a person.

    Args:
        points: (frames, markers, 3) by the first scale, NaN = missing.
        unit: in place of what the file says.
        raw: the clip as the file has it.
        notes: takes a sentence where there are two scales.
    """
    if raw.rescale == 1:
        return 1.0
    metres = metres_in(raw.unit if unit is None else unit)
    size = extent_of(points)
    said = f"{raw.scale_names[0]} and {raw.scale_names[1]} differ"
    if metres is None or not size:
        notes.append(f"{said}: {raw.scale_names[0]} is taken, as nothing tells which is right")
        return 1.0
    first, second = size * metres, size * raw.rescale * metres
    whole = points.shape[1] >= WHOLE_BODY
    fits = [SMALLEST < one < LARGEST for one in (first, second)]
    taken = int(whole and fits == [False, True])
    sure = (
        "by the size of the body" if whole and fits[0] != fits[1] else "as their size does not tell"
    )
    notes.append(
        f"{said}: the markers span {first:.2f} m by the first, {second:.2f} m by the second; "
        f"{raw.scale_names[taken]} is taken, {sure}"
    )
    return raw.rescale if taken else 1.0

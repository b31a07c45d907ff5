"""A file's points, straight from its bytes, where the survey found them.

The tests hold them to ezc3d and py-c3d, bit by bit, on every file at hand.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mocap_skel.readers.formats.c3d.contents import Contents, Groups
from mocap_skel.readers.formats.c3d.frames import without_padding
from mocap_skel.readers.formats.c3d.survey import Survey

# Bytes that are read at once.
_CHUNK = 1 << 24


def contents(found: Survey, groups: Groups | None = None) -> Contents:
    """Points and parameters of a file: of one that is cut off, the frames that it still has.

    Args:
        found: the file.
        groups: its parameters, in place of those that the survey found.
    """
    groups = found.section.groups if groups is None else groups
    points, invalid = _points(found)
    notes: tuple[str, ...] = ()
    if invalid.all() and points.any():
        # Who gives no point a residual means none of them to be missing.
        invalid = (points == 0).all(axis=-1)
        notes = ("every residual says that its point is missing: the residuals are not used",)
    if found.layout.width == 2:
        points *= found.scale
    points[invalid] = np.nan
    return Contents(
        points=points,
        invalid=invalid,
        rate=found.rate,
        first_frame=found.first_frame,
        parameters={"POINT": groups.get("POINT", {}), "TRIAL": groups.get("TRIAL", {})},
        notes=notes,
    )


def _points(found: Survey) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """(frames, points, 3) as they stand in the file, and (frames, points): whether the residual says missing.

    The fourth value holds a residual and a set of cameras; only its sign means the same to all. A zero has no
    sign here: some write -0.0 for a point without a residual.
    """
    layout = found.layout
    sure = min(layout.sure, layout.frames)
    frames = sure + without_padding(found.read(sure, layout.frames - sure), 0)
    points = np.empty((frames, layout.points, 3))
    invalid = np.empty((frames, layout.points), bool)
    step = max(1, _CHUNK // layout.stride)
    with np.errstate(invalid="ignore"):
        for first in range(0, frames, step):
            some = slice(first, min(first + step, frames))
            data = found.read(first, some.stop - first)
            points[some] = data[..., :3]
            np.less(data[..., 3], 0, out=invalid[some])
    return points, invalid

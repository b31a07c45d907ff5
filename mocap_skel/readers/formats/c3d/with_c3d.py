"""The second reader: the parameters by py-c3d, the frames all at once by numpy.

py-c3d's own `read_frames` goes through a Python loop that costs 50 µs a frame and takes the number
of frames from fields that may be stale; and a trouble with analog channels, which nobody needs
here, ends it. Where it cannot read the parameters either, those that `section` found must do.
"""

from __future__ import annotations

import struct
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from mocap_skel.errors import reason
from mocap_skel.readers.formats.c3d.contents import Contents, Groups, decoded
from mocap_skel.readers.formats.c3d.frames import without_padding
from mocap_skel.readers.formats.c3d.machine import numbers
from mocap_skel.readers.formats.c3d.survey import survey

# What py-c3d lets through on files that it does not expect; most of it is its own `assert`.
_REFUSALS = (
    ArithmeticError, AssertionError, AttributeError, LookupError, MemoryError, NameError, OSError,
    RuntimeError, TypeError, ValueError, struct.error,
)  # fmt: skip


def read(path: Path) -> Contents:
    """Read a file with py-c3d and numpy: of a file that is cut off, the frames that it still has.

    Raises:
        ClipError: it is no C3D file or has no parameters; the message does not name the file.
        OSError: it cannot be opened.
    """
    found = survey(path)
    notes: tuple[str, ...] = ()
    groups, reader = found.section.groups, "numpy"
    # A walk that found something wrong knows more than py-c3d, which stops there or reads on.
    if not found.section.faults and not found.base:
        try:
            groups, reader = _groups(path, found.section.machine), "py-c3d"
        except _REFUSALS as error:
            why = reason(error)
            # Nobody here needs the analog data over which it stumbles.
            if "analog" not in why.lower():
                notes = (f"py-c3d cannot read its parameters either: {why}",)
    layout, point = found.layout, groups.get("POINT", {})
    data = found.read(0, layout.frames)
    data = data[: without_padding(data, layout.sure)]
    with np.errstate(invalid="ignore"):
        points = data[..., :3].astype(np.float64)
    # The fourth value holds a residual and a set of cameras; only its sign means the same to all.
    # A zero has no sign here: some write -0.0 for a point without a residual.
    with np.errstate(invalid="ignore"):
        invalid = data[..., 3] < 0
    if invalid.all() and points.any():
        # Who gives no point a residual means none of them to be missing.
        invalid = (points == 0).all(axis=-1)
        notes = (
            *notes,
            "every residual says that its point is missing: the residuals are not used",
        )
    if layout.width == 2:
        points *= found.scale
    points[invalid] = np.nan
    return Contents(
        points=points,
        invalid=invalid,
        rate=found.rate,
        first_frame=found.first_frame,
        length=len(data),
        parameters={"POINT": point, "TRIAL": groups.get("TRIAL", {})},
        reader=reader,
        notes=notes,
    )


def _groups(path: Path, machine: str) -> Groups:
    """The parameters."""
    import c3d

    with path.open("rb") as file, warnings.catch_warnings():
        # Missing descriptions, no analog data: nothing that matters here.
        warnings.simplefilter("ignore")
        reader = c3d.Reader(file)
        groups: Groups = {}
        for name in ("POINT", "TRIAL"):
            group = reader.get(name)
            entries = group.param_items() if group is not None else ()
            groups[name] = {key: _value(param, machine) for key, param in entries}
    return groups


def _value(param: Any, machine: str) -> Any:
    """A parameter's value: flat numbers, or a list of text."""
    if param.bytes_per_element == -1:
        # The first dimension is the width of one text.
        width = param.dimensions[0] if param.dimensions else 1
        texts = range(0, len(param.bytes), max(1, width))
        return [decoded(param.bytes[at : at + width]) for at in texts]
    kind = {1: "i1", 2: "i2", 4: "f4"}.get(param.bytes_per_element)
    return np.empty(0) if kind is None else numbers(param.bytes, kind, machine)

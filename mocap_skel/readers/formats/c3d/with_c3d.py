"""Files that are not sound: their parameters by py-c3d, and where it cannot, those that `section` found.

Its frames are not used: `read_frames` takes their number from fields that may be stale, and a trouble with
analog channels, which nobody needs here, ends it.
"""

from __future__ import annotations

import struct
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mocap_skel.errors import reason
from mocap_skel.readers.formats.c3d.contents import Contents, Groups, decoded
from mocap_skel.readers.formats.c3d.machine import numbers
from mocap_skel.readers.formats.c3d.points import contents
from mocap_skel.readers.formats.c3d.survey import Survey, survey

# What py-c3d lets through on files that it does not expect; most of it is its own `assert`.
_REFUSALS = (
    ArithmeticError, AssertionError, AttributeError, LookupError, MemoryError, NameError, OSError,
    RuntimeError, TypeError, ValueError, struct.error,
)  # fmt: skip


def read(path: Path, found: Survey | None = None) -> Contents:
    """Read a file with py-c3d and numpy: of a file that is cut off, the frames that it still has.

    Args:
        path: the file.
        found: what is known of it.

    Raises:
        ClipError: it is no C3D file or has no parameters; the message does not name the file.
        OSError: it cannot be opened.
    """
    found = found or survey(path)
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
    raw = contents(found, groups)
    return replace(raw, reader=reader, notes=(*notes, *raw.notes))


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

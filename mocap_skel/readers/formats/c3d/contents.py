"""What a reader of C3D gives of a file, and the values of its parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mocap_skel.readers.raw import RawEvent

Groups = dict[str, dict[str, Any]]
"""Parameters: GROUP → NAME → value (flat numbers, or a list of text)."""


@dataclass(frozen=True, eq=False)
class Contents:
    """A C3D file as it stands.

    Attributes:
        points: (frames, points, 3), float64, the file's unit.
        invalid: (frames, points), residual below zero.
        rate: frames a second as the file has it, 0 where it has none.
        first_frame: the file's own number of the first frame.
        parameters: the groups POINT and TRIAL, and PROCESSING where all readers are done.
        reader: what read the parameters.
        events: as `RawClip` has them.
        rescale, scale_names: as `RawClip` has them.
        notes: what was decided while reading, one sentence each.
    """

    points: NDArray[np.float64]
    invalid: NDArray[np.bool_]
    rate: float
    first_frame: int
    parameters: Groups
    reader: str = "numpy"
    notes: tuple[str, ...] = ()
    rescale: float = 1.0
    scale_names: tuple[str, str] = ("", "")
    events: tuple[RawEvent, ...] = ()


def number(value: Any) -> float:
    """The first number of a parameter's value; 0 without one, or where it is not finite."""
    values = np.atleast_1d(value if value is not None else []).ravel()
    if not len(values) or values.dtype.kind not in "iuf" or not np.isfinite(values[0]):
        return 0.0
    return float(values[0])


def decoded(text: bytes) -> str:
    """A text of the file: UTF-8, or Latin-1 where it cannot be that; padding taken off."""
    try:
        found = text.decode("utf-8")
    except UnicodeDecodeError:
        found = text.decode("latin-1")
    return found.replace("\0", "").strip()


def texts(group: dict[str, Any], name: str) -> list[str]:
    """A list of texts with its continuations, NAME2, NAME3 and so on: one holds up to 255."""
    found: list[str] = []
    part, key = 1, name
    while key in group:
        value = group[key]
        found += [str(text).strip() for text in value] if isinstance(value, list) else []
        part += 1
        key = f"{name}{part}"
    return found

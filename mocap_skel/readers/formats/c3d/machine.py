"""Numbers as the three machines write them: Intel, DEC (VAX) and MIPS (SGI)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

MACHINES = {84: "INTEL", 85: "DEC", 86: "MIPS"}
"""The fourth byte of the parameter section."""


def dtype(kind: str, machine: str) -> np.dtype[Any]:
    """The type of numbers as they lie in the file: kind "i2", "u2", "f4"."""
    return np.dtype((">" if machine == "MIPS" else "<") + kind)


def native(values: NDArray[Any], machine: str) -> NDArray[Any]:
    """Numbers as they are meant: a DEC float has its words swapped and counts four times as much."""
    if machine != "DEC" or values.dtype.kind != "f":
        return values
    words = values.view("<u2").reshape(-1, 2)[:, ::-1]
    # Numbers that are none are found later on, by what they are.
    with np.errstate(invalid="ignore"):
        return np.ascontiguousarray(words).view("<f4").ravel() / np.float32(4)


def numbers(data: bytes, kind: str, machine: str) -> NDArray[Any]:
    """As many whole numbers as there are in `data`."""
    form = dtype(kind, machine)
    return native(np.frombuffer(data, form, len(data) // form.itemsize), machine)


def encoded(values: ArrayLike, kind: str, machine: str) -> bytes:
    """Numbers as the machine writes them: what `numbers` takes apart."""
    if machine == "DEC" and kind == "f4":
        words = (np.asarray(values, "<f4") * np.float32(4)).view("<u2").reshape(-1, 2)
        return words[:, ::-1].tobytes()
    return np.asarray(values).astype(dtype(kind, machine)).tobytes()

"""Tables of decimal numbers as text, many rows at once: digits by arithmetic, where `%.6f` goes cell by cell."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from mocap_skel.segments.pose import Array

# Cells of a piece of text: its digits stay in the cache.
_CELLS = 1 << 16
# Whole parts from here on do not fit into the digits.
_MOST = 10**9


def frame_rows(
    numbers: NDArray[np.int64], times: Array, columns: Sequence[Array], digits: int, between: str
) -> Iterator[str]:
    """The rows of a table: frame number, time to the microsecond, values; missing = empty, no "-0.00".

    Args:
        numbers: (frames,).
        times: (frames,) seconds.
        columns: values side by side, each (frames, any), NaN = missing.
        digits: of the values behind the point.
        between: one character between two cells.

    Returns:
        Pieces of some thousand cells, each of whole rows.

    >>> values = np.array([[1.25, np.nan], [-0.0004, -31.5]])
    >>> print("".join(frame_rows(np.array([7, 8]), np.array([0.06, 0.07]), [values], 2, ",")), end="")
    7,0.060000,1.25,
    8,0.070000,0.00,-31.50
    """
    step = max(1, _CELLS // max(1, sum(some.shape[1] for some in columns)))
    for first in range(0, len(numbers), step):
        some = slice(first, first + step)
        heads = [
            f"{n}{between}{t:.6f}".encode()
            for n, t in zip(numbers[some].tolist(), times[some].tolist(), strict=True)
        ]
        here = np.hstack([part[some] for part in columns])
        # What no body reaches is written as Python writes it.
        if (np.abs(here) < _MOST).sum() + np.isnan(here).sum() < here.size:
            yield _by_cells(heads, here, digits, between)
            continue
        left = np.array(heads)
        text = np.hstack(
            [
                left.view(np.uint8).reshape(len(left), -1),
                _cells(here, digits, between).reshape(len(left), -1),
                np.full((len(left), 1), ord("\n"), np.uint8),
            ]
        )
        yield text[text != 0].tobytes().decode("ascii")


def _cells(values: Array, digits: int, between: str) -> NDArray[np.uint8]:
    """(frames, columns, width): the characters of each cell, 0 = none."""
    known = np.isfinite(values)
    scaled = np.rint(np.where(known, values, 0.0) * 10.0**digits).astype(np.int64)
    whole, part = np.divmod(np.abs(scaled), 10**digits)
    places = len(str(int(whole.max(initial=0))))
    text = np.zeros((*values.shape, places + digits + 3), np.uint8)
    text[..., 1] = np.where(scaled < 0, ord("-"), 0)
    text[..., -1 - digits] = ord(".")
    _put(part.astype(np.int32), text[..., -digits:])
    _put(whole.astype(np.int32), text[..., 2 : 2 + places])
    for place in range(places - 1):
        # No zeros before the first digit.
        text[..., 2 + place][whole < 10 ** (places - 1 - place)] = 0
    text[~known] = 0
    text[..., 0] = ord(between)
    return text


def _put(numbers: NDArray[np.int32], text: NDArray[np.uint8]) -> None:
    """The digits of numbers, the last ones last."""
    for place in range(text.shape[-1] - 1, -1, -1):
        numbers, text[..., place] = np.divmod(numbers, 10)
    text += ord("0")


def _by_cells(heads: list[bytes], values: Array, digits: int, between: str) -> str:
    row = "%s" + f"{between}%.{digits}f" * values.shape[1] + "\n"
    rounded = (np.round(values, digits) + 0.0).tolist()
    lines = (row % (head.decode(), *cells) for head, cells in zip(heads, rounded, strict=True))
    return "".join(lines).replace("nan", "")

"""The length unit of a file: as it says, in whatever spelling, or by the size of what it shows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mocap_skel.errors import CallError
from mocap_skel.readers.raw import RawClip

# Metres in a unit, by its signs and by its names, of which a file may have the beginning ("mete").
_SIGNS = {"mm": 1e-3, "cm": 1e-2, "dm": 0.1, "m": 1.0, "in": 0.0254, "ft": 0.3048}
_NAMES = {
    "millimeters": 1e-3, "millimetres": 1e-3, "centimeters": 1e-2, "centimetres": 1e-2,
    "decimeters": 0.1, "decimetres": 0.1, "meters": 1.0, "metres": 1.0,
    "inches": 0.0254, "foot": 0.3048, "feet": 0.3048,
}  # fmt: skip
_SHORTEST = 4

# Enough for a median that decides between powers of ten.
_FRAMES = 300

SIGN_OF = {metres: sign for sign, metres in _SIGNS.items()}
"""How a unit of so many metres is written."""


def metres_in(unit: str) -> float | None:
    """Metres in a unit, in any spelling that files have; None for what is no unit.

    >>> metres_in("mm"), metres_in("[MM]"), metres_in("mete"), metres_in("furlong")
    (0.001, 0.001, 1.0, None)
    """
    name = unit.strip(" \0\t[]().").lower()
    if name in _SIGNS:
        return _SIGNS[name]
    begun = (m for full, m in _NAMES.items() if len(name) >= _SHORTEST and full.startswith(name))
    return next(begun, None)


def scale(points: NDArray[np.float64], unit: str | None, raw: RawClip, notes: list[str]) -> float:
    """Metres in the file's unit.

    Args:
        points: (frames, markers, 3) in the file's unit, NaN = missing.
        unit: in place of what the file says.
        raw: the clip as the file has it.
        notes: takes a sentence where the unit is not plain.

    Raises:
        CallError: `unit` is no length unit.
    """
    said = raw.unit if unit is None else unit
    stated = metres_in(said)
    if unit is not None and stated is None:
        raise CallError(f"{unit!r} is no length unit", "use mm, cm, dm, m, in or ft")
    size = extent_of(points)
    if stated is None:
        return _by_size(size, f"unit {said!r} is unknown" if said else "no unit in the file", notes)
    # From two markers of a finger to a football field.
    if size and not 0.02 < size * stated < 100.0:
        notes.append(
            f"the markers span {size * stated:.3g} m if the unit is {said!r} as the "
            f"{'file' if unit is None else 'call'} says; if that cannot be, give another --unit"
        )
    return stated


def _by_size(size: float, why: str, notes: list[str]) -> float:
    if not size:
        notes.append(
            f"{why}, and no size to tell it by: taken as mm; if that cannot be, give --unit"
        )
        return 1e-3
    # A figure or a limb of it spans 0.3 to 3 m, so that the three ranges do not overlap; a group of
    # people in metres still falls into the first.
    guess = 1.0 if size < 10 else 1e-2 if size < 300 else 1e-3
    notes.append(
        f"{why}: {SIGN_OF[guess]} by the size of the figure, {size * guess:.2f} m; "
        "if that cannot be, give --unit"
    )
    return guess


def extent_of(points: NDArray[np.float64]) -> float:
    """Median over frames, a few hundred of them, of the diagonal of the markers' bounding box."""
    seen = np.flatnonzero(np.isfinite(points[..., 0]).any(axis=1))
    some = points[seen[:: 1 + len(seen) // _FRAMES]]
    extent = np.nanmax(some, axis=1) - np.nanmin(some, axis=1)
    # np.median would import numpy.ma, 20 ms of a cold start.
    return float(np.sort(np.linalg.norm(extent, axis=-1))[len(extent) // 2])

"""Measures of a person: their names, what each can be in metres, and how they are written."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from mocap_skel.errors import CallError
from mocap_skel.text import listed, nearest, parse_toml, read_text

SIDES = ("left", "right")
# Metres, from a small child to the largest adult, with room at both ends: a value beyond is in another unit.
_OF_A_SIDE = {
    "knee_width": (0.04, 0.20),
    "ankle_width": (0.03, 0.13),
    "elbow_width": (0.03, 0.14),
    "wrist_width": (0.02, 0.11),
    "leg_length": (0.25, 1.35),
}
_OF_ALL = {"inter_asis": (0.10, 0.45), "marker_diameter": (0.002, 0.06), "height": (0.5, 2.5)}
MEASURES: Mapping[str, tuple[float, float]] = {
    **{f"{side}_{name}": limits for name, limits in _OF_A_SIDE.items() for side in SIDES},
    **_OF_ALL,
}
"""Every measure by its full name, and the least and most that it can be, metres."""

_LENGTH = re.compile(r"\s*([0-9.]+)\s*([a-z]*)\s*", re.IGNORECASE)
_METRES = {"mm": 1e-3, "cm": 1e-2, "dm": 0.1, "m": 1.0}


def possible(name: str, metres: float) -> bool:
    """Whether a person can have such a measure.

    >>> possible("left_knee_width", 0.1), possible("left_knee_width", 10.0)
    (True, False)
    """
    low, high = MEASURES[name]
    return low <= metres <= high


def measures_of(said: Iterable[str]) -> dict[str, float]:
    """Read measures as they are typed, NAME=LENGTH; without a side the value counts for both.

    Returns:
        Full name → metres; of two that give the same measure the later one counts.

    Raises:
        CallError: no such measure, no length with its unit, or one that no person has.

    >>> measures_of(["knee_width=10.2cm", "right_knee_width=105mm"])
    {'left_knee_width': 0.102, 'right_knee_width': 0.105}
    """
    found: dict[str, float] = {}
    for text in said:
        name, equals, length = text.partition("=")
        if not equals:
            raise CallError(f"measure {text!r}: a name and a length are needed, knee_width=10.2cm")
        found |= _measure(name.strip(), length)
    return found


def read_measures(path: Path) -> dict[str, float]:
    """Read a file of measures: TOML with one `knee_width = "10.2cm"` a line.

    Raises:
        CallError: it cannot be read, or a measure in it is wrong; it names the file.
    """
    data = parse_toml(path, read_text(path, CallError), CallError)
    found: dict[str, float] = {}
    for name, value in data.items():
        try:
            found |= _measure(name, str(value))
        except CallError as error:
            raise CallError(f"{path}: {error.message}", error.hint) from error
    return found


def _measure(name: str, length: str) -> dict[str, float]:
    """One measure for the side that it names, or for both."""
    names = [name] if name in MEASURES else [f"{side}_{name}" for side in SIDES]
    if names[0] not in MEASURES:
        known = [*_OF_A_SIDE, *_OF_ALL]
        hint = nearest(name, [*known, *MEASURES]) or f"measures: {listed(known, 20)}"
        raise CallError(f"there is no measure {name!r}", hint)
    found = _LENGTH.fullmatch(length)
    try:
        metres = float(found[1]) * _METRES[found[2].lower()] if found else None
    except (KeyError, ValueError):
        metres = None
    if metres is None:
        raise CallError(
            f"measure {name}: {length.strip()!r} is no length; give it with its unit, like 10.2cm "
            "(mm, cm, dm, m)"
        )
    if not possible(names[0], metres):
        low, high = (100 * limit for limit in MEASURES[names[0]])
        raise CallError(
            f"measure {name}: no person has {length.strip()} ({low:g} to {high:g} cm)",
            "is the unit right?",
        )
    return dict.fromkeys(names, metres)

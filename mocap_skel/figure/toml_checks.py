"""Checks of the values in a skeleton file; each error names the place of the value."""

from __future__ import annotations

import math
from typing import Any, TypeVar

from mocap_skel.errors import SkeletonError
from mocap_skel.figure.toml_places import Place, Places
from mocap_skel.text import nearest

T = TypeVar("T")


def names(value: Any, places: Places, i: int, key: str) -> tuple[str, ...]:
    """Check that a value is a list of names, none of them empty.

    Raises:
        SkeletonError: it is not.
    """
    if not isinstance(value, list) or not all(
        isinstance(v, str) and v and v.isprintable() for v in value
    ):
        what = key.rpartition(".")[2]
        raise SkeletonError(
            f"{places.of(i, key)}: {what}: a list of names is needed, not {value!r}"
        )
    return tuple(value)


def is_a(value: Any, kind: type[T], where: Place | str, what: str) -> T:
    """Check that a value is of a type; `what` names it in the error.

    Raises:
        SkeletonError: it is not.

    >>> is_a("Knee", str, "leg.toml:5:9", "joint: a text")
    'Knee'
    >>> is_a(7, str, "leg.toml:5:9", "joint: a text")
    Traceback (most recent call last):
        ...
    mocap_skel.errors.SkeletonError: leg.toml:5:9: joint: a text is needed, not 7
    """
    if not isinstance(value, kind):
        raise SkeletonError(f"{where}: {what} is needed, not {value!r}")
    return value


def a_name(value: Any, where: Place | str, what: str) -> str:
    """Check that a value is a text that can be a name: on one line, and printable; `what` names it in the error.

    Raises:
        SkeletonError: it is not.
    """
    if not is_a(value, str, where, f"{what}: a text").isprintable():
        raise SkeletonError(f"{where}: {what} {value!r} cannot be printed")
    return str(value)


def known_keys(
    entry: dict[str, Any], known: set[str], places: Places, i: int | None, inside: str = ""
) -> None:
    """Check that a table has no key that nothing reads.

    Raises:
        SkeletonError: it has; the hint names the keys that are read.
    """
    for key in entry:
        if key not in known:
            raise SkeletonError(
                f"{places.of(i, inside + key)}: unknown key {key!r}",
                nearest(key, sorted(known)) or f"known: {', '.join(sorted(known))}",
            )


def number(value: Any, where: Place | str, what: str, *, positive: bool = False) -> float:
    """Check that a value is a finite number; `what` is the sentence of the error.

    Raises:
        SkeletonError: it is not, or it has to be positive and is not.
    """
    wrong = isinstance(value, bool) or not isinstance(value, int | float)
    wrong = wrong or not math.isfinite(value)
    if wrong or (positive and not value > 0):
        raise SkeletonError(f"{where}: {what}, not {value!r}")
    return float(value)

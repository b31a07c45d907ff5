"""What a value of a skeleton file has to be, with its place where it is not."""

from __future__ import annotations

import math
from typing import Any, TypeVar

from mocap_skel.errors import SkeletonError
from mocap_skel.figure.toml_places import Places
from mocap_skel.text import nearest

T = TypeVar("T")


def names(value: Any, places: Places, i: int, key: str) -> tuple[str, ...]:
    """A list of names."""
    if not isinstance(value, list) or not all(isinstance(v, str) and v for v in value):
        what = key.rpartition(".")[2]
        raise SkeletonError(
            f"{places.of(i, key)}: {what}: a list of names is needed, not {value!r}"
        )
    return tuple(value)


def is_a(value: Any, kind: type[T], where: str, what: str) -> T:
    """A value of a kind."""
    if not isinstance(value, kind):
        raise SkeletonError(f"{where}: {what} is needed, not {value!r}")
    return value


def known_keys(
    entry: dict[str, Any], known: set[str], places: Places, i: int | None, inside: str = ""
) -> None:
    """Refuse a key that nothing reads."""
    for key in entry:
        if key not in known:
            raise SkeletonError(
                f"{places.of(i, inside + key)}: unknown key {key!r}",
                nearest(key, sorted(known)) or f"known: {', '.join(sorted(known))}",
            )


def number(value: Any, where: str, what: str, *, positive: bool = False) -> float:
    """A finite number; `what` is the sentence that says so."""
    wrong = isinstance(value, bool) or not isinstance(value, int | float)
    wrong = wrong or not math.isfinite(value)
    if wrong or (positive and not value > 0):
        raise SkeletonError(f"{where}: {what}, not {value!r}")
    return float(value)

"""The rest pose in a skeleton file: how a segment's bone, joint and hinge lie in the T-pose."""

from __future__ import annotations

import math
from typing import Any

from mocap_skel.errors import SkeletonError
from mocap_skel.figure.toml_places import Places

Vector = tuple[float, float, float]

REST_KEYS = ("rest", "rest_joint", "rest_axis")


def read_rest(
    entry: dict[str, Any], places: Places, i: int, *, root: bool
) -> tuple[Vector | None, Vector | None, Vector | None]:
    """Read a segment's `rest`, `rest_joint` and `rest_axis`; None for each that the file does not have.

    Raises:
        SkeletonError: one is not three numbers, or a direction without a length; or the root has one that
            is about a joint.
    """
    for key in REST_KEYS[1:]:
        if root and key in entry:
            raise SkeletonError(
                f"{places.of(i, key)}: {key!r} tells of the joint towards the parent; the root has none"
            )
    return (
        _vector(entry, places, i, "rest"),
        _vector(entry, places, i, "rest_joint"),
        _vector(entry, places, i, "rest_axis"),
    )


def _vector(entry: dict[str, Any], places: Places, i: int, key: str) -> Vector | None:
    """Three numbers under a key; None if it is not there."""
    value = entry.get(key)
    if value is None:
        return None
    numbers = value if isinstance(value, list) else []
    if len(numbers) != 3 or not all(
        isinstance(v, int | float) and not isinstance(v, bool) and math.isfinite(v) for v in numbers
    ):
        raise SkeletonError(
            f"{places.of(i, key)}: {key}: three numbers are needed, to the character's left, up and "
            f"forward, not {value!r}"
        )
    x, y, z = (float(v) for v in numbers)
    # A joint may lie on its parent's; a direction is one only with a length.
    if key != "rest_joint" and math.hypot(x, y, z) < 1e-9:
        raise SkeletonError(f"{places.of(i, key)}: {key}: a direction is needed, not {value!r}")
    return x, y, z

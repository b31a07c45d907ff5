"""Euler angles that do not flip: of the triples that are the same rotation, the one near the last frame's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mocap_skel.segments.pose import Array

Mask = NDArray[np.bool_]

ORDERS = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")
# Cosine of the middle angle. Below it only the sum or the difference of the other two is in the rotation, and
# any split is right to that many radians.
LOCKED = 1e-8


def euler_angles(rotation: Array, order: str) -> Array:
    """Angles (frames, 3) in degrees, in the order of the axes: R = R_first R_second R_third.

    Each frame is exactly its rotation. A rotation has two triples, (a, b, c) and (a + 180°, 180° - b,
    c + 180°), and both may have full turns added. Whether a frame takes the same kind of triple as the one
    before is decided by which is nearer; that choice does not depend on which kind the other had, so
    all frames are decided at once. Where the first and third axis fall together, the first angle goes on
    between its neighbours' and the others take up the rest.

    Args:
        rotation: (frames, 3, 3), without gaps.
        order: one of `ORDERS`.

    Raises:
        ValueError: no such order.

    >>> quarter = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    >>> euler_angles(np.array([quarter]), "ZXY")
    array([[90.,  0.,  0.]])
    """
    if order not in ORDERS:
        raise ValueError(f"order must be one of {ORDERS}, got {order!r}")
    i, j, k = ("XYZ".index(axis) for axis in order)
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    first = np.arctan2(-sign * rotation[:, j, k], rotation[:, k, k])
    locked = np.hypot(rotation[:, j, k], rotation[:, k, k]) < LOCKED
    first = _nearest(first, *_rest(rotation, first, i, j, k, sign), locked)
    first = _between(first, locked)
    middle, last = _rest(rotation, first, i, j, k, sign)
    return np.degrees(np.unwrap(np.stack([first, middle, last], axis=1), axis=0))


def _rest(
    rotation: Array, first: Array, i: int, j: int, k: int, sign: float
) -> tuple[Array, Array]:
    """The middle and last angle, once the first is known: it is undone, and two plane turns are left."""
    sine, cosine = np.sin(first)[:, None], np.cos(first)[:, None]
    row_j = cosine * rotation[:, j] + sign * sine * rotation[:, k]
    row_k = cosine * rotation[:, k] - sign * sine * rotation[:, j]
    return (
        np.arctan2(sign * rotation[:, i, k], row_k[:, k]),
        np.arctan2(sign * row_j[:, i], row_j[:, j]),
    )


def _nearest(first: Array, middle: Array, last: Array, locked: Mask) -> Array:
    """The first angles of the triples that follow each other most closely."""
    free = np.flatnonzero(~locked)
    if len(free) < 2:
        return first
    a, b, c = (angle[free] for angle in (first, middle, last))
    turn = _wrapped(np.diff(a)) ** 2 + _wrapped(np.diff(c)) ** 2
    same = turn + _wrapped(np.diff(b)) ** 2
    other = (
        _wrapped(np.diff(a) + np.pi) ** 2
        + _wrapped(np.diff(c) + np.pi) ** 2
        + _wrapped(np.pi - b[1:] - b[:-1]) ** 2
    )
    second = np.zeros(len(first), dtype=bool)
    second[free[1:]] = np.cumsum(other < same) % 2 == 1
    return np.where(second, first + np.pi, first)


def _between(angle: Array, locked: Mask) -> Array:
    """Angles, those of locked frames from a line between the frames around them."""
    free = ~locked
    if not free.any():
        return np.zeros_like(angle)
    at = np.arange(len(angle))
    angle = angle.copy()
    angle[free] = np.unwrap(angle[free])
    return np.asarray(np.interp(at, at[free], angle[free]))


def _wrapped(angle: Array) -> Array:
    return np.asarray((angle + np.pi) % (2.0 * np.pi) - np.pi)

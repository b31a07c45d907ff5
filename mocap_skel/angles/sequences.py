"""Angles of rotations about three axes in turn, and how fast they change with small turns.

Closed form, for any sequence, vectorised over frames; NaN stays NaN. Two turns about one line cannot be told
apart: near that gimbal lock the angles are given as they come, and the frames are named.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mocap_skel.segments.pose import Array

AXES = "XYZ"
# Degrees of the middle angle from where the first and third turn are about one line.
LOCK = 10.0


def angles_of(rotation: Array, sequence: str) -> Array:
    """The angles (frames, 3), radians, of turns about three axes, each carried by the turns before it.

    R = R_1(a) R_2(b) R_3(c). Of three different axes b is -π/2 to π/2; where the third axis is the first one again
    (YXY), b is -π to 0, so that an arm that is raised to the right has a negative b, as Wu 2005 has it.

    Args:
        rotation: (frames, 3, 3); NaN = not known.
        sequence: such as "ZXY".

    Source: Diebel 2006, Representing Attitude, as products of elementary rotations.

    A quarter turn about z:

    >>> quarter = np.array([[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
    >>> np.degrees(angles_of(quarter, "ZXY")).round(6) + 0.0
    array([[90.,  0.,  0.]])
    """
    i, j, k = (AXES.index(axis) for axis in sequence)
    r = np.moveaxis(rotation, 0, -1)
    if i == k:
        third = 3 - i - j
        sign = 1.0 if (j - i) % 3 == 1 else -1.0
        # The sine of b is negative throughout.
        first = np.arctan2(-r[j, i], sign * r[third, i])
        second = -np.arctan2(np.hypot(r[j, i], r[third, i]), r[i, i])
        last = np.arctan2(-r[i, j], -sign * r[i, third])
    else:
        sign = 1.0 if (j - i) % 3 == 1 else -1.0
        first = np.arctan2(-sign * r[j, k], r[k, k])
        second = np.arctan2(sign * r[i, k], np.hypot(r[i, i], r[i, j]))
        last = np.arctan2(-sign * r[i, j], r[i, i])
    return np.stack([first, second, last], axis=-1)


def unwrapped(angles: Array) -> Array:
    """The same angles (frames, 3), radians, without jumps by a whole turn; gaps are stepped over.

    The first known frame keeps its place from -π to π.

    >>> unwrapped(np.radians([[179.0], [-179.0], [np.nan], [-178.0]])).round(3).ravel()
    array([3.124, 3.159,   nan, 3.176])
    """
    made = angles.copy()
    for column in made.T:
        known = np.isfinite(column)
        column[known] = np.unwrap(column[known])
    return made


def about_their_mean(angles: Array) -> Array:
    """The same angles (frames, 3), radians, each within half a turn of its mean direction.

    For a joint that cannot turn round and round: what one frame near gimbal lock adds, the next ones do not keep.

    >>> about_their_mean(np.radians([[170.0], [-170.0], [np.nan], [-175.0]])).round(3).ravel()
    array([-3.316, -2.967,    nan, -3.054])
    """
    with np.errstate(invalid="ignore"):
        way = np.nansum(np.exp(1j * angles), axis=0)
    mean = np.angle(way)
    return np.asarray(mean + np.angle(np.exp(1j * (angles - mean))))


def settled(angles: Array, lock: NDArray[np.bool_], sequence: str) -> Array:
    """The same angles (frames, 3), where each stretch between two locks of a YXY is about zero, by whole turns.

    An arm that hangs turns its first and third angle as it likes, by whole turns too, which say nothing afterwards.
    Other sequences stay as they are: a heading counts its turns.

    >>> turns = np.full((3, 3), 2 * np.pi) + [0.1, 0.0, 0.2]
    >>> settled(turns, np.array([False, True, False]), "YXY")[[0, 2], 0].round(3)
    array([0.1, 0.1])
    """
    if sequence[0] != sequence[2]:
        return angles
    made = angles.copy()
    # Frames of one stretch, locked or free, have one number.
    stretch = np.cumsum(np.diff(lock, prepend=lock[:1]))
    for column in (0, 2):
        for number in np.unique(stretch):
            here = (stretch == number) & np.isfinite(made[:, column])
            if here.any():
                whole = np.round(np.median(made[here, column]) / (2 * np.pi))
                made[here, column] -= 2 * np.pi * whole
    return made


def locked(angles: Array, sequence: str) -> NDArray[np.bool_]:
    """(frames,): whether the first and the third turn are nearly about one line."""
    middle = angles[:, 1]
    size = np.abs(np.sin(middle)) if sequence[0] == sequence[2] else np.abs(np.cos(middle))
    with np.errstate(invalid="ignore"):
        return np.asarray(size < np.sin(np.radians(LOCK)))


def angles_by_turn(rotation: Array, angles: Array, sequence: str) -> Array:
    """How fast the angles change with a small turn of the child: (frames, 3, 3), a vector along the child's axes.

    The inverse of the matrix whose columns are the axes of the three turns. Large near gimbal lock.

    Args:
        rotation: (frames, 3, 3).
        angles: its `angles_of`.
        sequence: of them.
    """
    i, j, k = (AXES.index(axis) for axis in sequence)
    # In the child's axes: the first axis is fixed in the parent, the last in the child, the middle turns with the last.
    first = rotation[:, i, :]
    cosine, sine = np.cos(angles[:, 2]), np.sin(angles[:, 2])
    last, middle = np.zeros_like(first), np.zeros_like(first)
    last[:, k] = 1.0
    # R_k(c)ᵀ e_j lies in the plane square to k.
    m = 3 - j - k
    sign = 1.0 if (j - k) % 3 == 1 else -1.0
    middle[:, j], middle[:, m] = cosine, -sign * sine
    rows = [np.cross(middle, last), np.cross(last, first), np.cross(first, middle)]
    volume = (rows[0] * first).sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.stack(rows, axis=1) / volume[:, None, None])

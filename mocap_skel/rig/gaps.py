"""Filling short gaps for formats that cannot say that something is missing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mocap_skel.segments.pose import Array


def runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Stretches of True as (start, stop).

    >>> runs(np.array([True, False, True, True]))
    [(0, 1), (2, 4)]
    """
    edges = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    return list(
        zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True)
    )


def fill_positions(track: Array) -> Array:
    """A track (frames, 3) with its gaps filled in straight lines; NaN = missing.

    The ends have to be known: nothing is known of what lies beyond them.

    >>> fill_positions(np.array([[0.0, 0, 0], [np.nan] * 3, [2.0, 0, 4]]))[1]
    array([1., 0., 2.])
    """
    known = np.isfinite(track[:, 0])
    at = np.arange(len(track))
    return np.stack([np.interp(at, at[known], column[known]) for column in track.T], axis=1)


def fill_rotations(rotation: Array) -> Array:
    """Rotations (frames, 3, 3) with gaps filled along the shortest turn at constant speed; NaN = missing.

    The ends have to be known.
    """
    known = np.isfinite(rotation[:, 0, 0])
    if known.all():
        return rotation
    filled = rotation.copy()
    for start, stop in runs(~known):
        before, after = rotation[start - 1], rotation[stop]
        share = np.arange(1, stop - start + 1) / (stop - start + 1)
        filled[start:stop] = before @ _turns(before.T @ after, share)
    return filled


def _turns(rotation: Array, shares: Array) -> Array:
    """A rotation (3, 3) turned through each share of its angle: (len(shares), 3, 3), by Rodrigues."""
    cosine = np.clip((np.trace(rotation) - 1.0) / 2.0, -1.0, 1.0)
    # The axis is the eigenvector to eigenvalue 1 of the symmetric part; it is stable at half a turn,
    # where the antisymmetric part vanishes and gives the sign only.
    _, vectors = np.linalg.eigh(rotation + rotation.T)
    axis = vectors[:, -1]
    twist = np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    if axis @ twist < 0:
        axis = -axis
    angle = np.arctan2(np.linalg.norm(twist) / 2.0, cosine)
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    turn = (shares * angle)[:, None, None]
    return np.asarray(np.eye(3) + np.sin(turn) * cross + (1.0 - np.cos(turn)) * cross @ cross)

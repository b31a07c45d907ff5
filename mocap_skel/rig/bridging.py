"""Turns where nothing is seen: bridged by the motion before and after, held at the ends, eased where too fast."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mocap_skel.rig.blocks import (
    angle_between,
    multiply,
    orthonormal,
    rotation,
    rotation_vector,
    transposed,
)
from mocap_skel.segments.pose import Array

# Frames on each side of a gap that tell how fast the turn was.
SIDE = 8
# Seconds: over so long a gap the speed at its ends tells a quarter of what it tells over a short one; an arm
# swings to and fro in about a second.
MEMORY = 0.25


def runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Stretches of True as (start, stop).

    Example:
        >>> import numpy as np
        >>> runs(np.array([True, False, True, True]))
        [(0, 1), (2, 4)]
    """
    edges = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    return list(
        zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True)
    )


def bridged(turn: Array, known: NDArray[np.bool_], rate: float) -> Array:
    """Turns (3, 3, F) with those that are not known filled in.

    Inside, by a cubic in the rotation vector from the last known turn, with the speeds before and after the
    gap; at the ends the nearest known turn is held; without any it is no turn.
    """
    out = np.where(known, turn, np.eye(3)[:, :, None])
    if not known.any():
        return out
    for start, stop in runs(~known):
        if start == 0:
            out[..., :stop] = turn[..., stop, None]
        elif stop == len(known):
            out[..., start:] = turn[..., start - 1, None]
        else:
            out[..., start:stop] = _cubic(turn, known, start, stop, rate)
    return out


def _cubic(turn: Array, known: NDArray[np.bool_], start: int, stop: int, rate: float) -> Array:
    before = turn[..., start - 1]
    length = stop - start + 1
    whole = rotation_vector(before.T @ turn[..., stop])
    share = min(1.0, MEMORY * rate / length)
    low, high = start - 1, stop
    while low > max(0, start - 1 - SIDE) and known[low - 1]:
        low -= 1
    while high < min(len(known) - 1, stop + SIDE) and known[high + 1]:
        high += 1
    leaving, arriving = (
        whole + share * (length * _speed(before, turn[..., a : b + 1]) - whole)
        for a, b in ((low, start - 1), (stop, high))
    )
    t = np.arange(1, length) / length
    vector = (
        np.outer(leaving, t**3 - 2 * t**2 + t)
        + np.outer(arriving, t**3 - t**2)
        + np.outer(whole, 3 * t**2 - 2 * t**3)
    )
    return np.asarray(np.einsum("ij,jkf->ikf", before, rotation(vector)))


def _speed(axes: Array, turn: Array) -> Array:
    """(3,): mean turn from frame to frame of (3, 3, F), in the given axes."""
    if turn.shape[2] < 2:
        return np.zeros(3)
    step = rotation_vector(multiply(turn[..., 1:], transposed(turn[..., :-1])))
    return np.asarray(axes.T @ step.mean(axis=1))


def bridged_places(track: Array, known: NDArray[np.bool_]) -> Array:
    """Places (3, F), the gaps inside filled in straight lines, the ends held; zero without any known."""
    at = np.arange(track.shape[1])
    if not known.any():
        return np.zeros_like(track)
    return np.stack([np.interp(at, at[known], row[known]) for row in track])


def smoothed(turn: Array, frames: float) -> Array:
    """Turns (3, 3, F), each the mean of those around it by a Gaussian of a standard deviation in frames."""
    reach = min(int(3.0 * frames + 0.5), (turn.shape[2] - 1) // 2)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / frames) ** 2)
    rows = [np.convolve(row, kernel, "same") for row in turn.reshape(9, -1)]
    # The kernel leaves the clip at its ends, which makes the sum shorter and turns it no other way.
    return orthonormal(np.stack(rows).reshape(turn.shape) / kernel.sum())


def steps(turn: Array) -> Array:
    """(F - 1,): how far turns (3, 3, F) go from frame to frame, radians."""
    return angle_between(turn[..., :-1], turn[..., 1:])


def eased(turn: Array, limit: float) -> tuple[Array, NDArray[np.bool_]]:
    """Turns (3, 3, F) no step of which is longer than a limit (radians), and the frames that changed.

    Around each longer step the frames are widened until the turn over all of them keeps the limit, and are
    replaced by a turn at constant speed.
    """
    out, changed = turn.copy(), np.zeros(turn.shape[2], dtype=bool)
    last = turn.shape[2] - 1
    fast = runs(steps(out) > limit)
    while fast:
        for low, high in fast:
            whole = np.full(3, np.inf)
            while np.linalg.norm(whole) > 0.9 * limit * (high - low) and (low > 0 or high < last):
                low, high = max(0, low - 1), min(last, high + 1)
                whole = rotation_vector(out[..., low].T @ out[..., high])
            share = np.arange(1, high - low) / (high - low)
            out[..., low + 1 : high] = np.einsum(
                "ij,jkf->ikf", out[..., low], rotation(np.outer(whole, share))
            )
            changed[low + 1 : high] = True
        slower = runs(steps(out) > limit)
        if slower == fast:
            break
        fast = slower
    return out, changed

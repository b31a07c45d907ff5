"""Samples that a program has filled in: a marker nearly at rest, or smoother than any camera's, off its neighbours.

A gap that is filled by a spline has none of the noise of the cameras; one that is filled by the last place, with a
little noise on it, does not move. Both happen to real markers too, on a foot that stands or in filtered
data. So the neighbours decide: a sample counts as filled only if its distances to most of the markers that
best keep theirs to it are what they never are outside the stretch. What is filled rightly does no harm, and stays.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from mocap_skel.readers.repeated import FRAMES, MATES, SPREADS, distances, median, travels

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Seconds of a block, and blocks of a stretch at least: in a step a foot stands for 0.6 s.
_BLOCK, _BLOCKS = 0.25, 4
# Metres, and standard deviations of the clip's noise, within which a marker stays in a block if it rests: 30
# samples of Gaussian noise span 4 of them.
_REST, _NOISES = 0.0006, 6.0
# Share of a marker's usual roughness that no camera gives.
_SMOOTH = 0.2
# Metres, and share of itself, that a distance is off at least: skin carries a marker as far.
_OFF, _SHARE = 0.02, 0.1
# Share of a stretch in which it is off.
_LONG = 0.25

FILLED = (
    "filled",
    "samples that rest, or are smoother than measured ones, and are not in their place among the other markers",
)
"""What such samples are called, in a word and in words."""


def filled(points: Array, subjects: Sequence[str], rate: float) -> Mask | None:
    """Samples that rest, or are smooth, for a second and more, and are not where their neighbours have them.

    Args:
        points: (frames, markers, 3), metres, NaN = missing.
        subjects: one a marker: only markers of the same subject are compared.
        rate: frames a second.

    Returns:
        The samples (frames, markers), or None where there are none.

    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> way = np.linspace(0, 4, 600)[:, None, None] + 0.3 * rng.normal(size=(5, 3))
    >>> points = way + 0.001 * rng.normal(size=(600, 5, 3))
    >>> points[200:400, 2] = points[199, 2] + 0.0001 * rng.normal(size=(200, 3))
    >>> frames, markers = np.nonzero(filled(points, [""] * 5, 100.0))
    >>> bool(frames.min() < 205), bool(frames.max() > 395), set(markers.tolist())
    (True, True, {2})
    """
    size = round(_BLOCK * rate)
    count = len(points) // size if size > 3 else 0
    if count < 2 * _BLOCKS or points.shape[1] <= MATES:
        return None
    blocks = points[: count * size].reshape(count, size, -1, 3)
    # The last differences of a block would need the next one's samples; a few less tell as much.
    rough = np.sqrt((np.diff(blocks, n=3, axis=1) ** 2).mean(axis=(1, 3)))
    usual = median(rough)
    noise = float(np.nanmedian(usual)) / np.sqrt(20.0) if np.isfinite(usual).any() else 0.0
    limit = max(_REST, _NOISES * noise)
    rests = np.ptp(blocks, axis=1).max(axis=-1) <= limit
    smooth = rough <= _SMOOTH * usual
    odd = rests | smooth
    out = np.zeros(points.shape[:2], dtype=np.bool_)
    doubtful = np.repeat(odd, size, axis=0)
    names = np.asarray(subjects)
    for marker, first, last in _runs(odd):
        start, stop = first * size, last * size
        if _off_its_mates(points, names, doubtful, marker, start, stop):
            start, stop = _extended(points[:, marker], start, stop)
            out[start:stop, marker] = True
    return out if out.any() else None


def _runs(odd: Mask) -> Iterator[tuple[int, int, int]]:
    """(marker, first block, block behind the last) of every run of `_BLOCKS` or more."""
    for marker in np.flatnonzero(odd.sum(axis=0) >= _BLOCKS).tolist():
        padded = np.concatenate([[False], odd[:, marker], [False]])
        for first, last in np.flatnonzero(padded[1:] != padded[:-1]).reshape(-1, 2).tolist():
            if last - first >= _BLOCKS:
                yield marker, first, last


def _off_its_mates(
    points: Array, names: NDArray[np.str_], doubtful: Mask, marker: int, start: int, stop: int
) -> bool:
    """Whether the distances to the markers that best keep theirs are, within a stretch, what they are not elsewhere."""
    outside = np.isfinite(points[: len(doubtful), marker, 0]) & ~doubtful[:, marker]
    frames = np.flatnonzero(outside)
    if len(frames) < stop - start and len(frames) < FRAMES:
        return False
    seen = np.isfinite(points[start:stop, :, 0]) & ~doubtful[start:stop]
    mates = (names == names[marker]) & (2 * seen.sum(axis=0) > stop - start)
    mates[marker] = False
    others = np.flatnonzero(mates)
    if len(others) < MATES or not travels(points[frames], marker, others):
        return False
    usual = distances(points, marker, others, frames[:: 1 + len(frames) // FRAMES])
    enough = 2 * np.isfinite(usual).sum(axis=0) > len(usual)
    usual, others = usual[:, enough], others[enough]
    if len(others) < MATES:
        return False
    middle = median(usual)
    spread = 1.4826 * median(np.abs(usual - middle))
    bound = np.maximum(np.maximum(SPREADS * spread, _SHARE * middle), _OFF)
    # Of a hand beside a thigh the distance tells nothing.
    best = np.argsort(bound, kind="stable")[:MATES]
    inside = np.arange(start, stop)[:: 1 + (stop - start) // FRAMES]
    off = np.abs(distances(points, marker, others[best], inside) - middle[best]) > bound[best]
    return bool((off.sum(axis=1) > MATES / 2).mean() > _LONG)


def _extended(track: Array, start: int, stop: int) -> tuple[int, int]:
    """A stretch with the samples on both sides that are as smooth as it is, and as near."""
    with np.errstate(invalid="ignore"):
        steps = np.linalg.norm(np.diff(track, axis=0), axis=1)
        bends = np.linalg.norm(np.diff(track, n=3, axis=0), axis=1)
        # Of more samples the largest is larger, and a spline may be faster towards its ends.
        step, bend = 2 * steps[start : stop - 1].max(), 2 * bends[start : stop - 3].max()
        while start > 0 and steps[start - 1] <= step and bends[start - 1] <= bend:
            start -= 1
        while stop < len(track) and steps[stop - 1] <= step and bends[stop - 3] <= bend:
            stop += 1
    return start, stop

"""How constant the distance between every two markers is, and which markers move together."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Frames that are summed at once: their features then stay in the cache.
CHUNK = 64
MOST = 400
"""Markers that are compared with each other at the most: a table of pairs grows with the square of their number.
The largest marker sets have some 150, with both hands and a face 300."""

# Multiplications of one product that OpenBLAS leaves to one thread.
ONE_THREAD = 250_000
# Fewer frames together say nothing about a distance.
LEAST_FRAMES = 10
# A gap between the heights of two joins is clear where the second is so many times the first; and how far
# above the typical nearest marker's spread it is looked for.
CLEAR_GAP = 2.0
FARTHEST_GAP = 6.0


@dataclass(frozen=True, eq=False)
class Distances:
    """The distances between every two of M markers, over the frames that show both.

    Attributes:
        count: (M, M) frames.
        mean: (M, M) root mean square distance, metres; NaN where there are fewer than LEAST_FRAMES.
        spread: (M, M) standard deviation of the distance, metres; NaN likewise. From the moments of the
            squared distance: sd(d²) / 2 rms(d), which is that of d to first order.
    """

    count: Array
    mean: Array
    spread: Array


def distances(points: Array) -> Distances:
    """Mean and spread of the distances between every two markers, from points (F, M, 3), metres, NaN = missing.

    One pass, as matrix products: with q = |x|² and p = xᵀy, |x - y|² = q_x + q_y - 2p, and its square is
    q_x² + q_y² + 2 q_x q_y + 4p² - 4 q_x p - 4 q_y p. Every term is a sum of products of something of x
    and something of y, p² of the six products of two coordinates. A missing marker's features are zero,
    so a pair's sums hold the frames that show both.

    >>> still = np.zeros((50, 3))
    >>> swinging = np.stack([np.cos(np.arange(50)), np.sin(np.arange(50)), np.arange(50.0)], axis=1)
    >>> found = distances(np.stack([still, still + [0.3, 0, 0], swinging], axis=1))
    >>> bool(found.spread[0, 1] < 1e-6), bool(found.spread[0, 2] > 1)
    (True, True)
    """
    frames, count = points.shape[:2]
    middle = _middles(points)
    n = np.zeros((count, count))
    first, second = np.zeros_like(n), np.zeros_like(n)
    for k in range(0, frames, CHUNK):
        x = (points[k : k + CHUNK] - middle[k : k + CHUNK, None]).transpose(1, 2, 0)
        there: NDArray[np.bool_] = np.asarray(np.isfinite(x).all(axis=1))
        x = np.where(there[:, None], x, 0.0)
        seen = there[:, None].astype(np.float64)
        q = np.einsum("mdf,mdf->mf", x, x)[:, None]
        twice = x[:, _FIRST] * x[:, _SECOND]
        n += _sums([seen], [seen])
        first += _sums([q, seen, -2 * x], [seen, q, x])
        second += _sums(
            [q * q, seen, 2 * q, twice * _TIMES, -4 * q * x, x],
            [seen, q * q, q, twice, x, -4 * q * x],
        )
    few = n < LEAST_FRAMES
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(few, np.nan, first / n)
        variance = np.maximum(second / n - mean**2, 0.0)
        mean = np.sqrt(np.maximum(mean, 0.0))
        spread = np.sqrt(variance) / (2 * mean)
    spread[~(mean > 0)] = np.nan
    np.fill_diagonal(spread, np.nan)
    return Distances(n, mean, spread)


# The products of two coordinates, with 4 for p², and twice that where two terms are the same.
_FIRST, _SECOND = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]
_TIMES = np.array([4.0, 4.0, 4.0, 8.0, 8.0, 8.0])[:, None]


def _sums(left: list[Array], right: list[Array]) -> Array:
    """(M, M): Σ over frames and features.

    In products small enough for BLAS to do in one thread: on a busy machine its threads wait for each
    other ten times longer than they work.
    """
    count = len(left[0])
    a, b = (np.concatenate(side, axis=1).reshape(count, -1) for side in (left, right))
    if 4 * count**2 > ONE_THREAD:
        # The blocks below have a table of all pairs each: hundreds of them where there are many markers.
        return np.asarray(a @ b.T)
    width = ONE_THREAD // count**2
    whole = a.shape[1] // width * width
    blocks = (s[:, :whole].reshape(count, -1, width).swapaxes(0, 1) for s in (a, b))
    one, other = blocks
    total = (one @ other.swapaxes(1, 2)).sum(axis=0) if whole else 0.0
    return np.asarray(total + a[:, whole:] @ b[:, whole:].T)


def most_seen(points: Array, first: NDArray[np.bool_], most: int = MOST) -> NDArray[np.intp]:
    """Which markers to compare where there are too many: the first ones, then those that are seen longest.

    Args:
        points: (F, M, 3), NaN = missing.
        first: (M,) markers that go before all others.
        most: how many are taken.

    Returns:
        Their columns, in the clip's order.

    >>> gappy = np.ones((4, 3, 3))
    >>> gappy[1:, 1] = np.nan
    >>> most_seen(gappy, np.array([False, False, True]), 2).tolist()
    [0, 2]
    """
    seen = np.isfinite(points[..., 0]).sum(axis=0)
    return np.sort(np.lexsort((-seen, ~first))[:most])


def _middles(points: Array) -> Array:
    """The mean of the visible markers of each frame, (F, 3): taken away, it leaves distances with less rounding."""
    seen = np.isfinite(points[..., 0])
    count = np.maximum(seen.sum(axis=1), 1)[:, None]
    return np.asarray(np.where(seen[..., None], points, 0.0).sum(axis=1) / count)


def rigid_groups(spread: Array) -> list[list[int]]:
    """Group the markers that move together, by the spreads (M, M) of their distances; the largest group first.

    Complete linkage: two groups become one while all their distances are constant. How constant is
    decided by the first clear gap in the heights at which groups join, not far above what the closest
    markers of the clip show: that gap lies between noise and skin on one side, joints on the other.

    Returns:
        The indices of the markers of each group; every marker is in one.

    >>> spread = np.full((4, 4), 0.05)
    >>> spread[0, 2] = spread[2, 0] = spread[1, 3] = spread[3, 1] = 0.001
    >>> rigid_groups(spread)
    [[0, 2], [1, 3]]
    """
    count = len(spread)
    if count < 2:
        return [[i] for i in range(count)]
    heights = [height for height, _, _ in _joins(spread, np.inf)]
    limit = _limit(np.array(heights), spread)
    groups = {i: [i] for i in range(count)}
    for _, i, j in _joins(spread, limit):
        groups[i] += groups.pop(j)
    return sorted((sorted(g) for g in groups.values()), key=lambda g: (-len(g), g))


def _limit(heights: Array, spread: Array) -> float:
    """Metres: the height in the middle of the first clear gap, or of the widest there is."""
    nearest = np.where(np.isfinite(spread), spread, np.inf).min(axis=1)
    nearest = nearest[np.isfinite(nearest)]
    if not len(nearest) or len(heights) < 2:
        return 0.0
    typical = float(np.median(nearest))
    ratio = heights[1:] / np.maximum(heights[:-1], 1e-9)
    inside = (heights[:-1] >= typical) & (heights[:-1] <= FARTHEST_GAP * typical)
    if not inside.any():
        return CLEAR_GAP * typical
    ratio = np.where(inside, ratio, 0.0)
    clear = np.flatnonzero(ratio >= CLEAR_GAP)
    k = int(clear[0]) if len(clear) else int(ratio.argmax())
    return float(np.sqrt(max(heights[k], 1e-9) * heights[k + 1]))


def _joins(spread: Array, limit: float) -> Iterator[tuple[float, int, int]]:
    """(height, i, j): group j joins group i, in the order of complete linkage, up to a height."""
    far = np.where(np.isfinite(spread), spread, np.inf)
    np.fill_diagonal(far, np.inf)
    while True:
        i, j = (int(k) for k in np.unravel_index(far.argmin(), far.shape))
        height = float(far[i, j])
        if not height < min(limit, np.inf):
            return
        i, j = min(i, j), max(i, j)
        far[i] = far[:, i] = np.maximum(far[i], far[j])
        far[i, i] = np.inf
        far[j] = far[:, j] = np.inf
        yield height, i, j

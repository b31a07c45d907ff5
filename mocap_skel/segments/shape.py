"""The rigid shape of a segment's markers: its template, how rigid it is, and the pose onto it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from mocap_skel.segments.pose import (
    LINE,
    Array,
    Pose,
    by_rows,
    least_squares_pose,
    triad,
    triad_pose,
    wahba,
)

# A marker's weight in the pose varies by no more than this, so that one that happens to fit the
# others well does not become the whole segment.
WEIGHT_RATIO = 10.0


@dataclass(frozen=True, eq=False)
class Shape:
    """A rigid set of points in the segment's own coordinates.

    The origin is the markers' centroid; the axes are the thesis's three-point frame of the
    best-placed three of them, always the same three.

    Attributes:
        template: (M, 3), metres; NaN for a marker that is never seen with three others.
        weights: (M,), inverse variance about the template, relative, the largest 1.
        chosen: the three points of the axes, as indices.
        sigma: noise standard deviation per coordinate that the rigid residuals show, metres; robust.
    """

    template: Array
    weights: Array
    chosen: tuple[int, int, int]
    sigma: float

    def pose(self, points: Array) -> Pose:
        """Least-squares pose of points (frames, M, 3), NaN = missing."""
        weights = self.weights * np.isfinite(self.template[:, 0])
        return least_squares_pose(points, np.nan_to_num(self.template), weights)

    def triad_pose(self, points: Array) -> Pose:
        """Pose from the chosen three points alone, the thesis's case 1."""
        return triad_pose(points, self.template, self.chosen)


def find_shape(points: Array, squares: Array | None = None) -> tuple[Shape, Pose] | None:
    """The rigid shape of a segment's markers, and its least-squares pose in every frame.

    Closed form and blind to the order of frames: median squared distances give the configuration by
    classical scaling (Torgerson 1952), poses onto it give each point's median place and spread.

    Args:
        points: (frames, M, 3), metres, NaN = missing.
        squares: (M, M), squared median distances, m², where they are known already.

    Returns:
        None if fewer than three points are ever seen together, or if they lie on a line.

    Example:
        >>> import numpy as np
        >>> places = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.4, 0], [0, 0, 0.1]])
        >>> shape, pose = find_shape(np.tile(places, (50, 1, 1)))
        >>> print(np.linalg.norm(shape.template[1] - shape.template[2]).round(9))
        0.5
        >>> pose.to_lab(shape.template[1])[0].round(9) + 0.0
        array([0.3, 0. , 0. ])
    """
    x = by_rows(points)
    template = _scaling(x, _squares(x) if squares is None else squares)
    if template is None:
        return None
    count = len(template)
    usable = np.isfinite(template[:, 0])
    weights = np.where(usable, 1.0, 0.0)
    template = np.nan_to_num(template)
    sigma = 0.0
    # The first round places points that were not seen with all the others and measures how rigid
    # each is, the second uses that, the third is the pose. Three points leave nothing to weigh.
    for turn in range(3 if count > 3 else 1):
        rotation, origin = wahba(x, template, weights)
        if turn == 2:
            break
        inside = np.einsum("jif,mjf->mif", rotation, x - origin)
        placed = median(inside)
        usable = np.isfinite(placed[:, 0])
        if usable.sum() < 3:
            return None
        error = ((inside - placed[..., None]) ** 2).sum(axis=1)
        if turn == 0:
            sigma = _noise(error)
        if count > 3:
            template = np.nan_to_num(placed)
            weights = np.where(usable, _weights(error), 0.0)
        del inside, error
    chosen = _best_three(template, np.isfinite(x[:, 0]) & usable[:, None])
    if chosen is None:
        return None
    middle = template[usable].mean(axis=0)
    axes = triad(*(template[None, i] for i in chosen)).rotation[0]
    origin = origin + np.einsum("ijf,j->if", rotation, middle)
    pose = Pose(rotation.transpose(2, 0, 1) @ axes, np.ascontiguousarray(origin.T))
    template = np.where(usable[:, None], (template - middle) @ axes, np.nan)
    return Shape(template, weights, chosen, sigma), pose


def median(values: Array) -> Array:
    """Upper median over the last axis, NaN left out; NaN for a row without numbers.

    np.median costs three times as much for short rows, np.nanmedian thirty times; both, like
    np.unique, import numpy.ma, 20 ms of a cold start.

    Args:
        values: (..., N).

    Returns:
        (...), of an even count of numbers the larger of the two in the middle.

    Example:
        >>> import numpy as np
        >>> median(np.array([[4.0, 1.0, np.nan, 3.0], [1.0, 2.0, 3.0, 4.0]]))
        array([3., 3.])
    """
    if not values.shape[-1]:
        return np.full(values.shape[:-1], np.nan)
    count = np.isfinite(values).sum(axis=-1)
    ranks = sorted(set((count // 2).ravel().tolist()))
    # NaN sorts behind every number, so the k-th place of the sorted row is all that is needed.
    placed = np.partition(values, np.minimum(ranks, values.shape[-1] - 1), axis=-1)
    if len(ranks) == 1:
        return np.asarray(placed[..., min(ranks[0], values.shape[-1] - 1)])
    rank = np.minimum(count // 2, values.shape[-1] - 1)
    return np.asarray(np.take_along_axis(placed, rank[..., None], axis=-1)[..., 0])


def _squares(x: Array) -> Array:
    """Squared median distances (M, M) of the points x (M, 3, F)."""
    square = np.zeros((len(x), len(x)))
    for i, j in combinations(range(len(x)), 2):
        away = x[i] - x[j]
        square[i, j] = square[j, i] = median(np.einsum("df,df->f", away, away))
    return square


def _scaling(x: Array, square: Array) -> Array | None:
    """A configuration (M, 3) of the points x (M, 3, F), NaN for points not seen with the others."""
    count = len(x)
    seen = np.isfinite(x[:, 0]).sum(axis=1)
    core: list[int] = []
    for i in np.argsort(-seen, kind="stable"):
        if seen[i] and np.isfinite(square[i, core]).all():
            core.append(int(i))
    if len(core) < 3:
        return None
    part = square[np.ix_(core, core)]
    centre = np.eye(len(core)) - 1.0 / len(core)
    values, vectors = np.linalg.eigh(-0.5 * centre @ part @ centre)
    extent = np.sqrt(np.maximum(values[-3:], 0.0))
    if not extent[1] > LINE * extent[2]:
        return None
    shape = np.full((count, 3), np.nan)
    shape[core] = vectors[:, -3:] * extent
    if len(core) == 3:
        return shape
    # Distances cannot tell a shape from its mirror image; the data can: the determinant of
    # Σ (x - x̄) tᵀ over what a frame shows is positive for the shape and negative for its mirror image.
    known = x[core]
    seen_now = np.asarray(np.isfinite(known).all(axis=1))[:, None]
    enough = seen_now.sum(axis=0)[0] > 3
    known, seen_now = known[..., enough], seen_now[..., enough]
    mean = np.where(seen_now, known, 0.0).sum(axis=0) / seen_now.sum(axis=0)
    away = np.where(seen_now, known - mean, 0.0)
    turned = np.linalg.det(np.einsum("mif,mj->fij", away, shape[core]))
    if (turned < 0).sum() > (turned > 0).sum():
        shape[:, 0] *= -1.0
    return shape


def _noise(error: Array) -> float:
    """Noise standard deviation per coordinate from squared distances to the template, (M, F).

    A frame with n points has 3n - 6 degrees of freedom left after its pose; the median over frames
    is divided by the median of χ² (Wilson & Hilferty 1931), so that bad frames do not count.
    """
    seen = np.isfinite(error)
    freedom = 3 * seen.sum(axis=0) - 6
    usable = freedom > 0
    if not usable.any():
        return 0.0
    total = np.where(seen, error, 0.0).sum(axis=0)[usable]
    k = freedom[usable]
    return float(np.sqrt(median(total / (k * (1.0 - 2.0 / (9.0 * k)) ** 3))))


def _weights(error: Array) -> Array:
    """(M,): inverse median squared distance to the template, the largest 1."""
    spread = median(error)
    largest = np.nanmax(spread)
    if not largest > 0:
        return np.ones(len(spread))
    spread = np.maximum(np.nan_to_num(spread, nan=largest), largest / WEIGHT_RATIO)
    return np.asarray(spread.min() / spread)


def _best_three(template: Array, seen: NDArray[np.bool_]) -> tuple[int, int, int] | None:
    """The three points that are seen together most often and stand farthest from a line."""
    threes = np.array(list(combinations(range(len(template)), 3)))
    a, b, c = (template[threes[:, k]] for k in range(3))
    sides = np.stack([np.linalg.norm(v, axis=1) for v in (b - a, c - a, c - b)])
    half = sides.sum(axis=0) / 2
    area = np.sqrt(np.maximum(half * (half - sides).prod(axis=0), 0.0))
    together = np.ones(len(threes))
    if not seen.all():
        together = seen[threes].all(axis=1).mean(axis=1)
    score = together * area / np.maximum(sides.max(axis=0), 1e-12)
    # Of scores that differ by rounding only the first counts, or the axes would hang on rounding.
    best = int(np.argmax(score >= score.max() * (1 - 1e-6)))
    return (*map(int, threes[best]),) if score[best] > 0 else None  # type: ignore[return-value]

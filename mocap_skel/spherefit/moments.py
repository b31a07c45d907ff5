"""Central moments of points: all that a closed-form sphere fit needs to know of them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Moments:
    """Moments of point sets in D dimensions; any leading axes are a batch (markers, joints, subsets).

    With d = x - mean, sums run over the points and are divided by N - 1 (x̄, C and S of thesis 6.6,
    docs/method.md). Those of a part of a batch come by index: ``m[2]``, ``m[:, None]``.

    Attributes:
        count: number of points, shape (...).
        mean: x̄, shape (..., D), metres.
        covariance: C = Σ d dᵀ / (N-1), shape (..., D, D), m².
        third: S = Σ d |d|² / (N-1), shape (..., D), m³.
        fourth: Σ |d|⁴ / (N-1), shape (...), m⁴; it makes residuals and the Pratt fit possible
            without a second pass over the points.

    Example:
        >>> from mocap_skel.spherefit import Moments, sphere_moments
        >>> m = sphere_moments([[0.0, 0.0], [2.0, 0.0], [4.0, 0.0]])
        >>> isinstance(m, Moments), float(m.count), m.mean.tolist(), m.covariance.tolist()
        (True, 3.0, [2.0, 0.0], [[4.0, 0.0], [0.0, 0.0]])
    """

    count: Array
    mean: Array
    covariance: Array
    third: Array
    fourth: Array

    def __getitem__(self, index: Any) -> Moments:
        """A part of the batch: the index goes to the leading axes."""
        return Moments(
            self.count[index],
            self.mean[index],
            self.covariance[index],
            self.third[index],
            self.fourth[index],
        )


# Points that are worked on at once: their features then stay in the cache, and nothing that grows with
# the number of points is ever allocated.
CHUNK = 1 << 14
# Points of each set that are looked at for a place to measure from.
_LOOKED_AT = 32


def sphere_moments(points: ArrayLike) -> Moments:
    """Moments of points: one pass over them, in memory that does not grow with their number.

    A point with a NaN or an infinity in any coordinate is dropped. Fewer than two points have zero moments,
    none at all the mean zero.

    Args:
        points: (..., N, D), metres.

    Returns:
        Moments of batch shape (...).

    Raises:
        ValueError: the array has fewer than two axes.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.spherefit import sphere_moments
        >>> clip = np.random.default_rng(0).normal(size=(1000, 41, 3))  # frames, markers, coordinates
        >>> sphere_moments(clip.swapaxes(0, 1)).covariance.shape
        (41, 3, 3)
    """
    x = np.asarray(points)
    if x.dtype.kind not in "fiu":
        x = x.astype(np.float64)
    if x.ndim < 2:
        raise ValueError(f"points must have shape (..., N, D), got {x.shape}")
    *batch, size, dimension = x.shape
    sets = math.prod(batch)
    x = x.reshape(sets, size, dimension)
    # Coordinates are metres from the origin while spheres are centimetres wide: squares are taken
    # about a place among the points, or the digits that matter would be lost.
    place = _place(x)
    count = np.zeros(sets)
    gram = np.zeros((sets, dimension + 2, dimension + 1))
    at_once = max(1, CHUNK // max(size, 1))
    buffer = np.empty((min(at_once, sets), dimension + 2, min(size, CHUNK)))
    for i in range(0, sets, at_once):
        group = slice(i, i + at_once)
        for k in range(0, size, CHUNK):
            count[group] += _add_sums(x[group, k : k + CHUNK], place[group], buffer, gram[group])
    return central_moments(
        count.reshape(batch),
        place.reshape(*batch, dimension),
        gram.reshape(*batch, *gram.shape[1:]),
    )


def _place(x: Array) -> Array:
    """(B, D): the mean of some points of each set, spread over all of it, that have no NaN."""
    some = x[:, :: max(x.shape[1] // _LOOKED_AT, 1)].astype(np.float64)
    missing: NDArray[np.bool_] = np.asarray(~np.isfinite(some).all(axis=2))
    if missing.any():
        some[missing] = 0.0
        for lost in np.flatnonzero(missing.all(axis=1)):
            for k in range(0, x.shape[1], CHUNK):
                there = np.flatnonzero(np.isfinite(x[lost, k : k + CHUNK]).all(axis=1))
                if len(there):
                    some[lost, 0], missing[lost, 0] = x[lost, k + there[0]], False
                    break
    count = some.shape[1] - missing.sum(axis=1)
    return np.asarray(some.sum(axis=1) / np.maximum(count, 1)[:, None])


def _add_sums(x: Array, place: Array, buffer: Array, gram: Array) -> Array:
    """Add the sums of f gᵀ over points x (B, N, D), with d = x - place, f = (d, |d|², 1), g = (d, |d|²).

    Returns:
        (B,) how many points there were.
    """
    sets, size, dimension = x.shape
    features = buffer[:sets, :, :size]
    d = features[:, :dimension]
    features[:, -1] = 1.0
    with np.errstate(invalid="ignore", over="ignore"):
        np.subtract(x.swapaxes(1, 2), place[..., None], out=d)
        np.einsum("bdn,bdn->bn", d, d, out=features[:, -2])
        # f gᵀ, not f fᵀ: for a matrix times its own transpose, BLAS's symmetric routine is slower.
        product = features @ features[:, :-1].swapaxes(1, 2)
        if np.isfinite(product).all():
            gram += product
            return np.full(sets, float(size))
        missing: NDArray[np.bool_] = np.asarray(~np.isfinite(d).all(axis=1))
        np.copyto(features, 0.0, where=missing[:, None])
        gram += features @ features[:, :-1].swapaxes(1, 2)
    return np.asarray(size - missing.sum(axis=1), dtype=np.float64)


def central_moments(count: Array, place: Array, gram: Array) -> Moments:
    """Moments about the mean from sums about a place near it.

    Args:
        count: (...), number of points.
        place: (..., D).
        gram: (..., D + 2, D + 1), Σ f gᵀ with d = x - place, f = (d, |d|², 1), g = (d, |d|²).
    """
    some = np.maximum(count, 1.0)[..., None]
    h = gram[..., -1, :-1] / some
    hh = np.einsum("...d,...d->...", h, h)
    c = gram[..., :-2, :-1]
    s, fourth = gram[..., :-2, -1], gram[..., -2, -1]
    ch = (c @ h[..., None])[..., 0]
    trace = gram[..., -1, -1]
    n = count[..., None]
    below = np.maximum(n - 1.0, 1.0)
    cross = n[..., None] * h[..., :, None] * h[..., None, :]
    return Moments(
        count,
        place + h,
        (c - cross) / below[..., None],
        (s - 2 * ch - (trace[..., None] - 2 * n * hh[..., None]) * h) / below,
        (fourth - 4 * np.einsum("...d,...d->...", s - ch, h) + (2 * trace - 3 * count * hh) * hh)
        / below[..., 0],
    )


def merge_moments(a: Moments, b: Moments) -> Moments:
    """Moments of the union of two disjoint point sets, exact (Chan et al. 1983; Pébay 2008).

    Args:
        a, b: moments whose batch shapes broadcast.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.spherefit import merge_moments, sphere_moments
        >>> x = np.random.default_rng(0).normal(size=(100, 3))
        >>> both = merge_moments(sphere_moments(x[:30]), sphere_moments(x[30:]))
        >>> np.allclose(both.third, sphere_moments(x).third)
        True
    """
    n = a.count + b.count
    mean = (a.count[..., None] * a.mean + b.count[..., None] * b.mean) / np.maximum(n, 1.0)[
        ..., None
    ]
    below = np.maximum(n - 1.0, 1.0)
    (c1, s1, f1), (c2, s2, f2) = (_sums_about(m, mean) for m in (a, b))
    return Moments(
        n,
        mean,
        (c1 + c2) / below[..., None, None],
        (s1 + s2) / below[..., None],
        (f1 + f2) / below,
    )


def moved_moments(m: Moments, rotation: Array, shift: Array) -> Moments:
    """Moments of the points y = rotation x + shift.

    Args:
        m: moments of the points x, any batch shape.
        rotation: (D, D).
        shift: (D,), metres.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.spherefit import moved_moments, sphere_moments
        >>> x = np.random.default_rng(0).normal(size=(100, 3))
        >>> turn, shift = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.array([1, 2, 3])
        >>> moved = moved_moments(sphere_moments(x), turn, shift)
        >>> np.allclose(moved.third, sphere_moments(x @ turn.T + shift).third)
        True
    """
    turned = rotation @ m.covariance @ rotation.T
    return Moments(m.count, m.mean @ rotation.T + shift, turned, m.third @ rotation.T, m.fourth)


def _sums_about(m: Moments, centre: Array) -> tuple[Array, Array, Array]:
    """Σ d dᵀ, Σ d |d|² and Σ |d|⁴ of a set whose deviations d are taken from another centre."""
    below = np.maximum(m.count - 1.0, 0.0)
    h = m.mean - centre
    hh = np.einsum("...d,...d->...", h, h)
    c = below[..., None, None] * m.covariance
    s = below[..., None] * m.third
    trace = np.trace(c, axis1=-2, axis2=-1)
    ch = np.einsum("...de,...e->...d", c, h)
    return (
        c + m.count[..., None, None] * h[..., :, None] * h[..., None, :],
        s + 2 * ch + (trace + m.count * hh)[..., None] * h,
        below * m.fourth
        + 4 * np.einsum("...d,...d->...", s + ch, h)
        + 2 * trace * hh
        + m.count * hh**2,
    )

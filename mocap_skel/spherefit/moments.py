"""Central moments of points: all that a closed-form sphere fit needs to know of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Moments:
    """Moments of point sets in D dimensions; any leading axes are a batch (markers, joints, subsets).

    With d = x - mean, sums run over the points and are divided by N - 1 (the thesis's x̄, C and S;
    ``method.md`` section 1):

    Attributes:
        count: number of points, shape (...).
        mean: x̄, shape (..., D), metres.
        covariance: C = Σ d dᵀ / (N-1), shape (..., D, D), m².
        third: S = Σ d |d|² / (N-1), shape (..., D), m³.
        fourth: Σ |d|⁴ / (N-1), shape (...), m⁴; it makes residuals and the Pratt fit possible
            without a second pass over the points.
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


def sphere_moments(points: ArrayLike) -> Moments:
    """Moments of points of shape (..., N, D), metres; a point with a NaN in any coordinate is dropped.

    Fewer than two points have zero moments, none at all the mean zero.

    Raises:
        ValueError: the array has fewer than two axes.
    """
    x = np.asarray(points, dtype=np.float64)
    if x.ndim < 2:
        raise ValueError(f"points must have shape (..., N, D), got {x.shape}")
    # Coordinates in rows: every pass below then runs along contiguous memory.
    x = np.ascontiguousarray(np.swapaxes(x, -1, -2))
    missing: NDArray[np.bool_] = np.asarray(~np.isfinite(x).all(axis=-2))
    count = x.shape[-1] - missing.sum(axis=-1).astype(np.float64)
    gaps = bool(missing.any())
    if gaps:
        x = np.where(missing[..., None, :], 0.0, x)
    some = np.maximum(count, 1.0)[..., None]
    # Coordinates are metres from the origin while spheres are centimetres wide: squares are taken
    # about the mean only, and the mean once more, or the digits that matter would be lost.
    mean = x.sum(axis=-1) / some
    features = np.empty((*x.shape[:-2], x.shape[-2] + 1, x.shape[-1]))
    d = features[..., :-1, :]
    np.subtract(x, mean[..., None], out=d)
    if gaps:
        d *= ~missing[..., None, :]
    drift = d.sum(axis=-1) / some
    mean = mean + drift
    d -= drift[..., None]
    if gaps:
        d *= ~missing[..., None, :]
    np.einsum("...dn,...dn->...n", d, d, out=features[..., -1, :])
    gram = features @ np.swapaxes(features, -1, -2)
    gram /= np.maximum(count - 1.0, 1.0)[..., None, None]
    return Moments(count, mean, gram[..., :-1, :-1], gram[..., :-1, -1], gram[..., -1, -1])


def merge_moments(a: Moments, b: Moments) -> Moments:
    """Moments of the union of two disjoint point sets, exact (Chan et al. 1983; Pébay 2008)."""
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

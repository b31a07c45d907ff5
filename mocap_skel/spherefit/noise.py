"""The measurement noise Σ̂ from the points themselves: a level for each marker, or a whole matrix.

The noise that a fit takes away from C decides its bias; thesis 6.7 leaves open how to find it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mocap_skel.spherefit.estimators import mgdk, pratt, radial_variance
from mocap_skel.spherefit.moments import Array, Moments
from mocap_skel.spherefit.system import SphereFit

# A marker's noise is kept below its weakest spread by this share: at 1 nothing would be left of C.
_BELOW = 0.999
_MOST_TURNS = 200


@dataclass(frozen=True, eq=False)
class MarkerNoise:
    """Noise standard deviations of markers, as their own radial residuals show them.

    Attributes:
        sigma: (..., M), metres.
        weights: (..., M), what the samples of each are worth (`marker_weights`).
        converged: (...), whether the fixed point was reached.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial.spheres import cap
        >>> from mocap_skel.spherefit import MarkerNoise, marker_noise, sphere_moments
        >>> found = marker_noise(sphere_moments(cap(np.random.default_rng(0), (1, 100), 1.0)))
        >>> isinstance(found, MarkerNoise), bool(found.sigma[0] < 1e-6), bool(found.converged)
        (True, True, True)
    """

    sigma: Array
    weights: Array
    converged: NDArray[np.bool_]


def isotropic(sigma: ArrayLike, dimension: int) -> Array:
    """Noise matrices that are the same in all directions: Σ̂_p = σ_p² I.

    Args:
        sigma: (..., M), metres.
        dimension: D.

    Returns:
        (..., M, D, D), m².

    Example:
        >>> from mocap_skel.spherefit import isotropic
        >>> isotropic([1.0, 2.0], 2).tolist()
        [[[1.0, 0.0], [0.0, 1.0]], [[4.0, 0.0], [0.0, 4.0]]]
    """
    return np.asarray(np.asarray(sigma)[..., None, None] ** 2 * np.eye(dimension))


def marker_noise(m: Moments, *, bounded: bool = True) -> MarkerNoise:
    """A noise level for each marker, from the radial residuals about a fit that knows these levels.

    The residuals give the noise, the noise gives the next fit, both from the moments alone, until neither
    changes. With little coverage this fixed point runs away: too much noise gives too near a centre, which
    leaves no smaller residuals. So the common level is bounded by the pooled points' own (Pratt's), and
    the fixed point finds how the markers share it.

    Args:
        m: moments, batch shape (..., M).
        bounded: False leaves the bound out, for studies.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial.spheres import cap
        >>> from mocap_skel.spherefit import marker_noise, sphere_moments
        >>> rng = np.random.default_rng(0)
        >>> noise = np.array([0.001, 0.004])
        >>> x = cap(rng, (2, 5000), 1.0, 0.2) + noise[:, None, None] * rng.normal(size=(2, 5000, 3))
        >>> print(marker_noise(sphere_moments(x)).sigma.round(4))
        [0.001 0.004]
    """
    first = pratt(m, strict=False)
    sigma2 = np.repeat(first.sigma[..., None] ** 2, m.count.shape[-1], axis=-1)
    limit = _BELOW * np.maximum(np.linalg.eigvalsh(m.covariance)[..., 0], 0.0)
    dimension = m.mean.shape[-1]
    # The shared centre takes D degrees of freedom from all residuals; N - 1 has a radius's already.
    total = np.maximum(m.count - 1.0, 0.0).sum(axis=-1, keepdims=True)
    freedom = total / np.maximum(total - dimension, 1.0)
    radius, change = first.radius, np.full(first.sigma.shape, np.inf)
    for _ in range(_MOST_TURNS):
        shape = np.sqrt(np.maximum(sigma2, 0.0))
        weights = marker_weights(radius, shape) if bounded else None
        fit = mgdk(m, 1.0, isotropic(shape, dimension), weights, strict=False)
        found = np.minimum(np.nan_to_num(radial_variance(m, fit) * freedom), limit)
        if bounded:
            # Pratt's level is the mean over the points, each by the square of its radius.
            share = np.nan_to_num(radius**2) * np.maximum(m.count - 1.0, 0.0)
            mean = (found * share).sum(axis=-1, keepdims=True)
            most = first.sigma[..., None] ** 2 * share.sum(axis=-1, keepdims=True)
            found = found * np.minimum(1.0, most / np.where(mean > 0, mean, 1.0))
        change = np.abs(found - sigma2).max(axis=-1) / np.maximum(
            found.max(axis=-1), np.finfo(float).tiny
        )
        sigma2, radius = found, np.where(np.isfinite(fit.radius), fit.radius, radius)
        if bool((change <= 1e-10).all()):
            break
    sigma = np.sqrt(sigma2)
    return MarkerNoise(sigma, marker_weights(radius, sigma), np.asarray(change <= 1e-6))


def marker_weights(radius: ArrayLike, sigma: ArrayLike) -> Array:
    """What each marker's samples are worth in `mgdk`: 1 / (r_p σ_p)², the largest 1.

    |x - c|² - r² is 2 r times the radial residual, so its standard deviation is 2 r_p σ_p.

    Args:
        radius: (..., M), metres, NaN for a marker that was never seen.
        sigma: noise standard deviations, metres, of a shape that broadcasts with it.

    Returns:
        (..., M), from 0 to 1; 0 without a radius.

    Example:
        >>> from mocap_skel.spherefit import marker_weights
        >>> print(marker_weights([0.1, 0.2, 0.1], [0.001, 0.001, 0.002]).round(6))
        [1.   0.25 0.25]
    """
    r, s = np.broadcast_arrays(np.asarray(radius, dtype=np.float64), sigma)
    cost = np.where(np.isfinite(r), r * s, np.inf) ** 2
    some = np.isfinite(cost) & (cost > 0)
    least = np.where(some, cost, np.inf).min(axis=-1, keepdims=True)
    # A marker without noise would get all the weight: it counts like the best of the others.
    least = np.where(np.isfinite(least), least, 1.0)
    return np.asarray(np.where(np.isfinite(cost), least / np.where(some, cost, least), 0.0))


def radial_noise_matrix(points: ArrayLike, fit: SphereFit) -> Array:
    """The whole noise matrix Σ̂ from the radial residuals about a fit (thesis 6.7 asks for one).

    Along the unit direction u from the centre, noise of covariance Σ leaves a squared residual of uᵀΣu
    on average: a linear regression on the D (D+1) / 2 products of u. A cap shows only some of them; the
    others stay at the isotropic level, which the regression is drawn to by the weight of one part in
    a hundred of the points, and no eigenvalue is negative.

    Args:
        points: (M, N, D) or (N, D), metres, NaN = missing.
        fit: of these points.

    Returns:
        (D, D), m².

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial.spheres import cap
        >>> from mocap_skel.spherefit import pratt, radial_noise_matrix, sphere_moments
        >>> rng = np.random.default_rng(0)
        >>> x = cap(rng, (20000,), np.pi) + rng.normal(size=(20000, 3)) * [0.01, 0.02, 0.03]
        >>> matrix = radial_noise_matrix(x, pratt(sphere_moments(x)))
        >>> print(np.sqrt(np.diag(matrix)).round(3))
        [0.01 0.02 0.03]
    """
    x = np.asarray(points, dtype=np.float64)
    away = x - fit.centre
    distance = np.linalg.norm(away, axis=-1)
    seen = np.isfinite(distance) & (distance > 0)
    total = np.where(seen, distance, 0.0).sum(axis=-1, keepdims=True)
    error = distance - total / np.maximum(seen.sum(axis=-1, keepdims=True), 1)
    u, square = away[seen] / distance[seen][:, None], error[seen] ** 2
    dimension = x.shape[-1]
    pairs = np.triu_indices(dimension)
    products = u[:, pairs[0]] * u[:, pairs[1]] * np.where(pairs[0] == pairs[1], 1.0, 2.0)
    level = square.mean()
    flat = np.where(pairs[0] == pairs[1], 1.0, 0.0)
    gram = products.T @ products
    # An entry off the diagonal stands for two of the matrix: counted so, it turns with the points.
    ridge = 0.01 * len(u) / dimension**2 * np.diag(2.0 - flat)
    entries = level * flat + np.linalg.solve(
        gram + ridge, products.T @ (square - level * (products @ flat))
    )
    matrix = np.zeros((dimension, dimension))
    matrix[pairs] = entries
    matrix = np.triu(matrix) + np.triu(matrix, 1).T
    values, axes = np.linalg.eigh(matrix)
    return np.asarray((axes * np.maximum(values, 0.0)) @ axes.T)

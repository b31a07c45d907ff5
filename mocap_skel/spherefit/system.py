"""The linear system that every closed-form estimator solves, and what a fit is made of."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mocap_skel.errors import MocapSkelError
from mocap_skel.spherefit.moments import Array, Moments


class DegenerateSphereError(MocapSkelError, ValueError):
    """The points do not determine a sphere: too few, all equal, on a line, in a plane, or lost in noise.

    Example:
        >>> from mocap_skel.spherefit import DegenerateSphereError, fit_sphere
        >>> try:
        ...     fit_sphere([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "gdke")
        ... except DegenerateSphereError as error:
        ...     print(error)
        a sphere in 3 dimensions needs at least 4 points
    """


@dataclass(frozen=True, eq=False)
class SphereFit:
    """A fitted centre, and what the points say of it.

    Attributes:
        centre: (..., D), metres.
        radius: (..., M), metres, one a marker; (...) where the moments came without a marker axis.
        axes: (..., D, D), orthonormal columns, the direction that stands least above its noise first.
        spread: (..., D), variance of the points along each axis (mean over markers, weighted by
            their counts), m².
        rank: (...), the number of directions that were solved; the first D - rank axes were not.
        sigma: (...), the noise standard deviation that was taken away, metres.
        converged: (), False where an iteration ended before it had reached its answer.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.spherefit import fit_sphere
        >>> x = np.array([[2.0, 0, 0], [0, 2, 0], [0, 0, 2], [-2, 0, 0], [0, -2, 0], [0, 0, -2]])
        >>> fit = fit_sphere(x + 5.0)
        >>> print(fit.centre.round(6), fit.radius.round(6), int(fit.rank))
        [5. 5. 5.] 2.0 3
    """

    centre: Array
    radius: Array
    axes: Array
    spread: Array
    rank: Array
    sigma: Array
    converged: NDArray[np.bool_] = field(default_factory=lambda: np.asarray(True))

    @property
    def null(self) -> Array:
        """(..., D): the weakest direction where it was not solved (a hinge's axis), else NaN."""
        dimension = self.axes.shape[-1]
        return np.where((self.rank < dimension)[..., None], self.axes[..., :, 0], np.nan)


@dataclass(frozen=True, eq=False)
class System:
    """The linear system of a shared centre, still without the level η of the noise.

    Σ_p (C_p - η N_p) (c - middle) = Σ_p [½ S_p + (C_p - η N_p) (x̄_p - middle)] (thesis 6.6).

    Attributes:
        middle: (..., D), the mean of the points, metres.
        covariance, cross: C and ½ S of all markers about it, m² and m³.
        noise, noise_shift: N and Σ_p N_p (x̄_p - middle), the noise for σ = 1; None where N is the
            unit matrix.
        square, square_variance: mean and variance of |x - middle|² about each marker's own mean.
        reach: how far the coordinates are from the origin, metres.
    """

    middle: Array
    covariance: Array
    cross: Array
    noise: Array | None
    noise_shift: Array | None
    square: Array
    square_variance: Array
    reach: Array

    @cached_property
    def _eigen(self) -> tuple[Array, Array]:
        values, vectors = np.linalg.eigh(self.covariance)
        return values, vectors

    @property
    def spread(self) -> Array:
        """(..., D): eigenvalues of C, ascending."""
        return self._eigen[0]

    @property
    def axes(self) -> Array:
        """(..., D, D): eigenvectors of C as columns."""
        return self._eigen[1]

    @property
    def floor(self) -> Array:
        """What rounding alone leaves of a direction without extent, m².

        A few ulps of the coordinates, and of the largest eigenvalue.
        """
        eps, most = np.finfo(float).eps, np.maximum(self.spread[..., -1], 0.0)
        ulps = 64 * eps * (self.reach + np.sqrt(most))
        return np.asarray(np.maximum(ulps**2, 64 * eps * most) + np.finfo(float).tiny)

    def signal(self, eta: Array) -> tuple[Array, Array]:
        """Eigenvalues and eigenvectors of C - η N."""
        if self.noise is None:
            return self.spread - eta[..., None], self.axes
        return np.linalg.eigh(self.covariance - eta[..., None, None] * self.noise)

    def right_side(self, eta: Array) -> Array:
        """(..., D): the right side with the noise taken away, m³."""
        if self.noise_shift is None:
            return self.cross
        return np.asarray(self.cross - eta[..., None] * self.noise_shift)


def with_marker_axis(m: Moments) -> tuple[Moments, bool]:
    """Moments with a marker axis, and whether they came without one."""
    return (m[None], True) if m.count.ndim == 0 else (m, False)


def pool(m: Moments, shape: ArrayLike | None, weights: ArrayLike | None) -> System:
    """The linear system of the shared centre.

    Each marker's points are deviations from that marker's own mean (its radius is free); markers
    count by N - 1 times their weight, which for one marker leaves its C and S as they are.
    """
    n = m.count
    below = np.maximum(n - 1.0, 0.0)
    share = below / np.maximum(n, 1.0)
    if n.shape[-1] == 1 and shape is None:
        # The sums of one marker are its own moments: most of the time of a fit of few points.
        covariance, third, fourth = m.covariance[..., 0, :, :], m.third[..., 0, :], m.fourth[..., 0]
        mean, trace = m.mean[..., 0, :], np.trace(covariance, axis1=-2, axis2=-1)
        square = share[..., 0] * trace
        variance, reach = fourth - trace * square, np.abs(mean).max(axis=-1)
        return System(mean, covariance, 0.5 * third, None, None, square, variance, reach)
    part = below if weights is None else below * np.asarray(weights, dtype=np.float64)
    total = part.sum(axis=-1)[..., None]
    weight = part / np.where(total > 0, total, 1.0)
    middle = np.einsum("...p,...pd->...d", weight, m.mean)
    h = m.mean - middle[..., None, :]
    hh = np.einsum("...d,...d->...", h, h)
    ch = np.einsum("...de,...e->...d", m.covariance, h)
    trace = np.trace(m.covariance, axis1=-2, axis2=-1)
    covariance = np.einsum("...p,...pde->...de", weight, m.covariance)
    within = m.fourth - trace**2 * share + 4 * np.einsum("...d,...d->...", m.third + ch, h)
    noise = shift = None
    if shape is not None:
        each = np.broadcast_to(np.asarray(shape, dtype=np.float64), m.covariance.shape)
        noise = np.einsum("...p,...pde->...de", weight, each)
        shift = np.einsum("...p,...pde,...pe->...d", weight, each, h)
    return System(
        middle=middle,
        covariance=covariance,
        cross=np.einsum("...p,...pd->...d", weight, 0.5 * m.third + ch),
        noise=noise,
        noise_shift=shift,
        square=np.einsum("...p,...p->...", weight, share * trace + hh),
        square_variance=np.einsum("...p,...p->...", weight, within),
        reach=np.abs(m.mean).max(axis=(-1, -2)),
    )


def radii(m: Moments, centre: Array, noise: Array, shape: ArrayLike | None) -> Array:
    """(..., M): √((N-1)/N tr(C - Σ̂) + |x̄ - c|²), NaN for a marker without points (thesis 6.6)."""
    away = m.mean - centre[..., None, :]
    trace = np.trace(m.covariance, axis1=-2, axis2=-1)
    unit = m.mean.shape[-1] if shape is None else np.trace(np.asarray(shape), axis1=-2, axis2=-1)
    square = (m.count - 1) / np.maximum(m.count, 1.0) * (trace - noise[..., None] * unit)
    square = square + np.einsum("...d,...d->...", away, away)
    return np.asarray(np.sqrt(np.maximum(np.where(m.count > 0, square, np.nan), 0.0)))

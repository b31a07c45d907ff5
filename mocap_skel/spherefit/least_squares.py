"""Spheres by least squares over the points: the linear system (LLS) and the geometric fit (MLE).

Both are here for comparison: LLS gives GDKE's answer in ten times the time (thesis Table 4), and the
MLE is the reference for accuracy.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mocap_skel.extras import extra
from mocap_skel.spherefit.estimators import (
    found_elsewhere,
    pratt,
)
from mocap_skel.spherefit.moments import Array, Moments, sphere_moments
from mocap_skel.spherefit.system import DegenerateSphereError, SphereFit

# A sphere whose centre lies so many standard deviations of the points away is a plane.
PLANE = 1e4


def lls(points: ArrayLike, moments: Moments | None = None) -> SphereFit:
    """Linear least squares on |x|² = 2 c·x + k_p, a system of N rows and D + M columns, by SVD.

    The thesis's LLS (Table 4), for several markers that of Gamage and Lasenby 2002. As published, so
    without a shift to the points: the digits that it loses are lost here too.

    Args:
        points: (M, N, D) or (N, D), metres, NaN = missing.
        moments: of the points, for what the fit tells beside its answer; made from them if None.

    Returns:
        Centre (D,) and radii (M,), or () without a marker axis, metres.

    Raises:
        DegenerateSphereError: too few points, or points that do not span a sphere.
        ValueError: points of another number of axes.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.spherefit import lls
        >>> x = np.array([[3.0, 0, 0], [1, 2, 0], [1, 0, 2], [-1, 0, 0], [1, -2, 0]])
        >>> fit = lls(x)
        >>> print((fit.centre + 0.0).round(6) + 0.0, fit.radius.round(6))
        [1. 0. 0.] 2.0
    """
    centre, radius = lls_answer(points)
    return found_elsewhere(sphere_moments(points) if moments is None else moments, centre, radius)


def lls_answer(points: ArrayLike) -> tuple[Array, Array]:
    """Centre (D,) and radii (M,) of `lls` alone."""
    x, marker = _listed(points)
    dimension = x.shape[1]
    system = np.zeros((len(x), dimension + marker[-1] + 1))
    np.multiply(x, 2.0, out=system[:, :dimension])
    system[np.arange(len(x)), dimension + marker] = 1.0
    answer, _, rank, _ = np.linalg.lstsq(system, np.einsum("nd,nd->n", x, x), rcond=None)
    if rank < system.shape[1]:
        raise DegenerateSphereError(
            "the points do not span a sphere: they are all equal, on a line or in a plane"
        )
    centre = answer[:dimension]
    return centre, np.sqrt(np.maximum(answer[dimension:] + centre @ centre, 0.0))


def mle(
    points: ArrayLike,
    sigma: ArrayLike = 1.0,
    *,
    start: ArrayLike | None = None,
    most: int = 200,
    moments: Moments | None = None,
) -> SphereFit:
    """The geometric fit: the sphere that minimises Σ_p Σ_i ((|x_pi - c| - r_p) / σ_p)².

    Levenberg-Marquardt with the analytic Jacobian (MINPACK's, through SciPy): the maximum-likelihood
    answer for isotropic noise that is small beside the radius (thesis Table 4).

    Args:
        points: (M, N, D) or (N, D), metres, NaN = missing.
        sigma: noise standard deviations of the markers, (M,), or one; only their ratios count.
        start: centre to start from, (D,), metres; Pratt's if None.
        most: evaluations before it gives up.
        moments: of the points; made from them if None.

    Returns:
        Centre (D,) and radii (M,), metres; `converged` tells whether the minimum was reached.

    Raises:
        DegenerateSphereError: too few points, or points that do not span a sphere.
        MissingExtraError: SciPy is not installed.
        ValueError: points of another number of axes.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial.spheres import cap
        >>> from mocap_skel.spherefit import mle
        >>> rng = np.random.default_rng(0)
        >>> fit = mle(cap(rng, (1000,), 1.0, 0.2) + 0.001 * rng.normal(size=(1000, 3)))
        >>> print(np.abs(fit.centre).max() < 0.001, fit.radius.round(2), fit.converged)
        True 0.2 True
    """
    m = sphere_moments(_checked(points)) if moments is None else moments
    # Also where a start is given: it tells whether the points span a sphere.
    closed = pratt(m)
    centre, radius, reached = mle_answer(
        points, closed.centre if start is None else start, sigma, most
    )
    # With too much noise the minimum lies at infinity, where the sphere is a plane.
    extent = np.sqrt(np.maximum(closed.spread.max(), 0.0))
    reached &= bool(np.linalg.norm(centre - closed.centre) < PLANE * extent)
    return found_elsewhere(m, centre, radius, converged=reached)


def mle_answer(
    points: ArrayLike, start: ArrayLike, sigma: ArrayLike = 1.0, most: int = 200
) -> tuple[Array, Array, bool]:
    """Centre (D,) and radii (M,) of `mle` alone, and whether MINPACK says that it converged."""
    optimize = extra("scipy.optimize", "mle")
    x, marker = _listed(points)
    dimension = x.shape[1]
    first = np.asarray(start, dtype=np.float64)
    scale = (1.0 / np.broadcast_to(np.asarray(sigma, dtype=np.float64), marker[-1] + 1))[marker]
    number = np.arange(len(x))
    jacobian = np.zeros((dimension + marker[-1] + 1, len(x)))

    def lines(parameters: Array) -> tuple[Array, Array]:
        away = x - parameters[:dimension]
        return away, np.sqrt(np.einsum("nd,nd->n", away, away))

    def residuals(parameters: Array) -> Array:
        return np.asarray((lines(parameters)[1] - parameters[dimension:][marker]) * scale)

    def derivative(parameters: Array) -> Array:
        away, distance = lines(parameters)
        np.divide(away.T, -np.maximum(distance, np.finfo(float).tiny), out=jacobian[:dimension])
        jacobian[:dimension] *= scale
        jacobian[dimension + marker, number] = -scale
        return jacobian

    radii = np.bincount(marker, lines(first)[1]) / np.bincount(marker)
    answer, _, _, _, code = optimize.leastsq(
        residuals, np.append(first, radii), Dfun=derivative, col_deriv=True, full_output=True,
        ftol=1e-13, xtol=1e-13, gtol=1e-13, maxfev=most,
    )  # fmt: skip
    # MINPACK's codes 1 to 4 are its tests of convergence; 6 to 8 say that rounding stops it sooner.
    return answer[:dimension], np.abs(answer[dimension:]), code in (1, 2, 3, 4, 6, 7, 8)


def _checked(points: ArrayLike) -> Array:
    x = np.asarray(points, dtype=np.float64)
    if x.ndim not in (2, 3):
        raise ValueError(f"points must have shape (M, N, D) or (N, D), got {x.shape}")
    return x


def _listed(points: ArrayLike) -> tuple[Array, NDArray[np.intp]]:
    """All points that are there, (N, D), and whose they are, (N,), marker by marker."""
    x = _checked(points)
    markers = x[None] if x.ndim == 2 else x
    seen = np.isfinite(markers).all(axis=-1)
    counts = seen.sum(axis=-1)
    dimension = x.shape[-1]
    if counts.sum() < dimension + len(markers):
        raise DegenerateSphereError(
            f"a sphere in {dimension} dimensions needs at least {dimension + 1} points"
        )
    if not counts.all():
        raise DegenerateSphereError(f"marker {int(np.argmin(counts))} has no point")
    listed = markers.reshape(-1, dimension) if seen.all() else markers[seen]
    return listed, np.repeat(np.arange(len(markers)), counts)

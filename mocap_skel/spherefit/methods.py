"""Every estimator behind one call, by its name."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mocap_skel.spherefit.estimators import (
    found_elsewhere,
    gdke,
    mgdk,
    pratt,
    sgdk,
)
from mocap_skel.spherefit.least_squares import lls, mle
from mocap_skel.spherefit.moments import Moments, sphere_moments
from mocap_skel.spherefit.running import running_centres
from mocap_skel.spherefit.system import SphereFit

METHODS: tuple[str, ...] = ("gdke", "ugdk", "mgdk", "sgdk", "igdk", "lls", "mle", "pratt")
# These take nothing away from C, or find for themselves what to take.
NOISELESS = ("gdke", "lls", "mle", "pratt")


def fit_sphere(
    points: ArrayLike,
    method: str = "sgdk",
    *,
    sigma: float | None = None,
    noise: ArrayLike | None = None,
    weights: ArrayLike | None = None,
    moments: Moments | None = None,
) -> SphereFit:
    """Fit one centre to the points of one marker or of several, by any of `METHODS`.

    Args:
        points: (M, N, D) or (N, D), metres, NaN = missing.
        method: one of `METHODS`. All take several markers: ugdk is mgdk then, gdke and lls are Gamage
            and Lasenby 2002, pratt is Chang and Pollard 2007.
        sigma: noise standard deviation, metres; Pratt's if None. gdke, lls, mle and pratt need none.
        noise: Σ̂_p / sigma², (M, D, D) or (D, D), for ugdk, mgdk and sgdk; the unit matrix if None.
        weights: (M,), for ugdk, mgdk and sgdk.
        moments: those of the points, where they are known already or have been corrected.

    Returns:
        Centre (D,) and radii (M,), or () without a marker axis, metres, with what the points say of them.

    Raises:
        ValueError: no such method, or points of another number of axes.
        DegenerateSphereError: the points do not determine a sphere; for lls and mle also if one of
            several markers has no point, whose radius the others leave NaN.
        MissingExtraError: mle without SciPy.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.spherefit import METHODS, fit_sphere
        >>> x = np.random.default_rng(0).normal(size=(200, 3))
        >>> x = 0.3 * x / np.linalg.norm(x, axis=1, keepdims=True) + [1.0, 2.0, 3.0]
        >>> for method in METHODS:
        ...     fit = fit_sphere(x, method)
        ...     assert np.allclose(fit.centre, [1, 2, 3]) and np.allclose(fit.radius, 0.3)
    """
    if method not in METHODS:
        raise ValueError(f"method must be one of {METHODS}, got {method!r}")
    m = sphere_moments(points) if moments is None else moments
    if method == "sgdk":
        return sgdk(m, sigma, noise, weights)
    if method == "gdke":
        return gdke(m)
    if method == "pratt":
        return pratt(m)
    if method == "lls":
        return lls(points, m)
    if method == "mle":
        return mle(points, moments=m)
    level = float(pratt(m).sigma) if sigma is None else sigma
    if method == "igdk":
        return _last_of_running(points, m, level)
    return mgdk(m, level, noise, weights)


def _last_of_running(points: ArrayLike, m: Moments, sigma: float) -> SphereFit:
    """IGDK's answer after the last sample."""
    centre = running_centres(points, sigma)[-1:].ravel()
    if not len(centre) or np.isnan(centre).any():
        return mgdk(m, sigma)  # which says why there is none
    return found_elsewhere(m, centre, sigma=sigma)

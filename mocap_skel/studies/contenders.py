"""The estimators as the studies call them: many point sets in, a centre for each, NaN where there is none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mocap_skel.spherefit import (
    DegenerateSphereError,
    gdke,
    isotropic,
    marker_noise,
    mgdk,
    mle,
    pratt,
    running_centres,
    sgdk,
    sphere_moments,
    ugdk,
)
from mocap_skel.spherefit.least_squares import lls_answer, mle_answer
from mocap_skel.spherefit.moments import Array


@dataclass(frozen=True)
class Contender:
    """One estimator of the studies.

    Attributes:
        label: its name in tables and figures.
        centres: point sets (T, N, 3) and the true noise (metres) → centres (T, 3), metres.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial.spheres import cap
        >>> from mocap_skel.studies.contenders import CONTENDERS
        >>> points = cap(np.random.default_rng(0), (2, 100), 1.0)
        >>> lls = CONTENDERS["lls"]
        >>> print(lls.label, np.abs(lls.centres(points, 0.0)).max() < 1e-9)
        LLS True
    """

    label: str
    centres: Callable[[Array, float], Array]


def _lls(points: Array, _: float) -> Array:
    return np.array([_or_nothing(_lls_centre, x) for x in points])


def _mle(points: Array, _: float) -> Array:
    return np.array([_or_nothing(_mle_from_pratt, x) for x in points])


def _lls_centre(x: Array) -> tuple[Array, bool]:
    return lls_answer(x)[0], True


def _mle_from_pratt(x: Array) -> tuple[Array, bool]:
    fit = mle(x)
    return fit.centre, bool(fit.converged)


def _mle_from_mean(points: Array, _: float) -> Array:
    return np.array([mle_answer(x, x.mean(axis=0))[0] for x in points])


def _or_nothing(method: Callable[[Array], tuple[Array, bool]], x: Array) -> Array:
    """The centre of one set, for methods that take no batch; NaN without an answer or convergence."""
    try:
        centre, reached = method(x)
    except DegenerateSphereError:
        return np.full(x.shape[1], np.nan)
    return centre if reached else np.full(x.shape[1], np.nan)


def _gdke(points: Array, _: float) -> Array:
    return gdke(sphere_moments(points)[:, None], strict=False).centre


def _ugdk(points: Array, sigma: float) -> Array:
    return ugdk(sphere_moments(points)[:, None], sigma, strict=False).centre


def _fixed_point(points: Array, _: float) -> Array:
    m = sphere_moments(points)[:, None]
    found = marker_noise(m, bounded=False)
    return mgdk(m, 1.0, isotropic(found.sigma, points.shape[2]), strict=False).centre


def _sgdk(points: Array, sigma: float) -> Array:
    return sgdk(sphere_moments(points)[:, None], sigma).centre


def _igdk(points: Array, sigma: float) -> Array:
    return np.array([running_centres(x, sigma)[-1] for x in points])


def _pratt(points: Array, _: float) -> Array:
    return pratt(sphere_moments(points)[:, None], strict=False).centre


CONTENDERS: dict[str, Contender] = {
    "gdke": Contender("GDKE", _gdke),
    "ugdk": Contender("UGDK, true σ", _ugdk),
    "ugdk_fixed_point": Contender("UGDK, σ by fixed point", _fixed_point),
    "sgdk": Contender("SGDK, true σ", _sgdk),
    "igdk": Contender("IGDK in blocks", _igdk),
    "lls": Contender("LLS", _lls),
    "pratt": Contender("Pratt", _pratt),
    "mle": Contender("MLE", _mle),
    "mle_from_mean": Contender("MLE from the points' mean", _mle_from_mean),
}

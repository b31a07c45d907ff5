"""The estimators as the studies call them: many point sets in, one centre each, NaN where there is none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mocap_skel.spherefit import (
    DegenerateSphereError,
    fit_sphere,
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
from mocap_skel.spherefit.moments import Array


@dataclass(frozen=True)
class Contender:
    """One estimator.

    Attributes:
        label: its name in tables and figures.
        centres: point sets (T, N, 3) and the true noise (metres) → centres (T, 3).
    """

    label: str
    centres: Callable[[Array, float], Array]


def _each(method: str) -> Callable[[Array, float], Array]:
    """Set by set, for what knows no batches; NaN where there is no answer or it did not converge."""
    return lambda points, _: np.array([_one(x, method) for x in points])


def _one(x: Array, method: str) -> Array:
    try:
        fit = fit_sphere(x, method)
    except DegenerateSphereError:
        return np.full(x.shape[1], np.nan)
    return fit.centre if fit.converged else np.full(x.shape[1], np.nan)


def _mle_from_mean(points: Array, _: float) -> Array:
    return np.array([mle(x, start=x.mean(axis=0)).centre for x in points])


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
    "igdk": Contender("IGDK, true σ", _igdk),
    "lls": Contender("LLS", _each("lls")),
    "pratt": Contender("Pratt", _pratt),
    "mle": Contender("MLE", _each("mle")),
    "mle_from_mean": Contender("MLE from the points' mean", _mle_from_mean),
}

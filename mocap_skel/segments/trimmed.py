"""The common centre of spheres by least trimmed squares: where to judge from which samples belong to them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mocap_skel.segments.pose import Array
from mocap_skel.segments.shape import median

# Frames from which the place is found well enough.
ENOUGH = 500


def robust_centre(y: Array) -> Array:
    """Common centre (3,) of concentric spheres through y (M, 3, F), though a quarter be anywhere.

    Least trimmed squares by concentration steps (Rousseeuw & Van Driessen 2006), each a closed-form
    algebraic fit of the samples that the last one left nearest to its spheres. A place to judge samples
    from, not an estimate: it is as biased by noise as GDKE.

    Args:
        y: (M, 3, F), metres, NaN = missing.

    Example:
        Every tenth sample is half a metre from its sphere about (0, 0, 1).

        >>> import numpy as np
        >>> from mocap_skel.artificial.spheres import cap
        >>> y = cap(np.random.default_rng(0), (1000,), np.pi / 3, radius=0.3) + [0.0, 0.0, 1.0]
        >>> y[::10] += [0.3, 0.4, 0.0]
        >>> print(np.abs(robust_centre(y.T[None]) - [0.0, 0.0, 1.0]).max() < 1e-9)
        True
    """
    frames = np.flatnonzero(np.isfinite(y[:, 0]).any(axis=0))
    y = y[..., frames[:: len(frames) // ENOUGH + 1]]
    away = np.linalg.norm(y - median(y)[..., None], axis=1)
    with np.errstate(invalid="ignore"):
        keep = away <= 3.0 * median(away)[:, None]
    centre = np.zeros(3)
    for _ in range(8):
        centre = _algebraic_centre(y, keep)
        radius = np.linalg.norm(y - centre[:, None], axis=1)
        error = np.abs(radius - median(np.where(keep, radius, np.nan))[:, None])
        with np.errstate(invalid="ignore"):
            keep = error <= 1.7 * median(error)[:, None]  # three quarters of Gaussian errors
    return centre


def _algebraic_centre(y: Array, keep: NDArray[np.bool_]) -> Array:
    """Generalised Delogne-Kåsa of the samples to keep; unseen directions stay at the samples' mean."""
    weight = keep / np.maximum(keep.sum(axis=1), 1)[:, None]
    known = np.where(keep[:, None], y, 0.0)
    mean = np.einsum("mf,mif->mi", weight, known)
    middle = mean.mean(axis=0)
    deviation = np.where(keep[:, None], y - mean[..., None], 0.0)
    weighted = weight[:, None] * deviation
    shifted = np.where(keep[:, None], y - middle[:, None], 0.0)
    square = np.einsum("mif,mif->mf", shifted, shifted)
    spread = np.einsum("mif,mjf->ij", weighted, deviation)
    third = np.einsum("mif,mf->i", weighted, square)
    return np.asarray(middle + np.linalg.pinv(spread, rcond=1e-3, hermitian=True) @ third / 2)

"""Which way a hinge joint lies from a marker beside it: square to the bones on both sides."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mocap_skel.figure.prior_tables import Prior, Shift
from mocap_skel.segments.pose import Array

# How sure the two conditions on a hinge's axis are, metres: it is square to the bone above, whose upper
# joint is off by centimetres, and to the bone below, which leans by the carrying angle.
BONE_ERROR = 0.02
CARRYING_ERROR = 0.04
# Sine of the bend from which the plane of the two bones tells the axis.
LEAST_BEND = 0.15


def hinge_shift(priors: Sequence[Prior]) -> tuple[str, Shift] | None:
    """The marker beside a hinge joint, and the shift inward from it; None for a joint that is no hinge.

    Args:
        priors: of one joint; the first one with such a shift counts.

    >>> knee = Prior(("LKNE",), 0.015, "Gordon 1989", (Shift(hinge=1, by=0.054, toward=("LANK",)),))
    >>> marker, shift = hinge_shift([knee])
    >>> marker, shift.by
    ('LKNE', 0.054)
    """
    for prior in priors:
        if len(prior.mean) == 1:
            for shift in prior.shifts:
                if shift.hinge:
                    return prior.mean[0], shift
    return None


def inward(
    above: Array,
    below: Array,
    shift: Shift,
    size: float,
    swing: Array | float = 0.0,
    aside: float = 0.0,
) -> Array:
    """Direction from a marker beside a hinge joint to the joint, square to the bones on both sides.

    With v the direction, the joint is at depth v from the marker; both bones are square to v, so that
    v·above = aside - depth and v·below = depth - beside, for the latter in every frame of the motion. Their
    weighted squares are a quadratic form in v, whose weakest direction is where the length of v = 1 has
    to come from; which way, the sense of the bend tells (a knee bends backwards, an elbow forwards), and
    a straight limb tells nothing but the line through its ends, which the marker is beside.

    Args:
        above: (..., 3) from the upper joint to the marker, metres.
        below: (..., 3) from the marker to a place far down the lower bone; its mean where it moves.
        shift: the joint's depth, the side, and how far that place is beside the bone.
        size: the subject's.
        swing: (..., 3, 3) covariance of that place, m².
        aside: how far beside the bone the upper end is, 0 for a joint; metres in a person of 1.75 m.

    Returns:
        (..., 3), unit vectors; NaN where marker and joints are all in one place, or one is missing.

    A right knee, x to the front, y to the left; the marker lies 5 cm outside the joint, and the ankle's
    marker is as far outside:

    >>> knee = Shift(hinge=1, by=0.05, toward=("RANK",), beside=0.05)
    >>> thigh, shank = np.array([0.0, -0.05, -0.4]), np.array([-0.4, 0.0, 0.0])
    >>> inward(thigh, shank, knee, size=1.0).round(2) + 0.0
    array([0., 1., 0.])
    """
    depth, beside = shift.by * size, shift.beside * size
    known = np.asarray(np.isfinite(above + below).all(axis=-1))
    d, s = (np.where(known[..., None], v, 0.0) for v in (above, below))
    form = d[..., :, None] * d[..., None, :] / BONE_ERROR**2
    form = form + (swing + s[..., :, None] * s[..., None, :]) / CARRYING_ERROR**2
    right = (aside * size - depth) * d / BONE_ERROR**2 + (depth - beside) * s / CARRYING_ERROR**2
    normal = shift.hinge * np.cross(d, s)
    with np.errstate(invalid="ignore", divide="ignore"):
        lengths = np.linalg.norm(d, axis=-1) * np.linalg.norm(s, axis=-1)
        bend = (np.linalg.norm(normal, axis=-1) / lengths) ** 2
        found = _of_length_one(form, right, normal, bend)
        found = found / np.linalg.norm(found, axis=-1, keepdims=True)
    return np.asarray(np.where(known[..., None], found, np.nan))


def _of_length_one(form: Array, right: Array, normal: Array, bend: Array) -> Array:
    """The v with form v = right in the two strong directions, and what is left of length 1 in the weakest.

    Args:
        form: (..., 3, 3).
        right: (..., 3).
        normal: (..., 3), to which side the weakest direction counts.
        bend: (...), squared sine of the bend: how sure that side is.

    Returns:
        (..., 3), not longer than 1 where the strong directions are not.
    """
    values, axes = np.linalg.eigh(form)
    weakest = axes[..., :, 0]
    weakest = (
        weakest * np.where(np.einsum("...i,...i->...", normal, weakest) < 0, -1.0, 1.0)[..., None]
    )
    excess = np.maximum(values[..., 1:] - values[..., :1], 1e-12 * values[..., 2:])
    rest = np.einsum(
        "...ik,...k->...i",
        axes[..., :, 1:],
        np.einsum("...ik,...i->...k", axes[..., :, 1:], right) / excess,
    )
    left = np.sqrt(np.maximum(1.0 - (rest * rest).sum(axis=-1), 0.0))
    return np.asarray(rest + weakest * (left * bend / (bend + LEAST_BEND**2))[..., None])

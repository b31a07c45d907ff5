"""What the motion and anatomy say of a joint together, and how well each knows it (``method.md`` section 8)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocap_skel.pose import Array
from mocap_skel.priors import Expected
from mocap_skel.spherefit import Moments, SphereFit

# Skin slides with the joint's angle, and the part of it that is in proportion to the turn moves the centre
# without a trace in the residuals: metres a radian for each metre of residual that does leave one.
SLIDE = 2.5
# Metres: how far skin shifts a segment's markers together, unseen where there are no more than three.
SKIN = 0.005


@dataclass(frozen=True, eq=False)
class Posterior:
    """A joint's centre from motion and anatomy. Metres, in the parent's frame.

    Attributes:
        centre: (3,).
        covariance: (3, 3).
        share: how much of it is from the motion, 0 to 1, mean over the directions.
    """

    centre: Array
    covariance: Array
    share: float


def systematic(
    moments: Moments, fit: SphereFit, residual: Array, noise: Array, leverage: Array, reach: float
) -> Array:
    """Covariance (3, 3), m², of what skin does to a centre and more samples do not mend.

    Three parts: residuals that are the same whenever the joint comes back to the same place, so that each
    marker counts as one sample of its cap; a slide in proportion to the angle, which looks like another
    centre; and a noise level that may lie anywhere between what was taken away and what the residuals,
    with the frame's own skin, show at most.

    Args:
        moments: of the child's markers in the parent's frame.
        fit: the centre that was fitted to them.
        residual: (M,) variance of the radial residuals, m².
        noise: (M, 3, 3), what was taken away, m².
        leverage: (M, 3, 3), noise of the parent's frame at the markers for a σ of 1.
        reach: metres, the joint lies within it.
    """
    away = moments.mean - fit.centre
    radius = np.maximum(np.linalg.norm(away, axis=1), 1e-6)
    known = np.maximum(residual, 1e-12)
    seen = moments.count >= 2
    moved = np.maximum(seen, 0)[:, None, None] * moments.covariance
    solved = fit.axes[:, 3 - int(fit.rank) :]
    part = solved @ solved.T
    cap = np.einsum("p,pij->ij", 1.0 / (radius**2 * known), moved)
    cap = part @ cap @ part
    level = float(np.average(known, weights=moments.count))
    below = np.maximum(moments.count - 1.0, 0.0)
    weight = below / below.sum()
    # The middle between the two levels, and as far to either side.
    doubt = 0.5 * np.maximum(known - np.trace(noise, axis1=1, axis2=2) / 3, 0.0)
    extra = doubt[:, None, None] * np.eye(3) + 0.5 * SKIN**2 * leverage
    system = np.einsum("p,pij->ij", weight, moments.covariance - noise)
    push = np.einsum("p,pij,pj->i", weight, extra, away)
    values, axes = np.linalg.eigh(part @ system @ part)
    most = np.einsum("ik,ij,jk->k", axes, np.einsum("p,pij->ij", weight, extra), axes)
    floor = np.maximum(values, most + 1e-18)
    shift = axes @ ((axes.T @ (part @ push)) / floor)
    return np.asarray(
        np.linalg.inv(cap + np.eye(3) / reach**2)
        + SLIDE**2 * level * np.eye(3)
        + np.outer(shift, shift)
    )


def combine(centre: Array, covariance: Array, expected: Expected | None) -> Posterior:
    """The centre of the motion and that of anatomy, each by its information.

    Where the two contradict each other beyond what both allow, one of them claims too much, and there is
    no telling which: both errors grow by the same factor (Birge 1932).
    """
    if expected is None:
        return Posterior(centre, covariance, 1.0)
    total = covariance + expected.covariance
    gain = np.linalg.solve(total, covariance).T
    difference = expected.mean - centre
    conflict = float(difference @ np.linalg.solve(total, difference)) / 3.0
    joint = covariance - gain @ covariance
    return Posterior(
        centre + gain @ difference,
        0.5 * (joint + joint.T) * max(conflict, 1.0),
        1.0 - float(np.trace(gain)) / 3.0,
    )

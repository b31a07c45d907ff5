"""What the motion and anatomy say of a joint together, and how well each knows it (``method.md`` section 8)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocap_skel.joints.priors import Expected
from mocap_skel.joints.two_sided import SharedPoint
from mocap_skel.segments.pose import Array
from mocap_skel.spherefit import Moments, SphereFit

# The part of skin's slide that is in proportion to the joint's turn looks like another centre and leaves no
# residual: metres a radian of it for each metre of slide that does. For a ball joint; `Segment.looseness`
# times that where the bones themselves roll and glide.
SLIDE = 7.5
# Metres a radian for each metre of reach: skin of a limb of 30 cm goes some centimetre while its joint turns
# by 90 degrees (Leardini 2005), also where a motion is too small to show any of it.
USUAL = 0.02
# Radians: within such a turn of the marker's direction the skin lies as before, beyond it anew.
ALIKE = 0.4
# Skin slides about twice as far along a bone as away from it (Cappozzo 1996), and turns the parent's frame
# by all of it, but only the latter is seen in a radius: ratio of the variances.
ALONG = 4.0


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


@dataclass(frozen=True, eq=False)
class Skin:
    """What skin does to a centre that was fitted to a motion, and more samples do not mend.

    Attributes:
        covariance: (3, 3), m².
        shift: (3,), metres, what the middle of the possible noise levels would move the centre by.
        slide: variance of the slide in proportion to the angle, m².
    """

    covariance: Array
    shift: Array
    slide: float


def skin_error(
    moments: Moments,
    fit: SphereFit,
    residual: Array,
    smooth: Array,
    noise: Array,
    leverage: Array,
    reach: float,
    looseness: float = 1.0,
) -> Skin:
    """The error of a centre that the soft tissue under the markers makes.

    Residuals that follow each other smoothly are the same whenever the joint comes back to the same place:
    they do not average out over frames or markers, only over the places, as many as the markers'
    directions cover. Three parts: such residuals as the noise of a sphere fit; the slide in proportion to
    the angle, which they show the size of only; and what they add to the noise that was taken away, on
    the child and by the parent's frame, of which nobody knows how much is independent of the motion.

    Args:
        moments: of the child's markers in the parent's frame.
        fit: the centre that was fitted to them.
        residual: (M,) variance of the radial residuals, m².
        smooth: (M,) share of it that is smooth in time.
        noise: (M, 3, 3), what was taken away, m².
        leverage: (M, 3, 3), noise of the parent's frame at the markers for a σ of 1.
        reach: metres, the joint lies within it.
        looseness: of the joint, 1 for a ball.
    """
    away = moments.mean - fit.centre
    radius = np.maximum(np.linalg.norm(away, axis=1), np.finfo(float).eps * reach)
    below = np.maximum(moments.count - 1.0, 0.0)
    weight = below / below.sum()
    solved = fit.axes[:, 3 - int(fit.rank) :]
    part = solved @ solved.T
    moved = moments.covariance - noise
    cap = part @ np.einsum("p,pij->ij", weight / radius**2, moved) @ part
    each = residual * smooth
    skin = max(float(weight @ each), (np.finfo(float).eps * reach) ** 2)
    places = _places(cap, away.T @ weight)
    # What a slide in proportion to a turn about one axis leaves in the radius is of the third order in the
    # turn, so that it shows with the square of the places that the turn takes the marker to; and white
    # noise conceals no more than the part of it that `smooth_share` cannot tell from chance.
    unnoticed = 2.0 / np.sqrt(np.maximum(moments.count, 1.0))
    usual = (USUAL * reach / places**2) ** 2
    concealed = SLIDE**2 * float(weight @ (residual * unnoticed))
    hidden = usual * concealed / max(usual + concealed, np.finfo(float).tiny)
    unseen = skin + hidden * float(np.trace(cap))
    # What was not solved is no worse for skin.
    values, axes = np.linalg.eigh(solved.T @ cap @ solved)
    axes = solved @ axes
    known = np.maximum(values, 0.0) * places / unseen + 1.0 / reach**2
    # Between none and all of it: the middle, and as far to either side.
    extra = 0.5 * (each[:, None, None] * np.eye(3) + ALONG * skin * leverage)
    shift = _noise_shift(part, weight, moved, extra, away)
    slide = looseness**2 * (SLIDE**2 * skin / places + hidden)
    covariance = (axes / known) @ axes.T + np.outer(shift, shift)
    return Skin(covariance + slide * np.eye(3), shift, slide)


def _places(cap: Array, middle: Array) -> float:
    """How many times the markers' directions cover anew, at least one in each way across their mean."""
    length = float(np.linalg.norm(middle))
    axis = middle / length if length > 0 else middle
    across = np.eye(3) - np.outer(axis, axis)
    spread = np.linalg.eigvalsh(across @ cap @ across)[1:]
    # √12 standard deviations are the whole width of an even distribution.
    return float(np.prod(np.maximum(np.sqrt(12.0 * np.maximum(spread, 0.0)) / ALIKE, 1.0)))


def _noise_shift(part: Array, weight: Array, moved: Array, extra: Array, away: Array) -> Array:
    """(3,): where a centre goes when more noise is taken away, (C - N - ΔN)(c - x̄) = ½ S to first order."""
    system, more = (np.einsum("p,pij->ij", weight, m) for m in (moved, extra))
    push = part @ np.einsum("p,pij,pj->i", weight, extra, away)
    values, axes = np.linalg.eigh(part @ system @ part)
    # No farther than to the markers, however little is left of a direction.
    least = np.einsum("ik,ij,jk->k", axes, more, axes)
    return np.asarray(-axes @ ((axes.T @ push) / np.maximum(values, least + np.finfo(float).tiny)))


def with_shared_point(
    centre: Array, covariance: Array, shared: SharedPoint | None, slide: float
) -> tuple[Array, Array]:
    """Centre and covariance of a sphere fit and of the point that both segments share.

    Both come from the same frames, so neither adds to what the other knows: the two are averaged, each
    direction by their information (covariance intersection with equal shares, Julier & Uhlmann 1997).

    Args:
        centre, covariance: of the sphere fit.
        shared: the point, None where the segments have no poses of their own.
        slide: variance of skin's slide, which shifts it as it does the centre, m².
    """
    if shared is None or not shared.residual > 0:
        return centre, covariance
    values, axes = np.linalg.eigh(shared.turns)
    known = (axes * (values / (shared.residual + slide * values))) @ axes.T
    first = np.linalg.inv(covariance)
    both = np.linalg.inv(0.5 * (first + known))
    return both @ (0.5 * (first @ centre + known @ shared.centre)), both


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

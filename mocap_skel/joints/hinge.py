"""Which way a hinge joint lies from a marker beside it: square to the bones on both sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mocap_skel.figure.prior_tables import Prior, Shift
from mocap_skel.segments.pose import Array, Pose

# How sure the two conditions on a hinge's axis are, metres in a person of 1.75 m: it is square to the bone
# above, whose upper joint is off by centimetres, and to the bone below, which leans by the carrying angle.
BONE_ERROR = 0.02
CARRYING_ERROR = 0.04
# Radians for each radian of turn: the axis about which the skin of both segments turns is 9 to 13 degrees from
# the epicondyles' (knees whose bones were seen, Cereatti 2017), so the turn has so much of another axis.
CROSS = 0.19
# Radians by which poses wobble about any axis however little the joint turns: `benchmarks/skin.py`.
WOBBLE = 0.02
# Radians²: where the turns about two axes differ by less, the wobble of the poses may tell the axis: some
# times `WOBBLE` squared. By eye.
SHOWN = 0.001
# A clip in which a joint moves bends it so many times independently at least, there and back twice. By eye; only
# the certainty of the side hangs on it.
BENDS = 4.0


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


@dataclass(frozen=True, eq=False)
class Turning:
    """How a child turned in its parent, in the parent's frame.

    Attributes:
        spread: (3, 3), I - R̄ R̄ᵀ with the mean turn R̄: how much the child turned about the axes across
            each direction. A hinge's axis has least of it.
        shortening: (3,), the correlation of the turn with how near the child's far end comes to the parent,
            times the turn's direction: bending shortens that distance.
    """

    spread: Array
    shortening: Array

    @property
    def shown(self) -> bool:
        """Whether the turn about one axis is more than the wobble of the poses."""
        values = np.linalg.eigvalsh(self.spread)
        return bool(values[1] - values[0] >= SHOWN)

    @property
    def clue(self) -> Array:
        """(3,): along the axis, to the side of the bend; its length in standard deviations of that side."""
        r = min(float(np.linalg.norm(self.shortening)), 1.0 - 1e-12)
        return np.asarray(self.shortening * np.sqrt(BENDS / (1.0 - r * r)))

    def inward(self, hinge: int) -> tuple[Array, float]:
        """(3,): the axis to the side of `Shift.hinge`; and the chance that this side is right less that it is wrong."""
        axis = np.linalg.eigh(self.spread)[1][:, 0]
        side = float(np.tanh(half_log_odds(hinge * self.clue @ axis)))
        return np.asarray(axis if side >= 0 else -axis), abs(side)

    @property
    def error(self) -> float:
        """Radians: how far the child turns about other axes than the hinge's, skin's turns included."""
        return float(np.hypot(WOBBLE, CROSS * np.sqrt(np.linalg.eigvalsh(self.spread)[1])))


def turning(parent: Pose, child: Pose, far: Array, middle: Array) -> Turning | None:
    """How a child turned in its parent; None where both poses are known in fewer than four frames.

    Args:
        parent, child: poses in the same frames.
        far: (frames, 3) a place far down the child, in the parent's frame, NaN = missing.
        middle: (3,) the middle of the parent's markers, in its frame.
    """
    known = parent.known & child.known & np.isfinite(far[:, 0])
    if known.sum() < 4:
        return None
    turn = parent.rotation[known].transpose(0, 2, 1) @ child.rotation[known]
    mean = turn.mean(axis=0)
    u, _, vt = np.linalg.svd(mean)
    u[:, 2] *= np.linalg.det(u @ vt)
    apart = turn @ (u @ vt).T
    vector = 0.5 * np.stack(
        [
            apart[:, 2, 1] - apart[:, 1, 2],
            apart[:, 0, 2] - apart[:, 2, 0],
            apart[:, 1, 0] - apart[:, 0, 1],
        ],
        axis=-1,
    )
    spread = np.eye(3) - mean @ mean.T
    axis = np.linalg.eigh(spread)[1][:, 0]
    distance = ((far[known] - middle) ** 2).sum(axis=-1)
    about = vector @ axis
    both = float(np.std(distance) * np.std(about))
    cross = float(((distance - distance.mean()) * about).mean())
    return Turning(spread, -axis * (cross / both if both > 0 else 0.0))


class Inward(NamedTuple):
    """Directions (..., 3) from a marker beside a hinge joint to the joint, and their covariance (..., 3, 3), radians²."""

    direction: Array
    covariance: Array


def inward(
    above: Array | None,
    below: Array,
    shift: Shift,
    size: float,
    swing: Array | float = 0.0,
    aside: float = 0.0,
    turn: Turning | None = None,
    straight: Array | None = None,
) -> Inward:
    """Direction from a marker beside a hinge joint to the joint, square to the bones on both sides.

    With v the direction, the joint is at depth v from the marker; both bones are square to v, so that
    v·above = aside - depth and v·below = depth - beside, for the latter in every frame of the motion. Their
    weighted squares are a quadratic form in v, whose weakest direction is where the length of v = 1 has
    to come from; which way, the sense of the bend tells (a knee bends backwards, an elbow forwards), and
    a straight limb tells nothing but the line through its ends, which the marker is beside.

    Args:
        above: (..., 3) from the upper joint to the marker, metres; None where there is no upper joint, and
            the turn tells the axis alone.
        below: (..., 3) from the marker to a place far down the lower bone; its mean where it moves.
        shift: the joint's depth, the side, and how far that place is beside the bone.
        size: the subject's.
        swing: (..., 3, 3) covariance of that place, m².
        aside: how far beside the bone the upper end is, 0 for a joint; metres in a person of 1.75 m.
        turn: how the lower bone turned in the upper one, where both have poses of their own.
        straight: (..., 3), the way inward of a limb that hangs straight, not longer than 1.

    Returns:
        Unit vectors (..., 3), NaN where marker and joints are all in one place, or one is missing; and their
        covariance (..., 3, 3), radians².

    A right knee, x to the front, y to the left; the marker lies 5 cm outside the joint, and the ankle's
    marker is as far outside:

    >>> knee = Shift(hinge=1, by=0.05, toward=("RANK",), beside=0.05)
    >>> thigh, shank = np.array([0.0, -0.05, -0.4]), np.array([-0.4, 0.0, 0.0])
    >>> inward(thigh, shank, knee, size=1.0).direction.round(2) + 0.0
    array([0., 1., 0.])
    """
    depth, beside = shift.by * size, shift.beside * size
    bone, carrying = BONE_ERROR * size, CARRYING_ERROR * size
    known = np.asarray(np.isfinite(below).all(axis=-1))
    if above is not None:
        known = known & np.isfinite(above).all(axis=-1)
    d, s = (np.where(known[..., None], 0.0 if v is None else v, 0.0) for v in (above, below))
    form = d[..., :, None] * d[..., None, :] / bone**2
    form = form + (swing + s[..., :, None] * s[..., None, :]) / carrying**2
    right = (aside * size - depth) * d / bone**2 + (depth - beside) * s / carrying**2
    clues: list[Array] = []
    if turn is not None and turn.shown:
        form = form + turn.spread / turn.error**2
        clues.append(shift.hinge * turn.clue)
    if above is not None:
        with np.errstate(invalid="ignore", divide="ignore"):
            upper, lower = np.linalg.norm(d, axis=-1), np.linalg.norm(s, axis=-1)
            wrong = np.hypot(bone * lower, carrying * upper)
            bent = shift.hinge * np.cross(d, s) / wrong[..., None]
        clues.append(np.where(np.isfinite(bent), bent, 0.0))
    alike = 0.0 if straight is None else 1.0 / shift.turned**2
    with np.errstate(invalid="ignore", divide="ignore"):
        found, error = _of_length_one(
            form, right, clues, 0.0 if straight is None else straight, alike
        )
        found = found / np.linalg.norm(found, axis=-1, keepdims=True)
    return Inward(np.where(known[..., None], found, np.nan), error)


def half_log_odds(away: Array) -> Array:
    """Half the logarithm of a sign's odds, of a number so many standard deviations from 0.

    Its tanh is erf(x / √2), the chance that the sign is right less that it is wrong, to three digits (Page
    1977, Appl. Stat. 26, 75). Such numbers of independent clues add up.

    >>> np.tanh(half_log_odds(np.array([0.0, 1.0, 5.0]))).round(2)
    array([0.  , 0.68, 1.  ])
    """
    return np.asarray(np.sqrt(2.0 / np.pi) * away * (1.0 + 0.044715 * away * away))


def _of_length_one(
    form: Array, right: Array, clues: Sequence[Array], straight: Array | float, alike: float
) -> tuple[Array, Array]:
    """The v with form v = right in the two strong directions, and what is left of length 1 in the weakest.

    Both signs of the weakest direction fulfil the form. Each counts by its odds.

    Args:
        form: (..., 3, 3).
        right: (..., 3).
        clues: (..., 3) each, to which side the weakest direction counts, in standard deviations of that side.
        straight: (3,), another v, of which `alike` is known in each direction, radians⁻².
        alike: 0 where there is none.

    Returns:
        (..., 3), not longer than 1 where the strong directions are not; and its covariance (..., 3, 3).
    """
    values, axes = np.linalg.eigh(form)
    weakest, strong = axes[..., :, 0], axes[..., :, 1:]
    excess = np.maximum(values[..., 1:] - values[..., :1], 1e-12 * values[..., 2:]) + alike
    push = right + alike * np.asarray(straight)
    rest = np.einsum(
        "...ik,...k->...i", strong, np.einsum("...ik,...i->...k", strong, push) / excess
    )
    left = np.sqrt(np.maximum(1.0 - (rest * rest).sum(axis=-1), 0.0))
    # Of a whole length along the axis there is so much left that the sense of a bend can be seen by.
    odds = left * alike * (weakest @ np.broadcast_to(straight, 3))
    for clue in clues:
        odds = odds + half_log_odds(left * (weakest * clue).sum(axis=-1))
    sure = np.tanh(odds)
    error = (strong * np.minimum(1.0, 1.0 / excess)[..., None, :]) @ np.swapaxes(strong, -1, -2)
    unsure = weakest * (left * np.sqrt(1.0 - sure**2))[..., None]
    error = error + unsure[..., :, None] * unsure[..., None, :]
    return rest + weakest * (left * sure)[..., None], error

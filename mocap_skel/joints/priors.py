"""Where anatomy puts a joint: landmarks, shifts along and across them, and the axis of a hinge.

All in the coordinates of the joint's parent segment, and all from places and moments: no frame of the
clip is looked at.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mocap_skel.figure.prior_tables import Prior, Shift
from mocap_skel.figure.skeleton import Skeleton
from mocap_skel.segments.pose import Array
from mocap_skel.spherefit import Moments

# How sure the two conditions on a hinge's axis are, metres: it is square to the bone above, whose upper
# joint is off by centimetres, and to the bone below, which leans by the carrying angle.
BONE_ERROR = 0.02
CARRYING_ERROR = 0.04
# Sine of the bend from which the plane of the two bones tells the axis.
LEAST_BEND = 0.15
# Cosine between the bone above and the way inward from which that is no longer square to it.
LEAST_SQUARE = 0.5
# Beyond such sizes a clip is in the wrong unit.
SIZES = (0.1, 10.0)


@dataclass(frozen=True, eq=False)
class Expected:
    """A joint as anatomy has it, in the parent's coordinates.

    Attributes:
        mean: (3,), metres.
        covariance: (3, 3), m².
        landmarks: the markers that it rests on.
        source: whose word it is.
    """

    mean: Array
    covariance: Array
    landmarks: tuple[str, ...]
    source: str


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What anatomy can be read from, in the parent's coordinates.

    Attributes:
        places: marker → (3,), those of the parent.
        upper: (3,), the parent's own joint towards its parent; None for the root.
        lower: the moments of the mean of some of the child's markers, None where they are not seen together.
        size: the subject's, 1 for a person of 1.75 m.
    """

    places: Mapping[str, Array]
    upper: Array | None
    lower: Callable[[tuple[str, ...]], Moments | None]
    size: float


def subject_size(skeleton: Skeleton, distance: Callable[[str, str], float | None]) -> float:
    """The subject's size, 1 for a person of 1.75 m: the median over the lengths that can be measured.

    Args:
        skeleton: its `sizes` say between which markers, and how long each is in that person.
        distance: metres between two markers, None where they are not seen together.
    """
    ratios = [
        found / length
        for first, second, length in skeleton.sizes
        if (found := distance(first, second)) is not None
    ]
    return float(np.clip(np.median(ratios), *SIZES)) if ratios else 1.0


def expected_joint(
    priors: Sequence[Prior], landmarks: Mapping[str, Sequence[Sequence[str]]], around: Surroundings
) -> Expected | None:
    """What the first prior says whose landmarks are all there; None where there is none.

    Args:
        priors: of one joint, the best first.
        landmarks: name → sets of markers whose mean it is, the first one that is there counts.
        around: the parent and its markers.
    """
    for prior in priors:
        found = _mean(prior, landmarks, around)
        if found is not None:
            mean, used = found
            sd = prior.sd * around.size
            return Expected(mean, sd**2 * np.eye(3), used, prior.source)
    return None


def _mean(
    prior: Prior, landmarks: Mapping[str, Sequence[Sequence[str]]], around: Surroundings
) -> tuple[Array, tuple[str, ...]] | None:
    used: dict[str, None] = {}

    def place(name: str) -> Array | None:
        for markers in landmarks.get(name, [[name]]):
            if all(marker in around.places for marker in markers):
                used.update(dict.fromkeys(markers))
                return np.asarray(np.mean([around.places[m] for m in markers], axis=0))
        return None

    points = [place(name) for name in prior.mean]
    if not points or any(p is None for p in points):
        return None
    mean = np.mean([p for p in points if p is not None], axis=0)
    total = np.zeros(3)
    for shift in prior.shifts:
        step = (
            _hinge_step(shift, mean, place, around)
            if shift.hinge
            else _landmark_step(shift, place, around)
        )
        if step is None:
            return None
        total = total + step
    return mean + total, tuple(used)


def _landmark_step(
    shift: Shift, place: Callable[[str], Array | None], around: Surroundings
) -> Array | None:
    ends = [place(name) for name in (*shift.line, *shift.across, *shift.of)]
    lines = []
    for a, b in zip(ends[::2], ends[1::2], strict=True):
        if a is None or b is None or not np.linalg.norm(b - a) > 0:
            return None
        lines.append(b - a)
    length = float(np.linalg.norm(lines[-1] if shift.of else lines[0]))
    along = np.cross(lines[0], lines[1]) if shift.across else lines[0]
    size = float(np.linalg.norm(along))
    if not size > 0:
        return None
    return np.asarray(along / size * (shift.ratio * length + shift.by * around.size))


def _hinge_step(
    shift: Shift, marker: Array, place: Callable[[str], Array | None], around: Surroundings
) -> Array | None:
    lower, upper, aside = around.lower(shift.toward), around.upper, 0.0
    if upper is None:
        stand_ins = [place(name) for name in shift.upper]
        known = [p for p in stand_ins if p is not None]
        if known and len(known) == len(stand_ins):
            upper, aside = np.mean(known, axis=0), shift.aside
    if lower is None or upper is None:
        return None
    direction = inward(
        marker - upper, lower.mean - marker, shift, around.size, lower.covariance, aside
    )
    # Inward is square to the bone but for the joint's depth; where marker, joints and bones are all in line,
    # nothing says which way it is.
    along = abs(float(direction @ (marker - upper)))
    if not along < LEAST_SQUARE * np.linalg.norm(marker - upper):
        return None
    return np.asarray(direction * shift.by * around.size)


def hinge_shift(priors: Sequence[Prior]) -> tuple[str, Shift] | None:
    """The marker of a joint that anatomy calls a hinge, and the shift from it; None for other joints."""
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
    """
    depth, beside = shift.by * size, shift.beside * size
    known = np.asarray(np.isfinite(above + below).all(axis=-1))
    d, s = (np.where(known[..., None], v, 0.0) for v in (above, below))
    normal = shift.hinge * np.cross(d, s)
    form = d[..., :, None] * d[..., None, :] / BONE_ERROR**2
    form = form + (swing + s[..., :, None] * s[..., None, :]) / CARRYING_ERROR**2
    right = (aside * size - depth) * d / BONE_ERROR**2 + (depth - beside) * s / CARRYING_ERROR**2
    values, axes = np.linalg.eigh(form)
    weakest = axes[..., :, 0]
    weakest = (
        weakest * np.where(np.einsum("...i,...i->...", normal, weakest) < 0, -1.0, 1.0)[..., None]
    )
    excess = np.maximum(values[..., 1:] - values[..., :1], 1e-12 * values[..., 2:])
    with np.errstate(invalid="ignore", divide="ignore"):
        rest = np.einsum(
            "...ik,...k->...i",
            axes[..., :, 1:],
            np.einsum("...ik,...i->...k", axes[..., :, 1:], right) / excess,
        )
        lengths = np.linalg.norm(d, axis=-1) * np.linalg.norm(s, axis=-1)
        bend = (np.linalg.norm(normal, axis=-1) / lengths) ** 2
        left = np.sqrt(np.maximum(1.0 - (rest * rest).sum(axis=-1), 0.0))
        rest = rest + weakest * (left * bend / (bend + LEAST_BEND**2))[..., None]
        found = rest / np.linalg.norm(rest, axis=-1, keepdims=True)
    return np.asarray(np.where(known[..., None], found, np.nan))

"""Where anatomy expects a joint: from landmarks, shifts along and across them, and the axis of a hinge.

All is in the coordinates of the joint's parent segment, and comes from places and moments: no frame of the
clip is looked at.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mocap_skel.figure.prior_tables import Prior, Shift
from mocap_skel.figure.skeleton import Skeleton
from mocap_skel.joints.hinge import Turning, axis_inward
from mocap_skel.segments.pose import Array
from mocap_skel.spherefit import Moments

# Cosine between the bone above and the way inward above which the two are not square to each other.
MOST_ALONG = 0.5
# Beyond such sizes a clip is in the wrong unit.
SIZES = (0.1, 10.0)


@dataclass(frozen=True, eq=False)
class Expected:
    """Where anatomy expects a joint and how sure that is, in the parent's coordinates.

    Attributes:
        mean: (3,), metres.
        covariance: (3, 3), m².
        landmarks: the markers that it rests on.
        source: the publication that the prior comes from, as the skeleton file names it.
    """

    mean: Array
    covariance: Array
    landmarks: tuple[str, ...]
    source: str


@dataclass(frozen=True, eq=False)
class Surroundings:
    """The places that anatomy starts from, in the parent's coordinates. Metres.

    Attributes:
        places: marker of the parent → (3,).
        upper: (3,), the parent's own joint towards its parent; None for the root.
        lower: markers of the child → the moments of their mean; None where they are not seen together.
        size: the subject's, 1 for a person of 1.75 m.
        turn: markers of the child far down it → how it turned in the parent; None where it has no pose.
        direction: two markers of the figure → the mean (3,) of the unit vectors from the first to the second;
            None where they are not seen.
    """

    places: Mapping[str, Array]
    upper: Array | None
    lower: Callable[[tuple[str, ...]], Moments | None]
    size: float
    turn: Callable[[tuple[str, ...]], Turning | None] = lambda _: None
    direction: Callable[[str, str], Array | None] = lambda _, __: None


def subject_size(
    skeleton: Skeleton,
    distance: Callable[[str, str], float | None],
    otherwise: float | None = None,
) -> float:
    """How large the subject is, 1 for a person of 1.75 m: the median over the lengths that can be measured.

    Args:
        skeleton: its `sizes` say between which markers, and how long each is in that person.
        distance: metres between two markers, None where they are not seen together.
        otherwise: the size where no length can be measured.

    Returns:
        1 where nothing tells; never outside `SIZES`.

    >>> from mocap_skel.figure.skeleton import read_skeleton
    >>> human = read_skeleton("human")
    >>> lengths = {(first, second): 0.9 * length for first, second, length in human.sizes}
    >>> round(subject_size(human, lambda first, second: lengths[first, second]), 3)
    0.9
    """
    ratios = [
        found / length
        for first, second, length in skeleton.sizes
        if (found := distance(first, second)) is not None
    ]
    return float(np.clip(np.median(ratios or [otherwise or 1.0]), *SIZES))


def expected_joint(
    priors: Sequence[Prior], landmarks: Mapping[str, Sequence[Sequence[str]]], around: Surroundings
) -> Expected | None:
    """Where anatomy expects a joint, by the first prior whose landmarks are all there.

    Args:
        priors: of one joint, the best first.
        landmarks: name → sets of markers whose mean it is; the first set that is there counts.
        around: the parent and its markers.

    Returns:
        None where no prior has all its landmarks.

    >>> between = Prior(("LKNE", "LKNI"), sd=0.01, source="Davis 1991")
    >>> places = {"LKNE": np.array([0.0, 0.05, 0.0]), "LKNI": np.array([0.0, -0.05, 0.0])}
    >>> knee = expected_joint([between], {}, Surroundings(places, None, lambda markers: None, size=1.0))
    >>> knee.mean, knee.landmarks
    (array([0., 0., 0.]), ('LKNE', 'LKNI'))
    """
    for prior in priors:
        found = _mean(prior, landmarks, around)
        if found is not None:
            mean, used, unsure = found
            sd = prior.sd * around.size
            return Expected(mean, sd**2 * np.eye(3) + unsure, used, prior.source)
    return None


def _mean(
    prior: Prior, landmarks: Mapping[str, Sequence[Sequence[str]]], around: Surroundings
) -> tuple[Array, tuple[str, ...], Array] | None:
    """The place (3,) that a prior says, the markers that it rests on, and what its axis adds to its covariance.

    None if a landmark is missing.
    """
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
    total, unsure = np.zeros(3), np.zeros((3, 3))
    for shift in prior.shifts:
        if shift.hinge:
            inward = _hinge_step(shift, mean, place, around)
            if inward is None:
                return None
            total, unsure = total + inward[0], unsure + inward[1]
            continue
        step = _landmark_step(shift, place, around)
        if step is None:
            return None
        total = total + step
    return mean + total, tuple(used), unsure


def _landmark_step(
    shift: Shift, place: Callable[[str], Array | None], around: Surroundings
) -> Array | None:
    """A shift (3,) along a line of landmarks or across two; None if one is missing or has no direction."""
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
) -> tuple[Array, Array] | None:
    """A shift (3,) inward from a marker beside a hinge, and its covariance (3, 3), m².

    None if a bone's end is missing or all is in line, and no turn tells the axis.
    """
    lower, upper, aside = around.lower(shift.toward), around.upper, 0.0
    if lower is None:
        return None
    if upper is None:
        stand_ins = [place(name) for name in shift.upper]
        known = [p for p in stand_ins if p is not None]
        if known and len(known) == len(stand_ins):
            upper, aside = np.mean(known, axis=0), shift.aside
    turn = around.turn(shift.toward)
    shown = turn is not None and turn.shown
    straight = around.direction(*shift.straight) if shift.straight else None
    if upper is None and not shown:
        return None
    above = None if upper is None else marker - upper
    direction, error = axis_inward(
        above, lower.mean - marker, shift, around.size, lower.covariance, aside, turn, straight
    )
    # Inward is square to the bone but for the joint's depth; where marker, joints and bones are all in line,
    # nothing says which way it is.
    if above is not None and not abs(float(direction @ above)) < MOST_ALONG * np.linalg.norm(above):
        return None
    depth = shift.by * around.size
    return direction * depth, error * depth**2

"""Where anatomy expects a joint: from landmarks, shifts along and across them, and the axis of a hinge.

All is in the coordinates of the joint's parent segment, and comes from places and moments: no frame of the
clip is looked at.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from mocap_skel.figure.prior_tables import Prior, Shift
from mocap_skel.figure.skeleton import Skeleton
from mocap_skel.joints.hinge import Turning, hinge_shift, inward
from mocap_skel.segments.pose import Array
from mocap_skel.spherefit import Moments

# Cosine between the bone above and the way inward above which the two are not square to each other.
MOST_ALONG = 0.5
# Metres, in a person of 1.75 m: how little is known of a hinge's place across its axis by the middles of the
# markers on both segments: as much as a bone is long.
ACROSS = 0.4
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
        axis: (3,), the direction from one side of a joint that bends to the other, about which it does so; None for
            any other joint.
    """

    mean: Array
    covariance: Array
    landmarks: tuple[str, ...]
    source: str
    axis: Array | None = None


class _Place(NamedTuple):
    """Where a prior has a joint: the place (3,), its markers, what an axis adds to its covariance, and that axis."""

    mean: Array
    used: tuple[str, ...]
    unsure: Array
    axis: Array | None = None


@dataclass(frozen=True, eq=False)
class Surroundings:
    """The places that anatomy starts from, in the parent's coordinates. Metres.

    Attributes:
        places: marker of the parent → (3,).
        upper: (3,), the parent's own joint towards its parent; None for the root.
        lower: markers of the child, or () for all of them → the moments of their mean; None where they are
            not seen together.
        size: the subject's, 1 for a person of 1.75 m.
        turn: markers of the child far down it, or () for all → how it turned in the parent; None where it
            has no pose.
        hanging: a step inward, the bone above it (3,) and the markers' mean, → which way is inward by the trunk (3,),
            and how far that is off, radians; None where the trunk does not tell.
        cluster: the child's markers: their places (M, 3) in a frame of its own and their mean places (M, 3) in
            the parent, where the child has a pose.
        upper_error: standard deviation of `upper` in the direction in which it is known least.
    """

    places: Mapping[str, Array]
    upper: Array | None
    lower: Callable[[tuple[str, ...]], Moments | None]
    size: float
    turn: Callable[[tuple[str, ...]], Turning | None] = lambda _: None
    hanging: Callable[[Shift, Array | None, Array], tuple[Array, float] | None] = lambda *_: None
    cluster: tuple[Array, Array] | None = None
    upper_error: float = 0.0


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
        found = _mean(prior, landmarks, around) if prior.mean else _between(prior, around)
        if found is not None:
            sd = prior.sd * around.size
            axis = found.axis if hinge_shift(priors) is not None else None
            return Expected(
                found.mean, sd**2 * np.eye(3) + found.unsure, found.used, prior.source, axis
            )
    return None


def _mean(
    prior: Prior, landmarks: Mapping[str, Sequence[Sequence[str]]], around: Surroundings
) -> _Place | None:
    """The place that a prior says; None if a landmark is missing."""
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
    there = [p for p in points if p is not None]
    mean = np.mean(there, axis=0)
    axis = there[1] - there[0] if len(there) == 2 else None
    total, unsure = np.zeros(3), np.zeros((3, 3))
    for shift in prior.shifts:
        if shift.hinge:
            step = _hinge_step(shift, prior.sd, mean, place, around)
            if step is None:
                return None
            total, unsure, axis = total + step[0], unsure + step[1], step[0]
            continue
        step = _landmark_step(shift, place, around)
        if step is None:
            return None
        total, unsure = total + step[0], unsure + step[1]
    return _Place(mean + total, tuple(used), unsure, _unit(axis))


def _unit(axis: Array | None) -> Array | None:
    """(3,): the same direction with the length 1; None without one."""
    length = 0.0 if axis is None else float(np.linalg.norm(axis))
    return None if axis is None or not length > 0 else axis / length


def _between(prior: Prior, around: Surroundings) -> _Place | None:
    """As `_mean`, for a joint without a landmark. For a hinge: inward from the middles of the markers of both segments.

    As far as these markers lie on the outer side of the limb, and not in front of it or all around. None unless
    the turn shows the axis. Across the axis next to nothing is known.
    """
    (shift,) = prior.shifts
    if not shift.hinge:
        return _before_the_child(shift, around)
    turn = around.turn(())
    if turn is None or not turn.shown or around.cluster is None:
        return None
    axis, sure = turn.inward(shift.hinge)
    own, there = around.cluster
    above = np.array(list(around.places.values()))
    depth = shift.by * around.size
    outer = [_on_the_outer_side(above, above @ axis), _on_the_outer_side(own, there @ axis)]
    # Both may lie on either side of the limb where the side of the axis is not sure.
    steps = 0.5 * (above.mean(axis=0) + there.mean(axis=0)) + sure * depth * np.mean(outer) * axis
    error = (ACROSS * around.size) ** 2 * (np.eye(3) - np.outer(axis, axis))
    error = error + (1.0 - sure**2) * depth**2 * np.outer(axis, axis)
    return _Place(steps, tuple(around.places), error, axis)


def _before_the_child(shift: Shift, around: Surroundings) -> _Place | None:
    """As `_mean`: from markers of the child back on the line to the parent's own joint."""
    lower = around.lower(shift.toward)
    if lower is None or around.upper is None:
        return None
    back = around.upper - lower.mean
    length = float(np.linalg.norm(back))
    depth = shift.by * around.size
    # A joint beyond the parent's own is none.
    if not length > depth:
        return None
    return _Place(lower.mean + depth / length * back, shift.toward, np.zeros((3, 3)))


def _on_the_outer_side(places: Array, along: Array) -> float:
    """Cosine between the axis and the way that a patch of markers faces: 1 on the limb's outer side, 0 in front.

    A patch is thin the way it faces, and long along the bone: between the two directions of least spread, that
    along the axis tells how it is turned.

    Args:
        places: (M, 3) of the markers, metres, in a frame of their segment.
        along: (M,) the same along the hinge's axis.
    """
    thin, wide, _ = np.linalg.eigvalsh(np.cov(places.T, bias=True))
    if not wide > thin:
        return 0.0
    return float(np.sqrt(np.clip((wide - along.var()) / (wide - thin), 0.0, 1.0)))


def _landmark_step(
    shift: Shift, place: Callable[[str], Array | None], around: Surroundings
) -> tuple[Array, Array] | None:
    """A shift (3,) along a line of landmarks or across two, and its covariance (3, 3), m².

    None if a landmark is missing or has no direction.
    """
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
    along = along / size
    error = (shift.sd * around.size) ** 2 * np.outer(along, along)
    return along * (shift.ratio * length + shift.by * around.size), error


def _hinge_step(
    shift: Shift,
    sd: float,
    marker: Array,
    place: Callable[[str], Array | None],
    around: Surroundings,
) -> tuple[Array, Array] | None:
    """A shift (3,) inward from a marker beside a hinge, and its covariance (3, 3), m².

    None if a bone's end is missing or all is in line, and no turn tells the axis.
    """
    lower, upper, aside = around.lower(shift.toward), around.upper, 0.0
    if lower is None:
        return None
    # An upper end that is off turns the way inward by its error over the bone's length. Where this moves the joint
    # farther than the prior's own error, the prior would claim more than it knows.
    if upper is not None:
        moved = shift.by * around.upper_error
        upper = upper if moved <= sd * np.linalg.norm(marker - upper) else None
    if upper is None:
        stand_ins = [place(name) for name in shift.upper]
        known = [p for p in stand_ins if p is not None]
        if known and len(known) == len(stand_ins):
            upper, aside = np.mean(known, axis=0), shift.aside
    turn = around.turn(shift.toward)
    shown = turn is not None and turn.shown
    if upper is None and not shown:
        return None
    above = None if upper is None else marker - upper
    told = around.hanging(shift, above, marker) if shift.straight else None
    straight = None if told is None else told[0]
    if told is not None:
        shift = replace(shift, turned=told[1])
    direction, error = inward(
        above, lower.mean - marker, shift, around.size, lower.covariance, aside, turn, straight
    )
    # Inward is square to the bone but for the joint's depth; where marker, joints and bones are all in line,
    # nothing says which way it is.
    if above is not None and not abs(float(direction @ above)) < MOST_ALONG * np.linalg.norm(above):
        return None
    depth = shift.by * around.size
    return direction * depth, error * depth**2

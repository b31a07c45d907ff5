"""Anatomical axes in a segment's own coordinates, from places that are constant there."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from mocap_skel.figure.angle_table import Line, Way
from mocap_skel.segments.pose import Array

AXES = ("x", "y", "z")
# Sine of the bend from which the plane of three joints tells the axis: 20 degrees, as for landmarks beside a joint.
LEAST_BEND = 0.35
# Sine between the two directions below which they are one.
LINE = 0.05
# Metres, and a share of a direction's length: small beside a bone, large beside rounding.
STEP = 1e-6

Places = Mapping[str, Array]


def anatomical_axes(way: Way, places: Places, hinges: Places) -> Array | None:
    """The axes (columns: x forward, y up, z right) that a way gives in a segment's own coordinates.

    Args:
        way: which places make which axis.
        places: name → (3,) in the segment, metres.
        hinges: joint → (3,) direction of its axis in the segment.

    Returns:
        (3, 3), right-handed; None where a place is missing, two directions are one, or a limb is too straight.

    A thigh whose hip is 40 cm above the knee, and whose epicondyles lie 5 cm to both sides:

    >>> way = Way("y", Line(("Knee",), ("Hip",)), "z", Line(("Inside",), ("Outside",)))
    >>> places = {"Knee": [0, 0, 0], "Hip": [0, 0, 0.4], "Inside": [0, 0.05, 0], "Outside": [0, -0.05, 0]}
    >>> anatomical_axes(way, {name: np.array(place) for name, place in places.items()}, {})
    array([[ 1.,  0.,  0.],
           [ 0.,  0., -1.],
           [ 0.,  1.,  0.]])
    """
    if any(name not in places for name in way.names):
        return None
    along, beside = _direction(way.along, places), _beside(way, places, hinges)
    if beside is None:
        return None
    lengths = _length(along) * _length(beside)
    i, j = AXES.index(way.axis), AXES.index(way.other)
    k = 3 - i - j
    # Cyclic order gives the third axis its sign.
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    third = sign * _cross(along, beside)
    if not _length(third) > LINE * lengths:
        return None
    axes = np.empty((3, 3))
    axes[:, i] = along / _length(along)
    axes[:, k] = third / _length(third)
    axes[:, j] = sign * _cross(axes[:, k], axes[:, i])
    return axes + 0.0


def best_way(ways: tuple[Way, ...], places: Places, hinges: Places) -> tuple[Way, Array] | None:
    """The first way whose places are there, and its axes; None without one.

    The line of a hinge has no sense of its own: it is turned to where the next way has its axis.
    """
    for n, way in enumerate(ways):
        axes = anatomical_axes(way, places, hinges)
        if axes is None:
            continue
        if way.hinge:
            other = best_way(ways[n + 1 :], places, hinges)
            j = AXES.index(way.other)
            if other is not None and axes[:, j] @ other[1][:, j] < 0:
                axes = _half_turn(axes, way)
        return way, axes
    return None


def turn_by(way: Way, places: Places, hinges: Places, axes: Array) -> dict[str, Array]:
    """How far the axes turn when a place or a hinge's direction moves: name → (3, 3), radians a metre (or one).

    Args:
        way, places, hinges: as of `anatomical_axes`.
        axes: what they give; the turn is a vector along them.

    Returns:
        For each name of the way; the column is the coordinate that moves.
    """
    found = {}
    for name in (*way.names, *([way.hinge] if way.hinge else [])):
        old = hinges[name] if name == way.hinge else places[name]
        ends = [
            [_turn(old + step, name, way, places, hinges, axes) for step in sign * STEP * np.eye(3)]
            for sign in (1.0, -1.0)
        ]
        found[name] = (np.array(ends[0]) - np.array(ends[1])).T / (2 * STEP)
    return found


def _turn(new: Array, name: str, way: Way, places: Places, hinges: Places, axes: Array) -> Array:
    """The small turn (3,) of the axes where a place or direction is another one."""
    if name == way.hinge:
        hinges = {**hinges, name: new}
    else:
        places = {**places, name: new}
    moved = anatomical_axes(way, places, hinges)
    if moved is None:
        return np.full(3, np.nan)
    # The axes may be those of the hinge's line in its other sense.
    if way.hinge and moved[:, AXES.index(way.other)] @ axes[:, AXES.index(way.other)] < 0:
        moved = _half_turn(moved, way)
    between = axes.T @ moved
    skew = 0.5 * (between - between.T)
    return np.array([skew[2, 1], skew[0, 2], skew[1, 0]])


def _half_turn(axes: Array, way: Way) -> Array:
    """The axes with the other sense of the one that a hinge gives: half a turn about the certain one."""
    return np.asarray(axes * np.where(np.arange(3) == AXES.index(way.axis), 1.0, -1.0))


def _direction(line: Line, places: Places) -> Array:
    start, end = (_middle([places[n] for n in names]) for names in (line.start, line.end))
    return np.asarray(end - start)


def _middle(points: Sequence[Array]) -> Array:
    return points[0] if len(points) == 1 else np.asarray(np.mean(points, axis=0))


def _beside(way: Way, places: Places, hinges: Places) -> Array | None:
    if way.hinge:
        return hinges.get(way.hinge)
    if way.beside is not None:
        return _direction(way.beside, places)
    upper, middle, lower = (places[name] for name in way.bend)
    above, below = middle - upper, lower - middle
    normal = _cross(above, below)
    bent = _length(normal) > LEAST_BEND * _length(above) * _length(below)
    return np.asarray(way.sign * normal) if bent else None


# For single vectors (3,), of which the errors' derivatives take thousands; numpy's own look at shapes and axes first.


def _length(v: Array) -> float:
    return math.sqrt(v.dot(v))


def _cross(a: Array, b: Array) -> Array:
    (a1, a2, a3), (b1, b2, b3) = a.tolist(), b.tolist()
    return np.array([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])

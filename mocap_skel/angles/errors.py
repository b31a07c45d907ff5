"""How far the errors of joint centres, landmarks and hinge axes turn a segment's anatomical axes, to first order."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from mocap_skel.angles.anatomical import turn_by
from mocap_skel.angles.places import Place, Source
from mocap_skel.figure.angle_table import Way
from mocap_skel.segments.pose import Array

Turns = Mapping[Source, Array]


def turns_by_source(
    way: Way, places: Mapping[str, Place], hinges: Mapping[str, Place], axes: Array
) -> dict[Source, Array]:
    """How far the axes turn by each source of error: source → (3, 3), radians a metre, along the axes.

    Args:
        way: the one that the axes are by.
        places, hinges: of the segment, by name.
        axes: (3, 3).
    """
    rates = turn_by(way, _at(places), _at(hinges), axes)
    found: dict[Source, Array] = {}
    for name, rate in rates.items():
        for source, moves in (hinges if name == way.hinge else places)[name].moves.items():
            found[source] = found.get(source, 0.0) + rate @ moves
    return found


def _at(places: Mapping[str, Place]) -> dict[str, Array]:
    return {name: place.at for name, place in places.items()}


def standard_errors(
    rotation: Array,
    rates: Array,
    parent: Turns,
    child: Turns,
    covariance: Callable[[Source], Array],
) -> Array:
    """The standard error of each angle in each frame, (frames, 3), radians.

    A turn δ of the parent's axes turns the child by -δ as seen from there. What errs in both, as their common
    joint does, is counted with its sign in both.

    Args:
        rotation: (frames, 3, 3) of the child's axes in the parent's.
        rates: `angles_by_turn` of it.
        parent, child: `turns_by_source` of the two segments; none for the lab.
        covariance: of a source, (3, 3).

    A parent whose axes err by 0.02 rad about y, and a child that is not turned:

    >>> still = np.eye(3)[None]
    >>> by = {("hinge", "Knee"): np.diag([0.0, 1.0, 0.0])}
    >>> standard_errors(still, still, by, {}, lambda source: 0.02**2 * np.eye(3))
    array([[0.  , 0.02, 0.  ]])
    """
    back = rotation.transpose(0, 2, 1)
    variance = np.zeros(rotation.shape[:2])
    for source in dict.fromkeys([*parent, *child]):
        turn = np.zeros((1, 3, 3)) if source not in child else child[source][None]
        if source in parent:
            turn = turn - back @ parent[source]
        change = rates @ turn
        variance += np.einsum("fij,jk,fik->fi", change, covariance(source), change)
    return np.asarray(np.sqrt(variance))

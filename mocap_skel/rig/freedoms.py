"""How joints turn: pulls that hold a joint to one or two axes, to a turn, or to a share of a larger turn.

Each is a quadratic prior on the turns ω of a segment and of its parent, ½ (ω - ω_parent - e)ᵀ Λ (ω - ω_parent - e),
linear anew in every step of `solver.solve`. None of them is stiff: bones of a living body have play, and markers
on skin have more.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from mocap_skel.rig.blocks import (
    apply,
    cross,
    diagonal,
    multiply,
    rotation,
    rotation_vector,
    transposed,
)
from mocap_skel.segments.pose import Array

# A segment's index, Λ (3, 3, F) and Λ e (3, F).
Prior = tuple[int, Array, Array]
# Sine of the angle between two axes below which they tell no direction square to both.
PARALLEL = 1e-6


class Freedom(Protocol):
    """What holds the turn of one joint or of several."""

    def priors(self, turn: Array, parents: Sequence[int]) -> Iterator[Prior]:
        """The priors at the segments' turns (3, 3, S, F) in the lab."""

    def moved(self, new: Mapping[int, int]) -> Freedom | None:
        """The same for segments with other indices, old → new; None if one of them is gone."""


@dataclass(frozen=True, eq=False)
class Hinge:
    """A joint that turns about one axis, more or less.

    Attributes:
        segment: the child's index.
        above, below: (3,) the axis in the parent's and in the child's axes.
        stiffness: against turns about other axes, 1 / radian².
    """

    segment: int
    above: Array
    below: Array
    stiffness: float

    def priors(self, turn: Array, parents: Sequence[int]) -> Iterator[Prior]:
        above = apply(turn[:, :, parents[self.segment]], self.above)
        below = apply(turn[:, :, self.segment], self.below)
        across = -self.stiffness * above[:, None] * above[None]
        across += diagonal(np.full(turn.shape[3], self.stiffness))
        yield self.segment, across, apply(across, cross(below, above))

    def moved(self, new: Mapping[int, int]) -> Hinge | None:
        return replace(self, segment=new[self.segment]) if self.segment in new else None


@dataclass(frozen=True, eq=False)
class Universal:
    """A joint that turns about two axes, one fixed in the parent and one in the child (a Cardan joint).

    The angle between the axes keeps its value, more or less.

    Attributes:
        segment: the child's index.
        above, below: (3,) the axis in the parent's axes, and the one in the child's.
        angle: between them, radians.
        stiffness: against turns that change this angle, 1 / radian².
    """

    segment: int
    above: Array
    below: Array
    angle: float
    stiffness: float

    def priors(self, turn: Array, parents: Sequence[int]) -> Iterator[Prior]:
        above = apply(turn[:, :, parents[self.segment]], self.above)
        below = apply(turn[:, :, self.segment], self.below)
        square = cross(below, above)
        sine = np.sqrt((square * square).sum(axis=0))
        axis = square / np.maximum(sine, PARALLEL)
        # A turn about this axis brings the child's axis towards the parent's.
        away = np.arctan2(sine, (above * below).sum(axis=0)) - self.angle
        held = self.stiffness * axis
        yield self.segment, held[:, None] * axis[None], held * away

    def moved(self, new: Mapping[int, int]) -> Universal | None:
        return replace(self, segment=new[self.segment]) if self.segment in new else None


@dataclass(frozen=True, eq=False)
class Spring:
    """A joint that is pulled towards one turn.

    Attributes:
        segment: the child's index.
        turn: (3, 3) the child's axes in the parent's.
        stiffness: 1 / radian².
    """

    segment: int
    turn: Array
    stiffness: float

    def priors(self, turn: Array, parents: Sequence[int]) -> Iterator[Prior]:
        goal = _turned(turn[:, :, parents[self.segment]], self.turn)
        yield _towards(self.segment, goal, turn[:, :, self.segment], self.stiffness)

    def moved(self, new: Mapping[int, int]) -> Spring | None:
        return replace(self, segment=new[self.segment]) if self.segment in new else None


@dataclass(frozen=True, eq=False)
class Shared:
    """Joints in a row that share the turn between the first one's parent and the last segment, each an equal part.

    Attributes:
        segments: indices of the children, from the first joint to the last.
        rest: (3, 3) the last segment's axes in those of the first one's parent where no joint is turned; the
            segments between have the parent's axes then.
        stiffness: against unequal parts, 1 / radian².
    """

    segments: tuple[int, ...]
    rest: Array
    stiffness: float

    def priors(self, turn: Array, parents: Sequence[int]) -> Iterator[Prior]:
        above, last = turn[:, :, parents[self.segments[0]]], self.segments[-1]
        part = shares(above, turn[:, :, last], self.rest, len(self.segments))
        for segment in self.segments:
            goal = multiply(turn[:, :, parents[segment]], part)
            goal = _turned(goal, self.rest) if segment == last else goal
            yield _towards(segment, goal, turn[:, :, segment], self.stiffness)

    def moved(self, new: Mapping[int, int]) -> Shared | None:
        if not all(segment in new for segment in self.segments):
            return None
        return replace(self, segments=tuple(new[segment] for segment in self.segments))


def shares(above: Array, below: Array, rest: Array, count: int) -> Array:
    """The turn (3, 3, F) that `count` joints in a row each make.

    Args:
        above: (3, 3, F) turns in the lab of what the first joint hangs from.
        below: (3, 3, F) likewise of what the last joint carries.
        rest: (3, 3) the latter's axes in the former's where no joint is turned.
        count: of joints.

    Example:
        >>> import numpy as np
        >>> quarter = rotation(np.array([[0.0], [0.0], [np.pi / 2]]))
        >>> third = shares(np.eye(3)[..., None], quarter, np.eye(3), 3)
        >>> round(float(np.degrees(np.arcsin(third[1, 0, 0]))), 6)
        30.0
    """
    whole = _turned(multiply(transposed(above), below), rest.T)
    return rotation(rotation_vector(whole) / count)


def _turned(turn: Array, by: Array) -> Array:
    """Products of matrices (3, 3, F) and one (3, 3)."""
    return np.asarray(np.einsum("ijf,jk->ikf", turn, by))


def _towards(segment: int, goal: Array, now: Array, stiffness: float) -> Prior:
    away = rotation_vector(multiply(goal, transposed(now)))
    return segment, diagonal(np.full(now.shape[2], stiffness)), stiffness * away

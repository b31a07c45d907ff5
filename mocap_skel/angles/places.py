"""Where joints and landmarks are in a segment, in the clip's mean, and what each of these places hangs on."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from mocap_skel.figure.skeleton import STANDARD, read_skeleton
from mocap_skel.segments.pose import Array
from mocap_skel.skeleton_fit import SkeletonFit

# What an error comes from: ("joint", its name), ("marker", its name) or ("hinge", its joint).
Source = tuple[str, str]


class HingeAxis(Protocol):
    """The axis that a joint turns about, in the frame of the joint's parent segment."""

    @property
    def direction(self) -> Array:
        """(3,), a unit vector; its sense does not matter."""

    @property
    def covariance(self) -> Array:
        """(3, 3) of the direction."""


@dataclass(frozen=True, eq=False)
class Place:
    """A place in a segment.

    Attributes:
        at: (3,), metres.
        moves: source of error → (3, 3): how the place moves when the source does, the columns are its
            coordinates in its own segment.
    """

    at: Array
    moves: Mapping[Source, Array]


class Surveyed:
    """All places of one fit, looked up when they are asked for.

    Args:
        fit: of one subject.
        hinges: the axes of joints that are known.
        landmarks: name → sets of markers, besides those of the skeleton.
    """

    def __init__(
        self,
        fit: SkeletonFit,
        hinges: Mapping[str, HingeAxis] | None = None,
        landmarks: Mapping[str, tuple[tuple[str, ...], ...]] | None = None,
    ) -> None:
        self._fit = fit
        self._hinges = hinges or {}
        self._joints = {joint.joint: joint for joint in fit.joints if joint.fitted}
        self._more = landmarks or {}
        self._carried: dict[tuple[str, str], tuple[Array, Array] | None] = {}

    @cached_property
    def _segment_of(self) -> dict[str, str]:
        return {
            marker: name
            for name, segment in self._fit.segments.items()
            for marker in segment.template
        }

    def places(self, segment: str, names: Iterable[str]) -> dict[str, Place]:
        """Those of some joints and landmarks that are known in a segment."""
        found = {name: self._place(segment, name) for name in names}
        return {name: place for name, place in found.items() if place is not None}

    def hinges(self, segment: str, names: Iterable[str]) -> dict[str, Place]:
        """The directions of the joints' axes that are known, in a segment."""
        found = {}
        for name in names:
            if name in self._hinges and name in self._joints:
                carried = self._mean(segment, self._joints[name].parent)
                if carried is not None:
                    turn = carried[0]
                    found[name] = Place(
                        turn @ self._hinges[name].direction, {("hinge", name): turn}
                    )
        return found

    def covariance(self, source: Source, landmark_sd: float) -> Array:
        """(3, 3) of a source of error in its own segment, m² (of a direction: of a unit vector)."""
        kind, name = source
        if kind == "marker":
            return landmark_sd**2 * np.eye(3)
        return self._hinges[name].covariance if kind == "hinge" else self._joints[name].covariance

    def _place(self, segment: str, name: str) -> Place | None:
        joint = self._joints.get(name)
        if joint is not None:
            return self._carry(segment, joint.parent, joint.centre, ("joint", name))
        for markers in self._sets(name):
            found = [self._marker(segment, marker) for marker in markers]
            known = [one for one in found if one is not None]
            if len(known) == len(markers):
                return Place(
                    np.mean([one.at for one in known], axis=0),
                    {s: turn / len(known) for one in known for s, turn in one.moves.items()},
                )
        return None

    def _sets(self, name: str) -> tuple[tuple[str, ...], ...]:
        """Sets of markers for a landmark; a figure that does not have it may have the standard human's markers."""
        own = self._fit.skeleton.landmarks.get(name, ())
        known = read_skeleton(STANDARD).landmarks.get(name, ())
        return (*own, *self._more.get(name, ()), *known)

    def _marker(self, segment: str, marker: str) -> Place | None:
        own = self._segment_of.get(marker)
        if own is None:
            return None
        return self._carry(
            segment, own, self._fit.segments[own].template[marker], ("marker", marker)
        )

    def _carry(self, segment: str, own: str, at: Array, source: Source) -> Place | None:
        """A place of one segment in another: where it is there in the mean over the frames that have both."""
        carried = self._mean(segment, own)
        if carried is None:
            return None
        turn, shift = carried
        return Place(turn @ at + shift, {source: turn})

    def _mean(self, segment: str, own: str) -> tuple[Array, Array] | None:
        """The mean rotation and shift from one segment's coordinates to another's; None where they do not meet."""
        if segment == own:
            return np.eye(3), np.zeros(3)
        key = (segment, own)
        if key not in self._carried:
            self._carried[key] = self._mean_of(segment, own)
        return self._carried[key]

    def _mean_of(self, segment: str, own: str) -> tuple[Array, Array] | None:
        segments = self._fit.segments
        if segment not in segments or own not in segments:
            return None
        here, there = segments[segment].pose, segments[own].pose
        both = here.known & there.known
        if not both.any():
            return None
        back = here.rotation[both].transpose(0, 2, 1)
        turn = (back @ there.rotation[both]).mean(axis=0)
        shift = (back @ (there.origin - here.origin)[both][..., None])[..., 0].mean(axis=0)
        return turn, shift

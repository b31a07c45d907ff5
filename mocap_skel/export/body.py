"""A body to look at: capsules between the joints of a rig, each as thick as such a limb is on a person.

A rig knows no flesh, so how thick a limb is follows from where it is in the figure and how long it is. That needs
no names, and holds for a hand or a dog as well: a joint with more than one limb beyond it belongs to the
trunk, what hangs from the trunk is a limb. A limb that points up in the rest pose is a neck with a head, one that
points down stands on a foot.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mocap_skel.rig.kinematics import Rig, rest_places
from mocap_skel.segments.pose import Array

# Radii, chosen by eye beside people; nothing but the look depends on them. Of the first and of the last point of a
# limb, as shares of its longest bone; of the trunk, as a share of its length, but not more than a share of the
# longest limb; as shares of the trunk's, at least of its rim where limbs begin, of the head and of the neck.
LIMB = (0.18, 0.07)
TRUNK, TRUNK_OF_LIMB = 0.24, 0.3
RIM, HEAD, NECK = 0.65, 0.85, 0.45
# The cosine of the angle to the vertical up to which a limb points up or down.
UPRIGHT = 0.8
# A limb's first bone that is shorter than this share of its second is a collar bone, and belongs to the trunk.
COLLAR = 0.7
# Corners around a capsule, and rings on each of its caps.
AROUND, RINGS = 16, 4
# A capsule's ends differ in radius by at most this share of its length, so that neither lies inside the other.
STEEPEST = 0.95


@dataclass(frozen=True, eq=False)
class Capsule:
    """Two balls and the cone that touches both, in the rest pose; one ball where start and end are the same.

    Attributes:
        joint: the index of the joint that moves it.
        start: (3,) centre of the one ball, metres.
        end: (3,) centre of the other.
        radii: of the two balls, metres.
        floor: nothing of it is lower than this; None = no floor.
    """

    joint: int
    start: Array
    end: Array
    radii: tuple[float, float]
    floor: float | None = None

    @property
    def ball(self) -> bool:
        return bool((self.start == self.end).all())


@dataclass(frozen=True, eq=False)
class Body:
    """Triangles of the rest pose. Each corner moves with one joint.

    Attributes:
        points: (n, 3) corners, metres.
        normals: (n, 3) unit vectors, outward.
        joints: (n) index of the joint that each corner moves with.
        triangles: (m, 3) indices of corners, counter-clockwise as seen from outside.
    """

    points: Array
    normals: Array
    joints: NDArray[np.int64]
    triangles: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class _Limb:
    """What hangs from the trunk: its joints, and the places (k, 3) of those and of its end."""

    joints: list[int]
    places: Array

    @property
    def lengths(self) -> Array:
        """Of its bones, metres."""
        return np.asarray(np.linalg.norm(np.diff(self.places, axis=0), axis=1))

    @property
    def rises(self) -> float:
        """1 for a limb straight up in the rest pose, -1 for one straight down."""
        way = self.places[-1] - self.places[0]
        length = float(np.linalg.norm(way))
        return float(way[1]) / length if length > 0 else 0.0

    def radii(self, trunk: float) -> Array:
        """At each place: a neck is as thick all along, another limb gets thinner."""
        if self.rises > UPRIGHT:
            return np.full(len(self.places), NECK * trunk)
        along = np.concatenate([[0.0], self.lengths.cumsum()])
        if not along[-1]:
            return np.zeros(len(along))
        return np.asarray(self.lengths.max() * np.interp(along / along[-1], [0.0, 1.0], LIMB))


def capsules(rig: Rig) -> list[Capsule]:
    """The body of a rig whose rest pose has y up: every bone as a capsule, from joint to joint.

    The trunk has more of them, between the limbs that hang from the same joint; a head is a ball
    around the end of its limb, and a foot has a sole: it ends at the height of the rest pose's lowest point.

    Returns:
        Capsules in the rest pose, each moved by one joint; none for a rig whose bones have no length.
    """
    places, ends = rest_places(rig)
    floor = min([*places[:, 1], *(end[1] for end in ends.values())])
    limbs = _limbs(rig, places, ends)
    thick = _trunk_radius(rig, limbs)
    found = list(_trunk(rig, places, limbs, thick))
    for limb in limbs:
        found += _flesh(limb, thick, floor)
    return [part for part in found if max(part.radii) > 0]


def body(parts: Sequence[Capsule]) -> Body:
    """The triangles of capsules."""
    made = [_corners(part) for part in parts]
    faces, size = _faces(), len(made[0][0])
    # A ball's two halves meet, and there is no cone between them.
    between = np.arange(len(faces)) >= len(faces) - 2 * AROUND
    triangles = [faces[~between] if part.ball else faces for part in parts]
    return Body(
        np.concatenate([points for points, _ in made]),
        np.concatenate([normals for _, normals in made]),
        np.repeat([part.joint for part in parts], size),
        np.concatenate([own + k * size for k, own in enumerate(triangles)]),
    )


def _limbs(rig: Rig, places: Array, ends: dict[int, Array]) -> list[_Limb]:
    """From each joint that hangs from the trunk, and beyond which nothing branches, to the limb's end."""
    below = [rig.children(i) for i in range(len(rig.names))]
    leaves = [0] * len(below)
    for i in reversed(range(len(below))):
        leaves[i] = sum(leaves[child] for child in below[i]) or 1
    found = []
    for i, parent in enumerate(rig.parents):
        if leaves[i] > 1 or (parent >= 0 and leaves[parent] == 1):
            continue
        joints = [i]
        while below[joints[-1]]:
            joints += below[joints[-1]]
        there = [*places[joints], *(ends[k] for k in joints[-1:] if k in ends)]
        limb = _Limb(joints, np.stack(there))
        short = len(joints) > 2 and limb.lengths[0] < COLLAR * limb.lengths[1]
        if short and abs(limb.rises) < UPRIGHT:
            limb = _Limb(joints[1:], limb.places[1:])
        found.append(limb)
    return found


def _held(rig: Rig, limb: _Limb) -> tuple[int, int]:
    """The joint that a limb hangs from, and the branching one of the trunk: the same without a collar bone."""
    holder = trunk = rig.parents[limb.joints[0]]
    while trunk > 0 and len(rig.children(trunk)) == 1:
        trunk = rig.parents[trunk]
    return holder, trunk


def _trunk_radius(rig: Rig, limbs: Sequence[_Limb]) -> float:
    """As thick as the trunk is long, and as its limbs allow; never thinner than a limb that it holds."""
    reach = max(float(np.linalg.norm(limb.places[0] - rig.offsets[0])) for limb in limbs)
    longest = max(float(limb.lengths.sum()) for limb in limbs)
    thickest = LIMB[0] * max(float(limb.lengths.max(initial=0.0)) for limb in limbs)
    return max(min(TRUNK * reach, TRUNK_OF_LIMB * longest), thickest)


def _trunk(rig: Rig, places: Array, limbs: Sequence[_Limb], thick: float) -> Iterator[Capsule]:
    """The capsules of its bones, from there to the limbs, and between limbs that hang from the same joint."""
    elsewhere = {i for limb in limbs for i in limb.joints}
    for i, parent in enumerate(rig.parents):
        if parent >= 0 and i not in elsewhere:
            yield Capsule(parent, places[parent], places[i], (thick, thick))
    rim: list[tuple[int, Array, float]] = []
    for limb in limbs:
        holder, trunk = _held(rig, limb)
        if holder < 0:
            continue
        start, radius = limb.places[0], max(float(limb.radii(thick)[0]), RIM * thick)
        yield Capsule(trunk, places[trunk], start, (thick, radius))
        if holder != trunk:
            yield Capsule(holder, places[holder], start, (radius, radius))
        for other, there, size in rim:
            if other == trunk:
                yield Capsule(trunk, there, start, (size, radius))
        rim.append((trunk, start, radius))


def _flesh(limb: _Limb, trunk: float, floor: float) -> Iterator[Capsule]:
    """The capsules of a limb, with its head or its sole."""
    radii = limb.radii(trunk).tolist()
    bones = zip(limb.joints, pairwise(limb.places), pairwise(radii), strict=False)
    for joint, (start, end), both in bones:
        yield Capsule(joint, start, end, both, floor if limb.rises < -UPRIGHT else None)
    if limb.rises > UPRIGHT:
        tip = limb.places[-1]
        yield Capsule(limb.joints[-1], tip, tip, (HEAD * trunk, HEAD * trunk))


def _corners(part: Capsule) -> tuple[Array, Array]:
    """Points and normals: a pole, rings up to where the cone touches the first ball, from there to the other pole.

    A ring of either ball has the normals of its latitude, so the cone's normals are those of the two
    rings at which it begins and ends.
    """
    way = part.end - part.start
    length = float(np.linalg.norm(way))
    axis = way / length if length > 0 else np.array([0.0, 1.0, 0.0])
    shrinks = (part.radii[0] - part.radii[1]) / length if length > 0 else 0.0
    radii = (max(part.radii),) * 2 if part.ball else part.radii
    touches = np.arcsin(np.clip(shrinks, -STEEPEST, STEEPEST))
    first = np.linspace(-np.pi / 2, touches, RINGS + 1)
    latitude = np.concatenate([first, np.linspace(touches, np.pi / 2, RINGS + 1)])
    aside = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    aside /= np.linalg.norm(aside)
    turn = 2 * np.pi * np.arange(AROUND) / AROUND
    ring = np.outer(np.cos(turn), aside) + np.outer(np.sin(turn), np.cross(axis, aside))
    inner = latitude[1:-1, None, None]
    rings = (np.cos(inner) * ring + np.sin(inner) * axis).reshape(-1, 3)
    normals = np.concatenate([[-axis], rings, [axis]])
    second = np.arange(len(normals)) > RINGS * AROUND
    centres = np.where(second[:, None], part.end, part.start)
    points = centres + np.where(second, radii[1], radii[0])[:, None] * normals
    if part.floor is not None:
        points[:, 1] = np.maximum(points[:, 1], part.floor)
    return points, normals


def _faces() -> NDArray[np.int64]:
    """Triangles (4 · RINGS · AROUND, 3) of a capsule's corners, the cone's 2 · AROUND last."""
    rows = 1 + np.arange(2 * RINGS * AROUND).reshape(2 * RINGS, AROUND)
    after = np.roll(rows, -1, axis=1)
    last = rows[-1, -1] + 1
    low, high = np.zeros(AROUND, np.int64), np.full(AROUND, last)
    caps = [np.stack([low, after[0], rows[0]], 1), np.stack([rows[-1], after[-1], high], 1)]
    a, b, c, d = rows[:-1], after[:-1], after[1:], rows[1:]
    bands = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=1)
    # The cone is the band between the two caps.
    cone = np.arange(len(bands)) == RINGS - 1
    return np.concatenate([*caps, bands[~cone].reshape(-1, 3), bands[cone].reshape(-1, 3)])

"""A figure of rigid bones: joints at constant offsets, turned frame by frame, and where that puts them.

The fitted joints of a clip move a little against each other: a centre is constant in its parent's frame,
and wanders in its child's. A figure of bones cannot do that. `follow` turns each bone so that the figure
stays on the joints, `forward` says where the figure's joints are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mocap_skel.segments.pose import Array, nearest_rotation

# Metres. How firmly a bone keeps the turn that its markers show: a bone much longer than this points at the
# next joint, a shorter one would be turned by millimetres and stays with its markers.
FIRMNESS = 0.05
# 1 + cos of the angle between two directions: nearer to opposite there is no shortest turn.
OPPOSITE = 1e-6


@dataclass(frozen=True, eq=False)
class Rig:
    """A figure of bones and its motion. Metres; with all rotations zero it is in its rest pose.

    Attributes:
        names: (n) joints, parents first, each branch in one piece; the root first.
        parents: (n) the index of the joint that each hangs from, -1 for the root.
        offsets: (n, 3) each joint from its parent in the rest pose; the root's place in the rest pose.
        ends: end point of each joint without children, from that joint, in the rest pose.
        position: (frames, 3) the root in the lab; it does not contain the root's offset.
        rotation: (n, frames, 3, 3) of each joint against its parent, of the root in the lab.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Array
    ends: dict[int, Array]
    position: Array
    rotation: Array

    def called(self, names: tuple[str, ...]) -> Rig:
        """The same under other names."""
        return replace(self, names=names)

    def children(self, at: int) -> list[int]:
        return [i for i, parent in enumerate(self.parents) if parent == at]


def forward(rig: Rig) -> tuple[Array, dict[int, Array]]:
    """Where the joints (n, frames, 3) and the end points, index → (frames, 3), are in the lab."""
    places, turns, ends = [], [], {}
    for i, parent in enumerate(rig.parents):
        if parent < 0:
            places.append(rig.position)
            turns.append(rig.rotation[i])
        else:
            places.append(places[parent] + turns[parent] @ rig.offsets[i])
            turns.append(turns[parent] @ rig.rotation[i])
        if i in rig.ends:
            ends[i] = places[i] + turns[i] @ rig.ends[i]
    return np.stack(places), ends


def rest_places(rig: Rig) -> tuple[Array, dict[int, Array]]:
    """Joints (n, 3) and end points of the rest pose, the root at its offset."""
    places: list[Array] = []
    for offset, parent in zip(rig.offsets, rig.parents, strict=True):
        places.append(offset if parent < 0 else places[parent] + offset)
    return np.stack(places), {i: places[i] + end for i, end in rig.ends.items()}


def follow(rotation: Array, offsets: Array, targets: Array) -> Array:
    """A bone's rotations, turned so that the points fixed in it come near to where they should be.

    With several points it is the rotation that minimises Σ |t - R o|² + FIRMNESS² |R - R₀|². With one it is
    the shortest turn of R₀ that takes the bone's direction to that of t + (FIRMNESS / |o|)² R₀ o: of all
    rotations without a twist about the bone, the one that minimises |t - R o|² + FIRMNESS² |R - R₀|² / 2.

    Args:
        rotation: (frames, 3, 3) what the markers show.
        offsets: (k, 3) points in the bone's own axes, from its joint.
        targets: (k, frames, 3) where they should be, from the joint in the lab.
    """
    if len(offsets) == 1:
        length = float(offsets[0] @ offsets[0])
        if length == 0.0:
            return rotation
        now = rotation @ offsets[0]
        return shortest_turn(now, targets[0] + FIRMNESS**2 / length * now) @ rotation
    wanted = FIRMNESS**2 * rotation + np.einsum("kfi,kj->fij", targets, offsets)
    return nearest_rotation(wanted)


def shortest_turn(start: Array, goal: Array) -> Array:
    """Rotations (..., 3, 3) that turn directions (..., 3) into others; none where they are opposite."""
    with np.errstate(invalid="ignore", divide="ignore"):
        a = start / np.linalg.norm(start, axis=-1, keepdims=True)
        b = goal / np.linalg.norm(goal, axis=-1, keepdims=True)
    cosine = (a * b).sum(axis=-1)
    x, y, z = np.moveaxis(np.cross(a, b), -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*x.shape, 3, 3)
    usable = 1.0 + cosine > OPPOSITE
    share = 1.0 / np.where(usable, 1.0 + cosine, 1.0)
    turn = np.eye(3) + cross + share[..., None, None] * (cross @ cross)
    return np.asarray(np.where(usable[..., None, None], turn, np.eye(3)))

"""A figure of rigid bones: joints at constant offsets, turned frame by frame, and where that puts them.

`forward` says where the figure's joints are, `rest_places` where they are in the rest pose.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mocap_skel.segments.pose import Array

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

"""An animated figure as a rig: joints with offsets and turns against their parents, at rest in a T-pose."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mocap_skel.clip import turn_between
from mocap_skel.figure.skeleton import Segment
from mocap_skel.rig.animation import Animation
from mocap_skel.rig.kinematics import Rig, forward, rest_places, shortest_turn
from mocap_skel.segments.pose import Array

# Metres: shorter End Sites make nodes without length in common readers.
SHORTEST_END = 1e-3
# Metres: a lowest point farther from zero than this is no floor, and worth a word.
FLOOR = 0.1


def rig_of(
    animation: Animation, stretch: tuple[int, int], *, up: str = "y", floor: bool = False
) -> tuple[Rig, tuple[Segment, ...], tuple[str, ...]]:
    """A stretch of an animation as a rig, standing on the floor in its rest pose.

    Joints are named as in the skeleton file.

    Args:
        animation: the figure.
        stretch: (start, stop) of frames in which every segment is known.
        up: the rig's vertical axis.
        floor: move the figure up or down so that its lowest point over the stretch is at zero.

    Returns:
        The rig; the segment that each joint turns; and notes, one sentence each.
    """
    model, frames = animation.motion.model, slice(*stretch)
    order = _branches(model.bones.parents)
    new = {old: i for i, old in enumerate(order)}
    parents = tuple(new.get(model.bones.parents[old], -1) for old in order)
    segments = tuple(model.segments[old] for old in order)
    lab = turn_between(animation.up, up)
    upward = lab @ animation.vertical
    # From the character's axes, y up, to the rig's.
    upright = shortest_turn(np.array([0.0, 1.0, 0.0]), upward)
    rest = [upright @ animation.rest[old] for old in order]
    offsets = np.stack(
        [
            rest[parent] @ model.bones.offsets[old] if parent >= 0 else np.zeros(3)
            for old, parent in zip(order, parents, strict=True)
        ]
    )
    ends = {
        i: _end(rest[i] @ model.ends[old], offsets[i], rest[i])
        for i, old in enumerate(order)
        if old in model.ends
    }
    poses = animation.motion.poses
    world = [
        lab @ poses.turn[:, :, old, frames].transpose(2, 0, 1) @ rest[i].T
        for i, old in enumerate(order)
    ]
    rotation = np.stack(
        [
            turn if parent < 0 else world[parent].transpose(0, 2, 1) @ turn
            for turn, parent in zip(world, parents, strict=True)
        ]
    )
    names = tuple(s.joint or s.name for s in segments)
    rig = Rig(names, parents, offsets, ends, poses.root[:, frames].T @ lab.T, rotation)
    offsets[0] = -_lowest(rest_places(rig), upward) * upward
    lowest = _lowest(forward(rig), upward)
    notes: tuple[str, ...] = ()
    if floor:
        rig = Rig(names, parents, offsets, ends, rig.position - lowest * upward, rotation)
    elif abs(lowest) > FLOOR:
        where = "over" if lowest > 0 else "under"
        notes = (
            f"the figure's lowest point is {abs(lowest):.2f} m {where} zero; --floor puts it there",
        )
    return rig, segments, notes


def _branches(parents: Sequence[int]) -> list[int]:
    """Indices so that each joint is followed by all that hangs from it."""
    order, waiting = [], [0]
    while waiting:
        at = waiting.pop()
        order.append(at)
        waiting += [i for i in reversed(range(len(parents))) if parents[i] == at]
    return order


def _end(end: Array, offset: Array, rest: Array) -> Array:
    """An end point with a length: as the bone before it goes on, where it has none."""
    if np.linalg.norm(end) >= SHORTEST_END:
        return end
    along = offset / np.linalg.norm(offset) if offset.any() else rest[1]
    return np.asarray(10 * SHORTEST_END * along)


def _lowest(places: tuple[Array, dict[int, Array]], up: Array) -> float:
    joints, ends = places
    return min(float((joints @ up).min()), *(float((end @ up).min()) for end in ends.values()))

"""A moving rigid figure in coordinates: bodies, joints that turn about three axes, and the angles over time.

The axes of a body are x to the front, y up, z to the right where the figure stands in a T-pose (as ISB has them, Wu
2002). Where all angles are zero, it stands so.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from mocap_skel.clip import turn_between
from mocap_skel.export.euler import ORDERS, euler_angles
from mocap_skel.figure.sides import other_side
from mocap_skel.rig.animation import Animation
from mocap_skel.rig.freedoms import Hinge
from mocap_skel.rig.kinematics import shortest_turn
from mocap_skel.segments.pose import Array

# From the character's axes (x to its left, y up, z forward) to a body's.
BODY = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
# The order of turns of OpenSim's and ISB's hip: flexion, adduction, rotation. The root's first turn is that about the
# vertical, so that the others do not depend on where it looks in the lab (Baker 2001, Hum. Mov. Sci. 20, 833).
USUAL, ROOT = "ZXY", "YXZ"
# Another order is taken where the second angle of the usual one comes so near to a right angle: at it, first and
# third turn are about one axis. By eye.
NEAR_LOCK = np.radians(70.0)
# What a hinge's coordinates are called: its turn about its axis, and what it turns besides.
HINGE = ("hinge", "stray1", "stray2")


@dataclass(frozen=True, eq=False)
class CustomJoint:
    """A joint as OpenSim's CustomJoint: a frame in each of two bodies, and how one turns in the other.

    Attributes:
        name: of the joint.
        parent: the index of the body that it hangs from, -1 for the ground.
        place: (3,) the joint in that body's axes.
        above, below: (3, 3) the joint's axes in those of that body, and of the body that hangs from it.
        order: of the turns, each about an axis of the body that hangs from it as the turns before have left it.
        coordinates: what they are called, in this order.
        turn: (frames, 3, 3) the lower frame in the upper one. Where the figure is not known it means nothing.
    """

    name: str
    parent: int
    place: Array
    above: Array
    below: Array
    order: str
    coordinates: tuple[str, str, str]
    turn: Array


@dataclass(frozen=True, eq=False)
class Figure:
    """A moving figure, y up. Metres.

    Attributes:
        bodies: (n) their names, parents first.
        joints: (n) one a body.
        ends: index → (3,), the end of a body that nothing hangs from, from its joint.
        markers: their names, the body of each, and its place there.
        places: names of the coordinates of the root's place.
        root: (frames, 3) where the root is.
        points: (frames, markers, 3) the markers as recorded, NaN = missing or left out.
        locked: joints that come near to gimbal lock in any order, with the angle left to it, degrees.
    """

    bodies: tuple[str, ...]
    joints: tuple[CustomJoint, ...]
    ends: dict[int, Array]
    markers: tuple[tuple[str, int, Array], ...]
    places: tuple[str, str, str]
    root: Array
    points: Array
    locked: dict[str, float]

    def values(self, stretch: tuple[int, int]) -> tuple[list[str], Array]:
        """Coordinates over a stretch of frames: their names, and (frames, n) degrees and metres, without jumps."""
        frames = slice(*stretch)
        names: list[str] = []
        columns = []
        for joint in self.joints:
            names += joint.coordinates
            columns.append(euler_angles(joint.turn[frames], joint.order))
            if joint.parent < 0:
                names += self.places
                columns.append(self.root[frames])
        return names, np.hstack(columns)


def figure_of(
    animation: Animation, stretches: Sequence[tuple[int, int]], labels: dict[str, str]
) -> Figure:
    """An animation as bodies and coordinates.

    Args:
        animation: the figure.
        stretches: (start, stop) of frames in which every segment is known; the orders of turns suit them.
        labels: standard marker → what it is called in the result; others keep their name.
    """
    model, poses = animation.motion.model, animation.motion.poses
    lab = turn_between(animation.up, "y")
    # From a segment's own axes to its body's.
    body = [BODY @ rest for rest in animation.rest]
    names = plain_names(segment.joint or segment.name for segment in model.segments)
    joints, locked = _joints(animation, names, body, stretches)
    titles = plain_names(labels.get(m, m) for own in model.markers for m in own)
    where = [(s, body[s] @ place) for s, own in enumerate(model.bones.places) for place in own]
    x, y, z = (f"{names[0]}_t{axis}" for axis in "xyz")
    return Figure(
        plain_names(segment.name for segment in model.segments),
        tuple(joints),
        {s: body[s] @ end for s, end in model.ends.items()},
        tuple((title, s, place) for title, (s, place) in zip(titles, where, strict=True)),
        (x, y, z),
        poses.root.T @ lab.T,
        np.concatenate(animation.recorded, axis=1) @ lab.T,
        locked,
    )


def _joints(
    animation: Animation,
    names: Sequence[str],
    body: Sequence[Array],
    stretches: Sequence[tuple[int, int]],
) -> tuple[list[CustomJoint], dict[str, float]]:
    """The joints, and those near to gimbal lock with the angle left to it."""
    model, poses = animation.motion.model, animation.motion.poses
    bones, lab = model.bones, turn_between(animation.up, "y")
    frames = {
        one.segment: _hinge_frames(body, bones.parents[one.segment], one)
        for one in model.freedoms
        if isinstance(one, Hinge)
    }
    upright = (np.eye(3), np.eye(3))
    world = [lab @ poses.turn[:, :, s].transpose(2, 0, 1) @ own.T for s, own in enumerate(body)]
    turns = []
    for s, parent in enumerate(bones.parents):
        turn = world[s] if parent < 0 else world[parent].transpose(0, 2, 1) @ world[s]
        above, below = frames.get(s, upright)
        turns.append(above.T @ turn @ below)
    known = np.concatenate([np.arange(*stretch) for stretch in stretches])
    orders = _orders(names, {s: turns[s][known] for s in range(len(names)) if s not in frames})
    joints = []
    for s, parent in enumerate(bones.parents):
        order, _ = orders.get(s, (USUAL, 0.0))
        ways = HINGE if s in frames else [f"r{axis.lower()}" for axis in order]
        first, second, third = (f"{names[s]}_{way}" for way in ways)
        name = names[s] if parent >= 0 else f"ground_{names[s]}"
        place = np.zeros(3) if parent < 0 else body[parent] @ bones.offsets[s]
        coordinates = (first, second, third)
        joints.append(
            CustomJoint(name, parent, place, *frames.get(s, upright), order, coordinates, turns[s])
        )
    near = 90.0 - np.degrees(NEAR_LOCK)
    return joints, {names[s]: left for s, (_, left) in orders.items() if left < near}


def plain_names(names: Iterable[str]) -> tuple[str, ...]:
    """Names that OpenSim takes, of letters, digits, dots and dashes; a number behind those that are the same then.

    >>> plain_names(["left heel", "left/heel", "C7"])
    ('left_heel', 'left_heel_2', 'C7')
    """
    found: dict[str, None] = {}
    for name in names:
        plain = new = re.sub(r"[^\w.-]+", "_", name.strip()) or "_"
        number = 2
        while new in found:
            new, number = f"{plain}_{number}", number + 1
        found[new] = None
    return tuple(found)


def _hinge_frames(body: Sequence[Array], parent: int, hinge: Hinge) -> tuple[Array, Array]:
    """A hinge's axes in both its bodies, the third along it; in the T-pose it is not turned about that."""
    axis, across = body[parent] @ hinge.above, body[hinge.segment] @ hinge.below
    if axis[np.abs(axis).argmax()] < 0:
        axis, across = -axis, -across
    above = shortest_turn(np.array([0.0, 0.0, 1.0]), axis)
    below = above
    if axis @ across < 0:
        # Half a turn has no shortest way; any will do.
        half = 2.0 * np.outer(above[:, 0], above[:, 0]) - np.eye(3)
        axis, below = half @ axis, half @ above
    return above, np.asarray(shortest_turn(axis, across) @ below)


def _orders(names: Sequence[str], turns: dict[int, Array]) -> dict[int, tuple[str, float]]:
    """Of each joint the order of its turns, both sides alike, and how far it stays from gimbal lock, degrees."""
    found: dict[int, tuple[str, float]] = {}
    for s in turns:
        both = [t for t in turns if names[t] in (names[s], other_side(names[s]))]
        turn = np.concatenate([turns[t] for t in both])
        order = ROOT if s == 0 else USUAL
        if _second(turn, order) > NEAR_LOCK:
            order = min(ORDERS, key=lambda one: _second(turn, one))
        found[s] = order, float(90.0 - np.degrees(_second(turns[s], order)))
    return found


def _second(turn: Array, order: str) -> float:
    """The largest second angle, radians, 0 to π/2."""
    first, _, third = ("XYZ".index(axis) for axis in order)
    return float(np.arcsin(np.minimum(np.abs(turn[:, first, third]), 1.0)).max())

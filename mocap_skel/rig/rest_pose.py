"""The T-pose: how each segment stands in it, from the skeleton file's directions and the clip's own turns.

Character axes: x to the figure's left, y up, z forward. A segment with one joint beyond its own points
along its direction `rest`; one with several stands so that their joints come nearest to the places
`rest_joint` of its children (Kabsch), and keeps the fitted distances between them. What is left, the twist
about a bone, is that of the axis of the hinge at its end where the motion shows one (`rest_axis`), else what the
segment has towards its parent on the clip's average.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mocap_skel.figure.skeleton import Segment
from mocap_skel.rig.kinematics import shortest_turn
from mocap_skel.segments.pose import Array

# A joint turns about one axis if the mean square turn about it is so many times that about any other,
HINGE_RATIO = 4.0
# and at least this much (radians, root mean square): less may be skin.
HINGE_TURN = 0.1
# Cosine to the bone above which an axis tells nothing of the bone's twist.
ALONG = 0.7
# Weight of what only decides where the canonical directions leave a turn open.
WEAK = 1e-3


@dataclass(frozen=True, eq=False)
class Bone:
    """A segment of the figure as its rest pose needs it.

    Attributes:
        segment: of the skeleton file.
        parent: its parent's index in the list, -1 for the root.
        joint: (3,) the joint towards the parent in the segment's own axes.
        centre: (3,) the same joint in the parent's axes.
        end: (3,) in the segment's own axes: the end of one without children, or what its direction leads to where
            that is not the joint beyond it.
        rotation: (frames, 3, 3) in the lab, NaN where it is not known.
        local: (3, 3) its turn in its parent in the rest pose, the root's to the character's axes, if it is known
            beforehand.
    """

    segment: Segment
    parent: int
    joint: Array
    centre: Array
    end: Array | None
    rotation: Array
    local: Array | None = None


def rest_pose(bones: Sequence[Bone], up: Array) -> tuple[list[Array], list[str]]:
    """Rotations (3, 3) from each segment's own axes to the character's, and the segments with no direction.

    Args:
        bones: parents first.
        up: (3,) the lab's vertical.
    """
    children: dict[int, list[int]] = {i: [] for i in range(len(bones))}
    for i, bone in enumerate(bones):
        if bone.parent >= 0:
            children[bone.parent].append(i)
    relative = {i: _relative(bones[b.parent], b) for i, b in enumerate(bones) if b.parent >= 0}
    found: list[Array] = []
    average: list[str] = []
    for i, bone in enumerate(bones):
        if bone.local is not None:
            found.append(found[bone.parent] @ bone.local if bone.parent >= 0 else bone.local)
            continue
        if bone.parent >= 0:
            start = found[bone.parent] @ mean_rotation(relative[i])
        else:
            start = _root(bones, children, up)
        beyond = [bones[c] for c in children[i]]
        placed = [child for child in beyond if child.segment.rest_joint is not None]
        rest = bone.segment.rest
        if placed:
            found.append(_branching(bone, placed, start))
        elif rest is not None and len(beyond) <= 1:
            tip = beyond[0].centre if beyond and bone.end is None else bone.end
            turned = _pointing(start, tip, bone.joint, np.array(rest))
            for c in children[i]:
                turned = _twisted(turned, relative[c], bones[c].segment, np.array(rest))
            found.append(turned)
        else:
            found.append(start)
            average.append(bone.segment.name)
    return found, average


def mean_rotation(rotation: Array) -> Array:
    """The rotation (3, 3) with the least squared distance to all known ones (frames, 3, 3)."""
    known = rotation[np.isfinite(rotation[:, 0, 0])]
    return _nearest(known.mean(axis=0)) if len(known) else np.eye(3)


def hinge_axis(rotation: Array) -> Array | None:
    """The axis (3,) about which a joint's rotations (frames, 3, 3) turn, in the parent's axes; or None.

    It is the first principal direction of the turns away from the mean, if they are a hinge's.
    """
    known = rotation[np.isfinite(rotation[:, 0, 0])]
    if len(known) < 2:
        return None
    away = known @ mean_rotation(rotation).T
    sines = np.stack([away[:, k - 1, k - 2] - away[:, k - 2, k - 1] for k in range(3)], axis=1)
    values, vectors = np.linalg.eigh(sines.T @ sines / (4.0 * len(known)))
    if values[2] < HINGE_TURN**2 or values[2] < HINGE_RATIO * values[1]:
        return None
    return np.asarray(vectors[:, 2])


def _relative(parent: Bone, child: Bone) -> Array:
    return np.asarray(parent.rotation.transpose(0, 2, 1) @ child.rotation)


def _nearest(matrix: Array) -> Array:
    u, _, vt = np.linalg.svd(matrix)
    u[:, 2] *= np.linalg.det(u @ vt)
    return np.asarray(u @ vt)


def _root(bones: Sequence[Bone], children: Mapping[int, list[int]], up: Array) -> Array:
    """How the root stands on the clip's average, its limbs as near to their directions as they come.

    Without any direction it stands as it does in the lab.
    """
    root = bones[0].rotation
    wanted = np.zeros((3, 3))
    for i, bone in enumerate(bones):
        beyond = children[i]
        tip = bones[beyond[0]].centre if len(beyond) == 1 else bone.end
        if bone.segment.rest is None or tip is None or len(beyond) > 1:
            continue
        inside = root.transpose(0, 2, 1) @ bone.rotation @ (tip - bone.joint)
        mean = np.nanmean(inside, axis=0) if np.isfinite(inside[:, 0]).any() else np.zeros(3)
        wanted += np.outer(bone.segment.rest, mean / max(float(np.linalg.norm(mean)), 1e-9))
    if not wanted.any():
        return _turned_up(up) @ mean_rotation(root)
    upward = np.nanmean(root.transpose(0, 2, 1) @ up, axis=0)
    return _nearest(wanted + np.outer([0.0, 1.0, 0.0], upward))


def _turned_up(up: Array) -> Array:
    turn = shortest_turn(up, np.array([0.0, 1.0, 0.0]))
    # Half a turn has no shortest way.
    return turn if (turn @ up)[1] > 0 else np.diag([1.0, -1.0, -1.0])


def _branching(bone: Bone, children: Sequence[Bone], start: Array) -> Array:
    """Kabsch: the joints of a segment onto their places in the T-pose; `start` where they leave a turn open."""
    here = [child.centre for child in children]
    there = [np.array(child.segment.rest_joint) for child in children]
    if bone.parent >= 0:
        here.append(bone.joint)
        there.append(np.zeros(3))
    a, b = np.stack(here), np.stack(there)
    if len(a) > 1:
        a, b = a - a.mean(axis=0), b - b.mean(axis=0)
    wanted = b.T @ a
    size = float(np.linalg.norm(wanted))
    return _nearest(wanted / size + WEAK * start) if size > 0 else start


def _pointing(start: Array, tip: Array | None, joint: Array, rest: Array) -> Array:
    """A rotation turned the shortest way so that its bone points along `rest`."""
    if tip is None or not np.linalg.norm(tip - joint) > 0:
        return start
    direction = start @ (tip - joint)
    if direction @ rest < -0.999 * np.linalg.norm(direction) * np.linalg.norm(rest):
        # Half a turn has no shortest way; it goes by the front, as an arm that is held up comes down.
        aside = np.cross(rest, [0.0, 0.0, 1.0])
        if not np.linalg.norm(aside) > 0:
            aside = np.array([1.0, 0.0, 0.0])
        middle = np.cross(aside, rest)
        return np.asarray(shortest_turn(middle, rest) @ shortest_turn(direction, middle) @ start)
    return np.asarray(shortest_turn(direction, rest) @ start)


def _twisted(rotation: Array, relative: Array, child: Segment, rest: Array) -> Array:
    """A bone turned about itself, by less than a right angle, so that the hinge at its end lies as it should."""
    axis = hinge_axis(relative) if child.rest_axis is not None else None
    if axis is None:
        return rotation
    bone = rest / np.linalg.norm(rest)
    now, wanted = rotation @ axis, np.array(child.rest_axis)
    if abs(now @ bone) > ALONG or abs(wanted @ bone) > ALONG * np.linalg.norm(wanted):
        return rotation
    now, wanted = now - (now @ bone) * bone, wanted - (wanted @ bone) * bone
    if now @ wanted < 0:
        now = -now
    return np.asarray(shortest_turn(now, wanted) @ rotation)

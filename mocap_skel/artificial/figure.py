"""Figures as data, the standard human among them, and the poses that a motion gives them.

The lab is right-handed: X to the subject's front, Y to the left, Z up, floor at z = 0. In the zero
pose a figure stands, arms hanging with the thumbs forward, and all segment axes are the lab's. A
segment's origin is the joint to its parent; the human root's is the middle between the hip joints.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Vector = tuple[float, float, float]

STATURE = 1.75
"""Metres; the tables of this package are measured on a subject of this height."""


@dataclass(frozen=True)
class Segment:
    """One rigid segment of a figure.

    Attributes:
        name: unique in its figure.
        parent: the parent's name; None for the root.
        joint: name of the joint to the parent; empty for the root.
        offset: that joint in the parent's axes (the constant that a fit looks for), metres; for the
            root, where its origin is in the lab in the zero pose.
        end: far end of the bone in the segment's own axes, metres; the first child's joint if None.

    Example:
        >>> from mocap_skel.artificial import Segment
        >>> shank = Segment("Shank", parent="Thigh", joint="Knee", offset=(0.0, 0.0, -0.43))
        >>> shank.joint, shank.offset
        ('Knee', (0.0, 0.0, -0.43))
    """

    name: str
    parent: str | None = None
    joint: str = ""
    offset: Vector = (0.0, 0.0, 0.0)
    end: Vector | None = None


@dataclass(frozen=True)
class Pose:
    """Where a segment is in the lab in each frame.

    Attributes:
        rotation: its axes as columns, (frames, 3, 3).
        origin: (frames, 3), metres.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial import Pose
        >>> pose = Pose(np.eye(3)[None], np.array([[0.0, 0.0, 1.0]]))
        >>> pose.place((0.1, 0.0, 0.0)).tolist()
        [[0.1, 0.0, 1.0]]
    """

    rotation: Array
    origin: Array

    def place(self, local: Array | Vector) -> Array:
        """Lab positions (frames, 3) of a point (3,) or a track (frames, 3) in the segment's axes, metres."""
        turned = self.rotation @ np.asarray(local, dtype=np.float64)[..., None]
        return np.asarray(self.origin + turned[..., 0])


@dataclass(frozen=True)
class Motion:
    """What a figure does: a rotation of each joint, frame by frame.

    A figure takes from it what it has segments for.

    Attributes:
        rate: frames a second.
        shift: displacement of the root's origin from its place in the zero pose, (frames, 3),
            metres.
        rotations: segment -> (frames, 3, 3), its axes in its parent's (the root's: in the lab's).
            A segment that is not listed keeps the zero pose.
        glide: segment -> (frames, 3), how far its joint is from its place in the parent, in the parent's
            axes, metres: bones that roll and slide on each other. Empty for joints that stay.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial import Motion, from_vector, human
        >>> bend = np.linspace(0, 1, 11)[:, None] * [0.0, 1.0, 0.0]  # radians about y
        >>> motion = Motion(10.0, np.zeros((11, 3)), {"LowerLeftLeg": from_vector(bend)})
        >>> human().poses(motion)["LeftFoot"].origin[[0, -1], 0].round(3).tolist()
        [0.0, -0.363]
    """

    rate: float
    shift: Array
    rotations: Mapping[str, Array]
    glide: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True)
class Figure:
    """A tree of segments, each after its parent.

    Raises:
        ValueError: two segments or joints of one name, no root or several, a parent that does not
            come before its child, a joint without a name.

    Example:
        >>> from mocap_skel.artificial import Figure, Segment
        >>> leg = Figure((Segment("Thigh"), Segment("Shank", "Thigh", "Knee", (0.0, 0.0, -0.43))))
        >>> list(leg.joints), leg.bones["Thigh"].tolist()
        (['Knee'], [0.0, 0.0, -0.43])
    """

    segments: tuple[Segment, ...]

    def __post_init__(self) -> None:
        seen: set[str] = set()
        for segment in self.segments:
            if segment.name in seen:
                raise ValueError(f"two segments are called {segment.name!r}")
            if (segment.parent is None) != (not seen):
                raise ValueError("the first segment, and no other, must be a root (parent None)")
            if segment.parent is not None and segment.parent not in seen:
                raise ValueError(f"{segment.name!r} must come after its parent {segment.parent!r}")
            seen.add(segment.name)
        if not seen:
            raise ValueError("a figure needs at least a root")
        joints = [segment.joint for segment in self.segments[1:]]
        if not all(joints) or len(set(joints)) < len(joints):
            raise ValueError(f"every segment but the root needs a joint name of its own: {joints}")

    @cached_property
    def joints(self) -> dict[str, Segment]:
        """Joint name -> the child segment that hangs on it, in the figure's order."""
        return {segment.joint: segment for segment in self.segments[1:]}

    @cached_property
    def bones(self) -> dict[str, Array]:
        """Segment -> end of its bone in its own axes, (3,); zero where the figure does not say."""
        ends: dict[str, Array] = {}
        for segment in self.segments:
            first = next((s.offset for s in self.segments if s.parent == segment.name), None)
            ends[segment.name] = np.array(segment.end or first or (0.0, 0.0, 0.0))
        return ends

    def poses(self, motion: Motion) -> dict[str, Pose]:
        """Every segment's pose in every frame of a motion (forward kinematics)."""
        still = np.broadcast_to(np.eye(3), (len(motion.shift), 3, 3))
        poses: dict[str, Pose] = {}
        for segment in self.segments:
            own = motion.rotations.get(segment.name, still)
            if segment.parent is None:
                poses[segment.name] = Pose(own, motion.shift + np.array(segment.offset))
            else:
                parent = poses[segment.parent]
                place = np.array(segment.offset) + motion.glide.get(segment.name, 0.0)
                poses[segment.name] = Pose(parent.rotation @ own, parent.place(place))
        return poses


def mirrored(point: Vector) -> Vector:
    """The point on the other side of the body."""
    return point[0], -point[1], point[2]


def scaled(point: Vector, factor: float) -> Vector:
    """The point of a body that is `factor` times as large."""
    return point[0] * factor, point[1] * factor, point[2] * factor


# Heights and lengths follow Drillis and Contini's shares of stature (in Winter, Biomechanics and
# Motor Control of Human Movement); the spine's joints stand for L4/L5 and C7/T1. Metres, left side.
_TRUNK = (
    Segment("Hips", offset=(0.0, 0.0, 0.928)),
    Segment("Chest", "Hips", "Waist", (-0.020, 0.0, 0.130), end=(0.0, 0.0, 0.455)),
    Segment("Head", "Chest", "Neck", (0.0, 0.0, 0.455), end=(0.020, 0.0, 0.237)),
)
_ARM = (
    Segment("UpperLeftArm", "Chest", "LeftShoulder", (0.010, 0.184, 0.372)),
    Segment("LowerLeftArm", "UpperLeftArm", "LeftElbow", (0.0, 0.0, -0.3255)),
    Segment("LeftHand", "LowerLeftArm", "LeftWrist", (0.0, 0.0, -0.2555), end=(0.0, 0.0, -0.185)),
)
_LEG = (
    Segment("UpperLeftLeg", "Hips", "LeftHip", (0.0, 0.088, 0.0)),
    Segment("LowerLeftLeg", "UpperLeftLeg", "LeftKnee", (0.0, 0.0, -0.429)),
    Segment("LeftFoot", "LowerLeftLeg", "LeftAnkle", (0.0, 0.0, -0.431), end=(0.195, 0.0, -0.053)),
)
_SOLE = 0.068

# No body is symmetric, and a mirrored one would hide a mix-up of left and right from every test.
# The leg's two differences cancel, so that both feet stand on the floor.
_RIGHT_LONGER = {
    "RightElbow": 0.004,
    "RightWrist": -0.003,
    "RightKnee": -0.005,
    "RightAnkle": 0.005,
}


def _right(segment: Segment) -> Segment:
    joint = segment.joint.replace("Left", "Right")
    x, y, z = mirrored(segment.offset)
    return Segment(
        segment.name.replace("Left", "Right"),
        segment.parent and segment.parent.replace("Left", "Right"),
        joint,
        (x, y, z - _RIGHT_LONGER.get(joint, 0.0)),
        segment.end and mirrored(segment.end),
    )


def human(stature: float = STATURE) -> Figure:
    """The standard human: 15 segments and 14 joints, its right limbs a little other than the left.

    Args:
        stature: metres; all lengths grow with it.

    Raises:
        ValueError: a stature that is not positive.

    Example:
        >>> from mocap_skel.artificial import human
        >>> figure = human(1.75)
        >>> len(figure.segments), figure.joints["LeftKnee"].offset
        (15, (0.0, 0.0, -0.429))
    """
    if not stature > 0:
        raise ValueError(f"stature must be positive metres, got {stature}")
    k = stature / STATURE
    right_arm, right_leg = (tuple(map(_right, limb)) for limb in (_ARM, _LEG))
    return Figure(
        tuple(
            Segment(s.name, s.parent, s.joint, scaled(s.offset, k), s.end and scaled(s.end, k))
            for s in (*_TRUNK, *right_arm, *_ARM, *right_leg, *_LEG)
        )
    )


def floor_contacts(stature: float = STATURE) -> list[tuple[str, Vector]]:
    """Points of `human` that can bear on the floor, (segment, position): feet and knees."""
    k = stature / STATURE
    points: list[tuple[str, Vector]] = []
    for side in ("Right", "Left"):
        points += [(f"{side}Foot", scaled((x, 0.0, -_SOLE), k)) for x in (-0.06, 0.13, 0.19)]
        points.append((f"Lower{side}Leg", scaled((0.05, 0.0, -0.01), k)))
    return points

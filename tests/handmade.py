"""Fits made by hand, joint by joint: what tables, sentences and pictures of them say is known beforehand."""

from dataclasses import replace

import numpy as np

from mocap_skel.figure.skeleton import Segment, Skeleton
from mocap_skel.joints.joint_fit import JointFit, unfitted
from mocap_skel.segments.pose import Pose
from mocap_skel.skeleton_fit import SegmentFit, SkeletonFit

FRAMES = 5


def joint(name, se=0.001, *, parent="Root", share=1.0, landmarks=(), at=(0.0, 0.0, 0.0)):
    """A fitted joint with a standard error in its worst direction, metres."""
    nothing = unfitted(name, parent, f"{name}Part", FRAMES, "")
    return replace(
        nothing,
        centre=np.array(at),
        covariance=np.diag([se**2, 0.0, 0.0]),
        shown="yes",
        samples=100,
        share=share,
        landmarks=tuple(landmarks),
        track=np.tile(np.array(at), (FRAMES, 1)),
    )


def fit_of(*joints, movements=None, segments=()):
    movements = movements or {}
    parts = [Segment("Root", None, None, ("A", "B", "C"))]
    for j in joints:
        assert isinstance(j, JointFit)
        parts.append(Segment(j.child, j.parent, j.joint, (), movement=movements.get(j.joint, "")))
    still = Pose(np.tile(np.eye(3), (FRAMES, 1, 1)), np.zeros((FRAMES, 3)))
    poses = {n: SegmentFit(n, still, {}, None, np.zeros(3)) for n in ("Root", *segments)}
    return SkeletonFit(
        clip="c", subject="", skeleton=Skeleton("s", tuple(parts)),
        frame_numbers=np.arange(1, FRAMES + 1), rate=100.0, up="z", sigma=0.001, segments=poses,
        joints=tuple(joints), notes=(),
    )  # fmt: skip


def leg(side, length):
    """A knee and the ankle so far below it."""
    knee = joint(f"{side}Knee", at=(0.0, 0.0, 1.0))
    ankle = joint(f"{side}Ankle", parent=knee.child, at=(0.0, 0.0, 1.0 - length))
    return knee, ankle

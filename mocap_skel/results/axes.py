"""The same fit in axes of which another one points up."""

from __future__ import annotations

from dataclasses import replace

from mocap_skel.clip import turn_between
from mocap_skel.segments.pose import Array, Pose
from mocap_skel.skeleton_fit import SkeletonFit


def turned(fit: SkeletonFit, up: str | None) -> SkeletonFit:
    """A fit in axes of which `up` is the vertical one.

    The axes are renamed in a circle, so that a right-handed system stays one: from z up to y up,
    (x, y, z) becomes (y, z, x). Poses and tracks are turned; what is said of a joint in its parent's axes
    (centre, standard errors) stays.

    Args:
        fit: in any axes.
        up: "x", "y" or "z"; None = as it is.

    Raises:
        ValueError: `up` is none of "x", "y", "z".
    """
    if up is None or up == fit.up:
        return fit
    turn = turn_between(fit.up, up)
    return replace(
        fit,
        up=up,
        segments={
            name: replace(
                segment,
                pose=_turned(segment.pose, turn),
                points=None if segment.points is None else segment.points @ turn.T,
            )
            for name, segment in fit.segments.items()
        },
        joints=tuple(replace(joint, track=joint.track @ turn.T) for joint in fit.joints),
    )


def _turned(pose: Pose, turn: Array) -> Pose:
    return Pose(turn @ pose.rotation, pose.origin @ turn.T)

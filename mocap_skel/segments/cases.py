"""Poses of frames that leave a segment too few markers: the thesis's cases 2 and 3 (5.5.1.2, 5.5.1.3)."""

from __future__ import annotations

import numpy as np

from mocap_skel.segments.pose import Array, Pose, one_marker_pose
from mocap_skel.segments.shape import Shape, median


def filled(pose: Pose, other: Pose) -> Pose:
    """The first pose where it is known, the second elsewhere."""
    known = pose.known
    if known.all():
        return pose
    return Pose(
        np.where(known[:, None, None], pose.rotation, other.rotation),
        np.where(known[:, None], pose.origin, other.origin),
    )


def filled_by_hinge(pose: Pose, shape: Shape, points: Array, joint: Array, axis: Array) -> Pose:
    """Case 3 in frames where one marker is left: a hinge's axis is fixed in the child as well.

    The shape's last point is the joint; joint and axis are lab tracks (frames, 3).
    """
    inside = middle(np.einsum("fji,fj->fi", pose.rotation, axis))
    places, at = shape.template[:-1], shape.template[-1]
    for m, place in enumerate(places):
        if pose.known.all():
            break
        pose = filled(pose, one_marker_pose(points[:, m], joint, axis, place, at, inside))
    return pose


def beside(points: Array, track: Array) -> Array:
    """Points (frames, M, 3) with a track (frames, 3) as one more."""
    return np.concatenate([points, track[:, None]], axis=1)


def middle(values: Array) -> Array:
    """Median place (3,) of a track (frames, 3), over the frames in which it is known."""
    return median(np.ascontiguousarray(values.T))


def turned_with(parent: Pose, marker: Array) -> Pose:
    """A marker (frames, 3) with its parent's turn, where both are seen."""
    seen = (parent.known & np.isfinite(marker[:, 0]))[:, None]
    return Pose(np.where(seen[..., None], parent.rotation, np.nan), np.where(seen, marker, np.nan))

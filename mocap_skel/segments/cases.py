"""A segment's pose by the number of its markers: the thesis's cases 1 to 3 (5.5.1.1 to 5.5.1.3).

Three markers give a pose by themselves, two with the joint, one with the joint and an axis. A segment of three
markers falls back on the other cases in frames that have fewer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocap_skel.segments.pose import Array, Pose, one_marker_pose
from mocap_skel.segments.shape import Shape, find_shape, median


@dataclass(frozen=True, eq=False)
class Link:
    """The joint that a segment hangs from, as its pose can use it: lab tracks.

    Attributes:
        track: (frames, 3), the joint, metres.
        axis: (frames, 3), the direction of the joint's axis.
        hinge: whether the segment turns about that axis only, so that the axis is fixed in it as well.
    """

    track: Array
    axis: Array
    hinge: bool = False


@dataclass(frozen=True, eq=False)
class Posed:
    """A segment's pose and the points that it is of, in the segment's own coordinates.

    Attributes:
        pose: NaN in frames that do not determine it.
        template: (M, 3), the segment's markers, metres; the joint may be one more point behind them.
        joint: (3,), the joint; None for the root.
        shape: the rigid shape that the pose is of; None for one marker.
    """

    pose: Pose
    template: Array
    joint: Array | None
    shape: Shape | None = None


def by_markers(points: Array, shape: Shape, pose: Pose, link: Link) -> Posed:
    """Case 1: a segment of three markers or more; cases 2 and 3 in frames that have fewer.

    Args:
        points: (frames, M, 3), metres, NaN = missing.
        shape: the markers' rigid shape.
        pose: their pose onto it.
        link: the joint.

    Example:
        One of three markers is missing in a frame; there the joint stands in for it.

        >>> import numpy as np
        >>> x = np.zeros((3, 4, 3)) + [[0, 0, 0], [0.2, 0, 0], [0, 0.2, 0], [0, 0, 0.3]]
        >>> x[1, 2] = np.nan
        >>> shape, pose = find_shape(x[:, :3])
        >>> pose.known.tolist()
        [True, False, True]
        >>> link = Link(x[:, 3], np.zeros((3, 3)))
        >>> by_markers(x[:, :3], shape, pose, link).pose.known.tolist()
        [True, True, True]
    """
    joint = middle(pose.to_segment(link.track[:, None])[:, 0])
    if not pose.known.all():
        template, weights = np.vstack([shape.template, joint]), np.append(shape.weights, 1.0)
        extended = Shape(template, weights, shape.chosen, shape.sigma)
        pose = filled(pose, extended.pose(beside(points, link.track)))
        if link.hinge:
            pose = filled_by_hinge(pose, extended, points, link)
    return Posed(pose, shape.template, joint, shape)


def by_markers_and_joint(points: Array, link: Link, triad: bool = False) -> Posed | None:
    """Case 2: a segment of two markers, or of three in line, and its joint; case 3 where only one is seen.

    Args:
        points: (frames, M, 3), metres, NaN = missing.
        link: the joint.
        triad: take the pose from three points alone, not by least squares from all.

    Returns:
        None where markers and joint are no three points off a line that are seen together. The joint
        is the last point of the shape.

    Example:
        >>> import numpy as np
        >>> x = np.zeros((5, 3, 3)) + [[0.2, 0, 0], [0, 0.2, 0], [0, 0, 0.3]]
        >>> posed = by_markers_and_joint(x[:, :2], Link(x[:, 2], np.zeros((5, 3))))
        >>> posed.pose.to_lab(posed.joint)[0].round(9) + 0.0
        array([0. , 0. , 0.3])
        >>> by_markers_and_joint(x[:, :1], Link(x[:, 2], np.zeros((5, 3)))) is None
        True
    """
    with_joint = beside(points, link.track)
    found = find_shape(with_joint) if points.shape[1] >= 2 else None
    if found is None:
        return None
    shape, pose = found
    if triad:
        pose = shape.triad_pose(with_joint)
    if link.hinge:
        pose = filled_by_hinge(pose, shape, points, link)
    return Posed(pose, shape.template, shape.template[-1], shape)


def by_one_marker(marker: Array, link: Link, distance: float) -> Posed:
    """Case 3: the line from joint to marker and an axis across it.

    Args:
        marker: (frames, 3), metres.
        link: the joint and the axis.
        distance: of the two, metres.

    Example:
        >>> import numpy as np
        >>> link = Link(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))
        >>> posed = by_one_marker(np.array([[0.0, 0.3, 0.0]]), link, 0.3)
        >>> posed.pose.to_lab(posed.joint).round(9).tolist()
        [[0.0, 0.0, 0.0]]
    """
    place, joint = np.zeros(3), np.array([distance, 0.0, 0.0])
    pose = one_marker_pose(marker, link.track, link.axis, place, joint, np.array([0.0, 0.0, 1.0]))
    return Posed(pose, place[None], joint)


def by_line(points: Array, guide: int, posed: Posed, link: Link) -> Posed:
    """Case 3 for several markers in line with the joint: each of them keeps its place on the line.

    Args:
        points: (frames, M, 3), metres, NaN = missing.
        guide: the marker that the pose is of.
        posed: the segment by that marker alone.
        link: the joint and the axis.

    Returns:
        The segment with all markers, and with a pose also in frames that show only one of the others.

    Example:
        The second of two markers is missing in a frame, where the first one stands in for it.

        >>> import numpy as np
        >>> x = np.zeros((3, 2, 3)) + [[0, 0.1, 0], [0, 0.3, 0]]
        >>> x[1, 1] = np.nan
        >>> link = Link(np.zeros((3, 3)), np.zeros((3, 3)) + [0.0, 0.0, 1.0])
        >>> posed = by_line(x, 1, by_one_marker(x[:, 1], link, 0.3), link)
        >>> posed.template.round(9).tolist(), posed.pose.known.tolist()
        ([[0.2, 0.0, 0.0], [0.0, 0.0, 0.0]], [True, True, True])
    """
    pose, joint = posed.pose, posed.joint
    inside = pose.to_segment(points)
    places = np.stack([middle(inside[:, m]) for m in range(points.shape[1])])
    places[guide] = posed.template[0]
    if joint is not None:
        axis = middle(np.einsum("fji,fj->fi", pose.rotation, link.axis))
        for m in np.argsort(-np.linalg.norm(places - joint, axis=1)).tolist():
            if pose.known.all():
                break
            if np.isfinite(places[m]).all():
                other = one_marker_pose(points[:, m], link.track, link.axis, places[m], joint, axis)
                pose = filled(pose, other)
    return Posed(pose, places, joint)


def by_swing(marker: Array, track: Array, parent: Pose, distance: float) -> Posed:
    """One marker without an axis: turned from the parent by the shortest way to the line from joint to marker.

    Nothing is seen of the turn about that line; of all ways to draw the frame, this one turns about it least.

    Args:
        marker: (frames, 3), metres, the segment's origin.
        track: (frames, 3), its joint, metres.
        parent: the parent's pose.
        distance: from joint to marker, metres.

    Example:
        An arm that is raised to the side: its own turn is that of the raising.

        >>> import numpy as np
        >>> chest = Pose(np.tile(np.eye(3), (3, 1, 1)), np.zeros((3, 3)))
        >>> angle = np.radians([-45.0, 0.0, 45.0])
        >>> elbow = np.stack([np.sin(angle), 0 * angle, -np.cos(angle)], axis=1)
        >>> arm = by_swing(elbow, np.zeros((3, 3)), chest, 1.0)
        >>> arm.pose.to_lab(arm.joint).round(9).tolist()[0], np.ptp(arm.pose.rotation[:, 1], axis=0).round(9).tolist()
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    """
    back = np.einsum("fji,fj->fi", parent.rotation, track - marker)
    with np.errstate(invalid="ignore", divide="ignore"):
        back = back / np.linalg.norm(back, axis=1, keepdims=True)
    place, joint = np.zeros((1, 3)), np.array([distance, 0.0, 0.0])
    seen = np.isfinite(back[:, 0])
    if not seen.any():
        unknown = Pose(np.full_like(parent.rotation, np.nan), np.full_like(marker, np.nan))
        return Posed(unknown, place, joint)
    first = _frame_along(back[seen].mean(axis=0))
    rotation = parent.rotation @ _shortest(first[:, 0], back) @ first
    return Posed(Pose(rotation, np.where(seen[:, None], marker, np.nan)), place, joint)


def _frame_along(direction: Array) -> Array:
    """(3, 3): a rotation whose first column has a direction (3,)."""
    other = np.eye(3)[np.abs(direction).argmin()]
    columns, signs = np.linalg.qr(np.stack([direction, other, np.cross(direction, other)], axis=1))
    return np.asarray(columns * np.where(np.diag(signs) < 0, -1.0, 1.0))


def _shortest(start: Array, ends: Array) -> Array:
    """(N, 3, 3): the smallest turns of a unit vector (3,) to others (N, 3); NaN for half a turn, which has no way."""
    axis, cosine = np.cross(start, ends), ends @ start
    cross = np.zeros((len(ends), 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        cross[:, i, j], cross[:, j, i] = -axis[:, k], axis[:, k]
    share = np.where(cosine > -1.0, 1.0 / np.maximum(1.0 + cosine, 1e-12), np.nan)
    return np.asarray(np.eye(3) + cross + share[:, None, None] * (cross @ cross))


def turned_with(parent: Pose, marker: Array, track: Array) -> Posed:
    """A segment that turns with its parent: where its one marker is too near to its joint to show a turn.

    Args:
        parent: the parent's pose.
        marker: (frames, 3), metres, the segment's origin.
        track: (frames, 3), its joint, metres.

    Example:
        >>> import numpy as np
        >>> forearm = Pose(np.eye(3)[None], np.zeros((1, 3)))
        >>> hand = turned_with(forearm, np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 0.0, 1.25]]))
        >>> hand.joint
        array([0.  , 0.  , 0.25])
    """
    seen = (parent.known & np.isfinite(marker[:, 0]))[:, None]
    pose = Pose(np.where(seen[..., None], parent.rotation, np.nan), np.where(seen, marker, np.nan))
    return Posed(pose, np.zeros((1, 3)), middle(pose.to_segment(track[:, None])[:, 0]))


def filled(pose: Pose, other: Pose) -> Pose:
    """The first pose where it is known, the second elsewhere."""
    known = pose.known
    if known.all():
        return pose
    return Pose(
        np.where(known[:, None, None], pose.rotation, other.rotation),
        np.where(known[:, None], pose.origin, other.origin),
    )


def filled_by_hinge(pose: Pose, shape: Shape, points: Array, link: Link) -> Pose:
    """Case 3 in frames where one marker is left: a hinge's axis is fixed in the child as well.

    The shape's last point is the joint.
    """
    inside = middle(np.einsum("fji,fj->fi", pose.rotation, link.axis))
    places, joint = shape.template[:-1], shape.template[-1]
    for m, place in enumerate(places):
        if pose.known.all():
            break
        one = one_marker_pose(points[:, m], link.track, link.axis, place, joint, inside)
        pose = filled(pose, one)
    return pose


def beside(points: Array, track: Array) -> Array:
    """Points (frames, M, 3) with a track (frames, 3) as one more."""
    return np.concatenate([points, track[:, None]], axis=1)


def middle(values: Array) -> Array:
    """Median place (3,) of a track (frames, 3), over the frames in which it is known."""
    return median(np.ascontiguousarray(values.T))

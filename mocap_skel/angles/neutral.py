"""The neutral pose that another clip shows: its markers, with the segments and joints of the clip at hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from mocap_skel.segments.cases import filled
from mocap_skel.segments.pose import Array, Pose, least_squares_pose, nearest_rotation
from mocap_skel.skeleton_fit import SegmentFit, SkeletonFit

# Metres, root mean square of a segment's markers about their places, from which they may have been put on anew. Picked by eye
# between what skin does (a centimetre, Leardini 2005, Gait Posture 21, 212) and another place; only a note hangs on it.
MOVED = 0.015
# Degrees, median turn of a joint away from its mean, from which the person does not stand still. Picked by eye: standing
# people sway by one or two, and a movement that shows a joint turns it by tens; only a note hangs on it.
STILL = 5.0


@dataclass(frozen=True, eq=False)
class Static:
    """A static clip as seen from another one of the same markers.

    Attributes:
        turns: segment → (frames, 3, 3) in the static clip, of the axes that the segment has in the other clip.
        landmarks: segment → marker → place (3,) in those axes, of markers that only the static clip has.
        doubtful: segments whose markers lie otherwise than in the other clip.
        restless: joints that turn in the static clip.
        up: the static clip's vertical axis.
    """

    turns: Mapping[str, Array]
    landmarks: Mapping[str, Mapping[str, Array]]
    doubtful: tuple[str, ...]
    restless: tuple[str, ...]
    up: str


def seen_from(fit: SkeletonFit, static: SkeletonFit) -> Static:
    """Lay the segments of a fit onto the markers of a static clip.

    Of the static clip only the markers count: one in which nobody moves shows no joint. A segment with fewer than three
    markers is held by its joint as well. A segment that has not enough is left out, and so is one without common markers.
    """
    poses: dict[str, Pose] = {}
    landmarks: dict[str, dict[str, Array]] = {}
    doubtful = []
    centres = {joint.child: joint for joint in fit.joints}
    for name, here in fit.segments.items():
        there = static.segments.get(name)
        if there is None or there.points is None:
            continue
        joint = centres.get(name)
        above = None if joint is None else poses.get(joint.parent)
        track = None if joint is None or above is None else above.to_lab(joint.centre)
        pose, off = _laid(here, there, there.points, track)
        if not pose.known.any():
            continue
        poses[name] = pose
        inside = pose.to_segment(there.points)
        landmarks[name] = {
            marker: _mean(inside[:, m])
            for m, marker in enumerate(there.template)
            if marker not in here.template
        }
        if off > MOVED:
            doubtful.append(name)
    turns = {name: pose.rotation for name, pose in poses.items()}
    restless = tuple(
        joint.joint
        for joint in fit.joints
        if joint.parent in turns
        and joint.child in turns
        and _turning(turns[joint.parent], turns[joint.child]) > STILL
    )
    return Static(turns, landmarks, tuple(doubtful), restless, static.up)


def _turning(parent: Array, child: Array) -> float:
    """Median turn of a child in its parent away from the mean, degrees; 0 where they are never seen together."""
    between = parent.transpose(0, 2, 1) @ child
    mean = mean_rotation(between)
    if mean is None:
        return 0.0
    # The trace of a rotation by an angle is 1 + 2 cos(angle).
    cosine = (np.einsum("ij,fij->f", mean, between) - 1.0) / 2.0
    return float(np.degrees(np.arccos(np.clip(np.nanmedian(cosine), -1.0, 1.0))))


def _laid(
    here: SegmentFit, there: SegmentFit, points: Array, track: Array | None
) -> tuple[Pose, float]:
    """The pose of a segment by its markers in another clip, and how far they are from their places, metres."""
    common = [marker for marker in there.template if marker in here.template]
    columns = [list(there.template).index(marker) for marker in common]
    template = np.array([here.template[marker] for marker in common]).reshape(-1, 3)
    points = points[:, columns]
    pose = _pose(points, template)
    if track is not None and here.joint is not None:
        more = np.concatenate([points, track[:, None]], axis=1)
        pose = filled(pose, _pose(more, np.vstack([template, here.joint])))
    away = pose.to_segment(points) - template
    square = (away**2).sum(axis=2)
    seen = np.isfinite(square)
    return pose, float(np.sqrt(square[seen].mean())) if seen.any() else 0.0


def _pose(points: Array, template: Array) -> Pose:
    if len(template) < 3:
        return Pose(np.full((len(points), 3, 3), np.nan), np.full((len(points), 3), np.nan))
    return least_squares_pose(points, template, np.ones(len(template)))


def _mean(track: Array) -> Array:
    """The mean (3,) of a track (frames, 3) over the frames that have it; NaN without any."""
    known = np.isfinite(track).all(axis=1)
    return np.asarray(track[known].mean(axis=0)) if known.any() else np.full(3, np.nan)


def with_landmarks(fit: SkeletonFit, static: Static) -> SkeletonFit:
    """The fit with markers that only the static clip has, such as those on the inner sides of the joints."""
    segments = {}
    for name, segment in fit.segments.items():
        more = static.landmarks.get(name, {})
        known = {marker: place for marker, place in more.items() if np.isfinite(place).all()}
        segments[name] = replace(segment, template={**known, **segment.template})
    return replace(fit, segments=segments)


def mean_rotation(rotation: Array) -> Array | None:
    """The mean (3, 3) of rotations (frames, 3, 3), frames with NaN left out; None without any.

    >>> turns = np.array([[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], np.full((3, 3), np.nan)])
    >>> mean_rotation(turns).round(6) + 0.0
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    known = np.isfinite(rotation).all(axis=(1, 2))
    if not known.any():
        return None
    mean: Array = nearest_rotation(rotation[known].mean(axis=0)[None])[0]
    return mean

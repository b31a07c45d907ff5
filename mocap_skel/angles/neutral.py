"""The neutral pose that another clip shows: its segments in the coordinates of the clip at hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from mocap_skel.segments.pose import Array, Pose, least_squares_pose, nearest_rotation
from mocap_skel.skeleton_fit import SegmentFit, SkeletonFit

# Metres, root mean square of a segment's places between two clips, from which its markers were put on anew.
MOVED = 0.015


@dataclass(frozen=True, eq=False)
class Static:
    """A static clip as seen from another one.

    Attributes:
        turns: segment → (frames, 3, 3) in the static clip, of the axes that the segment has in the other clip.
        templates: segment → marker → place (3,) in those axes, of markers that only the static clip has.
        doubtful: segments whose markers lie otherwise than in the other clip.
    """

    turns: Mapping[str, Array]
    templates: Mapping[str, Mapping[str, Array]]
    doubtful: tuple[str, ...]


def seen_from(fit: SkeletonFit, static: SkeletonFit) -> Static:
    """The poses of a static clip in the segment coordinates of another clip of the same markers.

    A segment's coordinates come from its markers' shape, so they differ from clip to clip. The places that a
    segment has in both clips, its markers and its joint, are laid onto each other. A segment without three of them
    off a line is left out.
    """
    turns, templates, doubtful = {}, {}, []
    for name, there in static.segments.items():
        here = fit.segments.get(name)
        between = None if here is None else _between(here, there)
        if between is None:
            continue
        placed, off = between
        turns[name] = there.pose.rotation @ placed.rotation[0].T
        own = here.template if here else {}
        templates[name] = {
            marker: placed.to_lab(place)[0]
            for marker, place in there.template.items()
            if marker not in own
        }
        if off > MOVED:
            doubtful.append(name)
    return Static(turns, templates, tuple(doubtful))


def _between(here: SegmentFit, there: SegmentFit) -> tuple[Pose, float] | None:
    """The pose of the second's coordinates in the first's, and how far places are off it, metres."""
    ours, theirs = _places(here), _places(there)
    names = [name for name in theirs if name in ours]
    if len(names) < 3:
        return None
    points = np.array([ours[name] for name in names])
    template = np.array([theirs[name] for name in names])
    placed = least_squares_pose(points[None], template, np.ones(len(names)))
    if not placed.known[0]:
        return None
    off = np.array([placed.to_lab(place)[0] for place in template]) - points
    return placed, float(np.sqrt((off**2).sum(axis=1).mean()))


def _places(segment: SegmentFit) -> dict[str, Array]:
    joint = {} if segment.joint is None else {"": segment.joint}
    return {**segment.template, **joint}


def with_landmarks(fit: SkeletonFit, static: Static) -> SkeletonFit:
    """The fit with markers that only the static clip has, such as those on the inner sides of the joints."""
    segments = {
        name: replace(segment, template={**static.templates.get(name, {}), **segment.template})
        for name, segment in fit.segments.items()
    }
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

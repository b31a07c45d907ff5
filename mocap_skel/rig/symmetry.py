"""Left and right alike: bones of one length on both sides, as characters have them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mocap_skel.figure.sides import other_side
from mocap_skel.figure.skeleton import Segment
from mocap_skel.segments.pose import Array

# From the left of a character to its right; its x points to its left.
MIRROR = np.array([-1.0, 1.0, 1.0])


def even_offsets(
    segments: Sequence[Segment],
    parents: Sequence[int],
    offsets: Array,
    turns: Sequence[Array],
) -> Array:
    """Offsets (n, 3) of joints that are mirror images in the rest pose: each the mean of both sides.

    A joint of no side comes to lie in the middle, if the figure has sides at all.

    Args:
        segments: of the figure.
        parents: (n) of each, -1 for the root.
        offsets: (n, 3) of each joint from its parent's, in the parent's axes.
        turns: from each segment's axes to the character's, in the rest pose.
    """
    rested = {
        segment.name: turns[parent] @ offset
        for segment, parent, offset in zip(segments, parents, offsets, strict=True)
        if parent >= 0
    }
    even = even_points(rested)
    return np.stack(
        [
            turns[parent].T @ even[segment.name] if parent >= 0 else offset
            for segment, parent, offset in zip(segments, parents, offsets, strict=True)
        ]
    )


def even_points(points: Mapping[str, Array]) -> dict[str, Array]:
    """Points (3,) by segment, along the character's axes: each the mean of itself and its mirror image."""
    if not any(other_side(name) in points for name in points if other_side(name) != name):
        return dict(points)
    return {
        name: 0.5 * (point + MIRROR * points[other])
        if (other := other_side(name)) in points
        else point
        for name, point in points.items()
    }

"""What a clip lacks that shows no figure, in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mocap_skel.clip import Clip
from mocap_skel.figure.skeleton import Skeleton
from mocap_skel.labels.guess.rigid import distances
from mocap_skel.text import listed

# Metres: a face's markers change their distances less, and lie within a head.
FACE, HEAD = 0.03, 0.35
# Fewer points are any segment's.
LEAST = 8


def what_is_missing(clip: Clip) -> str:
    """Why a clip can show no joints, "" if nothing is in the way.

    >>> from dataclasses import replace
    >>> from mocap_skel import read_clip
    >>> clip = read_clip("sample_data/nearly_still.c3d")
    >>> what_is_missing(clip), what_is_missing(replace(clip, points=clip.points[:1]))
    ('', 'it has a single frame, and joints show only where segments move')
    """
    if clip.frames == 1:
        return "it has a single frame, and joints show only where segments move"
    seen = np.isfinite(clip.points[..., 0]).any(axis=0)
    if seen.sum() >= LEAST:
        found = distances(clip.points[:, seen])
        spread, mean = (x[np.isfinite(x)] for x in (found.spread, found.mean))
        if len(spread) and spread.max() < FACE and mean.max() < HEAD:
            return (
                f"its {seen.sum()} points keep their distances within {1e3 * spread.max():.0f} mm, as on a "
                "face, a head or one object: there are no segments that move against each other"
            )
    return ""


def one_segment(skeletons: Sequence[Skeleton]) -> str:
    """What figures of one segment each lack, "" where one has a joint.

    >>> from mocap_skel.figure.skeleton import shipped_skeletons
    >>> one_segment([shipped_skeletons()["human"]]), one_segment([shipped_skeletons()["head"]])
    ('', 'the place and turn of Head, and no joint: markers of a second segment are missing')
    """
    if any(len(skeleton.segments) > 1 for skeleton in skeletons):
        return ""
    names = listed(skeleton.root.name for skeleton in skeletons)
    return f"the place and turn of {names}, and no joint: markers of a second segment are missing"

"""Labels that stand twice in a file: which of the trajectories is the marker."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from mocap_skel.clip import Clip
from mocap_skel.labels.guess.motion import CLEARLY, TOO_MUCH
from mocap_skel.text import listed

# Frames together with another marker that tell anything.
LEAST_FRAMES = 10


def with_right_doubles(clip: Clip, segment_of: Mapping[str, str]) -> Clip:
    """The clip in which the plain label is that of the trajectory that moves with its segment.

    Args:
        clip: as it was read; its columns stay where they are, their labels may change places.
        segment_of: the segment of each label that is known; of copies too where they are markers of their own.

    Returns:
        The clip, with a note for each label of which a trajectory does not move with the segment; the same
        one if there is none.

    >>> from mocap_skel import read_clip
    >>> clip = read_clip("sample_data/nearly_still.c3d")
    >>> with_right_doubles(clip, {}) is clip
    True
    """
    labels, notes = list(clip.labels), []
    copies = {column for own in clip.doubles for column in own}
    for own in clip.doubles:
        first = own[0]
        label, segment = clip.labels[first], segment_of.get(clip.labels[first], "")
        if any(clip.labels[column] in segment_of for column in own[1:]):
            continue  # its copies are markers of their own
        others = [
            i
            for i, (other, whose) in enumerate(zip(clip.labels, clip.subjects, strict=True))
            if segment and segment_of.get(other) == segment and whose == clip.subjects[first]
            and i not in copies
        ]  # fmt: skip
        misfit = {column: _misfit(clip, column, others) for column in own}
        best = min(own, key=lambda column: misfit[column])
        limit = max(TOO_MUCH, CLEARLY * misfit[best])
        wrong = [column for column in own if misfit[column] > limit]
        if not others or not np.isfinite(misfit[best]) or not wrong:
            continue
        taken = best if first in wrong else first
        labels[first], labels[taken] = labels[taken], labels[first]
        rest = listed(labels[column] for column in wrong)
        notes.append(
            f"{label} stands {len(own)} times in the file: number {own.index(taken) + 1} moves with "
            f"{segment} and is taken; set aside: {rest}"
        )
    if not notes:
        return clip
    return replace(
        clip, labels=tuple(labels), notes=(*clip.notes, *notes),
        as_read=clip.as_read or (clip.labels, clip.subjects),
    )  # fmt: skip


def _misfit(clip: Clip, column: int, others: list[int]) -> float:
    """Metres: the median standard deviation of a trajectory's distances to markers; infinite if nothing tells."""
    away = np.linalg.norm(clip.points[:, others] - clip.points[:, [column]], axis=2)
    there = np.isfinite(away)
    count = there.sum(axis=0)
    enough = count >= LEAST_FRAMES
    if not enough.any():
        return float("inf")
    away, there = np.where(there, away, 0.0)[:, enough], there[:, enough]
    mean = away.sum(axis=0) / count[enough]
    off = np.where(there, away - mean, 0.0)
    return float(np.median(np.sqrt(np.square(off).sum(axis=0) / count[enough])))

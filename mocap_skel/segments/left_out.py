"""The record of the samples that a fit leaves out as marker trouble, and what there is to say of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mocap_skel.clip import Clip
from mocap_skel.segments.pose import Array
from mocap_skel.segments.prepare import Prepared
from mocap_skel.segments.shape import median
from mocap_skel.segments.trouble import GAUSS, SKIN, SMALL, SPREADS, Mask
from mocap_skel.text import counted

# Share of the samples in question that have to stand in the other's place for a swap to be named.
MOST = 0.8
# Markers that get a note of their own.
NOTED = 8


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Samples of one marker that are left out.

    Attributes:
        marker, segment: standard names.
        label: the marker's label in the clip.
        frames: the file's own numbers, ascending.
        partner: the marker with which it is plainly exchanged in most of them, "" for none.
    """

    marker: str
    segment: str
    label: str
    frames: NDArray[np.int64]
    partner: str = ""

    @property
    def stretches(self) -> int:
        """Runs of consecutive frames."""
        return 1 + int((np.diff(self.frames) > 1).sum())

    def sentence(self) -> str:
        """How many samples, where, and what it looks like.

        >>> LeftOut("LKNE", "UpperLeftLeg", "LKNE", np.array([7, 8, 9]), "RKNE").sentence()
        'LKNE: 3 samples in frames 7-9 left its segment: swapped with RKNE?'
        """
        name = self.marker if self.label == self.marker else f"{self.marker} (label {self.label})"
        many = len(self.frames) > 1
        where = f"frames {self.frames[0]}-{self.frames[-1]}" if many else f"frame {self.frames[0]}"
        if self.stretches > 1:
            where += f" ({self.stretches} stretches)"
        what = f"{name}: {counted(len(self.frames), 'sample')} in {where} left its segment"
        return what + (f": swapped with {self.partner}?" if self.partner else "")


def left_out(clip: Clip, prepared: Prepared, joints: Mapping[str, Array]) -> tuple[LeftOut, ...]:
    """The markers with trouble, those with the most samples first.

    Args:
        clip: the recording.
        prepared: its markers, and which of their samples were left out.
        joints: segment → track (frames, 3) of its joint towards the parent, metres.
    """
    columns, points = prepared.columns, prepared.points
    each = {
        (segment, m): mask[:, m]
        for segment, mask in prepared.masks.items()
        for m in np.flatnonzero(mask.any(axis=0)).tolist()
    }
    names = {segment: list(of) for segment, of in columns.items()}
    at = {(s, m): columns[s][names[s][m]] for s, m in each}
    together = _together(list(each.values()))
    partners: dict[tuple[str, int], str] = {}
    for i, a in enumerate(each):
        for j, b in enumerate(each):
            # Each has to be away in most of the time of the other.
            both = each[a] & each[b]
            if i >= j or together[i, j] < 0.5 * max(together[i, i], together[j, j]):
                continue
            if _fits(clip.points[:, at[b]], a, both, points, joints) and _fits(
                clip.points[:, at[a]], b, both, points, joints
            ):
                partners.setdefault(a, names[b[0]][b[1]])
                partners.setdefault(b, names[a[0]][a[1]])
    found = [
        LeftOut(
            names[s][m],
            s,
            clip.labels[at[s, m]],
            clip.frame_numbers[mask],
            partners.get((s, m), ""),
        )
        for (s, m), mask in each.items()
    ]
    return tuple(sorted(found, key=lambda one: -len(one.frames)))


def notes(found: tuple[LeftOut, ...], samples: int) -> list[str]:
    """One sentence for all samples that are left out, and one for each of the markers with the most.

    Args:
        found: the markers, those with the most samples first.
        samples: how many the subject has in all.

    >>> knee = LeftOut("LKNE", "UpperLeftLeg", "LKNE", np.array([7]))
    >>> notes((knee,), 2000)[0]
    'left out of the fit as marker trouble: 1 of 2000 samples (0.05 %)'
    """
    if not found:
        return []
    count = sum(len(one.frames) for one in found)
    share = 100 * count / samples
    first = f"left out of the fit as marker trouble: {count} of {counted(samples, 'sample')}"
    text = [f"{first} ({share:.2g} %)"] + [one.sentence() for one in found[:NOTED]]
    rest = found[NOTED:]
    if rest:
        others = sum(len(one.frames) for one in rest)
        text.append(f"{counted(len(rest), 'more marker')} with {counted(others, 'such sample')}")
    return text


def _together(masks: list[Mask]) -> Array:
    """(n, n): in how many frames each two are left out at once."""
    if not masks:
        return np.zeros((0, 0))
    stacked = np.array(masks, dtype=np.float64)
    return np.asarray(stacked @ stacked.T)


def _fits(
    track: Array,
    marker: tuple[str, int],
    frames: Mask,
    points: Mapping[str, Array],
    joints: Mapping[str, Array],
) -> bool:
    """Whether a track (frames, 3) is where a marker belongs, by its mates or, without three, its joint."""
    segment, m = marker
    own = points[segment]
    anchors = [own[:, k] for k in range(own.shape[1]) if k != m]
    if len(anchors) < 2 and segment in joints:
        anchors.append(joints[segment])
    well = np.ones(int(frames.sum()), dtype=np.bool_)
    judged = np.zeros(len(well), dtype=np.bool_)
    for anchor in anchors:
        distance = np.linalg.norm(own[:, m] - anchor, axis=1)
        place = float(median(distance))
        spread = GAUSS * float(median(np.abs(distance - place)))
        limit = max(SPREADS * spread, min(SKIN, SMALL * place))
        off = np.abs(np.linalg.norm(track[frames] - anchor[frames], axis=1) - place)
        seen = np.isfinite(off)
        judged |= seen
        well &= ~seen | (np.where(seen, off, 0.0) <= limit)
    return bool(judged.any() and (well & judged).sum() >= MOST * judged.sum())

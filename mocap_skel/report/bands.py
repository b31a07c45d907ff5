"""What is marked on the page's time line: stretches of frames that are filled, guessed, held, repaired, and events."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mocap_skel.events import Event
from mocap_skel.report.inline import text
from mocap_skel.report.moving import Moving
from mocap_skel.rig.bridging import runs
from mocap_skel.text import counted, listed

EVENT = "event"
"""The kind of what takes a moment."""
# What is marked, in the order of the lanes, and what it means.
KINDS = {
    "filled": "the markers left and the joints beside tell the pose",
    "guessed": "no marker tells the pose: it follows the motion before and after",
    "held": "no marker tells the pose: the nearest one is kept, at an end of the clip",
    "repaired": "a turn was too fast for a person",
    "without": "part of the figure is missing",
    EVENT: "a foot strikes the ground or leaves it, or what else the file names",
}
# A band is drawn at least as wide as this share of the line, else nobody sees it.
_THINNEST = 1 / 300
# Pixels of a fifth of a lane.
HIGH = 2.4
# Names in the words of a band, while its frames are shown and when it is pointed at.
_FEW, _MANY = 2, 12


@dataclass(frozen=True)
class Band:
    """A stretch of frames.

    Attributes:
        kind: one of `KINDS`.
        start, stop: indices of frames.
        segments: of which something is said there.
    """

    kind: str
    start: int
    stop: int
    segments: tuple[str, ...]

    @property
    def words(self) -> str:
        """What is the matter there, in a few words."""
        return f"{self.kind}: {listed(self.segments, _FEW)}"


def bands_of(moving: Moving) -> tuple[Band, ...]:
    """What was filled, guessed, held and repaired in a figure, and where some of it is missing."""
    if moving.animation is None:
        return ()
    motion = moving.animation.motion
    names = [segment.name for segment in motion.model.segments]
    flags = {kind: np.zeros_like(motion.absent) for kind in KINDS}
    for bridge in motion.bridges:
        if bridge.kind:
            flags[bridge.kind][bridge.segment, bridge.start : bridge.stop] = True
    flags["repaired"], flags["without"] = motion.repaired, motion.absent
    return tuple(
        Band(kind, start, stop, _names(names, own[:, start:stop]))
        for kind, own in flags.items()
        for start, stop in runs(np.asarray(own.any(axis=0)))
    )


def event_bands(events: Iterable[Event], numbers: NDArray[np.int64]) -> tuple[Band, ...]:
    """Events as bands of one frame.

    Args:
        events: of the subject.
        numbers: (frames,), the file's own.
    """
    return tuple(
        Band(EVENT, at, at + 1, (_said(event),))
        for event in events
        if 0 <= (at := event.frame - int(numbers[0])) < len(numbers)
    )


def _said(event: Event) -> str:
    whose = "" if event.label.lower().startswith(("left", "right")) else event.context
    found = " (found)" if event.source == "found" else ""
    return f"{whose} {event.label}{found}".strip()


def _names(names: Sequence[str], flags: NDArray[np.bool_]) -> tuple[str, ...]:
    return tuple(name for name, own in zip(names, flags, strict=True) if own.any())


def strip(bands: Sequence[Band], frames: int, first: int) -> str:
    """The bands as a picture as wide as the time line (SVG), a lane for each kind that there is.

    Args:
        bands: what to draw.
        frames: of the clip.
        first: the file's number of its first frame.
    """
    lanes = _kinds(bands)
    if not lanes:
        return ""
    rects = []
    for band in bands:
        wide = max(band.stop - band.start, frames * _THINNEST)
        left = min(max(0.5 * (band.start + band.stop - wide), 0.0), frames - wide)
        here, last = first + band.start, first + band.stop - 1
        numbers = f"frames {here} to {last}" if last > here else f"frame {here}"
        rects.append(
            f'<rect class="{band.kind}" data-frame="{first + band.start}" x="{left:.2f}" '
            f'y="{5 * lanes.index(band.kind)}" width="{wide:.2f}" height="4">'
            f"<title>{text(f'{band.kind}: {listed(band.segments, _MANY)}, {numbers}')}</title></rect>"
        )
    tall = 5 * len(lanes) - 1
    return (
        f'<svg id="bands" viewBox="0 0 {frames} {tall}" height="{HIGH * tall}" preserveAspectRatio="none" '
        f'role="img" aria-label="Stretches of frames: {text(listed(lanes, len(KINDS)))}">'
        f"{''.join(rects)}</svg>"
    )


def meanings(bands: Sequence[Band]) -> str:
    """What the kinds that there are mean, in one sentence; "" without bands."""
    return "; ".join(f"{kind}, {KINDS[kind]}" for kind in _kinds(bands))


def legend(bands: Sequence[Band]) -> str:
    """The kinds that there are and how many frames they have, as items of a list: buttons that go to the next band."""
    return "".join(
        f'<li class="{kind}"><button type="button" data-kind="{kind}" title="{text(KINDS[kind])}: go to the next">'
        f"{text(kind)} {counted(sum(b.stop - b.start for b in bands if b.kind == kind), 'frame')}"
        f"</button></li>"
        for kind in _kinds(bands)
    )


def _kinds(bands: Sequence[Band]) -> list[str]:
    return [kind for kind in KINDS if any(band.kind == kind for band in bands)]

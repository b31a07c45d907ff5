"""What is wrong with a fit and its figure, the worst first, each in one plain sentence that a person can act on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from mocap_skel.report.moving import Moving
from mocap_skel.results.verdict import USABLE, error_95, in_short, levels, name_in_words
from mocap_skel.rig.quality import (
    FLOOR,
    GUESSED,
    MARKER,
    MARKERS,
    SKATING,
    TURN,
    Quality,
    SegmentQuality,
)
from mocap_skel.skeleton_fit import SkeletonFit
from mocap_skel.text import counted

# Nothing that can be measured is worse than this many times its limit: a joint without any error known, say.
_WORST = 100.0


@dataclass(frozen=True, order=True)
class Finding:
    """Something to look at.

    Attributes:
        badness: how many times it is beyond its limit.
        words: one sentence.
        frame: the file's number of the frame to look at; None for no single one.
    """

    badness: float
    words: str
    frame: int | None = None


def findings(fit: SkeletonFit, shown: Moving) -> tuple[Finding, ...]:
    """All that a person should look at, the worst first; of each segment only what is worst about it."""
    found = [*_of_the_joints(fit)]
    if shown.quality is None:
        # Before all else: nothing but CSV can be made of this clip.
        words = "No moving figure can be made of this clip: no two frames in a row show all of it."
        found.append(Finding(2.0 * _WORST, words))
    else:
        quality = shown.quality
        found += [max(_of_a_segment(one, quality, fit.rate)) for one in quality.look_at]
    return tuple(sorted(found, key=lambda one: -one.badness))


def _of_the_joints(fit: SkeletonFit) -> Iterator[Finding]:
    groups = levels(fit)
    poor = {*groups.get("poor", []), *groups.get("none", [])}
    if "doubt" in groups:
        yield Finding(_WORST, in_short(fit))
    elif poor:
        errors = [error_95(joint) / USABLE for joint in fit.joints if joint.joint in poor]
        yield Finding(min(_WORST, max(errors)), in_short(fit))


def _of_a_segment(one: SegmentQuality, quality: Quality, rate: float) -> Iterator[Finding]:
    """What is beyond its limit, each with how many times."""
    name = name_in_words(one.segment)
    for beyond in one.look_at:
        match beyond:
            case "worst":
                off = one.worst or 0.0
                words = f"Marker {one.worst_marker} of the {name} is {_length(off)} from where the figure has it."
                yield Finding(off / MARKER, words, one.worst_frame)
            case "marker_rms":
                off = one.marker_rms or 0.0
                words = f"Check the labels of the {name}: its markers are {_length(off)} off on average."
                yield Finding(off / MARKERS, words, one.worst_frame)
            case "turn_speed":
                speed = one.turn_speed or 0.0
                words = f"The {name} turns faster than a person can."
                yield Finding(speed / TURN, words, one.turn_frame)
            case "skating":
                more = (one.skating or 0.0) - (one.marker_skating or 0.0)
                words = f"The {name} slides {_length(more)} in a second more than its markers while it stands."
                yield Finding(more / SKATING, words)
            case "floor_distance":
                above = one.floor_distance or 0.0
                words = f"The {name} is {_length(above)} from the floor while it stands."
                yield Finding(above / FLOOR, words)
            case "guessed":
                words = f"The {name} is a guess for {one.guessed:.1f} s, in which no marker tells how it turns."
                yield Finding(one.guessed / GUESSED, words)
            case "repaired":
                frames = counted(one.repaired, "frame")
                words = (
                    f"The {name} turned faster than a person can in {frames}, which were replaced."
                )
                yield Finding(one.repaired / rate / GUESSED, words)
            case "absent":
                words = f"The {name} is missing in {one.absent} of {quality.frames} frames: its markers were not seen for too long."
                yield Finding(one.absent / rate / GUESSED, words)


def _length(metres: float) -> str:
    return f"{100 * metres:.0f} cm" if metres >= 0.1 else f"{100 * metres:.1f} cm"

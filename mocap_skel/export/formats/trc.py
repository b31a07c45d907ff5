"""TRC, the marker file that OpenSim reads: the skeleton's points as if they were markers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mocap_skel.export.animated import Tracks
from mocap_skel.export.registry import Rendered, Source, option, register, vertical
from mocap_skel.text import listed, stem

if TYPE_CHECKING:
    from mocap_skel.clip import Clip
    from mocap_skel.segments.pose import Array
    from mocap_skel.skeleton_fit import SkeletonFit

SUFFIX = ".skeleton.trc"


@dataclass(frozen=True)
class TrcOptions(Tracks):
    """What a TRC may be told.

    Attributes:
        up: the vertical axis; OpenSim's models have it in y.
        markers: whether the subject's markers stand behind the skeleton.
    """

    up: str | None = vertical("y")
    markers: bool = option(False, "also the subject's markers.")


@register(
    "trc",
    suffixes=(SUFFIX,),
    options=TrcOptions,
    makes=f"walk{SUFFIX} for OpenSim",
    lacks="a TRC has points only, and does not say how well a joint is known",
)
def write(fit: SkeletonFit, options: TrcOptions, source: Source) -> Rendered:
    """The tracks of skeleton.csv as TRC text: metres, the clip's own frame numbers, missing = empty.

    The notes tell of the axes and of names that had to change.
    """
    from mocap_skel.clip import turn_between
    from mocap_skel.export.trc_text import axes_note, one_word, trc_text

    fit, made = options.fit_of(fit)
    tracks = {one_word(title): track for title, track in fit.tracks()}
    changed = _add_markers(tracks, source.clip, fit.subject) if options.markers else []
    up = options.up or fit.up
    turn = turn_between(fit.up, up)
    values = [track @ turn.T for track in tracks.values()]
    notes = [f"TRC: {axes_note(fit.up, up)}"] if up != fit.up else []
    notes += [f"TRC: {note}" for note in made]
    if changed:
        notes.append(f"TRC: markers whose name a joint has get a number: {listed(changed)}")
    name, numbers = f"{stem(Path(fit.clip))}{SUFFIX}", fit.frame_numbers
    return Rendered(
        {SUFFIX: trc_text(name, list(tracks), values, numbers, fit.time, fit.rate)}, tuple(notes)
    )


def _add_markers(tracks: dict[str, Array], clip: Clip, subject: str) -> list[str]:
    """Add the subject's markers to the tracks; returns the names that got a number."""
    from mocap_skel.export.trc_text import one_word

    changed = []
    for column, (label, whose) in enumerate(zip(clip.labels, clip.subjects, strict=True)):
        if whose != subject:
            continue
        title = plain = one_word(label)
        number = 2
        while title in tracks:
            title = f"{plain}_{number}"
            number += 1
        if title != plain:
            changed.append(title)
        tracks[title] = clip.points[:, column]
    return changed

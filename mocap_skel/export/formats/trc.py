"""TRC, the marker file that OpenSim reads: the skeleton's points as if they were markers.

Format: OpenSim documentation, Marker (.trc) Files; the reader is OpenSim's TRCFileAdapter.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mocap_skel.export.animated import Tracks
from mocap_skel.export.registry import Rendered, Source, option, register, vertical
from mocap_skel.text import listed

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
    import numpy as np

    from mocap_skel.clip import UPS, turn_between

    fit, made = options.fit_of(fit)
    tracks = {_one_word(title): track for title, track in fit.tracks()}
    changed = _add_markers(tracks, source.clip, fit.subject) if options.markers else []
    up = options.up or fit.up
    turn = turn_between(fit.up, up)
    values = np.hstack([track @ turn.T for track in tracks.values()])
    axes = ", ".join(UPS[int(np.concatenate([row, -row]).argmax())] for row in turn)
    notes = [f"TRC: {up} up, its x, y, z are the clip's {axes}"] if up != fit.up else []
    notes += [f"TRC: {note}" for note in made]
    if changed:
        notes.append(f"TRC: markers whose name a joint has get a number: {listed(changed)}")
    name = f"{Path(fit.clip).stem}{SUFFIX}"
    return Rendered({SUFFIX: _text(fit, name, list(tracks), values)}, tuple(notes))


def _add_markers(tracks: dict[str, Array], clip: Clip, subject: str) -> list[str]:
    """Add the subject's markers to the tracks; returns the names that got a number."""
    changed = []
    for column, (label, whose) in enumerate(zip(clip.labels, clip.subjects, strict=True)):
        if whose != subject:
            continue
        title = stem = _one_word(label)
        number = 2
        while title in tracks:
            title = f"{stem}_{number}"
            number += 1
        if title != stem:
            changed.append(title)
        tracks[title] = clip.points[:, column]
    return changed


def _one_word(name: str) -> str:
    """A name as a column's: tabs and blanks part the columns for some readers."""
    return re.sub(r"\s+", "_", name.strip())


def _text(fit: SkeletonFit, name: str, titles: list[str], values: Array) -> str:
    import numpy as np

    frames, count = len(values), len(titles)
    first, rate = int(fit.frame_numbers[0]), f"{fit.rate:.10g}"
    head = {
        "DataRate": rate, "CameraRate": rate, "NumFrames": frames, "NumMarkers": count,
        "Units": "m", "OrigDataRate": rate, "OrigDataStartFrame": first, "OrigNumFrames": frames,
    }  # fmt: skip
    axes = (f"{axis}{at}" for at in range(1, count + 1) for axis in "XYZ")
    lines = [
        ["PathFileType", "4", "(X/Y/Z)", _one_word(name)],
        head,
        map(str, head.values()),
        ["Frame#", "Time", *(cell for title in titles for cell in (title, "", ""))],
        ["", "", *axes],
        [],
    ]
    # As in skeleton.csv: one format for the whole table, and no "-0.000000".
    row = "%d\t%.6f" + "\t%.6f" * values.shape[1] + "\n"
    cells = np.column_stack([fit.frame_numbers, fit.time, np.round(values, 6) + 0.0])
    body: str = (row * frames) % tuple(cells.ravel().tolist())
    # OpenSim does not count the last cell of a row that is empty.
    body = body.replace("nan", "").replace("\t\n", "\t\t\n")
    return "".join("\t".join(line) + "\n" for line in lines) + body

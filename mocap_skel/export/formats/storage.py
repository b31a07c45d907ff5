"""STO and MOT: the joint angles of --format angles as OpenSim's storage and motion files.

They are for OpenSim's plots and tools of tables. The coordinates that move a model of --format osim are others:
they come from its T-pose, not from landmarks, and stand in the walk.mot that comes with it.

No cell is nan: of OpenSim 4.6, TimeSeriesTable reads that, but Storage, which loads motions and plots, takes the first
nan for 0, stops there, and says nothing.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from mocap_skel.errors import ExportError
from mocap_skel.export.angled import LACKS, AngleOptions
from mocap_skel.export.registry import Rendered, Source, register

if TYPE_CHECKING:
    from mocap_skel.skeleton_fit import SkeletonFit

STORAGE, MOTION = ".angles.sto", ".angles.mot"
_LACKS = f"has only frames in which every angle is known, no frame numbers and no places, {LACKS}"
# Of the frames, in which an angle has to be known; by eye: what one angle lacks costs all the others these frames.
LEAST = 0.5
# A reader of the file sees that it moves no model.
_SAID = ("Joint angles by ISB, not the coordinates of a model.",)


@register(
    "sto",
    suffixes=(STORAGE,),
    options=AngleOptions,
    makes=f"walk{STORAGE}, the joint angles for OpenSim's plots",
    lacks=f"a storage file of angles {_LACKS}",
)
def write_storage(fit: SkeletonFit, options: AngleOptions, source: Source) -> Rendered:
    """The angles of a fit as a storage file.

    Raises:
        ExportError: the figure has no joint whose angles are defined, or no frame in which all of them are known.
    """
    return _written(STORAGE, fit, options, source)


@register(
    "mot",
    suffixes=(MOTION,),
    options=AngleOptions,
    makes=f"walk{MOTION}, the same as a motion file (the walk.mot of osim has a model's coordinates)",
    lacks=f"a motion file of angles {_LACKS}; it moves no model, for which the walk.mot of osim is",
)
def write_motion(fit: SkeletonFit, options: AngleOptions, source: Source) -> Rendered:
    """The angles of a fit as a motion file.

    Raises:
        ExportError: the figure has no joint whose angles are defined, or no frame in which all of them are known.
    """
    return _written(MOTION, fit, options, source)


def _written(suffix: str, fit: SkeletonFit, options: AngleOptions, source: Source) -> Rendered:
    import numpy as np

    from mocap_skel.export.coordinates import plain_names
    from mocap_skel.export.storage_text import storage_text
    from mocap_skel.results.angle_tables import angle_columns
    from mocap_skel.text import listed, stem

    angles, notes = options.angles_of(fit, source)
    titles, values = angle_columns(angles)
    known = np.isfinite(values)
    columns = known.mean(axis=0) >= LEAST
    rows = np.asarray(known[:, columns].all(axis=1))
    kind = suffix.rpartition(".")[2].upper()
    if not columns.any() or not rows.any():
        raise ExportError(
            f"{fit.clip}: no frame in which all angles are known, and a {kind} has no gaps",
            "--rigid bridges gaps; --format angles has empty cells",
        )
    said = []
    if not columns.all():
        lost = [title for title, kept in zip(titles, columns, strict=True) if not kept]
        said.append(
            f"{kind}: angles known in less than half of the frames, left out: {listed(lost)}"
        )
    if not rows.all():
        frames = f"{int((~rows).sum())} of {len(rows)} frames"
        said.append(
            f"{kind}: {frames}, in which an angle is not known, left out; --rigid bridges gaps"
        )
    (name,) = plain_names([f"{stem(Path(fit.clip))} {fit.subject}".strip()])
    text = storage_text(
        name,
        [title for title, kept in zip(titles, columns, strict=True) if kept],
        values[rows][:, columns],
        angles.time[rows],
        said=_SAID,
        digits=4,
    )
    return Rendered({suffix: text}, (*notes, *said))

"""Every point of a C3D, model outputs included: what `read_clip` leaves out on purpose is the reference."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mocap_skel.clip import Clip
from mocap_skel.errors import ClipError
from mocap_skel.readers.markers import names_and_subjects
from mocap_skel.readers.raw import FARTHEST
from mocap_skel.readers.registry import read_raw
from mocap_skel.readers.units import metres_in

Array = NDArray[np.float64]


def all_points(path: Path, clip: Clip) -> dict[tuple[str, str], Array]:
    """(subject, label) → track (frames, 3) in metres, NaN = missing, of the points that are ever seen.

    Args:
        path: the file.
        clip: the same as `read_clip` has it; its unit is taken.

    Raises:
        ClipError: no reader reads it, or in other frames than `read_clip`.
    """
    # The door of `read_clip` itself, before it sorts points: ezc3d alone takes some files for others.
    raw = read_raw(path)
    names, subjects = names_and_subjects(raw)
    scale = metres_in(clip.unit)
    assert scale is not None, "read_clip has found a unit"
    if len(raw.points) < clip.frames:
        raise ClipError(f"{path}: {len(raw.points)} frames where read_clip finds {clip.frames}")
    found: dict[tuple[str, str], Array] = {}
    for column, (subject, name) in enumerate(zip(subjects, names, strict=True)):
        track = raw.points[: clip.frames, column].astype(np.float64)
        with np.errstate(invalid="ignore"):
            nothing = (np.abs(track) > FARTHEST).any(axis=1) | (track == 0).all(axis=1)
        track[nothing] = np.nan
        if name and (subject, name) not in found and np.isfinite(track).any():
            found[subject, name] = track * scale
    return found

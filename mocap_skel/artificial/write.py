"""Recordings to disk: the clip as C3D, its truth as CSV."""

from __future__ import annotations

import os
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from mocap_skel.artificial.recording import Recording

UNITS = {"mm": 1000.0, "cm": 100.0, "dm": 10.0, "m": 1.0}
"""Units that `write_c3d` knows, and how many of them a metre has."""

_WORD = 0xFFFF


def write_c3d(recording: Recording, path: str | os.PathLike[str], unit: str = "mm") -> None:
    """Write the clip as floating-point C3D: Z up, missing = residual -1; an old file is replaced.

    Labels past 255 go into POINT:LABELS2 and so on. A C3D header counts frames in 16 bits: a clip
    that ends past frame 65535 is written whole, with its true limits in TRIAL:ACTUAL_START_FIELD
    and ACTUAL_END_FIELD as Vicon does, but readers that trust POINT:FRAMES (ezc3d 1.7) see its
    first 65535 frames only.

    Raises:
        ValueError: a unit that is not in `UNITS`, a first frame that the header cannot hold.
        OSError: a file that cannot be written.

    Example:
        >>> from pathlib import Path
        >>> from tempfile import TemporaryDirectory
        >>> from mocap_skel import read_clip
        >>> from mocap_skel.artificial import human, marker_set, record, walk, write_c3d
        >>> recording = record(human(), marker_set("cmu"), walk(1, 60))
        >>> with TemporaryDirectory() as folder:
        ...     write_c3d(recording, Path(folder) / "walk.c3d")
        ...     clip = read_clip(Path(folder) / "walk.c3d")
        >>> print(clip.unit, clip.up, abs(clip.points - recording.points).max() < 1e-6)
        mm z True
    """
    if unit not in UNITS:
        raise ValueError(f"no unit {unit!r}; there are {', '.join(UNITS)}")
    if not 1 <= recording.first_frame <= _WORD:
        raise ValueError(f"first frame must be 1 to {_WORD}, got {recording.first_frame}")
    frames, markers, _ = recording.points.shape
    missing = np.isnan(recording.points).any(axis=2).T
    points = np.ones((4, markers, frames))
    points[:3] = recording.points.transpose(2, 1, 0) * UNITS[unit]
    points[:3, missing] = np.nan

    # By name and here: ezc3d has no types, and only this function needs it.
    ezc3d: Any = import_module("ezc3d")
    c3d = ezc3d.c3d()
    # ezc3d counts from 0 and adds the 1 when it writes.
    c3d["header"]["points"]["first_frame"] = recording.first_frame - 1
    c3d["data"]["points"] = points
    # Left alone, ezc3d writes a NaN with residual 0, which other readers take for a position.
    c3d["data"]["meta_points"]["residuals"] = np.where(missing, -1.0, 0.0)[None]
    c3d["data"]["meta_points"]["camera_masks"] = np.zeros((7, markers, frames), dtype=np.bool_)
    point = c3d["parameters"]["POINT"]
    point["RATE"]["value"] = [recording.rate]
    point["LABELS"]["value"] = list(recording.labels)
    point["UNITS"]["value"] = [unit]
    c3d.add_parameter("POINT", "X_SCREEN", ["+X"])
    c3d.add_parameter("POINT", "Y_SCREEN", ["+Z"])
    if recording.subjects:
        count = len(recording.subjects)
        c3d.add_parameter("SUBJECTS", "USED", [count])
        c3d.add_parameter("SUBJECTS", "NAMES", list(recording.subjects))
        c3d.add_parameter("SUBJECTS", "LABEL_PREFIXES", [f"{s}:" for s in recording.subjects])
        c3d.add_parameter("SUBJECTS", "USES_PREFIXES", [1] * count)
        _as_words(c3d, "SUBJECTS", "USED", "USES_PREFIXES")
    last = recording.first_frame + frames - 1
    if last > _WORD:
        for name, frame in (("START", recording.first_frame), ("END", last)):
            words = np.array([frame & _WORD, frame >> 16], dtype=np.uint16).view(np.int16)
            c3d.add_parameter("TRIAL", f"ACTUAL_{name}_FIELD", words.tolist())
        _as_words(c3d, "TRIAL", "ACTUAL_START_FIELD", "ACTUAL_END_FIELD")

    target = Path(path)
    # ezc3d adds .c3d to a name without it, and is silent about a file that it cannot open.
    part = target.with_name(f".{target.name}.part.c3d")
    try:
        c3d.write(str(part))
        if not part.exists():
            raise OSError(f"{target} cannot be written")
        part.replace(target)
    finally:
        part.unlink(missing_ok=True)


def write_truth(
    recording: Recording, path: str | os.PathLike[str], subject: str | None = None
) -> None:
    """Write the joints' true paths as CSV: `frame,time,<Joint>_x,<Joint>_y,<Joint>_z,…`.

    One row a frame, the joints in the figure's order, metres with 5 decimals in the clip's own
    axes, time = (frame - 1) / rate in seconds.

    Args:
        recording: of one subject or several.
        path: of the CSV file; an old one is replaced.
        subject: whose joints; may be left out where there is only one.

    Raises:
        ValueError: a subject that is not in the recording, or none where there are several.
        OSError: a file that cannot be written.

    Example:
        >>> from pathlib import Path
        >>> from tempfile import TemporaryDirectory
        >>> from mocap_skel.artificial import human, marker_set, record, walk, write_truth
        >>> recording = record(human(), marker_set("cmu"), walk(1, 60))
        >>> with TemporaryDirectory() as folder:
        ...     write_truth(recording, Path(folder) / "truth.csv")
        ...     print((Path(folder) / "truth.csv").read_text().splitlines()[0][:31])
        frame,time,Waist_x,Waist_y,Wais
    """
    prefix = ""
    if recording.subjects:
        if subject is None and len(recording.subjects) == 1:
            subject = recording.subjects[0]
        prefix = f"{subject}:"
    if (subject is not None or recording.subjects) and subject not in recording.subjects:
        raise ValueError(f"no subject {subject!r}; there are {list(recording.subjects)}")
    tracks = {
        joint.removeprefix(prefix): track
        for joint, track in recording.truth.items()
        if joint.startswith(prefix)
    }
    frames = recording.first_frame + np.arange(len(recording.points))
    columns = ["frame", "time", *(f"{joint}_{axis}" for joint in tracks for axis in "xyz")]
    table = np.column_stack([frames, (frames - 1) / recording.rate, *tracks.values()])
    np.savetxt(
        path,
        table,
        fmt=["%d", "%.6f", *["%.5f"] * (len(columns) - 2)],
        delimiter=",",
        header=",".join(columns),
        comments="",
        encoding="utf-8",
    )


def _as_words(c3d: Any, group: str, *names: str) -> None:
    # Vendors store these as 16-bit integers; ezc3d would make any number a float.
    for name in names:
        c3d["parameters"][group][name]["type"] = 2

"""Clips out of files: one reader a format behind one door, `read_clip`.

Here belongs all that knows how a file is written; what comes after sees a `Clip` only. It may import the
ground (`clip`, `errors`, `text`) only.
"""

from __future__ import annotations

from pathlib import Path

from mocap_skel.clip import Clip, negated
from mocap_skel.errors import ClipError, ours
from mocap_skel.readers.clean import clean
from mocap_skel.readers.registry import read_raw

__all__ = ["read_clip"]


def read_clip(
    path: str | Path,
    *,
    unit: str | None = None,
    rate: float | None = None,
    salvage: bool = False,
    mirror: str | None = None,
    up: str | None = None,
) -> Clip:
    """Read a motion capture file: markers in metres, and what was decided about them.

    The file's content decides which reader reads it, and its suffix where the content does not tell.
    C3D is the format that is read.

    Args:
        path: the file.
        unit: the file's length unit (mm, cm, dm, m, in, ft), in place of what it says.
        rate: frames a second, 0.01 to 100,000, in place of what the file says.
        salvage: read the whole frames that a file holds which is cut off or damaged.
        mirror: "x", "y" or "z": negate that axis, for a file whose bodies are mirrored.
        up: what points up (x, y, z, -x, -y, -z), in place of what the file says.

    Returns:
        The clip: points (frames, markers, 3) in metres in the file's own axes, NaN where a marker is
        missing; a sentence in its `notes` for each decision that is not plain.

    Raises:
        ClipError: the file cannot be read, is cut off or damaged, or holds no marker; it names the file.
        CallError: `unit` is no length unit, `rate` out of its range, or `up` no axis; the file has no frame rate
            that may be, or is of a kind that is not read yet, or a folder.

    >>> clip = read_clip("sample_data/nearly_still.c3d")
    >>> clip.points.shape, clip.rate, clip.unit
    ((300, 41, 3), 60.0, 'mm')
    >>> clip.labels[:3]
    ('LFHD', 'RFHD', 'LBHD')
    """
    path = Path(path)
    with ours(path, ClipError):
        clip = clean(read_raw(path, salvage), str(path), unit, rate, salvage, up)
    return negated(clip, mirror) if mirror else clip

"""A recording as everything after the readers sees it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from mocap_skel.events import Event

# What a vertical axis may be called.
AXES = ("x", "y", "z")
# What points up in a recording: along an axis, or against it.
UPS = (*AXES, "-x", "-y", "-z")


@dataclass(frozen=True, eq=False)
class Clip:
    """Marker trajectories of one recording.

    Attributes:
        name: the file's name, for messages.
        points: (frames, markers, 3), float64 metres in the file's own axes, NaN = missing.
        labels: one a marker, trimmed, without the subject; unique within a subject.
        subjects: one a marker, the part of the label before the colon, "" without one.
        rate: frames a second.
        first_frame: the file's own number of the first frame.
        zero_frame: the number that a frame at time 0 has: 1 in a C3D, 0 in a take of Motive; where a file's own
            times say it, it need not be a whole one.
        unit: the length unit of the file.
        up: the vertical axis, "x", "y" or "z", or "-x" ... where that axis points down.
        left_out: labels of the points that are no markers, by the reason why.
        notes: what the reader decided about the file, one sentence each.
        up_by: who says what is up: the "file", the "call", the "body", or "" where it is assumed.
        mirror: the axis that was negated when the file was read, since the file's body is mirrored; "" for none.
        doubles: columns whose label is one and the same in the file, the first of them and its copies.
        events: moments that the file gives a name, in their order in time; those of the file within the clip.
        as_read: labels and subjects as the reader gave them, where subjects were found in labels later.
        measures: of the one person in it, as the file has them: full name (`measures.MEASURES`) → metres.

    Example:
        >>> from mocap_skel import Clip, read_clip
        >>> clip = read_clip("sample_data/two_dancers.c3d")
        >>> isinstance(clip, Clip), clip.points.shape, clip.rate, clip.up
        (True, (700, 82, 3), 50.0, 'z')
        >>> clip.subject_names, clip.labels[:2], clip.subjects[:2]
        (('Anna', 'Ben'), ('LFHD', 'RFHD'), ('Anna', 'Anna'))
    """

    name: str
    points: NDArray[np.float64]
    labels: tuple[str, ...]
    subjects: tuple[str, ...]
    rate: float
    first_frame: int
    unit: str
    up: str
    left_out: dict[str, tuple[str, ...]]
    notes: tuple[str, ...]
    mirror: str = ""
    up_by: str = "file"
    doubles: tuple[tuple[int, ...], ...] = ()
    as_read: tuple[tuple[str, ...], tuple[str, ...]] | None = None
    measures: Mapping[str, float] = field(default_factory=dict)
    events: tuple[Event, ...] = ()
    zero_frame: float = 1

    @property
    def frames(self) -> int:
        """How many frames there are."""
        return len(self.points)

    @property
    def frame_numbers(self) -> NDArray[np.int64]:
        """(frames,), the file's own frame numbers."""
        return np.arange(self.first_frame, self.first_frame + self.frames, dtype=np.int64)

    @property
    def subject_names(self) -> tuple[str, ...]:
        """The subjects, in the order of their first markers."""
        return tuple(dict.fromkeys(self.subjects))

    def missing(self) -> NDArray[np.float64]:
        """(markers,), the share of frames in which each marker is missing, 0 to 1."""
        return np.asarray(np.isnan(self.points[..., 0]).mean(axis=0))


def negated(clip: Clip, axis: str) -> Clip:
    """The clip with one axis negated, which turns a mirrored body into one as it was.

    >>> from mocap_skel import read_clip
    >>> clip = read_clip("sample_data/nearly_still.c3d")
    >>> bool((negated(clip, "x").points[0, 0] == clip.points[0, 0] * [-1, 1, 1]).all())
    True
    """
    signs = [-1.0 if name == axis else 1.0 for name in AXES]
    note = f"{axis} is negated, as --mirror says"
    return replace(clip, points=clip.points * signs, notes=(*clip.notes, note), mirror=axis)


def turn_between(before: str, after: str) -> NDArray[np.float64]:
    """The rotation (3, 3) from axes with `before` up (one of `UPS`) to axes with `after` up (one of `AXES`, or `before`).

    The axes are renamed in a circle. Where `before` points down, they are turned by half a turn first, about
    the axis that follows it.

    >>> turn_between("z", "y") @ [1.0, 2.0, 3.0]
    array([2., 3., 1.])
    """
    if before == after:
        return np.eye(3)
    at = AXES.index(before[-1])
    first = np.eye(3)
    if before not in AXES:
        first = np.diag(np.where(np.arange(3) == (at + 1) % 3, 1.0, -1.0))
    return np.asarray(np.roll(first, AXES.index(after) - at, axis=0))


def vertical(up: str) -> NDArray[np.float64]:
    """(3,), the unit vector that points up, by its name, one of `UPS`.

    >>> vertical("-y").tolist()
    [0.0, -1.0, 0.0]
    """
    if up not in UPS:
        raise ValueError(f"what points up is one of {UPS}, got {up!r}")
    way = np.zeros(3)
    way[AXES.index(up[-1])] = 1.0 if up in AXES else -1.0
    return way

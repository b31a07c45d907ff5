"""What a reader takes out of a file, before anything is decided about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

FARTHEST = 1e7
"""Coordinates beyond it are none in any unit: 10 km in mm."""

SLOWEST, FASTEST = 1.0, 1e4
"""Frames a second of a recording: slower shows no movement, and the fastest cameras for bodies take some 2,000
(10,000 with a few lines of their picture). Picked by eye; a call may say otherwise."""


@dataclass(frozen=True)
class RawEvent:
    """A moment that a file gives a name, as it stands there.

    Attributes:
        time: seconds since frame 1; since the clip's first frame in files that count so.
        label: its name.
        context: left, right or something else, in the file's word, "" where it does not say.
        subject: whose it is, "" where the file does not say.
    """

    time: float
    label: str
    context: str = ""
    subject: str = ""


@dataclass(frozen=True, eq=False)
class RawClip:
    """A file's points and what it says of them. A new format's reader fills in what its files have.

    Attributes:
        points: (frames, points, 3), float64, the file's unit and axes, NaN = missing.
        labels: one a point, as the file has them, a subject's name and a colon in front where there are
            several ("Ann:LFHD"); "" where a point has none, and fewer than points where the file has fewer.
        rate: frames a second, 0 where the file does not say.
        unit: the file's word for its length unit, "" where it does not say.
        up: the file's word for its vertical axis ("z", "+Y"), "" where it does not say.
        up_name: what the file calls that, for messages.
        usual_up: the axis that is mostly vertical in files of its format, for one that does not say.
        first_frame: the file's own number of the first frame.
        zero_frame: the number that a frame at time 0 has, by the file's own times; None where it has none, and
            times count from frame 1.
        computed: labels of points that a model computed, by the file's own lists; with or without subject.
        earlier: labels of points that an earlier fit of this program added.
        rescale: a second scale that the file gives for its coordinates, as a part of the first, by which they
            are; 1 where it does not give two.
        scale_names: what the file calls the two, for messages.
        measures: of the one person in it, by their full names (`mocap_skel.measures.MEASURES`), metres.
        notes: what was decided while reading, one sentence each.
        events: the moments that the file gives a name.
    """

    points: NDArray[np.float64]
    labels: tuple[str, ...]
    rate: float = 0.0
    unit: str = ""
    up: str = ""
    up_name: str = "the vertical axis"
    usual_up: str = "z"
    first_frame: int = 1
    zero_frame: float | None = None
    computed: frozenset[str] = frozenset()
    earlier: frozenset[str] = frozenset()
    rescale: float = 1.0
    scale_names: tuple[str, str] = ("its first scale", "its second scale")
    measures: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    events: tuple[RawEvent, ...] = ()

"""What is known of a file by its header, its parameters and its size."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mocap_skel.readers.formats.c3d import layout, section
from mocap_skel.readers.formats.c3d.contents import number
from mocap_skel.readers.formats.c3d.frames import WORD, first_frame, unsigned
from mocap_skel.readers.formats.c3d.layout import Layout
from mocap_skel.readers.formats.c3d.machine import dtype, native, numbers
from mocap_skel.readers.formats.c3d.section import Header, Section
from mocap_skel.readers.raw import FASTEST, SLOWEST


@dataclass(frozen=True)
class Survey:
    """A C3D file as its header, its parameters and its size have it.

    Attributes:
        path: the file.
        header, section: what it says.
        layout: where its points are.
        first_frame: the file's own number of the first frame.
        contradictions: what it says of its points that is not so.
        doubts: what is wrong with its parameters, one phrase each.
        base: the byte at which it starts.
    """

    path: Path
    header: Header
    section: Section
    layout: Layout
    first_frame: int
    contradictions: tuple[str, ...]
    doubts: tuple[str, ...]
    base: int = 0

    def remarks(self) -> Iterator[str]:
        """What the file says in two ways without harm to its readers, one phrase each."""
        point, header, layout = self.section.groups.get("POINT", {}), self.header, self.layout
        rate = number(point.get("RATE"))
        if rate > 0 and header.rate > 0 and abs(rate - header.rate) > 1e-3 * rate:
            which = "first" if self.rate == rate else "second"
            yield f"POINT:RATE is {rate:g} Hz, the header's {header.rate:g}; the {which} is taken"
        said = unsigned(point.get("FRAMES"))
        # Counts past 16 bits stand elsewhere, and what the file has no room for is told apart.
        short = max(said, header.frames, layout.declared, header.last) < WORD
        fits = max(said, header.frames) <= layout.room
        if short and fits and min(said, header.frames) > 0 and said != header.frames:
            yield (
                f"POINT:FRAMES is {said}, the header's {header.frames}; "
                f"{layout.declared} frames are taken"
            )
        if layout.width == 4:
            return
        if not (number(point.get("SCALE")) or self.header.scale):
            yield "no scale for integer points: taken as 1"

    @property
    def scale(self) -> float:
        """What integers are to be multiplied with."""
        said = number(self.section.groups.get("POINT", {}).get("SCALE"))
        return abs(said or self.header.scale) or 1.0

    @property
    def rescale(self) -> float:
        """The header's scale as a part of `scale`; 1 where they are the same, or nothing is scaled."""
        said = number(self.section.groups.get("POINT", {}).get("SCALE"))
        if self.layout.width == 4 or not said or not self.header.scale:
            return 1.0
        ratio = abs(self.header.scale / said)
        return ratio if abs(ratio - 1) > 1e-3 else 1.0

    @property
    def scale_names(self) -> tuple[str, str]:
        """The two scales, for messages."""
        return f"POINT:SCALE {self.scale:g}", f"the header's {abs(self.header.scale):g}"

    @property
    def rate(self) -> float:
        """Frames a second by the parameters, or by the header where only that may be; 0 without any."""
        said = number(self.section.groups.get("POINT", {}).get("RATE")), self.header.rate
        return next((r for r in said if SLOWEST <= r <= FASTEST), said[0] or said[1])

    @property
    def rotations(self) -> bool:
        """Whether the file holds rotations of segments."""
        return number(self.section.groups.get("ROTATION", {}).get("USED")) > 0

    def read(self, first: int, count: int) -> NDArray[np.float32]:
        """Values of frames, (frames, points, 4): as `read_frames`."""
        return read_frames(self.path, self.base, self.layout, first, count)

    def read_some(self, frames: NDArray[np.intp]) -> NDArray[np.float32]:
        """Values of single frames, (frames, points, 4)."""
        return np.concatenate([self.read(int(at), 1) for at in frames])

    def raw(self, first: int, count: int) -> NDArray[np.uint8]:
        """Bytes of frames, (frames, stride), analog values too; those that are not there are zeros."""
        stride = self.layout.stride
        at = self.base + self.layout.start + first * stride
        found = np.fromfile(self.path, np.uint8, count * stride, offset=at)
        if len(found) < count * stride:
            found = np.concatenate([found, np.zeros(count * stride - len(found), np.uint8)])
        return found.reshape(count, stride)

    def values(self, found: NDArray[np.uint8]) -> NDArray[np.float64]:
        """Bytes as the numbers that the points are made of."""
        kind, machine = "f4" if self.layout.width == 4 else "i2", self.layout.machine
        with np.errstate(invalid="ignore"):
            return numbers(found.tobytes(), kind, machine).astype(np.float64)


def survey(path: Path) -> Survey:
    """Look at a C3D file without any library: what it says, and where its points are.

    >>> found = survey(Path("sample_data/nearly_still.c3d"))
    >>> found.section.machine, found.layout.points, found.layout.frames, found.first_frame
    ('INTEL', 41, 300, 1)

    Raises:
        ClipError: it is no C3D file, or has no parameters; the message does not name the file.
        OSError: it cannot be opened.
    """
    with path.open("rb") as file:
        head = file.read(section.HEAD)
        base = section.base(head)
        size = file.seek(0, 2) - base
    header, parameters = section.read(head[base:])
    first = first_frame(max(1, header.first), parameters.groups)
    found, contradictions = layout.find(
        size,
        header,
        parameters,
        first,
        lambda one, at, count: read_frames(path, base, one, at, count),
    )
    doubts = parameters.faults
    if base:
        doubts = (*doubts, f"{base} zeros stand before its header")
    return Survey(path, header, parameters, found, first, contradictions, doubts, base)


def read_frames(
    path: Path, base: int, layout: Layout, first: int, count: int
) -> NDArray[np.float32]:
    """Values of frames, (frames, points, 4), as they are in the file, without analog ones.

    Args:
        path: the file.
        base: where in it the header is.
        layout: where the points are.
        first: the first frame to read, counted from 0.
        count: frames; those that the file has not come back as zeros.
    """
    values = 4 * layout.points + layout.analogs
    form = dtype("f4" if layout.width == 4 else "i2", layout.machine)
    at = base + layout.start + first * layout.stride
    flat = np.fromfile(path, form, count * values, offset=at)
    if len(flat) < count * values:
        flat = np.concatenate([flat, np.zeros(count * values - len(flat), form)])
    data = native(flat, layout.machine).reshape(count, values)[:, : 4 * layout.points]
    return data.reshape(count, layout.points, 4)

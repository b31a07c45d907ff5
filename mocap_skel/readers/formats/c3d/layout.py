"""Where a file's points lie: by what its header and parameters say and, where they contradict each
other or the size of the file, by which of them makes tracks out of the bytes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from mocap_skel.readers.formats.c3d.contents import Groups, number
from mocap_skel.readers.formats.c3d.frames import WORD, frame_count, unsigned
from mocap_skel.readers.formats.c3d.section import BLOCK, Header, Section
from mocap_skel.readers.raw import FARTHEST

_PLACES = 48
_GUESSES = 8
# Numbers of frames that nobody may have meant: 1, and as many as 16 bits hold, counted from 1 or from 0.
_EMPTY = {1, WORD, WORD + 1}
# Steps that can be those of tracks, as `relative_step` counts.
_SMOOTH = 0.4

Read = Callable[["Layout", int, int], NDArray[np.float32]]
"""Values of frames, (frames, points, 4): a layout, the first frame from 0, how many."""


@dataclass(frozen=True)
class Layout:
    """Where the points are.

    Attributes:
        machine: whose numbers: INTEL, DEC, MIPS.
        start: byte of the first frame.
        points, analogs: values of a frame: four for each point, then the analog ones.
        width: bytes of a value: 4 floats, 2 integers.
        declared: frames that the file says it has.
        sure: frames that every counter of the file has; blank ones after them are padding.
        room: frames whose points the file has the bytes for.
        tail: bytes of the file after the declared frames.
    """

    machine: str
    start: int
    points: int
    analogs: int
    width: int
    declared: int = 0
    sure: int = 0
    room: int = 0
    tail: int = 0

    @property
    def stride(self) -> int:
        """Bytes of a frame."""
        return (4 * self.points + self.analogs) * self.width

    @property
    def frames(self) -> int:
        """Frames that can be read."""
        return min(self.declared, self.room)

    def fitted(self, size: int) -> Layout:
        """The same with its room in a file of so many bytes: analogs of the last frame may lack."""
        bytes_ = size - self.start
        points = 4 * self.points * self.width
        whole = 0 if bytes_ < points or not self.stride else 1 + (bytes_ - points) // self.stride
        return replace(self, room=whole)

    def fills(self, size: int, frames: int) -> bool:
        """Whether so many frames end where the file ends, its last block's padding apart."""
        left = size - self.start - frames * self.stride
        return frames > 0 and -self.analogs * self.width <= left < BLOCK


def find(
    size: int, header: Header, section: Section, first: int, read: Read
) -> tuple[Layout, tuple[str, ...]]:
    """Where the points lie.

    Args:
        size: bytes of the file from its header on.
        header, section: what it says.
        first: number of the first frame.
        read: gives frames.

    Returns:
        The layout, and the contradictions between what is said and what is there.
    """
    said = list(dict.fromkeys(_said(size, header, section)))
    claims = _claims(header, section.groups)
    best, step = said[0], None
    if len(said) > 1:
        best, step = _smoothest(size, said, claims, read)
    if not any(best.fills(size, n) for n in claims):
        others = list(dict.fromkeys(_by_size(size, said, claims)))
        if others:
            step = relative_steps(read, best) if step is None else step
            other, smooth = _smoothest(size, others, claims, read)
            # What nobody says needs proof; most files like this one are cut off or have a tail.
            if smooth < min(_SMOOTH, step / 3):
                best = other
    declared = frame_count(claims, first, section.groups, best.room, lambda n: best.fills(size, n))
    if _says_nothing(declared, best, size, claims, read):
        declared = best.room
    best = replace(
        best,
        declared=declared,
        sure=min([*claims, declared]),
        tail=max(0, size - best.start - declared * best.stride),
    )
    return best, tuple(_contradictions(best, claims, header, section))


def _says_nothing(declared: int, layout: Layout, size: int, claims: list[int], read: Read) -> bool:
    """Whether a number of frames is what a counter says that nobody set, and the file's end tells more.

    Such counters say 1, or all that 16 bits hold. A file that is cut off ends in the middle of a frame or of
    a block; one that is whole has nothing but the zeros of its last block behind its last frame.
    """
    if not claims or not {*claims, declared} <= _EMPTY:
        return False
    if not 1 < layout.room < WORD or layout.fills(size, 1) or size % BLOCK:
        return False
    return not read(layout, layout.room, 1).any()


def _claims(header: Header, groups: Groups) -> list[int]:
    """Frames by the parameters, which is unsigned whatever it says, and by the header."""
    counted = unsigned(groups.get("POINT", {}).get("FRAMES"))
    # Frames are counted from 1. Who writes a first frame 0 may mean that, or count from 0.
    by_header = [header.frames, header.last] if header.first == 0 else [header.frames]
    if not header.last:
        by_header = []
    return [n for n in dict.fromkeys([counted, *by_header]) if n > 0]


def analog_words(header: Header, groups: Groups) -> int | None:
    """Analog values in a frame as the parameters have it, None where they do not say."""
    analog, point = groups.get("ANALOG", {}), groups.get("POINT", {})
    if "USED" not in analog:
        return None
    samples = header.samples
    rates = number(analog.get("RATE")), number(point.get("RATE")) or header.rate
    if not samples and min(rates) > 0:
        samples = round(min(rates[0] / rates[1], WORD))
    return unsigned(analog["USED"]) * samples


def _said(size: int, header: Header, section: Section) -> Iterator[Layout]:
    """Every layout that the header's and the parameters' numbers allow, the header's first."""
    point = section.groups.get("POINT", {})
    points = [header.points, *([unsigned(point["USED"])] if "USED" in point else [])]
    points = [n for n in points if n] or [0]
    analogs = [header.analogs, analog_words(header, section.groups)]
    scales = [header.scale, number(point.get("SCALE"))]
    widths = [4 if scale < 0 else 2 for scale in scales if scale] or [4]
    blocks = [header.data_block, unsigned(point.get("DATA_START"))]
    after = -(-section.end // BLOCK)
    starts = [(n - 1) * BLOCK for n in blocks if section.start < (n - 1) * BLOCK < size]
    starts = starts or [after * BLOCK]
    # Without a group for them there are none, whatever the header says.
    known = [n or 0 for n in analogs]
    for start, count, values, width in product(
        *(list(dict.fromkeys(several)) for several in (starts, points, known, widths))
    ):
        yield Layout(section.machine, start, count, values, width).fitted(size)


def _by_size(size: int, said: list[Layout], claims: list[int]) -> Iterator[Layout]:
    """Layouts that nobody says but that fill the file: the other width, other analog values."""
    for one in said:
        if not one.points:
            continue
        other = replace(one, width=6 - one.width).fitted(size)
        if other.room:
            yield other
        for n, layout in product(claims, (one, other)):
            most = (size - layout.start) // (n * layout.width) - 4 * layout.points
            # The last block's padding leaves some numbers to choose from where frames are few.
            fewest = max(0, most - BLOCK // (n * layout.width), most - _GUESSES)
            for analogs in range(most, fewest - 1, -1):
                found = replace(layout, analogs=analogs).fitted(size)
                if found.fills(size, n):
                    yield found


def _smoothest(
    size: int, choice: list[Layout], claims: list[int], read: Read
) -> tuple[Layout, float]:
    """The layout whose points move least from frame to frame; of equals the one that fills the file.

    Returns:
        The layout and its step.
    """
    steps = {one: relative_steps(read, one) for one in choice}
    least = min(steps.values())
    # A wrong layout jumps by as much as the points are apart: there is little in between.
    limit = max(2 * least, 0.02) if least < _SMOOTH else math.inf
    close = [one for one in choice if steps[one] <= limit]
    # Of those that are the same, the first: what the header says.
    best = min(
        close,
        key=lambda one: (
            not any(one.fills(size, n) for n in claims),
            not any(n <= one.room for n in claims),
        ),
    )
    return best, steps[best]


def spread(count: int) -> NDArray[np.int64]:
    """Some dozens of the numbers below a count, over all of them."""
    # np.unique would import numpy.ma, 7 ms of a cold start.
    return np.array(sorted(set(np.linspace(0, count - 1, _PLACES).astype(int).tolist())))


def relative_steps(read: Read, layout: Layout) -> float:
    """`relative_step` at some places of a file, as a layout has it."""
    if layout.room < 2 or not layout.points:
        return math.inf
    at = spread(layout.room - 1)
    with np.errstate(invalid="ignore"):
        pairs = np.stack([read(layout, place, 2) for place in at]).astype(np.float64)
    return relative_step(pairs[:, 0], pairs[:, 1])


def relative_step(before: NDArray[np.float64], after: NDArray[np.float64]) -> float:
    """Median step from frame to frame as a part of the points' median distance from their middle.

    Some hundredths for tracks, about one for other bytes; infinite where nothing can be measured.

    Args:
        before, after: frames (n, points, 3 or 4, the last a residual) and the ones after them.
    """
    with np.errstate(invalid="ignore"):
        good = _sound(before) & _sound(after)
    if good.sum() * 5 < good.size and good.size:
        # Coordinates of nobody: most values are far off, or no numbers.
        absurd = ~(np.abs(before[..., :3]) < FARTHEST).all(axis=-1)
        if 2 * absurd.sum() > absurd.size:
            return math.inf
    if not good.any():
        return math.inf
    here, there = before[good][:, :3], after[good][:, :3]
    moved = np.sort(np.linalg.norm(there - here, axis=-1))[len(here) // 2]
    middle = np.sort(here, axis=0)[len(here) // 2]
    apart = np.sort(np.linalg.norm(here - middle, axis=-1))[len(here) // 2]
    return float(moved / apart) if apart > 0 else math.inf


def _sound(frames: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n, points): where there may be a point."""
    points = frames[..., :3]
    sound = (np.abs(points) < FARTHEST).all(axis=-1) & (points != 0).any(axis=-1)
    return np.asarray(sound & (frames[..., 3] >= 0) if frames.shape[-1] > 3 else sound)


def _contradictions(
    layout: Layout, claims: list[int], header: Header, section: Section
) -> Iterator[str]:
    """What the file says of its points that is not so."""
    point = section.groups.get("POINT", {})
    used = unsigned(point["USED"]) if "USED" in point else None
    start = unsigned(point.get("DATA_START")) or None
    analogs = analog_words(header, section.groups)
    block = layout.start // BLOCK + 1
    for where, what, said, found in (
        ("the header", "points a frame", header.points, layout.points),
        ("POINT:USED", "points a frame", used, layout.points),
        ("the header", "analog values a frame", header.analogs, layout.analogs),
        ("ANALOG:USED", "analog values a frame", analogs, layout.analogs),
        ("the header", "for the block where the points start", header.data_block, block),
        ("POINT:DATA_START", "for the block where the points start", start, block),
    ):
        if said is not None and said != found:
            yield f"{where} says {said} {what}, it is {found}"
    kinds = {4: "floats", 2: "integers"}
    for where, scale in (("the header", header.scale), ("POINT:SCALE", number(point.get("SCALE")))):
        if scale and (4 if scale < 0 else 2) != layout.width:
            yield f"{where} says that the points are {kinds[6 - layout.width]}, which they are not"
    empty = {*claims} <= _EMPTY and layout.declared < WORD and layout.declared not in claims
    for count in claims:
        if layout.declared <= layout.room and (empty or layout.room < count != WORD):
            yield f"the file says {count} frames and has {layout.declared}"

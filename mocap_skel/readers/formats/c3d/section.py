"""The header and the parameter section, read here so that they are checked before any library sees them.

A section that is damaged in one place still gives what can be read before and after it; what is wrong
with it is told in `faults`. Format: The C3D File Format User Guide, Motion Lab Systems, chapters 3 and 4.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any

from mocap_skel.errors import ClipError
from mocap_skel.readers.formats.c3d.contents import Groups, decoded, number
from mocap_skel.readers.formats.c3d.machine import MACHINES, numbers

BLOCK = 512
_KEY = 0x50
# The pointer to the parameters is one byte, and so is their number of blocks.
HEAD = 2 * 256 * BLOCK
_KINDS = {1: "i1", 2: "i2", 4: "f4"}
_TEXT = -1
_MOST_DIMENSIONS = 7


@dataclass(frozen=True)
class Header:
    """The first block: what the file says about its frames.

    Attributes:
        points: in a frame.
        analogs: analog values in a frame, all samples of all channels.
        first, last: frame numbers.
        scale: below zero where the points are floats.
        data_block: where the frames start, counted from 1.
        samples: of each analog channel in a frame.
        rate: frames a second.
    """

    points: int
    analogs: int
    first: int
    last: int
    scale: float
    data_block: int
    samples: int
    rate: float

    @property
    def frames(self) -> int:
        """How many, as far as 16 bits go."""
        return max(0, self.last - self.first + 1)


@dataclass(frozen=True)
class Section:
    """The parameters.

    Attributes:
        start, end: first byte, and the one after the last parameter.
        machine: whose numbers the file has: INTEL, DEC, MIPS.
        groups: GROUP → NAME → value (flat numbers, or a list of text).
        faults: what is not as the format has it, one phrase each.
    """

    start: int
    end: int
    machine: str
    groups: Groups
    faults: tuple[str, ...]


def base(head: bytes) -> int:
    """Where the file starts: some have zeros before the header.

    Raises:
        ClipError: this is no C3D file.
    """
    zeros = len(head) - len(head.lstrip(b"\0"))
    for at in {0, zeros}:
        if head[at + 1 : at + 2] == bytes([_KEY]) and len(head) - at >= BLOCK:
            return at
    raise ClipError("not a C3D file" if head else "an empty file")


def is_c3d(head: bytes) -> bool | None:
    """Whether a file that starts with these bytes is a C3D file; None for a text, in which they may be words."""
    try:
        at = base(head)
    except ClipError:
        return False
    return True if b"\0" in head[at : at + BLOCK] else None


def read(head: bytes) -> tuple[Header, Section]:
    """Read a file's first `HEAD` bytes, from its header on.

    Raises:
        ClipError: there are no parameters.
    """
    found: Section | None = None
    said = head[0]
    # A pointer that is wrong is wrong by little; the block after the header is the usual one.
    for block in dict.fromkeys([said, 2, *range(3, 33)]):
        start = (block - 1) * BLOCK
        if block < 2 or start + BLOCK > len(head):
            continue
        section = _section(head, start)
        if section and ("POINT" in section.groups or (block == said and not found)):
            found = section
        if found and "POINT" in found.groups:
            break
    if found is None:
        raise ClipError(f"no parameters in block {said}, where its header says they are")
    if found.start != (said - 1) * BLOCK:
        where = found.start // BLOCK + 1
        fault = f"the header says the parameters are in block {said}, they are in {where}"
        found = Section(found.start, found.end, found.machine, found.groups, (fault, *found.faults))
    return _header(head, found.machine), found


def _header(head: bytes, machine: str) -> Header:
    order = ">" if machine == "MIPS" else "<"
    points, analogs, first, last, _ = struct.unpack_from(order + "5H", head, 2)
    data_block, samples = struct.unpack_from(order + "2H", head, 16)
    scale, rate = (number(numbers(head[at : at + 4], "f4", machine)) for at in (12, 20))
    return Header(points, analogs, first, last, scale, data_block, samples, rate)


def _section(head: bytes, start: int) -> Section | None:
    """The section at a block, or None where there is none."""
    machine = MACHINES.get(head[start + 3]) or MACHINES.get(head[start + 3] + 83)
    faults: list[str] = []
    if machine is None:
        if not _is_entry(head, start + 4):
            return None
        machine = _guessed(head)
        faults.append(f"no machine has the number {head[start + 3]}: taken for {machine}")
    elif head[start + 3] not in MACHINES:
        faults.append(f"the machine has the number {head[start + 3]}: taken for {machine}")
    elif MACHINES[head[start + 3]] != "MIPS" and not _plausible(head, machine):
        # Intel and DEC differ in their floats only.
        other = "DEC" if machine == "INTEL" else "INTEL"
        if _plausible(head, other) and not _scaled(head, machine):
            faults.append(f"its numbers are not those of {machine}: taken for {other}")
            machine = other
    data = (_header(head, machine).data_block - 1) * BLOCK
    bound = min(len(head), max(start + head[start + 2] * BLOCK, data))
    if bound < start + BLOCK:
        bound = len(head)
    walk = _Walk(head[:bound], machine, faults)
    end = walk.run(start + 4)
    groups = walk.groups()
    if not groups:
        return None
    if start < data < end:
        faults.append("its parameters run into its points")
    return Section(start, end, machine, groups, tuple(dict.fromkeys(faults)))


def _guessed(head: bytes) -> str:
    """The machine that makes sense of the header's frame rate."""
    return next((name for name in MACHINES.values() if _plausible(head, name)), "INTEL")


def _plausible(head: bytes, machine: str) -> bool:
    """Whether the header's frame rate is one: a number of everyday size on one machine only."""
    return 0.1 <= _header(head, machine).rate <= 1e5


def _scaled(head: bytes, machine: str) -> bool:
    """Whether the header's scale is one on this machine: then only its frame rate is wrong."""
    return 1e-6 <= abs(_header(head, machine).scale) <= 1e4


def _is_entry(head: bytes, at: int) -> bool:
    """Whether a group or parameter with a printable name may start here, or the section end."""
    if at + 2 > len(head):
        return False
    length = _signed(head[at])
    name = head[at + 2 : at + 2 + abs(length)]
    return length == 0 or (
        head[at + 1] != 0 and len(name) == abs(length) and all(c >= 32 for c in name)
    )


def _signed(byte: int) -> int:
    return byte - 256 if byte > 127 else byte


class _Walk:
    """From entry to entry through the section."""

    def __init__(self, data: bytes, machine: str, faults: list[str]) -> None:
        self._data = data
        self._machine = machine
        self._faults = faults
        self._names: dict[int, str] = {}
        self._values: dict[int, dict[str, Any]] = {}

    def run(self, at: int) -> int:
        """Take up entry after entry; returns where the last one ends."""
        data = self._data
        while True:
            if at + 2 > len(data):
                self._faults.append("its parameters have no end")
                return at
            length = _signed(data[at])
            if length == 0:
                return at
            odd = not _is_entry(data, at)
            group = _signed(data[at + 1])
            name = decoded(data[at + 2 : at + 2 + abs(length)]).upper()
            here = at + 2 + abs(length)
            end = self._entry(group, name, here)
            step = int(number(numbers(data[here : here + 2], "u2", self._machine)))
            if odd:
                self._faults.append("some of its parameters cannot be read")
                # Bytes that are no entry hardly ever say where they end.
                if here + step != end:
                    return at
            following = self._next(name, here + step if step else None, end)
            if following is None:
                return end or here
            at = following

    def _next(self, name: str, said: int | None, end: int | None) -> int | None:
        """Where the next entry starts: as this one says, or where its content ends."""
        if said is None or said == end:
            return said
        self._faults.append(f"parameter {name} is not as long as it says")
        places = [at for at in (said, end) if at is not None and _is_entry(self._data, at)]
        if end in places and (said < end or self._data[said : said + 1] in (b"", b"\0")):
            return end
        return places[0] if places else None

    def _entry(self, group: int, name: str, at: int) -> int | None:
        """Note a group's name or a parameter's value; returns where it ends, None if it does not."""
        data = self._data
        if group < 0:
            # The first of a name or number is the file's own; a later one is more likely damage.
            self._names.setdefault(-group, name)
            value, at = None, at + 2
        else:
            read = self._value(at + 2)
            if read is None:
                self._faults.append(f"parameter {name} cannot be read")
                return None
            value, at = read
        if at >= len(data) or at + 1 + data[at] > len(data):
            self._faults.append(f"parameter {name} runs past the end")
            return None
        if group >= 0:
            self._values.setdefault(group, {})[name] = value
        return at + 1 + data[at]

    def _value(self, at: int) -> tuple[Any, int] | None:
        """A value and where it ends; None where the bytes make no sense."""
        data = self._data
        if at + 2 > len(data):
            return None
        kind, dimensions = _signed(data[at]), data[at + 1]
        shape = data[at + 2 : at + 2 + dimensions]
        if (kind != _TEXT and kind not in _KINDS) or dimensions > _MOST_DIMENSIONS:
            return None
        size = abs(kind)
        for extent in shape:
            size *= extent
        start = at + 2 + dimensions
        content = data[start : start + size]
        if len(shape) < dimensions or len(content) < size:
            return None
        if kind == _TEXT:
            width = max(1, shape[0] if shape else 1)
            rows = range(0, size, width)
            return [decoded(content[row : row + width]) for row in rows], start + size
        return numbers(content, _KINDS[kind], self._machine), start + size

    def groups(self) -> Groups:
        """The groups by their names; POINT by what is in it, where its own record is missing."""
        found: Groups = {}
        for index, values in self._values.items():
            name = self._names.get(index, "")
            if not name and "LABELS" in values and {"FRAMES", "DATA_START"} & values.keys():
                name = "POINT"
                self._faults.append("group POINT has no record of its own")
            for key, value in values.items():
                found.setdefault(name, {}).setdefault(key, value)
        for name in self._names.values():
            found.setdefault(name, {})
        return found

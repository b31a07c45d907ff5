"""The parameter section of a C3D file as bytes: what is not changed stays as it was, byte for byte.

Neither ezc3d nor py-c3d can do that: they write a file anew, with groups of their own, integers as
floats, other residuals and analog values, and many files they refuse (docs/formats.md has the table).
Format: The C3D File Format User Guide, Motion Lab Systems, chapter 4.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from mocap_skel.errors import ExportError
from mocap_skel.readers.formats.c3d.machine import encoded, numbers
from mocap_skel.readers.formats.c3d.section import BLOCK

MOST_TEXTS = 255
"""A list of texts holds so many; more go on in NAME2, NAME3 and so on."""
_MOST_BLOCKS = 255
_WIDEST = 255
# The step to the next entry is a number of 16 bits, which many take for one with a sign.
_FARTHEST = 0x7FFF
_TEXT = 0xFF
_KINDS = {1: "i1", 2: "u2", 4: "f4"}


@dataclass
class _Entry:
    """A group's or a parameter's record.

    Attributes:
        length: of the name, below zero where the entry is locked, as the byte that it is.
        group: its number, below zero for the group's own record, as the byte that it is.
        name: as it is written.
        content: what follows the step to the next entry.
    """

    length: int
    group: int
    name: bytes
    content: bytes

    @property
    def key(self) -> str:
        return self.name.decode("latin-1").upper()


class Parameters:
    """The entries of a section in which the readers found no fault."""

    def __init__(self, data: bytes, machine: str) -> None:
        """Take the section apart.

        Args:
            data: from the section's first byte on.
            machine: whose numbers it has.

        Raises:
            ExportError: it has no group POINT, or two.
        """
        self._front, self._machine = data[:4], machine
        self._entries = list(self._walk(data, 4))
        groups = [e.group for e in self._entries if e.group > 127 and e.key == "POINT"]
        if len(groups) != 1:
            raise ExportError(f"its parameters have {len(groups)} groups POINT")
        self._point = 256 - groups[0]

    def _walk(self, data: bytes, at: int) -> Iterator[_Entry]:
        while at + 2 <= len(data) and data[at]:
            length, group = data[at], data[at + 1]
            here = at + 2 + (length if length < 128 else 256 - length)
            start = here + 2
            if group > 127:
                end = start
            else:
                kind, dimensions = data[start], data[start + 1]
                end = start + 2 + dimensions
                size = 1 if kind == _TEXT else kind
                for extent in data[start + 2 : end]:
                    size *= extent
                end += size
            end += 1 + data[end]
            yield _Entry(length, group, data[at + 2 : here], data[start:end])
            if not self._word(data[here:start]):
                return
            at = end

    def _word(self, data: bytes) -> int:
        return int(numbers(data, "u2", self._machine)[0])

    def _find(self, name: str) -> _Entry | None:
        """A parameter of POINT.

        Raises:
            ExportError: it stands twice, and nobody knows which of them counts.
        """
        found = [e for e in self._entries if e.group == self._point and e.key == name]
        if len(found) > 1:
            raise ExportError(f"its parameters have POINT:{name} {len(found)} times")
        return found[0] if found else None

    def set_number(self, name: str, value: int) -> None:
        """Change the value of a single number of POINT, if it has it.

        Raises:
            ExportError: it is no number, or too small a one.
        """
        entry = self._find(name)
        if entry is None:
            return
        kind, dimensions = entry.content[:2]
        at = 2 + dimensions
        if kind not in _KINDS or (kind == 1 and value > 127):
            raise ExportError(f"its parameter POINT:{name} cannot be {value}")
        number = encoded([value], _KINDS[kind], self._machine)
        entry.content = entry.content[:at] + number + entry.content[at + kind :]

    def texts(self, name: str) -> list[bytes]:
        """A list of texts of POINT with its continuations, as they are in the file."""
        return [row for _, entry in self._parts(name) for row in self._rows(entry)]

    def set_texts(self, name: str, rows: Sequence[bytes], description: str = "") -> None:
        """Change a list of texts of POINT and its continuations, or make it.

        Lists whose texts stay the same are left alone.

        Raises:
            ExportError: a text or a list is longer than the format has it.
        """
        there = dict(self._parts(name))
        for start in range(0, len(rows), MOST_TEXTS):
            number = start // MOST_TEXTS + 1
            key = name if number == 1 else f"{name}{number}"
            some = list(rows[start : start + MOST_TEXTS])
            entry = there.get(key)
            if entry is None:
                said = description.encode()
                content = bytes([_TEXT, 2, 0, 0, len(said)]) + said
                entry = _Entry(len(key), self._point, key.encode(), content)
                self._entries.append(entry)
            if self._rows(entry) != some:
                self._write(entry, some)

    def _parts(self, name: str) -> Iterator[tuple[str, _Entry]]:
        key, number = name, 1
        while (entry := self._find(key)) is not None:
            yield key, entry
            number += 1
            key = f"{name}{number}"

    def _rows(self, entry: _Entry) -> list[bytes]:
        shape, data, _ = self._text(entry)
        width = max(1, shape[0] if shape else 1)
        return [data[at : at + width] for at in range(0, len(data), width)]

    def _text(self, entry: _Entry) -> tuple[bytes, bytes, bytes]:
        """Dimensions, texts, and the description with its length."""
        kind, dimensions = entry.content[:2]
        if kind != _TEXT:
            raise ExportError(f"its parameter POINT:{entry.key} is no list of text")
        shape, start = entry.content[2 : 2 + dimensions], 2 + dimensions
        size = 1
        for extent in shape:
            size *= extent
        return shape, entry.content[start : start + size], entry.content[start + size :]

    def _write(self, entry: _Entry, rows: list[bytes]) -> None:
        shape, _, description = self._text(entry)
        # Padding is no part of a text: a wider list gets more of it, a narrow one its own back.
        width = max([1, *shape[:1], *(len(row.rstrip(b" \0")) for row in rows)])
        size = width * len(rows)
        if width > _WIDEST or size + len(description) + 6 > _FARTHEST:
            raise ExportError(f"its parameter POINT:{entry.key} would be too long for the format")
        cut = (row if len(row) == width else row.rstrip(b" \0").ljust(width) for row in rows)
        front = bytes([_TEXT, 2, width, len(rows)])
        entry.content = front + b"".join(cut) + description

    def to_bytes(self) -> bytes:
        """The section in whole blocks.

        Raises:
            ExportError: it would have more of them than the format has numbers for.
        """
        parts = [self._front]
        for entry in self._entries:
            step = encoded([2 + len(entry.content)], "u2", self._machine)
            parts += [bytes([entry.length, entry.group]), entry.name, step, entry.content]
        data = b"".join([*parts, b"\0\0"])
        blocks = max(-(-len(data) // BLOCK), data[2])
        if blocks > _MOST_BLOCKS:
            raise ExportError("its parameters have no room for more points")
        return data[:2] + bytes([blocks]) + data[3:].ljust(blocks * BLOCK - 3, b"\0")

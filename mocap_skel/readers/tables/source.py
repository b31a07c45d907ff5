"""A text file as lines: its encoding, its line ends, what parts its cells, and how large it may be."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mocap_skel.errors import ClipError
from mocap_skel.readers.tables.beginning import BOMS
from mocap_skel.readers.units import metres_in
from mocap_skel.text import printable

LARGEST = 1 << 29
"""Bytes of text that are read: an hour and a half of 100 markers at 100 Hz has less. Picked by eye; a larger file would
not fit into the memory that a clip gets."""

MOST_IN_A_LINE = 100_000
"""Cells of a line: 30,000 markers and more."""
_SHOWN = 30
DELIMITERS = ("\t", ";", ",")
_DECIMAL_COMMA = re.compile(r"(?<![\d.])-?\d*,\d+(?:[eE][-+]?\d+)?(?![\d.,])")
_DECIMAL_POINT = re.compile(r"\d\.\d")


@dataclass(frozen=True)
class Text:
    """A text file.

    Attributes:
        data: its content in UTF-8, every line end a line feed.
        notes: what was decided about its encoding.
    """

    data: bytes
    notes: tuple[str, ...] = ()

    def head(self, lines: int) -> list[str]:
        """The first lines, without their ends."""
        found: list[str] = []
        start = 0
        while len(found) < lines and start < len(self.data):
            end = self.data.find(b"\n", start)
            end = len(self.data) if end < 0 else end
            found.append(self.data[start:end].decode("utf-8", "replace"))
            start = end + 1
        return found

    def after(self, lines: int) -> bytes:
        """What stands behind so many lines."""
        start = 0
        for _ in range(lines):
            end = self.data.find(b"\n", start)
            if end < 0:
                return b""
            start = end + 1
        return self.data[start:]


def read_text(path: Path) -> Text:
    """Read a text file in UTF-8 or UTF-16, otherwise as Windows has it in western Europe.

    Raises:
        ClipError: it is too large, or holds zero bytes as no text does; the message does not name it.
        OSError: it cannot be read.
    """
    with path.open("rb") as file:
        data = file.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise ClipError(f"a text of more than {LARGEST >> 20} MB", "cut it into several clips")
    data, notes = _in_utf8(data)
    data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if (zero := data.find(b"\0")) >= 0:
        raise ClipError(f"damaged: zero bytes in its text, from line {data.count(10, 0, zero) + 1}")
    return Text(data, notes)


def _in_utf8(data: bytes) -> tuple[bytes, tuple[str, ...]]:
    encoding = next((name for bom, name in BOMS if data.startswith(bom)), "utf-8")
    if data.isascii():
        return data, ()
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        # Windows has no character for five bytes; a name is no reason to refuse a file.
        text = data.decode("cp1252", "replace")
        note = "its text is not UTF-8: names are read as Windows writes them in western Europe"
        return text.encode(), (note,)
    return (data, ()) if encoding == "utf-8" else (text.encode(), ())


def delimiter_of(line: str) -> str:
    """What parts the cells of a line: the most frequent of tab, semicolon and comma; " " for none of them.

    >>> delimiter_of("Frame#;Time;LFHD;;"), delimiter_of("Frame# Time LFHD")
    (';', ' ')
    """
    outside = re.sub(r'"[^"]*"', "", line)
    mark = max(DELIMITERS, key=outside.count)
    return mark if mark in outside else " "


def cells(line: str, delimiter: str) -> list[str]:
    """The cells of a line, trimmed, without quotes and what a terminal would obey.

    Raises:
        ClipError: there are more than any table has.

    >>> cells('Frame,"Ann:LFHD" ,', ",")
    ['Frame', 'Ann:LFHD', '']
    """
    if (count := line.count(delimiter) + 1) > MOST_IN_A_LINE:
        raise ClipError(f"a line of {count} cells, and no table has more than {MOST_IN_A_LINE}")
    if delimiter == " ":
        return [printable(word) for word in line.split()]
    try:
        found = next(
            csv.reader([line], delimiter=delimiter, skipinitialspace=delimiter != "\t"), []
        )
    except csv.Error:
        # A cell of more than 128 kB.
        found = line.split(delimiter)
    return [printable(cell.strip().strip('"')) for cell in found]


def shown(text: str) -> str:
    r"""A text out of a file as messages have it: printable, and not long.

    >>> shown("1.2\x1b"), shown("x" * 100)
    ('1.2?', 'xxxxxxxxxxxxxxxxxxxxxxxxxxx...')
    """
    text = printable(text)
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."


def comma_is_decimal(lines: Sequence[str], delimiter: str) -> bool:
    """Whether numbers of these lines have a decimal comma.

    >>> comma_is_decimal(["1;0,01;12,5"], ";"), comma_is_decimal(["1,0.01,12.5"], ",")
    (True, False)
    """
    if delimiter == ",":
        return False
    found = [cell for line in lines for cell in cells(line, delimiter)]
    with_comma = sum(bool(_DECIMAL_COMMA.fullmatch(cell)) for cell in found)
    with_point = sum(bool(_DECIMAL_POINT.search(cell)) for cell in found)
    return with_comma > with_point


def number(text: str) -> float:
    """A number of a header, with a decimal point or comma; 0 for what is none.

    >>> number("119,88"), number("EXT"), number("1e999")
    (119.88, 0.0, 0.0)
    """
    try:
        found = float(text.strip().replace(",", "."))
    except ValueError:
        return 0.0
    return found if abs(found) < 1e300 else 0.0


def unit_in(text: str) -> str:
    """The length unit that stands in brackets in a column's name, "" for none.

    >>> unit_in("LKNE_x [mm]"), unit_in("X (left)")
    ('mm', '')
    """
    found = re.findall(r"[\[(]\s*([^\])]*?)\s*[\])]", text)
    return next((word for word in found if metres_in(word) is not None), "")

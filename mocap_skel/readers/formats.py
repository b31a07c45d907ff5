"""The registry of input formats: what each is called, how its files are known, and what reads them.

A module of this room that reads a format registers it when it is imported, and all of them are imported
when the first file is read: a new format is one new module (docs/formats.md shows one).
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from importlib import import_module
from pathlib import Path

from mocap_skel.errors import ClipError, Told, ours
from mocap_skel.readers.raw import RawClip
from mocap_skel.text import listed

HEAD = 1 << 18
"""Bytes of a file that a sniff gets, or all of a shorter file."""


@dataclass(frozen=True)
class Format:
    """One input format.

    Attributes:
        name: as messages call it: "C3D".
        suffixes: ends of file names, in small letters, with the dot.
        sniff: what the first `HEAD` bytes tell: True, it is of this format, whatever the file is called;
            False, it is not; None, they do not tell, and the suffix decides.
        read: reads a file, given its path and whether to salvage what is left of a damaged one. It raises
            ClipError, without the file's name, for a file that it refuses.
        refuses: other errors by which it refuses a file, and what to say of each.
        salvages: whether it can read what is left of a damaged file.
    """

    name: str
    suffixes: tuple[str, ...]
    sniff: Callable[[bytes], bool | None]
    read: Callable[[Path, bool], RawClip]
    refuses: Mapping[type[Exception], Told] = field(default_factory=dict, compare=False)
    salvages: bool = False


FORMATS: dict[str, Format] = {}
"""The formats by their names; `known` fills it."""


def register(entry: Format) -> None:
    """Make a format known.

    Raises:
        ValueError: there is one of that name.
    """
    if entry.name in FORMATS:
        raise ValueError(f"the format {entry.name} is registered already")
    FORMATS[entry.name] = entry


def known() -> tuple[Format, ...]:
    """All formats, in the order of their modules' names."""
    _import_all()
    return tuple(FORMATS.values())


@cache
def _import_all() -> None:
    package = __name__.rpartition(".")[0]
    for module in pkgutil.iter_modules([str(Path(__file__).parent)]):
        import_module(f"{package}.{module.name}")


def format_of(path: Path) -> Format:
    """The format of a file: by its first bytes where they are sure, otherwise by its suffix.

    Raises:
        ClipError: the file is empty, or of no format that is known; the message does not name the file.
        OSError: it cannot be read.
    """
    with path.open("rb") as file:
        head = file.read(HEAD)
        # A pipe gives its bytes once, and the reader opens the file again: this refuses it.
        file.seek(0)
    if not head:
        raise ClipError("an empty file")
    told = {entry: entry.sniff(head) for entry in known()}
    called = [entry for entry in told if path.name.lower().endswith(entry.suffixes)]
    sure = [entry for entry in (*called, *told) if told[entry]]
    found = sure or [entry for entry in called if told[entry] is None]
    if found:
        return found[0]
    names = " or ".join(entry.name for entry in called or told)
    reads = listed(suffix for entry in told for suffix in entry.suffixes)
    raise ClipError(f"not a {names} file", None if called else f"mocap-skel reads {reads}")


def read_raw(path: Path, salvage: bool = False) -> RawClip:
    """Read a file of any known format, without deciding what is in it.

    Args:
        path: the file.
        salvage: read what is left of a damaged file, where its format's reader can.

    Raises:
        ClipError: the file cannot be read; the message does not name it.
        OSError: it cannot be opened.
    """
    entry = format_of(path)
    with ours(None, ClipError, entry.refuses):
        raw = entry.read(path, salvage)
    if not salvage or entry.salvages:
        return raw
    note = f"--salvage changes nothing: {entry.name} files are read whole or not at all"
    return replace(raw, notes=(*raw.notes, note))

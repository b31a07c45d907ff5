"""The register of input formats: what each is called, how its files are known, and what reads them.

A format is one module in `formats/`: it registers itself when it is imported, and all of them are imported when
the first file is read. docs/formats.md shows one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

from mocap_skel.errors import CallError, ClipError, Told, ours
from mocap_skel.readers.raw import RawClip
from mocap_skel.text import check_file

HEAD = 1 << 18
"""Bytes of a file that a sniff gets; all of a shorter file."""

# What people give for a clip, by the ends of the names, what it is, and what to do instead. A format that
# registers one of the suffixes goes before.
_OTHERS = (
    ((".xlsx", ".xls", ".ods"), "a spreadsheet", "save its table as CSV"),
    ((".bvh", ".fbx", ".glb", ".gltf", ".amc", ".asf", ".mot", ".osim"),
     "it holds a skeleton, no markers", "give the C3D file of the markers it was made from"),
    ((".zip", ".7z", ".rar", ".xz", ".bz2"), "a packed file", "unpack it first, or pack it with gzip"),
)  # fmt: skip

Sniff = Callable[[bytes], bool | None]
"""What a file's first `HEAD` bytes tell of it: True, it is of the format, whatever it is called; False, it is not;
None, they do not tell, and the suffix decides."""
Reader = Callable[[Path, bool], RawClip]
"""Reads a file, given its path and whether to salvage what is left of a damaged one. It raises ClipError, without
the file's name, for a file that it refuses."""


@dataclass(frozen=True)
class Format:
    """An input format.

    Attributes:
        name: as messages call it: "C3D".
        suffixes: ends of its files' names, in small letters, with the dot.
        sniff: whether a file is of the format, by its first bytes.
        read: its reader.
        refuses: errors beside ClipError by which the reader refuses a file, and what to say of each.
        salvages: whether the reader can read what is left of a damaged file.
    """

    name: str
    suffixes: tuple[str, ...]
    sniff: Sniff
    read: Reader
    refuses: Mapping[type[Exception], Told] = field(default_factory=dict, compare=False)
    salvages: bool = False


_registered: dict[str, Format] = {}


def register(
    name: str,
    *,
    suffixes: tuple[str, ...],
    sniff: Sniff,
    refuses: Mapping[type[Exception], Told] | None = None,
    salvages: bool = False,
) -> Callable[[Reader], Reader]:
    """Register the decorated function as the reader of a format; the arguments are those of `Format`.

    Raises:
        ValueError: there is a format of that name.
    """

    def decorate(read: Reader) -> Reader:
        if name in _registered:
            raise ValueError(f"there are two formats {name!r}")
        _registered[name] = Format(name, suffixes, sniff, read, refuses or {}, salvages)
        return read

    return decorate


@cache
def _load() -> None:
    """Import every module of the folder, once."""
    for module in iter_modules([str(Path(__file__).with_name("formats"))]):
        import_module(f"mocap_skel.readers.formats.{module.name}")


def formats() -> tuple[Format, ...]:
    """All input formats, in the order of their modules' names."""
    _load()
    return tuple(_registered.values())


def format_of(path: Path) -> Format:
    """The format of a file: by its first bytes where they are sure, otherwise by its suffix.

    Raises:
        ClipError: the file is empty, or of none of the formats; the message does not name the file.
        CallError: it is of a kind that no clip is read from, or a folder; the message names it.
        OSError: it cannot be read.
    """
    _refuse_no_file(path)
    with path.open("rb") as file:
        head = file.read(HEAD)
    if not head:
        raise ClipError("an empty file")
    told = {entry: entry.sniff(head) for entry in formats()}
    called = [entry for entry in told if path.name.lower().endswith(entry.suffixes)]
    sure = [entry for entry in (*called, *told) if told[entry]]
    found = sure or [entry for entry in called if told[entry] is None]
    if found:
        return found[0]
    if not called:
        _refuse_by_suffix(path)
    if called:
        raise ClipError(f"not a {_either([entry.name for entry in called])} file")
    suffixes = sorted({suffix for entry in told for suffix in entry.suffixes})
    raise ClipError("no kind of file that mocap-skel reads", f"it reads {_either(suffixes)}")


def _refuse_by_suffix(path: Path) -> None:
    """Say of a file of a known kind what to do instead.

    Raises:
        CallError: it is one.
    """
    for suffixes, what, hint in _OTHERS:
        if path.name.lower().endswith(suffixes):
            raise CallError(f"{path}: {what}", hint)


def _refuse_no_file(path: Path) -> None:
    """Say of a folder, or of standard input, what to do instead.

    Raises:
        CallError: it is one.
        ClipError: it is a pipe or a device: the reader opens the file again.
    """
    if path.is_dir():
        raise CallError(f"{path}: a folder is no clip", f"name its files: {path / '*.c3d'}")
    if str(path) == "-" and not path.exists():
        raise CallError("-: a clip is not read from standard input", "give the name of a file")
    check_file(path, ClipError)


def _either(words: list[str]) -> str:
    """One of some words: "a, b or c"."""
    return " or ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)


def read_raw(path: Path, salvage: bool = False) -> RawClip:
    """Read a file of any format, without deciding what is in it.

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
    note = f"{entry.name} files are read whole or not at all: --salvage changes nothing"
    return replace(raw, notes=(*raw.notes, note))

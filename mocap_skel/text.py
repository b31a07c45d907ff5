"""Reading text files, the names of files without their suffixes, and the wording of lists, numbers and hints."""

from __future__ import annotations

import re
import stat
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from mocap_skel.errors import MocapSkelError, ours

LARGEST = 1 << 24
"""Bytes of an association, skeleton or options file: the largest of the shipped ones has a thousandth of it. Picked by eye."""


def read_text(path: Path, error: type[MocapSkelError], largest: int = LARGEST) -> str:
    """Read a text file in UTF-8, with or without a byte-order mark.

    Args:
        path: the file.
        error: what is raised.
        largest: bytes that it may have.

    Raises:
        MocapSkelError: of the type `error`: the file cannot be read, is too large, or is not UTF-8; it names the file.
    """
    check_file(path, error)
    with ours(path, error):
        with path.open("rb") as file:
            content = file.read(largest + 1)
        if len(content) > largest:
            raise error(f"a text of more than {largest >> 20} MB, which no such file has")
        # As text files are read: a line ends with one sign.
        return content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")


def check_file(path: Path, error: type[MocapSkelError]) -> None:
    """Refuse a pipe or a device, which may never begin or never end.

    Raises:
        MocapSkelError: of the type `error`: it is one, or cannot be looked at; it names the file.
    """
    with ours(path, error):
        mode = path.stat().st_mode
        # What opens a folder says so itself.
        if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
            raise error("a pipe or a device, and no file", "save what it gives as a file")


def parse_toml(path: Path, text: str, error: type[MocapSkelError]) -> dict[str, Any]:
    """The values of a TOML file.

    Args:
        path: of the file, for messages.
        text: its content.
        error: what is raised.

    Raises:
        MocapSkelError: of the type `error`: it is no TOML, or has a number or a name that cannot be; it names the file, and
            the line and column where they are known.
    """
    import tomllib  # most calls read no such file

    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as wrong:
        found = re.fullmatch(r"(.*) \(at line (\d+), column (\d+)\)", str(wrong), re.S)
        if found:
            raise error(f"{path}:{found[2]}:{found[3]}: {found[1]}") from wrong
        what = str(wrong).removesuffix(" (at end of document)")
        column = len(text) - text.rfind("\n")
        raise error(f"{path}:{text.count(chr(10)) + 1}:{column}: {what}") from wrong
    except (RecursionError, ValueError) as wrong:
        raise error(f"{path}: {unreadable(wrong)}") from wrong
    check_values(content, path, error)
    for value in _all_in(content):
        if isinstance(value, str) and not value.translate(_BREAKS).isprintable():
            raise error(f"{path}: a text that cannot be printed: {value!r:.60}")
    return content


_BREAKS = {ord("\n"): " ", ord("\t"): " "}
# Tables and lists in each other: no file has more than six. Picked by eye.
_DEEPEST = 30


def unreadable(error: Exception) -> str:
    """What to say where a parser of Python gives up, as it does beyond some depth or length."""
    if isinstance(error, RecursionError):
        return "lists in lists without end"
    return f"it cannot be read: {' '.join(str(error).split()):.80}"


def check_values(content: Any, path: Path, error: type[MocapSkelError]) -> None:
    """Refuse what a file of values can hold and nothing can calculate with or show.

    Args:
        content: tables, lists, numbers and texts.
        path: of the file, for messages.
        error: what is raised.

    Raises:
        MocapSkelError: of the type `error`: lists in lists without end, or a number that is too large; it names the file.
    """
    level = [content]
    for _ in range(_DEEPEST):
        level = [inner for one in level for inner in _inside(one)]
    if level:
        raise error(f"{path}: {unreadable(RecursionError())}")
    for value in _all_in(content):
        if isinstance(value, int) and abs(value) >= 1 << 63:
            raise error(f"{path}: a number with too many digits: {value.bit_length()} bits")


def _inside(value: Any) -> list[Any]:
    return (
        [*value, *value.values()]
        if isinstance(value, dict)
        else value
        if isinstance(value, list)
        else []
    )


def _all_in(value: Any) -> Iterator[Any]:
    """Keys and values in tables and lists, however deep."""
    waiting = [value]
    while waiting:
        one = waiting.pop()
        waiting += _inside(one)
        yield one


def nearest(name: str, known: Iterable[str], likeness: float = 0.5) -> str | None:
    """A hint that names what a misspelt name may have meant.

    Args:
        name: as it was written.
        known: names that there are.
        likeness: how much like it a name has to be, 0 to 1 (difflib's ratio, upper and lower case alike).

    Returns:
        At most three names in a question; None where no name is near.

    Example:
        >>> from mocap_skel.text import nearest
        >>> nearest("UperLeftLeg", ["UpperLeftLeg", "LowerLeftLeg", "Hips"], likeness=0.9)
        'did you mean UpperLeftLeg?'
    """
    from difflib import get_close_matches  # only needed where something is wrong already

    names = list(known)
    folded: dict[str, str] = {}
    for candidate in names:
        folded.setdefault(candidate.lower(), candidate)
    found = [folded[m] for m in get_close_matches(name.lower(), folded, n=3, cutoff=likeness)]
    return f"did you mean {' or '.join(found)}?" if found else None


def counted(count: int, noun: str, several: str = "") -> str:
    """A number with its noun in the singular or plural.

    Args:
        count: the number.
        noun: for one.
        several: the plural, where it is not `noun` with an s.

    Example:
        >>> from mocap_skel.text import counted
        >>> counted(1, "label"), counted(2, "label"), counted(2, "pass", "passes")
        ('1 label', '2 labels', '2 passes')
    """
    return f"{count} {noun if count == 1 else several or f'{noun}s'}"


def listed(names: Iterable[str], most: int = 8) -> str:
    """Names as a text with commas, a long list cut short.

    Args:
        names: any number of them.
        most: how many are named before the rest is only counted.

    Example:
        >>> from mocap_skel.text import listed
        >>> listed(["Hips", "Chest"]), listed("abcde", most=3)
        ('Hips, Chest', 'a, b, c and 2 more')
    """
    items = list(names)
    return ", ".join(items[:most]) + (f" and {len(items) - most} more" if len(items) > most else "")


def stem(path: Path) -> str:
    """What a clip is called without the suffixes of its file.

    >>> from pathlib import Path
    >>> stem(Path("clips/walk.c3d")), stem(Path("walk.trc.gz"))
    ('walk', 'walk')
    """
    return Path(path.stem).stem if path.suffix.lower() == ".gz" else path.stem


def printable(text: str) -> str:
    r"""A name out of a file as the program has it: each character that a terminal would obey, or nobody would see, is ?.

    >>> printable("LKNE\x1b[31m"), printable("Zoé")
    ('LKNE?[31m', 'Zoé')
    """
    return text if text.isprintable() else "".join(c if c.isprintable() else "?" for c in text)


# Unicode's control and format characters, halves of surrogate pairs, ends of lines and paragraphs.
_UNSEEN = ("Cc", "Cf", "Cs", "Zl", "Zp")
_ESCAPES = {"\n": r"\n", "\r": r"\r", "\t": r"\t"}
# Where Python keeps a byte of a file's name that is no UTF-8: 128 to 255 behind this.
_BYTES = 0xDC00


def visible(text: str, kept: str = "") -> str:
    r"""Any text on its way to a terminal: what that would obey, or nobody would see, is written as an escape.

    Args:
        text: the text; bytes of a file's name that are no UTF-8 are shown as what they are.
        kept: characters that stay as they are.

    >>> print(visible("a\x1b[2J\nb\udce4\u202e"))
    a\x1b[2J\nb\xe4\u202e
    """
    if text.isprintable():
        return text
    from unicodedata import category  # hardly a text has such characters

    return "".join(_escaped(c) if c not in kept and category(c) in _UNSEEN else c for c in text)


def _escaped(c: str) -> str:
    if c in _ESCAPES:
        return _ESCAPES[c]
    code = ord(c)
    if _BYTES + 0x80 <= code <= _BYTES + 0xFF:
        code -= _BYTES
    return (
        f"\\x{code:02x}"
        if code < 0x100
        else f"\\u{code:04x}"
        if code < 0x10000
        else f"\\U{code:08x}"
    )

"""Small helpers for text files that people write and messages that people read."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from mocap_skel.errors import MocapSkelError, ours


def read_text(path: Path, error: type[MocapSkelError]) -> str:
    """Read a text file in UTF-8, with or without a byte-order mark.

    Raises:
        MocapSkelError: of the type `error`: the file cannot be read, or is not UTF-8; it names the file.
    """
    with ours(path, error):
        return path.read_text(encoding="utf-8-sig")


def nearest(name: str, known: Iterable[str], likeness: float = 0.5) -> str | None:
    """A hint with the known names at least so much like this one (0 to 1), None without any.

    >>> nearest("LKNEE", ["LKNE", "RKNE", "C7"], 0.8)
    'did you mean LKNE?'
    """
    from difflib import get_close_matches  # only needed where something is wrong already

    names = list(known)
    folded: dict[str, str] = {}
    for candidate in names:
        folded.setdefault(candidate.lower(), candidate)
    found = [folded[m] for m in get_close_matches(name.lower(), folded, n=3, cutoff=likeness)]
    return f"did you mean {' or '.join(found)}?" if found else None


def counted(count: int, noun: str, several: str = "") -> str:
    """A number with its noun; `several` where its plural is no s more.

    >>> counted(1, "label"), counted(2, "label"), counted(2, "axis", "axes")
    ('1 label', '2 labels', '2 axes')
    """
    return f"{count} {noun if count == 1 else several or f'{noun}s'}"


def listed(names: Iterable[str], most: int = 8) -> str:
    """Names as a comma-separated text, a long list cut short.

    >>> listed(["C7", "T10", "LKNE"], 2)
    'C7, T10 and 1 more'
    """
    items = list(names)
    return ", ".join(items[:most]) + (f" and {len(items) - most} more" if len(items) > most else "")

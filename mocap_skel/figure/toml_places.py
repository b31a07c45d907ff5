"""Find the line and column of a table, a key or a name in a TOML text: tomllib does not say them."""

from __future__ import annotations

import re
from pathlib import Path

# Strings are kept, comments are what is blanked: a # inside quotes is no comment.
_STRING_OR_COMMENT = re.compile(r'"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\'|#[^\n]*')


class Places:
    r"""Lines and columns in a file of `[[segment]]` tables.

    >>> places = Places(Path("leg.toml"), 'name = "leg"\n[[segment]]\nname = "Thigh"\n')
    >>> print(places.of(0, "name"))
    leg.toml:3:1
    """

    def __init__(self, path: Path, text: str, table: str = "segment") -> None:
        self.path = path
        self._text = _STRING_OR_COMMENT.sub(
            lambda m: " " * len(m[0]) if m[0].startswith("#") else m[0], text
        )
        header = re.compile(rf"^[ \t]*\[\[\s*{table}\s*\]\]", re.M)
        self._starts = [m.start() + m[0].index("[") for m in header.finditer(self._text)]

    def of(self, entry: int | None, key: str = "", name: str | None = None) -> Place:
        """The place, which prints as ``path:line:column``, both from 1.

        Args:
            entry: index of the table; None for the file's head.
            key: a key of it (a dot leads into a table: ``prior.sd``); "" for the table itself.
            name: a text within the key's value, such as one of a list. The last one is taken: of two that
                are the same, the second is wrong.
        """
        return Place(self, entry, key, name)

    def look_up(self, entry: int | None, key: str, name: str | None) -> str:
        """The text of a place; arguments as of `of`."""
        start, stop = self._block(entry)
        at = start
        for part in key.split(".") if key else ():
            found = re.compile(rf"(?<![\w\"'-])[\"']?{re.escape(part)}[\"']?\s*[=\]]\s*").search(
                self._text, at, stop
            )
            if found is None:
                break
            at = found.end() if name is not None else found.start()
        if name is not None:
            listed = self._text.startswith("[", at)
            end = self._text.find("]", at, stop) if listed else stop
            quoted = re.compile(rf"([\"']){re.escape(name)}\1")
            hits = [m.start() for m in quoted.finditer(self._text, at, max(end, at))]
            if hits:
                at = hits[-1 if listed else 0]
        line_start = self._text.rfind("\n", 0, at) + 1
        return f"{self.path}:{self._text.count(chr(10), 0, at) + 1}:{at - line_start + 1}"

    def _block(self, entry: int | None) -> tuple[int, int]:
        """Where a table starts and ends in the text."""
        if entry is None:
            return 0, self._starts[0] if self._starts else len(self._text)
        if entry >= len(self._starts):  # tables written inline
            return 0, len(self._text)
        ends = [*self._starts[1:], len(self._text)]
        return self._starts[entry], ends[entry]


class Place:
    """A place in a file. It is looked up when it is printed, and of a file without an error none ever is."""

    def __init__(self, places: Places, entry: int | None, key: str, name: str | None) -> None:
        self._places, self._of = places, (entry, key, name)

    def __str__(self) -> str:
        return self._places.look_up(*self._of)

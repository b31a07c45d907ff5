"""Write a guess as an association file, for its user to read, correct and use."""

from __future__ import annotations

import re
from collections import Counter
from itertools import groupby

from mocap_skel.figure.skeleton import STANDARD
from mocap_skel.labels.guess import Guess, Line
from mocap_skel.labels.guess.names import UNSURE

_HEAD = """\
# {clip}: association guessed by mocap-skel assoc guess, to be checked.
# {counts}
# Lines that are used tell behind # how sure they are and why. To use one that starts with #, correct it and
# take that # away. To leave a marker out, put # before its line.
# LABEL  STANDARD MARKER  [SEGMENT]
"""


def association_text(guess: Guess) -> str:
    """The guess as the text of an association file; lines that are not sure enough are comments.

    >>> from mocap_skel import read_clip
    >>> from mocap_skel.labels.guess import guess_association
    >>> text = association_text(guess_association(read_clip("sample_data/range_of_motion.c3d")))
    >>> text.splitlines()[7]
    'RFWT  RFWT    # high: a name of Table 1; moves with it (1.4 mm)'
    """
    counts = Counter("computed points" if x.computed else x.confidence for x in guess.lines)
    said = ", ".join(f"{n} {what}" for what, n in counts.items())
    parts = [_HEAD.format(clip=_plain(guess.clip), counts=f"{len(guess.lines)} labels: {said}.")]
    if guess.skeleton.name != STANDARD:
        parts[0] += f"@skeleton {guess.skeleton.name}\n"
    own = {segment.name for segment in guess.skeleton.segments}
    for segment, lines in groupby(guess.lines, key=lambda x: x.segment):
        rows = [_row(line, own) for line in lines]
        widths = [max(len(words[i]) for words, _ in rows) for i in range(3)]
        parts.append(f"# {segment}" if segment else "# Not placed")
        for words, comment in rows:
            text = "  ".join(w.ljust(n) for w, n in zip(words, widths, strict=True))
            parts.append(f"{text.rstrip()}{' ' * (len(text) - len(text.rstrip()))}  # {comment}")
        parts.append("")
    return "\n".join(parts).rstrip() + "\n"


def _row(line: Line, own: set[str]) -> tuple[tuple[str, str, str], str]:
    """The three words of a line, "" where there is none, and its comment.

    Args:
        line: the guess for a label.
        own: the segments of the file's figure.
    """
    used = line.used and line.segment in own
    label = quoted(line.label)
    # The word ignore with one other would drop labels.
    whole = not line.standard or line.label.lower() == "ignore"
    marker, segment = quoted(line.marker) if line.marker else "", line.segment if whole else ""
    if not used:
        label = f"# {label}"
    kept = line.confidence if used or line.confidence == UNSURE else "not placed"
    if line.sure and line.segment not in own:
        kept = "not of this figure"
    never = "" if line.seen else "; never seen in the clip"
    return (label, marker, segment), f"{kept}: {_plain(line.reason)}{never}"


def quoted(name: str) -> str:
    """A name as a word of an association file, in quotes if it needs them.

    >>> print(quoted("LKNE"), quoted("left knee"))
    LKNE "left knee"
    """
    return name if re.fullmatch(r'[^\s"#@][^\s"#]*', name) else f'"{name}"'


def _plain(text: str) -> str:
    """A text on one line."""
    return " ".join(text.split())

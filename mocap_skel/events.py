"""Events of a recording: moments with a name, such as a foot strike, as a file has them or as they were found."""

from __future__ import annotations

import re
from dataclasses import dataclass

# What the foot does, by the words that files use: Vicon, Visual3D, Qualisys, Motion Analysis, BTS.
_STRIKE = re.compile(
    r"\b(foot|heel|toe)\W*(strike|contact|on|down)\b|\binitial\W*contact\b|\b(touch|foot)\W*down\b", re.I
)  # fmt: skip
_OFF = re.compile(
    r"\b(foot|toe|heel)\W*(off|up)\b|\b(terminal|final|last)\W*contact\b|\blift\W*off\b", re.I
)
# Short forms with the side in front: LHS, RTO, L_FC, LON, ROFF, eRHS.
_SHORT = re.compile(r"^e?([LR])[\W_]*(HS|FS|IC|FC|ON|FD|TO|FO|OFF|TC|HO)\d*$", re.I)
# The same without a side, which the context then tells.
_BARE = re.compile(r"^(HS|FS|IC|FC|FD|TO|FO|TC)\d*$", re.I)
_SHORT_OFF = ("TO", "FO", "OFF", "TC", "HO")
_SIDE = re.compile(r"^\W*(left|right|l|r)(?![a-z])|(?<![a-z])(left|right)(?![a-z])", re.I)

STRIKE, OFF = "strike", "off"
"""What a foot does."""


@dataclass(frozen=True)
class Event:
    """A moment in a recording.

    Attributes:
        time: seconds, as the clip's file counts them and all tables have them.
        frame: the nearest frame, by the file's own numbers.
        label: what it is called: "Foot Strike".
        context: whose it is, by the file's word: "Left", "Right", "General", "" where it does not say.
        subject: the subject's name, "" where the file does not say.
        source: "file", or "found" where this program found it.
        method: how it was found; "" for an event of the file.

    Example:
        >>> event = Event(5.05, 607, "Foot Strike", "Left")
        >>> event.side, event.foot, event.source
        ('left', 'strike', 'file')
        >>> Event(5.05, 607, "RTO").side, Event(5.05, 607, "RTO").foot
        ('right', 'off')
    """

    time: float
    frame: int
    label: str
    context: str = ""
    subject: str = ""
    source: str = "file"
    method: str = ""

    @property
    def side(self) -> str:
        """Whose foot or hand it is: "left", "right", or "" where neither context nor label tells."""
        for words in (self.context, self.label):
            short, found = _SHORT.match(words.strip()), _SIDE.search(words.replace("_", " "))
            letter = short[1] if short else (found[1] or found[2])[0] if found else ""
            if letter:
                return "left" if letter in "lL" else "right"
        return ""

    @property
    def foot(self) -> str:
        """What the foot does: "strike", "off", or "" for any other event."""
        words = self.label.strip().replace("_", " ")
        short = _SHORT.match(words) or _BARE.match(words)
        if short:
            return OFF if short[short.lastindex or 0].upper() in _SHORT_OFF else STRIKE
        if _OFF.search(words):
            return OFF
        return STRIKE if _STRIKE.search(words) else ""

"""Trajectories that nobody has named yet, by the names that programs give them."""

from __future__ import annotations

import re

_GAP = r"[ _.:*#-]*"
# The program, and how it spells a trajectory without a name.
_SPELLINGS = (
    ("Vicon: *12", r"\*_?\d+"),
    ("Cortex, EVaRT: U_12, uname*12", r"(U_|uname[*_ ]*)\d+"),
    ("Qualisys Track Manager: New 0012", r"New[ _]*\d+"),
    ("scripts: _0012, traj 12", r"(_|traj(ectory)?[ _.-]*)\d+"),
    ("scripts: ghost12", rf"(ghost|phantom|noise|unid|unlab){_GAP}\d+"),
    (
        "Motive, Shogun, Simi: Unlabeled 12, Unlabeled_5, unidentified12, unnamed marker 3",
        r"(un[ _-]?(labell?ed|named|identified|known|assigned|defined|tracked)|untitled|no[ _-]?name"
        rf"|not[ _-]?labell?ed)({_GAP}(marker|point|traj(ectory|ectories)?|track|target))?({_GAP}\d+)?",
    ),
)
_PATTERN = re.compile("|".join(spelling for _, spelling in _SPELLINGS), re.IGNORECASE)


def unlabelled(name: str, subject: str = "") -> bool:
    """Whether a label is what a program calls a trajectory that nobody has named.

    >>> [unlabelled(name) for name in ("*12", "Unlabeled 1000", "_0001", "U_1", "New 0001", "LFHD")]
    [True, True, True, True, True, False]
    >>> unlabelled("1234", subject="Unlabeled")
    True
    """
    whole = f"{subject}:{name}" if subject and name.isdigit() else name
    return bool(_PATTERN.fullmatch(name) or _PATTERN.fullmatch(whole))

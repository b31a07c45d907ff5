"""Trajectories without a name of their own: one stem and a running number, beside a complete set of names."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable

# So many labels of one stem, none of which says anything, are no marker set's names ...
LEAST_FAMILY = 5
# ... where so many labels beside them are placed. The smallest full set, Helen Hayes, has fifteen.
LEAST_SET = 12

_NUMBERED = re.compile(r"(.*?)[\s_.:*#-]*\d+")


def stem(label: str) -> str | None:
    """What stands in front of a label's number; None where it ends in none.

    >>> stem("M001"), stem("12"), stem("point_7"), stem("LFHD")
    ('M', '', 'point', None)
    """
    found = _NUMBERED.fullmatch(label)
    return None if found is None else found[1]


def nameless(open_: Iterable[str], placed: int) -> frozenset[str]:
    """The labels that are no more than a stem and a running number, beside a set of names.

    Args:
        open_: labels whose name says nothing, and that move with no part of the body.
        placed: how many others are placed.

    >>> sorted(nameless(["M1", "M2", "M3", "M4", "M5", "stick"], placed=39))
    ['M1', 'M2', 'M3', 'M4', 'M5']
    """
    families: dict[str, list[str]] = defaultdict(list)
    for label in open_ if placed >= LEAST_SET else ():
        if (name := stem(label)) is not None:
            families[name].append(label)
    return frozenset(x for own in families.values() if len(own) >= LEAST_FAMILY for x in own)

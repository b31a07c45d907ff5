"""Trajectories without a name of their own: one stem and a running number, beside a complete set of names."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Collection, Iterable

# So many labels of one stem, none of which says anything, are no marker set's names ...
LEAST_FAMILY = 5
# ... where so many labels beside them are placed. The smallest full set, Helen Hayes, has fifteen.
LEAST_SET = 12
# So many labels of one stem are no cluster's, whatever the stem says. The largest set's, Rizzoli's of the trunk, has 9.
CROWD = 13

# Signs and a few letters may stand behind the number too: 12*, (12), tr12x.
_NUMBERED = re.compile(r"(.*?)[\W_]*\d+([^\W\d_]*)[\W_]*")


def stem(label: str) -> tuple[str, str] | None:
    """What stands in front of a label's last number and behind it, without signs; None where it has no number.

    >>> stem("M001"), stem("12*"), stem("point_7"), stem("LFHD")
    (('M', ''), ('', ''), ('point', ''), None)
    """
    found = _NUMBERED.fullmatch(label)
    return None if found is None else (found[1], found[2])


def nameless(open_: Iterable[str], placed: int) -> frozenset[str]:
    """The labels that are no more than a stem and a running number, beside a set of names.

    Args:
        open_: labels whose name says nothing, or something that the movement denies, and that move with no
            part of the body.
        placed: how many others are placed.

    >>> sorted(nameless(["M1", "M2", "M3", "M4", "M5", "stick"], placed=39))
    ['M1', 'M2', 'M3', 'M4', 'M5']
    """
    if placed < LEAST_SET:
        return frozenset()
    families = _families(open_).values()
    return frozenset(x for own in families if len(own) >= LEAST_FAMILY for x in own)


def crowd(labels: Iterable[str], named: Collection[str]) -> frozenset[str]:
    """The labels of stems with too many numbers for a cluster, beside a set of other names.

    Args:
        labels: all of a clip.
        named: those whose name says which segment they are on.

    >>> ghosts = [f"H{i}" for i in range(1, 41)]
    >>> names = [f"{side}{x}" for side in "LR" for x in ("ASI", "PSI", "KNE", "ANK", "HEE", "TOE")]
    >>> len(crowd([*names, *ghosts], [*names, *ghosts])), len(crowd(ghosts, ghosts))
    (40, 0)
    """
    large = frozenset(x for own in _families(labels).values() if len(own) >= CROWD for x in own)
    return large if len(set(named) - large) >= LEAST_SET else frozenset()


def _families(labels: Iterable[str]) -> dict[tuple[str, str], list[str]]:
    families: dict[tuple[str, str], list[str]] = defaultdict(list)
    for label in labels:
        if (name := stem(label)) is not None:
            families[name].append(label)
    return families

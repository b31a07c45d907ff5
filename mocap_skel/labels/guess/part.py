"""Which figure a clip shows: the standard human, or the shipped parts of it that are whole."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from mocap_skel.figure.skeleton import LEAST_ON_ROOT, Skeleton, shipped_skeletons


def figures(placed: Mapping[str, int], human: Skeleton) -> tuple[Skeleton, ...]:
    """The human, or where its root is not shown, the parts of it that start at what is.

    The part with most markers is taken first, of equal ones the smallest; then others of segments that no
    part has yet. Each needs three markers on its root, and markers on a second segment where it has one.

    Args:
        placed: how many markers each segment has that the clip shows.
        human: the standard human.

    Returns:
        At least one; the human where there is no part.

    >>> human = shipped_skeletons()["human"]
    >>> legs = {"UpperRightLeg": 3, "LowerRightLeg": 3, "UpperLeftLeg": 3, "LowerLeftLeg": 2}
    >>> [part.name for part in figures(legs, human)]
    ['right_leg', 'left_leg']
    """
    if placed.get(human.root.name, 0) >= LEAST_ON_ROOT:
        return (human,)
    found: list[Skeleton] = []
    left = {name: count for name, count in placed.items() if count}
    while parts := list(_parts(left, human)):
        _, _, name, part = min(parts, key=lambda p: p[:3])
        found.append(replace(part, name=name))
        for segment in part.segments:
            left.pop(segment.name, None)
    return tuple(found) or (human,)


def _parts(placed: Mapping[str, int], human: Skeleton) -> Iterator[tuple[int, int, str, Skeleton]]:
    """(minus its markers, its segments, name, figure) of every part that the clip shows."""
    names = {s.name for s in human.segments}
    for name, part in shipped_skeletons().items():
        own = [s.name for s in part.segments]
        shown = sum(placed.get(segment, 0) > 0 for segment in own)
        if (
            set(own) < names
            and placed.get(part.root.name, 0) >= LEAST_ON_ROOT
            and shown >= min(2, len(own))
        ):
            yield -sum(placed.get(segment, 0) for segment in own), len(own), name, part


def begun(placed: Mapping[str, int], human: Skeleton) -> Skeleton | None:
    """The part of the human that a clip shows but for its root, which has a marker or two; None for none.

    Args:
        placed: how many markers each segment has that the clip shows.
        human: the standard human.

    >>> human = shipped_skeletons()["human"]
    >>> begun({"UpperRightLeg": 2, "LowerRightLeg": 2, "RightFoot": 2}, human).name
    'right_leg'
    """
    found = [
        (sum(placed.get(s.name, 0) for s in part.segments), -len(part.segments), name)
        for name, part in shipped_skeletons().items()
        if {s.name for s in part.segments} < {s.name for s in human.segments}
        and 0 < placed.get(part.root.name, 0) < LEAST_ON_ROOT
        and sum(placed.get(s.name, 0) > 0 for s in part.segments) > 1
    ]
    return replace(shipped_skeletons()[max(found)[2]], name=max(found)[2]) if found else None

"""Whether several clips show one person: by the lengths of the bones and the shapes of the segments."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from mocap_skel.joints.calibration import REATTACHED, SPREADS, Template
from mocap_skel.segments.pose import Array
from mocap_skel.text import listed

# Metres by which the distance of two markers differs where both were put on again, as a standard deviation:
# examiners find a landmark again to 6 to 21 mm, as Della Croce et al. 2005 are quoted (not confirmed in the
# paper), 1 cm along each axis; two markers, two days. So many times as much on all segments together is another
# person: two and a half of the deviations that the mean over some 25 independent distances has.
PUT_BACK, TOO_MUCH = 0.02, 1.35
# A bone's length differs by its errors and by such a part of it: anatomy's part of a joint goes with the markers.
BONE = 0.03
# All bones together of one person differ by less: so many standard deviations of their mean, and such a part.
SURE, SIZE = 2.5, 0.04
# Where the bones differ only because the movement shows the joints badly, the distances of the markers do not; those
# of a larger person do, by as much. Each marker put on to 1 cm changes their median by 2 %: half of it tells.
HALF = 0.5
# Segments, distances of markers, and bones that have to tell.
ENOUGH_SEGMENTS, ENOUGH_DISTANCES, ENOUGH_BONES = 3, 10, 3


@dataclass(frozen=True, eq=False)
class Body:
    """What a clip shows of a person's size and shape.

    Attributes:
        clip: its name.
        segments: name → markers in the segment's own coordinates.
        bones: segment → (length, standard error) between its joints, metres.
    """

    clip: str
    segments: Mapping[str, Template]
    bones: Mapping[str, tuple[float, float]]


def strangers(bodies: Sequence[Body]) -> tuple[list[list[str]], str]:
    """The clips, one group a person, and what tells two of them apart; one group and "" for one person.

    Markers that were put on again elsewhere make no other person: with most segments as they were it is the
    same one, unless these are larger or smaller by as much as the bones are longer or shorter. Otherwise all bones
    together must have the same length within their errors, and all segments together the same shape within what is
    usual in finding the places of the markers again.

    >>> one = Body("a", {}, {s: (length, 0.005) for s, length in [("thigh", 0.4), ("shank", 0.42), ("arm", 0.3)]})
    >>> two = Body("b", {}, {s: (1.1 * length, 0.005) for s, (length, _) in one.bones.items()})
    >>> strangers([one, two])
    ([['a'], ['b']], 'the bones of b are 10 % longer than those of a')
    """
    why: dict[tuple[str, str], str] = {}
    for one, other in combinations(bodies, 2):
        if said := difference(one, other):
            why[one.clip, other.clip] = why[other.clip, one.clip] = said
    groups: list[list[str]] = []
    for body in bodies:
        own = next((g for g in groups if not any((c, body.clip) in why for c in g)), None)
        if own is None:
            groups.append([body.clip])
        else:
            own.append(body.clip)
    return groups, next(iter(why.values()), "")


def difference(one: Body, other: Body) -> str:
    """What tells two clips' persons apart; "" where nothing does."""
    changes = {name: _changes(one, other, name) for name in one.segments if name in other.segments}
    changes = {name: change for name, change in changes.items() if len(change[0])}
    same = [
        n for n, (d, sd) in changes.items() if (d <= np.maximum(REATTACHED, SPREADS * sd)).all()
    ]
    longer, sd, count = _longer(one, other)
    if 2 * len(same) > len(changes) >= ENOUGH_SEGMENTS:
        # A few per cent of a segment are less than putting its markers on again, but not on all of them alike.
        larger = _larger(one, other, changes)
        if larger * longer <= 0 or abs(larger) < HALF * abs(longer):
            return ""
    if count >= ENOUGH_BONES and abs(longer) > max(SIZE, SURE * sd):
        part = abs(np.expm1(longer))
        return (
            f"the bones of {other.clip} are {100 * part:.0f} % "
            f"{'longer' if longer > 0 else 'shorter'} than those of {one.clip}"
        )
    if len(changes) < ENOUGH_SEGMENTS:
        return ""
    far, sds = (np.concatenate(parts) for parts in zip(*changes.values(), strict=True))
    much = np.sqrt((far**2 / (PUT_BACK**2 + sds**2)).mean())
    if len(far) < ENOUGH_DISTANCES or much <= TOO_MUCH:
        return ""
    worst = sorted(changes, key=lambda n: -float(changes[n][0].max()))
    return (
        f"distances of markers on {len(changes)} segments differ by {100 * np.sqrt((far**2).mean()):.1f} cm "
        f"between {one.clip} and {other.clip}, most on {listed(worst, 3)}"
    )


def _larger(one: Body, other: Body, segments: Iterable[str]) -> float:
    """Logarithm of how much larger the other's segments are: the median over their distances."""
    pairs = [_pairs(one, other, name) for name in segments]
    a, b = (np.concatenate(side) for side in zip(*pairs, strict=True))
    return float(np.median(np.log(b / a)))


def _changes(one: Body, other: Body, name: str) -> tuple[Array, Array]:
    """(pairs,) By how much the distances of a segment's markers differ, and the deviation that movement makes."""
    a, b = _pairs(one, other, name)
    sd = np.hypot(one.segments[name].rigid, other.segments[name].rigid)
    return np.abs(a - b), np.full(len(a), sd)


def _pairs(one: Body, other: Body, name: str) -> tuple[Array, Array]:
    """(pairs,) The distances of the markers that a segment has in both clips, in each of them."""
    first, second = one.segments[name], other.segments[name]
    common = [m for m in first.markers if m in second.markers]
    sides = (np.array([t.markers[m] for m in common]).reshape(-1, 3) for t in (first, second))
    a, b = (_distances(side)[np.triu_indices(len(common), 1)] for side in sides)
    return a, b


def _distances(points: Array) -> Array:
    return np.asarray(np.linalg.norm(points[:, None] - points[None], axis=2))


def _longer(one: Body, other: Body) -> tuple[float, float, int]:
    """Logarithm of how much longer the other's bones are, its standard deviation, and of how many bones."""
    common = [name for name in one.bones if name in other.bones]
    if not common:
        return 0.0, np.inf, 0
    (a, da), (b, db) = (np.array([body.bones[n] for n in common]).T for body in (one, other))
    variance = (da / a) ** 2 + (db / b) ** 2 + BONE**2
    weight = 1 / variance
    mean = float((weight * np.log(b / a)).sum() / weight.sum())
    return mean, float(np.sqrt(1 / weight.sum())), len(common)

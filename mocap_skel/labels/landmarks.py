"""Landmarks among a subject's markers: found under any spelling, and those beside a joint checked by their places."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mocap_skel.figure.skeleton import STANDARD, read_skeleton

if TYPE_CHECKING:
    from mocap_skel.labels.guess.dialects import Pair

Array = NDArray[np.float64]

# Metres between the markers on both sides of a joint; others are no such pair.
NEAREST, FARTHEST = 0.03, 0.25
# Fewer frames, or a smaller share of the clip's, prove nothing.
LEAST_FRAMES, LEAST_SHARE = 10, 0.05
# A place speaks clearly if the cosine between "from lateral to medial" and "inward" is beyond this in the
# median, and has the sign of it in so many frames.
CLEAR, MOST = 0.4, 0.8
# Sine of the bend from which the plane of the two bones tells what is inward: 20 degrees. A trochanter or
# an acromion stands for the upper joint, and leans the bone by 10.
BENT = 0.35
# How far the way between two markers that a number tells apart may be from straight inward, as a cosine in the
# median: a patella lies 45 degrees in front of the lateral epicondyle, 0.7.
STRAIGHT = 0.85
# KNE1 and KNE2, Ankle_A and Ankle_B.
_NUMBERED = re.compile(r"(.*[^\W\d_])[ _.-]*0?([12]|[AB])", re.I)
# What a place says of a name: it agrees, it contradicts, it is not clear.
AGREES, DENIES, OPEN = 1, -1, 0


@dataclass(frozen=True)
class Exchanged:
    """Two landmarks beside a joint whose names and places contradict each other.

    Attributes:
        lateral, medial: the landmarks, by their names.
        joint: with its side, in plain words.
        certain: whether their places are to be believed.
    """

    lateral: str
    medial: str
    joint: str
    certain: bool

    def sentence(self, labels: Mapping[str, str]) -> str:
        """What contradicts what, and what was made of it; `labels` are the clip's, by landmark.

        >>> one = Exchanged("LKNE", "LKNM", "left knee", certain=True)
        >>> one.sentence({"LKNE": "L_lat", "LKNM": "L_med"})
        'L_med is named for the inner side of the left knee but lies outside of L_lat: exchanged, as places say'
        """
        outer, inner = labels[self.lateral], labels[self.medial]
        said = (
            f"{inner} is named for the inner side of the {self.joint} but lies outside of {outer}: "
        )
        if self.certain:
            return said + "exchanged, as places say"
        return said + "are their names exchanged, or is the clip mirrored? Taken by their names"


def landmark(names: Iterable[str], segment: str) -> str:
    """The standard marker or landmark that one of these names means on a segment; "" for none.

    Args:
        names: the best first.
        segment: of the skeleton.

    >>> landmark(["LMFE"], "UpperLeftLeg"), landmark(["L.Knee.Med"], "Hips")
    ('LKNM', '')
    """
    # The face of that folder imports the module that imports this one.
    from mocap_skel.labels.guess.names import meanings

    found = (marker for name in names for s, marker in meanings(name) if s == segment)
    return next(found, "")


def segment_of_landmark(name: str, segments: Sequence[str]) -> str:
    """The segment of a landmark that is none of the standard human's markers; "" for other names.

    Args:
        name: the landmark, in any spelling.
        segments: those that it may lie on.

    >>> segment_of_landmark("V.Sacral", ["Hips", "Chest"]), segment_of_landmark("LKNEE", ["UpperLeftLeg"])
    ('Hips', '')
    """
    from mocap_skel.labels.guess.names import meanings

    # A standard marker in another spelling is rather a slip, of which an error can say more.
    standard = read_skeleton(STANDARD).segment_of
    found = (s for s, marker in meanings(name) if s in segments and marker not in standard)
    return next(found, "")


def own_names(columns: Mapping[str, Mapping[str, int]], labels: Sequence[str]) -> dict[str, str]:
    """Standard markers and landmarks that a subject has under other names: landmark → the marker's own name.

    Args:
        columns: segment → marker → its column in the clip.
        labels: the clip's, which count where a marker's name says nothing.

    >>> own_names({"Hips": {"LFWT": 0, "back": 1}}, ["LASI", "V.Sacral"])
    {'SACR': 'back'}
    """
    from mocap_skel.labels.guess.dialects import dialects

    known = dialects().landmarks
    there = {marker for of in columns.values() for marker in of}
    found: dict[str, str] = {}
    for segment, of in columns.items():
        for marker, column in of.items():
            if known.get(marker) != segment:
                name = landmark((marker, labels[column]), segment)
                if name and name not in there:
                    found.setdefault(name, marker)
    return found


def told_by_place(
    points: Array, columns: Mapping[str, Mapping[str, int]], labels: Sequence[str]
) -> dict[str, str]:
    """The landmarks on both sides of a joint whose labels differ in a number alone: landmark → the marker's own name.

    KNE1 and KNE2 are such a pair if one lies straight inward of the other; the name does not say which.

    Args:
        points: (frames, M, 3), metres, NaN = missing.
        columns: segment → marker → its column.
        labels: the clip's.

    >>> points = np.tile([[0.0, y, 0.5] for y in (0.05, 0.15, -0.05, -0.15)], (20, 1, 1))
    >>> labels = ["LKNE1", "LKNE2", "RKNE1", "RKNE2"]
    >>> columns = {"UpperLeftLeg": {"a": 0, "b": 1}, "UpperRightLeg": {"c": 2, "d": 3}}
    >>> told_by_place(points, columns, labels)
    {'LKNE': 'b', 'LKNM': 'a', 'RKNE': 'd', 'RKNM': 'c'}
    """
    from mocap_skel.labels.guess.dialects import dialects

    name_of = {column: marker for of in columns.values() for marker, column in of.items()}
    at = {marker: column for column, marker in name_of.items()}
    known = dialects().landmarks
    twins = {
        (side, pair): two
        for pair in dialects().pairs
        for side in "LR"
        if pair.medial.format(s=side) not in at
        and (
            two := _numbered(
                columns.get(known[pair.lateral.format(s=side)], {}),
                labels,
                pair.lateral.format(s=side),
            )
        )
    }
    assumed = dict(at)
    for (side, pair), (first, second) in twins.items():
        assumed |= {pair.lateral.format(s=side): first, pair.medial.format(s=side): second}
    found: dict[str, str] = {}
    for (side, pair), (first, second) in twins.items():
        named = _Named(points, assumed, side, "LR"["RL".index(side)])
        way = named.straight(pair, 1 if side == "L" else -1)
        lateral, medial = named.of(pair.lateral), named.of(pair.medial)
        # Where the table's own names take the first for the lateral one, `exchanged` has the word.
        if way and lateral in at:
            found[medial] = name_of[second if at[lateral] == first else first]
        elif way:
            outer, inner = (first, second) if way == AGREES else (second, first)
            found |= {lateral: name_of[outer], medial: name_of[inner]}
    return found


def _numbered(of: Mapping[str, int], labels: Sequence[str], lateral: str) -> tuple[int, int] | None:
    """The columns of the two markers of a segment that are called like a landmark, but for a 1 and a 2."""
    from mocap_skel.labels.guess.names import meanings

    stems: dict[str, dict[str, int]] = {}
    for column in of.values():
        if found := _NUMBERED.fullmatch(labels[column]):
            stems.setdefault(found[1], {})[found[2].upper()] = column
    for stem, numbers in stems.items():
        for one, two in (("1", "2"), ("A", "B")):
            if numbers.keys() == {one, two} and lateral in {m for _, m in meanings(stem)}:
                return numbers[one], numbers[two]
    return None


def exchanged(points: Array, at: Mapping[str, int]) -> list[Exchanged]:
    """The landmarks beside a joint whose places contradict their names.

    The medial one of a knee or an ankle is nearer to the other leg, and of a knee or an elbow it lies to one
    side of the plane in which the limb bends. In a mirrored clip the bend says the opposite for all joints:
    without a joint that the bend agrees with, or another sign, the names stand.

    Args:
        points: (frames, M, 3), metres, NaN = missing.
        at: landmark → its column.

    A left knee and a right one, standing side by side (x to the front, y to the left):

    >>> places = {"LKNE": 0.05, "LKNM": 0.15, "RKNE": -0.15, "RKNM": -0.05}
    >>> points = np.tile([[0.0, y, 0.5] for y in places.values()], (20, 1, 1))
    >>> [(one.lateral, one.certain) for one in exchanged(points, {m: i for i, m in enumerate(places)})]
    [('LKNE', True)]
    """
    from mocap_skel.labels.guess.dialects import dialects

    found = []
    for pair in dialects().pairs:
        for side, other, word, sign in (("L", "R", "left", 1), ("R", "L", "right", -1)):
            named = _Named(points, at, side, other)
            across = named.across(pair)
            if across is not None:
                near, bend = named.by_other_leg(pair, *across), named.by_bend(pair, sign, *across)
                found.append((pair, named, f"{word} {pair.joint}", near, bend))
    handed = any(bend == AGREES for *_, bend in found)
    return [
        Exchanged(
            named.of(pair.lateral), named.of(pair.medial), joint, certain=near == DENIES or handed
        )
        for pair, named, joint, near, bend in found
        if DENIES in (near, bend) and AGREES not in (near, bend)
    ]


class _Named:
    """The landmarks of one side of a clip, by their names in the table."""

    def __init__(self, points: Array, at: Mapping[str, int], side: str, other: str) -> None:
        self.points = points
        self.at = at
        self.sides = {"s": side, "o": other}

    def of(self, name: str) -> str:
        return name.format(**self.sides)

    def across(self, pair: Pair) -> tuple[Array, Array] | None:
        """The middle of a pair and the way from lateral to medial, each (frames, 3); None if they are no pair."""
        lateral, medial = self.of(pair.lateral), self.of(pair.medial)
        if lateral not in self.at or medial not in self.at:
            return None
        outer, inner = self.points[:, self.at[lateral]], self.points[:, self.at[medial]]
        across = inner - outer
        lengths = np.linalg.norm(across, axis=1)
        lengths = lengths[np.isfinite(lengths)]
        if not len(lengths) or not NEAREST < np.median(lengths) < FARTHEST:
            return None
        return (outer + inner) / 2, across

    def by_other_leg(self, pair: Pair, middle: Array, across: Array) -> int:
        place = self._first(pair.toward)
        return OPEN if place is None else self._clear(place - middle, across)

    def by_bend(self, pair: Pair, sign: int, middle: Array, across: Array) -> int:
        inward = self._bend(pair, sign, middle)
        return OPEN if inward is None else self._clear(inward, across)

    def _bend(self, pair: Pair, sign: int, middle: Array) -> Array | None:
        """The directions inward (frames, 3) that the bend tells, NaN where it is too small; None without the bones."""
        upper, lower = self._first(pair.upper), self._first(pair.lower)
        if not pair.bend or upper is None or lower is None:
            return None
        above, below = middle - upper, lower - middle
        normal = sign * pair.bend * np.cross(above, below)
        lengths = np.linalg.norm(above, axis=1) * np.linalg.norm(below, axis=1)
        with np.errstate(invalid="ignore"):
            bent = np.linalg.norm(normal, axis=1) > BENT * lengths
        return np.where(bent[:, None], normal, np.nan)

    def straight(self, pair: Pair, sign: int) -> int:
        """AGREES if the medial one lies straight inward of the lateral one, DENIES if the other way round, or OPEN."""
        across = self.across(pair)
        if across is None:
            return OPEN
        middle, way = across
        other, bend = self._first(pair.toward), self._bend(pair, sign, middle)
        near = None if other is None else other - middle
        found = {self._clear(inward, way) for inward in (near, bend) if inward is not None} - {OPEN}
        # The other leg is straight inward only of one who stands; the bend tells wherever it is seen.
        for inward in (bend, near):
            cosine = np.empty(0) if inward is None else np.abs(_cosines(inward, way))
            if len(cosine) >= LEAST_FRAMES:
                straight = np.median(cosine) > STRAIGHT
                return found.pop() if straight and len(found) == 1 else OPEN
        return OPEN

    def _first(self, sets: Iterable[Iterable[str]]) -> Array | None:
        """The mean track (frames, 3) of the first set of which the clip has one."""
        for names in sets:
            there = [self.at[name] for name in map(self.of, names) if name in self.at]
            if there:
                return np.asarray(self.points[:, there].mean(axis=1))
        return None

    def _clear(self, inward: Array, across: Array) -> int:
        """What directions inward (frames, 3), NaN where they are not known, say of the ways from lateral to medial."""
        cosine = _cosines(inward, across)
        if len(cosine) < max(LEAST_FRAMES, LEAST_SHARE * len(across)):
            return OPEN
        middle = float(np.median(cosine))
        clear = abs(middle) > CLEAR and np.mean(cosine * middle > 0) > MOST
        return (AGREES if middle > 0 else DENIES) if clear else OPEN


def _cosines(one: Array, other: Array) -> Array:
    """The cosines between directions (frames, 3), of the frames that have both."""
    with np.errstate(invalid="ignore", divide="ignore"):
        product = (one * other).sum(axis=1)
        cosine = product / (np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1))
    return np.asarray(cosine[np.isfinite(cosine)])

"""What markers' names mean: the table dialects.toml, prepared for look-ups."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

TABLE = Path(__file__).parent / "dialects.toml"
_ORDINALS = {"1": "ST", "2": "ND", "3": "RD", "4": "TH", "5": "TH"}
# Letters that tell two landmarks apart, but not which is which.
_UNTOLD = (["A", "B"],)
# Letters of stems that a side and another code are as likely to be.
_SHORT = 2
# Spellings by rule rank behind all that the table has, and before words.
_BY_RULE = 10_000
# C7, T10, L5, S1: with a side before it, such a code is a marker of a cluster (LT1: left thigh or tibia).
_VERTEBRA = re.compile(r"[A-Z]{1,2}\d+$")


@dataclass(frozen=True)
class Place:
    """A place on the body.

    Attributes:
        segment: of the standard human, with {Side} where the label must tell it.
        marker: the standard marker or landmark there, with {s} for the side; "" for none.
        side: the only side that has it, "" for any.
        middle: the landmark of a label without a side, "" for none.
    """

    segment: str
    marker: str
    side: str
    middle: str = ""

    @property
    def sided(self) -> bool:
        return "{" in self.segment

    def named(self, side: str) -> tuple[str, str]:
        """The segment and the standard marker or landmark ("" for none) on a side: "L", "R" or "".

        >>> Place("Upper{Side}Leg", "{s}KNE", "").named("L")
        ('UpperLeftLeg', 'LKNE')
        """
        long = {"L": "Left", "R": "Right", "": ""}[side]
        if not side and self.middle:
            return self.segment, self.middle
        # A marker of the middle is neither the left one nor the right one, and the reverse.
        fits = bool(side) == ("{" in self.marker) or (side and side == self.side)
        return self.segment.format(Side=long), self.marker.format(s=side) if fits else ""


@dataclass(frozen=True)
class Code:
    """One spelling of a place without the side.

    Attributes:
        rank: its place in the table, the best spelling first.
        doubtful: other sets use it for something else.
        needs: codes of which the clip must have one; empty for none.
        middle: counts only without a side.
    """

    place: Place
    rank: int
    doubtful: bool
    needs: frozenset[str]
    middle: bool


@dataclass(frozen=True)
class Either:
    """Codes with a side that may be either of two places.

    Attributes:
        codes: without side and number.
        where: the clip has one of these codes too; empty for always.
        unless: one of these settles it.
        reason: the question, in plain words.
    """

    codes: frozenset[str]
    where: frozenset[str]
    unless: frozenset[str]
    reason: str


@dataclass(frozen=True)
class Pair:
    """Two landmarks on either side of a joint. In all names {s} is the side and {o} the other one.

    Attributes:
        joint: in plain words, without the side.
        lateral, medial: the landmarks.
        toward: sets of landmarks to which the medial one is nearer; the first of which a clip has one counts.
        bend: on the left, 1 if the medial one lies to the side of (bone above) × (bone below), -1 if to the
            other one; 0 for a joint whose bend does not tell.
        upper, lower: sets of landmarks at the bones' other ends, likewise.
    """

    joint: str
    lateral: str
    medial: str
    toward: tuple[tuple[str, ...], ...]
    bend: int
    upper: tuple[tuple[str, ...], ...]
    lower: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Dialects:
    """The whole table.

    Attributes:
        sides: a word for a side → "L" or "R".
        words: spelling → the word that `phrases` have.
        noise: words that say nothing of the place.
        doubts: code without side → why it is not to be used unasked.
        either: codes of two places.
        computed_words, computed_codes, computed_starts: what names of computed points have in them.
        codes: code without side → its places, the best spelling first.
        clusters: stem of numbered codes → the places of the cluster.
        phrases: words that together name a place.
        there: words that name a place only if the segment is known from elsewhere.
        letters: letters that a clip must have → letter of a cluster → its place.
        landmarks: every standard marker and landmark of the table → its segment.
        pairs: landmarks on either side of a joint.
    """

    sides: dict[str, str]
    words: dict[str, str]
    noise: frozenset[str]
    doubts: dict[str, str]
    either: tuple[Either, ...]
    computed_words: frozenset[str]
    computed_codes: frozenset[str]
    computed_starts: tuple[str, ...]
    codes: dict[str, list[Code]] = field(default_factory=dict)
    clusters: dict[str, list[Place]] = field(default_factory=dict)
    phrases: list[tuple[frozenset[str], Place]] = field(default_factory=list)
    there: list[tuple[frozenset[str], Place]] = field(default_factory=list)
    letters: list[tuple[frozenset[str], dict[str, Place]]] = field(default_factory=list)
    landmarks: dict[str, str] = field(default_factory=dict)
    pairs: list[Pair] = field(default_factory=list)


@cache
def dialects() -> Dialects:
    """Read the table; later calls give the same one."""
    data = tomllib.loads(TABLE.read_text(encoding="utf-8"))
    found = Dialects(
        sides={word: side for side, words in data["sides"].items() for word in words},
        words={s: word for word, spellings in data["words"].items() for s in spellings},
        noise=frozenset(data["noise"]["words"]),
        doubts={code: why for why, codes in data["doubt"].items() for code in codes},
        either=tuple(
            Either(
                frozenset(e["codes"]), frozenset(e["where"]), frozenset(e["unless"]), e["reason"]
            )
            for e in data["either"]
        ),
        computed_words=frozenset(data["computed"]["words"]),
        computed_codes=frozenset(data["computed"]["codes"]),
        computed_starts=tuple(data["computed"]["starts"]),
    )
    rank = 0
    for entry in data["place"]:
        keys = ("marker", "side", "middle")
        place = Place(entry["segment"], *(entry.get(key, "") for key in keys))
        needs = entry.get("with", {})
        doubtful = entry.get("likely", [])
        for code in [*entry["codes"], *doubtful]:
            rank += 1
            middle = not place.sided and _VERTEBRA.match(code) is not None
            found.codes.setdefault(code, []).append(
                Code(place, rank, code in doubtful, frozenset(needs.get(code, ())), middle)
            )
        for stem in entry.get("cluster", []):
            found.clusters.setdefault(stem, []).append(place)
        found.phrases.extend((frozenset(phrase.split()), place) for phrase in entry["words"])
        found.there.extend((frozenset(p.split()), place) for p in entry.get("there", ()))
        for side in ("L", "R") if "{" in place.marker else (place.side,):
            segment, marker = place.named(side)
            found.landmarks[marker] = segment
    found.landmarks.pop("", None)
    for entry in data["spelled"]:
        _add_spelled(found, entry, data["ends"][entry["ends"]])
    for entry in data["numbered"]:
        _add_numbered(found, entry)
    for entry in data["letters"]:
        places = {letter: Place(s, "", "") for letter, s in entry["segments"].items()}
        found.letters.append((frozenset(entry["has"]), places))
    for entry in data["pair"]:
        sets = (
            tuple(tuple(names) for names in entry.get(key, ()))
            for key in ("toward", "upper", "lower")
        )
        toward, upper, lower = sets
        names = (entry["joint"], entry["lateral"], entry["medial"])
        found.pairs.append(Pair(*names, toward, entry.get("bend", 0), upper, lower))
    return found


def _add_spelled(found: Dialects, entry: Mapping[str, Any], ends: Mapping[str, Any]) -> None:
    """Add the spellings of two landmarks of one stem: with words anywhere, with letters where a clip has both."""
    one, other = (_place_of(found, name) for name in entry["places"])
    stems = entry["stems"]
    for place, words in ((one, ends["first"]), (other, ends["second"])):
        _add(found, place, (x for s in stems for w in words for x in (s + w, w + s)))
    inner = [*ends["second"], *(second for _, second in ends["letters"])]
    for stem in stems:
        # KneeM stands beside Knee as well as beside KneeL. LEL beside MEL is rather LE on the left than EL.
        if len(stem) > _SHORT:
            _add(found, one, (stem,), (x for w in inner for x in (stem + w, w + stem)))
        for first, second in ends["letters"]:
            outer = (stem + first, first + stem)
            _add(found, one, outer, (stem + second, second + stem))
            _add(found, other, (stem + second, second + stem), (*outer, stem))
        for first, second in _UNTOLD:
            for letter, partner in ((first, second), (second, first)):
                _add(found, replace(one, marker=""), (stem + letter,), (stem + partner,))


def _add_numbered(found: Dialects, entry: Mapping[str, Any]) -> None:
    """Add the spellings of landmarks that a number tells apart."""
    places = {number: _place_of(found, name) for number, name in entry["places"].items()}
    rest = replace(next(iter(places.values())), marker="")
    for n, order in _ORDINALS.items():
        for stem in entry["stems"]:
            spelled = (
                stem + n,
                f"{stem}0{n}",
                n + stem,
                n + order + stem,
                f"{stem}{n}H",
                f"D{n}{stem}",
            )
            _add(found, places.get(n, rest), spelled)
            _add(found, rest, (x for b in entry["base"] for x in (b + n + stem, stem + n + b)))


def _place_of(found: Dialects, marker: str) -> Place:
    """The place of a landmark, by its name in the table."""
    return next(place for _, place in found.phrases if place.marker == marker)


def _add(found: Dialects, place: Place, spelled: Iterable[str], needs: Iterable[str] = ()) -> None:
    """Add spellings of a place behind those that the table itself has."""
    code = Code(place, _BY_RULE, False, frozenset(needs), False)
    for spelling in spelled:
        known = found.codes.setdefault(spelling, [])
        if not known or code not in known:
            known.append(code)

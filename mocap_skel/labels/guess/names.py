"""What the labels of a clip say: the segment and the standard marker of each, and how sure that is."""

from __future__ import annotations

import re
import unicodedata
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from mocap_skel.labels.guess.dialects import Code, Dialects, Place, dialects

HIGH, LIKELY, UNSURE, OPEN = "high", "likely", "unsure", "open"
# Camel case, capitals in front of a capitalised word, numbers.
_TOKEN = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+")
# PELVIS_X: the tip of a segment's axis, where the clip has another axis of it too.
_AXIS = re.compile(r"(.+)[ _.-]([XYZ])", re.I)
# Pelvis_S1: a part of the body and a name.
_PART = re.compile(r"([A-Za-z]+)[ _.:/-]+(.+)")
_LETTER = re.compile(r"([LR])([A-Z])_?(\d+)$")
# What readers and labelling software make of a marker that stands in the file more than once.
_DOUBLE = re.compile(r"(.*\D\d*)[_-]\d+$")
# "LUArm", "RFArm": the side and the first letter of upper or fore in one token.
_SIDE_AND_PART = {"u": "upper", "f": "fore"}
# "Knee_I", "epicondyle M": inner and outer in a letter, at these joints; L is rather a side.
_BESIDE_A_JOINT = {"knee", "ankle", "elbow", "epicondyle", "condyle", "malleolus"}
_INWARD = {"m": "medial", "i": "medial", "o": "lateral", "e": "lateral"}
# "PelvisLF", "head_BR", "Waist B": side and front or back in letters, on these parts of the body.
_WITH_CORNERS = {"pelvis", "waist", "hip", "head"}
_CORNER = {"f": ("", "front"), "b": ("", "back")} | {
    letters: (side, part)
    for side in "LR"
    for letter, part in (("f", "front"), ("b", "back"))
    for letters in (side.lower() + letter, letter + side.lower())
}
_REASON = {
    "code": "{} is a known name",
    "cluster": "cluster {}",
    "numbered": "{}: a known name with a number",
}
_OTHER = {"L": "R", "R": "L"}
# Stems that must be there on both sides before letters of another language count as sides.
_LEAST_PAIRS = 4


@dataclass(frozen=True)
class NameGuess:
    """What one label says about its marker.

    Attributes:
        label: without its subject.
        segment: of the standard human, "" for nothing.
        marker: the standard marker or landmark, "" for none.
        confidence: HIGH, LIKELY, UNSURE (a guess that is not to be used unasked) or OPEN.
        reason: in plain words.
        rank: of several labels for one marker, the one with the smallest rank gets it.
        computed: the name of a point that a model computed.
        double_of: the label of which this is another copy in the file, "" for none.
        lost: it keeps its distance to no part of the body, so it is another body's.
    """

    label: str
    segment: str
    marker: str
    confidence: str
    reason: str
    rank: float = 1e9
    computed: bool = False
    double_of: str = ""
    lost: bool = False


def guess_names(
    labels: Sequence[str], standard: Iterable[tuple[str, str]] = ()
) -> dict[str, NameGuess]:
    """Guess from the names alone which label is which marker; no standard marker is given twice.

    Args:
        labels: all of one clip, without subjects: the meaning of one can depend on the others.
        standard: the skeleton's markers with their segments.

    Returns:
        Label → guess, in the order of the labels.

    >>> found = guess_names(["R.Knee.Lat", "point 7"])
    >>> found["R.Knee.Lat"].segment, found["R.Knee.Lat"].marker, found["R.Knee.Lat"].confidence
    ('UpperRightLeg', 'RKNE', 'high')
    >>> found["point 7"].reason
    'the name says nothing'
    """
    return dict(_guessed(tuple(labels), tuple(standard)))


# Subjects, sizes and the guess itself ask the same of one clip.
@lru_cache(64)
def _guessed(
    labels: tuple[str, ...], standard: tuple[tuple[str, str], ...]
) -> dict[str, NameGuess]:
    known = _Labels(labels, dict(standard))
    return _one_each({label: known.guess(label) for label in dict.fromkeys(labels)})


@lru_cache(4096)
def meanings(label: str) -> tuple[tuple[str, str], ...]:
    """(segment, standard marker or landmark) of all that a label may be, the likeliest first.

    The other labels of a clip do not matter here: who asks knows the segment from elsewhere.

    >>> meanings("LLE")
    (('UpperLeftLeg', 'LKNE'),)
    """
    known = _Labels([label], {})
    found = [
        code.place.named(side)
        for side, rest, _ in known._candidates(label)
        for code in known.table.codes.get(rest, [])
        if not (code.middle and side) and (side or not code.place.sided)
    ]
    by_words = known._by_words(label)
    if by_words and by_words.confidence != UNSURE:
        found.append((by_words.segment, by_words.marker))
    words, side, _, unknown = known._words(label)
    if side and not unknown:
        found += [place.named(side) for phrase, place in known.table.there if phrase == words]
    return tuple(dict.fromkeys((segment, marker) for segment, marker in found if marker))


def tokens(label: str) -> list[str]:
    """Split a label into its words and numbers, in small letters.

    >>> tokens("RightKneeLat_01")
    ['right', 'knee', 'lat', '01']
    """
    parts = re.split(r"[^A-Za-z0-9]+", _plain(label))
    return [t.lower() for part in parts for t in _TOKEN.findall(part)]


def _code(label: str) -> str:
    return re.sub(r"[^A-Z0-9]", "", _plain(label).upper())


def _plain(label: str) -> str:
    """A label without accents."""
    if label.isascii():
        return label
    apart = unicodedata.normalize("NFKD", label.replace("ß", "ss"))
    return "".join(c for c in apart if not unicodedata.combining(c))


class _Labels:
    """All labels of one clip: what each of them means can depend on the others."""

    def __init__(self, labels: Sequence[str], standard: dict[str, str]) -> None:
        self.table: Dialects = dialects()
        self.standard = standard
        self.labels = set(labels)
        self.all = {_code(label) for label in labels}
        self.pair = _other_language({_stem(code) for code in self.all})
        behind = [found[2] for found in map(_PART.fullmatch, labels) if found and self._part(found)]
        self.rests = {rest for x in (*labels, *behind) for _, rest, _ in self._candidates(x)}
        self.rests |= {_stem(rest) for rest in self.rests}
        # Stems with a number, side and all: how many numbers each has.
        self.numbered: dict[str, set[str]] = defaultdict(set)
        for code in self.all:
            stem = _stem(code)
            if stem != code:
                self.numbered[stem].add(code)
        self.tips: dict[str, set[str]] = defaultdict(set)
        for tip in filter(None, map(_AXIS.fullmatch, labels)):
            self.tips[tip[1].upper()].add(tip[2].upper())
        letters = {m[2] for code in self.all if (m := _LETTER.match(code)) and self._many(code)}
        self.letters: dict[str, Place] = next(
            (places for has, places in self.table.letters if has <= letters), {}
        )

    def guess(self, label: str) -> NameGuess:
        if computed := self._computed(label):
            return NameGuess(label, "", "", OPEN, computed, computed=True)
        if label in self.standard and not self._arm(label):
            return NameGuess(label, self.standard[label], label, HIGH, "a name of Table 1", 0)
        first = _DOUBLE.match(label)
        if first and first[1] in self.labels:
            of = self.guess(first[1])
            confidence = LIKELY if of.confidence == HIGH else of.confidence
            reason = f"a double of {first[1]}"
            return NameGuess(label, of.segment, "", confidence, reason, 1e8, of.computed, first[1])
        if either := self._either(label):
            return NameGuess(label, "", "", UNSURE, either)
        best = self._by_code(label) or self._by_words(label) or self._by_letter(label)
        if best is None or not best.marker:
            behind = self._behind_a_part(label)
            clear = best is not None and best.confidence in (HIGH, LIKELY)
            best = behind if behind and (behind.marker or not clear) else best
        return best or NameGuess(label, "", "", OPEN, "the name says nothing")

    def _part(self, found: re.Match[str]) -> bool:
        """Whether what stands in front of a name is a part of the body."""
        return all(t in self.table.words or t in self.table.sides for t in tokens(found[1]))

    def _behind_a_part(self, label: str) -> NameGuess | None:
        """The guess for Pelvis_S1 or Trunk.LAC1: a name behind a part of the body, on that part or beside it."""
        found = _PART.fullmatch(label)
        if not found or not self._part(found) or _code(found[2]) in self.table.computed_codes:
            return None
        part, rest = self._by_words(found[1]), self._by_code(found[2]) or self._by_words(found[2])
        if part is None or rest is None or rest.confidence in (UNSURE, OPEN) or not part.segment:
            return None
        if part.segment != rest.segment or part.confidence in (UNSURE, OPEN):
            return None
        return replace(rest, label=label, reason=f"{found[1]}, {rest.reason}")

    def _either(self, label: str) -> str:
        """The two places that an ambiguous code may be, in words; "" if it is clear, or the other labels make it so."""
        candidates = self._candidates(label)
        sided = (_stem(rest) for side, rest, mirrored in candidates if side and not mirrored)
        # The first is the likeliest: RTH1 is R and TH, not RT and H; but LFT1 is not LFT and 1.
        code = next(filter(None, sided), "")
        for either in self.table.either:
            there = not either.where or either.where & self.rests
            if there and code in either.codes and not either.unless & self.rests:
                return either.reason
        return ""

    def _computed(self, label: str) -> str:
        if (tip := _AXIS.fullmatch(label)) and len(self.tips[tip[1].upper()]) >= 2:
            return "the tip of an axis by its name"
        words = tokens(label)
        code = _code(label)
        # LFEL beside LFER is a marker whose side stands at the end; models write LFEL and RFEL.
        at_end = self._mirror(code) and _OTHER.get(code[0], "") + code[1:] not in self.all
        rests = set() if at_end else {rest for _, rest, _ in self._sides(code)}
        rests |= {code}
        hit = (
            next((w for w in words if w in self.table.computed_words), "")
            or next((r for r in rests if r in self.table.computed_codes), "")
            or next((s for s in self.table.computed_starts if code.startswith(s)), "")
        )
        return f"a computed point by its name ({hit})" if hit else ""

    def _arm(self, label: str) -> bool:
        """Whether RARM, a forearm in Table 1, is the upper arm here: the clip has another name for the forearm."""
        forearm = {"FRM", "FRA", "FARM", "FOREARM"}
        return label[1:] == "ARM" and bool(forearm & self.rests)

    def _sides(self, code: str) -> Iterator[tuple[str, str, bool]]:
        """(side, rest, whether the mirrored label must exist) of a code, the likeliest first."""
        yield "", code, False
        if self.pair:
            left, right, at_end = self.pair
            for letter, side in ((left, "L"), (right, "R")):
                if at_end and _stem(code).endswith(letter):
                    yield side, _stem(code)[:-1], False
                elif not at_end and code.startswith(letter):
                    yield side, code[1:], False
            return
        yield from _sided(code)

    def _by_code(self, label: str) -> NameGuess | None:
        whole = _code(label)
        candidates = self._candidates(label)
        for side, rest, mirrored in candidates:
            if mirrored and not self._mirror(whole):
                continue
            for kind, code, place in self._readings(side, rest, whole):
                segment, marker = place.named(side)
                marker = marker if kind == "code" else ""
                confidence = HIGH
                if (code and code.doubtful) or kind != "code" or self.pair:
                    confidence = LIKELY
                said = {"L": "left ", "R": "right ", "": ""}[side] + rest
                reason = _REASON[kind].format(said)
                if self._from_model(whole, kind):
                    reason = "a computed point: models number the axes that they write from 0"
                    return NameGuess(label, "", "", OPEN, reason, computed=True)
                doubt = self.table.doubts.get(rest) if kind == "code" else None
                if doubt:
                    confidence, marker, reason = UNSURE, "", f"{reason}, but {doubt}"
                rank = code.rank if code else 1e6
                return NameGuess(label, segment, marker, confidence, reason, rank)
        return None

    def _candidates(self, label: str) -> list[tuple[str, str, bool]]:
        """(side, rest, whether the mirrored label must exist) of a label, the likeliest first."""
        found = list(self._sides(_code(label)))
        spelled = tokens(label)
        said = [t for t in spelled if t not in self.table.noise]
        sides = {self.table.sides[t] for t in said if t in self.table.sides}
        if len(sides) == 1 and len(spelled) > 1 and not self.pair:
            # The side stands as a word of its own, wherever: that beats any letter.
            side = sides.pop()
            # RKneeM is medial and LKneeL lateral, before the letters are noise and side.
            rests = dict.fromkeys(r for words in (spelled, said) for r in self._without_side(words))
            found[1:1] = [(side, rest, False) for rest in rests]
            return [c for c in found if c[0] in ("", side)]
        if len(said) < len(spelled):
            found += self._sides("".join(said).upper())
        return found

    def _without_side(self, words: list[str]) -> list[str]:
        """The code of a label's words without its side: without the first, the last, and all words that tell it."""
        at = [i for i, word in enumerate(words) if word in self.table.sides]
        drop = [at[:1], at[-1:], at]
        return ["".join(w for i, w in enumerate(words) if i not in out).upper() for out in drop]

    def _readings(
        self, side: str, rest: str, whole: str
    ) -> Iterator[tuple[str, Code | None, Place]]:
        """What a code can be: itself, a marker of a cluster, itself with a number at its end."""
        stem = _stem(rest)
        for spelled, kind in ((rest, "code"), (stem, "cluster"), (stem, "numbered")):
            if kind == "cluster" and stem != rest:
                places = self.table.clusters.get(stem, [])
                sided = [p for p in places if p.sided]
                # H1 is on the head, LH1 on the left hand.
                places = sided if side and sided else [p for p in places if not p.sided]
                usable = {p.segment: p for p in places}
                if len(usable) == 1 and self._many(whole):
                    yield "cluster", None, next(iter(usable.values()))
            elif kind == "code" or (kind == "numbered" and stem != rest):
                for code in self.table.codes.get(spelled, []):
                    if code.place.sided and not side:
                        continue
                    if code.place.side and code.place.side != side:
                        continue
                    if code.middle and side:
                        continue
                    if code.needs and not code.needs & self.rests:
                        continue
                    yield kind, code, code.place

    def _from_model(self, code: str, kind: str) -> bool:
        """Whether the numbers are 0 alone, or 0 to 3: Vicon's models write a segment's axes so."""
        stem = _stem(code)
        numbers = {c[len(stem) :] for c in self.numbered[stem]}
        return (kind != "code" and numbers == {"0"}) or (
            kind == "numbered" and numbers == {"0", "1", "2", "3"}
        )

    def _mirror(self, code: str) -> bool:
        """Whether a code ends in a side, and the clip has the same one with the other side there."""
        return code[-1:] in _OTHER and code[:-1] + _OTHER[code[-1]] in self.all

    def _many(self, code: str) -> bool:
        return len(self.numbered[_stem(code)]) >= 2

    def _by_words(self, label: str) -> NameGuess | None:
        words, side, numbers, unknown = self._words(label)
        if not words:
            return None
        if "5" in numbers and words & {"metatarsal", "toe", "hand"}:
            words.add("fifth")
        elif numbers and words & {"metatarsal"}:
            words.add({"1": "first", "2": "second"}.get(numbers[0], "third"))
        fitting = [
            (len(phrase), -len(words - phrase), -i)
            for i, (phrase, place) in enumerate(self.table.phrases)
            if phrase <= words and not (place.side and place.side != side)
        ]
        if not fitting:
            return None
        _, left_over, index = max(fitting)
        place = self.table.phrases[-index][1]
        said = " ".join(sorted(words))
        if place.sided and not side:
            return NameGuess(label, "", "", OPEN, f"{said}: the name does not tell the side")
        segment, marker = place.named(side)
        if numbers and not words & {"fifth", "first", "second"}:
            marker = ""
        if unknown:
            reason = f"{said}, but what is {unknown[0]!r}?"
            return NameGuess(label, segment, marker, UNSURE, reason, 1e7)
        sided = {"L": "left ", "R": "right ", "": ""}[side]
        if left_over:
            return NameGuess(label, segment, "", LIKELY, f"the words {sided}{said}", 1e7)
        return NameGuess(label, segment, marker, HIGH, f"the words {sided}{said}", 1e5)

    def _words(self, label: str) -> tuple[set[str], str, list[str], list[str]]:
        """The words of a label in the table's spelling, its side, its numbers, and what is none of these."""
        spelled = tokens(label)
        joined: list[str] = []
        for token in spelled:
            if joined and joined[-1] + token in self.table.words and len(token) > 1:
                joined[-1] += token
            else:
                joined.append(token)
        words: set[str] = set()
        sides: set[str] = set()
        numbers: list[str] = []
        unknown: list[str] = []
        queue = list(joined)
        while queue:
            token = queue.pop(0)
            if token.isdigit():
                numbers.append(token.lstrip("0"))
            elif token in self.table.sides:
                sides.add(self.table.sides[token])
            elif (corner := _CORNER.get(token)) and self._among(_WITH_CORNERS, words, queue):
                side, part = corner
                sides |= {side} - {""}
                words.add(part)
            elif token in _INWARD and self._among(_BESIDE_A_JOINT, words, queue):
                words.add(_INWARD[token])
            elif len(token) == 2 and token[0] in "lr" and token[1] in _SIDE_AND_PART and queue:
                sides.add(token[0].upper())
                part = _SIDE_AND_PART[token[1]] + queue[0]
                if part in self.table.words:
                    queue[0] = part
                elif token[1] == "u":
                    words.add("upper")
            elif token in self.table.words:
                words.add(self.table.words[token])
            elif token in self.table.noise:
                continue
            elif (parts := _split(token)) is not None:
                queue[:0] = parts
            else:
                unknown.append(token)
        if len(sides) > 1:
            return set(), "", [], []
        return words, next(iter(sides), ""), numbers, unknown

    def _among(self, parts: set[str], words: set[str], others: Iterable[str]) -> bool:
        """Whether a label's words, found already or still to be, name one of some parts of the body."""
        return bool(parts & (words | {self.table.words.get(word, "") for word in others}))

    def _by_letter(self, label: str) -> NameGuess | None:
        found = _LETTER.match(_code(label))
        if not found or not self._many(_code(label)) or found[2] not in self.letters:
            return None
        segment, _ = self.letters[found[2]].named(found[1])
        others = "/".join(sorted(self.letters))
        return NameGuess(label, segment, "", LIKELY, f"cluster {found[2]} of a set with {others}")


@lru_cache(4096)
def _sided(code: str) -> tuple[tuple[str, str, bool], ...]:
    """(side, rest, whether the mirrored label must exist) of a code that starts or ends with a word for a side."""
    sides = [(word.upper(), side) for word, side in dialects().sides.items()]
    first = [(s, code[len(w) :], False) for w, s in sides if code.startswith(w) and code != w]
    last = [
        (s, code[: -len(w)], len(w) == 1)
        for w, s in sides
        if code.endswith(w) and len(code) > len(w) + 1
    ]
    return (*first, *last)


@lru_cache(4096)
def _split(token: str) -> list[str] | None:
    """Split a token into words of the table (kneelat: knee, lat), a side only first or last; None if it cannot be."""
    table = dialects()
    known = [w for w in table.words if len(w) >= 2]

    def parts(rest: str) -> list[str] | None:
        if not rest:
            return []
        for word in sorted((w for w in known if rest.startswith(w)), key=len, reverse=True):
            after = parts(rest[len(word) :])
            if after is not None:
                return [word, *after]
        return None

    found = parts(token)
    for side in sorted(table.sides, key=len, reverse=True):
        if found is None and token.startswith(side) and len(token) > len(side) + 2:
            inner = parts(token[len(side) :])
            found = None if inner is None else [side, *inner]
    return found


def _stem(code: str) -> str:
    return code.rstrip("0123456789")


def _other_language(stems: set[str]) -> tuple[str, str, bool] | None:
    """The letters for left and right in a set that has no L and R: G and D, gauche and droite.

    Returns:
        The letters and whether they stand at the end. Only certain where several stems have both, more
        than have L and R.
    """

    def pairs(left: str, right: str, at_end: bool) -> int:
        if at_end:
            return sum(s[-1:] == left and len(s) > 2 and s[:-1] + right in stems for s in stems)
        return sum(s[:1] == left and len(s) > 2 and right + s[1:] in stems for s in stems)

    usual = max(pairs("L", "R", True), pairs("L", "R", False))
    for at_end in (True, False):
        count = pairs("G", "D", at_end)
        if count >= _LEAST_PAIRS and count > usual:
            return "G", "D", at_end
    return None


def _one_each(found: dict[str, NameGuess]) -> dict[str, NameGuess]:
    """Leave each standard marker to one label only: the one with the best name, or the first of equal ones."""
    owner: dict[str, NameGuess] = {}
    certain = {HIGH: 0, LIKELY: 1, UNSURE: 2, OPEN: 3}
    for guess in sorted(found.values(), key=lambda g: (certain[g.confidence], g.rank)):
        if guess.marker:
            owner.setdefault(guess.marker, guess)
    result = {}
    for label, guess in found.items():
        if guess.marker and owner[guess.marker] is not guess:
            taken = f"{guess.reason}; {guess.marker} is {owner[guess.marker].label}"
            guess = replace(guess, marker="", reason=taken)
        result[label] = guess
    return result

"""What the movement says: it confirms or contradicts the names, and places markers whose name says nothing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mocap_skel.figure.skeleton import Skeleton
from mocap_skel.labels.guess.names import HIGH, LIKELY, OPEN, UNSURE, NameGuess
from mocap_skel.labels.guess.rigid import Distances
from mocap_skel.text import listed

# Metres. Skin moves a marker by up to 1 cm against its segment's others; a neighbour segment's markers
# may be as constant, one of farther away is not.
RIGID = 0.010
# A marker on another segment changes its distances by more than so many times as much.
CLEARLY = 2.5
# Metres: less is no evidence for anything, as the whole body hardly moves.
SHOWN = 0.005
# Metres: no camera sees two markers that still, only arithmetic is; a few roundings of millimetres in
# single precision.
EXACT = 3e-7
# Metres: a marker that stands in the file twice is not farther from itself.
APART = 0.05
# Metres: noise alone may make so much of a distance's spread.
STILL = 0.002
# Metres: not even a joint between them lets two markers of neighbours vary so much, only another body does;
# and what tells enough against a name that is not sure by itself.
ABSURD, TOO_MUCH = 0.05, 0.03
# Metres: no two markers of a person's segment are that far apart.
BODY = 1.0
# Markers of two segments are exchanged where each fits the other's place better, by the first on its own
# and by the second on average: a marker beside a joint fits the neighbour too, but two never do crosswise.
EACH, BOTH = 1.05, 2.0
# Share of the clip's frames that show a marker together with its segment's others.
LEAST_SEEN = 0.05
# What the reason of a marker says that its movement has placed.
MOVES = "keeps its distance to"


@dataclass(frozen=True)
class Verdict:
    """What the movement says of one marker.

    Attributes:
        guess: the guess by name, changed if the movement has something to say.
        contradicted: the name is clear, but it moves with another part of the body, or with none.
    """

    guess: NameGuess
    contradicted: bool = False


def weigh(
    guesses: list[NameGuess], found: Distances, skeleton: Skeleton, frames: int
) -> list[Verdict]:
    """Judge the guesses by name for the M markers of one subject by how constant their distances are.

    A marker's misfit to a segment is the median spread of its distances to the segment's placed markers,
    so that a bad one among them does not count. A neighbour segment in the tree proves nothing against a
    clear name: a marker beside the joint keeps its distance to both. Two markers are called exchanged
    only if each fits better with the other's segment.

    Args:
        guesses: by name, one for each marker.
        found: the distances between the markers, in the same order.
        skeleton: which segments are neighbours.
        frames: of the clip.

    Returns:
        One verdict for each marker.
    """
    guesses = _without_computed(_without_doubles(guesses, found), found)
    judge = _Judge(found, skeleton, frames)
    # Only what the names are sure of, where there is that: numbered names may be a second person's.
    judge.seat(guesses, certain=True)
    lost = {i: v for i, g in enumerate(guesses) if (v := judge.lost(i, g))}
    guesses = [lost[i].guess if i in lost else g for i, g in enumerate(guesses)]
    judge.seat(guesses)
    guesses = [g if i in lost else judge.place(i, g) for i, g in enumerate(guesses)]
    judge.seat(guesses)
    verdicts = [lost.get(i) or judge.confirm(i, g) for i, g in enumerate(guesses)]
    for i, j in judge.exchanged(guesses):
        for k, other in ((i, j), (j, i)):
            reason = f"{guesses[k].reason}, but it and {guesses[other].label} look exchanged"
            verdicts[k] = Verdict(replace(guesses[k], confidence=UNSURE, reason=reason), True)
    return verdicts


class _Judge:
    """The distances between markers, and which markers are placed on which segment so far."""

    def __init__(self, found: Distances, skeleton: Skeleton, frames: int) -> None:
        seen = found.count >= max(LEAST_SEEN * frames, 1)
        self.spread = np.where(seen, found.spread, np.nan)
        self.mean = np.where(seen, found.mean, np.nan)
        self.near = {
            s.name: {s.name, s.parent or s.name}
            | {c.name for c in skeleton.segments if c.parent == s.name}
            for s in skeleton.segments
        }
        self.order = [s.name for s in skeleton.segments]
        self.members: dict[str, list[int]] = {}
        self.usual: dict[str, float] = {}

    def seat(self, guesses: list[NameGuess], *, certain: bool = False) -> None:
        """Compare from now on with the markers that are placed in these guesses.

        Args:
            guesses: of all labels.
            certain: of a segment with names of high confidence, take these only.
        """
        self.members = {}
        placed = [
            (i, g) for i, g in enumerate(guesses) if g.segment and g.confidence in (HIGH, LIKELY)
        ]
        sure = {g.segment for _, g in placed if g.confidence == HIGH} if certain else set()
        for i, guess in placed:
            if guess.confidence == HIGH or guess.segment not in sure:
                self.members.setdefault(guess.segment, []).append(i)
        self.usual = {s: self._usual(members) for s, members in self.members.items()}

    def _usual(self, members: list[int]) -> float:
        """How much the distances of one more marker to these may vary; 0, which nothing fits, for a single marker."""
        inside = self.spread[np.ix_(members, members)]
        inside = inside[np.isfinite(inside)]
        return max(CLEARLY * float(np.median(inside)), STILL) if len(inside) else 0.0

    def place(self, i: int, guess: NameGuess) -> NameGuess:
        """Put a marker whose name is not clear on the segment with which it moves, if that is clear."""
        if guess.computed or guess.confidence in (HIGH, LIKELY):
            return guess
        fits = self._worst(i)
        if len(fits) < 2:
            return guess
        (best, segment), (second, other) = fits[0], fits[1]
        if best > RIGID or second <= SHOWN:
            return guess
        if best > self.usual[segment] or second < max(CLEARLY * best, best + SHOWN):
            reason = f"{guess.reason}; moves with {segment} or {other}"
            return replace(guess, reason=reason)
        if guess.segment not in ("", segment):
            return guess
        alone = [s for s in self.order if s in self.near[segment] and s not in self.members]
        if alone and guess.segment != segment:
            reason = f"{guess.reason}; moves with {segment}, but so might {alone[0]}"
            return replace(guess, reason=reason)
        moves = f"{MOVES} {segment} within {1e3 * best:.1f} mm"
        return replace(guess, segment=segment, confidence=LIKELY, reason=f"{guess.reason}; {moves}")

    def lost(self, i: int, guess: NameGuess) -> Verdict | None:
        """The verdict on a placed marker that keeps its distance to no part of the body; None for other markers."""
        if not guess.segment or guess.confidence not in (HIGH, LIKELY):
            return None
        fits = self._misfits(i, 1)
        own = self._own(fits, guess.segment)
        if own is None:
            return None
        limit = ABSURD if guess.confidence == HIGH else TOO_MUCH
        away = self._away(i, guess.segment)
        if away > BODY:
            why = f"but {away:.1f} m away from {guess.segment}'s others"
        elif own > limit and fits[0][0] > limit:
            why = f"but it keeps its distance to nothing ({1e3 * own:.0f} mm)"
        else:
            return None
        if guess.confidence == LIKELY:
            why += "; a second person or an object?"
        reason = f"{guess.reason}, {why}"
        return Verdict(
            replace(guess, confidence=UNSURE, reason=reason, lost=True), guess.confidence == HIGH
        )

    def confirm(self, i: int, guess: NameGuess) -> Verdict:
        """The verdict on a placed marker: whether it moves with its segment."""
        if not guess.segment or guess.confidence not in (HIGH, LIKELY):
            return Verdict(guess)
        if lost := self.lost(i, guess):
            return lost
        fits = self._misfits(i, 1)
        own = self._own(fits, guess.segment)
        alone = guess.segment not in {s for _, s in fits}
        least = 1 if alone else 2
        counted = self._misfits(i, least)
        far = next(((m, s) for m, s in counted if s not in self.near[guess.segment]), None)
        if own is None or far is None:
            return Verdict(guess)
        # A joint lies between a lonely marker and its neighbours.
        rigid = TOO_MUCH if alone else RIGID
        if own > max(rigid, CLEARLY * far[0]) and far[0] < rigid:
            reason = (
                f"{guess.reason}, but it moves with {far[1]} "
                f"({1e3 * far[0]:.0f} mm against {1e3 * own:.0f} mm)"
            )
            return Verdict(replace(guess, confidence=UNSURE, reason=reason), True)
        if alone:
            return Verdict(guess)
        best, segment = fits[0]
        if own > max(CLEARLY * best, STILL):
            reason = f"{guess.reason}, but it moves rather with {segment}"
            doubtful = guess.confidence == LIKELY or guess.segment in {s for _, s in counted}
            if doubtful and best < RIGID < own and own > 2 * CLEARLY * best:
                # With two others to tell: not even a marker beside the joint fits the neighbour so much better.
                return Verdict(
                    replace(guess, confidence=UNSURE, reason=reason), guess.confidence == HIGH
                )
            return Verdict(replace(guess, confidence=LIKELY, reason=reason))
        if MOVES in guess.reason:
            return Verdict(guess)
        if own < RIGID and own <= CLEARLY * best and far[0] > max(CLEARLY * own, SHOWN):
            reason = f"{guess.reason}; moves with it ({1e3 * own:.1f} mm)"
            return Verdict(replace(guess, confidence=HIGH, reason=reason))
        return Verdict(guess)

    def exchanged(self, guesses: list[NameGuess]) -> list[tuple[int, int]]:
        """Find pairs of placed markers that each fit better with the other's segment, the clearest pair first.

        Each marker is in one pair at most; a pair's markers do not count for each other.
        """
        placed = {k: s for s, members in self.members.items() for k in members}
        better: dict[int, set[str]] = {}
        own: dict[int, float] = {}
        for i, segment in placed.items():
            middle = self._middle(i, segment)
            if guesses[i].confidence in (HIGH, LIKELY) and middle > STILL:
                own[i] = middle
                better[i] = {
                    s for m, s in self._misfits(i, 1) if s != segment and m * EACH < middle
                }
        found = []
        for i, first in own.items():
            for j, second in own.items():
                if i >= j or placed[j] not in better[i] or placed[i] not in better[j]:
                    continue
                there = self._middle(i, placed[j], j)
                back = self._middle(j, placed[i], i)
                # What is left of two noises is no evidence.
                there, back = max(there, EXACT), max(back, EXACT)
                if max(there, back) > RIGID:
                    continue
                one, other = first / there, second / back
                if min(one, other) > EACH and one * other > BOTH**2:
                    found.append((one * other, i, j))
        pairs: list[tuple[int, int]] = []
        taken: set[int] = set()
        for _, i, j in sorted(found, reverse=True):
            if not {i, j} & taken:
                pairs.append((i, j))
                taken |= {i, j}
        return pairs

    def _middle(self, i: int, segment: str, without: int = -1) -> float:
        """The median spread of a marker's distances to a segment's other markers; NaN if there are none."""
        spreads = self.spread[i, [k for k in self.members[segment] if k not in (i, without)]]
        spreads = spreads[np.isfinite(spreads)]
        return float(np.median(spreads)) if len(spreads) else np.nan

    def _own(self, fits: list[tuple[float, str]], segment: str) -> float | None:
        """A marker's misfit to its own segment; if it is alone there, to the neighbour that fits best."""
        own = next((m for m, s in fits if s == segment), None)
        return (
            own if own is not None else next((m for m, s in fits if s in self.near[segment]), None)
        )

    def _away(self, i: int, segment: str) -> float:
        """Metres from a marker to the others of its segment, or of a neighbour if they are nearer; 0 for none."""
        found = []
        for name in self.near[segment]:
            means = self.mean[i, [k for k in self.members.get(name, []) if k != i]]
            means = np.sort(means[np.isfinite(means)])
            found += [float(means[(len(means) - 1) // 2])] if len(means) else []
        return min(found, default=0.0)

    def _worst(self, i: int) -> list[tuple[float, str]]:
        """(largest spread of its distances, segment), the best first."""
        fits = []
        for segment, members in self.members.items():
            spreads = self.spread[i, [k for k in members if k != i]]
            if np.isfinite(spreads).any():
                fits.append((float(np.nanmax(spreads)), segment))
        return sorted(fits)

    def _misfits(self, i: int, least: int) -> list[tuple[float, str]]:
        """(misfit, segment), the best first, of segments with at least so many other markers."""
        fits = []
        for segment, members in self.members.items():
            spreads = self.spread[i, [k for k in members if k != i]]
            spreads = np.sort(spreads[np.isfinite(spreads)])
            if len(spreads) >= least:
                fits.append((float(spreads[(len(spreads) - 1) // 2]), segment))
        return sorted(fits)


def _without_doubles(guesses: list[NameGuess], found: Distances) -> list[NameGuess]:
    """Make guesses unsure whose label is another's copy, if both are seen at once in different places."""
    at = {guess.label: i for i, guess in enumerate(guesses)}

    def sure(i: int, guess: NameGuess) -> NameGuess:
        j = at.get(guess.double_of)
        if j is None or not guess.segment or not found.mean[i, j] > APART:
            return guess
        reason = (
            f"{guess.reason}, but {100 * found.mean[i, j]:.0f} cm away from it at the same time"
        )
        return replace(guess, confidence=UNSURE, reason=reason)

    return [sure(i, guess) for i, guess in enumerate(guesses)]


def _without_computed(guesses: list[NameGuess], found: Distances) -> list[NameGuess]:
    """Find the points that a model computed: they keep a distance exactly.

    Not where most markers do, as in a generated clip without noise.
    """
    exact = found.spread < EXACT
    named = [i for i, g in enumerate(guesses) if g.confidence == HIGH]
    if not named or exact[named].any(axis=1).mean() > 0.5:
        return guesses
    return list(_exact(guesses, exact))


def _exact(guesses: list[NameGuess], exact: NDArray[np.bool_]) -> Iterator[NameGuess]:
    for guess, row in zip(guesses, exact, strict=True):
        if guess.confidence == HIGH or guess.computed or not row.any():
            yield guess
            continue
        others = listed((g.label for g, e in zip(guesses, row, strict=True) if e), 3)
        reason = f"a computed point: its distance to {others} never changes"
        yield NameGuess(guess.label, "", "", OPEN, reason, computed=True)

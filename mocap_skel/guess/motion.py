"""What the motion says: it confirms or contradicts the names, and places markers whose name says nothing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mocap_skel.guess.names import HIGH, LIKELY, OPEN, UNSURE, NameGuess
from mocap_skel.guess.rigid import Distances
from mocap_skel.skeleton import Skeleton
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
# Share of the clip's frames that show a marker together with its segment's others.
LEAST_SEEN = 0.05


@dataclass(frozen=True)
class Verdict:
    """What motion says of one marker.

    Attributes:
        guess: the name's guess, changed where motion has something to say.
        contradicted: a confident name that moves with another part of the body.
    """

    guess: NameGuess
    contradicted: bool = False


def weigh(
    guesses: list[NameGuess], found: Distances, skeleton: Skeleton, frames: int
) -> list[Verdict]:
    """The names' guesses for M markers of one subject, judged by their distances.

    A marker's misfit to a segment is the middle of the spreads of its distances to the segment's placed
    markers. A neighbour segment in the tree proves nothing against a confident name: a marker beside
    the joint keeps its distance to both.
    """
    guesses = _without_computed(_without_doubles(guesses, found), found)
    judge = _Judge(found, skeleton, frames)
    judge.seat(guesses)
    guesses = [judge.place(i, g) for i, g in enumerate(guesses)]
    judge.seat(guesses)
    return [judge.confirm(i, g) for i, g in enumerate(guesses)]


class _Judge:
    def __init__(self, found: Distances, skeleton: Skeleton, frames: int) -> None:
        seen = found.count >= max(LEAST_SEEN * frames, 1)
        self.spread = np.where(seen, found.spread, np.nan)
        self.near = {
            s.name: {s.name, s.parent or s.name}
            | {c.name for c in skeleton.segments if c.parent == s.name}
            for s in skeleton.segments
        }
        self.order = [s.name for s in skeleton.segments]
        self.members: dict[str, list[int]] = {}
        self.usual: dict[str, float] = {}

    def seat(self, guesses: list[NameGuess]) -> None:
        """Take the markers that are placed so far as what the others are measured against."""
        self.members = {}
        for i, guess in enumerate(guesses):
            if guess.segment and guess.confidence in (HIGH, LIKELY):
                self.members.setdefault(guess.segment, []).append(i)
        self.usual = {s: self._usual(members) for s, members in self.members.items()}

    def _usual(self, members: list[int]) -> float:
        """The spread to a segment's markers that one more may have; nothing fits a single marker."""
        inside = self.spread[np.ix_(members, members)]
        inside = inside[np.isfinite(inside)]
        return max(CLEARLY * float(np.median(inside)), STILL) if len(inside) else 0.0

    def place(self, i: int, guess: NameGuess) -> NameGuess:
        """A marker whose name leaves it open, on the segment that it moves with."""
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
        moves = f"keeps its distance to {segment} within {1e3 * best:.1f} mm"
        return replace(guess, segment=segment, confidence=LIKELY, reason=f"{guess.reason}; {moves}")

    def confirm(self, i: int, guess: NameGuess) -> Verdict:
        """A placed marker, and whether it moves with its segment."""
        if not guess.segment or guess.confidence not in (HIGH, LIKELY):
            return Verdict(guess)
        own = next((m for m, s in self._misfits(i, 1) if s == guess.segment), None)
        fits = self._misfits(i, 2)
        far = next(((m, s) for m, s in fits if s not in self.near[guess.segment]), None)
        if own is None or far is None:
            return Verdict(guess)
        if own > max(RIGID, CLEARLY * far[0]) and far[0] < RIGID:
            reason = (
                f"{guess.reason}, but it moves with {far[1]} "
                f"({1e3 * far[0]:.0f} mm against {1e3 * own:.0f} mm)"
            )
            return Verdict(replace(guess, confidence=UNSURE, reason=reason), True)
        best, segment = fits[0]
        if guess.confidence == LIKELY and segment != guess.segment:
            if best < RIGID < own and own > 2 * CLEARLY * best:
                reason = f"{guess.reason}, but it moves rather with {segment}"
                return Verdict(replace(guess, confidence=UNSURE, reason=reason))
        elif "keeps its distance" in guess.reason:
            return Verdict(guess)
        elif own < RIGID and far[0] > max(CLEARLY * own, SHOWN):
            reason = f"{guess.reason}; moves with it ({1e3 * own:.1f} mm)"
            return Verdict(replace(guess, confidence=HIGH, reason=reason))
        return Verdict(guess)

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
    """The guesses without doubles that are seen beside what they double: another body's marker."""
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
    """The guesses with points that a model computed found out: they keep a distance exactly.

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

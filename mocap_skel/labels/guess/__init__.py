"""Guess which label of a clip is which marker: by the labels first, then by the movement."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mocap_skel.clip import Clip
from mocap_skel.errors import CallError
from mocap_skel.figure.skeleton import STANDARD, Skeleton, shipped_skeletons
from mocap_skel.labels.association import Association, Rule, check_subject
from mocap_skel.labels.guess.dialects import dialects
from mocap_skel.labels.guess.motion import MOVES, Verdict, weigh
from mocap_skel.labels.guess.names import (
    HIGH,
    LIKELY,
    OPEN,
    UNSURE,
    NameGuess,
    guess_names,
    meanings,
)
from mocap_skel.labels.guess.rigid import distances
from mocap_skel.text import counted, listed

# A root's pose needs so many markers.
LEAST_ON_ROOT = 3
# Markers of so many segments that move with no part of the body are a second body's.
SECOND_BODY = 3

_GUESS = ("mocap-skel", "assoc", "guess")

__all__ = ["Guess", "Line", "check_sure", "guess_association", "in_words", "repeated"]


@dataclass(frozen=True)
class Line:
    """The guess for one label.

    Attributes:
        label: without the subject.
        marker: the standard marker, the landmark, or a name of its own; "" where nothing is guessed.
        segment: "" where nothing is guessed.
        standard: whether `marker` is one of the skeleton's.
        confidence: "high", "likely", "unsure" (not to be used unasked) or "open".
        reason: in plain words.
        contradicted: the name is clear, but it moves with another part of the body, or with none.
        lost: it moves with no part of the body.
        computed: it is no marker, but a point that a model computed.
        seen: whether the clip has a sample of it.
    """

    label: str
    marker: str
    segment: str
    standard: bool
    confidence: str
    reason: str
    contradicted: bool = False
    lost: bool = False
    computed: bool = False
    seen: bool = True

    @property
    def used(self) -> bool:
        return self.confidence in (HIGH, LIKELY)


@dataclass(frozen=True)
class Guess:
    """The guess for all labels of a clip.

    Attributes:
        clip: the clip's name.
        skeleton: the standard human, or the shipped part of it that the clip shows.
        lines: one for each label, in the skeleton's order and then the clip's.
    """

    clip: str
    skeleton: Skeleton
    lines: tuple[Line, ...]

    @property
    def used(self) -> tuple[Line, ...]:
        """The lines that are sure enough to be used."""
        return tuple(line for line in self.lines if line.used)

    def association(self) -> Association:
        """The lines that are sure enough to be used, as an association that was read from a file."""
        rules = (Rule(x.label, x.marker, x.segment, i) for i, x in enumerate(self.used, 1))
        rest = tuple(_escaped(line.label) for line in self.lines if not line.used)
        return Association("the guess", self.skeleton, tuple(rules), rest)


def guess_association(clip: Clip, subject: str | None = None, how: Sequence[str] = ()) -> Guess:
    """Guess which label is which marker of the standard human.

    Args:
        clip: the recording.
        subject: look at this one only. Without it, a label that several subjects have gets one line, and
            their movements have to agree.
        how: options that the clip was read with, for the commands that hints name.

    Raises:
        CallError: no label says which marker it is; or there is no such subject.

    >>> from mocap_skel import read_clip
    >>> guess = guess_association(read_clip("sample_data/range_of_motion.c3d"))
    >>> guess.lines[0].label, guess.lines[0].marker, guess.lines[0].confidence
    ('RFWT', 'RFWT', 'high')
    """
    check_subject(clip, subject)
    skeleton = shipped_skeletons()[STANDARD]
    subjects = [name for name in clip.subject_names if subject in (None, name)]
    columns = {
        name: [i for i, whose in enumerate(clip.subjects) if whose == name] for name in subjects
    }
    labels = [clip.labels[i] for own in columns.values() for i in own]
    named = guess_names(labels, skeleton.segment_of.items())
    verdicts: dict[str, list[Verdict]] = {label: [] for label in named}
    for own in columns.values():
        guesses = [named[clip.labels[i]] for i in own]
        found = distances(clip.points[:, own])
        for i, verdict in zip(own, weigh(guesses, found, skeleton, clip.frames), strict=True):
            verdicts[clip.labels[i]].append(verdict)
    there = np.flatnonzero(np.isfinite(clip.points[..., 0]).any(axis=0))
    seen = {clip.labels[i] for i in there}
    agreed = [_agreed(found) for found in verdicts.values()]
    placed = Counter(
        v.guess.segment
        for v in agreed
        if v.guess.confidence in (HIGH, LIKELY) and v.guess.label in seen
    )
    skeleton = _figure(placed, skeleton)
    lines = [replace(x, seen=x.label in seen) for x in _lines(agreed, skeleton)]
    if not any(line.used for line in lines):
        raise CallError(
            f"{clip.name}: no label says which marker it is: {listed(labels)}",
            f"{shlex.join([*_GUESS, clip.name, '--by-motion', *how, '-o', 'figure'])} finds a figure "
            "without names",
        )
    return Guess(clip.name, skeleton, tuple(lines))


def repeated(
    subject: str | None, unit: str | None, rate: float | None, *, salvage: bool
) -> list[str]:
    """The options of a call that a command in a hint has to repeat.

    >>> repeated("Ben", None, 120.0, salvage=True)
    ['--salvage', '--subject', 'Ben', '--rate', '120.0']
    """
    words = ["--salvage"] if salvage else []
    for option, value in (("--subject", subject), ("--unit", unit), ("--rate", rate)):
        words += [] if value is None else [option, str(value)]
    return words


def check_sure(guess: Guess, how: Sequence[str] = ()) -> None:
    """Raise an error if a guess is not sure enough for a fit.

    It is sure enough if the root has three placed markers, if no clear name moves with another part of
    the body, and if at least half of the labels that may be markers are placed. Markers that the clip
    never shows do not count.

    Args:
        guess: from `guess_association`.
        how: options that the clip was read with, for the command that the hint names.

    Raises:
        CallError: it is not sure enough; says why, and which command writes the file to correct.

    >>> from mocap_skel import read_clip
    >>> check_sure(guess_association(read_clip("sample_data/range_of_motion.c3d")))
    """
    hint = (
        f"{shlex.join([*_GUESS, guess.clip, *how, '-o', 'assoc.txt'])} writes it; correct it, then "
        "--assoc it"
    )
    against = [line.label for line in guess.lines if line.contradicted]
    root = guess.skeleton.root.name
    placed = [line for line in guess.used if line.seen]
    on_root = [line for line in placed if line.segment == root]
    may_be = [line for line in guess.lines if line.seen and not line.computed]
    trouble = ""
    if against:
        trouble = f"names and motion contradict each other: {listed(against)}"
        if len({line.segment for line in guess.lines if line.lost}) >= SECOND_BODY:
            trouble += "; is it a second person under the same labels?"
    elif len(on_root) < LEAST_ON_ROOT:
        found = listed(x.label for x in on_root) or "none"
        trouble = f"{root} needs three markers, and only {found} could be placed there"
    elif 2 * len(placed) < len(may_be):
        trouble = f"only {len(placed)} of {counted(len(may_be), 'label')} could be placed"
    if trouble:
        raise CallError(
            f"{guess.clip}: which label is which marker? The guess is not sure: {trouble}", hint
        )


def in_words(guess: Guess) -> str:
    """The guess in one sentence.

    >>> from mocap_skel import read_clip
    >>> in_words(guess_association(read_clip("sample_data/range_of_motion.c3d")))
    '41 of 41 labels placed (41 high, 0 likely)'
    """
    counts = Counter(line.confidence for line in guess.lines)
    said = (
        f"{len(guess.used)} of {counted(len(guess.lines), 'label')} placed"
        f" ({counts[HIGH]} high, {counts[LIKELY]} likely)"
    )
    unsure = [line.label for line in guess.lines if line.confidence == UNSURE]
    if unsure:
        said += f"; unsure and left out: {listed(unsure, 20)}"
    if len({line.segment for line in guess.lines if line.lost}) >= SECOND_BODY:
        said += "; that looks like a second person under the same labels"
    rest = [x.label for x in guess.lines if x.confidence == OPEN and not x.computed]
    if rest:
        said += f"; not placed: {listed(rest)}"
    computed = sum(x.computed for x in guess.lines)
    if computed:
        said += f"; computed points, no markers: {computed}"
    return said


def _figure(placed: Counter[str], human: Skeleton) -> Skeleton:
    """The standard human, or the smallest shipped part of it if the clip does not show the human's root.

    Args:
        placed: how many markers each segment has that the clip shows.
        human: the standard human.
    """
    if placed[human.root.name] >= LEAST_ON_ROOT:
        return human
    names = {s.name for s in human.segments}
    parts = []
    for name, part in shipped_skeletons().items():
        own = {s.name for s in part.segments}
        if set(placed) <= own <= names and placed[part.root.name] >= LEAST_ON_ROOT:
            parts.append((len(own), name, part))
    if not parts:
        return human
    _, name, part = min(parts, key=lambda p: p[:2])
    return replace(part, name=name)


def _agreed(verdicts: list[Verdict]) -> Verdict:
    """One verdict for a label that several subjects have."""
    order = {HIGH: 0, LIKELY: 1, UNSURE: 2, OPEN: 3}
    bad = next((v for v in verdicts if v.contradicted), None)
    if bad is not None or len({v.guess.segment for v in verdicts}) == 1:
        return bad or max(verdicts, key=lambda v: order[v.guess.confidence])
    first = verdicts[0].guess
    reason = f"{first.reason}; motion does not agree in all subjects"
    return Verdict(NameGuess(first.label, "", "", OPEN, reason))


def _lines(verdicts: list[Verdict], skeleton: Skeleton) -> list[Line]:
    """One line for each label, with a marker's name that no other has."""
    standard = skeleton.segment_of
    known = {**dialects().landmarks, **standard}
    taken = {v.guess.marker for v in verdicts if v.guess.marker}
    rank = {s.name: i for i, s in enumerate(skeleton.segments)}
    lines = []
    for verdict in verdicts:
        guess = verdict.guess
        # A segment by motion alone has no standard place on it, unless the name can be one there.
        has = bool(guess.marker) and known.get(guess.marker) == guess.segment
        name = guess.marker if has else ""
        if not name and guess.confidence == LIKELY and MOVES in guess.reason:
            there = (m for s, m in meanings(guess.label) if s == guess.segment and m not in taken)
            name = next(there, "")
            taken.add(name)
        if guess.segment and not name:
            name = guess.label
            while name in taken or name in known:
                name += "_own"
            taken.add(name)
        confidence, reason = guess.confidence, guess.reason
        if '"' in guess.label:
            name, confidence = "", OPEN
            guess = replace(guess, segment="")
            reason += "; a label with a quote cannot stand in a file"
        lines.append(
            Line(
                guess.label, name, guess.segment, name in standard, confidence, reason,
                verdict.contradicted, guess.lost, guess.computed,
            )
        )  # fmt: skip
    markers = {m: i for i, m in enumerate(standard)}
    return sorted(
        lines,
        key=lambda x: (rank.get(x.segment, len(rank)), markers.get(x.marker, len(markers))),
    )


def _escaped(label: str) -> str:
    """A label as a shell pattern that matches it alone."""
    return "".join(f"[{c}]" if c in "*?[" else c for c in label)

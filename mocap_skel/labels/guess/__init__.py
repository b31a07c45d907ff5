"""Guess which label of a clip is which marker: by the labels first, then by the movement."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mocap_skel.clip import Clip
from mocap_skel.errors import CallError
from mocap_skel.figure.skeleton import LEAST_ON_ROOT, STANDARD, Skeleton, shipped_skeletons
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
from mocap_skel.labels.guess.part import begun, figures
from mocap_skel.labels.guess.pelvis import with_pelvis
from mocap_skel.labels.guess.rigid import MOST, distances, most_seen
from mocap_skel.labels.guess.running import crowd, nameless
from mocap_skel.text import counted, listed

GUESSED = "the guess"
"""What the association of a guess says in place of a file's path."""
# Markers of so many segments that move with no part of the body are a second body's.
SECOND_BODY = 3
# Share of the labels that may contradict the movement while the others are still worth a fit.
FEW = 0.2

_GUESS = ("mocap-skel", "assoc", "guess")

__all__ = ["Guess", "Line", "check_sure", "doubts", "guess_association", "in_words", "repeated"]


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
        elsewhere: it is placed, on a segment that no figure of the guess has.
        aside: a stem and a running number beside a complete set: a trajectory that nobody has named.
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
    elsewhere: bool = False
    aside: bool = False

    @property
    def used(self) -> bool:
        return self.sure and not self.elsewhere

    @property
    def sure(self) -> bool:
        return self.confidence in (HIGH, LIKELY)


@dataclass(frozen=True)
class Guess:
    """The guess for all labels of a clip.

    Attributes:
        clip: the clip's name.
        skeleton: the standard human, or the shipped part of it that the clip shows.
        lines: one for each label, in the skeleton's order and then the clip's.
        parts: other shipped parts of the human that the clip shows too, where it does not show its root.
    """

    clip: str
    skeleton: Skeleton
    lines: tuple[Line, ...]
    parts: tuple[Skeleton, ...] = ()

    @property
    def used(self) -> tuple[Line, ...]:
        """The lines that are sure enough to be used, for the figure and the other parts."""
        return tuple(line for line in self.lines if line.used)

    @property
    def may_be(self) -> int:
        """How many labels may be markers of the figure: seen, not computed, not without a name."""
        return sum(x.seen and not (x.computed or x.aside or x.elsewhere) for x in self.lines)

    def association(self) -> Association:
        """The lines of the figure that are sure enough to be used, as an association that was read from a file."""
        return self.associations()[0]

    def associations(self) -> tuple[Association, ...]:
        """One association for the figure, and one for each other part."""
        found = []
        for figure in (self.skeleton, *self.parts):
            own = {segment.name for segment in figure.segments}
            used = [line for line in self.used if line.segment in own]
            rules = (Rule(x.label, x.marker, x.segment, i) for i, x in enumerate(used, 1))
            taken = {line.label for line in used}
            rest = tuple(_escaped(x.label) for x in self.lines if x.label not in taken)
            found.append(Association(GUESSED, figure, tuple(rules), rest, figure.name))
        return tuple(found)


def guess_association(
    clip: Clip,
    subject: str | None = None,
    how: Sequence[str] = (),
    figure: Skeleton | None = None,
) -> Guess:
    """Guess which label is which marker of the standard human, or of a part of it.

    Args:
        clip: the recording.
        subject: look at this one only. Without it, a label that several subjects have gets one line, and
            their movements have to agree.
        how: options that the clip was read with, for the commands that hints name.
        figure: a part of the human, or another figure whose markers' names the labels are; None = the
            human, or the parts of it that the clip shows.

    Raises:
        CallError: no label says which marker it is; or there is no such subject.

    >>> from mocap_skel import read_clip
    >>> guess = guess_association(read_clip("sample_data/range_of_motion.c3d"))
    >>> guess.lines[0].label, guess.lines[0].marker, guess.lines[0].confidence
    ('RFWT', 'RFWT', 'high')
    """
    check_subject(clip, subject)
    human = shipped_skeletons()[STANDARD]
    subjects = [name for name in clip.subject_names if subject in (None, name)]
    columns = {
        name: [i for i, whose in enumerate(clip.subjects) if whose == name] for name in subjects
    }
    labels = [clip.labels[i] for own in columns.values() for i in own]
    named = _named(labels, human)
    tree = human
    if figure is not None:
        named = {label: _own_name(guess, figure) for label, guess in named.items()}
        there_are = {s.name for s in figure.segments}
        if not there_are <= {s.name for s in human.segments}:
            tree = figure
            named = {x: g if g.segment in there_are else _no_name(g) for x, g in named.items()}
    verdicts: dict[str, list[Verdict]] = {label: [] for label in named}
    for own in columns.values():
        own = _compared(clip, own, named, verdicts)
        guesses = [named[clip.labels[i]] for i in own]
        found = distances(clip.points[:, own])
        judged = weigh(guesses, found, tree, clip.frames)
        if tree is human:
            judged = with_pelvis(judged, found, clip.points[:, own])
        for i, verdict in zip(own, judged, strict=True):
            verdicts[clip.labels[i]].append(verdict)
    there = np.flatnonzero(np.isfinite(clip.points[..., 0]).any(axis=0))
    seen = {clip.labels[i] for i in there}
    agreed = [_agreed(found) for found in verdicts.values()]
    placed = Counter(
        v.guess.segment
        for v in agreed
        if v.guess.confidence in (HIGH, LIKELY) and v.guess.label in seen
    )
    skeleton, *parts = figures(placed, human) if figure is None else (figure,)
    lines = [replace(x, seen=x.label in seen) for x in _lines(agreed, (skeleton, *parts))]
    lines = _without_nameless(lines)
    if not any(line.used for line in lines):
        what = f"{clip.name}: no label says which marker"
        what += " it is" if figure is None else f" of {figure.name!r} it is"
        raise CallError(
            f"{what}: {listed(labels)}",
            f"{shlex.join([*_GUESS, clip.name, '--by-motion', *how, '-o', 'figure'])} finds a figure "
            "without names",
        )
    return Guess(clip.name, skeleton, tuple(lines), tuple(parts))


def _compared(
    clip: Clip, own: list[int], named: dict[str, NameGuess], verdicts: dict[str, list[Verdict]]
) -> list[int]:
    """The columns of a subject whose movement is compared, not too many; the others get their verdict here."""
    if len(own) <= MOST:
        return own
    guesses = [named[clip.labels[i]] for i in own]
    first = np.array([bool(guess.segment) for guess in guesses])
    taken = set(most_seen(clip.points[:, own], first).tolist())
    reason = (
        f"one of more than {MOST} labels, and seen for a shorter time than others: not compared"
    )
    for k, guess in enumerate(guesses):
        if k not in taken:
            verdicts[guess.label].append(Verdict(NameGuess(guess.label, "", "", OPEN, reason)))
    return [i for k, i in enumerate(own) if k in taken]


def repeated(
    subject: str | None,
    unit: str | None,
    rate: float | None,
    *,
    salvage: bool,
    mirror: str | None = None,
    clip_up: str | None = None,
) -> list[str]:
    """The options of a call that a command in a hint has to repeat.

    >>> repeated("Ben", None, 120.0, salvage=True)
    ['--salvage', '--subject', 'Ben', '--rate', '120.0']
    """
    words = ["--salvage"] if salvage else []
    for option, value in (
        ("--subject", subject), ("--unit", unit), ("--rate", rate),
        ("--mirror", mirror), ("--clip-up", clip_up),
    ):  # fmt: skip
        words += [] if value is None else [option, str(value)]
    return words


def check_sure(guess: Guess, how: Sequence[str] = (), *, strict: bool = True) -> None:
    """Raise an error if a guess is not sure enough for a fit.

    It is sure enough if the root has three placed markers, if no clear name moves with another part of
    the body, and if at least half of the labels that may be markers are placed. Markers that the clip
    never shows do not count, nor do trajectories that nobody has named.

    Args:
        guess: from `guess_association`.
        how: options that the clip was read with, for the command that the hint names.
        strict: not even a few clear names may move with another part of the body; otherwise the others are
            enough.

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
    second_body = len({line.segment for line in guess.lines if line.lost}) >= SECOND_BODY
    trouble = ""
    if against and (strict or second_body or len(against) > FEW * guess.may_be):
        trouble = f"names and motion contradict each other: {listed(against)}"
        if second_body:
            trouble += "; is it a second person under the same labels?"
    elif len(on_root) < LEAST_ON_ROOT:
        found = f"only {listed(x.label for x in on_root)}" if on_root else "none"
        trouble = f"{root} needs three markers, and {found} could be placed there"
        if on_root:
            trouble += _one_more(guess.skeleton.root.markers, on_root)
        counts = Counter(line.segment for line in placed)
        part = begun(counts, guess.skeleton)
        if part is not None and part.root.name != root:
            first = part.root.name
            there = [x for x in placed if x.segment == first]
            trouble += f"; {part.name} starts at {first}, where only "
            trouble += f"{listed(x.label for x in there)} could be placed"
            trouble += _one_more(part.root.markers, there)
    elif 2 * len(placed) < guess.may_be:
        trouble = f"only {len(placed)} of {counted(guess.may_be, 'label')} could be placed"
    if trouble:
        raise CallError(
            f"{guess.clip}: which label is which marker? The guess is not sure: {trouble}", hint
        )


def _one_more(markers: Sequence[str], there: Sequence[Line]) -> str:
    """What a root lacks that has a marker or two of three, in words."""
    lacks = {1: "two more", 2: "one more"}[len(there)]
    others = [name for name in markers if name not in {line.marker for line in there}]
    return f" ({lacks} of it would do, such as {listed(others, 4)})"


def doubts(guess: Guess) -> str:
    """The labels whose clear name contradicts the movement, each with the reason; "" for none.

    >>> from mocap_skel import read_clip
    >>> doubts(guess_association(read_clip("sample_data/range_of_motion.c3d")))
    ''
    """
    against = [f"{x.label} ({x.reason})" for x in guess.lines if x.contradicted]
    return f"; names and motion contradict each other: {listed(against, 20)}" if against else ""


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
    if guess.skeleton.name != STANDARD:
        names = " and ".join(figure.name for figure in (guess.skeleton, *guess.parts))
        said += f"; of the figure {names}"
    unsure = [line.label for line in guess.lines if line.confidence == UNSURE]
    if unsure:
        said += f"; unsure and left out: {listed(unsure, 20)}"
    if len({line.segment for line in guess.lines if line.lost}) >= SECOND_BODY:
        said += "; that looks like a second person under the same labels"
    rest = [x.label for x in guess.lines if x.confidence == OPEN and not (x.computed or x.aside)]
    if rest:
        said += f"; not placed: {listed(rest)}"
    if beyond := [x.label for x in guess.lines if x.sure and x.elsewhere]:
        said += f"; on no segment of the figure: {listed(beyond)}"
    if aside := [line.label for line in guess.lines if line.aside]:
        many = counted(len(aside), "unlabelled trajectory is", "unlabelled trajectories are")
        said += f"; {many} set aside: {listed(aside)}"
    computed = sum(x.computed for x in guess.lines)
    if computed:
        said += f"; computed points, no markers: {computed}"
    return said


def _named(labels: list[str], human: Skeleton) -> dict[str, NameGuess]:
    """What the labels say of themselves, those that are one of a crowd left open."""
    standard = human.segment_of.items()
    named = guess_names(labels, standard)
    known = [x for x, g in named.items() if g.segment and g.confidence in (HIGH, LIKELY)]
    # C7 stays the vertebra beside C1 to C60.
    aside = crowd(named, known) - human.segment_of.keys()
    if not aside:
        return named
    rest = guess_names([label for label in labels if label not in aside], standard)
    reason = f"one of {len(aside)} running numbers"
    return {x: rest.get(x) or NameGuess(x, "", "", OPEN, reason) for x in named}


def _own_name(guess: NameGuess, figure: Skeleton) -> NameGuess:
    """The guess for a label, by a figure that has a marker of that name where the name says less."""
    segment = figure.segment_of.get(guess.label)
    placed = guess.segment in {s.name for s in figure.segments}
    if segment is None or (placed and (guess.marker or guess.segment != segment)):
        return guess
    reason = f"a marker of {figure.name}"
    return NameGuess(guess.label, segment, guess.label, HIGH, reason, 0)


def _no_name(guess: NameGuess) -> NameGuess:
    """The guess for a label whose place on the human is none on another figure."""
    return NameGuess(guess.label, "", "", OPEN, guess.reason, computed=guess.computed)


def _without_nameless(lines: list[Line]) -> list[Line]:
    """The lines, those set aside that are no more than a running number."""
    open_ = {x.label for x in lines if x.confidence == OPEN and not x.computed}
    # A second person's markers have names, each of them, and no number.
    denied = {x.label for x in lines if x.contradicted or x.confidence == UNSURE}
    aside = nameless(open_ | denied, sum(line.used for line in lines))
    return [
        replace(x, aside=True, contradicted=False, lost=False) if x.label in aside else x
        for x in lines
    ]


def _agreed(verdicts: list[Verdict]) -> Verdict:
    """One verdict for a label that several subjects have."""
    order = {HIGH: 0, LIKELY: 1, UNSURE: 2, OPEN: 3}
    bad = next((v for v in verdicts if v.contradicted), None)
    if bad is not None or len({v.guess.segment for v in verdicts}) == 1:
        return bad or max(verdicts, key=lambda v: order[v.guess.confidence])
    first = verdicts[0].guess
    reason = f"{first.reason}; motion does not agree in all subjects"
    return Verdict(NameGuess(first.label, "", "", OPEN, reason))


def _lines(verdicts: list[Verdict], figures: Sequence[Skeleton]) -> list[Line]:
    """One line for each label, with a marker's name that no other has.

    Args:
        verdicts: one for each label.
        figures: the guess's own, then other parts of the human that the clip shows.
    """
    standard = {m: s for figure in reversed(figures) for m, s in figure.segment_of.items()}
    known = {**dialects().landmarks, **standard}
    taken = {v.guess.marker for v in verdicts if v.guess.marker}
    segments = [s.name for figure in figures for s in figure.segments]
    rank = {name: i for i, name in enumerate(segments)}
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
                elsewhere=bool(guess.segment) and guess.segment not in rank,
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

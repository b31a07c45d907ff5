"""What the page of an association starts from: which marker each label is so far, and what is in doubt."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from mocap_skel.clip import Clip
from mocap_skel.errors import CallError
from mocap_skel.figure.skeleton import STANDARD, Skeleton, read_skeleton
from mocap_skel.labels.association import (
    Assignment,
    Association,
    Rule,
    associate,
    check_subject,
)
from mocap_skel.labels.guess import GUESSED, Guess, Line, guess_association, in_words
from mocap_skel.labels.guess.names import LIKELY, UNSURE
from mocap_skel.labels.guess.rigid import distances, rigid_groups
from mocap_skel.results.marker_check import MarkerCheck, check_association
from mocap_skel.text import listed

# Joining markers in groups takes time that grows with the cube of their number: some seconds for so many.
MOST_GROUPED = 400
# The verdicts of `check_association` that are worth a look, the worst first.
_WORST_FIRST = ("swapped", "wrong segment", "loose", "swapped at times", "leaves at times")


@dataclass(frozen=True)
class Placed:
    """What one column of the clip is so far.

    Attributes:
        marker, segment: "" where it is not assigned.
        ignored: left out on purpose.
        offered: the marker and the segment that a guess has for it but does not use; empty for none.
        reason: of the guess, in plain words; "" without one.
    """

    marker: str = ""
    segment: str = ""
    ignored: bool = False
    offered: tuple[str, str] | tuple[()] = ()
    reason: str = ""


@dataclass(frozen=True)
class Doubt:
    """Something to look at.

    Attributes:
        columns: of the clip, the markers that it is about.
        words: what is in doubt and why, in one sentence.
    """

    columns: tuple[int, ...]
    words: str


@dataclass(frozen=True)
class Start:
    """What the page starts from.

    Attributes:
        skeleton: the figure.
        figure: its name for `@skeleton`.
        columns: those that the page shows, of the chosen subject or of all.
        placed: one a column of the clip.
        doubts: the worst first.
        absent: rules of the association file whose labels the clip does not have.
        patterns: shell patterns that the association file ignores.
        said: where it comes from, in one sentence.
    """

    skeleton: Skeleton
    figure: str
    columns: tuple[int, ...]
    placed: tuple[Placed, ...]
    doubts: tuple[Doubt, ...]
    absent: tuple[Rule, ...]
    patterns: tuple[str, ...]
    said: str


def start_from_guess(
    clip: Clip,
    skeleton: str | None = None,
    subject: str | None = None,
    how: Sequence[str] = (),
    guess: Guess | None = None,
) -> Start:
    """What the guess says of each label. Where it knows nothing, no marker is assigned.

    Several parts of a body are on the page as what they are of: the human.

    Args:
        clip: the recording.
        skeleton: a figure in place of the standard human, a name or a file; markers on segments that it does
            not have are not assigned.
        subject: this one only.
        how: options that the clip was read with, for the commands that hints name.
        guess: where it is made already, for this figure and subject.

    Raises:
        CallError: there is no such subject.
        SkeletonError: there is no such skeleton file, or it is wrong.

    >>> from mocap_skel import read_clip
    >>> start = start_from_guess(read_clip("sample_data/range_of_motion.c3d"))
    >>> start.placed[0].marker, start.doubts
    ('LFHD', ())
    """
    check_subject(clip, subject)
    figure = None if skeleton is None else read_skeleton(skeleton)
    try:
        guess = guess or guess_association(clip, subject, how, figure)
    except CallError as error:
        said = error.message.removeprefix(f"{clip.name}: ")
        return _of(clip, figure or read_skeleton(STANDARD), skeleton or STANDARD, subject, {}, said)
    shown = read_skeleton(STANDARD) if guess.parts else guess.skeleton
    name = skeleton or (STANDARD if guess.parts else guess.skeleton.name)
    rules = tuple(rule for part in guess.associations() for rule in part.rules)
    association = Association(GUESSED, shown, rules, ()) if rules else None
    lines = {line.label: line for line in _inside(guess.lines, shown)}
    return _of(clip, shown, name, subject, lines, in_words(guess), association)


def start_from_file(clip: Clip, association: Association, subject: str | None = None) -> Start:
    """What an association file says of each label.

    Args:
        clip: the recording.
        association: the file, from `read_association`.
        subject: this one only.

    Raises:
        CallError: there is no such subject.
        ClipError: no label of the clip is in the file.
    """
    found = associate(clip, association, subject)
    start = _of(
        clip, association.skeleton, association.figure, subject, {}, f"From {Path(association.path).name}",
        association,
    )  # fmt: skip
    everywhere = [rule for rule in association.rules if all(rule in one.absent for one in found)]
    return replace(start, absent=tuple(everywhere), patterns=association.ignored)


def rigid_group_of(clip: Clip, columns: Sequence[int]) -> dict[int, int]:
    """Column → number of the group of markers that move together, for those columns that are seen.

    Empty where there are more than MOST_GROUPED of them.
    """
    seen = clip.missing() < 1.0
    groups: dict[int, int] = {}
    for subject in clip.subject_names:
        own = [c for c in columns if clip.subjects[c] == subject and seen[c]]
        if not 0 < len(own) <= MOST_GROUPED:
            continue
        for group in rigid_groups(distances(clip.points[:, own]).spread):
            number = len(set(groups.values()))
            groups |= {own[i]: number for i in group}
    return groups


def _of(
    clip: Clip, skeleton: Skeleton, figure: str, subject: str | None, lines: dict[str, Line], said: str,
    association: Association | None = None,
) -> Start:  # fmt: skip
    columns = [i for i, whose in enumerate(clip.subjects) if subject in (None, whose)]
    assigned = () if association is None else _assigned(clip, association, subject)
    placed = {
        column: (marker, segment)
        for one in assigned
        for segment, of in one.columns.items()
        for marker, column in of.items()
    }
    dropped = {(one.subject, label) for one in assigned if not lines for label in one.ignored}
    found = []
    for column, (label, whose) in enumerate(zip(clip.labels, clip.subjects, strict=True)):
        marker, segment = placed.get(column, ("", ""))
        line = lines.get(label)
        offered: tuple[str, str] | tuple[()] = ()
        if line is not None and not line.used and line.segment:
            offered = (line.marker, line.segment)
        ignored = (whose, label) in dropped or (line is not None and line.computed)
        found.append(
            Placed(marker, segment, ignored and not segment, offered, line.reason if line else "")
        )
    doubts = [*_of_the_movement(clip, assigned, skeleton), *_of_the_guess(clip, columns, lines)]
    ranked = sorted(doubts, key=lambda d: d[0])
    return Start(
        skeleton, figure, tuple(columns), tuple(found), tuple(d for _, d in ranked), (), (), said
    )


def _assigned(clip: Clip, association: Association, subject: str | None) -> tuple[Assignment, ...]:
    return associate(clip, association, subject) if association.rules else ()


def _inside(lines: Sequence[Line], figure: Skeleton) -> Iterator[Line]:
    """The lines as far as the figure has what they say."""
    segments = {s.name for s in figure.segments}
    for line in lines:
        has = line.segment in segments
        if has and line.standard:
            has = figure.segment_of.get(line.marker, line.segment) == line.segment
        yield (
            line if has else replace(line, marker="", segment="", standard=False, confidence="open")
        )


def _of_the_guess(
    clip: Clip, columns: Sequence[int], lines: dict[str, Line]
) -> Iterator[tuple[float, Doubt]]:
    for label, line in lines.items():
        own = tuple(c for c in columns if clip.labels[c] == label)
        what = f"{line.marker} of {line.segment}"
        if line.computed:
            continue
        if line.contradicted:
            yield 1, Doubt(own, f"{label}: {line.reason}")
        elif line.confidence == UNSURE:
            yield 1.5, Doubt(own, f"{label} may be {what}, but that is not sure: {line.reason}")
        elif not line.used:
            yield 1.7, Doubt(own, f"{label} is not placed: {line.reason}")
        elif line.confidence == LIKELY:
            yield len(_WORST_FIRST), Doubt(own, f"{label} is likely {what}: {line.reason}")


def _of_the_movement(
    clip: Clip, assigned: Sequence[Assignment], skeleton: Skeleton
) -> Iterator[tuple[float, Doubt]]:
    for one in assigned:
        column = {marker: c for of in one.columns.values() for marker, c in of.items()}
        said = set()
        for check in check_association(clip, one, skeleton).markers:
            if check.verdict not in _WORST_FIRST:
                continue
            about = tuple(column[m] for m in sorted({check.marker, check.partner} & column.keys()))
            if check.verdict == "swapped" and about in said:
                continue
            said.add(about)
            yield _WORST_FIRST.index(check.verdict), Doubt(about, _in_words(check))


def _in_words(check: MarkerCheck) -> str:
    """A finding of `check_association` as a sentence."""
    marker = check.marker if check.marker == check.label else f"{check.label} ({check.marker})"
    if check.verdict == "swapped":
        return f"{marker} and {check.partner} look exchanged: each moves with the other's segment"
    if check.verdict == "wrong segment":
        return f"{marker} moves with {check.moves_with}, not with {check.segment}"
    if check.verdict == "loose":
        return f"{marker} moves {1e3 * check.residual:.0f} mm against the others of {check.segment}"
    what = f"{marker} leaves {check.segment}"
    if check.partner:
        what = f"{marker} looks exchanged with {check.partner}"
    return f"{what} in some frames: {listed(map(str, check.frames), 4)}"

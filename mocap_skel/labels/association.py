"""Association files: which label of a clip is which marker of which segment (thesis 5.5.2)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from glob import escape
from pathlib import Path

from mocap_skel.clip import Clip
from mocap_skel.errors import AssociationError, CallError, ClipError, SkeletonError, ours
from mocap_skel.figure.skeleton import STANDARD, Skeleton, read_skeleton
from mocap_skel.labels.landmarks import exchanged, own_names, segment_of_landmark, told_by_place
from mocap_skel.text import counted, listed, nearest, printable, read_text

_PACKAGE = Path(__file__).parents[1]
# Inside the wheel the folder lies in the package, in a checkout beside it.
SHIPPED = next(
    (
        p
        for p in (_PACKAGE / "association_files", _PACKAGE.parent / "association_files")
        if p.exists()
    ),
    _PACKAGE / "association_files",
)


@dataclass(frozen=True)
class Rule:
    """One line of an association file: this label is this marker, and it sits on this segment.

    Attributes:
        label: the label in the clip, with or without its subject.
        marker: the standard name, or a name of its own.
        segment: of the skeleton.
        line: of the file, from 1; 0 where it stands in no file.
    """

    label: str
    marker: str
    segment: str
    line: int


@dataclass(frozen=True)
class Association:
    """An association file that was read, with its skeleton.

    Attributes:
        path: of the file, for messages.
        skeleton: the figure whose markers and segments it names.
        rules: its lines, in their order.
        ignored: shell patterns of the labels that it leaves out on purpose.
        figure: the skeleton as `@skeleton` names it.

    >>> read_association("right_leg").skeleton.joints
    ('RightKnee', 'RightAnkle')
    """

    path: str
    skeleton: Skeleton
    rules: tuple[Rule, ...]
    ignored: tuple[str, ...]
    figure: str = STANDARD


@dataclass(frozen=True)
class Assignment:
    """Which column of a clip is which marker, for one subject.

    Attributes:
        subject: "" where labels have no prefix.
        columns: for each segment, its markers' standard names and their columns in the clip's points,
            in the skeleton's order of markers, so that the clip's own order does not matter.
        absent: rules of the association file whose label the clip does not have.
        unmatched: labels of the clip's subject that the file does not mention.
        ignored: labels that it drops on purpose.
        landmarks: standard markers and landmarks that the subject has under another name → that name.
        by_place: what its markers' places say against their names, one sentence each.
    """

    subject: str
    columns: dict[str, dict[str, int]]
    absent: tuple[Rule, ...]
    unmatched: tuple[str, ...]
    ignored: tuple[str, ...] = ()
    landmarks: Mapping[str, str] = field(default_factory=dict)
    by_place: tuple[str, ...] = ()

    def mismatches(self, association: Association) -> list[str]:
        """Say which labels the clip or the association file does not have, and what places say against names.

        One sentence for all labels that the clip does not have, one for those that the file does not have,
        and one for each two markers that look exchanged.
        """
        notes = []
        if self.absent:
            lines = [f"{r.label}{self._where(r)}" for r in self.absent]
            what = counted(len(lines), "label")
            notes.append(f"{association.path}: {what} not in the clip: {listed(lines)}")
        if self.unmatched:
            what = counted(len(self.unmatched), "label")
            notes.append(f"{what} of the clip not in {association.path}: {listed(self.unmatched)}")
        return [*notes, *self.by_place]

    def _where(self, rule: Rule) -> str:
        said = [f"line {rule.line}"] if rule.line else []
        said += filter(None, [self._offer(rule.label)])
        return f" ({', '.join(said)})" if said else ""

    def _offer(self, label: str) -> str:
        # Half of the labels of a set differ by one letter: only a near miss is worth a word.
        hint = nearest(label, self.unmatched, 0.8)
        return hint or ""


def read_association(source: str | Path, skeleton: str | Path | None = None) -> Association:
    """Read an association file: a path, or the name of a shipped one (``cmu``).

    Args:
        source: the path or the name.
        skeleton: a figure to use in place of the file's ``@skeleton`` or the standard human. It may be a
            part of the file's own figure: markers that it does not have are then ignored.

    Raises:
        AssociationError: there is no such file, or a line is wrong; names file, line and column.
        SkeletonError: there is no such skeleton file, or it is wrong.

    >>> cmu = read_association("cmu")
    >>> cmu.skeleton.name, len(cmu.rules)
    ('human', 41)
    >>> cmu.rules[0]
    Rule(label='RFHD', marker='RFHD', segment='Head', line=5)
    """
    path = find_association(source)
    with ours(path, AssociationError):
        return _read(path, skeleton)


def _read(path: Path, skeleton: str | Path | None) -> Association:
    lines = read_text(path, AssociationError).splitlines()
    own: str | Path = STANDARD
    rules: list[tuple[int, list[tuple[str, int]]]] = []
    ignored: list[str] = []
    named: int | None = None
    figure = STANDARD if skeleton is None else str(skeleton)
    for number, line in enumerate(lines, 1):
        words = list(_words(line, f"{path}:{number}"))
        if not words:
            continue
        first = words[0][0]
        if first.startswith("@") and line.strip()[0] != '"':
            if first != "@skeleton" or len(words) != 2:
                raise AssociationError(
                    f"{path}:{number}:{words[0][1]}: only '@skeleton NAME' is known, not {line.strip()!r}"
                )
            with ours(f"{path}:{number}", AssociationError):
                own, named = _beside(path, words[1][0]), number
            figure = words[1][0] if skeleton is None else figure
        elif first == "ignore" and len(words) == 2:
            ignored.append(words[1][0])
        else:
            rules.append((number, words))
    by_the_file = named is not None and skeleton is None
    with ours(f"{path}:{named}", SkeletonError) if by_the_file else nullcontext():
        read = read_skeleton(skeleton or own)
    if skeleton is not None:
        part, rest = _of_the_figure(rules, read, own)
        if rules and not part:
            raise AssociationError(
                f"none of its markers is one of the skeleton {read.name!r}",
                f"its markers: {listed(read.segment_of, 12)}",
            )
        rules, ignored = part, ignored + rest
    return Association(str(path), read, tuple(_rules(rules, read, path)), tuple(ignored), figure)


def _of_the_figure(
    rules: list[tuple[int, list[tuple[str, int]]]], figure: Skeleton, own: str | Path
) -> tuple[list[tuple[int, list[tuple[str, int]]]], list[str]]:
    """The lines whose markers the figure has, and patterns for the labels that only the file's own figure has."""
    try:
        whole = read_skeleton(own)
    except SkeletonError:
        return rules, []
    names = [[s.name for s in each.segments] for each in (figure, whole)]
    markers = [each.segment_of for each in (figure, whole)]
    part, rest = [], []
    for number, words in rules:
        texts = [word for word, _ in words]
        here, there = (
            texts[2] in names[i]
            if len(texts) == 3
            else len(texts) == 2
            and (texts[1] in markers[i] or bool(segment_of_landmark(texts[1], names[i])))
            for i in (0, 1)
        )
        if there and not here:
            rest.append(escape(texts[0]))
        else:
            part.append((number, words))
    return part, rest


def find_association(source: str | Path) -> Path:
    """Find an association file by its path, or by the name of a shipped one.

    Raises:
        AssociationError: there is no such file, or it cannot be looked at; the hint names the shipped ones.

    >>> find_association("cmu").name
    'cmu.txt'
    """
    with ours(source, AssociationError):
        path = Path(source)
        if path.is_file():
            return path
        shipped = SHIPPED / f"{source}.txt"
        if path.name == str(source) and shipped.is_file():
            return shipped
        known = sorted(p.stem for p in SHIPPED.glob("*.txt"))
        hint = nearest(str(source), known) or f"shipped ones: {', '.join(known)}"
        raise AssociationError("no such association file", hint)


def _beside(path: Path, name: str) -> str | Path:
    """The path of a skeleton that lies beside the file that names it; its name if none lies there."""
    near = path.parent / name
    return near if near.is_file() else name


_WORD = re.compile(r'\s*(?:"([^"]*)"(?=\s|#|$)|([^\s"#]+(?=\s|#|$))|(#.*)|(\S))')


def _words(line: str, where: str) -> Iterator[tuple[str, int]]:
    """Split a line into words, each with its column from 1; a comment ends the line."""
    at, end = 0, len(line.rstrip())
    while at < end:
        found = _WORD.match(line, at)
        assert found is not None, "the last alternative takes any character"
        quoted, plain, comment, wrong = found.groups()
        if comment is not None:
            return
        group = next(i for i, g in enumerate(found.groups(), 1) if g is not None)
        column = found.start(group) + (quoted is None)
        if wrong is not None:
            raise AssociationError(
                f"{where}:{column}: stray or unclosed quote", 'a label with spaces or # is "quoted"'
            )
        # As the readers have labels: what cannot be printed is the same here and there.
        word = printable(plain if quoted is None else quoted.strip())
        if not word:
            raise AssociationError(f"{where}:{column}: an empty name")
        yield word, column
        at = found.end()


def _rules(
    lines: list[tuple[int, list[tuple[str, int]]]], skeleton: Skeleton, path: Path
) -> Iterator[Rule]:
    """Turn lines, as their number and words, into rules; the first wrong one is an error."""
    segment_of = skeleton.segment_of
    segments = [s.name for s in skeleton.segments]
    by_label: dict[str, int] = {}
    by_marker: dict[str, int] = {}
    for number, words in lines:
        where = f"{path}:{number}"
        if len(words) not in (2, 3):
            column = words[3][1] if len(words) > 3 else words[0][1]
            raise AssociationError(
                f"{where}:{column}: {counted(len(words), 'word')} where LABEL MARKER [SEGMENT] is needed",
                'a label with spaces or # is "quoted"',
            )
        (label, label_column), (marker, column) = words[0], words[1]
        if len(words) == 3:
            segment, column_3 = words[2]
            if segment not in segments:
                raise AssociationError(
                    f"{where}:{column_3}: {segment!r} is no segment of the skeleton {skeleton.name!r}",
                    nearest(segment, segments) or f"its segments: {', '.join(segments)}",
                )
        elif marker in segment_of:
            segment = segment_of[marker]
        elif not (segment := segment_of_landmark(marker, segments)):
            raise AssociationError(
                f"{where}:{column}: {marker!r} is no marker of the skeleton {skeleton.name!r}",
                nearest(marker, segment_of)
                or "a marker without a standard name needs its segment in a third column",
            )
        for name, seen, at, what in (
            (label, by_label, label_column, "label"),
            (marker, by_marker, column, "marker"),
        ):
            if name in seen:
                raise AssociationError(
                    f"{where}:{at}: {what} {name!r} stands in line {seen[name]} already"
                )
            seen[name] = number
        yield Rule(label, marker, segment, number)


def associate(
    clip: Clip, association: Association, subject: str | None = None
) -> tuple[Assignment, ...]:
    """Find which column of a clip is which marker, for each subject that has a label in the file.

    Labels match without their subject's prefix; capital and small letters are different. A rule whose
    label has the prefix matches that subject only.

    Args:
        clip: the recording.
        association: the file, from `read_association`.
        subject: this one only.

    Returns:
        One assignment for each subject, in the clip's order.

    Raises:
        CallError: the clip has no such subject.
        ClipError: no label of the clip is in the file.

    >>> from mocap_skel import read_clip
    >>> anna, ben = associate(read_clip("sample_data/two_dancers.c3d"), read_association("cmu"))
    >>> ben.subject, ben.columns["LeftFoot"]
    ('Ben', {'LHEE': 72, 'LTOE': 73, 'LMT5': 74})
    """
    check_subject(clip, subject)
    if not association.rules:
        raise ClipError(
            f"{clip.name}: {association.path} has no marker to fit, only labels to ignore",
            "its comment may say why",
        )
    found = [
        _assign(clip, name, association) for name in clip.subject_names if subject in (None, name)
    ]
    matched = tuple(a for a in found if a.columns)
    if not matched:
        labels = [
            label
            for label, whose in zip(clip.labels, clip.subjects, strict=True)
            if subject in (None, whose)
        ]
        raise ClipError(
            f"{clip.name}: no label of the clip is in {association.path}; it has {listed(labels)}",
            "mocap-skel inspect shows the labels; mocap-skel assoc guess writes a file for them",
        )
    return matched


def check_subject(clip: Clip, subject: str | None) -> None:
    """Raise an error if the clip has no such subject; None stands for all subjects.

    Raises:
        CallError: there is no such subject.
    """
    if subject is not None and subject not in clip.subject_names:
        known = [name for name in clip.subject_names if name]
        raise CallError(
            f"{clip.name}: no subject {subject!r} in it",
            nearest(subject, known) or f"it has {listed(known) or 'no subjects'}",
        )


def _assign(clip: Clip, subject: str, association: Association) -> Assignment:
    """The assignment of one subject; without columns if none of its labels is in the file."""
    own = {
        label: column
        for column, (label, whose) in enumerate(zip(clip.labels, clip.subjects, strict=True))
        if whose == subject
    }
    prefix = f"{subject}:" if subject else ""
    at: dict[str, dict[str, int]] = {}
    used: dict[str, Rule] = {}
    absent = []
    others = tuple(f"{name}:" for name in clip.subject_names if name and name != subject)
    for rule in association.rules:
        label = rule.label.removeprefix(prefix)
        if label in used:
            raise AssociationError(
                f"{association.path}:{rule.line}: label {rule.label!r} is that of line "
                f"{used[label].line} in {clip.name}"
            )
        if label in own:
            at.setdefault(rule.segment, {})[rule.marker] = own[label]
            used[label] = rule
        elif not label.startswith(others):
            absent.append(rule)
    rest = [label for label in own if label not in used]
    dropped = set(_ignored(rest, association.ignored))
    landmarks = own_names(at, clip.labels)
    landmarks |= told_by_place(clip.points, at, clip.labels)
    columns, by_place = _by_place(clip, at, landmarks)
    return Assignment(
        subject,
        {
            s.name: _in_order(columns[s.name], s.markers)
            for s in association.skeleton.segments
            if s.name in columns
        },
        tuple(absent),
        tuple(label for label in rest if label not in dropped),
        tuple(label for label in rest if label in dropped),
        landmarks,
        by_place,
    )


# A sign of a pattern that stands for itself.
_ESCAPED = re.compile(r"\[([*?\[])\]")


def _ignored(labels: Sequence[str], patterns: Iterable[str]) -> Iterator[str]:
    """The labels that a pattern matches; patterns that are plain labels, as a guess has by the thousand, are looked up."""
    plain, others = set(), []
    for pattern in patterns:
        if any(c in "*?[" for c in _ESCAPED.sub("", pattern)):
            others.append(pattern)
        else:
            plain.add(_ESCAPED.sub(r"\1", pattern))
    return (s for s in labels if s in plain or any(fnmatchcase(s, p) for p in others))


def _by_place(
    clip: Clip, columns: dict[str, dict[str, int]], landmarks: Mapping[str, str]
) -> tuple[dict[str, dict[str, int]], tuple[str, ...]]:
    """The columns with medial and lateral markers exchanged whose places say so, and what there is to say of them."""
    all_of = {marker: column for of in columns.values() for marker, column in of.items()}
    at = all_of | {name: all_of[marker] for name, marker in landmarks.items()}
    notes: list[str] = []
    moved: dict[int, int] = {}
    for one in exchanged(clip.points, at):
        pair = (one.lateral, one.medial)
        notes.append(one.sentence({name: clip.labels[at[name]] for name in pair}))
        if one.certain:
            moved |= {at[one.lateral]: at[one.medial], at[one.medial]: at[one.lateral]}
    changed = {s: {m: moved.get(c, c) for m, c in of.items()} for s, of in columns.items()}
    return changed, tuple(notes)


def _in_order(columns: dict[str, int], standard: tuple[str, ...]) -> dict[str, int]:
    """Sort markers: standard ones in the skeleton's order, then the others by name."""
    rank = {marker: i for i, marker in enumerate(standard)}
    return dict(sorted(columns.items(), key=lambda m: (rank.get(m[0], len(rank)), m[0])))

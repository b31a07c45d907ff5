"""Subjects that labels tell without a colon: `Subject1_LFHD`, `Lab LFHD`, `LFHD_Anna`, `LFHD1` and `LFHD2`."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from mocap_skel.clip import Clip
from mocap_skel.figure.skeleton import STANDARD, shipped_skeletons
from mocap_skel.labels.association import Association
from mocap_skel.labels.guess.names import HIGH, LIKELY, guess_names
from mocap_skel.text import listed

# So many labels that are known without their affix make a subject. A leg alone has seven in common sets.
LEAST = 6
# A label's affix ends at one of so many places where the kind of its characters changes.
DEEPEST = 5
# Metres: markers of one segment are not farther apart, and their distance does not vary so much.
SEGMENT, VARIES = 0.6, 0.05
# Frames that tell whether two people are two.
ENOUGH = 300

# What may stand between a label and its affix.
_SIGNS = " _-.:|/\\()[]#*~+,;"

# How many of these labels are known.
Known = Callable[[Sequence[str]], int]
# From an affix to the labels that have it, as (place among the labels, label without it).
Groups = dict[str, list[tuple[int, str]]]


def with_subjects(clip: Clip, association: Association | None = None) -> Clip:
    """The clip with the subjects that a common prefix or suffix of its labels tells, as a colon would.

    An affix is a subject if more labels are known without it than with it. Several affixes are several
    people if markers of the same name are not of one segment: their distance varies, or is large.

    Args:
        clip: as `read_clip` gave it; its columns stay where they are.
        association: its labels are the known ones; None = those that names tell.

    Returns:
        The clip, with a note for each change; the same one if there is none.

    >>> from mocap_skel import read_clip
    >>> clip = read_clip("sample_data/nearly_still.c3d")
    >>> named = replace(clip, labels=tuple(f"Lab 1_{label}" for label in clip.labels))
    >>> with_subjects(named).subject_names, with_subjects(named).labels == clip.labels
    (('Lab 1',), True)
    """
    if association is None:
        known: Known = _known_by_name
    else:
        given = {rule.label.rpartition(":")[2].strip() for rule in association.rules}
        given |= {rule.label for rule in association.rules}
        known = lambda labels: sum(label in given for label in labels)  # noqa: E731
    labels, subjects = list(clip.labels), list(clip.subjects)
    notes = []
    for subject in clip.subject_names:
        own = [i for i, whose in enumerate(clip.subjects) if whose == subject]
        found = _best([clip.labels[i] for i in own], own, clip, known)
        names = _names(found)
        for affix, members in found.items():
            whose = f"{subject}:{names[affix]}" if subject else names[affix]
            for k, label in members:
                labels[own[k]], subjects[own[k]] = label, whose
        if found:
            said = listed(f"{affix!r} is {names[affix]}" for affix in found)
            notes.append(f"subjects by what their labels have in common: {said}")
    if not notes:
        return clip
    _with_their_doubles(clip, labels, subjects)
    return replace(
        clip, labels=tuple(labels), subjects=tuple(subjects), notes=(*clip.notes, *notes),
        as_read=clip.as_read or (clip.labels, clip.subjects),
    )  # fmt: skip


def _known_by_name(labels: Sequence[str]) -> int:
    """How many labels are known by their names, those that are a standard marker twice."""
    found = guess_names(labels, shipped_skeletons()[STANDARD].segment_of.items()).values()
    sure = [guess for guess in found if guess.confidence in (HIGH, LIKELY)]
    return len(sure) + sum(bool(guess.marker) for guess in sure)


def _best(labels: list[str], columns: list[int], clip: Clip, known: Known) -> Groups:
    """The grouping in which most labels are known; an empty one where none is better than the labels as they are."""
    if len(labels) < LEAST:
        return {}
    best: Groups = {}
    most: int | None = None
    least = 0
    tried: set[tuple[tuple[str, int], ...]] = set()
    for groups in _groupings(labels):
        groups = _promising(groups, len(labels))
        key = tuple((affix, len(own)) for affix, own in groups.items())
        if not groups or key in tried:
            continue
        tried.add(key)
        if most is None:
            most = known(labels)
        counts = {affix: known([label for _, label in own]) for affix, own in groups.items()}
        groups = {affix: own for affix, own in groups.items() if counts[affix] >= LEAST}
        inside = {k for own in groups.values() for k, _ in own}
        rest = [(k, label) for k, label in enumerate(labels) if k not in inside]
        total = sum(counts[affix] for affix in groups) + known([label for _, label in rest])
        # Of two that know as many, the one that leaves less of the affix.
        kept = -sum(len(label) for own in groups.values() for _, label in own)
        # What all have may say nothing and be an affix all the same.
        as_good = kept > least if best else len(inside) == len(labels)
        better = total > most or (total == most and as_good)
        if groups and better and _apart([*groups.values(), rest], columns, clip):
            best, most, least = groups, total, kept
    return best


def _groupings(labels: list[str]) -> Iterator[Groups]:
    """The ways to part the labels by an affix: the k-th change of characters, a digit, what all have."""
    cuts = [_changes(label) for label in labels]
    for k in range(DEEPEST):
        yield _by(labels, (c[k] if k < len(c) else 0 for c in cuts), front=True)
        yield _by(labels, (c[-1 - k] if k < len(c) else 0 for c in cuts), front=False)
    yield _by(labels, (len(x) - 1 if x[-1:].isdigit() else 0 for x in labels), front=False)
    front = _common(labels)
    back = _common([label[::-1] for label in labels])[::-1]
    for cut in {len(front), *_changes(front)}:
        yield _by(labels, (cut for _ in labels), front=True)
    for cut in {len(back), *(len(back) - c for c in _changes(back))}:
        yield _by(labels, (len(label) - cut for label in labels), front=False)


def _common(labels: list[str]) -> str:
    """What all of them begin with."""
    low, high = min(labels), max(labels)
    differ = (i for i, (a, b) in enumerate(zip(low, high, strict=False)) if a != b)
    return low[: next(differ, len(low))]


def _changes(label: str) -> list[int]:
    """The places at which the kind of a label's characters changes, but not after a capital."""
    kinds = [
        "d" if c.isdigit() else "A" if c.isupper() else "a" if c.isalpha() else "_" for c in label
    ]
    return [
        i for i in range(1, len(label))
        if kinds[i] != kinds[i - 1] and (kinds[i - 1], kinds[i]) != ("A", "a")
    ]  # fmt: skip


def _by(labels: list[str], cuts: Iterable[int], *, front: bool) -> Groups:
    """Labels by what stands in front of the cut, or behind it; nothing is cut at 0 and at the end."""
    groups: Groups = defaultdict(list)
    for k, (label, cut) in enumerate(zip(labels, cuts, strict=True)):
        if 0 < cut < len(label):
            affix, rest = (label[:cut], label[cut:]) if front else (label[cut:], label[:cut])
            rest = rest.lstrip(_SIGNS) if front else rest.rstrip(_SIGNS)
            if any(c.isalnum() for c in affix) and rest:
                groups[affix].append((k, rest))
    return groups


def _promising(groups: Groups, count: int) -> Groups:
    """The groups that may be subjects: most of the labels, or the same names several times."""
    large = {affix: own for affix, own in groups.items() if len(own) >= LEAST}
    seen = Counter(label for own in large.values() for label in {label for _, label in own})
    found = {}
    for affix, own in large.items():
        shared = sum(seen[label] > 1 for _, label in own)
        if 2 * len(own) >= count or shared >= LEAST:
            found[affix] = own
    return found


def _apart(people: list[list[tuple[int, str]]], columns: list[int], clip: Clip) -> bool:
    """Whether markers of the same name belong to different bodies, for most of the names that stand twice."""
    first: dict[str, int] = {}
    pairs = []
    for own in people:
        for k, label in own:
            if label in first:
                pairs.append((columns[first[label]], columns[k]))
            first.setdefault(label, k)
    if not pairs:
        return True
    step = clip.frames // ENOUGH + 1
    one, other = (clip.points[::step, [pair[i] for pair in pairs]] for i in (0, 1))
    away = np.linalg.norm(one - other, axis=2)
    there = np.isfinite(away)
    count = there.sum(axis=0)
    some = count > 0
    away = np.where(there, away, 0.0)[:, some]
    mean = away.sum(axis=0) / count[some]
    off = np.where(there[:, some], away - mean, 0.0)
    varies = np.sqrt(np.square(off).sum(axis=0) / count[some])
    # Two that are never seen together tell nothing.
    return bool(2 * ((mean > SEGMENT) | (varies > VARIES)).sum() >= some.sum())


def _names(groups: Groups) -> dict[str, str]:
    """A subject's name for each affix: without blanks and signs at its ends, where that leaves them different."""
    names = {affix: affix.strip(_SIGNS) or affix.strip() for affix in groups}
    several = Counter(names.values())
    return {affix: name if several[name] == 1 else affix.strip() for affix, name in names.items()}


def _with_their_doubles(clip: Clip, labels: list[str], subjects: list[str]) -> None:
    """Give the copies of a label, whose number hides the suffix, to the subject of the first one."""
    for first, *copies in clip.doubles:
        for n, column in enumerate(copies, 2):
            if labels[first] != clip.labels[first] and labels[column] == clip.labels[column]:
                labels[column], subjects[column] = f"{labels[first]}_{n}", subjects[first]

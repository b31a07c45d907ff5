"""Which trajectory is which marker, of whom: the one way for every command, told or guessed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from glob import escape
from typing import TYPE_CHECKING

from mocap_skel.clip import Clip
from mocap_skel.errors import AssociationError, CallError
from mocap_skel.figure.skeleton import STANDARD, Skeleton, shipped_skeletons
from mocap_skel.labels.association import Association, check_subject
from mocap_skel.labels.doubles import with_right_doubles
from mocap_skel.labels.guess.part import figures
from mocap_skel.labels.shipped import Match, best_match, match, seen_rules
from mocap_skel.labels.subjects import with_subjects
from mocap_skel.text import counted, listed

if TYPE_CHECKING:
    from mocap_skel.labels.guess import Guess

# Share of an association file's lines; with fewer in the clip, another file that knows twice as much is meant.
FEW_LINES = 0.3
# Share of its lines that make a file the clip's own, and a shipped one taken unasked; all where names say nothing.
MOST_LINES = 0.8


@dataclass(frozen=True)
class Named:
    """A clip whose markers are named.

    Attributes:
        clip: with its subjects, and the right one of labels that stand twice.
        whole: the same before parts of a body became subjects.
        associations: the markers and the figure; further ones for other parts of the body, where the clip
            does not show the human's root. Each part is then a subject of the clip.
        notes: what was decided, one sentence each, the reader's too.
        guess: what it says of every label; None where an association file is used.
    """

    clip: Clip
    whole: Clip
    associations: tuple[Association, ...]
    notes: tuple[str, ...]
    guess: Guess | None = None

    @property
    def association(self) -> Association:
        """The first one."""
        return self.associations[0]


def name_markers(
    clip: Clip,
    association: Association | None,
    *,
    subject: str | None = None,
    figure: Skeleton | None = None,
    strict: bool = False,
    how: Sequence[str] = (),
) -> Named:
    """Find whose the trajectories of a clip are, and which is which marker.

    Args:
        clip: as it was read.
        association: from a file; None = guessed, or a shipped one that knows more labels.
        subject: this one only.
        figure: take this one, in place of the human or its parts that the clip shows; an association has it.
        strict: no clear name may contradict the movement.
        how: options that the clip was read with, for the commands that hints name.

    Raises:
        CallError: no such subject; the association file is another set's; or the guess is not sure.

    >>> from mocap_skel import read_clip
    >>> named = name_markers(read_clip("sample_data/nearly_still.c3d"), None)
    >>> named.association.skeleton.name, len(named.association.rules)
    ('human', 41)
    """
    clip = with_subjects(clip, association)
    check_subject(clip, subject)
    if association is not None:
        if association.rules:
            _check_known(clip, association, subject)
        clip = with_right_doubles(clip, {r.label: r.segment for r in association.rules})
        parts = () if figure is not None else _parts(clip, association, subject)
        if not parts:
            return Named(clip, clip, (association,), clip.notes)
        from mocap_skel.labels.guess.missing import one_segment

        shown = listed(part.skeleton.name for part in parts)
        root = association.skeleton.root.name
        note = f"the clip shows no three markers of {root}: of the figure {shown}"
        if alone := one_segment([part.skeleton for part in parts]):
            note += f": {alone}"
        return _named(clip, subject, parts, note, None)
    told = with_right_doubles(clip, _segments_by_name(clip))
    associations, note, guess = _guessed(told, subject, figure, strict, how)
    if guess is None:
        # A file's labels are those of the file, copies and all.
        segments = {rule.label: rule.segment for rule in associations[0].rules}
        told = with_right_doubles(clip, segments)
    return _named(told, subject, associations, note, guess)


def _named(
    clip: Clip,
    subject: str | None,
    associations: tuple[Association, ...],
    note: str,
    guess: Guess | None,
) -> Named:
    """The clip, in which each part of the body is a subject where there are several."""
    whole = clip
    if len(associations) > 1:
        one = subject or (clip.subject_names[0] if len(clip.subject_names) == 1 else None)
        if one is None:
            first, *rest = (part.skeleton.name for part in associations)
            note += (
                f"; of several subjects only {first} is taken: --subject takes {listed(rest)} too"
            )
            associations = associations[:1]
        else:
            clip = _parted(clip, one, associations)
    return Named(clip, whole, associations, (*clip.notes, note), guess)


def _parts(clip: Clip, association: Association, subject: str | None) -> tuple[Association, ...]:
    """An association of the human as those of the parts that the clip shows; none where it shows the human's root."""
    if association.figure != STANDARD or not association.rules:
        return ()
    seen = {rule.label: rule for rule in seen_rules(clip, association, subject)}
    found = figures(Counter(rule.segment for rule in seen.values()), association.skeleton)
    if found[0].name == association.skeleton.name:
        return ()
    parts = []
    for figure in found:
        own = {segment.name for segment in figure.segments}
        rules = tuple(rule for rule in association.rules if rule.segment in own)
        rest = tuple(escape(r.label) for r in association.rules if r.segment not in own)
        parts.append(
            replace(
                association,
                skeleton=figure,
                rules=rules,
                ignored=(*association.ignored, *rest),
                figure=figure.name,
            )
        )
    return tuple(parts)


def _check_known(clip: Clip, association: Association, subject: str | None) -> None:
    """Refuse an association file of another marker set, and name the shipped one that is meant.

    Raises:
        AssociationError: it is.
    """
    own = match(association.path, clip, association, subject)
    if own.share >= (FEW_LINES if own.usable else MOST_LINES):
        return
    best = best_match(with_subjects(clip), subject)
    if best is not None and best.association.path == association.path:
        best = None
    if not own.labels:
        what, hint = f"no label of the clip is in {association.path}", _other(best)
        labels = listed(
            x for x, s in zip(clip.labels, clip.subjects, strict=True) if subject in (None, s)
        )
        raise AssociationError(f"{clip.name}: {what}; it has {labels}", hint)
    if best is not None and (
        best.labels >= 2 * own.labels or (not own.usable and best.labels > own.labels)
    ):
        lines = counted(len(association.rules), "label")
        raise AssociationError(
            f"{clip.name}: only {own.labels} of the {lines} of {association.path} are in the clip",
            _other(best),
        )


def _other(best: Match | None) -> str:
    if best is None:
        return "mocap-skel inspect shows the labels; mocap-skel assoc guess writes a file for them"
    return f"--assoc {best.name} has {counted(best.labels, 'label')} of it; without --assoc it is guessed"


def _segments_by_name(clip: Clip) -> dict[str, str]:
    """Label → segment, where the name tells; nothing for a clip without labels that stand twice."""
    from mocap_skel.labels.guess.names import HIGH, LIKELY, guess_names

    if not clip.doubles:
        return {}
    human = shipped_skeletons()[STANDARD]
    found = guess_names(clip.labels, human.segment_of.items())
    return {
        x: g.segment
        for x, g in found.items()
        if g.segment and not g.double_of and g.confidence in (HIGH, LIKELY)
    }


def _guessed(
    clip: Clip,
    subject: str | None,
    figure: Skeleton | None,
    strict: bool,
    how: Sequence[str],
) -> tuple[tuple[Association, ...], str, Guess | None]:
    """The associations that names and motion give, or a shipped one that knows more; what to say; the guess if used.

    Raises:
        CallError: neither is sure.
    """
    from mocap_skel.labels.guess import check_sure, doubts, guess_association, in_words
    from mocap_skel.labels.guess.missing import LEAST, one_segment, what_is_missing

    guess, trouble = None, None
    try:
        guess = guess_association(clip, subject, how, figure)
        check_sure(guess, how, strict=strict)
    except CallError as error:
        trouble = error
    placed = 0 if guess is None else sum(x.seen for x in guess.used)
    may_be = len(clip.labels) if guess is None else guess.may_be
    if figure is None and (trouble or placed < may_be):
        best = best_match(clip, subject)
        if best is not None and knows_more(best, placed, may_be, clip, subject):
            said = f"no --assoc: the shipped file {best.name} has {counted(best.labels, 'label')} of the clip"
            return (
                (best.association,),
                f"{said}, more than names tell ({placed}), and is used",
                None,
            )
    if trouble is not None:
        if missing := what_is_missing(clip):
            raise CallError(f"{clip.name}: no figure to fit: {missing}", trouble.hint) from trouble
        raise trouble
    assert guess is not None, "there is no trouble"
    said = f"no --assoc, so it is guessed from names and motion: {in_words(guess)}"
    associations = guess.associations()
    alone = "" if figure is not None else one_segment([a.skeleton for a in associations])
    if alone and placed >= LEAST:
        name = associations[0].skeleton.name
        raise CallError(
            f"{clip.name}: no figure to fit: {placed} of its {len(clip.labels)} points are on the {name}, "
            f"as on a face: they show {alone}",
            f"--skeleton {name} fits that all the same",
        )
    if alone:
        said += f": {alone}"
    return associations, f"{said}{doubts(guess)}", guess


def knows_more(best: Match, placed: int, may_be: int, clip: Clip, subject: str | None) -> bool:
    """Whether a shipped file is a better answer than the guess: more labels, most lines, and no contradiction.

    Args:
        best: the file.
        placed: how many labels the guess places; 0 if names say nothing.
        may_be: how many may be markers.
        clip, subject: whose labels they are.
    """
    from mocap_skel.labels.shipped import judged

    least = MOST_LINES if placed else 1.0
    if best.labels <= placed or best.share < least or 2 * best.labels < may_be:
        return False
    found = judged(clip, best.association, subject)
    # Numbers may be another laboratory's: there the movement has to confirm them.
    confirmed = sum("moves with it" in v.guess.reason for v in found)
    sure = bool(placed) or 2 * confirmed >= len(found)
    return sure and not any(v.contradicted for v in found)


def _parted(clip: Clip, subject: str, associations: tuple[Association, ...]) -> Clip:
    """The clip in which each part of the body is a subject of its own."""
    subjects = list(clip.subjects)
    for association in associations:
        part = association.skeleton.name
        own = {rule.label for rule in association.rules}
        for i, (label, whose) in enumerate(zip(clip.labels, clip.subjects, strict=True)):
            if whose == subject and label in own:
                subjects[i] = f"{subject} {part}" if subject else part
    as_read = clip.as_read or (clip.labels, clip.subjects)
    return replace(clip, subjects=tuple(subjects), as_read=as_read)

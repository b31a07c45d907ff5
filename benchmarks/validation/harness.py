"""From a folder to results: find, withhold, associate, fit by every method, score."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from mocap_skel.errors import MocapSkelError
from mocap_skel.figure.skeleton import Skeleton
from mocap_skel.labels.association import Assignment
from mocap_skel.readers import read_clip
from validation.estimates import Subject
from validation.folder import choose
from validation.references import ASF, Reference, References, find_references, ranked, without
from validation.scoring import carried, errors, halves, lengths
from validation.tables import ClipResult

Fitted = list[tuple[Subject, list[Reference]]]


def validate(
    clips: Sequence[Path],
    folder: Path,
    association: str | None = None,
    *,
    half: bool = False,
    tell: Callable[[str], object] = lambda _: None,
) -> list[ClipResult]:
    """Run over clips; one that fails is a result with its reason.

    Args:
        clips: C3D files.
        folder: what their names are told from.
        association: one for all of them; the best for each if None.
        half: also fit each half of the frames.
        tell: is given a sentence before each clip.
    """
    results: list[ClipResult] = []
    done: dict[Path, list[tuple[str, Subject, list[Reference], ClipResult]]] = {}
    for path in clips:
        name = str(path.relative_to(folder)) if path.is_relative_to(folder) else path.name
        name = name.removesuffix(path.suffix)
        tell(name)
        result = ClipResult(name)
        results.append(result)
        try:
            fitted = _one(path, result, association, half=half)
        except MocapSkelError as error:
            result.failed = " ".join(str(error).split())
            continue
        # One clip's numbers that a method cannot take must not cost the others theirs.
        except (ArithmeticError, ValueError, LookupError) as error:
            result.failed = f"{type(error).__name__}: {error}"
            continue
        for subject, found in fitted:
            done.setdefault(path.parent, []).append((name, subject, found, result))
    for together in done.values():
        others = [(name.rpartition("/")[2], subject) for name, subject, _, _ in together]
        for name, subject, found, result in together:
            result.errors += carried((name.rpartition("/")[2], subject, found), others)
    return results


def _one(path: Path, result: ClipResult, association: str | None, *, half: bool) -> Fitted:
    clip = read_clip(path)
    references = find_references(path, clip)
    result.notes += references.notes
    seen = without(clip, references.withheld)
    beside = path.with_name(f"{path.stem}.map.txt")
    known, assignments = choose(seen, str(beside) if beside.exists() else association)
    medial = [label for _, label in sorted(references.withheld)]
    placed = sum(len(c) for a in assignments for c in a.columns.values())
    result.head = (
        f"{clip.frames} frames at {clip.rate:g} Hz, {Path(known.path).stem}, {placed} markers"
        + (f"; withheld: {', '.join(medial)}" if medial else "")
    )
    fitted: Fitted = []
    problems: list[MocapSkelError] = []
    for assignment in assignments:
        try:
            subject = Subject(seen, assignment, known.skeleton)
        except MocapSkelError as error:
            problems.append(error)
            result.notes.append(f"{assignment.subject or 'the figure'}: {error}")
            continue
        own = _own(references, assignment, alone=len(assignments) == 1)
        own = _here(own, known.skeleton)
        rows, notes = errors(result.name, subject, own)
        result.errors += rows
        result.notes += notes
        studio = references.lengths if any(r.kind == ASF for r in own) else {}
        result.lengths += lengths(result.name, subject, studio)
        if half:
            result.halves += halves(result.name, subject)
        fitted.append((subject, own))
    if not fitted and problems:
        raise problems[0]
    return fitted


def _own(references: References, assignment: Assignment, *, alone: bool) -> list[Reference]:
    """A subject's references; the studio's skeleton, and labels without a subject, are those of the only one."""
    own = [
        replace(one, subject=assignment.subject)
        for one in references.found
        if one.subject == assignment.subject or (alone and one.subject in ("*", ""))
    ]
    return ranked(own)


def _here(found: list[Reference], skeleton: Skeleton) -> list[Reference]:
    return [one for one in found if one.joint in skeleton.joints]

"""From a clip's file to its result files: the whole way of one clip."""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mocap_skel.clip import Clip
from mocap_skel.errors import CallError, ClipError, ExportError, MocapSkelError
from mocap_skel.events import Event
from mocap_skel.export.files import Content, check_free, put_all, write_all
from mocap_skel.export.registry import Source
from mocap_skel.export.result_files import stem_of
from mocap_skel.gait.events import own_events
from mocap_skel.labels.association import Assignment
from mocap_skel.pipeline.job import Job, fit_file, named, static_fits, static_of
from mocap_skel.pipeline.limits import limited
from mocap_skel.pipeline.told_options import options_of
from mocap_skel.skeleton_fit import SkeletonFit

if TYPE_CHECKING:
    from mocap_skel.rig.quality import Quality


@dataclass(frozen=True)
class Figure:
    """A rigid figure of one subject, and the formats that hold it.

    Attributes:
        subject: as the fit has it.
        formats: their names.
        quality: how good the figure is.
    """

    subject: str
    formats: tuple[str, ...]
    quality: Quality


@dataclass(frozen=True)
class Done:
    """What came of one clip.

    Attributes:
        fits: one a subject.
        files: result files with their contents.
        notes: what there is to say about it, one sentence each.
        failed: why other subjects could not be fitted, or formats not written.
        figures: the rigid figures in the files, those that are told the same once.
        events: subject → the events of the file that are of it.
        options: gives the version and all options that are no defaults.
    """

    fits: tuple[SkeletonFit, ...]
    files: dict[Path, Content]
    notes: tuple[str, ...]
    failed: tuple[MocapSkelError, ...]
    figures: tuple[Figure, ...] = ()
    events: Mapping[str, tuple[Event, ...]] = field(default_factory=dict)
    options: Callable[[], Mapping[str, Any]] = dict


def process(path: Path, job: Job, taken: Container[Path] = ()) -> Done:
    """Read, fit, render and write one clip; its files appear together or not at all.

    Args:
        path: the clip.
        job: what to do with it.
        taken: files that are not to be written, though `job.overwrite` allows to replace others.

    Raises:
        MocapSkelError: the clip cannot be read, fitted, or written, or needs too much memory.
    """
    with limited(path):
        return _stored(path, job, render(path, job), taken)


def render(path: Path, job: Job) -> Done:
    """All of `process` but writing. A format that cannot hold the clip does not keep the others from it.

    Raises:
        OutputError: a result is there already and may not be replaced; this is seen before anything is fitted.
        MocapSkelError: the clip cannot be read or fitted, or none of the formats can hold it.
    """
    found = fit_file(path, job, lambda clip, all_of_it: _check_targets(path, job, clip, all_of_it))
    statics = static_fits(job)
    notes = list(found.notes)
    files: dict[Path, Content] = {}
    failed: list[MocapSkelError] = [*found.failed]
    figures: list[Figure] = []
    for assignment, fit in found.subjects:
        stem = stem_of(path, found.clip, fit.subject)
        decided = (*found.decided, *assignment.mismatches(found.association))
        static = static_of(statics, fit)
        if statics and static is None:
            notes.append(named(fit.subject, f"{job.static} has no such subject: no neutral pose"))
        source = Source(
            found.clip, path, assignment, decided, job.command, static, partial(options_of, job)
        )
        rigid: dict[Quality, list[str]] = {}
        for chosen in job.formats:
            try:
                rendered = chosen.render(fit, source)
            except (ExportError, ClipError) as error:
                failed.append(error)
                continue
            notes += [named(fit.subject, note) for note in rendered.notes]
            quality = chosen.options.quality(fit)
            if quality is not None:
                rigid.setdefault(quality, []).append(chosen.format.name)
            for suffix, content in rendered.files.items():
                files[target_of(job, stem, suffix)] = content
        figures += [Figure(fit.subject, tuple(names), quality) for quality, names in rigid.items()]
    fits = tuple(fit for _, fit in found.subjects)
    if failed and not files:
        raise failed[0]
    events = {fit.subject: own_events(found.clip, fit.subject) for fit in fits}
    said, told = tuple(dict.fromkeys(notes)), partial(options_of, job)
    return Done(fits, files, said, tuple(failed), tuple(figures), events, told)


def target_of(job: Job, stem: str, suffix: str) -> Path:
    """The result file of a clip or a subject with that stem."""
    return (job.folder or Path()) / f"{stem}{suffix}"


def _check_targets(path: Path, job: Job, clip: Clip, subjects: Sequence[Assignment]) -> None:
    """Refuse results that cannot be written, before the work.

    Raises:
        OutputError: one is there already.
        CallError: two subjects would write the same file.
    """
    suffixes = [suffix for chosen in job.formats for suffix in chosen.format.suffixes]
    seen: set[Path] = set()
    for subject in subjects:
        stem = stem_of(path, clip, subject.subject)
        targets = [target_of(job, stem, suffix) for suffix in suffixes]
        for target in targets:
            check_not_taken(path, target, seen)
        seen |= set(targets)
    if job.folder is not None:
        check_free(seen, job.overwrite, job.inputs)


def _stored(path: Path, job: Job, done: Done, taken: Container[Path]) -> Done:
    for target in done.files:
        check_not_taken(path, target, taken)
    if job.folder is not None:
        write_all(done.files, job.overwrite, job.inputs)
    return done


def put(path: Path, job: Job, parts: Mapping[Path, Path], taken: Container[Path]) -> None:
    """Put a clip's results, which wait on the same disk, into their places, all or none.

    Args:
        path: the clip.
        job: what was done with it.
        parts: file → where its content waits.
        taken: files that are not to be written, though `job.overwrite` allows to replace others.

    Raises:
        OutputError: one is there already or cannot be written.
        CallError: another clip of the call has written one.
    """
    for target in parts:
        check_not_taken(path, target, taken)
    put_all(parts, job.overwrite, job.inputs)


def check_not_taken(path: Path, target: Path, taken: Container[Path]) -> None:
    """Refuse a file that another clip or subject of the call has written.

    Raises:
        CallError: one has.
    """
    if target in taken:
        raise CallError(
            f"{path}: {target} is the result of another clip or subject of this call",
            "choose with --subject, or use another -o",
        )

"""From a clip's file to its result files: the whole way, for one clip or in a child for each of many."""

from __future__ import annotations

from collections import deque
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from mocap_skel.errors import CallError, ClipError, ExportError, MocapSkelError
from mocap_skel.events import Event
from mocap_skel.export.files import write_all
from mocap_skel.export.registry import Source
from mocap_skel.export.result_files import stem_of
from mocap_skel.gait.events import own_events
from mocap_skel.pipeline.job import Job, fit_file, named, static_fits, static_of
from mocap_skel.pipeline.limits import limited, memory_for, size_of
from mocap_skel.skeleton_fit import SkeletonFit

if TYPE_CHECKING:
    from mocap_skel.pipeline.isolation import Worker
    from mocap_skel.rig.quality import Quality

# What one clip in a child may take; a long clip honestly needs more than a short one.
SECONDS, SECONDS_PER_BYTE = 30.0, 2e-6


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
    """

    fits: tuple[SkeletonFit, ...]
    files: dict[Path, str | bytes]
    notes: tuple[str, ...]
    failed: tuple[MocapSkelError, ...]
    figures: tuple[Figure, ...] = ()
    events: Mapping[str, tuple[Event, ...]] = field(default_factory=dict)


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
        done = render(path, job)
    return _stored(path, job, done, taken)


class Isolated:
    """`process` for several clips, each read and fitted in a child that may die instead of us.

    The child fits the next clip while this process writes and shows the last one.
    """

    def __init__(self, paths: Sequence[Path], job: Job) -> None:
        # One clip needs none of it; `fit` starts sooner without.
        from mocap_skel.pipeline.isolation import Worker

        self._waiting = deque(paths)
        self._job = job
        self._worker: Worker = Worker()
        self._next()

    def __enter__(self) -> Isolated:
        return self

    def __exit__(self, *_: object) -> None:
        self._worker.stop()

    def process(self, path: Path, taken: Container[Path] = ()) -> Done:
        """As `process`, for the clips in the order of `paths`.

        Raises:
            MocapSkelError: as there; or the child died, took too long, or too much memory.
        """
        from mocap_skel.pipeline.isolation import TaskError

        try:
            done = self._worker.result(SECONDS + SECONDS_PER_BYTE * size_of(path))
        except TaskError as error:
            raise ClipError(f"{path}: {error}") from error
        finally:
            self._next()
        return _stored(path, self._job, done, taken)

    def _next(self) -> None:
        if self._waiting:
            path = self._waiting.popleft()
            self._worker.start(render, path, self._job, memory=memory_for(path))


def render(path: Path, job: Job) -> Done:
    """All of `process` but writing. A format that cannot hold the clip does not keep the others from it.

    Raises:
        MocapSkelError: the clip cannot be read or fitted, or none of the formats can hold it.
    """
    folder = job.folder or Path()
    found = fit_file(path, job)
    statics = static_fits(job)
    notes = list(found.notes)
    files: dict[Path, str | bytes] = {}
    failed: list[MocapSkelError] = [*found.failed]
    figures: list[Figure] = []
    for assignment, fit in found.subjects:
        stem = stem_of(path, found.clip, fit)
        decided = (*found.decided, *assignment.mismatches(found.association))
        static = static_of(statics, fit)
        if statics and static is None:
            notes.append(named(fit.subject, f"{job.static} has no such subject: no neutral pose"))
        source = Source(found.clip, path, assignment, decided, job.command, static)
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
                target = folder / f"{stem}{suffix}"
                _check_free(path, target, files)
                files[target] = content
        figures += [Figure(fit.subject, tuple(names), quality) for quality, names in rigid.items()]
    fits = tuple(fit for _, fit in found.subjects)
    if failed and not files:
        raise failed[0]
    events = {fit.subject: own_events(found.clip, fit.subject) for fit in fits}
    return Done(fits, files, tuple(dict.fromkeys(notes)), tuple(failed), tuple(figures), events)


def _stored(path: Path, job: Job, done: Done, taken: Container[Path]) -> Done:
    for target in done.files:
        _check_free(path, target, taken)
    if job.folder is not None:
        write_all(done.files, job.overwrite, job.inputs)
    return done


def _check_free(path: Path, target: Path, taken: Container[Path]) -> None:
    if target in taken:
        raise CallError(
            f"{path}: {target} is the result of another clip or subject of this call",
            "choose with --subject, or use another -o",
        )

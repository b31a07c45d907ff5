"""From a clip's file to its result files: the whole way, for one clip or in a child for each of many."""

from __future__ import annotations

from collections import deque
from collections.abc import Container, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mocap_skel.association import Assignment, Association, associate
from mocap_skel.clip import Clip
from mocap_skel.errors import CallError, ClipError, FitError, RootError
from mocap_skel.export import WRITERS, Options, Rendered
from mocap_skel.export.files import safe_name, write_all
from mocap_skel.fit import SkeletonFit, fit_skeleton
from mocap_skel.joint import BEST
from mocap_skel.readers import read_clip
from mocap_skel.skeleton import shipped_with_root
from mocap_skel.text import listed

if TYPE_CHECKING:
    from mocap_skel.isolation import Worker

# What one clip in a child may take; a long clip honestly needs more of both than a short one.
SECONDS, SECONDS_PER_BYTE = 30.0, 2e-6
MEMORY, MEMORY_PER_BYTE = 2 << 30, 20.0
# The one result that shows the clip itself beside the fit.
PAGE = "html"


@dataclass(frozen=True)
class Job:
    """What to do with every clip.

    Attributes:
        association: the markers and the skeleton; None = guessed for each clip, from names and motion.
        formats: names of `export.WRITERS`, or `PAGE`.
        folder: where the results go; None renders them only.
        overwrite: whether existing files may be replaced.
        subject: fit this one only.
        sigma: marker noise in metres, or three along the clip's axes; None = estimated.
        pose, method, noise: as `fit_skeleton` takes them.
        unit, rate: in place of what the clip says.
        salvage: read what there is of a clip whose file is cut off.
        options: what the writers are told.
        command: the call, as the page shows it.
    """

    association: Association | None
    formats: tuple[str, ...] = ("csv",)
    folder: Path | None = None
    overwrite: bool = False
    subject: str | None = None
    sigma: float | tuple[float, ...] | None = None
    pose: str = "least-squares"
    method: str = BEST
    noise: str = "rigid"
    unit: str | None = None
    rate: float | None = None
    salvage: bool = False
    options: Options = field(default_factory=Options)
    command: str = ""

    @property
    def known(self) -> Association:
        """The association, where there is one: `process` guesses it before anything asks."""
        assert self.association is not None
        return self.association

    def fit(self, clip: Clip, assignment: Assignment, *, search: bool = True) -> SkeletonFit:
        """One subject of a clip, fitted as the job says."""
        sigma = np.diag(np.square(self.sigma)) if isinstance(self.sigma, tuple) else self.sigma
        return fit_skeleton(
            clip, assignment, self.known.skeleton, sigma=sigma, pose=self.pose,
            method=self.method, noise=self.noise, search=search,
        )  # fmt: skip


@dataclass(frozen=True)
class Done:
    """What came of one clip.

    Attributes:
        fits: one a subject.
        files: result files with their contents.
        notes: what there is to say about it, one sentence each.
        failed: why other subjects of the clip could not be fitted.
    """

    fits: tuple[SkeletonFit, ...]
    files: dict[Path, str]
    notes: tuple[str, ...]
    failed: tuple[FitError, ...]


def process(path: Path, job: Job, taken: Container[Path] = ()) -> Done:
    """Read, fit, render and write one clip; its files appear together or not at all.

    Args:
        path: the clip.
        job: what to do with it.
        taken: files that are not to be written, though `job.overwrite` allows to replace others.

    Raises:
        MocapSkelError: the clip cannot be read, fitted, or written.
    """
    return _stored(path, job, render(path, job), taken)


class Isolated:
    """`process` for several clips, each read and fitted in a child that may die instead of us.

    The child fits the next clip while this process writes and shows the last one.
    """

    def __init__(self, paths: Sequence[Path], job: Job) -> None:
        # One clip needs none of it; `fit` starts sooner without.
        from mocap_skel.isolation import Worker

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
        from mocap_skel.isolation import TaskError

        try:
            done = self._worker.result(SECONDS + SECONDS_PER_BYTE * _size(path))
        except TaskError as error:
            raise ClipError(f"{path}: {error}") from error
        finally:
            self._next()
        return _stored(path, self._job, done, taken)

    def _next(self) -> None:
        if self._waiting:
            path = self._waiting.popleft()
            memory = max(MEMORY, int(MEMORY_PER_BYTE * _size(path)))
            self._worker.start(render, path, self._job, memory=memory)


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return 0


def render(path: Path, job: Job) -> Done:
    """All of `process` but writing.

    Raises:
        MocapSkelError: the clip cannot be read or fitted, or a format cannot hold it.
    """
    folder = job.folder or Path()
    clip = read_clip(path, unit=job.unit, rate=job.rate, salvage=job.salvage)
    notes = list(clip.notes)
    if job.association is None:
        job = replace(job, association=_guessed(clip, job, notes))
    before = tuple(notes)
    fits, failed = _fits(clip, job, notes)
    files: dict[Path, str] = {}
    for assignment, fit in fits:
        subject = safe_name(fit.subject) if len(clip.subject_names) > 1 and fit.subject else ""
        stem = f"{path.stem}.{subject}" if subject else path.stem
        for name in job.formats:
            if name == PAGE:
                rendered = _page(clip, assignment, fit, before, job)
            else:
                rendered = WRITERS[name](fit, job.options)
            notes += [_named(fit.subject, note) for note in rendered.notes]
            for suffix, text in rendered.files.items():
                target = folder / f"{stem}{suffix}"
                _check_free(path, target, files)
                files[target] = text
    return Done(tuple(fit for _, fit in fits), files, tuple(dict.fromkeys(notes)), tuple(failed))


def _stored(path: Path, job: Job, done: Done, taken: Container[Path]) -> Done:
    for target in done.files:
        _check_free(path, target, taken)
    if job.folder is not None:
        write_all(done.files, job.overwrite)
    return done


def _check_free(path: Path, target: Path, taken: Container[Path]) -> None:
    if target in taken:
        raise CallError(
            f"{path}: {target} is the result of another clip or subject of this call",
            "choose with --subject, or use another -o",
        )


def _guessed(clip: Clip, job: Job, notes: list[str]) -> Association:
    """The association that the clip's own names and motion give, where that is sure."""
    from mocap_skel.guess import check_sure, guess_association, in_words, repeated

    how = repeated(job.subject, job.unit, job.rate, salvage=job.salvage)
    found = guess_association(clip, job.subject, how)
    check_sure(found, how)
    notes.append(f"no --assoc, so it is guessed from names and motion: {in_words(found)}")
    return found.association()


def _page(
    clip: Clip, assignment: Assignment, fit: SkeletonFit, before: tuple[str, ...], job: Job
) -> Rendered:
    """The HTML page of one subject; `before`: what was decided before its fit."""
    from mocap_skel.report.html import Shown, page

    decided = (*before, *assignment.mismatches(job.known))
    return Rendered({".report.html": page(Shown(clip, assignment, fit, decided, job.command))})


def _fits(
    clip: Clip, job: Job, notes: list[str]
) -> tuple[list[tuple[Assignment, SkeletonFit]], list[FitError]]:
    """The subjects of a clip that can be fitted, and why others cannot."""
    fits: list[tuple[Assignment, SkeletonFit]] = []
    failed: list[FitError] = []
    for assignment in associate(clip, job.known, job.subject):
        mismatches = assignment.mismatches(job.known)
        try:
            fit = job.fit(clip, assignment)
        except FitError as error:
            message = _named(assignment.subject, error.message)
            hints = [_other_root(error)] if isinstance(error, RootError) else [error.hint]
            failed.append(FitError(message, "; ".join(filter(None, [*hints, *mismatches])) or None))
            continue
        fits.append((assignment, fit))
        notes += [_named(fit.subject, note) for note in (*mismatches, *fit.notes)]
    if not fits:
        raise failed[0]
    return fits, failed


def _other_root(error: RootError) -> str | None:
    """What to do where the root is not in the clip: a figure that starts at what is."""
    if not error.seen:
        return error.hint
    figures = shipped_with_root(error.seen)
    if figures:
        return f"the clip shows {listed(error.seen, 5)}: try --skeleton {' or '.join(figures)}"
    return (
        f"{error.hint}; three markers are seen on {listed(error.seen)} only: --skeleton with a file of "
        "your own can start there"
    )


def _named(subject: str, note: str) -> str:
    return f"{subject}: {note}" if subject else note

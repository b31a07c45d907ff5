"""From a clip's file to its result files: the whole way for one clip, as every command goes it."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from mocap_skel.association import Assignment, Association, associate
from mocap_skel.clip import Clip
from mocap_skel.errors import CallError, FitError
from mocap_skel.export import WRITERS, Options
from mocap_skel.export.files import safe_name, write_all
from mocap_skel.fit import SkeletonFit, fit_skeleton
from mocap_skel.joint import BEST
from mocap_skel.readers import read_clip


@dataclass(frozen=True)
class Job:
    """What to do with every clip.

    Attributes:
        association: the markers and the skeleton; None = guessed for each clip, from names and motion.
        formats: names of `export.WRITERS`.
        folder: where the results go; None renders them only.
        overwrite: whether existing files may be replaced.
        subject: fit this one only.
        sigma: marker noise in metres, or three along the clip's axes; None = estimated.
        pose, method, noise: as `fit_skeleton` takes them.
        unit, rate: in place of what the clip says.
        options: what the writers are told.
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
    options: Options = field(default_factory=Options)

    @property
    def known(self) -> Association:
        """The association, where there is one: `process` guesses it before anything asks."""
        assert self.association is not None
        return self.association

    def fit(self, clip: Clip, assignment: Assignment) -> SkeletonFit:
        """One subject of a clip, fitted as the job says."""
        sigma = np.diag(np.square(self.sigma)) if isinstance(self.sigma, tuple) else self.sigma
        return fit_skeleton(
            clip, assignment, self.known.skeleton, sigma=sigma, pose=self.pose,
            method=self.method, noise=self.noise,
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
    folder = job.folder or Path()
    clip = read_clip(path, unit=job.unit, rate=job.rate)
    notes = list(clip.notes)
    if job.association is None:
        job = replace(job, association=_guessed(clip, job.subject, notes))
    fits, failed = _fits(clip, job, notes)
    files: dict[Path, str] = {}
    for fit in fits:
        subject = safe_name(fit.subject) if len(clip.subject_names) > 1 and fit.subject else ""
        stem = f"{path.stem}.{subject}" if subject else path.stem
        for name in job.formats:
            rendered = WRITERS[name](fit, job.options)
            notes += [_named(fit.subject, note) for note in rendered.notes]
            for suffix, text in rendered.files.items():
                target = folder / f"{stem}{suffix}"
                if target in files or target in taken:
                    raise CallError(
                        f"{path}: {target} is the result of another clip or subject of this call",
                        "choose with --subject, or use another -o",
                    )
                files[target] = text
    if job.folder is not None:
        write_all(files, job.overwrite)
    return Done(tuple(fits), files, tuple(dict.fromkeys(notes)), tuple(failed))


def _guessed(clip: Clip, subject: str | None, notes: list[str]) -> Association:
    """The association that the clip's own names and motion give, where that is sure."""
    from mocap_skel.guess import check_sure, guess_association, in_words

    found = guess_association(clip, subject)
    check_sure(found)
    notes.append(f"no --assoc, so it is guessed from names and motion: {in_words(found)}")
    return found.association()


def _fits(clip: Clip, job: Job, notes: list[str]) -> tuple[list[SkeletonFit], list[FitError]]:
    """The subjects of a clip that can be fitted, and why others cannot."""
    fits: list[SkeletonFit] = []
    failed: list[FitError] = []
    for assignment in associate(clip, job.known, job.subject):
        mismatches = assignment.mismatches(job.known)
        try:
            fit = job.fit(clip, assignment)
        except FitError as error:
            message = _named(assignment.subject, error.message)
            hint = "; ".join([*([error.hint] if error.hint else []), *mismatches])
            failed.append(FitError(message, hint or None))
            continue
        fits.append(fit)
        notes += [_named(fit.subject, note) for note in (*mismatches, *fit.notes)]
    if not fits:
        raise failed[0]
    return fits, failed


def _named(subject: str, note: str) -> str:
    return f"{subject}: {note}" if subject else note

"""From a clip's file to its result files: the whole way for one clip, as every command goes it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from mocap_skel.association import Association, associate
from mocap_skel.clip import Clip
from mocap_skel.errors import CallError, FitError
from mocap_skel.export import SUFFIXES, WRITERS, Options
from mocap_skel.export.files import check_free, safe_name, write_all
from mocap_skel.fit import SkeletonFit, fit_skeleton
from mocap_skel.readers import read_clip


@dataclass(frozen=True)
class Job:
    """What to do with every clip.

    Attributes:
        association: the markers and the skeleton.
        formats: names of `export.WRITERS`.
        folder: where the results go; None renders them only.
        overwrite: whether existing files may be replaced.
        subject: fit this one only.
        sigma: marker noise in metres, None = estimated.
        pose: one of `fit.POSES`.
        unit, rate: in place of what the clip says.
        options: what the writers are told.
    """

    association: Association
    formats: tuple[str, ...] = ("csv",)
    folder: Path | None = None
    overwrite: bool = False
    subject: str | None = None
    sigma: float | None = None
    pose: str = "least-squares"
    unit: str | None = None
    rate: float | None = None
    options: Options = field(default_factory=Options)


@dataclass(frozen=True)
class Done:
    """One clip's fits, its result files with their contents, and what there is to say about it."""

    fits: tuple[SkeletonFit, ...]
    files: dict[Path, str]
    notes: tuple[str, ...]


def process(path: Path, job: Job) -> Done:
    """Read, fit, render and write one clip; its files appear together or not at all.

    Raises:
        MocapSkelError: the clip cannot be read, fitted, or written.
    """
    folder = job.folder or Path()
    if job.folder is not None:
        # A clip that was done before is refused before any work; several subjects only after reading.
        check_free(
            [folder / f"{path.stem}{suffix}" for name in job.formats for suffix in SUFFIXES[name]],
            job.overwrite,
        )
    clip = read_clip(path, unit=job.unit, rate=job.rate)
    notes = list(clip.notes)
    fits = _fits(clip, job, notes)
    files: dict[Path, str] = {}
    for fit in fits:
        subject = safe_name(fit.subject) if len(clip.subject_names) > 1 and fit.subject else ""
        stem = f"{path.stem}.{subject}" if subject else path.stem
        for name in job.formats:
            rendered = WRITERS[name](fit, job.options)
            notes += [_named(fit.subject, note) for note in rendered.notes]
            for suffix, text in rendered.files.items():
                if folder / f"{stem}{suffix}" in files:
                    raise CallError(
                        f"{path}: two subjects would write {stem}{suffix}", "choose with --subject"
                    )
                files[folder / f"{stem}{suffix}"] = text
    if job.folder is not None:
        write_all(files, job.overwrite)
    return Done(tuple(fits), files, tuple(dict.fromkeys(notes)))


def _fits(clip: Clip, job: Job, notes: list[str]) -> list[SkeletonFit]:
    """The subjects of a clip that can be fitted; why another cannot goes into the notes."""
    fits: list[SkeletonFit] = []
    failed: list[FitError] = []
    for assignment in associate(clip, job.association, job.subject):
        try:
            fit = fit_skeleton(
                clip, assignment, job.association.skeleton, sigma=job.sigma, pose=job.pose
            )
        except FitError as error:
            failed.append(error)
            continue
        fits.append(fit)
        notes += [
            _named(fit.subject, n) for n in (*assignment.mismatches(job.association), *fit.notes)
        ]
    if not fits:
        raise failed[0]
    notes += [error.message for error in failed]
    return fits


def _named(subject: str, note: str) -> str:
    return f"{subject}: {note}" if subject else note

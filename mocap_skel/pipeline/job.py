"""What to do with clips, and the one way from a clip's file to its fits: read, associate or guess, fit."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from mocap_skel.clip import Clip
from mocap_skel.errors import FitError, RootError
from mocap_skel.export.registry import Chosen, choose
from mocap_skel.figure.skeleton import Skeleton, shipped_with_root
from mocap_skel.fit import fit_skeleton
from mocap_skel.joints.calibration import Calibration
from mocap_skel.joints.choices import BEST
from mocap_skel.labels.association import Assignment, Association, associate
from mocap_skel.pipeline.naming import Named, name_markers
from mocap_skel.readers import read_clip
from mocap_skel.results.body_size import check_size, check_size_by_names
from mocap_skel.results.upright import upright
from mocap_skel.skeleton_fit import SkeletonFit
from mocap_skel.text import listed


@dataclass(frozen=True)
class Job:
    """What to do with every clip.

    Attributes:
        association: the markers and the skeleton; None = guessed for each clip, from names and motion.
        formats: the results, and what each format is told.
        folder: where the results go; None renders them only.
        overwrite: whether existing files may be replaced.
        inputs: files that never are: all that the call reads.
        subject: fit this one only.
        sigma: marker noise in metres, or three along the clip's axes; None = estimated.
        pose, method, noise, prior: as `fit_skeleton` takes them.
        calibration: what other clips of the actor know of the joints.
        unit, rate: in place of what the clip says.
        salvage: read what there is of a clip whose file is cut off.
        mirror: the axis to negate when a clip is read, None for none.
        clip_up: what points up in a clip, in place of what the clip and the body say.
        trust: fit the markers as they are named, though some look exchanged.
        measures: of the person, full name (`measures.MEASURES`) → metres.
        static: a clip whose mean pose is neutral for angles.
        command: the call, as the page shows it.
        figure: the one that was asked for, which the association has; None = its own, or the parts that a clip shows.
        strict: without an association, no clear name may contradict the movement.
    """

    association: Association | None
    formats: tuple[Chosen, ...] = field(default_factory=choose)
    folder: Path | None = None
    overwrite: bool = False
    inputs: frozenset[Path] = frozenset()
    subject: str | None = None
    sigma: float | tuple[float, ...] | None = None
    pose: str = "least-squares"
    method: str = BEST
    noise: str = "rigid"
    prior: str = "skeleton"
    calibration: Calibration | None = None
    unit: str | None = None
    rate: float | None = None
    salvage: bool = False
    mirror: str | None = None
    clip_up: str | None = None
    trust: bool = False
    measures: Mapping[str, float] = field(default_factory=dict)
    static: Path | None = None
    command: str = ""
    figure: Skeleton | None = None
    strict: bool = False

    def read(self, path: Path) -> Clip:
        """A clip, read as the job says.

        Raises:
            ClipError: it cannot be read.
        """
        return read_clip(
            path, unit=self.unit, rate=self.rate, salvage=self.salvage,
            mirror=self.mirror, up=self.clip_up,
        )  # fmt: skip

    def named(self, clip: Clip) -> Named:
        """Whose the clip's trajectories are and which is which marker, told or guessed.

        Raises:
            CallError: neither is sure.
        """
        return name_markers(
            clip, self.association, subject=self.subject, figure=self.figure, strict=self.strict,
            how=self.how,
        )  # fmt: skip

    @property
    def how(self) -> list[str]:
        """The options that a command in a hint has to repeat, to read the same clip."""
        from mocap_skel.labels.guess import repeated

        return repeated(
            self.subject, self.unit, self.rate,
            salvage=self.salvage, mirror=self.mirror, clip_up=self.clip_up,
        )  # fmt: skip

    @property
    def known(self) -> Association:
        """The association, where there is one: `fit_file` guesses it before anything asks."""
        assert self.association is not None
        return self.association

    def fit(self, clip: Clip, assignment: Assignment, *, search: bool = True) -> SkeletonFit:
        """One subject of a clip, fitted as the job says.

        Raises:
            CallError: the body is of a size that says that the unit is wrong.
        """
        check_size(clip, assignment)
        sigma = np.diag(np.square(self.sigma)) if isinstance(self.sigma, tuple) else self.sigma
        return fit_skeleton(
            clip, assignment, self.known.skeleton, sigma=sigma, pose=self.pose,
            method=self.method, noise=self.noise, search=search, prior=self.prior,
            calibration=self.calibration, trust=self.trust, measures=self.measures,
        )  # fmt: skip


@dataclass(frozen=True)
class Fitted:
    """A clip and what was fitted to it.

    Attributes:
        clip: as it was read.
        association: the markers and the skeleton, guessed where the job had none.
        subjects: which column is which marker, and the fit, of every subject that could be fitted.
        decided: what was decided about the file and its names before any fit, one sentence each.
        notes: all there is to say, that too, one sentence each.
        failed: why other subjects of the clip could not be fitted.
    """

    clip: Clip
    association: Association
    subjects: tuple[tuple[Assignment, SkeletonFit], ...]
    decided: tuple[str, ...]
    notes: tuple[str, ...]
    failed: tuple[FitError, ...]


def fit_file(
    path: Path, job: Job, before: Callable[[Clip, Sequence[Assignment]], None] | None = None
) -> Fitted:
    """Read a clip, guess what is not told, and fit its subjects.

    Args:
        path: the clip.
        job: what to do with it.
        before: is called when it is known who is in the clip, and before any of them is fitted.

    Raises:
        MocapSkelError: the clip cannot be read, or none of its subjects be fitted.
    """
    clip = job.read(path)
    if job.association is None:
        check_size_by_names(clip, job.subject)
    found = job.named(clip)
    several = len(found.associations) > 1
    # A part of the body is a subject that the call need not know.
    jobs = [
        replace(job, association=one, subject=None if several else job.subject)
        for one in found.associations
    ]
    assigned = [associate(found.clip, part.known, part.subject) for part in jobs]
    if before is not None:
        before(found.clip, [one for part in assigned for one in part])
    clip = upright(found.clip, assigned[0], jobs[0].known.skeleton)
    notes = [*found.notes, *(note for note in clip.notes if note not in found.notes)]
    decided = tuple(notes)
    subjects: list[tuple[Assignment, SkeletonFit]] = []
    failed: list[FitError] = []
    for part, assignments in zip(jobs, assigned, strict=True):
        fits, without = _fits(clip, assignments, part, notes)
        subjects += fits
        failed += without
    if not subjects:
        raise _why(clip, failed[0])
    said = tuple(dict.fromkeys(notes))
    return Fitted(clip, found.association, tuple(subjects), decided, said, tuple(failed))


def static_fits(job: Job) -> dict[str, SkeletonFit]:
    """The fits of the job's static clip by subject; none without one.

    Raises:
        MocapSkelError: the clip cannot be read, or none of its subjects be fitted.
    """
    if job.static is None:
        return {}
    return {fit.subject: fit for _, fit in fit_file(job.static, job).subjects}


def static_of(fits: Mapping[str, SkeletonFit], fit: SkeletonFit) -> SkeletonFit | None:
    """The static fit of a subject: by its name, or the only one there is."""
    if fit.subject in fits:
        return fits[fit.subject]
    return next(iter(fits.values())) if len(fits) == 1 else None


def _fits(
    clip: Clip, assignments: Sequence[Assignment], job: Job, notes: list[str]
) -> tuple[list[tuple[Assignment, SkeletonFit]], list[FitError]]:
    """The subjects of a clip that can be fitted, and why others cannot."""
    fits: list[tuple[Assignment, SkeletonFit]] = []
    failed: list[FitError] = []
    for assignment in assignments:
        mismatches = assignment.mismatches(job.known)
        try:
            fit = job.fit(clip, assignment)
        except FitError as error:
            message = named(assignment.subject, error.message)
            hints = [_other_root(error)] if isinstance(error, RootError) else [error.hint]
            failed.append(FitError(message, "; ".join(filter(None, [*hints, *mismatches])) or None))
            continue
        fits.append((assignment, fit))
        notes += [named(fit.subject, note) for note in (*mismatches, *fit.notes)]
    return fits, failed


def _why(clip: Clip, error: FitError) -> FitError:
    """The error, in place of all that every joint lacks what the whole clip lacks."""
    from mocap_skel.labels.guess.missing import what_is_missing

    missing = "" if isinstance(error, RootError) else what_is_missing(clip)
    if not missing:
        return error
    hint = "fit a clip of movement with the same markers"
    return FitError(f"{clip.name}: no joint can be fitted: {missing}", hint)


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


def named(subject: str, note: str) -> str:
    """A note, with whom it is about where that is said."""
    return f"{subject}: {note}" if subject else note

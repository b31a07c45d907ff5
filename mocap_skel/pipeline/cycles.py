"""From the call of `cycles` to its files: fit the clips, take their strides, add them up."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from mocap_skel.angles.joint_angles import joint_angles
from mocap_skel.errors import CallError, ClipError, FitError, MocapSkelError
from mocap_skel.export.files import check_free, write_all
from mocap_skel.export.tables_csv import rows_csv
from mocap_skel.figure.angle_table import angle_table
from mocap_skel.gait.cycles import (
    Cycle,
    MeanCycle,
    cycle_rows,
    cycles_of,
    mean_cycles,
    mean_rows,
    strides,
)
from mocap_skel.gait.events import foot_events
from mocap_skel.pipeline.engine import seconds_for
from mocap_skel.pipeline.isolation import TaskError, Worker
from mocap_skel.pipeline.job import Job, fit_file, static_fits, static_of
from mocap_skel.pipeline.limits import limited, memory_for
from mocap_skel.report.figures import check_figures, picture
from mocap_skel.results.series import sideless
from mocap_skel.skeleton_fit import SkeletonFit
from mocap_skel.text import listed, nearest, visible

USUAL = ("Hip", "Knee", "Ankle")
"""Joints of a call that names none."""
# Joints in the files' names; more are called so.
_FEW, _MANY = 3, "angles"


@dataclass(frozen=True)
class Wanted:
    """What to make.

    Attributes:
        joints: as the table of angles has them.
        stem: what the files are called by.
        by: whose events count, one of `gait.events.BY`.
        folder: for the files.
        kind: of the picture, one of `report.figures.KINDS`; "" for none.
        overwrite: whether existing files may be replaced.
    """

    joints: tuple[str, ...]
    stem: str
    by: str = "auto"
    folder: Path = field(default_factory=Path)
    kind: str = "png"
    overwrite: bool = False

    @property
    def files(self) -> dict[str, Path]:
        """What is written: the means, the single cycles, the picture."""
        suffixes = {"mean": ".cycles.csv", "each": ".cycles.each.csv"}
        if self.kind:
            suffixes["picture"] = f".cycles.{self.kind}"
        return {name: self.folder / f"{self.stem}{end}" for name, end in suffixes.items()}


@dataclass(frozen=True, eq=False)
class Added:
    """What came of the clips: means, files, notes with the clip in front, why clips failed or none has a cycle."""

    means: tuple[MeanCycle, ...]
    files: tuple[Path, ...]
    notes: tuple[str, ...]
    failed: tuple[Exception, ...]


def named_joints(names: Sequence[str]) -> tuple[tuple[str, ...], str]:
    """Joints by their names or by what both sides share, and what files of them are called by.

    Raises:
        CallError: there is no such joint.

    >>> named_joints(["Knee"])
    (('LeftKnee', 'RightKnee'), 'Knee')
    >>> named_joints(["LeftHip", "Hips"])
    (('LeftHip', 'Hips'), 'LeftHip-Hips')
    """
    names = list(dict.fromkeys(names)) or list(USUAL)
    known = [rule.name for rule in angle_table().angles]
    found: list[str] = []
    for name in names:
        own = [joint for joint in known if name in (joint, sideless(joint))]
        if not own:
            hint = nearest(name, [*known, *map(sideless, known)])
            raise CallError(
                f"no joint {name!r} has angles", hint or f"there are {listed(known, 20)}"
            )
        found += sorted(own)
    return tuple(dict.fromkeys(found)), "-".join(names) if len(names) <= _FEW else _MANY


def add_up(paths: Sequence[Path], job: Job, wanted: Wanted) -> Added:
    """Fit clips, and write the mean and the single cycles of some joints; a clip that fails does not stop the others.

    Where no clip has a cycle, nothing is written, and the failures say why.

    Raises:
        CallError: one clip twice; files that are there already; matplotlib is not installed.
        MocapSkelError: the static clip cannot be used, or the files cannot be written.
    """
    if wanted.kind:
        check_figures()
    real = [path.resolve() for path in paths]
    if twice := [path for path, file in zip(paths, real, strict=True) if real.count(file) > 1]:
        raise CallError(f"{twice[0]}: given twice, and its cycles would count twice")
    check_free(wanted.files.values(), wanted.overwrite, job.inputs)
    notes: list[str] = []
    failed: list[Exception] = []
    shown: list[_Shown] = []
    for path, one in _shown(paths, job, wanted, static_fits(job)):
        if isinstance(one, Exception):
            failed.append(one)
            continue
        shown.append(one)
        notes += [f"{path}: {note}" for note in dict.fromkeys(one.notes)]
    names = [one.path.name for one in shown]
    cycles = [
        # Of two clips of one name, the folder tells which is which.
        replace(cycle, clip=visible(str(one.path))) if names.count(one.path.name) > 1 else cycle
        for one in shown
        for cycle in one.cycles
    ]
    if not cycles:
        if shown:
            called = listed((visible(name) for name in names), 4)
            reasons = listed(dict.fromkeys(one.why_none for one in shown), 4)
            none = f"{called}: no gait cycle of {listed(wanted.joints)}: {reasons}"
            failed.append(FitError(none))
        return Added((), (), tuple(notes), tuple(failed))
    means = mean_cycles(cycles)
    contents: dict[Path, str | bytes] = {
        wanted.files["mean"]: rows_csv(mean_rows(means)),
        wanted.files["each"]: rows_csv(cycle_rows(cycles)),
    }
    if wanted.kind:
        from mocap_skel.report.cycle_figure import cycles_figure

        contents[wanted.files["picture"]] = picture(*cycles_figure(means), wanted.kind)
    write_all(contents, wanted.overwrite, job.inputs)
    return Added(tuple(means), tuple(contents), tuple(notes), tuple(failed))


def _shown(
    paths: Sequence[Path], job: Job, wanted: Wanted, statics: Mapping[str, SkeletonFit]
) -> Iterator[tuple[Path, _Shown | Exception]]:
    """What each clip shows, or why nothing: one clip here, several in a child that may die instead of us."""
    if len(paths) == 1:
        try:
            with limited(paths[0]):
                yield paths[0], _of_clip(paths[0], job, wanted, statics)
        except MocapSkelError as error:
            yield paths[0], error
        return
    with Worker() as worker:
        for path in paths:
            worker.start(
                _of_clip, path, job, wanted, statics,
                memory=memory_for(path), seconds=seconds_for(path),
            )  # fmt: skip
            result: _Shown | Exception
            try:
                result = worker.result()
            except TaskError as error:
                result = ClipError(f"{path}: {error}")
            except Exception as error:
                result = error
            yield path, result


@dataclass(frozen=True, eq=False)
class _Shown:
    """The cycles of one clip, what there is to say about it, and why it has none."""

    path: Path
    cycles: tuple[Cycle, ...]
    notes: tuple[str, ...]
    why_none: str


def _of_clip(path: Path, job: Job, wanted: Wanted, statics: Mapping[str, SkeletonFit]) -> _Shown:
    found = fit_file(path, job)
    if len(found.subjects) > 1:
        known = ", ".join(fit.subject for _, fit in found.subjects)
        raise CallError(f"{path}: several subjects", f"choose with --subject: {known}")
    fit = found.subjects[0][1]
    angles = joint_angles(fit, static_of(statics, fit))
    events = foot_events(fit, found.clip, wanted.by)
    # A note about one joint has its name in front.
    others = {joint.rule.name for joint in angles.joints} - set(wanted.joints)
    about = [note for note in angles.notes if note.partition(":")[0] not in others]
    said = [*found.notes, *about, *events.notes]
    own = strides(events.of_feet, said)
    cycles = tuple(cycles_of(angles, own, wanted.joints, visible(path.name), fit.subject))
    if cycles:
        return _Shown(path, cycles, tuple(said), "")
    if not events.of_feet:
        why = events.notes[0]
    elif not own:
        why = "no foot strikes twice in it"
    else:
        why = f"its strides do not show {listed(wanted.joints)}"
    return _Shown(path, (), (*said, f"no cycle: {why}"), why)

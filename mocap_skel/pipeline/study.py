"""From the call of a study to its result files."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from mocap_skel.clip import Clip
from mocap_skel.errors import CallError, OutputError
from mocap_skel.export.files import check_folder, check_free, safe_name, write_all
from mocap_skel.export.tables_csv import rows_csv
from mocap_skel.extras import extra
from mocap_skel.labels.association import Assignment, associate
from mocap_skel.pipeline.job import Job
from mocap_skel.pipeline.limits import limited
from mocap_skel.skeleton_fit import SkeletonFit
from mocap_skel.studies import accuracy, speed, tables
from mocap_skel.studies.parallel import in_parallel
from mocap_skel.studies.resample import (
    ENOUGH,
    NEAR,
    SHARE,
    Answer,
    Summary,
    refits,
    summarise,
)
from mocap_skel.text import counted
from mocap_skel.version import __version__

Item = TypeVar("Item")
# Wraps the parts of a study while they are done: (parts, how many) → the same parts.
Progress = Callable[[Iterable[Any], int], Iterable[Any]]
# Levels of a pass that one task refits.
_AT_ONCE = 10


def no_progress(parts: Iterable[Any], count: int) -> Iterable[Any]:
    """Tell nobody."""
    del count
    return parts


@dataclass(frozen=True)
class Where:
    """Where a study's results go.

    Attributes:
        folder: for the files.
        overwrite: whether existing ones may be replaced.
        figures: whether figures are drawn, which needs matplotlib.
        command: for the captions.
        progress: wraps what takes long.
        workers: processes; as many as cores if None.
        inputs: files that are never replaced: all that the call reads.
    """

    folder: Path
    overwrite: bool = False
    figures: bool = True
    command: str = ""
    progress: Progress = no_progress
    workers: int | None = None
    inputs: frozenset[Path] = frozenset()

    def names(self, stem: str, csv: Sequence[str], png: Sequence[str]) -> dict[str, Path]:
        """Result files by suffix, after it has been seen that they can be written.

        Raises:
            OutputError: one exists already, or is an input.
            MissingExtraError: matplotlib is missing.
        """
        if self.figures:
            from mocap_skel.report.figures import check_figures

            check_figures()
        suffixes = [f"{name}.csv" for name in csv]
        suffixes += [f"{name}.png" for name in png] if self.figures else []
        paths = {suffix: self.folder / f"{stem}.{suffix}" for suffix in suffixes}
        check_free(paths.values(), self.overwrite, self.inputs)
        return paths


@dataclass(frozen=True)
class Findings:
    """What a study found: its tables by name, what they say in words, the files, notes on the clip."""

    tables: dict[str, list[tables.Row]]
    words: list[str]
    files: list[Path] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def _written(
    where: Where,
    names: dict[str, Path],
    findings: Findings,
    figures: dict[str, Callable[[], bytes]],
) -> Findings:
    contents: dict[Path, str | bytes] = {}
    for suffix, path in names.items():
        stem, _, kind = suffix.rpartition(".")
        contents[path] = rows_csv(findings.tables[stem]) if kind == "csv" else figures[stem]()
    write_all(contents, where.overwrite, where.inputs)
    return replace(findings, files=list(contents))


@dataclass(frozen=True)
class Resampling:
    """The thesis's plan (6.1): passes, and in each a refit without 0 to `levels` - 1 percent of the frames."""

    passes: int = 4
    levels: int = 100
    seed: int = 0


def resample(path: Path, job: Job, plan: Resampling, where: Where) -> Findings:
    """Thesis 6.1 for one subject of a clip.

    Each pass is put by when it is done: the same call after an interruption goes on from there.

    Raises:
        MocapSkelError: the clip cannot be read or fitted, or its results not be written.
    """
    with limited(path):
        clip = job.named(job.read(path)).clip
    subjects = associate(clip, job.known, job.subject)
    if len(subjects) > 1:
        known = ", ".join(subject.subject for subject in subjects)
        raise CallError(f"{path}: the study takes one subject", f"choose with --subject: {known}")
    subject = subjects[0]
    several = len(clip.subject_names) > 1 and subject.subject
    stem = f"{path.stem}.{safe_name(subject.subject)}" if several else path.stem
    csv = ("answers", "means", "deviations", "power_law")
    names = where.names(f"{stem}.resample", csv, ["figure24"])
    # The whole clip first: one that cannot be fitted, or a folder that cannot be written to, is told at once.
    whole = job.fit(clip, subject)
    clip = _without(clip, subject, whole)
    check_folder(where.folder)
    store = _Store(where.folder / f".{stem}.resample-{_key(clip, subject, job, plan)}")
    answers = _all_passes(clip, subject, job, plan, where, store)
    summary = summarise(answers)
    asked = plan.passes * plan.levels
    verdicts = {joint.joint: joint.shown for joint in whole.joints}
    found = Findings(
        {
            "answers": tables.answer_rows(summary, answers),
            "means": tables.mean_rows(summary.groups, verdicts),
            "deviations": tables.deviation_rows(summary.groups),
            "power_law": tables.law_rows(summary.laws, verdicts),
        },
        [
            f"{path}: {clip.frames} frames, {counted(asked, 'refit')} of the whole figure "
            f"({counted(plan.passes, 'pass', 'passes')}, 0 to {plan.levels - 1} % left out, seed {plan.seed})",
            *_in_words(summary, asked - len({(a.passed, a.level) for a in answers})),
        ],
        notes=[*clip.notes, *subject.mismatches(job.known), *whole.notes],
    )
    caption = f"{path.name}, {asked} refits, seed {plan.seed}: {where.command}"

    def figure24() -> bytes:
        from mocap_skel.studies.figures import deviations_figure

        return deviations_figure(summary, caption)

    done = _written(where, names, found, {"figure24": figure24})
    store.forget()
    return done


def _without(clip: Clip, subject: Assignment, whole: SkeletonFit) -> Clip:
    """The clip without the samples that its fit has left out: in frames that are drawn from it, they
    could not be told from others by their steps.
    """
    points = clip.points.copy()
    for left in whole.left_out:
        points[left.frames - clip.first_frame, subject.columns[left.segment][left.marker]] = np.nan
    return replace(clip, points=points)


def _in_words(summary: Summary, failed: int) -> list[str]:
    words = [f"{failed} of them could not be fitted"] if failed else []
    law = summary.laws[-1]
    if np.isfinite(law.slope):
        words.append(
            f"deviation falls with the samples as n^{law.slope:.2f} ± {law.slope_error:.2f}; as "
            f"(n N/(N - n))^{law.finite_slope:.2f} when it counts that all n come from one clip of N"
        )
    if np.isfinite(law.near):
        words.append(
            f"{100 * law.near:.1f} % of the answers from more than {ENOUGH} samples lie within "
            f"{100 * NEAR:g} cm of their joint's mean"
        )
    total = Counter(answer.joint for answer in summary.answers)
    several: Counter[str] = Counter()
    odd: Counter[str] = Counter()
    for group in summary.groups:
        if group.cluster > 1:
            # A share of the joint's answers that is worth the name, or strays.
            often = group.answers >= max(3, SHARE * total[group.joint])
            (several if often else odd)[group.joint] += group.answers
    for text, counts in (
        ("joints with several answers, each measured about its own mean", several),
        ("joints with odd answers, by other axes or another method", odd),
    ):
        shown = [f"{joint} ({count} of {total[joint]})" for joint, count in counts.items()]
        if shown:
            words.append(f"{text}: {', '.join(shown)}")
    return words


def _all_passes(
    clip: Clip, subject: Assignment, job: Job, plan: Resampling, where: Where, store: _Store
) -> list[Answer]:
    known = {number: store.read(number) for number in range(plan.passes)}
    blocks = [range(k, min(k + _AT_ONCE, plan.levels)) for k in range(0, plan.levels, _AT_ONCE)]
    tasks = [
        (number, block)
        for number in range(plan.passes)
        if known[number] is None
        for block in blocks
    ]
    work = in_parallel(partial(_refit_block, clip, subject, job, plan.seed), tasks, where.workers)
    current: list[Answer] = []
    for (number, block), answers in zip(tasks, where.progress(work, len(tasks)), strict=True):
        current += answers
        if block is blocks[-1]:
            store.write(number, current)
            known[number], current = current, []
    return [answer for number in range(plan.passes) for answer in known[number] or []]


def _refit_block(
    clip: Clip, subject: Assignment, job: Job, seed: int, task: tuple[int, range]
) -> list[Answer]:
    return refits(clip, lambda part: job.fit(part, subject, search=False), task[0], task[1], seed)


def _key(clip: Clip, subject: Assignment, job: Job, plan: Resampling) -> str:
    """A name for what the answers depend on, so that only the same study is ever gone on with."""
    options = (job.sigma, job.pose, job.method, job.noise, job.known.skeleton)
    text = repr((__version__, subject.columns, options, plan.levels, plan.seed))
    return hashlib.sha256(text.encode() + clip.points.tobytes()).hexdigest()[:12]


@dataclass(frozen=True)
class _Store:
    """Passes that are done, put by until the study is."""

    folder: Path

    def _file(self, number: int) -> Path:
        return self.folder / f"pass{number}.json"

    def read(self, number: int) -> list[Answer] | None:
        try:
            return [Answer(**row) for row in json.loads(self._file(number).read_text())]
        except (OSError, ValueError, TypeError):
            return None

    def write(self, number: int, answers: list[Answer]) -> None:
        text = json.dumps([asdict(answer) for answer in answers])
        write_all({self._file(number): text}, overwrite=True)

    def forget(self) -> None:
        try:
            shutil.rmtree(self.folder)
        except OSError as error:
            raise OutputError(f"{self.folder}: {error.strerror}") from error


def run_speed(trials: int, most_points: int, seed: int, where: Where) -> Findings:
    """Thesis 6.4: the time of every estimator against points and noise.

    Raises:
        MocapSkelError: SciPy or matplotlib is missing, or the results cannot be written.
    """
    extra("scipy.optimize", "mle")
    names = where.names("speed", ["trials", "ratios"], ["figure26", "figure27"])
    check_folder(where.folder)
    work = speed.trials(trials, most_points, seed)
    done: list[speed.Trial] = list(where.progress(work, trials))
    ratios, least = speed.ratios(done), speed.threshold(done)
    low, high = speed.NOISE_RANGE
    words = [
        f"{trials} point sets of 10 to {most_points:,} points, noise {low:g} to {high:g}, seed {seed}; ratios "
        f"over those of {least:,} points or more",
        f"IGDK one sample at a time: {1e6 * speed.time_of_a_sample():.0f} microseconds a sample",
    ]
    found = Findings(
        {"trials": tables.trial_rows(done), "ratios": tables.ratio_rows(ratios)}, words
    )
    caption = f"{trials} point sets, seed {seed}: {where.command}"

    def figure26() -> bytes:
        from mocap_skel.studies.figures import times_figure

        return times_figure(done, caption)

    def figure27() -> bytes:
        from mocap_skel.studies.figures import ratios_figure

        return ratios_figure(done, least, caption)

    return _written(where, names, found, {"figure26": figure26, "figure27": figure27})


def run_accuracy(plan: accuracy.Plan, where: Where) -> Findings:
    """Thesis 6.6: bias and error of every estimator against the bound, and what is known of the noise.

    Raises:
        MocapSkelError: SciPy or matplotlib is missing, or the results cannot be written.
    """
    extra("scipy.optimize", "mle")
    names = where.names("accuracy", ["scores", "noise", "markers"], ["map"])
    check_folder(where.folder)
    parts: list[Callable[[], list[Any]]] = [
        *(partial(accuracy.score_cell, plan, cell) for cell in plan.cells),
        partial(accuracy.score_noise, plan),
        partial(accuracy.score_markers, plan),
    ]
    work = in_parallel(_call, parts, where.workers)
    *cells, noise, markers = where.progress(work, len(parts))
    scores = [score for cell in cells for score in cell]
    found = Findings(
        {
            "scores": tables.score_rows(scores),
            "noise": tables.noise_rows(noise),
            "markers": tables.marker_rows(markers),
        },
        [
            f"{plan.trials} trials of {plan.count} points a cell, seed {plan.seed}; an estimator breaks over "
            f"{accuracy.BREAKS} times the bound, over {accuracy.NOTHING} radii, or without an answer",
            *accuracy.verdicts(scores),
        ],
    )
    caption = (
        f"{plan.trials} trials of {plan.count} points a cell, seed {plan.seed}: {where.command}"
    )

    def figure() -> bytes:
        from mocap_skel.studies.figures import accuracy_figure

        return accuracy_figure(scores, caption)

    return _written(where, names, found, {"map": figure})


def _call(part: Callable[[], Item]) -> Item:
    return part()

"""mocap-skel study: the thesis's experiments, on a clip or on generated points."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import click

from mocap_skel.cli import options, say, warn
from mocap_skel.cli.jobs import Told, job_of

if TYPE_CHECKING:
    from mocap_skel.pipeline.study import Findings, Where


@click.group("study", epilog="Example: mocap-skel study resample walk.c3d --assoc cmu -o study")
def command() -> None:
    """Repeat the thesis's experiments: what resampling, speed and accuracy say of the estimators.

    Needs the extra 'studies': pip install 'mocap-skel[studies]'.
    """


class _How(TypedDict):
    """What `options.findings` say, under the names of their parameters."""

    figures: bool
    folder: Path
    overwrite: bool
    as_json: bool
    quiet: bool


class _Resample(Told, _How):
    """Those, and how the clip is read and fitted."""


workers = click.option(
    "--workers", type=click.IntRange(1), metavar="N", show_default="one a core", help="Processes."
)


@command.command(
    "resample",
    short_help="Refit a clip with frames left out at random (6.1).",
    epilog="Example: mocap-skel study resample walk.c3d --assoc cmu -o study",
)
@options.clip
@options.which
@click.option(
    "--passes", type=click.IntRange(1), default=4, show_default=True, help="Passes over all levels."
)
@click.option(
    "--levels", type=click.IntRange(1, 100), default=100, show_default=True,
    help="Refits in a pass: without 0, 1, 2 ... percent of the frames.",
)  # fmt: skip
@options.seed
@options.pure_estimation
@options.reading
@workers
@options.findings
def resample(
    clip: Path,
    passes: int,
    levels: int,
    seed: int,
    workers: int | None,
    **told: Unpack[_Resample],
) -> int:
    """Refit CLIP's whole figure with frames left out at random, and see how the joints scatter (6.1).

    Writes, for walk.c3d: walk.resample.means.csv and .deviations.csv (the thesis's tables 2 and 3),
    .power_law.csv, .answers.csv (every refit's joints) and .figure24.png. Joints that have two distinct
    answers are found and measured about each answer's own mean. A pass is kept when it is done, in a
    hidden folder beside the results: after an interruption, the same call goes on from there.
    """
    from mocap_skel.pipeline import study as run

    if told["association"] is None:
        raise options.missing_association()
    job = job_of(told, [clip])
    where = replace(_where(told, "tens of refits", workers), inputs=job.inputs)
    found = run.resample(clip, job, run.Resampling(passes, levels, seed), where)
    tables = {
        "Means of the joints' constants, m (thesis table 2)": "means",
        "Their standard deviations, m (thesis table 3)": "deviations",
        "Deviation against the number of samples (thesis figure 24)": "power_law",
    }
    for note in [] if told["quiet"] else found.notes:
        warn(f"{clip}: {note}")
    return _show(found, tables, told["as_json"])


@command.command(
    "speed",
    short_help="Time every estimator (6.4).",
    epilog="Example: mocap-skel study speed --trials 100 -o study",
)
@click.option(
    "--trials", type=click.IntRange(1), default=200, show_default=True, help="Point sets to time."
)
@click.option(
    "--most-points", type=click.IntRange(100, 10_000_000), default=1_000_000, show_default=True,
    help="Of one set.",
)  # fmt: skip
@options.seed
@options.findings
def speed(trials: int, most_points: int, seed: int, **how: Unpack[_How]) -> int:
    """Time every estimator on point sets from the thesis's ranges (6.4).

    Writes speed.trials.csv, speed.ratios.csv (beside the thesis's ratios), speed.figure26.png and
    speed.figure27.png. On one core.
    """
    from mocap_skel.studies.parallel import use_one_core

    use_one_core()
    from mocap_skel.pipeline import study as run

    where = _where(how, "sets")
    found = run.run_speed(trials, most_points, seed, where)
    return _show(found, {"Time against GDKE's": "ratios"}, how["as_json"])


@command.command(
    "accuracy",
    short_help="Error of every estimator against the bound (6.6).",
    epilog="Example: mocap-skel study accuracy --trials 50 -o study",
)
@click.option(
    "--trials", type=click.IntRange(2), default=200, show_default=True, help="Point sets a cell."
)
@click.option(
    "--points",
    type=click.IntRange(20, 100_000),
    default=1000,
    show_default=True,
    help="Of one set.",
)
@options.seed
@workers
@options.findings
def accuracy(trials: int, points: int, seed: int, workers: int | None, **how: Unpack[_How]) -> int:
    """Bias and error of every estimator against the Cramér-Rao bound, over noise and coverage (6.6).

    Writes accuracy.scores.csv (every estimator in every cell), accuracy.noise.csv (a noise matrix
    estimated, thesis 6.7), accuracy.markers.csv (markers of different noise) and accuracy.map.png,
    where each estimator breaks, with the criterion's line.
    """
    from mocap_skel.pipeline import study as run
    from mocap_skel.studies.accuracy import Plan

    where = _where(how, "cells", workers)
    found = run.run_accuracy(Plan(count=points, trials=trials, seed=seed), where)
    tables = {
        "A noise matrix, σ along x, y, z in radii (thesis 6.7)": "noise",
        "Two markers of different noise, radii 1 and 2": "markers",
    }
    return _show(found, tables, how["as_json"])


def _where(how: _How, unit: str, workers: int | None = None) -> Where:
    """Where the results go and what shows the progress; `unit` is the noun of what is counted."""
    from mocap_skel.pipeline.study import Where, no_progress

    def bar(parts: Iterable[Any], count: int) -> Iterable[Any]:
        from tqdm import tqdm

        return tqdm(parts, total=count, unit=f" {unit}", file=sys.stderr, leave=False)

    watched = sys.stderr.isatty() and not how["quiet"]
    called = shlex.join(["mocap-skel", *sys.argv[1:]])
    return Where(
        how["folder"], how["overwrite"], how["figures"], called, bar if watched else no_progress,
        workers,
    )  # fmt: skip


def _show(found: Findings, tables: dict[str, str], as_json: bool) -> int:
    """Print the findings as sentences and tables, or the rows of the tables as JSON lines; the exit code."""
    if as_json:
        for name in tables.values():
            for row in found.tables[name]:
                say(json.dumps({"table": name, **_plain(row)}, allow_nan=False))
        return 0
    from mocap_skel.pipeline.telling import wrote
    from mocap_skel.report.terminal import rows_table

    for line in found.words:
        say(line)
    for title, name in tables.items():
        say(f"\n{title}\n{rows_table(found.tables[name])}")
    say(f"\n{wrote(found.files)}")
    return 0


def _plain(row: dict[str, Any]) -> dict[str, Any]:
    """A row for JSON: NaN becomes None."""
    return {key: None if value != value else value for key, value in row.items()}

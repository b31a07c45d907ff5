"""mocap-skel batch: many clips, in parallel, each once, with a manifest of what became of them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from mocap_skel.cli import format_options, options
from mocap_skel.cli.jobs import Told, job_of
from mocap_skel.errors import CallError
from mocap_skel.export.registry import DEFAULT, choose
from mocap_skel.export.registry import formats as known_formats

if TYPE_CHECKING:
    from mocap_skel.pipeline.engine import Engine


class _For(click.ParamType):  # type: ignore[type-arg]  # generic from click 8.2 on only
    """PATTERN=MAP."""

    name = "pattern=map"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, str]:
        pattern, equals, association = str(value).rpartition("=")
        if not equals or not pattern or not association:
            self.fail(f"{value!r}: give a pattern of clips, = and an association file", param, ctx)
        return pattern, association


def _cores() -> int:
    """Cores that this process may use."""
    known = getattr(os, "sched_getaffinity", None)
    return len(known(0)) if known else os.cpu_count() or 1


@click.command(
    "batch",
    epilog="Example: mocap-skel batch recordings --assoc cmu --jobs 4 -o out",
)
@click.argument("inputs", nargs=-1, required=True, metavar="INPUT...")
@options.which
@click.option(
    "--assoc-for", "associations", type=_For(), multiple=True, metavar="PATTERN=MAP",
    help="Association file of the clips of a folder or with a certain name, such as 'anna/*=anna.txt'; repeat it. "
    "The first pattern that fits counts, then --assoc.",
)  # fmt: skip
@options.strict
@click.option(
    "--format", "-f", "formats", multiple=True, type=click.Choice(tuple(known_formats())),
    default=(DEFAULT,), show_default=True, help="Result format; repeat it for several.",
)  # fmt: skip
@click.option(
    "-o", "--output", "folder", required=True, metavar="DIR",
    type=options.Folder(path_type=Path), help="Folder for the results and the manifest.",
)  # fmt: skip
@click.option(
    "--root", metavar="DIR", type=click.Path(path_type=Path), show_default="the deepest folder of all inputs",
    help="Folder of the recordings: below -o, results lie as their clips lie below it.",
)  # fmt: skip
@click.option(
    "--jobs", "-j", type=click.IntRange(1), metavar="N", show_default="cores",
    help="Clips that are fitted at the same time.",
)  # fmt: skip
@click.option(
    "--engine", type=click.Choice(["local", "dask"]), default="local", show_default=True,
    help="Who fits: children of this process, or the workers of a Dask scheduler (pip install 'mocap-skel[cluster]').",
)  # fmt: skip
@click.option("--scheduler", metavar="ADDRESS", help="Of the Dask scheduler: tcp://HOST:PORT.")
@click.option(
    "--resume/--no-resume", default=True, show_default=True,
    help="Leave out clips that are finished: same content, options and version, by the manifest.",
)  # fmt: skip
@click.option(
    "--skip-existing",
    is_flag=True,
    help="Leave clips alone whose results exist, whatever made them.",
)
@options.overwrite
@click.option("--fail-fast", is_flag=True, help="End with the first clip that fails.")
@click.option(
    "--job", metavar="FILE", is_eager=True, expose_value=False,
    type=click.Path(path_type=Path), callback=lambda ctx, _, value: _read_job(ctx, value),
    help="A TOML file with options of this call, such as jobs = 4; those of the command line go before.",
)  # fmt: skip
@options.estimation
@format_options.all_options
@options.reading
@options.as_json
@options.quiet
def command(
    inputs: tuple[str, ...],
    associations: tuple[tuple[str, str], ...],
    formats: tuple[str, ...],
    folder: Path,
    root: Path | None,
    jobs: int | None,
    engine: str,
    scheduler: str | None,
    resume: bool,
    skip_existing: bool,
    overwrite: bool,
    fail_fast: bool,
    strict: bool,
    as_json: bool,
    quiet: bool,
    **told: Any,
) -> int:
    """Fit many clips at the same time, and keep a manifest of what became of each.

    An INPUT is a clip, a folder (its clips are found by their suffixes, also in folders below it), a
    pattern in quotes, or - for a list on standard input. Results lie below -o as their clips lie below
    the deepest folder of all inputs, so that clips of one name do not meet.

    manifest.jsonl has a line for each clip as soon as it is done: status, reason, notes, joints, files.
    The same call again fits only what is missing, has failed or was broken off. At the end,
    manifest.csv has one row a clip, and summary.csv one row a joint over all clips.

    Each clip is fitted in a child with limits of memory and time; one that crashes is one failed clip.

    Exit codes: 0 all done, 1 some clips failed, 2 wrong call or association file, 3 nothing could
    be fitted, 130 interrupted, 143 terminated.
    """
    from mocap_skel.cli.many import run
    from mocap_skel.labels.association import read_association
    from mocap_skel.pipeline.batch import Rules
    from mocap_skel.pipeline.inputs import STANDARD_INPUT, find_clips, from_standard_input

    if (engine == "dask") != (scheduler is not None):
        raise CallError("--engine dask and --scheduler ADDRESS go together")
    chosen = choose(formats, **format_options.told_of(told, formats))
    for one in chosen:
        one.format.check_installed()
    if told["calibration"] and associations:
        raise CallError(
            "--calibration goes with one --assoc for all clips", "leave --assoc-for out"
        )
    known = tuple(
        (pattern, read_association(name, told["skeleton"])) for pattern, name in associations
    )
    lines = from_standard_input() if STANDARD_INPUT in inputs else []
    places = find_clips(inputs, lines=lines, root=root, without=folder)
    job = job_of(
        cast(Told, {key: told[key] for key in told.keys() - format_options.names()}),
        [*(place.path for place in places), *(Path(name) for _, name in associations)],
        formats=chosen, folder=folder, overwrite=overwrite, strict=strict,
    )  # fmt: skip
    rules = Rules(resume, skip_existing, fail_fast, known)
    who = _engine(engine, scheduler, jobs, len(places))
    return run(places, job, rules, who, as_json=as_json, quiet=quiet)


def _engine(name: str, scheduler: str | None, jobs: int | None, clips: int) -> Engine:
    if name == "dask" and scheduler is not None:
        from mocap_skel.pipeline.cluster import Dask

        return Dask(scheduler, jobs)
    from mocap_skel.pipeline.engine import Local

    return Local(min(jobs or _cores(), clips))


def _read_job(ctx: click.Context, path: Path | None) -> None:
    """Let the options of a file be defaults of the call."""
    if path is None:
        return
    from mocap_skel.cli.job_file import read_job

    ctx.default_map = read_job(path, ctx.command)

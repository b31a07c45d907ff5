"""mocap-skel fit: clips in, skeletons and joint statistics out."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mocap_skel.cli import FAILED, NOTHING_FITTED, USAGE, bug, complain, options, say
from mocap_skel.errors import CallError, MocapSkelError

if TYPE_CHECKING:
    from mocap_skel.batch import Done

FORMATS = ("csv", "bvh", "c3d", "trc", "parquet")


@click.command(
    "fit",
    epilog="Example: mocap-skel fit walk.c3d --assoc cmu --format csv --format bvh -o out",
)
@options.clips
@options.association
@options.skeleton
@options.subject
@click.option(
    "--format", "-f", "formats", multiple=True, type=click.Choice(FORMATS), default=("csv",),
    show_default=True, help="Result format; repeat it for several.",
)  # fmt: skip
@options.output
@options.overwrite
@options.sigma
@options.pose
@options.method
@options.noise
@click.option(
    "--up", type=click.Choice(["x", "y", "z"]), help="Turn the results so that this axis points up."
    "  [default: as in the clip; y for bvh and trc]",
)  # fmt: skip
@click.option("--trim", is_flag=True, help="bvh: leave out incomplete frames at both ends.")
@click.option(
    "--axes", is_flag=True, help="c3d: also each segment's origin and the tips of its axes."
)
@click.option("--markers", is_flag=True, help="trc: also the subject's markers.")
@options.rig
@options.unit
@options.rate
@options.salvage
@options.as_json
@options.quiet
def command(
    clips: tuple[Path, ...],
    association: str | None,
    skeleton: str | None,
    subject: str | None,
    formats: tuple[str, ...],
    output: str,
    overwrite: bool,
    sigma: float | tuple[float, ...] | None,
    pose: str,
    method: str,
    noise: str,
    up: str | None,
    trim: bool,
    axes: bool,
    markers: bool,
    rotation_order: str,
    scale: float,
    names: str,
    floor: bool,
    root_at_origin: bool,
    unit: str | None,
    rate: float | None,
    salvage: bool,
    as_json: bool,
    quiet: bool,
) -> int:
    """Fit a skeleton to each CLIP and write it.

    For walk.c3d, csv makes walk.skeleton.csv (the joints in every frame) and walk.joints.csv (each
    joint with its evidence), parquet the same two in long form; bvh makes walk.bvh; trc makes
    walk.skeleton.trc for OpenSim; c3d makes walk.skeleton.c3d, a copy of the clip with the skeleton's
    points behind its own. The joint table goes to standard output. Column 'known' tells whether the
    motion shows the joint: yes, weak or no.

    Without --assoc, which label is which marker is guessed from names and motion, and said; where that
    is not sure, nothing is fitted: mocap-skel assoc guess writes the file to correct.

    Exit codes: 0 all done, 1 some clips failed, 2 wrong call or association file, 3 nothing could
    be fitted, 130 interrupted.
    """
    if association is None and skeleton is not None:
        # Names are guessed for the standard human.
        raise options.missing_association()
    to_stdout = output == "-"
    if to_stdout and (len(clips) > 1 or len(set(formats)) > 1 or as_json):
        raise CallError(
            "-o - sends one clip in one format and nothing else", "give a folder for more"
        )
    _check_names(clips)
    from mocap_skel.association import read_association
    from mocap_skel.batch import Isolated, Job, process
    from mocap_skel.export import Options
    from mocap_skel.extras import extra

    options.check_estimation(method, noise, sigma)
    if "parquet" in formats:
        # Better missed before the work than after it.
        extra("pyarrow.parquet", "parquet")
    job = Job(
        association=None if association is None else read_association(association, skeleton),
        formats=tuple(dict.fromkeys(formats)),
        folder=None if to_stdout else Path(output),
        overwrite=overwrite,
        inputs=frozenset(clip.resolve() for clip in clips),
        subject=subject,
        sigma=sigma,
        pose=pose,
        method=method,
        noise=noise,
        unit=unit,
        rate=rate,
        salvage=salvage,
        options=Options(
            up=up,
            trim=trim,
            rotation_order=rotation_order,
            scale=scale,
            names=names,
            floor=floor,
            root_at_origin=root_at_origin,
            axes=axes,
            markers=markers,
        ),
    )
    debug = bool(click.get_current_context().find_root().obj)
    failures: list[MocapSkelError] = []
    written: set[Path] = set()
    # One clip may as well fail on its own.
    with Isolated(clips, job) if len(clips) > 1 else nullcontext() as isolated:
        for clip in _progress(clips):
            try:
                done = isolated.process(clip, written) if isolated else process(clip, job, written)
            except MocapSkelError as error:
                failures.append(error)
                complain(error)
                continue
            except Exception as error:  # one clip's trouble must not take the others with it
                failures.append(bug(error, debug))
                complain(failures[-1])
                continue
            failures += done.failed
            for failure in done.failed:
                complain(failure)
            if not quiet:
                for note in done.notes:
                    click.echo(f"mocap-skel: {clip}: {note}", err=True)
            if to_stdout:
                _send(clip, done)
                return FAILED if failures else 0
            written |= set(done.files)
            if as_json:
                _print_json(clip, done)
            else:
                _print_tables(clip, done)
    if not failures:
        return 0
    if written:
        if len(clips) > 1:
            click.echo(f"mocap-skel: {len(failures)} of {len(clips)} clips failed", err=True)
        return FAILED
    return USAGE if all(isinstance(e, CallError) for e in failures) else NOTHING_FITTED


def _check_names(clips: tuple[Path, ...]) -> None:
    """Two clips of one name would write the same files: better said before any work."""
    seen: dict[str, Path] = {}
    for clip in clips:
        if clip.stem in seen:
            raise CallError(
                f"{seen[clip.stem]} and {clip} would write the same files",
                "fit them in two calls with different -o",
            )
        seen[clip.stem] = clip


def _progress(clips: tuple[Path, ...]) -> Iterable[Path]:
    if len(clips) < 2 or not sys.stderr.isatty():
        return clips
    from tqdm import tqdm

    return tqdm(clips, unit="clip", file=sys.stderr)


def _send(path: Path, done: Done) -> None:
    if len(done.fits) > 1:
        names = ", ".join(fit.subject for fit in done.fits)
        raise CallError(f"{path}: -o - takes one subject", f"choose with --subject: {names}")
    content = next(iter(done.files.values()))
    if isinstance(content, bytes) and sys.stdout.isatty():
        raise CallError(f"{path}: this format is not for a terminal", "redirect it: -o - > file")
    say(content, nl=False)


def _print_json(path: Path, done: Done) -> None:
    from mocap_skel.tables import joint_row

    for fit in done.fits:
        for joint in fit.joints:
            row = {"clip": str(path), "subject": fit.subject, **joint_row(joint)}
            say(json.dumps(row, allow_nan=False))


def _print_tables(path: Path, done: Done) -> None:
    from mocap_skel.report.terminal import joint_table

    for fit in done.fits:
        say(joint_table(fit, str(path)))
    say(f"wrote {', '.join(str(file) for file in done.files)}")

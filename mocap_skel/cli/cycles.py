"""mocap-skel cycles: joint angles over the gait cycle."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Unpack

import click

from mocap_skel.cli import FAILED, NOTHING_FITTED, USAGE, bug, complain, options, say, warn
from mocap_skel.cli.jobs import Told, job_of
from mocap_skel.errors import CallError, MocapSkelError


@click.command(
    "cycles",
    epilog="Example: mocap-skel cycles walk1.c3d walk2.c3d --assoc cmu --joint Knee -o out",
)
@options.clips
@options.which
@click.option(
    "--joint", "-j", "joints", multiple=True, metavar="NAME", show_default="Hip, Knee and Ankle",
    help="Joint, such as LeftKnee; Knee means both sides. Repeat it for several.",
)  # fmt: skip
@click.option(
    "--events", "by", type=click.Choice(["auto", "file", "found"]), default="auto", show_default=True,
    help="Foot strikes of the file (file), found in the movement (found), or found where the file has none (auto).",
)  # fmt: skip
@click.option(
    "--picture", "kind", type=click.Choice(["png", "svg", "pdf", "none"]), default="png",
    show_default=True, help="Kind of the picture.",
)  # fmt: skip
@click.option(
    "--output", "-o", metavar="DIR", type=click.Path(path_type=Path), default=Path(), show_default="the current folder",
    help="Folder for the files.",
)  # fmt: skip
@options.overwrite
@options.estimation
@options.static
@options.reading
@options.as_json
@options.quiet
def command(
    clips: tuple[Path, ...],
    joints: tuple[str, ...],
    by: str,
    kind: str,
    output: Path,
    overwrite: bool,
    as_json: bool,
    quiet: bool,
    **told: Unpack[Told],
) -> int:
    """Fit walking CLIPs and add up their gait cycles: mean and standard deviation of joint angles.

    A cycle goes from a foot strike to the next one of the same foot, and has 101 points, 0 to 100 %. A joint of
    one side takes the strikes of that side; a joint in the middle takes those of both, one after the other.

    For --joint Knee, the files are Knee.cycles.csv (the means), Knee.cycles.each.csv (every cycle) and
    Knee.cycles.png. The picture needs the extra 'plot': pip install 'mocap-skel[plot]'.

    Each of several clips is fitted in a child process: one that fails, crashes or hangs is named, and the
    cycles of the others are written.

    Exit codes: 0 all done, 1 some clips failed, 2 wrong call or association file, 3 no clip has a cycle,
    130 interrupted.
    """
    kind = "" if kind == "none" else kind
    if kind:
        from mocap_skel.extras import extra

        extra("matplotlib.figure", "plot")
    from mocap_skel.gait.cycles import mean_rows, stride_rows
    from mocap_skel.pipeline.cycles import Wanted, add_up, named_joints

    names, stem = named_joints(joints)
    done = add_up(clips, job_of(told, clips), Wanted(names, stem, by, output, kind, overwrite))
    debug = bool(click.get_current_context().find_root().obj)
    failed = [e if isinstance(e, MocapSkelError) else bug(e, debug) for e in done.failed]
    for failure in failed:
        complain(failure)
    for note in [] if quiet else done.notes:
        warn(note)
    if not done.means:
        return USAGE if all(isinstance(e, CallError) for e in failed) else NOTHING_FITTED
    if failed:
        warn(f"{len(failed)} of {len(clips)} clips failed")
    if as_json:
        for row in mean_rows(done.means):
            plain = {key: None if value != value else value for key, value in row.items()}
            say(json.dumps(plain, allow_nan=False))
    else:
        from mocap_skel.pipeline.telling import wrote
        from mocap_skel.report.terminal import rows_table

        say(rows_table(stride_rows(done.means)))
        say(wrote(done.files))
    return FAILED if failed else 0

"""mocap-skel calibrate: what several clips of one actor show of the joints, in one file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

import click

from mocap_skel.cli import FAILED, complain, options, say, warn
from mocap_skel.cli.jobs import Told, job_of
from mocap_skel.errors import CallError

if TYPE_CHECKING:
    from mocap_skel.joints.calibration import Calibrated


@click.command(
    "calibrate",
    epilog="Example: mocap-skel calibrate hip.c3d walk.c3d --assoc cmu -o actor.json",
)
@options.clips
@options.which
@click.option(
    "-o", "--output", metavar="FILE", default="actor.json", show_default=True,
    type=click.Path(path_type=Path), help="The calibration.",
)  # fmt: skip
@options.overwrite
@options.pure_estimation
@options.prior
@options.person
@options.reading
@options.wide
@options.as_json
@options.quiet
def command(
    clips: tuple[Path, ...],
    output: Path,
    overwrite: bool,
    wide: bool,
    as_json: bool,
    quiet: bool,
    **told: Unpack[Told],
) -> int:
    """Add up what several CLIPs of one actor show of the joints.

    A trial that moves a joint on purpose shows it better than a walk does. The calibration keeps each
    clip's evidence, and mocap-skel fit --calibration actor.json takes it over for any clip of the
    same actor with the same markers. Markers that were put on again elsewhere are noticed, and their
    segment's evidence is left out. Without --assoc the markers are guessed, as mocap-skel fit does. The table shows each joint, and how much of it each clip gave.

    Exit codes: 0 all done, 1 some clips could not be used, 2 wrong call or association file, 3 no
    clip could be used, 130 interrupted.
    """
    from mocap_skel.export.calibration_json import calibration_json
    from mocap_skel.export.files import check_free, write_all
    from mocap_skel.pipeline.calibrate import calibrate

    job = job_of(told, clips)
    check_free([output], overwrite, job.inputs)
    from mocap_skel.joints.choices import check_method

    try:
        check_method(job.method, job.noise, job.sigma, calibrated=True)
    except ValueError as error:
        raise CallError(str(error)) from error
    done = calibrate(clips, job)
    for failure in done.failed:
        complain(failure)
    for note in [] if quiet else done.notes:
        warn(note)
    write_all({output: calibration_json(done.calibration, done.joints)}, overwrite, job.inputs)
    if as_json:
        _print_json(done)
    else:
        from mocap_skel.pipeline.telling import wrote
        from mocap_skel.report.terminal import calibration_table

        say(calibration_table(done, wide=wide))
        say(wrote([output]))
    return FAILED if done.failed else 0


def _print_json(done: Calibrated) -> None:
    from mocap_skel.results.tables import joint_row

    for found in done.joints:
        row = {"clip": found.clip, **joint_row(found.joint), "shares": found.shares}
        say(json.dumps(row, allow_nan=False))

"""mocap-skel report: one HTML page a clip, with the moving skeleton and the evidence for it."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

import click

from mocap_skel.cli import each, options
from mocap_skel.errors import CallError


@click.command("report", epilog="Example: mocap-skel report walk.c3d --assoc cmu -o out")
@options.clips
@options.association
@options.skeleton
@options.subject
@options.output
@options.overwrite
@options.sigma
@options.pose
@options.method
@options.noise
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
    output: str,
    overwrite: bool,
    sigma: float | tuple[float, ...] | None,
    pose: str,
    method: str,
    noise: str,
    unit: str | None,
    rate: float | None,
    salvage: bool,
    as_json: bool,
    quiet: bool,
) -> int:
    """Fit a skeleton to each CLIP and show it on one HTML page.

    For walk.c3d it makes walk.report.html, one page a subject: which joints to trust, the skeleton and
    its markers moving in 3-D, the joint table, the part of each sphere that the movement shows, and
    what was decided about the file. A browser opens it without a network. The joint table also goes to
    standard output.

    Options and exit codes are those of fit; mocap-skel fit writes the numbers.
    """
    if association is None and skeleton is not None:
        # Names are guessed for the standard human.
        raise options.missing_association()
    to_stdout = output == "-"
    if to_stdout and (len(clips) > 1 or as_json):
        raise CallError(
            "-o - sends the page of one clip and nothing else", "give a folder for more"
        )
    each.check_names(clips)
    from mocap_skel.association import read_association
    from mocap_skel.batch import PAGE, Job

    options.check_estimation(method, noise, sigma)
    job = Job(
        association=None if association is None else read_association(association, skeleton),
        formats=(PAGE,),
        folder=None if to_stdout else Path(output),
        overwrite=overwrite,
        subject=subject,
        sigma=sigma,
        pose=pose,
        method=method,
        noise=noise,
        unit=unit,
        rate=rate,
        salvage=salvage,
        command=shlex.join(["mocap-skel", *sys.argv[1:]]),
    )
    return each.run(clips, job, as_json=as_json, quiet=quiet)

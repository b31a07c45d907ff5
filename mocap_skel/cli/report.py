"""mocap-skel report: one HTML page a clip, with the moving skeleton and the evidence for it."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Unpack

import click

from mocap_skel.cli import each, options
from mocap_skel.cli.jobs import Told, job_of
from mocap_skel.errors import CallError


@click.command("report", epilog="Example: mocap-skel report walk.c3d --assoc cmu -o out")
@options.clips
@options.which
@options.output_page
@options.overwrite
@options.estimation
@options.static
@options.reading
@options.wide
@options.as_json
@options.quiet
def command(
    clips: tuple[Path, ...],
    output: str,
    overwrite: bool,
    wide: bool,
    as_json: bool,
    quiet: bool,
    **told: Unpack[Told],
) -> int:
    """Fit a skeleton to each CLIP and show it on one HTML page.

    For walk.c3d it makes walk.report.html, one page a subject: which joints to trust, the skeleton and
    its markers moving in 3-D, the joint table, the part of each sphere that the movement shows, and
    what was decided about the file. A browser opens it without a network. The joint table also goes to
    standard output.

    Options and exit codes are those of fit; mocap-skel fit writes the numbers.
    """
    to_stdout = output == "-"
    if to_stdout and (len(clips) > 1 or as_json):
        raise CallError(
            "-o - sends the page of one clip and nothing else", "give a folder for more"
        )
    each.check_names(clips)
    from mocap_skel.report.html import PAGE

    job = job_of(
        told,
        clips,
        formats=(PAGE,),
        folder=each.folder_of(output, PAGE.format.suffixes),
        overwrite=overwrite,
        command=shlex.join(["mocap-skel", *sys.argv[1:]]),
    )
    return each.run(clips, job, as_json=as_json, quiet=quiet, wide=wide)

"""mocap-skel assoc page: one HTML page to see which marker is which, to correct it, and to save it."""

from __future__ import annotations

from pathlib import Path
from typing import Unpack

import click

from mocap_skel.cli import options, say, warn
from mocap_skel.cli.jobs import Looked, looked_at


@click.command("page", epilog="Example: mocap-skel assoc page walk.c3d -o page.html")
@options.clip
@options.which
@click.option(
    "-o", "--output", metavar="FILE", required=True, type=click.Path(path_type=Path),
    help="The page.",
)  # fmt: skip
@options.overwrite
@options.reading
@options.quiet
def command(clip: Path, output: Path, overwrite: bool, quiet: bool, **told: Unpack[Looked]) -> int:
    """Make a page on which you see CLIP's markers move, correct which is which, and save the association file.

    The page is one file that needs no network: open it in a browser. Markers have the colour of the segment
    that the guess, or MAP, gives them; what is in doubt is listed with its reason. Pick markers, choose
    their name or segment, and see whether the segment becomes more rigid. Save map.txt there, and then:
    mocap-skel fit CLIP --assoc map.txt
    """
    from mocap_skel.export.files import check_free, write_all
    from mocap_skel.pipeline.page_start import page_start
    from mocap_skel.pipeline.telling import wrote
    from mocap_skel.report.assoc_page import assoc_page
    from mocap_skel.text import counted

    inputs = [clip, *(Path(n) for n in (told["association"], told["skeleton"]) if n)]
    check_free([output], overwrite, inputs)
    with looked_at(clip, told) as (found, job):
        read, start = page_start(found, job, told["skeleton"])
        page = assoc_page(read, start)
    write_all({output: page}, overwrite, inputs)
    say(wrote([output]))
    if not quiet:
        warn(f"{clip}: {start.said}")
        if start.doubts:
            doubts = counted(len(start.doubts), "doubt")
            warn(f"{clip}: {doubts}, listed on the page")
    return 0

"""mocap-skel assoc check: find markers that do not move with the segment that they are given to."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Unpack

import click

from mocap_skel.cli import options, say
from mocap_skel.cli.jobs import Looked, looked_at


@click.command("check", epilog="Example: mocap-skel assoc check walk.c3d --assoc cmu")
@options.clip
@options.which
@options.reading
@options.as_json
def command(clip: Path, as_json: bool, **told: Unpack[Looked]) -> int:
    """Check against CLIP whether each marker moves with the segment that MAP gives it.

    Finds lines that are exchanged, markers given to the wrong segment, and the frames in which a marker
    left its segment. The table goes to standard output; its last line says what to do.

    Columns: residual mm, how far the marker's distances within its segment vary (robust standard
    deviation); out of place, share of its samples, with the first and the last such frame.
    """
    if told["association"] is None:
        raise options.missing_association()
    from mocap_skel.labels.association import associate
    from mocap_skel.report.check_table import check_row, check_table
    from mocap_skel.results.marker_check import check_association

    read, association = looked_at(clip, told)
    assert association is not None, "refused above"
    for assignment in associate(read, association, told["subject"]):
        check = check_association(read, assignment, association.skeleton)
        if as_json:
            for one in check.markers:
                say(json.dumps(check_row(one, str(clip)), allow_nan=False))
        else:
            say(check_table(check, str(clip)))
        for note in assignment.mismatches(association):
            click.echo(f"mocap-skel: {clip}: {note}", err=True)
    return 0

"""mocap-skel assoc check: whether markers move with the segments that an association gives them."""

from __future__ import annotations

import json
from pathlib import Path

import click

from mocap_skel.cli import options, say


@click.command("check", epilog="Example: mocap-skel assoc check walk.c3d --assoc cmu")
@options.clip
@options.association
@options.skeleton
@options.subject
@options.unit
@options.rate
@options.salvage
@options.as_json
def command(
    clip: Path,
    association: str | None,
    skeleton: str | None,
    subject: str | None,
    unit: str | None,
    rate: float | None,
    salvage: bool,
    as_json: bool,
) -> int:
    """Check against CLIP whether each marker moves with the segment that MAP gives it.

    Finds lines that are exchanged, markers given to the wrong segment, and the frames in which a marker
    left its segment. The table goes to standard output; its last line says what to do.

    Columns: residual mm, how far the marker's distances within its segment vary (robust standard
    deviation); out of place, share of its samples, with the first and the last such frame.
    """
    if association is None:
        raise options.missing_association()
    from mocap_skel.labels.association import associate, read_association
    from mocap_skel.readers import read_clip
    from mocap_skel.report.check_table import check_row, check_table
    from mocap_skel.results.marker_check import check_association

    known = read_association(association, skeleton)
    read = read_clip(clip, unit=unit, rate=rate, salvage=salvage)
    for assignment in associate(read, known, subject):
        check = check_association(read, assignment, known.skeleton)
        if as_json:
            for one in check.markers:
                say(json.dumps(check_row(one, str(clip)), allow_nan=False))
        else:
            say(check_table(check, str(clip)))
        for note in assignment.mismatches(known):
            click.echo(f"mocap-skel: {clip}: {note}", err=True)
    return 0

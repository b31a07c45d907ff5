"""mocap-skel assoc check: find markers that do not move with the segment that they are given to."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Unpack

import click

from mocap_skel.cli import options, say, warn
from mocap_skel.cli.jobs import Looked, looked_at


@click.command("check", epilog="Example: mocap-skel assoc check walk.c3d --assoc cmu")
@options.clip
@options.which
@options.reading
@options.as_json
def command(clip: Path, as_json: bool, **told: Unpack[Looked]) -> int:
    """Check against CLIP whether each marker moves with the segment that MAP gives it.

    Finds lines that are exchanged, markers given to the wrong segment, and the frames in which a marker
    left its segment. Without --assoc the markers are guessed, as mocap-skel fit does. The table goes to standard output; its last line says what to do.

    Columns: residual mm, how far the marker's distances within its segment vary (robust standard
    deviation); out of place, share of its samples, with the first and the last such frame.
    """
    from mocap_skel.labels.association import associate
    from mocap_skel.report.check_table import check_row, check_table
    from mocap_skel.results.marker_check import check_association
    from mocap_skel.text import visible

    with looked_at(clip, told) as (read, job):
        named = job.named(read)
        if job.association is None:
            warn(f"{clip}: {named.notes[-1]}")
        # A part of the body is a subject that the call need not know.
        subject = None if len(named.associations) > 1 else told["subject"]
        pairs = [(a, x) for a in named.associations for x in associate(named.clip, a, subject)]
        for association, assignment in pairs:
            check = check_association(named.clip, assignment, association.skeleton)
            if as_json:
                for one in check.markers:
                    say(json.dumps(check_row(one, str(clip)), allow_nan=False))
            else:
                say(check_table(check, visible(str(clip))))
            for note in assignment.mismatches(association):
                warn(f"{clip}: {note}")
    return 0

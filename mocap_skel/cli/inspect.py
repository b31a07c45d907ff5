"""mocap-skel inspect: what is in a clip before anyone fits it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

import click

from mocap_skel.cli import options, say
from mocap_skel.cli.jobs import Looked, looked_at

if TYPE_CHECKING:
    from collections.abc import Iterator

    from mocap_skel.clip import Clip
    from mocap_skel.labels.association import Assignment, Association


@click.command("inspect", epilog="Example: mocap-skel inspect walk.c3d --assoc cmu")
@options.clip
@options.which
@options.reading
@options.as_json
def command(clip: Path, as_json: bool, **told: Unpack[Looked]) -> int:
    """Show what is in CLIP: subjects, labels, unit, rate, frames, how much of each marker is missing.

    With --assoc also which marker of which segment each label is, and what does not match.
    """
    from mocap_skel.errors import ClipError
    from mocap_skel.labels.association import associate, check_subject
    from mocap_skel.report.terminal import clip_table
    from mocap_skel.results.inspection import marker_rows

    subject = told["subject"]
    read, association = looked_at(clip, told)
    check_subject(read, subject)
    matched: tuple[Assignment, ...] = ()
    mismatches: list[str] = []
    if association is not None:
        try:
            matched = associate(read, association, subject)
            mismatches = [note for match in matched for note in match.mismatches(association)]
        except ClipError as error:  # nothing matches, and this is the place to see why
            mismatches = [error.message]
    warnings = [f"warning: {words}" for words in _sizes(read, association, matched, subject)]
    rows = [row for row in marker_rows(read, matched) if subject in (None, row["subject"])]
    if as_json:
        say(
            json.dumps(
                {**_facts(read), "markers": rows, "mismatches": mismatches, "warnings": warnings}
            )
        )
    else:
        say("\n".join([clip_table(read, rows), *mismatches, *warnings]))
    return 0


def _sizes(
    clip: Clip,
    association: Association | None,
    matched: tuple[Assignment, ...],
    subject: str | None,
) -> Iterator[str]:
    """A sentence for each subject whose size says that the unit is wrong."""
    from mocap_skel.results.body_size import sizes_by_names, wrong_size

    if association is None:
        found = list(sizes_by_names(clip, subject))
    else:
        sizes = [(match.subject, wrong_size(clip, match.columns)) for match in matched]
        found = [(whose, size) for whose, size in sizes if size is not None]
    for whose, size in found:
        yield f"{whose}: {size}" if whose else str(size)


def _facts(clip: Clip) -> dict[str, object]:
    return {
        "clip": clip.name,
        "frames": clip.frames,
        "rate": clip.rate,
        "first_frame": clip.first_frame,
        "unit": clip.unit,
        "up": clip.up,
        "subjects": [name for name in clip.subject_names if name],
        "left_out": {reason: list(labels) for reason, labels in clip.left_out.items()},
        "notes": list(clip.notes),
    }

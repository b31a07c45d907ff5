"""mocap-skel inspect: what is in a clip before anyone fits it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

import click

from mocap_skel.cli import options, say
from mocap_skel.cli.jobs import Looked, looked_at

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from mocap_skel.clip import Clip
    from mocap_skel.labels.association import Assignment


@click.command("inspect", epilog="Example: mocap-skel inspect walk.c3d --assoc cmu")
@options.clip
@options.which
@options.reading
@options.as_json
def command(clip: Path, as_json: bool, **told: Unpack[Looked]) -> int:
    """Show what is in CLIP: subjects, labels, unit, rate, frames, how much of each marker is missing.

    Also which marker of which segment each label is, by --assoc or guessed as mocap-skel fit does, and
    what does not match.
    """
    from mocap_skel.errors import CallError, ClipError
    from mocap_skel.labels.association import associate, check_subject
    from mocap_skel.labels.subjects import with_subjects
    from mocap_skel.report.terminal import clip_table
    from mocap_skel.results.inspection import marker_rows
    from mocap_skel.results.upright import upright, upright_by_names

    subject = told["subject"]
    matched: list[Assignment] = []
    mismatches: list[str] = []
    with looked_at(clip, told) as (found, job):
        try:
            named = job.named(found)
        except (CallError, ClipError) as error:  # nothing matches, and this is the place to see why
            read = with_subjects(found, job.association)
            check_subject(read, subject)
            mismatches = [error.message]
            read = upright_by_names(read, subject)
        else:
            parts = len(named.associations) > 1
            for association in named.associations:
                own = associate(named.clip, association, None if parts else subject)
                matched += own
                if job.association is not None:
                    mismatches += [note for one in own for note in one.mismatches(association)]
            read = upright(named.whole, matched, named.association.skeleton)
            mismatches += [note for note in named.notes if note not in read.notes]
        warnings = [f"warning: {words}" for words in _sizes(read, matched, subject)]
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


def _sizes(clip: Clip, matched: Sequence[Assignment], subject: str | None) -> Iterator[str]:
    """A sentence for each subject whose size says that the unit is wrong."""
    from mocap_skel.results.body_size import sizes_by_names, wrong_size

    if matched:
        sizes = [(match.subject, wrong_size(clip, match.columns)) for match in matched]
        found = [(whose, size) for whose, size in sizes if size is not None]
    else:
        found = list(sizes_by_names(clip, subject))
    for whose, size in found:
        yield f"{whose}: {size}" if whose else str(size)


def _facts(clip: Clip) -> dict[str, object]:
    from mocap_skel.gait.events import event_row

    return {
        "clip": clip.name,
        "frames": clip.frames,
        "rate": clip.rate,
        "first_frame": clip.first_frame,
        "unit": clip.unit,
        "up": clip.up,
        "subjects": [name for name in clip.subject_names if name],
        "left_out": {reason: list(labels) for reason, labels in clip.left_out.items()},
        "events": [event_row(event) for event in clip.events],
        "notes": list(clip.notes),
    }

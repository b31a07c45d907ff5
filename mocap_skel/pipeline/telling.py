"""What a call says of a fitted clip on standard output: tables for people, or JSON lines."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Literal

from mocap_skel.errors import MocapSkelError
from mocap_skel.gait.events import event_row
from mocap_skel.pipeline.clip_files import Done
from mocap_skel.results.rig_rows import RIG_TABLE, rig_rows
from mocap_skel.results.tables import JOINT_TABLE, joint_rows
from mocap_skel.text import visible

Manner = Literal["tables", "wide", "json", ""]
"""Tables, tables with all columns, JSON lines, or nothing."""

# What lines of JSON say of themselves that are about no joint.
ABOUT, NOTES, FAILURES = "about", "notes", "failures"


def told(path: Path, done: Done, manner: Manner) -> tuple[str, ...]:
    """What to print of a clip whose results are written, one text after the other."""
    if manner == "json":
        return tuple(json.dumps(row, allow_nan=False) for row in _rows(path, done))
    return tuple(_tables(path, done, manner == "wide")) if manner else ()


def wrote(paths: Iterable[Path]) -> str:
    """A line that names the files that were written."""
    return f"wrote {', '.join(visible(str(path)) for path in paths)}"


def note_row(path: Path, note: str) -> str:
    """A line of JSON with what there is to say about a clip."""
    return json.dumps({"clip": str(path), "table": NOTES, "note": note})


def failure_row(path: Path, error: MocapSkelError) -> str:
    """A line of JSON about a clip, a subject or a format that failed."""
    row = {"clip": str(path), "table": FAILURES, "failure": error.message, "hint": error.hint}
    return json.dumps(row)


def _rows(path: Path, done: Done) -> Iterator[dict[str, Any]]:
    clip = str(path)
    for fit in done.fits:
        for row in joint_rows(fit):
            yield {"clip": clip, "subject": fit.subject, "table": JOINT_TABLE, **row}
    for subject, events in done.events.items():
        for event in events:
            yield {"clip": clip, "table": "events", **event_row(event), "subject": subject}
    for figure in done.figures:
        about = {"table": RIG_TABLE, "formats": figure.formats}
        for row in rig_rows(figure.quality):
            yield {"clip": clip, "subject": figure.subject, **about, **row}
    options = dict(done.options())
    if ABOUT in options["formats"]:
        yield {"clip": clip, "table": ABOUT, "version": options.pop("version"), "options": options}


def _tables(path: Path, done: Done, wide: bool) -> Iterator[str]:
    from mocap_skel.report.terminal import joint_table, sentence
    from mocap_skel.results.verdict import verdict

    for fit in done.fits:
        yield joint_table(fit, visible(str(path)), wide=wide)
        for words in verdict(fit, joint_rows(fit, angles=False)):
            yield sentence(words)
        for figure in done.figures:
            if figure.subject == fit.subject:
                from mocap_skel.report.rig_table import rig_table

                yield rig_table(figure.quality, figure.formats, wide=wide)
    yield wrote(done.files)

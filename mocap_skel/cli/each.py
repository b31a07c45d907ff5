"""Do the job of a call for each of its clips, print the results, and find the exit code."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Iterable
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mocap_skel.cli import FAILED, NOTHING_FITTED, USAGE, bug, complain, say
from mocap_skel.errors import CallError, MocapSkelError
from mocap_skel.text import stem

if TYPE_CHECKING:
    from mocap_skel.pipeline.clip_files import Done
    from mocap_skel.pipeline.job import Job


def run(
    clips: tuple[Path, ...], job: Job, *, as_json: bool, quiet: bool, wide: bool = False
) -> int:
    """Do the job for every clip and print what came of it; one that fails does not stop the others.

    Args:
        clips: the files, one or more.
        job: what to do with each.
        as_json: print JSON lines, not tables.
        quiet: print no notes.
        wide: all columns of the joint table, and all segments of the rig's.

    Returns:
        The exit code. Without `job.folder` the one clip's result goes to standard output.
    """
    from mocap_skel.pipeline.clip_files import Isolated, process

    debug = bool(click.get_current_context().find_root().obj)
    failures: list[MocapSkelError] = []
    written: set[Path] = set()
    # One clip may as well fail on its own.
    with Isolated(clips, job) if len(clips) > 1 else nullcontext() as isolated:
        for clip in _progress(clips):
            try:
                done = isolated.process(clip, written) if isolated else process(clip, job, written)
            except MocapSkelError as error:
                failures.append(error)
                complain(error)
                continue
            except Exception as error:  # one clip's trouble must not take the others with it
                failures.append(bug(error, debug))
                complain(failures[-1])
                continue
            failures += done.failed
            for failure in done.failed:
                complain(failure)
            if not quiet:
                for note in done.notes:
                    click.echo(f"mocap-skel: {clip}: {note}", err=True)
            if job.folder is None:
                _send(clip, done)
                return FAILED if failures else 0
            written |= set(done.files)
            if as_json:
                _print_json(clip, done)
            else:
                _print_tables(clip, done, wide)
    if not failures:
        return 0
    if written:
        if len(clips) > 1:
            click.echo(f"mocap-skel: {len(failures)} of {len(clips)} clips failed", err=True)
        return FAILED
    return USAGE if all(isinstance(e, CallError) for e in failures) else NOTHING_FITTED


def check_names(clips: tuple[Path, ...]) -> None:
    """Refuse two clips of one name, before any work: they would write the same files.

    Raises:
        CallError: there are two.
    """
    seen: dict[str, Path] = {}
    for clip in clips:
        name = stem(clip)
        if name in seen:
            raise CallError(
                f"{seen[name]} and {clip} would write the same files",
                "fit them in two calls with different -o",
            )
        seen[name] = clip


def folder_of(output: str, suffixes: Iterable[str]) -> Path | None:
    """The folder that `-o` names; None for - (standard output).

    Args:
        output: what was typed.
        suffixes: of the files that are written there; a folder is not called like one of them.

    Raises:
        CallError: it is the name of a file.
    """
    if output == "-":
        return None
    folder = Path(output)
    endings = {Path(f"walk{suffix}").suffix for suffix in suffixes}
    if folder.suffix.lower() in endings and not folder.is_dir():
        raise CallError(
            f"-o {output}: that is a file's name, and results go to a folder, each under the name of its clip",
            f"give a folder, or - for standard output: -o - > {shlex.quote(output)}",
        )
    return folder


def _progress(clips: tuple[Path, ...]) -> Iterable[Path]:
    if len(clips) < 2 or not sys.stderr.isatty():
        return clips
    from tqdm import tqdm

    return tqdm(clips, unit="clip", file=sys.stderr)


def _send(path: Path, done: Done) -> None:
    if len(done.fits) > 1:
        names = ", ".join(fit.subject for fit in done.fits)
        raise CallError(f"{path}: -o - takes one subject", f"choose with --subject: {names}")
    content = next(iter(done.files.values()))
    if isinstance(content, bytes) and sys.stdout.isatty():
        raise CallError(f"{path}: this format is not for a terminal", "redirect it: -o - > file")
    say(content, nl=False)


def _print_json(path: Path, done: Done) -> None:
    from mocap_skel.gait.events import event_row
    from mocap_skel.results.rig_rows import RIG_TABLE, rig_rows
    from mocap_skel.results.tables import JOINT_TABLE, joint_rows

    for fit in done.fits:
        for row in joint_rows(fit):
            line = {"clip": str(path), "subject": fit.subject, "table": JOINT_TABLE, **row}
            say(json.dumps(line, allow_nan=False))
    for subject, events in done.events.items():
        for event in events:
            line = {"clip": str(path), "table": "events", **event_row(event), "subject": subject}
            say(json.dumps(line, allow_nan=False))
    for figure in done.figures:
        about = {"table": RIG_TABLE, "formats": figure.formats}
        for row in rig_rows(figure.quality):
            line = {"clip": str(path), "subject": figure.subject, **about, **row}
            say(json.dumps(line, allow_nan=False))


def _print_tables(path: Path, done: Done, wide: bool) -> None:
    from mocap_skel.report.rig_table import rig_table
    from mocap_skel.report.terminal import joint_table, sentence
    from mocap_skel.results.tables import joint_rows
    from mocap_skel.results.verdict import verdict

    for fit in done.fits:
        say(joint_table(fit, str(path), wide=wide))
        for words in verdict(fit, joint_rows(fit)):
            say(sentence(words))
        for figure in done.figures:
            if figure.subject == fit.subject:
                say(rig_table(figure.quality, figure.formats, wide=wide))
    say(f"wrote {', '.join(str(file) for file in done.files)}")

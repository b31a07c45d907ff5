"""Do the job of a call for each of its clips, print the results, and find the exit code."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mocap_skel.cli import FAILED, NOTHING_FITTED, USAGE, bug, complain, is_closed, say, warn
from mocap_skel.errors import CallError, MocapSkelError
from mocap_skel.text import stem

if TYPE_CHECKING:
    from mocap_skel.pipeline.clip_files import Done
    from mocap_skel.pipeline.engine import Outcome
    from mocap_skel.pipeline.job import Job
    from mocap_skel.pipeline.telling import Manner


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
    manner: Manner = "json" if as_json else "wide" if wide else "tables"
    debug = bool(click.get_current_context().find_root().obj)
    calls = _Calls(manner, quiet, debug)
    # One clip may as well fail on its own.
    if len(clips) == 1:
        return _one(clips[0], job, calls)
    return _several(clips, job, calls)


class _Calls:
    """What is printed of the clips of a call, and what failed.

    Attributes:
        failures: all there were.
        manner: what is printed of a clip.
    """

    def __init__(self, manner: Manner, quiet: bool, debug: bool) -> None:
        self.failures: list[MocapSkelError] = []
        self.manner = manner
        self._quiet, self._debug = quiet, debug

    def failed(self, clip: Path, error: Exception) -> None:
        """A clip without a result."""
        self._complain(clip, error)

    def wrote(
        self,
        clip: Path,
        failed: Iterable[MocapSkelError],
        notes: Iterable[str],
        said: Iterable[str],
    ) -> None:
        """A clip with results, though parts of it may have failed."""
        for text in said:
            say(text)
        for error in failed:
            self._complain(clip, error)
        for note in [] if self._quiet else notes:
            warn(f"{clip}: {note}")
            if self.manner == "json":
                from mocap_skel.pipeline.telling import note_row

                say(note_row(clip, note))

    def code(self, written: bool, clips: int) -> int:
        """The exit code."""
        if not self.failures:
            return 0
        if written:
            if clips > 1:
                warn(f"{len(self.failures)} of {clips} clips failed")
            return FAILED
        wrong = all(isinstance(error, CallError) for error in self.failures)
        return USAGE if wrong else NOTHING_FITTED

    def _complain(self, clip: Path, error: Exception) -> None:
        known = error if isinstance(error, MocapSkelError) else bug(error, self._debug)
        self.failures.append(known)
        complain(known)
        if self.manner == "json":
            from mocap_skel.pipeline.telling import failure_row

            say(failure_row(clip, known))


def _one(clip: Path, job: Job, calls: _Calls) -> int:
    from mocap_skel.pipeline.clip_files import process
    from mocap_skel.pipeline.telling import told

    try:
        done = process(clip, job)
    except Exception as error:
        calls.failed(clip, error)
        return calls.code(written=False, clips=1)
    to_stdout = job.folder is None
    calls.wrote(clip, done.failed, done.notes, () if to_stdout else told(clip, done, calls.manner))
    if to_stdout:
        _send(clip, done)
    return calls.code(written=True, clips=1)


def _several(clips: tuple[Path, ...], job: Job, calls: _Calls) -> int:
    from mocap_skel.export.files import staging
    from mocap_skel.pipeline.engine import Local, Task

    assert job.folder is not None
    written: set[Path] = set()
    with staging(job.folder) as stage, Local() as engine:
        tasks = (Task(clip, job, stage, calls.manner) for clip in clips)
        for outcome in _progress(engine.run(tasks), len(clips)):
            _take(outcome, calls, written)
    return calls.code(bool(written), len(clips))


def _take(outcome: Outcome, calls: _Calls, written: set[Path]) -> None:
    """Put a clip's results into their places, and say so."""
    from mocap_skel.pipeline.clip_files import put

    clip, answer = outcome.task.path, outcome.result
    if isinstance(answer, Exception):
        calls.failed(clip, answer)
        return
    try:
        put(clip, outcome.task.job, answer.parts, written)
    except MocapSkelError as error:
        calls.failed(clip, error)
        return
    written |= set(answer.parts)
    calls.wrote(clip, answer.failed, answer.notes, answer.said)


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
        if is_closed(sys.stdout):
            raise CallError("-o -: standard output is closed", "give a folder")
        return None
    folder = Path(output)
    endings = {Path(f"walk{suffix}").suffix for suffix in suffixes}
    if folder.suffix.lower() in endings and not folder.is_dir():
        raise CallError(
            f"-o {output}: that is a file's name, and results go to a folder, each under the name of its clip",
            f"give a folder, or - for standard output: -o - > {shlex.quote(output)}",
        )
    return folder


def _progress(outcomes: Iterable[Outcome], count: int) -> Iterable[Outcome]:
    if not sys.stderr.isatty():
        return outcomes
    from tqdm import tqdm

    return tqdm(outcomes, total=count, unit="clip", file=sys.stderr)


def _send(path: Path, done: Done) -> None:
    if len(done.fits) > 1:
        names = ", ".join(fit.subject for fit in done.fits)
        raise CallError(f"{path}: -o - takes one subject", f"choose with --subject: {names}")
    from mocap_skel.export.files import Pieces

    content = next(iter(done.files.values()))
    if isinstance(content, bytes) and sys.stdout.isatty():
        raise CallError(f"{path}: this format is not for a terminal", "redirect it: -o - > file")
    for piece in content.make() if isinstance(content, Pieces) else (content,):
        say(piece, nl=False)

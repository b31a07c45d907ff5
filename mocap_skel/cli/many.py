"""Run a batch, show how far it is, and find the exit code."""

from __future__ import annotations

import json
import os
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mocap_skel.cli import FAILED, NOTHING_FITTED, USAGE, bug, complain, say, warn
from mocap_skel.errors import CallError, ExistsError, MocapSkelError
from mocap_skel.pipeline.batch import Batch, Event, Fate, Rules, results_of
from mocap_skel.text import counted

if TYPE_CHECKING:
    from tqdm import tqdm

    from mocap_skel.pipeline.engine import Engine
    from mocap_skel.pipeline.inputs import Place
    from mocap_skel.pipeline.job import Job
    from mocap_skel.pipeline.manifest import Manifest

# Seconds between two lines that say how far it is, where nobody watches a bar. Picked by eye.
_EVERY = 30.0
# Clips whose results exist already are named as far as these, the others are counted. Picked by eye.
_NAMED = 3


def run(
    places: Sequence[Place], job: Job, rules: Rules, engine: Engine, *, as_json: bool, quiet: bool
) -> int:
    """Fit the clips that are not finished, and write what became of all.

    Returns:
        The exit code.

    Raises:
        CallError: another batch writes there, or what lies there is not of a batch.
    """
    from mocap_skel.export.files import check_folder
    from mocap_skel.pipeline.manifest import Manifest

    assert job.folder is not None
    check_folder(job.folder)
    debug = bool(click.get_current_context().find_root().obj)
    since = time.monotonic()
    with Manifest(job.folder) as manifest:
        tables = _tables(job.folder, manifest, job.overwrite)
        results = results_of(manifest)
        places = [place for place in places if Path(os.path.abspath(place.path)) not in results]
        show = _Shown(len(places), quiet, as_json, debug)
        batch = Batch(places, job, rules, manifest, lambda error: bug(error, debug))
        broken = False
        try:
            # Its children end with it, whatever happens here.
            with show.progress(), closing(batch.run(engine)) as events:
                for event in events:
                    show.event(event)
        except MocapSkelError as error:
            if not show.written:
                raise
            # The batch came to an end before its clips did.
            complain(error)
            broken = True
        finally:
            rows, trouble = _write_tables(manifest, tables)
        if trouble is not None and not broken:
            complain(trouble)
            broken = True
    show.end()
    if as_json:
        for row in rows:
            say(json.dumps({"table": "summary", **row}, allow_nan=False))
    else:
        _print_summary(rows, job.folder)
    fates, left = show.fates, len(places) - show.fates.total()
    if not quiet:
        warn(_in_words(fates, left, time.monotonic() - since))
    if not show.trouble and not broken:
        return 0
    if show.written or fates[Fate.KEPT] or fates[Fate.SKIPPED]:
        return FAILED
    return USAGE if show.only_wrong_calls else NOTHING_FITTED


class _Shown:
    """What is shown of a batch while it goes on, and what there is to know at its end.

    Attributes:
        fates: how many clips had each.
        written: whether any clip has results of this call.
        trouble: whether anything failed, of the clips that are kept, too.
        only_wrong_calls: whether all that failed failed because of the call itself.
    """

    def __init__(self, clips: int, quiet: bool, as_json: bool, debug: bool) -> None:
        self.fates: Counter[Fate] = Counter()
        self.written = self.trouble = False
        self.only_wrong_calls = True
        self._clips, self._quiet, self._json, self._debug = clips, quiet, as_json, debug
        self._there = 0
        self._bar: tqdm[Any] | None = None
        self._since = self._last = time.monotonic()

    @contextmanager
    def progress(self) -> Iterator[None]:
        """A bar, where somebody watches."""
        if self._quiet or not sys.stderr.isatty():
            yield
            return
        from tqdm import tqdm

        with tqdm(total=self._clips, unit="clip", file=sys.stderr) as self._bar:
            yield

    def end(self) -> None:
        """Say what was only counted."""
        if self._there > _NAMED:
            warn(f"error: {self._there - _NAMED} more exist already")

    def event(self, event: Event) -> None:
        """Show that the call is done with a clip."""
        self.fates[event.fate] += 1
        self.written |= bool(event.line and event.line["files"])
        failures = [
            e if isinstance(e, MocapSkelError) else bug(e, self._debug) for e in event.failures
        ]
        self.trouble |= bool(failures)
        self.only_wrong_calls &= all(isinstance(error, CallError) for error in failures)
        if self._bar is not None:
            self._bar.clear()
        for failure in failures:
            self._there += isinstance(failure, ExistsError)
            if not isinstance(failure, ExistsError) or self._there <= _NAMED:
                complain(failure)
        if self._json:
            line = event.line or {"clip": str(event.place.path), "name": event.place.name}
            more = {} if event.line else {"status": event.fate.value, "reason": _reason(failures)}
            say(json.dumps({"table": "clips", **line, **more}, allow_nan=False))
        if self._bar is not None:
            self._bar.update()
            self._bar.set_postfix(failed=self.fates[Fate.FAILED])
        elif not self._quiet and time.monotonic() - self._last > _EVERY:
            self._last = time.monotonic()
            rate = self.fates.total() / (self._last - self._since)
            warn(
                f"{self.fates.total()} of {counted(self._clips, 'clip')}, "
                f"{self.fates[Fate.FAILED]} failed, {rate:.1f} a second"
            )


def _reason(failures: Sequence[MocapSkelError]) -> str | None:
    return "; ".join(error.message for error in failures) or None


def _tables(folder: Path, manifest: Manifest, overwrite: bool) -> tuple[Path, Path]:
    """The files of the tables that a batch ends with.

    Raises:
        OutputError: they are there, and are of no batch.
    """
    from mocap_skel.export.files import check_free

    tables = folder / "manifest.csv", folder / "summary.csv"
    check_free(tables, overwrite or len(manifest) > 0)
    return tables


def _write_tables(
    manifest: Manifest, tables: tuple[Path, Path]
) -> tuple[list[dict[str, object]], MocapSkelError | None]:
    """Write manifest.csv and summary.csv; the rows of the latter, or why they cannot be written."""
    from mocap_skel.export.files import put_all, stage_all, staging
    from mocap_skel.export.tables_csv import rows_csv
    from mocap_skel.pipeline.placing import STAGE
    from mocap_skel.pipeline.summary import clip_row, summary

    if not len(manifest):
        return [], None
    try:
        rows = summary(manifest.lines())
        contents = {tables[0]: rows_csv([clip_row(line) for line in manifest.lines()])}
        if rows:
            contents[tables[1]] = rows_csv(rows)
        # What is half written is found by the next batch, and goes away.
        with staging(manifest.folder, STAGE) as stage:
            put_all(stage_all(contents, stage), overwrite=True)
    except MocapSkelError as error:
        return [], error
    return rows, None


def _print_summary(rows: Sequence[dict[str, object]], folder: Path) -> None:
    from mocap_skel.pipeline.summary import HEAD, in_words
    from mocap_skel.pipeline.telling import wrote
    from mocap_skel.report.terminal import table

    if rows:
        say(table(HEAD, list(in_words(rows)), frozenset({0})))
        say(wrote(folder / name for name in ("manifest.jsonl", "manifest.csv", "summary.csv")))


def _in_words(fates: Counter[Fate], left: int, seconds: float) -> str:
    """What became of the clips, and how fast."""
    said = [f"{count} {fate.value}" for fate, count in fates.items()]
    said += [f"{left} not begun"] if left else []
    done = fates[Fate.FITTED] + fates[Fate.FAILED]
    clips = counted(fates.total() + left, "clip")
    rate = f", {done / seconds:.1f} clips a second" if done else ""
    return f"{clips}: {', '.join(said) or 'nothing to do'}; {seconds:.1f} s{rate}"

"""A batch: many clips, each fitted once, however often the call is ended and begun again."""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from enum import Enum
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from mocap_skel.errors import ExistsError, MocapSkelError, OutputError
from mocap_skel.export.digest import digest_of
from mocap_skel.export.files import check_free, identity, staging
from mocap_skel.labels.association import Association
from mocap_skel.pipeline.clip_files import check_not_taken, target_of
from mocap_skel.pipeline.engine import Answer, Engine, Outcome, Task
from mocap_skel.pipeline.inputs import Place
from mocap_skel.pipeline.job import Job
from mocap_skel.pipeline.manifest import DONE, FAILED, PARTLY, Finished, Manifest
from mocap_skel.pipeline.placing import STAGE, clean_up, put_with_line, sizes
from mocap_skel.pipeline.told_options import fit_options, has_all, options_of
from mocap_skel.text import stem


class Fate(Enum):
    """What became of a clip in a call."""

    FITTED = "fitted"
    FAILED = "failed"
    KEPT = "kept"
    SKIPPED = "skipped"


@dataclass(frozen=True)
class Event:
    """A clip that the call is done with.

    Attributes:
        place: which.
        fate: what became of it.
        failures: why it, or a part of it, failed; an unexpected error as it is.
        line: the manifest's, None where there is none.
    """

    place: Place
    fate: Fate
    failures: tuple[Exception, ...] = ()
    line: dict[str, Any] | None = None


@dataclass(frozen=True)
class Rules:
    """How a batch goes on.

    Attributes:
        resume: keep what is finished by the manifest.
        skip_existing: leave clips alone whose results are there, whatever made them.
        fail_fast: end with the first clip that fails.
        associations: patterns of clips' names, and the association of those; the first that fits counts.
    """

    resume: bool = True
    skip_existing: bool = False
    fail_fast: bool = False
    associations: tuple[tuple[str, Association], ...] = ()


@dataclass
class Batch:
    """The clips of a call on their way to a folder of results with its manifest.

    Attributes:
        places: the clips.
        job: what to do with each; `job.folder` is the folder of results.
        rules: how to go on.
        manifest: of that folder.
        tell: what to make of an error that nobody raised on purpose.
    """

    places: Sequence[Place]
    job: Job
    rules: Rules
    manifest: Manifest
    tell: Callable[[Exception], MocapSkelError]
    _clip: dict[Path, Place] = field(default_factory=dict)
    _written: set[Path] = field(default_factory=set)
    _aside: list[Event] = field(default_factory=list)
    _options: dict[int, dict[str, Any]] = field(default_factory=dict)
    _inputs: frozenset[tuple[int, int]] = frozenset()

    def run(self, engine: Engine) -> Generator[Event, None, None]:
        """Fit what is not finished; each clip is one event, in the order in which they end.

        Raises:
            OutputError: nothing can be written any more.
        """
        assert self.job.folder is not None
        clean_up(self.manifest)
        self._inputs = frozenset(found for path in self.job.inputs if (found := identity(path)))
        with staging(self.job.folder, STAGE) as stage, engine:
            for outcome in engine.run(self._tasks(stage)):
                yield from self._set_aside()
                event = self._take(outcome, stage)
                yield event
                if event.fate is Fate.FAILED and self.rules.fail_fast:
                    return
            yield from self._set_aside()

    def _set_aside(self) -> Iterator[Event]:
        events, self._aside = self._aside, []
        yield from events

    def _tasks(self, stage: Path) -> Iterator[Task]:
        """The tasks of all clips that are not finished; the others are set aside."""
        for place in self.places:
            job = self._job_of(place)
            try:
                kept = self._settled(place, job)
            except MocapSkelError as error:
                self._aside.append(Event(place, Fate.FAILED, (error,)))
                if self.rules.fail_fast:
                    return
                continue
            if kept is not None:
                self._aside.append(Event(place, kept, self._failed_before(place, kept)))
                continue
            self._clip[place.path] = place
            yield Task(place.path, job, stage, hashed=True)

    def _failed_before(self, place: Place, fate: Fate) -> tuple[Exception, ...]:
        """What of a clip failed in an earlier call, and would fail again."""
        known = self.manifest.finished(place.name)
        if fate is not Fate.KEPT or known is None or known.reason is None:
            return ()
        return (MocapSkelError(f"{place.path}: {known.reason}"),)

    def _job_of(self, place: Place) -> Job:
        """The job of one clip: its own folder, its own association, no list of all other inputs."""
        assert self.job.folder is not None
        found = [
            one for pattern, one in self.rules.associations if fnmatchcase(place.name, pattern)
        ]
        return replace(
            self.job,
            association=found[0] if found else self.job.association,
            folder=(self.job.folder / place.name).parent,
            inputs=frozenset([place.path]),
        )

    def _settled(self, place: Place, job: Job) -> Fate | None:
        """What is decided about a clip before it is read: that it is left as it is, or None: it is to be fitted.

        Raises:
            ExistsError: results are there that may not be replaced.
            ClipError: it cannot be read, so that nobody knows whether it is finished.
        """
        known = self.manifest.finished(place.name)
        whole = known is not None and self._whole(known)
        same = whole and known is not None and has_all(known.options, self.options_of(job))
        if (
            self.rules.resume
            and same
            and known is not None
            and known.sha256 == digest_of(place.path)
        ):
            self.manifest.renew(place.name)
            return Fate.KEPT
        if job.overwrite:
            return None
        try:
            suffixes = [suffix for chosen in job.formats for suffix in chosen.format.suffixes]
            targets = [target_of(job, stem(place.path), suffix) for suffix in suffixes]
            # Those of its subjects, too, as far as they are known; the others are seen when it is read.
            targets += [
                self.manifest.folder / name
                for name in (known.files if known else ())
                if name.endswith(tuple(suffixes))
            ]
            check_free(targets, overwrite=False)
        except ExistsError as error:
            if self.rules.skip_existing:
                return Fate.SKIPPED
            why = ""
            if whole:
                why = (
                    "the clip was another when it was fitted"
                    if same
                    else "fitted with other options"
                )
            raise ExistsError(
                f"{place.path}: {error.message}" + (f" ({why})" if why else ""),
                "--overwrite replaces it, --skip-existing leaves it",
            ) from None
        return None

    def _whole(self, known: Finished) -> bool:
        """Whether the results of a clip are all there, of the size that they had."""
        try:
            return all(
                (self.manifest.folder / name).stat().st_size == size
                for name, size in known.files.items()
            )
        except OSError:
            return False

    def options_of(self, job: Job) -> dict[str, Any]:
        """`options_of`, found once for each association."""
        key = id(job.association)
        if key not in self._options:
            self._options[key] = options_of(job)
        return self._options[key]

    def _take(self, outcome: Outcome, stage: Path) -> Event:
        task, result = outcome.task, outcome.result
        place = self._clip.pop(task.path)
        line: dict[str, Any] = {
            "clip": str(place.path), "name": place.name, "status": FAILED, "reason": None, "notes": [],
            "seconds": round(outcome.seconds, 3), "sha256": "", "joints": [], "files": {},
            "options": self.options_of(task.job),
        }  # fmt: skip
        if isinstance(result, Answer):
            failed: tuple[Exception, ...] = result.failed
            try:
                line |= {
                    "status": PARTLY if failed else DONE, "reason": self._reason(failed),
                    "notes": list(result.notes), "sha256": result.digest, "joints": list(result.joints),
                    "files": sizes(result.parts, self.manifest.folder),
                }  # fmt: skip
                self._add_formats(line)
                self._put(task, result, line, stage)
            except MocapSkelError as error:
                result = error
            else:
                return Event(place, Fate.FAILED if failed else Fate.FITTED, failed, line)
        if isinstance(result, ExistsError) and self.rules.skip_existing:
            return Event(place, Fate.SKIPPED)
        line |= {"status": FAILED, "reason": self._reason((result,)), "files": {}, "joints": []}
        if not line["sha256"]:
            with suppress(MocapSkelError):
                line["sha256"] = digest_of(place.path)
        self.manifest.append(line)
        return Event(place, Fate.FAILED, (result,), line)

    def _add_formats(self, line: dict[str, Any]) -> None:
        """Let the line tell of results in other formats, too, that are of the same fit."""
        known = self.manifest.finished(line["name"])
        if known is None or known.sha256 != line["sha256"] or not self._whole(known):
            return
        if fit_options(known.options) == fit_options(line["options"]):
            formats = {**known.options["formats"], **line["options"]["formats"]}
            line |= {
                "options": {**line["options"], "formats": formats},
                "files": {**known.files, **line["files"]},
            }

    def _put(self, task: Task, answer: Answer, line: dict[str, Any], stage: Path) -> None:
        """Put the results into their places, and tell the manifest."""
        for target in answer.parts:
            check_not_taken(task.path, target, self._written)
            if identity(target) in self._inputs:
                raise OutputError(f"{target}: is an input of this call", "use another -o")
        put_with_line(self.manifest, stage, answer.parts, line, task.job.overwrite)
        self._written |= set(answer.parts)

    def _reason(self, failed: Sequence[Exception]) -> str | None:
        known = [
            error if isinstance(error, MocapSkelError) else self.tell(error) for error in failed
        ]
        said = [
            f"{error.message} ({error.hint})" if error.hint else error.message for error in known
        ]
        return "; ".join(said) or None


def results_of(manifest: Manifest) -> set[Path]:
    """The result files that a manifest knows, as absolute paths: they are no inputs."""
    folder = Path(os.path.abspath(manifest.folder))
    return {folder / name for known in manifest.known() for name in known.files}

"""A batch: many clips, each fitted once, however often the call is ended and begun again."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, fields, replace
from enum import Enum
from fnmatch import fnmatchcase
from hashlib import sha256
from pathlib import Path
from shutil import rmtree
from typing import Any

from mocap_skel.errors import ExistsError, MocapSkelError, OutputError, ours
from mocap_skel.export.files import check_free, identity, staging
from mocap_skel.labels.association import Association
from mocap_skel.pipeline.clip_files import put, target_of
from mocap_skel.pipeline.engine import Answer, Engine, Outcome, Task, digest_of
from mocap_skel.pipeline.inputs import Place
from mocap_skel.pipeline.isolation import interrupts_held
from mocap_skel.pipeline.job import Job
from mocap_skel.pipeline.manifest import BROKEN, DONE, FAILED, PARTLY, Finished, Manifest
from mocap_skel.version import __version__

_STAGE = ".batch-"
_MOVING = "moving.json"
# Fields of a job that do not change what is in the result files.
_NO_OPTIONS = {
    "association",
    "figure",
    "calibration",
    "formats",
    "folder",
    "overwrite",
    "inputs",
    "command",
}


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

    def run(self, engine: Engine) -> Iterator[Event]:
        """Fit what is not finished; each clip is one event, in the order in which they end.

        Raises:
            OutputError: nothing can be written any more.
        """
        assert self.job.folder is not None
        clean_up(self.manifest)
        self._inputs = frozenset(found for path in self.job.inputs if (found := identity(path)))
        with staging(self.job.folder, _STAGE) as stage, engine:
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
                self._aside.append(Event(place, kept))
                continue
            self._clip[place.path] = place
            yield Task(place.path, job, stage, hashed=True)

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
            targets = [target_of(job, place.path.stem, suffix) for suffix in suffixes]
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
            status = PARTLY if failed else DONE
            line |= {
                "status": status, "reason": self._reason(failed), "notes": list(result.notes),
                "sha256": result.digest, "joints": list(result.joints),
                "files": {self._below(target): part.stat().st_size for target, part in result.parts.items()},
            }  # fmt: skip
            self._add_formats(line)
            try:
                self._put(task, result, line, stage)
            except MocapSkelError as error:
                result = error
            else:
                self._written |= set(result.parts)
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
        if _fit_options(known.options) == _fit_options(line["options"]):
            formats = {**known.options["formats"], **line["options"]["formats"]}
            line |= {
                "options": {**line["options"], "formats": formats},
                "files": {**known.files, **line["files"]},
            }

    def _put(self, task: Task, answer: Answer, line: dict[str, Any], stage: Path) -> None:
        """Put the results into their places and tell the manifest, without an interrupt in between."""
        for part in answer.parts.values():
            if not part.exists():
                raise OutputError(
                    f"{task.path}: its results are not where they were left: {part}",
                    "the workers and this machine have to share the folder of the results",
                )
        for target in answer.parts:
            if identity(target) in self._inputs:
                raise OutputError(f"{target}: is an input of this call", "use another -o")
        moving = stage / _MOVING
        entry = {
            "line": line,
            "new": [name for name in line["files"] if not os.path.lexists(self.manifest.folder / name)],
            "parts": {self._below(target): str(part.relative_to(stage)) for target, part in answer.parts.items()},
        }  # fmt: skip
        with interrupts_held(), ours(stage, OutputError):
            moving.write_text(json.dumps(entry), encoding="utf-8")
            put(task.path, task.job, answer.parts, self._written)
            try:
                self.manifest.append(line)
            except OutputError:
                for name in entry["new"]:
                    (self.manifest.folder / name).unlink(missing_ok=True)
                raise
            moving.unlink()
        first = next(iter(answer.parts.values()), None)
        if first is not None:
            rmtree(first.parent, ignore_errors=True)

    def _below(self, target: Path) -> str:
        return target.relative_to(self.manifest.folder).as_posix()

    def _reason(self, failed: Sequence[Exception]) -> str | None:
        known = [
            error if isinstance(error, MocapSkelError) else self.tell(error) for error in failed
        ]
        said = [
            f"{error.message} ({error.hint})" if error.hint else error.message for error in known
        ]
        return "; ".join(said) or None


def clean_up(manifest: Manifest) -> None:
    """Take away what a batch left that was killed: what waited, and files that were put while no line told of them.

    Raises:
        OutputError: the manifest cannot be written.
    """
    for stage in sorted(manifest.folder.glob(f"{_STAGE}*")):
        try:
            entry = json.loads((stage / _MOVING).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            entry = None
        if entry is not None:
            line = entry["line"]
            known = manifest.finished(line["name"])
            told = known is not None and (known.sha256, known.options, known.files) == (
                line["sha256"], line["options"], line["files"],
            )  # fmt: skip
            if not told:
                moved = [
                    name for name, part in entry["parts"].items() if not (stage / part).exists()
                ]
                for name in moved:
                    if name in entry["new"]:
                        (manifest.folder / name).unlink(missing_ok=True)
                if moved:
                    reason = "the program was ended while it put the results into their places"
                    manifest.append(
                        {**line, "status": BROKEN, "reason": reason, "files": {}, "joints": []}
                    )
        rmtree(stage, ignore_errors=True)


def options_of(job: Job) -> dict[str, Any]:
    """All that decides what is in the results of a clip: the version and the options that are no defaults.

    Files of the call are named, with a hash of what they say.
    """
    told: dict[str, Any] = {"version": __version__}
    if job.association is not None:
        told["assoc"] = Path(job.association.path).name
        told["assoc_sha256"] = _hash(replace(job.association, path=""))
    if job.figure is not None:
        told["skeleton"] = job.figure.name
        told["skeleton_sha256"] = _hash(job.figure)
    if job.calibration is not None:
        told["calibration_sha256"] = sha256(_calibration_text(job)).hexdigest()
    for one in fields(job):
        value = getattr(job, one.name)
        if one.name not in _NO_OPTIONS and value != one.default:
            told[one.name] = value
    told["formats"] = {
        chosen.format.name: {
            key: value for key, value in asdict(chosen.options).items()
            if value != getattr(type(chosen.options)(), key)
        }
        for chosen in job.formats
    }  # fmt: skip
    # As it is read from the manifest: lists, no tuples.
    plain: dict[str, Any] = json.loads(json.dumps(told, default=str))
    return plain


def has_all(known: Mapping[str, Any], wanted: Mapping[str, Any]) -> bool:
    """Whether results with the known options are all that is wanted: the same fit, and at least the formats."""
    formats = known["formats"]
    return _fit_options(known) == _fit_options(wanted) and all(
        formats.get(name) == told for name, told in wanted["formats"].items()
    )


def _fit_options(options: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in options.items() if name != "formats"}


def _calibration_text(job: Job) -> bytes:
    from mocap_skel.export.calibration_json import calibration_json

    assert job.calibration is not None
    return calibration_json(job.calibration, ()).encode()


def _hash(thing: object) -> str:
    return sha256(repr(thing).encode()).hexdigest()[:16]


def results_of(manifest: Manifest) -> set[Path]:
    """The result files that a manifest knows, as absolute paths: they are no inputs."""
    folder = Path(os.path.abspath(manifest.folder))
    return {folder / name for known in manifest.known() for name in known.files}

"""Many clips, each in a child that may die instead of us: what a child is told, what it answers, who runs them."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self

from mocap_skel.errors import ClipError, MocapSkelError, ours
from mocap_skel.export.digest import digest_of
from mocap_skel.export.files import stage_all
from mocap_skel.pipeline.clip_files import render
from mocap_skel.pipeline.isolation import TaskError, Worker, first_ready, most_overdue
from mocap_skel.pipeline.job import Job
from mocap_skel.pipeline.limits import bytes_of, memory_for
from mocap_skel.pipeline.telling import Manner, told
from mocap_skel.results.tables import joint_rows

# What one clip in a child may take; a long clip honestly needs more than a short one.
SECONDS, SECONDS_PER_BYTE = 30.0, 2e-6
# What an answer keeps of a joint's row, beside the subject.
KEPT = ("joint", "shown", "x", "y", "z", "bone")


@dataclass(frozen=True)
class Task:
    """One clip of many.

    Attributes:
        path: its file.
        job: what to do with it; `job.folder` is where its results belong.
        stage: a folder on the same disk, where they wait until they are put there.
        manner: what to say of it.
        hashed: whether the answer has the file's hash and the joints.
    """

    path: Path
    job: Job
    stage: Path
    manner: Manner = ""
    hashed: bool = False


@dataclass(frozen=True)
class Answer:
    """What a child says of a clip: rows and text, no fits and no contents of files.

    Attributes:
        parts: result file → where its content waits.
        notes: what there is to say about the clip, one sentence each.
        failed: why other subjects could not be fitted, or formats not written.
        said: what to print, as `telling.told` has it.
        joints: one row a joint and subject, with the columns `KEPT`.
        digest: the file's hash, "" where none is wanted.
    """

    parts: dict[Path, Path]
    notes: tuple[str, ...]
    failed: tuple[MocapSkelError, ...]
    said: tuple[str, ...] = ()
    joints: tuple[dict[str, Any], ...] = ()
    digest: str = ""


@dataclass(frozen=True)
class Outcome:
    """How a task ended: with an answer, or with an error.

    Attributes:
        task: which.
        result: either of them.
        seconds: from its start to its end.
    """

    task: Task
    result: Answer | Exception
    seconds: float


class Engine(Protocol):
    """Who runs tasks. As a context, it ends what it has started."""

    def run(self, tasks: Iterable[Task]) -> Iterator[Outcome]:
        """Run the tasks, which are taken as there is room for them; what ends first comes first."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None: ...


@dataclass
class Local:
    """Children of this process, each with one task at a time. With one child, tasks end in their order.

    Attributes:
        jobs: how many.
    """

    jobs: int = 1
    _workers: list[Worker] = field(default_factory=list)

    def __enter__(self) -> Self:
        self._workers = [Worker() for _ in range(self.jobs)]
        return self

    def __exit__(self, *_: object) -> None:
        for worker in self._workers:
            worker.stop()

    def run(self, tasks: Iterable[Task]) -> Iterator[Outcome]:
        """See `Engine`."""
        waiting = iter(tasks)
        busy: dict[Worker, tuple[Task, float]] = {}
        free = list(self._workers)
        while True:
            while free and (task := next(waiting, None)) is not None:
                worker = free.pop()
                begin(worker, task)
                busy[worker] = task, time.monotonic()
            if not busy:
                return
            outcomes = []
            for worker in first_ready([*busy]) or [most_overdue([*busy])]:
                ended, since = busy.pop(worker)
                result = result_of(worker, ended)
                outcomes.append(Outcome(ended, result, time.monotonic() - since))
                # The next clip is fitted while the caller is busy with this one.
                if (task := next(waiting, None)) is not None:
                    begin(worker, task)
                    busy[worker] = task, time.monotonic()
                else:
                    free.append(worker)
            yield from outcomes


def begin(worker: Worker, task: Task, folder: Path | None = None) -> None:
    """Let a child do a task, within the limits of its clip.

    Args:
        worker: the child.
        task: what it does.
        folder: from which the task's paths lead on; None = the current one.
    """
    path = (folder or Path()) / task.path
    arguments = (task,) if folder is None else (task, folder)
    worker.start(work, *arguments, memory=memory_for(path), seconds=seconds_for(path))


def seconds_for(path: Path) -> float:
    """Seconds that the clip in a file may take in a child."""
    return SECONDS + SECONDS_PER_BYTE * bytes_of(path)


def result_of(worker: Worker, task: Task) -> Answer | Exception:
    """What came of the task of a child; waits for it."""
    try:
        answer: Answer = worker.result()
    except TaskError as error:
        return ClipError(f"{task.path}: {error}")
    except Exception as error:
        return error
    return answer


def work(task: Task, folder: Path | None = None) -> Answer:
    """Read, fit and render a clip, and leave its results where the task says. It runs in a child.

    Args:
        task: what to do.
        folder: from which the task's paths lead on; None = the current one.

    Raises:
        MocapSkelError: as `clip_files.render`; or nothing can be written.
    """
    if folder is not None:
        with ours(folder, ClipError):
            os.chdir(folder)
    digest = digest_of(task.path) if task.hashed else ""
    done = render(task.path, task.job)
    joints = tuple(
        {"subject": fit.subject, **{key: row[key] for key in KEPT}}
        for fit in done.fits
        for row in joint_rows(fit, angles=False)
        if task.hashed
    )
    parts = stage_all(done.files, task.stage)
    said = told(task.path, done, task.manner)
    return Answer(parts, done.notes, done.failed, said, joints, digest)

"""Clips on many machines: an engine that gives its tasks to the workers of a Dask scheduler."""

from __future__ import annotations

import logging
import multiprocessing
import os
import threading
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Self

from mocap_skel.errors import CallError, ClipError, MocapSkelError
from mocap_skel.extras import extra
from mocap_skel.pipeline.engine import Answer, Outcome, Task, begin, result_of
from mocap_skel.pipeline.isolation import Worker
from mocap_skel.version import __version__

# Seconds to wait for a scheduler. Picked by eye.
_PATIENCE = 10.0
# How an address of a scheduler in another process begins.
_SCHEMES = ("tcp", "tls", "ucx", "ws", "wss")
# Tasks that wait at the workers for each that is under way, so that none is idle while an answer travels.
_AHEAD = 2


class Dask:
    """The workers of a Dask scheduler, which share the folders of the clips and of the results with this process.

    A worker fits each clip in a child of its own, within the limits of the clip. A task whose worker dies is given
    to another one. Only this process puts results into their places, so that none is there twice.
    """

    def __init__(self, scheduler: str, jobs: int | None = None) -> None:
        """Name the scheduler: tcp://HOST:PORT. `jobs` is the largest number of clips under way, None = no limit.

        Raises:
            CallError: it is no address.
            MissingExtraError: dask.distributed is not installed.
        """
        if scheduler.partition("://")[0] not in _SCHEMES:
            raise CallError(f"{scheduler}: no address of a scheduler", "give tcp://HOST:PORT")
        self._scheduler, self._jobs = scheduler, jobs
        self._dask = extra("distributed", "cluster")
        self._client: Any = None

    def __enter__(self) -> Self:
        # What it logs is no message for a user.
        for name in ("distributed", "tornado"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
        try:
            self._client = self._dask.Client(
                self._scheduler, timeout=_PATIENCE, set_as_default=False
            )
        except (OSError, ValueError, TypeError) as error:
            said = " ".join(str(error).split()) or type(error).__name__
            raise CallError(f"{self._scheduler}: no scheduler answers: {said}") from error
        return self

    def __exit__(self, *_: object) -> None:
        # Tasks under way end by themselves; what they leave goes away with the folder where it waits.
        self._client.close()

    def run(self, tasks: Iterable[Task]) -> Iterator[Outcome]:
        """See `Engine`.

        Raises:
            MocapSkelError: the scheduler has gone.
        """
        waiting = iter(tasks)
        here = os.getcwd()
        under_way: dict[Any, Task] = {}
        ended = self._dask.as_completed(loop=self._client.loop)
        while True:
            while len(under_way) < self._room() and (task := next(waiting, None)) is not None:
                future = self._client.submit(remote, task, here, __version__, pure=False)
                under_way[future] = task
                ended.add(future)
            if not under_way:
                return
            future = next(ended)
            task = under_way.pop(future)
            yield Outcome(task, *self._result(future, task))

    def _room(self) -> int:
        threads = sum(self._client.nthreads().values())
        return min(self._jobs or threads * _AHEAD, threads * _AHEAD) or 1

    def _result(self, future: Any, task: Task) -> tuple[Answer | Exception, float]:
        try:
            result, seconds = future.result()
        except self._dask.KilledWorker as error:
            return ClipError(f"{task.path}: every worker that had it died: {error}"), 0.0
        except Exception as error:
            if future.cancelled() or self._client.status != "running":
                raise MocapSkelError(
                    f"{self._scheduler}: the scheduler has gone",
                    "the same call again goes on from here",
                ) from error
            return error, 0.0
        return result, seconds


_own = threading.local()


def remote(task: Task, folder: str, version: str) -> tuple[Answer | Exception, float]:
    """Do a task in a child of a worker.

    Args:
        task: its paths are those of the caller.
        folder: the caller's current one.
        version: the caller's.

    Returns:
        What came of it, and the seconds that it took.
    """
    if version != __version__:
        said = f"the worker has mocap-skel {__version__}, this call {version}"
        return CallError(said, "install the same on both"), 0.0
    # The children of Dask's workers may have no children, unless they are told otherwise.
    multiprocessing.current_process()._config["daemon"] = False  # type: ignore[attr-defined]
    if not hasattr(_own, "worker"):
        _own.worker = Worker()
    since = time.monotonic()
    begin(_own.worker, task, Path(folder))
    return result_of(_own.worker, task), time.monotonic() - since

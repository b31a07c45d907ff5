"""Independent tasks on all cores."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

Task = TypeVar("Task")
Result = TypeVar("Result")

# What the BLAS libraries that numpy comes with read when they are loaded.
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def in_parallel(
    function: Callable[[Task], Result], tasks: Sequence[Task], workers: int | None
) -> Iterator[Result]:
    """Call a function with each of several tasks, on all cores; the results in the order of the tasks.

    Args:
        function: called with each task; where several processes work, a new one must be able to import it.
        tasks: as many as there are.
        workers: processes; as many as cores if None. One is this process itself.

    Raises:
        Exception: what `function` raises, at its result; the other processes are ended.

    Example:
        >>> from mocap_skel.studies.parallel import in_parallel
        >>> list(in_parallel(abs, [-1, 2, -3], workers=1))
        [1, 2, 3]
    """
    count = min(workers or os.cpu_count() or 1, len(tasks))
    if count < 2:
        yield from map(function, tasks)
        return
    # Workers that each used all cores for their matrices would get in each other's way; and a
    # process that is forked while BLAS has threads may hang.
    with (
        _one_thread_each(),
        ProcessPoolExecutor(
            count, multiprocessing.get_context("spawn"), initializer=_leave_interrupts
        ) as pool,
    ):
        try:
            yield from pool.map(function, tasks)
        except BaseException:
            # The pool would wait for what its workers have begun.
            for worker in multiprocessing.active_children():
                worker.terminate()
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _leave_interrupts() -> None:
    # Ctrl-C goes to the parent, which ends its workers.
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def use_one_core() -> None:
    """Keep numpy to one core, to compare times with a thesis that had one: before numpy is loaded."""
    os.environ.update(dict.fromkeys(_THREADS, "1"))


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Let processes that start meanwhile use one thread each."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value

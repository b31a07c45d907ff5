"""A child process for work that may crash, hang or eat memory: its end is one failed task, not ours."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

GIGABYTE = 1 << 30


class TaskError(Exception):
    """A task that came to no end of its own; the message says why, without naming the task."""


class Worker:
    """Does one task after another in a child, which is started when needed and replaced when it dies.

    One task may be under way while the caller is busy with the result of the one before.
    """

    def __init__(self) -> None:
        self._child: BaseProcess | None = None
        self._pipe: Connection | None = None

    def __enter__(self) -> Worker:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def start(self, function: Callable[..., Any], *arguments: Any, memory: int) -> None:
        """Begin a task.

        Args:
            function: what a new process can import.
            arguments: what can be sent to it.
            memory: bytes that it may use.
        """
        if self._child is None or not self._child.is_alive():
            self.stop()
            self._spawn()
        assert self._pipe is not None
        # A child that died in between is noticed when its result is asked for.
        with suppress(BrokenPipeError, ConnectionResetError):
            self._pipe.send((function, arguments, memory))

    def result(self, seconds: float) -> Any:
        """What the task returns; what it raises is raised here.

        Args:
            seconds: that it may take from now on.

        Raises:
            TaskError: it crashed, was killed, or took too long.
        """
        assert self._child is not None and self._pipe is not None
        ready = wait([self._pipe, self._child.sentinel], seconds)
        if not ready:
            self.stop()
            raise TaskError(f"took longer than {seconds:.0f} s")
        try:
            worked, value = self._pipe.recv()
        except (EOFError, OSError, pickle.UnpicklingError):
            self._child.join(5)
            code = self._child.exitcode
            self.stop()
            raise TaskError(_died(code)) from None
        if worked:
            return value
        raise value

    def stop(self) -> None:
        """End the child, whatever it does."""
        if self._child is not None:
            self._child.kill()
            self._child.join()
            self._child.close()
        if self._pipe is not None:
            self._pipe.close()
        self._child = self._pipe = None

    def _spawn(self) -> None:
        # A process that is forked while BLAS has threads may hang.
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._child = context.Process(target=_serve, args=(theirs,), daemon=True)
        with _interrupts_held():
            self._child.start()
        theirs.close()


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Ctrl-C waits, here and in a process that starts meanwhile: it would die of it, and say so."""
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _died(code: int | None) -> str:
    if code is not None and code < 0:
        with suppress(ValueError):
            return f"the process that read it was ended by {signal.Signals(-code).name}"
    return f"the process that read it ended with code {code}"


def _serve(pipe: Connection) -> None:
    """The child: tasks until the pipe closes."""
    # Ctrl-C goes to the parent, which ends its child.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # What a library in C prints before it dies is no message for a user.
    silence = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(silence, stream)
    while True:
        try:
            function, arguments, memory = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            _limit(memory)
            answer = True, function(*arguments)
        except MemoryError:
            answer = False, TaskError(f"needs more than {memory / GIGABYTE:.3g} GB of memory")
        except Exception as error:
            # The parent has no other way to see where it was raised.
            error.add_note(traceback.format_exc())
            answer = False, error
        try:
            pipe.send(answer)
        except (pickle.PicklingError, TypeError, AttributeError) as error:
            pipe.send((False, RuntimeError(f"{type(answer[1]).__name__}: {error}")))
        except OSError:
            return


def _limit(memory: int) -> None:
    """Let this process use so many bytes, where the system can see to it."""
    statistics = Path("/proc/self/statm")
    if sys.platform == "win32" or not statistics.exists():
        return
    import resource

    # Address space is what can be limited, and BLAS reserves much more than it uses.
    reserved, used = (int(n) * resource.getpagesize() for n in statistics.read_text().split()[:2])
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    limit = reserved + max(0, memory - used)
    if hard != resource.RLIM_INFINITY:
        limit = min(limit, hard)
    resource.setrlimit(resource.RLIMIT_AS, (limit, hard))

"""A child process for work that may crash, hang or eat memory: its end is one failed task, not ours."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

from mocap_skel.errors import MocapSkelError
from mocap_skel.export.interrupts import SIGNS, interrupts_held
from mocap_skel.pipeline.limits import (
    GIGABYTE,
    limit,
    restore,
    starved,
    too_much,
    used_memory,
    used_seconds,
)

__all__ = ["GIGABYTE", "TaskError", "Worker", "first_ready", "most_overdue"]

# A child that holds more between two tasks is replaced: what it keeps of one clip is room that the
# next would lack, and its address space says no more how much that one uses.
_KEPT = 300 << 20
# On a busy machine a task has a core for a part of its time only. So one whose time is over gets a tenth of it more, again
# and again, while it has a core for so large a share, up to so many times its time. Picked by eye: one that hangs has none.
_MORE, _AT_WORK, _PATIENCE = 0.1, 0.02, 20.0
# Seconds: the system counts a core's time in hundredths.
_LEAST_MORE = 1.0


class TaskError(Exception):
    """A task that came to no end of its own; the message says why, without naming the task."""


class Worker:
    """Does one task after another in a child, which is started when needed and replaced when it dies.

    One task may be under way while the caller is busy with the result of the one before.
    """

    def __init__(self) -> None:
        self._child: BaseProcess | None = None
        self._pipe: Connection | None = None
        self._fat = False
        self._seconds = self._since = self._until = 0.0
        # Seconds for which the child has had a core: at the task's begin, and when that was last looked at.
        self._before = self._seen = 0.0

    def __enter__(self) -> Worker:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def start(
        self, function: Callable[..., Any], *arguments: Any, memory: int, seconds: float
    ) -> None:
        """Begin a task.

        Args:
            function: what a new process can import.
            arguments: what can be sent to it.
            memory: bytes that it may use.
            seconds: that it may take.
        """
        if self._child is None or self._fat or not self._child.is_alive():
            self.stop()
            self._spawn()
        assert self._pipe is not None
        # A child that died in between is noticed when its result is asked for.
        with suppress(BrokenPipeError, ConnectionResetError):
            self._pipe.send((function, arguments, memory))
        self._seconds, self._since = seconds, time.monotonic()
        self._until = self._since + seconds
        assert self._child is not None and self._child.pid is not None
        self._before = self._seen = used_seconds(self._child.pid) or 0.0

    def result(self) -> Any:
        """What the task returns, as soon as it is there; what it raises is raised here.

        Raises:
            TaskError: it crashed, was killed, or took too long.
        """
        assert self._child is not None and self._pipe is not None
        if not first_ready([self]):
            self.stop()
            raise TaskError(f"took longer than {self._seconds:.0f} s")
        try:
            worked, value, self._fat = self._pipe.recv()
        except (EOFError, OSError, pickle.UnpicklingError):
            self._child.join(5)
            code = self._child.exitcode
            self.stop()
            raise TaskError(_died(code)) from None
        if worked:
            return value
        raise value

    def wait_longer(self) -> bool:
        """Whether a child whose time is over has only waited for a core, and gets some more time."""
        used = used_seconds(self._child.pid) if self._child and self._child.pid else None
        if used is None or used - self._before >= self._seconds:
            return False
        more = max(_LEAST_MORE, self._seconds * _MORE)
        moved, self._seen = used - self._seen, used
        if moved < _AT_WORK * more or time.monotonic() > self._since + _PATIENCE * self._seconds:
            return False
        self._until = time.monotonic() + more
        return True

    def stop(self) -> None:
        """End the child, whatever it does."""
        if self._child is not None:
            self._child.kill()
            self._child.join()
            self._child.close()
        if self._pipe is not None:
            self._pipe.close()
        self._child = self._pipe = None
        self._fat = False

    def _spawn(self) -> None:
        # A process that is forked while BLAS has threads may hang.
        context = multiprocessing.get_context("spawn")
        try:
            with interrupts_held():
                # Its start lets signals through again, which the child's start must not.
                resource_tracker.ensure_running()
            with interrupts_held():
                self._pipe, theirs = context.Pipe()
                with closing(theirs):
                    child = context.Process(target=_serve, args=(theirs,), daemon=True)
                    child.start()
                    self._child = child
        except OSError as error:
            said = f"a child process cannot be started: {error.strerror}"
            raise MocapSkelError(said, "ulimit -a shows what there may be") from error


def first_ready(busy: Sequence[Worker]) -> list[Worker]:
    """Wait for workers with a task under way, until one has come to its end or the time of one is over.

    Args:
        busy: the workers, one or more.

    Returns:
        Those whose task has come to its end; none where a time is over first.
    """
    # What a task says, and its process's end.
    signs: dict[Any, Worker] = {}
    for worker in busy:
        if worker._pipe and worker._child:
            signs |= {worker._pipe: worker, worker._child.sentinel: worker}
    while True:
        next_one = most_overdue(busy)
        ready = wait(list(signs), max(0.0, next_one._until - time.monotonic()))
        if ready or not next_one.wait_longer():
            return list(dict.fromkeys(signs[sign] for sign in ready))


def most_overdue(busy: Sequence[Worker]) -> Worker:
    """The worker whose time is over first."""
    return min(busy, key=lambda worker: worker._until)


def _died(code: int | None) -> str:
    if code is not None and code < 0:
        with suppress(ValueError):
            return f"the process that read it was ended by {signal.Signals(-code).name}"
    return f"the process that read it ended with code {code}"


def _serve(pipe: Connection) -> None:
    """The child: tasks until the pipe closes."""
    # Ctrl-C goes to the parent, which ends its child. The others were held while this process started.
    for sign in SIGNS:
        signal.signal(sign, signal.SIG_IGN if sign == signal.SIGINT else signal.SIG_DFL)
    if sys.platform != "win32":
        signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNS)
    # What a library in C prints before it dies is no message for a user.
    silence = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(silence, stream)
    before = None
    while True:
        try:
            function, arguments, memory = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            # The last task's limit is not the user's.
            restore(before)
            before = limit(memory)
            answer = True, function(*arguments)
        except Exception as error:
            answer = False, _told(error, memory)
        try:
            _send(pipe, *answer)
        except OSError:
            return


def _send(pipe: Connection, worked: bool, value: Any) -> None:
    """The answer, or that it cannot be sent, and whether this process is to be replaced."""
    try:
        message = pickle.dumps((worked, value, used_memory()[1] > _KEPT))
    except MemoryError:
        value = TaskError("needs more memory than it may use for its result")
        message = pickle.dumps((False, value, True))
    except (pickle.PicklingError, TypeError, AttributeError) as error:
        value = RuntimeError(f"{type(value).__name__}: {error}")
        message = pickle.dumps((False, value, used_memory()[1] > _KEPT))
    pipe.send_bytes(message)


def _told(error: Exception, memory: int) -> Exception:
    """An error as the parent gets it: want of memory has many names."""
    if starved(error):
        return TaskError(too_much(memory))
    # The parent has no other way to see where it was raised.
    error.add_note(traceback.format_exc())
    return error

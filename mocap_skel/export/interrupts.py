"""Ctrl-C, SIGTERM and SIGHUP wait while something is half done."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

# Windows has no terminal that hangs up.
SIGNS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
"""What ends a call."""


@contextmanager
def interrupts_held() -> Iterator[None]:
    """What ends a call waits for the end, here and in a process that starts meanwhile: it would die of it, and say so.

    >>> before = signal.signal(signal.SIGTERM, lambda *_: print("end"))
    >>> with interrupts_held():
    ...     signal.raise_signal(signal.SIGTERM)
    ...     print("whole")
    whole
    end
    >>> _ = signal.signal(signal.SIGTERM, before)
    """
    came: list[int] = []
    handlers = {}
    if threading.current_thread() is threading.main_thread():
        # The system may give a signal to a thread of a library, whatever the mask of this one says.
        handlers = {sign: signal.getsignal(sign) for sign in SIGNS}
        for sign in [sign for sign, handler in handlers.items() if callable(handler)]:
            signal.signal(sign, lambda number, _: came.append(number))
    before = _mask()
    try:
        yield
    finally:
        _unmask(before)
        for sign, handler in handlers.items():
            if callable(handler):
                signal.signal(sign, handler)
        for sign in came[:1]:
            signal.raise_signal(sign)


def _mask() -> set[int]:
    """Keep the signals from this thread and from processes that it starts; what it kept before."""
    if sys.platform == "win32":
        return set()
    return {*signal.pthread_sigmask(signal.SIG_BLOCK, SIGNS)}


def _unmask(before: set[int]) -> None:
    if sys.platform != "win32":
        signal.pthread_sigmask(signal.SIG_SETMASK, before)

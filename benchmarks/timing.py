"""Timing side by side: tasks take turns in one run, so that the machine's load hits all alike."""

from __future__ import annotations

import time
from collections.abc import Callable


def alternate(*tasks: Callable[[], object], rounds: int = 9) -> list[float]:
    """Best time of each task in seconds."""
    times: list[list[float]] = [[] for _ in tasks]
    for _ in range(rounds):
        for task, record in zip(tasks, times, strict=True):
            start = time.perf_counter()
            task()
            record.append(time.perf_counter() - start)
    return [min(record) for record in times]


def aimed(value: float, *, most: float | None = None, least: float | None = None) -> str:
    """A number, and behind it what it should be.

    >>> aimed(2.5, most=1.5), aimed(2.0, least=1.8)
    ('   2.50  (aim: at most 1.5, missed)', '   2.00  (aim: at least 1.8)')
    """
    reached = value <= most if most is not None else least is None or value >= least
    aim = f"at most {most:g}" if most is not None else f"at least {least:g}"
    return f"{value:7.2f}  (aim: {aim}{'' if reached else ', missed'})"

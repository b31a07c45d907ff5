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

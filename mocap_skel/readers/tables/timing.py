"""Which frames the rows of a table are, and how many there are in a second."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mocap_skel.errors import ClipError
from mocap_skel.readers.tables.rows import MOST_CELLS, Rows
from mocap_skel.text import counted

Array = NDArray[np.float64]

# Frame numbers beyond it are none.
_LAST = 1e9
# So many frames for each row may be without one; more are no gap, but a number that is wrong.
_SPARSE = 100
# Of a step, by which times may be off the grid of a camera; and by which two rates differ that are not one.
_OFF_GRID, _DIFFERENT = 0.3, 0.01
# Of a frame, by which the time 0 may be off it and be taken for it; a rate in a header has as few digits as that.
_ON_GRID = 0.02
# Seconds of a take: later times are those of a clock, such as seconds since 1970.
_LONGEST = 86_400.0
# Times have at most so many decimals.
_DECIMALS = 9


@dataclass(frozen=True)
class Timing:
    """The frames of rows.

    Attributes:
        places: (rows,) the place of each among the clip's frames, from 0, rising.
        first: the number of the first frame.
        zero: the number that a frame at time 0 has, by the times; None without them.
        rate: frames a second, 0 where nothing says it.
        notes: what was decided about them.
    """

    places: NDArray[np.int64]
    first: int
    zero: float | None
    rate: float
    notes: tuple[str, ...]


def timing(rows: Rows, said: float, seconds: float = 1.0) -> Timing:
    """Find the frames of a table's rows by their numbers, or by their times.

    Args:
        rows: the table's.
        said: the header's frames a second, 0 where it does not say.
        seconds: in a unit of its times.

    Raises:
        ClipError: frame numbers so far apart that they cannot be.
    """
    notes: list[str] = []
    count = len(rows.lines)
    if not count:
        return Timing(np.arange(0), 1, None, said, ())
    times = None if rows.times is None else rows.times * seconds
    if times is not None and not (np.isfinite(times).all() and (np.diff(times) > 0).all()):
        if not said:
            notes.append("its times do not rise from row to row, or are no numbers: not used")
        times = None
    places, first, step = np.arange(count), 1, 1
    numbered = _by_numbers(rows, notes)
    if numbered is not None:
        places, first, step = numbered
    elif times is not None:
        places = _by_times(times, notes)
    if len(places) and (places[-1] + 1) * rows.points.shape[1] * 3 > MOST_CELLS:
        raise ClipError(f"{places[-1] + 1} frames by its frame numbers: too many")
    if (lost := int(places[-1]) + 1 - count) > 0:
        at = int(np.flatnonzero(np.diff(places) > 1)[0])
        notes.append(
            f"{counted(lost, 'frame')} without a row, the first of them {places[at] + 1 + first}: "
            "every marker counts as missing there"
        )
    rate = _rate(said, times, places, step, notes)
    zero = None if times is None or not rate > 0 else _zero(times, places + first, rate, notes)
    return Timing(places, first, zero, rate, tuple(notes))


def _by_numbers(rows: Rows, notes: list[str]) -> tuple[NDArray[np.int64], int, int] | None:
    """Places, first number and step by the frame numbers; None where they do not tell."""
    numbers = rows.frames
    if numbers is None:
        return None
    if not np.isfinite(numbers).all() or (abs(numbers) > _LAST).any():
        line = rows.lines[~(np.isfinite(numbers) & (abs(numbers) <= _LAST))][0]
        notes.append(f"line {line} has no frame number: frames are counted from 1")
        return None
    whole = np.round(numbers).astype(np.int64)
    steps = np.diff(whole)
    if (whole != numbers).any() or (steps <= 0).any():
        wrong = whole != numbers
        wrong[1:] |= steps <= 0
        line = rows.lines[wrong][0]
        notes.append(f"frame numbers do not rise by whole steps, line {line}: counted from 1")
        return None
    first = int(whole[0])
    if len(steps) > 1 and steps[0] > 1 and (steps == steps[0]).all():
        step = int(steps[0])
        notes.append(f"frame numbers rise by {step}: frames are counted on from {first} by ones")
        return np.arange(len(whole)), first, step
    places = whole - whole[0]
    if places[-1] > _SPARSE * len(whole):
        at = int(steps.argmax())
        raise ClipError(
            f"line {rows.lines[at + 1]}: frame {whole[at + 1]} follows frame {whole[at]}"
        )
    return places, first, 1


def _by_times(times: Array, notes: list[str]) -> NDArray[np.int64]:
    """Places by times that rise: every row one on, but where rows are left out."""
    if len(times) < 3:
        return np.arange(len(times))
    steps = np.diff(times)
    usual = float(np.sort(steps)[len(steps) // 2])
    on = steps / usual
    near = np.maximum(np.round(on), 1)
    if (abs(on - near) > _OFF_GRID).any():
        notes.append(
            f"its times are not even, steps of {steps.min():.4g} to {steps.max():.4g} s: "
            "every row is one frame on"
        )
        return np.arange(len(times))
    places = np.concatenate([[0], np.cumsum(near)])
    if places[-1] > _SPARSE * len(times):
        return np.arange(len(times))
    return places.astype(np.int64)


def _zero(times: Array, numbers: NDArray[np.int64], rate: float, notes: list[str]) -> float | None:
    """The number of a frame at time 0; a whole one where the times, as they are rounded, allow it."""
    if abs(times[0]) > _LONGEST:
        notes.append("its times are those of a clock: they are counted from the first frame")
        return float(numbers[0])
    # A rate that differs a little from the times must not move the first frame.
    zero = float(numbers[0] - times[0] * rate)
    near = max(_ON_GRID, _unit_of(times) * rate)
    return float(round(zero)) if abs(zero - round(zero)) <= near else zero


def _rate(
    said: float, times: Array | None, places: NDArray[np.int64], step: int, notes: list[str]
) -> float:
    """The header's rate, otherwise that of the times; a note where they differ."""
    timed = 0.0 if times is None or len(times) < 2 else _rate_of(times, places)
    if not said > 0 or not timed:
        return said if said > 0 else timed
    if abs(timed / said - 1) < _DIFFERENT:
        return said
    taken, why = said, "the header's is taken"
    if step > 1 and abs(timed * step / said - 1) < _DIFFERENT:
        taken, why = timed, "that of the times is taken, since only some of the frames are there"
    notes.append(f"{said:g} Hz by the header, {timed:.5g} Hz by its times: {why}")
    return taken


def _rate_of(times: Array, places: NDArray[np.int64]) -> float:
    """Frames a second by times; a whole number if the times, as they are rounded, allow it."""
    slope = float((places[-1] - places[0]) / (times[-1] - times[0]))
    whole = round(slope)
    if whole:
        off = times - times[0] - (places - places[0]) / whole
        if abs(off).max() <= 1.01 * _unit_of(times):
            return float(whole)
    return slope


def _unit_of(times: Array) -> float:
    """To what the times are rounded, seconds."""
    digits = range(_DECIMALS + 1)
    decimals = next((d for d in digits if abs(np.round(times, d) - times).max() < 1e-12), None)
    return float(10.0 ** -(_DECIMALS if decimals is None else decimals))

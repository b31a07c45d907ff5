"""Gait cycles: joint angles from one foot strike to the next of the same foot, over 0 to 100 % of the cycle."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mocap_skel.angles.joint_angles import Angles, JointAngles
from mocap_skel.events import OFF, STRIKE, Event
from mocap_skel.gait.contacts import LONGEST, SHORTEST
from mocap_skel.segments.pose import Array
from mocap_skel.text import listed

PERCENT = np.arange(101.0)
"""(101,): where in a cycle its values are."""
SIDES = ("left", "right")


@dataclass(frozen=True, eq=False)
class Stride:
    """From a foot strike to the next one of the same foot.

    Attributes:
        side: whose strikes they are.
        start, stop: both strikes.
        off: at which percent the foot leaves the ground; NaN where no event tells.
    """

    side: str
    start: Event
    stop: Event
    off: float

    @property
    def seconds(self) -> float:
        """How long it takes."""
        return self.stop.time - self.start.time


@dataclass(frozen=True, eq=False)
class Cycle:
    """The angles of a joint in one stride.

    Attributes:
        clip, subject: of whom.
        joint: as the table of angles calls it.
        parts: the names of its three angles.
        stride: when.
        degrees: (101, 3), NaN = not known.
    """

    clip: str
    subject: str
    joint: str
    parts: tuple[str, str, str]
    stride: Stride
    degrees: Array


@dataclass(frozen=True, eq=False)
class MeanCycle:
    """The cycles of a joint by the strikes of one side.

    Attributes:
        joint, parts, side: as the cycles have them.
        count: (101, 3), how many cycles are known there.
        mean, sd: (101, 3) degrees; standard deviation over cycles, NaN with less than two.
        off: mean percent at which the foot leaves the ground; NaN where no event tells.
        cycles: what they are of.
    """

    joint: str
    parts: tuple[str, str, str]
    side: str
    count: Array
    mean: Array
    sd: Array
    off: float
    cycles: tuple[Cycle, ...]


def strides(events: Iterable[Event], notes: list[str]) -> list[Stride]:
    """The strides between the foot strikes of each side; a note names those that are too short or too long.

    Args:
        events: of one subject, in their order in time.
        notes: what is left out is added to them.

    >>> said = []
    >>> strikes = [Event(t, round(100 * t) + 1, "Foot Strike", "Left") for t in (1.0, 2.1, 9.0)]
    >>> [round(stride.seconds, 2) for stride in strides(strikes, said)], said
    ([1.1], ['no stride is as long as from left strike 211 to 901: 6.9 s'])
    """
    events = list(events)
    found = []
    for side in SIDES:
        own = [event for event in events if event.side == side]
        strikes = [event for event in own if event.foot == STRIKE]
        for start, stop in pairwise(strikes):
            seconds = stop.time - start.time
            if not SHORTEST <= seconds <= LONGEST:
                word = "long" if seconds > LONGEST else "short"
                notes.append(
                    f"no stride is as {word} as from {side} strike {start.frame} to {stop.frame}: {seconds:.3g} s"
                )
                continue
            offs = [e.time for e in own if e.foot == OFF and start.time < e.time < stop.time]
            off = 100 * (offs[0] - start.time) / seconds if offs else np.nan
            found.append(Stride(side, start, stop, off))
    return found


def cycles_of(
    angles: Angles, found: Sequence[Stride], joints: Iterable[str], clip: str, subject: str = ""
) -> Iterator[Cycle]:
    """The cycles of some joints: of a joint with a side by the strikes of that side, of the others by both.

    Args:
        angles: of one fit.
        found: its strides.
        joints: names as the table of angles has them; those that the fit does not have give none.
        clip, subject: for the cycles.
    """
    known = {joint.rule.name: joint for joint in angles.joints}
    for name in joints:
        own = next((side for side in SIDES if side in name.lower()), "")
        for stride in found:
            if name not in known or own not in ("", stride.side):
                continue
            joint = known[name]
            degrees = _normalised(joint, angles.time, stride)
            if np.isfinite(degrees).any():
                yield Cycle(clip, subject, name, joint.rule.parts, stride, degrees)


def _normalised(joint: JointAngles, time: Array, stride: Stride) -> Array:
    """(101, 3): the angles at each percent, on straight lines between frames; NaN beside what is missing."""
    at = stride.start.time + PERCENT / 100 * stride.seconds
    place = (at - time[0]) / (time[1] - time[0])
    # A time that is a frame's, but for rounding, needs that frame only.
    near = np.round(place)
    place = np.where(np.abs(place - near) < 1e-6, near, place)
    inside = (place >= 0) & (place <= len(time) - 1)
    before = np.clip(np.floor(place), 0, len(time) - 1).astype(int)
    after = np.clip(np.ceil(place), 0, len(time) - 1).astype(int)
    share = (place - before)[:, None]
    values = joint.degrees
    found = np.where(
        share > 0, (1 - share) * values[before] + share * values[after], values[before]
    )
    found[~inside] = np.nan
    return np.asarray(found)


def mean_cycles(cycles: Iterable[Cycle]) -> list[MeanCycle]:
    """The mean and the standard deviation of the cycles of each joint, by the strikes of each side.

    Angles that go on past 180 degrees (the heading of the pelvis) are brought to the turn of the first cycle.
    """
    groups: dict[tuple[str, str], list[Cycle]] = {}
    for cycle in cycles:
        groups.setdefault((cycle.joint, cycle.stride.side), []).append(cycle)
    return [_mean(joint, side, own) for (joint, side), own in groups.items()]


def _mean(joint: str, side: str, own: Sequence[Cycle]) -> MeanCycle:
    middles = np.array([_middle(cycle.degrees) for cycle in own])
    first = np.array([next((m for m in column if np.isfinite(m)), 0.0) for column in middles.T])
    turns = np.round((middles - first) / 360.0)
    values = np.stack([cycle.degrees for cycle in own]) - 360.0 * np.nan_to_num(turns)[:, None]
    seen = np.isfinite(values)
    count = seen.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(seen, values, 0.0).sum(axis=0) / count
        away = np.where(seen, values - mean, 0.0)
        sd = np.sqrt((away**2).sum(axis=0) / (count - 1))
    mean[count == 0] = np.nan
    sd[count < 2] = np.nan
    offs = [cycle.stride.off for cycle in own if np.isfinite(cycle.stride.off)]
    off = float(np.mean(offs)) if offs else np.nan
    return MeanCycle(joint, own[0].parts, side, count, mean, sd, off, tuple(own))


def _middle(degrees: Array) -> Array:
    columns = [column[np.isfinite(column)] for column in degrees.T]
    return np.array([column.mean() if len(column) else np.nan for column in columns])


def mean_rows(means: Iterable[MeanCycle]) -> list[dict[str, object]]:
    """One row for each angle and percent: joint, angle, side, percent, mean, sd, cycles; degrees."""
    return [
        {
            "joint": one.joint, "angle": part, "side": one.side, "percent": int(percent),
            "mean": round(float(one.mean[i, k]), 4), "sd": round(float(one.sd[i, k]), 4), "cycles": int(one.count[i, k]),
        }
        for one in means
        for k, part in enumerate(one.parts)
        if one.count[:, k].any()
        for i, percent in enumerate(PERCENT)
    ]  # fmt: skip


def cycle_rows(cycles: Iterable[Cycle]) -> list[dict[str, object]]:
    """One row for each cycle, angle and percent, with clip, subject and both strikes (the file's frame numbers)."""
    return [
        {
            "clip": one.clip, "subject": one.subject, "joint": one.joint, "angle": part,
            "side": one.stride.side, "start": one.stride.start.frame, "stop": one.stride.stop.frame,
            "events": one.stride.start.source, "percent": int(percent), "degrees": round(float(one.degrees[i, k]), 4),
        }
        for one in cycles
        for k, part in enumerate(one.parts)
        if np.isfinite(one.degrees[:, k]).any()
        for i, percent in enumerate(PERCENT)
    ]  # fmt: skip


def stride_rows(means: Iterable[MeanCycle]) -> list[dict[str, object]]:
    """One row for each joint and side: how many cycles of how many clips, how long, when the foot leaves."""
    rows: list[dict[str, object]] = []
    for one in means:
        seconds = [cycle.stride.seconds for cycle in one.cycles]
        sources = dict.fromkeys(cycle.stride.start.source for cycle in one.cycles)
        rows.append(
            {
                "joint": one.joint,
                "side": one.side,
                "cycles": len(one.cycles),
                "clips": len({cycle.clip for cycle in one.cycles}),
                "events": listed(sources),
                "stride_s": float(np.mean(seconds)),
                "off_percent": one.off,
            }
        )
    return rows

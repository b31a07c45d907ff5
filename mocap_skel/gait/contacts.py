"""Foot contacts of gait, found in a fit: when a foot strikes the ground and when it leaves it.

A foot that swings turns round at the foremost and the hindmost place that it reaches, seen from the pelvis (Zeni
2008). That is so on the floor and on a treadmill, where nothing else stands still. The heel's foremost place comes
some hundredths of a second before it bears on the ground, so a strike is the first moment from which the foot moves
with the ground, where a heel marker tells that.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mocap_skel.angles.joint_angles import anatomical_frames
from mocap_skel.clip import vertical
from mocap_skel.events import OFF, STRIKE, Event
from mocap_skel.rig.bridging import runs
from mocap_skel.rig.feet import LOW, LOWEST, SLOW, steady
from mocap_skel.segments.pose import Array
from mocap_skel.skeleton_fit import SkeletonFit

Flags = NDArray[np.bool_]

TURNS, STANDS = "Zeni 2008", "standing foot"
"""Methods: where the foot turns round, seen from the pelvis; from when on it moves with the ground."""
LABELS = {STRIKE: "Foot Strike", OFF: "Foot Off"}
"""What a found event is called: as Vicon calls it."""

# The numbers below are chosen by eye where no source is named. benchmarks/gait.py makes each of them smaller (x 0.7) and
# larger (x 1.4) alone, on 14 walks with 232 contacts and 14 clips in which nobody walks; what it prints stands behind each.
# Those of feet that stand (SLOW, LOW, LOWEST of rig/feet.py) matter most: 3 to 6 contacts lost, 2 new, one moved by 0.12 s.

# Metres: a foot that swings by less, seen from the pelvis, makes no step: old people's slow steps are 0.3 m long, and
# who stands sways by some centimetres (no contact changes). At an end of the clip, where the swing is cut, so much is
# enough (1 lost).
LEAST_STEP, LEAST_TURN = 0.15, 0.02
# Seconds: strides of people are between them, a runner's and a slow patient's (no change; a shorter LONGEST loses the
# 27 contacts of the walk with strides of 2.2 s, a longer one finds 6 where nobody walks).
SHORTEST, LONGEST = 0.4, 3.0
# Of a stride: where in it the other foot strikes, also of a person who limps; one who jumps lands on both (narrower: no
# change; wider: 24 where nobody walks).
OTHER = 0.25, 0.75
# Seconds over which the direction of the pelvis is averaged: about a stride, in which it turns to and fro (contacts move
# by 0.02 at most).
AVERAGED = 1.0
# Seconds: tracks are averaged over that, so that noise makes no turning points (1 lost, others move by 0.02 at most); a
# longer gap hides a contact (no change: these clips have few such gaps).
SMOOTH, GAP = 0.08, 0.1
# Seconds round the turning point in which the foot comes to stand (no change).
BEFORE, AFTER = 0.1, 0.2
# Seconds: a part of a stance that the clip shows only the begin or the end of; a walking person's takes 0.62 of a stride of
# 1.08 s (Winter 2009) (no change).
SHOWN = 0.4
# Of a stance: the part in which the foot lies flat (1 lost, 1 new, moves of 0.01), and how much of the stance it has to be
# low (smaller: 2 new; the whole of it: 31 lost).
MIDDLE, MOSTLY = (0.3, 0.6), 0.75


@dataclass(frozen=True, eq=False)
class Contacts:
    """The contacts of one fit.

    Attributes:
        events: in their order in time.
        ground: metres a second of the ground along the walking direction: about 0 on the floor, below 0 on a treadmill.
        why_none: why there are no events, in a few words; "" where there are some.
    """

    events: tuple[Event, ...] = ()
    ground: float = 0.0
    why_none: str = ""


@dataclass(frozen=True, eq=False)
class _Foot:
    """The hindmost and the foremost point of a foot in every frame.

    Attributes:
        side: "left" or "right".
        ahead: heel, toe → (frames,) metres in front of the pelvis.
        height: likewise, metres along the vertical.
        velocity: likewise, (frames, 3) metres a second along the walking direction, beside it, and up, in the lab.
        heel: whether the heel is a marker behind the ankle.
    """

    side: str
    ahead: Mapping[str, Array]
    height: Mapping[str, Array]
    velocity: Mapping[str, Array]
    heel: bool


@dataclass(frozen=True)
class _Stance:
    """A foot on the ground, by indices of frames; None where the clip does not show its begin or end."""

    foot: int
    strike: int | None
    off: int | None
    method: str = TURNS


def find_contacts(fit: SkeletonFit) -> Contacts:
    """The foot contacts of a walking person.

    A step counts if its foot stays low and moves with the ground while it stands, and if it is part of a stride in
    which the other foot, where it is seen, strikes once.

    Args:
        fit: of one subject.

    Source: Zeni, Richards & Higginson 2008, Gait Posture 27, 710.
    """
    # A step takes longer, and two frames have no speed.
    feet = _feet(fit) if len(fit.time) > SHORTEST * fit.rate else []
    if not feet:
        return Contacts(why_none="it takes a pelvis with a front, a foot, and the time of a stride")
    stances = [stance for i, foot in enumerate(feet) for stance in _stances(i, foot, fit.rate)]
    stances = [stance for stance in stances if _low(feet[stance.foot], stance, fit.rate)]
    if not stances:
        return Contacts(why_none="no foot swings and stands by turns")
    speeds = np.array([_middle_speed(feet[s.foot], s, fit.rate) for s in stances])
    seen = speeds[np.isfinite(speeds)]
    ground = float(np.median(seen)) if len(seen) else np.nan
    # The floor stands still; what is measured there is how feet roll.
    ground = 0.0 if abs(ground) < SLOW else ground
    stances = [s for s, v in zip(stances, speeds, strict=True) if abs(v - ground) < SLOW]
    stances = _in_strides(
        [_landed(feet[s.foot], s, ground, fit.rate) for s in stances], feet, fit.rate
    )
    if not stances:
        return Contacts(why_none="no foot strikes the ground twice in a walking rhythm")
    events = [event for stance in stances for event in _events(stance, feet[stance.foot].side, fit)]
    return Contacts(tuple(sorted(events, key=lambda e: (e.time, e.side))), ground)


def _feet(fit: SkeletonFit) -> list[_Foot]:
    """The feet of a fit, seen from its pelvis; none where it has none or does not tell where its front is."""
    root = fit.skeleton.root.name
    up = vertical(fit.up)
    front = _front(fit, root, up)
    if front is None:
        return []
    pose = fit.segments[root].pose
    front = _level(_averaged(front, AVERAGED * fit.rate), up)
    beside = np.cross(up, front)
    found = []
    for segment in fit.skeleton.segments:
        side = next((word for word in ("left", "right") if word in segment.name.lower()), "")
        own = fit.segments.get(segment.name)
        if not segment.sole or not side or own is None or own.joint is None:
            continue
        places = [own.template[m] for m in segment.sole if m in own.template]
        places = [own.joint, *(places or own.template.values())]
        tracks = [_bridged(own.pose.to_lab(place), GAP * fit.rate) for place in places]
        ahead = [_along(track - pose.origin, front) for track in tracks]
        seen = [float(np.nanmean(one)) if np.isfinite(one).any() else np.nan for one in ahead]
        if not np.isfinite(seen).all():
            continue
        ends = {"heel": int(np.argmin(seen)), "toe": int(np.argmax(seen))}
        smooth = {name: _averaged(tracks[i], SMOOTH * fit.rate) for name, i in ends.items()}
        # The average would begin a stand before it begins.
        steps = {name: fit.rate * np.gradient(tracks[i], axis=0) for name, i in ends.items()}
        found.append(
            _Foot(
                side,
                {name: _along(track - pose.origin, front) for name, track in smooth.items()},
                {name: track @ up for name, track in smooth.items()},
                {
                    n: np.stack([_along(v, front), _along(v, beside), v @ up], 1)
                    for n, v in steps.items()
                },
                ends["heel"] != 0,
            )
        )
    return found


def _front(fit: SkeletonFit, root: str, up: Array) -> Array | None:
    """(frames, 3): where the pelvis faces, on the level: by its markers, otherwise square to the line of the hips."""
    axes = anatomical_frames(fit).get(root)
    if axes is not None:
        return _level(fit.segments[root].pose.rotation @ axes.axes[:, 0], up)
    parents = {segment.name: segment.parent for segment in fit.skeleton.segments}
    hips = {}
    for segment in fit.skeleton.segments:
        name: str | None = segment.name if segment.sole else None
        while name is not None and parents[name] != root:
            name = parents[name]
        joints = [j.track for j in fit.joints if name is not None and j.child == name]
        if joints and np.isfinite(joints[0]).any():
            hips["left" if "left" in segment.name.lower() else "right"] = joints[0]
    if root not in fit.segments or len(hips) < 2:
        return None
    return _level(np.cross(up, hips["right"] - hips["left"]), up)


def _stances(index: int, foot: _Foot, rate: float) -> list[_Stance]:
    """Where the heel turns round in front and the toe behind it, by turns."""
    strikes = turning_points(foot.ahead["heel"], LEAST_STEP, LEAST_TURN)
    offs = turning_points(-foot.ahead["toe"], LEAST_STEP, LEAST_TURN)
    found = [_Stance(index, None, off) for off in offs if strikes and off < strikes[0]][-1:]
    for strike, following in zip(strikes, [*strikes[1:], len(foot.ahead["heel"])], strict=False):
        off = next((o for o in offs if strike < o < following), None)
        # Without an off between two strikes the toe was not seen, or did not swing.
        if off is not None or following - strike < LONGEST * rate:
            found.append(_Stance(index, strike, off))
    return found


def turning_points(track: Array, least: float, at_ends: float) -> list[int]:
    """Frames in which a track turns from rising to falling, by at least so much on both sides.

    Args:
        track: (frames,), NaN = missing; a gap is an end.
        least: how far it rises before and falls after.
        at_ends: how far, on the side of an end of the track.

    >>> turning_points(np.array([0.0, 0.5, 1.0, 0.9, 0.95, 0.2, 0.0, 0.6, 0.5]), 0.3, 0.05)
    [2, 7]
    """
    found: list[int] = []
    for start, stop in runs(np.isfinite(track)):
        part = track[start:stop]
        if len(part) < 3:
            continue
        steps = np.sign(np.diff(part))
        inner = (
            np.flatnonzero(
                (steps[:-1] > 0) & (steps[1:] <= 0) | (steps[:-1] < 0) & (steps[1:] >= 0)
            )
            + 1
        )
        top, bottom, rising = 0, 0, True
        for i in [0, *inner.tolist(), len(part) - 1]:
            if part[i] > part[top]:
                top = i
            if part[i] < part[bottom]:
                bottom = i
            if rising and part[top] - part[i] >= least:
                if part[top] - part[: top + 1].min() >= at_ends:
                    found.append(start + top)
                bottom, rising = i, False
            elif not rising and part[i] - part[bottom] >= least:
                top, rising = i, True
        if (
            rising
            and 0 < top < len(part) - 1
            and part[top] - part[top:].min() >= at_ends
            and part[top] - part[:top].min() >= least
        ):
            found.append(start + top)
    return found


def _low(foot: _Foot, stance: _Stance, rate: float) -> bool:
    """Whether heel or toe is near the ground in most of a stance: near its lowest places in the clip."""
    here = _frames(foot, stance, rate)
    near = [height[here] < np.nanquantile(height, LOWEST) + LOW for height in foot.height.values()]
    return bool(np.logical_or(*near).mean() >= MOSTLY)


def _frames(foot: _Foot, stance: _Stance, rate: float) -> slice:
    """The frames of a stance; of a short one where its begin or end is not shown."""
    short, frames = round(SHOWN * rate), len(foot.ahead["heel"])
    if stance.strike is None:
        stop = stance.off or 1
        return slice(max(0, stop - short), stop)
    stop = stance.off or min(stance.strike + short, frames)
    return slice(stance.strike, max(stop, stance.strike + 1))


def _middle_speed(foot: _Foot, stance: _Stance, rate: float) -> float:
    """Metres a second along the walking direction of a foot that lies flat: of the ground that it stands on."""
    here = _frames(foot, stance, rate)
    count = here.stop - here.start
    low, high = (here.start + round(part * count) for part in MIDDLE)
    ways = [v[low : max(high, low + 1), 0] for v in foot.velocity.values()]
    speeds = [float(np.median(way)) for way in ways]
    # Of heel and toe the one that stands: it is the slower one, on the floor and on a belt against the swing.
    return min(speeds)


def _landed(foot: _Foot, stance: _Stance, ground: float, rate: float) -> _Stance:
    """The stance from the moment on from which heel or toe moves with the ground, where a heel marker tells that."""
    if not foot.heel or stance.strike is None:
        return stance
    stands = np.zeros(len(foot.ahead["heel"]), dtype=bool)
    for name, velocity in foot.velocity.items():
        low = foot.height[name] < np.nanquantile(foot.height[name], LOWEST) + LOW
        stands |= low & (np.linalg.norm(velocity - [ground, 0.0, 0.0], axis=1) < SLOW)
    for start, _ in runs(steady(stands, rate)):
        if stance.strike - BEFORE * rate <= start <= stance.strike + AFTER * rate and start > 0:
            return replace(stance, strike=start, method=STANDS)
    return stance


def _in_strides(stances: list[_Stance], feet: Sequence[_Foot], rate: float) -> list[_Stance]:
    """The stances that begin, end or lie within a stride of one foot."""
    kept: dict[int, _Stance] = {}
    struck = [(s.strike, s) for s in stances if s.strike is not None]
    for foot in range(len(feet)):
        own = [(at, s) for at, s in struck if s.foot == foot]
        for (start, before), (stop, after) in pairwise(own):
            other = [(at, s) for at, s in struck if s.foot != foot and start < at < stop]
            between = [
                s for at, s in other if OTHER[0] <= (at - start) / (stop - start) <= OTHER[1]
            ]
            if not SHORTEST * rate <= stop - start <= LONGEST * rate:
                continue
            if len(feet) == 1 or len(between) == len(other) == 1:
                kept |= {id(s): s for s in (before, after, *between)}
    for stance in stances:
        if stance.strike is None and stance.off is not None:
            later = [at for at, s in struck if s.foot == stance.foot and id(s) in kept]
            # A swing takes less than half of a stride.
            if later and min(later) - stance.off < 0.5 * LONGEST * rate:
                kept[id(stance)] = stance
    return list(kept.values())


def _events(stance: _Stance, side: str, fit: SkeletonFit) -> list[Event]:
    frames = {STRIKE: (stance.strike, stance.method), OFF: (stance.off, TURNS)}
    return [
        Event(
            float(fit.time[at]), int(fit.frame_numbers[at]), LABELS[what], side.capitalize(),
            fit.subject, "found", method,
        )
        for what, (at, method) in frames.items()
        if at is not None
    ]  # fmt: skip


def _along(vectors: Array, way: Array) -> Array:
    return np.asarray(np.einsum("fi,fi->f", vectors, way))


def _level(vectors: Array, up: Array) -> Array:
    """Vectors (frames, 3) laid on the level, of length one."""
    flat = vectors - (vectors @ up)[:, None] * up
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(flat / np.linalg.norm(flat, axis=1, keepdims=True))


def _averaged(tracks: Array, frames: float) -> Array:
    """Tracks (frames, n) averaged over a window without weight for what is missing; NaN stays where that is."""
    half = max(1, round(frames / 2))
    window = np.hanning(2 * half + 3)[1:-1]
    seen = np.isfinite(tracks)
    out = np.full_like(tracks, np.nan)
    for i in range(tracks.shape[1]):
        weight = np.convolve(seen[:, i].astype(float), window)[half:-half]
        total = np.convolve(np.where(seen[:, i], tracks[:, i], 0.0), window)[half:-half]
        out[seen[:, i], i] = total[seen[:, i]] / weight[seen[:, i]]
    return out


def _bridged(track: Array, longest: float) -> Array:
    """A track (frames, 3) with straight lines over short gaps."""
    seen = np.isfinite(track).all(axis=1)
    out, at = track.copy(), np.flatnonzero(seen)
    for start, stop in runs(np.asarray(~seen)):
        if stop - start <= longest and start > 0 and stop < len(track):
            for i in range(3):
                out[start:stop, i] = np.interp(np.arange(start, stop), at, track[at, i])
    return out

"""Feet on the floor: where the floor is, when a sole stands on it, and the figure held there."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from mocap_skel.rig.blocks import apply, multiply, rotation, transposed
from mocap_skel.rig.bridging import eased, runs
from mocap_skel.rig.model import Model
from mocap_skel.rig.motion import CALM_ANGLE
from mocap_skel.rig.solver import Bones, Poses, Problem, Pull, Sums, marker_sums, solve
from mocap_skel.segments.pose import Array

# Metres a second and metres: a marker of the sole stands if it is slower, and no higher above its lowest places.
# A walking foot swings at 3 to 5 m/s; skin and the rolling of a standing foot reach some 0.2.
SLOW, LOW = 0.3, 0.04
# Seconds: a shorter stand is a turning point of the swing, a shorter break is noise.
STAND, BREAK = 0.1, 0.05
# Seconds, and share of a clip: a foot that stands less than the smaller of both in all does not stand at all, but
# turns in the air, as those of a person who is filmed sitting or hanging.
STANDS, STANDING = 0.5, 0.05
# The share of slow places below which a marker is taken to stand.
LOWEST = 0.1
# Metres: markers of a sole are no higher than that over the floor, else the floor is not at zero. Where it is not,
# it is taken to be so far below the lowest marker: a marker's radius, the sole's skin and a shoe.
HIGHEST_MARKER, UNDER_MARKER = 0.15, 0.03
# Cosine of the angle between the stands' vertical and that of the rest pose beyond which the stands are none: a
# foot that hangs in the air is not flat.
FLAT = np.cos(np.radians(25.0))
# Seconds in which toes bend or straighten: at push-off a person's take about a tenth (Carson 2001, J. Biomech. 34, 1299).
BEND = 0.1
# As a share of their length, what toes that point straight down reach forward; less has no direction.
LEAST_LEVEL = 1e-6
# A held sole weighs as so many markers, and takes so long (seconds) to come from its free path and go back.
HOLD, EASE = 100.0, 0.15


@dataclass(frozen=True, eq=False)
class Sole:
    """A point of the sole, under a marker.

    Attributes:
        segment: its index in the model.
        marker: the marker above it.
        above: (3,) the marker in the segment's axes, from its joint.
        place: (3,) the point of the sole, likewise.
        stands: (start, stop) of frames in which it stands on the floor.
    """

    segment: int
    marker: str
    above: Array
    place: Array
    stands: tuple[tuple[int, int], ...]


@dataclass(frozen=True, eq=False)
class Feet:
    """The soles of a figure, and the floor that they stand on.

    Attributes:
        floor: metres along the vertical.
        soles: those that stand somewhere in the clip.
    """

    floor: float
    soles: tuple[Sole, ...]


def find_feet(model: Model, poses: Poses, up: Array, rate: float, rest: Sequence[Array]) -> Feet:
    """When the markers of the soles (`sole` of the skeleton file) stand, and the points of the sole under them.

    A point lies under its marker by the marker's height in the standing frames, along what the foot then has
    as vertical.

    Args:
        model: the figure.
        poses: its motion.
        up: (3,) the lab's vertical.
        rate: frames a second.
        rest: of each segment, from its axes to the character's in the rest pose, y up.
    """
    found: list[tuple[int, str, Array, NDArray[np.bool_], float]] = []
    for s, segment in enumerate(model.segments):
        for marker in segment.sole:
            place = model.place(s, marker)
            if place is None:
                continue
            track = point_track(model.bones, poses, s, place)
            height = up @ track
            slow = speed(track, rate) < SLOW
            if slow.sum() < STAND * rate:
                continue
            low = float(np.quantile(height[slow], LOWEST))
            stands = steady(slow & (height < low + LOW), rate)
            if stands.sum() > min(STANDS * rate, STANDING * len(stands)):
                found.append((s, marker, place, stands, float(np.median(height[stands]))))
    heights = [above for *_, above in found]
    lowest = min(heights, default=0.0)
    # Laboratories put the floor at zero; a figure that never comes near stands on something else.
    at_zero = lowest >= 0.0 and max(heights, default=0.0) <= HIGHEST_MARKER
    floor = 0.0 if at_zero else lowest - UNDER_MARKER
    soles = []
    for s, marker, place, stands, above in found:
        down = apply(transposed(poses.turn[:, :, s][..., stands]), -up).mean(axis=1)
        flat = -rest[s][1]
        if down @ flat < FLAT * np.linalg.norm(down):
            down = flat
        under = place + (above - floor) * down / np.linalg.norm(down)
        soles.append(Sole(s, marker, place, under, tuple(runs(stands))))
    return Feet(floor, tuple(soles))


def point_track(bones: Bones, poses: Poses, segment: int, place: Array) -> Array:
    """(3, F): a point of a segment in the lab."""
    return np.asarray(poses.joints(bones)[:, segment] + apply(poses.turn[:, :, segment], place))


def speed(track: Array, rate: float) -> Array:
    """(F,) metres a second of a track (3, F), over two frames."""
    if track.shape[1] < 2:
        return np.zeros(track.shape[1])
    return np.asarray(rate * np.linalg.norm(np.gradient(track, axis=1), axis=0))


def steady(flags: NDArray[np.bool_], rate: float) -> NDArray[np.bool_]:
    """Flags (frames,) of a foot that stands, without short breaks and without short stands."""
    out = flags.copy()
    for start, stop in runs(~out):
        if start > 0 and stop < len(out) and stop - start < BREAK * rate:
            out[start:stop] = True
    for start, stop in runs(out):
        if stop - start < STAND * rate:
            out[start:stop] = False
    return out


def held_feet(problem: Problem, poses: Poses, feet: Feet, up: Array, rate: float) -> Poses:
    """The motion with each sole held at one place of the floor while it stands.

    The whole leg gives way, and the rest of the figure stays as near as it can to where it was; before and after a
    stand the sole comes from and goes back to its free path over EASE seconds.
    """
    extra: Sums | None = None
    bones = problem.bones
    touched = np.zeros(poses.frames, dtype=bool)
    for sole in feet.soles:
        free = point_track(bones, poses, sole.segment, sole.place)
        goal = _goal(free, sole.stands, feet.floor, up, EASE * rate)
        touched |= np.isfinite(goal[0])
        more = _held_sums(bones, sole, goal, problem.sums.origin)
        extra = more if extra is None else extra.plus(more)
    if extra is None:
        return poses
    here = np.flatnonzero(touched)
    # The markers as the figure has them, not as they were seen: without the floor the figure would stay as it is, so that
    # nothing jumps where a stand begins or ends, and what was calmed or slowed is not undone.
    joints = poses.joints(bones)
    shown = [
        (apply(poses.turn[:, :, s, :, None], place.T[:, None]) + joints[:, s, :, None]).transpose(
            1, 2, 0
        )
        for s, place in enumerate(bones.places)
    ]
    own = marker_sums(bones, shown, problem.sums.origin.T)
    stiffness = np.full(poses.frames, 1.0 / CALM_ANGLE**2)
    calm = tuple(Pull(s, poses.local(bones, s), stiffness) for s in range(1, len(bones.parents)))
    found = solve(Problem(bones, own.plus(extra), (), calm).at(here), poses.at(here))
    turn, root = poses.turn.copy(), poses.root.copy()
    turn[..., here], root[:, here] = found.turn, found.root
    return Poses(turn, root)


def bent_toes(
    model: Model, poses: Poses, feet: Feet, up: Array, rate: float, limit: float
) -> tuple[Poses, NDArray[np.bool_]]:
    """The motion with toes that lie on the floor while their foot rolls over them, instead of going through it.

    Toes are what hangs from a foot with a sole (`Model.tips`). They begin to bend a little before the floor asks for
    it, and straighten over BEND seconds: never less than it asks for.

    Args:
        model: the figure.
        poses: its motion.
        feet: its soles and the floor.
        up: (3,) the lab's vertical.
        rate: frames a second.
        limit: degrees a second; no toes turn faster.

    Returns:
        The motion; (S, F) turns of toes that were faster than the limit, replaced.
    """
    changed = np.zeros(poses.turn.shape[2:], dtype=bool)
    soled = {sole.segment for sole in feet.soles}
    toes = [s for s in model.ends if model.bones.parents[s] in soled & set(model.tips)]
    if not toes:
        return poses, changed
    turn, joints = poses.turn.copy(), poses.joints(model.bones)
    for s in toes:
        foot, place = turn[:, :, model.bones.parents[s]], joints[:, s]
        above = feet.floor - up @ place
        bend = _bend(turn[:, :, s], model.ends[s], above, up)
        # In the foot, whose turn the bend goes with.
        eased_bend = _eased_bend(apply(transposed(foot), bend), BEND * rate)
        own = multiply(rotation(apply(foot, eased_bend)), turn[:, :, s])
        # What its axis was turned by, where the foot turns fast.
        own = multiply(rotation(_bend(own, model.ends[s], above, up)), own)
        local, changed[s] = eased(multiply(transposed(foot), own), np.radians(limit) / rate)
        turn[:, :, s] = multiply(foot, local)
    return Poses(turn, poses.root), changed


def _bend(turn: Array, end: Array, floor: Array, up: Array) -> Array:
    """(3, F): the turn about a level axis that brings the end of toes up to the floor; 0 where it is not under it.

    Args:
        turn: (3, 3, F) of the toes.
        end: (3,) from their joint, in their axes.
        floor: (F,) its height over the joint.
        up: (3,) the lab's vertical.
    """
    reach = apply(turn, end)
    length = float(np.linalg.norm(end))
    height, lowest = up @ reach, np.clip(floor, -length, 0.0)
    level = reach - up[:, None] * height
    level /= np.maximum(np.linalg.norm(level, axis=0), LEAST_LEVEL * length)
    # About the level axis that is square to the toes, from their slope to that of the floor under them.
    angle = np.arcsin(lowest / length) - np.arcsin(np.clip(height / length, -1.0, 1.0))
    return np.asarray(np.cross(level.T, up).T * np.maximum(angle, 0.0))


def _eased_bend(bend: Array, frames: float) -> Array:
    """Rotation vectors (3, F) that come and go over so many frames, and are nowhere smaller than they were.

    The mean, over a window, of the largest in a window of the same width.
    """
    half = int(0.5 * frames + 0.5)
    size = np.linalg.norm(bend, axis=0)
    if half < 1 or not size.any():
        return bend
    wide = np.pad(size, 2 * half, mode="edge")
    largest = sliding_window_view(wide, 2 * half + 1).max(axis=1)
    grown = sliding_window_view(largest, 2 * half + 1).mean(axis=1)
    # Its axis is the mean of those around it, as far as the window of a window goes.
    around = np.pad(bend, ((0, 0), (2 * half, 2 * half)), mode="edge")
    axis = sliding_window_view(around, 4 * half + 1, axis=1).mean(axis=2)
    length = np.linalg.norm(axis, axis=0)
    return np.asarray(
        axis * np.where(length > 0.0, grown / np.where(length > 0.0, length, 1.0), 0.0)
    )


def _goal(
    free: Array, stands: Iterable[tuple[int, int]], floor: float, up: Array, ease: float
) -> Array:
    """(3, F): where a sole shall be; NaN where it is free."""
    frames = free.shape[1]
    away, weight = np.zeros_like(free), np.zeros(frames)
    at = np.arange(frames)
    for start, stop in stands:
        middle = free[:, start:stop].mean(axis=1)
        middle += (floor - up @ middle) * up
        own = middle[:, None] - free
        # Outside the stand the correction of its edge fades.
        own[:, :start], own[:, stop:] = own[:, start, None], own[:, stop - 1, None]
        out = np.maximum(np.maximum(start - at, at - (stop - 1)), 0) / max(ease, 1.0)
        share = np.where(out < 1.0, 0.5 + 0.5 * np.cos(np.pi * np.minimum(out, 1.0)), 0.0)
        away += share * own
        weight += share
    # Two stands near each other share the frames between them.
    goal = free + away / np.maximum(weight, 1.0)
    return np.where(weight > 0, goal, np.nan)


def _held_sums(bones: Bones, sole: Sole, goal: Array, origin: Array) -> Sums:
    nothing = np.empty((0, 3)), np.empty(0), np.empty((goal.shape[1], 0, 3))
    places = [nothing[0]] * len(bones.parents)
    weights, points = [nothing[1]] * len(bones.parents), [nothing[2]] * len(bones.parents)
    usual = float(np.concatenate(bones.weights).mean())
    places[sole.segment], weights[sole.segment] = sole.place[None], np.array([HOLD * usual])
    points[sole.segment] = goal.T[:, None]
    only = Bones(bones.parents, bones.offsets, tuple(places), tuple(weights))
    return marker_sums(only, points, origin.T)

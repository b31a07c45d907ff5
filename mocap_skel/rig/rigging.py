"""A fit as a figure of bones without gaps, its rest pose a T-pose: what formats for animators hold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mocap_skel.clip import AXES
from mocap_skel.errors import ExportError
from mocap_skel.figure.skeleton import Segment
from mocap_skel.rig.gaps import fill_positions, fill_rotations, runs
from mocap_skel.rig.kinematics import Rig, follow, forward, rest_places, shortest_turn
from mocap_skel.rig.rest_pose import Bone, rest_pose
from mocap_skel.segments.pose import Array, Pose
from mocap_skel.skeleton_fit import SegmentFit, SkeletonFit
from mocap_skel.text import listed

# Seconds: over a longer gap an interpolated limb is an invention.
LONGEST_GAP = 0.5
# Metres: shorter End Sites make nodes without length in common readers.
SHORTEST_END = 1e-3
# Metres: a lowest point farther from zero than this is no floor, and worth a word.
FLOOR = 0.1
# Metres: joints so far from the fit are worth a note.
ASTRAY = 0.02


@dataclass(frozen=True, eq=False)
class _Found:
    """The fitted segments of a skeleton, parents first, with the parent's index of each."""

    segments: tuple[Segment, ...]
    fits: tuple[SegmentFit, ...]
    parents: tuple[int, ...]


def rig_of(
    fit: SkeletonFit, *, trim: bool = False, floor: bool = False
) -> tuple[Rig, tuple[Segment, ...], tuple[str, ...]]:
    """The fit as a rig, standing on the floor in its rest pose.

    Joints are named as in the skeleton file. The rest pose has the fit's own vertical as up.

    Args:
        fit: its vertical may be any axis.
        trim: leave out the frames at both ends that would need a pose beyond a segment's last one.
        floor: move the figure up or down so that its lowest point over the clip is at zero.

    Returns:
        The rig; the segment that each joint turns; and notes that list joints left out and frames that
        were filled.

    Raises:
        ExportError: a segment has no pose over too long a time.
    """
    found = _found(fit)
    fitted = {joint.joint for joint in fit.joints if joint.fitted}
    gone = [s.joint for s in fit.skeleton.segments if s.joint and s.name not in fit.segments]
    ends = [joint for joint in gone if joint in fitted]
    notes = [f"without {listed(gone)}"] if gone else []
    if ends:
        notes.append(f"fitted, but no segment turns about them: {listed(ends)}")
    window = _window(fit, found, trim, notes)
    centres = _centres(fit, found)
    up = np.eye(3)[AXES.index(fit.up)]
    bones = [
        Bone(s, parent, _joint(own), centre, _tip(own, fit), own.pose.rotation)
        for s, own, parent, centre in zip(
            found.segments, found.fits, found.parents, centres, strict=True
        )
    ]
    turns, average = rest_pose(bones, up)
    if average:
        notes.append(
            f"the rest pose of {listed(average)} is the clip's average, no T-pose: the skeleton file "
            "has no direction (rest) for it"
        )
    # From the character's axes, y up, to the fit's.
    upright = shortest_turn(np.array([0.0, 1.0, 0.0]), up)
    rig = _still(found, bones, [upright @ turn for turn in turns])
    lowest = _lowest(rest_places(rig), up)
    rig = replace(rig, offsets=rig.offsets - lowest * np.outer(_first(rig), up))
    rig = _moving(rig, found, bones, [upright @ turn for turn in turns], window)
    places = forward(rig)
    notes += _astray(fit, found, places[0], window)
    lowest = _lowest(places, up)
    if floor:
        rig = replace(rig, position=rig.position - lowest * up)
    elif abs(lowest) > FLOOR:
        where = "over" if lowest > 0 else "under"
        notes.append(
            f"the figure's lowest point is {abs(lowest):.2f} m {where} zero; --floor puts it there"
        )
    return rig, found.segments, tuple(notes)


def _found(fit: SkeletonFit) -> _Found:
    here = [s for s in fit.skeleton.segments if s.name in fit.segments]
    place = {s.name: i for i, s in enumerate(here)}
    parents = [-1 if s.parent is None else place[s.parent] for s in here]
    order = _branches(parents)
    new = {old: i for i, old in enumerate(order)}
    return _Found(
        tuple(here[i] for i in order),
        tuple(fit.segments[here[i].name] for i in order),
        tuple(new.get(parents[i], -1) for i in order),
    )


def _branches(parents: Sequence[int]) -> list[int]:
    """Indices so that each joint is followed by all that hangs from it."""
    order, waiting = [], [0]
    while waiting:
        at = waiting.pop()
        order.append(at)
        waiting += [i for i in reversed(range(len(parents))) if parents[i] == at]
    return order


def _centres(fit: SkeletonFit, found: _Found) -> list[Array]:
    joints = {joint.child: joint.centre for joint in fit.joints}
    return [joints.get(s.name, np.zeros(3)) for s in found.segments]


def _joint(own: SegmentFit) -> Array:
    return np.zeros(3) if own.joint is None else own.joint


def _astray(fit: SkeletonFit, found: _Found, places: Array, window: slice) -> list[str]:
    """A note on joints that bones of constant length put elsewhere than the fit does."""
    tracks = {joint.child: joint for joint in fit.joints}
    far = []
    for segment, place in zip(found.segments, places, strict=True):
        if segment.name in tracks:
            joint = tracks[segment.name]
            away = np.linalg.norm(place - joint.track[window], axis=1)
            most = float(np.nanmax(away, initial=0.0))
            if most > ASTRAY:
                far.append(f"{joint.joint} {100 * most:.1f} cm")
    if not far:
        return []
    return [
        f"bones of constant length put joints elsewhere than the fit, at most {listed(far, 14)}"
    ]


def _tip(own: SegmentFit, fit: SkeletonFit) -> Array:
    """A point beyond the joint for a segment that ends there: a joint without a child's pose, if it has one."""
    below = [j for j in fit.joints if j.parent == own.name and j.fitted]
    if len(below) == 1 and below[0].child not in fit.segments:
        return below[0].centre
    if own.end is not None:
        return own.end
    return np.asarray(np.mean(list(own.template.values()), axis=0))


def _window(fit: SkeletonFit, found: _Found, trim: bool, notes: list[str]) -> slice:
    """The frames that can be written: from the one in which the last segment shows up to the one in which the
    first is gone, whatever is missing lies between two known poses.
    """
    known = np.stack([own.pose.known for own in found.fits])
    frames = known.shape[1]
    first = int(known.argmax(axis=1).max())
    stop = frames - int(known[:, ::-1].argmax(axis=1).max())
    if stop - first < 2:
        worst = found.fits[int(known.sum(axis=1).argmin())].name
        raise ExportError(
            f"{fit.clip}: the segments are not seen at the same time ({worst} has the fewest frames)"
        )
    if not trim and stop - first < frames:
        ends = [(0, first), (stop, frames)]
        raise ExportError(
            f"{fit.clip}: not every segment has a pose in frames {_spans(fit, ends)}",
            "use --trim to leave them out",
        )
    if stop - first < frames:
        notes.append(f"{frames - (stop - first)} incomplete frames at the ends left out")
    for own, row in zip(found.fits, known[:, first:stop], strict=True):
        gaps = [(start + first, end + first) for start, end in runs(~row)]
        longest = max((end - start for start, end in gaps), default=0)
        if longest > LONGEST_GAP * fit.rate:
            raise ExportError(
                f"{fit.clip}: {own.name} has no pose for {longest / fit.rate:.1f} s; gaps "
                f"over {LONGEST_GAP} s are not filled"
            )
        if gaps:
            notes.append(f"{own.name} filled in frames {_spans(fit, gaps)}")
    return slice(first, stop)


def _still(found: _Found, bones: Sequence[Bone], turns: Sequence[Array]) -> Rig:
    """The rig in its rest pose, its root at zero."""
    offsets = [np.zeros(3)] + [
        turns[bone.parent] @ (bone.centre - bones[bone.parent].joint) for bone in bones[1:]
    ]
    ends = {}
    for i, bone in enumerate(bones):
        if i in found.parents or bone.end is None:
            continue
        end = turns[i] @ (bone.end - bone.joint)
        if np.linalg.norm(end) < SHORTEST_END:
            # As the bone before it goes on.
            along = offsets[i] / np.linalg.norm(offsets[i]) if offsets[i].any() else turns[i][1]
            end = 10 * SHORTEST_END * along
        ends[i] = end
    names = tuple(s.joint or s.name for s in found.segments)
    nothing = np.empty((len(bones), 0, 3, 3))
    return Rig(names, found.parents, np.stack(offsets), ends, np.empty((0, 3)), nothing)


def _moving(
    rig: Rig, found: _Found, bones: Sequence[Bone], turns: Sequence[Array], window: slice
) -> Rig:
    """The rig with the motion of the clip's frames, each bone following the fitted joints."""
    poses = [
        Pose(fill_rotations(own.pose.rotation[window]), fill_positions(own.pose.origin[window]))
        for own in found.fits
    ]
    places: list[Array] = [poses[0].origin]
    world: list[Array] = []
    local: list[Array] = []
    for i, (bone, pose) in enumerate(zip(bones, poses, strict=True)):
        if i:
            parent = bones[bone.parent]
            there = world[bone.parent] @ (bone.centre - parent.joint)
            places.append(places[bone.parent] + there)
        beyond = [child.centre for child in bones if child.parent == i]
        tips = beyond or [point for point in [bone.end] if point is not None]
        # The root is where its markers are, and its joints are constant in its own frame.
        turn = pose.rotation
        if i and tips:
            targets = np.stack([pose.to_lab(tip) - places[i] for tip in tips])
            turn = follow(turn, np.stack(tips) - bone.joint, targets)
        world.append(turn)
    rested = [turn @ rest.T for turn, rest in zip(world, turns, strict=True)]
    for turn, bone in zip(rested, bones, strict=True):
        above = rested[bone.parent].transpose(0, 2, 1) if bone.parent >= 0 else np.eye(3)
        local.append(above @ turn)
    return replace(rig, position=places[0], rotation=np.stack(local))


def _first(rig: Rig) -> Array:
    return np.asarray(np.eye(1, len(rig.names))[0])


def _lowest(places: tuple[Array, dict[int, Array]], up: Array) -> float:
    joints, ends = places
    return min(float((joints @ up).min()), *(float((end @ up).min()) for end in ends.values()))


def _spans(fit: SkeletonFit, stretches: list[tuple[int, int]]) -> str:
    """Stretches (start, stop) in the file's own frame numbers."""
    numbers = fit.frame_numbers
    return listed(
        (
            str(numbers[start]) if stop - start == 1 else f"{numbers[start]}-{numbers[stop - 1]}"
            for start, stop in stretches
            if stop > start
        ),
        12,
    )

"""A fit as a figure to animate: rigid, calm, its feet on the floor, both sides alike."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from mocap_skel.clip import vertical
from mocap_skel.figure.full_rig import full_rig
from mocap_skel.rig.bridging import runs
from mocap_skel.rig.feet import Feet, bent_toes, find_feet, held_feet
from mocap_skel.rig.filtering import chosen_cutoff, low_passed
from mocap_skel.rig.fuller import fuller
from mocap_skel.rig.model import Model, model_of
from mocap_skel.rig.motion import Limits, RigidMotion, rigid_motion
from mocap_skel.rig.rest_pose import Bone, rest_pose
from mocap_skel.rig.symmetry import even_offsets, even_points
from mocap_skel.segments.pose import Array
from mocap_skel.skeleton_fit import SkeletonFit
from mocap_skel.text import listed

# Animations of one fit that are kept: several formats show the same.
KEPT = 2
AUTO = "auto"
# Metres: the joint of toes is at least so high over the sole, in the middle of toes as thick as twice that.
LEAST_OVER = 0.01


@dataclass(frozen=True)
class Choice:
    """What an animated figure may be told.

    Attributes:
        limits: how long gaps may be, and how fast joints.
        smooth: hertz above which the markers' movement is taken away; AUTO = by residual analysis; 0 = nothing is.
        lock: hold each sole where it stands.
        even: bones of one length on both sides.
        full: with the joints that animators know and no marker shows (`figure/full_rig.toml`).
    """

    limits: Limits = field(default_factory=Limits)
    smooth: float | str = AUTO
    lock: bool = False
    even: bool = True
    full: bool = False


@dataclass(frozen=True, eq=False)
class Animation:
    """A rigid figure, its rest pose and its motion. Metres, in the clip's own axes.

    Attributes:
        motion: of the figure; `motion.model` has its bones.
        rest: of each segment the rotation (3, 3) from its axes to the character's in the T-pose (x to its
            left, y up, z forward).
        average: segments whose rest pose is the clip's average, for the skeleton file has no direction for them.
        feet: when the soles stand, and where the floor is.
        cutoff: hertz of the filter; None = none was used.
        rate: frames a second.
        up: the clip's vertical axis.
        frame_numbers: (F,), the file's own.
        recorded: of each segment the markers as they were recorded, before the filter, (F, M, 3) in the order of
            the motion's model.
        lacking: joints of the full rig that the figure cannot have; empty where it was not asked for.
    """

    motion: RigidMotion
    rest: tuple[Array, ...]
    average: tuple[str, ...]
    feet: Feet
    cutoff: float | None
    rate: float
    up: str
    frame_numbers: NDArray[np.int64]
    recorded: tuple[Array, ...]
    lacking: tuple[str, ...] = ()

    @property
    def vertical(self) -> Array:
        """(3,): the clip's vertical."""
        return vertical(self.up)


@lru_cache(maxsize=KEPT)
def animate(fit: SkeletonFit, choice: Choice = Choice()) -> Animation:
    """The rigid figure of a fit through its clip.

    Args:
        fit: of one subject, in the clip's own axes.
        choice: what the figure shall be.
    """
    upward = vertical(fit.up)
    model = model_of(fit)
    recorded = _by_marker(model)
    model, cutoff = _filtered(model, fit.rate, choice.smooth)
    lacking: tuple[str, ...] = ()
    # Before the fit: the markers decide where the changed bones are.
    if choice.even:
        model = _even(model, upward)
    if choice.full:
        model, lacking = fuller(model, _rested(model, upward)[0], full_rig())
        model = _even(model, upward) if choice.even else model
    motion = rigid_motion(model, fit.rate, choice.limits)
    model = motion.model
    rest, average = _rested(model, upward)
    feet = find_feet(model, motion.poses, upward, fit.rate, rest)
    if choice.lock and feet.soles:
        poses = held_feet(motion.problem, motion.poses, feet, upward, fit.rate)
        motion = replace(motion, poses=poses)
    model = _on_soles(model, feet)
    rest, average = _rested(model, upward)
    model = _toed(model, rest, choice.even)
    if choice.even:
        turned = {model.segments[i].name: rest[i] @ end for i, end in model.ends.items()}
        even = even_points(turned)
        ends = {i: rest[i].T @ even[model.segments[i].name] for i in model.ends}
        model = replace(model, ends=ends)
    poses = bent_toes(model, motion.poses, feet, upward, np.radians(choice.limits.speed) / fit.rate)
    motion = replace(motion, model=model, poses=poses)
    return Animation(
        motion, tuple(rest), tuple(average), feet, cutoff, fit.rate, fit.up, fit.frame_numbers,
        _of_segments(model, recorded), lacking,
    )  # fmt: skip


def _by_marker(model: Model) -> dict[str, Array]:
    """Marker → its points (F, 3)."""
    return {
        marker: points[:, i]
        for names, points in zip(model.markers, model.points, strict=True)
        for i, marker in enumerate(names)
    }


def _of_segments(model: Model, points: Mapping[str, Array]) -> tuple[Array, ...]:
    """Of each segment the points (F, M, 3) of its markers; a full rig has moved some to new segments."""
    return tuple(
        np.stack([points[marker] for marker in names], axis=1)
        if names
        else np.empty((model.start.frames, 0, 3))
        for names in model.markers
    )


def _even(model: Model, vertical: Array) -> Model:
    rest, _ = _rested(model, vertical)
    offsets = even_offsets(model.segments, model.bones.parents, model.bones.offsets, rest)
    return replace(model, bones=replace(model.bones, offsets=offsets))


def _filtered(model: Model, rate: float, smooth: float | str) -> tuple[Model, float | None]:
    cutoff = chosen_cutoff(model.points, rate) if isinstance(smooth, str) else smooth
    if not cutoff:
        return model, None
    points = tuple(low_passed(own, rate, cutoff) for own in model.points)
    return replace(model, points=points), cutoff


def _rested(model: Model, vertical: Array) -> tuple[list[Array], list[str]]:
    turns = model.start.turn.transpose(2, 3, 0, 1)
    zero = np.zeros(3)
    bones = [
        Bone(
            segment,
            model.bones.parents[i],
            zero,
            model.bones.offsets[i],
            model.ends.get(i, model.tips.get(i)),
            turns[i],
            model.rested.get(i),
        )
        for i, segment in enumerate(model.segments)
    ]
    return rest_pose(bones, vertical)


def _on_soles(model: Model, feet: Feet) -> Model:
    """Ends and tips, those of feet on the sole instead of at the markers above it; feet with toes stand flat at rest."""
    ends, tips, segments = dict(model.ends), dict(model.tips), list(model.segments)
    for i, segment in enumerate(model.segments):
        chosen = segment.ends or model.markers[i]
        soles = [s for s in feet.soles if s.segment == i and s.marker in chosen]
        if not soles:
            continue
        place = np.mean([sole.place for sole in soles], axis=0)
        if i in ends:
            ends[i] = place
        elif i in tips:
            tips[i] = place
            up = np.sum([sole.above - sole.place for sole in soles], axis=0)
            up /= np.linalg.norm(up)
            level = float(np.linalg.norm(np.cross(up, place)))
            segments[i] = replace(segment, rest=(0.0, float(up @ place), level))
    return replace(model, segments=tuple(segments), ends=ends, tips=tips)


def _toed(model: Model, rest: Sequence[Array], even: bool) -> Model:
    """Toes forward in the rest pose, from above the sole of their foot down to its height.

    Nothing shows where the joint of toes without markers is, so that it may still be put over the sole.
    """
    joints, ends, where = {}, {}, {}
    for s in (s for s in model.ends if model.bones.parents[s] in model.tips):
        foot, name = model.bones.parents[s], model.segments[s].name
        tip, joint = rest[foot] @ model.tips[foot], rest[foot] @ model.bones.offsets[s]
        if not model.markers[s]:
            joint = np.array([tip[0], max(joint[1], tip[1] + LEAST_OVER), tip[2]])
        joints[name], where[name] = joint, s
        ends[name] = np.array([0.0, tip[1] - joint[1], float(np.linalg.norm(model.ends[s]))])
    if even:
        joints, ends = even_points(joints), even_points(ends)
    offsets, placed = model.bones.offsets.copy(), dict(model.ends)
    for name, s in where.items():
        turn = rest[model.bones.parents[s]]
        offsets[s], placed[s] = turn.T @ joints[name], turn.T @ ends[name]
    return replace(model, bones=replace(model.bones, offsets=offsets), ends=placed)


def animation_notes(animation: Animation) -> tuple[str, ...]:
    """What was done to the motion, one sentence each: filters, gaps, repairs, frames without a figure."""
    notes = []
    if animation.lacking:
        notes.append(
            f"a full rig has joints that this figure has no segments for: {listed(animation.lacking)}"
        )
    if animation.cutoff:
        notes.append(
            f"the markers' movement above {animation.cutoff:g} Hz is taken away (--smooth 0 keeps it)"
        )
    ways = {
        "markers": "by the markers left and the joints beside",
        "motion": "by the motion before and after",
        "hold": "with the nearest pose",
    }
    motion = animation.motion
    names = [segment.name for segment in motion.model.segments]
    for by, how in ways.items():
        filled = {
            names[s]: [(b.start, b.stop) for b in motion.bridges if b.segment == s and b.by == by]
            for s in range(len(names))
            # What no marker shows ever has no gaps of its own.
            if names[s] not in motion.model.added
        }
        told = [f"{name} {spans(animation, found)}" for name, found in filled.items() if found]
        off = [b.residual for b in motion.bridges if b.by == by and np.isfinite(b.residual)]
        seen = f"; markers seen there are {1e3 * max(off):.0f} mm off at most" if off else ""
        if told:
            notes.append(f"filled {how}: {listed(told, 20)}{seen}")
    repaired = [
        f"{name} {spans(animation, runs(row))}"
        for name, row in zip(names, motion.repaired, strict=True)
        if row.any()
    ]
    if repaired:
        notes.append(f"turns faster than any person's are slowed down: {listed(repaired, 20)}")
    return tuple(notes)


def spans(animation: Animation, stretches: Iterable[tuple[int, int]]) -> str:
    """Stretches (start, stop) in the file's own frame numbers."""
    numbers = animation.frame_numbers
    return listed(
        (
            str(numbers[start]) if stop - start == 1 else f"{numbers[start]}-{numbers[stop - 1]}"
            for start, stop in stretches
            if stop > start
        ),
        12,
    )

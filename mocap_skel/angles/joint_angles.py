"""The joint angles of a fit: anatomical axes, sequences, errors and neutral pose put together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mocap_skel.angles.anatomical import best_way
from mocap_skel.angles.errors import Turns, standard_errors, turns_by_source
from mocap_skel.angles.neutral import STILL, Static, mean_rotation, seen_from, with_landmarks
from mocap_skel.angles.places import HingeAxis, Place, Source, Surveyed
from mocap_skel.angles.sequences import (
    about_their_mean,
    angles_by_turn,
    angles_of,
    locked,
    settled,
    unwrapped,
)
from mocap_skel.clip import AXES, vertical
from mocap_skel.figure.angle_table import AngleRule, FrameRule, Way, angle_table
from mocap_skel.segments.pose import Array
from mocap_skel.skeleton_fit import SkeletonFit
from mocap_skel.text import listed

# Mirrors right and left of anatomical axes (z is to the right).
MIRROR = np.diag([1.0, 1.0, -1.0])
# Runs of frames that a note names.
MOST_RUNS = 4


@dataclass(frozen=True, eq=False)
class AnatomicalAxes:
    """The anatomical axes of one segment: x forward, y up, z to the right.

    Attributes:
        axes: (3, 3), columns, in the segment's own coordinates.
        way: how they were found.
        unseen: whether nothing shows how the segment turns about `way.axis`.
        turns: source of error → (3, 3): how far it turns them, radians a metre, along the axes.
    """

    axes: Array
    way: Way
    unseen: bool
    turns: Turns


@dataclass(frozen=True, eq=False)
class JointAngles:
    """The three angles of one joint, or of a segment in the lab, in every frame.

    Attributes:
        rule: what they are called, and their sequence.
        degrees: (frames, 3); NaN = not known, or not seen. Without jumps by a whole turn.
        standard_error: (frames, 3), degrees: how far the errors of centres, landmarks and axes turn them. These errors
            are the same in all frames: they shift a line rather than shake it, and where a joint bends far, they mix the
            bend into its other angles.
        locked: (frames,): whether the first and third angle cannot be told apart.
    """

    rule: AngleRule
    degrees: Array
    standard_error: Array
    locked: NDArray[np.bool_]

    @property
    def typical_error(self) -> Array:
        """(3,) degrees: the median standard error over the clip; NaN where there is none."""
        columns = [error[np.isfinite(error)] for error in self.standard_error.T]
        return np.array([np.median(known) if len(known) else np.nan for known in columns])


@dataclass(frozen=True, eq=False)
class Angles:
    """All joint angles of a fit.

    Attributes:
        frame_numbers: (frames,), the file's own.
        time: (frames,), seconds.
        joints: in the order of the table of angles; without those whose segments have no anatomical axes.
        notes: what was decided and what is missing, one sentence each.
    """

    frame_numbers: NDArray[np.int64]
    time: Array
    joints: tuple[JointAngles, ...]
    notes: tuple[str, ...]

    def __getitem__(self, name: str) -> JointAngles:
        """The angles of a joint, or of a segment in the lab, by name."""
        return next(joint for joint in self.joints if joint.rule.name == name)


def joint_angles(
    fit: SkeletonFit,
    static: SkeletonFit | None = None,
    hinges: Mapping[str, HingeAxis] | None = None,
) -> Angles:
    """The joint angles of a fit, in degrees, with their standard errors.

    Args:
        fit: of one subject.
        static: the fit of a static clip of the same markers: its mean pose is neutral, all angles of joints are
            0 there, and a segment's tilt and obliquity in the lab; landmarks that only it has count too.
        hinges: joint → its axis, where the movement shows one; it counts where it is surer than landmarks are.

    Source: Wu 2002 and 2005 (ISB), Grood & Suntay 1983, Baker 2001; see `figure/angles.toml`.

    >>> from mocap_skel import associate, fit_skeleton, read_association, read_clip
    >>> clip, cmu = read_clip("sample_data/range_of_motion.c3d"), read_association("cmu")
    >>> angles = joint_angles(fit_skeleton(clip, associate(clip, cmu)[0], cmu.skeleton))
    >>> angles["LeftKnee"].rule.titles[0], angles["LeftKnee"].degrees.shape
    ('LeftKnee_flexion', (1380, 3))
    """
    neutral = None if static is None else seen_from(fit, static)
    axes = anatomical_frames(fit, static, hinges)
    survey = Surveyed(fit, hinges)
    joints, missing = [], []
    for rule in angle_table().angles:
        if rule.child in axes and (not rule.parent or rule.parent in axes):
            joints.append(_angles(rule, fit, axes, neutral, survey))
        elif rule.child in fit.segments and rule.parent in ("", *fit.segments):
            missing.append(rule.name)
    notes = [*_ways(axes), *_locks(joints, fit)]
    if missing:
        notes.append(f"no angles of {listed(missing)}: their landmarks are missing")
    if neutral is not None:
        notes += _static_notes(neutral, joints)
    return Angles(fit.frame_numbers, fit.time, tuple(joints), tuple(notes))


def anatomical_frames(
    fit: SkeletonFit,
    static: SkeletonFit | None = None,
    hinges: Mapping[str, HingeAxis] | None = None,
) -> dict[str, AnatomicalAxes]:
    """The anatomical axes of each segment that has them; arguments as of `joint_angles`."""
    more = None
    if static is not None:
        fit = with_landmarks(fit, seen_from(fit, static))
        more = static.skeleton.landmarks
    survey = Surveyed(fit, hinges, more)
    found = {}
    for name in fit.segments:
        rule = angle_table().frames.get(name)
        axes = None if rule is None else _axes_of(rule, survey, fit)
        if axes is not None:
            found[name] = axes
    return found


def _axes_of(rule: FrameRule, survey: Surveyed, fit: SkeletonFit) -> AnatomicalAxes | None:
    names = dict.fromkeys(name for way in rule.ways for name in way.names)
    places = survey.places(rule.segment, names)
    hinges = survey.hinges(rule.segment, [way.hinge for way in rule.ways if way.hinge])
    # A leaf that stands on one marker turns as its parent does, or as chance has it.
    leaf = all(segment.parent != rule.segment for segment in fit.skeleton.segments)
    lost = leaf and not fit.segments[rule.segment].drawn_through

    def found_by(hinges: Mapping[str, Place]) -> AnatomicalAxes | None:
        at = ({n: p.at for n, p in some.items()} for some in (places, hinges))
        found = best_way(rule.ways, *at)
        if found is None:
            return None
        way, axes = found
        turns = turns_by_source(way, places, hinges, axes)
        return AnatomicalAxes(axes, way, way.unseen or lost, turns)

    best = found_by(hinges)
    if best is None or not best.way.hinge:
        return best
    # The movement may show an axis worse than landmarks do.
    other = found_by({})
    return other if other and _error_about(other, survey) < _error_about(best, survey) else best


def _error_about(found: AnatomicalAxes, survey: Surveyed) -> float:
    """Variance of the turn about the axis whose direction is certain, radians²."""
    row = AXES.index(found.way.axis)
    sd = angle_table().landmark_sd
    return float(
        sum(turn[row] @ survey.covariance(s, sd) @ turn[row] for s, turn in found.turns.items())
    )


def _angles(
    rule: AngleRule,
    fit: SkeletonFit,
    axes: Mapping[str, AnatomicalAxes],
    neutral: Static | None,
    survey: Surveyed,
) -> JointAngles:
    child = axes[rule.child]
    here = {name: segment.pose.rotation for name, segment in fit.segments.items()}
    rotation = _between(rule, here, axes, fit.up)
    turns = child.turns
    parent: Turns = axes[rule.parent].turns if rule.parent else {}
    at_rest = None if neutral is None else _at_rest(rule, neutral, axes)
    if at_rest is not None:
        rotation = rotation @ at_rest.T
        # The child's axes are then the parent's, carried over in the neutral pose.
        turns = parent
    if rule.mirrored:
        rotation = MIRROR @ rotation @ MIRROR
        # A turn is no arrow: its mirror image turns the other way.
        turns, parent = ({s: -MIRROR @ g for s, g in some.items()} for some in (turns, parent))
    sequence = _sequence(rule, child)
    angles = angles_of(rotation, sequence)
    rates = angles_by_turn(rotation, angles, sequence)
    table = angle_table()

    def covariance(source: Source) -> Array:
        return survey.covariance(source, table.landmark_sd)

    errors = np.degrees(standard_errors(rotation, rates, parent, turns, covariance))
    lock = locked(angles, sequence)
    # A heading counts its turns, and so may a shoulder that circles; other joints do not turn round.
    circles = not rule.parent or sequence[0] == sequence[2]
    steady = settled(unwrapped(angles), lock, sequence) if circles else about_their_mean(angles)
    degrees = np.degrees(steady)
    if child.unseen:
        degrees[:, 2] = np.nan
    if rule.parent and axes[rule.parent].unseen:
        degrees[:] = np.nan
    if sequence != rule.sequence:
        order = [sequence.index(axis) for axis in rule.sequence]
        degrees, errors = degrees[:, order], errors[:, order]
    degrees = degrees * rule.signs
    errors[~np.isfinite(degrees)] = np.nan
    return JointAngles(rule, degrees, errors, lock)


def _sequence(rule: AngleRule, child: AnatomicalAxes) -> str:
    """The sequence, with the turn that nothing shows as the last one, so that it leaves the others alone."""
    axis = child.way.axis.upper()
    if not child.unseen or rule.sequence.endswith(axis):
        return rule.sequence
    return rule.sequence.replace(axis, "") + axis


def _between(
    rule: AngleRule,
    turns: Mapping[str, Array],
    axes: Mapping[str, AnatomicalAxes],
    up: str,
) -> Array:
    """(frames, 3, 3): the child's anatomical axes in the parent's, or in the lab."""
    child = turns[rule.child] @ axes[rule.child].axes
    if not rule.parent:
        return np.asarray(_lab(up).T @ child)
    return np.asarray((turns[rule.parent] @ axes[rule.parent].axes).transpose(0, 2, 1) @ child)


def _lab(up: str) -> Array:
    """The lab's anatomical axes: y up, x the first horizontal axis behind it in the circle of x, y, z."""
    y, x = vertical(up), np.eye(3)[(AXES.index(up[-1]) + 1) % 3]
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _at_rest(rule: AngleRule, neutral: Static, axes: Mapping[str, AnatomicalAxes]) -> Array | None:
    """(3, 3): the mean of a joint in the neutral pose; in the lab without the heading."""
    if any(name and name not in neutral.turns for name in (rule.parent, rule.child)):
        return None
    mean = mean_rotation(_between(rule, neutral.turns, axes, neutral.up))
    if mean is None or rule.parent:
        return mean
    heading = angles_of(mean[None], "YXZ")[0, 0]
    c, s = np.cos(heading), np.sin(heading)
    return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]]) @ mean


def _ways(axes: Mapping[str, AnatomicalAxes]) -> list[str]:
    """What there is to say about the ways to the axes: those that stand in for the definition."""
    said: dict[str, list[str]] = {}
    for name, found in axes.items():
        if found.way.says:
            said.setdefault(found.way.says, []).append(name)
    return [f"axes of {listed(names)}: {words}" for words, names in said.items()]


def _locks(joints: Iterable[JointAngles], fit: SkeletonFit) -> list[str]:
    notes = []
    for joint in joints:
        flags = joint.locked & np.isfinite(joint.degrees[:, [0, 2]]).all(axis=1)
        if flags.any():
            first, _, third = joint.rule.parts
            notes.append(
                f"{joint.rule.name}: {first} and {third} cannot be told apart in frames "
                f"{_runs(fit.frame_numbers[flags])}: only their sum or difference is known there"
            )
    return notes


def _runs(numbers: NDArray[np.int64]) -> str:
    """Frame numbers as ranges.

    >>> _runs(np.array([3, 4, 5, 9]))
    '3 to 5, 9'
    """
    parts = np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1)
    return listed([f"{p[0]} to {p[-1]}" if len(p) > 1 else f"{p[0]}" for p in parts], MOST_RUNS)


def _static_notes(neutral: Static, joints: Iterable[JointAngles]) -> list[str]:
    without = [
        joint.rule.name
        for joint in joints
        if any(name and name not in neutral.turns for name in (joint.rule.parent, joint.rule.child))
    ]
    notes = []
    if without:
        notes.append(f"the static clip gives no neutral pose of {listed(without)}")
    if neutral.restless:
        notes.append(
            f"the person does not stand still in the static clip, where these joints turn by more than {STILL:g} degrees, "
            f"and the mean of that is their zero: {listed(neutral.restless)}"
        )
    if neutral.doubtful:
        notes.append(
            f"markers of {listed(neutral.doubtful)} lie otherwise in the static clip: its neutral pose is in doubt"
        )
    return notes

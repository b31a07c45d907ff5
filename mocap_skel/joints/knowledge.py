"""What is known of a joint besides its own markers' spheres: anatomy, the shared point, other clips."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mocap_skel.figure.prior_tables import Shift
from mocap_skel.figure.skeleton import Segment
from mocap_skel.joints.calibration import Pooled, Template, pooled_evidence, template_of
from mocap_skel.joints.evidence import NEAREST
from mocap_skel.joints.hanging import inward_of_hanging
from mocap_skel.joints.hinge import Turning, hinge_shift, turning
from mocap_skel.joints.priors import Expected, Surroundings, expected_joint
from mocap_skel.joints.samples import LEAST_SAMPLES
from mocap_skel.joints.segment_pose import Placed
from mocap_skel.joints.task import Task
from mocap_skel.joints.turn_axis import (
    TurnAxis,
    Wobble,
    bending,
    bends,
    best_axis,
    by_plane,
    by_turns,
    wobble,
)
from mocap_skel.joints.two_sided import SharedPoint, shared_point
from mocap_skel.segments.pose import Array
from mocap_skel.segments.prepare import Prepared
from mocap_skel.spherefit import Moments, sphere_moments

# Markers that make a patch, whose way of facing is told by their places.
CLUSTER = 3


@dataclass(frozen=True, eq=False)
class JointKnowledge:
    """What a fit may add to the movement of a joint's markers. All in the parent's frame.

    Attributes:
        expected: where anatomy has the joint; None without a prior.
        shared: the point that both segments' own poses share; only beside `expected`.
        pooled: what the calibration's clips know of it.
    """

    expected: Expected | None
    shared: SharedPoint | None
    pooled: Pooled | None


def joint_knowledge(
    segment: Segment, parent: Placed, inside: Array, prepared: Prepared, task: Task
) -> tuple[JointKnowledge, tuple[str, ...]]:
    """What is known of the joint between a segment and its parent, and notes on what cannot be used.

    Args:
        segment: the segment below the joint.
        parent: the one above it.
        inside: the segment's markers (frames, M, 3) in the parent's frame, metres.
        prepared: the clip's markers.
        task: what is fitted, and how.
    """
    expected = expected_in(segment, parent, inside, prepared, task)
    shared = _shared(segment, parent, prepared) if expected is not None else None
    pooled, notes = _pooled(segment, parent, prepared, task)
    return JointKnowledge(expected, shared, pooled), notes


def expected_in(
    segment: Segment, parent: Placed, inside: Array, prepared: Prepared, task: Task
) -> Expected | None:
    """Where anatomy has a segment's joint, in its parent's frame; arguments as of `joint_knowledge`."""
    if not task.anatomy or not segment.priors:
        return None
    columns = prepared.markers(segment.name)

    def middle_of(markers: tuple[str, ...]) -> Array:
        """(frames, 3): the middle of some of the child's markers, of all for ()."""
        few = inside[:, [columns.index(m) for m in markers]] if markers else inside
        return np.asarray(few.mean(axis=1))

    def lower(markers: tuple[str, ...]) -> Moments | None:
        if not all(m in columns for m in markers):
            return None
        found = sphere_moments(middle_of(markers))
        return found if found.count >= LEAST_SAMPLES else None

    def turn(markers: tuple[str, ...]) -> Turning | None:
        hinge = segment.freedom == "hinge" and segment.name in prepared.shapes
        if not hinge or not all(m in columns for m in markers):
            return None
        middle = np.mean(list(parent.template.values()), axis=0)
        return turning(parent.pose, prepared.shapes[segment.name][1], middle_of(markers), middle)

    def inside_parent(ends: Sequence[Array | None]) -> Array | None:
        """(frames, 3): the line between two tracks of the lab, along the parent's axes."""
        a, b = ends
        if a is None or b is None:
            return None
        return np.asarray(np.einsum("fij,fi->fj", parent.pose.rotation, b - a))

    def hanging(shift: Shift, bone: Array | None, marker: Array) -> tuple[Array, float] | None:
        line = inside_parent([prepared.track(name) for name in shift.straight])
        if line is None:
            return None
        ends = [_landmark(name, prepared, task) for name in shift.hanging]
        down = inside_parent(ends) if ends else None
        return inward_of_hanging(shift, line, bone, middle_of(shift.toward) - marker, down)

    cluster: tuple[Array, Array] | None = None
    if segment.name in prepared.shapes:
        own = prepared.shapes[segment.name][0].template
        seen = np.isfinite(own[:, 0]) & np.isfinite(inside[..., 0]).any(axis=0)
        if seen.sum() >= CLUSTER:
            cluster = own[seen], np.nanmean(inside[:, seen], axis=0)
    around = Surroundings(
        parent.template,
        parent.posed.joint,
        lower,
        task.size,
        turn,
        hanging,
        cluster,
        parent.joint_error,
    )
    return expected_joint(segment.priors, task.skeleton.landmarks, around)


def _landmark(name: str, prepared: Prepared, task: Task) -> Array | None:
    """(frames, 3) in the lab: the mean of a landmark's markers, by the first set that the clip has; None without one."""
    for markers in task.skeleton.landmarks.get(name, ((name,),)):
        found = [track for m in markers if (track := prepared.track(m)) is not None]
        if len(found) == len(markers):
            return np.asarray(np.mean(found, axis=0))
    return None


def turn_axis(
    segment: Segment, parent: Placed, centre: Array, prepared: Prepared, size: float
) -> TurnAxis | None:
    """The axis on which a segment and its parent turn; None for a ball, or where none is shown.

    Args:
        segment: the one below the joint.
        parent: the one above it.
        centre: (3,) the joint in the parent's frame, metres.
        prepared: the clip's markers.
        size: the subject's, 1 for a person of 1.75 m.
    """
    markers = prepared.markers(segment.name)
    # A parent on one marker has no turn of its own, or the one that its child gives it.
    if not markers or parent.posed.shape is None or not bends(segment):
        return None
    hinge = hinge_shift(segment.priors)
    told = () if hinge is None else hinge[1].toward
    ends = [markers.index(m) for m in (told if all(m in markers for m in told) else ()) or markers]
    far = sphere_moments(parent.pose.to_segment(prepared.of(segment.name)[:, ends]).mean(axis=1))
    if far.count < LEAST_SAMPLES:
        return None
    sigma, distance = prepared.noise.sigma, float(np.linalg.norm(far.mean - centre))
    # Where the pose rests on the joint above, that is one more point of its shape.
    rests = len(parent.posed.shape.template) > len(parent.markers)
    if rests and not np.isfinite(parent.joint_error):
        return None
    above = wobble(parent.posed.shape, sigma, parent.joint_error if rests else 0.0)
    place = Wobble(0.0, sigma**2 / (len(ends) * max(distance, NEAREST) ** 2))
    middle = np.mean(list(parent.template.values()), axis=0)
    beside = 0.0 if hinge is None else -hinge[1].hinge * hinge[1].beside * size
    found = [by_plane(far, centre, middle, [above, place], beside)]
    # Another joint's turns about its bone go with its bend as often as not: only the plane tells them apart.
    if segment.freedom == "hinge" and segment.name in prepared.shapes:
        shape, pose = prepared.shapes[segment.name]
        turned = by_turns(parent.pose, pose, [above, wobble(shape, sigma)])
        found.append(None if turned is None else bending(turned, far, centre, middle))
    return best_axis(found)


def _shared(segment: Segment, parent: Placed, prepared: Prepared) -> SharedPoint | None:
    """The point of a segment's own shape that stays in its parent."""
    if segment.name not in prepared.shapes:
        return None
    return shared_point(parent.pose, prepared.shapes[segment.name][1])


def _pooled(
    segment: Segment, parent: Placed, prepared: Prepared, task: Task
) -> tuple[Pooled | None, tuple[str, ...]]:
    """What the calibration knows of the joint, and a note for each clip with markers that have moved."""
    if task.calibration is None or segment.joint is None or not parent.drawn_through:
        return None, ()
    markers = prepared.markers(segment.name)
    shape = prepared.shapes[segment.name][0] if segment.name in prepared.shapes else None
    return pooled_evidence(
        task.calibration,
        segment.joint,
        Template(parent.template, parent.posed.joint, parent.rigid),
        template_of(markers, prepared.of(segment.name), shape),
        markers,
        segment.looseness,
    )

"""A segment's pose once its joint is known, and how far a joint in its frame can be trusted."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mocap_skel.figure.skeleton import Segment
from mocap_skel.joints.hinge import hinge_shift, inward
from mocap_skel.joints.joint_fit import JointFit
from mocap_skel.joints.samples import Frame
from mocap_skel.joints.task import Task
from mocap_skel.joints.turn_axis import KNOWN, wobble
from mocap_skel.joints.twist import SHARPEST, Plane, Turned, about, turned
from mocap_skel.segments.cases import (
    Link,
    Posed,
    by_line,
    by_markers,
    by_markers_and_joint,
    by_one_marker,
    by_swing,
    middle,
    turned_with,
)
from mocap_skel.segments.pose import Array, Pose
from mocap_skel.segments.prepare import Prepared
from mocap_skel.segments.shape import Shape, median

# A marker nearer to its joint than so many radial residuals shows no direction.
NO_DIRECTION = 3.0
# Of several markers in line with the joint, one that is seen in such a share of the frames of another may be
# the one that the pose is of.
OFTEN = 0.9
# The way from the marker to the joint of a segment that stands on one marker, as it is drawn.
_LENGTH = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True, eq=False)
class Placed:
    """A segment that has a pose.

    Attributes:
        segment: of the figure.
        markers: names of the first points of `posed.template`.
        posed: the pose, and the points that it is of.
        frame: what the fit of a joint in this segment's frame has to know of it.
        joint_error: standard deviation of its joint towards its parent, in the direction in which that is known
            least, metres; 0 for the root, infinite for a place holder.
    """

    segment: Segment
    markers: tuple[str, ...]
    posed: Posed
    frame: Frame
    joint_error: float = 0.0

    @property
    def pose(self) -> Pose:
        """NaN in frames that do not determine it."""
        return self.posed.pose

    @property
    def template(self) -> dict[str, Array]:
        """Marker → its place (3,) in the segment, metres, of those that have one."""
        known = np.asarray(np.isfinite(self.posed.template).all(axis=1))
        places = zip(self.markers, self.posed.template, known, strict=False)
        return {marker: place for marker, place, there in places if there}

    @property
    def drawn_through(self) -> tuple[str, ...]:
        """The three points, markers or the joint, that give the axes; empty for a segment of one marker."""
        if self.posed.shape is None:
            return ()
        # The joint is the last point of a shape that has it.
        names = [*self.markers, self.segment.joint or ""]
        return tuple(names[i] for i in self.posed.shape.chosen)

    @property
    def rigid(self) -> float:
        """Standard deviation of the markers about their places, metres, skin included."""
        return self.posed.shape.sigma if self.posed.shape else 0.0


def placed_root(segment: Segment, prepared: Prepared, task: Task) -> Placed:
    """The root by its own markers, which have a rigid shape."""
    shape, pose = _own_pose(segment.name, prepared, task)
    posed = Posed(pose, shape.template, None, shape)
    return Placed(segment, prepared.markers(segment.name), posed, Frame(shape))


def placed_child(
    segment: Segment, joint: JointFit, parent: Placed, prepared: Prepared, task: Task
) -> tuple[Placed, str]:
    """A segment by the case that each frame allows (thesis 5.5.1.1 to 5.5.1.3).

    Args:
        segment: it has a marker.
        joint: its joint towards the parent, fitted.
        parent: the parent.
        prepared: the clip's markers.
        task: what is fitted, and how.

    Returns:
        The segment, whose pose may be unknown in every frame; and a note, "" for none.
    """
    points, markers = prepared.of(segment.name), prepared.markers(segment.name)
    link = Link(joint.track, parent.pose.rotation @ joint.axis, joint.hinge)
    plane = _plane_below(segment, joint.track, prepared, task)
    if segment.name in prepared.shapes:
        posed = by_markers(points, *_own_pose(segment.name, prepared, task), link)
        posed, note = _with_plane(segment, posed, plane, prepared)
        return Placed(segment, markers, posed, Frame(posed.shape), _error(joint)), note
    found = by_markers_and_joint(points, link, task.triad)
    if found is not None:
        found, note = _with_plane(segment, found, plane, prepared)
        frame = Frame(found.shape)
        if joint.shown == "no":
            doubt = f"the frame of {segment.name} rests on {joint.joint}, which the movement does not show"
            frame = replace(frame, limit="weak", doubt=doubt, lost=bool(np.isinf(_error(joint))))
        return Placed(segment, markers, found, frame, _error(joint)), note
    return _placed_by_one(segment, joint, link, parent, prepared, plane)


def _error(joint: JointFit) -> float:
    """Metres; a joint that neither movement nor anatomy shows is a place holder, whose own error says nothing."""
    return np.inf if joint.shown == "no" and not joint.landmarks else joint.worst_error


def _own_pose(name: str, prepared: Prepared, task: Task) -> tuple[Shape, Pose]:
    """The rigid shape of a segment's markers, and the pose that they give."""
    shape, pose = prepared.shapes[name]
    return shape, shape.triad_pose(prepared.of(name)) if task.triad else pose


def _with_plane(
    segment: Segment, posed: Posed, plane: Plane | None, prepared: Prepared
) -> tuple[Posed, str]:
    """A segment turned about its length to the plane of the limb below, as far as skin carries its markers round.

    Args:
        segment: of the figure.
        posed: it, by its markers.
        plane: of the limb below; None where nothing shows one.
        prepared: the clip's markers.

    Returns:
        The segment, and a note where its markers turn otherwise by more than an axis may be off; "" for none.
    """
    if plane is None or not plane.kept or posed.joint is None or posed.shape is None:
        return posed, ""
    # Markers that keep their distances to what their noise allows are on no skin: they are right.
    if not wobble(posed.shape, prepared.noise.sigma).skin > SHARPEST:
        return posed, ""
    place = posed.template[plane.marker]
    found = turned(posed.pose, place - posed.joint, place, plane) if np.isfinite(place[0]) else None
    if found is None or not found.wander > 0:
        return posed, ""
    inside = found.pose.to_segment(prepared.of(segment.name))
    template = posed.template.copy()
    for m in range(inside.shape[1]):
        template[m] = middle(inside[:, m])
    note = _turned_note(segment, found, markers=True)
    return replace(posed, pose=found.pose, template=template), note


def _turned_note(segment: Segment, found: Turned, *, markers: bool) -> str:
    """What there is to say of a turn that rests on the plane below; "" where skin is as skin is.

    Args:
        segment: of the figure.
        found: its turn.
        markers: whether it has a turn by its own markers as well.
    """
    if not found.wander > KNOWN:
        return ""
    seen = found.pose.known
    lost = int((found.error[seen] > KNOWN).sum())
    words = f"{segment.name} turns about its length with the plane of the limb below it"
    if markers:
        words += (
            f": its own markers turn {np.degrees(found.wander):.0f} degrees otherwise, as skin does"
        )
    if lost:
        words += (
            f"; in {lost} of {int(seen.sum())} frames the limb is too straight to show this turn to "
            f"{np.degrees(KNOWN):.0f} degrees"
        )
    return words


def _placed_by_one(
    segment: Segment,
    joint: JointFit,
    link: Link,
    parent: Placed,
    prepared: Prepared,
    plane: Plane | None,
) -> tuple[Placed, str]:
    """A segment on one marker, or on several in line with the joint, which show no more of its turn."""
    points, names = prepared.of(segment.name), prepared.markers(segment.name)
    m, distance = _guide(points, joint.track)
    marker = points[:, m]
    several = len(names) > 1
    below, note = False, ""
    if distance < NO_DIRECTION * joint.residual:
        # The line from joint to marker is noise; the parent's turn is the best that is known.
        posed = turned_with(parent.pose, marker, joint.track)
        which = "none of its markers is" if several else "its one marker is no"
        note = f"{segment.name} turns with {joint.parent}: {which} farther from {joint.joint} than noise"
    else:
        below = plane is not None
        if plane is not None:
            link = Link(joint.track, plane.inward, hinge=True)
        posed = by_one_marker(marker, link, distance)
        if plane is not None and plane.kept:
            swung = by_swing(marker, joint.track, parent.pose, distance)
            found = turned(swung.pose, _LENGTH, np.zeros(3), plane)
            if found is not None:
                posed = _drawn_inward(swung, found)
                link = Link(joint.track, posed.pose.rotation[:, :, 2], hinge=True)
                note = _turned_note(segment, found, markers=False)
    if several:
        posed = by_line(points, m, posed, link)
    which = f"markers in line with {joint.joint}" if several else "one marker"
    frame = (
        Frame(
            None,
            "weak",
            f"{segment.name} stands on {which}",
            by_child=several and below,
        )
        if link.hinge
        else Frame(None, "no", f"the turn of {segment.name} is not seen: {which}")
    )
    frame = replace(frame, lost=bool(np.isinf(_error(joint))))
    return Placed(segment, names, posed, frame, _error(joint)), note


def _guide(points: Array, joint: Array) -> tuple[int, float]:
    """The marker that shows best where the line from the joint points to, and its distance from there, metres.

    The farthest one of those that are seen in nearly as many frames as any.
    """
    seen = np.isfinite(points[..., 0]).sum(axis=0)
    away = median(np.ascontiguousarray(np.linalg.norm(points - joint[:, None], axis=2).T))
    often = np.nan_to_num(np.where(seen >= OFTEN * seen.max(), away, -1.0), nan=-1.0)
    m = int(often.argmax())
    return m, float(away[m])


def _drawn_inward(swung: Posed, found: Turned) -> Posed:
    """A segment on one marker, as `by_one_marker` draws it: z is the mean way inward of the hinge at its end."""
    angle = np.arctan2(found.inward[2], found.inward[1]) - 0.5 * np.pi
    rotation = found.pose.rotation @ about(_LENGTH, np.array([angle]))[0]
    return replace(swung, pose=Pose(rotation, found.pose.origin))


def _plane_below(segment: Segment, joint: Array, prepared: Prepared, task: Task) -> Plane | None:
    """The plane in which the limb below a segment bends; None where anatomy has no hinge there, or nobody sees it.

    It is fixed in the segment, and the lower bone shows it, as the segment's own marker cannot.
    """
    if not task.anatomy:
        return None
    names = prepared.markers(segment.name)
    for child in task.skeleton.segments:
        found = hinge_shift(child.priors) if child.parent == segment.name else None
        if found is None or found[0] not in names:
            continue
        m = names.index(found[0])
        marker = prepared.of(segment.name)[:, m]
        ends = [prepared.track(name) for name in found[1].toward]
        known = [end for end in ends if end is not None]
        if len(known) == len(ends):
            below = np.mean(known, axis=0) - marker
            way = inward(marker - joint, below, found[1], task.size)
            return Plane(m, way.direction, way.covariance, found[1].plane)
    return None

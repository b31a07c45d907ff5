"""The walk down the tree: a clip's markers and a skeleton become poses, joint centres and evidence."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from mocap_skel.clip import Clip
from mocap_skel.errors import FitError, RootError
from mocap_skel.figure.skeleton import Segment, Skeleton
from mocap_skel.joints.calibration import (
    Calibration,
    Pooled,
    Template,
    digest_of,
    pooled_evidence,
    share_of,
)
from mocap_skel.joints.centre import (
    BEST,
    LEAST_SAMPLES,
    PRIOR,
    CentreFit,
    Frame,
    JointFit,
    fit_centre,
    from_anatomy,
    unfitted,
)
from mocap_skel.joints.choices import POSES, PRIORS, SHAPED, check_method
from mocap_skel.joints.priors import (
    Expected,
    Surroundings,
    expected_joint,
    hinge_shift,
    inward,
    subject_size,
)
from mocap_skel.joints.two_sided import SharedPoint, shared_point
from mocap_skel.labels.association import Assignment
from mocap_skel.segments.cases import beside, filled, filled_by_hinge, middle, turned_with
from mocap_skel.segments.left_out import LeftOut, left_out, notes
from mocap_skel.segments.noise import clip_noise
from mocap_skel.segments.pose import Array, Pose, by_rows, one_marker_pose
from mocap_skel.segments.shape import Shape, find_shape, median
from mocap_skel.segments.trouble import Mask, off_sphere, out_of_shape
from mocap_skel.skeleton_fit import SegmentFit, SkeletonFit
from mocap_skel.spherefit import DegenerateSphereError, Moments, sphere_moments
from mocap_skel.text import listed

# A marker nearer to its joint than so many radial residuals shows no direction.
NO_DIRECTION = 3.0


def fit_skeleton(
    clip: Clip,
    assignment: Assignment,
    skeleton: Skeleton,
    *,
    sigma: float | Array | None = None,
    pose: str = "least-squares",
    method: str = BEST,
    noise: str = "rigid",
    search: bool = True,
    prior: str = "skeleton",
    calibration: Calibration | None = None,
) -> SkeletonFit:
    """Fit a skeleton to one subject of a clip.

    Args:
        clip: the recording.
        assignment: which column of it is which marker.
        skeleton: the figure.
        sigma: noise standard deviation of a marker in metres, or its covariance (3, 3) along the
            clip's axes, m²; estimated if None.
        pose: "least-squares" (all visible markers) or "triad" (three-point frames, thesis case 1).
        method: the sphere fit, one of `spherefit.METHODS`; "best" is MGDK, with SGDK where a direction is
            not shown.
        noise: how it is estimated. "rigid": one level for the clip, from the rigidity of the segments.
            "matrix": a whole matrix for the clip, from the same residuals. "marker": a level for each
            marker, from its own radial residuals, and weights that go with it.
        search: whether swapped, ghost and jumping markers are looked for; not in frames that do not follow
            each other, where every step is a jump.
        prior: "skeleton": what the motion does not show is taken from the skeleton's priors, each direction
            by its information. "none": the motion alone, the thesis's pure fit.
        calibration: what other clips of the actor know of the joints; the clip itself, if it is among
            them, counts once.

    Raises:
        ValueError: no such pose, method, noise or prior, or two that do not go together.
        RootError: the root segment has no three markers that are seen together off a line.
        FitError: no joint can be fitted.
    """
    if pose not in POSES:
        raise ValueError(f"pose must be one of {POSES}, got {pose!r}")
    if prior not in PRIORS:
        raise ValueError(f"prior must be one of {PRIORS}, got {prior!r}")
    check_method(method, noise, sigma, calibrated=calibration is not None)
    walk = _Walk(
        clip, assignment, skeleton, sigma, pose == "triad", method, noise, search, prior != "none",
        calibration,
    )  # fmt: skip
    for segment in skeleton.segments:
        walk.visit(segment)
    # What anatomy alone gives is no fit of this clip.
    if skeleton.joints and not any(joint.fitted and joint.samples for joint in walk.joints):
        reasons = "; ".join(dict.fromkeys(joint.reason for joint in walk.joints))
        raise FitError(f"{clip.name}: no joint can be fitted: {reasons}")
    trouble = walk.left_out()
    return SkeletonFit(
        clip=clip.name,
        subject=assignment.subject,
        skeleton=skeleton,
        frame_numbers=clip.frame_numbers,
        rate=clip.rate,
        up=clip.up,
        sigma=walk.sigma,
        segments=walk.segments,
        joints=tuple(walk.joints),
        notes=(*walk.all_notes(), *notes(trouble, walk.samples)),
        left_out=trouble,
    )


class _Walk:
    """What the walk has found so far; one use, inside `fit_skeleton`."""

    def __init__(
        self,
        clip: Clip,
        assignment: Assignment,
        skeleton: Skeleton,
        sigma: float | Array | None,
        triad: bool,
        method: str,
        noise: str,
        search: bool,
        prior: bool,
        calibration: Calibration | None,
    ) -> None:
        self.clip, self.skeleton, self.triad = clip, skeleton, triad
        self.method, self.search, self.prior = method, search, prior
        self.notes: list[str] = []
        self.calibrated: list[str] = []
        if calibration is not None:
            calibration = calibration.without(digest_of(clip, assignment.subject))
        self.calibration = calibration
        self.lost: list[str] = []
        self.segments: dict[str, SegmentFit] = {}
        self.frames: dict[str, Frame] = {}
        self.joints: list[JointFit] = []
        self.markers = {
            name: self._seen(name, columns) for name, columns in assignment.columns.items()
        }
        self.points = {
            name: clip.points[:, list(columns.values())] for name, columns in self.markers.items()
        }
        self.samples = sum(int(np.isfinite(p[..., 0]).sum()) for p in self.points.values())
        self.masks: dict[str, Mask] = {}
        self.shapes: dict[str, tuple[Shape, Pose]] = {}
        for name, points in self.points.items():
            squares = None
            if search and points.shape[1] >= 2:
                squares, left = out_of_shape(by_rows(points))
                if left is not None:
                    self._leave_out(name, left.T)
            shape = find_shape(points, squares) if points.shape[1] >= 3 else None
            if shape is not None:
                self.shapes[name] = shape
        self.size = subject_size(skeleton, self._distance) if prior else 1.0
        self._check_size()
        self.noise = clip_noise(self.points, self.shapes, sigma, noise)
        self.sigma = self.noise.sigma
        if self.noise.note:
            self.notes.append(self.noise.note)
        if method not in SHAPED:
            self.notes.append(
                f"{method.upper()} leaves in the noise of the segments' frames: elbows and knees may be off "
                "by more than their standard errors"
            )

    def _seen(self, segment: str, columns: dict[str, int]) -> dict[str, int]:
        there = {
            marker: column
            for marker, column in columns.items()
            if np.isfinite(self.clip.points[:, column, 0]).any()
        }
        lost = [marker for marker in columns if marker not in there]
        if lost:
            self.lost.append(f"{listed(lost)} ({segment})")
        return there

    def _track(self, marker: str) -> Array | None:
        """A marker's points (frames, 3)."""
        for segment, columns in self.markers.items():
            if marker in columns:
                return self.points[segment][:, list(columns).index(marker)]
        return None

    def _distance(self, first: str, second: str) -> float | None:
        ends = [self._track(first), self._track(second)]
        if ends[0] is None or ends[1] is None:
            return None
        found = float(median(np.linalg.norm(ends[0] - ends[1], axis=1)))
        return found if np.isfinite(found) else None

    def _expected(self, segment: Segment, inside: Array) -> Expected | None:
        """Where anatomy has the joint of a segment, whose markers are `inside` its parent's frame."""
        assert segment.parent is not None
        if not self.prior or not segment.priors:
            return None
        parent = self.segments[segment.parent]
        columns = list(self.markers.get(segment.name, {}))

        def lower(markers: tuple[str, ...]) -> Moments | None:
            if not all(m in columns for m in markers):
                return None
            found = sphere_moments(inside[:, [columns.index(m) for m in markers]].mean(axis=1))
            return found if found.count >= LEAST_SAMPLES else None

        around = Surroundings(parent.template, parent.joint, lower, self.size)
        return expected_joint(segment.priors, self.skeleton.landmarks, around)

    def _leave_out(self, segment: str, left: Mask) -> None:
        """Samples (frames, M) of a segment's markers that nothing from here on shall see."""
        self.masks[segment] = left | self.masks.get(segment, False)
        self.points[segment][left] = np.nan

    def _check_size(self) -> None:
        """A person is neither a hand's length nor a house high: then it is the unit."""
        if not 0.3 < self.size < 1.6:
            self.notes.append(
                f"the subject measures as {175 * self.size:.0f} cm tall: is the clip's unit right? "
                "(--unit says it)"
            )

    def left_out(self) -> tuple[LeftOut, ...]:
        """The record of all that was left out."""
        tracks = {joint.child: joint.track for joint in self.joints if joint.fitted}
        return left_out(self.clip, self.markers, self.points, self.masks, tracks)

    def all_notes(self) -> list[str]:
        """The notes, one sentence a kind: a leg-only clip of the standard human has many of some."""
        found = []
        if self.lost:
            found.append(f"markers missing in every frame: {'; '.join(self.lost)}")
        unfitted = [f"{j.joint} ({j.reason})" for j in self.joints if not j.fitted]
        if unfitted:
            found.append(f"joints not fitted: {listed(unfitted, 20)}")
        guessed = [f"{j.joint} ({j.reason})" for j in self.joints if j.method == PRIOR]
        if guessed:
            found.append(f"joints from anatomy alone: {listed(guessed, 20)}")
        unknown = [j.joint for j in self.joints if j.fitted and j.shown == "no" and not j.landmarks]
        if unknown:
            found.append(f"place holders, no joint centres (shown: no): {listed(unknown, 20)}")
        if self.calibrated:
            found.append(f"from the calibration: {listed(self.calibrated, 20)}")
        elif self.calibration is not None:
            found.append(
                "nothing of the calibration could be used: another actor, other markers, or this clip alone?"
            )
        return found + self.notes

    def visit(self, segment: Segment) -> None:
        """Fit a segment's joint in its parent's frame, then the segment's own pose."""
        markers = self.markers.get(segment.name, {})
        if segment.parent is None:
            self._root(segment)
            return
        assert segment.joint is not None, "read_skeleton gives every segment but the root a joint"
        reason = None
        if segment.parent not in self.segments:
            reason = f"{segment.parent} has no pose"
        elif not markers and self._pooled(segment) is None:
            reason = f"no marker on {segment.name}"
        joint = None
        if not reason:
            try:
                joint = self._joint(segment)
            except DegenerateSphereError as error:
                reason = f"{self.method.upper()}: {error.message}"
        if joint is None:
            reason = reason or (
                f"{segment.name} and {segment.parent} are seen together in fewer than "
                f"{LEAST_SAMPLES} frames"
            )
            joint = self._anatomical(segment, reason) or unfitted(
                segment.joint, segment.parent, segment.name, self.clip.frames, reason
            )
        self.joints.append(joint)
        if joint.fitted and markers:
            self._child(segment, joint)

    def _root(self, segment: Segment) -> None:
        if segment.name not in self.shapes:
            markers = self.markers.get(segment.name, {})
            raise RootError(
                f"{self.clip.name}: the root segment {segment.name} needs three markers that are seen "
                f"together off a line; the clip has {listed(markers) or 'none'}",
                f"its markers: {listed(segment.markers, 12)}",
                tuple(s.name for s in self.skeleton.segments if s.name in self.shapes),
            )
        shape = self.shapes[segment.name][0]
        self._add(segment, self._markers_pose(segment.name), Frame(shape), shape, None)

    def _joint(self, segment: Segment) -> JointFit | None:
        assert segment.parent is not None and segment.joint is not None
        parent = self.segments[segment.parent]
        points = self._points(segment)
        inside = parent.pose.to_segment(points)
        expected = self._expected(segment, inside)
        pooled = self._pooled(segment)
        found = self._centre(segment, inside, expected, pooled)
        left = None
        if self.search and found is not None and points.shape[1]:
            left = off_sphere(inside, points, found.motion)
        if left is not None:
            self._leave_out(segment.name, left)
            inside = np.where(left[..., None], np.nan, inside)
            found = self._centre(segment, inside, expected, pooled)
        if found is not None and pooled is not None:
            found = self._said(segment.joint, segment.name, found, pooled)
        return None if found is None else self._named(segment, found)

    def _points(self, segment: Segment) -> Array:
        """A segment's markers (frames, M, 3), M = 0 where it has none."""
        return self.points.get(segment.name, np.empty((self.clip.frames, 0, 3)))

    def _pooled(self, segment: Segment) -> Pooled | None:
        """What the calibration knows of a segment's joint, in this clip's frame of the parent."""
        if self.calibration is None or segment.joint is None or segment.parent is None:
            return None
        parent = self.segments[segment.parent]
        if not parent.drawn_through:
            return None
        markers = list(self.markers.get(segment.name, {}))
        own = self.shapes.get(segment.name)
        places = dict(zip(markers, own[0].template, strict=True)) if own else {}
        rigid = own[0].sigma if own else 0.0
        if len(markers) == 2:
            length = self._distance(*markers)
            if length is not None:
                places = {m: np.array([i * length, 0, 0]) for i, m in enumerate(markers)}
        found, notes = pooled_evidence(
            self.calibration, segment.joint, Template(parent.template, parent.joint, parent.rigid),
            Template({m: p for m, p in places.items() if np.isfinite(p).all()}, None, rigid), markers,
        )  # fmt: skip
        self.notes += [note for note in notes if note not in self.notes]
        return found

    def _said(self, joint: str, child: str, found: CentreFit, pooled: Pooled) -> CentreFit:
        """A centre with the calibration's share in its reason, and as the clip's own columns have it."""
        share = share_of(pooled.evidence, found.evidence, found.centre)
        count = len(pooled.clips)
        words = f"calibration ({count} clip{'s' if count > 1 else ''}) {100 * share:.0f} %"
        self.calibrated.append(f"{joint}: {words}")
        reason = "; ".join(filter(None, [found.reason, words]))
        own = len(self.markers.get(child, {}))
        return replace(found, reason=reason, radius=found.radius[:own])

    def _anatomical(self, segment: Segment, reason: str) -> JointFit | None:
        """A joint that no motion shows, where anatomy has it."""
        if segment.parent not in self.segments:
            return None
        parent = self.segments[segment.parent]
        expected = self._expected(segment, parent.pose.to_segment(self._points(segment)))
        return None if expected is None else self._named(segment, from_anatomy(expected, reason))

    def _named(self, segment: Segment, found: CentreFit) -> JointFit:
        assert segment.parent is not None and segment.joint is not None
        used = np.isfinite(found.radius)
        names = list(self.markers.get(segment.name, {}))
        found = replace(found, radius=found.radius[used])
        return JointFit(
            joint=segment.joint,
            parent=segment.parent,
            child=segment.name,
            markers=tuple(names[i] for i in np.flatnonzero(used)),
            track=self.segments[segment.parent].pose.to_lab(found.centre),
            **{f.name: getattr(found, f.name) for f in fields(CentreFit)},
        )

    def _centre(
        self, segment: Segment, inside: Array, expected: Expected | None, pooled: Pooled | None
    ) -> CentreFit | None:
        assert segment.parent is not None
        if pooled is not None:
            more = len(pooled.markers) - inside.shape[1]
            inside = np.concatenate([inside, np.full((len(inside), more, 3), np.nan)], axis=1)
        own = self.shapes.get(segment.name)
        return fit_centre(
            inside,
            self.sigma,
            max(own[0].sigma if own else 0.0, self.sigma),
            self.frames[segment.parent],
            self.method,
            self.noise.in_frame(self.segments[segment.parent].pose),
            each=self.noise.each,
            expected=expected,
            looseness=segment.looseness,
            shared=self._shared(segment) if expected is not None else None,
            pooled=None if pooled is None else pooled.evidence,
        )

    def _shared(self, segment: Segment) -> SharedPoint | None:
        """The point of a segment's own shape that stays in its parent.

        Not for a ball joint: there it follows the skin's turns about the bone, which a marker's distance
        from the centre does not feel.
        """
        if segment.name not in self.shapes or segment.looseness <= 1 or segment.parent is None:
            return None
        return shared_point(self.segments[segment.parent].pose, self.shapes[segment.name][1])

    def _markers_pose(self, name: str) -> Pose:
        shape, pose = self.shapes[name]
        return shape.triad_pose(self.points[name]) if self.triad else pose

    def _child(self, segment: Segment, joint: JointFit) -> None:
        """The segment's pose by the case that each frame allows (thesis 5.5.1.1 to 5.5.1.3)."""
        points = self.points[segment.name]
        axis = self.segments[joint.parent].pose.rotation @ joint.axis
        if segment.name in self.shapes:
            shape = self.shapes[segment.name][0]
            pose = self._markers_pose(segment.name)
            at = middle(pose.to_segment(joint.track[:, None])[:, 0])
            if not pose.known.all():
                template, weights = np.vstack([shape.template, at]), np.append(shape.weights, 1.0)
                extended = Shape(template, weights, shape.chosen, shape.sigma)
                pose = filled(pose, extended.pose(beside(points, joint.track)))
                if joint.hinge:
                    pose = filled_by_hinge(pose, extended, points, joint.track, axis)
            self._add(segment, pose, Frame(shape), shape, at)
            return
        with_joint = beside(points, joint.track)
        found = find_shape(with_joint) if points.shape[1] >= 2 else None
        if found is not None:
            shape, pose = found
            if self.triad:
                pose = shape.triad_pose(with_joint)
            if joint.hinge:
                pose = filled_by_hinge(pose, shape, points, joint.track, axis)
            frame = Frame(shape)
            if joint.shown == "no":
                doubt = f"the frame of {segment.name} rests on {joint.joint}, which is not known"
                frame = Frame(shape, "weak", doubt)
            self._add(segment, pose, frame, shape, shape.template[-1])
            return
        self._one_marker(segment, joint, points, axis)

    def _one_marker(self, segment: Segment, joint: JointFit, points: Array, axis: Array) -> None:
        """A segment of one marker (or of markers in line with the joint): case 3 throughout."""
        m = int(np.isfinite(points[..., 0]).sum(axis=0).argmax())
        place = np.zeros(3)
        distance = float(median(np.linalg.norm(points[:, m] - joint.track, axis=1)))
        turn_seen = joint.hinge
        if distance < NO_DIRECTION * joint.residual:
            # The line from joint to marker is noise; the parent's turn is the best that is known.
            pose = turned_with(self.segments[joint.parent].pose, points[:, m])
            at = middle(pose.to_segment(joint.track[:, None])[:, 0])
            self.notes.append(
                f"{segment.name} turns with {joint.parent}: its one marker is no farther from "
                f"{joint.joint} than noise"
            )
        else:
            at = np.array([distance, 0.0, 0.0])
            below = self._hinge_below(segment, points[:, m], joint.track)
            if below is not None:
                axis, turn_seen = below, True
            pose = one_marker_pose(
                points[:, m], joint.track, axis, place, at, np.array([0.0, 0.0, 1.0])
            )
        name = list(self.markers[segment.name])[m]
        end = place if segment in self.skeleton.leaves else None
        if pose.known.any():
            self.segments[segment.name] = SegmentFit(segment.name, pose, {name: place}, at, end)
            self.frames[segment.name] = (
                Frame(None, "weak", f"{segment.name} stands on one marker")
                if turn_seen
                else Frame(None, "no", f"the turn of {segment.name} is not seen: one marker")
            )

    def _hinge_below(self, segment: Segment, marker: Array, joint: Array) -> Array | None:
        """The axis (frames, 3) of the hinge at a segment's other end; None where anatomy has none there.

        It is fixed in the segment, and the lower bone shows it, as the segment's own marker cannot.
        """
        if not self.prior:
            return None
        for child in self.skeleton.segments:
            found = hinge_shift(child.priors) if child.parent == segment.name else None
            if found is None or found[0] not in self.markers[segment.name]:
                continue
            ends = [self._track(name) for name in found[1].toward]
            known = [end for end in ends if end is not None]
            if len(known) == len(ends):
                return inward(marker - joint, np.mean(known, axis=0) - marker, found[1], self.size)
        return None

    def _add(
        self, segment: Segment, pose: Pose, frame: Frame, shape: Shape, joint: Array | None
    ) -> None:
        if not pose.known.any():
            self.notes.append(f"{segment.name} has no pose in any frame")
            return
        template = {
            marker: place
            for marker, place in zip(self.markers[segment.name], shape.template, strict=False)
            if np.isfinite(place).all()
        }
        end = None
        if segment in self.skeleton.leaves and segment.parent is not None:
            chosen = [template[m] for m in segment.ends if m in template]
            end = np.mean(chosen or list(template.values()), axis=0)
        # The joint is the last point of a shape that has it.
        names = [*self.markers[segment.name], segment.joint or ""]
        through = tuple(names[i] for i in shape.chosen)
        self.segments[segment.name] = SegmentFit(
            segment.name, pose, template, joint, end, through, shape.sigma
        )
        self.frames[segment.name] = frame

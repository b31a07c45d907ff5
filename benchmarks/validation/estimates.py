"""What every method says of the joints of one subject, from the same points and poses."""

from __future__ import annotations

import inspect
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mocap_skel.clip import Clip
from mocap_skel.errors import MocapSkelError
from mocap_skel.figure.skeleton import Skeleton
from mocap_skel.fit import fit_skeleton
from mocap_skel.joints.joint_fit import JointFit
from mocap_skel.labels.association import Assignment
from mocap_skel.segments.pose import Pose
from mocap_skel.segments.shape import find_shape, median
from mocap_skel.skeleton_fit import SkeletonFit
from validation import published

Array = NDArray[np.float64]
OURS, PURE, ANATOMY = "ours", "pure", "anatomy"
METHODS = (OURS, PURE, ANATOMY, *published.METHODS)


@dataclass(frozen=True, eq=False)
class Frame:
    """A segment's frame: pose, its markers in it, and whether its own markers give it."""

    pose: Pose
    template: dict[str, Array]
    own: bool


class Subject:
    """One subject of a clip, fitted by every method.

    Attributes:
        clip, assignment, skeleton: what was fitted, without the withheld markers.
        fits: "ours" and "pure".
        joints: joint → our fit of it.
        tracks: method → joint → (frames, 3) in the lab, metres; NaN where there is no answer.
    """

    def __init__(self, clip: Clip, assignment: Assignment, skeleton: Skeleton) -> None:
        self.clip, self.assignment, self.skeleton = clip, assignment, skeleton
        self.fits = {OURS: fit_skeleton(clip, assignment, skeleton)}
        self.fits[PURE] = pure(clip, assignment, skeleton) or self.fits[OURS]
        self.joints: dict[str, JointFit] = {j.joint: j for j in self.fits[OURS].joints}
        self._points = self._cleaned()
        self._frames: dict[str, Frame | None] = {}
        self.tracks: dict[str, dict[str, Array]] = {m: {} for m in METHODS}
        for method, fit in self.fits.items():
            for joint in fit.joints:
                self.tracks[method][joint.joint] = joint.track
        for joint in self.joints.values():
            self.tracks[ANATOMY][joint.joint] = self._anatomy(joint)
            for method, track in self.published(joint, slice(None)).items():
                self.tracks[method][joint.joint] = track

    def _anatomy(self, joint: JointFit) -> Array:
        """(frames, 3): the joint by its prior alone."""
        if joint.anatomy is None:
            return np.full((self.clip.frames, 3), np.nan)
        return self.fits[OURS].segments[joint.parent].pose.to_lab(joint.anatomy)

    def _cleaned(self) -> dict[str, Array]:
        """Segment → points (frames, M, 3) without the samples that our fit leaves out as trouble."""
        gone = {(x.segment, x.marker): x.frames for x in self.fits[OURS].left_out}
        points = {}
        for segment, columns in self.assignment.columns.items():
            x = self.clip.points[:, list(columns.values())].copy()
            for m, marker in enumerate(columns):
                if (segment, marker) in gone:
                    x[gone[segment, marker] - self.clip.first_frame, m] = np.nan
            points[segment] = x
        return points

    def frame(self, segment: str) -> Frame | None:
        """The segment's frame from its own markers, from our fit where it has fewer than three."""
        if segment not in self._frames:
            self._frames[segment] = self._own(segment) or self._fitted(segment)
        return self._frames[segment]

    def _own(self, segment: str) -> Frame | None:
        points = self._points.get(segment)
        found = find_shape(points) if points is not None and points.shape[1] >= 3 else None
        if found is None:
            return None
        shape, pose = found
        names = self.assignment.columns[segment]
        template = {m: t for m, t in zip(names, shape.template, strict=True) if np.isfinite(t[0])}
        return Frame(pose, template, True)

    def _fitted(self, segment: str) -> Frame | None:
        found = self.fits[OURS].segments.get(segment)
        return None if found is None else Frame(found.pose, found.template, False)

    def published(self, joint: JointFit, part: slice) -> dict[str, Array]:
        """Method → lab track (frames of the part, 3) from the frames of that part alone."""
        count = len(self.clip.points[part])
        nothing = np.full((count, 3), np.nan)
        out = dict.fromkeys(published.METHODS, nothing)
        parent = self.frame(joint.parent)
        points = self._points.get(joint.child)
        if parent is None or points is None:
            return out
        pose = _part(parent.pose, part)
        inside = pose.to_segment(points[part])
        for name, method in published.SPHERES.items():
            out[name] = pose.to_lab(method(inside))
        child = self.frame(joint.child)
        if child is not None and child.own:
            other = _part(child.pose, part)
            out["SCoRE"] = published.score_track(pose, other, published.score(pose, other))
            point, axis = published.sara(pose, other)
            middle = np.nanmean(
                np.concatenate([inside, self._inside(joint, pose, part)], 1), (0, 1)
            )
            out["SARA"] = pose.to_lab(point + axis * (axis @ (middle - point)))
        if joint.joint.endswith("Hip"):
            side = joint.joint.removesuffix("Hip")
            places = parent.template
            out["Harrington"] = pose.to_lab(published.harrington(places, side))
            out["Hara"] = pose.to_lab(published.hara(places, side, self._leg(side)))
        return out

    def _inside(self, joint: JointFit, pose: Pose, part: slice) -> Array:
        return pose.to_segment(self._points[joint.parent][part])

    def _leg(self, side: str) -> float:
        """Metres from the anterior spine by the knee's marker to the ankle's."""
        letter = side[0]
        points = [self._marker(letter + name) for name in ("FWT", "KNE", "ANK")]
        if any(p is None for p in points):
            return float("nan")
        spine, knee, ankle = (p for p in points if p is not None)
        return float(
            np.nanmedian(np.linalg.norm(spine - knee, axis=1))
            + np.nanmedian(np.linalg.norm(knee - ankle, axis=1))
        )

    def _marker(self, name: str) -> Array | None:
        for segment, columns in self.assignment.columns.items():
            if name in columns:
                return self._points[segment][:, list(columns).index(name)]
        return None

    def constant(self, joint: str, track: Array, part: slice = slice(None)) -> Array:
        """A track's median place (3,) in the parent's frame; NaN without one."""
        frame = self.frame(self.joints[joint].parent)
        if frame is None:
            return published.UNKNOWN
        inside = _part(frame.pose, part).to_segment(track[:, None])[:, 0]
        return median(np.ascontiguousarray(inside.T))

    def half(self, part: slice) -> dict[str, dict[str, Array]]:
        """Method → joint → constant (3,) in the whole clip's frames, from a part of the frames."""
        out: dict[str, dict[str, Array]] = {m: {} for m in METHODS}
        start = part.start or 0
        clip = replace(
            self.clip, points=self.clip.points[part], first_frame=self.clip.first_frame + start
        )
        fits: dict[str, SkeletonFit | None] = {}
        try:
            fits[OURS] = fit_skeleton(clip, self.assignment, self.skeleton)
            fits[PURE] = pure(clip, self.assignment, self.skeleton) or fits[OURS]
        except MocapSkelError:
            fits = {}
        for method, fit in fits.items():
            for one in fit.joints if fit is not None else ():
                out[method][one.joint] = self.constant(one.joint, one.track, part)
        for name, joint in self.joints.items():
            for method, track in self.published(joint, part).items():
                out[method][name] = self.constant(name, track, part)
        return out


def pure(clip: Clip, assignment: Assignment, skeleton: Skeleton) -> SkeletonFit | None:
    """The fit without any prior; None as long as there is no other."""
    if "prior" not in inspect.signature(fit_skeleton).parameters:
        return None
    option: dict[str, Any] = {"prior": "none"}
    return fit_skeleton(clip, assignment, skeleton, **option)


def _part(pose: Pose, part: slice) -> Pose:
    return Pose(pose.rotation[part], pose.origin[part])

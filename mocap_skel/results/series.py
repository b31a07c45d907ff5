"""A fit over time, as numbers: marker tracks, distances to a joint's centre, bone lengths. Metres."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from mocap_skel.clip import Clip
from mocap_skel.joints.joint_fit import JointFit
from mocap_skel.labels.association import Assignment
from mocap_skel.segments.pose import Array
from mocap_skel.skeleton_fit import SkeletonFit

# Segment → marker → its track (frames, 3).
Tracks = Mapping[str, Mapping[str, Array]]

_SIDE = re.compile("left|right", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Radial:
    """The markers around one joint, seen from its centre in the frame of its parent segment.

    Attributes:
        joint: the fit.
        errors: (frames, M) each marker's distance from the centre, less its own mean distance; NaN where it is missing, was left out, or the parent has no pose. Their root
            mean square is `JointFit.residual`.
        directions: (frames, M, 3) unit vectors from the centre to the markers, in the parent's frame.
    """

    joint: JointFit
    errors: Array
    directions: Array


@dataclass(frozen=True, eq=False)
class Bone:
    """The distance between two neighbouring joints, or from a leaf's joint to the leaf's end point.

    Attributes:
        segment: the segment that both are on.
        start, end: names of the two, as skeleton.csv has them.
        length: (frames,), NaN = missing.
    """

    segment: str
    start: str
    end: str
    length: Array

    @property
    def median(self) -> float:
        """The median of the lengths, metres; NaN for a bone that is never seen."""
        seen = self.length[np.isfinite(self.length)]
        return float(np.median(seen)) if len(seen) else float("nan")


def marker_tracks(clip: Clip, assignment: Assignment, fit: SkeletonFit) -> Tracks:
    """The tracks of one subject's markers as the fit used them.

    Args:
        clip: the recording.
        assignment: which of its columns is which marker.
        fit: what came of both.

    Returns:
        Segment → marker → track (frames, 3); NaN where the marker is missing or was left out.
    """
    points = clip.points
    columns = assignment.columns
    if fit.left_out:
        points = points.copy()
        for left in fit.left_out:
            column = columns[left.segment][left.marker]
            points[left.frames - clip.first_frame, column] = np.nan
    return {
        segment: {marker: points[:, column] for marker, column in markers.items()}
        for segment, markers in columns.items()
    }


def radial(fit: SkeletonFit, markers: Tracks) -> tuple[Radial, ...]:
    """The markers around each fitted joint that has markers, in the skeleton's order.

    Args:
        fit: of one subject.
        markers: its `marker_tracks`.
    """
    return tuple(_radial(fit, joint, markers[joint.child]) for joint in fit.joints if joint.markers)


def _radial(fit: SkeletonFit, joint: JointFit, markers: Mapping[str, Array]) -> Radial:
    points = np.stack([markers[name] for name in joint.markers], axis=1)
    inside = fit.segments[joint.parent].pose.to_segment(points)
    distance = np.linalg.norm(inside - joint.centre, axis=-1)
    seen = np.isfinite(distance)
    mean = np.where(seen, distance, 0.0).sum(axis=0) / np.maximum(seen.sum(axis=0), 1)
    away = inside - joint.centre
    with np.errstate(invalid="ignore", divide="ignore"):
        directions = away / np.linalg.norm(away, axis=-1, keepdims=True)
    return Radial(joint, distance - mean, directions)


def bones(fit: SkeletonFit) -> tuple[Bone, ...]:
    """The lengths of all bones in every frame, parents first.

    The root is left out: all its joints are constant in its own frame, so their distances never vary. In the other
    segments only the joint at the end is constant; the length varies as the joint at the start wanders.
    """
    tracks = dict(fit.tracks())
    found = []
    for segment in fit.skeleton.segments:
        # What hangs on a segment that is not in the clip has no track.
        if segment.joint not in tracks:
            continue
        ends = [s.joint for s in fit.skeleton.segments if s.parent == segment.name and s.joint]
        for end in (end for end in ends or [segment.name] if end in tracks):
            length = np.linalg.norm(tracks[end] - tracks[segment.joint], axis=1)
            found.append(Bone(segment.name, segment.joint, end, length))
    return tuple(found)


def side(name: str) -> str:
    """The side that a name tells: "left", "right", or "" for neither.

    >>> side("UpperRightLeg"), side("Neck")
    ('right', '')
    """
    found = _SIDE.search(name)
    return found[0].lower() if found else ""


def sideless(name: str) -> str:
    """A name without its side: what the left and the right one share.

    >>> sideless("RightKnee"), sideless("left_hip"), sideless("Neck")
    ('Knee', 'hip', 'Neck')
    """
    return _SIDE.sub("", name).strip("_- ") or name


def by_sides(names: Iterable[str]) -> dict[str, list[int]]:
    """Group names that differ in their side only: name without its side → indices of the names.

    >>> by_sides(["Neck", "RightHip", "LeftHip"])
    {'Neck': [0], 'Hip': [1, 2]}
    """
    groups: dict[str, list[int]] = {}
    for i, name in enumerate(names):
        groups.setdefault(sideless(name), []).append(i)
    return groups


def best_frame(fits: Iterable[tuple[SkeletonFit, Tracks]]) -> int:
    """The frame in which most joints and markers are seen, counted from 0.

    Where several frames are equally good it is the one nearest to the middle of the clip.

    Args:
        fits: each subject's fit with its `marker_tracks`.
    """
    seen: Array | None = None
    for fit, markers in fits:
        tracks = [joint.track for joint in fit.joints]
        tracks += [track for own in markers.values() for track in own.values()]
        count = np.isfinite(np.stack(tracks)[..., 0]).sum(axis=0)
        seen = count if seen is None else seen + count
    assert seen is not None, "no fit, no frame"
    most = np.flatnonzero(seen == seen.max())
    return int(most[np.abs(most - (len(seen) - 1) / 2).argmin()])

"""The rigid motion as a fit again, so that every table and format can hold it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mocap_skel.figure.skeleton import Segment, Skeleton
from mocap_skel.joints.joint_fit import PRIOR, JointFit, unfitted
from mocap_skel.rig.model import Model
from mocap_skel.rig.motion import RigidMotion
from mocap_skel.segments.pose import Array, Pose
from mocap_skel.skeleton_fit import SegmentFit, SkeletonFit

ADDED = "placed by anatomy for the full rig; no marker shows it"


def rigid_fit(fit: SkeletonFit, motion: RigidMotion) -> SkeletonFit:
    """A fit whose tracks and poses are those of its rigid figure: constant bones, gaps bridged.

    Joint centres and their evidence stay those of the closed-form fit, of which the bones are made. What is
    absent in the motion is NaN; segments that are not in the figure have no pose. Joints that a full rig adds have no
    evidence, and a standard error of NaN.
    """
    model, absent = motion.model, motion.absent
    places = motion.poses.joints(model.bones).transpose(1, 2, 0)
    segments: dict[str, SegmentFit] = {}
    tracks = {}
    for s, segment in enumerate(model.segments):
        turn = motion.poses.turn[:, :, s].transpose(2, 0, 1).copy()
        turn[absent[s]] = np.nan
        pose = Pose(turn, places[s] - turn @ model.joints[s])
        end = model.joints[s] + model.ends[s] if s in model.ends else None
        if segment.name in fit.segments:
            own = fit.segments[segment.name]
            joint = own.joint if segment.parent is None else model.joints[s]
            # Ends of the figure's own leaves stay where the fit has them.
            end = None if end is None else own.end
            segments[segment.name] = replace(own, pose=pose, joint=joint, end=end)
        else:
            segments[segment.name] = SegmentFit(segment.name, pose, {}, model.joints[s], end)
        # A joint is where either of its segments has it.
        unknown = absent[s] & absent[model.bones.parents[s]]
        tracks[segment.joint] = np.where(unknown[:, None], np.nan, places[s])
    skeleton = _skeleton(fit.skeleton, model)
    known = {joint.joint: joint for joint in fit.joints}
    joints = []
    for segment in skeleton.segments:
        if segment.joint is None or segment.parent is None:
            continue
        track, joint = tracks.get(segment.joint), known.get(segment.joint)
        if joint is None:
            joints.append(_added(model, segment, tracks[segment.joint]))
            continue
        if track is None:
            above = segments.get(joint.parent)
            track = (
                np.full_like(joint.track, np.nan)
                if above is None
                else above.pose.to_lab(joint.centre)
            )
        joint = replace(joint, child=segment.name, track=track)
        if segment.parent != joint.parent:
            # The axes are those of the old parent, counted from another place.
            moved = _centre(model, segment.name) - joint.centre
            joint = replace(
                joint,
                parent=segment.parent,
                centre=joint.centre + moved,
                motion=joint.motion + moved,
            )
        joints.append(joint)
    ordered = {s.name: segments[s.name] for s in skeleton.segments if s.name in segments}
    return replace(fit, skeleton=skeleton, segments=ordered, joints=tuple(joints))


def _skeleton(plain: Skeleton, model: Model) -> Skeleton:
    """The skeleton with the segments that a full rig adds, each before its first child, toes behind their feet."""
    if not model.added:
        return plain
    there = {segment.name: segment for segment in model.segments}
    found: dict[str, Segment] = {}
    for segment in plain.segments:
        own = there.get(segment.name, segment)
        above, parent = [], own.parent
        while parent in model.added:
            above.append(there[parent])
            parent = there[parent].parent
        for one in (*reversed(above), own):
            found.setdefault(one.name, one)
        for one in model.segments:
            if one.parent == own.name and one.name in model.added and _leaf(model, one.name):
                found[one.name] = one
    return replace(plain, segments=tuple(found.values()))


def _leaf(model: Model, name: str) -> bool:
    return not any(segment.parent == name for segment in model.segments)


def _centre(model: Model, name: str) -> Array:
    """(3,): a segment's joint in the axes of its parent's closed-form pose."""
    s = [segment.name for segment in model.segments].index(name)
    return np.asarray(model.joints[model.bones.parents[s]] + model.bones.offsets[s])


def _added(model: Model, segment: Segment, track: Array) -> JointFit:
    nothing = unfitted(segment.joint or "", segment.parent or "", segment.name, len(track), ADDED)
    centre = _centre(model, segment.name)
    return replace(nothing, centre=centre, method=PRIOR, share=0.0, track=track)

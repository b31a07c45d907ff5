"""The rigid motion as a fit again, so that every table and format can hold it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mocap_skel.rig.model import joint_of
from mocap_skel.rig.motion import RigidMotion
from mocap_skel.segments.pose import Pose
from mocap_skel.skeleton_fit import SegmentFit, SkeletonFit


def rigid_fit(fit: SkeletonFit, motion: RigidMotion) -> SkeletonFit:
    """A fit whose tracks and poses are those of its rigid figure: constant bones, gaps bridged.

    Joint centres and their evidence stay those of the closed-form fit, of which the bones are made. What is
    absent in the motion is NaN; segments that are not in the figure have no pose.
    """
    bones, absent = motion.model.bones, motion.absent
    places = motion.poses.joints(bones).transpose(1, 2, 0)
    segments: dict[str, SegmentFit] = {}
    for s, segment in enumerate(motion.model.segments):
        own = fit.segments[segment.name]
        turn = motion.poses.turn[:, :, s].transpose(2, 0, 1).copy()
        turn[absent[s]] = np.nan
        segments[segment.name] = replace(own, pose=Pose(turn, places[s] - turn @ joint_of(own)))
    tracks = {}
    for s, segment in enumerate(motion.model.segments):
        # A joint is where either of its segments has it.
        unknown = absent[s] & absent[bones.parents[s]]
        tracks[segment.name] = np.where(unknown[:, None], np.nan, places[s])
    joints = []
    for joint in fit.joints:
        track = tracks.get(joint.child)
        if track is None:
            above = segments.get(joint.parent)
            track = (
                np.full_like(joint.track, np.nan)
                if above is None
                else above.pose.to_lab(joint.centre)
            )
        joints.append(replace(joint, track=track))
    ordered = {name: segments[name] for name in fit.segments if name in segments}
    return replace(fit, segments=ordered, joints=tuple(joints))

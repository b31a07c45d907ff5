"""The result of a fit: a skeleton that moves through a clip. All that comes after a fit reads this."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mocap_skel.figure.skeleton import Skeleton
from mocap_skel.joints.joint_fit import JointFit
from mocap_skel.joints.segment_pose import Placed
from mocap_skel.segments.left_out import LeftOut
from mocap_skel.segments.pose import Array, Pose
from mocap_skel.segments.prepare import Prepared


@dataclass(frozen=True, eq=False)
class SegmentFit:
    """One segment: its pose in every frame, and the points that are constant in it. Metres.

    Attributes:
        name: the segment.
        pose: NaN in frames that do not determine it.
        template: markers in the segment's own coordinates, name → (3,).
        joint: (3,) the joint towards the parent in the segment's own coordinates; None for the root.
        end: (3,) the end point of a leaf in the segment's own coordinates; None for the others.
        drawn_through: names of the three points that give its axes; empty for a segment of one marker.
        rigid: standard deviation of its markers about the template, metres, skin included.
        points: (frames, M, 3) the markers of the template in the lab, in its order; NaN = missing or left out.
            None for a fit that was not made from a clip.
    """

    name: str
    pose: Pose
    template: dict[str, Array]
    joint: Array | None
    end: Array | None
    drawn_through: tuple[str, ...] = ()
    rigid: float = 0.0
    points: Array | None = None


def segment_fit(found: Placed, skeleton: Skeleton, prepared: Prepared) -> SegmentFit:
    """A segment as the result has it: a leaf has an end point, the mean of its end markers."""
    segment, template = found.segment, found.template
    end = None
    if segment in skeleton.leaves and segment.parent is not None:
        chosen = [template[m] for m in segment.ends if m in template]
        end = np.mean(chosen or list(template.values()), axis=0)
    names, points = prepared.markers(segment.name), prepared.of(segment.name)
    if names != tuple(template):
        points = points[:, [names.index(m) for m in template]]
    return SegmentFit(
        name=segment.name,
        pose=found.pose,
        template=template,
        joint=found.posed.joint,
        end=end,
        drawn_through=found.drawn_through,
        rigid=found.rigid,
        points=points,
    )


@dataclass(frozen=True, eq=False)
class SkeletonFit:
    """A skeleton moving through a clip. Metres, in the clip's own axes.

    Attributes:
        clip: the clip's name.
        subject: "" where the clip has no subjects.
        skeleton: the figure.
        frame_numbers: (frames,), the file's own.
        rate: frames a second.
        up: the clip's vertical axis.
        sigma: noise standard deviation of a marker, given or estimated.
        segments: the segments with a pose, parents first.
        joints: one a joint of the skeleton, in its order; `JointFit.fitted` tells which could be fitted, and
            `JointFit.shown` what the movement shows of it.
        notes: what was decided and what is missing, one sentence each.
        left_out: markers with samples that are left out because the marker was somewhere else.
        zero_frame: the number that a frame at time 0 has, as in the clip.

    >>> from mocap_skel import associate, fit_skeleton, read_association, read_clip
    >>> clip, association = read_clip("sample_data/range_of_motion.c3d"), read_association("cmu")
    >>> (subject,) = associate(clip, association)
    >>> fit = fit_skeleton(clip, subject, association.skeleton)
    >>> [(joint.joint, joint.shown) for joint in fit.joints[:2]]
    [('Waist', 'yes'), ('Neck', 'yes')]
    >>> dict(fit.tracks())["Neck"].shape
    (1380, 3)
    """

    clip: str
    subject: str
    skeleton: Skeleton
    frame_numbers: NDArray[np.int64]
    rate: float
    up: str
    sigma: float
    segments: dict[str, SegmentFit]
    joints: tuple[JointFit, ...]
    notes: tuple[str, ...]
    left_out: tuple[LeftOut, ...] = ()
    zero_frame: float = 1

    @property
    def time(self) -> Array:
        """(frames,) seconds as the clip's file counts them, also in a clip that was cut out of a longer take.

        Since frame 1 in a C3D, and since frame 0 in a take of Motive.
        """
        return np.asarray((self.frame_numbers - self.zero_frame) / self.rate)

    def tracks(self) -> Iterator[tuple[str, Array]]:
        """Name and lab track (frames, 3) of every joint, of the root's origin, of each leaf's end point.

        Metres, NaN where nothing is seen. A leaf is a segment from which no other hangs.
        """
        for joint in self.joints:
            yield joint.joint, joint.track
        for segment in dict.fromkeys((self.skeleton.root, *self.skeleton.leaves)):
            found = self.segments.get(segment.name)
            if found is None:
                yield segment.name, np.full((len(self.frame_numbers), 3), np.nan)
            elif segment.parent is None:
                yield segment.name, found.pose.origin
            elif found.end is not None:
                yield segment.name, found.pose.to_lab(found.end)

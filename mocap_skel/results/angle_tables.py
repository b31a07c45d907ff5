"""Joint angles as rows and columns: of angles.csv, of Parquet, of pandas, and of the table of joints."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mocap_skel.angles.joint_angles import Angles, joint_angles
from mocap_skel.segments.pose import Array, Pose
from mocap_skel.skeleton_fit import SkeletonFit

if TYPE_CHECKING:
    import pandas

# Frames that the errors in the table of joints are the median of: they hardly change from frame to frame.
FRAMES = 100


def angle_columns(angles: Angles) -> tuple[list[str], Array]:
    """The columns of angles.csv behind frame and time.

    Returns:
        Their names (Hips_rotation, LeftKnee_flexion ...) and their values (frames, columns), degrees; NaN = missing.
    """
    names = [title for joint in angles.joints for title in joint.rule.titles]
    if not names:
        return [], np.empty((len(angles.time), 0))
    return names, np.hstack([joint.degrees for joint in angles.joints])


def long_angle_columns(fit: SkeletonFit, angles: Angles) -> dict[str, NDArray[Any]]:
    """The angles in long form: one row for each angle in each frame, frame by frame.

    Columns: clip, subject, frame, time (s), joint, angle, degrees, standard_error (degrees); NaN = missing.
    """
    frames = len(angles.time)
    parts = [(joint.rule.name, part) for joint in angles.joints for part in joint.rule.parts]
    names, values = angle_columns(angles)
    errors = [joint.standard_error for joint in angles.joints]
    return {
        "clip": np.full(frames * len(names), fit.clip, dtype=object),
        "subject": np.full(frames * len(names), fit.subject, dtype=object),
        "frame": np.repeat(angles.frame_numbers, len(names)),
        "time": np.repeat(angles.time, len(names)),
        "joint": np.tile(np.array([joint for joint, _ in parts], dtype=object), frames),
        "angle": np.tile(np.array([part for _, part in parts], dtype=object), frames),
        "degrees": values.ravel(),
        "standard_error": np.hstack(errors).ravel() if errors else np.empty(0),
    }


def angles_table(fit: SkeletonFit, static: SkeletonFit | None = None) -> pandas.DataFrame:
    """The joint angles as a DataFrame, one row a frame.

    The index is `frame`; the columns are `time` in seconds and those of angles.csv in degrees.

    Args:
        fit: of one subject.
        static: the fit of a static clip, whose mean pose is neutral.

    >>> from mocap_skel import associate, fit_skeleton, read_association, read_clip
    >>> clip, association = read_clip("sample_data/nearly_still.c3d"), read_association("cmu")
    >>> fit = fit_skeleton(clip, associate(clip, association)[0], association.skeleton)
    >>> angles_table(fit).shape, angles_table(fit).columns[1]
    ((300, 49), 'Hips_rotation')
    """
    import pandas

    angles = joint_angles(fit, static)
    names, values = angle_columns(angles)
    table = pandas.DataFrame(values, columns=names)
    table.insert(0, "time", angles.time)
    table.index = pandas.Index(angles.frame_numbers, name="frame")
    return table


def angle_errors(fit: SkeletonFit) -> dict[str, dict[str, float]]:
    """Joint → angle → its typical standard error in degrees, of the angles that have one."""
    step = max(1, len(fit.frame_numbers) // FRAMES)
    segments = {
        name: replace(s, pose=Pose(s.pose.rotation[::step], s.pose.origin[::step]))
        for name, s in fit.segments.items()
    }
    angles = joint_angles(replace(fit, segments=segments, frame_numbers=fit.frame_numbers[::step]))
    return {
        joint.rule.name: {
            part: error
            for part, error in zip(joint.rule.parts, joint.typical_error.tolist(), strict=True)
            if np.isfinite(error)
        }
        for joint in angles.joints
    }

"""A fit as rows and columns, the one source of every table: CSV, JSON, terminal, pandas."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mocap_skel.joints.joint_fit import JointFit
from mocap_skel.results.angle_tables import angle_errors
from mocap_skel.results.series import bones, by_sides
from mocap_skel.segments.pose import Array
from mocap_skel.skeleton_fit import SkeletonFit

if TYPE_CHECKING:
    import pandas

# What a line of JSON that is about a joint says of itself: other lines are about other things.
JOINT_TABLE = "joints"


def track_columns(fit: SkeletonFit) -> tuple[list[str], Array]:
    """The columns of skeleton.csv behind frame and time.

    Returns:
        Their names (Waist_x, Waist_y ...) and their values (frames, columns), metres; NaN = missing.
    """
    names, tracks = zip(*fit.tracks(), strict=True)
    return [f"{name}_{axis}" for name in names for axis in "xyz"], np.hstack(tracks)


def track_kinds(fit: SkeletonFit) -> Iterator[tuple[str, str, Array]]:
    """Name, kind and track (frames, 3) of each of `fit.tracks()`.

    The kind is "joint", "origin" for the root's origin, or "end" for a leaf's end point.
    """
    for place, (name, track) in enumerate(fit.tracks()):
        own = "origin" if name == fit.skeleton.root.name else "end"
        yield name, "joint" if place < len(fit.joints) else own, track


def axis_ends(fit: SkeletonFit, joint: JointFit, length: float) -> tuple[Array, Array] | None:
    """Tracks (frames, 3) of the two ends of a joint's axis in the lab; None where the clip shows none.

    Args:
        fit: the figure.
        joint: one of its.
        length: metres from the joint to each end; the second one is where the axis points to.
    """
    parent = fit.segments.get(joint.parent)
    if joint.turns_on is None or parent is None:
        return None
    way = length * (parent.pose.rotation @ joint.turns_on.direction)
    return joint.track - way, joint.track + way


def point_columns(fit: SkeletonFit) -> dict[str, NDArray[Any]]:
    """The moving skeleton in long form: one row for each point in each frame, frame by frame.

    Columns: clip, subject, frame, time (s), point, kind (as `track_kinds`), x, y, z (m, NaN = missing).
    """
    names, kinds, tracks = zip(*track_kinds(fit), strict=True)
    frames, points = len(fit.frame_numbers), len(names)
    x, y, z = np.stack(tracks, axis=1).reshape(-1, 3).T
    return {
        "clip": np.full(frames * points, fit.clip, dtype=object),
        "subject": np.full(frames * points, fit.subject, dtype=object),
        "frame": np.repeat(fit.frame_numbers, points),
        "time": np.repeat(fit.time, points),
        "point": np.tile(np.array(names, dtype=object), frames),
        "kind": np.tile(np.array(kinds, dtype=object), frames),
        "x": x,
        "y": y,
        "z": z,
    }


# `determined` is the old name of `shown`: it has the same value, stays for one release, and goes then.
JOINT_COLUMNS = (
    "joint", "parent", "child", "x", "y", "z", "se_x", "se_y", "se_z", "markers", "samples",
    "effective_samples", "radius", "residual", "sigma", "weakest_sd", "theta_deg", "shown", "method",
    "reason", "from_motion", "prior", "bone", "bone_sd", "side_difference", "determined",
    "axis_x", "axis_y", "axis_z", "axis_se_deg",
    "angles", "angles_se_deg",
)  # fmt: skip


def joint_rows(fit: SkeletonFit, *, angles: bool = True) -> list[dict[str, Any]]:
    """The rows of joints.csv: one a joint, with the evidence for it.

    Args:
        fit: of one subject.
        angles: whether `angles` and `angles_se_deg` are found, which takes longer than all the rest; else they are empty.

    Returns:
        `JOINT_COLUMNS` → value. Lengths are metres, the angle is in degrees; None = there is no value. `bone` is the
        median distance from the parent segment's own joint, `bone_sd` its standard deviation over the clip, and
        `side_difference` how much longer it is than on the other side, as a share of the mean of both. `axis_x`, `axis_y` and `axis_z` are the
        axis on which both segments turn, in the parent's frame, to the side about which a right-handed turn bends
        the joint; `axis_se_deg` is its standard error in the worst direction. They are None for a ball, and where no
        axis is shown.
        `angles` are the names of the joint's angles that are seen, and `angles_se_deg` how far the errors of joint
        centres and landmarks turn them.
    """
    lengths = {bone.end: bone for bone in bones(fit)} if fit.joints else {}
    medians = [lengths[j.joint].median if j.joint in lengths else np.nan for j in fit.joints]
    names = [joint.joint for joint in fit.joints]
    difference = np.full(len(names), np.nan)
    for places in by_sides(names).values():
        if len(places) == 2:
            here, there = (medians[i] for i in places)
            difference[places] = np.array([here - there, there - here]) / (0.5 * (here + there))
    errors = angle_errors(fit) if angles and fit.joints else {}
    rows = []
    for joint, median, other in zip(fit.joints, medians, difference, strict=True):
        length = lengths[joint.joint].length if joint.joint in lengths else np.empty(0)
        seen = length[np.isfinite(length)]
        spread = float(seen.std()) if len(seen) else np.nan
        rows.append(_joint_row(joint, (median, spread, other), errors.get(joint.joint)))
    return rows


def joint_row(joint: JointFit) -> dict[str, Any]:
    """The row of one joint without its skeleton: its bone's columns are None, and those of its angles empty."""
    return _joint_row(joint, (np.nan, np.nan, np.nan), None)


def _joint_row(
    joint: JointFit, bone: tuple[float, float, float], errors: Mapping[str, float] | None
) -> dict[str, Any]:
    prior = " ".join(joint.landmarks) + (f" ({joint.source})" if joint.source else "")
    x, y, z = map(_number, joint.centre)
    se_x, se_y, se_z = map(_number, joint.standard_error)
    values = (
        joint.joint, joint.parent, joint.child, x, y, z, se_x, se_y, se_z, list(joint.markers),
        joint.samples, _number(joint.effective, 1), [_number(r) for r in joint.radius],
        _number(joint.residual), _number(joint.sigma), _number(joint.weakest_sd),
        _number(np.degrees(joint.angle), 2), joint.shown, joint.method, joint.reason,
        _number(joint.share, 3), prior, *(_number(value) for value in bone), joint.shown,
        *_axis_cells(joint),
        list(errors or ()), [_number(value, 2) for value in (errors or {}).values()],
    )  # fmt: skip
    return dict(zip(JOINT_COLUMNS, values, strict=True))


def _axis_cells(joint: JointFit) -> tuple[float | None, ...]:
    axis = joint.turns_on
    if axis is None:
        return (None,) * 4
    x, y, z = (_number(value, 4) for value in axis.direction)
    return x, y, z, _number(np.degrees(axis.standard_error), 2)


def _number(value: float, digits: int = 6) -> float | None:
    # Adding zero turns -0.0 into 0.0.
    return round(float(value), digits) + 0.0 if np.isfinite(value) else None


def tracks_table(fit: SkeletonFit) -> pandas.DataFrame:
    """The moving skeleton as a DataFrame, one row a frame.

    The index is `frame`; the columns are `time` in seconds and those of skeleton.csv in metres.

    >>> from mocap_skel import associate, fit_skeleton, read_association, read_clip
    >>> clip, association = read_clip("sample_data/nearly_still.c3d"), read_association("cmu")
    >>> fit = fit_skeleton(clip, associate(clip, association)[0], association.skeleton)
    >>> table = tracks_table(fit)
    >>> table.shape, list(table.columns[:4])
    ((300, 61), ['time', 'Waist_x', 'Waist_y', 'Waist_z'])
    """
    import pandas

    names, values = track_columns(fit)
    table = pandas.DataFrame(values, columns=names)
    table.insert(0, "time", fit.time)
    table.index = pandas.Index(fit.frame_numbers, name="frame")
    return table


def points_table(fit: SkeletonFit) -> pandas.DataFrame:
    """The moving skeleton as a DataFrame in long form: one row for each point in each frame.

    The columns are those of `point_columns`; the text columns repeat for every row.

    >>> from mocap_skel import associate, fit_skeleton, read_association, read_clip
    >>> clip, association = read_clip("sample_data/nearly_still.c3d"), read_association("cmu")
    >>> fit = fit_skeleton(clip, associate(clip, association)[0], association.skeleton)
    >>> table = points_table(fit)
    >>> len(table) == 300 * table["point"].nunique()
    True
    """
    import pandas

    return pandas.DataFrame(point_columns(fit))


def joints_table(fit: SkeletonFit) -> pandas.DataFrame:
    """The joints as a DataFrame, one row a joint, with the evidence for each.

    The index is `joint`; the columns are those of `joint_rows`.

    >>> from mocap_skel import associate, fit_skeleton, read_association, read_clip
    >>> clip, association = read_clip("sample_data/nearly_still.c3d"), read_association("cmu")
    >>> fit = fit_skeleton(clip, associate(clip, association)[0], association.skeleton)
    >>> joints_table(fit).loc["LeftKnee", ["shown", "reason"]].to_list()
    ['no', 'hardly moves']
    """
    import pandas

    rows = joint_rows(fit)
    return pandas.DataFrame(rows, columns=list(JOINT_COLUMNS)).set_index("joint")

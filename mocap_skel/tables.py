"""A fit as rows and columns, the one source of every table: CSV, JSON, terminal, pandas."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mocap_skel.fit import SkeletonFit
from mocap_skel.joint import JointFit
from mocap_skel.pose import Array

if TYPE_CHECKING:
    import pandas


def track_columns(fit: SkeletonFit) -> tuple[list[str], Array]:
    """Column names and values (frames, columns) of skeleton.csv behind frame and time; NaN = missing."""
    names, tracks = zip(*fit.tracks(), strict=True)
    return [f"{name}_{axis}" for name in names for axis in "xyz"], np.hstack(tracks)


JOINT_COLUMNS = (
    "joint", "parent", "child", "x", "y", "z", "se_x", "se_y", "se_z", "markers", "samples",
    "effective_samples", "radius", "residual", "sigma", "weakest_sd", "theta_deg", "determined",
    "method", "reason",
)  # fmt: skip


def joint_row(joint: JointFit) -> dict[str, Any]:
    """One row of joints.csv: lengths in metres, the angle in degrees; None where nothing is known."""
    x, y, z = map(_number, joint.centre)
    se_x, se_y, se_z = map(_number, joint.standard_error)
    values = (
        joint.joint, joint.parent, joint.child, x, y, z, se_x, se_y, se_z, list(joint.markers),
        joint.samples, _number(joint.effective, 1), [_number(r) for r in joint.radius],
        _number(joint.residual), _number(joint.sigma), _number(joint.weakest_sd),
        _number(np.degrees(joint.angle), 2), joint.determined, joint.method, joint.reason,
    )  # fmt: skip
    return dict(zip(JOINT_COLUMNS, values, strict=True))


def _number(value: float, digits: int = 6) -> float | None:
    # Adding zero turns -0.0 into 0.0.
    return round(float(value), digits) + 0.0 if np.isfinite(value) else None


def tracks_table(fit: SkeletonFit) -> pandas.DataFrame:
    """The moving skeleton as a DataFrame: `frame` as index, `time`, then the columns of skeleton.csv."""
    import pandas

    names, values = track_columns(fit)
    table = pandas.DataFrame(values, columns=names)
    table.insert(0, "time", fit.time)
    table.index = pandas.Index(fit.frame_numbers, name="frame")
    return table


def joints_table(fit: SkeletonFit) -> pandas.DataFrame:
    """The joints as a DataFrame: one row a joint, `joint` as index, the columns of joints.csv."""
    import pandas

    rows = [joint_row(joint) for joint in fit.joints]
    return pandas.DataFrame(rows, columns=list(JOINT_COLUMNS)).set_index("joint")

"""The error of a joint's centre as an ellipsoid, which the page and the pictures draw."""

from __future__ import annotations

import numpy as np

from mocap_skel.joints.joint_fit import JointFit
from mocap_skel.segments.pose import Array

# Standard errors that a semi-axis is long.
ERRORS = 2.0


def ellipsoid(joint: JointFit) -> tuple[Array, Array] | None:
    """The ellipsoid of two standard errors around a joint's centre.

    Returns:
        Its axes (3, 3) as columns, right-handed, in the parent's frame, and its semi-axes (3,) in metres. None
        for a joint that was not fitted, or whose error is not known.
    """
    if not joint.fitted or not np.isfinite(joint.covariance).all():
        return None
    values, vectors = np.linalg.eigh(joint.covariance)
    if np.linalg.det(vectors) < 0:
        vectors = -vectors
    return np.asarray(vectors), ERRORS * np.sqrt(np.maximum(values, 0.0))

"""How well a joint's centre is known, as the ellipsoid that pictures draw about it."""

from __future__ import annotations

import numpy as np

from mocap_skel.joints.joint_fit import JointFit
from mocap_skel.segments.pose import Array

# Standard errors that a semi-axis is long.
ERRORS = 2.0


def ellipsoid(joint: JointFit) -> tuple[Array, Array] | None:
    """The axes (3, 3), columns, right-handed, in the parent's frame, and the semi-axes (3,) in metres.

    None where the joint was not fitted or nothing is known of its errors.
    """
    if not joint.fitted or not np.isfinite(joint.covariance).all():
        return None
    values, vectors = np.linalg.eigh(joint.covariance)
    if np.linalg.det(vectors) < 0:
        vectors = -vectors
    return np.asarray(vectors), ERRORS * np.sqrt(np.maximum(values, 0.0))

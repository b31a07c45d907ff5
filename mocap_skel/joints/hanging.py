"""Which way is inward at the hinge of a limb that hangs: told by the trunk, and the less the farther it is from hanging."""

from __future__ import annotations

import numpy as np

from mocap_skel.figure.prior_tables import Shift
from mocap_skel.joints.twist import about
from mocap_skel.segments.pose import Array

# Radians: how far a limb is taken to be raised where nothing shows what is down, halfway to level.
RAISED = np.pi / 4


def inward_of_hanging(
    shift: Shift, line: Array, bone: Array | None, below: Array, down: Array | None
) -> tuple[Array, float] | None:
    """The way inward by a line across the trunk, and how far it may be off.

    A limb that leaves the posture in which its turn is known may turn about its length by as much as it leaves it: the
    angle by which the bone is raised, and that by which the limb is bent, add to the error.

    Args:
        shift: the step inward: `inside`, `turned`, `hinge`, and whether it has `hanging`.
        line: (frames, 3) across the trunk, in the parent's frame, NaN = missing.
        bone: (3,) from the upper joint to the landmark beside the hinge; None where there is no joint.
        below: (frames, 3) from there to the far end of the child.
        down: (frames, 3) along the trunk; None where nobody sees it.

    Returns:
        (3,), the mean over the frames, not longer than 1; and its standard deviation in each direction, radians. None
        where no frame shows it.

    A right arm that hangs and is turned inward by 38 degrees, x forward, y to the left, z up:

    >>> step = Shift(hinge=-1, by=0.04, toward=("RWRA",), turned=0.25, inside=0.66, hanging=("C7", "T10"))
    >>> to_the_left, down = np.array([[0.0, 1.0, 0.0]]), np.array([[0.0, 0.0, -1.0]])
    >>> inward, error = inward_of_hanging(step, to_the_left, down[0], down, down)
    >>> inward.round(2) + 0.0, error
    (array([-0.61,  0.79,  0.  ]), 0.25)
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        line = line / np.linalg.norm(line, axis=1, keepdims=True)
    if not shift.hanging or bone is None:
        seen = np.isfinite(line[:, 0])
        return (line[seen].mean(axis=0), shift.turned) if seen.any() else None
    bone = bone / np.linalg.norm(bone)
    line = line @ about(bone, np.array([shift.hinge * shift.inside]))[0].T
    raised = np.full(len(line), RAISED) if down is None else _angle(down, bone)
    left = raised**2 + _angle(below, bone) ** 2
    seen = np.isfinite(line[:, 0]) & np.isfinite(left)
    if not seen.any():
        return None
    error = float(np.sqrt(shift.turned**2 + left[seen].mean()))
    return line[seen].mean(axis=0), error


def _angle(directions: Array, bone: Array) -> Array:
    """(frames,): between directions (frames, 3) and a unit vector (3,), radians."""
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = directions @ bone / np.linalg.norm(directions, axis=1)
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))

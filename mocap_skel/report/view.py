"""Where a figure is looked at from: parallel projection along directions that the figure itself gives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mocap_skel.clip import AXES
from mocap_skel.results.series import by_sides, side
from mocap_skel.segments.pose import Array
from mocap_skel.skeleton_fit import SkeletonFit

VIEWS = ("oblique", "front", "side", "top")
# Degrees to the right of the figure's front, and above the floor.
_TURN, _RISE = 35.0, 15.0
# Mean of unit vectors below which figures look in so many directions that none is the front.
_SCATTERED = 0.3


@dataclass(frozen=True, eq=False)
class View:
    """A parallel projection.

    Attributes:
        axes: (3, 3), rows: the picture's right, its up, and the direction towards the viewer, in the lab.
        up: (3,) the lab's vertical.
        own: whether the figure's left and right give the front; otherwise the lab's axes do.
    """

    axes: Array
    up: Array
    own: bool

    def project(self, points: Array) -> Array:
        """Picture coordinates (..., 2) of points (..., 3), metres."""
        return np.asarray(points @ self.axes[:2].T)

    def depth(self, points: Array) -> Array:
        """(...,) how near points are to the viewer, metres."""
        return np.asarray(points @ self.axes[2])

    def ellipse(self, matrix: Array) -> tuple[Array, float]:
        """Semi-axes (2,), the long one first, and its direction in degrees, of an ellipsoid's outline.

        Args:
            matrix: (3, 3), such that the ellipsoid is {x: xᵀ matrix⁻¹ x ≤ 1}; may be singular.
        """
        values, vectors = np.linalg.eigh(self.axes[:2] @ matrix @ self.axes[:2].T)
        angle = float(np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1])))
        return np.sqrt(np.maximum(values[::-1], 0.0)), angle


def view_of(name: str, fits: Sequence[SkeletonFit], frames: Sequence[int]) -> View:
    """The view of figures in some frames.

    Args:
        name: one of `VIEWS`. "side" is from the figure's right, "top" has its front up.
        fits: the figures; where they look in different directions the first one counts.
        frames: counted from 0.
    """
    up = np.eye(3)[AXES.index(fits[0].up)]
    right = _right(fits, frames, up)
    own = right is not None
    if right is None:
        right = np.roll(up, 1)
    forward = np.cross(up, right)
    if name == "front":
        axes = [-right, up, forward]
    elif name == "side":
        axes = [forward, up, right]
    elif name == "top":
        axes = [right, forward, up]
    else:
        turn, rise = np.radians([_TURN, _RISE])
        near = np.cos(turn) * forward + np.sin(turn) * right
        towards = np.cos(rise) * near + np.sin(rise) * up
        across = np.cross(up, near)
        axes = [across, np.cross(towards, across), towards]
    return View(np.array(axes), up, own)


def _right(fits: Sequence[SkeletonFit], frames: Sequence[int], up: Array) -> Array | None:
    """(3,) horizontal unit vector to the figures' right; None where they have no two sides."""
    found = [
        unit for fit in fits for frame in frames if (unit := _right_of(fit, frame, up)) is not None
    ]
    if not found:
        return None
    mean = np.mean(found, axis=0)
    if np.linalg.norm(mean) < _SCATTERED:
        mean = found[0]
    return np.asarray(mean / np.linalg.norm(mean))


def _right_of(fit: SkeletonFit, frame: int, up: Array) -> Array | None:
    """The hips' line where it is seen, else the next pair of joints down the figure."""
    root = fit.skeleton.root.name
    joints = sorted(fit.joints, key=lambda joint: joint.parent != root)
    for pair in by_sides(joint.joint for joint in joints).values():
        sides = {side(joints[i].joint): joints[i].track[frame] for i in pair}
        if {"left", "right"} <= sides.keys():
            across = sides["right"] - sides["left"]
            level = across - (across @ up) * up
            length = np.linalg.norm(level)
            # A line that is nearly upright says nothing: someone lies on the side.
            if length > 0.5 * np.linalg.norm(across) > 0:
                return np.asarray(level / length)
    return None

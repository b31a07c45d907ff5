"""From where a figure is looked at: by its own front and right, for pictures and for the page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mocap_skel.clip import vertical
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
    """A parallel projection of the lab onto a picture.

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
        """The ellipse that is the outline of an ellipsoid in the picture.

        Args:
            matrix: (3, 3), such that the ellipsoid is {x: xᵀ matrix⁻¹ x ≤ 1}; may be singular.

        Returns:
            Its semi-axes (2,), the long one first, and the direction of the long one in degrees.
        """
        values, vectors = np.linalg.eigh(self.axes[:2] @ matrix @ self.axes[:2].T)
        angle = float(np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1])))
        return np.sqrt(np.maximum(values[::-1], 0.0)), angle


def view_of(name: str, fits: Sequence[SkeletonFit], frames: Sequence[int]) -> View:
    """A view of the figures in some frames, by their own front and right.

    Args:
        name: one of `VIEWS`. "side" is from the figure's right, "top" has its front up.
        fits: the figures; where they look in different directions the first one counts.
        frames: counted from 0.
    """
    up = _up(fits[0])
    right = _mean_right(fits, frames)
    own = right is not None
    if right is None:
        right = _lab_right(up)
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


def first_front(fit: SkeletonFit) -> Array:
    """(3,) horizontal unit vector, in the lab: where the figure faces when it is first seen.

    It is the front of `view_of` in that frame. A figure without two sides faces along the lab's axes, as there.
    """
    up = _up(fit)
    rights = right_of(fit)
    seen = rights[np.isfinite(rights[:, 0])]
    return np.asarray(np.cross(up, seen[0] if len(seen) else _lab_right(up)))


def right_of(fit: SkeletonFit) -> Array:
    """(frames, 3) horizontal unit vector to the figure's right, in the lab; NaN where nothing shows it.

    It is the line from the left to the right hip. Where that is not seen, the next pair of joints down the figure.
    """
    up, root = _up(fit), fit.skeleton.root.name
    joints = sorted(fit.joints, key=lambda joint: joint.parent != root)
    found = np.full((len(fit.frame_numbers), 3), np.nan)
    for pair in by_sides(joint.joint for joint in joints).values():
        sides = {side(joints[i].joint): joints[i].track for i in pair}
        if not {"left", "right"} <= sides.keys():
            continue
        across = sides["right"] - sides["left"]
        level = across - np.outer(across @ up, up)
        length = np.linalg.norm(level, axis=1)
        # A line that is nearly upright says nothing: someone lies on the side.
        good = (length > 0.5 * np.linalg.norm(across, axis=1)) & np.isnan(found[:, 0])
        found[good] = level[good] / length[good, None]
    return found


def _mean_right(fits: Sequence[SkeletonFit], frames: Sequence[int]) -> Array | None:
    """(3,) horizontal unit vector to the right of all figures; None where they have no two sides."""
    rights = np.concatenate([right_of(fit)[list(frames)] for fit in fits])
    seen = rights[np.isfinite(rights[:, 0])]
    if not len(seen):
        return None
    mean = seen.mean(axis=0)
    if np.linalg.norm(mean) < _SCATTERED:
        mean = seen[0]
    return np.asarray(mean / np.linalg.norm(mean))


def _up(fit: SkeletonFit) -> Array:
    return vertical(fit.up)


def _lab_right(up: Array) -> Array:
    """The right of a figure without two sides: the axis that follows the vertical one."""
    return np.asarray(np.roll(up, 1))

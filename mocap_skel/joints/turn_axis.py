"""The axis on which the two segments of a joint turn, as the movement shows it, and how well it is known.

From the turns between the two (in moments, Ehrig et al. 2007, J. Biomech. 40, 2150, "SARA"), or from the plane
in which the far end of the child moves, whichever shows it better: an elbow's forearm also turns about its own
bone, which leaves that plane as it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mocap_skel.figure.skeleton import Segment
from mocap_skel.joints.evidence import NEAREST
from mocap_skel.joints.hinge import CARRYING_ERROR, hinge_shift
from mocap_skel.segments.pose import Array, Pose
from mocap_skel.segments.shape import Shape
from mocap_skel.spherefit import Moments

# Radians: an axis that is known worse is not said. Beyond, it is nearer to another body axis than to its own.
KNOWN = 0.35
# Skin turns a segment's markers together by more than it moves them apart (Barré et al. 2013, IEEE Trans. Biomed.
# Eng. 60, 3131). By how much more is chosen by eye: the standard error of an axis on skin hangs on it.
TOGETHER = 2.5
# Radians: bone and axis are square to each other up to the carrying angle, in a finger as in a forearm of 25 cm.
TILT = 0.16


@dataclass(frozen=True, eq=False)
class TurnAxis:
    """An axis on which two segments turn.

    Attributes:
        direction: (3,), a unit vector in the parent's frame; a right-handed turn about it bends the joint.
        covariance: (3, 3) of the direction, radians²; none along itself.
    """

    direction: Array
    covariance: Array

    @property
    def standard_error(self) -> float:
        """Radians, about the axis across it that is known least."""
        return float(np.sqrt(np.linalg.eigvalsh(self.covariance)[-1]))


@dataclass(frozen=True, eq=False)
class Wobble:
    """How far a segment's markers turn it about its bone, by how much they leave their shape.

    Attributes:
        skin: variance that skin makes, radians², the same throughout a movement.
        noise: variance that noise makes, radians², anew in every frame.
    """

    skin: float
    noise: float


def wobble(shape: Shape, sigma: float, joint_error: float = 0.0) -> Wobble:
    """How far noise and skin turn a segment.

    Args:
        shape: of its markers.
        sigma: noise standard deviation of a marker, metres.
        joint_error: of the joint that is one of the shape's points, 0 where it is none; it turns the segment as
            skin does.
    """
    known = shape.template[np.isfinite(shape.template).all(axis=1)]
    # About the axis for which the markers are nearest to a line, the worst.
    spread = len(known) * np.linalg.eigvalsh(np.cov(known.T, bias=True))[-2]
    square = max(float(spread), 1e-6)
    skin = max(shape.sigma**2 - sigma**2, 0.0)
    return Wobble(TOGETHER**2 * skin / square + _by_joint(known, joint_error), sigma**2 / square)


def _by_joint(points: Array, error: float) -> float:
    """Variance, radians², that an error of the last of the points makes in a least-squares pose of all."""
    away = points - points.mean(axis=0)
    inertia = (away**2).sum() * np.eye(3) - away.T @ away
    x, y, z = away[-1]
    lever = np.linalg.pinv(inertia) @ np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return float(error**2 * np.linalg.norm(lever, 2) ** 2)


def bends(segment: Segment) -> bool:
    """Whether a segment's joint bends about an axis that is worth showing, by its skeleton file."""
    return (
        segment.freedom != "ball"
        or segment.rest_axis is not None
        or hinge_shift(segment.priors) is not None
    )


def by_turns(parent: Pose, child: Pose, moved: Sequence[Wobble]) -> TurnAxis | None:
    """The axis that stays nearest to fixed in both segments; None where the turns show none.

    Args:
        parent, child: poses in the same frames.
        moved: what noise and skin make of both.

    >>> from mocap_skel.artificial.rotations import from_vector
    >>> bend = np.linspace(0.0, 1.5, 40)[:, None] * [0.0, 0.6, 0.8]
    >>> thigh = Pose(np.tile(np.eye(3), (40, 1, 1)), np.zeros((40, 3)))
    >>> found = by_turns(thigh, Pose(from_vector(bend), np.zeros((40, 3))), [])
    >>> abs(found.direction).round(3)
    array([0. , 0.6, 0.8])
    """
    known = parent.known & child.known
    if known.sum() < 4:
        return None
    mean = (parent.rotation[known].transpose(0, 2, 1) @ child.rotation[known]).mean(axis=0)
    spread = np.eye(3) - mean @ mean.T
    least, most, _ = np.linalg.eigvalsh(spread)
    return _axis(spread / _other_turns(float(least), float(most), moved, float(known.sum())))


def by_plane(
    far: Moments, centre: Array, middle: Array, moved: Sequence[Wobble], beside: float = 0.0
) -> TurnAxis | None:
    """The axis across the bone about which its far end swings; None where that shows none.

    A short arc lies nearly on a line, and says nothing of the axis along the bone; there it counts that bone and
    axis are square to each other, up to the carrying angle.

    Args:
        far: of a place far down the child, in the parent's frame.
        centre: (3,) the joint, metres.
        middle: (3,) the middle of the parent's markers.
        moved: what noise and skin make of the parent, and of the place.
        beside: metres by which the place lies beside the plane, to the axis' side.

    >>> from mocap_skel.spherefit import sphere_moments
    >>> angle = np.linspace(0.0, 2.0, 50)
    >>> wrist = 0.25 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> shoulder = np.array([-0.3, 0.0, 0.0])
    >>> abs(by_plane(sphere_moments(wrist), np.zeros(3), shoulder, []).direction).round(3)
    array([0., 0., 1.])
    """
    bone = far.mean - centre
    # The mean of an arc lies nearer to its centre than the arc.
    square = float(bone @ bone + np.trace(far.covariance))
    if not square > NEAREST**2:
        return None
    bone = bone / max(float(np.linalg.norm(bone)), NEAREST)
    spread = far.covariance / square
    across = np.eye(3) - np.outer(bone, bone)
    values = np.linalg.eigvalsh(across @ spread @ across)[1:]
    other = _other_turns(float(values[0]), float(values[1]), moved, float(far.count))
    sure = max(square / CARRYING_ERROR**2, 1.0 / TILT**2)
    found = _axis(spread / other + np.outer(bone, bone) * sure)
    if found is None:
        return None
    found = bending(found, far, centre, middle)
    tilted = found.direction + found.covariance @ bone * sure * beside / np.sqrt(square)
    return TurnAxis(tilted / np.linalg.norm(tilted), found.covariance)


def _other_turns(least: float, most: float, moved: Sequence[Wobble], frames: float) -> float:
    """Variance, radians², of turns about other axes that may go with the bend.

    Neither turns of skin nor the joint's own about other axes average out. Noise averages over frames.
    """
    skin = sum(one.skin for one in moved)
    noise = sum(one.noise for one in moved)
    excess = max(most - least, 1e-12)
    return skin + max(least - noise, 0.0) + noise / frames * (most + noise) / excess + 1e-12


def _axis(form: Array) -> TurnAxis | None:
    """The weakest direction of an information matrix (3, 3), and its error."""
    values, axes = np.linalg.eigh(form)
    excess = np.maximum(values[1:] - values[0], 1e-12)
    covariance = (axes[:, 1:] / excess) @ axes[:, 1:].T
    found = TurnAxis(axes[:, 0], 0.5 * (covariance + covariance.T))
    return found if found.standard_error < KNOWN else None


def best_axis(found: Sequence[TurnAxis | None]) -> TurnAxis | None:
    """The one of them that is known best; None without any."""
    there = [one for one in found if one is not None]
    return min(there, key=lambda one: one.standard_error) if there else None


def bending(axis: TurnAxis, far: Moments, centre: Array, middle: Array) -> TurnAxis:
    """The axis to the side about which a right-handed turn bends the joint: brings the child's end nearer.

    Args:
        axis: to either side.
        far: of a place far down the child, in the parent's frame.
        centre: (3,) the joint, metres.
        middle: (3,) the middle of the parent's markers.
    """
    along = np.cross(axis.direction, far.mean - centre)
    nearer = float((centre - middle) @ far.covariance @ along)
    return TurnAxis(-axis.direction, axis.covariance) if nearer > 0 else axis

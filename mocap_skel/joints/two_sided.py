"""The point that stays fixed in both segments of a joint, where both have a pose of their own.

After Ehrig et al., J. Biomech. 39, 2798 (2006), "SCoRE": the point that is fixed in both segments. Where the
sphere fit asks that each marker keeps its distance, this asks that one point of the child keeps its place in
the parent; both are sums over frames of the same poses, and neither knows what the other knows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocap_skel.segments.pose import Array, Pose
from mocap_skel.spherefit import smooth_share

# Radians: within such a turn of the marker's direction the skin lies as before, beyond it anew.
ALIKE = 0.4
# Turns of less than such a standard deviation are the wobble of the poses themselves, radians.
LEAST_TURN = 0.03


@dataclass(frozen=True, eq=False)
class SharedPoint:
    """The point that two segments share. Metres, in the parent's frame.

    Attributes:
        centre: (3,).
        turns: (3, 3), I - R̄ R̄ᵀ with the mean R̄ of the child's rotations in the parent: how much the child
            turned about the axes across each direction; a hinge's own axis has none.
        residual: how far the point wanders in the parent, m²: the smooth part of its variance, mean over axes.
    """

    centre: Array
    turns: Array
    residual: float

    @property
    def places(self) -> float:
        """How many places the child's turns go to, between which the skin lies anew."""
        spread = np.sort(0.5 * np.trace(self.turns) - np.linalg.eigvalsh(self.turns))[1:]
        return places_of(spread)

    @property
    def left(self) -> float:
        """Of these places, how many the residual is of: three coordinates each, less the six of the point in both segments."""
        return max(self.places - 2.0, 1.0 / 3.0)


def places_of(spread: Array) -> float:
    """How many places a turn goes to, between which the skin lies anew; at least one each way.

    Args:
        spread: (2,) variances of the directions, radians².

    >>> round(places_of(np.array([0.8**2 / 12, 0.0])), 6)
    2.0
    """
    # √12 standard deviations are the whole width of an even distribution.
    width = np.sqrt(12.0 * np.maximum(spread, 0.0))
    return float(np.prod(np.maximum(width / ALIKE, 1.0)))


def shared_point(parent: Pose, child: Pose) -> SharedPoint | None:
    """The point that is fixed in two segments, by least squares (Ehrig et al. 2006, "SCoRE").

    Along a direction in which the child never turned it is the one beside the child's own origin.

    Args:
        parent, child: the segments' poses in the same frames; frames without one of them are left out.

    Returns:
        The point in the parent's frame, metres; None where both are known in fewer than four frames.

    >>> from mocap_skel.artificial.rotations import from_vector
    >>> turn = from_vector(0.5 * np.random.default_rng(0).normal(size=(50, 3)))
    >>> thigh = Pose(np.tile(np.eye(3), (50, 1, 1)), np.zeros((50, 3)))
    >>> shank = Pose(turn, [0.1, 0.2, 0.4] - turn @ [0.0, 0.0, 0.3])
    >>> shared_point(thigh, shank).centre.round(6)
    array([0.1, 0.2, 0.4])
    """
    known = parent.known & child.known
    if known.sum() < 4:
        return None
    across = parent.rotation[known].transpose(0, 2, 1)
    turn = across @ child.rotation[known]
    away = np.einsum("fij,fj->fi", across, child.origin[known] - parent.origin[known])
    mean, middle = turn.mean(axis=0), away.mean(axis=0)
    # c₁ = R c₂ + d in every frame; its mean gives c₁, and c₂ is what is left: (I - R̄ᵀR̄) c₂ = R̄ᵀd̄ - mean Rᵀd.
    right = mean.T @ middle - np.einsum("fij,fi->j", turn, away) / len(turn)
    values, axes = np.linalg.eigh(np.eye(3) - mean.T @ mean)
    solved = values > LEAST_TURN**2
    own = axes @ np.where(solved, (axes.T @ right) / np.where(solved, values, 1.0), 0.0)
    centre = mean @ own + middle
    error = turn @ own + away - centre
    # One share for the three directions, or it would hang on how the parent's axes are drawn.
    apart = np.vstack([error, np.full((1, 3), np.nan)]).T.reshape(-1, 1)
    variance = float(smooth_share(apart)[0] * error.var(axis=0).mean())
    values, axes = np.linalg.eigh(np.eye(3) - mean @ mean.T)
    return SharedPoint(centre, (axes * np.maximum(values - LEAST_TURN**2, 0.0)) @ axes.T, variance)

"""What the motion and anatomy tell of a joint together (``docs/priors.md``)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocap_skel.joints.priors import Expected
from mocap_skel.joints.two_sided import SharedPoint
from mocap_skel.segments.pose import Array


@dataclass(frozen=True, eq=False)
class Estimate:
    """A centre and how well it is known. Metres, in the parent's frame.

    Attributes:
        centre: (3,).
        covariance: (3, 3), m².
    """

    centre: Array
    covariance: Array

    def widened(self, by: Array) -> Estimate:
        """The same centre with an independent error more, (3, 3), m²."""
        return Estimate(self.centre, self.covariance + by)


@dataclass(frozen=True, eq=False)
class Posterior(Estimate):
    """A joint's centre from motion and anatomy. Metres, in the parent's frame.

    Attributes:
        share: how much of it is from the motion, 0 to 1, mean over the directions.
    """

    share: float


def with_shared_point(motion: Estimate, shared: SharedPoint | None, slide: float) -> Estimate:
    """The average of a sphere fit's centre and of the point that both segments share.

    Both come from the same frames, so neither adds to what the other knows: each direction counts by
    its information, both with equal shares (covariance intersection, Julier & Uhlmann 1997). What skin leaves
    of the point is a mean over the places that the turns cover, less those that its own two places take, as for a
    sphere.

    Args:
        motion: of the sphere fit.
        shared: the point, None where the segments have no poses of their own.
        slide: variance of skin's slide, which shifts it as it does the centre, m².

    >>> motion = Estimate(np.array([0.02, 0.0, 0.0]), 3e-4 * np.eye(3))
    >>> point = SharedPoint(np.zeros(3), turns=0.01 * np.eye(3), residual=1e-6)
    >>> with_shared_point(motion, point, slide=0.0).centre.round(3)
    array([0.01, 0.  , 0.  ])
    """
    if shared is None or not shared.residual > 0:
        return motion
    values, axes = np.linalg.eigh(shared.turns)
    known = (axes * (values / (shared.residual / shared.left + slide * values))) @ axes.T
    first = np.linalg.inv(motion.covariance)
    both = np.linalg.inv(0.5 * (first + known))
    return Estimate(both @ (0.5 * (first @ motion.centre + known @ shared.centre)), both)


def combine(motion: Estimate, expected: Expected | None) -> Posterior:
    """The centre that motion and anatomy give together, each by its information.

    Where the two contradict each other beyond what both allow, one of them claims too much, and there is
    no telling which: both errors grow by the same factor (Birge 1932).

    Args:
        motion: the centre of the motion alone.
        expected: where anatomy has the joint; None for the motion alone.

    >>> motion = Estimate(np.array([0.02, 0.0, 0.0]), 4e-4 * np.eye(3))
    >>> hip = Expected(np.zeros(3), 4e-4 * np.eye(3), ("RFWT", "LFWT"), "Harrington 2007")
    >>> both = combine(motion, hip)
    >>> both.centre.round(3), round(both.share, 3)
    (array([0.01, 0.  , 0.  ]), 0.5)
    """
    centre, covariance = motion.centre, motion.covariance
    if expected is None:
        return Posterior(centre, covariance, 1.0)
    total = covariance + expected.covariance
    gain = np.linalg.solve(total, covariance).T
    difference = expected.mean - centre
    conflict = float(difference @ np.linalg.solve(total, difference)) / 3.0
    joint = covariance - gain @ covariance
    return Posterior(
        centre + gain @ difference,
        0.5 * (joint + joint.T) * max(conflict, 1.0),
        1.0 - float(np.trace(gain)) / 3.0,
    )

"""What is fitted and how: the same for every segment of a figure."""

from __future__ import annotations

from dataclasses import dataclass

from mocap_skel.figure.skeleton import Skeleton
from mocap_skel.joints.calibration import Calibration
from mocap_skel.joints.choices import Estimation


@dataclass(frozen=True, eq=False)
class Task:
    """What is fitted and how.

    Attributes:
        skeleton: the figure.
        estimation: the sphere fit, and where its noise comes from.
        triad: whether poses are from three points, not by least squares from all.
        search: whether samples off a joint's sphere are looked for.
        anatomy: whether the skeleton's priors are used.
        size: the subject's, 1 for a person of 1.75 m.
        calibration: what other clips know of the joints.
    """

    skeleton: Skeleton
    estimation: Estimation
    triad: bool
    search: bool
    anatomy: bool
    size: float
    calibration: Calibration | None

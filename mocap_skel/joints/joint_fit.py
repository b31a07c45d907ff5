"""The result of one joint: its centre in the parent's frame, with all that says how good it is."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mocap_skel.joints.evidence import Evidence
from mocap_skel.joints.priors import Expected
from mocap_skel.joints.turn_axis import TurnAxis
from mocap_skel.segments.pose import Array

# What stands for a method where no motion was used.
PRIOR = "PRIOR"


@dataclass(frozen=True, eq=False)
class CentreFit:
    """A common centre of markers in another segment's frame, with the evidence for it. Metres.

    Attributes:
        centre: (3,) c̃ in the parent's frame; NaN for a joint that could not be fitted.
        covariance: (3, 3) of the centre, in the parent's frame.
        samples: marker samples used, all markers together.
        effective: how many of them are independent.
        radius: (M,) distance of each marker from the centre.
        residual: root mean square of the radial residuals about it, skin movement included.
        sigma: noise standard deviation that the estimator took away.
        weakest_sd: √λ_min, the standard deviation of the markers in their weakest direction.
        angle: half-angle (radians) of the cap with the same weakest standard deviation.
        shown: "yes", "weak" or "no".
        reason: the verdict in plain words, "" for yes.
        method: the estimator: of its own accord UGDK (one marker), MGDK (several), SGDK (a direction
            had to be left out).
        axis: (3,) in the parent's frame: a hinge's axis, otherwise the direction that is most square to
            the lines from the centre to the markers.
        hinge: whether one direction, and only one, was left out: the joint turns about it.
        motion: (3,) the centre that the motion alone gives; NaN where it gives none.
        share: how much of the centre is from the motion, 0 to 1; the rest is anatomy's.
        landmarks: the markers that anatomy's part rests on; empty without a prior.
        source: the publication that the prior comes from, as the skeleton file names it; "" without a prior.
        anatomy: (3,) the centre that anatomy alone gives; None without a prior.
        evidence: what this clip's own markers tell of the centre; None where they were not used.
    """

    centre: Array
    covariance: Array
    samples: int
    effective: float
    radius: Array
    residual: float
    sigma: float
    weakest_sd: float
    angle: float
    shown: str
    reason: str
    method: str
    axis: Array
    hinge: bool
    motion: Array
    share: float
    landmarks: tuple[str, ...]
    source: str
    anatomy: Array | None = field(default=None, kw_only=True)
    evidence: Evidence | None = field(default=None, kw_only=True)

    @property
    def fitted(self) -> bool:
        return bool(np.isfinite(self.centre).all())

    @property
    def standard_error(self) -> Array:
        """(3,) metres, along the axes of the parent's frame."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def worst_error(self) -> float:
        """Metres, in the direction in which the centre is known least."""
        return worst_error(self.covariance)


@dataclass(frozen=True, eq=False)
class JointFit(CentreFit):
    """A joint: the centre that links two segments.

    Attributes:
        joint, parent, child: names.
        markers: the child's markers that were used.
        track: (frames, 3) the centre in the lab.
        turns_on: the axis on which both segments turn, in the parent's frame; None for a ball, or where none is shown.
        doubt: why the joint is not to be trusted whatever its numbers say; "" where nothing speaks against it.
    """

    joint: str
    parent: str
    child: str
    markers: tuple[str, ...]
    track: Array
    turns_on: TurnAxis | None = field(default=None, kw_only=True)
    doubt: str = field(default="", kw_only=True)


def doubted(joint: JointFit, doubt: str) -> JointFit:
    """The joint, shown weakly at best, with a doubt as part of its reason; "" leaves it as it is."""
    if not doubt or not joint.fitted:
        return joint
    shown = "weak" if joint.shown == "yes" else joint.shown
    reason = f"{joint.reason}; {doubt}" if joint.reason else doubt
    return replace(joint, shown=shown, reason=reason, doubt=doubt)


def worst_error(covariance: Array) -> float:
    """Standard deviation in the direction in which a covariance (D, D) is largest; metres for m².

    >>> worst_error(np.diag([0.0004, 0.0001, 0.0009]))
    0.03
    """
    return float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))


def from_anatomy(expected: Expected, reason: str, markers: int = 0) -> CentreFit:
    """A centre from anatomy alone, where the motion shows nothing.

    Args:
        expected: where anatomy has the joint.
        reason: why the motion was not used.
        markers: how many markers the child has; their radii are NaN.
    """
    return CentreFit(
        centre=expected.mean, covariance=expected.covariance, radius=np.full(markers, np.nan),
        reason=reason, method=PRIOR, share=0.0, landmarks=expected.landmarks, source=expected.source,
        anatomy=expected.mean, **_no_motion(),
    )  # fmt: skip


def unfitted(joint: str, parent: str, child: str, frames: int, reason: str) -> JointFit:
    """A joint of which nothing is known: all numbers are NaN.

    Args:
        joint, parent, child: names.
        frames: of the clip.
        reason: why nothing is known.
    """
    return JointFit(
        centre=np.full(3, np.nan), covariance=np.full((3, 3), np.nan), radius=np.empty(0),
        reason=reason, method="", share=np.nan, landmarks=(), source="",
        joint=joint, parent=parent, child=child, markers=(), track=np.full((frames, 3), np.nan),
        **_no_motion(),
    )  # fmt: skip


def _no_motion() -> dict[str, Any]:
    """What a fit without any sample has for evidence."""
    nothing = float("nan")
    return {
        "samples": 0, "effective": 0.0, "residual": nothing, "sigma": nothing, "weakest_sd": nothing,
        "angle": nothing, "shown": "no", "axis": np.full(3, nothing), "hinge": False,
        "motion": np.full(3, nothing),
    }  # fmt: skip

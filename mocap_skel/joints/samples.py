"""What a clip shows of one joint: the child's markers in the parent's frame, and the noise of both."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mocap_skel.joints.evidence import Evidence, merged
from mocap_skel.joints.lever import Lever
from mocap_skel.joints.two_sided import SharedPoint
from mocap_skel.segments.pose import Array
from mocap_skel.segments.shape import Shape
from mocap_skel.spherefit import (
    SphereFit,
    common_markers,
    effective_counts,
    radial_variance,
    smooth_share,
    sphere_moments,
)

# Fewer samples than unknowns (a centre and a radius) show nothing at all.
LEAST_SAMPLES = 4


@dataclass(frozen=True, eq=False)
class Frame:
    """What a joint's fit has to know of its parent's frame.

    Attributes:
        shape: the points that the frame stands on; None for one marker, a joint and an axis.
        limit: the best verdict that a joint in this frame can get.
        doubt: why it is not "yes", in plain words.
        by_child: whether the child's own markers give its turn, so that they move in it as they have to.
        lost: whether it rests on a joint that is a place holder.
    """

    shape: Shape | None
    limit: str = "yes"
    doubt: str = ""
    by_child: bool = False
    lost: bool = False


@dataclass(frozen=True, eq=False)
class JointSamples:
    """What a clip shows of one joint. Metres, along the axes of the parent's frame.

    Attributes:
        inside: (frames, M, 3), the child's markers in the parent's frame, NaN = missing.
        sigma: noise standard deviation of a marker.
        own_sigma: the same as the child's own rigid shape shows it, skin movement included.
        frame: the parent's frame.
        noise: (3, 3) Σ̂ / sigma² of a marker; the unit matrix if None.
        shared: the point that both segments' own poses share, where they have it.
    """

    inside: Array
    sigma: float
    own_sigma: float
    frame: Frame
    noise: Array | None = None
    shared: SharedPoint | None = None

    @property
    def seen(self) -> NDArray[np.bool_]:
        """(M,): whether the marker is seen in any frame."""
        return np.asarray(np.isfinite(self.inside[..., 0]).any(axis=0))

    def of(self, markers: NDArray[np.bool_]) -> JointSamples:
        """Some of the markers (M,)."""
        return replace(self, inside=self.inside[:, markers])

    def radial_errors(self, centre: Array) -> Array:
        """(frames, M): distances from a centre, less each marker's mean distance; NaN = missing."""
        away = np.linalg.norm(self.inside - centre, axis=-1)
        seen = np.isfinite(away)
        mean = np.where(seen, away, 0.0).sum(axis=0) / np.maximum(seen.sum(axis=0), 1)
        return np.asarray(away - mean)

    def evidence(self) -> Evidence:
        """All that the samples tell before there is a centre: nothing yet of the residuals about one."""
        moments = sphere_moments(np.swapaxes(self.inside, 0, 1))
        eye = np.broadcast_to(np.eye(3), (self.inside.shape[1], 3, 3))
        lever = Lever.of(self.frame.shape, self.noise)
        leverage = np.zeros_like(eye) if lever is None else lever.covariance(moments)
        skew = (
            np.zeros_like(moments.mean)
            if lever is None
            else lever.third_moment(moments, self.inside)
        )
        noise = eye if self.noise is None else np.broadcast_to(self.noise, eye.shape)
        # Skin movement is not independent of the joint's, so it is nothing to take away; but spread that
        # it alone would make, with the segments' rigid residuals as its size, proves nothing.
        skin = self.frame.shape.sigma if self.frame.shape else self.own_sigma
        still = self.own_sigma**2 * noise + skin**2 * leverage
        nothing = np.zeros(len(eye))
        return Evidence(
            moments, self.sigma, noise, leverage, skew, still, nothing, nothing, self.shared
        )


@dataclass(frozen=True, eq=False)
class Gathered:
    """A clip's samples, the evidence that they are, and what other clips add to it.

    Attributes:
        samples: of this clip.
        own: this clip's evidence.
        pooled: other clips' evidence of the same markers, in the same frame; None without any.
        share: what each sample of this clip counts, beside one of the others'.
    """

    samples: JointSamples
    own: Evidence
    pooled: Evidence | None
    share: float = 1.0

    @cached_property
    def total(self) -> Evidence:
        """All evidence together."""
        return (
            self.own if self.pooled is None else merged(self.own.counted(self.share), self.pooled)
        )

    @property
    def enough(self) -> bool:
        """Whether any marker has as many samples as a fit has unknowns."""
        return bool(self.total.count.max(initial=0) >= LEAST_SAMPLES)

    def with_residuals(self, errors: Array) -> Gathered:
        """The same with what the radial errors (frames, M) about a centre tell of how samples hang together."""
        # A frame of few markers moves all that is seen in it at once.
        alike = common_markers(errors, self.samples.inside - self.own.moments.mean)
        own = replace(
            self.own, effective=effective_counts(errors) / alike, smooth=smooth_share(errors)
        )
        return Gathered(self.samples, own, self.pooled, self.share)

    def residual(self, errors: Array, fit: SphereFit) -> float:
        """Metres: root mean square of all radial residuals about the centre of a fit.

        The clip's own are the errors (frames, M), those of other clips come from their moments.
        """
        seen = np.isfinite(errors)
        count = int(seen.sum())
        own = float(np.sqrt((np.where(seen, errors, 0.0) ** 2).sum() / max(count, 1)))
        if self.pooled is None:
            return own
        others = float(self.pooled.count @ radial_variance(self.pooled.moments, fit))
        total = max(count + float(self.pooled.count.sum()), 1.0)
        return float(np.sqrt((count * own**2 + others) / total))


def gather(samples: JointSamples, pooled: Evidence | None) -> Gathered:
    """A clip's samples with their evidence, and that of other clips beside it."""
    return Gathered(samples, samples.evidence(), pooled)

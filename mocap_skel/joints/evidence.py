"""What one clip, or several together, know of a joint: moments of the child's markers in the parent's frame.

All of it adds up: evidence of several clips is merged marker by marker, without looking at a frame again.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mocap_skel.joints.two_sided import SharedPoint
from mocap_skel.segments.pose import Array
from mocap_skel.spherefit import Moments, merge_moments, moved_moments


@dataclass(frozen=True, eq=False)
class Evidence:
    """Evidence for a joint's centre. Metres, in the parent's frame; M markers of the child.

    Attributes:
        moments: (M,) of the markers.
        sigma: noise standard deviation of a marker.
        noise: (M, 3, 3) a marker's own noise for a sigma of 1.
        leverage: (M, 3, 3) what noise of the parent's frame adds, for a sigma of 1.
        skew: (M, 3) what the frame's noise adds to the third moment, for a sigma of 1.
        still: (M, 3, 3) what noise and skin alone would spread, m².
        effective: (M,) independent samples.
        smooth: (M,) share of the radial residuals' variance that is smooth in time.
        shared: the point that both segments' own poses share, where they have it.
    """

    moments: Moments
    sigma: float
    noise: Array
    leverage: Array
    skew: Array
    still: Array
    effective: Array
    smooth: Array
    shared: SharedPoint | None = None

    @property
    def count(self) -> Array:
        """(M,) samples."""
        return self.moments.count

    def __getitem__(self, index: NDArray[Any]) -> Evidence:
        """Some of the markers."""
        parts: dict[str, Any] = {name: getattr(self, name)[index] for name in _OF_EACH}
        return replace(self, **parts)


# Metres.
NEAREST = 1e-3
_OF_EACH = ("moments", "noise", "leverage", "skew", "still", "effective", "smooth")


def merged(a: Evidence, b: Evidence) -> Evidence:
    """The evidence of two clips for the same joint and markers, both in one frame.

    Noise adds up as the moments do that it is taken from: each clip's by its samples.
    """
    moments = merge_moments(a.moments, b.moments)
    total = np.maximum(moments.count, 1.0)
    first = np.where(moments.count > 0, a.count / total, 0.5)
    parts = [(a, first), (b, 1.0 - first)]
    counts = [float(e.count.sum()) for e in (a, b)]
    square = sum(n * e.sigma**2 for n, e in zip(counts, (a, b), strict=True)) / max(
        sum(counts), 1.0
    )
    sigma = float(np.sqrt(square))

    def mean(name: str, weights: list[Array]) -> Array:
        found = sum(
            _wide(w, getattr(e, name)) * getattr(e, name)
            for w, (e, _) in zip(weights, parts, strict=True)
        )
        return np.asarray(found)

    shares = [share for _, share in parts]
    # In shares of the common level, which is one for all markers.
    levels = [w * (e.sigma**2 / square if square > 0 else 1.0) for e, w in parts]
    skew = np.zeros_like(a.skew)
    for e, w in zip((a, b), levels, strict=True):
        away = e.moments.mean - moments.mean
        each = e.leverage
        trace = np.trace(each, axis1=1, axis2=2)[:, None]
        skew = skew + w[:, None] * (e.skew + trace * away + 2 * np.einsum("mij,mj->mi", each, away))
    return Evidence(
        moments, sigma, mean("noise", levels), mean("leverage", levels), skew, mean("still", shares),
        a.effective + b.effective, mean("smooth", shares), _both(a.shared, b.shared),
    )  # fmt: skip


def _wide(weights: Array, like: Array) -> Array:
    return weights.reshape(-1, *[1] * (like.ndim - 1))


def _both(a: SharedPoint | None, b: SharedPoint | None) -> SharedPoint | None:
    """Two shared points as one: what each knows adds up, skin's slide stays common to both."""
    found = [s for s in (a, b) if s is not None and s.residual > 0]
    if len(found) < 2:
        return found[0] if found else a or b
    weights = [s.turns / s.residual for s in found]
    middle = 0.5 * (found[0].centre + found[1].centre)
    push = sum(w @ (s.centre - middle) for w, s in zip(weights, found, strict=True))
    total = weights[0] + weights[1]
    centre = middle + np.linalg.pinv(total, rcond=1e-9, hermitian=True) @ np.asarray(push)
    residual = 0.5 * (found[0].residual + found[1].residual)
    return SharedPoint(centre, total * residual, residual)


def moved(evidence: Evidence, rotation: Array, shift: Array) -> Evidence:
    """The same evidence in other coordinates, y = rotation x + shift."""
    turn = rotation
    shared = evidence.shared
    if shared is not None:
        shared = SharedPoint(
            turn @ shared.centre + shift, turn @ shared.turns @ turn.T, shared.residual
        )
    return replace(
        evidence,
        moments=moved_moments(evidence.moments, turn, shift),
        noise=turn @ evidence.noise @ turn.T,
        leverage=turn @ evidence.leverage @ turn.T,
        skew=evidence.skew @ turn.T,
        still=turn @ evidence.still @ turn.T,
        shared=shared,
    )


def placed(evidence: Evidence, places: list[int], count: int) -> Evidence:
    """Its markers at those places among `count`; the others without a sample."""

    def spread(part: Array) -> Array:
        whole = np.zeros((count, *part.shape[1:]))
        whole[places] = part
        return whole

    moments = Moments(*(spread(getattr(evidence.moments, f.name)) for f in fields(Moments)))
    parts: dict[str, Any] = {
        name: spread(getattr(evidence, name)) for name in _OF_EACH if name != "moments"
    }
    return replace(evidence, moments=moments, **parts)


def information(evidence: Evidence, centre: Array) -> Array:
    """(3, 3), m⁻²: what the evidence tells of a centre, Σ N_p C_p / (r_p σ_p)² (``method.md`` section 3)."""
    m = evidence.moments
    away = m.mean - centre
    # A marker that stands still may come out in the centre; nearer than this it is in the bone.
    square = np.maximum((away**2).sum(axis=1), NEAREST**2)
    values, axes = np.linalg.eigh(m.covariance - evidence.still)
    spread = np.einsum("pdk,pk,pek->pde", axes, np.maximum(values, 0.0), axes)
    # The residuals' size is the clip's skin and noise: what stands still spreads that much.
    noise = np.maximum(np.trace(evidence.still, axis1=1, axis2=2) / 3, (1e-5) ** 2)
    return np.asarray(np.einsum("p,pde->de", evidence.effective / (square * noise), spread))

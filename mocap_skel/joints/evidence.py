"""What clips tell of a joint's centre: moments of the child's markers in the parent's frame, and their noise.

All of it adds up: the evidence of several clips is merged marker by marker, and no frame is looked at again.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mocap_skel.joints.two_sided import SharedPoint
from mocap_skel.segments.pose import Array
from mocap_skel.spherefit import Moments, merge_moments, moved_moments


@dataclass(frozen=True, eq=False)
class Evidence:
    """What the samples of M markers tell of a joint's centre. Metres, in the parent's frame.

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

    @property
    def freedom(self) -> Array:
        """(M,) degrees of freedom: samples less one, never below 0."""
        return np.asarray(np.maximum(self.count - 1.0, 0.0))

    @cached_property
    def share(self) -> Array:
        """(M,) what each marker has of all samples, adding up to 1."""
        return np.asarray(self.freedom / self.freedom.sum())

    @cached_property
    def reach(self) -> float:
        """Metres: how far the markers are from the parent's origin, root mean square.

        The joint is on the parent too, so it lies no farther from the markers than that.
        """
        return root_mean_square(np.linalg.norm(self.moments.mean, axis=1))

    def over_markers(self, matrices: Array) -> Array:
        """(3, 3): the mean of matrices (M, 3, 3), each marker's by its share of the samples."""
        return np.asarray(np.einsum("p,pij->ij", self.share, matrices))

    @property
    def spread_over_noise(self) -> float:
        """Smallest ratio, over directions, of the markers' standard deviation to what noise alone makes."""
        spread, still = self.over_markers(self.moments.covariance), self.over_markers(self.still)
        floor = np.trace(still) * 1e-12 + np.finfo(float).tiny
        factor = np.linalg.inv(np.linalg.cholesky(still + floor * np.eye(3)))
        return float(np.sqrt(max(np.linalg.eigvalsh(factor @ spread @ factor.T)[0], 0.0)))

    def counted(self, share: float) -> Evidence:
        """The same, each sample counted as so much of one."""
        if share >= 1.0:
            return self
        m = self.moments
        few = replace(m, count=m.count * max(share, LEAST_COUNTED))
        return replace(self, moments=few, effective=self.effective * max(share, LEAST_COUNTED))

    def __getitem__(self, index: NDArray[Any]) -> Evidence:
        """Some of the markers."""
        parts: dict[str, Any] = {name: getattr(self, name)[index] for name in _OF_EACH}
        return replace(self, **parts)


# Metres: a marker that stands still may come out in the centre; nearer than this it is in the bone.
NEAREST = 1e-3
# Metres: residuals are never taken for smaller, a hundredth of a millimetre is below any camera's.
LEAST_NOISE = 1e-5
# However little a clip knows beside another, its samples count as so much of others: markers that only it has keep theirs.
LEAST_COUNTED = 1e-3
_OF_EACH = ("moments", "noise", "leverage", "skew", "still", "effective", "smooth")


def root_mean_square(lengths: Array) -> float:
    """Root mean square of lengths (N,)."""
    return float(np.sqrt(np.mean(lengths**2)))


def merged(a: Evidence, b: Evidence) -> Evidence:
    """The evidence of two clips together, for the same joint and markers, both in one frame.

    Noise adds up as the moments do that it is taken from: each clip's by its samples.

    >>> from mocap_skel.spherefit import sphere_moments
    >>> def seen(frames):
    ...     markers = np.random.default_rng(frames).normal(size=(2, frames, 3))
    ...     each, none = np.tile(np.eye(3), (2, 1, 1)), np.zeros(2)
    ...     return Evidence(sphere_moments(markers), 0.001, each, 0 * each, np.zeros((2, 3)), each, none, none)
    >>> merged(seen(100), seen(50)).count
    array([150., 150.])
    """
    moments = merge_moments(a.moments, b.moments)
    first = np.where(moments.count > 0, a.count / np.maximum(moments.count, 1.0), 0.5)
    shares = (first, 1.0 - first)
    square = _common_square(a, b)
    # In shares of the common level, which is one for all markers.
    levels = tuple(
        w * (e.sigma**2 / square if square > 0 else 1.0)
        for e, w in zip((a, b), shares, strict=True)
    )

    def mean(name: str, weights: tuple[Array, ...]) -> Array:
        found = sum(
            _wide(w, getattr(e, name)) * getattr(e, name)
            for w, e in zip(weights, (a, b), strict=True)
        )
        return np.asarray(found)

    skew = np.zeros_like(a.skew)
    for e, w in zip((a, b), levels, strict=True):
        skew = skew + w[:, None] * _skew_about(e, moments.mean)
    return Evidence(
        moments, float(np.sqrt(square)), mean("noise", levels), mean("leverage", levels), skew,
        mean("still", shares), a.effective + b.effective, mean("smooth", shares),
        _both(a.shared, b.shared),
    )  # fmt: skip


def _common_square(a: Evidence, b: Evidence) -> float:
    """The square of the common noise level, m²: each clip's by its samples."""
    counts = [float(e.count.sum()) for e in (a, b)]
    total = sum(n * e.sigma**2 for n, e in zip(counts, (a, b), strict=True))
    return total / max(sum(counts), 1.0)


def _skew_about(evidence: Evidence, middle: Array) -> Array:
    """(M, 3): what the frame's noise adds to the third moment about other places than the markers' means."""
    away = evidence.moments.mean - middle
    each = evidence.leverage
    trace = np.trace(each, axis1=1, axis2=2)[:, None]
    return np.asarray(evidence.skew + trace * away + 2 * np.einsum("mij,mj->mi", each, away))


def _wide(weights: Array, like: Array) -> Array:
    return weights.reshape(-1, *[1] * (like.ndim - 1))


def _both(a: SharedPoint | None, b: SharedPoint | None) -> SharedPoint | None:
    """Two clips' shared points as one: their information adds up, and they turn as much as both do on average.

    So two alike are as one of half the residual; the places that they cover do not become more.
    """
    found = [s for s in (a, b) if s is not None and s.residual > 0]
    if len(found) < 2:
        return found[0] if found else a or b
    weights = [s.turns / s.residual for s in found]
    middle = 0.5 * (found[0].centre + found[1].centre)
    push = sum(w @ (s.centre - middle) for w, s in zip(weights, found, strict=True))
    total = weights[0] + weights[1]
    centre = middle + np.linalg.pinv(total, rcond=1e-9, hermitian=True) @ np.asarray(push)
    turned, known = sum(float(np.trace(s.turns)) for s in found), float(np.trace(total))
    residual = 0.5 * (turned / known if known > 0 else found[0].residual + found[1].residual)
    return SharedPoint(centre, total * residual, residual)


def moved(evidence: Evidence, rotation: Array, shift: Array) -> Evidence:
    """The same evidence in other coordinates, y = rotation x + shift, for a (3, 3) and a (3,) in metres."""
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
    """The same evidence with more markers: its own at these places among `count`, the others without a sample."""

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
    """(3, 3), m⁻²: how much the evidence tells of a centre, Σ N_p C_p / (r_p σ_p)² (thesis 6.6).

    Args:
        evidence: of M markers.
        centre: (3,), metres.
    """
    m = evidence.moments
    away = m.mean - centre
    square = np.maximum((away**2).sum(axis=1), NEAREST**2)
    values, axes = np.linalg.eigh(m.covariance - evidence.still)
    spread = np.einsum("pdk,pk,pek->pde", axes, np.maximum(values, 0.0), axes)
    # The residuals' size is the clip's skin and noise: what stands still spreads that much.
    noise = np.maximum(np.trace(evidence.still, axis1=1, axis2=2) / 3, LEAST_NOISE**2)
    return np.asarray(np.einsum("p,pde->de", evidence.effective / (square * noise), spread))

"""One joint: the centre that a child's markers keep in the parent's frame, and what that rests on."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mocap_skel.joints.evidence import Evidence, merged
from mocap_skel.joints.lever import Lever
from mocap_skel.joints.posterior import combine, skin_error, with_shared_point
from mocap_skel.joints.priors import Expected
from mocap_skel.joints.two_sided import SharedPoint
from mocap_skel.segments.pose import Array
from mocap_skel.segments.shape import Shape
from mocap_skel.spherefit import (
    NOISELESS,
    Moments,
    SphereFit,
    allowed_sigma,
    centre_covariance,
    common_markers,
    coverage_angle,
    effective_counts,
    fit_sphere,
    marker_noise,
    radial_variance,
    smooth_share,
    sphere_moments,
)

# Verdicts (`_shown`). At 3 the noise is a tenth of the variance in the weakest direction, so that
# an error of half in the noise level moves the centre by a twentieth of its distance.
SAFE_RATIO = 3.0
# Metres: a standard error above it is no joint centre that a lab would publish, and skin moves by less
# than such a residual.
SAFE_ERROR = 0.01
SAFE_RESIDUAL = 0.01
# Metres: skin on a person who stands still moves that much, however smooth the clip.
LEAST_SPREAD = 0.003
# A marker keeps this share at least of what its residual shows, whatever the frame's noise explains.
LEAST_SHARE = 0.1
# The method that suits a joint: UGDK, MGDK or SGDK, and no sphere that the data do not show.
BEST = "best"
# What stands for a method where no motion was used.
PRIOR = "PRIOR"
VERDICTS = ("no", "weak", "yes")
# Fewer samples than unknowns (a centre and a radius) show nothing at all.
LEAST_SAMPLES = 4


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
        source: whose word the prior is.
        evidence: what this clip's own markers know of the centre; None where they were not used.
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
        return _worst_error(self.covariance)


@dataclass(frozen=True, eq=False)
class JointFit(CentreFit):
    """A joint: the centre that links two segments.

    Attributes:
        joint, parent, child: names.
        markers: the child's markers that were used.
        track: (frames, 3) the centre in the lab.
    """

    joint: str
    parent: str
    child: str
    markers: tuple[str, ...]
    track: Array


@dataclass(frozen=True, eq=False)
class Frame:
    """What a joint's fit has to know of its parent's frame.

    Attributes:
        shape: the points that the frame stands on; None for one marker, a joint and an axis.
        limit: the best verdict that a joint in this frame can get.
        doubt: why it is not "yes", in plain words.
    """

    shape: Shape | None
    limit: str = "yes"
    doubt: str = ""


def from_anatomy(expected: Expected, reason: str, markers: int = 0) -> CentreFit:
    """A centre of which the motion shows nothing; `reason` says why. The radii of markers are NaN."""
    return CentreFit(
        centre=expected.mean, covariance=expected.covariance, radius=np.full(markers, np.nan),
        reason=reason, method=PRIOR, share=0.0, landmarks=expected.landmarks, source=expected.source,
        **_no_motion(),
    )  # fmt: skip


def unfitted(joint: str, parent: str, child: str, frames: int, reason: str) -> JointFit:
    """A joint of which nothing is known."""
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


def fit_centre(
    inside: Array,
    sigma: float,
    own_sigma: float,
    frame: Frame,
    method: str = BEST,
    noise: Array | None = None,
    *,
    each: bool = False,
    expected: Expected | None = None,
    looseness: float = 1.0,
    shared: SharedPoint | None = None,
    pooled: Evidence | None = None,
) -> CentreFit | None:
    """The common centre of the child's markers in the parent's frame.

    Args:
        inside: (frames, M, 3), the child's markers in the parent's frame, NaN = missing.
        sigma: noise standard deviation of a marker.
        own_sigma: the same as the child's own rigid shape shows it, skin movement included.
        frame: the parent's frame.
        method: one of `spherefit.METHODS`, or `BEST`.
        noise: (3, 3) Σ̂ / sigma² of a marker along the parent's axes; the unit matrix if None.
        each: take each marker's noise from its own radial residuals instead, and weigh it by that.
        expected: where anatomy has the joint; None for what the motion alone gives.
        looseness: how far the joint is from a ball, as `Segment.looseness`.
        shared: the point that both segments' own poses share, beside `expected` only.
        pooled: what other clips know of it, in this frame, of the same M markers.

    Returns:
        None where no marker has enough samples. A marker that is never seen has the radius NaN.

    Raises:
        DegenerateSphereError: the method has no answer for these samples; `BEST` always has one.
    """
    there = np.asarray(np.isfinite(inside[..., 0]).any(axis=0))
    if pooled is not None:
        there |= pooled.count > 0
    if not there.all():
        found = fit_centre(
            inside[:, there], sigma, own_sigma, frame, method, noise, each=each, expected=expected,
            looseness=looseness, shared=shared,
            pooled=None if pooled is None else pooled[there],
        )  # fmt: skip
        if found is None:
            return None
        radius = np.full(len(there), np.nan)
        radius[there] = found.radius
        return replace(found, radius=radius)
    own = _own_evidence(inside, sigma, own_sigma, frame, noise, shared)
    seen = own if pooled is None else merged(own, pooled)
    moments, sigma, leverage = seen.moments, seen.sigma, seen.leverage
    if moments.count.max(initial=0) < LEAST_SAMPLES:
        return None
    if each:
        each_own, weights = _noise_of_each(moments, sigma, leverage)
        taken = each_own + leverage
        fit = _fit(inside, moments, method, sigma, taken, weights, seen.skew)
        level = np.sqrt(np.trace(each_own, axis1=1, axis2=2).mean() / 3)
        fit = replace(fit, sigma=fit.sigma * level)
    else:
        weights = np.ones(len(moments.count))
        taken = seen.noise + leverage
        fit = _fit(inside, moments, method, sigma, taken, None, seen.skew)
    if expected is not None and not fit.converged:
        return from_anatomy(expected, f"{method.upper()} did not converge", len(moments.count))
    errors = _radial_errors(inside, fit.centre)
    # A frame of few markers moves all that is seen in it at once.
    effective = effective_counts(errors) / common_markers(errors, inside - own.moments.mean)
    own = replace(own, effective=effective, smooth=smooth_share(errors))
    seen = own if pooled is None else merged(own, pooled)
    effective = seen.effective
    residual = _residual(errors, pooled, fit)
    weakest = float(np.sqrt(max(float(fit.spread.min()), 0.0)))
    rank = int(fit.rank)
    shown = _shown(rank, weakest, residual, _spread_over_noise(moments, seen.still))
    if method == "mle":
        weights = 1.0 / np.maximum(fit.radius**2, np.finfo(float).tiny)
    covariance = _covariance(moments, fit, weights, effective, sigma, seen.still, shown[0] == "yes")
    soft = skin_error(
        moments, fit, radial_variance(moments, fit), seen.smooth,
        float(fit.sigma) ** 2 * taken, leverage, _reach(moments), looseness,
    )  # fmt: skip
    # A pure fit stays what it is, with the error that it has.
    centre, total = fit.centre, covariance + soft.covariance
    if frame.limit == "no":
        # The frame turns as nobody sees, and the markers in it with it.
        total = total + _reach(moments) ** 2 * np.eye(3)
    if expected is not None:
        centre, total = with_shared_point(centre + soft.shift, total, seen.shared, soft.slide)
    both = combine(centre, total, expected)
    # The worst of what the movement shows, what the numbers say, and what the parent's frame allows.
    verdict, reason = min(
        ("yes", "") if fit.converged else ("no", f"{method.upper()} did not converge"),
        shown,
        _trusted(residual, _worst_error(covariance)),
        (frame.limit, frame.doubt),
        key=lambda verdict: VERDICTS.index(verdict[0]),
    )
    return CentreFit(
        centre=both.centre,
        covariance=both.covariance,
        samples=int(moments.count.sum()),
        effective=float(effective.sum()),
        radius=fit.radius if expected is None else _radius(moments, fit, both.centre),
        residual=(
            residual
            if expected is None
            else _residual(
                _radial_errors(inside, both.centre), pooled, replace(fit, centre=both.centre)
            )
        ),
        sigma=float(fit.sigma),
        weakest_sd=weakest,
        angle=float(coverage_angle(weakest, _root_mean_square(fit.radius))),
        shown=verdict,
        reason=reason,
        method=_name(method, rank, len(moments.count)),
        axis=fit.axes[:, 0] if rank == 2 else _square_axis(moments, fit),
        hinge=rank == 2,
        motion=fit.centre,
        share=both.share,
        landmarks=() if expected is None else expected.landmarks,
        source="" if expected is None else expected.source,
        evidence=own,
    )


def _own_evidence(
    inside: Array,
    sigma: float,
    own_sigma: float,
    frame: Frame,
    noise: Array | None,
    shared: SharedPoint | None,
) -> Evidence:
    """What the clip's own samples tell, but for what their residuals about a centre do."""
    moments = sphere_moments(np.swapaxes(inside, 0, 1))
    eye = np.broadcast_to(np.eye(3), (inside.shape[1], 3, 3))
    lever = Lever.of(frame.shape, noise)
    leverage = np.zeros_like(eye) if lever is None else lever.covariance(moments)
    skew = np.zeros_like(moments.mean) if lever is None else lever.third_moment(moments, inside)
    shape = eye if noise is None else np.broadcast_to(noise, eye.shape)
    # Skin movement is not independent of the joint's, so it is nothing to take away; but spread that
    # it alone would make, with the segments' rigid residuals as its size, proves nothing.
    skin = frame.shape.sigma if frame.shape else own_sigma
    still = own_sigma**2 * shape + skin**2 * leverage
    nothing = np.zeros(len(eye))
    return Evidence(moments, sigma, shape, leverage, skew, still, nothing, nothing, shared)


def _residual(errors: Array, pooled: Evidence | None, fit: SphereFit) -> float:
    """Root mean square of the clip's own radial residuals, and of the pooled ones by their moments."""
    own = _total_root_mean_square(errors)
    if pooled is None:
        return own
    count = int(np.isfinite(errors).sum())
    others = float(pooled.count @ radial_variance(pooled.moments, fit))
    total = max(count + float(pooled.count.sum()), 1.0)
    return float(np.sqrt((count * own**2 + others) / total))


def _radial_errors(inside: Array, centre: Array) -> Array:
    """(frames, M): distances from the centre, less each marker's mean."""
    away = np.linalg.norm(inside - centre, axis=-1)
    seen = np.isfinite(away)
    mean = np.where(seen, away, 0.0).sum(axis=0) / np.maximum(seen.sum(axis=0), 1)
    return np.asarray(away - mean)


def _total_root_mean_square(errors: Array) -> float:
    seen = np.isfinite(errors)
    return float(np.sqrt((np.where(seen, errors, 0.0) ** 2).sum() / max(int(seen.sum()), 1)))


def _noise_of_each(moments: Moments, sigma: float, leverage: Array) -> tuple[Array, Array]:
    """Σ̂_p / sigma², (M, 3, 3), of each marker by its own residuals, and the weights that go with it.

    A marker's residual holds the frame's noise as well, which has a shape of its own: the leverage.
    """
    found = marker_noise(moments)
    frames = sigma**2 * np.trace(leverage, axis1=1, axis2=2) / 3
    rest = np.maximum(found.sigma**2 - frames, (LEAST_SHARE * found.sigma) ** 2)
    own = rest[:, None, None] / max(sigma**2, np.finfo(float).tiny) * np.eye(3)
    return own, found.weights


def _name(method: str, rank: int, markers: int) -> str:
    """What a fit is called: UGDK of several markers is MGDK, and of one the other way round."""
    if method not in (BEST, "ugdk", "mgdk"):
        return method.upper()
    return "SGDK" if rank < 3 else "UGDK" if markers == 1 else "MGDK"


def _fit(
    inside: Array,
    moments: Moments,
    method: str,
    sigma: float,
    noise: Array,
    weights: Array | None,
    skew: Array,
) -> SphereFit:
    """The sphere fit with the clip's noise, (M, 3, 3) for a sigma of 1, taken away by what can take it."""
    points = np.swapaxes(inside, 0, 1)
    if method in NOISELESS:
        return fit_sphere(points, method, moments=moments)
    # Each joint uses the clip's measured noise, but never more than its own points' residual shows:
    # one level for all that is taken away.
    level = float(allowed_sigma(moments, sigma, noise))
    if method == "igdk":
        return fit_sphere(points, method, sigma=level, moments=moments)
    return fit_sphere(
        points, "sgdk" if method == BEST else method, sigma=level, noise=noise, weights=weights,
        moments=replace(moments, third=moments.third - level**2 * skew),
    )  # fmt: skip


def _square_axis(moments: Moments, fit: SphereFit) -> Array:
    """(3,): the axis that the markers' directions from the centre have least of."""
    away = moments.mean - fit.centre
    scatter = moments.covariance + away[:, :, None] * away[:, None, :]
    return np.asarray(np.linalg.eigh(_pooled(scatter, moments))[1][:, 0])


def _worst_error(covariance: Array) -> float:
    return float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))


def _reach(moments: Moments) -> float:
    return _root_mean_square(np.linalg.norm(moments.mean, axis=1))


def _radius(moments: Moments, fit: SphereFit, centre: Array) -> Array:
    """(M,): the markers' distances from another centre than the fit's, by the same moments."""
    before, after = ((moments.mean - c) ** 2 for c in (fit.centre, centre))
    return np.asarray(np.sqrt(np.maximum(fit.radius**2 + (after - before).sum(axis=1), 0.0)))


def _root_mean_square(lengths: Array) -> float:
    return float(np.sqrt(np.mean(lengths**2)))


def _pooled(matrices: Array, moments: Moments) -> Array:
    below = np.maximum(moments.count - 1.0, 0.0)
    return np.asarray(np.einsum("p,pde->de", below / below.sum(), matrices))


def _spread_over_noise(moments: Moments, noise: Array) -> float:
    """Smallest ratio, over directions, of the markers' standard deviation to what noise alone makes."""
    spread, still = _pooled(moments.covariance, moments), _pooled(noise, moments)
    floor = np.trace(still) * 1e-12 + np.finfo(float).tiny
    factor = np.linalg.inv(np.linalg.cholesky(still + floor * np.eye(3)))
    return float(np.sqrt(max(np.linalg.eigvalsh(factor @ spread @ factor.T)[0], 0.0)))


def _covariance(
    moments: Moments,
    fit: SphereFit,
    weights: Array,
    effective: Array,
    sigma: float,
    frame_noise: Array,
    shown: bool,
) -> Array:
    """Covariance of the centre, from what the motion alone has spread and how markers were weighed."""
    values, vectors = np.linalg.eigh(moments.covariance - frame_noise)
    moved = np.einsum("pdk,pk,pek->pde", vectors, np.maximum(values, 0.0), vectors)
    # What was not solved is not known, whatever the noise spreads there.
    solved = fit.axes[:, 3 - int(fit.rank) :]
    moved = solved @ (solved.T @ moved @ solved) @ solved.T
    # The joint is on the parent too: it lies no farther from the markers than the parent's origin. For
    # joints that hardly move the fitted radius comes out near zero and would feign certainty.
    reach = _reach(moments)
    radius = fit.radius if shown else np.maximum(fit.radius, reach)
    residual = np.maximum(radial_variance(moments, fit), sigma**2)
    return centre_covariance(
        moved, effective, radius, residual, reach, weights * np.maximum(moments.count - 1.0, 0.0)
    )


def _shown(rank: int, weakest: float, residual: float, over_noise: float) -> tuple[str, str]:
    """Whether the movement shows the joint, and in plain words why not.

    The thesis's criterion, σ < √λ_min, with the noise that is really there: the radial residual, and
    the spread that the parent's own frame noise makes out of nothing.
    """
    if rank == 0:
        return "no", "hardly moves"
    if rank == 1:
        return "no", "moves along one line only"
    if rank == 2:
        return "no", "turns about one axis only: not known along it"
    if weakest < LEAST_SPREAD:
        return "no", f"moves only {1e3 * weakest:.1f} mm in one direction: skin alone does that"
    if weakest <= residual or over_noise <= np.sqrt(2.0):
        return "no", "moves less than its noise in one direction"
    if weakest <= SAFE_RATIO * residual or over_noise <= SAFE_RATIO:
        return "weak", f"moves only {100 * weakest:.1f} cm in one direction, little above its noise"
    return "yes", ""


def _trusted(residual: float, error: float) -> tuple[str, str]:
    """Whether the numbers of a joint that was shown deserve trust."""
    if residual > SAFE_RESIDUAL:
        return "weak", (
            f"its markers do not keep their distance ({100 * residual:.1f} cm): swapped or wrongly "
            "assigned?"
        )
    if error > SAFE_ERROR:
        return "weak", f"standard error {100 * error:.1f} cm in one direction"
    return "yes", ""

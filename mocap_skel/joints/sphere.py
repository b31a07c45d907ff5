"""The sphere fit of one joint: the noise that it takes away, and what its centre and error rest on."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mocap_skel.joints.choices import BEST, Estimation
from mocap_skel.joints.evidence import Evidence, root_mean_square
from mocap_skel.joints.samples import Gathered
from mocap_skel.segments.pose import Array
from mocap_skel.spherefit import (
    NOISELESS,
    SphereFit,
    allowed_sigma,
    centre_covariance,
    coverage_angle,
    fit_sphere,
    marker_noise,
    radial_variance,
)

# A marker keeps this share at least of what its residual shows, whatever the noise of the parent's frame
# explains. By eye: it only keeps a marker from passing for free of noise.
LEAST_SHARE = 0.1


@dataclass(frozen=True, eq=False)
class Noise:
    """The noise that a fit takes away from the moments of M markers.

    Attributes:
        shape: (M, 3, 3) its covariance for a sigma of 1, the noise of the parent's frame included.
        weights: (M,), how much a sample of each marker counts.
        level: the markers' own noise, standard deviation for a sigma of 1.
    """

    shape: Array
    weights: Array
    level: float = 1.0


def noise_of_clip(evidence: Evidence) -> Noise:
    """The clip's noise, the same for all markers, whose samples count alike."""
    return Noise(evidence.noise + evidence.leverage, np.ones(len(evidence.count)))


def noise_of_each(evidence: Evidence) -> Noise:
    """Each marker's noise by its own radial residuals, and the weights that go with it.

    A marker's residual holds the noise of the parent's frame as well, which has a shape of its own: the
    leverage. What that explains is not the marker's.
    """
    found = marker_noise(evidence.moments)
    square = evidence.sigma**2
    frames = square * np.trace(evidence.leverage, axis1=1, axis2=2) / 3
    rest = np.maximum(found.sigma**2 - frames, (LEAST_SHARE * found.sigma) ** 2)
    own = rest[:, None, None] / max(square, np.finfo(float).tiny) * np.eye(3)
    level = np.sqrt(np.trace(own, axis1=1, axis2=2).mean() / 3)
    return Noise(own + evidence.leverage, found.weights, level)


@dataclass(frozen=True, eq=False)
class Sphere:
    """Spheres of M markers about one centre, and what they rest on. Metres, in the parent's frame.

    Attributes:
        seen: the samples and all evidence, with the residuals about this centre.
        fit: centre, radii, solved directions, and the noise level that was taken away.
        noise: (M, 3, 3), the noise at that level, m².
        weights: (M,), how much a sample of each marker counted.
        method: that was asked for.
        variance: (M,), m², of each marker's radial residuals.
        residual: root mean square of all radial residuals.
    """

    seen: Gathered
    fit: SphereFit
    noise: Array
    weights: Array
    method: str
    variance: Array
    residual: float

    @property
    def evidence(self) -> Evidence:
        return self.seen.total

    @property
    def failure(self) -> str:
        """Why the estimator has no answer, in plain words; "" where it has one."""
        return "" if self.fit.converged else f"{self.method.upper()} did not converge"

    @property
    def rank(self) -> int:
        """How many directions were solved."""
        return int(self.fit.rank)

    @property
    def solved(self) -> Array:
        """(3, rank), the directions that were solved, as columns."""
        return self.fit.axes[:, 3 - self.rank :]

    @property
    def hinge(self) -> bool:
        """Whether all directions but one were solved: the joint turns about that one."""
        return self.rank == 2

    @property
    def weakest_sd(self) -> float:
        """√λ_min, the standard deviation of the markers in their weakest direction."""
        return float(np.sqrt(max(float(self.fit.spread.min()), 0.0)))

    @property
    def angle(self) -> float:
        """Half-angle of the cap with the same weakest standard deviation, radians."""
        return float(coverage_angle(self.weakest_sd, root_mean_square(self.fit.radius)))

    @property
    def away(self) -> Array:
        """(M, 3): from the centre to the markers' means."""
        return np.asarray(self.evidence.moments.mean - self.fit.centre)

    @property
    def axis(self) -> Array:
        """(3,): a hinge's axis, else the direction that the lines from the centre to the markers have least of."""
        if self.hinge:
            return self.fit.axes[:, 0]
        away = self.away
        scatter = self.evidence.moments.covariance + away[:, :, None] * away[:, None, :]
        return np.asarray(np.linalg.eigh(self.evidence.over_markers(scatter))[1][:, 0])

    @property
    def name(self) -> str:
        """What the fit is called: UGDK of several markers is MGDK, and of one the other way round."""
        if self.method not in (BEST, "ugdk", "mgdk"):
            return self.method.upper()
        return "SGDK" if self.rank < 3 else "UGDK" if len(self.weights) == 1 else "MGDK"

    def covariance(self, shown: bool) -> Array:
        """Covariance (3, 3) of the centre, m²: what noise makes of the markers' movement (thesis 6.6).

        Args:
            shown: whether the movement shows the joint, so that the fitted radii can be believed.
        """
        evidence, fit = self.evidence, self.fit
        values, vectors = np.linalg.eigh(evidence.moments.covariance - evidence.still)
        moved = np.einsum("pdk,pk,pek->pde", vectors, np.maximum(values, 0.0), vectors)
        # What was not solved is not known, whatever the noise spreads there.
        moved = self.solved @ (self.solved.T @ moved @ self.solved) @ self.solved.T
        # For joints that hardly move the fitted radius comes out near zero and would feign certainty.
        reach = evidence.reach
        radius = fit.radius if shown else np.maximum(fit.radius, reach)
        residual = np.maximum(self.variance, evidence.sigma**2)
        weights = self.weights * evidence.freedom
        return centre_covariance(moved, evidence.effective, radius, residual, reach, weights)

    def radius_about(self, centre: Array) -> Array:
        """(M,): the markers' distances from another centre (3,), by the same moments."""
        mean = self.evidence.moments.mean
        before, after = ((mean - c) ** 2 for c in (self.fit.centre, centre))
        return np.asarray(
            np.sqrt(np.maximum(self.fit.radius**2 + (after - before).sum(axis=1), 0.0))
        )

    def residual_about(self, centre: Array) -> float:
        """The residual about another centre (3,)."""
        errors = self.seen.samples.radial_errors(centre)
        return self.seen.residual(errors, replace(self.fit, centre=centre))


def fit_markers(seen: Gathered, choice: Estimation) -> Sphere:
    """Fit a common centre to all evidence, and look at the residuals about it.

    Raises:
        DegenerateSphereError: the method has no answer for these samples.
    """
    noise = noise_of_each(seen.total) if choice.each else noise_of_clip(seen.total)
    fit = _fit(seen, noise, choice.method)
    fit = replace(fit, sigma=fit.sigma * noise.level)
    weights = noise.weights
    if choice.method == "mle":
        # It takes distances, not their squares: a residual's pull does not grow with the radius.
        weights = 1.0 / np.maximum(fit.radius**2, np.finfo(float).tiny)
    taken = float(fit.sigma) ** 2 * noise.shape
    errors = seen.samples.radial_errors(fit.centre)
    variance = radial_variance(seen.total.moments, fit)
    return Sphere(
        seen.with_residuals(errors), fit, taken, weights, choice.method, variance,
        seen.residual(errors, fit),
    )  # fmt: skip


def _fit(seen: Gathered, noise: Noise, method: str) -> SphereFit:
    """The fit by a method, with the noise taken away by what can take it."""
    points, evidence = np.swapaxes(seen.samples.inside, 0, 1), seen.total
    moments = evidence.moments
    if method in NOISELESS:
        return fit_sphere(points, method, moments=moments)
    # Each joint uses the clip's measured noise, but never more than its own points' residual shows:
    # one level for all that is taken away.
    level = float(allowed_sigma(moments, evidence.sigma, noise.shape))
    if method == "igdk":
        return fit_sphere(points, method, sigma=level, moments=moments)
    return fit_sphere(
        points, "sgdk" if method == BEST else method, sigma=level, noise=noise.shape,
        weights=noise.weights, moments=replace(moments, third=moments.third - level**2 * evidence.skew),
    )  # fmt: skip

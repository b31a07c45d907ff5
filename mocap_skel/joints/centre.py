"""One joint: the common centre of a child's markers in the parent's frame.

A chain of steps: the evidence of the samples, the sphere fit, what skin adds to its error, the point that both
segments share, what anatomy expects, and the verdict.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mocap_skel.joints.choices import Estimation
from mocap_skel.joints.evidence import Evidence
from mocap_skel.joints.joint_fit import CentreFit, from_anatomy, worst_error
from mocap_skel.joints.pooling import by_skin
from mocap_skel.joints.posterior import Estimate, Posterior, combine, with_shared_point
from mocap_skel.joints.priors import Expected
from mocap_skel.joints.samples import Gathered, JointSamples, gather
from mocap_skel.joints.skin import along_axis, skin_error
from mocap_skel.joints.sphere import Sphere, fit_markers
from mocap_skel.joints.verdicts import (
    LEAST_SPREAD,
    Verdict,
    by_error,
    by_movement,
    by_numbers,
    worst,
)
from mocap_skel.segments.pose import Array

# Metres: skin carries a marker by 1 to 3 cm from one extreme of a movement to the other (Leardini et al. 2005, Gait &
# Posture 21), so that a root mean square of 2 cm is more than skin.
MOST_SKIN = 0.02


@dataclass(frozen=True, eq=False)
class PriorKnowledge:
    """What is known of a joint before its samples are looked at. Metres, in the parent's frame.

    Attributes:
        expected: where anatomy has the joint; None for what the motion alone gives.
        looseness: how far the joint is from a ball, as `Segment.looseness`.
        pooled: evidence of other clips, of the same M markers; None without any.
        size: the subject's, 1 for a person of 1.75 m.
    """

    expected: Expected | None = None
    looseness: float = 1.0
    pooled: Evidence | None = None
    size: float = 1.0

    def of(self, markers: NDArray[np.bool_]) -> PriorKnowledge:
        """The same for some of the markers (M,)."""
        return self if self.pooled is None else replace(self, pooled=self.pooled[markers])


# However little a joint moves, so much of its information is left: no covariance is without bounds.
LEAST_SHOWN = 1e-4
_AS_SUITS = Estimation()
_NOTHING = PriorKnowledge()


def fit_centre(
    samples: JointSamples, choice: Estimation = _AS_SUITS, known: PriorKnowledge = _NOTHING
) -> CentreFit | None:
    """Fit the common centre of a child's markers in the parent's frame (thesis 6.6, docs/priors.md).

    Args:
        samples: (frames, M, 3) the markers, metres, with their noise and the parent's frame.
        choice: the method, and where the noise comes from.
        known: what anatomy and other clips know of the joint.

    Returns:
        None where no marker has enough samples. A marker that is never seen has the radius NaN.

    Raises:
        DegenerateSphereError: the method has no answer for these samples; `BEST` always has one.

    >>> from mocap_skel.joints.samples import Frame
    >>> ball = np.random.default_rng(0).normal(size=(500, 1, 3))
    >>> markers = [0.1, 0.2, 0.3] + 0.4 * ball / np.linalg.norm(ball, axis=-1, keepdims=True)
    >>> found = fit_centre(JointSamples(markers, sigma=0.001, own_sigma=0.001, frame=Frame(None)))
    >>> found.centre.round(6), found.radius.round(6), found.method, found.shown
    (array([0.1, 0.2, 0.3]), array([0.4]), 'UGDK', 'yes')
    """
    seen = samples.seen
    if known.pooled is not None:
        seen = seen | (known.pooled.count > 0)
    if seen.all():
        return _fit(samples, choice, known)
    found = _fit(samples.of(seen), choice, known.of(seen))
    return None if found is None else replace(found, radius=_at(seen, found.radius))


def _at(seen: NDArray[np.bool_], radius: Array) -> Array:
    """(M,): the radii of the markers that are seen, NaN for the others."""
    every = np.full(len(seen), np.nan)
    every[seen] = radius
    return every


def _fit(samples: JointSamples, choice: Estimation, known: PriorKnowledge) -> CentreFit | None:
    """The chain, for markers that are all seen somewhere."""
    seen = _together(samples, known)
    if not seen.enough:
        return None
    sphere = fit_markers(seen, choice)
    if known.expected is not None and sphere.failure:
        return from_anatomy(known.expected, sphere.failure, len(sphere.weights))
    movement = by_movement(
        sphere.rank, sphere.weakest_sd, sphere.residual, sphere.evidence.spread_over_noise
    )
    motion = Estimate(sphere.fit.centre, sphere.covariance(movement.shown == "yes"))
    found = _posterior(sphere, motion, known)
    # The worst of what the movement shows, what the numbers say, and what the parent's frame allows.
    verdict = worst(
        Verdict("no", sphere.failure) if sphere.failure else Verdict("yes"),
        movement,
        by_numbers(sphere.residual, worst_error(motion.covariance)),
        Verdict(samples.frame.limit, samples.frame.doubt),
        by_error(worst_error(found.covariance)),
    )
    return _result(sphere, found, verdict, known.expected)


def _together(samples: JointSamples, known: PriorKnowledge) -> Gathered:
    """All evidence; where other clips know more than this one, its samples count less, and the other way round."""
    seen = gather(samples, known.pooled)
    if known.pooled is None or not gather(samples, None).enough:
        return seen
    first = fit_markers(gather(samples, None), _AS_SUITS).evidence
    own, others = by_skin([first, known.pooled], known.looseness)
    return Gathered(samples, seen.own, known.pooled.counted(others), own)


def _posterior(sphere: Sphere, motion: Estimate, known: PriorKnowledge) -> Posterior:
    """The centre with the error that it has, and with anatomy where there is a prior."""
    skin = skin_error(sphere, known.looseness)
    found = motion.widened(skin.covariance)
    frame = sphere.seen.samples.frame
    unseen = frame.by_child or frame.lost
    if frame.limit == "no" or (unseen and known.expected is not None):
        # The frame turns as nobody sees, or as the markers in it do. A pure fit has nothing else.
        found = found.widened(sphere.evidence.reach**2 * np.eye(3))
    if known.expected is not None:
        # A pure fit stays what it is; only a centre that is combined is averaged.
        # The point that both segments share stays where it is in a frame that turns as it should.
        shared = None if frame.lost else sphere.evidence.shared
        found = with_shared_point(found, shared, skin.slide)
        if known.expected.axis is not None:
            found = found.widened(along_axis(sphere, skin, known.expected.axis))
        # Skin on a person who stands still moves the markers too, and shows nothing of the joint.
        moved = (sphere.weakest_sd / (LEAST_SPREAD * known.size)) ** 2
        found = Estimate(found.centre, found.covariance / np.clip(moved, LEAST_SHOWN, 1.0))
    return combine(found, known.expected)


def _result(
    sphere: Sphere, found: Posterior, verdict: Verdict, expected: Expected | None
) -> CentreFit:
    """All there is to say of a fitted centre."""
    radius, residual, covariance = sphere.fit.radius, sphere.residual, found.covariance
    if expected is not None:
        radius, residual = sphere.radius_about(found.centre), sphere.residual_about(found.centre)
        # Skin moves by less. What is beyond it says that markers are elsewhere, those that anatomy starts from too.
        beyond = max(residual**2 - MOST_SKIN**2, 0.0)
        covariance = covariance + beyond * np.eye(3)
    return CentreFit(
        centre=found.centre,
        covariance=covariance,
        samples=int(sphere.evidence.count.sum()),
        effective=float(sphere.evidence.effective.sum()),
        radius=radius,
        residual=residual,
        sigma=float(sphere.fit.sigma),
        weakest_sd=sphere.weakest_sd,
        angle=sphere.angle,
        shown=verdict.shown,
        reason=verdict.reason,
        method=sphere.name,
        axis=sphere.axis,
        hinge=sphere.hinge,
        motion=sphere.fit.centre,
        share=found.share,
        landmarks=() if expected is None else expected.landmarks,
        source="" if expected is None else expected.source,
        anatomy=None if expected is None else expected.mean,
        evidence=sphere.seen.own,
    )

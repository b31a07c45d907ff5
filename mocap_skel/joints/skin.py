"""The error of a centre that skin makes by moving over the bone (``docs/priors.md``)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mocap_skel.joints.sphere import Sphere
from mocap_skel.joints.two_sided import places_of
from mocap_skel.segments.pose import Array

# `benchmarks/coverage.py` prints how often the truth lies within the errors that follow from these numbers.
# The part of skin's slide that is in proportion to the joint's turn looks like another centre and leaves no
# residual: metres a radian of it for each metre of slide that does. For a ball joint; `Segment.looseness`
# times that where the bones themselves roll and glide.
SLIDE = 7.5
# Metres a radian for each metre of reach: skin of a limb of 30 cm goes some centimetre while its joint turns
# by 90 degrees (Leardini 2005), also where a motion is too small to show any of it.
USUAL = 0.02
# The same for a ball joint, whose markers tell by how far they contradict each other what a slide in proportion to
# the turn makes of them one by one; this is what they all have in common, in metres for each metre of slide that
# leaves a residual. Functional hips on skin lie 11 mm from the bone's, 6.4 mm along each axis (Fiorentino 2016), and
# markers in such trials leave 2.7 mm.
COMMON = 2.4


@dataclass(frozen=True, eq=False)
class Skin:
    """What skin does to a centre that was fitted to a motion, which more samples do not mend.

    Attributes:
        covariance: (3, 3), m².
        slide: variance of the slide in proportion to the angle, m².
    """

    covariance: Array
    slide: float


def skin_error(sphere: Sphere, looseness: float = 1.0) -> Skin:
    """The error of a fitted centre that the soft tissue under the markers makes.

    Residuals that follow each other smoothly are the same whenever the joint comes back to the same place:
    they do not average out over frames or markers, only over the places, as many as the markers'
    directions cover. Three parts: such residuals as the noise of a sphere fit; the slide in proportion to
    the angle, which they show the size of only; and what they add to the noise that was taken away, on
    the child and by the parent's frame, of which nobody knows how much is independent of the motion.

    Args:
        sphere: the fit, with the smooth share of its radial residuals.
        looseness: of the joint, 1 for a ball, 2 or 3 where the bones themselves roll and glide.

    A marker 0.4 m below a joint that turns freely, on skin that swells by 5 mm and back:

    >>> from mocap_skel.joints.choices import Estimation
    >>> from mocap_skel.joints.samples import Frame, JointSamples, gather
    >>> from mocap_skel.joints.sphere import fit_markers
    >>> cone = [0.0, 0.0, -2.0] + np.random.default_rng(0).normal(size=(500, 1, 3))
    >>> cone = cone / np.linalg.norm(cone, axis=-1, keepdims=True)
    >>> swelling = 0.005 * np.sin(np.linspace(0.0, 20.0, 500))[:, None, None]
    >>> samples = JointSamples([1.0, 0.0, 0.0] + (0.4 + swelling) * cone, 0.001, 0.001, Frame(None))
    >>> skin = skin_error(fit_markers(gather(samples, None), Estimation()))
    >>> bool(0.003 < np.sqrt(skin.covariance[0, 0]) < 0.03)
    True
    """
    seen = _Directions(sphere)
    hidden = _hidden_slide(seen)
    # What was not solved is no worse for skin.
    solved = sphere.solved
    values, axes = np.linalg.eigh(solved.T @ seen.cap @ solved)
    axes = solved @ axes
    unseen = seen.skin + hidden * float(np.trace(seen.cap))
    known = np.maximum(values, 0.0) * seen.places / unseen + 1.0 / seen.reach**2
    part = (axes / known) @ axes.T
    if looseness > 1.0:
        slide = looseness**2 * (SLIDE**2 * seen.skin / seen.places + hidden)
    else:
        part = _of_markers(seen, part)
        slide = COMMON**2 * seen.skin + hidden
    return Skin(part + slide * np.eye(3), slide)


def _of_markers(seen: _Directions, part: Array) -> Array:
    """(3, 3), m²: the error by how far the markers contradict each other, each one draw of skin."""
    sphere = seen.sphere
    count = len(sphere.weights)
    if count < 2 or not sphere.solved.shape[1]:
        return part
    moments, noise = sphere.evidence.moments, sphere.noise
    weight = sphere.weights * sphere.evidence.freedom
    solved = sphere.solved
    third = moments.third - (sphere.fit.sigma**2) * sphere.evidence.skew
    push = weight[:, None] * (
        np.einsum("pij,pj->pi", seen.moved, sphere.away) + 0.5 * third
    ) @ solved
    system = solved.T @ np.einsum("p,pij->ij", weight, seen.moved) @ solved
    each = count / (count - 1.0) * push.T @ push
    values, axes = np.linalg.eigh(system)
    values = np.maximum(values, np.finfo(float).eps * max(values[-1], np.finfo(float).tiny))
    inverse = (axes / values) @ axes.T
    apart = solved @ (inverse * (np.trace(inverse @ each) / len(values))) @ solved.T
    return part / count + (1.0 - 1.0 / count) * apart


@dataclass(frozen=True, eq=False)
class _Directions:
    """A fit as skin sees it: the directions from its centre to the markers, and how much of them is smooth."""

    sphere: Sphere

    @cached_property
    def reach(self) -> float:
        return self.sphere.evidence.reach

    @cached_property
    def share(self) -> Array:
        """(M,), of all samples."""
        return self.sphere.evidence.share

    @cached_property
    def part(self) -> Array:
        """(3, 3): the projection onto the directions that were solved."""
        return self.sphere.solved @ self.sphere.solved.T

    @cached_property
    def moved(self) -> Array:
        """(M, 3, 3), m²: the markers' covariance without the noise that was taken away."""
        return self.sphere.evidence.moments.covariance - self.sphere.noise

    @cached_property
    def cap(self) -> Array:
        """(3, 3), radians²: scatter of the markers' directions from the centre."""
        least = np.finfo(float).eps * self.reach
        radius = np.maximum(np.linalg.norm(self.sphere.away, axis=1), least)
        return np.asarray(
            self.part @ np.einsum("p,pij->ij", self.share / radius**2, self.moved) @ self.part
        )

    @cached_property
    def smooth(self) -> Array:
        """(M,), m²: variance of the radial residuals that follow each other smoothly."""
        return self.sphere.variance * self.sphere.evidence.smooth

    @cached_property
    def skin(self) -> float:
        """m²: the same of all markers."""
        least = (np.finfo(float).eps * self.reach) ** 2
        return max(float(self.share @ self.smooth), least)

    @cached_property
    def places(self) -> float:
        """How many times the directions cover anew, at least one in each way across their mean."""
        middle = self.sphere.away.T @ self.share
        length = float(np.linalg.norm(middle))
        axis = middle / length if length > 0 else middle
        across = np.eye(3) - np.outer(axis, axis)
        spread = np.linalg.eigvalsh(across @ self.cap @ across)[1:]
        return places_of(spread)


def _hidden_slide(seen: _Directions) -> float:
    """m² a radian²: variance of the slide that may be there although no residual shows it.

    What a slide in proportion to a turn about one axis leaves in the radius is of the third order in the
    turn, so that it shows with the square of the places that the turn takes the marker to; and white
    noise conceals no more than the part of it that `smooth_share` cannot tell from chance.
    """
    unnoticed = 2.0 / np.sqrt(np.maximum(seen.sphere.evidence.count, 1.0))
    usual = (USUAL * seen.reach / seen.places**2) ** 2
    concealed = SLIDE**2 * float(seen.share @ (seen.sphere.variance * unnoticed))
    return usual * concealed / max(usual + concealed, np.finfo(float).tiny)

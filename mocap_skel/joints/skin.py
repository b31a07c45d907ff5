"""The error of a centre that skin makes by moving over the bone (``docs/priors.md``)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mocap_skel.joints.sphere import Sphere
from mocap_skel.joints.two_sided import places_of
from mocap_skel.segments.pose import Array

# The part of skin's slide that is in proportion to the joint's turn looks like another centre and leaves no
# residual: metres a radian of it for each metre of slide that does, times `Segment.looseness`, where the bones
# themselves roll and glide. Five loose joints whose bones were seen ask for 1.4 in the directions that are shown
# (`benchmarks/skin.py`), all references of real clips for 3.3; the rest is a margin by eye, for with less the
# shoulders and knees of walks are worse than anatomy alone.
SLIDE = 6.0
# The same for a ball joint. How far its markers contradict each other tells their own slides; this is what all
# of them have in common: with it a functional hip is 6.6 mm off along each axis (Fiorentino 2016; the sum is in
# `benchmarks/skin.py`).
COMMON = 3.2
# Metres a radian for each metre of reach: skin of a limb of 30 cm goes some centimetre while its joint turns
# by 90 degrees (Leardini 2005), also where a motion is too small to show any of it.
USUAL = 0.02
# Skin carries a marker along the surface by so many times as much as to or from the joint: 1 to 3 cm on a thigh
# (Leardini 2005), where radial residuals are 2 to 4 mm. With 3 and with 10 the joints of real clips are where they are
# with 7, to a millimetre.
ACROSS = 7.0
# Values that are left by any fit: with none, its residuals would say nothing of skin.
LEAST_LEFT = 1.0


@dataclass(frozen=True, eq=False)
class Skin:
    """What skin does to a centre that was fitted to a motion, which more samples do not mend.

    Attributes:
        covariance: (3, 3), m².
        slide: variance of the slide in proportion to the angle, m².
        smooth: variance of the radial residuals that follow each other smoothly, m².
        places: that the markers' directions cover, between which the skin lies anew.
        taken: how many times as large the skin is as its residuals: what a fit takes of it into its centre and radii.
    """

    covariance: Array
    slide: float
    smooth: float
    places: float
    taken: float


def skin_error(sphere: Sphere, looseness: float = 1.0) -> Skin:
    """The error of a fitted centre that the soft tissue under the markers makes.

    Residuals that follow each other smoothly are the same whenever the joint comes back to the same place:
    they do not average out over frames, only over the places, as many as the markers' directions cover. Two
    parts: such residuals as the noise of a sphere fit, for a ball joint as far as its markers contradict each
    other; and the slide in proportion to the angle, which they show the size of only. Of both, the residuals are
    what is left by a fit with as many unknowns as it has.

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
    >>> bool(0.002 < np.sqrt(skin.covariance[0, 0]) < 0.02)
    True
    """
    seen = _Directions(sphere)
    hidden = _hidden_slide(seen)
    # What was not solved is no worse for skin.
    solved = sphere.solved
    values, axes = np.linalg.eigh(solved.T @ seen.cap @ solved)
    axes = solved @ axes
    unseen = seen.taken * seen.skin + hidden * float(np.trace(seen.cap))
    known = np.maximum(values, 0.0) * seen.places / unseen + 1.0 / seen.reach**2
    part = (axes / known) @ axes.T
    rate = SLIDE * looseness if looseness > 1.0 else COMMON
    slide = rate**2 * seen.taken * seen.skin / seen.places + looseness**2 * hidden
    if looseness <= 1.0:
        part = _of_markers(seen, part)
    covariance = part + slide * np.eye(3)
    return Skin(covariance, slide, seen.skin, seen.places, seen.taken)


def along_axis(sphere: Sphere, skin: Skin, axis: Array) -> Array:
    """(3, 3), m²: what a joint that bends about an axis does not show of its place along it.

    Along the axis a centre is told by how far its markers swing along it: with the bones, or with the skin on them. The
    share of that swing's variance that skin makes leads the centre so much of the way to where the markers are.

    Args:
        sphere: the fit.
        skin: what `skin_error` says of it.
        axis: (3,), a unit vector.
    """
    moved = sphere.evidence.over_markers(sphere.evidence.moments.covariance - sphere.noise)
    by_skin = ACROSS**2 * skin.smooth
    share = by_skin / max(float(axis @ moved @ axis), by_skin)
    return np.asarray((share * sphere.evidence.reach) ** 2 * np.outer(axis, axis))


def _of_markers(seen: _Directions, part: Array) -> Array:
    """(3, 3), m²: the error by how far the markers contradict each other, each one draw of skin.

    Each marker pulls at the common centre; the pulls add up to nothing, and their scatter is the error's (White
    1980, "sandwich"). It is a mean over the directions, in proportion to the inverse of what the fit knows of
    them. One marker contradicts nobody: of M draws the scatter counts for M - 1.

    Args:
        seen: the fit.
        part: (3, 3), m², the error by the places, for a fit whose markers say nothing of each other.
    """
    sphere, count = seen.sphere, len(seen.share)
    if count < 2 or sphere.rank == 0:
        return part
    evidence, solved = sphere.evidence, sphere.solved
    weight = sphere.weights * evidence.freedom
    third = evidence.moments.third - sphere.fit.sigma**2 * evidence.skew
    pulls = np.einsum("pij,pj->pi", seen.moved, sphere.away) + 0.5 * third
    # Of a pull only the smooth share is skin's; noise has its own bound.
    pulls = (weight * np.sqrt(evidence.smooth))[:, None] * pulls @ solved
    scatter = count / (count - 1.0) * pulls.T @ pulls
    values, axes = np.linalg.eigh(solved.T @ np.einsum("p,pij->ij", weight, seen.moved) @ solved)
    # No less than rounding leaves of a marker that turned all around.
    values = np.maximum(values, np.finfo(float).eps * seen.reach**2 * float(weight.sum()))
    level = float(np.trace((axes.T @ scatter @ axes) / values[:, None])) / len(values)
    # A size that is known from few draws has the tails of Student's: its variance by their number.
    draws = len(values) * (count - 1)
    level *= draws / max(draws - 2, 1)
    # Nothing is known worse than to the reach, as for the places.
    variance = level / (values + level / seen.reach**2)
    known = solved @ axes
    return np.asarray(part / count + (1.0 - 1.0 / count) * (known * variance) @ known.T)


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
    def taken(self) -> float:
        """How many times as large the skin is as its residuals, for so many of its values have gone into the fit.

        Skin has one value for each marker in each place; the centre and the radii are fitted to these.
        """
        values = len(self.share) * self.places
        return values / max(values - len(self.share) - self.sphere.rank, LEAST_LEFT)

    @cached_property
    def places(self) -> float:
        """How many times the directions cover anew, at least one in each way across their mean."""
        middle = self.sphere.away.T @ self.share
        length = float(np.linalg.norm(middle))
        axis = middle / length if length > 0 else middle
        across = np.eye(3) - np.outer(axis, axis)
        spread = np.linalg.eigvalsh(across @ self.cap @ across)[1:]
        return places_of(np.asarray(spread))


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

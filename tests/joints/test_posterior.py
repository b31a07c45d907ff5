"""Motion and anatomy together: limits and invariances. Hypothesis draws the rest.

Algebra of 3×3 matrices with condition numbers below 1e6 is held to 1e-9 relative.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mocap_skel.artificial.rotations import from_vector
from mocap_skel.joints.posterior import Estimate, combine, with_shared_point
from mocap_skel.joints.priors import Expected
from mocap_skel.joints.two_sided import SharedPoint

vectors = st.tuples(*[st.floats(-3, 3)] * 3).map(np.array)
sds = st.tuples(*[st.floats(1e-3, 1.0)] * 3).map(np.array)


def expected(mean=(0.0, 0.0, 0.0), sd=0.02):
    return Expected(np.array(mean), sd**2 * np.eye(3), ("A",), "s")


def combined(centre, cov, prior):
    return combine(Estimate(centre, cov), prior)


def averaged(centre, cov, point, slide):
    found = with_shared_point(Estimate(centre, cov), point, slide)
    return found.centre, found.covariance


def covariance(sd, turn=(0.0, 0.0, 0.0)):
    rotation = from_vector(np.array(turn))
    return rotation @ np.diag(np.square(sd)) @ rotation.T


# --- combine


def test_without_anatomy_the_motion_stays_what_it_is():
    cov = covariance([0.1, 0.2, 0.3], (1.0, 0.5, 0.2))
    found = combined(np.array([1.0, 2.0, 3.0]), cov, None)
    assert (found.centre == [1.0, 2.0, 3.0]).all()
    assert (found.covariance == cov).all()
    assert found.share == 1.0


def test_a_motion_that_knows_nothing_leaves_anatomy():
    prior = expected((0.1, 0.2, 0.3))
    found = combined(np.array([0.5, 0.5, 0.5]), 1e6 * np.eye(3), prior)
    assert np.abs(found.centre - prior.mean).max() < 1e-9
    # The share is that of the variances, 4e-4 of 1e6.
    assert np.abs(found.covariance / prior.covariance.max() - np.eye(3)).max() < 1e-6
    assert found.share == pytest.approx(4e-10, rel=1e-5, abs=1e-15)


def test_an_exact_motion_belongs_to_itself():
    centre = np.array([0.01, 0.0, 0.0])
    found = combined(centre, np.zeros((3, 3)), expected())
    assert (found.centre == centre).all()
    assert (found.covariance == 0).all()
    assert found.share == 1.0


def test_each_direction_by_its_own_information():
    """A hinge: exact across its axis, nothing along it."""
    found = combined(np.array([0.01, 0.01, 0.01]), np.diag([1e-12, 1e6, 1e-12]), expected())
    assert found.centre == pytest.approx([0.01, 0.0, 0.01], abs=1e-9)
    assert found.share == pytest.approx(2 / 3, abs=1e-6)


def test_two_that_know_alike_meet_halfway():
    found = combined(np.array([0.02, 0.0, 0.0]), 0.02**2 * np.eye(3), expected(sd=0.02))
    assert found.centre == pytest.approx([0.01, 0, 0])
    assert found.covariance == pytest.approx(0.5 * 0.02**2 * np.eye(3))
    assert found.share == pytest.approx(0.5)


def test_information_adds_up_whatever_the_directions_of_both():
    """(P⁻¹ + S⁻¹)⁻¹ of docs/priors.md, for ellipsoids that lie askew; no contradiction."""
    p, s = covariance([0.01, 0.02, 0.03], (1, 2, 3)), covariance([0.03, 0.01, 0.02], (-1, 0.5, 0))
    centre, mean = np.array([0.01, 0.0, 0.0]), np.array([0.0, 0.005, 0.0])
    found = combined(centre, p, Expected(mean, s, ("A",), "s"))
    both = np.linalg.inv(np.linalg.inv(p) + np.linalg.inv(s))
    assert found.covariance == pytest.approx(both, rel=1e-9, abs=1e-12)
    assert found.centre == pytest.approx(
        both @ (np.linalg.solve(p, centre) + np.linalg.solve(s, mean))
    )
    assert found.share == pytest.approx(np.trace(both @ np.linalg.inv(p)) / 3)


@pytest.mark.parametrize("sds_apart", [0.0, 1.0, 1.73, 1.74, 3.0, 10.0])
def test_a_contradiction_widens_the_error_by_birges_factor(sds_apart):
    """χ² of the difference over its three degrees of freedom, never below one."""
    sd = 0.02 * np.sqrt(2)
    found = combined(np.array([sds_apart * sd, 0, 0]), 0.02**2 * np.eye(3), expected(sd=0.02))
    factor = max(sds_apart**2 / 3, 1.0)
    assert found.covariance == pytest.approx(factor * 0.5 * 0.02**2 * np.eye(3))
    # The place does not move by it.
    assert found.centre == pytest.approx([sds_apart * sd / 2, 0, 0])


@settings(max_examples=80, deadline=None)
@given(vectors, sds, vectors, vectors, st.floats(1e-3, 1.0))
def test_the_covariance_is_one_and_the_share_a_share(centre, sd, turn, mean, prior_sd):
    found = combined(centre, covariance(sd, turn), expected(mean, prior_sd))
    assert (found.covariance == found.covariance.T).all()
    assert np.linalg.eigvalsh(found.covariance)[0] > 0
    assert 0 <= found.share <= 1
    # Without a contradiction, both together know more than either.
    calm = combined(centre, covariance(sd, turn), expected(centre, prior_sd)).covariance
    for one in (covariance(sd, turn), prior_sd**2 * np.eye(3)):
        assert np.linalg.eigvalsh(one - calm)[0] > -1e-9


@settings(max_examples=80, deadline=None)
@given(vectors, sds, vectors, vectors, vectors, vectors)
def test_turning_and_moving_the_frame_turns_and_moves_the_answer(c, sd, turn, mean, about, shift):
    rotation = from_vector(about)
    cov = covariance(sd, turn)
    prior = expected(mean)
    first = combined(c, cov, prior)
    moved = combined(
        rotation @ c + shift,
        rotation @ cov @ rotation.T,
        Expected(
            rotation @ prior.mean + shift, rotation @ prior.covariance @ rotation.T, ("A",), "s"
        ),
    )
    assert np.abs(moved.centre - (rotation @ first.centre + shift)).max() < 1e-8
    scale = np.abs(first.covariance).max()
    assert np.abs(moved.covariance - rotation @ first.covariance @ rotation.T).max() < 1e-8 * scale
    assert moved.share == pytest.approx(first.share, abs=1e-9)


# --- the shared point


# Turns of `shared` that cover less than a place each way, 0.4² / 12, and the places of others: the product of the
# two larger widths √12 √(½ trace - turn) over 0.4.
SMALL = (0.01, 0.01, 0.01)


def places(turns):
    width = np.sqrt(12 * (0.5 * sum(turns) - np.sort(turns)[:2])) / 0.4
    return np.prod(np.maximum(width, 1.0))


def shared(centre=(0.0, 0.0, 0.0), turns=(0.2, 0.2, 0.2), residual=1e-4):
    return SharedPoint(np.array(centre), np.diag(turns), residual)


def test_no_shared_point_no_change():
    motion = Estimate(np.array([1.0, 0, 0]), np.eye(3))
    for nothing in (None, shared(residual=0.0), shared(residual=float("nan"))):
        assert with_shared_point(motion, nothing, 1e-4) is motion


def test_what_did_not_turn_is_the_spheres_with_half_its_information():
    """Equal shares: along a direction of which only one knows, it keeps its place and half its information."""
    centre, cov = np.array([0.01, 0.02, 0.03]), covariance([0.01, 0.02, 0.03])
    found, wider = averaged(centre, cov, shared(turns=(0.0, 0.0, 0.0)), 1e-4)
    assert found == pytest.approx(centre)
    assert wider == pytest.approx(2 * cov)


def test_two_that_know_alike_meet_halfway_and_know_no_more():
    assert places(SMALL) == 1
    known = shared(turns=SMALL, residual=1e-6)
    # Of one place a third is left at least.
    variance = 1e-6 / (1 / 3) / 0.01
    centre, cov = averaged(np.array([0.02, 0, 0]), variance * np.eye(3), known, 0.0)
    assert centre == pytest.approx([0.01, 0, 0])
    assert cov == pytest.approx(variance * np.eye(3))


def test_a_point_that_slides_is_known_by_its_slide():
    """1 / (residual / (places - 2) / turns + slide) along each direction, half of that and of the sphere's."""
    known = shared(turns=(0.5, 0.25, 1.0), residual=1e-4)
    centre, cov = averaged(np.array([0.02, 0.02, 0.02]), 1e-3 * np.eye(3), known, 2e-4)
    left = places((0.5, 0.25, 1.0)) - 2
    assert left > 1
    its = 1 / (1e-4 / left / np.array([0.5, 0.25, 1.0]) + 2e-4)
    assert centre == pytest.approx(0.02 * 1000 / (1000 + its))
    assert cov == pytest.approx(np.diag(2 / (1000 + its)))


@settings(max_examples=50, deadline=None)
@given(vectors, sds, vectors, vectors, vectors, st.floats(1e-6, 1e-2), st.floats(0, 1e-3))
def test_the_frame_does_not_matter_to_the_shared_point(c, sd, turn, point, about, residual, slide):
    rotation = from_vector(about)
    cov, one = covariance(sd, turn), shared(point, (0.5, 0.1, 0.0), residual)
    first = averaged(c, cov, one, slide)
    turned = SharedPoint(rotation @ one.centre, rotation @ one.turns @ rotation.T, residual)
    found = averaged(rotation @ c, rotation @ cov @ rotation.T, turned, slide)
    assert np.abs(found[0] - rotation @ first[0]).max() < 1e-6
    assert np.abs(found[1] - rotation @ first[1] @ rotation.T).max() < 1e-6
    # Neither adds to what the other knows: never narrower than the narrower of both.
    assert np.linalg.eigvalsh(found[1])[0] > 0

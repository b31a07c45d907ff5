"""The point that two segments share: exact where the poses are, free of the frames' choice, blind along a hinge.

Exact data are held to 1e-9 m: sums of 200 rotations, solved with a condition number below 100.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mocap_skel.artificial.rotations import from_vector
from mocap_skel.joints.two_sided import shared_point
from mocap_skel.segments.pose import Pose

EXACT = 1e-9
# Radians: smaller turns are the wobble of poses.
LEAST_TURN = 0.03
CENTRE = np.array([0.03, -0.02, -0.4])
OWN = np.array([0.01, 0.05, 0.2])

vectors = st.tuples(*[st.floats(-3, 3)] * 3).map(np.array)


def poses(turns, seed=1, noise=0.0, own=OWN):
    """A parent that moves about and a child that turns in it about CENTRE, `own` in the child."""
    rng = np.random.default_rng(seed)
    frames = len(turns)
    walk = np.cumsum(0.05 * rng.standard_normal((frames, 3)), axis=0)
    parent = Pose(
        from_vector(np.cumsum(0.1 * rng.standard_normal((frames, 3)), axis=0)), walk + 1.0
    )
    rotation = parent.rotation @ from_vector(turns)
    origin = parent.to_lab(CENTRE) - rotation @ own
    return parent, Pose(rotation, origin + noise * rng.standard_normal((frames, 3)))


def ball(frames=200, seed=2, size=0.5):
    return size * np.random.default_rng(seed).standard_normal((frames, 3))


def hinge(frames=200, axis=(0.0, 1.0, 0.0)):
    return np.sin(np.linspace(0, 9, frames))[:, None] * np.array(axis)


def test_exact_poses_give_the_exact_point():
    found = shared_point(*poses(ball()))
    assert np.abs(found.centre - CENTRE).max() < EXACT
    assert found.residual < EXACT**2


def test_turns_are_one_less_the_mean_rotation():
    turns = ball()
    found = shared_point(*poses(turns))
    mean = from_vector(turns).mean(axis=0)
    whole = np.eye(3) - mean @ mean.T
    assert np.abs(found.turns - (whole - LEAST_TURN**2 * np.eye(3))).max() < EXACT
    assert np.abs(found.turns - found.turns.T).max() < EXACT


def test_a_hinge_says_nothing_along_its_axis():
    """Across it the point is exact; along it, it lies beside the child's origin and claims nothing."""
    axis = np.array([0.0, 1.0, 0.0])
    found = shared_point(*poses(hinge(axis=axis)))
    assert found.turns @ axis == pytest.approx(0.0, abs=EXACT)
    across = np.eye(3) - np.outer(axis, axis)
    assert np.abs(across @ (found.centre - CENTRE)).max() < EXACT
    # The child's origin lies OWN before its joint, and a hinge keeps that along its axis.
    assert axis @ (found.centre - CENTRE) == pytest.approx(-OWN[1], abs=EXACT)
    assert np.linalg.eigvalsh(found.turns)[1] > 0.1


def test_segments_that_do_not_turn_share_no_point():
    found = shared_point(*poses(np.zeros((50, 3))))
    assert np.abs(found.turns).max() < EXACT
    assert np.isfinite(found.centre).all()


def test_turns_within_the_wobble_of_poses_are_none():
    found = shared_point(*poses(0.5 * LEAST_TURN * ball(size=1.0)))
    assert np.abs(found.turns).max() < EXACT


@settings(max_examples=30, deadline=None)
@given(vectors, vectors, vectors, vectors)
def test_how_the_frames_are_drawn_does_not_matter(turn, shift, child_turn, child_shift):
    """Another frame of the child: the same point. Another of the parent: the point in that frame."""
    parent, child = poses(ball(60), noise=0.002)
    drift = 0.005 * np.sin(np.linspace(0, 9, 60))[:, None] * [1.0, 0.5, 0.0]
    child = Pose(child.rotation, child.origin + np.einsum("fij,fj->fi", parent.rotation, drift))
    first = shared_point(parent, child)
    assert first.residual > 1e-6
    other = from_vector(turn)
    new_parent = Pose(parent.rotation @ other, parent.to_lab(shift))
    new_child = Pose(child.rotation @ from_vector(child_turn), child.to_lab(child_shift))
    found = shared_point(new_parent, new_child)
    # Condition 10, lengths of metres.
    assert np.abs(shift + other @ found.centre - first.centre).max() < 1e-8
    assert np.abs(other @ found.turns @ other.T - first.turns).max() < 1e-8
    assert abs(found.residual - first.residual) < 1e-10


@pytest.mark.parametrize("known", [0, 3])
def test_fewer_than_four_frames_are_none(known):
    parent, child = poses(ball(10))
    origin = child.origin.copy()
    origin[known:] = np.nan
    assert shared_point(parent, Pose(child.rotation, origin)) is None


def test_frames_that_one_of_both_does_not_know_are_left_out():
    parent, child = poses(ball())
    rotation, origin = child.rotation.copy(), child.origin.copy()
    rotation[::3], origin[::3] = np.nan, np.nan
    found = shared_point(parent, Pose(rotation, origin))
    assert np.abs(found.centre - CENTRE).max() < EXACT


def test_noise_gives_the_error_of_its_law():
    """Var(c) = σ² (1/N + R̄ (N (I - R̄ᵀR̄))⁻¹ R̄ᵀ) per direction for white noise of the child's origin; 200 seeds.

    The mean square of 600 numbers is off by √(2/600) = 6 %, or 17 % at three of these.
    """
    turns, sigma = ball(100, size=0.6), 0.003
    mean = from_vector(turns).mean(axis=0)
    inner = np.linalg.inv(len(turns) * (np.eye(3) - mean.T @ mean))
    law = sigma**2 * (np.eye(3) / len(turns) + mean @ inner @ mean.T)
    errors = []
    for seed in range(200):
        parent, child = poses(turns, seed=seed, noise=sigma)
        errors.append(shared_point(parent, child).centre - CENTRE)
    found = np.mean(np.square(errors))
    assert found == pytest.approx(np.trace(law) / 3, rel=0.17)


def test_only_what_is_smooth_in_time_is_a_residual():
    """White noise averages out; a slow wander of the point does not, and is there with its variance."""
    white = shared_point(*poses(ball(2000), noise=0.005))
    assert white.residual < 0.1 * 0.005**2
    parent, child = poses(ball(2000))
    slow = 0.01 * np.sqrt(2) * np.sin(np.linspace(0, 40, 2000))[:, None] * [0.0, 0.0, 1.0]
    wander = np.einsum("fij,fj->fi", parent.rotation, slow)
    found = shared_point(parent, Pose(child.rotation, child.origin + wander))
    # A third, for it is a mean over directions; what the fit takes up of it is small.
    assert found.residual == pytest.approx(0.01**2 / 3, rel=0.15)

"""The way inward from a marker beside a hinge.

Exact geometry is held to 1e-9 m: some tens of operations on numbers of order 1, and the eigenvectors of
well separated values. Seeds are named where numbers are drawn.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from limbs import KNEE, limb
from scipy.special import erf

from mocap_skel.artificial.rotations import from_vector
from mocap_skel.joints.hinge import (
    BONE_ERROR,
    CARRYING_ERROR,
    Turning,
    half_log_odds,
    inward,
    turning,
)
from mocap_skel.segments.pose import Pose
from mocap_skel.spherefit import sphere_moments

EXACT = 1e-9
vectors = st.tuples(*[st.floats(-3, 3)] * 3).map(np.array)


def direction(*args, **more):
    return inward(*args, **more).direction


def law(above, below, shift, inwards):
    """What `inward` is to give: the part of the way in the bones' plane, and the rest as far as the side is sure."""
    normal = np.cross(above, below)
    # The bones' plane is off where their ends are: by so many of these standard deviations it is bent.
    sure = erf(abs(inwards @ normal) / error_of(above, below) / np.sqrt(2))
    axis = shift.hinge * normal / np.linalg.norm(normal)
    left = inwards @ axis
    found = inwards - left * axis + left * axis * sure
    return found / np.linalg.norm(found)


def error_of(above, below):
    """Metres²: of the product of both bones."""
    upper, lower = np.linalg.norm(above), np.linalg.norm(below)
    return np.hypot(BONE_ERROR * lower, CARRYING_ERROR * upper)


@pytest.mark.parametrize("degrees", [1, 5, 20, 45, 90, 120, 150])
def test_the_way_inward_of_a_perfect_hinge_is_exact(degrees):
    above, below, inwards = limb(np.deg2rad(degrees))
    found = direction(above, below, KNEE, 1.0)
    # The error function is exact to three digits.
    assert np.abs(found - law(above, below, KNEE, inwards)).max() < 0.002
    # What the doubt of a nearly straight limb costs is in the covariance; here it stays within 15 mm.
    assert np.linalg.norm(found - inwards) * KNEE.by < (0.001 if degrees >= 45 else 0.015)


def test_a_straight_limb_still_tells_the_way_by_the_depth_alone():
    """The bones are a line, the marker is beside it; which side it bends to is not needed."""
    above, below, inwards = limb(0.0)
    for hinge in (1, -1):
        found = direction(above, below, replace(KNEE, hinge=hinge), 1.0)
        # The root of rounding: what is left of a length of one.
        assert np.abs(found - inwards).max() < 1e-7


def test_the_other_sense_is_the_other_side():
    above, below, inwards = limb(np.deg2rad(80), replace(KNEE, by=1e-9, beside=1e-9))
    for hinge in (1, -1):
        found = direction(above, below, replace(KNEE, hinge=hinge, by=1e-9, beside=1e-9), 1.0)
        assert np.abs(found - hinge * inwards).max() < 1e-7


@pytest.mark.parametrize("degrees", [0, 10, 60, 130])
def test_the_mirrored_limb_has_the_mirrored_way(degrees):
    mirror = np.array([1.0, -1.0, 1.0])
    above, below, _ = limb(np.deg2rad(degrees))
    left = direction(above * mirror, below * mirror, replace(KNEE, hinge=-1), 1.0)
    assert np.abs(left - mirror * direction(above, below, KNEE, 1.0)).max() < EXACT


@settings(max_examples=50, deadline=None)
@given(vectors, st.floats(0.02, 2.5), st.floats(0.5, 2.0))
def test_a_turned_and_larger_limb_has_the_turned_way(turn, bend, size):
    rotation = from_vector(turn)
    above, below, _ = limb(bend)
    swing = np.diag([0.01, 0.001, 0.02])
    found = direction(above, below, KNEE, 1.0, swing)
    other = direction(
        size * rotation @ above,
        size * rotation @ below,
        KNEE,
        size,
        size**2 * rotation @ swing @ rotation.T,
    )
    assert np.abs(other - rotation @ found).max() < 1e-7
    assert abs(np.linalg.norm(found) - 1) < EXACT


def test_a_bend_that_moves_is_known_by_the_mean_and_its_spread():
    """The lower end of a hinge keeps to a plane: its spread is square to the way inward, and says so."""
    bends = np.linspace(0.0, 1.8, 200)
    above, below, inwards = limb(bends)
    moments = sphere_moments(below)
    found = direction(above, moments.mean, KNEE, 1.0, moments.covariance)
    assert np.linalg.norm(found - inwards) * KNEE.by < 0.001


def test_frames_are_independent_of_each_other():
    above, below, _ = limb(np.deg2rad([10.0, 50.0, 100.0]))
    together = direction(np.broadcast_to(above, below.shape), below, KNEE, 1.0)
    each = [direction(above, one, KNEE, 1.0) for one in below]
    assert np.abs(together - each).max() < EXACT


def test_nan_in_nan_out_and_nowhere_else():
    above, below, _ = limb(np.deg2rad([10.0, 50.0, 100.0]))
    above = np.tile(above, (3, 1))
    above[0, 1] = np.nan
    below[2] = np.nan
    found = direction(above, below, KNEE, 1.0)
    assert np.isnan(found[[0, 2]]).all()
    assert np.isfinite(found[1]).all()


def test_markers_and_joints_in_one_place_have_no_way():
    assert np.isnan(direction(np.zeros(3), np.zeros(3), KNEE, 1.0)).all()


def test_an_end_that_lies_aside_itself():
    """The greater trochanter, in place of the hip joint, lies farther out than the marker of the knee."""
    above, below, inwards = limb(0.6)
    outside = np.array([0.0, -0.08, 0.0])
    found = direction(above - outside, below, KNEE, 1.0, 0.0, 0.08)
    assert np.linalg.norm(found - inwards) * KNEE.by < 0.001


def test_conditions_that_contradict_each_other_count_by_their_errors():
    """The bone above to 2 cm, the one below, which leans, to 4: solved by hand, bones along -z and x."""
    upper, lower, depth, beside, swing = 0.4, 0.3, 0.054, 0.043, 0.2
    found = direction(
        np.array([0.0, 0.0, -upper]), np.array([lower, 0.0, 0.0]), KNEE, 1.0,
        np.diag([0.0, 0.0, swing**2]),
    )  # fmt: skip
    # Least squares of -0.4 z = -depth, and of 0.2 z = 0, for the shank swings by so much up and down.
    z = upper * depth / 0.02**2 / (upper**2 / 0.02**2 + swing**2 / 0.04**2)
    x = (depth - beside) / lower
    # The rest of the length; of a bend of 90 degrees nobody doubts. The normal is -z × x = -y.
    y = -np.sqrt(1 - x**2 - z**2)
    assert found == pytest.approx([x, y, z], abs=1e-6)


def test_the_chance_of_a_side_is_that_of_a_normal_error():
    x = np.linspace(0, 5, 51)
    assert np.tanh(half_log_odds(x)) == pytest.approx(erf(x / np.sqrt(2)), abs=0.0015)


# --- the axis that the turn shows


def bending(degrees, axis=(0.0, 1.0, 0.0), frames=200):
    """A shank that bends about an axis, there and back twice: both poses, and its far end in the thigh."""
    bend = np.deg2rad(degrees) * 0.5 * (1 - np.cos(np.linspace(0, 4 * np.pi, frames)))
    turn = from_vector(bend[:, None] * np.asarray(axis))
    thigh = Pose(np.tile(np.eye(3), (frames, 1, 1)), np.zeros((frames, 3)))
    knee = np.array([0.0, 0.0, -0.4])
    return thigh, Pose(turn, np.tile(knee, (frames, 1))), knee + turn @ [0.0, 0.0, -0.4]


def test_a_hinge_turns_about_its_axis_and_its_bend_tells_the_side():
    """The thigh's markers lie above the knee: bending brings the shank's end nearer to them."""
    for side in (1.0, -1.0):
        thigh, shank, far = bending(60, (0.0, side, 0.0))
        found = turning(thigh, shank, far, np.array([0.0, 0.0, -0.2]))
        assert found.shown
        values, axes = np.linalg.eigh(found.spread)
        assert abs(axes[1, 0]) == pytest.approx(1, abs=EXACT)
        assert values[0] == pytest.approx(0, abs=EXACT)
        # I - R̄R̄ᵀ of turns about one axis is 1 - |mean of e^{iθ}|² across it.
        bend = np.deg2rad(60) * 0.5 * (1 - np.cos(np.linspace(0, 4 * np.pi, 200)))
        assert values[1] == pytest.approx(1 - abs(np.exp(1j * bend).mean()) ** 2, abs=EXACT)
        assert found.clue @ [0.0, side, 0.0] > 2


def test_a_joint_that_does_not_turn_shows_no_axis():
    thigh, shank, far = bending(0)
    assert not turning(thigh, shank, far, np.zeros(3)).shown
    few = np.where(np.arange(200)[:, None] < 3, far, np.nan)
    assert turning(thigh, shank, few, np.zeros(3)) is None


def test_the_turn_tells_the_way_of_a_limb_without_an_upper_joint():
    _, below, inwards = limb(np.deg2rad(np.linspace(0, 90, 50)))
    moments = sphere_moments(below)
    # A right knee bends to the right-handed side of -inward.
    spread = np.diag([0.2, 0.0, 0.2])
    found, error = inward(
        None, moments.mean, KNEE, 1.0, moments.covariance, turn=Turning(spread, 0.999 * inwards)
    )
    assert np.linalg.norm(found - inwards) * KNEE.by < 0.001
    # The side is sure, and along the way its length of one is.
    assert inwards @ error @ inwards < 1e-4
    assert np.linalg.eigvalsh(error)[1] > 1e-4


def test_a_side_that_nothing_tells_is_a_full_error_along_the_axis():
    """No bend, no upper joint: either side, so nothing is gone inward, and the error is the depth's."""
    spread = np.diag([0.2, 0.0, 0.2])
    _, error = inward(
        None,
        np.array([0.0, 0.0, -0.4]),
        replace(KNEE, beside=KNEE.by),
        1.0,
        turn=Turning(spread, np.zeros(3)),
    )
    assert error[1, 1] == pytest.approx(1, abs=EXACT)


def test_a_limb_that_hangs_straight_is_told_by_the_way_of_the_pelvis():
    above, below, inwards = limb(0.0, replace(KNEE, beside=KNEE.by))
    knee = replace(KNEE, beside=KNEE.by, straight=("RFWT", "LFWT"), turned=0.35)
    found, _ = inward(above, below, knee, 1.0, straight=inwards)
    assert np.linalg.norm(found - inwards) * KNEE.by < 0.001

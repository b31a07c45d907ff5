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

from mocap_skel.artificial.rotations import from_vector
from mocap_skel.joints.hinge import inward
from mocap_skel.spherefit import sphere_moments

EXACT = 1e-9
# Sine of the bend from which the plane of the bones tells the axis.
LEAST_BEND = 0.15
vectors = st.tuples(*[st.floats(-3, 3)] * 3).map(np.array)


def law(above, below, shift, inwards):
    """What `inward` is to give: the part of the way in the bones' plane, and the rest less where they are straight."""
    normal = np.cross(above, below)
    sine = np.linalg.norm(normal) / (np.linalg.norm(above) * np.linalg.norm(below))
    axis = shift.hinge * normal / np.linalg.norm(normal)
    left = inwards @ axis
    found = inwards - left * axis + left * axis * sine**2 / (sine**2 + LEAST_BEND**2)
    return found / np.linalg.norm(found)


@pytest.mark.parametrize("degrees", [1, 5, 20, 45, 90, 120, 150])
def test_the_way_inward_of_a_perfect_hinge_is_exact(degrees):
    above, below, inwards = limb(np.deg2rad(degrees))
    found = inward(above, below, KNEE, 1.0)
    assert np.abs(found - law(above, below, KNEE, inwards)).max() < EXACT
    # What the doubt of a nearly straight limb costs stays within the prior's own sd, 15 mm.
    assert np.linalg.norm(found - inwards) * KNEE.by < (0.001 if degrees >= 45 else 0.015)


def test_a_straight_limb_still_tells_the_way_by_the_depth_alone():
    """The bones are a line, the marker is beside it; which side it bends to is not needed."""
    above, below, inwards = limb(0.0)
    for hinge in (1, -1):
        found = inward(above, below, replace(KNEE, hinge=hinge), 1.0)
        # The root of rounding: what is left of a length of one.
        assert np.abs(found - inwards).max() < 1e-7


def test_the_other_sense_is_the_other_side():
    above, below, inwards = limb(np.deg2rad(80), replace(KNEE, by=1e-9, beside=1e-9))
    for hinge in (1, -1):
        found = inward(above, below, replace(KNEE, hinge=hinge, by=1e-9, beside=1e-9), 1.0)
        assert np.abs(found - hinge * inwards).max() < 1e-7


@pytest.mark.parametrize("degrees", [0, 10, 60, 130])
def test_the_mirrored_limb_has_the_mirrored_way(degrees):
    mirror = np.array([1.0, -1.0, 1.0])
    above, below, _ = limb(np.deg2rad(degrees))
    left = inward(above * mirror, below * mirror, replace(KNEE, hinge=-1), 1.0)
    assert np.abs(left - mirror * inward(above, below, KNEE, 1.0)).max() < EXACT


@settings(max_examples=50, deadline=None)
@given(vectors, st.floats(0.02, 2.5), st.floats(0.5, 2.0))
def test_a_turned_and_larger_limb_has_the_turned_way(turn, bend, size):
    rotation = from_vector(turn)
    above, below, _ = limb(bend)
    swing = np.diag([0.01, 0.001, 0.02])
    found = inward(above, below, KNEE, 1.0, swing)
    other = inward(
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
    found = inward(above, moments.mean, KNEE, 1.0, moments.covariance)
    assert np.linalg.norm(found - inwards) * KNEE.by < 0.001


def test_frames_are_independent_of_each_other():
    above, below, _ = limb(np.deg2rad([10.0, 50.0, 100.0]))
    together = inward(np.broadcast_to(above, below.shape), below, KNEE, 1.0)
    each = [inward(above, one, KNEE, 1.0) for one in below]
    assert np.abs(together - each).max() < EXACT


def test_nan_in_nan_out_and_nowhere_else():
    above, below, _ = limb(np.deg2rad([10.0, 50.0, 100.0]))
    above = np.tile(above, (3, 1))
    above[0, 1] = np.nan
    below[2] = np.nan
    found = inward(above, below, KNEE, 1.0)
    assert np.isnan(found[[0, 2]]).all()
    assert np.isfinite(found[1]).all()


def test_markers_and_joints_in_one_place_have_no_way():
    assert np.isnan(inward(np.zeros(3), np.zeros(3), KNEE, 1.0)).all()


def test_an_end_that_lies_aside_itself():
    """The greater trochanter, in place of the hip joint, lies farther out than the marker of the knee."""
    above, below, inwards = limb(0.6)
    outside = np.array([0.0, -0.08, 0.0])
    found = inward(above - outside, below, KNEE, 1.0, 0.0, 0.08)
    assert np.linalg.norm(found - inwards) * KNEE.by < 0.001


def test_conditions_that_contradict_each_other_count_by_their_errors():
    """The bone above to 2 cm, the one below, which leans, to 4: solved by hand, bones along -z and x."""
    upper, lower, depth, beside, swing = 0.4, 0.3, 0.054, 0.043, 0.2
    found = inward(
        np.array([0.0, 0.0, -upper]), np.array([lower, 0.0, 0.0]), KNEE, 1.0,
        np.diag([0.0, 0.0, swing**2]),
    )  # fmt: skip
    # Least squares of -0.4 z = -depth, and of 0.2 z = 0, for the shank swings by so much up and down.
    z = upper * depth / 0.02**2 / (upper**2 / 0.02**2 + swing**2 / 0.04**2)
    x = (depth - beside) / lower
    # The rest of the length, less what a doubt of the bend takes; the normal is -z × x = -y.
    y = -np.sqrt(1 - x**2 - z**2) / (1 + LEAST_BEND**2)
    assert found == pytest.approx(np.array([x, y, z]) / np.linalg.norm([x, y, z]), abs=EXACT)

"""Sequences of turns against SciPy's, and the rates of their angles against small turns."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mocap_skel.angles.sequences import (
    LOCK,
    about_their_mean,
    angles_by_turn,
    angles_of,
    locked,
    settled,
    unwrapped,
)

ALL = [a + b + c for a, b, c in product("XYZ", repeat=3) if a != b and b != c]
ANGLE = st.floats(-3.1, 3.1)


@pytest.mark.parametrize("sequence", ALL)
def test_every_sequence_gives_the_rotation_back_and_scipys_angles(sequence):
    turns = Rotation.random(300, random_state=1)
    angles = angles_of(turns.as_matrix(), sequence)
    back = Rotation.from_euler(sequence, angles)
    assert (back.inv() * turns).magnitude().max() < 1e-9
    if sequence[0] != sequence[2]:
        np.testing.assert_allclose(angles, turns.as_euler(sequence), atol=1e-9)
    else:
        assert (angles[:, 1] <= 0).all()


@pytest.mark.parametrize("sequence", ALL)
def test_rates_are_those_of_small_turns_of_the_child(sequence):
    turns = Rotation.random(100, random_state=2)
    angles = angles_of(turns.as_matrix(), sequence)
    rates = angles_by_turn(turns.as_matrix(), angles, sequence)
    free = ~locked(angles, sequence)
    for step in np.eye(3):
        moved = (turns * Rotation.from_rotvec(1e-6 * step)).as_matrix()
        change = np.angle(np.exp(1j * (angles_of(moved, sequence) - angles))) / 1e-6
        np.testing.assert_allclose(change[free], (rates @ step)[free], rtol=1e-3, atol=1e-3)


@given(first=ANGLE, second=st.floats(-1.5, 1.5), third=ANGLE)
def test_the_joint_coordinate_system_takes_its_own_angles_back(first, second, third):
    turn = Rotation.from_euler("ZXY", [first, second, third]).as_matrix()[None]
    np.testing.assert_allclose(angles_of(turn, "ZXY")[0], [first, second, third], atol=1e-9)


@given(elevation=st.floats(0.01, 3.1), plane=ANGLE, third=ANGLE)
def test_a_raised_arm_has_a_negative_middle_turn(elevation, plane, third):
    turn = Rotation.from_euler("YXY", [plane, -elevation, third]).as_matrix()[None]
    np.testing.assert_allclose(angles_of(turn, "YXY")[0], [plane, -elevation, third], atol=1e-9)


def test_missing_frames_stay_missing_and_gimbal_lock_is_no_error():
    missing = np.full((1, 3, 3), np.nan)
    quarter = Rotation.from_euler("ZXY", [0.3, np.pi / 2, 0.2]).as_matrix()[None]
    turns = np.concatenate([missing, quarter])
    angles = angles_of(turns, "ZXY")
    assert np.isnan(angles[0]).all() and np.isfinite(angles[1]).all()
    assert locked(angles, "ZXY").tolist() == [False, True]
    assert not np.isfinite(angles_by_turn(turns, angles, "ZXY")[0]).any()


@pytest.mark.parametrize(("sequence", "middle"), [("ZXY", 90.0), ("YXY", 0.0), ("YXY", -180.0)])
def test_lock_is_within_ten_degrees_of_where_two_turns_are_one(sequence, middle):
    sign = -1.0 if middle > -180 else 1.0
    if middle == 90.0:
        near, far = middle - LOCK + 0.1, middle - LOCK - 0.1
    else:
        near, far = middle + sign * (LOCK - 0.1), middle + sign * (LOCK + 0.1)
    angles = np.radians([[0, near, 0], [0, far, 0]])
    assert locked(angles, sequence).tolist() == [True, False]


def test_an_arm_that_hung_in_between_has_its_angles_about_zero_again():
    plane = np.linspace(0.2, 7.0, 60)
    angles = np.stack([plane, np.full(60, -1.0), -plane], axis=1)
    lock = np.zeros(60, dtype=bool)
    lock[20:40] = True
    made = settled(angles, lock, "YXY")
    turns = (made - angles) / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-12)
    assert np.abs(np.median(made[40:, 0])) < np.pi and np.abs(np.median(made[40:, 2])) < np.pi
    np.testing.assert_array_equal(made[:20], angles[:20])
    np.testing.assert_array_equal(settled(angles, lock, "YXZ"), angles)


@given(st.lists(st.floats(-0.5, 0.5), min_size=2, max_size=40))
def test_unwrapping_takes_whole_turns_only_and_leaves_steps_below_half_a_turn(steps):
    path = np.cumsum([3.0, *steps])[:, None]
    wrapped = np.angle(np.exp(1j * path))
    np.testing.assert_allclose(unwrapped(wrapped), path - path[0] + wrapped[0], atol=1e-9)


@given(st.floats(-3.0, 3.0), st.lists(st.floats(-0.7, 0.7), min_size=1, max_size=40))
def test_a_joint_that_stays_about_one_angle_has_no_whole_turns(middle, away):
    path = middle + np.array(away)[:, None]
    wrapped = np.angle(np.exp(1j * (path + 2 * np.pi * np.arange(len(path))[:, None])))
    made = about_their_mean(wrapped)
    turns = (made - path) / (2 * np.pi)
    # The same whole turns in all frames, and none unless the mean itself is beyond half a turn.
    np.testing.assert_allclose(turns, np.full_like(turns, np.round(turns[0])), atol=1e-9)
    assert abs(turns[0, 0]) < 1e-9 or abs(path.mean()) > np.pi - 0.7

"""Turns where nothing is seen: bridges, means, and steps that are too fast."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mocap_skel.rig.bridging import bridged, bridged_places, eased, runs, smoothed, steps

LAWS = settings(derandomize=True, deadline=None, max_examples=40, database=None)
Z = np.array([0.0, 0.0, 1.0])


def about_z(angles):
    turn = Rotation.from_rotvec(np.asarray(angles, float)[:, None] * Z).as_matrix()
    return np.ascontiguousarray(turn.transpose(1, 2, 0))


def angles_of(turn):
    return np.unwrap(np.arctan2(turn[1, 0], turn[0, 0]))


@given(flags=st.lists(st.booleans(), max_size=30))
@LAWS
def test_runs_are_the_stretches_of_true(flags):
    found = np.zeros(len(flags), bool)
    for start, stop in runs(np.array(flags, bool)):
        assert stop > start and (start == 0 or not flags[start - 1])
        found[start:stop] = True
    assert found.tolist() == flags


def test_a_turn_at_constant_speed_is_bridged_at_that_speed():
    known = np.ones(60, bool)
    known[20:40] = False
    truth = 0.05 * np.arange(60)
    lost = np.where(known, about_z(truth), np.nan)
    np.testing.assert_allclose(angles_of(bridged(lost, known, 100.0)), truth, atol=1e-9)


def test_a_short_bridge_leaves_and_arrives_at_the_speeds_beside_it():
    known = np.ones(60, bool)
    known[28:32] = False
    # The speed is the mean of 8 frames, so it lags: by 4 frames of an acceleration of 0.012 at the most.
    truth = 1.2 * np.sin(0.1 * np.arange(60))
    lost = np.where(known, about_z(truth), np.nan)
    assert np.abs(angles_of(bridged(lost, known, 100.0)) - truth).max() < 0.02


def test_ends_are_held_and_nothing_is_no_turn():
    known = np.zeros(10, bool)
    known[3:6] = True
    turn = np.where(known, about_z(np.linspace(0, 0.9, 10)), np.nan)
    found = angles_of(bridged(turn, known, 50.0))
    np.testing.assert_allclose(found[:3], 0.3, atol=1e-12)
    np.testing.assert_allclose(found[6:], 0.5, atol=1e-12)
    nothing = bridged(np.full((3, 3, 4), np.nan), np.zeros(4, bool), 50.0)
    np.testing.assert_array_equal(nothing, np.tile(np.eye(3)[:, :, None], (1, 1, 4)))


def test_places_are_bridged_in_straight_lines():
    track = np.array([[0.0, np.nan, np.nan, 3.0, np.nan]] * 3)
    np.testing.assert_allclose(bridged_places(track, np.isfinite(track[0])), [[0, 1, 2, 3, 3]] * 3)


def test_a_mean_takes_noise_and_leaves_a_steady_turn():
    steady = 0.02 * np.arange(200)
    np.testing.assert_allclose(
        angles_of(smoothed(about_z(steady), 4.0))[15:-15], steady[15:-15], atol=1e-6
    )
    noise = 0.1 * np.random.default_rng(0).normal(size=200)
    left = angles_of(smoothed(about_z(noise), 4.0))[15:-15]
    # A Gaussian of 4 frames averages over 2 sqrt(pi) 4 = 14 independent values.
    assert 0.5 / 14 < (left.std() / 0.1) ** 2 < 2.0 / 14


@given(seed=st.integers(0, 2**32 - 1), jump=st.floats(0.3, 3.0))
@LAWS
def test_no_step_is_longer_than_the_limit(seed, jump):
    rng = np.random.default_rng(seed)
    angles = np.cumsum(rng.uniform(-0.05, 0.05, 80))
    angles[40:] += jump
    turn = about_z(angles)
    found, changed = eased(turn, 0.1)
    assert steps(found).max() <= 0.1 + 1e-9
    np.testing.assert_array_equal(found[..., ~changed], turn[..., ~changed])
    assert changed[40] or changed[39]


def test_slow_turns_are_left_alone():
    turn = about_z(0.01 * np.arange(20))
    found, changed = eased(turn, 0.1)
    np.testing.assert_array_equal(found, turn)
    assert not changed.any()

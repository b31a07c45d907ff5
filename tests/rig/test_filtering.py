"""The low-pass filter: its gain by the formula, no lag, gaps that stay; and the frequency that is chosen."""

import numpy as np
import pytest

from mocap_skel.rig.filtering import HIGHEST, chosen_cutoff, low_passed

RATE = 120.0


def wave(hertz, seconds=8.0):
    time = np.arange(0, seconds, 1 / RATE)
    return np.repeat(np.sin(2 * np.pi * hertz * time)[:, None, None], 3, axis=2)


@pytest.mark.parametrize(("hertz", "gain"), [(1.0, 1.0), (8.0, np.sqrt(0.5)), (30.0, 0.0)])
def test_half_of_the_power_is_left_at_the_cutoff(hertz, gain):
    made, found = wave(hertz)[200:-200], low_passed(wave(hertz), RATE, 8.0)[200:-200]
    # Without lag the wave is the same but for its size.
    np.testing.assert_allclose(found, gain * made, atol=0.02)


def test_gaps_and_short_stretches_stay_as_they_are():
    points = wave(2.0)
    points[300:400] = np.nan
    points[395:398] = 0.5
    found = low_passed(points, RATE, 8.0)
    np.testing.assert_array_equal(np.isnan(found), np.isnan(points))
    np.testing.assert_array_equal(found[395:398], points[395:398])


def test_above_half_the_rate_nothing_is_done():
    points = wave(2.0)
    assert low_passed(points, RATE, 60.0) is points


def test_the_chosen_frequency_lies_between_movement_and_noise():
    rng = np.random.default_rng(1)
    movement = wave(1.0) + 0.1 * wave(4.0)
    noisy = movement + 0.003 * rng.normal(size=movement.shape)
    found = chosen_cutoff([noisy], RATE)
    assert 4.5 < found <= HIGHEST
    filtered = low_passed(noisy, RATE, found)
    assert np.abs(filtered - movement).std() < np.abs(noisy - movement).std()


def test_a_slow_or_short_clip_tells_nothing():
    assert chosen_cutoff([wave(1.0)[:60]], RATE) is None
    assert chosen_cutoff([wave(1.0)], 50.0) is None

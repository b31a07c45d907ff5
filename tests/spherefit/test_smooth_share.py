"""The share of residuals that stays from one frame to the next, by hand and against its law."""

import numpy as np
import pytest

from mocap_skel.spherefit import smooth_share

PAIRS = np.tile([2.0, 1.0, np.nan], 100)


@pytest.mark.parametrize(
    ("series", "correlation"),
    [
        (np.ones(101), 1.0),
        # 2 · 1 over the mean of 4 and 1, whichever comes first.
        (PAIRS, 0.8),
        (PAIRS[::-1], 0.8),
        (np.tile([2.0, -1.0, np.nan], 100), -0.8),
    ],
    ids=["constant", "pairs", "pairs backwards", "signs that change"],
)
def test_it_is_the_correlation_of_neighbours_less_twice_its_own_error(series, correlation):
    """A hundred pairs, whose correlation chance makes 1/10."""
    (share,) = smooth_share(series[:, None])
    assert share == pytest.approx(max(correlation - 0.2, 0.0), abs=1e-12)


def test_series_without_neighbours_have_none():
    gaps = np.tile([[1.0], [np.nan]], (20, 1))
    np.testing.assert_array_equal(smooth_share(np.column_stack([gaps, np.full(40, np.nan)])), 0.0)


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.9])
def test_noise_with_a_memory_has_that_share(memory):
    rng = np.random.default_rng(2)
    frames, series = 5000, 40
    x = rng.normal(size=(frames, series))
    for k in range(1, frames):
        x[k] = memory * x[k - 1] + np.sqrt(1 - memory**2) * x[k]
    share = smooth_share(x)
    # A correlation of N pairs is known to √((1 - φ²)/N).
    error = 4 * np.sqrt((1 - memory**2) / frames)
    assert np.abs(share - max(memory - 2 / np.sqrt(frames), 0.0)).max() <= error

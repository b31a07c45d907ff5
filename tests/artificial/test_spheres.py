"""Points on a cap are spread as they should be."""

import numpy as np
import pytest
from findings import EPS

from mocap_skel.artificial.spheres import cap


class TestCap:
    @pytest.mark.parametrize("degrees", [10, 90, 180])
    def test_points_lie_evenly_on_their_cap(self, degrees):
        count, angle = 20_000, np.radians(degrees)
        points = cap(np.random.default_rng(degrees), (2, count // 2), angle, 3.0).reshape(-1, 3)
        np.testing.assert_allclose(np.linalg.norm(points, axis=1), 3.0, rtol=8 * EPS)
        height = points[:, 2] / 3
        assert height.min() >= np.cos(angle) - 8 * EPS
        # Even on the sphere is even in height (Archimedes): mean and variance of a uniform number.
        low = np.cos(angle)
        spread = (1 - low) / np.sqrt(12)
        assert abs(height.mean() - (1 + low) / 2) <= 4 * spread / np.sqrt(count)
        # Its square varies by √(1/180) of the width's.
        allowed = 4 * (1 - low) ** 2 / np.sqrt(180 * count)
        assert abs(height.var() - spread**2) <= allowed
        across = points[:, :2].mean(axis=0) / 3
        assert np.abs(across).max() <= 4 * np.sqrt((1 - height**2).mean() / 2 / count)

    def test_a_seed_gives_the_same_points(self):
        one, two = (cap(np.random.default_rng(7), (5, 4), 1.0) for _ in range(2))
        np.testing.assert_array_equal(one, two)
        assert one.shape == (5, 4, 3)

"""Points on a part of a sphere, with a known centre."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mocap_skel.artificial.faults import Array


def cap(rng: np.random.Generator, shape: Sequence[int], angle: float, radius: float = 1.0) -> Array:
    """Points spread evenly over a spherical cap about the z axis, the centre at the origin.

    Args:
        rng: source of randomness.
        shape: of the sets of points.
        angle: half-angle θ of the cap, radians; π gives the whole sphere.
        radius: any unit.

    Returns:
        (*shape, 3), in the unit of the radius.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial.spheres import cap
        >>> points = cap(np.random.default_rng(0), (5, 100), np.pi / 2, radius=0.3)
        >>> print(points.shape, points[..., 2].min() >= 0)
        (5, 100, 3) True
    """
    height = 1.0 - rng.uniform(size=shape) * (1.0 - np.cos(angle))
    turn = rng.uniform(0.0, 2 * np.pi, size=shape)
    side = np.sqrt(np.maximum(1.0 - height**2, 0.0))
    return radius * np.stack([side * np.cos(turn), side * np.sin(turn), height], axis=-1)

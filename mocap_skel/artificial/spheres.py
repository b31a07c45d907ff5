"""Points on a part of a sphere, with a known centre."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mocap_skel.artificial.faults import Array


def cap(rng: np.random.Generator, shape: Sequence[int], angle: float, radius: float = 1.0) -> Array:
    """Points (*shape, 3) spread evenly over the cap of a half-angle (radians) about the z axis.

    The centre is the origin; an angle of π gives the whole sphere.
    """
    height = 1.0 - rng.uniform(size=shape) * (1.0 - np.cos(angle))
    turn = rng.uniform(0.0, 2 * np.pi, size=shape)
    side = np.sqrt(np.maximum(1.0 - height**2, 0.0))
    return radius * np.stack([side * np.cos(turn), side * np.sin(turn), height], axis=-1)

"""Rigid points and their true poses, for tests of poses."""

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mocap_skel.segments.pose import Pose

LAWS = settings(derandomize=True, deadline=None, max_examples=40, database=None)
SEEDS = st.integers(0, 2**32 - 1)
EPS = np.finfo(float).eps


def rotations(rng, count):
    return Rotation.from_quat(rng.normal(size=(count, 4))).as_matrix()


def moved(rng, template, frames, distance=1.0):
    """Points (frames, M, 3) of a rigid template, and the true pose."""
    truth = Pose(rotations(rng, frames), distance * rng.normal(size=(frames, 3)))
    return truth.origin[:, None] + template @ truth.rotation.swapaxes(1, 2), truth


def assert_proper(rotation, tolerance=32 * EPS):
    """Orthonormal and right-handed, by default to a few roundings."""
    assert np.isfinite(rotation).all()
    product = rotation.swapaxes(-1, -2) @ rotation
    assert np.abs(product - np.eye(3)).max() <= tolerance
    assert np.abs(np.linalg.det(rotation) - 1).max() <= tolerance

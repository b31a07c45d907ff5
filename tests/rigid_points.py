"""What the tests of poses share: rigid sets of points, moved at random, and what a rotation has to be."""

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mocap_skel.segments.pose import Pose

LAWS = settings(derandomize=True, deadline=None, max_examples=40, database=None)
SEEDS = st.integers(0, 2**32 - 1)
EPS = np.finfo(float).eps

TEMPLATES = {
    "three points": np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.05, 0.1, 0.0]]),
    "four points": np.array([[0.1, 0, 0], [-0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.08]]),
    "plane": np.array([[0.1, 0.1, 0], [-0.1, 0.1, 0], [-0.1, -0.1, 0], [0.12, -0.1, 0], [0, 0, 0]]),
    "seven points": 0.1 * np.random.default_rng(1).normal(size=(7, 3)),
    "nearly a line, 10 %": np.array([[-0.2, 0, 0], [0.2, 0, 0], [0.0, 0.06, 0], [0.1, 0, 0.01]]),
    "nearly a line, 6 %": np.array([[-0.2, 0, 0], [0.2, 0, 0], [0.0, 0.032, 0], [0.1, 0, 0]]),
}


def rotations(rng, count):
    return Rotation.from_quat(rng.normal(size=(count, 4))).as_matrix()


def moved(rng, template, frames, distance=1.0, noise=0.0):
    """Points (frames, M, 3) of a rigid template in random poses, and the poses."""
    truth = Pose(rotations(rng, frames), distance * rng.normal(size=(frames, 3)))
    x = truth.origin[:, None] + template @ truth.rotation.swapaxes(1, 2)
    return x + noise * rng.normal(size=x.shape), truth


def assert_proper(rotation, tolerance=32 * EPS):
    """Orthonormal and right-handed, by default to a few roundings."""
    assert np.isfinite(rotation).all()
    product = rotation.swapaxes(-1, -2) @ rotation
    assert np.abs(product - np.eye(3)).max() <= tolerance
    assert np.abs(np.linalg.det(rotation) - 1).max() <= tolerance

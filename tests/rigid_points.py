"""Rigid sets of points, and such points with noise."""

import numpy as np
from poses import moved

TEMPLATES = {
    "three points": np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.05, 0.1, 0.0]]),
    "four points": np.array([[0.1, 0, 0], [-0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.08]]),
    "plane": np.array([[0.1, 0.1, 0], [-0.1, 0.1, 0], [-0.1, -0.1, 0], [0.12, -0.1, 0], [0, 0, 0]]),
    "seven points": 0.1 * np.random.default_rng(1).normal(size=(7, 3)),
    "nearly a line, 10 %": np.array([[-0.2, 0, 0], [0.2, 0, 0], [0.0, 0.06, 0], [0.1, 0, 0.01]]),
    "nearly a line, 6 %": np.array([[-0.2, 0, 0], [0.2, 0, 0], [0.0, 0.032, 0], [0.1, 0, 0]]),
}


def moved_with_noise(rng, template, frames, noise=0.0):
    """As `poses.moved`, with noise on every coordinate."""
    x, truth = moved(rng, template, frames)
    return x + noise * rng.normal(size=x.shape), truth

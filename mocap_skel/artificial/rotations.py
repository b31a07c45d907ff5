"""The few rotations that the generator needs, vectorised over frames."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def from_vector(vector: Array) -> Array:
    """Rotation matrices (..., 3, 3) from rotation vectors (..., 3), radians (Rodrigues)."""
    x, y, z = np.moveaxis(vector, -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    cross = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    angle = np.linalg.norm(vector, axis=-1)[..., None, None]
    # np.sinc is sin(πx)/(πx), so that no angle, zero included, divides by zero.
    linear, square = np.sinc(angle / np.pi), 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    return np.asarray(np.eye(3) + linear * cross + square * (cross @ cross))


def swing_twist(angles: Array) -> Array:
    """Rotation matrices (..., 3, 3) of angles (..., 3), radians.

    The first two components are one rotation vector across the limb (it can circle without the
    order of axes mattering), the third turns the limb about its own z axis before.
    """
    swing = angles * [1.0, 1.0, 0.0]
    return from_vector(swing) @ from_vector(angles - swing)


def half_sine(rotation: Array) -> Array:
    """The axis times sin(angle / 2), (..., 3); smooth, singular at a half turn only."""
    trace = np.trace(rotation, axis1=-2, axis2=-1)
    cosine = 0.5 * np.sqrt(np.maximum(1.0 + trace, 1e-12))
    skew = rotation - np.swapaxes(rotation, -1, -2)
    axis = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)
    return np.asarray(axis / (4.0 * cosine[..., None]))


def to_vector(rotation: Array) -> Array:
    """Rotation vectors (..., 3), radians; singular at a half turn only."""
    half = half_sine(rotation)
    sine = np.minimum(np.linalg.norm(half, axis=-1, keepdims=True), 1.0)
    ratio = np.divide(2.0 * np.arcsin(sine), sine, out=np.full_like(sine, 2.0), where=sine > 0)
    return np.asarray(ratio * half)

"""The few rotations that the generator needs, vectorised over frames."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def from_vector(vector: Array) -> Array:
    """Rotation matrices from rotation vectors: the axis times the angle (Rodrigues).

    Args:
        vector: (..., 3), radians.

    Returns:
        (..., 3, 3).

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial import from_vector
        >>> (from_vector(np.array([0.0, 0.0, np.pi / 2])).round(6) + 0.0).tolist()
        [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    """
    x, y, z = np.moveaxis(vector, -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    cross = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    angle = np.linalg.norm(vector, axis=-1)[..., None, None]
    # np.sinc is sin(πx)/(πx), so that no angle, zero included, divides by zero.
    linear, square = np.sinc(angle / np.pi), 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    return np.asarray(np.eye(3) + linear * cross + square * (cross @ cross))


def swing_twist(angles: Array) -> Array:
    """Rotation matrices of a limb's swing about x and y and of the twist about its own z axis before.

    The first two angles are one rotation vector across the limb, so that it can circle without the
    order of axes mattering.

    Args:
        angles: (..., 3), radians.

    Returns:
        (..., 3, 3).

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial import from_vector, swing_twist
        >>> knee = np.array([0.0, 1.2, 0.3])
        >>> swing, twist = from_vector(knee * [1, 1, 0]), from_vector(knee * [0, 0, 1])
        >>> np.allclose(swing_twist(knee), swing @ twist)
        True
    """
    swing = angles * [1.0, 1.0, 0.0]
    return from_vector(swing) @ from_vector(angles - swing)


def half_sine(rotation: Array) -> Array:
    """The axis of a rotation times sin(angle / 2): smooth, but for a half turn.

    Args:
        rotation: (..., 3, 3).

    Returns:
        (..., 3).
    """
    trace = np.trace(rotation, axis1=-2, axis2=-1)
    cosine = 0.5 * np.sqrt(np.maximum(1.0 + trace, 1e-12))
    skew = rotation - np.swapaxes(rotation, -1, -2)
    axis = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)
    return np.asarray(axis / (4.0 * cosine[..., None]))


def to_vector(rotation: Array) -> Array:
    """Rotation vectors of rotation matrices, the inverse of `from_vector` below a half turn.

    Args:
        rotation: (..., 3, 3).

    Returns:
        (..., 3), radians.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial import from_vector, to_vector
        >>> to_vector(from_vector(np.array([0.1, -0.2, 0.3]))).round(6).tolist()
        [0.1, -0.2, 0.3]
    """
    half = half_sine(rotation)
    sine = np.minimum(np.linalg.norm(half, axis=-1, keepdims=True), 1.0)
    ratio = np.divide(2.0 * np.arcsin(sine), sine, out=np.full_like(sine, 2.0), where=sine > 0)
    return np.asarray(ratio * half)

"""Algebra of many 3 x 3 matrices at once, components first: a matrix is (3, 3, ...), a vector (3, ...).

With the components in front each product is a few passes over long contiguous arrays, several times as fast
as numpy's batched `@` on (..., 3, 3).
"""

from __future__ import annotations

import numpy as np

from mocap_skel.segments.pose import Array

# Enough for means of turns that lie within 90 degrees of each other.
POLAR_STEPS = 6
# Radians: below it the power series of sine and cosine are exact to 1e-16.
SMALL = 1e-4


def multiply(a: Array, b: Array) -> Array:
    """Products a b of matrices (3, 3, ...)."""
    out: Array = a[:, 0, None] * b[None, 0]
    out += a[:, 1, None] * b[None, 1]
    out += a[:, 2, None] * b[None, 2]
    return out


def transposed(a: Array) -> Array:
    """Transposes, as a view."""
    return a.swapaxes(0, 1)


def apply(a: Array, v: Array) -> Array:
    """Matrices (3, 3, ...) times vectors (3, ...)."""
    out: Array = a[:, 0] * v[0]
    out += a[:, 1] * v[1]
    out += a[:, 2] * v[2]
    return out


def cross(u: Array, v: Array) -> Array:
    """Vector products u x v; v may also be a matrix, whose columns are taken one by one."""
    return np.stack(
        [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    )


def times_skew(a: Array, v: Array) -> Array:
    """A [v]x: matrices times the matrices of the vector product by v."""
    return -transposed(cross(v, transposed(a)))


def diagonal(values: Array) -> Array:
    """Matrices (3, 3, ...) with the same value (...) three times on the diagonal."""
    out = np.zeros((3, 3, *values.shape))
    for i in range(3):
        out[i, i] = values
    return out


def inverse(a: Array) -> Array:
    """Inverses of symmetric matrices, by cofactors; the lower triangle is not read."""
    c00 = a[1, 1] * a[2, 2] - a[1, 2] ** 2
    c01 = a[0, 2] * a[1, 2] - a[0, 1] * a[2, 2]
    c02 = a[0, 1] * a[1, 2] - a[0, 2] * a[1, 1]
    c11 = a[0, 0] * a[2, 2] - a[0, 2] ** 2
    c12 = a[0, 1] * a[0, 2] - a[0, 0] * a[1, 2]
    c22 = a[0, 0] * a[1, 1] - a[0, 1] ** 2
    out = np.stack(
        [np.stack([c00, c01, c02]), np.stack([c01, c11, c12]), np.stack([c02, c12, c22])]
    )
    out /= a[0, 0] * c00 + a[0, 1] * c01 + a[0, 2] * c02
    return out


def orthonormal(a: Array) -> Array:
    """Rotations nearest to matrices that are not far from one (their determinant is positive).

    Newton's iteration of the polar factor, X to (X + X⁻ᵀ) / 2, which doubles its digits (Higham 1986).
    """
    for _ in range(POLAR_STEPS):
        cofactors = np.stack([cross(a[1], a[2]), cross(a[2], a[0]), cross(a[0], a[1])])
        a = 0.5 * (a + cofactors / (a[0] * cofactors[0]).sum(axis=0))
    return a


def rotation(vector: Array) -> Array:
    """Rotations (3, 3, ...) by rotation vectors (3, ...), radians (Rodrigues).

    Example:
        >>> import numpy as np
        >>> quarter = rotation(np.array([0.0, 0.0, np.pi / 2]))
        >>> bool(np.allclose(quarter @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]))
        True
    """
    square = (vector * vector).sum(axis=0)
    angle = np.sqrt(square)
    small = angle < SMALL
    safe = np.where(small, 1.0, angle)
    sine = np.where(small, 1.0 - square / 6.0, np.sin(safe) / safe)
    cosine = np.where(small, 0.5 - square / 24.0, (1.0 - np.cos(safe)) / safe**2)
    out = cosine * vector[:, None] * vector[None]
    x, y, z = sine * vector
    for i in range(3):
        out[i, i] += 1.0 - cosine * square
    out[0, 1] -= z
    out[1, 0] += z
    out[0, 2] += y
    out[2, 0] -= y
    out[1, 2] -= x
    out[2, 1] += x
    return np.asarray(out)


def rotation_vector(turn: Array) -> Array:
    """Rotation vectors (3, ...) of rotations, radians; of half a turn the axis is not found."""
    twist = np.stack([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine = 0.5 * np.sqrt((twist * twist).sum(axis=0))
    angle = np.arctan2(sine, 0.5 * (turn[0, 0] + turn[1, 1] + turn[2, 2] - 1.0))
    return np.asarray(twist * (0.5 * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-12), 1.0)))


def angle_between(a: Array, b: Array) -> Array:
    """Angles (...) from rotations a to rotations b, radians."""
    return np.asarray(np.linalg.norm(rotation_vector(multiply(b, transposed(a))), axis=0))

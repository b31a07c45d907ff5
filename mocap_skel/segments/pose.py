"""Segment poses: three-point frames, least squares onto a template, and the thesis's cases 2 and 3.

A pose is a rotation whose columns are the segment's axes in the lab, and an origin; a point y of the
segment is at x = origin + rotation y in the lab (thesis (234), (243)). Everything is closed form and
vectorised over frames; a frame that does not determine a pose is NaN.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

# A visible set of points whose second extent is below this share of its first is a line: it leaves
# the turn about that line to chance.
LINE = 0.05


@dataclass(frozen=True, eq=False)
class Pose:
    """A segment's pose in every frame: rotation (frames, 3, 3), origin (frames, 3), metres.

    NaN in frames that do not determine it.

    Example:
        A segment that lies a metre above the lab's origin, its x axis along the lab's y.

        >>> import numpy as np
        >>> turn = np.array([[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
        >>> pose = Pose(turn, np.array([[0.0, 0.0, 1.0]]))
        >>> pose.to_lab([0.3, 0.0, 0.0])
        array([[0. , 0.3, 1. ]])
        >>> pose.to_segment([[[0.0, 0.3, 1.0]]])
        array([[[0.3, 0. , 0. ]]])
    """

    rotation: Array
    origin: Array

    def to_lab(self, point: ArrayLike) -> Array:
        """Lab track (frames, 3) of a point (3,) fixed in the segment (243)."""
        return np.asarray(self.origin + self.rotation @ np.asarray(point, dtype=np.float64))

    def to_segment(self, points: ArrayLike) -> Array:
        """Lab points (frames, M, 3) in the segment's own coordinates (234)."""
        away = np.asarray(points, dtype=np.float64) - self.origin[:, None, :]
        return np.asarray(away @ self.rotation)

    @property
    def known(self) -> NDArray[np.bool_]:
        """(frames,): whether the frame determines the pose."""
        return np.asarray(np.isfinite(self.origin[:, 0]))


def triad(first: ArrayLike, second: ArrayLike, third: ArrayLike) -> Pose:
    """The frame that three points span, the thesis's (235)-(238).

    x̂ points from the first to the second, ẑ ∝ (third - first) × x̂ (the differences are the erratum
    of (237)), ŷ = ẑ × x̂; the origin is the first point.

    Args:
        first, second, third: (frames, 3), metres, NaN = missing.

    Returns:
        NaN in frames in which a point is missing or the three lie on a line.

    Example:
        >>> pose = triad([[1.0, 0.0, 0.0]], [[3.0, 0.0, 0.0]], [[1.0, -1.0, 0.0]])
        >>> pose.rotation.round(9) + 0.0
        array([[[1., 0., 0.],
                [0., 1., 0.],
                [0., 0., 1.]]])
        >>> triad([[0.0, 0.0, 0.0]], [[1.0, 0.0, 0.0]], [[2.0, 0.0, 0.0]]).known
        array([False])
    """
    p, q, r = (np.asarray(v, dtype=np.float64) for v in (first, second, third))
    rotation = _two_vector_frame(q - p, r - p)
    return Pose(rotation, np.where(np.isfinite(rotation[:, :1, 2]), p, np.nan))


def _two_vector_frame(along: Array, beside: Array) -> Array:
    """(frames, 3, 3): x̂ ∝ along, ẑ ∝ beside × x̂, ŷ = ẑ × x̂; NaN where the two are parallel."""
    x = _unit(along)
    across = _cross(beside, x)
    sine = np.linalg.norm(across, axis=-1)
    scale = np.linalg.norm(beside, axis=-1)
    with np.errstate(invalid="ignore"):
        flat = ~(sine > 1e-9 * scale)
    z = _unit(np.where(flat[..., None], np.nan, across))
    return np.stack([x, _cross(z, x), z], axis=-1)


def _unit(v: Array) -> Array:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def _cross(a: Array, b: Array) -> Array:
    # np.cross spends most of its time on axis bookkeeping.
    (ax, ay, az), (bx, by, bz) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def triad_pose(points: ArrayLike, template: ArrayLike, chosen: tuple[int, int, int]) -> Pose:
    """The pose by the same three markers in every frame, in the template's coordinates (case 1, 5.5.1.1).

    Args:
        points: (frames, M, 3), metres, NaN = missing.
        template: (M, 3), metres.
        chosen: indices of the three markers.

    Returns:
        NaN in frames without all of the three, or with the three on a line.

    Example:
        >>> import numpy as np
        >>> template = np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 0.1, 0.0]])
        >>> pose = triad_pose(template[None] + [0.0, 0.0, 1.0], template, (0, 1, 2))
        >>> pose.origin.round(9)
        array([[0., 0., 1.]])
    """
    x = np.asarray(points, dtype=np.float64)
    t = np.asarray(template, dtype=np.float64)
    here = triad(*(x[:, i] for i in chosen))
    there = triad(*(t[None, i] for i in chosen))
    rotation = here.rotation @ there.rotation[0].T
    return Pose(rotation, here.origin - rotation @ there.origin[0])


def least_squares_pose(points: ArrayLike, template: ArrayLike, weights: ArrayLike) -> Pose:
    """The least-squares pose of each frame: the one that minimises Σ_m w_m |x_m - (p + R t_m)|² (Wahba 1965).

    Solved without SVD by Markley's FOAM (J. Astronaut. Sci. 41, 1993): the largest root of a quartic
    by Newton's method gives the optimal rotation as a rational function of B = Σ w (x - x̄) tᵀ.

    Args:
        points: (frames, M, 3), metres; may hold NaN where the weight is zero.
        template: (M, 3), metres.
        weights: (frames, M) or (M,), not negative; a point with a NaN gets weight zero.

    Returns:
        Rotations right-handed and orthonormal to rounding; NaN where the points with weight are
        fewer than three or lie on a line.

    Example:
        >>> import numpy as np
        >>> template = np.array([[0.1, 0, 0], [-0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.08]])
        >>> quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        >>> points = (template @ quarter.T + [0.0, 0.0, 1.0])[None]
        >>> points[0, 3] = np.nan  # three are enough
        >>> pose = least_squares_pose(points, template, np.ones(4))
        >>> print(np.abs(pose.rotation[0] - quarter).max() < 1e-12, pose.origin.round(9) + 0.0)
        True [[0. 0. 1.]]
    """
    x = by_rows(points)
    w = np.asarray(weights, dtype=np.float64)
    rotation, origin = wahba(x, np.asarray(template, dtype=np.float64), w.T)
    return Pose(np.ascontiguousarray(rotation.transpose(2, 0, 1)), np.ascontiguousarray(origin.T))


def by_rows(points: ArrayLike) -> Array:
    """Points (frames, M, 3) as (M, 3, frames), contiguous: what the arithmetic over frames wants."""
    return np.ascontiguousarray(np.asarray(points, dtype=np.float64).transpose(1, 2, 0))


def wahba(x: Array, template: Array, weights: Array) -> tuple[Array, Array]:
    """`least_squares_pose` by rows: x (M, 3, F), weights (M,) or (M, F) → (3, 3, F), (3, F)."""
    t = template
    w = weights if weights.ndim == 2 else np.broadcast_to(weights[:, None], (len(x), x.shape[2]))
    seen = np.isfinite(x[:, 0]) & np.isfinite(x[:, 1]) & np.isfinite(x[:, 2])
    if not seen.all():
        w = w * seen
        x = np.where(seen[:, None], x, 0.0)
    total = w.sum(axis=0)
    some = np.where(total > 0, total, 1.0)
    x_mean = np.einsum("mf,mif->if", w, x) / some
    t_mean = (t.T @ w) / some
    away = x - x_mean
    weighted = away * w[:, None]
    # Where the template's centroid moves with what is visible, Σ w (x - x̄) t̄ᵀ vanishes anyway.
    b = (t.T @ weighted.reshape(len(x), -1)).reshape(3, 3, -1).swapaxes(0, 1)
    size = np.einsum("mif,mif->f", weighted, away)
    size += (t * t).sum(axis=1) @ w - total * (t_mean * t_mean).sum(axis=0)
    b = np.ascontiguousarray(b)
    # Of a long clip they are the largest there is, and what follows needs as much again.
    del away, weighted, x
    rotation = _foam(b, 0.5 * size)
    flat = ~_spans_plane(w > 0, t)
    if flat.any():
        rotation[:, :, flat] = np.nan
    return rotation, x_mean - np.einsum("ijf,jf->if", rotation, t_mean)


def nearest_rotation(matrices: ArrayLike) -> Array:
    """The rotations (frames, 3, 3) nearest to matrices (frames, 3, 3), by SVD: slow, and right for any matrix.

    Example:
        >>> nearest_rotation([[[0.9, 0.0, 0.0], [0.0, 1.1, 0.0], [0.0, 0.0, 1.0]]])[0]
        array([[1., 0., 0.],
               [0., 1., 0.],
               [0., 0., 1.]])
    """
    u, _, vt = np.linalg.svd(np.asarray(matrices, dtype=np.float64))
    u[..., 2] *= np.linalg.det(u @ vt)[..., None]
    return np.asarray(u @ vt)


def _foam(b: Array, bound: Array) -> Array:
    """Rotations (3, 3, F) that maximise tr(Rᵀ B) for B of shape (3, 3, F).

    The sought root, max tr(Rᵀ B), is half of Σ w (|x|² + |t|²) less half the residual of the fit. So
    that sum, the bound, is above it and for rigid points close; from above, Newton's method falls to
    the largest root without passing it. NaN where the points, not the template, lie on a line.
    """
    cofactor = np.empty_like(b)
    for i in range(3):
        _cross_rows(b[i - 2], b[i - 1], cofactor[i])
    determinant = (b[0] * cofactor[0]).sum(axis=0)
    norm = np.einsum("ijf,ijf->f", b, b)
    adjoint = 4.0 * np.einsum("ijf,ijf->f", cofactor, cofactor)
    # The other bound, √3 times the Frobenius norm, helps where the two sets differ in size.
    root = np.minimum(bound, np.sqrt(3.0 * norm))
    with np.errstate(invalid="ignore", divide="ignore"):
        for _ in range(40):
            excess = root * root - norm
            value = excess * excess - 8.0 * root * determinant - adjoint
            slope = 4.0 * root * excess - 8.0 * determinant
            step = np.where(slope > 0, value / slope, 0.0)
            root = root - step
            if not (np.abs(step) > 1e-15 * root).any():
                break
        kappa = 0.5 * (root * root - norm)
        zeta = kappa * root - determinant
        # (s₁ + s₂)(s₂ + s₃)(s₃ + s₁) for the singular values of B: next to nothing beside s₁³ on a line.
        zeta[zeta <= 1e-5 * root**3] = np.nan
        product = np.einsum("ikf,jkf->ijf", b, b)
        rotation = (kappa + norm) * b + root * cofactor - np.einsum("ikf,kjf->ijf", product, b)
        rotation /= zeta
        # Rounding in the root leaves columns orthogonal to about 1e-12; Gram-Schmidt makes it 1e-16.
        x, y, z = (rotation[:, k] for k in range(3))
        x /= np.sqrt((x * x).sum(axis=0))
        _cross_rows(x, y.copy(), z)
        z /= np.sqrt((z * z).sum(axis=0))
        _cross_rows(z, x, y)
    return np.asarray(rotation)


def _cross_rows(a: Array, b: Array, out: Array) -> None:
    """Out = a × b for arrays (3, F)."""
    for i in range(3):
        np.multiply(a[i - 2], b[i - 1], out=out[i])
        out[i] -= a[i - 1] * b[i - 2]


def _spans_plane(used: NDArray[np.bool_], template: Array) -> NDArray[np.bool_]:
    """(F,): whether the template points that a frame uses, (M, F), are three or more off a line."""
    if used.all():
        patterns, where = np.array([(1 << len(template)) - 1]), np.zeros(used.shape[1], dtype=int)
    else:
        code = (1 << np.arange(len(template), dtype=np.int64)) @ used.astype(np.int64)
        patterns, where = np.unique(code, return_inverse=True)
    good = np.zeros(len(patterns), dtype=bool)
    for k, pattern in enumerate(patterns):
        chosen = template[[bool(pattern >> m & 1) for m in range(len(template))]]
        if len(chosen) >= 3:
            extent = np.linalg.svd(chosen - chosen.mean(axis=0), compute_uv=False)
            good[k] = extent[1] > LINE * extent[0]
    return np.asarray(good[where])


def one_marker_pose(
    marker: Array,
    joint: Array,
    axis: Array,
    template_marker: Array,
    template_joint: Array,
    template_axis: Array,
) -> Pose:
    """The pose by one marker, the joint centre and a vector fixed in the segment (case 3, (249)-(255)).

    x̂ points from the marker to the joint, ẑ is the vector made perpendicular to x̂ (the erratum of
    (252)), ŷ = ẑ × x̂.

    Args:
        marker, joint: lab tracks (frames, 3), metres, NaN = missing.
        axis: (frames, 3), the vector in the lab; its length does not matter.
        template_marker, template_joint: (3,), the same in the segment's own coordinates.
        template_axis: (3,), likewise.

    Returns:
        NaN in frames in which one of the three is missing, or the vector lies along x̂.

    Example:
        >>> import numpy as np
        >>> lab = np.array([[1.0, 2.0, 3.0]]), np.array([[1.0, 2.5, 3.0]]), np.array([[0.0, 0.0, 1.0]])
        >>> own = np.zeros(3), np.array([0.5, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
        >>> one_marker_pose(*lab, *own).to_lab([0.5, 0.0, 0.0])
        array([[1. , 2.5, 3. ]])
    """
    here = _axis_frame(joint - marker, axis)
    there = _axis_frame((template_joint - template_marker)[None], template_axis[None])[0]
    rotation = here @ there.T
    return Pose(rotation, marker - rotation @ template_marker)


def _axis_frame(along: Array, axis: Array) -> Array:
    x = _unit(along)
    rest = axis - np.einsum("fi,fi->f", axis, x)[:, None] * x
    with np.errstate(invalid="ignore"):
        # Nearer than 3 degrees to x̂ the rest of the vector is mostly error.
        lost = ~(np.linalg.norm(rest, axis=-1) > LINE * np.linalg.norm(axis, axis=-1))
    z = _unit(np.where(lost[:, None], np.nan, rest))
    return np.stack([x, _cross(z, x), z], axis=-1)

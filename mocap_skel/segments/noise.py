"""The measurement noise of a clip's markers: one level, or a whole matrix (thesis 6.7)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mocap_skel.segments.pose import Array, Pose
from mocap_skel.segments.shape import Shape, median

# How it is found: one level from the rigidity of the segments, a matrix from the same, or from each
# marker's own radial residuals, joint by joint.
NOISES = ("rigid", "matrix", "marker")
# Frames with all markers that an estimate of six numbers has to have.
_LEAST_FRAMES = 20
# A frame whose squared residual is so many times the median holds a swap or a ghost, no noise.
_WILD = 9.0
# How firmly what the residuals do not show is held to the same noise in all directions.
_RIDGE = 0.02
# An orthonormal basis of the symmetric 3 x 3 matrices, as columns of their 9 entries.
_SYMMETRIC = np.zeros((9, 6))
for _column, (_i, _j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
    _SYMMETRIC[[3 * _i + _j, 3 * _j + _i], _column] = 1.0 if _i == _j else np.sqrt(0.5)


@dataclass(frozen=True, eq=False)
class ClipNoise:
    """The noise that the fits of a clip's joints take away.

    Attributes:
        sigma: standard deviation per coordinate, metres.
        matrix: Σ̂ (3, 3) along the lab's axes, m²; None where the level is all.
        each: whether each joint finds the noise of each of its markers instead.
        note: what there is to say about it.
    """

    sigma: float
    matrix: Array | None = None
    each: bool = False
    note: str = ""

    def in_frame(self, frame: Pose) -> Array | None:
        """Σ̂ / sigma², (3, 3), along the axes of a segment, mean over time; None where the level is all."""
        if self.matrix is None or not self.sigma > 0:
            return None
        turns = frame.rotation[frame.known]
        return np.asarray((turns.swapaxes(1, 2) @ self.matrix @ turns).mean(axis=0) / self.sigma**2)


def clip_noise(
    points: Mapping[str, Array],
    shapes: Mapping[str, tuple[Shape, Pose]],
    sigma: float | Array | None,
    how: str,
) -> ClipNoise:
    """The noise of a clip, given or estimated.

    Args:
        points: segment → markers (frames, M, 3), metres.
        shapes: segment → its rigid shape and pose, for those that have one.
        sigma: standard deviation in metres, or covariance (3, 3), m²; estimated if None.
        how: one of `NOISES`.

    Returns:
        A level of 0 where no segment is rigid enough to tell.

    Raises:
        ValueError: sigma is a matrix and no covariance.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.segments.shape import find_shape
        >>> box = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.2, 0], [0, 0, 0.1]])
        >>> points = box + 0.001 * np.random.default_rng(0).normal(size=(2000, 4, 3))
        >>> found = clip_noise({"Box": points}, {"Box": find_shape(points)}, None, "rigid")
        >>> f"{1000 * found.sigma:.1f} mm"
        '1.0 mm'
    """
    if isinstance(sigma, np.ndarray):
        _check_covariance(sigma)
        return ClipNoise(float(np.sqrt(np.trace(sigma) / 3)), sigma)
    if sigma is not None:
        return ClipNoise(sigma)
    # Skin and swapped markers only ever add to a shape's residual, so the more rigid segments
    # tell of the cameras; the very first may be some that the lab's software has filled in.
    rigid = sorted(shape.sigma for shape, _ in shapes.values()) or [0.0]
    level = rigid[len(rigid) // 3]
    if how != "matrix" or not level > 0:
        return ClipNoise(level, each=how == "marker")
    found = {
        shape.sigma: matrix
        for name, (shape, pose) in shapes.items()
        for matrix in [rigid_noise_matrix(points[name], shape, pose)]
        if matrix is not None and shape.sigma > 0
    }
    if not found:
        note = "no segment has four markers that are seen together: no noise matrix, one level"
        return ClipNoise(level, note=note)
    # All markers are seen by the same cameras, so the clip has one matrix: that of the segment that is as
    # rigid as the level says, neither moved by skin nor filled in by software.
    nearest = min(found, key=lambda own: abs(np.log(own / level)))
    matrix = found[nearest] * (level / nearest) ** 2
    return ClipNoise(float(np.sqrt(np.trace(matrix) / 3)), matrix)


def _check_covariance(matrix: Array) -> None:
    """Refuse what is no covariance, rounding allowed for."""
    if matrix.shape == (3, 3) and np.isfinite(matrix).all():
        rounding = 1e-9 * np.abs(matrix).max()
        symmetric = np.abs(matrix - matrix.T).max() <= rounding
        if symmetric and np.linalg.eigvalsh(matrix)[0] >= -rounding:
            return
    raise ValueError(
        f"a noise covariance is a symmetric (3, 3) matrix without a negative eigenvalue, got "
        f"{matrix.tolist()}"
    )


def rigid_noise_matrix(points: Array, shape: Shape, pose: Pose) -> Array | None:
    """The covariance of the noise of a segment's markers, Σ̂ (3, 3), m², along the lab's axes (thesis 6.7).

    A pose takes what it can of the noise n: the residuals are e_m = Σ_k P_mk n_k with a matrix P that
    the template gives. So the residuals' second moments are linear in Σ, S = Q Σ as vectors of nine,
    Q = Σ_mk P_mk ⊗ P_mk, turned with the segment in every frame; six unknowns are solved from the mean
    over frames. What they do not show, as that across four markers in a plane, stays isotropic.

    Args:
        points: (frames, M, 3), metres, NaN = missing.
        shape: the markers' rigid shape.
        pose: their least-squares pose onto it.

    Returns:
        None for fewer than four markers, which leave too little of the noise, or too few frames that
        have them all.

    Example:
        Noise of 1 mm sideways and 2 mm in depth.

        >>> import numpy as np
        >>> from mocap_skel.segments.shape import find_shape
        >>> places = 0.1 * np.random.default_rng(1).normal(size=(6, 3))
        >>> noise = np.random.default_rng(0).normal(size=(4000, 6, 3)) * [0.001, 0.002, 0.001]
        >>> points = places + noise
        >>> found = rigid_noise_matrix(points, *find_shape(points))
        >>> (1000 * np.sqrt(np.diag(found))).round(1)
        array([1., 2., 1.])
    """
    used = np.isfinite(shape.template[:, 0])
    template, weights = shape.template[used], shape.weights[used]
    if len(template) < 4:
        return None
    error = pose.to_segment(points[:, used]) - template
    square = np.einsum("fmi,fmi->f", error, error)
    frames = np.isfinite(square)
    frames &= np.where(frames, square, np.inf) <= _WILD * median(square)
    if frames.sum() < _LEAST_FRAMES:
        return None
    rotation = pose.rotation[frames]
    inside = np.einsum("fmi,fmj->fij", error[frames], error[frames])
    lab = (rotation @ inside @ rotation.swapaxes(1, 2)).mean(axis=0).reshape(9)
    turned = np.einsum("fik,fjl->fijkl", rotation, rotation).reshape(-1, 9, 9)
    projector = _projector(template, weights)
    q = np.einsum("mkij,mkab->iajb", projector, projector).reshape(9, 9)
    seen = (turned @ q @ turned.swapaxes(1, 2)).mean(axis=0)
    system, right = _SYMMETRIC.T @ seen @ _SYMMETRIC, _SYMMETRIC.T @ lab
    flat = _SYMMETRIC.T @ np.eye(3).reshape(9)
    level = flat @ right / (flat @ system @ flat)
    ridge = (_RIDGE * np.linalg.norm(system, 2)) ** 2
    deviation = np.linalg.solve(
        system.T @ system + ridge * np.eye(6), system.T @ (right - level * (system @ flat))
    )
    values, axes = np.linalg.eigh((_SYMMETRIC @ (level * flat + deviation)).reshape(3, 3))
    return np.asarray((axes * np.maximum(values, 0.0)) @ axes.T)


def _projector(template: Array, weights: Array) -> Array:
    """P, (M, M, 3, 3): what a weighted least-squares pose leaves of small displacements of the markers."""
    count = len(template)
    # A marker at t moves by δ + ω × t; ω × t is -[t]× ω.
    x, y, z = template.T
    zero = np.zeros(count)
    turn = np.stack([zero, z, -y, -z, zero, x, y, -x, zero], axis=1).reshape(count, 3, 3)
    moves = np.concatenate([np.broadcast_to(np.eye(3), (count, 3, 3)), turn], axis=2)
    weighted = weights[:, None, None] * moves
    normal = np.einsum("mia,mib->ab", weighted, moves)
    taken = np.einsum("mia,ab,kjb->mkij", moves, np.linalg.inv(normal), weighted)
    return np.asarray(np.eye(count)[:, :, None, None] * np.eye(3) - taken)

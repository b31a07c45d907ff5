"""Published ways to a joint centre, each written from its paper, to stand beside ours.

All see the same poses and points. Every function is vectorised over frames; what a paper has no answer for
is NaN. Metres.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from mocap_skel.segments.pose import Pose

Array = NDArray[np.float64]
METHODS = ("SCoRE", "SARA", "Gamage-Lasenby", "Halvorsen", "Chang-Pollard", "Harrington", "Hara")
# Halvorsen iterates until the centre rests; a case that needs more rounds runs away, as its paper's
# fixed point does where the noise is not small beside the movement.
ROUNDS = 1000
REST = 1e-9
# Fewer samples than unknowns, a centre and a radius, show nothing.
LEAST = 4
UNKNOWN = np.full(3, np.nan)


def score(parent: Pose, child: Pose) -> tuple[Array, Array]:
    """SCoRE: the point that is most nearly fixed in both segments (Ehrig et al., J Biomech 39, 2006).

    Least squares over the frames of [R₁ -R₂] [c₁; c₂] = t₂ - t₁. Its joint in a frame is the mean of the
    two places R₁ c₁ + t₁ and R₂ c₂ + t₂ (`score_track`).

    Returns:
        c₁ (3,) in the parent's frame and c₂ (3,) in the child's.
    """
    both = parent.known & child.known
    if both.sum() < LEAST:
        return UNKNOWN, UNKNOWN
    left = np.concatenate([parent.rotation[both], -child.rotation[both]], axis=2)
    right = child.origin[both] - parent.origin[both]
    found = np.linalg.lstsq(left.reshape(-1, 6), right.ravel(), rcond=None)[0]
    return found[:3], found[3:]


def score_track(parent: Pose, child: Pose, centres: tuple[Array, Array]) -> Array:
    """(frames, 3): SCoRE's joint in the lab, NaN where one of the poses is."""
    return 0.5 * (parent.to_lab(centres[0]) + child.to_lab(centres[1]))


def sara(parent: Pose, child: Pose) -> tuple[Array, Array]:
    """SARA: the axis that is most nearly fixed in both segments (Ehrig et al., J Biomech 40, 2007).

    The least squares of `score` leave the axis' own direction to noise: it is the singular vector of the
    smallest singular value, whose halves are the axis in the parent and in the child.

    Returns:
        A point (3,) of the axis and its direction (3,), both in the parent's frame.
    """
    both = parent.known & child.known
    if both.sum() < LEAST:
        return UNKNOWN, UNKNOWN
    left = np.concatenate([parent.rotation[both], -child.rotation[both]], axis=2).reshape(-1, 6)
    right = (child.origin[both] - parent.origin[both]).ravel()
    u, sizes, vt = np.linalg.svd(left, full_matrices=False)
    found = vt[:5].T @ ((u.T @ right)[:5] / sizes[:5])
    length = float(np.linalg.norm(vt[5, :3]))
    return found[:3], vt[5, :3] / length if length > 0 else UNKNOWN


def harrington(places: Mapping[str, Array], side: str) -> Array:
    """The hip (3,) by the pelvis' width and depth (Harrington et al., J Biomech 40, 595, 2007)."""
    found = _pelvis(places)
    if found is None:
        return UNKNOWN
    middle, front, left, up, width, depth = found
    out = left if side == "Left" else -left
    x, y, z = -0.24 * depth - 0.0099, -0.30 * width - 0.0109, 0.33 * width + 0.0073
    return np.asarray(middle + x * front + y * up + z * out)


def hara(places: Mapping[str, Array], side: str, leg: float) -> Array:
    """The hip (3,) by the leg's length alone (Hara et al., Sci Rep 6, 37707, 2016)."""
    found = _pelvis(places)
    if found is None or not np.isfinite(leg):
        return UNKNOWN
    middle, front, left, up, _, _ = found
    out = left if side == "Left" else -left
    x, y, z = 0.011 - 0.063 * leg, -0.009 - 0.078 * leg, 0.008 + 0.086 * leg
    return np.asarray(middle + x * front + y * up + z * out)


def _pelvis(
    places: Mapping[str, Array],
) -> tuple[Array, Array, Array, Array, float, float] | None:
    """Middle of the anterior spines, axes to front, left and up, width, depth; None without landmarks."""
    back = [places[m] for m in ("LBWT", "RBWT", "SACR") if m in places]
    if "LFWT" not in places or "RFWT" not in places or not back:
        return None
    across = places["LFWT"] - places["RFWT"]
    middle = 0.5 * (places["LFWT"] + places["RFWT"])
    depth = middle - np.mean(back, axis=0)
    left = across / np.linalg.norm(across)
    up = np.cross(depth, left)
    up /= np.linalg.norm(up)
    front = np.cross(left, up)
    return middle, front, left, up, float(np.linalg.norm(across)), float(np.linalg.norm(depth))


def _normal(inside: Array) -> tuple[Array, Array, Array, list[Array]]:
    """Gamage and Lasenby's A (3, 3) and b (3,), the sum of the markers' means, each marker's points.

    A = 2 Σ (v - v̄)(v - v̄)ᵀ and b = Σ (v - v̄) |v|², per marker and then summed. The paper divides by the
    number of frames, the same for all markers; where samples are missing the sums are what its cost
    function says. The means are weighed by their samples likewise.
    """
    square, right, means = np.zeros((3, 3)), np.zeros(3), np.zeros(3)
    points = []
    for p in range(inside.shape[1]):
        v = inside[np.isfinite(inside[:, p, 0]), p]
        if len(v) < 2:
            continue
        away = v - v.mean(axis=0)
        square += 2.0 * away.T @ away
        right += away.T @ (v * v).sum(axis=1)
        means += len(v) * v.mean(axis=0)
        points.append(v)
    return square, right, means, points


def _shift(inside: Array) -> Array:
    """A place among the points, to measure from: squares of metres would cost digits."""
    return np.asarray(np.nanmean(inside.reshape(-1, 3), axis=0))


def _enough(inside: Array) -> bool:
    return bool(np.isfinite(inside[..., 0]).sum(axis=0).max(initial=0) >= LEAST)


def gamage_lasenby(inside: Array) -> Array:
    """The centre (3,) of concentric spheres (Gamage & Lasenby, J Biomech 35, 2002).

    Minimises Σ_p Σ_k (|v_k^p - m|² - r_p²)², which is linear in m.

    Args:
        inside: (frames, M, 3), the child's markers in the parent's frame, NaN = missing.
    """
    if not _enough(inside):
        return UNKNOWN
    place = _shift(inside)
    square, right, _, _ = _normal(inside - place)
    return _solved(square, right) + place


def halvorsen(inside: Array) -> Array:
    """Gamage and Lasenby's centre without the bias of noise (Halvorsen, J Biomech 36, 2003).

    Round by round: the noise σ² is the mean over markers of Σ (u² - ū²)² / (4 N ū²), u the distances
    from the last centre; then A m = b - 2 σ² Σ_p (v̄_p - m_last).

    Args:
        inside: as for `gamage_lasenby`.

    Returns:
        NaN where the rounds do not come to rest.
    """
    if not _enough(inside):
        return UNKNOWN
    place = _shift(inside)
    square, right, means, points = _normal(inside - place)
    count = sum(len(v) for v in points)
    centre = _solved(square, right)
    for _ in range(ROUNDS):
        u2 = [((v - centre) ** 2).sum(axis=1) for v in points]
        noise = np.mean([np.var(u) / (4.0 * u.mean()) for u in u2])
        last, centre = centre, _solved(square, right - 2.0 * noise * (means - count * centre))
        step = float(np.linalg.norm(centre - last))
        if not step < 1e3:
            break
        if step < REST:
            return centre + place
    return UNKNOWN


def chang_pollard(inside: Array) -> Array:
    """Constrained least squares (Chang & Pollard, J Biomech 40, 2007).

    Spheres a |v|² + b·v + c_p = 0 with a and b in common, Σ of squares least under the constraint that
    the mean of |b|² - 4 a c_p over the samples is 1 (Pratt's normalisation): the eigenvector of the least
    eigenvalue above zero of S u = λ C u; the centre is -b / 2a.

    Args:
        inside: as for `gamage_lasenby`.
    """
    if not _enough(inside):
        return UNKNOWN
    place = _shift(inside)
    v = inside - place
    seen = np.isfinite(v[..., 0])
    size = float(np.sqrt(np.nanmean((v**2).sum(axis=-1))))
    if not size > 0:
        return UNKNOWN
    v = v / size
    share = seen.sum(axis=0) / seen.sum()
    # The c_p only enter the constraint by their weighed mean: for a given mean c they are free to be
    # each marker's best, which is c plus what makes its own mean residual that of all markers.
    rows = []
    for p in np.flatnonzero(seen.any(axis=0)):
        x = v[seen[:, p], p]
        rows.append(np.column_stack([(x * x).sum(axis=1), x]))
    middle = sum(s * r.mean(axis=0) for s, r in zip(share[share > 0], rows, strict=True))
    design = np.concatenate([r - r.mean(axis=0) + middle for r in rows])
    design = np.column_stack([design, np.ones(len(design))])
    scatter = design.T @ design / len(design)
    constraint = np.diag([0.0, 1.0, 1.0, 1.0, 0.0])
    constraint[0, 4] = constraint[4, 0] = -2.0
    values, vectors = np.linalg.eig(np.linalg.solve(constraint, scatter))
    vectors = vectors.real
    length = np.einsum("ik,ij,jk->k", vectors, constraint, vectors)
    allowed = np.where(length > 0, values.real, np.inf)
    best = vectors[:, int(np.argmin(allowed))]
    with np.errstate(divide="ignore", invalid="ignore"):
        centre = -0.5 * best[1:4] / best[0]
    return np.asarray(centre * size + place) if np.isfinite(centre).all() else UNKNOWN


def _solved(square: Array, right: Array) -> Array:
    try:
        return np.asarray(np.linalg.solve(square, right))
    except np.linalg.LinAlgError:
        return UNKNOWN


SPHERES = {
    "Gamage-Lasenby": gamage_lasenby,
    "Halvorsen": halvorsen,
    "Chang-Pollard": chang_pollard,
}

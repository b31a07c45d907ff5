"""Which rigid groups hang on each other: those that share a point that is fixed in both."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocap_skel.joints.centre import fit_centre
from mocap_skel.joints.samples import Frame, JointSamples
from mocap_skel.segments.pose import Array, Pose
from mocap_skel.segments.shape import Shape, find_shape, median
from mocap_skel.spherefit import DegenerateSphereError

# A neighbour is near: so much residual is a metre from the joint to the nearest marker worth. It decides
# only between groups that hardly move against each other.
PER_METRE = 0.02
# Metres: the prior of a joint about the middle of both groups, for directions that no motion shows.
REACH = 0.5
# Fewer frames with both groups show no joint.
LEAST_FRAMES = 10
# Frames that are looked at: they show a joint as well as all of a long clip do.
MOST_FRAMES = 1500


@dataclass(frozen=True)
class Hinge:
    """Two groups, the second hung on the first.

    Attributes:
        parent, child: indices of the groups.
        residual: metres, how far the common point is from fixed in both, root mean square.
        cost: the residual, and something for the joint's distance from the markers.
    """

    parent: int
    child: int
    residual: float
    cost: float


@dataclass(frozen=True, eq=False)
class _Body:
    """A group with the frame that its markers, and its joint if it needs that, give it."""

    points: Array
    shape: Shape
    pose: Pose


def hang(points: Array, groups: list[list[int]]) -> list[Hinge]:
    """A tree over groups of markers: the joints in the order in which they were found, at best G - 1.

    Prim's minimum spanning tree from the group with most markers that has a frame. Where both groups have
    three markers, the common point of both (SCoRE: Ehrig et al. 2006) tells the residual; otherwise
    the sphere on which the second's markers move in the first's frame. A group of two markers gets a
    frame, and can carry others, once it hangs on one: its joint is the third point.

    Args:
        points: (F, M, 3), NaN = missing.
        groups: the markers of each, the largest first.
    """
    points = points[:: max(len(points) // MOST_FRAMES, 1)]
    own = [points[:, g] for g in groups]
    bodies: dict[int, _Body] = {}
    for i, own_points in enumerate(own):
        found = find_shape(own_points) if own_points.shape[1] >= 3 else None
        if found is not None:
            bodies[i] = _Body(own_points, *found)
    if not bodies:
        return []
    sigma = float(np.median([body.shape.sigma for body in bodies.values()]))
    placed = {min(bodies)}
    best: dict[int, tuple[Hinge, Array]] = {}
    newest = min(bodies)
    tree: list[Hinge] = []
    while len(placed) < len(groups):
        for child in range(len(groups)):
            if child in placed or newest not in bodies:
                continue
            found_joint = _joint(bodies[newest], own[child], bodies.get(child), sigma)
            if found_joint is None:
                continue
            residual, cost, track = found_joint
            if child not in best or cost < best[child][0].cost:
                best[child] = (Hinge(newest, child, residual, cost), track)
        if not best:
            return tree
        newest = min(best, key=lambda child: best[child][0].cost)
        hinge, track = best.pop(newest)
        tree.append(hinge)
        placed.add(newest)
        if newest not in bodies and own[newest].shape[1] == 2:
            with_joint = np.concatenate([own[newest], track[:, None]], axis=1)
            found = find_shape(with_joint)
            if found is not None:
                bodies[newest] = _Body(with_joint, *found)
    return tree


def _joint(
    parent: _Body, points: Array, child: _Body | None, sigma: float
) -> tuple[float, float, Array] | None:
    """Residual, cost, and the joint's track in the lab (F, 3)."""
    if child is not None and child.points.shape[1] >= 3:
        found = common_point(parent.pose, child.pose)
        if found is None:
            return None
        centre, residual = found
        track = parent.pose.to_lab(centre)
    else:
        try:
            inside = parent.pose.to_segment(points)
            fit = fit_centre(JointSamples(inside, sigma, sigma, Frame(parent.shape)))
        except DegenerateSphereError:
            return None
        if fit is None:
            return None
        residual, track = fit.residual, parent.pose.to_lab(fit.centre)
    away = sum(_nearest(body, track) for body in (parent.points, points))
    return residual, residual + PER_METRE * away, track


def _nearest(points: Array, track: Array) -> float:
    """The median distance of a track from the nearest of some points."""
    far = median(np.linalg.norm(points - track[:, None], axis=-1).T)
    return float(np.nanmin(far)) if np.isfinite(far).any() else float(REACH)


def common_point(first: Pose, second: Pose) -> tuple[Array, float] | None:
    """The point that is most nearly fixed in two frames (SCoRE), in the first's, and its residual in m.

    Minimises Σ |p + M c - q - N d|² over c and d, with a weak prior at both origins that holds what
    the motion does not show. None where fewer than LEAST_FRAMES frames have both.
    """
    both = first.known & second.known
    count = int(both.sum())
    if count < LEAST_FRAMES:
        return None
    m, n = first.rotation[both], second.rotation[both]
    between = second.origin[both] - first.origin[both]
    cross = -np.einsum("fji,fjk->ik", m, n)
    left = np.block([[count * np.eye(3), cross], [cross.T, count * np.eye(3)]])
    right = np.concatenate(
        [np.einsum("fji,fj->i", m, between), -np.einsum("fji,fj->i", n, between)]
    )
    # As sure as frames that are REACH off: a millimetre of noise against half a metre.
    prior = count * (0.001 / REACH) ** 2
    c, d = np.split(np.linalg.solve(left + prior * np.eye(6), right), 2)
    off = m @ c - n @ d - between
    return c, float(np.sqrt(np.einsum("fi,fi->", off, off) / count))

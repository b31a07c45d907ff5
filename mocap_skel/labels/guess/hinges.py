"""Find the joints between rigid groups of markers: two groups are neighbours if a point is fixed in both."""

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
    """A joint: the group `child` hangs on the group `parent`.

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
    """A group with its frame, from its markers and, if they are only two, its joint."""

    points: Array
    shape: Shape
    pose: Pose


def hang(points: Array, groups: list[list[int]]) -> list[Hinge]:
    """Connect groups of markers to a tree by joints, the joints in the order in which they were found.

    Prim's minimum spanning tree from the group with most markers that has a frame. Where both groups have
    three markers, the common point of both (SCoRE: Ehrig et al. 2006) tells the residual; otherwise
    the sphere on which the second's markers move in the first's frame. A group of two markers gets a
    frame, and can carry others, once it hangs on one: its joint is the third point.

    Args:
        points: (F, M, 3), NaN = missing.
        groups: the markers of each of the G groups, the largest first.

    Returns:
        At most G - 1 joints; none if no group has a frame.
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
    """The joint between a body and a group: residual, cost, and its track in the lab (F, 3); None for no joint."""
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
    """The distance of a track (F, 3) from the nearest of some points (F, M, 3), by their medians over the frames."""
    far = median(np.linalg.norm(points - track[:, None], axis=-1).T)
    return float(np.nanmin(far)) if np.isfinite(far).any() else float(REACH)


def common_point(first: Pose, second: Pose) -> tuple[Array, float] | None:
    """Find the point that is most nearly fixed in two moving frames (SCoRE: Ehrig et al. 2006).

    Minimises Σ |p + M c - q - N d|² over c and d, with a weak prior at both origins that holds what
    the motion does not show.

    Returns:
        The point (3,) in the first frame, metres, and the root mean square residual, metres; None if
        fewer than LEAST_FRAMES frames have both poses.

    >>> angle = np.linspace(0, 1, 50)
    >>> zero, one = np.zeros(50), np.ones(50)
    >>> rows = [[np.cos(angle), -np.sin(angle), zero], [np.sin(angle), np.cos(angle), zero], [zero, zero, one]]
    >>> turning = np.moveaxis(np.array(rows), 2, 0)
    >>> knee, residual = common_point(Pose(np.tile(np.eye(3), (50, 1, 1)), np.zeros((50, 3))),
    ...                               Pose(turning, [0.1, 0.2, 0] - turning @ [0.3, 0, 0]))
    >>> knee.round(3), residual < 1e-4
    (array([0.1, 0.2, 0. ]), True)
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

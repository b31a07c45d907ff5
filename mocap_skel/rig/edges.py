"""Where lost markers would be, known at both edges of a gap and carried into it.

Skin and rigid bones make a figure that is fitted to some of its markers differ from one that is fitted to all, by
centimetres at a pelvis that only the thighs and the thorax tell of. How far is known in the frames beside a gap, where all
are there: the same markers are hidden, the frames are solved again, and the places that the hidden ones have in that
figure are theirs inside the gap as well. They go from those at one edge to those at the other.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mocap_skel.rig.bridging import SIDE, runs
from mocap_skel.rig.model import Model
from mocap_skel.rig.solver import Poses, Problem, marker_sums, solve
from mocap_skel.segments.pose import Array

# Gauss-Newton steps: a start from all markers is near.
STEPS = 3
# What a marker that is known from the edges weighs beside one that is seen: skin moves meanwhile. By trial on gaps of a
# second; from 0.3 to 1 joints are moved by the same within a fifth.
WORTH = 0.3


@dataclass(frozen=True)
class _Edge:
    """The frames beside a gap, and the frame in it that tells which markers are lost."""

    segments: tuple[int, ...]
    frames: tuple[int, ...]
    inside: int


def carried_in(model: Model, problem: Problem, poses: Poses, missing: NDArray[np.bool_]) -> Poses:
    """The motion with what is known at the edges of its gaps carried into them.

    Args:
        model: the figure and its markers.
        problem: what the poses solve.
        poses: of F frames.
        missing: (S, F) where a segment has no pose of its own.
    """
    gaps: dict[tuple[int, int], list[int]] = defaultdict(list)
    for s, row in enumerate(missing):
        for gap in runs(row):
            gaps[gap].append(s)
    frames = missing.shape[1]
    edges: dict[tuple[int, int], tuple[_Edge, _Edge]] = {}
    for (start, stop), lost in gaps.items():
        free = np.asarray(~missing[lost].any(axis=0))
        before = [f for f in range(max(0, start - SIDE), start) if free[f:start].all()]
        after = [f for f in range(stop, min(frames, stop + SIDE)) if free[stop : f + 1].all()]
        if before or after:
            edges[start, stop] = (
                _Edge(tuple(lost), tuple(before), start),
                _Edge(tuple(lost), tuple(after), stop - 1),
            )
    if not edges:
        return poses
    return _corrected(model, problem, poses, edges)


def _corrected(
    model: Model,
    problem: Problem,
    poses: Poses,
    edges: dict[tuple[int, int], tuple[_Edge, _Edge]],
) -> Poses:
    joints = poses.joints(model.bones)
    shown = [np.full_like(own, np.nan) for own in model.points]
    places = _places(model, problem, poses, [edge for both in edges.values() for edge in both])
    inside = np.zeros(poses.frames, dtype=bool)
    for (start, stop), both in edges.items():
        known = [places[edge] for edge in both if edge.frames]
        here = slice(start, stop)
        inside[here] = True
        share = (np.arange(1, stop - start + 1) / (stop - start + 1))[:, None, None]
        for s in both[0].segments:
            place = (1.0 - share) * known[0][s] + share * known[-1][s]
            found = np.einsum("ijf,fmj->fmi", poses.turn[:, :, s, here], place)
            found += joints[:, s, here].T[:, None]
            shown[s][here] = np.where(np.isnan(model.points[s][here]), found, np.nan)
    at = np.flatnonzero(inside)
    weights = tuple(WORTH * own for own in model.bones.weights)
    bones = replace(model.bones, weights=weights)
    more = marker_sums(bones, [own[at] for own in shown], problem.sums.origin[:, at].T)
    part = problem.at(at)
    solved = solve(replace(part, sums=part.sums.plus(more)), poses.at(at), STEPS)
    turn, root = poses.turn.copy(), poses.root.copy()
    turn[..., at], root[:, at] = solved.turn, solved.root
    return Poses(turn, root)


def _places(
    model: Model, problem: Problem, poses: Poses, edges: Iterable[_Edge]
) -> dict[_Edge, dict[int, Array]]:
    """Of each edge and each of its segments, where its markers (M, 3) are from its joint, in its axes.

    In a figure that is fitted without those that the gap loses; the mean over the edge.
    """
    chosen = [edge for edge in edges if edge.frames]
    at = np.array([f for edge in chosen for f in edge.frames])
    points = [own[at].copy() for own in model.points]
    rows, row = {}, 0
    for edge in chosen:
        rows[edge] = slice(row, row + len(edge.frames))
        row = rows[edge].stop
        for s in edge.segments:
            points[s][rows[edge], np.isnan(model.points[s][edge.inside, :, 0])] = np.nan
    sums = marker_sums(model.bones, points, problem.sums.origin[:, at].T)
    less = solve(replace(problem.at(at), sums=sums), poses.at(at), STEPS)
    joints = less.joints(model.bones)
    found: dict[_Edge, dict[int, Array]] = {}
    for edge, own in rows.items():
        found[edge] = {}
        for s in edge.segments:
            away = model.points[s][at[own]] - joints[:, s, own].T[:, None]
            inside = np.einsum("jif,fmj->fmi", less.turn[:, :, s, own], away)
            seen = np.isfinite(inside).all(axis=2)
            total = np.where(seen[..., None], inside, 0.0).sum(axis=0)
            count = seen.sum(axis=0)[:, None]
            mean = total / np.maximum(count, 1)
            found[edge][s] = np.where(count > 0, mean, model.bones.places[s])
    return found

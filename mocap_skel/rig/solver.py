"""Poses of a figure of rigid bones that explain the visible markers best, in many frames at once.

Unknown in each frame are the root's place and a rotation of every segment. Joints are constant in their parent
and markers in their segment, so that Σ w |p + R m - x|² over all markers is minimised by Gauss-Newton steps. Each
step solves its normal equations exactly by elimination along the tree, from the leaves to the root and back, in
blocks of 3 x 3 (as articulated bodies: Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 7). A child
that is eliminated acts on its parent as one more marker at the joint, whose weight is a matrix. What a frame's
markers tell enters by sums that are made once, so a step costs the same whatever the number of markers.

Arrays have their components first and the frames last: rotations (3, 3, segments, frames).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mocap_skel.rig.blocks import (
    apply,
    cross,
    diagonal,
    inverse,
    multiply,
    rotation,
    rotation_vector,
    times_skew,
    transposed,
)
from mocap_skel.rig.freedoms import Freedom
from mocap_skel.segments.pose import Array

# Radians. A frame's step is no longer than this, so that a far start does not run away,
LONGEST_STEP = 0.3
# and a frame is done when no segment turns by more than this; the next step would be its square.
DONE = 1e-3
MOST_STEPS = 12
# Frames at a time: what a step needs of so many stays in the cache.
CHUNK = 2048
# Frames that are done are taken out when they are more than this share: taking out costs as much as a step.
WORTH_LEAVING = 0.3
# Metres and a share: every joint resists a change of its turn within a step as much as a marker of so little
# weight at so short a lever; else a turn that no marker shows would have no answer. It biases nothing: it
# pulls to where the step starts.
LEVER = 0.05
# The same where nothing may be added: what keeps the inverse of a turn that no marker shows finite.
NO_RESISTANCE = 1e-9
RESISTANCE = 1e-3


@dataclass(frozen=True, eq=False)
class Bones:
    """A figure of rigid bones. Metres.

    Attributes:
        parents: (n) each segment's parent, -1 for the root; breadth first, so that depths ascend.
        offsets: (n, 3) each segment's joint from its parent's joint, in the parent's axes.
        places: (M, 3) each segment's markers from its joint, in its axes.
        weights: (M,) of those markers, 1 / variance.
    """

    parents: tuple[int, ...]
    offsets: Array
    places: tuple[Array, ...]
    weights: tuple[Array, ...]

    @property
    def unit(self) -> float:
        """What a marker of the usual weight tells of a turn at the lever of `LEVER`: 1 / radian²."""
        every = np.concatenate(self.weights)
        return float(every.mean()) * LEVER**2 if len(every) else 1.0

    @property
    def floors(self) -> list[slice]:
        """The segments of each depth."""
        depth = [0]
        for parent in self.parents[1:]:
            depth.append(depth[parent] + 1)
        assert depth == sorted(depth), "segments have to be breadth first"
        edges = [i for i, (a, b) in enumerate(pairwise([-1, *depth])) if a != b]
        return [slice(a, b) for a, b in pairwise([*edges, len(depth)])]


@dataclass(frozen=True, eq=False)
class Pull:
    """A pull of a segment's turn in its parent towards a given one.

    Attributes:
        segment: its index.
        turn: (3, 3, frames), the child's axes in the parent's.
        stiffness: (frames,) 1 / radian².
    """

    segment: int
    turn: Array
    stiffness: Array

    def at(self, frames: NDArray[np.intp]) -> Pull:
        return Pull(self.segment, self.turn[..., frames], self.stiffness[frames])


@dataclass(frozen=True, eq=False)
class Sums:
    """What the visible markers of each segment and frame tell, with w = 0 for a hidden one.

    Attributes:
        n: (S, F) Σ w.
        a: (3, S, F) Σ w m.
        x: (3, S, F) Σ w x, the marker x counted from `origin`.
        b: (3, 3, S, F) Σ w m xᵀ.
        q: (3, 3, S, F) Σ w m mᵀ.
        origin: (3, F) a place near the root.
    """

    n: Array
    a: Array
    x: Array
    b: Array
    q: Array
    origin: Array

    def at(self, frames: NDArray[np.intp]) -> Sums:
        parts = (self.n, self.a, self.x, self.b, self.q, self.origin)
        return Sums(*(np.ascontiguousarray(part[..., frames]) for part in parts))

    def plus(self, other: Sums) -> Sums:
        """Both sets of markers together; they are counted from the same origin."""
        return Sums(
            self.n + other.n, self.a + other.a, self.x + other.x, self.b + other.b,
            self.q + other.q, self.origin,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Poses:
    """Where the figure is in every frame.

    Attributes:
        turn: (3, 3, S, F) each segment's axes in the lab.
        root: (3, F) the root's joint in the lab.
    """

    turn: Array
    root: Array

    @property
    def frames(self) -> int:
        return int(self.turn.shape[3])

    def at(self, frames: NDArray[np.intp]) -> Poses:
        return Poses(
            np.ascontiguousarray(self.turn[..., frames]), np.ascontiguousarray(self.root[:, frames])
        )

    def joints(self, bones: Bones) -> Array:
        """(3, S, F): where each segment's joint is."""
        places = np.empty((3, *self.turn.shape[2:]))
        places[:, 0] = self.root
        for s, parent in enumerate(bones.parents[1:], 1):
            places[:, s] = places[:, parent] + apply(self.turn[:, :, parent], bones.offsets[s])
        return places

    def local(self, bones: Bones, segment: int) -> Array:
        """(3, 3, F): a segment's turn in its parent; the root's in the lab."""
        parent = bones.parents[segment]
        own = self.turn[:, :, segment]
        return own if parent < 0 else multiply(transposed(self.turn[:, :, parent]), own)


def marker_sums(bones: Bones, points: Sequence[Array], origin: Array) -> Sums:
    """The sums of all frames.

    Args:
        bones: S segments.
        points: of each segment (F, M, 3), NaN = hidden.
        origin: (F, 3) a place near the root; sums over lab coordinates would lose digits.
    """
    count, frames = len(bones.parents), len(origin)
    n, a, x = np.zeros((count, frames)), np.zeros((3, count, frames)), np.zeros((3, count, frames))
    b, q = np.zeros((3, 3, count, frames)), np.zeros((3, 3, count, frames))
    for s, (place, weight, seen) in enumerate(
        zip(bones.places, bones.weights, points, strict=True)
    ):
        if not len(place):
            continue
        moved = (seen - origin[:, None]).transpose(2, 1, 0)
        visible = np.isfinite(moved[0])
        w = weight[:, None] * visible
        weighed = w * np.where(visible, moved, 0.0)
        n[s] = w.sum(axis=0)
        a[:, s] = place.T @ w
        x[:, s] = weighed.sum(axis=1)
        b[:, :, s] = np.einsum("mi,jmf->ijf", place, weighed)
        squares = (place[:, :, None] * place[:, None, :]).reshape(len(place), 9)
        q[:, :, s] = (squares.T @ w).reshape(3, 3, frames)
    return Sums(n, a, x, b, q, np.ascontiguousarray(origin.T))


@dataclass(frozen=True, eq=False)
class Problem:
    """All that a step needs but the poses."""

    bones: Bones
    sums: Sums
    freedoms: tuple[Freedom, ...] = ()
    pulls: tuple[Pull, ...] = ()

    def at(self, frames: NDArray[np.intp]) -> Problem:
        pulls = tuple(pull.at(frames) for pull in self.pulls)
        return Problem(self.bones, self.sums.at(frames), self.freedoms, pulls)


def solve(problem: Problem, start: Poses, most: int = MOST_STEPS) -> Poses:
    """The poses with the least squares, from starts that are not too far away.

    Args:
        problem: markers of F frames.
        start: F frames without NaN.
        most: Gauss-Newton steps a frame.
    """
    turn, root = start.turn.copy(), start.root - problem.sums.origin
    for first in range(0, start.frames, CHUNK):
        here = np.arange(first, min(first + CHUNK, start.frames))
        now, own = Poses(turn, root).at(here), problem.at(here)
        for _ in range(most):
            now, size = _stepped(own, now)
            rest = size >= DONE
            if rest.mean() < 1.0 - WORTH_LEAVING or not rest.any():
                turn[..., here], root[:, here] = now.turn, now.root
                if not rest.any():
                    break
                kept = np.flatnonzero(rest)
                here, now, own = here[kept], now.at(kept), own.at(kept)
        turn[..., here], root[:, here] = now.turn, now.root
    return Poses(turn, root + problem.sums.origin)


def known_turns(problem: Problem, poses: Poses) -> Array:
    """What the markers, and the joints below, tell of each segment's turn about its joint.

    Returns:
        (S, F, 3) eigenvalues, 1 / radian², ascending: the inverse variance of the turn about the axis that is
        known least, and so on; the segment's own joint counts as known.
    """
    relative = Poses(poses.turn, poses.root - problem.sums.origin)
    system = _assembled(problem, relative, NO_RESISTANCE)
    offsets = _turned_offsets(problem.bones, relative)
    for floor in reversed(problem.bones.floors[1:]):
        _eliminated(system, floor, offsets, problem.bones.parents)
    matrices = system.ww.transpose(2, 3, 0, 1).copy()
    # The root has no joint: its place is found together with its turn.
    d = system.pp[:, :, 0] + diagonal(np.full(poses.frames, 1e-9 * problem.bones.unit))
    uw = system.pw[:, :, 0]
    matrices[0] -= multiply(multiply(transposed(uw), inverse(d)), uw).transpose(2, 0, 1)
    return np.asarray(np.linalg.eigvalsh(matrices))


@dataclass(eq=False)
class _System:
    """Normal equations of one step; the blocks of a segment's turn ω and its joint's shift δp.

    ww, pw, pp: (3, 3, S, F) second derivatives; w, p: (3, S, F) minus the first ones. `stiff` and `wanted` are the
    pulls between a segment and its parent, and what they would turn.
    """

    ww: Array
    pw: Array
    pp: Array
    w: Array
    p: Array
    stiff: Array
    wanted: Array


def _assembled(problem: Problem, poses: Poses, resistance: float) -> _System:
    sums, turn = problem.sums, poses.turn
    joints = poses.joints(problem.bones)
    y = apply(turn, sums.a)
    g = multiply(turn, sums.b)
    g -= y[:, None] * joints[None]
    square = multiply(multiply(turn, sums.q), transposed(turn))
    ww = diagonal(square[0, 0] + square[1, 1] + square[2, 2]) - square
    zero = np.zeros_like(sums.n)
    pw = np.stack(
        [
            np.stack([zero, y[2], -y[1]]),
            np.stack([-y[2], zero, y[0]]),
            np.stack([y[1], -y[0], zero]),
        ]
    )
    w = np.stack([g[1, 2] - g[2, 1], g[2, 0] - g[0, 2], g[0, 1] - g[1, 0]])
    stiff, wanted = _pulls(problem, turn, resistance)
    return _System(
        ww + stiff, pw, diagonal(sums.n), w + wanted, sums.x - sums.n * joints - y, stiff, wanted
    )


def _pulls(problem: Problem, turn: Array, resistance: float) -> tuple[Array, Array]:
    """Λ (3, 3, S, F) and Λ e (3, S, F) of ½ (ω - ω_parent - e)ᵀ Λ (ω - ω_parent - e)."""
    bones = problem.bones
    stiff = diagonal(np.full(turn.shape[2:], resistance * bones.unit))
    # The root has no parent; a trace of it keeps a frame without any marker solvable.
    stiff[:, :, 0] *= 1e-6
    wanted = np.zeros((3, *turn.shape[2:]))
    for freedom in problem.freedoms:
        for segment, held, pulled in freedom.priors(turn, bones.parents):
            stiff[:, :, segment] += held
            wanted[:, segment] += pulled
    for pull in problem.pulls:
        goal = multiply(turn[:, :, bones.parents[pull.segment]], pull.turn)
        away = rotation_vector(multiply(goal, transposed(turn[:, :, pull.segment])))
        stiff[:, :, pull.segment] += diagonal(pull.stiffness)
        wanted[:, pull.segment] += pull.stiffness * away
    return stiff, wanted


def _turned_offsets(bones: Bones, poses: Poses) -> Array:
    """(3, S, F): from the parent's joint to each segment's, in the lab."""
    offsets = np.zeros((3, *poses.turn.shape[2:]))
    for s, parent in enumerate(bones.parents[1:], 1):
        offsets[:, s] = apply(poses.turn[:, :, parent], bones.offsets[s])
    return offsets


def _eliminated(system: _System, floor: slice, offsets: Array, parents: tuple[int, ...]) -> Array:
    """Take the turns of one floor out of the equations, which changes those of its parents.

    Returns:
        (3, 3, floor, F): the inverses that give these turns back.
    """
    o, stiff = offsets[:, floor], system.stiff[:, :, floor]
    pw, w = system.pw[:, :, floor], system.w[:, floor]
    free = inverse(system.ww[:, :, floor])
    pull = multiply(pw, free)
    weight = system.pp[:, :, floor] - multiply(pull, transposed(pw))
    force = system.p[:, floor] - apply(pull, w)
    held = multiply(stiff, free)
    mixed = multiply(held, transposed(pw))
    skewed, twisted = times_skew(weight, o), times_skew(mixed, o)
    ww = stiff - multiply(held, stiff) - cross(o, skewed) - twisted - transposed(twisted)
    turned = cross(o, force) + apply(held, w) - system.wanted[:, floor]
    back = transposed(mixed) - skewed
    for k, parent in enumerate(parents[floor]):
        system.pp[:, :, parent] += weight[:, :, k]
        system.p[:, parent] += force[:, k]
        system.pw[:, :, parent] += back[:, :, k]
        system.ww[:, :, parent] += ww[:, :, k]
        system.w[:, parent] += turned[:, k]
    return free


def _stepped(problem: Problem, poses: Poses) -> tuple[Poses, Array]:
    """One Gauss-Newton step, and how far (F,) it turns the segment that turns most. Places as in the sums."""
    bones = problem.bones
    system = _assembled(problem, poses, RESISTANCE)
    offsets = _turned_offsets(bones, poses)
    floors = bones.floors
    free = [_eliminated(system, f, offsets, bones.parents) for f in reversed(floors[1:])][::-1]
    own = inverse(system.ww[:, :, 0])
    pull = multiply(system.pw[:, :, 0], own)
    weight = system.pp[:, :, 0] - multiply(pull, transposed(system.pw[:, :, 0]))
    weight += diagonal(np.full(poses.frames, 1e-9 * bones.unit))
    turns, shifts = np.empty_like(offsets), np.empty_like(offsets)
    shifts[:, 0] = apply(inverse(weight), system.p[:, 0] - apply(pull, system.w[:, 0]))
    turns[:, 0] = apply(own, system.w[:, 0] - apply(transposed(system.pw[:, :, 0]), shifts[:, 0]))
    for floor, inverted in zip(floors[1:], free, strict=True):
        above = list(bones.parents[floor])
        shifts[:, floor] = shifts[:, above] + cross(turns[:, above], offsets[:, floor])
        moved = system.w[:, floor] - apply(transposed(system.pw[:, :, floor]), shifts[:, floor])
        turns[:, floor] = apply(inverted, moved + apply(system.stiff[:, :, floor], turns[:, above]))
    size = np.sqrt((turns * turns).sum(axis=0)).max(axis=0)
    share = np.minimum(1.0, LONGEST_STEP / np.maximum(size, 1e-12))
    turned = multiply(rotation(turns * share), poses.turn)
    return Poses(turned, poses.root + shifts[:, 0] * share), size

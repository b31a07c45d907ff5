"""The rigid figure through a clip: fitted to the markers of every frame, its gaps bridged, its jumps repaired."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mocap_skel.rig.blocks import apply, multiply
from mocap_skel.rig.bridging import bridged, bridged_places, eased, runs, smoothed
from mocap_skel.rig.freedoms import Shared
from mocap_skel.rig.model import Model
from mocap_skel.rig.solver import Bones, Poses, Problem, Pull, known_turns, marker_sums, solve
from mocap_skel.segments.pose import Array

# A pull towards the mean turn (a hand of one marker) or the bridge over a gap: as a marker of so small a weight
# at `solver.LEVER`. It decides what nothing else does, and is lost beside any marker.
FAINT = 0.03
# Radians: what the markers tell of a turn is enough if its standard deviation is below it.
TOLD = 0.2
# Frames that tell where the markers are in the rigid bones.
SAMPLES = 200
# No branch is left out while the whole figure is there in so large a share of the frames.
SELDOM = 0.5
# Steps of a march into a gap, and Gauss-Newton steps at each: a start from a neighbour is near.
MARCH, MARCH_STEPS = 120, 3
# Seconds and radians: turns are pulled towards their own mean over so long a time as firmly as to so large an
# angle. It takes what markers do not show; joints move by millimetres (benchmarks/rig_quality.py).
CALM, CALM_ANGLE = 1.0 / 30.0, np.radians(5.0)


@dataclass(frozen=True)
class Limits:
    """What a motion may be.

    Attributes:
        gap: seconds; a turn that nothing shows for longer is not bridged.
        hold: seconds at the ends of a clip for which the nearest turn is held.
        speed: degrees a second; no joint turns faster.
    """

    gap: float = 2.0
    hold: float = 0.25
    speed: float = 1500.0


@dataclass(frozen=True)
class Bridge:
    """A stretch of frames in which the closed-form fit has no pose of a segment.

    Attributes:
        segment: its index.
        start, stop: indices of frames.
        by: "markers" (those left, and the joints beside it, show the turn), "motion" (before and after it), "hold"
            (the nearest turn, at the clip's ends), or "" (too long: nothing is said there).
        residual: metres, root mean square distance of the markers seen meanwhile on the segment and its
            neighbours; NaN for none.
    """

    segment: int
    start: int
    stop: int
    by: str
    residual: float


@dataclass(frozen=True, eq=False)
class RigidMotion:
    """Rigid bones moving through a clip.

    Attributes:
        model: the figure.
        poses: of all frames; where `absent` it means nothing.
        absent: (S, F) segments of which nothing is known for too long.
        bridges: every stretch that the closed-form fit has no pose for, by segment and frame.
        repaired: (S, F) turns that were faster than the limit, replaced.
        problem: what the poses solve.
    """

    model: Model
    poses: Poses
    absent: NDArray[np.bool_]
    bridges: tuple[Bridge, ...]
    repaired: NDArray[np.bool_]
    problem: Problem

    @property
    def stretches(self) -> list[tuple[int, int]]:
        """(start, stop) of the frames in which every segment is known, the longest first."""
        found = runs(np.asarray(~self.absent.any(axis=0)))
        return sorted(found, key=lambda one: (one[0] - one[1], one[0]))


def rigid_motion(model: Model, rate: float, limits: Limits | None = None) -> RigidMotion:
    """Fit the rigid figure to the markers of every frame.

    A frame in which a segment is lost is started from its neighbours' turns, marching into the gap from both
    sides, so that a knee does not flip. What no marker shows there follows the motion before and after.
    Branches that are lost in most of the clip are left out; `motion.model` tells what is there.

    Args:
        model: the figure, its markers and the closed-form poses to start from.
        rate: frames a second.
        limits: how long gaps may be, and how fast joints.
    """
    limits = limits or Limits()
    found = _moved(model, rate, limits)
    while less := _worth_leaving_out(found.model, found.absent):
        found = _moved(found.model.without(less), rate, limits)
    return found


def _moved(model: Model, rate: float, limits: Limits) -> RigidMotion:
    missing = model.missing
    gap = np.asarray(missing.any(axis=0))
    start = _started(model, rate)
    model = _replaced(model, start, gap)
    bones = model.bones
    problem = Problem(
        bones,
        marker_sums(bones, model.points, start.root.T),
        model.freedoms,
        tuple(_loose_pulls(model, start.frames)),
    )
    whole = np.flatnonzero(~gap)
    poses = _put(start, solve(problem.at(whole), start.at(whole)), whole)
    if gap.any():
        poses = _marched(problem, poses, missing, gap) if len(whole) else poses
        bridges = [
            Pull(
                s,
                bridged(poses.local(bones, s), ~missing[s], rate),
                FAINT * bones.unit * missing[s],
            )
            for s in np.flatnonzero(missing.any(axis=1)).tolist()
            # The root has no parent to turn in.
            if s
        ]
        inside = np.flatnonzero(gap)
        problem = replace(problem, pulls=(*problem.pulls, *bridges))
        poses = _put(poses, solve(problem.at(inside), poses.at(inside)), inside)
    absent, spans = _judged(problem, poses, missing, rate, limits)
    poses = _calmed(problem, poses, rate)
    poses, repaired = _slowed(bones, poses, absent, np.radians(limits.speed) / rate)
    residual = residuals(model, poses)
    told = [
        Bridge(s, a, b, by, _root_mean_square(residual, bones, s, slice(a, b)))
        for s, a, b, by in spans
    ]
    return RigidMotion(model, poses, absent, tuple(told), repaired, problem)


def _replaced(model: Model, start: Poses, gap: NDArray[np.bool_]) -> Model:
    """The figure with its markers where the rigid bones see them, which is not quite where free poses did.

    From one fit to a few frames; done again and again it would let the joints drift.
    """
    whole = np.flatnonzero(~gap)
    if len(whole) < SAMPLES:
        return model
    few = whole[np.linspace(0, len(whole) - 1, SAMPLES).astype(int)]
    points = [own[few] for own in model.points]
    sums = marker_sums(model.bones, points, start.root[:, few].T)
    pulls = tuple(pull.at(few) for pull in _loose_pulls(model, start.frames))
    poses = solve(Problem(model.bones, sums, model.freedoms, pulls), start.at(few))
    joints = poses.joints(model.bones)
    places = []
    for s, (place, own) in enumerate(zip(model.bones.places, points, strict=True)):
        away = own.transpose(1, 2, 0) - joints[None, :, s]
        inside = np.einsum("jif,mjf->mif", poses.turn[:, :, s], away)
        seen = np.isfinite(inside[:, 0])
        mean = (
            np.where(seen[:, None], inside, 0.0).sum(axis=2)
            / np.maximum(seen.sum(axis=1), 1)[:, None]
        )
        places.append(np.where(seen.any(axis=1)[:, None], mean, place))
    return replace(model, bones=replace(model.bones, places=tuple(places)))


def _started(model: Model, rate: float) -> Poses:
    """The closed-form poses, where there are none the bridged turns of the joints."""
    bones, missing = model.bones, model.missing
    turn = np.nan_to_num(model.start.turn)
    for s, parent in enumerate(bones.parents):
        lost = missing[s]
        if lost.any():
            known = ~lost if parent < 0 else ~lost & ~missing[parent]
            filled = bridged(Poses(turn, model.start.root).local(bones, s), known, rate)[..., lost]
            above = turn[:, :, parent][..., lost]
            turn[:, :, s, lost] = filled if parent < 0 else multiply(above, filled)
    return Poses(turn, bridged_places(model.start.root, ~missing[0]))


def _loose_pulls(model: Model, frames: int) -> list[Pull]:
    stiffness = np.full(frames, FAINT * model.bones.unit)
    return [
        Pull(s, np.broadcast_to(turn[..., None], (3, 3, frames)), stiffness)
        for s, turn in model.loose.items()
    ]


def _put(poses: Poses, part: Poses, frames: NDArray[np.intp]) -> Poses:
    turn, root = poses.turn.copy(), poses.root.copy()
    turn[..., frames], root[:, frames] = part.turn, part.root
    return Poses(turn, root)


def _marched(
    problem: Problem, poses: Poses, missing: NDArray[np.bool_], gap: NDArray[np.bool_]
) -> Poses:
    """Gaps solved frame by frame from both sides, each from its neighbour's turns."""
    bones = problem.bones
    turn, root = poses.turn.copy(), poses.root.copy()
    walks = _walks(gap)
    for step in range(max(map(len, walks), default=0)):
        here, before = np.array([w[step] for w in walks if step < len(w)]).T
        # Frames that a long march passes over start as the one that it comes to.
        for s, parent in enumerate(bones.parents):
            lost = missing[s, here]
            if lost.any():
                at, old = here[lost], before[lost]
                local = Poses(turn[..., old], root[:, old]).local(bones, s)
                above = turn[:, :, parent][..., at]
                turn[:, :, s, at] = local if parent < 0 else multiply(above, local)
        found = solve(problem.at(here), Poses(turn, root).at(here), MARCH_STEPS)
        turn[..., here], root[:, here] = found.turn, found.root
    return Poses(turn, root)


def _walks(gap: NDArray[np.bool_]) -> list[list[tuple[int, int]]]:
    """For each side of each gap the (frame, frame before it) that a march takes."""
    walks = []
    for start, stop in runs(gap):
        inner = start > 0 and stop < len(gap)
        middle = (start + stop + 1) // 2 if inner else (stop if start > 0 else start)
        for path in (range(start - 1, middle), range(stop, middle - 1, -1)):
            frames = [f for f in path if 0 <= f < len(gap)][: MARCH + 1]
            if len(frames) > 1 and not gap[frames[0]]:
                walks.append(list(zip(frames[1:], frames[:-1], strict=True)))
    return walks


def _judged(
    problem: Problem,
    poses: Poses,
    missing: NDArray[np.bool_],
    rate: float,
    limits: Limits,
) -> tuple[NDArray[np.bool_], list[tuple[int, int, int, str]]]:
    """Which segments are absent where, and every stretch (segment, start, stop, by) of a missing pose."""
    told = _told(problem, poses, missing)
    by_motion, by_hold, absent = (np.zeros_like(missing) for _ in range(3))
    for s, lost in enumerate(missing):
        for a, b in runs(lost & ~told[s]):
            end = a == 0 or b == len(lost)
            short = b - a <= (limits.hold if end else limits.gap) * rate and b - a != len(lost)
            kind = (by_hold if end else by_motion) if short else absent
            kind[s, a:b] = True
    for freedom in problem.freedoms:
        # Parts of a turn that nothing shows are not there either.
        if isinstance(freedom, Shared):
            absent[list(freedom.segments)] |= absent[freedom.segments[-1]]
    for s, parent in enumerate(problem.bones.parents):
        # Nor is what no marker ever shows, where the segment that it hangs from is not.
        if parent >= 0 and not len(problem.bones.places[s]):
            absent[s] |= absent[parent]
    kinds = {"markers": told, "motion": by_motion, "hold": by_hold}
    found = {by: missing & flags & ~absent for by, flags in kinds.items()} | {"": missing & absent}
    spans = [
        (s, a, b, by)
        for by, flags in found.items()
        for s, row in enumerate(flags)
        for a, b in runs(row)
    ]
    return absent, sorted(spans)


def _told(problem: Problem, poses: Poses, missing: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(S, F): whether the markers left tell a segment's turn as far as they ever do."""
    told = ~missing
    if not missing.any():
        return told
    # Parts of a turn say nothing of the whole.
    freedoms = tuple(one for one in problem.freedoms if not isinstance(one, Shared))
    every = known_turns(replace(problem, freedoms=freedoms), poses)
    for s in np.flatnonzero(missing.any(axis=1)).tolist():
        if missing[s].all():
            continue
        # A hand of one marker never shows its turn about it; that is no gap.
        usual = np.median(every[s][~missing[s]], axis=0)
        asked = np.flatnonzero(usual >= TOLD**-2)
        told[s] |= True if not len(asked) else every[s][:, asked[0]] >= TOLD**-2
    return told


def _calmed(problem: Problem, poses: Poses, rate: float) -> Poses:
    """What the markers do not show follows its own mean over a short time."""
    bones = problem.bones
    stiffness = np.full(poses.frames, 1.0 / CALM_ANGLE**2)
    pulls = [
        Pull(s, smoothed(poses.local(bones, s), max(1.0, CALM * rate)), stiffness)
        for s in range(1, len(bones.parents))
    ]
    return solve(replace(problem, pulls=(*problem.pulls, *pulls)), poses)


def _slowed(
    bones: Bones, poses: Poses, absent: NDArray[np.bool_], limit: float
) -> tuple[Poses, NDArray[np.bool_]]:
    """Turns that are faster than a limit (radians a frame) replaced, and where."""
    repaired = np.zeros(poses.turn.shape[2:], dtype=bool)
    locals_ = [poses.local(bones, s) for s in range(len(bones.parents))]
    for s, local in enumerate(locals_):
        locals_[s], repaired[s] = eased(local, limit)
    repaired &= ~absent
    if not repaired.any():
        return poses, repaired
    turn = np.empty_like(poses.turn)
    for s, parent in enumerate(bones.parents):
        turn[:, :, s] = locals_[s] if parent < 0 else multiply(turn[:, :, parent], locals_[s])
    return Poses(turn, poses.root), repaired


def residuals(model: Model, poses: Poses) -> list[Array]:
    """Of each segment (F, M): how far its markers are from where the figure has them."""
    joints = poses.joints(model.bones)
    return [
        np.linalg.norm(
            apply(poses.turn[:, :, s, :, None], place.T[:, None]) + joints[:, s, :, None]
            - points.transpose(2, 0, 1),
            axis=0,
        )
        for s, (place, points) in enumerate(zip(model.bones.places, model.points, strict=True))
    ]  # fmt: skip


def _root_mean_square(away: Sequence[Array], bones: Bones, segment: int, frames: slice) -> float:
    beside = [
        s
        for s, parent in enumerate(bones.parents)
        if segment in (s, parent) or s == bones.parents[segment]
    ]
    seen = np.concatenate([away[s][frames].ravel() for s in beside])
    seen = seen[np.isfinite(seen)]
    return float(np.sqrt((seen**2).mean())) if len(seen) else float("nan")


def _worth_leaving_out(model: Model, absent: NDArray[np.bool_]) -> frozenset[str]:
    """The branch that is lost in most of the clip, without which a stretch of frames holds more segments times frames."""
    if (~absent.any(axis=0)).mean() >= SELDOM:
        return frozenset()
    parents = model.bones.parents
    below = [{s} for s in range(len(parents))]
    for s in range(len(parents) - 1, 0, -1):
        below[parents[s]] |= below[s]

    def worth(gone: set[int]) -> int:
        kept = [s for s in range(len(parents)) if s not in gone]
        longest = max((b - a for a, b in runs(np.asarray(~absent[kept].any(axis=0)))), default=0)
        return longest * len(kept)

    best = max((below[s] for s in range(1, len(parents))), key=worth, default=set())
    if not best or worth(best) <= worth(set()):
        return frozenset()
    return frozenset(model.segments[s].name for s in best)

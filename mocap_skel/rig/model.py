"""The rigid figure behind a fit: constant bones, markers at constant places, joints with their freedom."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mocap_skel.figure.skeleton import Segment
from mocap_skel.rig.freedoms import Freedom, Hinge, Universal
from mocap_skel.rig.solver import Bones, Poses
from mocap_skel.segments.pose import Array
from mocap_skel.skeleton_fit import SegmentFit, SkeletonFit

# Radians: a knee's turns about other axes than its hinge. Free fits of ordinary clips stray 4 to 8 degrees from
# one axis, most of it skin (benchmarks/rig_quality.py); the bones themselves 2 to 4 (Lafortune 1992).
STRAY = np.radians(5.0)
# A joint shows its hinge if the variance of its turn about it is so much larger than about any other axis; it is
# that of a swing through some 6 degrees, below which not even the axis' sense is seen.
SHOWN = 0.01
# Steps in which the axes of a universal joint are found, each from these directions beside the axes: enough for four
# digits of ankles, wrists and elbows.
ALTERNATIONS = 30
STARTS = np.array([[1.0, 1, 1], [1, 1, -1], [1, -1, 1], [-1, 1, 1]]) / np.sqrt(3.0)
# A joint shows its two axes if the cosine between others varies by more than this, the square of what a swing through
# 26 degrees to each side has; and by so many times what the cosine between these does, else it is a ball. So it is if
# the angle between these strays by more than 2 STRAY.
SHOWN_TWO, CLEARER = 0.001, 4.0
# Cosine: two axes nearer to each other are one, by eye; ankles, wrists and elbows have 60 to 90 degrees between theirs.
ALONG = 0.87
# Metres: no marker is put on more exactly than that, so none weighs more.
PLACED = 0.002


@dataclass(frozen=True, eq=False)
class Model:
    """A fit's segments as rigid bones.

    Attributes:
        segments: of the skeleton file, breadth first.
        bones: the same as numbers.
        freedoms: what holds the joints' turns: axes, where the file names them and the clip shows them, and springs.
        markers: of each segment, their names.
        points: of each segment, its markers (F, M, 3) in the order of `bones.places`, NaN = hidden or left out.
        start: what the closed-form fit has; NaN where a segment has no pose.
        loose: segments of one marker, whose turn about it is not seen, with their mean turn (3, 3) in the parent.
        ends: the end point (3,) of each segment without children, from its joint in its axes.
        joints: (S, 3) each segment's joint in the axes of its closed-form pose.
        rested: turns (3, 3) in the rest pose that are known beforehand: of a segment in its parent, of the root from
            its axes to the character's.
        tips: what a segment's direction of the rest pose leads to, where that is not the next joint (3,).
        added: segments that the fit has not: no marker shows their joints.
    """

    segments: tuple[Segment, ...]
    bones: Bones
    freedoms: tuple[Freedom, ...]
    markers: tuple[tuple[str, ...], ...]
    points: tuple[Array, ...]
    start: Poses
    loose: dict[int, Array]
    ends: dict[int, Array]
    joints: Array
    rested: dict[int, Array] = field(default_factory=dict)
    tips: dict[int, Array] = field(default_factory=dict)
    added: frozenset[str] = frozenset()

    def without(self, names: frozenset[str]) -> Model:
        """The figure less some segments; what hangs from them has to be among them."""
        kept = [i for i, segment in enumerate(self.segments) if segment.name not in names]
        new = {old: i for i, old in enumerate(kept)}
        bones = Bones(
            tuple(new.get(self.bones.parents[i], -1) for i in kept),
            self.bones.offsets[kept],
            tuple(self.bones.places[i] for i in kept),
            tuple(self.bones.weights[i] for i in kept),
        )
        ends = _renumbered(self.ends, new)
        # A segment that nothing hangs from any more ends where its children did.
        for i in kept:
            gone = [j for j, p in enumerate(self.bones.parents) if p == i and j not in new]
            if new[i] not in bones.parents and gone:
                ends[new[i]] = self.bones.offsets[gone].mean(axis=0)
        return Model(
            tuple(self.segments[i] for i in kept),
            bones,
            tuple(moved for one in self.freedoms if (moved := one.moved(new)) is not None),
            tuple(self.markers[i] for i in kept),
            tuple(self.points[i] for i in kept),
            Poses(np.ascontiguousarray(self.start.turn[:, :, kept]), self.start.root),
            _renumbered(self.loose, new),
            ends,
            self.joints[kept],
            _renumbered(self.rested, new),
            _renumbered(self.tips, new),
            self.added,
        )

    def place(self, segment: int, marker: str) -> Array | None:
        """(3,) a marker of a segment from its joint, in the segment's axes; None if the figure has it not."""
        names = self.markers[segment]
        return self.bones.places[segment][names.index(marker)] if marker in names else None

    @property
    def missing(self) -> NDArray[np.bool_]:
        """(S, F): where the closed-form fit has no pose."""
        return np.asarray(np.isnan(self.start.turn[0, 0]))


def _renumbered(values: dict[int, Array], new: dict[int, int]) -> dict[int, Array]:
    return {new[i]: value for i, value in values.items() if i in new}


def model_of(fit: SkeletonFit) -> Model:
    """The rigid figure of a fit: joints where it has them, markers at their places in its templates."""
    segments = _breadth_first(fit)
    index = {segment.name: i for i, segment in enumerate(segments)}
    fits = [fit.segments[segment.name] for segment in segments]
    parents = tuple(index.get(segment.parent or "", -1) for segment in segments)
    centres = {joint.child: joint.centre for joint in fit.joints}
    offsets = np.stack(
        [
            np.zeros(3) if parent < 0 else centres[own.name] - joint_of(fits[parent])
            for own, parent in zip(fits, parents, strict=True)
        ]
    )
    places = tuple(
        np.array(list(own.template.values())).reshape(-1, 3) - joint_of(own) for own in fits
    )
    weights = tuple(
        np.full(len(place), 1.0 / max(fit.sigma**2 + own.rigid**2, PLACED**2))
        for place, own in zip(places, fits, strict=True)
    )
    turn = np.stack([own.pose.rotation for own in fits]).transpose(2, 3, 0, 1)
    start = Poses(np.ascontiguousarray(turn), np.ascontiguousarray(fits[0].pose.origin.T))
    bones = Bones(parents, offsets, places, weights)
    found = [_freedom(bones, start, i, segment.freedom) for i, segment in enumerate(segments)]
    freedoms = tuple(one for one in found if one is not None)
    loose = {
        i: mean_turn(start.local(bones, i))
        for i, place in enumerate(places)
        if len(place) == 1 and parents[i] >= 0
    }
    ends = {i: _end(fit, fits[i]) for i in range(len(fits)) if i not in parents}
    names, points = (
        tuple(tuple(own.template) for own in fits),
        tuple(_points(own, len(fit.frame_numbers)) for own in fits),
    )
    joints = np.stack([joint_of(own) for own in fits])
    return Model(segments, bones, freedoms, names, points, start, loose, ends, joints)


def joint_of(own: SegmentFit) -> Array:
    """(3,) the joint that a segment turns about, in its own axes; the root turns about its origin."""
    return np.zeros(3) if own.joint is None else own.joint


def _end(fit: SkeletonFit, own: SegmentFit) -> Array:
    """The end of a segment that no other hangs from: the joint beyond it, if it has one, or its end point."""
    below = [j for j in fit.joints if j.parent == own.name and j.fitted]
    if len(below) == 1 and below[0].child not in fit.segments:
        end = below[0].centre
    elif own.end is not None:
        end = own.end
    else:
        end = np.mean(list(own.template.values()), axis=0)
    return np.asarray(end - joint_of(own))


def _points(own: SegmentFit, frames: int) -> Array:
    return np.full((frames, len(own.template), 3), np.nan) if own.points is None else own.points


def _breadth_first(fit: SkeletonFit) -> tuple[Segment, ...]:
    depth: dict[str, int] = {}
    for segment in fit.skeleton.segments:
        above = -1 if segment.parent is None else depth.get(segment.parent)
        if above is not None and segment.name in fit.segments:
            depth[segment.name] = above + 1
    found = [segment for segment in fit.skeleton.segments if segment.name in depth]
    return tuple(sorted(found, key=lambda segment: depth[segment.name]))


def mean_turn(turn: Array) -> Array:
    """(3, 3): the rotation nearest to all that are known of (3, 3, F)."""
    u, _, vt = np.linalg.svd(_mean(turn))
    u[:, 2] *= np.linalg.det(u @ vt)
    return np.asarray(u @ vt)


def _mean(turn: Array) -> Array:
    known = np.isfinite(turn[0, 0])
    return np.asarray(turn[..., known].mean(axis=2)) if known.any() else np.eye(3)


def _freedom(bones: Bones, start: Poses, segment: int, kind: str) -> Freedom | None:
    """What holds a joint of a kind that a skeleton file names, if the clip shows it."""
    if kind not in ("hinge", "universal"):
        return None
    turn = start.local(bones, segment)
    return (hinge if kind == "hinge" else universal)(segment, turn)


def hinge(segment: int, turn: Array) -> Hinge | None:
    """The axis that a joint keeps in both its segments best, if it turns about it enough to show it.

    It is the pair of directions u, v with the largest mean uᵀ R v over the turns R: the first singular pair of
    their mean.

    Args:
        segment: the child's index.
        turn: (3, 3, F) the child's axes in the parent's, NaN = not known.
    """
    u, kept, vt = np.linalg.svd(_mean(turn))
    if kept[0] ** 2 - kept[1] ** 2 < SHOWN:
        return None
    return Hinge(segment, u[:, 0], vt[0], 1.0 / STRAY**2)


def universal(segment: int, turn: Array) -> Universal | None:
    """The two axes about which a joint turns, if it turns about both enough to show them.

    They are the directions u in the parent and v in the child with the least variance of uᵀ R v over the turns R: the
    cosine of the angle between them, which turns about either of them leave as it is. For a given v that is the
    last eigenvector of a 3 x 3 matrix, and so it is for a given u: both are found in turns, from each axis of the
    child, which leads to more than one place; the least is taken.

    Args:
        segment: the child's index.
        turn: (3, 3, F) the child's axes in the parent's, NaN = not known.
    """
    known = turn[..., np.isfinite(turn[0, 0])]
    if known.shape[2] < 2:
        return None
    away = known - known.mean(axis=2, keepdims=True)
    spread = np.einsum("ijf,klf->ijkl", away, away) / known.shape[2]
    found = []
    for v in (*np.eye(3), *STARTS):
        for _ in range(ALTERNATIONS):
            above, u = _least(np.einsum("ijkl,j,l->ik", spread, v, v))
            below, v = _least(np.einsum("ijkl,i,k->jl", spread, u, u))
        # What both axes have to be told from: the next best direction of either.
        found.append((below[0], min(above[1], below[1]), u, v))
    least, next_best, u, v = min(found, key=lambda one: one[0])
    if next_best < max(SHOWN_TWO, CLEARER * least):
        return None
    angles = np.arccos(np.clip(np.einsum("i,ijf,j->f", u, known, v), -1.0, 1.0))
    angle = float(angles.mean())
    if abs(np.cos(angle)) > ALONG or angles.std() > 2.0 * STRAY:
        return None
    return Universal(segment, u, v, angle, 1.0 / STRAY**2)


def _least(matrix: Array) -> tuple[Array, Array]:
    """Eigenvalues of a symmetric matrix, ascending, and the first eigenvector."""
    values, vectors = np.linalg.eigh(matrix)
    return values, vectors[:, 0]

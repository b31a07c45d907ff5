"""Errors of every method against references, bone lengths, halves of a clip against each other."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mocap_skel.segments.pose import least_squares_pose
from validation.estimates import METHODS, OURS, Subject
from validation.references import FUNCTIONAL, Reference

Array = NDArray[np.float64]
# χ² of three degrees of freedom: 95 and 50 of 100 errors are inside.
ELLIPSOID = 7.815
HALF = 2.366
# Metres: a reference farther from all markers of both its segments belongs to something else.
FARTHEST = 0.35
# Markers that carry a joint from one clip into another.
COMMON = 3
BONES = {
    f"{side} {name}": (f"{side}{a}", f"{side}{b}")
    for name, a, b in (
        ("thigh", "Hip", "Knee"), ("shank", "Knee", "Ankle"),
        ("upper arm", "Shoulder", "Elbow"), ("forearm", "Elbow", "Wrist"),
    )
    for side in ("Left", "Right")
}  # fmt: skip


@dataclass(frozen=True)
class ErrorRow:
    """One reference and how far each method is from it.

    Attributes:
        clip, subject, joint, kind, source: of the reference.
        counts: whether it is in the totals.
        shown: our verdict on the joint, "-" for one that is not fitted.
        own_parent: whether the parent's pose is that of its own markers.
        wander: how far the reference moves in the parent's frame, RMS about its mean, cm: nobody who
            says that the joint is fixed there can be nearer.
        errors: method → RMS over the frames that both have, cm; NaN for no answer.
        worst_se: our standard error in the worst direction, cm.
        within_axes: mean error within two standard errors along each axis of our covariance.
        within_ellipsoid: within the 95 % ellipsoid of our covariance.
        within_half: within the 50 % one.
        within_worst: its root mean square over axes at most twice the worst standard error.
    """

    clip: str
    subject: str
    joint: str
    kind: str
    source: str
    counts: bool
    shown: str
    own_parent: bool
    wander: float
    errors: Mapping[str, float]
    worst_se: float
    within_axes: bool | None
    within_ellipsoid: bool | None
    within_half: bool | None
    within_worst: bool | None


@dataclass(frozen=True)
class LengthRow:
    """A bone, by every method: against the studio's (mm) or left against right (%)."""

    clip: str
    subject: str
    bone: str
    what: str
    reference: float
    values: Mapping[str, float]


@dataclass(frozen=True)
class HalfRow:
    """How far the joint of a clip's first half is from that of its second, mm, in the parent's frame."""

    clip: str
    subject: str
    joint: str
    shown: str
    distances: Mapping[str, float]


def errors(
    name: str, subject: Subject, found: Iterable[Reference]
) -> tuple[list[ErrorRow], list[str]]:
    """A row for each reference of a subject, and what was not to be used."""
    rows, notes = [], []
    for one in found:
        if one.joint not in subject.joints:
            continue
        if not _near(subject, one):
            notes.append(f"{one.joint}: {one.kind} ({one.source}) is nowhere near it and left out")
            continue
        rows.append(_row(name, subject, one))
    return rows, notes


def _row(name: str, subject: Subject, one: Reference) -> ErrorRow:
    joint = subject.joints[one.joint]
    parent = subject.frame(joint.parent)
    inside = np.full_like(one.track, np.nan)
    if parent is not None:
        inside = parent.pose.to_segment(one.track[:, None])[:, 0]
    away = np.full(3, np.nan)
    if joint.fitted:
        turn = subject.fits[OURS].segments[joint.parent].pose.rotation
        away = _mean(np.einsum("fji,fj->fi", turn, one.track - joint.track))
    axes, ellipsoid, half, worst = _within(away, joint.covariance)
    return ErrorRow(
        clip=name,
        subject=subject.assignment.subject,
        joint=one.joint,
        kind=one.kind,
        source=one.source,
        counts=one.counts,
        shown=joint.shown if joint.fitted else "-",
        own_parent=parent is not None and parent.own,
        wander=100 * _rms(inside - _mean(inside)),
        errors={m: 100 * _rms(subject.tracks[m][one.joint] - one.track) for m in METHODS},
        worst_se=100 * joint.worst_error if joint.fitted else float("nan"),
        within_axes=axes,
        within_ellipsoid=ellipsoid,
        within_half=half,
        within_worst=worst,
    )


def _within(away: Array, covariance: Array) -> tuple[bool | None, ...]:
    """Whether an error (3,) is what the covariance says, along each of its axes, all together, at worst."""
    if not (np.isfinite(away).all() and np.isfinite(covariance).all()):
        return None, None, None, None
    values, axes = np.linalg.eigh(covariance)
    values = np.maximum(values, np.finfo(float).tiny)
    along = (axes.T @ away) ** 2 / values
    worst = float(np.linalg.norm(away)) / np.sqrt(3) <= 2 * np.sqrt(values[-1])
    whole = float(along.sum())
    return bool((along <= 4).all()), whole <= ELLIPSOID, whole <= HALF, bool(worst)


def _near(subject: Subject, one: Reference) -> bool:
    joint = subject.joints[one.joint]
    columns = [
        c
        for segment in (joint.parent, joint.child)
        for c in subject.assignment.columns.get(segment, {}).values()
    ]
    away = np.linalg.norm(subject.clip.points[:, columns] - one.track[:, None], axis=2)
    nearest = np.where(np.isfinite(away), away, np.inf).min(axis=1, initial=np.inf)
    nearest = nearest[np.isfinite(nearest)]
    return bool(len(nearest)) and float(np.median(nearest)) <= FARTHEST


def lengths(name: str, subject: Subject, known: Mapping[str, float]) -> list[LengthRow]:
    """Bones against the studio's, mm, and left against right, %."""
    who = subject.assignment.subject
    found = {
        m: {b: _length(subject.tracks[m], *ends) for b, ends in BONES.items()} for m in METHODS
    }
    rows = [
        LengthRow(
            name, who, bone, "mm off the studio's", 1e3 * length,
            {m: 1e3 * abs(found[m][bone] - length) for m in METHODS},
        )
        for bone, length in known.items()
        if np.isfinite(found[OURS].get(bone, np.nan))
    ]  # fmt: skip
    for bone in dict.fromkeys(b.partition(" ")[2] for b in BONES):
        sides = {m: (found[m][f"Left {bone}"], found[m][f"Right {bone}"]) for m in METHODS}
        if np.isfinite(sides[OURS]).all():
            values = {m: 200 * abs(a - b) / (a + b) for m, (a, b) in sides.items()}
            mean = 500 * sum(sides[OURS])
            rows.append(LengthRow(name, who, bone, "% left against right", mean, values))
    return rows


def _length(tracks: Mapping[str, Array], one: str, other: str) -> float:
    if one not in tracks or other not in tracks:
        return float("nan")
    away = np.linalg.norm(tracks[one] - tracks[other], axis=1)
    away = away[np.isfinite(away)]
    return float(np.median(away)) if len(away) else float("nan")


def halves(name: str, subject: Subject) -> list[HalfRow]:
    """Each joint from the first half of the frames against the second."""
    middle = subject.clip.frames // 2
    one, two = subject.half(slice(0, middle)), subject.half(slice(middle, subject.clip.frames))
    nothing = np.full(3, np.nan)
    return [
        HalfRow(
            name,
            subject.assignment.subject,
            joint,
            fit.shown,
            {
                m: 1e3
                * float(np.linalg.norm(one[m].get(joint, nothing) - two[m].get(joint, nothing)))
                for m in METHODS
            },
        )
        for joint, fit in subject.joints.items()
        if fit.fitted
    ]


def carried(
    target: tuple[str, Subject, Iterable[Reference]], others: Iterable[tuple[str, Subject]]
) -> list[ErrorRow]:
    """Published functional answers in one clip against a calibration of the same joint in another.

    The calibration is the clip with the same markers in which our standard error is least; the shape of
    the parent's common markers carries its joint over.
    """
    name, subject, found = target
    rows = []
    for one in found:
        joint = subject.joints.get(one.joint)
        if one.kind != FUNCTIONAL or joint is None:
            continue
        better = [
            (other.joints[one.joint].worst_error, where, other)
            for where, other in others
            if other is not subject
            and one.joint in other.joints
            and other.joints[one.joint].fitted
            and not (joint.fitted and joint.worst_error < other.joints[one.joint].worst_error)
        ]
        for _, where, other in sorted(better, key=lambda x: x[0]):
            row = _carry(f"{where} → {name}", subject, other, one)
            if row is not None:
                rows.append(row)
                break
    return rows


def _carry(name: str, subject: Subject, other: Subject, one: Reference) -> ErrorRow | None:
    joint = other.joints[one.joint]
    here, there = other.frame(joint.parent), subject.frame(joint.parent)
    if here is None or there is None:
        return None
    common = [m for m in here.template if m in there.template]
    if len(common) < COMMON or not (here.own and there.own):
        return None
    ours = np.array([here.template[m] for m in common])
    theirs = np.array([there.template[m] for m in common])
    over = least_squares_pose(theirs[None], ours, np.ones(len(common)))
    # The reference in the calibration's own frame.
    inside = there.pose.to_segment(one.track[:, None])[:, 0]
    inside = (inside - over.origin[0]) @ over.rotation[0]
    constants = {m: other.constant(one.joint, other.tracks[m][one.joint]) for m in METHODS}
    away = _mean(inside) - constants[OURS]
    axes, ellipsoid, half, worst = _within(away, joint.covariance)
    return ErrorRow(
        clip=name,
        subject=subject.assignment.subject,
        joint=one.joint,
        kind="carried",
        source=one.source,
        counts=False,
        shown=joint.shown,
        own_parent=True,
        wander=100 * _rms(inside - _mean(inside)),
        errors={m: 100 * _rms(inside - c) for m, c in constants.items()},
        worst_se=100 * joint.worst_error,
        within_axes=axes,
        within_ellipsoid=ellipsoid,
        within_half=half,
        within_worst=worst,
    )


def _rms(away: Array) -> float:
    """Root mean square length of (frames, 3), over the frames that have one."""
    square = (away**2).sum(axis=-1)
    square = square[np.isfinite(square)]
    return float(np.sqrt(square.mean())) if len(square) else float("nan")


def _mean(track: Array) -> Array:
    seen = track[np.isfinite(track[:, 0])]
    return np.asarray(seen.mean(axis=0)) if len(seen) else np.full(3, np.nan)

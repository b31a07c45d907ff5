"""Clips from a figure, its markers and a motion, together with all that is true of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mocap_skel.artificial.faults import (
    Faults,
    correlated_noise,
    missing_samples,
    outlier_tracks,
    slide_tracks,
)
from mocap_skel.artificial.figure import Figure, Motion, Pose, Vector
from mocap_skel.artificial.markers import MarkerSet
from mocap_skel.artificial.rotations import half_sine, to_vector
from mocap_skel.artificial.tissue import tissue_tracks

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Recording:
    """An artificial clip and all that is true of it. Metres, seconds, Z up.

    Attributes:
        points: what the cameras saw, (frames, markers, 3), missing = NaN.
        labels: the markers' names, with `Subject:` prefixes if there are subjects.
        rate: frames a second.
        first_frame: number of the first frame, counted from 1.
        clean: the markers on rigid segments, without any fault, like `points`.
        truth: joint -> its path in the lab, (frames, 3), in the figure's order.
        constants: joint -> its place in its parent's axes, (3,).
        poses: segment -> its pose in every frame.
        subjects: their names, if the recording is of named subjects; they then prefix the keys of
            `truth`, `constants` and `poses` too.
        wrong: samples that are not where their marker is, (frames, markers): outliers and swaps.
            Empty, (0, 0), if there are none.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial import Recording, human, marker_set, record, walk
        >>> clip = record(human(), marker_set("cmu"), walk(1, 60))
        >>> isinstance(clip, Recording), clip.points.shape, list(clip.truth)[:2]
        (True, (60, 41, 3), ['Waist', 'Neck'])
        >>> knee = clip.poses["UpperLeftLeg"].place(clip.constants["LeftKnee"])
        >>> np.allclose(knee, clip.truth["LeftKnee"])
        True
    """

    points: Array
    labels: tuple[str, ...]
    rate: float
    first_frame: int
    clean: Array
    truth: Mapping[str, Array]
    constants: Mapping[str, Array]
    poses: Mapping[str, Pose]
    subjects: tuple[str, ...] = ()
    wrong: Mask = field(default_factory=lambda: np.zeros((0, 0), dtype=np.bool_))


def record(
    figure: Figure,
    markers: MarkerSet,
    motion: Motion,
    faults: Faults | None = None,
    *,
    seed: int = 0,
    first_frame: int = 1,
    place: Vector = (0.0, 0.0, 0.0),
) -> Recording:
    """Film a motion: the markers of a figure in every frame, with faults.

    Args:
        figure, markers, motion: who, what is seen of it, and what it does.
        faults: noise, slide, drop-outs, outliers, swaps; none by default.
        seed: of the faults. Each kind has a stream of its own: more noise leaves the gaps alone.
        first_frame: number of the first frame, counted from 1.
        place: where the figure's origin stands, metres.

    Raises:
        ValueError: no markers, a marker on a segment that the figure does not have, a lost marker
            or a swapped one that is not in the set.

    Example:
        >>> from mocap_skel.artificial import Faults, human, marker_set, range_of_motion, record
        >>> motion = range_of_motion(5, 100)
        >>> clip = record(human(), marker_set("cmu"), motion, Faults(sigma=0.001), seed=1)
        >>> print((clip.points - clip.clean).std().round(4))
        0.001
    """
    faults = faults or Faults()
    labels = tuple(markers)
    _check(figure, markers, faults)
    moved = Motion(motion.rate, motion.shift + np.array(place), motion.rotations, motion.glide)
    poses = figure.poses(moved)
    clean = np.stack([poses[name].place(point) for name, point in markers.values()], axis=1)
    white, slow, skin, gaps, stray, soft = np.random.default_rng(seed).spawn(6)
    points = clean.copy()
    if faults.slide:
        points += faults.slide * _skin(figure, markers, poses, motion, skin)
    if faults.tissue[1] or faults.wobble:
        points += _tissue(figure, markers, poses, motion, faults, soft)
    if faults.correlated:
        memory = np.exp(-1 / (motion.rate * faults.correlation_time))
        points += faults.correlated * correlated_noise(points.shape, memory, slow)
    if faults.sigma:
        points += faults.sigma * white.standard_normal(points.shape)
    frames = len(points)
    wrong = _misplace(points, labels, faults, stray)
    points[missing_samples(frames, len(labels), faults.dropout, faults.burst, gaps)] = np.nan
    points[:, [label in faults.lost for label in labels]] = np.nan
    joints = figure.joints
    return Recording(
        points=points,
        labels=labels,
        rate=motion.rate,
        first_frame=first_frame,
        clean=clean,
        truth={joint: poses[child.name].origin for joint, child in joints.items()},
        constants={joint: np.array(child.offset) for joint, child in joints.items()},
        poses=poses,
        wrong=wrong & np.isfinite(points[..., 0]) if wrong.size else wrong,
    )


def merge(recordings: Mapping[str, Recording]) -> Recording:
    """Several subjects in one clip: their markers beside each other, their names as prefixes.

    Args:
        recordings: subject's name -> its own recording.

    Raises:
        ValueError: no recordings, a name that is empty or holds a colon, a recording that has
            subjects already, or recordings whose rate, first frame or length differ.

    Example:
        >>> from mocap_skel.artificial import human, marker_set, merge, record, still
        >>> each = [record(human(), marker_set("cmu"), still(1, 60, seed)) for seed in (1, 2)]
        >>> both = merge({"Anna": each[0], "Ben": each[1]})
        >>> both.points.shape, both.labels[0], both.subjects
        ((60, 82, 3), 'Anna:LFHD', ('Anna', 'Ben'))
    """
    if not recordings:
        raise ValueError("nothing to merge")
    for name, one in recordings.items():
        if not name or ":" in name or one.subjects:
            raise ValueError(f"{name!r} cannot name a subject, or has subjects of its own")
    kinds = {(r.rate, r.first_frame, len(r.points)) for r in recordings.values()}
    if len(kinds) > 1:
        raise ValueError(f"rate, first frame and frame count must agree, got {sorted(kinds)}")
    rate, first_frame, _ = kinds.pop()
    each = recordings.items()
    return Recording(
        points=np.concatenate([r.points for r in recordings.values()], axis=1),
        labels=tuple(f"{name}:{label}" for name, r in each for label in r.labels),
        rate=rate,
        first_frame=first_frame,
        clean=np.concatenate([r.clean for r in recordings.values()], axis=1),
        truth={f"{name}:{key}": value for name, r in each for key, value in r.truth.items()},
        constants={f"{name}:{key}": c for name, r in each for key, c in r.constants.items()},
        poses={f"{name}:{key}": pose for name, r in each for key, pose in r.poses.items()},
        subjects=tuple(recordings),
        wrong=_side_by_side(list(recordings.values())),
    )


def _side_by_side(recordings: list[Recording]) -> Mask:
    """The wrong samples of several subjects, (frames, all markers), or the empty array."""
    if not any(r.wrong.size for r in recordings):
        return recordings[0].wrong
    each = [r.wrong if r.wrong.size else np.zeros(r.points.shape[:2], np.bool_) for r in recordings]
    return np.concatenate(each, axis=1)


def _misplace(
    points: Array, labels: tuple[str, ...], faults: Faults, rng: np.random.Generator
) -> Mask:
    """Move outliers and exchange swapped markers in place; returns which samples are wrong then."""
    if not (faults.outliers or faults.swaps):
        return np.zeros((0, 0), dtype=np.bool_)
    frames, markers, _ = points.shape
    wrong, ways = outlier_tracks(frames, markers, faults.outliers, faults.outlier_burst, rng)
    points += faults.outlier_size * np.where(wrong[..., None], ways, 0.0)
    for swap in faults.swaps:
        pair = [labels.index(swap.first), labels.index(swap.second)]
        points[swap.start : swap.stop, pair] = points[swap.start : swap.stop, pair[::-1]]
        wrong[swap.start : swap.stop, pair] = True
    return wrong


def _check(figure: Figure, markers: MarkerSet, faults: Faults) -> None:
    """Raise where markers are on no segment, or faults name markers that are not there."""
    if not markers:
        raise ValueError("a recording needs at least one marker")
    known = {segment.name for segment in figure.segments}
    for label, (segment, _) in markers.items():
        if segment not in known:
            raise ValueError(f"marker {label!r} is on {segment!r}, which the figure does not have")
    for what, named in (
        ("lost", faults.lost),
        ("swapped", tuple(name for s in faults.swaps for name in (s.first, s.second))),
    ):
        unknown = sorted(set(named) - set(markers))
        if unknown:
            raise ValueError(f"{what} markers that are not in the set: {', '.join(unknown)}")


def _skin(
    figure: Figure,
    markers: MarkerSet,
    poses: Mapping[str, Pose],
    motion: Motion,
    rng: np.random.Generator,
) -> Array:
    """Displacements in the lab for a slide of one metre, (frames, markers, 3)."""
    half_sines = half_sine(_nearest_turns(figure, markers, motion))
    tracks = slide_tracks(half_sines, _normals(figure, markers), motion.rate, rng)
    return _in_lab(tracks, markers, poses)


def _tissue(
    figure: Figure,
    markers: MarkerSet,
    poses: Mapping[str, Pose],
    motion: Motion,
    faults: Faults,
    rng: np.random.Generator,
) -> Array:
    """Displacements in the lab by soft tissue, (frames, markers, 3)."""
    turns = to_vector(_nearest_turns(figure, markers, motion))
    bones = np.stack([figure.bones[segment] for segment, _ in markers.values()])
    length = np.linalg.norm(bones, axis=1, keepdims=True)
    along = np.divide(bones, length, out=np.zeros_like(bones), where=length > 0)
    names = [segment.name for segment in figure.segments]
    groups = np.array([names.index(segment) for segment, _ in markers.values()])
    tracks = tissue_tracks(turns, along, _normals(figure, markers), groups, faults, rng)
    return _in_lab(tracks, markers, poses)


def _in_lab(tracks: Array, markers: MarkerSet, poses: Mapping[str, Pose]) -> Array:
    """Displacements (frames, markers, 3) in the segments' axes, turned into the lab's."""
    turn = np.stack([poses[segment].rotation for segment, _ in markers.values()], axis=1)
    return np.asarray((turn @ tracks[..., None])[..., 0])


def _nearest_turns(figure: Figure, markers: MarkerSet, motion: Motion) -> Array:
    """Rotation of the joint nearest to each marker, (frames, markers, 3, 3); the unit matrix without one."""
    parents = {segment.name: segment.parent for segment in figure.segments}
    turns = np.tile(np.eye(3), (len(motion.shift), len(markers), 1, 1))
    for i, (segment, point) in enumerate(markers.values()):
        # Joints at this segment as seen from it: (where, the segment whose rotation it makes).
        joints = [(s.offset, s.name) for s in figure.segments if s.parent == segment]
        if parents[segment] is not None:
            joints.append(((0.0, 0.0, 0.0), segment))
        if not joints:
            continue
        nearest = min(joints, key=lambda joint: float(np.linalg.norm(np.subtract(point, joint[0]))))
        rotation = motion.rotations.get(nearest[1])
        if rotation is not None:
            # A rotation's axis has the same components in the axes of both its segments.
            turns[:, i] = rotation
    return turns


def _normals(figure: Figure, markers: MarkerSet) -> Array:
    """Unit vectors from each marker's bone to the marker, in the segment's axes, (markers, 3)."""
    positions = np.array([point for _, point in markers.values()])
    bones = np.stack([figure.bones[segment] for segment, _ in markers.values()])
    square = (bones**2).sum(axis=1)
    along = np.divide(
        (positions * bones).sum(axis=1), square, out=np.zeros(len(bones)), where=square > 0
    )
    out = positions - np.clip(along, 0.0, 1.0)[:, None] * bones
    length = np.linalg.norm(out, axis=1, keepdims=True)
    # A marker on the bone itself has no skin to lie on and may slide anywhere.
    return np.asarray(np.divide(out, length, out=np.zeros_like(out), where=length > 1e-6))

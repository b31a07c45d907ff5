"""A fit and its markers as the page's viewer needs them: names as JSON, movement as packed numbers."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mocap_skel.clip import AXES, Clip, turn_between
from mocap_skel.joints.joint_fit import JointFit
from mocap_skel.joints.verdicts import VERDICTS
from mocap_skel.labels.association import Assignment
from mocap_skel.report.bands import Band
from mocap_skel.report.ellipsoid import ellipsoid
from mocap_skel.report.view import first_front
from mocap_skel.results.tables import axis_ends
from mocap_skel.rig.bridging import runs
from mocap_skel.segments.pose import Array
from mocap_skel.skeleton_fit import SkeletonFit

# Metres: a tenth of a millimetre is below the noise of any marker. Where a track is longer than 16 bits
# of such steps (6.5 m), the step of the whole page doubles until it fits.
STEP = 1e-4
MOST_STEPS = 32767
MISSING = -32768
# Axes of a pose are unit vectors: steps of 0.002 degrees.
UNIT = 1.0 / MOST_STEPS
# A page of so many samples of points takes about 4 MB; longer clips show every second frame, and so on.
MOST_SAMPLES = 600_000
# Metres: an ellipsoid that is drawn larger would hide the figure. It is then marked as cut.
LARGEST = 0.10
# Metres from a joint to the ends of the line that shows the axis on which it turns.
AXIS = 0.08


@dataclass(frozen=True, eq=False)
class Scene:
    """The data that the page's viewer gets.

    Attributes:
        about: names, links and constants, ready for JSON.
        packed: the movement, see `pack`.
        step: metres of one step of a position.
        every: one of so many frames is in it.
    """

    about: dict[str, Any]
    packed: bytes
    step: float
    every: int


def scene(
    clip: Clip,
    assignment: Assignment,
    fit: SkeletonFit,
    floor: float | None = None,
    bands: Sequence[Band] = (),
) -> Scene:
    """Collect the moving figure, its markers, and the ellipsoids of its joint centres.

    Args:
        clip: the recording.
        assignment: which of its markers are whose.
        fit: what came of them, in the clip's own axes.
        floor: metres along the vertical; None = where the figure comes lowest.
        bands: stretches of frames that are marked.
    """
    tracks = dict(fit.tracks())
    markers = _markers(clip, assignment, fit)
    axes_shown = [(j, ends) for j in fit.joints if (ends := axis_ends(fit, j, AXIS)) is not None]
    points = [
        *tracks.values(),
        *(clip.points[:, m["column"]] for m in markers),
        *(end for _, ends in axes_shown for end in ends),
    ]
    parents = [name for name in fit.segments if any(j.parent == name for j in fit.joints)]
    every = max(1, -(-clip.frames * len(points) // MOST_SAMPLES))
    # The viewer knows what points up by the number of an axis: one that points down is turned over.
    lab = turn_between(fit.up, fit.up[-1])
    positions = np.stack(points, axis=1)[::every] @ lab.T
    middle = middles(positions)
    step = step_of(positions - middle)
    rotations = [lab @ fit.segments[name].pose.rotation[::every, :, :2] for name in parents]
    axes = np.stack(rotations, axis=1) if rotations else np.empty((len(positions), 0, 3, 2))
    rows = np.concatenate(
        [
            steps_of(positions - middle, step).reshape(len(positions), -1),
            # x and y axis of each segment, one after the other; z is their cross product.
            steps_of(axes, UNIT).swapaxes(2, 3).reshape(len(positions), -1),
        ],
        axis=1,
    ).T
    names = list(tracks)
    about = {
        "frames": len(positions),
        "firstFrame": int(clip.first_frame),
        "zeroFrame": float(clip.zero_frame),
        "every": every,
        "rate": float(clip.rate),
        "up": AXES.index(fit.up[-1]),
        "floor": floor_height(positions[..., AXES.index(fit.up[-1])])
        if floor is None
        else round(floor, 4),
        # In frames of the file, as `leftOut`.
        "bands": [
            [clip.first_frame + band.start, clip.first_frame + band.stop, band.words]
            for band in bands
        ],
        "front": np.round(lab @ first_front(fit), 4).tolist(),
        "step": step,
        "middle": np.round(middle, 6).tolist(),
        "points": len(points),
        "segments": parents,
        "joints": [_joint(joint, names, parents) for joint in fit.joints],
        # The line of an axis is a bone between two points behind the markers.
        "bones": [
            *_bones(fit, names),
            *(
                {"from": at, "to": at + 1, "shown": joint.shown}
                for at, (joint, _) in zip(
                    range(len(names) + len(markers), len(points), 2), axes_shown, strict=True
                )
            ),
        ],
        "root": names.index(fit.skeleton.root.name),
        "markers": [{**marker, "point": len(names) + i} for i, marker in enumerate(markers)],
        "largest": LARGEST,
    }
    return Scene(about, pack(rows), step, every)


def step_of(away: Array) -> float:
    """The smallest step (0.1 mm, 0.2 mm, 0.4 mm ...) in which all these lengths fit 16 bits; metres.

    >>> step_of(np.array([3.0])), step_of(np.array([5.0]))
    (0.0001, 0.0002)
    """
    longest = np.abs(np.where(np.isfinite(away), away, 0.0)).max(initial=0.0)
    step = STEP
    while longest > step * MOST_STEPS:
        step *= 2.0
    return step


def steps_of(values: Array, step: float) -> NDArray[np.int16]:
    """Values as whole numbers of steps; NaN becomes `MISSING`."""
    known = np.isfinite(values)
    return np.where(known, np.rint(np.where(known, values, 0.0) / step), MISSING).astype(np.int16)


def pack(rows: NDArray[np.int16]) -> bytes:
    """Compress rows (row, frames) of 16 bits; smooth movements become small.

    Each row as its differences from frame to frame (modulo 2**16), all low bytes before all high ones,
    compressed by zlib.
    """
    whole = rows.astype(np.uint16)
    steps = np.diff(whole, axis=1, prepend=np.uint16(0))
    halves = np.stack([steps & 0xFF, steps >> 8]).astype(np.uint8)
    return zlib.compress(halves.tobytes(), 9)


def unpack(packed: bytes, frames: int) -> NDArray[np.int16]:
    """Undo `pack`, in the way in which the viewer does it."""
    low, high = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(2, -1, frames)
    steps = low.astype(np.uint16) | (high.astype(np.uint16) << 8)
    return np.cumsum(steps, axis=1, dtype=np.uint16).astype(np.int16)


def _markers(clip: Clip, assignment: Assignment, fit: SkeletonFit) -> list[dict[str, Any]]:
    """The subject's markers that are ever seen, assigned ones first."""
    place = {
        column: (marker, segment)
        for segment, columns in assignment.columns.items()
        for marker, column in columns.items()
    }
    others = [
        column
        for column, subject in enumerate(clip.subjects)
        if column not in place and subject == assignment.subject
    ]
    left = {(one.segment, one.marker): one.frames for one in fit.left_out}
    found = []
    for column in [*place, *others]:
        if not np.isfinite(clip.points[:, column, 0]).any():
            continue
        marker, segment = place.get(column, ("", ""))
        frames = left.get((segment, marker))
        away = [] if frames is None else runs(np.isin(clip.frame_numbers, frames))
        found.append(
            {
                "column": column,
                "label": clip.labels[column],
                "marker": marker,
                "segment": segment,
                "leftOut": [[clip.first_frame + a, clip.first_frame + b] for a, b in away],
            }
        )
    return found


def middles(positions: Array) -> Array:
    """The middle (points, 3) between the lowest and the highest place of each track along each axis."""
    known = np.isfinite(positions)
    low = np.where(known, positions, np.inf).min(axis=0)
    high = np.where(known, positions, -np.inf).max(axis=0)
    return np.where(np.isfinite(low), 0.5 * (np.where(np.isfinite(low), low, 0.0) + high), 0.0)


def floor_height(heights: Array) -> float:
    """The height of the floor: 0 if the figure comes about as low as that, else its lowest height."""
    known = heights[np.isfinite(heights)]
    lowest = float(np.quantile(known, 0.001)) if known.size else 0.0
    return 0.0 if -0.05 < lowest < 0.15 else round(lowest, 3)


def _joint(joint: JointFit, names: list[str], parents: list[str]) -> dict[str, Any]:
    """One joint, with the ellipsoid of its centre along the axes of its parent's frame."""
    about: dict[str, Any] = {
        "name": joint.joint,
        "point": names.index(joint.joint),
        "shown": joint.shown if joint.fitted else "none",
        "why": _why(joint),
        "spokes": list(joint.markers),
        "child": joint.child,
    }
    found = ellipsoid(joint)
    if found is not None and joint.parent in parents:
        axes, radii = found
        about["ellipsoid"] = {
            "segment": parents.index(joint.parent),
            "axes": np.round(axes.T, 6).tolist(),
            "radii": np.round(radii, 6).tolist(),
        }
    return about


def _why(joint: JointFit) -> str:
    """The verdict's reason, and how well the axis is known that the line through the joint shows."""
    if joint.turns_on is None:
        return joint.reason
    degrees = np.degrees(joint.turns_on.standard_error)
    axis = f"the line is the axis on which it turns, s.e. {degrees:.0f}°"
    return f"{joint.reason}; {axis}" if joint.reason else axis


def _bones(fit: SkeletonFit, names: list[str]) -> list[dict[str, Any]]:
    """Lines from each segment's own joint to the joints of its children, or to its end point."""
    shown = {j.joint: j.shown if j.fitted else "no" for j in fit.joints}
    bones = []
    for segment in fit.skeleton.segments:
        start = segment.joint or segment.name
        ends = [s.joint for s in fit.skeleton.segments if s.parent == segment.name and s.joint]
        if not ends and segment.name in names and segment.joint:
            ends = [segment.name]
        for end in ends:
            worst = min(shown.get(start, "yes"), shown.get(end, "yes"), key=VERDICTS.index)
            bones.append({"from": names.index(start), "to": names.index(end), "shown": worst})
    return bones

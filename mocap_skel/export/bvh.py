"""Biovision hierarchy (BVH): a rig as a tree of joints with Euler angles.

The root's OFFSET is where it is in the rest pose, which stands on the floor; its position channels are where it
is, not where it is from there. Blender, pybvh and bvhio read it so: the channels take the OFFSET's place.
Readers that add both (three.js) need an OFFSET of zero, `root_at_origin`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from mocap_skel.export.euler import euler_angles
from mocap_skel.export.joint_names import joint_names
from mocap_skel.rig.kinematics import Rig
from mocap_skel.rig.rigging import LONGEST_GAP, SHORTEST_END, rig_of
from mocap_skel.segments.pose import Array
from mocap_skel.skeleton_fit import SkeletonFit

__all__ = ["CENTIMETRES", "LONGEST_GAP", "SHORTEST_END", "bvh", "bvh_text"]

CENTIMETRES = 100.0


def bvh(
    fit: SkeletonFit,
    *,
    trim: bool = False,
    order: str = "ZXY",
    scale: float = CENTIMETRES,
    names: str = "mocap",
    floor: bool = False,
    root_at_origin: bool = False,
) -> tuple[str, tuple[str, ...]]:
    """The fit as BVH text, one node a fitted joint; with all channels zero it stands in a T-pose.

    Args:
        fit: its vertical is that of the file.
        trim: leave out the frames at both ends that would need a pose beyond a segment's last one.
        order: of the rotation channels, one of `euler.ORDERS`.
        scale: units of the file in a metre.
        names: how the joints are called, one of `joint_names.NAMINGS`.
        floor: move the figure up or down so that its lowest point over the clip is at zero.
        root_at_origin: give the root the OFFSET 0 0 0.

    Returns:
        The text, and notes that list joints left out and frames that were filled.

    Raises:
        ExportError: a segment has no pose over too long a time.
    """
    rig, segments, notes = rig_of(fit, trim=trim, floor=floor)
    called, more = joint_names(segments, names)
    rig = replace(rig, names=called)
    return bvh_text(rig, fit.rate, order, scale, root_at_origin), (*notes, *more)


def bvh_text(
    rig: Rig, rate: float, order: str, scale: float = CENTIMETRES, root_at_origin: bool = False
) -> str:
    """A rig as BVH text."""
    offsets = scale * rig.offsets
    if root_at_origin:
        offsets[0] = 0.0
    channels = " ".join(f"{axis}rotation" for axis in order)
    head = "".join(_hierarchy(rig, offsets, scale, channels, 0, 0))
    angles = [euler_angles(turn, order) for turn in rig.rotation]
    rows = np.hstack([scale * rig.position, *angles])
    form = " ".join(["%.6f"] * rows.shape[1]) + "\n"
    motion = (form * len(rows)) % tuple((np.round(rows, 6) + 0.0).ravel().tolist())
    return f"HIERARCHY\n{head}MOTION\nFrames: {len(rows)}\nFrame Time: {1.0 / rate:.10f}\n{motion}"


def _hierarchy(
    rig: Rig, offsets: Array, scale: float, channels: str, at: int, depth: int
) -> Iterator[str]:
    tab = "\t" * depth
    kind = "JOINT" if depth else "ROOT"
    place = "3" if depth else "6 Xposition Yposition Zposition"
    yield f"{tab}{kind} {rig.names[at]}\n{tab}{{\n{tab}\tOFFSET {_vector(offsets[at])}\n"
    yield f"{tab}\tCHANNELS {place} {channels}\n"
    for child in rig.children(at):
        yield from _hierarchy(rig, offsets, scale, channels, child, depth + 1)
    if at in rig.ends:
        end = _vector(scale * rig.ends[at])
        yield f"{tab}\tEnd Site\n{tab}\t{{\n{tab}\t\tOFFSET {end}\n{tab}\t}}\n"
    yield f"{tab}}}\n"


def _vector(v: Array) -> str:
    x, y, z = np.round(v, 6) + 0.0
    return f"{x:.6f} {y:.6f} {z:.6f}"

"""Biovision hierarchy (BVH): a rig as a tree of joints with Euler angles.

The root's OFFSET is where it is in the rest pose, which stands on the floor; its position channels are where it
is, not where it is from there. Blender, pybvh and bvhio read it so: the channels take the OFFSET's place.
Readers that add both (three.js) need an OFFSET of zero, `root_at_origin`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mocap_skel.export.animated import Animated, rigs_of
from mocap_skel.export.registry import Rendered, Source, option, register, vertical

if TYPE_CHECKING:
    from mocap_skel.rig.kinematics import Rig
    from mocap_skel.segments.pose import Array
    from mocap_skel.skeleton_fit import SkeletonFit

CENTIMETRES = 100.0
# Units of length that the file may have, in a metre.
UNITS = {"mm": 1000.0, "cm": CENTIMETRES, "m": 1.0, "in": 1.0 / 0.0254}
# The file has six decimals.
SMALLEST, LARGEST = 1e-3, 1e6
# Those of `euler`, which needs numpy; what animators use most stands first.
ORDERS = ("ZXY", "ZYX", "XYZ", "XZY", "YXZ", "YZX")
LACKS = "a BVH cannot say that something is missing"


def scale_of(text: str) -> float:
    """Units in a metre, from what was typed: a unit of length, or a factor to centimetres.

    Raises:
        ValueError: it is neither, or the factor is not from 0.001 to 1,000,000.

    >>> scale_of("mm"), scale_of("1"), scale_of("0.5")
    (1000.0, 100.0, 50.0)
    """
    word = text.strip().lower()
    if word in UNITS:
        return UNITS[word]
    try:
        factor = float(word)
    except ValueError:
        factor = 0.0
    if not SMALLEST <= factor <= LARGEST:
        raise ValueError(
            f"{text!r}: a unit ({', '.join(UNITS)}), or a factor to centimetres from 0.001 up"
        )
    return CENTIMETRES * factor


@dataclass(frozen=True)
class BvhOptions(Animated):
    """What a BVH may be told, beside what every moving figure may.

    Attributes:
        up: the vertical axis.
        rotation_order: of the rotation channels, one of `ORDERS`.
        scale: units of the file in a metre.
        root_at_origin: give the root the OFFSET 0 0 0.
    """

    up: str | None = vertical("y")
    rotation_order: str = option("ZXY", "order of the rotation channels.", choices=ORDERS)
    scale: float = option(
        CENTIMETRES,
        "unit of length: cm, m, mm, in; or a factor to centimetres.",
        parse=scale_of,
        metavar="UNIT",
        default_text="cm",
    )
    root_at_origin: bool = option(
        False,
        "root OFFSET 0 0 0, for readers that add it to the position (three.js); the rest pose then has its "
        "root, not its feet, at zero.",
    )


@register("bvh", suffixes=(".bvh",), options=BvhOptions, makes="walk.bvh", lacks=LACKS)
def write(fit: SkeletonFit, options: BvhOptions, source: Source) -> Rendered:
    """The fit as BVH text, one node a joint; with all channels zero it stands in a T-pose.

    The notes say what was done to the motion, and what is not in the file.

    Raises:
        ExportError: there are no two frames in a row in which the figure is known.
    """
    del source
    rigs, notes = rigs_of(fit, options, options.up or fit.up)
    order, scale = options.rotation_order, options.scale
    files: dict[str, str | bytes] = {
        f"{part}.bvh": bvh_text(rig, fit.rate, order, scale, options.root_at_origin)
        for part, rig in rigs.items()
    }
    return Rendered(files, tuple(f"BVH: {note}" for note in notes))


def bvh_text(
    rig: Rig, rate: float, order: str, scale: float = CENTIMETRES, root_at_origin: bool = False
) -> str:
    """A rig as BVH text.

    Args:
        rig: metres.
        rate: frames a second.
        order: of the rotation channels, one of `ORDERS`.
        scale: units of the file in a metre.
        root_at_origin: give the root the OFFSET 0 0 0.

    Raises:
        ValueError: no such order.
    """
    import numpy as np

    from mocap_skel.export.euler import euler_angles

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
    x, y, z = v.round(6) + 0.0
    return f"{x:.6f} {y:.6f} {z:.6f}"

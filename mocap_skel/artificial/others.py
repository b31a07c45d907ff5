"""A figure that moves from any skeleton file: it has names only; bones, marker places and ranges are added.

Segments of the standard human have its bones, ranges and markers; the hand and the quadruped have the
bones below. What is not known is invented by a rule, so that every tree of segments can be filmed.
"""

from __future__ import annotations

import numpy as np

from mocap_skel.artificial.figure import Figure, Segment, Vector, human
from mocap_skel.artificial.markers import MarkerSet, place_of
from mocap_skel.artificial.motion import ROM_DEGREES, Limits
from mocap_skel.figure.skeleton import Segment as Names
from mocap_skel.figure.skeleton import Skeleton

# Segment -> its joint in the parent's axes, and its far end in its own where nothing hangs on it, metres.
_Bone = tuple[Vector, Vector | None]


def _finger(name: str, base: Vector, lengths: tuple[float, float, float]) -> dict[str, _Bone]:
    first, second, third = lengths
    return {
        f"{name}1": (base, None),
        f"{name}2": ((0.0, 0.0, -first), None),
        f"{name}3": ((0.0, 0.0, -second), (0.0, 0.0, -third)),
    }


# A right hand of 185 mm that hangs, thumb forward, palm to the left. Lengths are shares of the hand's
# (Buchholz, Armstrong and Goldstein 1992, Ergonomics 35, 261).
_HAND: dict[str, _Bone] = {
    "Hand": ((0.0, 0.0, -0.250), None),
    **_finger("Thumb", (0.022, 0.008, -0.020), (0.046, 0.036, 0.029)),
    **_finger("Index", (0.026, 0.0, -0.083), (0.045, 0.027, 0.018)),
    **_finger("Middle", (0.005, 0.0, -0.083), (0.049, 0.031, 0.020)),
    **_finger("Ring", (-0.014, 0.0, -0.077), (0.045, 0.031, 0.020)),
    **_finger("Little", (-0.031, 0.0, -0.070), (0.038, 0.022, 0.017)),
}

# A dog of about 30 kg; the bones are round figures.
_QUADRUPED: dict[str, _Bone] = {
    "Trunk": ((0.060, 0.0, 0.050), None),
    "Neck": ((0.420, 0.0, 0.080), None),
    "Head": ((0.140, 0.0, 0.120), (0.180, 0.0, -0.030)),
    **{
        name.replace("Left", side): ((x, sign * y, z), end)
        for side, sign in (("Left", 1.0), ("Right", -1.0))
        for name, (x, y, z), end in (
            ("UpperLeftForelimb", (0.360, 0.080, -0.100), None),
            ("LowerLeftForelimb", (-0.050, 0.0, -0.170), None),
            ("LeftForepaw", (0.0, 0.0, -0.190), (0.030, 0.0, -0.090)),
            ("UpperLeftHindlimb", (0.0, 0.055, 0.0), None),
            ("LowerLeftHindlimb", (0.060, 0.0, -0.190), None),
            ("LeftHindpaw", (-0.080, 0.0, -0.190), (0.030, 0.0, -0.120)),
        )
    },
}

_BONES = {"hand": _HAND, "quadruped": _QUADRUPED}

# Bony places that a skeleton file's prior rests on, as `artificial.markers` has them for the human.
_PLACES: dict[str, dict[str, tuple[str, Vector]]] = {
    "hand": {
        "WRA": ("Forearm", (0.037, -0.006, -0.248)),
        "WRB": ("Forearm", (-0.035, -0.006, -0.246)),
    }
}

_FREE: Limits = ((-35, 35), (-45, 45), (-25, 25))
_HINGE: Limits = ((0, 85), (0, 0), (0, 0))
_FINGERS = ("Thumb", "Index", "Middle", "Ring", "Little")
_RANGES: dict[str, dict[str, Limits]] = {
    "hand": {
        "Forearm": ((-20, 20), (-20, 20), (-60, 60)),
        "Hand": ((-60, 60), (-25, 25), (-10, 10)),
        **{f"{finger}1": ((-20, 80), (-18, 18), (-8, 8)) for finger in _FINGERS},
        **{f"{finger}{i}": _HINGE for finger in _FINGERS for i in (2, 3)},
    }
}


def figure_of(skeleton: Skeleton) -> Figure:
    """A figure with the segments of a skeleton file; its lowest point stands on the floor.

    Example:
        >>> from mocap_skel import read_skeleton
        >>> from mocap_skel.artificial import figure_of
        >>> list(figure_of(read_skeleton("left_arm")).joints)
        ['LeftElbow', 'LeftWrist']
    """
    bones = [_bone(s, skeleton) for s in skeleton.segments]
    heights: dict[str | None, float] = {None: 0.0}
    low = 0.0
    for names, (offset, end) in zip(skeleton.segments, bones, strict=True):
        heights[names.name] = heights[names.parent] + offset[2]
        low = min(low, heights[names.name] + (end[2] if end else 0.0))
    bones[0] = ((0.0, 0.0, -low), bones[0][1])
    return Figure(
        tuple(
            Segment(names.name, names.parent, names.joint or "", offset, end)
            for names, (offset, end) in zip(skeleton.segments, bones, strict=True)
        )
    )


def markers_of(skeleton: Skeleton, figure: Figure) -> MarkerSet:
    """A place for every marker of a skeleton file: the human's, or one by rule around the segment's bones.

    Args:
        skeleton: the file, as `read_skeleton` gives it.
        figure: its bones, as `figure_of` gives them.

    Raises:
        ValueError: the skeleton names no markers.

    Example:
        >>> from mocap_skel import read_skeleton
        >>> from mocap_skel.artificial import figure_of, markers_of
        >>> arm = read_skeleton("left_arm")
        >>> markers_of(arm, figure_of(arm))["LELB"]
        ('UpperLeftArm', (-0.008, 0.043, -0.322))
    """
    markers: dict[str, tuple[str, Vector]] = {}
    for names in skeleton.segments:
        ends = [s.offset for s in figure.segments if s.parent == names.name]
        ends = ends or [(float(x), float(y), float(z)) for x, y, z in [figure.bones[names.name]]]
        for i, marker in enumerate(names.markers):
            known = _PLACES.get(skeleton.name, {}).get(marker) or place_of(marker)
            if known is None or known[0] != names.name:
                known = names.name, _around(ends, i, len(names.markers))
            markers[marker] = known
    if not markers:
        raise ValueError(f"the skeleton {skeleton.name!r} names no markers")
    return markers


def ranges_of(skeleton: Skeleton) -> dict[str, Limits]:
    """How far every segment of a skeleton file turns against its parent, for `circumduct`.

    Returns:
        Segment -> (low, high) about x, y and z, degrees.

    Example:
        >>> from mocap_skel import read_skeleton
        >>> from mocap_skel.artificial import ranges_of
        >>> ranges_of(read_skeleton("left_arm"))["LowerLeftArm"]
        ((-4, 4), (-140, 0), (-75, 75))
    """
    known = {**_human_ranges(), **_RANGES.get(skeleton.name, {})}
    return {names.name: known.get(names.name, _FREE) for names in skeleton.segments}


def _bone(names: Names, skeleton: Skeleton) -> _Bone:
    """A segment's joint and end: those of the figure below, of the human, or by the depth in the tree."""
    known = _BONES.get(skeleton.name, {}).get(names.name)
    if known is not None:
        return known
    child = next((s for s in human().segments if s.name == names.name), None)
    depth = 0
    above = names.parent
    while above is not None:
        depth, above = depth + 1, skeleton[above].parent
    length = 0.3 * 0.85**depth
    if names.parent is None:
        offset: Vector = (0.0, 0.0, 0.0)
    elif child is not None and child.parent == names.parent:
        offset = child.offset
    else:
        offset = _fanned(names, skeleton, length / 0.85)
    leaf = names in skeleton.leaves
    end = (child.end if child is not None else None) or (0.0, 0.0, -0.6 * length)
    return offset, end if leaf else None


def _fanned(names: Names, skeleton: Skeleton, length: float) -> Vector:
    """A joint below its parent: of an only child straight down, of several on a cone."""
    siblings = [s.name for s in skeleton.segments if s.parent == names.parent]
    if len(siblings) == 1:
        return (0.0, 0.0, -length)
    turn = 2 * np.pi * siblings.index(names.name) / len(siblings)
    return (
        0.5 * length * float(np.cos(turn)),
        0.5 * length * float(np.sin(turn)),
        -0.85 * length,
    )


def _around(ends: list[Vector], i: int, count: int) -> Vector:
    """The i-th of a segment's markers: along one of its bones in turn, and off it to the side."""
    bone = np.array(ends[i % len(ends)])
    length = float(np.linalg.norm(bone))
    # Two directions across the bone; of the lab's axes the one that it runs along least gives them.
    side = np.cross(bone, np.eye(3)[int(np.argmin(np.abs(bone)))])
    across = [v / np.linalg.norm(v) for v in (side, np.cross(side, bone))]
    # Within 160 degrees of the bone's outside, so that no two and the joint are in line.
    angle = np.deg2rad(-80 + 160 * (i + 0.5) / count)
    share = 0.45 + 0.45 * ((0.618 * i) % 1.0)
    out = 0.2 * length * (np.cos(angle) * across[0] + np.sin(angle) * across[1])
    x, y, z = share * bone + out
    return (float(x), float(y), float(z))


def _human_ranges() -> dict[str, Limits]:
    """`ROM_DEGREES` for both sides."""
    ranges = dict(ROM_DEGREES)
    for name, (x, y, z) in ROM_DEGREES.items():
        if "Left" in name:
            ranges[name.replace("Left", "Right")] = ((-x[1], -x[0]), y, (-z[1], -z[0]))
    return ranges

"""What joints are called elsewhere: rigs of animators have names of their own for the same bones."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from mocap_skel.text import listed

if TYPE_CHECKING:
    from mocap_skel.figure.skeleton import Segment

NAMINGS = ("mocap", "mixamo", "unreal", "cmu")

# Segment of the standard human, or joint of the full rig → the bone that moves it, as Mixamo's characters have it, as
# Unreal's mannequin has it, and as the BVH files have it that B. Hahne made of the CMU database (cgspeed.com). A
# joint goes before its segment: the chest turns about the lowest joint of the spine, but about the highest in a full rig.
_NAMES = {
    "Hips": ("Hips", "pelvis", "Hips"),
    "Chest": ("Spine", "spine_01", "Spine"),
    "Head": ("Head", "head", "Head"),
    "LowerTrunk": ("Spine", "spine_01", "LowerBack"),
    "MiddleTrunk": ("Spine1", "spine_02", "Spine"),
    "UpperSpine": ("Spine2", "spine_03", "Spine1"),
    "NeckBones": ("Neck", "neck_01", "Neck"),
    **{
        segment.format(side): tuple(
            name.format(side, side[0].lower()) for name in (mixamo, unreal, mixamo)
        )
        for side in ("Left", "Right")
        for segment, mixamo, unreal in (
            ("{}ShoulderGirdle", "{0}Shoulder", "clavicle_{1}"),
            ("Upper{}Arm", "{0}Arm", "upperarm_{1}"),
            ("Lower{}Arm", "{0}ForeArm", "lowerarm_{1}"),
            ("{}Hand", "{0}Hand", "hand_{1}"),
            ("Upper{}Leg", "{0}UpLeg", "thigh_{1}"),
            ("Lower{}Leg", "{0}Leg", "calf_{1}"),
            ("{}Foot", "{0}Foot", "foot_{1}"),
            ("{}Toes", "{0}ToeBase", "ball_{1}"),
        )
    },
}
_PREFIX = {"mixamo": "mixamorig:"}


def joint_names(
    segments: Sequence[Segment], naming: str
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """A name without blanks for the joint of every segment, and notes on those with no name there.

    Args:
        segments: each is called after its joint, the root after itself.
        naming: one of `NAMINGS`.

    Raises:
        ValueError: no such naming.

    >>> from mocap_skel.figure.skeleton import read_skeleton
    >>> joint_names(read_skeleton("human").segments[:2], "mixamo")
    (('mixamorig:Hips', 'mixamorig:Spine'), ())
    """
    if naming not in NAMINGS:
        raise ValueError(f"names must be one of {NAMINGS}, got {naming!r}")
    own = [s.joint or s.name for s in segments]
    if naming == "mocap":
        return tuple(_apart(own)), ()
    column, prefix = NAMINGS.index(naming) - 1, _PREFIX.get(naming, "")
    there = [_NAMES.get(s.joint or "") or _NAMES.get(s.name) for s in segments]
    names = [
        prefix + found[column] if found else name for found, name in zip(there, own, strict=True)
    ]
    kept = [name for found, name in zip(there, own, strict=True) if not found]
    notes = (f"no {naming} name for {listed(kept)}; it stays",) if kept else ()
    return tuple(_apart(names)), notes


def _apart(names: Iterable[str]) -> list[str]:
    """Names without blanks, a number behind those that are the same then."""
    found: list[str] = []
    for name in names:
        plain = re.sub(r"\s+", "_", name.strip())
        new, number = plain, 2
        while new in found:
            new, number = f"{plain}_{number}", number + 1
        found.append(new)
    return found

"""What joints are called elsewhere: rigs of animators have names of their own for the same bones."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from mocap_skel.text import listed

if TYPE_CHECKING:
    from mocap_skel.figure.skeleton import Segment

NAMINGS = ("mocap", "mixamo", "cmu")

# Segment → the bone that moves it, as both Mixamo's characters and the BVH files that B. Hahne made of the
# CMU database (cgspeed.com) have it; those have more bones in spine, neck and shoulders than a fit has joints.
_BONES = {
    "Hips": "Hips",
    "Chest": "Spine",
    "Head": "Head",
    **{
        segment.format(side): bone.format(side)
        for side in ("Left", "Right")
        for segment, bone in (
            ("Upper{}Arm", "{}Arm"),
            ("Lower{}Arm", "{}ForeArm"),
            ("{}Hand", "{}Hand"),
            ("Upper{}Leg", "{}UpLeg"),
            ("Lower{}Leg", "{}Leg"),
            ("{}Foot", "{}Foot"),
        )
    },
}
_PREFIX = {"mixamo": "mixamorig:", "cmu": ""}


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
    names = [
        _PREFIX[naming] + _BONES[s.name] if s.name in _BONES else name
        for s, name in zip(segments, own, strict=True)
    ]
    kept = [name for s, name in zip(segments, own, strict=True) if s.name not in _BONES]
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

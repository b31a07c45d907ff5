"""Masses of a figure's segments, where their centres are, and their inertia, from the mass of the whole body.

Source: de Leva 1996 (J. Biomech. 29, 1223), table 4, the mean of men and women.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mocap_skel.segments.pose import Array


@dataclass(frozen=True)
class Part:
    """What de Leva says of a segment, along one of the figure's bones.

    Attributes:
        mass: of the whole body's.
        at: where the centre of mass is, from the bone's start (0) to its tip (1).
        radii: of gyration, in lengths of the bone: about the axis to the front, the one to the side, the bone.
        start: joints whose middle the bone starts from; none = the segment's own joint.
        tip: joints whose middle it ends at; none = all that hang from the segment, or its end.
    """

    mass: float
    at: float
    radii: tuple[float, float, float]
    start: tuple[str, ...] = ()
    tip: tuple[str, ...] = ()


_LIMBS = {
    "Upper{}Arm": Part(0.02630, 0.5763, (0.2815, 0.2645, 0.1530)),
    "Lower{}Arm": Part(0.01500, 0.4567, (0.2685, 0.2610, 0.1075)),
    # From the wrist to the third knuckle, as de Leva has it.
    "{}Hand": Part(0.00585, 0.7687, (0.5795, 0.4835, 0.3680)),
    "Upper{}Leg": Part(0.14470, 0.3854, (0.3490, 0.3465, 0.1555)),
    "Lower{}Leg": Part(0.04570, 0.4438, (0.2630, 0.2580, 0.0980)),
    # de Leva's foot goes from the heel to the tip of the toes (243 mm), ours from the ankle, 55 mm before the heel, to the
    # ball, at 0.73 of the foot (Gordon 1989): 122 mm.
    "{}Foot": Part(0.01330, 0.39, (0.554, 0.522, 0.262)),
}
# The trunk's parts have other ends than de Leva's: with his mean lengths the waist's joint is 445 mm below C7 and 100 mm
# above the hips (Dumas 2007), and the parts' centres are 119 mm (upper), 330 mm (middle) below C7, 73 mm (lower)
# above the hips.
HUMAN = {
    # From C7 to the vertex he has 243 mm, we 200 mm to a head band.
    "Head": Part(0.06810, 0.62, (0.349, 0.371, 0.318)),
    # Upper and middle part in one.
    "Chest": Part(0.31195, 0.497, (0.336, 0.292, 0.226), tip=("Neck",)),
    "Hips": Part(0.11820, 0.73, (0.857, 0.780, 0.843), ("RightHip", "LeftHip"), ("Waist",)),
    **{
        name.format(side): part for side in ("Left", "Right") for name, part in _LIMBS.items()
    },
}  # fmt: skip
# With a spine of three joints the middle part is that of two bones, in equal halves, each of 0.195 of the trunk.
SPINE = {
    "Chest": Part(0.15705, 0.56, (0.423, 0.276, 0.398), tip=("Neck",)),
    "LowerTrunk": Part(0.07745, 0.5, (0.928, 0.654, 1.068)),
    "MiddleTrunk": Part(0.07745, 0.5, (0.928, 0.654, 1.068)),
}
# What all of them are together. His numbers add up to 99.995 %.
WHOLE = sum(part.mass for part in HUMAN.values())
# A bone that de Leva does not know has so much of the mass of the one that it hangs from: enough for a body that a
# program can move, and too little to matter. By eye, as its centre in the middle and its radii, those of a rod.
SHARE, ROD = 0.01, (0.29, 0.29, 0.1)
# Metres: a shorter bone has the inertia of one as long as this.
SHORTEST = 0.05


@dataclass(frozen=True, eq=False)
class Mass:
    """A segment as a rigid body.

    Attributes:
        mass: kilograms.
        centre: (3,) its centre of mass from the segment's joint, metres.
        inertia: (3, 3) about that centre, kg m².
        bone: (2, 3) where the bone starts and ends, from the segment's joint.
    """

    mass: float
    centre: Array
    inertia: Array
    bone: Array


def masses(
    names: Sequence[str],
    joints: Sequence[str],
    parents: Sequence[int],
    offsets: Array,
    ends: Mapping[int, Array],
    whole: float,
) -> tuple[list[Mass], bool]:
    """The masses of a figure's segments.

    In axes in which the figure stands in a T-pose, x to its front, y up, z to its right.

    Args:
        names: of the segments, parents first.
        joints: the joint that each hangs from.
        parents: the index of the segment that each hangs from, -1 for the root.
        offsets: (n, 3) each segment's joint from its parent's.
        ends: index → (3,), the end of a segment without children, from its joint.
        whole: kilograms of the whole body. What the figure has not is not shared out.

    Returns:
        One a segment; and whether the masses are de Leva's. A figure most of whose segments he does not know shares
        the mass out equally.

    >>> import numpy as np
    >>> leg, known = masses(
    ...     ["UpperLeftLeg", "LowerLeftLeg"], ["", "LeftKnee"], [-1, 0],
    ...     np.array([[0, 0, 0], [0, -0.4, 0]]), {1: np.array([0, -0.4, 0])}, 70.0)
    >>> known, [round(float(one.mass), 2) for one in leg], leg[1].centre.round(4).tolist()
    (True, [10.13, 3.2], [0.0, -0.1775, 0.0])
    """
    table = HUMAN | (SPINE if set(SPINE) <= set(names) else {})
    parts = [table.get(name) for name in names]
    # Other animals have a head too: a figure is a person's if most of its segments are.
    known = 2 * sum(part is not None for part in parts) >= len(parts)
    parts = parts if known else [None] * len(names)
    shares = [part.mass / WHOLE if part else 0.0 for part in parts]
    if not known:
        shares = [1.0 / len(names)] * len(names)
    for i, parent in enumerate(parents):
        if known and parts[i] is None:
            carrier = parent if parent >= 0 else next(j for j, part in enumerate(parts) if part)
            shares[i] = SHARE * shares[carrier]
            shares[carrier] -= shares[i]
    found = []
    for i, part in enumerate(parts):
        chosen = part or Part(0.0, 0.5, ROD)
        below = {joints[j]: offsets[j] for j, parent in enumerate(parents) if parent == i}
        start = _middle(below, chosen.start)
        tip = _middle(below, chosen.tip)
        start = np.zeros(3) if start is None else start
        if tip is None:
            tip = ends.get(i) if not below else np.mean(list(below.values()), axis=0)
        bone = np.stack([start, start if tip is None else tip])
        found.append(_mass(whole * shares[i], chosen, bone))
    return found, known


def _middle(places: Mapping[str, Array], chosen: Sequence[str]) -> Array | None:
    """The middle of the chosen places, None unless all are there."""
    if not chosen or not set(chosen) <= places.keys():
        return None
    return np.asarray(np.mean([places[name] for name in chosen], axis=0))


def _mass(mass: float, part: Part, bone: Array) -> Mass:
    along = bone[1] - bone[0]
    length = float(np.linalg.norm(along))
    along = along / length if length > 0 else np.array([0.0, 1.0, 0.0])
    # The axis to the front; a bone that points there, as a foot does, has the one up in its place.
    front = np.eye(3)[0 if abs(along[0]) < abs(along[1]) or abs(along[0]) < abs(along[2]) else 1]
    front = front - (front @ along) * along
    front /= np.linalg.norm(front)
    axes = np.stack([front, np.cross(along, front), along], axis=1)
    squares = (max(length, SHORTEST) * np.array(part.radii)) ** 2
    centre = bone[0] + part.at * (bone[1] - bone[0])
    return Mass(mass, centre, mass * (axes * squares) @ axes.T, bone)

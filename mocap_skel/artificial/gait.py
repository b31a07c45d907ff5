"""A walk whose foot contacts are known: its feet stand where they strike, on the floor or on a treadmill's belt."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mocap_skel.artificial.figure import STATURE, Motion, human
from mocap_skel.artificial.rotations import from_vector, swing_twist

Array = NDArray[np.float64]

# Metres a second, seconds, and the part of a stride in which a foot stands: Winter 2009, natural cadence.
SPEED, STRIDE, STANCE = 1.2, 1.08, 0.62
# Degrees that the foot points up when it strikes and down when it leaves; parts of the stance at which it comes to
# lie flat and at which the heel rises.
STRIKE_PITCH, OFF_PITCH, FLAT, RISE = 18.0, 55.0, 0.12, 0.5
# Metres: what the foot rolls over, from the ankle of a subject of `STATURE`; its sole is so far below the ankle.
HEEL, BALL, SOLE = -0.06, 0.13, 0.068
# Metres: how far the pelvis is lower than in a straight stance, and how far it rises and falls.
LOWER, BOB = 0.025, 0.015
# Metres in front of the hip where a heel strikes.
REACH = 0.27


@dataclass(frozen=True, eq=False)
class Gait:
    """A walk and its contacts.

    Attributes:
        motion: of the standard human.
        strikes, offs: side ("left", "right") → the times, seconds after the first frame, at which the heel comes to
            stand and the toes leave.
    """

    motion: Motion
    strikes: Mapping[str, Array]
    offs: Mapping[str, Array]


def gait(
    seconds: float,
    rate: float,
    *,
    stature: float = STATURE,
    treadmill: bool = False,
    speed: float = SPEED,
) -> Gait:
    """A human walks straight on, along x; each foot stands still on the ground from its strike to its off.

    Args:
        seconds, rate: the motion has round(seconds * rate) frames.
        stature: metres.
        treadmill: the ground goes back, and the human stays in place.
        speed: metres a second.

    Raises:
        ValueError: no frames, or a rate that is not positive.

    Example:
        >>> from mocap_skel.artificial.gait import gait
        >>> walk = gait(4, 100)
        >>> len(walk.motion.shift), walk.strikes["left"].round(2).tolist()
        (400, [0.54, 1.62, 2.7, 3.78])
    """
    frames = round(seconds * rate)
    if not (rate > 0 and frames > 0):
        raise ValueError(f"{seconds} s at {rate} frames a second is no motion")
    times = np.arange(frames) / rate
    k = stature / STATURE
    figure = human(stature)
    offsets = {segment.name: np.array(segment.offset) for segment in figure.segments}
    phase = 2 * np.pi * times / STRIDE
    # The right foot strikes at phase 0, the left one half a stride later.
    pelvis = swing_twist(
        np.deg2rad(np.column_stack([4 * np.sin(phase), 6 + np.cos(2 * phase), 5 * np.cos(phase)]))
    )
    shift = np.column_stack(
        [speed * times, 0.02 * k * np.sin(phase), k * (-LOWER - BOB * np.cos(2 * phase))]
    )
    origin = shift + offsets["Hips"]
    rotations = {"Hips": pelvis, **_upper_body(phase)}
    strikes: dict[str, Array] = {}
    offs: dict[str, Array] = {}
    for side, start in (("Right", 0.0), ("Left", 0.5)):
        hip = origin + (pelvis @ offsets[f"Upper{side}Leg"])
        ankle, pitch = _foot(times / STRIDE - start, start, speed, k)
        ankle[:, 1] += 0.9 * offsets[f"Upper{side}Leg"][1]
        lengths = (-offsets[f"Lower{side}Leg"][2], -offsets[f"{side}Foot"][2])
        thigh, shank = _leg(hip, ankle, lengths)
        foot = from_vector(pitch[:, None] * [0.0, 1.0, 0.0])
        rotations[f"Upper{side}Leg"] = pelvis.transpose(0, 2, 1) @ thigh
        rotations[f"Lower{side}Leg"] = thigh.transpose(0, 2, 1) @ shank
        rotations[f"{side}Foot"] = shank.transpose(0, 2, 1) @ foot
        strides = np.arange(-1, int(seconds / STRIDE) + 2) + start
        for found, of in ((strikes, strides), (offs, strides + STANCE)):
            at = of * STRIDE
            found[side.lower()] = at[(at > 0) & (at < times[-1])]
    if treadmill:
        shift = shift - np.array([speed, 0.0, 0.0]) * times[:, None]
    return Gait(Motion(rate, shift, rotations), strikes, offs)


def _foot(strides: Array, start: float, speed: float, k: float) -> tuple[Array, Array]:
    """The ankle in the lab (frames, 3) and the foot's pitch, radians, toes down; `strides` counts from a strike."""
    count = np.floor(strides)
    share = strides - count
    length = speed * STRIDE
    # Where the heel of each stance stands: in front of the hip by REACH when it strikes.
    heel = (count + start) * length + REACH * k
    ankle, pitch = _standing(share, k)
    swing = share >= STANCE
    part = (share[swing] - STANCE) / (1 - STANCE)
    step = 1e-4
    (leaving, before, landing, after), pitches = _standing(
        np.array([STANCE, STANCE - step, 0.0, step]), k
    )
    scale = (1 - STANCE) / step
    landing, after = (place + [length, 0.0, 0.0] for place in (landing, after))
    ankle[swing] = _hermite(
        part, leaving, (leaving - before) * scale, landing, (after - landing) * scale
    )
    ankle[swing, 2] += 0.03 * k * np.sin(np.pi * part) ** 2
    pitch[swing] = _hermite(
        part, pitches[:1], (pitches[:1] - pitches[1:2]) * scale,
        pitches[2:3], (pitches[3:] - pitches[2:3]) * scale,
    )[:, 0]  # fmt: skip
    ankle[:, 0] += heel
    return ankle, pitch


def _standing(share: Array, k: float) -> tuple[Array, Array]:
    """The ankle (frames, 3) seen from where the heel stands, and the pitch: over the heel, flat, over the ball."""
    part = share / STANCE
    up, down = np.deg2rad(STRIKE_PITCH), np.deg2rad(OFF_PITCH)
    pitch = -up * np.clip(1 - part / FLAT, 0, 1) ** 2
    pitch = pitch + down * np.clip((part - RISE) / (1 - RISE), 0, 1) ** 2
    over = np.where(pitch < 0, HEEL, BALL) * k
    # From the point that the foot rolls over to the ankle, turned by the pitch about y.
    x, z = -over, SOLE * k
    c, s = np.cos(pitch), np.sin(pitch)
    ankle = np.column_stack([c * x + s * z, np.zeros(len(part)), -s * x + c * z])
    ankle[:, 0] += over - HEEL * k
    return ankle, pitch


def _hermite(part: Array, start: Array, leaves: Array, stop: Array, arrives: Array) -> Array:
    """(frames, n): a cubic from a place to another with given velocities."""
    t = part[:, None]
    return np.asarray(
        (2 * t**3 - 3 * t**2 + 1) * start + (t**3 - 2 * t**2 + t) * leaves
        + (3 * t**2 - 2 * t**3) * stop + (t**3 - t**2) * arrives
    )  # fmt: skip


def _leg(hip: Array, ankle: Array, lengths: tuple[float, float]) -> tuple[Array, Array]:
    """Thigh and shank in the lab, (frames, 3, 3): the knee bends forward, about the axis that is most across."""
    line = hip - ankle
    # A leg that does not reach is as good as straight.
    far = np.clip(np.linalg.norm(line, axis=1), None, 0.9995 * sum(lengths))
    z = line / np.linalg.norm(line, axis=1, keepdims=True)
    y = np.array([0.0, 1.0, 0.0]) - z[:, 1:2] * z
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    straight = np.stack([np.cross(y, z), y, z], axis=2)
    above, below = lengths
    at_hip = np.arccos((above**2 + far**2 - below**2) / (2 * above * far))
    at_ankle = np.arccos((below**2 + far**2 - above**2) / (2 * below * far))
    about = np.array([0.0, 1.0, 0.0])
    thigh = straight @ from_vector(-at_hip[:, None] * about)
    shank = straight @ from_vector(at_ankle[:, None] * about)
    return thigh, shank


def _upper_body(phase: Array) -> dict[str, Array]:
    """Trunk and arms as they swing with the legs."""
    swing, bob = np.cos(phase), np.sin(phase)
    degrees = {
        "Chest": (-4 * bob, -3 + np.cos(2 * phase), -9 * swing),
        "Head": (2 * bob, 1.5 * np.cos(2 * phase), 4 * swing),
    }
    for side, sign in (("Left", 1.0), ("Right", -1.0)):
        # An arm goes forward with the leg of the other side.
        arm = sign * swing
        degrees |= {
            f"Upper{side}Arm": (sign * (8 + arm), -4 - 16 * arm, sign * 5 * arm),
            f"Lower{side}Arm": (0 * arm, -25 - 12 * arm, sign * 8 * arm),
            f"{side}Hand": (sign * 4 * arm, 2 * arm, 0 * arm),
        }
    return {name: swing_twist(np.deg2rad(np.column_stack(a))) for name, a in degrees.items()}

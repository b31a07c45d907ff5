"""Motions: joint angles over time for the standard human, and one for any figure.

Angles are the components of `rotations.swing_twist` about the parent's axes (x front, y left,
z up). On the left side +x abducts and +z turns outward; -y flexes hip, shoulder and elbow and lifts
the toes; +y flexes the knee and bends the trunk forward. The wrist, its palm to the thigh, flexes
about x. The right side mirrors: its x and z have the other sign.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mocap_skel.artificial.figure import STATURE, Motion, floor_contacts, human
from mocap_skel.artificial.rotations import from_vector, swing_twist

Array = NDArray[np.float64]
Limits = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]

ROM_DEGREES: dict[str, Limits] = {
    "Hips": ((-12, 12), (-12, 15), (0, 0)),
    "Chest": ((-25, 25), (-15, 38), (-35, 35)),
    "Head": ((-30, 30), (-40, 35), (-55, 55)),
    "UpperLeftArm": ((8, 105), (-95, 30), (-40, 40)),
    "LowerLeftArm": ((-4, 4), (-140, 0), (-75, 75)),
    "LeftHand": ((-55, 55), (-28, 28), (0, 0)),
    "UpperLeftLeg": ((-8, 42), (-85, 18), (-28, 28)),
    "LowerLeftLeg": ((-5, 5), (0, 120), (-25, 25)),
    "LeftFoot": ((-26, 26), (-26, 40), (-21, 21)),
}
"""Physiological limits about x, y, z on the left side, degrees; the right side mirrors them."""

_MIRROR = np.array([-1.0, 1.0, -1.0])


def range_of_motion(seconds: float, rate: float, seed: int = 0, stature: float = STATURE) -> Motion:
    """A human moves every joint through its whole range in all its directions, all at once.

    Sines of incommensurate frequencies (0.25 to 0.65 Hz, phase-modulated) fill each joint's box of
    angles within about ten seconds; the knee turns about the shank only while it is bent. The
    pelvis sways, turns and is carried so that the lowest foot or knee stays on the floor.

    Args:
        seconds, rate: the motion has round(seconds * rate) frames.
        seed: of the phases.
        stature: metres, for the height over the floor.

    Raises:
        ValueError: no frames, or a rate that is not positive.

    Example:
        >>> from mocap_skel.artificial import range_of_motion
        >>> motion = range_of_motion(10, 50)
        >>> motion.rotations["LowerLeftLeg"].shape
        (500, 3, 3)
    """
    times, rng = _times(seconds, rate), np.random.default_rng(seed)
    limits = {name: limit for left, limit in ROM_DEGREES.items() for name in _both(left)}
    angles = _sweep(limits, times, rng)
    for name in angles:
        if "Right" in name:
            angles[name] = angles[name] * _MIRROR
    for name in _both("LowerLeftLeg"):
        angles[name][:, 2] *= -np.expm1(-angles[name][:, 1] / np.deg2rad(12))
    drift = _waves([0.05, 0.071, 0.09], times, rng)
    yaw = np.deg2rad(80) * drift[:, 2]
    return _stand(angles, yaw, 0.35 * drift[:, :2], rate, stature)


def circumduct(degrees: Mapping[str, Limits], seconds: float, rate: float, seed: int = 0) -> Motion:
    """Any figure's segments through given ranges, all at once, the root's origin at rest.

    Args:
        degrees: segment -> (low, high) about its parent's x, y and z, degrees, see `ROM_DEGREES`.
        seconds, rate: the motion has round(seconds * rate) frames.
        seed: of the phases.

    Raises:
        ValueError: no frames, or a rate that is not positive.

    Example:
        >>> from mocap_skel.artificial import circumduct
        >>> motion = circumduct({"Shank": ((0, 0), (0, 90), (0, 0))}, 10, 50)
        >>> print(motion.rotations["Shank"][:, 1, 1].round(6).min())
        1.0
    """
    times = _times(seconds, rate)
    angles = _sweep(degrees, times, np.random.default_rng(seed))
    rotations = {name: swing_twist(angle) for name, angle in angles.items()}
    return Motion(rate, np.zeros((len(times), 3)), rotations)


def dance(seconds: float, rate: float, seed: int = 0, stature: float = STATURE) -> Motion:
    """A human dances a salsa: steps on the spot, hips, arms, and a full turn every few seconds.

    Joints keep to moderate ranges (knees 0 to 70 degrees), as in takes that were not made for
    calibration.

    Args:
        seconds, rate, seed, stature: as for `range_of_motion`.

    Raises:
        ValueError: no frames, or a rate that is not positive.

    Example:
        >>> from mocap_skel.artificial import dance
        >>> dance(2, 60).shift.shape
        (120, 3)
    """
    times, rng = _times(seconds, rate), np.random.default_rng(seed)
    beat = 2 * np.pi * 0.8 * times + 0.4 * _waves([0.11], times, rng)[:, 0]
    sway = np.sin(beat)
    trunk = _waves(rng.uniform(0.15, 0.5, 6), times, rng).T
    angles = {
        "Hips": _degrees(7 * sway, 5 + 3 * trunk[0], 12 * sway),
        "Chest": _degrees(-8 * sway, 4 + 7 * trunk[1], -16 * sway + 10 * trunk[2]),
        "Head": _degrees(8 * trunk[3], 12 * trunk[4], 25 * trunk[5]),
    }
    for side, mirror, phase in _sides(beat):
        leg = _waves(rng.uniform(0.15, 0.4, 5), times, rng).T
        lift = ((1 + np.sin(phase)) / 2) ** 2 * (0.8 + 0.2 * leg[4])
        arm = _waves(rng.uniform(0.3, 0.8, 8), times, rng).T
        limbs = {
            f"Upper{side}Leg": _degrees(5 + 7 * leg[0], -4 - 32 * lift, 10 + 12 * leg[1]),
            f"Lower{side}Leg": _degrees(1.5 * leg[2], 6 + 60 * lift, 8 * lift * leg[3]),
            f"{side}Foot": _degrees(4 * leg[2], 3 - 13 * lift, 5 * leg[3]),
            f"Upper{side}Arm": _degrees(25 + 18 * arm[0], -20 - 32 * arm[1], 25 * arm[2]),
            f"Lower{side}Arm": _degrees(2 * arm[3], -70 - 40 * arm[4], 45 * arm[5]),
            f"{side}Hand": _degrees(20 * arm[6], 12 * arm[7], 0 * arm[7]),
        }
        angles |= {name: mirror * angle for name, angle in limbs.items()}
    starts = np.arange(2.5, seconds, 5.0)
    starts = starts + rng.uniform(-1.0, 1.0, len(starts))
    ways = rng.choice([-1.0, 1.0], len(starts))
    turns = np.pi * (1 + np.tanh((times[:, None] - starts) / 0.6)) @ ways
    path = 0.4 * _waves([0.04, 0.055], times, rng) + 0.12 * np.sin(beat / 2)[:, None]
    return _stand(angles, turns, path, rate, stature)


def walk(seconds: float, rate: float, seed: int = 0, stature: float = STATURE) -> Motion:
    """A human walks on the level, 1.2 m/s round a circle of 2.5 m radius; joints that are nearly hinges.

    Args:
        seconds, rate, stature: as for `range_of_motion`.
        seed: of the phases of the small motions.

    Raises:
        ValueError: no frames, or a rate that is not positive.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial import walk
        >>> path = walk(5, 60).shift[:, :2]
        >>> print(np.linalg.norm(np.diff(path, axis=0), axis=1).mean().round(3))  # metres a frame
        0.02
    """
    times, rng = _times(seconds, rate), np.random.default_rng(seed)
    stride = 2 * np.pi * 0.92 * times
    small = _waves(rng.uniform(0.2, 0.6, 3), times, rng).T
    angles = {
        "Hips": _degrees(4 * np.sin(stride), 4 + np.cos(2 * stride), 5 * np.cos(stride)),
        "Chest": _degrees(-4 * np.sin(stride), 1 + small[0], -10 * np.cos(stride)),
        "Head": _degrees(2 * small[1], 3 * small[0], 6 * small[2]),
    }
    for side, mirror, phase in _sides(stride):
        swing = _bump(phase, 0.73, 2.5)
        push = _bump(phase, 0.62, 9.0)
        stance = _bump(phase, 0.14, 6.0)
        arm = np.cos(phase + np.pi)
        limbs = {
            f"Upper{side}Leg": _degrees(
                2 * np.sin(phase), -10 - 20 * np.cos(phase + 0.35), 4 * np.sin(phase)
            ),
            f"Lower{side}Leg": _degrees(0.5 * swing, 4 + 13 * stance + 56 * swing, 5 * swing),
            f"{side}Foot": _degrees(3 * swing, -5 * np.sin(phase - 0.8) + 16 * push, 3 * push),
            f"Upper{side}Arm": _degrees(8 + arm, -4 - 16 * arm, 5 * arm),
            f"Lower{side}Arm": _degrees(0.3 * arm, -25 - 12 * arm, 8 * arm),
            f"{side}Hand": _degrees(4 * arm, 2 * arm, 0 * arm),
        }
        angles |= {name: mirror * angle for name, angle in limbs.items()}
    radius, speed = 2.5, 1.2
    yaw = speed / radius * times
    path = radius * np.column_stack([np.sin(yaw), 1 - np.cos(yaw)])
    return _stand(angles, yaw, path, rate, stature)


def still(seconds: float, rate: float, seed: int = 0) -> Motion:
    """A human stands: trunk and arms sway by about a degree, the feet by millimetres.

    No joint can be seen from this.

    Args:
        seconds, rate, seed: as for `range_of_motion`.

    Raises:
        ValueError: no frames, or a rate that is not positive.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial import still
        >>> print(np.ptp(still(10, 60).shift, axis=0).max() < 0.01)
        True
    """
    times, rng = _times(seconds, rate), np.random.default_rng(seed)
    rotations = {}
    for name in (segment.name for segment in human().segments):
        size = 0.15 if "Leg" in name or name in ("Hips", "RightFoot", "LeftFoot") else 1.0
        waves = size * _waves(rng.uniform(0.1, 0.5, 3), times, rng)
        # The arms hang a little off the trunk.
        waves[:, 0] += {"UpperLeftArm": 10.0, "UpperRightArm": -10.0}.get(name, 0.0)
        rotations[name] = swing_twist(np.deg2rad(waves))
    shift = _waves(rng.uniform(0.1, 0.4, 3), times, rng) * [0.004, 0.003, 0.0005]
    return Motion(rate, shift, rotations)


def _times(seconds: float, rate: float) -> Array:
    """(frames,), the time of each frame, seconds."""
    frames = round(seconds * rate)
    if not (rate > 0 and frames > 0):
        raise ValueError(f"{seconds} s at {rate} frames a second is no motion")
    return np.arange(frames) / rate


def _waves(hertz: ArrayLike, times: Array, rng: np.random.Generator) -> Array:
    """Smooth signals within ±1, (frames, signals): sines whose phase moves to and fro by a slower sine."""
    angle = 2 * np.pi * np.multiply.outer(times, np.asarray(hertz))
    fast, slow = rng.uniform(0, 2 * np.pi, (2, angle.shape[1]))
    return np.asarray(np.sin(angle + fast + 1.2 * np.sin(0.37 * angle + slow)))


def _sweep(
    degrees: Mapping[str, Limits], times: Array, rng: np.random.Generator
) -> dict[str, Array]:
    """Angles that fill their ranges: segment -> (frames, 3), radians."""
    angles = {}
    for i, (name, limits) in enumerate(degrees.items()):
        low, high = np.deg2rad(np.array(limits, dtype=np.float64)).T
        # Multiples of the golden ratio keep any three neighbours apart, so that no joint's axes
        # run in step and trace a line where they should fill a box.
        share = (np.arange(3 * i, 3 * i + 3) * 0.6180339887) % 1.0
        waves = _waves(0.25 + 0.4 * share, times, rng)
        angles[name] = (low + high) / 2 + (high - low) / 2 * waves
    return angles


def _both(left: str) -> tuple[str, ...]:
    """A segment, and that of the other side where it has one."""
    return (left, left.replace("Left", "Right")) if "Left" in left else (left,)


def _sides(phase: Array) -> Iterator[tuple[str, Array, Array]]:
    """Each side: its name, the signs of its angles, its phase; the right is half a cycle behind."""
    yield "Left", np.ones(3), phase
    yield "Right", _MIRROR, phase + np.pi


def _degrees(x: Array, y: Array, z: Array) -> Array:
    return np.deg2rad(np.column_stack([x, y, z]))


def _bump(phase: Array, cycle: float, sharpness: float) -> Array:
    """A smooth periodic peak of height 1 at a share of the cycle."""
    return np.asarray(np.exp(sharpness * (np.cos(phase - 2 * np.pi * cycle) - 1)))


def _stand(
    angles: Mapping[str, Array], yaw: Array, path: Array, rate: float, stature: float
) -> Motion:
    """The motion of a human that bears on the floor with its lowest foot or knee.

    Args:
        angles: segment -> (frames, 3), radians; the root's are its tilt in its own heading.
        yaw: heading, (frames,), radians.
        path: of the root over the floor, (frames, 2), metres.
    """
    rotations = {name: swing_twist(angle) for name, angle in angles.items()}
    heading = from_vector(yaw[:, None] * np.array([0.0, 0.0, 1.0]))
    rotations["Hips"] = heading @ rotations["Hips"]
    shift = np.column_stack([path, np.zeros(len(path))])
    poses = human(stature).poses(Motion(rate, shift, rotations))
    contacts = floor_contacts(stature)
    heights = np.stack([poses[name].place(point)[:, 2] for name, point in contacts])
    shift[:, 2] = _smooth(-heights.min(axis=0), 0.07 * rate)
    return Motion(rate, shift, rotations)


def _smooth(track: Array, width: float) -> Array:
    """A track (frames,) through a Gaussian of a width in frames, so that a change of foot makes no kick."""
    reach = int(np.ceil(3 * width))
    window = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    padded = np.pad(track, reach, mode="edge")
    return np.convolve(padded, window / window.sum(), mode="valid")

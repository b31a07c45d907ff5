"""A human whose landmarks lie so that anatomical axes are the generator's own, and motions of known joint angles.

The generator's axes are x forward, y to the left, z up. So right is -y: a turn about an anatomical axis is one about
(1, 0, 0), (0, 0, 1) or (0, -1, 0) here. Rotations are made here by Rodrigues' formula, apart from the package.
"""

import numpy as np

from mocap_skel.artificial import Motion, human, record

FORWARD, UP, RIGHT = np.array([1.0, 0, 0]), np.array([0, 0, 1.0]), np.array([0, -1.0, 0])
AXIS = {"X": FORWARD, "Y": UP, "Z": RIGHT}
SIDES = {"Right": -1.0, "Left": 1.0}

_BOTH = {
    "FWT": ("Hips", (0.08, 0.12, 0.09)),
    "BWT": ("Hips", (-0.11, 0.06, 0.09)),
    "SHO": ("Chest", (0.0, 0.178, 0.423)),
    "FHD": ("Head", (0.11, 0.07, 0.15)),
    "BHD": ("Head", (-0.07, 0.07, 0.15)),
    "UPA": ("Upper{}Arm", (0.005, 0.052, -0.165)),
    "ELB": ("Upper{}Arm", (0.0, 0.042, -0.3255)),
    "MEP": ("Upper{}Arm", (0.0, -0.042, -0.3255)),
    "ARM": ("Lower{}Arm", (0.042, 0.005, -0.12)),
    # The thumb points outward at rest, as in the anatomical position.
    "WRA": ("Lower{}Arm", (0.0, 0.035, -0.2555)),
    "WRB": ("Lower{}Arm", (0.0, -0.035, -0.2555)),
    "FIN": ("{}Hand", (0.0, 0.0, -0.09)),
    "THI": ("Upper{}Leg", (0.01, 0.092, -0.2)),
    "KNE": ("Upper{}Leg", (0.0, 0.054, -0.429)),
    "KNM": ("Upper{}Leg", (0.0, -0.054, -0.429)),
    "TIB": ("Lower{}Leg", (0.042, 0.034, -0.185)),
    "ANK": ("Lower{}Leg", (0.0, 0.043, -0.431)),
    "MED": ("Lower{}Leg", (0.0, -0.043, -0.431)),
    "HEE": ("{}Foot", (-0.068, 0.0, -0.036)),
    "TOE": ("{}Foot", (0.122, 0.0, -0.036)),
    "MT5": ("{}Foot", (0.09, 0.05, -0.045)),
}
_MIDDLE = {
    "CLAV": ("Chest", (0.08, 0.0, 0.4)),
    "C7": ("Chest", (-0.08, 0.0, 0.4)),
    "STRN": ("Chest", (0.08, 0.0, 0.2)),
    "T10": ("Chest", (-0.08, 0.0, 0.2)),
}
# Right limbs of the generated human are a little longer or shorter than left ones; so are their landmarks.
_LONGER = {"ELB": 0.004, "MEP": 0.004, "WRA": -0.003, "WRB": -0.003, "KNE": -0.005, "KNM": -0.005, "ANK": 0.005, "MED": 0.005}  # fmt: skip
MARKERS = {
    **_MIDDLE,
    **{
        f"{side[0]}{name}": (segment.format(side), (x, sign * y, z - (sign < 0) * _LONGER.get(name, 0.0)))
        for name, (segment, (x, y, z)) in _BOTH.items()
        for side, sign in SIDES.items()
    },
}  # fmt: skip

# Joint → its child segment, sequence, and for each of our angles the sign of the turn on the right side.
JOINTS = {
    "Waist": ("Chest", "ZXY", (-1, 1, 1)),
    "Neck": ("Head", "ZXY", (-1, 1, 1)),
    **{
        f"{side}{name}": (child.format(side), sequence, (a, b * (-sign), c * (-sign)))
        for side, sign in SIDES.items()
        for name, child, sequence, (a, b, c) in (
            ("Elbow", "Lower{}Arm", "ZXY", (1, -1, 1)),
            ("Wrist", "{}Hand", "ZXY", (1, 1, 1)),
            ("Hip", "Upper{}Leg", "ZXY", (1, 1, 1)),
            ("Knee", "Lower{}Leg", "ZXY", (-1, 1, 1)),
            ("Ankle", "{}Foot", "ZXY", (1, 1, 1)),
        )
    },
    # Left of the body the arm is raised the other way round.
    "RightShoulder": ("UpperRightArm", "YXY", (1, -1, 1)),
    "LeftShoulder": ("UpperLeftArm", "YXY", (-1, 1, -1)),
}  # fmt: skip

# Joint → lowest and highest degrees of its three angles.
RANGES = {
    "Waist": ((-10, 40), (-20, 20), (-30, 30)),
    "Neck": ((-30, 30), (-25, 25), (-50, 50)),
    "Shoulder": ((-30, 80), (25, 110), (-60, 50)),
    "Elbow": ((5, 120), (-6, 6), (-60, 60)),
    "Wrist": ((-40, 40), (-20, 20), (0, 0)),
    "Hip": ((-15, 80), (-30, 8), (-25, 25)),
    "Knee": ((2, 110), (-5, 5), (-20, 20)),
    "Ankle": ((-30, 20), (-15, 15), (-15, 15)),
}


def turn(axis, radians):
    """Rotations (frames, 3, 3) about a unit vector (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    a = np.asarray(radians)[:, None, None]
    return np.eye(3) + np.sin(a) * cross + (1 - np.cos(a)) * (cross @ cross)


def in_turn(sequence, degrees, signs):
    """Rotations of our angles (frames, 3), degrees: three turns, each about an axis that the ones before carry."""
    made = np.eye(3)
    for axis, angle, sign in zip(sequence, degrees.T, signs, strict=True):
        made = made @ turn(AXIS[axis], np.radians(sign * angle))
    return made


def waves(ranges, frames, seed):
    """Angles (frames, 3), degrees, that fill their ranges by sines of unlike frequencies."""
    rng = np.random.default_rng(seed)
    times = np.linspace(0, 12, frames)
    low, high = np.array(ranges, dtype=float).T
    hertz, phase = rng.uniform(0.25, 0.65, 3), rng.uniform(0, 2 * np.pi, 3)
    return (low + high) / 2 + (high - low) / 2 * np.sin(2 * np.pi * times[:, None] * hertz + phase)


def filmed(frames=1200, seed=0, faults=None, joints=None, markers=MARKERS):
    """A recording, and its truth: joint → our angles (frames, 3), degrees; the root against the lab as "Hips".

    Args:
        joints: joint → angles, in place of those of `RANGES`.
    """
    truth = {
        name: waves(RANGES[name.removeprefix("Right").removeprefix("Left")], frames, seed + i)
        for i, name in enumerate(JOINTS)
    } | (joints or {})
    rotations = {
        JOINTS[name][0]: in_turn(JOINTS[name][1], angles, JOINTS[name][2])
        for name, angles in truth.items()
        if name in JOINTS
    }
    truth["Hips"] = (joints or {}).get(
        "Hips", waves(((-170, 170), (-10, 10), (-5, 25)), frames, 99)
    )
    rotations["Hips"] = in_turn("YXZ", truth["Hips"], (1, -1, -1))
    motion = Motion(100.0, np.zeros((frames, 3)), rotations)
    return record(human(), markers, motion, faults, seed=seed), truth


def association_of(folder, markers=MARKERS):
    """An association file of these markers, as read."""
    from mocap_skel import read_association

    path = folder / "anatomy.txt"
    lines = [f"{label} {label} {segment}" for label, (segment, _) in markers.items()]
    path.write_text("\n".join(lines))
    return read_association(path)

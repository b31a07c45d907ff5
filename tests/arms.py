"""Small figures of their own for tests: an arm of three joints, and two arms on a trunk."""

from functools import cache

from mocap_skel import read_association
from mocap_skel.artificial import Faults, Figure, Segment, circumduct, record

ARM = Figure(
    (
        Segment("Trunk", offset=(0.0, 0.0, 1.0)),
        Segment("Upper", "Trunk", "Shoulder", (0.0, 0.20, 0.40)),
        Segment("Fore", "Upper", "Elbow", (0.0, 0.0, -0.30)),
        Segment("Hand", "Fore", "Wrist", (0.0, 0.0, -0.25), end=(0.0, 0.0, -0.15)),
    )
)
ARM_MARKERS = {
    "T1": ("Trunk", (0.1, 0.1, 0.0)), "T2": ("Trunk", (-0.1, 0.12, 0.1)),
    "T3": ("Trunk", (0.0, -0.1, 0.2)), "T4": ("Trunk", (0.12, 0.0, 0.3)),
    "U1": ("Upper", (0.04, 0.03, -0.10)), "U2": ("Upper", (-0.05, 0.04, -0.20)),
    "U3": ("Upper", (0.01, -0.06, -0.25)),
    "F1": ("Fore", (0.05, 0.0, -0.10)), "F2": ("Fore", (-0.04, 0.03, -0.20)),
    "F3": ("Fore", (0.0, -0.05, -0.15)),
    "H1": ("Hand", (0.03, 0.02, -0.10)), "H2": ("Hand", (-0.03, 0.03, -0.08)),
}  # fmt: skip
BALL = ((-40, 50), (-60, 40), (-40, 40))
HINGE = ((0, 0), (-70, 50), (0, 0))
ALL = tuple(ARM_MARKERS)
TWO = tuple(name for name in ALL if name != "U3")
ONE = tuple(name for name in ALL if name not in ("U2", "U3"))
TWO_ARMS = Figure(
    (
        Segment("Trunk", offset=(0.0, 0.0, 1.0)),
        Segment("Left", "Trunk", "LeftJoint", (0.0, 0.2, 0.4), end=(0.0, 0.0, -0.3)),
        Segment("Right", "Trunk", "RightJoint", (0.0, -0.2, 0.4), end=(0.0, 0.0, -0.3)),
    )
)
TWO_ARMS_MARKERS = {
    "T1": ("Trunk", (0.1, 0.1, 0.0)), "T2": ("Trunk", (-0.1, 0.12, 0.1)),
    "T3": ("Trunk", (0.0, -0.1, 0.2)), "T4": ("Trunk", (0.12, 0.0, 0.3)),
    "L1": ("Left", (0.04, 0.03, -0.10)), "L2": ("Left", (-0.05, 0.04, -0.20)),
    "L3": ("Left", (0.01, -0.06, -0.25)),
    "R1": ("Right", (0.04, 0.03, -0.10)), "R2": ("Right", (-0.05, 0.04, -0.20)),
    "R3": ("Right", (0.01, -0.06, -0.25)),
}  # fmt: skip


def association(figure, markers, folder):
    """The association of a figure, of files that are written to a folder."""
    segments = []
    for segment in figure.segments:
        own = [name for name, (on, _) in markers.items() if on == segment.name]
        parent = f'parent = "{segment.parent}"\njoint = "{segment.joint}"' if segment.parent else ""
        segments.append(f'[[segment]]\nname = "{segment.name}"\n{parent}\nmarkers = {own}\n')
    (folder / "arm.toml").write_text("\n".join(segments))
    lines = [f"{name} {name}" for name in markers]
    (folder / "arm.txt").write_text("\n".join(["@skeleton arm.toml", *lines]))
    return read_association(folder / "arm.txt")


@cache
def arm_recording(labels, shoulder=BALL, sigma=0.0, seed=3):
    """The arm with some of its markers, 400 frames; the elbow and wrist are ball joints."""
    ranges = {"Trunk": ((-20, 20),) * 3, "Upper": shoulder, "Fore": BALL, "Hand": BALL}
    motion = circumduct(ranges, 8, 50, seed=seed)
    markers = {name: ARM_MARKERS[name] for name in labels}
    return record(ARM, markers, motion, Faults(sigma=sigma), seed=seed)


def two_arms_moving(right, sigma=0.0, left=BALL):
    """150 frames: the left arm moves like a shoulder, the right one as it is told."""
    ranges = {"Trunk": ((-20, 20),) * 3, "Left": left, "Right": right}
    motion = circumduct(ranges, 6, 25, seed=3)
    return record(TWO_ARMS, TWO_ARMS_MARKERS, motion, Faults(sigma=sigma))

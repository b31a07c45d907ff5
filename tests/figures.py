"""Clips as moving figures, and where they are by the model: what the checks by other programs compare with."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from rigs import rig_of

from mocap_skel.errors import MocapSkelError
from mocap_skel.export.body import body, capsules
from mocap_skel.export.joint_names import joint_names
from mocap_skel.fit import fit_skeleton
from mocap_skel.labels.association import associate, read_association
from mocap_skel.readers import read_clip
from mocap_skel.results.axes import turned
from mocap_skel.rig.kinematics import Rig, forward, rest_places

SAMPLES = Path(__file__).parent.parent / "sample_data"
CLIPS = [f"{SAMPLES}/{name}.c3d:cmu" for name in ("range_of_motion", "two_dancers", "nearly_still")]
# Namings whose figure has the joints of the full rig.
FULL = ("unreal",)
FRAMES = 10
# Metres: no program may put a joint farther from where the model has it.
MOST = 1e-3


@dataclass(frozen=True, eq=False)
class Figure:
    """A clip's subject as a rig with y up, its joints called by one of the namings."""

    name: str
    naming: str
    rig: Rig
    rate: float

    @property
    def frames(self) -> np.ndarray:
        """Ten of them, the first and the last included."""
        return np.linspace(0, len(self.rig.position) - 1, FRAMES).astype(int)


def figures(calls: list[str], namings=("mocap",)) -> Iterator[Figure]:
    """Fit each CLIP.c3d[:ASSOCIATION]; one that cannot be a figure is named and left out."""
    for call in calls or CLIPS:
        path, _, association = call.partition(":")
        try:
            known = read_association(association or "cmu")
            clip = read_clip(Path(path))
            for subject in associate(clip, known):
                fit = turned(fit_skeleton(clip, subject, known.skeleton), "y")
                name = f"{Path(path).stem}{subject.subject and '-'}{subject.subject}"
                for naming in namings:
                    rig, segments, _ = rig_of(fit, rig="full" if naming in FULL else "markers")
                    called, _ = joint_names(segments, naming)
                    yield Figure(name, naming, replace(rig, names=called), fit.rate)
        except MocapSkelError as error:
            print(f"{call}: not compared: {error}")


def moving(rig: Rig) -> dict[str, np.ndarray]:
    """Name → (frames, 3), of the joints and, `_end` behind the joint's name, of the limbs' ends."""
    joints, ends = forward(rig)
    named = dict(zip(rig.names, joints, strict=True))
    return named | {f"{rig.names[i]}_end": track for i, track in ends.items()}


def resting(rig: Rig) -> dict[str, np.ndarray]:
    """Name → (3,), of the same points in the rest pose."""
    joints, ends = rest_places(rig)
    named = dict(zip(rig.names, joints, strict=True))
    return named | {f"{rig.names[i]}_end": place for i, place in ends.items()}


def corners(rig: Rig, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Indices (n) of corners all over the body, and where they are at some frames, (frames, n, 3)."""
    shape = body(capsules(rig))
    joints, _ = rest_places(rig)
    chosen = np.linspace(0, len(shape.points) - 1, 60).astype(int)
    found = []
    for k in chosen:
        joint = int(shape.joints[k])
        # As the end of its joint, so that the model's own kinematics move it.
        held = replace(rig, ends={joint: shape.points[k] - joints[joint]})
        found.append(forward(held)[1][joint][frames])
    return chosen, np.stack(found, axis=1)

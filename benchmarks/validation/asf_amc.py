"""Acclaim's skeleton (ASF) and motion (AMC): joint tracks in metres along the axes of the C3D beside them.

One length unit is 25.4/0.45 mm where the file's `length` is 0.45; x, y, z of the C3D are z, x, y here. The
files are Latin-1.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
INCH = 0.0254
# The joint is at the end of the bone.
BONE_OF = {
    f"{side}{joint}": f"{side[0].lower()}{bone}"
    for side in ("Left", "Right")
    for joint, bone in (
        ("Hip", "hipjoint"), ("Knee", "femur"), ("Ankle", "tibia"),
        ("Shoulder", "clavicle"), ("Elbow", "humerus"), ("Wrist", "radius"),
    )
}  # fmt: skip
LENGTHS = {
    f"{side} {name}": f"{side[0].lower()}{bone}"
    for side in ("Left", "Right")
    for name, bone in (("thigh", "femur"), ("shank", "tibia"))
}


class AcclaimError(ValueError):
    """A file that is not what its name says."""


@dataclass
class Bone:
    """A bone: its end from its start, (3,) in the file's unit; its axes; the angles that it has."""

    offset: Array = field(default_factory=lambda: np.zeros(3))
    axis: Array = field(default_factory=lambda: np.eye(3))
    dof: list[str] = field(default_factory=list)


@dataclass
class Acclaim:
    """A skeleton: bones by name, parent of each, children after their parents, metres in a unit."""

    bones: dict[str, Bone]
    parents: dict[str, str]
    root_order: list[str]
    root: Bone
    metre: float
    degrees: bool

    def length(self, bone: str) -> float:
        """Metres."""
        return float(np.linalg.norm(self.bones[bone].offset)) * self.metre


def turns(angles: Array) -> Array:
    """(..., 3, 3): Rz Ry Rx of angles (..., 3) about x, y, z in radians."""
    c, s = np.cos(angles), np.sin(angles)
    (cx, cy, cz), (sx, sy, sz) = np.moveaxis(c, -1, 0), np.moveaxis(s, -1, 0)
    rows = [
        [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
        [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
        [-sy, cy * sx, cy * cx],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def read_asf(path: Path) -> Acclaim:
    """Read a skeleton.

    Raises:
        AcclaimError: sections or numbers are missing.
    """
    try:
        return _read_asf(path.read_text(encoding="latin-1"))
    except (KeyError, IndexError, ValueError) as error:
        raise AcclaimError(f"{path}: no ASF skeleton: {error}") from error


def _read_asf(text: str) -> Acclaim:
    sections: dict[str, list[list[str]]] = {}
    rows: list[list[str]] = []
    for line in text.splitlines():
        words = line.partition("#")[0].split()
        if not words:
            continue
        if words[0].startswith(":"):
            rows = sections.setdefault(words[0][1:].lower(), [])
        else:
            rows.append(words)
    units = {row[0].lower(): row[-1].lower() for row in sections["units"]}
    degrees = units.get("angle", "deg").startswith("deg")
    angle = np.pi / 180 if degrees else 1.0
    bones: dict[str, Bone] = {}
    direction, length, name = np.zeros(3), 0.0, ""
    here = Bone()
    for row in sections["bonedata"]:
        key = row[0].lower()
        if key == "begin":
            here, name, length, direction = Bone(), "", 0.0, np.zeros(3)
        elif key == "name":
            name = row[1]
        elif key == "direction":
            direction = np.array(row[1:4], dtype=float)
        elif key == "length":
            length = float(row[1])
        elif key == "axis":
            here.axis = turns(angle * np.array(row[1:4], dtype=float))
        elif key == "dof":
            here.dof = [word.lower() for word in row[1:]]
        elif key == "end":
            here.offset = direction * length
            bones[name] = here
    below: dict[str, list[str]] = {}
    for row in sections["hierarchy"]:
        if row[0] not in ("begin", "end"):
            below[row[0]] = row[1:]
    parents: dict[str, str] = {}
    waiting = ["root"]
    for parent in waiting:
        for child in below.get(parent, []):
            parents[child] = parent
            waiting.append(child)
    root, order = Bone(), ["tx", "ty", "tz", "rx", "ry", "rz"]
    for row in sections.get("root", []):
        key = row[0].lower()
        if key == "order":
            order = [word.lower() for word in row[1:]]
        elif key == "position":
            root.offset = np.array(row[1:4], dtype=float)
        elif key == "orientation":
            root.axis = turns(angle * np.array(row[1:4], dtype=float))
    return Acclaim(bones, parents, order, root, INCH / float(units["length"]), degrees)


def read_amc(path: Path) -> dict[str, Array]:
    """The numbers of each bone, (frames, n), as they stand.

    Raises:
        AcclaimError: no frames, or not all bones in all of them.
    """
    found: dict[str, list[list[str]]] = {}
    frames = 0
    with path.open(encoding="latin-1") as file:
        for line in file:
            words = line.split()
            if not words or words[0][0] in "#:":
                continue
            if len(words) == 1 and words[0].isdigit():
                frames += 1
            else:
                found.setdefault(words[0], []).append(words[1:])
    if not frames or "root" not in found or any(len(v) != frames for v in found.values()):
        raise AcclaimError(f"{path}: no AMC motion, or bones missing in some of its frames")
    try:
        return {name: np.array(rows, dtype=float) for name, rows in found.items()}
    except ValueError as error:
        raise AcclaimError(f"{path}: no AMC motion: {error}") from error


def joint_tracks(asf: Acclaim, motion: dict[str, Array]) -> dict[str, Array]:
    """(frames, 3) of every joint of `BONE_OF` that the skeleton has, metres, along the C3D's axes."""
    ends = _ends(asf, motion)
    return {
        joint: ends[bone][:, [2, 0, 1]] * asf.metre
        for joint, bone in BONE_OF.items()
        if bone in ends
    }


def _ends(asf: Acclaim, motion: dict[str, Array]) -> dict[str, Array]:
    root = motion["root"]
    place, angles = _channels(asf, asf.root_order, root)
    pose = {"root": asf.root.axis @ turns(angles) @ asf.root.axis.T}
    end = {"root": place + asf.root.offset}
    for name, parent in asf.parents.items():
        bone = asf.bones[name]
        turn = np.eye(3)
        if bone.dof and name in motion:
            turn = bone.axis @ turns(_channels(asf, bone.dof, motion[name])[1]) @ bone.axis.T
        pose[name] = pose[parent] @ turn
        end[name] = end[parent] + pose[name] @ bone.offset
    return end


def _channels(asf: Acclaim, order: list[str], numbers: Array) -> tuple[Array, Array]:
    """Shift and angles (radians) about x, y, z, each (frames, 3), of a bone's numbers."""
    shift, angles = np.zeros((len(numbers), 3)), np.zeros((len(numbers), 3))
    for k, name in enumerate(order):
        if name[0] in "tr" and name[1:] in ("x", "y", "z"):
            (shift if name[0] == "t" else angles)[:, "xyz".index(name[1])] = numbers[:, k]
    return shift, np.deg2rad(angles) if asf.degrees else angles


def beside(clip: Path) -> tuple[Path, Path] | None:
    """The skeleton and the motion that belong to a C3D of the same folder, if they are there.

    The motion's stem is the clip's, or begins or continues it where a word ends; the skeleton's begins
    the motion's, or it is the only one.
    """
    files = sorted(p for p in clip.parent.iterdir() if p.is_file())
    motions = [p for p in files if p.suffix.lower() == ".amc" and _same(p.stem, clip.stem)]
    skeletons = [p for p in files if p.suffix.lower() == ".asf"]
    if not motions or not skeletons:
        return None
    motion = min(motions, key=lambda p: abs(len(p.stem) - len(clip.stem)))
    fitting = [p for p in skeletons if _same(p.stem, motion.stem)]
    if not fitting and len(skeletons) > 1:
        return None
    return max(fitting or skeletons, key=lambda p: len(p.stem)), motion


def _same(one: str, other: str) -> bool:
    short, long = sorted((one.lower(), other.lower()), key=len)
    rest = long.removeprefix(short)
    return long.startswith(short) and not rest[:1].isalnum()

"""OpenSim's files read by their own rules, from the text alone: no line of the writer is used here."""

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from recordings import ASSOCIATIONS, SAMPLES, fit_sample, known, rendered
from scipy.spatial.transform import Rotation

from mocap_skel import associate, read_clip
from mocap_skel.clip import turn_between
from mocap_skel.export.registry import Source, choose
from mocap_skel.rig.animation import Choice, animate


@dataclass
class Motion:
    """A .mot: the text of its head, its names, (frames,) seconds, and (frames, names)."""

    head: dict[str, str]
    names: list[str]
    time: np.ndarray
    values: np.ndarray


def read_motion(text):
    head, _, table = text.partition("endheader\n")
    said = dict(line.split("=") for line in head.splitlines() if "=" in line)
    lines = table.splitlines()
    titles = lines[0].split("\t")
    assert titles[0] == "time"
    values = np.array([line.split("\t") for line in lines[1:]], dtype=float)
    return Motion(said, titles[1:], values[:, 0], values[:, 1:])


def vector(element, tag):
    return np.array(element.find(tag).text.split(), dtype=float)


class Model:
    """An .osim: its elements, and where its bodies are for values of its coordinates."""

    def __init__(self, text):
        self.root = ET.fromstring(text)
        self.model = self.root.find("Model")
        self.bodies = {body.get("name"): body for body in self._all("BodySet/objects/Body")}
        self.joints = {one.get("name"): one for one in self._all("JointSet/objects/CustomJoint")}
        self.markers = {one.get("name"): one for one in self._all("MarkerSet/objects/Marker")}

    def _all(self, path):
        return self.model.findall(path)

    def coordinates(self):
        """Their names, in the order of the file."""
        return [one.get("name") for one in self.model.iter("Coordinate")]

    def mass(self):
        return sum(float(body.find("mass").text) for body in self.bodies.values())

    def inertia(self, name):
        xx, yy, zz, xy, xz, yz = vector(self.bodies[name], "inertia")
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    def axes(self, joint):
        """The names of a joint's coordinates, the axes of its rotations, and the order of axes as letters."""
        turns = [
            axis
            for axis in self.joints[joint].findall("SpatialTransform/TransformAxis")
            if axis.get("name").startswith("rotation")
        ]
        names = [axis.find("coordinates").text for axis in turns]
        axes = np.array([vector(axis, "axis") for axis in turns])
        return names, axes, "".join("XYZ"[axis.argmax()] for axis in axes)

    def bodies_at(self, values):
        """Body → (turn, place) in the ground, of frames at once, by coordinates (radians, metres)."""
        frames = len(next(iter(values.values())))
        ground = (Rotation.from_quat(np.tile([0.0, 0, 0, 1], (frames, 1))), np.zeros((frames, 3)))
        found = {"/ground": ground}
        for joint in self.joints.values():
            offsets = {
                frame.get("name"): frame for frame in joint.findall("frames/PhysicalOffsetFrame")
            }
            above = offsets[joint.find("socket_parent_frame").text]
            below = offsets[joint.find("socket_child_frame").text]
            turn, place = moved(*found[above.find("socket_parent").text], *offset(above))
            # Rotations first, each about its axis as the others have left it; translations in the upper frame.
            shift, whole = np.zeros((frames, 3)), None
            for axis in joint.findall("SpatialTransform/TransformAxis"):
                how = axis.get("name")
                direction, value = vector(axis, "axis"), self._value(axis, values, frames)
                if how.startswith("rotation"):
                    step = Rotation.from_rotvec(value[:, None] * direction)
                    whole = step if whole is None else whole * step
                else:
                    shift = shift + value[:, None] * direction
            place = place + turn.apply(shift)
            turn = turn * whole
            # The lower frame is where the body has it: back from there to the body.
            own, away = offset(below)
            turn = turn * own.inv()
            found[below.find("socket_parent").text] = (turn, place - turn.apply(away))
        return {name.removeprefix("/bodyset/"): pose for name, pose in found.items()}

    @staticmethod
    def _value(axis, values, frames):
        name = axis.find("coordinates").text
        linear = axis.find("LinearFunction/coefficients")
        if linear is None:
            assert not name
            return np.full(frames, float(axis.find("Constant/value").text))
        slope, start = map(float, linear.text.split())
        return slope * values[name] + start

    def markers_at(self, bodies):
        """Marker → places (frames, 3)."""
        found = {}
        for name, marker in self.markers.items():
            turn, place = bodies[marker.find("socket_parent_frame").text.removeprefix("/bodyset/")]
            found[name] = place + turn.apply(vector(marker, "location"))
        return found


def offset(frame):
    return Rotation.from_euler("XYZ", vector(frame, "orientation")), vector(frame, "translation")


def moved(turn, place, by, away):
    return turn * by, place + turn.apply(away)


def radians(motion, names):
    """Coordinate → its values, radians and metres; a translation's name ends with _tx, _ty, _tz."""
    assert motion.head["inDegrees"] == "yes"
    return {
        name: column if name[-3:] in ("_tx", "_ty", "_tz") else np.radians(column)
        for name, column in zip(names, motion.values.T, strict=True)
    }


def written(fit, **told):
    """What the format makes of a fit that nobody says the labels of."""
    return rendered("osim", fit, None, Path("walk.c3d"), **told)


def sample(name, subject=None, **told):
    """What it makes of a bundled clip, as the command line does."""
    path, (chosen,) = SAMPLES / f"{name}.c3d", choose("osim", **told)
    clip = read_clip(path)
    named = associate(clip, known(ASSOCIATIONS[name]), subject)[0]
    return chosen.render(fit_sample(name, subject), Source(clip, path, named))


def rig_of(fit, full=False):
    """Segments, joints (n, frames, 3) and markers (name → (frames, 3)) of the rig itself, y up."""
    motion = animate(fit, Choice(smooth=0.0, even=False, full=full)).motion
    model, poses = motion.model, motion.poses
    joints = poses.joints(model.bones)
    turn = turn_between(fit.up, "y")
    markers = {
        marker: (np.einsum("ijf,j->fi", poses.turn[:, :, s], place) + joints[:, s].T) @ turn.T
        for s, names in enumerate(model.markers)
        for marker, place in zip(names, model.bones.places[s], strict=True)
    }
    return model, joints.transpose(1, 2, 0) @ turn.T, markers

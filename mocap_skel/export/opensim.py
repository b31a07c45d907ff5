"""A figure as an OpenSim 4 model, and its coordinates as a motion file.

Format: OpenSim 4, "OpenSim Models" and "Storage (.sto and .mot) Files" of its documentation; document version 40000 is
that of OpenSim 4.0, which later ones read.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from xml.etree import ElementTree as ET

import numpy as np

from mocap_skel.export.body_masses import Mass
from mocap_skel.export.coordinates import CustomJoint, Figure
from mocap_skel.export.euler import euler_angles
from mocap_skel.export.storage_text import storage_text
from mocap_skel.rig.kinematics import shortest_turn
from mocap_skel.segments.pose import Array

VERSION = "40000"
GRAVITY = (0.0, -9.80665, 0.0)
# A bone is drawn as an ellipsoid so many times as long as it is thick, but not thinner than that (metres).
SLENDER, THINNEST = 6.0, 0.005


def model_text(
    name: str, said: str, figure: Figure, masses: Sequence[Mass], start: Sequence[float]
) -> str:
    """An .osim: bodies, joints, coordinates, markers.

    Args:
        name: of the model.
        said: what it was made of, for its credits.
        figure: y up.
        masses: one a body.
        start: the coordinates' default values, degrees and metres, in the order of `figure.values`: a pose of the
            clip, so that inverse kinematics starts near.
    """
    document = ET.Element("OpenSimDocument", Version=VERSION)
    model = ET.SubElement(document, "Model", name=name)
    _add(model, "credits", said)
    _add(model, "length_units", "meters")
    _add(model, "force_units", "N")
    _add(model, "gravity", _numbers(GRAVITY))
    ET.SubElement(model, "Ground", name="ground")
    bodies = _set(model, "BodySet", "bodyset")
    for title, mass in zip(figure.bodies, masses, strict=True):
        _add_body(bodies, title, mass)
    joints, values = _set(model, "JointSet", "jointset"), iter(start)
    for title, joint in zip(figure.bodies, figure.joints, strict=True):
        _add_joint(joints, title, joint, figure, values)
    markers = _set(model, "MarkerSet", "markerset")
    for title, body, place in figure.markers:
        marker = ET.SubElement(markers, "Marker", name=title)
        _add(marker, "socket_parent_frame", f"/bodyset/{figure.bodies[body]}")
        _add(marker, "location", _numbers(place))
        _add(marker, "fixed", "true")
    ET.indent(document, "\t")
    text = ET.tostring(document, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def motion_text(name: str, titles: Sequence[str], values: Array, time: Array) -> str:
    """A .mot: coordinates over time, degrees and metres.

    Args:
        name: of the motion.
        titles: of the coordinates.
        values: (frames, coordinates).
        time: (frames,), seconds.
    """
    said = ["Units are S.I. units (second, meters, Newtons, ...)"]
    return storage_text(name, titles, values, time, said=said)


def _add(above: ET.Element, tag: str, text: str) -> None:
    ET.SubElement(above, tag).text = text


def _set(model: ET.Element, tag: str, name: str) -> ET.Element:
    return ET.SubElement(ET.SubElement(model, tag, name=name), "objects")


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{value + 0.0:.12g}" for value in np.round(np.asarray(list(values)), 12))


def _add_body(bodies: ET.Element, name: str, mass: Mass) -> None:
    body = ET.SubElement(bodies, "Body", name=name)
    shape = ET.SubElement(ET.SubElement(body, "components"), "PhysicalOffsetFrame", name="bone")
    along = mass.bone[1] - mass.bone[0]
    length = float(np.linalg.norm(along))
    thick = max(length / SLENDER, THINNEST)
    drawn = ET.SubElement(ET.SubElement(shape, "attached_geometry"), "Ellipsoid", name="shape")
    _add(drawn, "socket_frame", "..")
    _add(drawn, "radii", _numbers([thick / 2.0, max(length, thick) / 2.0, thick / 2.0]))
    upright = np.array([0.0, 1.0, 0.0])
    turn = shortest_turn(upright, along) if length > 0 else np.eye(3)
    _place(shape, "..", mass.bone.mean(axis=0), turn)
    _add(body, "mass", _numbers([mass.mass]))
    _add(body, "mass_center", _numbers(mass.centre))
    # More digits than a length needs: the inertia of a small body is a small number.
    i = mass.inertia
    moments = (i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2])
    _add(body, "inertia", " ".join(f"{moment:.12g}" for moment in moments))


def _place(frame: ET.Element, parent: str, place: Array, turn: Array) -> None:
    _add(frame, "socket_parent", parent)
    _add(frame, "translation", _numbers(place))
    _add(frame, "orientation", _numbers(np.radians(euler_angles(turn[None], "XYZ")[0])))


def _add_joint(
    joints: ET.Element, body: str, custom: CustomJoint, figure: Figure, values: Iterable[float]
) -> None:
    free = custom.parent < 0
    joint = ET.SubElement(joints, "CustomJoint", name=custom.name)
    above, below = f"{custom.name}_above", f"{custom.name}_below"
    _add(joint, "socket_parent_frame", above)
    _add(joint, "socket_child_frame", below)
    coordinates = ET.SubElement(joint, "coordinates")
    for title, value in zip(custom.coordinates, values, strict=False):
        _add_coordinate(coordinates, title, float(np.radians(value)), np.pi)
    for title, value in zip(figure.places if free else (), values, strict=False):
        _add_coordinate(coordinates, title, value, 10.0)
    frames = ET.SubElement(joint, "frames")
    parent = "/ground" if free else f"/bodyset/{figure.bodies[custom.parent]}"
    for name, where, place, turn in (
        (above, parent, custom.place, custom.above),
        (below, f"/bodyset/{body}", np.zeros(3), custom.below),
    ):
        _place(ET.SubElement(frames, "PhysicalOffsetFrame", name=name), where, place, turn)
    transform = ET.SubElement(joint, "SpatialTransform")
    for i, (axis, title) in enumerate(zip(custom.order, custom.coordinates, strict=True), 1):
        _add_axis(transform, f"rotation{i}", "XYZ".index(axis), title)
    for i in range(3):
        _add_axis(transform, f"translation{i + 1}", i, figure.places[i] if free else "")


def _add_coordinate(coordinates: ET.Element, name: str, value: float, reach: float) -> None:
    coordinate = ET.SubElement(coordinates, "Coordinate", name=name)
    _add(coordinate, "default_value", _numbers([value]))
    # Nothing is clamped; the range is that of the sliders.
    _add(coordinate, "range", _numbers([min(-reach, value), max(reach, value)]))
    _add(coordinate, "clamped", "false")
    _add(coordinate, "locked", "false")


def _add_axis(transform: ET.Element, name: str, axis: int, coordinate: str) -> None:
    found = ET.SubElement(transform, "TransformAxis", name=name)
    _add(found, "coordinates", coordinate)
    _add(found, "axis", _numbers(np.eye(3)[axis]))
    if coordinate:
        function = ET.SubElement(found, "LinearFunction", name="function")
        _add(function, "coefficients", "1 0")
    else:
        _add(ET.SubElement(found, "Constant", name="function"), "value", "0")

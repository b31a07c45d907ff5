"""Measures of the person in a C3D file: the group PROCESSING, which Vicon's programs write."""

from __future__ import annotations

import re

from mocap_skel.measures import MEASURES, possible
from mocap_skel.readers.formats.c3d.contents import Groups, number
from mocap_skel.text import listed

# Vicon writes them in millimetres, whatever the unit of the points.
MILLIMETRE = 1e-3
_OWN = {
    "KNEEWIDTH": "knee_width", "ANKLEWIDTH": "ankle_width", "ELBOWWIDTH": "elbow_width",
    "WRISTWIDTH": "wrist_width", "LEGLENGTH": "leg_length",
    "INTERASISDISTANCE": "inter_asis", "MARKERDIAMETER": "marker_diameter", "HEIGHT": "height",
}  # fmt: skip
_SIDE = {"L": "left_", "R": "right_"}


def person(parameters: Groups) -> tuple[dict[str, float], tuple[str, ...]]:
    """The measures that a file has, full name → metres, and a note on those that cannot be.

    Zeros stand for what nobody has measured.
    """
    found: dict[str, float] = {}
    odd = []
    for key, value in parameters.get("PROCESSING", {}).items():
        name, said = _name(key), number(value)
        if name is None or said == 0.0:
            continue
        if possible(name, said * MILLIMETRE):
            found[name] = said * MILLIMETRE
        else:
            odd.append(f"{name} {said:g} mm")
    note = f"measures in the file that no person has, not used: {listed(odd)}"
    return found, (note,) if odd else ()


def _name(key: str) -> str | None:
    """A measure's full name, None for what is none: "LKneeWidth", "Marker Diameter"."""
    word = re.sub(r"[^A-Z0-9]", "", key.upper())
    side = _SIDE.get(word[:1], "")
    for name in (_OWN.get(word), side + _OWN.get(word[1:], "") if side else None):
        if name in MEASURES:
            return name
    return None

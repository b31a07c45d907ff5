"""Marker sets as data: label -> (segment, position on the skin in the segment's axes, metres)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mocap_skel.artificial.figure import STATURE, Vector, mirrored, scaled

MarkerSet = Mapping[str, tuple[str, Vector]]
"""Any set: marker label -> (segment, position in the segment's axes, metres)."""

_UPPER = (
    "LSHO", "LUPA", "LELB", "LFRM", "LWRA", "LWRB", "LFIN",
    "RSHO", "RUPA", "RELB", "RFRM", "RWRA", "RWRB", "RFIN",
)  # fmt: skip

LABELS: dict[str, tuple[str, ...]] = {
    "cmu": (
        "LFHD", "RFHD", "LBHD", "RBHD", "C7", "T10", "CLAV", "STRN", "RBAC", *_UPPER,
        "LFWT", "RFWT", "LBWT", "RBWT",
        "LTHI", "LKNE", "LSHN", "LANK", "LHEE", "LTOE", "LMT5",
        "RTHI", "RKNE", "RSHN", "RANK", "RHEE", "RTOE", "RMT5",
    ),
    "plug_in_gait": (
        "LFHD", "RFHD", "LBHD", "RBHD", "C7", "T10", "CLAV", "STRN", "RBAK", *_UPPER,
        "LASI", "RASI", "LPSI", "RPSI",
        "LTHI", "LKNE", "LTIB", "LANK", "LHEE", "LTOE",
        "RTHI", "RKNE", "RTIB", "RANK", "RHEE", "RTOE",
    ),
}  # fmt: skip
"""The sets that `marker_set` knows, with their labels in the order of the vendors' files."""

_SINGLE: dict[str, tuple[str, Vector]] = {
    "C7": ("Chest", (-0.070, 0.0, 0.435)),
    "T10": ("Chest", (-0.105, 0.0, 0.180)),
    "CLAV": ("Chest", (0.075, 0.0, 0.355)),
    "STRN": ("Chest", (0.115, 0.0, 0.195)),
    "RBAC": ("Chest", (-0.110, -0.085, 0.275)),
    "RBAK": ("Chest", (-0.110, -0.085, 0.275)),
}

# Bony landmarks lie where palpation finds them on a subject of STATURE: epicondyles and malleoli
# at the height of their joint and half the joint's width (plus the marker's radius) to the side.
_LEFT: dict[str, tuple[str, Vector]] = {
    "FHD": ("Head", (0.115, 0.070, 0.150)),
    "BHD": ("Head", (-0.070, 0.065, 0.155)),
    "SHO": ("Chest", (-0.005, 0.178, 0.423)),
    "UPA": ("UpperLeftArm", (0.005, 0.052, -0.165)),
    "ELB": ("UpperLeftArm", (-0.008, 0.043, -0.322)),
    "MEP": ("UpperLeftArm", (0.008, -0.041, -0.329)),
    "FRM": ("LowerLeftArm", (0.005, 0.042, -0.120)),
    "WRA": ("LowerLeftArm", (0.037, 0.010, -0.247)),
    "WRB": ("LowerLeftArm", (-0.036, 0.012, -0.245)),
    "FIN": ("LeftHand", (0.012, 0.023, -0.090)),
    "FWT": ("Hips", (0.075, 0.130, 0.095)),
    "BWT": ("Hips", (-0.110, 0.062, 0.105)),
    "ASI": ("Hips", (0.072, 0.122, 0.086)),
    "PSI": ("Hips", (-0.110, 0.045, 0.092)),
    "GTR": ("UpperLeftLeg", (-0.010, 0.075, 0.010)),
    "THI": ("UpperLeftLeg", (0.010, 0.092, -0.200)),
    "KNE": ("UpperLeftLeg", (0.002, 0.053, -0.424)),
    "KNM": ("UpperLeftLeg", (-0.002, -0.051, -0.434)),
    "SHN": ("LowerLeftLeg", (0.042, 0.034, -0.185)),
    "TIB": ("LowerLeftLeg", (0.005, 0.058, -0.200)),
    "ANK": ("LowerLeftLeg", (-0.006, 0.040, -0.426)),
    "MED": ("LowerLeftLeg", (0.008, -0.038, -0.434)),
    "HEE": ("LeftFoot", (-0.068, 0.004, -0.030)),
    "TOE": ("LeftFoot", (0.122, 0.006, -0.036)),
    "MT5": ("LeftFoot", (0.090, 0.050, -0.045)),
}

# Technicians put these at different heights on the two sides, to tell the sides apart.
_RIGHT_LOWER = {"UPA": 0.035, "FRM": 0.015, "THI": 0.040, "SHN": 0.030, "TIB": 0.045}


def place_of(label: str) -> tuple[str, Vector] | None:
    """Segment and place of a human marker on a subject of STATURE, metres; None if it is in no set."""
    known = label in _SINGLE or (label[:1] in ("L", "R") and label[1:] in _LEFT)
    return _site(label) if known else None


def _site(label: str) -> tuple[str, Vector]:
    if label in _SINGLE:
        return _SINGLE[label]
    side, name = label[0], label[1:]
    segment, point = _LEFT[name]
    if side == "L":
        return segment, point
    x, y, z = mirrored(point)
    return segment.replace("Left", "Right"), (x, y, z - _RIGHT_LOWER.get(name, 0.0))


def marker_set(name: str, stature: float = STATURE) -> dict[str, tuple[str, Vector]]:
    """The markers of a set on the standard human: label -> (segment, position in the segment's axes).

    Args:
        name: "cmu" or "plug_in_gait".
        stature: of the human, metres.

    Raises:
        ValueError: a set that is not in `LABELS`.

    Example:
        >>> from mocap_skel.artificial import marker_set
        >>> markers = marker_set("cmu")
        >>> len(markers), markers["LKNE"]
        (41, ('UpperLeftLeg', (0.002, 0.053, -0.424)))
    """
    if name not in LABELS:
        raise ValueError(f"no marker set {name!r}; there are {', '.join(LABELS)}")
    sites = {label: _site(label) for label in LABELS[name]}
    k = stature / STATURE
    return {label: (segment, scaled(point, k)) for label, (segment, point) in sites.items()}


def misplaced(markers: MarkerSet, most: float, seed: int = 0) -> dict[str, tuple[str, Vector]]:
    """The markers as a hurried technician sticks them: each at random within a length of its place.

    Args:
        markers: where they belong.
        most: the largest distance from there, metres.
        seed: of what is drawn.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial import marker_set, misplaced
        >>> right = marker_set("cmu")
        >>> placed = misplaced(right, 0.01)
        >>> print(0 < np.linalg.norm(np.subtract(placed["C7"][1], right["C7"][1])) <= 0.01)
        True
    """
    rng = np.random.default_rng(seed)
    way = rng.standard_normal((len(markers), 3))
    way *= most * rng.random((len(markers), 1)) ** (1 / 3) / np.linalg.norm(way, axis=1)[:, None]
    return {
        label: (segment, (point[0] + dx, point[1] + dy, point[2] + dz))
        for (label, (segment, point)), (dx, dy, dz) in zip(
            markers.items(), way.tolist(), strict=True
        )
    }

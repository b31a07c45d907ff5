"""Optical motion-capture clips with known truth: for tests, studies and your own experiments.

Here belongs what makes such a clip. It may import `figure` and the ground.

Example:
    >>> from mocap_skel.artificial import Faults, human, marker_set, range_of_motion, record
    >>> faults = Faults(sigma=0.001, slide=0.005, dropout=0.1)
    >>> clip = record(human(), marker_set("cmu"), range_of_motion(20, 100), faults, seed=1)
    >>> clip.points.shape, clip.truth["LeftKnee"].shape
    ((2000, 41, 3), (2000, 3))

`write_c3d` and `write_truth` put it on disk, as does ``python -m mocap_skel.artificial``. Any skeleton
file becomes a figure by `figure_of`, `markers_of` and `ranges_of`; any other figure is a `Figure` of
`Segment`s with a dict of markers, moved by `circumduct` or a `Motion`.
"""

from mocap_skel.artificial.faults import Faults, Swap
from mocap_skel.artificial.figure import STATURE, Figure, Motion, Pose, Segment, Vector, human
from mocap_skel.artificial.markers import LABELS, MarkerSet, marker_set, misplaced
from mocap_skel.artificial.motion import (
    ROM_DEGREES,
    Limits,
    circumduct,
    dance,
    range_of_motion,
    still,
    walk,
)
from mocap_skel.artificial.others import figure_of, markers_of, ranges_of
from mocap_skel.artificial.recording import Recording, merge, record
from mocap_skel.artificial.rotations import from_vector, swing_twist, to_vector
from mocap_skel.artificial.write import UNITS, write_c3d, write_truth

__all__ = [
    "LABELS",
    "ROM_DEGREES",
    "STATURE",
    "UNITS",
    "Faults",
    "Figure",
    "Limits",
    "MarkerSet",
    "Motion",
    "Pose",
    "Recording",
    "Segment",
    "Swap",
    "Vector",
    "circumduct",
    "dance",
    "figure_of",
    "from_vector",
    "human",
    "marker_set",
    "markers_of",
    "merge",
    "misplaced",
    "range_of_motion",
    "ranges_of",
    "record",
    "still",
    "swing_twist",
    "to_vector",
    "walk",
    "write_c3d",
    "write_truth",
]

"""BVH files of fits: written as `fit --format bvh` does, and their numbers."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
from recordings import fit_recording, rendered

from mocap_skel.artificial import Faults, human, marker_set, range_of_motion, record

CM = 100.0
# The file holds centimetres and degrees with six decimals: half of 1e-8 m and of 1e-6 degrees = 9e-9 rad each.
# Three angles a joint and six joints in a row make 1.6e-7 rad, and 1 m of chain 2e-7 m.
ANGLE, LENGTH = 1.6e-7, 3e-7
BUNDLED = [("range_of_motion", None), ("two_dancers", "Anna")]


def write(fit, **told):
    """As `fit --format bvh`, but no filter and bones as fitted, unless that is told."""
    return rendered("bvh", fit, **{"smooth": 0.0, "asymmetric": True, **told})


def text_of(fit, **told):
    return write(fit, **told).files[".bvh"]


def motion_of(text):
    """The motion's numbers, (frames, channels)."""
    return np.array([line.split() for line in text.splitlines() if re.match(r"-?\d", line)], float)


def joint_names_of(text):
    return re.findall(r"(?:ROOT|JOINT) (.*)", text)


def end_sites_of(text):
    return np.array(re.findall(r"End Site\s*\{\s*OFFSET (\S+) (\S+) (\S+)", text), float)


@cache
def recording():
    """Five seconds of a figure, whose first frame is number 101."""
    motion = range_of_motion(5, 60, seed=2)
    faults = Faults(sigma=0.0005)
    return record(human(), marker_set("cmu"), motion, faults, seed=2, first_frame=101)


def on(*segments):
    """The labels on these segments."""
    return [label for label, (where, _) in marker_set("cmu").items() if where in segments]


def without(labels, frames, clip=None):
    """The recording, or another, with some markers missing in some of its 300 frames."""
    clip = clip or recording()
    points = clip.points.copy()
    for label in labels:
        points[frames, clip.labels.index(label)] = np.nan
    return replace(clip, points=points)


@cache
def whole():
    return fit_recording(recording())


def fit_without(labels, frames):
    return fit_recording(without(labels, frames))

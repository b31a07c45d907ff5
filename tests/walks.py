"""Generated walks with known contacts, read and fitted."""

from functools import cache

import numpy as np
from recordings import clip_of, fit_recording

from mocap_skel.artificial import Faults, Motion, human, marker_set, record
from mocap_skel.artificial.gait import gait
from mocap_skel.artificial.rotations import from_vector


def recording_of(motion, markers="cmu", faults=None):
    return record(human(), marker_set(markers), motion, faults or Faults(sigma=0.001))


def turned(motion, degrees):
    """The motion with its heading turned."""
    turn = from_vector(np.deg2rad([[0.0, 0.0, degrees]]))[0]
    rotations = {**motion.rotations, "Hips": turn @ motion.rotations["Hips"]}
    return Motion(motion.rate, motion.shift @ turn.T, rotations)


@cache
def walked(seconds=6, rate=100, treadmill=False, heading=0.0, markers="cmu"):
    """(the walk, its clip, its fit)."""
    walk = gait(seconds, rate, treadmill=treadmill)
    recording = recording_of(turned(walk.motion, heading), markers)
    return walk, clip_of(recording), fit_recording(recording, markers)

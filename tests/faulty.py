"""Artificial clips with faults: outliers, swaps, gaps, skin that slides."""

from mocap_skel.artificial import Faults, dance, human, marker_set, range_of_motion, record, walk

FIRST = 101
MOTIONS = {"rom": range_of_motion, "dance": dance, "walk": walk}


def faulty(seed=0, markers="cmu", motion="rom", seconds=20, rate=60, **faults):
    """A recording of a person, by default 1,200 frames of every joint's whole range with noise of 1 mm."""
    faults = Faults(**{"sigma": 0.001, **faults})
    moved = MOTIONS[motion](seconds, rate, seed=seed)
    return record(human(), marker_set(markers), moved, faults, seed=seed, first_frame=FIRST)

"""A leg whose knee is known, for tests of priors along a hinge."""

import numpy as np

from mocap_skel.figure.prior_tables import Shift

KNEE = Shift(hinge=1, by=0.054, toward=("ANK",), beside=0.043)


def limb(bend, shift=KNEE, upper=0.43, lower=0.42, beside=None):
    """A right leg that hangs, x to the front, y to the left: marker outside the knee, a place far down.

    Returns the way from the hip to the marker, from there to the place (..., 3), and the true way inward.
    """
    inwards = np.array([0.0, 1.0, 0.0])
    bend = np.asarray(bend, dtype=float)
    shank = np.stack([-np.sin(bend), np.zeros_like(bend), -np.cos(bend)], axis=-1)
    marker = np.array([0.0, 0.0, -upper]) - shift.by * inwards
    place = (
        np.array([0.0, 0.0, -upper])
        + lower * shank
        - (shift.beside if beside is None else beside) * inwards
    )
    return marker, place - marker, inwards

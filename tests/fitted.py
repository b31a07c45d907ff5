"""What tests of whole fits share: recordings of every joint's whole range, their fits, and when two are the same.

`ROUNDING`: a coordinate 10 m from the origin is off by eps × 10 m; a sphere fit multiplies that by
r²/λ_min of the points (400 for a cap of 35 degrees, the narrowest joint here), the parent's frame by
the reach of the child over the width of the parent's markers (6 for the thigh).
"""

from dataclasses import replace
from functools import cache

import numpy as np
from recordings import constant_error, fit_recording

from mocap_skel.artificial import Faults, human, marker_set, range_of_motion, record

EPS = np.finfo(float).eps
ROUNDING = EPS * 10 * 400 * 6
NOISE, GAPS, SHORT = (
    Faults(sigma=0.001),
    Faults(sigma=0.001, dropout=0.2, burst=10),
    Faults(sigma=0.001, dropout=0.1),
)
JOINTS = [
    "Waist", "Neck", "RightShoulder", "RightElbow", "RightWrist", "LeftShoulder", "LeftElbow",
    "LeftWrist", "RightHip", "RightKnee", "RightAnkle", "LeftHip", "LeftKnee", "LeftAnkle",
]  # fmt: skip
ENDS = ["Head", "RightHand", "LeftHand", "RightFoot", "LeftFoot"]


@cache
def full_range(faults=NOISE, seed=0):
    """The clip that the project's promise is made for: 1,400 frames at 60 Hz, every joint's whole range."""
    motion = range_of_motion(1400 / 60, 60, seed=seed)
    return record(human(), marker_set("cmu"), motion, faults, seed=seed)


@cache
def full_range_fit(faults=NOISE, seed=0, **options):
    return fit_recording(full_range(faults, seed), **options)


@cache
def short(faults=SHORT, seed=1):
    """The same in 300 frames, for laws."""
    motion = range_of_motion(10, 30, seed=seed)
    return record(human(), marker_set("cmu"), motion, faults, seed=seed, first_frame=51)


@cache
def short_fit():
    return fit_recording(short())


def columns(recording, *labels):
    return [recording.labels.index(label) for label in labels]


def without_markers(recording, *labels, frames=slice(None)):
    """The recording with markers missing, in all frames or in some."""
    points = recording.points.copy()
    for at in columns(recording, *labels):
        points[frames, at] = np.nan
    return replace(recording, points=points)


def joints(fit):
    return {joint.joint: joint for joint in fit.joints}


def seen(track):
    """(frames,): where a track is known."""
    return np.isfinite(track).all(axis=1)


def lengths(fit, recording, *names):
    """Errors of the joints' constants, metres; of all joints, or of those whose name ends like that."""
    return np.array(
        [
            np.linalg.norm(constant_error(fit, recording, joint))
            for joint in fit.joints
            if joint.joint.endswith(names or "")
        ]
    )


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def assert_same_fit(fit, other):
    """Not one bit of difference."""
    for a, b in zip(fit.joints, other.joints, strict=True):
        # The evidence holds what the rest is made of, in arrays of arrays.
        for name in vars(a).keys() - {"evidence", "turns_on"}:
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=a.joint)
        assert (a.turns_on is None) == (b.turns_on is None)
        for name in ("direction", "covariance") if a.turns_on else ():
            np.testing.assert_array_equal(getattr(a.turns_on, name), getattr(b.turns_on, name))
    for (name, a), (_, b) in zip(fit.tracks(), other.tracks(), strict=True):
        np.testing.assert_array_equal(a, b, err_msg=name)
    assert fit.sigma == other.sigma


def assert_same_evidence(fit, other, tolerance=ROUNDING, counts=True):
    """The same constants and the same evidence for them; lengths to a tolerance in metres."""
    for a, b in zip(fit.joints, other.joints, strict=True):
        assert (a.joint, a.samples, a.shown, a.method) == (
            b.joint, b.samples, b.shown, b.method,
        )  # fmt: skip
        for name in ("centre", "radius", "residual", "sigma", "weakest_sd"):
            np.testing.assert_allclose(
                getattr(a, name), getattr(b, name), rtol=0, atol=tolerance, err_msg=a.joint
            )
        if counts:
            # The errors' spread is a millimetre, and it is by this that their autocorrelation and
            # the standard error change in proportion.
            share = 1e3 * tolerance
            np.testing.assert_allclose(a.effective, b.effective, rtol=10 * share)
            np.testing.assert_allclose(a.standard_error, b.standard_error, rtol=10 * share)

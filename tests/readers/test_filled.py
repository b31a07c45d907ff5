"""Samples that rest or are smooth, off the markers of their segment, are missing; those of feet that stand are not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mocap_skel.artificial import Faults, human, marker_set, range_of_motion, record, still, walk
from mocap_skel.readers import read_clip
from mocap_skel.readers.filled import filled

CLIP = record(human(), marker_set("plug_in_gait"), walk(6, 100), Faults(sigma=0.001), seed=3)
SUBJECTS = [""] * len(CLIP.labels)


def found(points):
    """What is found in points in metres as a file of single precision has them."""
    out = filled(points.astype(np.float32).astype(np.float64), SUBJECTS, CLIP.rate)
    return np.zeros(points.shape[:2], dtype=bool) if out is None else out


def is_the_stretch(out, marker, start, length):
    want = np.zeros(out.shape, dtype=bool)
    want[start : start + length, marker] = True
    assert (out | ~want).all()
    # The samples between which it was filled may go too.
    assert (out & ~want).sum() <= 4


@settings(max_examples=30, deadline=None)
@given(
    st.integers(0, len(SUBJECTS) - 1),
    st.integers(10, 250),
    st.integers(180, 300),
    st.sampled_from([5e-5, 1e-4]),
)
def test_any_marker_that_is_nearly_held_is_missing_there(marker, start, length, noise):
    points = CLIP.points.copy()
    rng = np.random.default_rng(length)
    points[start : start + length, marker] = points[start - 1, marker] + noise * rng.normal(
        size=(length, 3)
    )
    is_the_stretch(found(points), marker, start, length)


def spline(points, marker, start, length):
    """Put a cubic between two samples, with the speed of the marker there."""
    y, stop = points[:, marker], start + length
    before, after = (y[start - 1] - y[start - 4]) / 3, (y[stop + 3] - y[stop]) / 3
    u, n = np.arange(1, length + 1)[:, None] / (length + 1), length + 1
    points[start:stop, marker] = (
        (2 * u**3 - 3 * u**2 + 1) * y[start - 1]
        + (u**3 - 2 * u**2 + u) * n * before
        + (3 * u**2 - 2 * u**3) * y[stop]
        + (u**3 - u**2) * n * after
    )


@pytest.mark.parametrize("label", ["LANK", "RKNE", "RWRA", "LTOE", "RTHI"])
def test_a_spline_that_leaves_its_segment_is_missing(label):
    points, marker = CLIP.points.copy(), CLIP.labels.index(label)
    spline(points, marker, 150, 300)
    is_the_stretch(found(points), marker, 150, 300)


def test_a_spline_in_its_place_stays():
    points, marker = CLIP.points.copy(), CLIP.labels.index("LFHD")
    mate = points[:, CLIP.labels.index("RFHD")]
    points[150:300, marker] = mate[150:300] + (points[149, marker] - mate[149])
    spline(points, marker, 310, 20)
    assert not found(points).any()


@pytest.mark.parametrize("motion", [still, range_of_motion, walk])
@pytest.mark.parametrize("sigma", [0.0, 0.0003, 0.003])
def test_nothing_is_found_where_nothing_was_filled(motion, sigma):
    clip = record(human(), marker_set("cmu"), motion(8, 120), Faults(sigma=sigma), seed=1)
    assert filled(clip.points, [""] * len(clip.labels), clip.rate) is None


@pytest.mark.real
def test_nothing_is_found_in_recordings(shared_clips):
    for folder in ("cmu", "functional_hip", "functional_knee", "pins", "plug_in_gait"):
        for path in sorted((shared_clips / folder).glob("*.c3d")):
            assert not [note for note in read_clip(path).notes if "filled sample" in note], path

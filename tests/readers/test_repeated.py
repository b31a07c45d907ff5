"""Samples that repeat their place while the body moves are missing; those of still markers are not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mocap_skel.artificial import Faults, human, marker_set, record, walk
from mocap_skel.readers.repeated import repeated

CLIP = record(human(), marker_set("plug_in_gait"), walk(4, 100), Faults(sigma=0.001), seed=3)
SUBJECTS = [""] * len(CLIP.labels)


def found(points):
    """What is found in points in metres as a file of millimetres has them."""
    out = repeated((1000 * points).astype(np.float32).astype(np.float64), SUBJECTS, CLIP.rate)
    return np.zeros(points.shape[:2], dtype=bool) if out is None else out


@settings(max_examples=60, deadline=None)
@given(st.integers(0, len(SUBJECTS) - 1), st.integers(3, 330), st.integers(30, 120))
def test_any_held_stretch_of_any_marker_is_missing_and_nothing_else(marker, start, length):
    points = CLIP.points.copy()
    points[start : start + length, marker] = points[start - 1, marker]
    out = found(points)
    want = np.zeros(out.shape, dtype=bool)
    want[start : start + length, marker] = True
    assert (out | ~want).all()
    # The place from which it was held may go too.
    assert (out & ~want).sum() <= 1


@pytest.mark.parametrize("value", [-0.001, 9.999, 0.5])
def test_a_constant_is_missing_in_short_gaps_too(value):
    points = CLIP.points.copy()
    points[100:160, 5] = points[300:302, 5] = points[200:201, 7] = value
    out = found(points)
    assert out[:, 5].sum() == 62 and out[:, 7].sum() == 1 and out.sum() == 63


def test_a_straight_line_across_a_long_gap_is_missing_and_its_ends_are_not():
    points = CLIP.points.copy()
    share = np.linspace(0, 1, 61)[:, None]
    points[100:161, 5] = (1 - share) * points[100, 5] + share * points[160, 5]
    out = found(points)
    assert np.flatnonzero(out.any(axis=0)).tolist() == [5]
    assert np.flatnonzero(out[:, 5]).tolist() == list(range(101, 160))


@pytest.mark.parametrize("grid", [1e-4, 1e-3, 5e-3])
def test_still_markers_in_a_file_of_coarse_numbers_keep_their_samples(grid):
    points = np.round(CLIP.clean / grid) * grid
    points[:, 3] = points[:, 11] = points[0, 3]
    points[200:, 11] += grid
    assert not found(points).any()


def test_a_clip_that_stands_still_as_a_whole_keeps_its_samples():
    points = CLIP.points.copy()
    points[150:250] = points[150]
    assert not found(points).any()

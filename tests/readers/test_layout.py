"""Where the points lie: what the file says, or what its bytes prove."""

from __future__ import annotations

import numpy as np
import pytest

from mocap_skel.readers.formats.c3d.layout import Layout, find, relative_step
from mocap_skel.readers.formats.c3d.section import Header, Section

START, POINTS, FRAMES = 1024, 4, 60
HEADER = Header(POINTS, 0, 1, FRAMES, -1.0, START // 512 + 1, 0, 100.0)
SECTION = Section(512, 1000, "INTEL", {"POINT": {"USED": [POINTS], "FRAMES": [FRAMES]}}, ())


def stepping(said, other):
    """Frames whose `relative_step` is `said` in the layout that the file says, `other` in every other."""

    def read(layout, first, count):
        step = said if (layout.points, layout.width, layout.analogs) == (POINTS, 4, 0) else other
        # Points 1, 2, 3 … along x: the median distance from their middle is known.
        x = np.arange(1.0, layout.points + 1)
        apart = np.sort(np.abs(x - x[len(x) // 2]))[len(x) // 2]
        data = np.zeros((count, layout.points, 4), np.float32)
        data[..., 0] = x + step * apart * np.arange(count)[:, None]
        return data

    return read


@pytest.mark.parametrize(
    ("said", "other", "proven"),
    [
        (0.3, 0.05, True),
        (0.3, 0.09, True),
        (0.3, 0.11, False),
        (0.9, 0.2, True),
        (3.0, 0.45, False),
    ],
)
def test_a_layout_that_nobody_says_needs_proof(said, other, proven):
    """It has to be a third as rough as what is said, and no rougher than tracks are."""
    size = START + FRAMES * 16 * POINTS + 5000
    layout, contradictions = find(size, HEADER, SECTION, 1, stepping(said, other))
    is_other = (layout.width, layout.analogs) != (4, 0)
    assert is_other == proven == bool(contradictions)
    assert (layout.points, layout.declared) == (POINTS, FRAMES)


@pytest.mark.parametrize(("said", "other", "points"), [(0.03, 0.02, 4), (0.06, 0.02, 5)])
def test_of_two_that_are_said_the_first_unless_the_other_is_twice_as_smooth(said, other, points):
    five = Section(512, 1000, "INTEL", {"POINT": {"USED": [5], "FRAMES": [FRAMES]}}, ())
    size = START + FRAMES * 16 * 5 + 5000
    layout, (contradiction,) = find(size, HEADER, five, 1, stepping(said, other))
    assert layout.points == points
    where, wrong = ("POINT:USED", 5) if points == 4 else ("the header", 4)
    assert contradiction == f"{where} says {wrong} points a frame, it is {points}"


def test_a_layout_that_fills_the_file_is_not_looked_into():
    size = START + FRAMES * 16 * POINTS + 256
    layout, contradictions = find(size, HEADER, SECTION, 1, stepping(3.0, 0.01))
    assert (layout.width, layout.analogs, contradictions) == (4, 0, ())
    assert (layout.room, layout.tail) == (FRAMES + 4, 256)


def test_frames_fill_a_file_but_for_the_padding_of_its_last_block():
    """By hand: 4 points of 4 values and 3 analog values, 4 bytes each, are 76 bytes a frame."""
    layout = Layout("INTEL", START, 4, 3, 4)
    assert layout.stride == 76
    whole = START + 10 * 76
    assert [layout.fills(whole + left, 10) for left in (0, 511, 512)] == [True, True, False]
    # The analog values of the last frame may lack.
    assert [layout.fills(whole - less, 10) for less in (12, 13)] == [True, False]
    assert [layout.fitted(whole - less).room for less in (0, 12, 13, 76)] == [10, 10, 9, 9]
    assert layout.fitted(START + 63).room == 0
    assert not layout.fills(START, 0)


def test_a_step_is_measured_against_the_distance_of_the_points():
    before = np.zeros((5, 3, 4))
    before[..., 0] = 10.0, 20.0, 40.0
    after = before.copy()
    after[..., 1] = 3.0
    # From the middle point, 20: 10, 0 and 20 away; the median is 10.
    assert relative_step(before, after) == pytest.approx(0.3, rel=1e-12)
    assert relative_step(1000 * before, 1000 * after) == pytest.approx(0.3, rel=1e-12)
    # Points with a residual below zero, at the origin, or beyond all measure are none.
    for hide in ((..., 2, 3, -1.0), (..., 2, slice(3), 0.0), (..., 2, 0, 1e8)):
        some = before.copy()
        some[hide[:-1]] = hide[-1]
        # Of 10 and 20 the middle is 20: 0 and 10 away.
        assert relative_step(some, after) == pytest.approx(0.3, rel=1e-12)
    assert relative_step(np.zeros((5, 3, 4)), after) == np.inf


def test_values_that_are_mostly_absurd_are_no_tracks():
    """Where a few points are seen and the rest is missing, that is a step; where the rest is absurd, it is none."""
    before = np.zeros((5, 10, 4))
    before[:, 0, 0] = 10.0, 20.0, 30.0, 40.0, 50.0
    after = before.copy()
    after[:, 0, 1] = 5.0
    # From the middle one, 30: 20, 10, 0, 10, 20; the median is 10.
    assert relative_step(before, after) == pytest.approx(0.5, rel=1e-12)
    before[:, 1:, 0] = after[:, 1:, 0] = 1e30
    assert relative_step(before, after) == np.inf

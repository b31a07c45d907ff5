"""The map of where markers have been: its circles, its cells, and which way it is turned."""

import re
from dataclasses import replace

import numpy as np
import pytest
from handmade import joint

from mocap_skel.report.coverage import CELL, COLOURS, RADIUS, _cells, coverage_map, flattened
from mocap_skel.results.series import Radial


def swing(degrees, across, count=200):
    """(count, 1, 3) directions of a marker that swings to both sides of x: in the plane of x and `across`."""
    angle = np.radians(np.linspace(-degrees, degrees, count))
    x = np.array([1.0, 0.0, 0.0])
    return (np.cos(angle)[:, None] * x + np.sin(angle)[:, None] * across)[:, None]


def test_the_dashed_circle_is_the_cap_of_the_equivalent_angle():
    # Lambert's map has radius 2 sin(θ/2) of 2: sin 30° for a cap of half-angle 60°, a half.
    hip = replace(joint("Hip"), angle=np.radians(60.0))
    drawn = coverage_map(Radial(hip, np.zeros((200, 1)), swing(40, np.array([0.0, 1.0, 0.0]))))
    assert f'<circle r="{RADIUS / 2:.1f}" class="cap"/>' in drawn
    nothing = replace(hip, angle=np.nan)
    assert "cap" not in coverage_map(Radial(nothing, np.zeros((1, 1)), swing(0, np.zeros(3), 1)))


def test_half_of_the_sphere_lies_within_the_inner_circle():
    # 90 degrees from the middle: 2 sin 45° of 2.
    flat = flattened(swing(90, np.array([0.0, 0.0, 1.0])))
    assert np.linalg.norm(flat[[0, -1], 0], axis=1) == pytest.approx(RADIUS / np.sqrt(2), rel=1e-6)


@pytest.mark.parametrize("across", [[0.0, 1.0, 0.0], [0.0, 0.6, 0.8], [0.0, 0.0, 1.0]])
def test_most_of_the_movement_runs_from_left_to_right(across):
    across = np.array(across)
    wide, low = swing(50, across), swing(10, np.cross([1.0, 0.0, 0.0], across))
    flat = flattened(np.concatenate([wide, low]))[:, 0]
    assert np.ptp(flat[:, 0]) > 4 * np.ptp(flat[:, 1]) > 0
    # 2 sin 25° of 2 to either side.
    assert np.abs(flat[:, 0]).max() == pytest.approx(RADIUS * np.sin(np.radians(25)), rel=1e-3)


def test_neighbouring_cells_of_a_row_are_one_bar_and_each_cell_is_covered_once():
    points = np.array(
        [[0.5, 0.5], [4.5, 1.0], [8.1, 3.9], [9.0, 2.0], [16.1, 0.1], [0.2, 4.2], [np.nan] * 2]
    )
    # In the first row of cells three side by side and one apart, in the next one alone.
    assert _cells(points) == (
        f"M0 0h{3 * CELL}v{CELL}h-{3 * CELL}z"
        f"M16 0h{CELL}v{CELL}h-{CELL}z"
        f"M0 4h{CELL}v{CELL}h-{CELL}z"
    )


def test_each_marker_has_a_colour_of_its_own():
    directions = np.concatenate([swing(20, np.array([0.0, 1.0, 0.0]))] * 9, axis=1)
    drawn = coverage_map(Radial(joint("Hip"), np.zeros((200, 9)), directions))
    assert re.findall(r'fill="(#\w+)"', drawn) == [*COLOURS, *COLOURS[:2]]

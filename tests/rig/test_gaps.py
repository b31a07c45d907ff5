"""Filling of gaps, against SciPy's slerp and against motion at constant speed."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mocap_skel.rig.gaps import fill_positions, fill_rotations, runs
from scipy.spatial.transform import Rotation, Slerp

LAWS = settings(derandomize=True, deadline=None, max_examples=40, database=None)


@LAWS
@given(st.lists(st.booleans(), max_size=30))
def test_runs_are_the_stretches_of_true(flags):
    found = runs(np.array(flags, dtype=bool))
    rebuilt = np.zeros(len(flags), dtype=bool)
    for start, stop in found:
        assert start < stop
        assert not rebuilt[max(start - 1, 0) : stop + 1].any()
        rebuilt[start:stop] = True
    assert rebuilt.tolist() == flags


def test_runs_of_nothing_and_of_everything():
    assert runs(np.zeros(0, dtype=bool)) == []
    assert runs(np.zeros(3, dtype=bool)) == []
    assert runs(np.ones(3, dtype=bool)) == [(0, 3)]
    assert runs(np.array([True, False, True, True])) == [(0, 1), (2, 4)]


@LAWS
@given(st.integers(0, 2**32 - 1), st.floats(0, np.pi))
def test_rotations_are_filled_as_by_slerp(seed, angle):
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    ends = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))
    first = Rotation.random(random_state=rng)
    keys = Rotation.concatenate([first, first * ends])
    count = int(rng.integers(1, 20))
    track = np.full((count + 2, 3, 3), np.nan)
    track[0], track[-1] = keys.as_matrix()
    filled = fill_rotations(track)
    np.testing.assert_array_equal(filled[[0, -1]], track[[0, -1]])
    times = np.arange(count + 2) / (count + 1)
    # An angle's cosine is known to eps; near half a turn and near none its angle to √eps, the
    # axis at half a turn likewise.
    tolerance = 4 * np.sqrt(np.finfo(float).eps)
    step = Rotation.from_matrix(filled[:-1].swapaxes(1, 2) @ filled[1:]).magnitude()
    np.testing.assert_allclose(step, angle / (count + 1), rtol=0, atol=tolerance)
    if angle < np.pi - 1e-3:
        expected = Slerp([0.0, 1.0], keys)(times).as_matrix()
        np.testing.assert_allclose(filled, expected, rtol=0, atol=tolerance)
    unit = filled.swapaxes(1, 2) @ filled
    np.testing.assert_allclose(unit, np.broadcast_to(np.eye(3), unit.shape), atol=1e-12)
    assert (np.linalg.det(filled) > 0).all()


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0, 0.8), (-0.6, 0.8, 0)])
def test_half_a_turn_goes_one_way_or_the_other_at_constant_speed(axis):
    track = np.full((5, 3, 3), np.nan)
    track[0] = np.eye(3)
    track[4] = 2 * np.outer(axis, axis) - np.eye(3)
    filled = Rotation.from_matrix(fill_rotations(track))
    for k in range(1, 4):
        vector = filled[k].as_rotvec()
        assert np.linalg.norm(vector) == pytest.approx(k * np.pi / 4, abs=1e-12)
        assert abs(np.dot(vector / np.linalg.norm(vector), axis)) == pytest.approx(1, abs=1e-12)


def test_no_turn_at_all_stays_where_it_is():
    track = np.full((4, 3, 3), np.nan)
    track[0] = track[3] = Rotation.from_rotvec([0.3, -0.2, 0.9]).as_matrix()
    np.testing.assert_allclose(fill_rotations(track), np.tile(track[0], (4, 1, 1)), atol=1e-15)


def test_several_gaps_are_each_filled_between_their_own_ends():
    turn = Rotation.from_rotvec(np.linspace(0, 2, 21)[:, None] * [0.0, 0.6, 0.8]).as_matrix()
    gappy = turn.copy()
    gappy[[3, 4, 10, 15, 16, 17]] = np.nan
    # At constant speed about one axis, filling is undoing.
    np.testing.assert_allclose(fill_rotations(gappy), turn, rtol=0, atol=1e-14)
    line = np.linspace(0, 1, 21)[:, None] * [1.0, -2.0, 3.0]
    holes = line.copy()
    holes[[3, 4, 10, 15, 16, 17]] = np.nan
    np.testing.assert_allclose(fill_positions(holes), line, rtol=0, atol=1e-14)


def test_what_is_complete_is_left_as_it_is():
    turn = Rotation.random(5, random_state=1).as_matrix()
    np.testing.assert_array_equal(fill_rotations(turn), turn)
    place = np.random.default_rng(1).normal(size=(5, 3))
    np.testing.assert_array_equal(fill_positions(place), place)

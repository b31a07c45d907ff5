"""Rigid bones: where they put their joints, by hand, and how they are turned onto others, by the least cost."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_skel.rig.kinematics import (
    FIRMNESS,
    Rig,
    follow,
    forward,
    rest_places,
    shortest_turn,
)

EXACT = {"rtol": 0, "atol": 1e-12}


def about(axis, degrees):
    return Rotation.from_rotvec(np.radians(degrees) * np.asarray(axis, float)).as_matrix()


def arm():
    """A root one metre up, an upper arm of 0.3 m along x, a forearm of 0.2 m with an end; one frame."""
    turns = [np.eye(3), about([0, 0, 1], 90), about([0, 0, 1], -90)]
    return Rig(
        ("root", "shoulder", "elbow"),
        (-1, 0, 1),
        np.array([[0, 1.0, 0], [0, 0.5, 0], [0.3, 0, 0]]),
        {2: np.array([0.2, 0, 0])},
        np.array([[5.0, 0, 0]]),
        np.stack(turns)[:, None],
    )


def test_joints_are_where_their_parents_turns_put_them():
    joints, ends = forward(arm())
    # The root's offset is its place at rest only; the upper arm points up, the forearm along x again.
    want = [[5, 0, 0], [5, 0.5, 0], [5, 0.8, 0]]
    np.testing.assert_allclose(joints[:, 0], want, **EXACT)
    np.testing.assert_allclose(ends[2][0], [5.2, 0.8, 0], **EXACT)


def test_at_rest_they_are_at_the_sum_of_their_offsets():
    joints, ends = rest_places(arm())
    np.testing.assert_allclose(joints, [[0, 1, 0], [0, 1.5, 0], [0.3, 1.5, 0]], **EXACT)
    np.testing.assert_allclose(ends[2], [0.5, 1.5, 0], **EXACT)


class TestShortestTurn:
    def test_a_right_angle_is_about_the_axis_that_is_square_to_both(self):
        x, y, z = np.eye(3)
        np.testing.assert_allclose(shortest_turn(x, 2 * y), about(z, 90), **EXACT)
        np.testing.assert_allclose(shortest_turn(np.stack([y, z]), np.stack([z, y])),
                                   [about(x, 90), about(x, -90)], **EXACT)  # fmt: skip

    def test_it_is_scipys_and_leaves_what_is_there(self):
        rng = np.random.default_rng(3)
        a, b = rng.normal(size=(2, 200, 3))
        turns = shortest_turn(a, b)
        unit = [v / np.linalg.norm(v, axis=1, keepdims=True) for v in (a, b)]
        np.testing.assert_allclose(np.einsum("nij,nj->ni", turns, unit[0]), unit[1], **EXACT)
        angle = np.arccos((unit[0] * unit[1]).sum(axis=1))
        np.testing.assert_allclose(Rotation.from_matrix(turns).magnitude(), angle, atol=1e-7)
        np.testing.assert_allclose(
            shortest_turn(a, 3 * a), np.tile(np.eye(3), (200, 1, 1)), **EXACT
        )

    def test_between_opposite_directions_there_is_none(self):
        np.testing.assert_array_equal(shortest_turn(np.eye(3)[0], -np.eye(3)[0]), np.eye(3))


class TestFollow:
    def test_one_point_is_followed_as_firmly_as_the_bone_is_short(self):
        """The bone points along t + (5 cm / L)² R₀ o: one of 5 cm halfway, without a twist."""
        start = about([0, 0, 1], 0)[None]
        offset = np.array([[0.05, 0, 0]])
        target = np.array([[[0, 0.05, 0]]])
        np.testing.assert_allclose(follow(start, offset, target)[0], about([0, 0, 1], 45), **EXACT)
        # One of 15 cm to the tangent of 9.
        long = follow(start, 3 * offset, 3 * target)[0]
        np.testing.assert_allclose(long, about([0, 0, 1], np.degrees(np.arctan(9))), **EXACT)

    def test_a_bone_without_length_keeps_its_turn(self):
        turn = about([0.6, 0, 0.8], 50)[None]
        np.testing.assert_array_equal(follow(turn, np.zeros((1, 3)), np.ones((1, 1, 3))), turn)

    def test_several_points_are_followed_at_the_least_cost(self):
        rng = np.random.default_rng(7)
        start = Rotation.random(5, random_state=1).as_matrix()
        offsets = 0.2 * rng.normal(size=(3, 3))
        targets = np.einsum("fij,kj->kfi", start, offsets) + 0.05 * rng.normal(size=(3, 5, 3))
        found = follow(start, offsets, targets)

        def cost(turn):
            away = targets - np.einsum("fij,kj->kfi", turn, offsets)
            own = ((turn - start) ** 2).sum(axis=(1, 2))
            return (away**2).sum(axis=(0, 2)) + FIRMNESS**2 * own

        least = cost(found)
        assert (least < cost(start)).all()
        for way in 1e-3 * np.vstack([np.eye(3), -np.eye(3)]):
            assert (cost(found @ Rotation.from_rotvec(way).as_matrix()) > least).all()

    @pytest.mark.parametrize("points", [1, 3])
    def test_what_is_there_already_is_left(self, points):
        start = Rotation.random(4, random_state=2).as_matrix()
        offsets = np.array([[0.1, 0.2, 0], [0, 0.3, 0.1], [0.2, 0, 0]])[:points]
        targets = np.einsum("fij,kj->kfi", start, offsets)
        np.testing.assert_allclose(follow(start, offsets, targets), start, **EXACT)

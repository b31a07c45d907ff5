"""Rigid bones: where they put their joints, by hand."""

import numpy as np
from scipy.spatial.transform import Rotation

from mocap_skel.rig.kinematics import (
    Rig,
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

"""Euler angles against SciPy's rotations: exact, and without jumps."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_skel.export.euler import ORDERS, euler_angles


@pytest.mark.parametrize("order", ORDERS)
def test_every_order_is_exactly_the_rotation(order):
    turn = Rotation.random(300, random_state=4).as_matrix()
    angles = euler_angles(turn, order)
    again = Rotation.from_euler(order, angles, degrees=True).as_matrix()
    np.testing.assert_allclose(again, turn, rtol=0, atol=1e-12)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("end", [360.0, -360.0])
def test_through_gimbal_lock_no_channel_steps_more_than_the_motion(order, end):
    """The middle angle goes full circle, twice through lock, the others slowly: 400 steps of at most
    0.9° that come back as they were, half a turn more in two of them included."""
    t = np.linspace(0, 1, 401)[:, None]
    given = np.hstack([20 * np.sin(6 * t), end * t, 30 * t])
    turn = Rotation.from_euler(order, given, degrees=True).as_matrix()
    angles = euler_angles(turn, order)
    assert np.abs(np.diff(angles, axis=0)).max() <= np.abs(np.diff(given, axis=0)).max() + 1e-9
    again = Rotation.from_euler(order, angles, degrees=True).as_matrix()
    np.testing.assert_allclose(again, turn, rtol=0, atol=1e-12)


@pytest.mark.parametrize("middle", [90.0, -90.0])
def test_within_gimbal_lock_nothing_jumps(middle):
    t = np.linspace(0, 1, 200)[:, None]
    given = np.hstack([40 * t, np.full_like(t, middle), 80 * t])
    turn = Rotation.from_euler("ZXY", given, degrees=True).as_matrix()
    angles = euler_angles(turn, "ZXY")
    # Sum or difference is all that is left: 120° in 199 steps, all of it in one channel at most.
    assert np.abs(np.diff(angles, axis=0)).max() <= 120 / 199 + 1e-6
    again = Rotation.from_euler("ZXY", angles, degrees=True).as_matrix()
    np.testing.assert_allclose(again, turn, rtol=0, atol=1e-7)


@pytest.mark.parametrize("order", ORDERS)
def test_of_the_two_triples_each_frame_has_the_one_that_is_nearer_to_the_last(order):
    angles = euler_angles(Rotation.random(300, random_state=9).as_matrix(), order)
    # (a, b, c) and (a + 180°, 180° - b, c + 180°) are one rotation.
    others = angles * [1, -1, 1] + 180

    def step(there):
        return (((there[1:] - angles[:-1] + 180) % 360 - 180) ** 2).sum(axis=1)

    assert (step(angles) <= step(others) + 1e-6).all()


@pytest.mark.parametrize("middle", [89.6, -89.99])
def test_near_gimbal_lock_each_frame_is_still_exactly_its_rotation(middle):
    rng = np.random.default_rng(3)
    first, last = rng.uniform(-180, 180, (2, 50))
    turn = Rotation.from_euler(
        "ZXY", np.stack([first, np.full(50, middle), last], axis=1), degrees=True
    ).as_matrix()
    again = Rotation.from_euler("ZXY", euler_angles(turn, "ZXY"), degrees=True).as_matrix()
    np.testing.assert_allclose(again, turn, rtol=0, atol=1e-11)


def test_an_unknown_order_is_refused():
    with pytest.raises(ValueError, match="order"):
        euler_angles(np.eye(3)[None], "ZXZ")

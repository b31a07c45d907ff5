"""What holds joints: two axes, a spring, equal parts of a turn; each against turns written down beforehand."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_skel.rig.freedoms import Shared, Spring, Universal, shares
from mocap_skel.rig.model import universal
from mocap_skel.rig.solver import Bones, Poses, Problem, marker_sums, solve

FRAMES = 200
RNG = np.random.default_rng(3)
ABOVE, BELOW = np.array([0.0, 0.6, 0.8]), np.array([1.0, 0.0, 0.0])
BETWEEN = Rotation.from_rotvec([0.3, -0.2, 0.5])


def turns(rotations):
    return np.ascontiguousarray(rotations.as_matrix().transpose(1, 2, 0))


def about(axis, angles):
    return Rotation.from_rotvec(np.outer(angles, axis))


def cardan(first=0.9, second=0.8, skin=0.0):
    a, b = (size * RNG.uniform(-1, 1, FRAMES) for size in (first, second))
    noise = Rotation.from_rotvec(skin * RNG.normal(size=(FRAMES, 3)))
    return turns(about(ABOVE, a) * BETWEEN * about(BELOW, b) * noise)


@pytest.mark.parametrize("skin", [0.0, 0.02])
def test_the_axes_of_a_joint_with_two_are_found(skin):
    found = universal(1, cardan(skin=skin))
    assert abs(found.above @ ABOVE) > np.cos(max(4 * skin, 1e-3))
    assert abs(found.below @ BELOW) > np.cos(max(4 * skin, 1e-3))
    sign = (found.above @ ABOVE) * (found.below @ BELOW)
    between = np.arccos(np.sign(sign) * (ABOVE @ BETWEEN.apply(BELOW)))
    assert found.angle == pytest.approx(between, abs=max(4 * skin, 1e-3))


def test_a_hinge_a_ball_and_a_still_joint_show_no_two_axes():
    ball = turns(Rotation.from_rotvec(0.5 * RNG.normal(size=(FRAMES, 3))))
    for shown in (cardan(second=0.0), cardan(first=0.0), cardan(0.01, 0.01)):
        assert universal(1, shown) is None
    assert universal(1, ball) is None
    assert universal(1, np.full((3, 3, 5), np.nan)) is None


def chain(count):
    """A root with markers, joints without any, and a last segment with markers, 0.1 m from each other."""
    none = np.empty((0, 3)), np.empty(0)
    cross = np.vstack([0.1 * np.eye(3), -0.1 * np.eye(3)])
    full = cross, np.full(6, 1.0 / 0.003**2)
    own = [full, *[none] * (count - 1), full]
    offsets = np.vstack([np.zeros(3), np.tile([0.0, 0.1, 0.0], (count, 1))])
    places, weights = zip(*own, strict=True)
    return Bones(tuple(range(-1, count)), offsets, places, weights)


def points_of(bones, truth):
    joints = truth.joints(bones)
    return [
        np.einsum("ijf,mj->fmi", truth.turn[:, :, s], place) + joints[:, s].T[:, None]
        for s, place in enumerate(bones.places)
    ]


def still(count, frames):
    return Poses(np.tile(np.eye(3)[:, :, None, None], (1, 1, count, frames)), np.zeros((3, frames)))


def test_joints_in_a_row_take_equal_parts_of_a_turn():
    bones, rest = chain(3), Rotation.from_rotvec([0.2, 0.4, -0.1])
    part = about([0.6, 0.0, 0.8], np.linspace(-0.4, 0.4, 9))
    truth = still(4, 9)
    first, second, last = turns(part), turns(part * part), turns(part * part * part * rest)
    for s, turn in enumerate((first, second, last), 1):
        truth.turn[:, :, s] = turn
    np.testing.assert_allclose(
        shares(truth.turn[:, :, 0], last, rest.as_matrix(), 3), first, atol=1e-12
    )
    sums = marker_sums(bones, points_of(bones, truth), np.zeros((9, 3)))
    shared = Shared((1, 2, 3), rest.as_matrix(), 1.0 / np.radians(5) ** 2)
    start = still(4, 9)
    start.turn[:, :, 3] = last
    found = solve(Problem(bones, sums, (shared,)), start, 60)
    np.testing.assert_allclose(found.turn, truth.turn, atol=2e-3)


def test_a_spring_keeps_its_turn_until_markers_show_another():
    wanted = Rotation.from_rotvec([0.0, 0.0, 0.3]).as_matrix()
    bones, truth = chain(1), still(2, 1)
    truth.turn[:, :, 1, 0] = Rotation.from_rotvec([0.5, 0.0, 0.0]).as_matrix()
    spring = Spring(1, wanted, 1.0 / np.radians(10) ** 2)
    points = points_of(bones, truth)
    seen = solve(Problem(bones, marker_sums(bones, points, np.zeros((1, 3))), (spring,)), truth, 60)
    np.testing.assert_allclose(seen.turn, truth.turn, atol=0.02)
    points[1] = np.full_like(points[1], np.nan)
    lost = solve(Problem(bones, marker_sums(bones, points, np.zeros((1, 3))), (spring,)), truth, 60)
    np.testing.assert_allclose(lost.turn[:, :, 1, 0], wanted, atol=2e-3)


def test_two_axes_decide_what_a_marker_on_one_of_them_does_not():
    bones = chain(1)
    bones = Bones(
        bones.parents, bones.offsets, (bones.places[0], 0.1 * np.eye(3)[:1]),
        (bones.weights[0], bones.weights[1][:1]),
    )  # fmt: skip
    y, z = np.eye(3)[1:]
    truth = still(2, 9)
    # About the parent's z, then about the child's own y: square to each other throughout.
    truth.turn[:, :, 1] = turns(
        about(z, np.linspace(0, 0.8, 9)) * about(y, np.linspace(-0.5, 0.5, 9))
    )
    joint = Universal(1, z, y, np.pi / 2, 1.0 / np.radians(5) ** 2)
    assert next(joint.priors(truth.turn, bones.parents))[2] == pytest.approx(0.0, abs=1e-9)
    sums = marker_sums(bones, points_of(bones, truth), np.zeros((9, 3)))
    turn = truth.turn.copy()
    # Turned about the line from joint to marker, which the marker does not show.
    turn[:, :, 1] = np.einsum(
        "ijf,jk->ikf", turn[:, :, 1], Rotation.from_rotvec([0.3, 0, 0]).as_matrix()
    )
    found = solve(Problem(bones, sums, (joint,)), Poses(turn, truth.root), 60)
    np.testing.assert_allclose(found.turn, truth.turn, atol=2e-3)

"""Gauss-Newton by elimination along the tree, against the same equations written out whole."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_skel.rig.freedoms import Hinge
from mocap_skel.rig.solver import (
    Bones,
    Poses,
    Problem,
    Pull,
    known_turns,
    marker_sums,
    solve,
)

#          0
#        1   2
#       3 4   5
PARENTS = (-1, 0, 0, 1, 1, 2)
FRAMES = 7


def figure(seed, markers=(4, 3, 4, 1, 3, 2)):
    rng = np.random.default_rng(seed)
    return Bones(
        PARENTS,
        np.vstack([np.zeros(3), 0.3 * rng.normal(size=(5, 3))]),
        tuple(0.1 * rng.normal(size=(m, 3)) for m in markers),
        tuple(rng.uniform(0.5, 2.0, m) / 0.003**2 for m in markers),
    )


def poses(seed, frames=FRAMES):
    turn = Rotation.random(6 * frames, random_state=seed).as_matrix().reshape(6, frames, 3, 3)
    root = np.random.default_rng(seed).normal(size=(3, frames))
    return Poses(np.ascontiguousarray(turn.transpose(2, 3, 0, 1)), root)


def markers_of(bones, where):
    joints = where.joints(bones)
    return [
        np.einsum("ijf,mj->fmi", where.turn[:, :, s], place) + joints[:, s].T[:, None]
        for s, place in enumerate(bones.places)
    ]


def near(where, radians, seed):
    rng = np.random.default_rng(seed)
    away = Rotation.from_rotvec(radians * rng.normal(size=(6 * where.frames, 3))).as_matrix()
    away = away.reshape(6, where.frames, 3, 3).transpose(2, 3, 0, 1)
    turn = np.einsum("ijsf,jksf->iksf", away, where.turn)
    return Poses(turn, where.root + 0.01 * rng.normal(size=where.root.shape))


def cost(problem, points, where):
    total = 0.0
    for s, (seen, made) in enumerate(zip(points, markers_of(problem.bones, where), strict=True)):
        square = ((seen - made) ** 2).sum(axis=2)
        total = total + np.nansum(problem.bones.weights[s] * square, axis=1)
    return total


def test_exact_markers_give_their_poses_back():
    bones, truth = figure(1, markers=(4, 3, 4, 3, 3, 3)), poses(2)
    points = markers_of(bones, truth)
    found = solve(Problem(bones, marker_sums(bones, points, truth.root.T)), near(truth, 0.3, 3), 40)
    np.testing.assert_allclose(found.turn, truth.turn, atol=1e-5)
    np.testing.assert_allclose(found.root, truth.root, atol=1e-6)


def test_the_answer_is_the_least_cost_of_all_directions():
    """Noisy markers, some hidden: no small turn of a segment, no shift of the root makes it cheaper."""
    bones, truth = figure(4, markers=(4, 3, 4, 3, 3, 3)), poses(5)
    rng = np.random.default_rng(6)
    points = [p + 0.003 * rng.normal(size=p.shape) for p in markers_of(bones, truth)]
    points[1][0, 0] = np.nan
    points[5][3] = np.nan
    problem = Problem(bones, marker_sums(bones, points, truth.root.T))
    found = solve(problem, near(truth, 0.05, 7), 60)
    least = cost(problem, points, found)
    step = 1e-3
    for s in range(6):
        for way in np.vstack([np.eye(3), -np.eye(3)]):
            turn = found.turn.copy()
            own = Rotation.from_rotvec(step * way).as_matrix()
            turn[:, :, s] = np.einsum("ij,jkf->ikf", own, turn[:, :, s])
            assert (cost(problem, points, Poses(turn, found.root)) >= least - 1e-6).all()
    for way in 1e-4 * np.vstack([np.eye(3), -np.eye(3)]):
        assert (cost(problem, points, Poses(found.turn, found.root + way[:, None])) > least).all()


def test_a_hinge_keeps_its_axis_where_no_marker_says_otherwise():
    bones = figure(8, markers=(4, 4, 4, 1, 3, 0))
    axis = np.array([0.0, 0.6, 0.8])
    truth = poses(9)
    turn = truth.turn.copy()
    bend = Rotation.from_rotvec(np.linspace(0.2, 1.5, FRAMES)[:, None] * axis).as_matrix()
    turn[:, :, 3] = np.einsum("ijf,fjk->ikf", turn[:, :, 1], bend)
    truth = Poses(turn, truth.root)
    points = markers_of(bones, truth)
    hinge = Hinge(3, axis, axis, 1.0 / np.radians(5) ** 2)
    problem = Problem(bones, marker_sums(bones, points, truth.root.T), (hinge,))
    found = solve(problem, near(truth, 0.1, 10), 60)
    np.testing.assert_allclose(found.turn[:, :, 3], truth.turn[:, :, 3], atol=2e-3)


def test_a_pull_decides_what_nothing_else_does():
    bones = figure(11, markers=(4, 4, 4, 3, 3, 0))
    truth = poses(12)
    points = markers_of(bones, truth)
    wanted = truth.local(bones, 5)
    pull = Pull(5, wanted, np.full(FRAMES, 0.03 * bones.unit))
    problem = Problem(bones, marker_sums(bones, points, truth.root.T), (), (pull,))
    found = solve(problem, near(truth, 0.2, 13), 60)
    np.testing.assert_allclose(found.local(bones, 5), wanted, atol=1e-3)


def test_what_markers_tell_of_a_turn_is_their_weight_times_their_lever_squared():
    """A leaf with one marker at 0.1 m: nothing about its own direction, w 0.01 m² about the other two."""
    bones = Bones(
        (-1, 0), np.array([[0, 0, 0], [0.3, 0, 0]]),
        (np.eye(3), np.array([[0.0, 0.0, 0.1]])), (np.full(3, 4.0), np.array([25.0])),
    )  # fmt: skip
    where = Poses(np.tile(np.eye(3)[:, :, None, None], (1, 1, 2, 1)), np.zeros((3, 1)))
    points = [p[None] + o for p, o in zip(bones.places, bones.offsets, strict=True)]
    told = known_turns(Problem(bones, marker_sums(bones, points, np.zeros((1, 3)))), where)
    np.testing.assert_allclose(told[1, 0], [0.0, 0.25, 0.25], atol=1e-6)


@pytest.mark.parametrize("frames", [1, 3000])
def test_frames_do_not_know_of_each_other(frames):
    bones, truth = figure(14, markers=(4, 3, 4, 3, 3, 3)), poses(15, frames)
    points = markers_of(bones, truth)
    problem = Problem(bones, marker_sums(bones, points, truth.root.T))
    start = near(truth, 0.1, 16)
    together = solve(problem, start)
    last = np.array([frames - 1])
    alone = solve(problem.at(last), start.at(last))
    np.testing.assert_allclose(together.turn[..., -1:], alone.turn, atol=1e-12)

"""Evidence by hand: what samples tell, how clips add up, and how it goes into another frame."""

from dataclasses import replace

import numpy as np
import pytest
from centres import CENTRE, TEMPLATE, centre_of, frame_on, on_sphere

from mocap_skel.artificial.rotations import from_vector
from mocap_skel.joints.evidence import Evidence, information, merged, moved, placed
from mocap_skel.joints.lever import Lever
from mocap_skel.joints.samples import JointSamples
from mocap_skel.joints.two_sided import SharedPoint
from mocap_skel.spherefit import sphere_moments

EYE = np.eye(3)


def evidence_of(points, sigma=0.001, noise=1.0, **more):
    """Evidence of points (frames, M, 3) with given numbers."""
    moments = sphere_moments(np.swapaxes(points, 0, 1))
    each = np.broadcast_to(EYE, (points.shape[1], 3, 3))
    parts = {
        "leverage": 0 * each, "skew": 0 * moments.mean, "still": sigma**2 * each,
        "effective": moments.count / 2, "smooth": 0 * moments.count,
    }  # fmt: skip
    return Evidence(moments, sigma, noise * each, **(parts | more))


def test_samples_tell_the_markers_noise_and_that_of_the_frame():
    """The noise that is taken away is the clip's; what proves nothing is skin's, of child and of parent."""
    points = on_sphere(1.0, 100, np.random.default_rng(0), 0.001, markers=2)
    matrix = np.diag([0.5, 1.0, 1.5])
    frame = frame_on(sigma=0.003)
    found = JointSamples(points, 0.001, 0.002, frame, matrix).evidence()
    lever = Lever.of(frame.shape, matrix).covariance(found.moments)
    assert found.sigma == 0.001
    assert (found.noise == matrix).all()
    np.testing.assert_allclose(found.leverage, lever)
    np.testing.assert_allclose(found.still, 0.002**2 * matrix + 0.003**2 * lever)


class TestNumbers:
    def test_the_reach_is_how_far_the_markers_are_from_the_parents_origin(self):
        far = np.array([[0.3, 0.4, 0.0], [0.0, 0.0, 1.2]])
        assert evidence_of(np.tile(far, (5, 1, 1))).reach == pytest.approx(
            np.sqrt((0.5**2 + 1.2**2) / 2)
        )

    def test_spread_over_noise_is_that_of_the_worst_direction(self):
        points = np.random.default_rng(1).normal(size=(50, 1, 3))
        one = evidence_of(points)
        moments = replace(one.moments, covariance=np.diag([9.0, 2.0, 4.0])[None])
        # 9 / 4, 2 / 0.5, 4 / 1 in the variance.
        found = replace(one, moments=moments, still=np.diag([4.0, 0.5, 1.0])[None])
        assert found.spread_over_noise == pytest.approx(1.5)

    def test_information_is_the_bound_of_the_thesis(self):
        """N C / (r σ)², with N independent samples; noise is what the markers have at rest."""
        points = on_sphere(1.0, 100, np.random.default_rng(2))
        one = replace(evidence_of(points, sigma=0.002), effective=np.array([25.0]))
        away = points.mean(axis=(0, 1)) - CENTRE
        spread = one.moments.covariance[0] - 0.002**2 * EYE
        np.testing.assert_allclose(
            information(one, CENTRE), 25 * spread / (away @ away * 0.002**2), rtol=1e-9
        )

    def test_a_marker_in_the_centre_is_a_millimetre_off_and_none_is_better_than_10_micrometres(
        self,
    ):
        points = np.random.default_rng(3).normal(size=(40, 1, 3))
        one = evidence_of(points, sigma=0.0)
        law = 20 * one.moments.covariance[0] / (0.001 * 1e-5) ** 2
        np.testing.assert_allclose(information(one, one.moments.mean[0]), law, rtol=1e-9)


class TestTogether:
    def test_noise_adds_up_by_samples(self):
        """30 samples with 1 mm and 10 with 2 mm; what a clip says for a sigma of 1 is in its own sigma."""
        rng = np.random.default_rng(4)
        first, second = (
            evidence_of(
                rng.normal(size=(n, 1, 3)), sigma, noise, still=np.full((1, 3, 3), sigma),
                smooth=np.array([smooth]), effective=np.array([free]),
            )
            for n, sigma, noise, smooth, free in ((30, 0.001, 1.0, 0.8, 12.0), (10, 0.002, 3.0, 0.4, 5.0))
        )  # fmt: skip
        found = merged(first, second)
        assert found.sigma**2 == pytest.approx((30 * 0.001**2 + 10 * 0.002**2) / 40)
        np.testing.assert_allclose(
            found.sigma**2 * found.noise[0],
            (30 * 0.001**2 * 1.0 + 10 * 0.002**2 * 3.0) / 40 * EYE, atol=1e-18,
        )  # fmt: skip
        assert found.still[0] == pytest.approx(np.full((3, 3), (30 * 0.001 + 10 * 0.002) / 40))
        assert found.smooth == pytest.approx([0.7])
        assert found.effective == pytest.approx([17.0])

    def test_a_marker_of_one_clip_only_keeps_its_numbers(self):
        rng = np.random.default_rng(5)
        both, one = rng.normal(size=(30, 2, 3)), rng.normal(size=(10, 2, 3))
        one[:, 1] = np.nan
        first = evidence_of(both, smooth=np.array([0.1, 0.2]))
        found = merged(first, evidence_of(one, smooth=np.array([0.9, 0.0])))
        assert found.smooth[1] == pytest.approx(0.2)
        assert found.count.tolist() == [40, 30]

    def test_the_frames_noise_of_parts_is_that_of_the_whole(self):
        """Halves of one clip at different places: what a lever adds about each mean, taken about the common one."""
        points = on_sphere(1.0, 4000, np.random.default_rng(6))
        points = points[np.argsort(points[:, 0, 0])]
        whole, *halves = (
            JointSamples(p, 0.001, 0.001, frame_on()).evidence()
            for p in (points, points[:2000], points[2000:])
        )
        found = merged(*halves)
        # N - 1 in moments and N in means.
        for name in ("leverage", "skew", "still"):
            own = getattr(whole, name)
            np.testing.assert_allclose(
                getattr(found, name), own, rtol=0, atol=2e-3 * np.abs(own).max(), err_msg=name
            )
        # The halves' means do matter.
        assert (
            np.abs(halves[0].skew + halves[1].skew - 2 * whole.skew).max()
            > 0.2 * np.abs(whole.skew).max()
        )

    def test_shared_points_add_their_information_and_turn_as_both_do(self):
        """I - R̄R̄ᵀ over the residual is what a point is known by: three of four parts are the first's."""
        first = SharedPoint(np.array([0.01, 0.0, 0.0]), 0.6 * EYE, 1e-6)
        second = SharedPoint(np.array([0.03, 0.0, 0.04]), 0.6 * EYE, 3e-6)
        points = np.random.default_rng(7).normal(size=(10, 1, 3))
        a, b = (replace(evidence_of(points), shared=s) for s in (first, second))
        found = merged(a, b).shared
        assert found.centre == pytest.approx([0.015, 0.0, 0.01])
        assert found.turns == pytest.approx(0.6 * EYE)
        assert found.turns / found.residual == pytest.approx(0.6 * EYE / 1e-6 + 0.6 * EYE / 3e-6)
        # One that knows nothing of itself leaves the other as it is.
        for nothing in (None, replace(second, residual=0.0)):
            alone = merged(a, replace(b, shared=nothing)).shared
            assert alone is first


def test_evidence_turns_with_its_samples():
    """Points and frame turned, or their evidence."""
    turn = from_vector(np.array([0.3, -1.0, 0.5]))
    points = on_sphere(1.0, 200, np.random.default_rng(8), 0.001, markers=2)
    matrix = np.diag([0.5, 1.0, 1.5])
    point = SharedPoint(np.array([0.1, 0.0, 0.2]), np.diag([0.1, 0.2, 0.0]), 1e-5)
    before = JointSamples(points, 0.001, 0.002, frame_on(sigma=0.003), matrix, point).evidence()
    after = JointSamples(
        points @ turn.T, 0.001, 0.002, frame_on(TEMPLATE @ turn.T, 0.003), turn @ matrix @ turn.T
    ).evidence()
    found = moved(before, turn, np.zeros(3))
    for name in ("noise", "leverage", "skew", "still"):
        own = getattr(after, name)
        np.testing.assert_allclose(
            getattr(found, name), own, rtol=0, atol=1e-12 * np.abs(own).max(), err_msg=name
        )
    np.testing.assert_allclose(found.moments.mean, after.moments.mean, rtol=0, atol=1e-12)
    # And what is a place is shifted too.
    shift = np.array([1.0, 2.0, 3.0])
    shared = moved(before, turn, shift).shared
    assert shared.centre == pytest.approx(turn @ point.centre + shift)
    assert shared.turns == pytest.approx(turn @ point.turns @ turn.T)
    assert shared.residual == point.residual


def test_markers_take_their_places_in_any_order():
    points = np.random.default_rng(9).normal(size=(20, 2, 3))
    one = evidence_of(points, effective=np.array([3.0, 4.0]))
    found = placed(one, [2, 0], 4)
    assert found.count.tolist() == [20, 0, 20, 0]
    assert found.effective.tolist() == [4.0, 0.0, 3.0, 0.0]
    assert (found.moments.mean[[2, 0]] == one.moments.mean).all()
    assert (found[np.array([2, 0])].noise == one.noise).all()


def test_a_clip_that_is_pooled_with_itself_has_twice_the_samples_and_the_same_centre():
    points = on_sphere(1.5, 3000, np.random.default_rng(10), 0.001)
    once = centre_of(points, 0.001)
    twice = centre_of(points, 0.001, pooled=once.evidence)
    # N - 1 in moments and N in radii, of 1 mm.
    np.testing.assert_allclose(twice.centre, once.centre, rtol=0, atol=1e-6)
    assert twice.effective == pytest.approx(2 * once.effective)

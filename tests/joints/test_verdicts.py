"""Which verdict a joint gets: caps, arcs and hinges of known width and noise, and each limit by its number."""

from dataclasses import replace

import numpy as np
import pytest
from centres import CENTRE, arc, centre_of, frame_on, on_sphere
from scipy.spatial.transform import Rotation

from mocap_skel.joints.joint_fit import JointFit, from_anatomy, unfitted
from mocap_skel.joints.priors import Expected
from mocap_skel.joints.samples import Frame
from mocap_skel.joints.verdicts import SAFE_ERROR, by_error, by_movement, by_numbers, wide_enough


class TestVerdict:
    @pytest.mark.parametrize(
        ("half_angle", "count", "sigma", "verdict", "word"),
        [
            # λ_min = r² sin⁴(θ/2) / 3: √λ_min is 58 mm for 60 degrees, 16 for 30, 7 for 20, 1.8 for 10.
            (60, 500, 0.001, "yes", ""),
            (60, 500, 0.005, "yes", ""),
            (60, 500, 0.015, "weak", "distance"),
            (60, 12, 0.005, "weak", "standard error"),
            (30, 500, 0.008, "weak", "above its noise"),
            (20, 500, 0.009, "no", ""),
            (10, 500, 0.0001, "no", "skin"),
            (0.1, 500, 0.003, "no", "moves"),
        ],
    )
    def test_a_cap_gets_the_one_that_it_deserves_with_a_reason(
        self, half_angle, count, sigma, verdict, word
    ):
        rng = np.random.default_rng(20)
        points = on_sphere(np.radians(half_angle), count, rng, sigma)
        found = centre_of(points, sigma)
        assert (found.shown, found.reason == "") == (verdict, verdict == "yes")
        assert word in found.reason

    def test_a_residual_counts_whatever_the_noise_is_said_to_be(self):
        points = on_sphere(np.radians(30), 500, np.random.default_rng(22), 0.008)
        assert centre_of(points, 0.001).shown == "weak"

    def test_noise_of_the_frame_that_explains_the_spread_counts(self):
        points = on_sphere(np.radians(30), 500, np.random.default_rng(23), 0.001)
        # Along the cap's axis, where it spreads least (16 mm), the points are 0.2 m off the middle of
        # the frame's markers, which stand 0.14 m around it: there noise of σ in them makes 1.3 σ.
        verdicts = [
            centre_of(points, 0.001, frame_on(sigma=skin)).shown for skin in (0.0005, 0.005, 0.02)
        ]
        assert verdicts == ["yes", "weak", "no"]

    @pytest.mark.parametrize(("half_angle", "word"), [(40, "one axis"), (4, "one line")])
    def test_an_arc_does_not_show_a_centre(self, half_angle, word):
        # r (1 - cos θ) is 94 mm for the one, 1 mm for the other: no more than a line in noise of 2 mm.
        points = arc(np.radians(half_angle), 500, 0.002, np.random.default_rng(21))
        found = centre_of(points, 0.002)
        assert (found.shown, found.method) == ("no", "SGDK")
        assert word in found.reason
        assert found.hinge == (word == "one axis")

    def test_more_noise_never_makes_a_verdict_better(self):
        rank = {"no": 0, "weak": 1, "yes": 2}
        for theta in (0.1, 0.3, 0.8):
            verdicts = []
            for sigma in (0.0001, 0.001, 0.005, 0.02, 0.05):
                points = on_sphere(theta, 500, np.random.default_rng(16), sigma)
                verdicts.append(rank[centre_of(points, sigma).shown])
            assert verdicts == sorted(verdicts, reverse=True)
            assert verdicts[-1] == 0

    def test_a_hinge_is_no_and_gives_its_axis(self):
        rng = np.random.default_rng(17)
        axis = np.array([0.6, 0.0, 0.8])
        bend = rng.uniform(-1.2, 1.2, 600)
        spin = Rotation.from_rotvec(bend[:, None] * axis).as_matrix()
        arms = np.array([[0.0, 0.3, 0.0], [0.08, 0.2, -0.06]])
        points = CENTRE + np.einsum("fij,mj->fmi", spin, arms)
        sigma = 0.001
        found = centre_of(points + sigma * rng.standard_normal(points.shape), sigma)
        assert (found.shown, found.method, found.hinge) == ("no", "SGDK", True)
        assert "one axis" in found.reason
        # The plane's normal: σ over the spread in the plane (0.06 m in its shorter direction) and √N.
        assert abs(found.axis @ axis) >= np.cos(5 * sigma / 0.06 / np.sqrt(1200))
        # On the axis; along it level with the markers.
        across = found.centre - CENTRE
        along = across @ axis
        assert np.linalg.norm(across - along * axis) <= 5 * sigma * 3 / np.sqrt(1200) * 4
        middle = (points.reshape(-1, 3).mean(axis=0) - CENTRE) @ axis
        assert along == pytest.approx(middle, abs=5 * sigma)

    def test_along_a_hinge_nothing_is_known_but_the_reach(self):
        axis = np.array([0.6, 0.0, 0.8])
        for seed in range(5):
            rng = np.random.default_rng(seed)
            spin = Rotation.from_rotvec(rng.uniform(-1.2, 1.2, 600)[:, None] * axis).as_matrix()
            arms = np.array([[0.0, 0.3, 0.0], [0.08, 0.2, -0.06]]) + 0.2 * axis
            points = CENTRE + np.einsum("fij,mj->fmi", spin, arms)
            noisy = points + 0.001 * rng.standard_normal(points.shape)
            found = centre_of(noisy, 0.001)
            # How far the markers are from the frame's origin is all that bounds it.
            reach = np.sqrt((points.mean(axis=0) ** 2).sum(axis=1).mean())
            assert np.sqrt(axis @ found.covariance @ axis) == pytest.approx(reach, rel=0.05)

    def test_a_joint_in_a_frame_on_one_marker_is_limited(self):
        points = on_sphere(1.0, 500, np.random.default_rng(18), 0.001)
        free = centre_of(points, 0.001)
        assert free.shown == "yes"
        for limit in ("weak", "no"):
            frame = Frame(None, limit, "stands on one marker")
            found = centre_of(points, 0.001, frame)
            assert (found.shown, found.reason) == (limit, "stands on one marker")
            np.testing.assert_array_equal(found.centre, free.centre)
        # A worse verdict of its own comes first.
        still = CENTRE + 0.001 * np.random.default_rng(19).standard_normal((500, 1, 3))
        found = centre_of(still, 0.001, Frame(None, "weak", "stands on one marker"))
        assert found.shown == "no"
        assert found.reason != "stands on one marker"


def test_an_unfitted_joint_is_all_nan_and_says_why():
    joint = unfitted("Knee", "Thigh", "Shank", 7, "no marker on Shank")
    assert not joint.fitted
    assert (joint.shown, joint.reason, joint.samples) == ("no", "no marker on Shank", 0)
    assert joint.track.shape == (7, 3) and np.isnan(joint.track).all()
    assert np.isnan(joint.standard_error).all()
    assert isinstance(replace(joint, centre=np.zeros(3)), JointFit)


@pytest.mark.parametrize(
    ("rank", "weakest", "residual", "over_noise", "shown", "word"),
    [
        (0, 0.05, 0.0, 99, "no", "hardly moves"),
        (1, 0.05, 0.0, 99, "no", "one line"),
        (2, 0.05, 0.0, 99, "no", "one axis"),
        # Skin on a person who stands still spreads 3 mm.
        (3, 0.00299, 0.0, 99, "no", "3.0 mm in one direction: skin"),
        (3, 0.00301, 0.0, 99, "yes", ""),
        # The thesis's criterion: σ < √λ_min.
        (3, 0.02, 0.0201, 99, "no", "less than its noise"),
        (3, 0.02, 0.0199, 99, "weak", "2.0 cm in one direction"),
        # Three times the residual is safe.
        (3, 0.03, 0.0101, 99, "weak", "little above its noise"),
        (3, 0.03, 0.0099, 99, "yes", ""),
        # Against what noise alone spreads, movement and noise add up: √2, and three times.
        (3, 0.05, 0.0, 1.41, "no", "less than its noise"),
        (3, 0.05, 0.0, 1.42, "weak", "little above its noise"),
        (3, 0.05, 0.0, 2.99, "weak", "little above its noise"),
        (3, 0.05, 0.0, 3.01, "yes", ""),
    ],
)
def test_each_limit_of_the_movement_by_its_number(rank, weakest, residual, over_noise, shown, word):
    found = by_movement(rank, weakest, residual, over_noise)
    assert found.shown == shown
    assert word in found.reason


def test_each_limit_of_the_numbers_by_its_number():
    """A centimetre of residual, then one of standard error."""
    assert by_numbers(0.0099, 0.0099) == ("yes", "")
    assert by_numbers(0.0101, 0.02).reason.startswith(
        "its markers do not keep their distance (1.0 cm)"
    )
    assert by_numbers(0.0099, 0.0101) == ("weak", "standard error 1.0 cm in one direction")
    assert SAFE_ERROR == 0.01


def test_the_errors_of_a_joint_are_roots_of_its_covariance():
    turn = Rotation.from_euler("z", 45, degrees=True).as_matrix()
    joint = replace(
        unfitted("Knee", "Thigh", "Shank", 7, ""), centre=np.zeros(3),
        covariance=turn @ np.diag([0.0009, 0.0001, 0.0004]) @ turn.T,
    )  # fmt: skip
    assert joint.standard_error == pytest.approx([np.sqrt(0.0005), np.sqrt(0.0005), 0.02])
    assert joint.worst_error == pytest.approx(0.03)


def test_a_joint_of_anatomy_is_not_shown_and_says_why():
    prior = Expected(np.ones(3), 0.0004 * np.eye(3), ("LKNE",), "Gordon 1989")
    found = from_anatomy(prior, "no marker on Shank", 2)
    assert (found.shown, found.reason, found.method) == ("no", "no marker on Shank", "PRIOR")
    assert (found.share, found.samples, found.effective) == (0.0, 0, 0.0)
    assert (found.landmarks, found.source) == (("LKNE",), "Gordon 1989")
    assert found.worst_error == pytest.approx(0.02)
    assert np.isnan(found.motion).all() and np.isnan(found.radius).tolist() == [True, True]


def test_a_yes_has_a_standard_error_that_deserves_it():
    assert by_error(SAFE_ERROR).shown == "yes"
    assert by_error(1.001 * SAFE_ERROR) == (
        "weak",
        "standard error 1.0 cm in one direction with skin",
    )
    assert wide_enough(0.0301, 0.01) and not wide_enough(0.0299, 0.01)
    assert not wide_enough(0.0029, 0.0)

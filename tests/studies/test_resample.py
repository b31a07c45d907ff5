"""What the answers of a resampling study say: clusters, deviations, the law of their fall (thesis 6.1).

Tolerances come from what is drawn: a share, a mean or a slope gets four of its standard errors. The
logarithm (base 10) of the length of a normal vector of three varies by `LOG`, so that a line through K
such lengths over x has a slope that is known to LOG / (σ_x √K).
"""

from dataclasses import replace

import numpy as np
import pytest
from findings import EPS, answer, mirrored, scattered

from mocap_skel.errors import FitError
from mocap_skel.studies.resample import clusters, summarise

# Standard deviation of log10 of the length of a normal vector of three: ½ √ψ'(3/2) / ln 10.
LOG = 0.21


class TestLaw:
    def test_an_exact_law_is_found_exactly(self):
        samples = [10, 30, 100, 200, 300, 1000, 3000]
        law = summarise(mirrored(samples, lambda n: 0.08 * n**-0.5)).laws[-1]
        assert law.slope == pytest.approx(-0.5, abs=1e-9)
        assert law.slope_error == pytest.approx(0.0, abs=1e-6)
        assert law.at_enough == pytest.approx(0.08 * 200**-0.5, rel=1e-9)
        assert (law.joint, law.answers) == ("all", 14)

    def test_scatter_has_the_slope_of_its_law_within_its_standard_error(self):
        count = 400
        for seed in range(5):
            found = summarise(scattered(np.random.default_rng(seed), count))
            one, law = found.laws
            assert (one.joint, law.joint) == ("LeftKnee", "all")
            assert one.slope == law.slope
            # Numbers of samples are even in their logarithm over two decades.
            expected = LOG / (2 / np.sqrt(12) * np.sqrt(count))
            # A standard deviation of 400 lengths is known to 1/√800.
            assert law.slope_error == pytest.approx(expected, rel=4 / np.sqrt(2 * count))
            assert abs(law.slope + 0.5) <= 4 * law.slope_error

    def test_drawn_from_a_clip_that_ends_the_law_is_that_of_what_is_left(self):
        whole, samples = 1000, range(100, 1000, 50)
        pairs = mirrored(samples, lambda n: 0.05 * np.sqrt(1 / n - 1 / whole))
        law = summarise([*pairs, answer((0, 0, 0), whole)]).laws[-1]
        assert law.finite_slope == pytest.approx(-0.5, abs=1e-9)
        assert law.slope < -0.8

    @pytest.mark.parametrize(("far", "share"), [(1, 0.9), (5, 0.5), (0, 1.0)])
    def test_the_share_within_a_centimetre_counts_what_has_more_than_200_samples(self, far, share):
        near = mirrored([201] * (10 - far), lambda n: 0.0099)
        away = mirrored([900] * far, lambda n: 0.0101)
        # These do not count: 200 are not more than 200.
        few = mirrored([200, 50], lambda n: 0.05)
        assert summarise(near + away + few).laws[-1].near == pytest.approx(share)

    def test_what_cannot_be_said_is_no_number(self):
        law = summarise(mirrored([150, 150], lambda n: 0.01)).laws[-1]
        assert np.isnan([law.slope, law.slope_error, law.finite_slope, law.near]).all()

    def test_numbers_that_hardly_differ_are_no_law(self):
        """0 to 4 % left out: a line through them would foretell anything."""
        law = summarise(
            [
                answer(np.random.default_rng(k).normal(size=3) / 100, 1380 - 14 * (k % 5))
                for k in range(40)
            ]
        ).laws[-1]
        assert np.isnan([law.slope, law.slope_error, law.at_enough]).all()
        assert law.near < 1.0

    def test_answers_that_agree_to_rounding_have_no_logarithm(self):
        law = summarise([answer((0.1, 0.2, 0.3), n) for n in (100, 300, 900)]).laws[-1]
        assert np.isnan(law.slope) and law.near == 1.0

    def test_each_joint_has_its_own_law(self):
        rng = np.random.default_rng(3)
        knee = mirrored([20, 100, 500], lambda n: n**-0.5 / 10)
        hip = mirrored([20, 100, 500], lambda n: n**-1.0 / 10, joint="LeftHip")
        both = [*knee, *hip]
        found = summarise([both[i] for i in rng.permutation(len(both))])
        laws = {law.joint: law.slope for law in found.laws}
        assert laws["LeftKnee"] == pytest.approx(-0.5) and laws["LeftHip"] == pytest.approx(-1.0)
        assert laws["LeftHip"] < laws["all"] < laws["LeftKnee"]

    def test_refits_without_an_answer_are_left_out(self):
        nothing = replace(answer((0, 0, 0), 0), x=np.nan, y=np.nan, z=np.nan)
        found = summarise([nothing, *mirrored([10, 100, 1000], lambda n: n**-0.5), nothing])
        assert len(found.answers) == len(found.deviation) == len(found.cluster) == 6
        with pytest.raises(FitError, match="no refit has an answer"):
            summarise([nothing])


def by_cluster(summary):
    return {group.cluster: group for group in summary.groups}


class TestClusters:
    def test_two_frames_of_the_parent_are_two_answers_about_two_means(self):
        """The thesis's ankles and elbows (6.1), whose table 3 has deviations from a mean of both."""
        rng = np.random.default_rng(1)
        one = scattered(rng, 120, 0.01, (0.3, 0.0, 0.0), frame="a b c")
        two = scattered(rng, 80, 0.01, (0.0, 0.3, 0.0), frame="a b d")
        found = summarise(
            [pair for both in zip(one, two, strict=False) for pair in both] + one[80:]
        )
        groups = by_cluster(found)
        assert [(groups[k].answers, groups[k].frame) for k in (1, 2)] == [
            (120, "a b c"), (80, "a b d")
        ]  # fmt: skip
        for own, made in zip((groups[1], groups[2]), (one, two), strict=True):
            places = np.array([(a.x, a.y, a.z) for a in made])
            np.testing.assert_allclose(own.mean, places.mean(axis=0), rtol=0, atol=8 * EPS)
            np.testing.assert_allclose(own.deviation, places.std(axis=0, ddof=1), rtol=1e-12)
        # 200 answers of two places 0.3 m apart: 0.3 √(p (1 - p)) along either axis.
        apart = 0.3 * np.sqrt(0.6 * 0.4)
        np.testing.assert_allclose(groups[1].single[:2], apart, rtol=0.02)
        assert (groups[1].single[:2] > 50 * groups[1].deviation[:2]).all()
        np.testing.assert_array_equal(groups[1].single, groups[2].single)
        # Every deviation is from the own mean: none is as large as the way to the other.
        assert found.deviation.max() < 0.03
        assert found.laws[0].near == 1.0

    def test_two_places_of_one_kind_are_found_by_the_gap_between_them(self):
        for seed in range(5):
            rng = np.random.default_rng(seed)
            found = summarise(
                scattered(rng, 90, 0.01) + scattered(rng, 60, 0.01, (0.0, 0.05, 0.05))
            )
            groups = by_cluster(found)
            assert {k: g.answers for k, g in groups.items()} == {1: 90, 2: 60}
            np.testing.assert_array_equal(found.cluster, [1] * 90 + [2] * 60)
            # σ / √n of 10 samples at least: the means of so many are well within a millimetre.
            np.testing.assert_allclose(groups[2].mean, (0.0, 0.05, 0.05), rtol=0, atol=0.001)

    def test_three_places_are_three(self):
        """Two of them near each other, the third far off: cut twice."""
        rng = np.random.default_rng(2)
        places = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.1, 0.0)]
        made = [scattered(rng, n, 0.01, at) for n, at in zip((50, 70, 60), places, strict=True)]
        found = summarise([a for part in made for a in part])
        np.testing.assert_array_equal(found.cluster, [3] * 50 + [1] * 70 + [2] * 60)

    @pytest.mark.parametrize("freedom", [1, 2, 3])
    def test_one_place_with_heavy_tails_stays_one(self, freedom):
        for seed in range(10):
            rng = np.random.default_rng(seed)
            made = scattered(rng, 200, 0.01, draw=lambda r: r.standard_t(freedom, size=3))
            assert {group.cluster for group in summarise(made).groups} == {1}

    def test_a_few_outliers_are_no_second_answer(self):
        rng = np.random.default_rng(3)
        # Fewer than one in twenty of those that decide, the better half.
        made = scattered(rng, 200, 0.01) + [answer((0.3, 0.0, 0.0), 900) for _ in range(4)]
        assert {group.cluster for group in summarise(made).groups} == {1}

    def test_kinds_that_mean_the_same_place_are_one_answer(self):
        """By another estimator or with other points of the parent, but to the same centre."""
        rng = np.random.default_rng(4)
        made = scattered(rng, 100, 0.01) + scattered(rng, 60, 0.01, method="SGDK")
        (group,) = summarise(made).groups
        assert (group.answers, group.method) == (160, "MGDK")

    def test_answers_of_few_samples_belong_to_the_nearest_mean(self):
        """Of few samples they lie anywhere, also right between the two."""
        rng = np.random.default_rng(5)
        one, two = (scattered(rng, 60, 0.01, (x, 0.0, 0.0)) for x in (0.0, 0.1))
        stray = [answer((x, 0.01, 0.0), 3) for x in (0.04, 0.06, -0.02, 0.13)]
        found = summarise(one + two + stray)
        a, b = found.cluster[0], found.cluster[60]
        assert a != b
        np.testing.assert_array_equal(found.cluster[120:], [a, b, a, b])

    def test_equal_answers_are_one_and_too_few_are_not_divided(self):
        place = np.tile([0.1, 0.2, 0.3], (40, 1))
        assert (clusters(place, np.arange(40.0), [0] * 40) == 0).all()
        two = np.array([[0.0, 0, 0], [0.0, 0, 0], [1.0, 0, 0], [1.0, 0, 0]])
        assert (clusters(two, np.ones(4), [0] * 4) == 0).all()

    def test_the_order_of_answers_is_nothing(self):
        rng = np.random.default_rng(6)
        made = scattered(rng, 70) + scattered(rng, 50, at=(0.1, 0.0, 0.0), frame="a b d")
        order = rng.permutation(120)
        found, other = summarise(made), summarise([made[i] for i in order])
        np.testing.assert_array_equal(found.cluster[order], other.cluster)
        # A mean summed in another order.
        np.testing.assert_allclose(found.deviation[order], other.deviation, rtol=0, atol=64 * EPS)

    def test_a_single_answer_has_no_deviation(self):
        (group,) = summarise([answer((0.1, 0.2, 0.3))]).groups
        assert np.isnan(group.deviation).all() and np.isnan(group.single).all()

    @pytest.mark.parametrize(("apart", "distinct"), [(5.0, False), (7.0, True)])
    def test_answers_are_distinct_from_six_times_their_scatter_on(self, apart, distinct):
        """Corners of two cubes of edge 2: every one lies √3 from the middle of its own."""
        corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
        far = corners + [apart * np.sqrt(3), 0.0, 0.0]
        label = clusters(np.concatenate([corners, far]), np.ones(16), [0] * 8 + [1] * 8)
        assert len(set(label.tolist())) == 1 + distinct

    def test_two_of_a_hundred_are_outliers_and_six_an_answer_of_their_own(self):
        rng = np.random.default_rng(7)
        for count, parts in ((2, 1), (6, 2)):
            near, far = rng.normal(size=(100 - count, 3)), rng.normal(size=(count, 3)) + 100
            label = clusters(np.concatenate([near, far]), np.ones(100), [0] * 100)
            assert len(set(label.tolist())) == parts

    def test_places_that_differ_by_rounding_are_one(self):
        place = np.array([0.1, 0.2, 0.3])
        both = np.concatenate([np.tile(place, (5, 1)), np.tile(np.nextafter(place, 1), (5, 1))])
        assert (clusters(both, np.ones(10), [0] * 5 + [1] * 5) == 0).all()

    def test_answers_of_many_samples_decide_where_those_of_few_lie_anywhere(self):
        rng = np.random.default_rng(8)
        near = rng.normal(0, 0.001, (80, 3)) + np.repeat([[0.0, 0, 0], [0.1, 0, 0]], 40, axis=0)
        anywhere = np.column_stack([np.linspace(-0.5, 0.5, 60), np.zeros(60), np.zeros(60)])
        samples = np.array([900.0] * 80 + [10.0] * 60)
        label = clusters(np.concatenate([near, anywhere]), samples, [0] * 140)
        assert len(set(label[:40].tolist())) == len(set(label[40:80].tolist())) == 1
        assert label[0] != label[40]

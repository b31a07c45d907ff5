"""The time of the estimators (thesis 6.4): what is drawn, ratios, powers."""

import numpy as np
import pytest
from findings import a_trial

from mocap_skel.spherefit import gdke, sphere_moments
from mocap_skel.studies import speed
from mocap_skel.studies.contenders import CONTENDERS, Contender


class TestSpeed:
    def test_what_is_drawn_is_repeated_and_in_the_thesiss_ranges(self, monkeypatch):
        monkeypatch.setattr(
            speed, "time_methods", lambda x, noise, methods: dict.fromkeys(methods, float(x.sum()))
        )
        first = list(speed.trials(40, 1000, seed=3))
        assert first == list(speed.trials(40, 1000, seed=3))
        assert first != list(speed.trials(40, 1000, seed=4))
        assert first[:5] == list(speed.trials(5, 1000, seed=3))
        assert all(10 <= t.points <= 1000 for t in first)
        assert all(1e-11 <= t.noise <= 1e12 for t in first)
        assert all(0 <= t.angle_deg <= 180 and 0 < t.radius <= 37 for t in first)
        # Even in the logarithm: half of 40 below the middle, with four standard deviations of √10.
        for values, middle in (
            ([t.points for t in first], 100),
            ([t.noise for t in first], 10**0.5),
        ):
            assert abs(sum(v < middle for v in values) - 20) <= 4 * np.sqrt(10)

    def test_the_points_lie_on_the_sphere_that_is_told_and_its_centre_anywhere_within_two_metres(
        self, monkeypatch
    ):
        seen = []

        def look(x, noise, methods):
            seen.append(x)
            return {}

        monkeypatch.setattr(speed, "time_methods", look)
        done = list(speed.trials(200, 1000, seed=5))
        centres = []
        for x, trial in zip(seen, done, strict=True):
            if trial.noise < 1e-8 and trial.angle_deg > 30:
                fit = gdke(sphere_moments(x))
                # Noise over a cap of 30 degrees: 1 / sin⁴(15°) of it at the most.
                assert fit.radius == pytest.approx(trial.radius, abs=1e-5)
                centres.append(fit.centre)
                assert len(x) == trial.points
        spread = np.array(centres)
        # Evenly drawn: 3 of 200 trials are the least that show it, and there are some 20.
        assert len(spread) > 10
        assert np.abs(spread).max() <= 2 + 1e-5 and np.ptp(spread, axis=0).min() > 2

    def test_the_best_time_counts_after_a_hundredth_of_a_second_and_three_turns(self, monkeypatch):
        clock, taken = [0.0], iter([0.004, 0.001, 0.002, 0.004, 0.006])

        def slow(points, noise):
            clock[0] += next(taken)
            return points[:, 0]

        monkeypatch.setattr(speed.time, "perf_counter", lambda: clock[0])
        monkeypatch.setitem(CONTENDERS, "slow", Contender("slow", slow))
        best = speed.time_methods(np.zeros((5, 3)), 0.0, ["slow"])
        assert best == {"slow": pytest.approx(0.001)}
        # 4 ms, then 1 and 2 within one turn of 3 ms, then 4: 11 ms in three turns.
        assert next(taken) == 0.006

    def test_every_estimator_is_timed_on_points_from_anywhere(self):
        """Noise of up to 10¹² m included: nobody may warn or break."""
        found = list(speed.trials(4, 100, seed=1))
        for trial in found:
            assert tuple(trial.seconds) == speed.METHODS
            assert all(0 < s < 10 for s in trial.seconds.values())

    def test_ratios_are_medians_and_quartiles_of_times_by_gdkes(self):
        done = [a_trial(20_000 + k, gdke=0.001, lls=0.001 * k) for k in (1, 2, 3, 4, 10)]
        found = {ratio.method: ratio for ratio in speed.ratios(done)}
        lls = found["lls"]
        assert (lls.lower, lls.median, lls.upper) == pytest.approx((2, 3, 4))
        assert (found["gdke"].lower, found["gdke"].median, found["gdke"].upper) == (1, 1, 1)

    def test_only_sets_of_many_points_count_unless_there_are_none(self):
        few = [a_trial(100 + k, lls=0.1) for k in range(9)]
        many = [a_trial(200_000, lls=0.005)]
        found = {ratio.method: ratio.median for ratio in speed.ratios(few + many)}
        assert found["lls"] == pytest.approx(5)
        found = {ratio.method: ratio.median for ratio in speed.ratios(few)}
        assert found["lls"] == pytest.approx(100)

    def test_what_many_is_depends_on_what_there_is(self):
        few, many = [a_trial(100), a_trial(300)], [a_trial(200_000)]
        assert speed.threshold(few + many) == speed.MANY == 200_000
        assert speed.threshold(few) == 100

    def test_a_sample_at_a_time_has_a_time(self):
        assert 0 < speed.time_of_a_sample(200) < 0.1

    def test_small_noise_is_below_one(self):
        done = [a_trial(20_000, 0.99, mle=0.07), *[a_trial(30_000, 1.0, mle=0.5)] * 2]
        found = {ratio.method: ratio.small_noise for ratio in speed.ratios(done)}
        assert found["mle"] == pytest.approx(70)
        loud = {ratio.method: ratio.small_noise for ratio in speed.ratios(done[1:])}
        assert np.isnan(loud["mle"])

    def test_the_power_is_that_of_the_points(self):
        done = [a_trial(n, lls=n * 1e-6, mle=n**1.5 * 1e-6) for n in (200_000, 400_000, 900_000)]
        found = {ratio.method: ratio.power for ratio in speed.ratios(done)}
        assert found["lls"] == pytest.approx(1.0)
        assert found["mle"] == pytest.approx(1.5)
        assert found["gdke"] == pytest.approx(0.0, abs=1e-9)
        assert np.isnan(speed.ratios(done[:1])[0].power)

    def test_sets_of_the_same_size_have_no_power(self):
        """Two of a hundred points at most are that now and then."""
        assert all(np.isnan(ratio.power) for ratio in speed.ratios([a_trial(43), a_trial(43)]))

    def test_the_thesiss_ratios_stand_beside_them(self):
        found = {ratio.method: ratio.thesis for ratio in speed.ratios([a_trial()])}
        assert found == dict.fromkeys(speed.METHODS) | {
            "lls": 11.05, "igdk": 2.17, "mle_from_mean": 80.0
        }  # fmt: skip
        assert tuple(found) == speed.METHODS

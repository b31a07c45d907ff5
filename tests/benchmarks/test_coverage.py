"""Error bars that hold: generated clips of benchmarks/coverage.py, whose table has all scenarios.

Each principal axis of a joint's covariance is one trial with a share of p inside: n of them lie within two
standard deviations √(p (1 - p) / n) of p, in 95 of 100 cases. Seeds are those of the benchmark.
"""

import coverage as bench
import numpy as np
import pytest

ROM, SHORT, PART, DANCE, WALK = bench.MOTIONS
WHITE, FAST, SLOW = bench.NOISES
NONE, SOME, MUCH = bench.SKINS
LOW, HIGH = bench.WINDOW
CLIPS = 8


def collect(motion, skin, noise, prior, clips=CLIPS):
    scenario = bench.Scenario(noise, skin, motion)
    return [o for trial in range(clips) for o in bench.outcomes(scenario, trial, (prior,))]


def tolerance(share, found):
    return 2.0 * np.sqrt(share * (1.0 - share) / (3 * len(found)))


def in_window(found):
    share = bench.covered(found)
    return LOW - tolerance(LOW, found) <= share <= HIGH + tolerance(HIGH, found)


@pytest.mark.parametrize(
    ("motion", "skin", "noise", "prior"),
    [
        (ROM, NONE, WHITE, "skeleton"),
        (ROM, NONE, WHITE, "none"),
        (ROM, MUCH, WHITE, "none"),
        (SHORT, NONE, WHITE, "skeleton"),
        (SHORT, SOME, WHITE, "skeleton"),
        (SHORT, MUCH, SLOW, "skeleton"),
        (SHORT, MUCH, SLOW, "none"),
        (DANCE, MUCH, FAST, "none"),
        (WALK, SOME, WHITE, "none"),
        (WALK, MUCH, WHITE, "skeleton"),
        (WALK, MUCH, SLOW, "none"),
        (PART, SOME, FAST, "skeleton"),
    ],
)
def test_95_percent_intervals_cover_90_to_98_percent(motion, skin, noise, prior):
    assert in_window(collect(motion, skin, noise, prior))


@pytest.mark.parametrize(
    ("motion", "noise"), [(ROM, WHITE), (SHORT, SLOW), (PART, FAST), (WALK, SLOW)]
)
def test_50_percent_ellipsoids_cover_40_to_65_percent_where_skin_slides_as_it_does(motion, noise):
    """By up to 15 mm, as on a thigh (Cappozzo 1996). Where it slides less they are wider: 78 % over all scenarios."""
    found = collect(motion, MUCH, noise, "skeleton")
    share, (low, high) = bench.halves(found), bench.HALF_WINDOW
    # Each joint is one trial.
    chance = 2.0 * np.sqrt(np.array([low * (1 - low), high * (1 - high)]) / len(found))
    assert low - chance[0] <= share <= high + chance[1]


@pytest.mark.xfail(
    strict=True,
    reason="too wide: nothing tells slow noise from skin, and skin of that size would need such intervals",
)
@pytest.mark.parametrize(("motion", "skin", "noise"), [(ROM, NONE, SLOW), (ROM, SOME, SLOW)])
def test_95_percent_intervals_are_no_wider_than_that(motion, skin, noise):
    assert in_window(collect(motion, skin, noise, "skeleton"))


@pytest.mark.parametrize("prior", bench.PRIORS)
@pytest.mark.parametrize("motion", bench.MOTIONS)
def test_no_interval_is_too_narrow_under_correlated_noise_and_sliding_skin(motion, prior):
    found = collect(motion, SOME, SLOW, prior, clips=4)
    assert bench.covered(found) >= LOW - tolerance(LOW, found)


def test_white_noise_stays_with_the_data():
    found = collect(ROM, NONE, WHITE, "skeleton", clips=2)
    # A prior of 1 cm and more against a centre that is known to a millimetre: a hundredth at most.
    assert np.median([o.share for o in found]) > 0.99

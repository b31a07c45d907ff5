"""The time of every estimator against the number of points and the noise (thesis 6.4)."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mocap_skel.artificial.spheres import cap
from mocap_skel.spherefit import igdk
from mocap_skel.spherefit.moments import Array
from mocap_skel.studies.contenders import CONTENDERS

# The thesis's ranges: any noise of these is tried, and any angle, centre and radius.
NOISE_RANGE = (1e-11, 1e12)
CENTRE = 2.0
LARGEST_RADIUS = 37.0
# With fewer points a call's own cost and the start of GDKE's one pass hide what a point costs.
MANY = 200_000
# The thesis's ratios to GDKE, measured in C.
THESIS = {"lls": 11.05, "igdk": 2.17, "mle_from_mean": 80.0}
METHODS = ("gdke", "ugdk", "pratt", "igdk", "lls", "mle", "mle_from_mean")


@dataclass(frozen=True)
class Trial:
    """One point set, and the seconds that each estimator took for it.

    Attributes:
        points: how many.
        noise: σ, metres.
        angle_deg: half-angle of the cap.
        radius: metres.
        seconds: by key of `CONTENDERS`.
    """

    points: int
    noise: float
    angle_deg: float
    radius: float
    seconds: dict[str, float]


@dataclass(frozen=True)
class Ratio:
    """An estimator's time divided by GDKE's, over the trials of many points.

    Attributes:
        method: key of `CONTENDERS`.
        median, lower, upper: with quartiles.
        small_noise: the median where the noise is below one, as the thesis counts it for the MLE.
        power: exponent of the time in the number of points.
        thesis: its ratio, None where it gives none.
    """

    method: str
    median: float
    lower: float
    upper: float
    small_noise: float
    power: float
    thesis: float | None


def trials(count: int, most_points: int, seed: int) -> Iterator[Trial]:
    """Point sets drawn at random from the thesis's ranges (6.4), each timed with every estimator.

    Numbers of points and noises are drawn evenly in their logarithm.

    Args:
        count: how many.
        most_points: of one set.
        seed: of all that is drawn; times are what they are.

    Example:
        >>> from mocap_skel.studies.speed import trials
        >>> for trial in trials(2, most_points=100, seed=1):
        ...     print(trial.points, sorted(trial.seconds)[:2])
        32 ['gdke', 'igdk']
        97 ['gdke', 'igdk']
    """
    rng = np.random.default_rng(seed)
    for _ in range(count):
        points = round(10 ** rng.uniform(1, np.log10(most_points)))
        noise = 10 ** rng.uniform(*np.log10(NOISE_RANGE))
        degrees, radius = rng.uniform(0, 180), LARGEST_RADIUS * (1 - rng.uniform())
        x = cap(rng, (points,), np.radians(degrees), radius)
        x += rng.uniform(-CENTRE, CENTRE, 3) + noise * rng.normal(size=x.shape)
        yield Trial(points, noise, degrees, radius, time_methods(x, noise, METHODS))


def time_methods(x: Array, noise: float, methods: Sequence[str]) -> dict[str, float]:
    """The best time of each estimator for the same points.

    They take turns, so that the machine's load hits all alike, until each has had a hundredth of a
    second; three turns at least for all but the slow ones. A quick one runs several times in its turn:
    the first finds the caches as the one before it has left them.

    Args:
        x: points (N, 3).
        noise: σ, in the unit of the points.
        methods: keys of `CONTENDERS`.

    Returns:
        Seconds, by method.
    """
    best = dict.fromkeys(methods, np.inf)
    total = dict.fromkeys(methods, 0.0)
    turn = 0
    while left := [m for m in methods if total[m] < 0.01 or (turn < 3 and total[m] < 0.5)]:
        for method in left:
            until = time.perf_counter() + 0.003
            while (start := time.perf_counter()) < until:
                with np.errstate(all="ignore"):
                    CONTENDERS[method].centres(x[None], noise)
                taken = time.perf_counter() - start
                best[method], total[method] = min(best[method], taken), total[method] + taken
        turn += 1
    return best


def time_of_a_sample(count: int = 2000, seed: int = 0) -> float:
    """Seconds that `igdk` takes for one sample and the centre after it.

    Args:
        count: samples over which the time is the mean.
        seed: of the samples.
    """
    x = cap(np.random.default_rng(seed), (count,), np.pi / 3)
    start = time.perf_counter()
    for _ in igdk(x):
        pass
    return (time.perf_counter() - start) / count


def threshold(done: Iterable[Trial]) -> int:
    """The number of points from which on ratios are taken: `MANY`, or that of the smallest set if none has so many."""
    points = [trial.points for trial in done]
    return MANY if max(points) >= MANY else min(points)


def ratios(done: Iterable[Trial]) -> list[Ratio]:
    """Each estimator's time divided by GDKE's, in the trials of `threshold` points or more.

    Example:
        >>> from mocap_skel.studies.speed import METHODS, Trial, ratios
        >>> seconds = dict.fromkeys(METHODS, 0.001) | {"lls": 0.012}
        >>> found = ratios([Trial(1_000_000, 0.1, 90.0, 1.0, seconds)])
        >>> print([(ratio.method, ratio.median, ratio.thesis) for ratio in found if ratio.thesis == 11.05])
        [('lls', 12.0, 11.05)]
    """
    every = list(done)
    many = [trial for trial in every if trial.points >= threshold(every)]
    found = []
    for method in METHODS:
        each = np.array([trial.seconds[method] / trial.seconds["gdke"] for trial in many])
        calm = np.array([trial.noise < 1 for trial in many])
        lower, median, upper = np.percentile(each, [25, 50, 75])
        power = _slope(
            np.log([trial.points for trial in many]),
            np.log([trial.seconds[method] for trial in many]),
        )
        small = float(np.median(each[calm])) if calm.any() else float("nan")
        found.append(
            Ratio(
                method, float(median), float(lower), float(upper), small, float(power),
                THESIS.get(method),
            )
        )  # fmt: skip
    return found


def _slope(x: Array, y: Array) -> float:
    """Slope of the least-squares line through (x, y); NaN without a spread in x."""
    away = x - x.mean()
    square = float(away @ away)
    return float(away @ y / square) if square > 0 else float("nan")

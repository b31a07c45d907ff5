"""Timings of the sphere fits, side by side in one run: `make bench` or `python benchmarks/bench_spheres.py`.

For each number of points, every method on the same array of shape (N, 3), as multiples of `np.sum` over
it; then many small fits at once, the memory that a fit needs beside its input, and what the speed costs
in digits. Ratios are what counts: the machine's load moves the rest.
"""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares
from skspatial.objects import Sphere
from timing import aimed, alternate

from mocap_skel.artificial.spheres import cap
from mocap_skel.spherefit import gdke, lls, mgdk, mle, pratt, sphere_moments, ugdk

SIGMA = 0.001
SIZES = (1_000, 10_000, 100_000, 1_000_000)
# Slower than this many seconds: three rounds are enough.
SLOW = 0.2


def textbook_ugdk(x: np.ndarray) -> np.ndarray:
    """UGDK as the formula reads."""
    d = x - x.mean(axis=0)
    c = np.cov(x.T)
    s = (d * (d**2).sum(axis=1, keepdims=True)).sum(axis=0) / (len(x) - 1)
    return x.mean(axis=0) + 0.5 * np.linalg.solve(c - SIGMA**2 * np.eye(3), s)


def linear(x: np.ndarray) -> np.ndarray:
    """LLS as anybody would write it."""
    system = np.column_stack([2 * x, np.ones(len(x))])
    return np.linalg.lstsq(system, (x**2).sum(axis=1), rcond=None)[0][:3]


def geometric(x: np.ndarray, *, analytic: bool) -> np.ndarray:
    """The MLE by SciPy's Levenberg-Marquardt from the points' mean."""

    def residuals(p: np.ndarray) -> np.ndarray:
        return np.linalg.norm(x - p[:3], axis=1) - p[3]

    def jacobian(p: np.ndarray) -> np.ndarray:
        away = p[:3] - x
        unit = away / np.linalg.norm(away, axis=1, keepdims=True)
        return np.column_stack([unit, -np.ones(len(x))])

    start = np.append(x.mean(axis=0), x.std())
    return least_squares(
        residuals, start, method="lm", **({"jac": jacobian} if analytic else {})
    ).x[:3]


def tasks(x: np.ndarray) -> dict[str, Callable[[], object]]:
    four = x[: len(x) // 4 * 4].reshape(4, -1, 3)
    return {
        "np.sum": lambda: np.sum(x),
        "np.mean(axis=0)": lambda: x.mean(axis=0),
        "our GDKE": lambda: gdke(sphere_moments(x)),
        "our UGDK": lambda: ugdk(sphere_moments(x), SIGMA),
        "our MGDK, 4 markers": lambda: mgdk(sphere_moments(four), SIGMA),
        "our Pratt": lambda: pratt(sphere_moments(x)),
        "textbook numpy UGDK": lambda: textbook_ugdk(x),
        "numpy lstsq (LLS)": lambda: linear(x),
        "our LLS": lambda: lls(x),
        "our MLE, from Pratt": lambda: mle(x),
        "SciPy MLE, analytic": lambda: geometric(x, analytic=True),
        "SciPy MLE, numeric": lambda: geometric(x, analytic=False),
        "scikit-spatial": lambda: Sphere.best_fit(x),
    }


def one_size(count: int) -> None:
    x = cap(np.random.default_rng(0), (count,), np.radians(60), 0.3)
    x += SIGMA * np.random.default_rng(1).normal(size=x.shape) + [1.0, 2.0, 3.0]
    all_tasks = tasks(x)
    once = dict(zip(all_tasks, alternate(*all_tasks.values(), rounds=1), strict=True))
    quick = [name for name in all_tasks if once[name] < SLOW]
    slow = [name for name in all_tasks if name not in quick]
    rounds = 30 if count <= 10_000 else 12
    best = dict(zip(quick, alternate(*(all_tasks[n] for n in quick), rounds=rounds), strict=True))
    best |= zip(slow, alternate(*(all_tasks[n] for n in slow), rounds=2), strict=True)
    floor, ours = best["np.sum"], best["our UGDK"]
    print(f"\n{count:,} points            time ms   / np.sum   / our UGDK")
    for name in all_tasks:
        taken = best[name]
        print(f"  {name:22s} {1e3 * taken:9.3f} {taken / floor:10.1f} {taken / ours:12.2f}")
    if count == SIZES[0]:
        print(f"  our UGDK, microseconds {aimed(1e6 * ours, most=80)}")
    if count == SIZES[-1]:
        print(f"  our UGDK / np.sum      {aimed(ours / floor, most=8)}")


def many_small(sets: int = 1000, count: int = 1000) -> None:
    x = cap(np.random.default_rng(2), (sets, count), np.radians(60), 0.3) + 2.0
    total, batch, whole, loop = alternate(
        lambda: np.sum(x),
        lambda: ugdk(sphere_moments(x)[:, None], SIGMA),
        lambda: pratt(sphere_moments(x)[:, None]),
        lambda: [linear(points) for points in x],
        rounds=7,
    )
    print(f"\n{sets:,} fits of {count:,} points at once, microseconds a fit")
    print(f"  np.sum                 {1e6 * total / sets:9.1f}")
    print(f"  our UGDK, batched      {1e6 * batch / sets:9.1f}")
    print(f"  our Pratt, batched     {1e6 * whole / sets:9.1f}")
    print(f"  numpy lstsq, a loop    {1e6 * loop / sets:9.1f}")


def memory(count: int = 1_000_000) -> None:
    x = np.random.default_rng(3).normal(size=(count, 3))
    print(f"\npeak memory beside an input of {x.nbytes / 2**20:.0f} MiB, MiB")
    for name in ("our UGDK", "textbook numpy UGDK", "numpy lstsq (LLS)"):
        task = tasks(x)[name]
        tracemalloc.start()
        task()
        print(f"  {name:22s} {tracemalloc.get_traced_memory()[1] / 2**20:9.2f}")
        tracemalloc.stop()


def unshifted_gdke(x: np.ndarray) -> np.ndarray:
    """GDKE from one pass of sums about the lab's origin: what the shift of `sphere_moments` is for."""
    n, mean, square = len(x), x.mean(axis=0), (x**2).sum(axis=1)
    second = x.T @ x
    third = x.T @ square - 2 * second @ mean - (square.sum() - 2 * n * mean @ mean) * mean
    return mean + 0.5 * np.linalg.solve(second - n * np.outer(mean, mean), third)


def digits() -> None:
    print("\nrelative error of the centre of an exact sphere of 10 cm, 10 m from the origin")
    print(f"{'':22s} {'180 degrees':>12s} {'60 degrees':>12s} {'20 degrees':>12s}")
    centre = np.array([6.0, 0.0, 8.0])
    methods: dict[str, Callable[[np.ndarray], np.ndarray]] = {
        "our GDKE": lambda x: gdke(sphere_moments(x)).centre,
        "our Pratt": lambda x: pratt(sphere_moments(x)).centre,
        "GDKE without a shift": unshifted_gdke,
        "numpy lstsq (LLS)": linear,
    }
    for name, method in methods.items():
        errors = []
        for degrees in (180, 60, 20):
            x = cap(np.random.default_rng(4), (1000,), np.radians(degrees), 0.1) + centre
            errors.append(np.linalg.norm(method(x) - centre) / 0.1)
        print(f"  {name:20s} {errors[0]:12.1e} {errors[1]:12.1e} {errors[2]:12.1e}")


def main() -> None:
    for size in SIZES:
        one_size(size)
    many_small()
    memory()
    digits()


if __name__ == "__main__":
    main()

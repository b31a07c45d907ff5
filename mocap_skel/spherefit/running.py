"""IGDK: the centre after every sample, from a state whose size does not grow with their number."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mocap_skel.spherefit.estimators import linear_system
from mocap_skel.spherefit.moments import CHUNK, Array, Moments, central_moments


@dataclass(frozen=True, eq=False)
class RunningFit:
    """What IGDK knows after some samples of M markers.

    Attributes:
        centre: (D,), metres; NaN until the samples determine it.
        place: (M, D), where deviations are measured from: the first sample of each marker, metres.
        count: (M,) samples so far.
        sums: (M, D + 2, D + 1), Σ f gᵀ with d = x - place, f = (d, |d|², 1), g = (d, |d|²).

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial.spheres import cap
        >>> from mocap_skel.spherefit import RunningFit, igdk, pratt
        >>> *_, last = igdk(cap(np.random.default_rng(0), (50,), 1.0))
        >>> isinstance(last, RunningFit), last.count.tolist(), pratt(last.moments[0]).rank.tolist()
        (True, [50.0], 3)
    """

    centre: Array
    place: Array
    count: Array
    sums: Array

    @property
    def moments(self) -> Moments:
        """(M,): those of all samples so far, for any other estimator."""
        return central_moments(self.count, np.nan_to_num(self.place), self.sums)


def igdk(samples: Iterable[ArrayLike], sigma: float = 0.0) -> Iterator[RunningFit]:
    """Incremental GDK (thesis Table 4): a centre after each sample, in memory that does not grow.

    Exactly the running sums of `mgdk`, so that the last centre is the batch answer to rounding; the
    system of D unknowns is solved anew each time, which costs less than keeping its inverse up to date
    and does not drift.

    Args:
        samples: each (D,) for one marker or (M, D) for several about one centre, metres; NaN = missing.
        sigma: noise standard deviation, metres.

    Yields:
        One fit for each sample, when it is asked for; its centre is NaN until the samples determine it.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial.spheres import cap
        >>> from mocap_skel.spherefit import igdk
        >>> for fit in igdk(cap(np.random.default_rng(0), (4,), np.pi)):
        ...     print(int(fit.count[0]), np.isfinite(fit.centre).all())
        1 False
        2 False
        3 False
        4 True
    """
    state: RunningFit | None = None
    for sample in samples:
        x = np.atleast_2d(np.asarray(sample, dtype=np.float64))
        _, state = _advance(state, x[:, None], sigma)
        yield state


def running_centres(points: ArrayLike, sigma: float = 0.0) -> Array:
    """The centres that `igdk` gives after each of N samples, many samples at once.

    Args:
        points: (M, N, D) or (N, D), metres, NaN = missing.
        sigma: noise standard deviation, metres.

    Returns:
        (N, D), metres, NaN until the samples determine a centre.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial.spheres import cap
        >>> from mocap_skel.spherefit import running_centres
        >>> centres = running_centres(cap(np.random.default_rng(0), (100,), 1.0))
        >>> print(centres.shape, np.isnan(centres[:3]).all(), np.abs(centres[-1]).max() < 1e-9)
        (100, 3) True True
    """
    x = np.asarray(points, dtype=np.float64)
    x = x[None] if x.ndim == 2 else x
    centres = np.empty(x.shape[1:])
    state: RunningFit | None = None
    for k in range(0, x.shape[1], CHUNK // 8):
        block = slice(k, k + CHUNK // 8)
        centres[block], state = _advance(state, x[:, block], sigma)
    return centres


def _advance(state: RunningFit | None, x: Array, sigma: float) -> tuple[Array, RunningFit]:
    """Centres (n, D) after each of n more samples x (M, n, D), and the state after the last."""
    markers, size, dimension = x.shape
    if state is None:
        state = RunningFit(
            np.full(dimension, np.nan), np.full((markers, dimension), np.nan), np.zeros(markers),
            np.zeros((markers, dimension + 2, dimension + 1)),
        )  # fmt: skip
    seen: NDArray[np.bool_] = np.asarray(np.isfinite(x).all(axis=-1))
    new = np.isnan(state.place[:, 0]) & seen.any(axis=-1)
    first = x[np.arange(markers), seen.argmax(axis=-1)]
    place = np.where(new[:, None], first, state.place)
    # Samples last: the running sums then go along contiguous memory.
    f = np.empty((markers, dimension + 2, size))
    f[:, :dimension] = np.where(seen[..., None], x - place[:, None], 0.0).swapaxes(1, 2)
    np.einsum("mdn,mdn->mn", f[:, :dimension], f[:, :dimension], out=f[:, dimension])
    f[:, -1] = seen
    sums = state.sums[..., None] + np.cumsum(f[:, :, None] * f[:, None, :-1], axis=-1)
    count = state.count[:, None] + np.cumsum(seen, axis=1)
    m = central_moments(count.T, np.nan_to_num(place), np.moveaxis(sums, -1, 0))
    middle, matrix, right = linear_system(m, sigma)
    shift = _positive_solution(np.moveaxis(matrix, 0, -1), right.T)
    shift[:, m.count.max(axis=-1) <= dimension] = np.nan
    centres = middle + shift.T
    return centres, RunningFit(centres[-1], place, count[:, -1], sums[..., -1])


def _positive_solution(matrix: Array, right: Array) -> Array:
    """Solutions (D, n) of n symmetric systems (D, D, n), (D, n) by elimination, all at once.

    NaN where a matrix is not positive definite: the points do not span a sphere, or are lost in noise.
    """
    a, b = matrix.copy(), right.copy()
    least = 64 * np.finfo(float).eps * np.trace(matrix)
    with np.errstate(invalid="ignore", divide="ignore"):
        for i in range(len(b)):
            a[i, i] = np.where(a[i, i] > least, a[i, i], np.nan)
            for j in range(i + 1, len(b)):
                factor = a[j, i] / a[i, i]
                a[j, i:] -= factor * a[i, i:]
                b[j] -= factor * b[i]
        for i in reversed(range(len(b))):
            for j in range(i + 1, len(b)):
                b[i] -= a[i, j] * b[j]
            b[i] /= a[i, i]
    return b

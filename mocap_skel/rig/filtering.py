"""Low-pass filtering of marker trajectories, as biomechanics does it: Butterworth, to and fro."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mocap_skel.rig.bridging import runs
from mocap_skel.segments.pose import Array

# A second-order filter run to and fro is of fourth order and has no lag; each run lowers the frequency at which
# half of the power is left, which the design makes up for (Winter 2009, Biomechanics and Motor Control, 2.4.4).
TWO_RUNS = 0.802
# Hertz: where the residual analysis looks. Below it a person's own movement would go, above it no person moves.
LOWEST, HIGHEST = 4.0, 20.0
# The share of the frequencies above HIGHEST and below the Nyquist frequency whose residual is noise alone.
STRAIGHT = 0.5


def low_passed(points: Array, rate: float, cutoff: float) -> Array:
    """Trajectories without what is faster than a frequency, zero-phase Butterworth of fourth order.

    Each stretch between gaps is filtered by itself; gaps stay, and so do stretches too short for the filter.

    Args:
        points: (frames, markers, 3), NaN = missing.
        rate: frames a second.
        cutoff: hertz, at which half of the power is left (-3 dB); at or above half the rate nothing is done.
    """
    from scipy.signal import butter, sosfiltfilt

    if cutoff / TWO_RUNS >= 0.5 * rate:
        return points
    sections = butter(2, cutoff / TWO_RUNS, fs=rate, output="sos")
    # Odd extension over the time that the filter remembers.
    pad = max(9, int(rate / cutoff))
    out = points.copy()
    for m in range(points.shape[1]):
        for start, stop in runs(np.isfinite(points[:, m, 0])):
            if stop - start > pad:
                out[start:stop, m] = sosfiltfilt(
                    sections, points[start:stop, m], axis=0, padlen=pad
                )
    return out


def chosen_cutoff(points: Sequence[Array], rate: float) -> float | None:
    """The frequency (hertz) below which the markers' movement lies, by residual analysis (Winter 2009, 2.4.4.3).

    The root mean square of what a filter takes away falls with its frequency, steeply while it takes movement, then in
    a straight line while it takes noise only. The line at zero frequency is the noise; the chosen frequency is
    the one whose residual is as large.

    Args:
        points: of each segment (frames, markers, 3).
        rate: frames a second.

    Returns:
        None where the clip is too slow (under twice HIGHEST) or too short to tell.
    """
    every = np.concatenate([p for p in points if p.shape[1]], axis=1)
    whole = np.isfinite(every[..., 0]).all(axis=0)
    if rate <= 2.5 * HIGHEST or len(every) < rate or not whole.any():
        return None
    track = every[:, whole].reshape(len(every), -1)
    # The residual of a filter is what its transfer function leaves, so that all are found by one transform.
    trend = np.linspace(0, 1, len(track))[:, None] * (track[-1] - track[0]) + track[0]
    power = (np.abs(np.fft.rfft(track - trend, axis=0)) ** 2).mean(axis=1)
    frequency = np.fft.rfftfreq(len(track), 1.0 / rate)
    tried = np.arange(1.0, 0.5 * rate * TWO_RUNS, 0.5)
    gone = (1.0 - 1.0 / (1.0 + (frequency[None] / (tried[:, None] / TWO_RUNS)) ** 4)) ** 2
    residual = np.sqrt(2.0 * (gone * power).sum(axis=1)) / len(track)
    noisy = tried >= HIGHEST + STRAIGHT * (tried[-1] - HIGHEST)
    slope, noise = np.polyfit(tried[noisy], residual[noisy], 1)
    if slope >= 0 or noise <= 0:
        return HIGHEST
    return float(np.clip(tried[int(np.argmax(residual <= noise))], LOWEST, HIGHEST))

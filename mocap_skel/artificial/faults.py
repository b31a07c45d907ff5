"""What cameras, labelling and skin do to markers: noise, slide, drop-outs, outliers, swaps, all seeded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Swap:
    """Two markers whose labels are exchanged from one frame up to before another.

    Attributes:
        first, second: their labels.
        start, stop: indices of frames, `stop` itself left out; None = to the end of the clip.

    Example:
        >>> from mocap_skel.artificial import Faults, Swap, human, marker_set, record, still
        >>> swapped = Faults(swaps=(Swap("LKNE", "RKNE", start=5),))
        >>> clip = record(human(), marker_set("cmu"), still(1, 10), swapped)
        >>> knees = [clip.labels.index(label) for label in ("LKNE", "RKNE")]
        >>> clip.wrong[:, knees].sum(axis=0).tolist()
        [5, 5]
    """

    first: str
    second: str
    start: int = 0
    stop: int | None = None


@dataclass(frozen=True)
class Faults:
    """How a recording departs from the truth; the default is not at all.

    Attributes:
        sigma: standard deviation of white noise on each coordinate, metres.
        correlated: standard deviation of additional noise on each coordinate that is correlated
            in time (first-order autoregressive), metres.
        correlation_time: its time constant, seconds.
        slide: how far the skin carries a marker along the segment's surface when the joint nearest
            to it is bent by 90 degrees, metres, at most; a slow drift of a fifth of that comes on
            top. In proportion to sin(angle / 2), in a direction of each marker's own.
        tissue: least and most that soft tissue carries a marker along the bone when the joint nearest to it
            turns by 90 degrees, metres; in proportion to the angle, each marker by a size and ways of its own.
        wobble: standard deviation of what else a pose does to the skin, metres, along it: smooth in the
            pose, the same whenever the joint comes back to it.
        together: share of the variance of both that the markers of a segment have in common, as the skin of
            a whole thigh moves at once; such movement leaves their shape alone.
        dropout: share of the samples that are missing, 0 to below 1, independently per marker.
        burst: mean length of a drop-out, frames. Where `dropout` leaves less than one frame
            between bursts on average, they last longer.
        lost: labels of markers that are missing in the whole clip.
        outliers: share of the samples that are somewhere else, 0 to below 1, independently per marker.
        outlier_size: how far away, metres, in a direction of each burst's own: a ghost or a jump.
        outlier_burst: mean length of a stay there, frames; 1 gives single samples almost only.
        swaps: labels that are exchanged for a while, one after the other.

    Raises:
        ValueError: a value out of its range.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial import Faults, human, marker_set, record, still
        >>> faults = Faults(sigma=0.001, dropout=0.2, lost=("C7",))
        >>> clip = record(human(), marker_set("cmu"), still(10, 60), faults)
        >>> gone = np.isnan(clip.points[..., 0]).mean(axis=0)
        >>> print(gone[clip.labels.index("C7")], 0.1 < np.median(gone) < 0.3)
        1.0 True
    """

    sigma: float = 0.0
    correlated: float = 0.0
    correlation_time: float = 0.5
    slide: float = 0.0
    tissue: tuple[float, float] = (0.0, 0.0)
    wobble: float = 0.0
    together: float = 0.5
    dropout: float = 0.0
    burst: float = 10.0
    lost: tuple[str, ...] = ()
    outliers: float = 0.0
    outlier_size: float = 0.5
    outlier_burst: float = 1.0
    swaps: tuple[Swap, ...] = ()

    def __post_init__(self) -> None:
        if min(self.sigma, self.correlated, self.slide) < 0:
            raise ValueError("sigma, correlated and slide are lengths, they cannot be negative")
        if not (0 <= self.tissue[0] <= self.tissue[1] and self.wobble >= 0):
            raise ValueError(
                f"tissue is a least and a most length and wobble one, got {self.tissue}, {self.wobble}"
            )
        if not 0 <= self.together <= 1:
            raise ValueError(f"together is a share from 0 to 1, got {self.together}")
        if not self.correlation_time > 0:
            raise ValueError(f"correlation_time must be positive, got {self.correlation_time}")
        if not 0 <= self.dropout < 1:
            raise ValueError(f"dropout is a share from 0 to below 1, got {self.dropout}")
        if not self.burst >= 1:
            raise ValueError(f"burst must be at least one frame, got {self.burst}")
        if not 0 <= self.outliers < 1:
            raise ValueError(f"outliers is a share from 0 to below 1, got {self.outliers}")
        if not (self.outlier_size >= 0 and self.outlier_burst >= 1):
            raise ValueError("outlier_size cannot be negative, outlier_burst not below one frame")


def correlated_noise(shape: tuple[int, ...], memory: float, rng: np.random.Generator) -> Array:
    """Noise that follows itself from frame to frame: first-order autoregressive, of unit variance.

    Args:
        shape: of the result, frames first.
        memory: correlation from one frame to the next, 0 to below 1.
        rng: source of randomness.

    Returns:
        An array of that shape; stationary, so that it may start anywhere.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial.faults import correlated_noise
        >>> noise = correlated_noise((20_000,), 0.5, np.random.default_rng(0))
        >>> print(np.corrcoef(noise[1:], noise[:-1])[0, 1].round(1))
        0.5
    """
    noise = rng.standard_normal(shape)
    noise[1:] *= np.sqrt(1 - memory**2)
    # x[t] = Σ memory^k e[t - k]: each pass doubles the number of terms, in place of a loop.
    step = 1
    while step < shape[0] and memory**step > 1e-17:
        noise[step:] += memory**step * noise[:-step]
        step *= 2
    return noise


def slide_tracks(half_sines: Array, normals: Array, rate: float, rng: np.random.Generator) -> Array:
    """Displacements along the skin for a slide of one metre (see `Faults.slide`).

    Args:
        half_sines: of the joint nearest to each marker: axis times sin(angle / 2),
            (frames, markers, 3), in the axes of the marker's segment.
        normals: unit vectors off the skin in the same axes, (markers, 3).
        rate: frames a second.
        rng: source of randomness.

    Returns:
        (frames, markers, 3), in the axes of the marker's segment.
    """
    frames, markers, _ = half_sines.shape
    own, _ = np.linalg.qr(rng.standard_normal((markers, 3, 3)))
    bent = np.einsum("mij,fmj->fmi", own, half_sines) * np.sqrt(2.0)
    hertz, phase = rng.uniform([[[0.02]], [[0.0]]], [[[0.1]], [[2 * np.pi]]], (2, markers, 3))
    times = np.arange(frames)[:, None, None] / rate
    drift = 0.2 / np.sqrt(3) * np.sin(2 * np.pi * hertz * times + phase)
    free = bent + drift
    return np.asarray(free - (free * normals).sum(axis=-1, keepdims=True) * normals)


def missing_samples(
    frames: int, markers: int, share: float, burst: float, rng: np.random.Generator
) -> Mask:
    """Where samples drop out, (frames, markers): a chain of two states, seen and missing, for each marker.

    Both states last for geometrically distributed times, so that the chain may start anywhere in
    one, and a share of the samples is missing on average; arguments as in `Faults`.
    """
    if share == 0:
        return np.zeros((frames, markers), dtype=np.bool_)
    gone = max(burst, share / (1 - share))
    seen = gone * (1 - share) / share
    mask = np.empty((frames, markers), dtype=np.bool_)
    pairs = frames // 2 + 1
    for marker in range(markers):
        missing_first = bool(rng.random() < share)
        means = [gone, seen] if missing_first else [seen, gone]
        lengths = rng.geometric(1 / np.tile(means, pairs))
        states = np.tile([missing_first, not missing_first], pairs)
        # Lengths past the end are cut first: a long clip's would be repeated to many times its own.
        count = int(np.searchsorted(np.cumsum(lengths), frames)) + 1
        mask[:, marker] = np.repeat(states[:count], lengths[:count])[:frames]
    return mask


def outlier_tracks(
    frames: int, markers: int, share: float, burst: float, rng: np.random.Generator
) -> tuple[Mask, Array]:
    """Which samples are somewhere else, (frames, markers), and their unit directions (frames, markers, 3).

    A stay keeps its direction; shares and lengths as for `missing_samples`.
    """
    away = missing_samples(frames, markers, share, burst, rng)
    directions = rng.standard_normal((frames, markers, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    starts = away & ~np.vstack([np.zeros((1, markers), dtype=np.bool_), away[:-1]])
    # A sample takes the direction that was drawn for the frame in which its stay began.
    begun = np.maximum.accumulate(np.where(starts, np.arange(frames)[:, None], 0), axis=0)
    return away, np.take_along_axis(directions, begun[..., None], axis=0)

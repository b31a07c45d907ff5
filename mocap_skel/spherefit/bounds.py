"""How well a centre can be known: coverage, the largest noise, independent samples, Cramér-Rao bounds."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mocap_skel.spherefit.moments import Array


def coverage_angle(weakest_sd: ArrayLike, radius: ArrayLike) -> Array:
    """Half-angle of the even cap whose weakest spread is that of the points.

    Points spread evenly over a cap of half-angle θ on a sphere of radius r have the standard deviation
    (r/√3) sin²(θ/2) in the direction in which it is least (docs/method.md, coverage).

    Args:
        weakest_sd: √λ_min, the points' standard deviation in the direction in which it is least, metres.
        radius: metres; any shape that broadcasts with the first.

    Returns:
        θ, radians; π where even a whole sphere has a smaller spread.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.spherefit import coverage_angle
        >>> print(np.degrees(coverage_angle(0.0433, radius=0.3)).round(1))
        60.0
    """
    sine = np.sqrt(3.0) * np.asarray(weakest_sd) / np.maximum(radius, np.finfo(float).tiny)
    return np.asarray(2 * np.arcsin(np.sqrt(np.clip(sine, 0.0, 1.0))))


def largest_noise(radius: ArrayLike, angle: ArrayLike) -> Array:
    """Noise at which a cap stops to show its centre: σ < (r/√3) sin²(θ/2), the thesis's criterion (6.6).

    It is the weakest standard deviation of points spread evenly over the cap: `coverage_angle` the
    other way round.

    Args:
        radius: metres.
        angle: θ, the cap's half-angle, radians; any shape that broadcasts with the first.

    Returns:
        The largest σ, metres.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.spherefit import largest_noise
        >>> print(largest_noise(0.3, np.radians([20, 60, 180])).round(4))
        [0.0052 0.0433 0.1732]
    """
    return np.asarray(np.asarray(radius) / np.sqrt(3.0) * np.sin(np.asarray(angle) / 2) ** 2)


def crlb_circle(count: ArrayLike, sigma: ArrayLike, angle: ArrayLike) -> Array:
    """Least covariance that a circle's centre and radius can have: the Cramér-Rao bound (thesis 6.6).

    For points spread evenly over an arc of ± θ, each with independent noise.

    Args:
        count: number of points.
        sigma: noise standard deviation, metres.
        angle: θ, radians. The three may have any shapes (...) that broadcast.

    Returns:
        (..., 3, 3), m²: centre across the arc's axis (which runs from the centre to the arc's middle),
        centre along it, radius.

    Raises:
        ValueError: an angle outside (0, π].

    Example:
        >>> import numpy as np
        >>> from mocap_skel.spherefit import crlb_circle
        >>> print(np.sqrt(np.diag(crlb_circle(100, 0.001, np.pi / 2))).round(5))
        [0.00014 0.00032 0.00023]
    """
    theta = _checked(angle)
    sine, cosine = np.sin(theta), np.cos(theta)
    across, both = _arc_terms(theta)
    matrix = np.zeros((*theta.shape, 3, 3))
    matrix[..., 0, 0] = both / across
    matrix[..., 1, 1] = 2 * theta
    matrix[..., 1, 2] = matrix[..., 2, 1] = -2 * sine
    matrix[..., 2, 2] = theta + cosine * sine
    return _scaled(matrix, 2 * theta / both, count, sigma)


def _arc_terms(theta: Array) -> tuple[Array, Array]:
    """Θ - cos θ sin θ and 2θ (θ + cos θ sin θ) - 4 sin² θ, by their series where θ is small.

    There the leading digits of the differences cancel.
    """
    x = 2 * theta
    series = x < 0.2
    across = np.where(
        series,
        x**3 / 12 * (1 - x**2 / 20 + x**4 / 840 - x**6 / 60480),
        theta - np.cos(theta) * np.sin(theta),
    )
    both = np.where(
        series,
        x**6 / 720 * (1 - x**2 / 28 + x**4 / 1680 - x**6 / 166320),
        2 * theta * (theta + np.cos(theta) * np.sin(theta)) - 4 * np.sin(theta) ** 2,
    )
    return across, both


def crlb_sphere(count: ArrayLike, sigma: ArrayLike, angle: ArrayLike) -> Array:
    """Least covariance that a sphere's centre and radius can have: the Cramér-Rao bound (thesis 6.6).

    For points spread evenly over a cap of half-angle θ, each with independent noise.

    Args:
        count: number of points.
        sigma: noise standard deviation, metres.
        angle: θ, radians. The three may have any shapes (...) that broadcast.

    Returns:
        (..., 4, 4), m²: centre across the cap's axis (twice), centre along it, radius.

    Raises:
        ValueError: an angle outside (0, π].

    Example:
        >>> import numpy as np
        >>> from mocap_skel.spherefit import crlb_sphere
        >>> print(np.sqrt(np.diag(crlb_sphere(100, 0.001, np.pi))).round(6))
        [0.000173 0.000173 0.000173 0.0001  ]
    """
    theta = _checked(angle)
    sine2, cosine2 = np.sin(theta / 2) ** 2, np.cos(theta / 2) ** 2
    matrix = np.zeros((*theta.shape, 4, 4))
    matrix[..., 0, 0] = matrix[..., 1, 1] = sine2 / (2 + np.cos(theta))
    matrix[..., 2, 2] = 1.0
    matrix[..., 2, 3] = matrix[..., 3, 2] = -cosine2
    matrix[..., 3, 3] = (3 * cosine2**2 + sine2**2) / 3
    return _scaled(matrix, 3 / sine2**2, count, sigma)


def _checked(angle: ArrayLike) -> Array:
    theta = np.asarray(angle, dtype=np.float64)
    if not bool(((theta > 0) & (theta <= np.pi)).all()):
        raise ValueError(f"a half-angle lies in (0, π] radians, got {theta}")
    return theta


def _scaled(matrix: Array, factor: Array, count: ArrayLike, sigma: ArrayLike) -> Array:
    scale = factor * np.asarray(sigma, dtype=np.float64) ** 2 / np.asarray(count, dtype=np.float64)
    return np.asarray(matrix * scale[..., None, None])


def effective_counts(residuals: ArrayLike) -> Array:
    """Number of independent samples in each marker's residuals: N / integrated autocorrelation time.

    Noise of motion capture is correlated in time, so frames are not independent samples. The
    autocorrelation is summed up to its first value that is not positive (after Geyer 1992, Practical
    Markov chain Monte Carlo, initial positive sequence).

    Args:
        residuals: (frames, M), any unit, NaN = missing.

    Returns:
        (M,), between 1 and N; 0 for a marker without samples.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.spherefit import effective_counts
        >>> white = np.random.default_rng(0).normal(size=(1000, 1))
        >>> slow = np.repeat(white[:100], 10, axis=0)
        >>> print(effective_counts(slow) < 0.2 * effective_counts(white))
        [ True]
    """
    e = np.asarray(residuals, dtype=np.float64).T
    seen = np.isfinite(e)
    n = seen.sum(axis=-1)
    e = np.where(seen, e, 0.0)
    largest = np.abs(e).max(axis=-1, initial=0.0)
    e = np.where(seen, e - e.sum(axis=-1, keepdims=True) / np.maximum(n, 1)[:, None], 0.0)
    frames = e.shape[-1]
    if frames < 2:
        return np.asarray(n, dtype=np.float64)
    # A lag seen in a few pairs only is noise; a tenth of the series is long enough for any memory
    # that leaves ten independent samples. Padding by the lags keeps the correlation from wrapping.
    lags = min(max(frames // 10, 2), frames)
    size = 1 << (frames + lags - 1).bit_length()
    correlation = _autocorrelation(e, size)[:, :lags]
    if bool(seen.all()):
        correlation /= np.arange(frames, frames - lags, -1)
    else:
        pairs = np.rint(_autocorrelation(seen.astype(np.float64), size)[:, :lags])
        correlation = np.where(pairs > 0, correlation / np.maximum(pairs, 1.0), 0.0)
    variance = correlation[:, :1]
    # What is left of a constant is rounding, and has no memory to speak of.
    constant = variance <= (64 * np.finfo(float).eps * largest[:, None]) ** 2
    rho = np.where(constant, 0.0, correlation[:, 1:] / np.where(constant, 1.0, variance))
    positive = np.logical_and.accumulate(rho > 0, axis=-1)
    time = 1.0 + 2.0 * np.where(positive, rho, 0.0).sum(axis=-1)
    return np.asarray(np.where(n > 0, np.clip(n / time, 1.0, np.maximum(n, 1)), 0.0))


def common_markers(residuals: ArrayLike, away: ArrayLike) -> float:
    """How many markers tell the same of a centre: 1 if all are independent, at most their number.

    What a sample says of the centre is its residual times its direction. Where markers have noise in
    common, as that of the frame they are seen in, the variance of the sum over markers is larger than the
    sum of their variances, by this ratio (the design effect of a cluster sample, Kish 1965).

    Args:
        residuals: (frames, M), metres, NaN = missing.
        away: (frames, M, 3), the markers from their means, metres.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.spherefit import common_markers
        >>> rng = np.random.default_rng(0)
        >>> noise, away = rng.normal(size=(50, 1)), rng.normal(size=(50, 1, 3))
        >>> print(round(common_markers(np.repeat(noise, 3, axis=1), np.repeat(away, 3, axis=1)), 6))
        3.0
    """
    e, d = np.asarray(residuals, dtype=np.float64), np.asarray(away, dtype=np.float64)
    pull = np.where(np.isfinite(e)[..., None], e[..., None] * d, 0.0)
    alone = float(np.einsum("fmi,fmi->", pull, pull))
    together = pull.sum(axis=1)
    return max(float(np.einsum("fi,fi->", together, together)) / alone, 1.0) if alone > 0 else 1.0


def smooth_share(residuals: ArrayLike) -> Array:
    """Share of each marker's residual variance that stays from one frame to the next.

    The correlation of neighbours, less twice its own standard error (1/√N for independent noise): 0 for
    noise of cameras, near 1 for skin, which moves with the body.

    Args:
        residuals: (frames, M), any unit, NaN = missing.

    Returns:
        (M,), between 0 and 1; 0 where no two frames follow each other.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.spherefit import smooth_share
        >>> skin = np.sin(np.linspace(0, 20, 1000))
        >>> noise = np.random.default_rng(1).normal(size=1000)
        >>> print(smooth_share(np.column_stack([skin, noise])).round(2))
        [0.94 0.  ]
    """
    e = np.asarray(residuals, dtype=np.float64)
    both = np.isfinite(e[1:]) & np.isfinite(e[:-1])
    first, second = (np.where(both, part, 0.0) for part in (e[:-1], e[1:]))
    square = 0.5 * (first * first + second * second).sum(axis=0)
    product = (first * second).sum(axis=0)
    chance = 2.0 / np.sqrt(np.maximum(both.sum(axis=0), 1))
    share = product / np.maximum(square, np.finfo(float).tiny)
    return np.asarray(np.clip(share - chance, 0.0, 1.0))


def _autocorrelation(series: Array, size: int) -> Array:
    spectrum = np.fft.rfft(series, size)
    return np.asarray(np.fft.irfft(spectrum.real**2 + spectrum.imag**2, size))


def centre_covariance(
    covariance: Array,
    counts: Array,
    radius: Array,
    noise: Array,
    reach: ArrayLike,
    weights: Array | None = None,
) -> Array:
    """Covariance of a fitted centre, from the spread of the points and the noise that they have.

    [A B⁻¹ A + I / reach²]⁻¹, where A = Σ_p W_p C_p is the system that was solved and
    B = Σ_p W_p² r_p² σ_p² C_p / N_p the covariance of its right side, with effective sample counts N_p. For
    the weights W_p = N_p / (r_p σ_p)² that markers deserve, A B⁻¹ A is Σ_p N_p C_p / (r_p σ_p)²: the
    Cramér-Rao bound for the points that were measured (docs/method.md, standard error). In a direction
    that the data do not show the covariance would be infinite; what is known there is only that the joint
    lies within reach of its markers.

    Args:
        covariance: (M, D, D), the markers' covariance without noise, m².
        counts: (M,), effective samples.
        radius: (M,), metres.
        noise: (M,), variance of the radial residuals, m².
        reach: how far the centre can be, metres.
        weights: (M,), how much all samples of each marker counted together; those that they deserve if
            None.

    Returns:
        (D, D), m².

    Example:
        >>> import numpy as np
        >>> from mocap_skel.spherefit import centre_covariance
        >>> flat = np.diag([0.01, 0.01, 0.0])[None]  # a marker that moves in a plane
        >>> found = centre_covariance(flat, np.array([100.0]), np.array([0.2]), np.array([1e-6]), 0.4)
        >>> print(np.sqrt(np.diag(found)).round(5).tolist())
        [0.0002, 0.0002, 0.4]
    """
    # Exact data have no residual; rounding of the places is the least that there is.
    least = (64 * np.finfo(float).eps * np.maximum(np.asarray(reach), np.finfo(float).eps)) ** 2
    deserved = counts / (np.maximum(radius**2, least) * np.maximum(noise, least))
    if weights is None:
        information = np.einsum("p,pde->de", deserved, covariance)
    else:
        share = weights / np.maximum(weights.max(), np.finfo(float).tiny)
        cost = np.where(deserved > 0, share**2 / np.where(deserved > 0, deserved, 1.0), 0.0)
        system, right = (np.einsum("p,pde->de", w, covariance) for w in (share, cost))
        values, axes = np.linalg.eigh(right)
        shown = values > 64 * np.finfo(float).eps * values[-1]
        part = system @ axes[:, shown]
        information = (part / values[shown]) @ part.T
    # By eigenvectors: an exact hinge has directions that differ by more than the digits of a number.
    values, axes = np.linalg.eigh(information)
    known = np.maximum(values, 0.0) + 1.0 / np.maximum(np.asarray(reach) ** 2, least)
    return np.asarray((axes / known) @ axes.T)

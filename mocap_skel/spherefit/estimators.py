"""Closed-form centres of spheres, circles and hyperspheres from their moments.

Every estimator takes the moments of M markers on concentric spheres, batch shape (..., M), and
gives one centre for them and a radius each; a single point set may come without the marker axis.
All solve the same linear system and differ in the noise that they take away from C (docs/estimators.md).
The thesis is J. K. Knight, Rotation Points from Motion Capture Data Using a Closed Form Solution, 2008.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mocap_skel.spherefit.moments import Array, Moments
from mocap_skel.spherefit.system import (
    DegenerateSphereError,
    SphereFit,
    System,
    pool,
    radii,
    with_marker_axis,
)


def gdke(m: Moments, *, strict: bool = True) -> SphereFit:
    """Generalised Delogne-Kåsa: the least-squares sphere of |x - c|² - r², without any noise taken away.

    Its centre is too near to noisy points where they cover little of the sphere. The answer equals that of
    `lls`; for several markers it is that of Gamage and Lasenby 2002 (J. Biomech. 35, 87).

    Args:
        m: moments, batch shape (..., M) or ().
        strict: raise for a degenerate member of a batch; otherwise its centre and radii are NaN.

    Returns:
        Centre (..., D) and radii (..., M), metres, with what the points say of them.

    Raises:
        DegenerateSphereError: fewer than D + 1 points, or points in a plane, on a line, all equal.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.spherefit import gdke, sphere_moments
        >>> x = [[3, 0, 0], [1, 2, 0], [1, 0, 2], [-1, 0, 0], [1, -2, 0]]
        >>> fit = gdke(sphere_moments(x))  # about (1, 0, 0)
        >>> print(np.abs(fit.centre - [1, 0, 0]).max() < 1e-9, fit.radius.round(6))
        True 2.0
    """
    return mgdk(m, 0.0, strict=strict)


def ugdk(
    m: Moments, sigma: ArrayLike, shape: ArrayLike | None = None, *, strict: bool = True
) -> SphereFit:
    """Unbiased GDK (thesis 6.6): `mgdk` under the name that it has for one marker.

    Args:
        m: moments, batch shape (...) with or without a marker axis.
        sigma: noise standard deviation, metres.
        shape: as for `mgdk`.
        strict: as for `mgdk`.

    Raises:
        DegenerateSphereError: as for `mgdk`.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial.spheres import cap
        >>> from mocap_skel.spherefit import gdke, sphere_moments, ugdk
        >>> rng = np.random.default_rng(0)
        >>> x = cap(rng, (5000,), np.pi / 4, radius=0.2) + 0.005 * rng.normal(size=(5000, 3))
        >>> m = sphere_moments(x)
        >>> print(gdke(m).centre[2] > 0.01, abs(ugdk(m, sigma=0.005).centre[2]) < 0.003)
        True True
    """
    return mgdk(m, sigma, shape, strict=strict)


def mgdk(
    m: Moments,
    sigma: ArrayLike,
    shape: ArrayLike | None = None,
    weights: ArrayLike | None = None,
    *,
    strict: bool = True,
) -> SphereFit:
    """Unbiased GDK of one or several markers about one centre (thesis 6.6).

    c = [Σ_p (C_p - Σ̂_p)]⁻¹ Σ_p [(C_p - Σ̂_p) x̄_p + ½ S_p]: GDKE with the covariance of the noise taken
    away from that of the points.

    Args:
        m: moments, batch shape (..., M) or ().
        sigma: noise standard deviation, metres, shape () or (...).
        shape: Σ̂_p / sigma², the noise by direction, shape (..., M, D, D) or (D, D); the unit matrix if None.
        weights: (..., M), how much each marker's samples count, not negative; all alike if None, as
            in the thesis. `marker_weights` gives those that markers of different noise deserve.
        strict: raise for a degenerate member of a batch; otherwise its centre and radii are NaN.

    Returns:
        Centre (..., D) and radii (..., M), metres, with what the points say of them.

    Raises:
        DegenerateSphereError: as for `gdke`, or the noise is no smaller than the points' weakest spread.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial.spheres import cap
        >>> from mocap_skel.spherefit import mgdk, sphere_moments
        >>> rng = np.random.default_rng(0)
        >>> x = np.stack([cap(rng, (500,), 1.0, radius) for radius in (0.2, 0.3)])  # two markers
        >>> fit = mgdk(sphere_moments(x + 0.001 * rng.normal(size=x.shape)), sigma=0.001)
        >>> print(np.abs(fit.centre).max() < 0.001, fit.radius.round(2))
        True [0.2 0.3]
    """
    m, alone = with_marker_axis(m)
    system = pool(m, shape, weights)
    noise = np.broadcast_to(np.asarray(sigma, dtype=np.float64) ** 2, system.square.shape)
    if system.noise is not None and system.noise_shift is not None:
        # A member whose noise is not known has no answer, as if it were larger than the spread; the
        # others must not pay for it.
        unknown: NDArray[np.bool_] = np.asarray(~np.isfinite(system.noise).all(axis=(-1, -2)))
        if unknown.any():
            spread = 1.0 + 2.0 * np.trace(system.covariance, axis1=-2, axis2=-1)
            large = spread[..., None, None] * np.eye(m.mean.shape[-1])
            noise = np.where(unknown, 1.0, noise)
            system = replace(
                system,
                noise=np.where(unknown[..., None, None], large, system.noise),
                noise_shift=np.where(unknown[..., None], 0.0, system.noise_shift),
            )
    return _solve(m, system, noise, shape, strict, alone)


def pratt(m: Moments, *, strict: bool = True) -> SphereFit:
    """Pratt's fit: needs no noise level, since it finds one from the points' own residual.

    Chang and Pollard 2007 (J. Biomech. 40, 1392) for several markers. Their generalised eigenproblem comes down to
    UGDK with σ² = η, the smallest root of a falling function on [0, λ_min(C)): an estimate of the noise
    that never reaches the points' weakest spread.

    Args:
        m: moments, batch shape (..., M) or ().
        strict: raise for a degenerate member of a batch; otherwise its centre and radii are NaN.

    Returns:
        Centre (..., D), radii (..., M) and `sigma` (...), metres.

    Raises:
        DegenerateSphereError: as for `gdke`.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial.spheres import cap
        >>> from mocap_skel.spherefit import pratt, sphere_moments
        >>> rng = np.random.default_rng(0)
        >>> x = cap(rng, (5000,), np.pi / 4, radius=0.2) + 0.005 * rng.normal(size=(5000, 3))
        >>> fit = pratt(sphere_moments(x))
        >>> print(fit.sigma.round(3), abs(fit.centre[2]) < 0.003)
        0.005 True
    """
    m, alone = with_marker_axis(m)
    system = pool(m, None, None)
    return _solve(m, system, _pratt_noise(system), None, strict, alone)


def sgdk(
    m: Moments,
    sigma: ArrayLike | None = None,
    shape: ArrayLike | None = None,
    weights: ArrayLike | None = None,
) -> SphereFit:
    """MGDK in the directions in which the points stand above the noise: for hinges and planar motion.

    A direction is solved where the points' own variance in it, without the noise, exceeds the noise (the
    thesis's criterion σ < √λ, 6.6). Along the others the centre stays level with the mean of the points,
    and the weakest of them is the fit's `null` vector: a hinge's axis.

    Args:
        m: moments, batch shape (..., M) or ().
        sigma: noise standard deviation, metres, () or (...). Without it, or where it is larger
            than what the points' own residual shows, Pratt's noise is used.
        shape: as for `mgdk`.
        weights: as for `mgdk`.

    Returns:
        Centre (..., D) and radii (..., M), metres; `rank` (...), how many directions were solved.

    Raises:
        DegenerateSphereError: no marker has two points.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.spherefit import sgdk, sphere_moments
        >>> angle = np.linspace(0, 1.5, 100)
        >>> arc = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])  # a hinge about z
        >>> fit = sgdk(sphere_moments(arc))
        >>> print(int(fit.rank), np.abs(fit.null).round(6), np.abs(fit.centre).max() < 1e-9)
        2 [0. 0. 1.] True
    """
    m, alone = with_marker_axis(m)
    if bool((m.count.max(axis=-1) < 2).any()):
        raise DegenerateSphereError("a sphere fit needs points, and there are fewer than two")
    system = pool(m, shape, weights)
    noise = _allowed_noise(system, sigma)
    signal, axes = system.signal(noise)
    still = np.broadcast_to(noise[..., None], signal.shape)
    if system.noise is not None:
        still = still * np.einsum("...dk,...de,...ek->...k", axes, system.noise, axes)
    order = np.argsort(signal / (still + system.floor[..., None]), axis=-1)
    signal, still = (np.take_along_axis(v, order, axis=-1) for v in (signal, still))
    axes = np.take_along_axis(axes, order[..., None, :], axis=-1)
    above = (signal > still) & (signal > system.floor[..., None])
    return _finish(m, system, noise, shape, signal, axes, above, alone)


def linear_system(m: Moments, sigma: float) -> tuple[Array, Array, Array]:
    """The system A (c - middle) = b that `mgdk` solves, for those who solve it by themselves.

    Args:
        m: moments, batch shape (..., M) or ().
        sigma: noise standard deviation, metres.

    Returns:
        middle (..., D), A (..., D, D) and b (..., D).
    """
    system = pool(with_marker_axis(m)[0], None, None)
    unit = np.eye(m.mean.shape[-1])
    return system.middle, system.covariance - sigma**2 * unit, system.cross


def found_elsewhere(
    m: Moments,
    centre: Array,
    radius: Array | None = None,
    *,
    sigma: float = 0.0,
    converged: bool = True,
) -> SphereFit:
    """A fit whose centre (D,) did not come from the moments (M,), with what these say of the points.

    Args:
        m: moments of the points.
        centre: the centre, metres.
        radius: (M,), metres; what the moments give about that centre if None.
        sigma: the noise that was taken away to find it, metres.
        converged: whether it was reached.
    """
    m, alone = with_marker_axis(m)
    system = pool(m, None, None)
    if radius is None:
        radius = radii(m, centre, np.asarray(sigma**2), None)
    return SphereFit(
        centre=centre,
        radius=radius[0] if alone else radius,
        axes=system.axes,
        spread=system.spread,
        rank=np.asarray(len(centre)),
        sigma=np.asarray(sigma),
        converged=np.asarray(converged),
    )


def allowed_sigma(m: Moments, sigma: ArrayLike, shape: ArrayLike | None = None) -> Array:
    """Sigma, or the noise standard deviation that the points' own residual shows if that is less.

    Pratt's noise is the same in all directions, so it bounds what the shape has in all of them.

    Args:
        m: moments, batch shape (..., M) or ().
        sigma: noise standard deviation, metres, () or (...).
        shape: Σ̂_p / sigma², as for `mgdk`.

    Returns:
        (...), metres.

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial.spheres import cap
        >>> from mocap_skel.spherefit import allowed_sigma, sphere_moments
        >>> rng = np.random.default_rng(0)
        >>> x = cap(rng, (5000,), 1.0, radius=0.2) + 0.002 * rng.normal(size=(5000, 3))
        >>> m = sphere_moments(x)
        >>> print(allowed_sigma(m, 0.001).round(3), allowed_sigma(m, 0.1).round(3))
        0.001 0.002
    """
    system = pool(with_marker_axis(m)[0], shape, None)
    return np.asarray(np.sqrt(_allowed_noise(system, sigma)))


def _allowed_noise(system: System, sigma: ArrayLike | None) -> Array:
    """`allowed_sigma` squared; Pratt's noise itself without a sigma."""
    everywhere = np.ones_like(system.square)
    if system.noise is not None:
        least = np.linalg.eigvalsh(system.noise)[..., 0]
        everywhere = np.where(least > 0, least, everywhere)
    if sigma is None:
        return np.asarray(_pratt_noise(system) / everywhere)
    wish = np.broadcast_to(np.asarray(sigma, dtype=np.float64) ** 2, system.square.shape)
    value, _ = _pratt_function(system, _projected(system), wish * everywhere)
    # Left of the root the function is positive: no need to find it.
    if bool(((value > 0) & (wish * everywhere < system.spread[..., 0])).all()):
        return np.asarray(wish)
    return np.asarray(np.minimum(wish, _pratt_noise(system) / everywhere))


def _projected(system: System) -> Array:
    """(..., D): the squared covariance of |x|² with the coordinate along each eigenvector of C."""
    return np.asarray((system.axes.swapaxes(-1, -2) @ (2 * system.cross)[..., None])[..., 0] ** 2)


def _pratt_function(system: System, projected: Array, eta: Array) -> tuple[Array, Array]:
    """The function whose root is Pratt's noise, and its slope, at eta (...)."""
    least = np.finfo(float).eps * system.spread[..., -1:] + np.finfo(float).tiny
    gap = np.maximum(system.spread - eta[..., None], least)
    part = projected / gap
    value = system.square_variance - part.sum(axis=-1) - 4 * eta * (system.square + eta)
    slope = -(part / gap).sum(axis=-1) - 4 * system.square - 8 * eta
    return value, np.minimum(slope, -np.finfo(float).tiny)


def _pratt_noise(system: System) -> Array:
    """The noise variance η that the points' own residual shows in Pratt's fit, shape (...), m².

    With f = |x|² about the middle, λ_k and g_k the covariance with f in the eigenvectors of C, it is
    the root of var f - Σ g_k²/(λ_k - η) - 4 η mean f - 4 η² in [0, λ_min), where the left side falls
    from its least-squares residual (≥ 0) to -∞.
    """
    projected = _projected(system)
    low, high = np.zeros_like(system.square), np.maximum(system.spread[..., 0], 0.0)
    eta = low
    # Newton's method on a falling concave function, kept inside its bracket by bisection: the pole
    # at λ_min would throw a free step out. A dozen steps are usual, 60 the bound of pure bisection.
    for _ in range(60):
        value, slope = _pratt_function(system, projected, eta)
        low, high = np.where(value > 0, eta, low), np.where(value > 0, high, eta)
        step = eta - value / slope
        new = np.where((step > low) & (step < high), step, 0.5 * (low + high))
        done = bool((np.abs(new - eta) <= 1e-14 * high).all())
        eta = new
        if done:
            break
    return np.asarray(eta)


def radial_variance(m: Moments, fit: SphereFit) -> Array:
    """Variance of each marker's radial residuals about a fit, from the moments alone.

    |x - c|² less its mean is 2 r times the radial residual to first order, and its variance follows
    from C, S and the fourth moment.

    Args:
        m: moments, batch shape (..., M) or ().
        fit: its centre (..., D) is used.

    Returns:
        (..., M), or () without a marker axis, m².

    Example:
        >>> import numpy as np
        >>> from mocap_skel.artificial.spheres import cap
        >>> from mocap_skel.spherefit import pratt, radial_variance, sphere_moments
        >>> rng = np.random.default_rng(0)
        >>> m = sphere_moments(cap(rng, (5000,), 1.0, 0.2) + 0.002 * rng.normal(size=(5000, 3)))
        >>> print(np.sqrt(radial_variance(m, pratt(m))).round(3))
        0.002
    """
    m, alone = with_marker_axis(m)
    away = fit.centre[..., None, :] - m.mean
    trace = np.trace(m.covariance, axis1=-2, axis2=-1)
    small = np.maximum(m.count, 1.0)
    variance = (
        m.fourth
        - trace**2 * (m.count - 1) / small
        - 4 * np.einsum("...d,...d->...", m.third, away)
        + 4 * np.einsum("...d,...de,...e->...", away, m.covariance, away)
    )
    square = trace * (m.count - 1) / small + np.einsum("...d,...d->...", away, away)
    result = np.maximum(variance, 0.0) / (4 * np.maximum(square, np.finfo(float).tiny))
    return np.asarray(result[..., 0] if alone else result)


def _solve(
    m: Moments, system: System, noise: Array, shape: ArrayLike | None, strict: bool, alone: bool
) -> SphereFit:
    """Every direction solved; a degenerate member is an error or NaN."""
    dimension = m.mean.shape[-1]
    flat = system.spread[..., 0] <= system.floor
    few = m.count.max(axis=-1) < dimension + 1
    signal, axes = system.signal(noise)
    noisy = signal[..., 0] <= 0
    if strict and bool((flat | few | noisy).any()):
        if bool(few.any()):
            raise DegenerateSphereError(
                f"a sphere in {dimension} dimensions needs at least {dimension + 1} points"
            )
        if bool(flat.any()):
            raise DegenerateSphereError(
                "the points do not span a sphere: they are all equal, on a line or in a plane"
            )
        raise DegenerateSphereError(
            "the noise is no smaller than the points' weakest spread: the centre is not determined",
            "use sgdk, which leaves such a direction out",
        )
    good = ~(flat | few | noisy)
    above = np.broadcast_to(good[..., None], signal.shape)
    fit = _finish(m, system, noise, shape, signal, axes, above, alone)
    return replace(
        fit,
        centre=np.where(good[..., None], fit.centre, np.nan),
        radius=np.where(good if alone else good[..., None], fit.radius, np.nan),
    )


def _finish(
    m: Moments,
    system: System,
    noise: Array,
    shape: ArrayLike | None,
    signal: Array,
    axes: Array,
    above: NDArray[np.bool_],
    alone: bool,
) -> SphereFit:
    """Centre and radii from the directions that may be solved."""
    right = axes.swapaxes(-1, -2) @ system.right_side(noise)[..., None]
    shift = np.where(above, right[..., 0] / np.where(above, signal, 1.0), 0.0)
    centre = system.middle + (axes @ shift[..., None])[..., 0]
    radius = radii(m, centre, noise, shape)
    return SphereFit(
        centre=centre,
        radius=radius[..., 0] if alone else radius,
        axes=axes,
        spread=(axes * (system.covariance @ axes)).sum(axis=-2),
        rank=above.sum(axis=-1),
        sigma=np.sqrt(noise),
    )

"""What the tests of sphere fits share: points on spheres, caps and arcs, and the laws of their errors."""

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st

from mocap_skel.spherefit import METHODS, Moments, sphere_moments

LAWS = settings(derandomize=True, deadline=None, max_examples=40, database=None)
SEEDS = st.integers(0, 2**32 - 1)
EPS = np.finfo(float).eps
# MLE stops where the sum of squares would fall by less than this share of it.
STOP = 1e-13
# sgdk has an answer to all that has two points: it leaves out what is not determined.
STRICT = tuple(name for name in METHODS if name != "sgdk")
FIELDS = ("count", "mean", "covariance", "third", "fourth")


def cap(rng, shape, degrees, radius=1.0, dimension=3):
    """Points (*shape, D) within a half-angle of the last axis about the origin; even for D = 3."""
    theta = np.radians(degrees)
    u = rng.uniform(size=shape)
    if dimension == 3:
        angle = np.arccos(1 - u * (1 - np.cos(theta)))
    else:
        angle = theta * u ** (1 / (dimension - 1))
    side = rng.normal(size=(*shape, dimension - 1))
    side /= np.linalg.norm(side, axis=-1, keepdims=True)
    return radius * np.concatenate(
        [np.sin(angle)[..., None] * side, np.cos(angle)[..., None]], axis=-1
    )


def arc(rng, shape, degrees, radius=1.0, height=0.0):
    """Points (*shape, 3) on an arc of ± degrees about the z axis, at a height."""
    a = np.radians(degrees) * rng.uniform(-1, 1, shape)
    return np.stack([radius * np.cos(a), radius * np.sin(a), np.full(shape, height)], axis=-1)


def rotation(rng, dimension=3):
    q, r = np.linalg.qr(rng.normal(size=(dimension, dimension)))
    q = q * np.sign(np.diag(r))
    q[:, 0] *= np.sign(np.linalg.det(q))
    return q


def direction(rng, dimension=3):
    v = rng.normal(size=dimension)
    return v / np.linalg.norm(v)


def rounding(degrees, distance, radius):
    """Relative error of the centre that rounding of the points' coordinates makes."""
    return 8 * EPS * (1 + distance / radius) / np.sin(np.radians(degrees) / 2) ** 2


def markers_on_spheres(rng, counts, noise, degrees=60.0):
    """Noisy caps of different radii about one centre, a list of (N_p, 3), and their moments."""
    points = [
        cap(rng, (n,), degrees, 0.1 + 0.1 * p) @ rotation(rng).T + noise * rng.normal(size=(n, 3))
        for p, n in enumerate(counts)
    ]
    return points, stack([sphere_moments(x) for x in points])


def stack(moments):
    return Moments(*(np.stack([getattr(m, name) for m in moments]) for name in FIELDS))


def assert_same(a, b, tolerance, width):
    """Moments agree to a relative tolerance of the width of the points to the right power."""
    np.testing.assert_array_equal(a.count, b.count)
    for power, name in enumerate(FIELDS[1:], start=1):
        allowed = tolerance * width**power
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=0, atol=allowed)


def cap_law(degrees):
    """Mean height of a uniform cap of the unit sphere, and its variance along the axis."""
    half = np.sin(np.radians(degrees) / 2) ** 2
    return 1 - half, half**2 / 3


def bound(sigma, degrees, count):
    """The thesis's CRLB of the centre: standard deviations across and along the cap's axis."""
    half = np.sin(np.radians(degrees) / 2) ** 2
    across = 3 / (half * (2 + np.cos(np.radians(degrees))))
    return sigma / np.sqrt(count) * np.sqrt([across, across, 3 / half**2])


def even_cap(degrees, rings=200, around=200):
    """A cap of the unit sphere covered evenly: equal steps of height and of longitude."""
    z = 1 - (np.arange(rings) + 0.5) / rings * (1 - np.cos(np.radians(degrees)))
    turn = 2 * np.pi * (np.arange(around) + 0.5) / around
    z, turn = (v.ravel() for v in np.meshgrid(z, turn))
    side = np.sqrt(1 - z**2)
    return np.column_stack([side * np.cos(turn), side * np.sin(turn), z])


def fisher_bound(points, sigma):
    """Inverse Fisher information of (centre, radii), its centre block: markers about the origin."""
    rows = []
    for p, x in enumerate(points):
        unit = x / np.linalg.norm(x, axis=1, keepdims=True)
        rows.append(
            np.column_stack([unit, np.tile(np.eye(len(points))[p], (len(x), 1))]) / sigma[p]
        )
    jacobian = np.concatenate(rows)
    return np.linalg.inv(jacobian.T @ jacobian)[:3, :3]


def hinge(rng, members, heights, noise=0.0, degrees=45.0, count=200, distance=1.0):
    """A batch of hinges (members, M, N, 3), their axes (members, 3) and points on the axes."""
    turn = np.stack([rotation(rng) for _ in range(members)])
    place = np.stack([distance * direction(rng) for _ in range(members)])
    x = np.stack(
        [arc(rng, (members, count), degrees, 0.2 + 0.05 * p, h) for p, h in enumerate(heights)],
        axis=1,
    )
    x = np.einsum("bij,bpnj->bpni", turn, x) + place[:, None, None]
    return x + noise * rng.normal(size=x.shape), turn[:, :, 2], place


def degenerate_sets():
    rng = np.random.default_rng(25)
    line = direction(rng)
    plane = arc(rng, (50,), 60) @ rotation(rng).T + 1.0
    return {
        "too few": (cap(rng, (3,), 90), "at least 4 points"),
        "no points": (np.full((10, 3), np.nan), "at least 4 points"),
        "an empty array": (np.empty((0, 3)), "at least 4 points"),
        "a line": (rng.uniform(-1, 1, (50, 1)) * line + 1.0, "do not span a sphere"),
        "a plane": (plane, "do not span a sphere"),
        "all equal": (np.tile(rng.normal(size=3), (50, 1)), "do not span a sphere"),
    }


DEGENERATE = degenerate_sets()


def markers(rng, count, size, degrees=60.0, dimension=3, noise=0.0):
    """Caps (M, N, D) of radii 0.1, 0.2, ... about the origin, that look in any direction."""
    x = np.stack(
        [
            cap(rng, (size,), degrees, 0.1 + 0.1 * p, dimension) @ rotation(rng, dimension).T
            for p in range(count)
        ]
    )
    return x + noise * rng.normal(size=x.shape)


def linear_error(x):
    """Error of the linear least-squares sphere of points (M, N, D): of its unknowns, in their norm.

    For a system A y = b with condition κ and residual ρ, rounding of ε moves y by
    ε (2 κ |y| + κ² |ρ| / |A|) (Golub & Van Loan 5.3.8). N-fold sums make ε some ulps.
    """
    count = len(x)
    rows = [
        np.column_stack([2 * p, np.tile(np.eye(count)[k], (len(p), 1))]) for k, p in enumerate(x)
    ]
    system, right = np.concatenate(rows), (np.concatenate(x) ** 2).sum(axis=1)
    there = np.isfinite(right)
    system, right = system[there], right[there]
    answer = np.linalg.lstsq(system, right, rcond=None)[0]
    residual = np.linalg.norm(system @ answer - right)
    condition, size = np.linalg.cond(system), np.linalg.norm(system, 2)
    return 8 * EPS * (2 * condition * np.linalg.norm(answer) + condition**2 * residual / size)


def method_error(name, x, degrees=60.0, noise=0.0):
    """How far a method's centre may be from where exact arithmetic puts it, metres.

    Of points (M, N, D) on caps of noise; the largest radius counts where radii differ.
    """
    if name == "lls":
        return linear_error(x)
    distance = np.linalg.norm(np.nanmean(x, axis=(0, 1)))
    radius = 0.1 * len(x)
    plain = 4 * radius * rounding(degrees, distance, 0.1)
    if name != "mle":
        return plain
    # The sum of squares is N σ² + (c - ĉ)ᵀ (σ² CRLB⁻¹) (c - ĉ): a share STOP of it is √(STOP N)
    # standard deviations away from its minimum.
    count = x.shape[1]
    return plain + np.sqrt(STOP * count) * np.linalg.norm(bound(noise, degrees, count))


def noisy_markers(rng, trials, size, radius, noise, degrees=60.0):
    """Points (T, M, N, 3) about the origin, one cap that looks along its own axis for each marker."""
    markers = len(radius)
    turn = np.stack([rotation(rng) for _ in range(markers)])
    x = cap(rng, (trials, markers, size), degrees)
    x = np.reshape(radius, (-1, 1, 1)) * np.einsum("pij,tpnj->tpni", turn, x)
    return x + np.reshape(noise, (-1, 1, 1)) * rng.normal(size=x.shape)


def rmse(centres):
    return np.sqrt((centres**2).sum(axis=-1).mean())

"""Bias and spread of every estimator against the Cramér-Rao bound, over noise and coverage (thesis 6.6)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mocap_skel.artificial.spheres import cap
from mocap_skel.segments.noise import rigid_noise_matrix
from mocap_skel.segments.shape import find_shape
from mocap_skel.spherefit import (
    crlb_sphere,
    isotropic,
    largest_noise,
    marker_noise,
    marker_weights,
    mgdk,
    pratt,
    radial_noise_matrix,
    sphere_moments,
    ugdk,
)
from mocap_skel.spherefit.moments import Array, Moments
from mocap_skel.studies.contenders import CONTENDERS

NOISES = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2)
ANGLES = (10.0, 20.0, 30.0, 45.0, 60.0, 80.0, 100.0, 135.0, 180.0)
METHODS = ("gdke", "ugdk", "ugdk_fixed_point", "sgdk", "igdk", "lls", "pratt", "mle")
# An estimator breaks where its error is so many times the bound, or so many radii: the mean of the points
# has an error of one radius, and where the bound is as large that would look good. Picked by eye; only the
# crosses of the map and the counts in words hang on them.
BREAKS = 1.5
NOTHING = 0.5


@dataclass(frozen=True)
class Plan:
    """What is tried: every noise with every angle.

    Attributes:
        noises: σ / r.
        angles: half-angles θ of the cap, degrees.
        count: points of a set.
        trials: sets in each cell.
        seed: of all that is drawn.
        methods: keys of `CONTENDERS`.
    """

    noises: tuple[float, ...] = NOISES
    angles: tuple[float, ...] = ANGLES
    count: int = 1000
    trials: int = 200
    seed: int = 0
    methods: tuple[str, ...] = METHODS

    @property
    def cells(self) -> list[tuple[int, int]]:
        """Index of the noise and index of the angle, cell by cell."""
        return [(i, j) for i in range(len(self.noises)) for j in range(len(self.angles))]


@dataclass(frozen=True)
class Score:
    """How one estimator did in one cell, lengths in radii.

    Attributes:
        method: key of `CONTENDERS`.
        noise: σ / r.
        angle_deg: half-angle of the cap.
        bias: mean error along the cap's axis, positive towards the data.
        rmse: root mean square distance from the true centre.
        bound: the same for an unbiased estimator at the Cramér-Rao bound.
        ratio: rmse / bound.
        failed: share of trials without an answer.
        criterion: whether σ < (r/√3) sin²(θ/2).
    """

    method: str
    noise: float
    angle_deg: float
    bias: float
    rmse: float
    bound: float
    ratio: float
    failed: float
    criterion: bool

    @property
    def breaks(self) -> bool:
        """Whether the estimator is of no use there."""
        return not (self.ratio <= BREAKS and self.rmse <= NOTHING and self.failed <= 0.01)


def score_cell(plan: Plan, cell: tuple[int, int]) -> list[Score]:
    """Every estimator of the plan on the same point sets of one cell.

    What is drawn depends on the plan's seed and the cell only.

    Args:
        plan: what is tried.
        cell: index of the noise, index of the angle.

    Example:
        >>> from mocap_skel.studies.accuracy import Plan, score_cell
        >>> plan = Plan(noises=(0.03,), angles=(20.0,), trials=50, methods=("gdke", "pratt"))
        >>> for score in score_cell(plan, (0, 0)):
        ...     print(score.method, score.breaks)
        gdke True
        pratt False
    """
    noise, degrees = plan.noises[cell[0]], plan.angles[cell[1]]
    rng = np.random.default_rng([plan.seed, *cell])
    points = noisy_caps(rng, plan.trials, plan.count, noise, np.radians(degrees))
    bound = float(np.sqrt(np.trace(crlb_sphere(plan.count, noise, np.radians(degrees))[:3, :3])))
    criterion = bool(noise < largest_noise(1.0, np.radians(degrees)))
    scores = []
    for name in plan.methods:
        bias, rmse, failed = _errors(CONTENDERS[name].centres(points, noise))
        scores.append(
            Score(name, noise, degrees, bias, rmse, bound, rmse / bound, failed, criterion)
        )
    return scores


def noisy_caps(
    rng: np.random.Generator, trials: int, count: int, noise: float, angle: float
) -> Array:
    """Point sets on caps of radius 1 about the origin, with noise: (trials, count, 3).

    Args:
        rng: source of randomness.
        trials: sets.
        count: points of a set.
        noise: σ, in radii.
        angle: half-angle θ of the cap, radians.
    """
    return cap(rng, (trials, count), angle) + noise * rng.normal(size=(trials, count, 3))


def _errors(centres: Array) -> tuple[float, float, float]:
    """Bias along z, root mean square length, share of NaN, of centres (T, 3) whose truth is zero."""
    good = np.isfinite(centres).all(axis=1)
    if not good.any():
        return float("nan"), float("nan"), 1.0
    found = centres[good]
    rmse = np.sqrt((found**2).sum(axis=1).mean())
    return float(found[:, 2].mean()), float(rmse), float(1.0 - good.mean())


def verdicts(scores: Iterable[Score]) -> list[str]:
    """What the scores say of each estimator, and of Pratt against UGDK, one sentence each.

    Example:
        >>> from mocap_skel.studies.accuracy import Plan, score_cell, verdicts
        >>> plan = Plan(noises=(0.01,), angles=(20.0,), trials=50, methods=("gdke",))
        >>> verdicts(score_cell(plan, (0, 0)))
        ['GDKE: breaks in 1 of 1 cells, in 1 of the 1 that meet the criterion']
    """
    table = {(s.method, s.noise, s.angle_deg): s for s in scores}
    cells = list(dict.fromkeys((noise, angle) for _, noise, angle in table))
    methods = list(dict.fromkeys(method for method, _, _ in table))
    lines = []
    for method in methods:
        broken = [cell for cell in cells if table[method, *cell].breaks]
        inside = sum(table[method, *cell].criterion for cell in broken)
        met = sum(table[method, *cell].criterion for cell in cells)
        lines.append(
            f"{CONTENDERS[method].label}: breaks in {len(broken)} of {len(cells)} cells, in {inside} of the "
            f"{met} that meet the criterion"
        )
    others = [m for m in ("ugdk", "ugdk_fixed_point", "gdke") if m in methods]
    return lines + [_against(table, cells, other) for other in others if "pratt" in methods]


def _against(
    table: dict[tuple[str, float, float], Score], cells: list[tuple[float, float]], other: str
) -> str:
    def wins(method: str, rival: str) -> list[tuple[float, float]]:
        return [c for c in cells if _better(table[method, *c], table[rival, *c])]

    won, lost = wins("pratt", other), wins(other, "pratt")
    inside = sum(table["pratt", *c].criterion for c in won)
    return (
        f"Pratt beats {CONTENDERS[other].label} by over 5 % in {len(won)} of {len(cells)} cells, {inside} of "
        f"them within the criterion{_where(won)}; it loses in {len(lost)}{_where(lost)}; the rest are equal"
    )


def _better(one: Score, other: Score) -> bool:
    """By more answers if they differ by over 1 %, else by an error that is over 5 % less."""
    if abs(one.failed - other.failed) > 0.01:
        return one.failed < other.failed
    return one.rmse < 0.95 * other.rmse


def _where(cells: list[tuple[float, float]]) -> str:
    """Noises with the angles at both ends."""
    angles: dict[float, list[float]] = {}
    for noise, angle in cells:
        angles.setdefault(noise, []).append(angle)
    found = (
        f"{noise:g} at {min(of):g}°{f' to {max(of):g}°' if len(of) > 1 else ''}"
        for noise, of in angles.items()
    )
    return f" (σ/r {', '.join(found)})" if cells else ""


@dataclass(frozen=True)
class NoiseScore:
    """How well a centre is found with one way to know the noise matrix Σ̂, where noise differs by direction.

    Attributes:
        angle_deg: half-angle of the cap.
        spread: standard deviations of the true noise along x, y and z (the cap's axis), in radii.
        known: what UGDK takes away.
        matrix_error: relative error of Σ̂ (Frobenius), root mean square; None where nothing is estimated.
        bias, rmse, failed: of the centre, as in `Score`.
    """

    angle_deg: float
    spread: tuple[float, float, float]
    known: str
    matrix_error: float | None
    bias: float
    rmse: float
    failed: float


SPREADS = ((0.01, 0.01, 0.03), (0.03, 0.01, 0.01), (0.01, 0.02, 0.03))
NOISE_ANGLES = (45.0, 90.0, 180.0)


def score_noise(plan: Plan) -> list[NoiseScore]:
    """Errors of the centre with a whole noise matrix: estimated, the true one, or one level (thesis 6.7).

    Args:
        plan: its count, trials and seed are used; noises and angles are `SPREADS` and `NOISE_ANGLES`.
    """
    scores = []
    for i, spread in enumerate(SPREADS):
        truth = np.diag(np.square(spread))
        for j, degrees in enumerate(NOISE_ANGLES):
            rng = np.random.default_rng([plan.seed, 1, i, j])
            shape = (plan.trials, plan.count)
            points = cap(rng, shape, np.radians(degrees)) + rng.normal(size=(*shape, 3)) * spread
            m = sphere_moments(points)[:, None]
            level = np.trace(truth) / 3
            radial = np.array([radial_noise_matrix(x, pratt(sphere_moments(x))) for x in points])
            rigid = np.array([_rigid_estimate(rng, plan.count, spread) for _ in points])
            each = {
                "nothing (GDKE)": (np.zeros((3, 3)), None),
                "one level, the true one": (level * np.eye(3), None),
                "matrix from the radial residuals": (radial[:, None], radial),
                "matrix from a rigid segment of five": (rigid[:, None], rigid),
                "the true matrix": (truth, None),
            }
            for known, (noise, found) in each.items():
                bias, rmse, failed = _errors(ugdk(m, 1.0, noise, strict=False).centre)
                error = None
                if found is not None:
                    error = np.linalg.norm(found - truth, axis=(1, 2)) / np.linalg.norm(truth)
                    error = float(np.sqrt((error**2).mean()))
                scores.append(NoiseScore(degrees, spread, known, error, bias, rmse, failed))
    return scores


def _rigid_estimate(
    rng: np.random.Generator, frames: int, spread: tuple[float, float, float]
) -> Array:
    """Σ̂ from five markers, about 0.5 from each other, on a segment that turns at random."""
    template = 0.5 * rng.normal(size=(5, 3))
    turns = np.linalg.qr(rng.normal(size=(frames, 3, 3)))[0]
    turns[:, :, 0] *= np.linalg.det(turns)[:, None]
    points = np.einsum("fij,mj->fmi", turns, template)
    points += rng.normal(size=points.shape) * spread
    found = find_shape(points)
    matrix = None if found is None else rigid_noise_matrix(points, *found)
    return np.full((3, 3), np.nan) if matrix is None else matrix


@dataclass(frozen=True)
class MarkersScore:
    """How well a centre is found from two markers of different noise: radii 1 and 2, lengths in the first.

    Attributes:
        noises: σ of the two markers.
        angle_deg: half-angle of both caps.
        how: what is known of the noise, and how the markers count.
        rmse, bound, ratio, failed: as in `Score`.
    """

    noises: tuple[float, float]
    angle_deg: float
    how: str
    rmse: float
    bound: float
    ratio: float
    failed: float


MARKER_NOISES = ((0.01, 0.01), (0.005, 0.05), (0.05, 0.01))
MARKER_ANGLES = (30.0, 60.0, 120.0)


def score_markers(plan: Plan) -> list[MarkersScore]:
    """Errors of MGDK of two markers of different noise, weighted alike and as they deserve.

    Args:
        plan: its count, trials and seed are used; the cells are `MARKER_NOISES` and `MARKER_ANGLES`.
    """
    scores = []
    for i, noises in enumerate(MARKER_NOISES):
        for j, degrees in enumerate(MARKER_ANGLES):
            rng = np.random.default_rng([plan.seed, 2, i, j])
            angle = np.radians(degrees)
            points = np.stack(
                [
                    cap(rng, (plan.trials, plan.count), angle, radius)
                    + noise * rng.normal(size=(plan.trials, plan.count, 3))
                    for radius, noise in zip((1.0, 2.0), noises, strict=True)
                ],
                axis=1,
            )
            bound = _two_marker_bound(plan.count, noises, angle)
            for how, centres in _two_marker_fits(sphere_moments(points), noises).items():
                _, rmse, failed = _errors(centres)
                ratio = rmse / bound
                scores.append(MarkersScore(noises, degrees, how, rmse, bound, ratio, failed))
    return scores


def _two_marker_bound(count: int, noises: tuple[float, float], angle: float) -> float:
    """Root of the trace of the bound of a centre that two markers share: their information adds up."""
    blocks = (crlb_sphere(count, noise, angle)[:3, :3] for noise in noises)
    information = sum(np.linalg.inv(block) for block in blocks)
    return float(np.sqrt(np.trace(np.linalg.inv(information))))


def _two_marker_fits(m: Moments, noises: tuple[float, float]) -> dict[str, Array]:
    mean = float(np.sqrt(np.square(noises).mean()))
    true, weights = isotropic(noises, 3), marker_weights([1.0, 2.0], noises)
    found = marker_noise(m)
    estimated = isotropic(found.sigma, 3)
    return {
        "MGDK, one level, alike": mgdk(m, mean, strict=False).centre,
        "MGDK, true levels, alike": mgdk(m, 1.0, true, strict=False).centre,
        "MGDK, true levels, weighted": mgdk(m, 1.0, true, weights, strict=False).centre,
        "MGDK, estimated levels, weighted": mgdk(
            m, 1.0, estimated, found.weights, strict=False
        ).centre,
        "Chang-Pollard": pratt(m, strict=False).centre,
    }

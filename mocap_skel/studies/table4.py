"""The thesis's comparison of the estimators (Table 4), with what they do on this machine."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mocap_skel.artificial.spheres import cap
from mocap_skel.errors import MissingExtraError
from mocap_skel.extras import extra
from mocap_skel.studies.accuracy import Plan, noisy_caps, score_cell
from mocap_skel.studies.contenders import CONTENDERS
from mocap_skel.studies.flops import PER_SAMPLE
from mocap_skel.studies.speed import time_methods

# The conditions that the table's accuracy is measured in, σ / r and half-angle in degrees: a whole
# sphere, an ordinary joint, and one that moves as little as many do.
CONDITIONS = ((0.01, 180.0), (0.01, 45.0), (0.03, 20.0))
POINTS = 100_000
# Where the digits are measured: a sphere of 10 cm, 10 m from the origin.
RADIUS, DISTANCE = 0.1, 10.0


@dataclass(frozen=True)
class Method:
    """A row of the thesis's Table 4.

    Attributes:
        name: the method.
        contender: key of `CONTENDERS`.
        for_it, against_it: the thesis's words, mended where the measurements say otherwise.
        flops: operations a sample by the thesis, None where it gives none.
        time: of `POINTS` points, divided by GDKE's; None where SciPy is missing.
        errors: RMSE by the Cramér-Rao bound in each of `CONDITIONS`.
        digits: relative error of the centre of an exact sphere far from the origin.
    """

    name: str
    contender: str
    for_it: str
    against_it: str
    flops: int | None
    time: float | None
    errors: tuple[float, ...] | None
    digits: float | None


_WORDS = {
    "MLE": ("mle", "accepted theory of best solution", "slow, initial guess, may not converge"),
    "LLS": ("lls", "no initial guess", "GDKE's answer, slower, with fewer digits"),
    "GDKE": (
        "gdke",
        "fastest, no initial guess",
        "biased towards the data where they cover little",
    ),
    "UGDK": (
        "ugdk",
        "as fast, asymptotically unbiased",
        "needs σ; breaks where the criterion fails",
    ),
    "SGDK": ("sgdk", "hinges and planar motion: tells the axis", "needs eigenvectors"),
    "MGDK": (
        "ugdk",
        "several markers, a radius each; UGDK for one",
        "weighs markers alike unless told",
    ),
    "IGDK": ("igdk", "O(1) memory, a centre after every sample", "a system solved for each sample"),
    "Pratt": ("pratt", "as fast, needs no σ, near the MLE", "one noise level for all directions"),
}


def methods(seed: int = 0, trials: int = 100) -> Iterator[Method]:
    """The thesis's Table 4, row by row, measured now.

    Args:
        seed: of the points.
        trials: for the accuracy; an error along one axis is then known to 1 / √(2 trials) of itself.

    Example:
        >>> from mocap_skel.studies.table4 import methods
        >>> for row in methods(trials=5):
        ...     print(row.name, row.flops)
        MLE None
        LLS 236
        GDKE 26
        UGDK 26
        SGDK None
        MGDK 26
        IGDK 123
        Pratt None
    """
    try:
        extra("scipy.optimize", "mle")
        missing: tuple[str, ...] = ()
    except MissingExtraError:
        missing = ("mle",)
    names = [n for n in dict.fromkeys(key for key, _, _ in _WORDS.values()) if n not in missing]
    rng = np.random.default_rng(seed)
    cloud = noisy_caps(rng, 1, POINTS, 0.01, np.pi / 2)[0]
    times = time_methods(cloud, 0.01, names)
    plan = Plan(
        noises=tuple(s for s, _ in CONDITIONS), angles=tuple(a for _, a in CONDITIONS),
        trials=trials, seed=seed, methods=tuple(names),
    )  # fmt: skip
    cells = [{s.method: s.ratio for s in score_cell(plan, (i, i))} for i in range(len(CONDITIONS))]
    far = cap(rng, (1, 1000), np.pi / 3, RADIUS) + np.array([0.0, 0.0, DISTANCE])
    for name, (key, good, bad) in _WORDS.items():
        if key in missing:
            yield Method(name, key, good, bad, None, None, None, None)
            continue
        away = CONTENDERS[key].centres(far, 0.0)[0] - [0.0, 0.0, DISTANCE]
        yield Method(
            name, key, good, bad, PER_SAMPLE.get(key), times[key] / times["gdke"],
            tuple(cell[key] for cell in cells), float(np.linalg.norm(away) / RADIUS),
        )  # fmt: skip

"""Time of the motion grouping: `python benchmarks/bench_guess.py` prints it beside ways to do the same.

100 markers x 3,000 frames with a tenth of the samples missing: the spread of all 4,950 distances from
moments, against one pair of markers after the other; then the whole guess and the figure without names
of the bundled range-of-motion clip.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from timing import alternate

from mocap_skel import read_clip
from mocap_skel.labels.guess import guess_association
from mocap_skel.labels.guess.figure import find_figure
from mocap_skel.labels.guess.rigid import distances, rigid_groups

ROOT = Path(__file__).parent.parent
MARKERS, FRAMES, MISSING, SEED = 100, 3000, 0.1, 0


def by_pairs(points: np.ndarray) -> np.ndarray:
    """The same spreads, one marker against all others at a time."""
    spread = np.empty((points.shape[1],) * 2)
    for i in range(points.shape[1]):
        away = points - points[:, i : i + 1]
        square = np.einsum("fmd,fmd->fm", away, away)
        with np.errstate(invalid="ignore", divide="ignore"):
            spread[i] = np.nanstd(square, axis=0) / (2 * np.sqrt(np.nanmean(square, axis=0)))
    np.fill_diagonal(spread, np.nan)
    return spread


def main() -> None:
    rng = np.random.default_rng(SEED)
    points = rng.normal(size=(FRAMES, MARKERS, 3))
    points[rng.random((FRAMES, MARKERS)) < MISSING] = np.nan
    np.testing.assert_allclose(distances(points).spread, by_pairs(points), rtol=1e-9)
    moments, pairs = alternate(lambda: distances(points), lambda: by_pairs(points), rounds=5)
    spread = distances(points).spread
    (groups,) = alternate(lambda: rigid_groups(spread), rounds=5)
    print(f"{MARKERS} markers x {FRAMES} frames, {100 * MISSING:.0f} % missing, seed {SEED}")
    print(f"  all distances' spreads from moments        {1e3 * moments:7.0f} ms")
    print(f"  the same, a marker against all at a time   {1e3 * pairs:7.0f} ms")
    print(f"  rigid groups from them                     {1e3 * groups:7.0f} ms")
    clip = read_clip(ROOT / "sample_data" / "range_of_motion.c3d")
    whole, figure = alternate(lambda: guess_association(clip), lambda: find_figure(clip), rounds=5)
    print(f"{Path(clip.name).name}: {clip.frames} frames, {len(clip.labels)} markers")
    print(f"  the guess by names and motion              {1e3 * whole:7.0f} ms")
    print(f"  the figure without names                   {1e3 * figure:7.0f} ms")


if __name__ == "__main__":
    main()

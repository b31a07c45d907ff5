"""Soft tissue between bone and marker: slide along the bone with the joint's angle, and a wobble with the pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mocap_skel.artificial.faults import Array, Faults

# Radians of the joint's turn over which the skin's wobble is alike, picked by eye; and waves enough to make it
# nearly Gaussian.
ALIKE = 0.5
WAVES = 12


def tissue_tracks(
    turns: Array,
    along: Array,
    normals: Array,
    groups: NDArray[np.intp],
    faults: Faults,
    rng: np.random.Generator,
) -> Array:
    """Displacements of markers by the soft tissue, (frames, markers, 3), in the axes of their segments.

    Along the bone, in proportion to the turn of the joint, as far as each marker's own size and up or down
    for each of the turn's three components; and a wobble along the skin that is a smooth random function of
    the pose (a Gaussian process by random waves, Rahimi & Recht 2007): the same whenever the joint comes back.
    Of both, a share of the variance is common to the markers of a segment.

    Args:
        turns: of the joint nearest to each marker, rotation vectors, (frames, markers, 3), radians.
        along: unit vectors along the bones, (markers, 3); zero where there is none.
        normals: unit vectors off the skin, (markers, 3).
        groups: (markers,), which segment each is on, as a number.
        faults: their `tissue`, `wobble` and `together`.
        rng: source of randomness.
    """
    markers = turns.shape[1]
    count = int(groups.max()) + 1
    size = rng.uniform(*faults.tissue, markers)
    total = np.zeros_like(turns)
    for share, of in ((1 - faults.together, np.arange(markers)), (faults.together, groups)):
        number = max(markers, count)
        way = rng.choice([-1.0, 1.0], (number, 3))[of]
        slide = size * np.einsum("fmi,mi->fm", turns, way) / (np.pi / 2)
        pace = rng.standard_normal((number, WAVES, 3))[of] / ALIKE
        phase = rng.uniform(0, 2 * np.pi, (number, WAVES))[of]
        ways = rng.standard_normal((number, WAVES, 3))[of] * np.sqrt(2 / WAVES)
        waves = np.cos(np.einsum("fmi,mki->fmk", turns, pace) + phase)
        wobble = np.einsum("fmk,mki->fmi", waves, ways)
        total += np.sqrt(share) * (slide[..., None] * along + faults.wobble * wobble)
    return np.asarray(total - np.einsum("fmi,mi->fm", total, normals)[..., None] * normals)

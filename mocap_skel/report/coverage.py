"""A map of where a joint's markers have been around its centre: the part of the sphere that was covered."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mocap_skel.results.series import Radial
from mocap_skel.segments.pose import Array

# The map is a disc of radius 100; a cell of it is a place where a marker has been.
RADIUS = 100
CELL = 4
# Paul Tol's bright colours, which stay apart for the colour-blind.
COLOURS = ("#4477AA", "#EE6677", "#228833", "#CCBB44", "#66CCEE", "#AA3377", "#BBBBBB")


def coverage_map(about: Radial) -> str:
    """The directions from a joint's centre to its markers, in the parent's frame, as the text of an SVG.

    An equal-area map (Lambert's azimuthal) of the whole sphere about the markers' mean direction,
    turned so that most of the movement runs from left to right. Each marker has a colour; the circle is
    the cap of half-angle θ that would show the centre as well.
    """
    joint, flat = about.joint, flattened(about.directions)
    parts = [
        f'<circle r="{RADIUS}" class="sphere"/>',
        f'<circle r="{RADIUS / np.sqrt(2):.1f}" class="half"/>',
    ]
    for m in range(flat.shape[1]):
        colour = COLOURS[m % len(COLOURS)]
        parts.append(f'<path d="{_cells(flat[:, m])}" fill="{colour}"/>')
    if np.isfinite(joint.angle):
        parts.append(f'<circle r="{RADIUS * np.sin(joint.angle / 2):.1f}" class="cap"/>')
    box = f"{-RADIUS - 3} {-RADIUS - 3} {2 * RADIUS + 6} {2 * RADIUS + 6}"
    return f'<svg viewBox="{box}" aria-hidden="true">{"".join(parts)}</svg>'


def flattened(directions: Array) -> Array:
    """Places on the map: unit vectors (frames, M, 3) → (frames, M, 2), in a disc of radius `RADIUS`."""
    rows = directions.reshape(-1, 3)
    rows = rows[np.isfinite(rows[:, 0])]
    mean = rows.sum(axis=0)
    length = np.linalg.norm(mean)
    ahead = mean / length if length > 1e-9 else np.array([0.0, 0.0, 1.0])
    # The two directions square to the mean one in which there is most and least movement.
    square = np.eye(3) - np.outer(ahead, ahead)
    beside = np.linalg.svd(square)[0][:, :2]
    _, vectors = np.linalg.eigh(np.atleast_2d(np.cov((rows @ beside).T, bias=True)))
    basis = np.column_stack([beside @ vectors[:, ::-1], ahead])
    x, y, z = np.moveaxis(directions @ basis, -1, 0)
    # Half of the radius 2 of the sphere of radius 1: the far end of the sphere is the disc's rim.
    scale = RADIUS * np.sqrt(0.5 / np.maximum(1.0 + z, 1e-9))
    flat = np.stack([scale * x, scale * y], axis=-1)
    reach = np.linalg.norm(flat, axis=-1, keepdims=True)
    return np.asarray(flat * np.minimum(1.0, RADIUS / np.maximum(reach, 1e-9)))


def _cells(flat: Array) -> str:
    """The cells of the map that hold one of the points (frames, 2), as an SVG path of squares."""
    known = flat[np.isfinite(flat[:, 0])]
    cells: NDArray[np.int64] = np.unique(np.floor(known / CELL).astype(np.int64)[:, ::-1], axis=0)
    path = []
    start = 0
    for i in range(1, len(cells) + 1):
        if i < len(cells) and (cells[i] == cells[i - 1] + [0, 1]).all():
            continue
        y, x = (CELL * cells[start]).tolist()
        width = CELL * (i - start)
        path.append(f"M{x} {y}h{width}v{CELL}h{-width}z")
        start = i
    return "".join(path)

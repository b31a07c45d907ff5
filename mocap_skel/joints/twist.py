"""How a segment turns about its length: by its markers, and by the plane in which the limb below it bends.

Skin does not follow a limb's turn about its own length as the bone does: on an upper arm that is turned far, it is off by
30 degrees (Hamming et al. 2012, J. Biomech. 45, 1161: pins in the humerus). A bent elbow shows that turn, a straight
one does not. Each frame takes both by what they know.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocap_skel.segments.pose import Array, Pose

# Radians²: no plane is known better, however far the limb is bent.
SHARPEST = 1e-6


@dataclass(frozen=True, eq=False)
class Plane:
    """Which way is inward at the hinge at a segment's lower end, frame by frame, as the limb's bend shows it.

    Attributes:
        marker: index of the segment's marker beside the hinge.
        inward: (frames, 3), unit vectors in the lab; NaN = not seen.
        error: (frames, 3, 3), its covariance, radians².
        kept: whether nothing but skin leaves that plane.
    """

    marker: int
    inward: Array
    error: Array
    kept: bool = True


@dataclass(frozen=True, eq=False)
class Turned:
    """A segment's turn about its length by its markers and by the plane below it.

    Attributes:
        pose: turned about the axis in every frame in which the plane is seen.
        inward: (3,), the mean way inward, a unit vector in the segment.
        wander: standard deviation, radians, of the markers' turn about that of the plane, the plane's own error
            taken away; 0 where the two do not contradict each other.
        error: (frames,) standard deviation of the turn about the axis, radians; 0 where the markers alone give it.
    """

    pose: Pose
    inward: Array
    wander: float
    error: Array


def turned(pose: Pose, axis: Array, place: Array, plane: Plane) -> Turned | None:
    """Turn a segment about its length to where the limb's plane says, as far as its markers contradict it.

    Let φ be the angle between the plane's inward direction and its mean over the frames, as the segment sees it, and
    w its information in a frame. The markers' turn wanders by τ² = (Σ w φ² - (n - 1)) / (Σ w - Σ w² / Σ w)
    (DerSimonian & Laird 1986). A frame takes the direction between both, weighted 1/τ² and w: of markers that move with
    the plane nothing changes, and a limb that is nearly straight says nothing.

    Args:
        pose: of the segment, by its markers.
        axis: (3,) along its length, in the segment.
        place: (3,) a point of that line, which stays where it is.
        plane: of the limb below.

    Returns:
        None where the plane is seen in fewer than two frames.

    A segment along x whose markers do not follow a turn of 60 degrees, which a bent limb shows:

    >>> angle = np.radians(np.linspace(-30.0, 30.0, 61))
    >>> inward = np.stack([0 * angle, np.cos(angle), np.sin(angle)], axis=1)
    >>> still = Pose(np.tile(np.eye(3), (61, 1, 1)), np.zeros((61, 3)))
    >>> plane = Plane(0, inward, np.tile(0.01 * np.eye(3), (61, 1, 1)))
    >>> found = turned(still, np.array([1.0, 0.0, 0.0]), np.zeros(3), plane)
    >>> round(float(np.degrees(found.wander))), round(float(np.degrees(found.pose.rotation[-1, 2, 1])))
    (17, 26)
    """
    length = axis / np.linalg.norm(axis)
    inside = np.einsum("fji,fj->fi", pose.rotation, plane.inward)
    error = np.einsum("fji,fjk,fkl->fil", pose.rotation, plane.error, pose.rotation)
    across = inside - np.outer(inside @ length, length)
    with np.errstate(invalid="ignore", divide="ignore"):
        across = across / np.linalg.norm(across, axis=1, keepdims=True)
    side = np.cross(length, across)
    seen = np.asarray(np.isfinite(side).all(axis=1))
    if seen.sum() < 2:
        return None
    variance = np.einsum("fi,fij,fj->f", side, error, side)
    known = np.where(seen, 1.0 / np.maximum(variance, SHARPEST), 0.0)
    across = np.where(seen[:, None], across, 0.0)
    mean = known @ across
    if not np.linalg.norm(mean) > 0:
        return None
    mean = mean / np.linalg.norm(mean)
    cosine, sine = across @ mean, across @ np.cross(length, mean)
    angle, w = np.arctan2(sine, cosine)[seen], known[seen]
    spare = float(w.sum() - (w**2).sum() / w.sum())
    wander = max(float(w @ angle**2) - (len(w) - 1), 0.0) / max(spare, np.finfo(float).tiny)
    if not wander > 0:
        return Turned(pose, mean, 0.0, np.zeros(len(known)))
    by = np.arctan2(known * sine, 1.0 / wander + known * cosine)
    rotation = pose.rotation @ about(length, by)
    origin = pose.to_lab(place) - rotation @ place
    left = 1.0 / np.sqrt(1.0 / wander + known)
    return Turned(Pose(rotation, origin), mean, float(np.sqrt(wander)), left)


def about(axis: Array, angle: Array) -> Array:
    """(frames, 3, 3): the turns by angles (frames,), radians, about a unit vector (3,).

    >>> about(np.array([0.0, 0.0, 1.0]), np.array([np.pi / 2]))[0].round(6) + 0.0
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.asarray(np.eye(3) + s * cross + (1.0 - c) * (cross @ cross))

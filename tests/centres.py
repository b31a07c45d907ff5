"""What the tests of one joint share: markers on caps about a known centre, frames, and the fit of them."""

import numpy as np
from scipy.spatial.transform import Rotation

from mocap_skel.joints.centre import PriorKnowledge, fit_centre
from mocap_skel.joints.choices import Estimation
from mocap_skel.joints.samples import Frame, JointSamples, gather
from mocap_skel.joints.sphere import fit_markers
from mocap_skel.segments.pose import least_squares_pose
from mocap_skel.segments.shape import Shape

# A frame that is exact: on one marker, whose noise nothing tells of.
EXACT = Frame(None)
CENTRE = np.array([0.1, -0.2, 0.3])
RADIUS = 0.4

TEMPLATE = np.array(
    [[0.1, 0.1, 0.0], [-0.12, 0.08, 0.02], [-0.05, -0.15, 0.04], [0.08, -0.06, -0.1]]
)
TEMPLATE = TEMPLATE - TEMPLATE.mean(axis=0)


def centre_of(points, sigma=0.0, frame=EXACT, *, own=None, noise=None, shared=None, **more):
    """`fit_centre` of points (frames, M, 3); `more` is what `Estimation` and `PriorKnowledge` take."""
    samples = JointSamples(points, sigma, sigma if own is None else own, frame, noise, shared)
    choice = {k: more.pop(k) for k in ("method", "each") if k in more}
    return fit_centre(samples, Estimation(**choice), PriorKnowledge(**more))


def sphere_of(points, sigma=0.0, frame=EXACT, *, own=None, pooled=None, **choice):
    """The sphere step of `centre_of` alone."""
    samples = JointSamples(points, sigma, sigma if own is None else own, frame)
    return fit_markers(gather(samples, pooled), Estimation(**choice))


def cap(half_angle, count, axis=(0.0, 0.0, 1.0)):
    """Unit vectors (count, 3) spread evenly over a cap: a golden spiral."""
    i = np.arange(count) + 0.5
    z = 1 - i / count * (1 - np.cos(half_angle))
    turn = np.pi * (1 + np.sqrt(5)) * i
    ring = np.sqrt(1 - z**2)
    points = np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)
    return points @ Rotation.align_vectors([axis], [[0.0, 0.0, 1.0]])[0].as_matrix().T


def on_sphere(half_angle, count, rng, sigma=0.0, markers=1):
    """(count, markers, 3) about CENTRE, in random order of time, with white noise."""
    points = np.stack(
        [
            CENTRE + RADIUS * (1 + 0.2 * m) * cap(half_angle, count)[rng.permutation(count)]
            for m in range(markers)
        ],
        axis=1,
    )
    return points + sigma * rng.standard_normal(points.shape)


def arc(half_angle, count, sigma, rng):
    """One marker, (count, 1, 3), on a circle about CENTRE."""
    bend = half_angle * (2 * (rng.permutation(count) + 0.5) / count - 1)
    ring = np.stack([np.sin(bend), np.zeros(count), np.cos(bend)], axis=1)
    return (CENTRE + RADIUS * ring + sigma * rng.standard_normal((count, 3)))[:, None]


def frame_on(template=TEMPLATE, sigma=0.0):
    return Frame(Shape(template, np.ones(len(template)), (0, 1, 2), sigma))


def noisy_frames(points, template, sigma, rng):
    """Points (frames, M, 3) of a frame as they look from the pose of its noisy markers."""
    seen = template + sigma * rng.standard_normal((len(points), *template.shape))
    return least_squares_pose(seen, template, np.ones(len(template))).to_segment(points)

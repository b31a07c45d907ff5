"""The standard human with its markers, filmed without a fault and with noise; and a sphere fit apart from the package's."""

import numpy as np

from mocap_skel import artificial as art

SIGMA = 0.001
HUMAN = art.human()
CMU = art.marker_set("cmu")
ROM = art.range_of_motion(14, 100, seed=4)
EXACT = art.record(HUMAN, CMU, ROM)
NOISY = art.record(HUMAN, CMU, ROM, art.Faults(sigma=SIGMA), seed=4)
JOINTS = list(HUMAN.joints)


def child_markers(figure, markers, recording, joint, points):
    """Tracks of the markers on a joint's child segment in the parent's true frame."""
    child = figure.joints[joint]
    parent = recording.poses[child.parent]
    rows = [i for i, (segment, _) in enumerate(markers.values()) if segment == child.name]
    shifted = points[:, rows] - parent.origin[:, None]
    return np.einsum("fji,fmj->mfi", parent.rotation, shifted)


def sphere_centre(tracks, noise=0.0):
    """MGDK: the shared centre, and the weakest standard deviation of the mean covariance."""
    total, right, covariances = np.zeros((3, 3)), np.zeros(3), []
    for track in tracks:
        mean = track.mean(axis=0)
        d = track - mean
        covariance = d.T @ d / (len(d) - 1)
        third = d.T @ (d**2).sum(axis=1) / (len(d) - 1)
        clean = covariance - noise * np.eye(3)
        total += clean
        right += clean @ mean + third / 2
        covariances.append(covariance)
    weakest = np.sqrt(np.linalg.eigvalsh(np.mean(covariances, axis=0))[0])
    return np.linalg.solve(total, right), weakest


def hinged(degrees, frames=61):
    """A figure whose left knee alone bends by so much, and its motion."""
    turn = np.deg2rad(degrees) * np.linspace(0, 1, frames)[:, None] * [0.0, 1.0, 0.0]
    return art.Motion(60.0, np.zeros((frames, 3)), {"LowerLeftLeg": art.from_vector(turn)})

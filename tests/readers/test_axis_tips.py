"""Tips of a segment's axes are no markers, and markers that are called like them are."""

import numpy as np
import pytest
from c3d_bytes import c3d_file, cloud

from mocap_skel.artificial import human, marker_set, record, walk
from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.labels.guess.names import OPEN, guess_names
from mocap_skel.readers import read_clip

POSES = record(human(), marker_set("cmu"), walk(0.5, 50, 1), seed=1).poses


def axes(segment, longer=1.0):
    """Origin and tips of X, Y and Z (frames, 4, 3), mm: 100 long, each `longer` times as long as the one before."""
    pose = POSES[segment]
    tips = [pose.origin + 0.1 * longer**i * pose.rotation[:, :, i] for i in range(3)]
    return 1000 * np.stack([pose.origin, *tips], axis=1)


def read(path, labels, tracks):
    """A clip of two markers, A and B, and these tracks."""
    others = np.broadcast_to(cloud(markers=2)[:1], (len(tracks), 2, 3))
    return read_clip(
        c3d_file(path, np.concatenate([others, tracks], axis=1), LABELS=["A", "B", *labels])
    )


@pytest.mark.parametrize(
    "names",
    [
        ("PELVIS", "PELVIS_X", "PELVIS_Y", "PELVIS_Z"),
        ("LFEMUR_O", "LFEMUR_X", "LFEMUR_Y", "LFEMUR_Z"),
        ("L.Femur.Origin", "L.Femur.X", "L.Femur.Y", "L.Femur.Z"),
        ("Trunk0", "Trunkx", "Trunky", "Trunkz"),
    ],
)
def test_axes_with_their_origin_are_outputs(path, names):
    clip = read(path, names, axes("Hips"))
    assert clip.labels == ("A", "B")
    assert set(clip.left_out["model output"]) == set(names)


def test_tips_without_an_origin_are_outputs_by_their_distances(path):
    names = ("LFEMUR_X", "LFEMUR_Y", "LFEMUR_Z")
    assert read(path, names, axes("UpperLeftLeg")[:, 1:]).labels == ("A", "B")


def test_markers_that_are_called_so_stay_where_their_distances_are_not_equal(path):
    names = ("HIP_X", "HIP_Y", "HIP_Z")
    assert read(path, names, axes("Hips", longer=1.3)[:, 1:]).labels == ("A", "B", *names)


def test_two_tips_of_a_segment_are_none_by_their_names():
    standard = read_skeleton("human").segment_of.items()
    found = guess_names(["PELVIS_X", "PELVIS_Y", "LKNE_X", "LASI"], standard)
    assert all(found[x].computed and found[x].confidence == OPEN for x in ("PELVIS_X", "PELVIS_Y"))
    assert not found["LKNE_X"].computed
    assert found["LASI"].marker == "LFWT"

"""Trajectories that nobody has named, as programs call them."""

import numpy as np
import pytest
from c3d_bytes import c3d_file, cloud
from hypothesis import given
from hypothesis import strategies as st

from mocap_skel.artificial import marker_set
from mocap_skel.figure.skeleton import shipped_skeletons
from mocap_skel.readers import read_clip
from mocap_skel.readers.unlabelled import unlabelled

SPELLINGS = (
    "*{}", "*_{}", "U_{}", "uname*{}", "New {:04d}", "_{:04d}", "Unlabeled {}", "Unlabeled_{}",
    "Unlabelled{}", "unlabeled marker {}", "unidentified{}", "unnamed {}", "Unassigned-{}", "ghost{}",
    "traj_{}", "Trajectory {}",
)  # fmt: skip


@given(st.sampled_from(SPELLINGS), st.integers(0, 99999))
def test_every_number_of_every_spelling(spelling, number):
    assert unlabelled(spelling.format(number))


def test_no_name_of_a_shipped_figure_or_set_is_one():
    names = {name for figure in shipped_skeletons().values() for name in figure.segment_of}
    names |= {
        *marker_set("cmu"),
        *marker_set("plug_in_gait"),
        "LNEW",
        "UN",
        "U1",
        "*",
        "B*1",
        "New",
    }
    assert not [name for name in names if unlabelled(name)]


@pytest.mark.parametrize("spelling", SPELLINGS)
def test_they_are_set_aside_beside_names_and_are_markers_alone(path, spelling):
    ghosts = [spelling.format(n) for n in range(1, 5)]
    points = np.concatenate([cloud(markers=4), cloud(markers=3)], axis=1)
    clip = read_clip(c3d_file(path, points, LABELS=[*ghosts, "LFHD", "RFHD", "C7"]))
    assert clip.labels == ("LFHD", "RFHD", "C7")
    assert sum("4 unlabelled trajectories are set aside" in note for note in clip.notes) == 1
    assert read_clip(c3d_file(path, cloud(markers=4), LABELS=ghosts)).labels == tuple(ghosts)


def test_a_number_after_a_colon_is_one_where_the_subject_says_so(path):
    labels = ["Unlabeled:1", "Anna:1", "Anna:LFHD"]
    clip = read_clip(c3d_file(path, cloud(markers=3), LABELS=labels))
    assert clip.labels == ("1", "LFHD")

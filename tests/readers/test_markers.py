"""Which points of a file are markers, whose they are, and what they are called."""

from __future__ import annotations

import numpy as np
import pytest
from c3d_bytes import c3d_file, cloud, notes
from references import read_alike

from mocap_skel import artificial as art
from mocap_skel.errors import ClipError
from mocap_skel.readers import read_clip
from mocap_skel.readers.formats.c3d import with_c3d


def labelled(path, *labels, **more):
    points = cloud(markers=len(labels))
    return read_clip(c3d_file(path, points, LABELS=list(labels), **more))


def test_labels_are_trimmed(path):
    assert labelled(path, "  LFHD ", "RFHD", "C7 \0\0").labels == ("LFHD", "RFHD", "C7")
    # One library stops at the first zero of a text, the other does not.
    assert with_c3d.read(path).parameters["POINT"]["LABELS"] == ["LFHD", "RFHD", "C7"]


def test_doubles_are_told_apart_without_taking_a_name_that_is_there(path):
    clip = labelled(path, "A", "A", "A_2", "B", "A", "B")
    assert clip.labels == ("A", "A_3", "A_2", "B", "A_4", "B_2")
    assert "more than once" in notes(clip)
    assert "A, B" in notes(clip)


def test_the_same_label_of_two_subjects_is_no_double(path):
    clip = labelled(path, "Ann:LFHD", "Bob:LFHD", "LFHD")
    assert (clip.labels, clip.notes) == (("LFHD",) * 3, ())
    assert clip.subject_names == ("Ann", "Bob", "")


def test_blanks_are_called_by_their_place(path):
    clip = labelled(path, "*1", "", "point_4", "", "Ann:")
    assert clip.labels == ("point_2", "point_4", "point_4_2", "point_5")
    assert clip.subjects == ("", "", "", "Ann")
    assert "points without a label: 3" in notes(clip)
    # Nor do they take the name of a point that comes later.
    assert labelled(path, "", "point_1").labels == ("point_1_2", "point_1")


def test_a_double_cannot_take_the_name_of_a_blank_or_the_other_way_round(path):
    labels = labelled(path, "point", "", "point", "point").labels
    assert labels[0] == "point"
    assert len(set(labels)) == 4


def test_many_doubles_take_no_time(path):
    points = np.full((1, 4000, 3), 5.0) + np.arange(4000)[:, None]
    more = {f"LABELS{i}": ["A"] * 255 for i in range(2, 17)}
    clip = read_clip(c3d_file(path, points, LABELS=["A"] * 255, **more))
    assert len(set(clip.labels)) == 4000


@pytest.mark.parametrize(
    ("text", "subject", "label"),
    [
        ("Ann:LFHD", "Ann", "LFHD"),
        (" Ann Lee : L FHD ", "Ann Lee", "L FHD"),
        ("A:B:LFHD", "A:B", "LFHD"),
        (":LFHD", "", "LFHD"),
        ("Zoë:Schädel", "Zoë", "Schädel"),
        ("An\x1b[1mn:L\x07", "An?[1mn", "L?"),
    ],
)
def test_prefixes(path, text, subject, label):
    clip = labelled(path, text, "C7")
    assert (clip.subjects[0], clip.labels[0]) == (subject, label)


def test_labels_in_latin_1_can_be_printed(path):
    c3d_file(path, cloud(markers=1), LABELS="Schädel".encode("latin-1"))
    assert read_clip(path).labels == ("Schädel",)
    read_alike(path)


def test_more_points_than_labels_and_more_labels_than_points(path):
    c3d_file(path, cloud(), LABELS=["A", "B"])
    assert read_clip(path).labels == ("A", "B", "point_3")
    c3d_file(path, cloud(), LABELS=["A", "B", "C", "A", "B"])
    clip = read_clip(path)
    assert (clip.labels, clip.notes) == (("A", "B", "C"), ())


def test_labels_as_one_text_and_no_labels(path):
    assert read_clip(c3d_file(path, cloud(markers=1), LABELS="LFHD")).labels == ("LFHD",)
    clip = read_clip(c3d_file(path, cloud(), LABELS=None))
    assert clip.labels == ("point_1", "point_2", "point_3")


def test_parameter_names_in_small_letters(path):
    clip = read_clip(c3d_file(path, cloud(), LABELS=None, Labels=["A", "B", "C"]))
    assert clip.labels == ("A", "B", "C")


def test_more_than_255_labels(path):
    names = [f"P{i}" for i in range(600)]
    figure = art.human()
    at = {name: ("Head", (0.001 * i, 0.0, 0.1)) for i, name in enumerate(names)}
    art.write_c3d(art.record(figure, at, art.still(0.1, 100)), path)
    clip = read_clip(path)
    assert clip.labels == tuple(names)
    read_alike(path)


# --- What is no marker --------------------------------------------------------------------------


def test_unlabelled_points_are_left_out_even_twice(path):
    clip = labelled(path, "*12", "A", "Ann:*3", "*12", "*", "B*1")
    assert clip.labels == ("A", "*", "B*1")
    assert clip.left_out == {"unlabelled": ("*12", "*3", "*12")}
    assert "3 unlabelled trajectories are set aside: *12, *3, *12" in notes(clip)


def test_where_nothing_has_a_name_three_unlabelled_points_are_a_figure(path):
    clip = labelled(path, "*1", "*12", "*3")
    assert (clip.labels, clip.left_out, clip.notes) == (("*1", "*12", "*3"), {}, ())
    with pytest.raises(ClipError, match=r"clip\.c3d: no marker among its points, 2 of them"):
        labelled(path, "*1", "*12")


def test_points_of_an_earlier_fit_are_those_of_the_subject_it_was_of(path):
    lists = {"JOINT_CENTRES": ["Ann:LeftHip", "Waist"], "SEGMENT_AXES": ["Hips_O"]}
    labels = ["Ann:LeftHip", "Bob:LeftHip", "Waist", "Bob:Waist", "Hips_O", "C7"]
    clip = labelled(path, *labels, **lists)
    assert clip.left_out == {"joint centres of an earlier fit": ("LeftHip", "Waist", "Hips_O")}
    assert clip.labels == ("LeftHip", "Waist", "C7")
    assert clip.subjects == ("Bob", "Bob", "")


@pytest.mark.parametrize(
    "group", ["ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "MODELED_MARKERS", "REACTIONS"]
)
def test_model_outputs_by_list(path, group):
    clip = labelled(path, "A", "XYZ", "B", "XYZ", **{group: ["XYZ", "ABC"]})
    assert clip.labels == ("A", "B")
    assert clip.left_out == {"model output": ("XYZ", "XYZ")}


def test_model_outputs_listed_with_and_without_prefix(path):
    lists = {"ANGLES": ["Ann:P1", "Q1"], "ANGLES2": ["Z1"]}
    clip = labelled(path, "Ann:P1", "Bob:P1", "Ann:Q1", "Bob:Z1", **lists)
    assert clip.left_out == {"model output": ("P1", "Q1", "Z1")}
    assert (clip.labels, clip.subjects) == (("P1",), ("Bob",))


def test_type_groups_name_the_lists(path):
    more = {"TYPE_GROUPS": ["ODDITIES", "ODD", "LABELS", "MARKER"], "ODDITIES": ["B"]}
    clip = labelled(path, "A", "B", "ODD", **more)
    assert clip.labels == ("A", "ODD")
    assert clip.left_out == {"model output": ("B",)}


@pytest.mark.parametrize(
    ("label", "is_marker"),
    [
        *[("LHipAngles", False), ("RAbsAnkleAngle", False), ("LAnkleForce", False)],
        *[("LKneeMoment", False), ("RHipPower", False), ("LNormalisedGRF", False)],
        *[("RGroundReactionForce2", False), ("LInferiorAngle", True), ("LFHD", True)],
        *[("PowerPack", True), ("GRFX", True)],
    ],
)
def test_model_outputs_by_name(path, label, is_marker):
    assert (label in labelled(path, label, "C7").labels) == is_marker


def bones(seed=0, stretch=1.0, count=20):
    """A bone of Plug-in Gait in any pose: origin and three axes, (frames, 4, 3), millimetres."""
    rng = np.random.default_rng(seed)
    turns, _ = np.linalg.qr(rng.standard_normal((count, 3, 3)))
    origin = rng.uniform(300, 900, (count, 1, 3))
    arms = 150 * turns * np.array([1, 1, stretch])[:, None]
    return np.concatenate([origin, origin + arms], axis=1)


def four(stem, subject=""):
    return [f"{subject}{stem}{end}" for end in "OALP"]


def test_bones_are_model_outputs_per_subject(path):
    points = np.concatenate([cloud(markers=2), bones(1), bones(2)], axis=1)
    names = ["C7", "Ann:C7", *four("LFE"), "Ann:HEDO", "Ann:HEDA", "Ann:HEDL", "Bob:HEDP"]
    clip = read_clip(c3d_file(path, points, LABELS=names))
    assert clip.left_out == {"model output": tuple(four("LFE"))}
    assert clip.labels == ("C7", "C7", "HEDO", "HEDA", "HEDL", "HEDP")
    names[-1] = "Ann:HEDP"
    clip = read_clip(c3d_file(path, points, LABELS=names))
    assert clip.left_out == {"model output": (*four("LFE"), *four("HED"))}


def test_bones_with_gaps_and_coarse_coordinates(path):
    points = np.concatenate([cloud(count=200, markers=1), bones(count=200)], axis=1)
    points[:90, 2] = 0
    clip = read_clip(c3d_file(path, points, scale=1.0, LABELS=["C7", *four("PEL")]))
    assert clip.labels == ("C7",)


def test_bones_that_are_right_to_a_few_per_cent(path):
    points = np.concatenate([cloud(markers=1), bones(stretch=1.05)], axis=1)
    clip = read_clip(c3d_file(path, points, LABELS=["C7", *four("LSH")]))
    assert clip.left_out == {"model output": tuple(four("LSH"))}


@pytest.mark.parametrize("four_points", [cloud(markers=4), bones(stretch=1.2)])
def test_markers_named_like_bones_are_kept(path, four_points):
    clip = read_clip(c3d_file(path, four_points, LABELS=four("LSH")))
    assert clip.labels == tuple(four("LSH"))


def test_nothing_but_model_outputs_is_an_error(path):
    with pytest.raises(ClipError, match=r"clip\.c3d: no marker among its points, 2 of them"):
        labelled(path, "LHipAngles", "*1")

"""Association files: what they may say, what goes wrong where, and how they meet a clip."""

from dataclasses import replace

import numpy as np
import pytest
from recordings import clip_of as clip_of_recording
from recordings import fit_clip

from mocap_skel import read_clip
from mocap_skel.artificial import human, marker_set, range_of_motion, record
from mocap_skel.clip import Clip
from mocap_skel.errors import AssociationError, ClipError, MocapSkelError, SkeletonError
from mocap_skel.labels.association import SHIPPED, associate, read_association

FILES = sorted(SHIPPED.glob("*.txt"))


def clip_of(*labels):
    """A clip of one frame with these labels, `Subject:` prefixes taken apart as the reader does."""
    parts = [label.rpartition(":") for label in labels]
    return Clip(
        name="clip.c3d",
        points=np.zeros((1, len(labels), 3)),
        labels=tuple(p[2] for p in parts),
        subjects=tuple(p[0] for p in parts),
        rate=100.0,
        first_frame=1,
        unit="mm",
        up="z",
        left_out={},
        notes=(),
    )


@pytest.fixture
def write(tmp_path):
    def write(text, name="map.txt"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_a_file_maps_labels_to_standard_markers_on_their_segments(write):
    path = write(
        "# my lab\n\n"
        '"r should"  RSHO   # with a blank\n'
        '"#7"\tCLAV\n'
        "LT01  LT01  UpperLeftLeg\n"
        "ignore *Angles\n"
    )
    found = read_association(path)
    assert [(r.label, r.marker, r.segment, r.line) for r in found.rules] == [
        ("r should", "RSHO", "Chest", 3),
        ("#7", "CLAV", "Chest", 4),
        ("LT01", "LT01", "UpperLeftLeg", 5),
    ]
    assert found.ignored == ("*Angles",)
    assert found.skeleton.name == "human"


@pytest.mark.parametrize(
    ("line", "column", "what"),
    [
        ("LFWT", 1, "1 word where LABEL MARKER"),
        ("A B C D E", 7, "5 words where LABEL MARKER"),
        ("LFWT LFTW", 6, "'LFTW' is no marker of the skeleton 'human'"),
        ("X1 X1 UperLeftLeg", 7, "'UperLeftLeg' is no segment"),
        ('"LFWT LFWT', 1, "stray or unclosed quote"),
        ('LF"WT LFWT', 1, "stray or unclosed quote"),
        ('"" LFWT', 1, "an empty name"),
        ("@skelton human", 1, "only '@skeleton NAME' is known"),
    ],
)
def test_a_wrong_line_is_named_with_file_line_and_column(write, line, column, what):
    path = write(f"RFWT RFWT\n{line}\n")
    with pytest.raises(AssociationError) as error:
        read_association(path)
    assert error.value.message.startswith(f"{path}:2:{column}: ")
    assert what in error.value.message


@pytest.mark.parametrize(
    ("line", "hint"),
    [("LFWT LFTW", "LFWT"), ("X1 X1 UperLeftLeg", "UpperLeftLeg"), ("LSHN lsho1", "LSHO")],
)
def test_a_misspelt_name_gets_a_suggestion(write, line, hint):
    with pytest.raises(AssociationError) as error:
        read_association(write(line))
    assert hint in error.value.hint


def test_words_that_mean_something_else_can_be_labels(write):
    """A quoted @skeleton, and ignore with a marker and its segment."""
    found = read_association(write('"@skeleton" LFWT\nignore Z1 Hips\nignore "a b"\n'))
    assert [(r.label, r.marker) for r in found.rules] == [("@skeleton", "LFWT"), ("ignore", "Z1")]
    assert found.ignored == ("a b",)


def test_a_label_or_a_marker_stands_in_one_line_only(write):
    with pytest.raises(AssociationError, match=r":2:1: label 'A' stands in line 1 already"):
        read_association(write("A LFWT\nA RFWT\n"))
    with pytest.raises(AssociationError, match=r":2:3: marker 'LFWT' stands in line 1 already"):
        read_association(write("A LFWT\nB LFWT\n"))


def test_a_file_that_is_not_there_or_not_text(tmp_path):
    with pytest.raises(AssociationError) as error:
        read_association("cmuu")
    assert "no such association file" in error.value.message
    assert "cmu" in error.value.hint
    binary = tmp_path / "map.txt"
    binary.write_bytes(b"LFWT \xff\xfe\x00")
    with pytest.raises(AssociationError, match="not a text file in UTF-8"):
        read_association(binary)
    with pytest.raises(AssociationError):
        read_association(tmp_path)
    # A shipped file is reached by its bare name only.
    with pytest.raises(AssociationError, match="no such association file"):
        read_association("nowhere/cmu")


def test_a_byte_order_mark_and_windows_line_ends_are_no_matter(tmp_path):
    path = tmp_path / "map.txt"
    path.write_bytes(b"\xef\xbb\xbfLFWT LFWT\r\nRFWT RFWT\r\n")
    assert [r.label for r in read_association(path).rules] == ["LFWT", "RFWT"]


def test_labels_match_by_case_and_without_their_subject(write):
    found = read_association(write("LFWT LFWT\nRFWT RFWT\n"))
    (one,) = associate(clip_of("Ann:LFWT", "Ann:rfwt", "Ann:X"), found)
    assert one.subject == "Ann"
    assert one.columns == {"Hips": {"LFWT": 0}}
    assert [r.label for r in one.absent] == ["RFWT"]
    assert one.unmatched == ("rfwt", "X")


def test_every_subject_of_a_clip_is_found_and_one_can_be_chosen(write):
    found = read_association(write("LFWT LFWT\n"))
    clip = clip_of("Ann:LFWT", "Ben:LFWT", "Ball:B1")
    assert [a.subject for a in associate(clip, found)] == ["Ann", "Ben"]
    assert [a.subject for a in associate(clip, found, "Ben")] == ["Ben"]
    with pytest.raises(MocapSkelError, match="no subject 'Bem'") as error:
        associate(clip, found, "Bem")
    assert "Ben" in error.value.hint


def test_a_rule_with_a_subject_is_for_that_subject_only(write):
    found = read_association(write("Ann:LFWT LFWT\nRFWT RFWT\n"))
    clip = clip_of("Ann:LFWT", "Ben:LFWT", "Ann:RFWT", "Ben:RFWT")
    ann, ben = associate(clip, found)
    assert ann.columns == {"Hips": {"RFWT": 2, "LFWT": 0}}
    assert ben.columns == {"Hips": {"RFWT": 3}}
    # What is for Ann is not missing in Ben; what is for nobody here is.
    assert ann.absent == ben.absent == ()
    found = read_association(write("Cat:LFWT LFWT\nRFWT RFWT\n"))
    assert [r.label for r in associate(clip, found)[0].absent] == ["Cat:LFWT"]


def test_two_lines_for_one_label_of_a_subject_are_an_error(write):
    path = write("Ann:LFWT LFWT\n\nLFWT RFWT\n")
    with pytest.raises(AssociationError, match=r":3: label 'LFWT' is that of line 1 in clip\.c3d"):
        associate(clip_of("Ann:LFWT", "Ben:LFWT"), read_association(path))


def test_no_label_in_common_is_an_error_that_shows_the_clips_labels(write):
    with pytest.raises(ClipError, match=r"clip\.c3d: no label of the clip is in .*it has P1, P2"):
        associate(clip_of("P1", "P2"), read_association(write("LFWT LFWT\n")))


def test_mismatches_say_the_line_and_what_the_clip_offers(write):
    found = read_association(write("LFWT LFWT\n\nLSHN LTIB\n"))
    (one,) = associate(clip_of("LFWT", "LSHIN"), found)
    absent, unmatched = one.mismatches(found)
    assert "LSHN (line 3, did you mean LSHIN?)" in absent
    assert "LSHIN" in unmatched
    # Most labels of a set are as much alike as these two.
    (one,) = associate(clip_of("LFWT", "LSHO"), found)
    assert "LSHN (line 3)" in one.mismatches(found)[0]


def test_ignored_labels_are_no_mismatch(write):
    found = read_association(write("LFWT LFWT\nignore *-[0-9]\n"))
    (one,) = associate(clip_of("LFWT", "RBAC-1"), found)
    assert one.unmatched == ()
    assert one.ignored == ("RBAC-1",)


def test_markers_come_in_the_skeletons_order_whatever_the_clips(write):
    found = read_association(write("A LBWT\nB RFWT\nC Z9 Hips\nD LFWT\n"))
    (one,) = associate(clip_of("C", "A", "D", "B"), found)
    assert list(one.columns["Hips"]) == ["RFWT", "LFWT", "LBWT", "Z9"]


# Parts of a body, and sets of a few markers a segment; all the others cover whole bodies.
SMALL = {
    "left_arm", "left_leg", "right_arm", "right_leg", "lower_body_plates",
    "plug_in_gait_kad", "numbered_points",
}  # fmt: skip
# Its comment says why nothing can be fitted.
NOTHING_TO_FIT = "motion_monitor_points"


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_shipped_files_read_by_bare_name(path):
    found = read_association(path.stem)
    assert found.path == str(path)
    if path.stem == NOTHING_TO_FIT:
        assert found.rules == () and found.ignored
        return
    assert len(found.rules) >= (30 if path.stem not in SMALL else 12)
    root = found.skeleton.root.name
    assert sum(r.segment == root for r in found.rules) >= 3  # or no clip of it could be fitted


def test_cmu_maps_the_41_markers():
    rules = {r.label: r.marker for r in read_association("cmu").rules}
    assert len(rules) == 41
    assert (rules["LFRM"], rules["LSHN"]) == ("LARM", "LTIB")


LEG = """
name = "leg"
[[segment]]
name = "Shank"
parent = "Thigh"
joint = "Knee"
markers = ["S1", "S2"]
ends = ["S2"]
prior = {mean = ["T3"], sd = 0.02, source = "me"}
[[segment]]
name = "Thigh"
markers = ["T1", "T2", "T3"]
"""


def test_an_association_file_names_its_skeleton_beside_itself(write):
    write(LEG, "leg.toml")
    found = read_association(write("@skeleton leg.toml\na T1\nb S1\n"))
    assert found.skeleton.name == "leg"
    assert {r.segment for r in found.rules} == {"Thigh", "Shank"}


# a part of the figure


def test_a_part_of_the_associations_figure_takes_its_markers_only():
    found = read_association("cmu", "upper_body")
    segments = {s.name for s in found.skeleton.segments}
    assert {r.segment for r in found.rules} <= segments
    clip = clip_of_recording(record(human(), marker_set("cmu"), range_of_motion(1, 60), seed=1))
    (one,) = associate(clip, found)
    assert one.unmatched == () and one.absent == ()
    assert {"LKNE", "LFWT"} < set(one.ignored)
    assert len(fit_clip(clip, found).joints) == 7


def test_a_label_that_the_part_has_no_use_for_is_left_out_alone(tmp_path):
    path = tmp_path / "own.txt"
    path.write_text('"knee*" LKNE\nneck C7\n')
    found = read_association(path, "upper_body")
    (one,) = associate(clip_of("knee*", "knee2", "neck"), found)
    assert (one.ignored, one.unmatched) == (("knee*",), ("knee2",))


def test_a_skeleton_that_a_file_names_wrongly_is_said_with_the_line(write):
    path = write("# mine\n\n@skeleton humam\na LFWT\n")
    with pytest.raises(SkeletonError) as error:
        read_association(path)
    assert error.value.message == f"{path}:3: humam: no such skeleton file"
    assert error.value.hint == "did you mean human?"


def test_a_name_of_neither_figure_is_still_an_error(tmp_path):
    path = tmp_path / "own.txt"
    path.write_text("a CLAV\nb CLAF\n")
    with pytest.raises(AssociationError, match=r"own\.txt:2:3: 'CLAF' is no marker"):
        read_association(path, "upper_body")


def test_a_figure_with_none_of_the_markers_is_refused():
    with pytest.raises(AssociationError, match="none of its markers is one of the skeleton 'hand'"):
        read_association("cmu", "hand")


def test_a_set_of_which_nothing_can_be_fitted_says_so():
    clip = replace(
        clip_of_recording(record(human(), {"M1": ("Hips", (0.1, 0, 0))}, range_of_motion(1, 60))),
        name="mm",
    )
    with pytest.raises(ClipError, match="no marker to fit, only labels to ignore"):
        associate(clip, read_association("motion_monitor_points"))


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_every_association_file_says_what_it_is_for(path):
    lines = path.read_text().splitlines()
    assert lines[0].startswith("# ")
    assert max(map(len, lines)) <= 120
    head = [line for line in lines[: lines.index("")] if line.startswith("# ")]
    assert len(head) >= 2


# Which association file belongs to which recording. Every label has its line.
SETS = {
    "cmu/01_01": "cmu",
    "cmu/basketball": "cmu",
    "hdm05/HDM_dg_06-03_03_120": "cmu",
    "functional_hip/FunctionalLHip": "plug_in_gait_clusters",
    "functional_hip/FunctionalWalk": "plug_in_gait_clusters",
    "functional_knee/right_knee": "landmarks_and_triads",
    "plug_in_gait/HC055A01": "oxford_foot_model",
    "plug_in_gait/HC055A34": "oxford_foot_model",
    "two_subjects/kinematics_tennis_serve_2players": "plug_in_gait",
    "odd_files/Dance": "phoenix_channels",
    "odd_files/bad_parameter_section": "numbered_points",
    "odd_files/Eb015pi": "lower_body_plates",
    "odd_files/Eb015si": "lower_body_plates",
    "odd_files/duplicate_labels": "wheelchair_upper_body",
    "odd_files/sub_labels": "plug_in_gait_kad",
}


@pytest.mark.real
@pytest.mark.parametrize("clip", SETS)
def test_every_label_of_every_recording_is_assigned_or_ignored_with_a_reason(shared_clips, clip):
    read = read_clip(shared_clips / f"{clip}.c3d")
    found = associate(read, read_association(SETS[clip]))
    assert found
    for subject in found:
        assert subject.unmatched == ()
        assert sum(map(len, subject.columns.values())) >= 12

"""Association files: what they may say, what goes wrong where, and how they meet a clip."""

from pathlib import Path

import numpy as np
import pytest

from mocap_skel.clip import Clip
from mocap_skel.errors import AssociationError, ClipError, MocapSkelError, SkeletonError
from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.labels.association import associate, read_association

SHIPPED = sorted((Path(__file__).parents[2] / "association_files").glob("*.txt"))


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
    ann, ben = associate(clip_of("Ann:LFWT", "Ben:LFWT", "Ann:RFWT", "Ben:RFWT"), found)
    assert ann.columns == {"Hips": {"RFWT": 2, "LFWT": 0}}
    assert ben.columns == {"Hips": {"RFWT": 3}}


def test_no_label_in_common_is_an_error_that_shows_the_clips_labels(write):
    with pytest.raises(ClipError, match=r"clip\.c3d: no label of the clip is in .*it has P1, P2"):
        associate(clip_of("P1", "P2"), read_association(write("LFWT LFWT\n")))


def test_mismatches_say_the_line_and_what_the_clip_offers(write):
    found = read_association(write("LFWT LFWT\n\nLSHN LTIB\n"))
    (one,) = associate(clip_of("LFWT", "LSHIN"), found)
    absent, unmatched = one.mismatches(found)
    assert "LSHN (line 3, did you mean LSHIN?)" in absent
    assert "LSHIN" in unmatched


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


@pytest.mark.parametrize("path", SHIPPED, ids=lambda p: p.stem)
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


def test_the_standard_human_has_the_51_names_of_table_1():
    human = read_skeleton("human")
    assert len(human.segment_of) == 51
    assert (len(human.segments), len(human.joints), len(human.leaves)) == (15, 14, 5)
    assert human.segment_of["RFTShould"] == "Chest"
    assert human.segment_of["RPelvis"] == "Hips"


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


def test_a_skeleton_file_gives_any_tree_parents_first(write):
    leg = read_skeleton(write(LEG, "leg.toml"))
    assert [s.name for s in leg.segments] == ["Thigh", "Shank"]
    assert leg.joints == ("Knee",)
    assert leg["Shank"].ends == ("S2",)
    assert leg["Shank"].priors[0].sd == 0.02


def test_an_association_file_names_its_skeleton_beside_itself(write):
    write(LEG, "leg.toml")
    found = read_association(write("@skeleton leg.toml\na T1\nb S1\n"))
    assert found.skeleton.name == "leg"
    assert {r.segment for r in found.rules} == {"Thigh", "Shank"}


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ('name = "Thigh"', 'name = "Thigh"\nparent = "Shank"\njoint = "Hip"', "exactly one root"),
        ('parent = "Thigh"\njoint = "Knee"\n', "", "exactly one root"),
        ('parent = "Thigh"', 'parent = "Tigh"', "hangs from unknown 'Tigh'"),
        ('joint = "Knee"\n', "", "belong together"),
        ('"S2"]\nends', '"T1"]\nends', "is not one of its markers"),
        ('markers = ["S1", "S2"]', 'markers = ["S1", "S2", "T1"]', "marker 'T1' stands in it 2"),
        ("sd = 0.02", "sd = -1", "sd is a length"),
        ('joint = "Knee"', 'joint = "Thigh"', "names a segment and a joint"),
        ('markers = ["S1"', 'marker = ["S1"', "unknown key 'marker'"),
        ('joint = "Knee"', 'joint = "Knee"\nrest = [0, 1]', "rest: three numbers are needed"),
        ('joint = "Knee"', 'joint = "Knee"\nrest = [0, true, 1]', "three numbers are needed"),
        ('joint = "Knee"', 'joint = "Knee"\nrest_joint = [0, nan, 1]', "not [0, nan, 1]"),
        ('joint = "Knee"', 'joint = "Knee"\nrest = "up"', "not 'up'"),
        (
            'joint = "Knee"',
            'joint = "Knee"\nrest_axis = [0, 0, 0]',
            "rest_axis: a direction is needed",
        ),
        ('name = "Thigh"', 'name = "Thigh"\nrest_axis = [1, 0, 0]', "the root has none"),
        ("[[segment]]", "[[segment", "leg.toml"),
    ],
)
def test_a_skeleton_that_does_not_hold_together_says_why(write, old, new, what):
    assert old in LEG
    with pytest.raises(SkeletonError) as error:
        read_skeleton(write(LEG.replace(old, new), "leg.toml"))
    assert what in error.value.message
    assert "leg.toml" in error.value.message


def test_segments_that_hang_in_a_circle(write):
    text = (
        LEG
        + '[[segment]]\nname="A"\nparent="B"\njoint="x"\n[[segment]]\nname="B"\nparent="A"\njoint="y"\n'
    )
    with pytest.raises(SkeletonError, match="in a circle: A, B"):
        read_skeleton(write(text, "leg.toml"))

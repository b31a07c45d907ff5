"""A guess as a whole: what several subjects say together, when it is sure enough, and its file."""

from dataclasses import replace
from fnmatch import fnmatchcase

import numpy as np
import pytest
from labelled import CLIP, CMU, more, on, renamed, unseen
from recordings import SAMPLES

from mocap_skel import associate, read_association, read_clip
from mocap_skel.errors import CallError
from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.labels.guess import Guess, Line, check_sure, guess_association, in_words, repeated
from mocap_skel.labels.guess.catalogue import shipped_associations
from mocap_skel.labels.guess.names import HIGH, LIKELY, OPEN, UNSURE
from mocap_skel.labels.guess.text import association_text, quoted

TWO = read_clip(SAMPLES / "two_dancers.c3d")
STILL = read_clip(SAMPLES / "nearly_still.c3d")


def line_of(guess, label):
    return next(line for line in guess.lines if line.label == label)


def column(clip, subject, label):
    return [*zip(clip.subjects, clip.labels, strict=True)].index((subject, label))


# several subjects with the same labels


def hidden(clip, subject, label):
    """A clip without the samples of one subject's label."""
    points = clip.points.copy()
    points[:, column(clip, subject, label)] = np.nan
    return replace(clip, points=points)


def test_one_subject_that_contradicts_a_name_is_enough():
    points = TWO.points.copy()
    ben = [column(TWO, "Ben", label) for label in ("LFHD", "RANK")]
    points[:, ben] = points[:, ben[::-1]]
    guess = guess_association(replace(TWO, points=points))
    assert {line.label for line in guess.lines if line.contradicted} == {"LFHD", "RANK"}


def test_subjects_agree_on_what_the_least_certain_of_them_knows():
    clip = renamed(TWO, {"LTHI": "LTHI2"})
    assert line_of(guess_association(clip), "LTHI2").confidence == HIGH
    clip = hidden(clip, "Ben", "LTHI2")
    assert line_of(guess_association(clip), "LTHI2").confidence == LIKELY
    assert line_of(guess_association(clip, "Anna"), "LTHI2").confidence == HIGH


def test_subjects_that_do_not_agree_leave_a_label_open():
    clip = hidden(renamed(TWO, {"STRN": "nobody"}), "Ben", "nobody")
    found = line_of(guess_association(clip), "nobody")
    assert (found.segment, found.confidence) == ("", OPEN)
    assert "motion does not agree in all subjects" in found.reason
    assert line_of(guess_association(clip, "Anna"), "nobody").segment == "Chest"


def test_a_subject_that_is_not_there_is_refused():
    with pytest.raises(CallError, match="no subject 'Bem'"):
        guess_association(TWO, "Bem")


# sure enough


@pytest.mark.parametrize(("placed", "sure"), [(21, True), (20, False)])
def test_half_of_the_labels_have_to_be_placed(placed, sure):
    """Of 41, of which motion can place none; computed points and labels that are never seen do not count."""
    kept = [*(label for label in CMU if CMU[label][0] == "Hips"), *CMU]
    lost = [label for label in CMU if label not in [*dict.fromkeys(kept)][:placed]]
    clip = renamed(STILL, {label: f"obj{label[::-1]}x" for label in lost})
    model = {name: np.cumsum(np.full((300, 3), 0.001 * k), axis=0) for k, name in
             enumerate(("CentreOfMass", "LHJC", "RHJC", "LKJC"), 1)}  # fmt: skip
    clip = more(clip, model | {"pixel": np.full((300, 3), np.nan)})
    guess = guess_association(clip)
    assert len(guess.used) == placed
    if sure:
        check_sure(guess)
    else:
        with pytest.raises(CallError, match="only 20 of 41 labels could be placed"):
            check_sure(guess)
    assert in_words(guess).startswith(f"{placed} of 46 labels placed (")
    assert in_words(guess).endswith("computed points, no markers: 4")


@pytest.mark.parametrize("name", [str, "obj{}".format])
def test_a_root_that_is_not_seen_is_not_sure(name):
    """Whatever its markers are called, where no other segment could be a root: thighs have two here."""
    hips = [label for label in CMU if CMU[label][0] in ("Hips", "Chest", "Head")]
    guess = guess_association(renamed(unseen(CLIP, hips), {label: name(label) for label in hips}))
    with pytest.raises(CallError, match="Hips needs three markers, and only none could be placed"):
        check_sure(guess)
    assert not any(line.seen for line in guess.lines if "FWT" in line.label or "BWT" in line.label)


def test_the_hint_repeats_how_the_clip_was_read():
    how = repeated("Ben", "cm", 50.0, salvage=True)
    assert how == ["--salvage", "--subject", "Ben", "--unit", "cm", "--rate", "50.0"]
    roots = [label for label in CMU if CMU[label][0] in ("Hips", "Chest", "Head")]
    with pytest.raises(CallError) as error:
        check_sure(guess_association(unseen(CLIP, roots)), how)
    called = f"mocap-skel assoc guess artificial {' '.join(how)} -o assoc.txt"
    assert error.value.hint.startswith(called)


# names of their own, and the file


def test_a_label_on_another_segment_than_its_standard_marker_gets_a_name_of_its_own(tmp_path):
    """With a forearm beside it, RARM is the upper arm; Table 1 has it on the forearm."""
    clip = more(CLIP, {"RARM": on("UpperRightArm", (0.0, -0.05, -0.1), np.random.default_rng(1))})
    guess = guess_association(clip)
    found = line_of(guess, "RARM")
    assert (found.segment, found.marker, found.standard) == ("UpperRightArm", "RARM_own", False)
    assert line_of(guess, "RFRM").marker == "RARM"
    path = tmp_path / "own.txt"
    path.write_text(association_text(guess))
    (one,) = associate(clip, read_association(path))
    assert one.columns["UpperRightArm"]["RARM_own"] == 41
    assert one.columns["LowerRightArm"]["RARM"] == clip.labels.index("RFRM")


def test_a_label_that_is_a_pattern_leaves_out_itself_only():
    clip = renamed(STILL, {"LTHI": "obj*", "RTHI": "obj[1]", "LKNE": "obj1"})
    left_out = guess_association(clip).association().ignored
    for label in ("obj*", "obj[1]", "obj1"):
        assert sum(fnmatchcase(label, pattern) for pattern in left_out) == 1


@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("LKNE", "LKNE"), ("r should", '"r should"'), ("#7", '"#7"'), ("@LKNE", '"@LKNE"'),
        ("L@KNE", "L@KNE"), ("L#KNE", '"L#KNE"'), ("", '""'),
    ],
)  # fmt: skip
def test_a_name_is_quoted_where_a_file_needs_it(name, written):
    assert quoted(name) == written


def guessed_by_hand(*lines, skeleton="human"):
    return Guess("a\nclip", read_skeleton(skeleton), lines)


def test_what_is_written_is_what_is_read(tmp_path):
    """Labels that mean something else in a file, lines that are not used, and a part of the human."""
    guess = guessed_by_hand(
        Line("ignore", "RKNE", "UpperRightLeg", True, HIGH, "for\nsure"),
        Line("@skeleton", "RTHI", "UpperRightLeg", True, HIGH, "odd"),
        Line("mine", "mine", "RightFoot", False, LIKELY, "moves"),
        Line("RTIB", "RTIB", "LowerRightLeg", True, UNSURE, "perhaps"),
        Line("pixel", "", "", False, OPEN, "nothing", seen=False),
        skeleton="right_leg",
    )
    text = association_text(guess)
    path = tmp_path / "leg.txt"
    path.write_text(text)
    found = read_association(path)
    assert found.skeleton == read_skeleton("right_leg")
    assert [(r.label, r.marker, r.segment) for r in found.rules] == [
        ("ignore", "RKNE", "UpperRightLeg"),
        ("@skeleton", "RTHI", "UpperRightLeg"),
        ("mine", "mine", "RightFoot"),
    ]
    assert found.ignored == ()
    rows = {row.split("  # ")[1].split(":")[0]: row for row in text.splitlines() if "  # " in row}
    assert rows["unsure"].startswith("# RTIB  RTIB")
    assert rows["not placed"].endswith("nothing; never seen in the clip")
    assert text.startswith("# a clip: association guessed")
    assert "# 5 labels: 2 high, 1 likely, 1 unsure, 1 open." in text


def test_a_guess_in_words_counts_what_is_left_out():
    words = in_words(
        guessed_by_hand(
            Line("a", "LKNE", "UpperLeftLeg", True, HIGH, ""),
            Line("b", "b", "Hips", False, LIKELY, ""),
            Line("c", "", "", False, UNSURE, ""),
            Line("d", "", "", False, OPEN, ""),
            Line("e", "", "", False, OPEN, "", computed=True),
        )
    )
    assert words == (
        "2 of 5 labels placed (1 high, 1 likely); unsure and left out: c; not placed: d; "
        "computed points, no markers: 1"
    )


def test_shipped_files_say_what_they_are_for_and_not_how_they_are_laid_out():
    said = shipped_associations()
    assert said["cmu"].startswith("The 41 markers of the CMU Graphics Lab")
    assert all(text and "LABEL" not in text and "#" not in text for text in said.values())

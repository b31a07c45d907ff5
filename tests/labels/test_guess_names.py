"""What the names of markers say: every set of marker_sets.toml, and the rules that hold for all."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mocap_skel import read_association
from mocap_skel.clip import Clip
from mocap_skel.errors import CallError
from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.labels.guess import guess_association
from mocap_skel.labels.guess.catalogue import standard_markers
from mocap_skel.labels.guess.dialects import dialects
from mocap_skel.labels.guess.names import HIGH, LIKELY, OPEN, UNSURE, guess_names, tokens
from mocap_skel.labels.guess.text import association_text

HUMAN = read_skeleton("human")
STANDARD = HUMAN.segment_of
# The table's landmarks too.
NAMED = {**dialects().landmarks, **STANDARD}
SETS = tomllib.loads((Path(__file__).parent / "marker_sets.toml").read_text())


def guessed(labels):
    return guess_names(labels, STANDARD.items())


def expected(name):
    return {
        label.strip(): segment
        for segment, text in SETS[name].items()
        for label in (text.split("|") if "|" in text else text.split())
    }


@pytest.mark.parametrize("name", SETS)
def test_every_label_of_a_set_is_on_its_segment(name):
    wanted = expected(name)
    found = guessed(list(wanted))
    for label, segment in wanted.items():
        guess = found[label]
        placed = guess.segment if guess.confidence in (HIGH, LIKELY) else "Open"
        if segment == "Out":
            assert placed == "Open", guess
        else:
            assert placed == segment, guess


def test_a_standard_marker_is_given_once_and_on_its_own_segment():
    for name in SETS:
        given = [g for g in guessed(list(expected(name))).values() if g.marker]
        assert len(given) == len({g.marker for g in given}), name
        assert all(NAMED[g.marker] == g.segment for g in given), name


def test_the_order_of_the_labels_does_not_matter_for_segments():
    for name in SETS:
        labels = list(expected(name))
        there, back = guessed(labels), guessed(labels[::-1])
        assert all(there[label].segment == back[label].segment for label in labels), name


def test_the_mirrored_label_is_on_the_mirrored_segment():
    """Where a label starts with its side, the other side's label says the other side."""
    other = {"L": "R", "R": "L", "l": "r", "r": "l"}
    long = {"Left": "Right", "Right": "Left"}
    count = 0
    for name in SETS:
        if {"Open", "Out"} & set(SETS[name]) or name == "french_sides":
            continue
        labels = [
            label
            for label, segment in expected(name).items()
            if label[0] in other and any(side in segment for side in long) and len(label) > 2
            if not label.lower().startswith(("left", "right", "lt", "rt"))
        ]
        mirrored = [other[label[0]] + label[1:] for label in labels]
        found = guessed(list(dict.fromkeys([*expected(name), *mirrored])))
        for label, twin in zip(labels, mirrored, strict=True):
            segment = found[label].segment
            side = next(s for s in long if s in segment)
            assert found[twin].segment == segment.replace(side, long[side]), (name, label)
        count += len(labels)
    assert count > 200


@pytest.mark.parametrize(
    ("label", "marker"),
    [
        ("r should", "RSHO"), ("L_knee_lat", "LKNE"), ("RightKneeLateral", "RKNE"),
        ("R.ASIS", "RFWT"), ("LPSI", "LBWT"), ("WaistRBack", "RBWT"), ("Hip_LFront", "LFWT"),
        ("RLFE", "RKNE"), ("R_FAL", "RANK"), ("LHMH2", "LFIN"), ("LGT", "LGTR"), ("R.Heel", "RHEE"),
        ("pLeftLatMalleolus", "LANK"), ("LFRA", "LARM"), ("RBAK", "RBAC"), ("R.Bicep", "RUPA"),
        ("Sternum", "STRN"), ("CV7", "C7"), ("TV10", "T10"), ("r_5meta_study", "RMT5"),
        ("R_Metatarsal_5", "RMT5"), ("L Metatarsal 05", "LMT5"), ("R10", "R10"), ("LFTShould", "LFTShould"), ("RightAcromion", "RSHO"), ("L.Wrist.Ulnar", "LWRB"),
    ],
)  # fmt: skip
def test_a_place_with_a_standard_marker_gets_it(label, marker):
    assert guessed([label])[label].marker == marker


@pytest.mark.parametrize(
    "label",
    ["RTH1", "LFHD_2", "RCLA", "HeadFront", "R_Metatarsal_3", "RKAX", "Coccyx"],
)
def test_a_place_without_a_standard_marker_gets_none(label):
    others = ["RTH2", "RTH3", "LFHD", "LKNE"]
    assert guessed([label, *others])[label].marker == ""
    assert guessed([label, *others])[label].segment != ""


@pytest.mark.parametrize(
    ("lateral", "medial", "place"),
    [
        ("{s}LatCond", "{s}MedCond", "KN"), ("{s} lateral condyle", "{s} medial condyle", "KN"),
        ("{s}LEPI", "{s}MEPI", "KN"), ("LFE{s}", "MFE{s}", "KN"), ("{s}ANL", "{s}ANM", "AN"),
        ("{s} lat humeral condyle", "{s} med humeral condyle", "EL"),
    ],
)  # fmt: skip
def test_lateral_and_medial_are_landmarks_in_any_spelling(lateral, medial, place):
    """LFEL beside LFER is the left lateral epicondyle, no axis that a model wrote."""
    names = {"KN": ("KNE", "KNM"), "AN": ("ANK", "MED"), "EL": ("ELB", "MEP")}[place]
    wanted = {
        way.format(s=s): s + n
        for s in "LR"
        for way, n in zip((lateral, medial), names, strict=True)
    }
    found = guessed([*wanted, "LASI", "RASI"])
    assert {label: found[label].marker for label in wanted} == wanted


def test_what_models_write_under_a_side_is_computed():
    found = guessed(["LFEL", "RFEL", "LFEO", "RFEO"])
    assert all(guess.computed for guess in found.values())


def test_the_better_name_gets_the_standard_marker():
    found = guessed(["LSHN", "LTIB"])
    assert (found["LTIB"].marker, found["LSHN"].marker) == ("LTIB", "")
    assert found["LSHN"].segment == "LowerLeftLeg"
    assert "LTIB is LTIB" in found["LSHN"].reason


def test_letters_of_clusters_mean_what_the_other_letters_leave():
    with_femur = guessed(["LF1", "LF2", "LT1", "LT2"])
    with_shank = guessed(["LS1", "LS2", "LT1", "LT2"])
    alone = guessed(["LT1", "LT2", "LT3"])
    assert with_femur["LT1"].segment == "LowerLeftLeg"
    assert with_shank["LT1"].segment == "UpperLeftLeg"
    assert alone["LT1"].confidence == OPEN


@pytest.mark.parametrize(
    ("labels", "wanted"),
    [
        ("LeftUpLeg LeftLeg LeftFoot", ["UpperLeftLeg", "LowerLeftLeg", "LeftFoot"]),
        ("RightUpLeg1 RightUpLeg2", ["UpperRightLeg"] * 2),
        ("LLE LME LLM LMM", ["UpperLeftLeg"] * 2 + ["LowerLeftLeg"] * 2),
        ("LLE LME LUA1 LUA2 LFA1 LFA2 LRS LUS", ["", "", *["UpperLeftArm"] * 2, *["LowerLeftArm"] * 4]),
        ("LLE LME", ["", ""]),
        ("LH1 LH2 LH3 LHAND", ["LeftHand"] * 4),
        ("LH1 LH2 LH3 LKNE", ["", "", "", "UpperLeftLeg"]),
        ("H1 H2 H3", ["Head"] * 3),
        ("LFT1 LFT2 LFT3 LLFC LMFC", ["", "", "", "UpperLeftLeg", "UpperLeftLeg"]),
        ("LFT1 LFT2 LTH1 LTH2 LLFC", ["LeftFoot"] * 2 + ["UpperLeftLeg"] * 3),
    ],
)  # fmt: skip
def test_a_code_of_two_places_is_what_the_other_labels_leave(labels, wanted):
    found = guessed(labels.split())
    assert [g.segment if g.confidence in (HIGH, LIKELY) else "" for g in found.values()] == wanted


def test_d_and_g_are_sides_only_where_a_whole_set_has_them():
    assert guessed(["ELD", "EMD"])["ELD"].segment == ""
    labels = ["ACD", "ACG", "ELD", "ELG", "EMD", "EMG", "TEMPD", "TEMPG"]
    assert guessed(labels)["ELG"].segment == "UpperLeftArm"
    # Where L and R pairs are as many, they are the sides.
    pairs = [f"{side}{x}" for x in ("KNE", "ANK", "TOE", "HEE") for side in "LR"]
    assert guessed([*labels, *pairs[:6]])["ELG"].segment == "UpperLeftArm"
    assert guessed([*labels, *pairs])["ELG"].segment == ""


def test_a_double_is_less_certain_than_what_it_doubles():
    found = guessed(["LFHD", "LFHD_2", "LKAX", "LKAX_2"])
    assert [g.confidence for g in found.values()] == [HIGH, LIKELY, UNSURE, UNSURE]
    assert (found["LFHD_2"].segment, found["LFHD_2"].double_of) == ("Head", "LFHD")


def test_four_numbers_from_0_on_are_axes_that_a_model_wrote():
    axes = guessed([f"LASI{i}" for i in range(4)])
    assert all(g.computed and g.segment == "" for g in axes.values())
    for numbers in (range(3), range(1, 4), range(5)):
        found = guessed([f"LASI{i}" for i in numbers])
        assert all((g.computed, g.segment) == (False, "Hips") for g in found.values())
    assert guessed(["LASI0"])["LASI0"].computed


def test_the_forearm_of_table_1_is_the_upper_arm_beside_another_forearm():
    assert guessed(["RARM"])["RARM"].segment == "LowerRightArm"
    found = guessed(["RARM", "RFRM"])
    assert (found["RARM"].segment, found["RFRM"].marker) == ("UpperRightArm", "RARM")


@pytest.mark.parametrize("label", ["LeftRightKnee", "left knee right", "Knee Lat"])
def test_words_that_name_both_sides_or_none_place_nothing(label):
    assert (guessed([label])[label].segment, guessed([label])[label].confidence) == ("", OPEN)


def test_a_word_that_nobody_knows_makes_a_guess_unsure():
    guess = guessed(["RightHandRacket"])["RightHandRacket"]
    assert guess.confidence == "unsure"
    assert "racket" in guess.reason


@pytest.mark.parametrize(
    ("label", "words"),
    [
        ("RightKneeLat", ["right", "knee", "lat"]), ("L.Toe_tip", ["l", "toe", "tip"]),
        ("WaistLFront", ["waist", "l", "front"]), ("LT01", ["lt", "01"]), ("", []), ("Knöchel ß", ["knochel", "ss"]),
    ],
)  # fmt: skip
def test_labels_fall_into_words(label, words):
    assert tokens(label) == words


def test_the_table_speaks_of_the_standard_human_only():
    table = dialects()
    segments = {s.name for s in HUMAN.segments}
    places = [c.place for codes in table.codes.values() for c in codes]
    places += [p for several in table.clusters.values() for p in several]
    places += [p for _, p in table.phrases] + [p for _, ps in table.letters for p in ps.values()]
    for place in places:
        for side in ("L", "R") if place.sided else ("L", "R", ""):
            segment, marker = place.named(side)
            assert segment in segments
            if marker and place.side in ("", side):
                assert NAMED[marker] == segment
                assert STANDARD.get(marker, segment) == segment
    words = set(table.words.values())
    assert all(phrase <= words for phrase, _ in table.phrases)


def test_table_1_has_a_place_for_every_standard_marker():
    rows = standard_markers()
    assert len(rows) == 51
    assert all(row["location"] for row in rows)
    assert rows[0] == {"marker": "RFWT", "segment": "Hips", "location": "anterior right top"}


KNOWN = [label for name in SETS for label in expected(name)]
TEXT = st.text(st.characters(blacklist_categories=("C", "Z")) | st.just(" "), min_size=1).map(
    str.strip
)
LABELS = st.lists(st.sampled_from(KNOWN) | TEXT.filter(bool), min_size=1, max_size=12, unique=True)


@given(labels=LABELS)
@settings(max_examples=150, deadline=None, derandomize=True)
def test_whatever_the_labels_are_the_written_file_says_what_was_guessed(labels, tmp_path_factory):
    clip = Clip(
        "any.c3d", np.zeros((3, len(labels), 3)), tuple(labels), ("",) * len(labels),
        50.0, 1, "m", "z", {}, (),
    )  # fmt: skip
    try:
        guess = guess_association(clip)
    except CallError:
        assert not any(g.confidence in (HIGH, LIKELY) and '"' not in g.label
                       for g in guessed(labels).values())  # fmt: skip
        return
    path = tmp_path_factory.mktemp("any") / "any.txt"
    path.write_text(association_text(guess), encoding="utf-8")
    read = {(r.label, r.marker, r.segment) for r in read_association(path).rules}
    assert read == {(x.label, x.marker, x.segment) for x in guess.used}
    assert len(guess.lines) == len(labels)

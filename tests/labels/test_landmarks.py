"""A landmark is a landmark whatever a clip calls it; of two beside a joint, places check the names."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings import clip_of, fit_clip

from mocap_skel import associate, read_association
from mocap_skel.artificial import Faults, human, marker_set, record, still, walk
from mocap_skel.artificial.markers import place_of
from mocap_skel.errors import AssociationError
from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.labels.guess import guess_association
from mocap_skel.labels.guess.names import guess_names, meanings
from mocap_skel.labels.landmarks import exchanged, own_names

STANDARD = read_skeleton("human").segment_of
SIGMA = 0.001
MEDIAL = {m: place_of(m) for s in "LR" for m in (f"{s}KNM", f"{s}MED", f"{s}MEP")}
PAIRS = {"KNM": "KNE", "MED": "ANK", "MEP": "ELB"}
# Spellings without a side, by landmark.
SPELLINGS = {
    "KNM": ["KNM", "KneeM", "Knee_Med", "Knee.Medial", "KneeIn", "Inner Knee", "MKNE", "MFE", "MFC",
            "Medial Femoral Epicondyle", "Med_Fem_Cond", "MedialKnee", "knee-int"],
    "MED": ["MED", "MMAL", "AnkleM", "Ankle_Med", "Medial.Malleolus", "Malleolus Medial", "TAM", "SPH",
            "InnerAnkle", "AnkIn", "MedMal", "int malleolus"],
    "MEP": ["MEP", "MHE", "ElbowM", "Elbow_Med", "Medial Humeral Epicondyle", "MELB", "Elbow.Inner"],
    "KNE": ["KNE", "Knee", "Knee_Lat", "LFC", "Lateral Femoral Epicondyle", "KneeOut"],
    "GTR": ["GTR", "Troch", "Greater Trochanter", "GreatTroch", "GT"],
    "SHO": ["SHO", "Acromion", "ACR", "Shoulder", "Shoulder_Top"],
    "MT1": ["MT1", "Metatarsal 1", "First Metatarsal Head", "MTH1"],
    "MT5": ["MT5", "Metatarsal 5", "Fifth Metatarsal Head", "MTH5"],
    "WRA": ["WRA", "Radial Styloid", "Styloid_Radius"],
    "TRG": ["Tragus", "TRAG"],
}  # fmt: skip
SACRA = [
    "sacrum", "SACR", "VSAC", "V.Sacral", "v_sacral", "SAC", "S1", "L5/S1", "L5S1", "Mid_PSIS", "PSIS",
    "Sacral", "Pelvis Back", "WaistBack", "Sacrum Upper",
]  # fmt: skip


def filmed(motion):
    """A recording of the Plug-in Gait set with medial markers, and its clip."""
    markers = {**marker_set("plug_in_gait"), **MEDIAL}
    recording = record(human(), markers, motion, Faults(sigma=SIGMA), seed=3)
    return recording, clip_of(recording)


@pytest.fixture(scope="module")
def standing():
    return filmed(still(3, 60, 3))


@pytest.fixture(scope="module")
def walking():
    return filmed(walk(4, 60, 3))


def named(clip, names):
    return replace(clip, labels=tuple(names.get(label, label) for label in clip.labels))


def error(fit, recording, joint):
    """Median distance from the truth, metres."""
    found = next(j for j in fit.joints if j.joint == joint)
    return float(np.nanmedian(np.linalg.norm(found.track - recording.truth[joint], axis=1)))


def guessed(clip):
    association = guess_association(clip).association()
    return association, associate(clip, association)[0]


def with_sacrum(clip, name):
    """One marker between those on the posterior spines, in place of both."""
    middle = clip.points[:, [clip.labels.index(m) for m in ("LPSI", "RPSI")]].mean(axis=1)
    keep = [i for i, label in enumerate(clip.labels) if label not in ("LPSI", "RPSI")]
    points = np.concatenate([clip.points[:, keep], middle[:, None]], axis=1)
    labels = (*(clip.labels[i] for i in keep), name)
    return replace(clip, points=points, labels=labels, subjects=("",) * len(labels))


# --- by name


@settings(deadline=None, max_examples=150)
@given(
    st.sampled_from([(m, s) for m, spellings in SPELLINGS.items() for s in spellings]),
    st.sampled_from(["L{0}", "L_{0}", "L.{0}", "l {0}", "Left{0}", "left_{0}", "LEFT {0}", "{0}_Left"]),
    st.sampled_from([str, str.upper, str.lower]),
)  # fmt: skip
def test_any_spelling_of_a_landmark_is_the_landmark(spelling, side, case):
    marker, text = spelling
    # Only where blanks or signs part the words can case be anything.
    left = side.format(text) if text[1:].lower() != text[1:] else case(side.format(text))
    others = [m for m in marker_set("plug_in_gait") if m[1:] != marker]
    assert guess_names([*others, left], STANDARD.items())[left].marker == f"L{marker}"


@pytest.mark.parametrize("name", SACRA)
def test_a_hip_has_its_pelvis_whatever_the_sacrum_is_called(name, standing):
    recording, clip = standing
    davis = with_sacrum(clip, name)
    association, _ = guessed(davis)
    fit = fit_clip(davis, association)
    # Harrington's regression is right to 2 cm in each direction.
    assert max(error(fit, recording, f"{side}Hip") for side in ("Left", "Right")) < 0.04


@pytest.mark.parametrize("inner", ["{}KneeM", "{}.Knee.Med", "{}_MFC", "Inner Knee {}"])
@pytest.mark.parametrize("last", [False, True])
def test_a_knee_lies_between_its_epicondyles_in_any_order_of_the_file(inner, last, standing):
    recording, clip = standing
    names = {f"{s}KNM": inner.format(s) for s in "LR"} | {f"{s}KNE": f"{s}KneeL" for s in "LR"}
    order = sorted(range(len(clip.labels)), key=lambda i: (clip.labels[i][1:] == "KNM") == last)
    labels = named(clip, names).labels
    turned = replace(
        clip, points=clip.points[:, order], labels=tuple(labels[i] for i in order)
    )  # fmt: skip
    association, assignment = guessed(turned)
    assert assignment.by_place == ()
    fit = fit_clip(turned, association)
    for side in ("Left", "Right"):
        assert error(fit, recording, f"{side}Knee") < 0.02


def test_what_a_name_may_be_where_its_segment_is_known_from_elsewhere():
    assert meanings("LME") == (("UpperLeftLeg", "LKNM"),)
    assert meanings("R_MedialEpicondyle") == (("UpperRightArm", "RMEP"), ("UpperRightLeg", "RKNM"))
    assert meanings("point 7") == ()


# --- in association files


@pytest.mark.parametrize(
    ("line", "name"),
    [
        ("back V.Sacral Hips", "V.Sacral"),
        ("back SACR", "SACR"),
        ("back sacrum", "sacrum"),
        ('back "L5/S1"', "L5/S1"),
    ],
)
def test_an_association_file_may_name_a_landmark_by_a_synonym(tmp_path, standing, line, name):
    recording, clip = standing
    davis = with_sacrum(clip, "back")
    standard = {"LASI": "LFWT", "RASI": "RFWT", "LFRM": "LARM", "RFRM": "RARM"}
    rest = [m for m in davis.labels if m in STANDARD or m in standard]
    path = tmp_path / "map.txt"
    path.write_text("\n".join([*(f"{m} {standard.get(m, m)}" for m in rest), line]))
    fit = fit_clip(davis, read_association(path))
    assert error(fit, recording, "LeftHip") < 0.04
    # The marker keeps the name that the file gives it.
    assert name in next(j for j in fit.joints if j.joint == "LeftHip").landmarks
    assert read_association(path, "lower_body").rules[-1].segment == "Hips"


def test_a_misspelt_standard_marker_is_still_an_error(tmp_path):
    path = tmp_path / "map.txt"
    path.write_text("LASI LFWT\nLKNEE LKNEE\n")
    with pytest.raises(AssociationError, match="'LKNEE' is no marker") as raised:
        read_association(path)
    assert "LKNE" in (raised.value.hint or "")


def test_a_standard_name_stays_and_a_name_on_another_segment_is_no_landmark():
    columns = {"UpperLeftLeg": {"LKNM": 0, "LMFE": 1}, "Chest": {"sacrum": 2}}
    assert own_names(columns, ["a", "b", "c"]) == {}
    assert own_names({"UpperLeftLeg": {"x": 0}}, ["L_Knee_Med"]) == {"LKNM": "x"}


# --- by place


def at(clip):
    return {label: i for i, label in enumerate(clip.labels)}


def swapped(clip, one, other):
    order = list(range(len(clip.labels)))
    i, j = clip.labels.index(one), clip.labels.index(other)
    order[i], order[j] = order[j], order[i]
    return replace(clip, points=clip.points[:, order])


@pytest.mark.parametrize("medial", ["LKNM", "RKNM", "LMED", "RMED", "RMEP"])
def test_a_medial_marker_on_the_outer_side_is_exchanged_and_said(medial, walking):
    _, clip = walking
    lateral = medial[0] + PAIRS[medial[1:]]
    wrong = swapped(clip, lateral, medial)
    found = exchanged(wrong.points, at(wrong))
    assert [(one.lateral, one.medial, one.certain) for one in found] == [(lateral, medial, True)]
    association, assignment = guessed(wrong)
    (note,) = assignment.by_place
    assert f"{medial} is named for the inner side" in note
    assert note in assignment.mismatches(association)
    columns = {m: c for of in assignment.columns.values() for m, c in of.items()}
    assert clip.labels[columns[lateral]] == medial


def test_names_that_places_agree_with_stay_and_nothing_is_said(walking, standing):
    for _, clip in (walking, standing):
        assert exchanged(clip.points, at(clip)) == []
        assert guessed(clip)[1].by_place == ()


def test_a_mirrored_body_has_no_exchanged_markers(walking):
    """Its elbows bend the wrong way: the names stand, and the doubt is said."""
    _, clip = walking
    found = exchanged(clip.points * [-1, 1, 1], at(clip))
    assert {one.lateral for one in found} <= {"LELB", "RELB"}
    assert not any(one.certain for one in found)
    assert all("mirrored" in one.sentence({one.lateral: "a", one.medial: "b"}) for one in found)


def test_markers_that_are_no_pair_and_a_glimpse_prove_nothing(walking):
    _, clip = walking
    wrong = swapped(clip, "LKNE", "LKNM")
    far = wrong.points.copy()
    far[:, at(wrong)["LKNM"]] += [0.0, 0.0, 0.5]
    assert exchanged(far, at(wrong)) == []
    assert exchanged(wrong.points[:5], at(wrong)) == []

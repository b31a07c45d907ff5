"""A pelvis whose markers at the back have no name; landmarks that a number or a letter tells apart."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from labelled import more, renamed
from recordings import clip_of

from mocap_skel import associate
from mocap_skel.artificial import Faults, human, marker_set, record, still, walk
from mocap_skel.artificial.markers import place_of
from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.labels.guess import guess_association
from mocap_skel.labels.guess.names import guess_names
from mocap_skel.labels.guess.running import CROWD, LEAST_SET, crowd, stem

STANDARD = read_skeleton("human").segment_of
SACRUM = {"QQ": ("Hips", (-0.11, 0.0, 0.085))}
MEDIAL = {m: place_of(m) for s in "LR" for m in (f"{s}KNM", f"{s}MED", f"{s}MEP")}
PIG = marker_set("plug_in_gait")
FRONT = {m: place for m, place in PIG.items() if "PSI" not in m}


def filmed(markers, motion):
    return clip_of(record(human(), markers, motion, Faults(sigma=0.001), seed=3))


def on_hips(clip):
    guess = guess_association(clip)
    assert guess.skeleton.name == "human"
    return {x.label: x.marker for x in guess.used if x.segment == "Hips"}


@pytest.mark.parametrize("motion", [walk, still])
def test_an_unnamed_sacrum_is_found_by_its_place(motion):
    found = on_hips(filmed({**FRONT, **SACRUM}, motion(3, 60, 3)))
    assert found == {"LASI": "LFWT", "RASI": "RFWT", "QQ": "SACR"}


@pytest.mark.parametrize("motion", [walk, still])
def test_unnamed_posterior_spines_are_found_by_their_places(motion):
    clip = renamed(filmed(PIG, motion(3, 60, 3)), {"LPSI": "one", "RPSI": "other"})
    found = on_hips(clip)
    assert (found["one"], found["other"]) == ("LBWT", "RBWT")


@pytest.mark.parametrize("motion", [walk, still])
@pytest.mark.parametrize("named", ["LGTR", "T10"])
def test_a_thigh_or_chest_marker_without_a_name_is_not_on_the_pelvis(motion, named):
    others = {m: place for m, place in FRONT.items() if m != "T10"}
    clip = filmed({**others, "QQ": place_of(named)}, motion(3, 60, 3))
    found = {x.label: x.segment for x in guess_association(clip).used}
    assert found.get("QQ") != "Hips"


@pytest.mark.parametrize("ends", ["12", "21", "AB"])
def test_numbers_beside_a_joint_are_told_apart_by_place(ends):
    joints = {"KNM": "KNE", "MED": "ANK", "MEP": "ELB"}
    clip = filmed({**PIG, **MEDIAL}, walk(3, 60, 3))
    names = {f"{s}{m}": f"{s}{x}{ends[1]}" for s in "LR" for m, x in joints.items()}
    names |= {f"{s}{x}": f"{s}{x}{ends[0]}" for s in "LR" for x in joints.values()}
    clip = renamed(clip, names)
    one = associate(clip, guess_association(clip).association())[0]
    column = {marker: c for of in one.columns.values() for marker, c in of.items()}
    found = {landmark: clip.labels[column[own]] for landmark, own in one.landmarks.items()}
    assert {m: found[m] for m in names.keys() & found.keys()} == names


def test_a_patella_is_no_medial_epicondyle():
    places = {**PIG, "LKN2": ("UpperLeftLeg", (0.055, 0.0, -0.42))}
    clip = renamed(filmed(places, walk(3, 60, 3)), {"LKNE": "LKNE1", "LKN2": "LKNE2"})
    one = associate(clip, guess_association(clip).association())[0]
    assert not {"LKNM", "LKNE"} & one.landmarks.keys()


STEMS = {
    "KN": ["KNE", "Knee", "KJ", "FemEpi", "FEMCOND", "Epi"],
    "AN": ["ANK", "Ankle", "Mal", "Malleo", "AJ"],
    "EL": ["ELB", "Elbow", "EJ", "HumEpi"],
}
LANDMARKS = {"KN": ("KNE", "KNM"), "AN": ("ANK", "MED"), "EL": ("ELB", "MEP")}
ENDS = [
    ("L", "M"),
    ("LAT", "MED"),
    ("Out", "In"),
    ("O", "I"),
    ("Ext", "Int"),
    ("lateral", "medial"),
]


@settings(deadline=None, max_examples=100)
@given(
    st.sampled_from([(joint, s) for joint, stems in STEMS.items() for s in stems]),
    st.sampled_from(ENDS),
    st.sampled_from(
        ["{side}_{stem}_{end}", "{side}.{end}.{stem}", "{stem}_{end}_{side}", "{side} {stem}{end}"]
    ),
)
def test_every_stem_takes_every_end_in_any_order(named, ends, way):
    joint, stem = named
    wanted = {
        way.format(side=side, stem=stem, end=end): side + landmark
        for side in "LR"
        for end, landmark in zip(ends, LANDMARKS[joint], strict=True)
    }
    found = guess_names([*wanted, "LASI", "RASI"], STANDARD.items())
    assert {label: found[label].marker for label in wanted} == wanted


@given(
    st.text("abcXYZ*#_ .", min_size=0, max_size=6),
    st.sampled_from(["", "*", ")", "_", "x"]),
    st.integers(CROWD, 60),
)
def test_a_crowd_is_set_aside_beside_a_set_and_never_alone(front, back, count):
    ghosts = [f"{front}{i}{back}" for i in range(1, count + 1)]
    names = list(PIG)
    assert crowd([*names, *ghosts], [*names, *ghosts]) == set(ghosts)
    assert not crowd(ghosts, ghosts)
    assert not crowd([*names[: LEAST_SET - 1], *ghosts], [*names[: LEAST_SET - 1], *ghosts])
    assert len({stem(x) for x in ghosts}) == 1


def test_a_crowd_that_spells_like_a_cluster_refuses_no_set():
    clip = filmed(PIG, walk(3, 60, 3))
    rng = np.random.default_rng(5)
    many = np.cumsum(rng.normal(0, 0.01, (clip.frames, 60, 3)), axis=0)
    guess = guess_association(more(clip, {f"tr{i}": many[:, i] for i in range(60)}))
    assert set(PIG) <= {x.label for x in guess.used}
    assert sum(x.aside for x in guess.lines) >= 55

"""Subjects without a colon: the figure is the same whatever the subject is called and wherever that stands."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from labelled import CLIP, more, renamed
from recordings import SAMPLES

from mocap_skel import artificial as art
from mocap_skel import read_association, read_clip
from mocap_skel.labels.guess import guess_association
from mocap_skel.labels.subjects import with_subjects

TWO = read_clip(SAMPLES / "two_dancers.c3d")
SHORT = replace(TWO, points=TWO.points[:150])
RULES = read_association("cmu")
CALLED = st.text(
    st.characters(codec="ascii", categories=["L", "N"]), min_size=1, max_size=12
) | st.sampled_from(["Skeleton 001", "Ann Lee", "L", "Right", "Head", "S01-b", "Marker 1", "Zoë"])


def called(clip, *ways):
    """The clip, its subjects' names spelled in the labels: one way for each subject."""
    way = dict(zip(clip.subject_names, ways, strict=True))
    labels = tuple(
        way[whose].format(label) for label, whose in zip(clip.labels, clip.subjects, strict=True)
    )
    return replace(clip, labels=labels, subjects=("",) * len(labels))


@settings(max_examples=40, deadline=None)
@given(
    CALLED,
    st.sampled_from(["{n}_{{}}", "{n} {{}}", "{n}-{{}}", "{{}}_{n}", "{{}} {n}", "{{}} ({n})"]),
)
def test_any_name_before_or_behind_is_the_subject(name, way):
    found = with_subjects(called(CLIP, way.format(n=name)))
    assert (found.labels, found.subject_names) == (CLIP.labels, (name,))
    told = with_subjects(called(CLIP, way.format(n=name)), RULES)
    assert (told.labels, told.subject_names) == (found.labels, found.subject_names)


@pytest.mark.parametrize(
    "ways",
    [
        ("Anna_{}", "Ben_{}"), ("{}1", "{}2"), ("{}", "{}_2"), ("{}_A", "{}_B"), ("L_{}", "R_{}"),
        ("{}", "Ben {}"), ("1{}", "2{}"), ("{} (1)", "{} (2)"), ("P1{}", "P2{}"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("rules", [None, RULES])
def test_two_people_never_become_one(ways, rules):
    found = with_subjects(called(SHORT, *ways), rules)
    assert found.labels == SHORT.labels
    assert len(found.subject_names) == 2
    column = dict(zip(SHORT.subject_names, found.subject_names, strict=True))
    assert found.subjects == tuple(column[whose] for whose in SHORT.subjects)


def test_the_guess_is_that_of_a_colon():
    found = with_subjects(called(SHORT, "{}1", "{}2"))
    assert guess_association(found).used == guess_association(SHORT).used


@pytest.mark.parametrize("name", ["cmu", "plug_in_gait"])
def test_sides_and_parts_of_the_body_are_no_subjects(name):
    """With a blank behind the side, and where a whole set is of one side."""
    markers = art.marker_set(name)
    figure = art.human()
    clip = art.record(figure, markers, art.still(1, 50))
    for labels in (
        [f"{x[0]} {x[1:]}" if x[0] in "LR" else x for x in clip.labels],
        [f"left_{x[1:].lower()}" for x in clip.labels if x[0] == "L"],
    ):
        kept = replace(CLIP, labels=tuple(labels), points=clip.points[:, : len(labels)],
                       subjects=("",) * len(labels))  # fmt: skip
        assert with_subjects(kept) is kept


def test_clusters_numbered_on_every_segment_are_one_person():
    """LThigh1 … LThigh4: a number that looks like a person's, but the four are of one segment."""
    stems = {"LThigh": "UpperLeftLeg", "RThigh": "UpperRightLeg", "LShank": "LowerLeftLeg",
             "RShank": "LowerRightLeg", "LFoot": "LeftFoot", "RFoot": "RightFoot", "Pelvis": "Hips",
             "LUpperArm": "UpperLeftArm", "RUpperArm": "UpperRightArm"}  # fmt: skip
    rng = np.random.default_rng(0)
    markers = {
        f"{stem}{n}": (segment, tuple(rng.uniform(-0.06, 0.06, 3)))
        for stem, segment in stems.items()
        for n in range(1, 5)
    }
    recording = art.record(art.human(), markers, art.range_of_motion(6, 50, seed=1))
    clip = replace(CLIP, labels=recording.labels, points=recording.points,
                   subjects=("",) * len(markers))  # fmt: skip
    assert with_subjects(clip) is clip


def test_an_association_file_with_the_prefix_in_it_goes_on_to_match():
    clip = called(CLIP, "Lab_{}")
    rules = tuple(replace(rule, label=f"Lab_{rule.label}") for rule in RULES.rules)
    assert with_subjects(clip, replace(RULES, rules=rules)) is clip


def test_what_has_no_prefix_stays_without_a_subject():
    track = np.cumsum(np.full((len(CLIP.points), 3), 0.001), axis=0)
    clip = with_subjects(more(called(CLIP, "Ann_{}"), {"stick": track}))
    assert clip.subject_names == ("Ann", "") and clip.labels[-1] == "stick"
    assert clip.as_read[0][0] == f"Ann_{CLIP.labels[0]}"


def test_copies_of_a_label_stay_with_its_subject():
    first = CLIP.labels.index("LKNE")
    track = CLIP.points[:, first] + 0.5
    clip = more(called(renamed(CLIP, {}), "{}_Ann"), {"LKNE_Ann_2": track})
    found = with_subjects(replace(clip, doubles=((first, 41),)))
    assert (found.labels[-1], found.subjects[-1]) == ("LKNE_2", "Ann")

"""What the page of an association starts from: the guess or a file, and what is in doubt."""

from dataclasses import replace

import numpy as np
import pytest
from labelled import CLIP, more, on, renamed, unseen
from recordings import SAMPLES

from mocap_skel import read_association, read_clip
from mocap_skel.errors import CallError
from mocap_skel.results.assoc_start import rigid_group_of, start_from_file, start_from_guess

CMU = {rule.label: rule for rule in read_association("cmu").rules}


def of(clip, start):
    return dict(zip(clip.labels, start.placed, strict=True))


def test_a_clean_clip_starts_as_its_shipped_file_has_it_and_nothing_is_in_doubt():
    for start in (start_from_guess(CLIP), start_from_file(CLIP, read_association("cmu"))):
        placed = {label: (p.marker, p.segment) for label, p in of(CLIP, start).items()}
        assert placed == {label: (rule.marker, rule.segment) for label, rule in CMU.items()}
        assert start.doubts == () and start.absent == () and start.figure == "human"


def test_exchanged_labels_are_the_first_doubt_and_it_is_about_both():
    clip = renamed(CLIP, {"LKNE": "RFIN", "RFIN": "LKNE"})
    start = start_from_file(clip, read_association("cmu"))
    assert {clip.labels[c] for c in start.doubts[0].columns} == {"LKNE", "RFIN"}
    assert "look exchanged" in start.doubts[0].words
    guessed = start_from_guess(clip)
    about = {clip.labels[c] for doubt in guessed.doubts[:2] for c in doubt.columns}
    assert about == {"LKNE", "RFIN"}


def test_each_label_that_the_guess_does_not_use_is_a_doubt_with_its_reason_and_an_offer():
    clip = renamed(CLIP, {"LFWT": "LKAX"})
    start = start_from_guess(clip)
    unsure = of(clip, start)["LKAX"]
    assert (unsure.marker, unsure.segment) == ("", "") and unsure.offered[1] == "UpperLeftLeg"
    (doubt,) = (d for d in start.doubts if d.columns == (clip.labels.index("LKAX"),))
    assert "LKAX may be" in doubt.words and unsure.reason in doubt.words


def test_where_the_guess_knows_nothing_no_marker_is_placed():
    clip = replace(CLIP, labels=tuple(str(i) for i in range(len(CLIP.labels))))
    start = start_from_guess(clip)
    assert {(p.marker, p.segment, p.ignored) for p in start.placed} == {("", "", False)}
    assert start.said.startswith("no label says which marker it is")
    with pytest.raises(CallError, match="no subject 'Ben'"):
        start_from_guess(clip, subject="Ben")


def test_a_part_of_the_figure_places_the_markers_that_it_has():
    start = start_from_guess(CLIP, "right_leg")
    placed = {p.segment for p in start.placed if p.segment}
    assert placed == {"UpperRightLeg", "LowerRightLeg", "RightFoot"}
    assert start.figure == "right_leg"


def test_a_file_keeps_what_this_clip_does_not_show(tmp_path):
    path = tmp_path / "lab.txt"
    path.write_text("@skeleton right_leg\nRTHI RTHI\nRKNE RKNE\nGONE RANK\nignore *HD\n")
    start = start_from_file(CLIP, read_association(path))
    assert [rule.label for rule in start.absent] == ["GONE"]
    assert (start.patterns, start.figure) == (("*HD",), "right_leg")
    placed = of(CLIP, start)
    assert placed["LFHD"].ignored and not placed["C7"].ignored


def test_groups_are_the_markers_of_one_rigid_part():
    rng = np.random.default_rng(4)
    clip = more(CLIP, {"extra": on("Head", [0.05, 0.1, 0.0], rng)})
    clip = unseen(clip, ["LFIN"])
    groups = rigid_group_of(clip, range(len(clip.labels)))
    head = {groups[clip.labels.index(x)] for x in ("LFHD", "RFHD", "LBHD", "RBHD", "extra")}
    assert len(head) == 1
    assert groups[clip.labels.index("LKNE")] not in head
    assert clip.labels.index("LFIN") not in groups


def test_subjects_have_groups_and_doubts_of_their_own():
    clip = read_clip(SAMPLES / "two_dancers.c3d")
    groups = rigid_group_of(clip, range(len(clip.labels)))
    anna, ben = (
        {g for c, g in groups.items() if clip.subjects[c] == name} for name in ("Anna", "Ben")
    )
    assert anna and ben and not anna & ben
    start = start_from_guess(clip, subject="Ben")
    assert {clip.subjects[c] for c in start.columns} == {"Ben"}
    assert not any(start.placed[c].segment for c in range(82) if clip.subjects[c] == "Anna")

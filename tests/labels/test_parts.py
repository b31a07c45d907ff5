"""A sure part is worth having: few doubts, parts of the body, trajectories without a name, doubles, shipped files."""

from dataclasses import replace

import numpy as np
import pytest
from labelled import CLIP, CMU, more, on, renamed, unseen

from mocap_skel import artificial as art
from mocap_skel import read_association
from mocap_skel.errors import CallError
from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.labels.doubles import with_right_doubles
from mocap_skel.labels.guess import check_sure, doubts, guess_association, in_words
from mocap_skel.labels.guess.missing import what_is_missing
from mocap_skel.labels.shipped import Match
from mocap_skel.pipeline.naming import knows_more, name_markers

RNG = np.random.default_rng(4)


def only(clip, *segments):
    """The clip with the markers of some segments only."""
    keep = [i for i, label in enumerate(clip.labels) if CMU[label][0] in segments]
    return replace(clip, points=clip.points[:, keep], labels=tuple(clip.labels[i] for i in keep),
                   subjects=("",) * len(keep))  # fmt: skip


def leg(side):
    names = {"LEFT": "L", "RIGHT": "R"}
    long = side.capitalize()
    return {f"{names[side]}GTR": on(f"Upper{long}Leg", (0.06, 0.02, -0.05), RNG)}


LEGS = ("UpperRightLeg", "LowerRightLeg", "RightFoot", "UpperLeftLeg", "LowerLeftLeg", "LeftFoot")
ARM = ("UpperRightArm", "LowerRightArm", "RightHand")
UPPER = ("Chest", "Head", *ARM, "UpperLeftArm", "LowerLeftArm", "LeftHand")


@pytest.mark.parametrize(
    ("clip", "parts"),
    [
        (more(only(CLIP, *LEGS[:3]), leg("RIGHT")), ["right_leg"]),
        (more(only(CLIP, *LEGS), leg("RIGHT") | leg("LEFT")), ["left_leg", "right_leg"]),
        (only(CLIP, *UPPER), ["upper_body"]),
        (more(only(CLIP, *UPPER, *LEGS), leg("LEFT")), ["upper_body", "left_leg"]),
        (only(CLIP, "Head"), ["head"]),
        (CLIP, ["human"]),
    ],
    ids=["leg", "legs", "upper", "upper and leg", "head", "whole"],
)
def test_the_parts_that_are_whole_are_taken(clip, parts):
    found = name_markers(clip, None)
    assert [a.skeleton.name for a in found.associations] == parts
    if parts != ["human"]:
        assert f"of the figure {' and '.join(parts)}" in found.notes[-1]
    # Several parts are several subjects, each with its own markers.
    assert set(parts) >= set(found.clip.subject_names) - {""} and (
        len(parts) == 1 or set(found.clip.subject_names) >= set(parts)
    )


def test_a_figure_that_is_asked_for_is_guessed_for_it():
    clip = more(CLIP, {"RUPB": on("UpperRightArm", (0.05, 0.05, -0.1), RNG)})
    arm = read_skeleton("right_arm")
    found = name_markers(clip, None, figure=arm).association
    assert found.skeleton == arm
    assert {rule.segment for rule in found.rules} == set(ARM)
    assert {r.label: r.marker for r in found.rules}["RUPB"] == "RUPB"
    with pytest.raises(CallError, match="Pelvis needs three markers, and none"):
        name_markers(CLIP, None, figure=read_skeleton("quadruped"))


def test_a_limb_whose_first_segment_lacks_a_marker_says_which():
    lower = [x for x in CMU if CMU[x][0] in ("UpperLeftLeg", "LowerLeftLeg", "LeftFoot")]
    legs = CLIP.points[:, [CLIP.labels.index(label) for label in lower]]
    clip = replace(CLIP, labels=tuple(lower), points=legs, subjects=("",) * len(lower))
    with pytest.raises(
        CallError,
        match=r"left_leg starts at UpperLeftLeg, where only LTHI, LKNE could be placed .one more of it would do, such as LGTR",
    ):
        name_markers(clip, None)


def test_a_few_doubts_leave_the_others_unless_strict():
    clip = renamed(CLIP, {"LFHD": "RANK", "RANK": "LFHD"})
    guess = guess_association(clip)
    check_sure(guess, strict=False)
    assert "RANK (" in doubts(guess) and "LFHD (" in doubts(guess)
    left = {rule.label for rule in name_markers(clip, None).association.rules}
    assert left == set(CMU) - {"LFHD", "RANK"}
    with pytest.raises(CallError, match="names and motion contradict each other: "):
        name_markers(clip, None, strict=True)


@pytest.mark.parametrize("name", ["M{:03d}", "{}", "ball {}", "U{}"])
def test_running_numbers_beside_a_set_are_set_aside(name):
    """However many they are; beside no set they are labels like others."""
    tracks = {
        name.format(n): track
        for n, track in enumerate(RNG.normal(size=(60, len(CLIP.points), 3)), 1)
    }
    guess = guess_association(more(CLIP, tracks))
    check_sure(guess)
    assert {line.label for line in guess.used} == set(CMU)
    assert "60 unlabelled trajectories are set aside" in in_words(guess)
    alone = guess_association(more(only(CLIP, "Hips", "RightFoot"), tracks))
    with pytest.raises(CallError, match="could be placed"):
        check_sure(alone)


# labels that stand twice


@pytest.mark.parametrize("label", ["LKNE", "RFHD", "STRN"])
@pytest.mark.parametrize("association", [None, "cmu"])
def test_of_two_trajectories_the_one_that_moves_with_the_segment_is_the_marker(label, association):
    first = CLIP.labels.index(label)
    real = CLIP.points[:, first].copy()
    points = CLIP.points.copy()
    points[:, first] = CLIP.points[:, CLIP.labels.index("RFIN")] + 0.03
    clip = replace(more(replace(CLIP, points=points), {f"{label}_2": real}), doubles=((first, 41),))
    found = name_markers(clip, association and read_association(association))
    assert (found.clip.labels[41], found.clip.labels[first]) == (label, f"{label}_2")
    assert any(f"{label} stands 2 times" in n and f"set aside: {label}_2" in n for n in found.notes)
    assert f"{label}_2" not in {rule.label for rule in found.association.rules}


def test_copies_that_move_alike_and_copies_with_a_line_of_their_own_stay():
    first = CLIP.labels.index("LKNE")
    clip = more(CLIP, {"LKNE_2": CLIP.points[:, first] + 0.001})
    clip = replace(clip, doubles=((first, 41),))
    segments = {label: CMU[label][0] for label in CMU}
    assert with_right_doubles(clip, segments) is clip
    far = replace(
        clip,
        points=np.where(
            np.arange(42)[:, None] == 41, RNG.normal(size=clip.points.shape), clip.points
        ),
    )
    assert with_right_doubles(far, segments | {"LKNE_2": "UpperLeftLeg"}) is far
    assert with_right_doubles(far, segments) is not far


# shipped files, and what is missing


def test_a_shipped_file_that_has_more_labels_is_used_and_said():
    """Channels say nothing: the movement has to confirm the file, and contradict nothing."""
    channels = {rule.marker: rule.label for rule in read_association("phoenix_channels").rules}
    clip = renamed(CLIP, channels)
    keep = [i for i, label in enumerate(clip.labels) if label in channels.values()]
    rules = tuple(r for r in read_association("phoenix_channels").rules if r.label in clip.labels)
    file = Match(
        "channels", replace(read_association("phoenix_channels"), rules=rules), len(keep), 1.0, 4
    )
    clip = replace(clip, points=clip.points[:, keep], labels=tuple(clip.labels[i] for i in keep),
                   subjects=("",) * len(keep))  # fmt: skip
    assert knows_more(file, 0, len(keep), clip, None)
    shuffled = replace(clip, points=clip.points[:, RNG.permutation(len(keep))])
    assert not knows_more(file, 0, len(keep), shuffled, None)
    still = replace(
        clip,
        points=np.repeat(clip.points[:1], 100, axis=0) + RNG.normal(0, 1e-3, (100, len(keep), 3)),
    )
    assert not knows_more(file, 0, len(keep), still, None)
    assert not knows_more(replace(file, share=0.7), len(keep) - 1, len(keep), clip, None)


@pytest.mark.parametrize("wrong", ["right_leg", "hand", "phoenix_channels", "plug_in_gait"])
def test_a_wrong_file_names_the_shipped_one_that_is_meant(wrong):
    with pytest.raises(CallError, match=r"in the clip|no label of the clip") as error:
        name_markers(CLIP, read_association(wrong))
    assert "--assoc cmu has 41 labels of it" in error.value.hint


def test_a_part_of_a_set_and_a_part_of_a_body_are_no_wrong_files():
    lines = tuple(r for r in read_association("cmu").rules if r.segment in ("Hips", *LEGS))
    mine = replace(read_association("cmu"), path="mine.txt", rules=lines)
    assert name_markers(CLIP, mine).association is mine
    lower = only(CLIP, "Hips", *LEGS)
    assert name_markers(lower, read_association("cmu")).clip.labels == lower.labels


def test_a_face_and_a_single_frame_say_what_is_missing():
    markers = {f"f{n}x": ("Head", tuple(RNG.uniform(-0.08, 0.08, 3))) for n in range(30)}
    recording = art.record(
        art.human(), markers, art.range_of_motion(4, 50), art.Faults(sigma=0.002)
    )
    face = replace(CLIP, points=recording.points, labels=recording.labels, subjects=("",) * 30)
    with pytest.raises(CallError, match=r"30 points keep their distances .* as on a face"):
        name_markers(face, None)
    with pytest.raises(CallError, match="it has a single frame"):
        name_markers(replace(face, points=face.points[:1]), None)
    assert what_is_missing(CLIP) == "" == what_is_missing(unseen(CLIP, ["LFHD"]))
    named = replace(face, labels=tuple(f"HEAD{n}" for n in range(1, 31)))
    with pytest.raises(
        CallError, match=r"30 of its 30 points are on the head, .* no joint"
    ) as error:
        name_markers(named, None)
    assert error.value.hint.startswith("--skeleton head")
    band = ["LFHD", "RFHD", "LBHD", "RBHD"]
    few = replace(only(CLIP, "Head"), notes=())
    assert sorted(few.labels) == sorted(band)
    assert "and no joint: markers of a second segment" in name_markers(few, None).notes[-1]


def test_parts_that_several_subjects_leave_out_are_named():
    legs = more(only(CLIP, *LEGS), leg("LEFT") | leg("RIGHT"))
    count = len(legs.labels)
    two = replace(
        legs,
        points=np.concatenate([legs.points, legs.points + 3.0], axis=1),
        labels=legs.labels * 2,
        subjects=("Ann",) * count + ("Ben",) * count,
    )
    both = name_markers(two, None)
    parts = {one.skeleton.name for one in name_markers(two, None, subject="Ann").associations}
    (taken,) = [one.skeleton.name for one in both.associations]
    (other,) = parts - {taken}
    assert both.notes[-1].endswith(f"only {taken} is taken: --subject takes {other} too")

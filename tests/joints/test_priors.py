"""Where anatomy puts a joint: the way inward from a marker, sizes, priors by their landmarks, and the tables.

Exact geometry is held to 1e-9 m: some tens of operations on numbers of order 1, and the eigenvectors of
well separated values. Seeds are named where numbers are drawn.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mocap_skel.artificial import (
    Faults,
    Motion,
    circumduct,
    figure_of,
    human,
    marker_set,
    markers_of,
    ranges_of,
    record,
    walk,
)
from mocap_skel.artificial.rotations import from_vector
from mocap_skel.errors import SkeletonError
from mocap_skel.figure.prior_tables import Prior, Shift
from mocap_skel.figure.skeleton import SHIPPED, read_skeleton
from mocap_skel.joints.priors import (
    LEAST_BEND,
    SIZES,
    Surroundings,
    expected_joint,
    hinge_shift,
    inward,
    subject_size,
)
from mocap_skel.spherefit import sphere_moments

EXACT = 1e-9
KNEE = Shift(hinge=1, by=0.054, toward=("ANK",), beside=0.043)
PRIORS = [name for name in sorted(p.stem for p in SHIPPED.glob("*.toml")) if name != "quadruped"]

vectors = st.tuples(*[st.floats(-3, 3)] * 3).map(np.array)


def limb(bend, shift=KNEE, upper=0.43, lower=0.42, beside=None):
    """A right leg that hangs, x to the front, y to the left: marker outside the knee, a place far down.

    Returns the way from the hip to the marker, from there to the place (..., 3), and the true way inward.
    """
    inwards = np.array([0.0, 1.0, 0.0])
    bend = np.asarray(bend, dtype=float)
    shank = np.stack([-np.sin(bend), np.zeros_like(bend), -np.cos(bend)], axis=-1)
    marker = np.array([0.0, 0.0, -upper]) - shift.by * inwards
    place = (
        np.array([0.0, 0.0, -upper])
        + lower * shank
        - (shift.beside if beside is None else beside) * inwards
    )
    return marker, place - marker, inwards


def law(above, below, shift, inwards):
    """What `inward` is to give: the part of the way in the bones' plane, and the rest less where they are straight."""
    normal = np.cross(above, below)
    sine = np.linalg.norm(normal) / (np.linalg.norm(above) * np.linalg.norm(below))
    axis = shift.hinge * normal / np.linalg.norm(normal)
    left = inwards @ axis
    found = inwards - left * axis + left * axis * sine**2 / (sine**2 + LEAST_BEND**2)
    return found / np.linalg.norm(found)


# --- inward


@pytest.mark.parametrize("degrees", [1, 5, 20, 45, 90, 120, 150])
def test_the_way_inward_of_a_perfect_hinge_is_exact(degrees):
    above, below, inwards = limb(np.deg2rad(degrees))
    found = inward(above, below, KNEE, 1.0)
    assert np.abs(found - law(above, below, KNEE, inwards)).max() < EXACT
    # What the doubt of a nearly straight limb costs stays within the prior's own sd, 15 mm.
    assert np.linalg.norm(found - inwards) * KNEE.by < (0.001 if degrees >= 45 else 0.015)


def test_a_straight_limb_still_tells_the_way_by_the_depth_alone():
    """The bones are a line, the marker is beside it; which side it bends to is not needed."""
    above, below, inwards = limb(0.0)
    for hinge in (1, -1):
        found = inward(above, below, replace(KNEE, hinge=hinge), 1.0)
        # The root of rounding: what is left of a length of one.
        assert np.abs(found - inwards).max() < 1e-7


def test_the_other_sense_is_the_other_side():
    above, below, inwards = limb(np.deg2rad(80), replace(KNEE, by=1e-9, beside=1e-9))
    for hinge in (1, -1):
        found = inward(above, below, replace(KNEE, hinge=hinge, by=1e-9, beside=1e-9), 1.0)
        assert np.abs(found - hinge * inwards).max() < 1e-7


@pytest.mark.parametrize("degrees", [0, 10, 60, 130])
def test_the_mirrored_limb_has_the_mirrored_way(degrees):
    mirror = np.array([1.0, -1.0, 1.0])
    above, below, _ = limb(np.deg2rad(degrees))
    left = inward(above * mirror, below * mirror, replace(KNEE, hinge=-1), 1.0)
    assert np.abs(left - mirror * inward(above, below, KNEE, 1.0)).max() < EXACT


@settings(max_examples=50, deadline=None)
@given(vectors, st.floats(0.02, 2.5), st.floats(0.5, 2.0))
def test_a_turned_and_larger_limb_has_the_turned_way(turn, bend, size):
    rotation = from_vector(turn)
    above, below, _ = limb(bend)
    swing = np.diag([0.01, 0.001, 0.02])
    found = inward(above, below, KNEE, 1.0, swing)
    other = inward(
        size * rotation @ above,
        size * rotation @ below,
        KNEE,
        size,
        size**2 * rotation @ swing @ rotation.T,
    )
    assert np.abs(other - rotation @ found).max() < 1e-7
    assert abs(np.linalg.norm(found) - 1) < EXACT


def test_a_bend_that_moves_is_known_by_the_mean_and_its_spread():
    """The lower end of a hinge keeps to a plane: its spread is square to the way inward, and says so."""
    bends = np.linspace(0.0, 1.8, 200)
    above, below, inwards = limb(bends)
    moments = sphere_moments(below)
    found = inward(above, moments.mean, KNEE, 1.0, moments.covariance)
    assert np.linalg.norm(found - inwards) * KNEE.by < 0.001


def test_frames_are_independent_of_each_other():
    above, below, _ = limb(np.deg2rad([10.0, 50.0, 100.0]))
    together = inward(np.broadcast_to(above, below.shape), below, KNEE, 1.0)
    each = [inward(above, one, KNEE, 1.0) for one in below]
    assert np.abs(together - each).max() < EXACT


def test_nan_in_nan_out_and_nowhere_else():
    above, below, _ = limb(np.deg2rad([10.0, 50.0, 100.0]))
    above = np.tile(above, (3, 1))
    above[0, 1] = np.nan
    below[2] = np.nan
    found = inward(above, below, KNEE, 1.0)
    assert np.isnan(found[[0, 2]]).all()
    assert np.isfinite(found[1]).all()


def test_markers_and_joints_in_one_place_have_no_way():
    assert np.isnan(inward(np.zeros(3), np.zeros(3), KNEE, 1.0)).all()


def test_an_end_that_lies_aside_itself():
    """The greater trochanter, in place of the hip joint, lies farther out than the marker of the knee."""
    above, below, inwards = limb(0.6)
    outside = np.array([0.0, -0.08, 0.0])
    found = inward(above - outside, below, KNEE, 1.0, 0.0, 0.08)
    assert np.linalg.norm(found - inwards) * KNEE.by < 0.001


# --- a subject's size


def skeleton_with(*sizes):
    return replace(read_skeleton("human"), sizes=sizes)


def test_size_is_the_median_over_what_can_be_measured():
    skeleton = skeleton_with(("A", "B", 0.4), ("C", "D", 0.4), ("E", "F", 0.2), ("G", "H", 1.0))
    lengths = {"A": 0.44, "C": 0.48, "E": 2.0}
    assert subject_size(skeleton, lambda a, b: lengths.get(a)) == pytest.approx(1.2)


def test_size_is_one_where_nothing_is_known():
    assert subject_size(skeleton_with(), lambda a, b: 5.0) == 1.0
    assert subject_size(skeleton_with(("A", "B", 0.4)), lambda a, b: None) == 1.0


def test_a_wrong_unit_does_not_make_giants():
    skeleton = skeleton_with(("A", "B", 0.4))
    assert subject_size(skeleton, lambda a, b: 400.0) == SIZES[1]
    assert subject_size(skeleton, lambda a, b: 0.0004) == SIZES[0]


@pytest.mark.parametrize("stature", [1.4, 1.75, 2.05])
def test_size_follows_stature(stature):
    """Within 6 %: people, and the two sides of one, do not have all their bones in the table's proportion."""
    markers = marker_set("cmu", stature)
    renamed = {**markers, "RSHN": markers["RSHN"]}
    clip = record(human(stature), renamed, walk(2, 50, 1, stature), Faults(), seed=1)

    def distance(a, b):
        at = [clip.points[:, clip.labels.index(name)] for name in (a, b)]
        return float(np.median(np.linalg.norm(at[0] - at[1], axis=1)))

    found = subject_size(read_skeleton("human"), distance)
    assert found == pytest.approx(stature / 1.75, rel=0.06)


# --- priors by their landmarks

PLACES = {
    "A": np.array([0.0, 0.0, 0.0]),
    "B": np.array([0.2, 0.0, 0.0]),
    "C": np.array([0.0, 0.1, 0.0]),
    "D": np.array([0.0, 0.0, 0.3]),
}


def around(places=PLACES, upper=None, lower=None, size=1.0):
    return Surroundings(places, upper, lambda markers: lower, size)


def prior(*mean, sd=0.01, source="s", **shift):
    return Prior(mean, sd, source, (Shift(**shift),) if shift else ())


def mean_of(one, landmarks=(), **more):
    return expected_joint([one], dict(landmarks), around(**more)).mean


def test_the_mean_of_landmarks_with_its_sd_and_source():
    found = expected_joint([prior("A", "B", sd=0.02, source="Wu")], {}, around(size=1.5))
    assert np.abs(found.mean - [0.1, 0, 0]).max() < EXACT
    assert np.abs(found.covariance - 0.03**2 * np.eye(3)).max() < EXACT
    assert (found.landmarks, found.source) == (("A", "B"), "Wu")


def test_a_share_of_a_line_along_it():
    assert np.abs(mean_of(prior("A", line=("A", "B"), ratio=0.5)) - [0.1, 0, 0]).max() < EXACT


def test_a_share_of_another_line_and_metres_beside_it():
    found = mean_of(prior("A", line=("A", "B"), of=("A", "D"), ratio=0.5, by=0.01), size=2.0)
    # half of 0.3 m, which is the subject's own, and 1 cm times the size
    assert np.abs(found - [0.17, 0, 0]).max() < EXACT


def test_a_shift_square_to_two_lines_is_right_handed():
    found = mean_of(prior("A", across=("A", "B", "A", "C"), by=0.1))
    assert np.abs(found - [0, 0, 0.1]).max() < EXACT
    other = mean_of(prior("A", across=("A", "C", "A", "B"), ratio=0.5))
    assert np.abs(other - [0, 0, -0.05]).max() < EXACT


def test_shifts_start_from_the_mean_and_add_up():
    two = Prior(
        ("A", "B"), 0.01, "", (Shift(line=("A", "C"), by=0.1), Shift(line=("A", "D"), by=0.2))
    )
    assert np.abs(mean_of(two) - [0.1, 0.1, 0.2]).max() < EXACT


def test_the_first_prior_counts_whose_landmarks_are_there():
    priors = [prior("A", "Z", source="1"), prior("B", source="2"), prior("A", source="3")]
    assert expected_joint(priors, {}, around()).source == "2"


@pytest.mark.parametrize(
    "shift",
    [
        {"line": ("A", "Z"), "by": 0.1},
        {"line": ("A", "A"), "by": 0.1},
        {"line": ("A", "B"), "of": ("A", "Z"), "ratio": 0.1},
        {"across": ("A", "B", "A", "B"), "by": 0.1},
        {"hinge": 1, "by": 0.05, "toward": ("Z",)},
    ],
)
def test_a_shift_without_a_direction_leads_to_the_next_prior(shift):
    priors = [prior("A", source="1", **shift), prior("B", source="2")]
    assert expected_joint(priors, {}, around()).source == "2"


def test_no_prior_no_expectation():
    assert expected_joint([], {}, around()) is None
    assert expected_joint([prior("Z")], {}, around()) is None


def test_a_landmark_is_the_first_of_its_sets_that_is_whole():
    landmarks = {"Inside": [["Z"], ["A", "Z"], ["C", "D"], ["B"]]}
    found = expected_joint([prior("A", "Inside")], landmarks, around())
    assert np.abs(found.mean - [0, 0.025, 0.075]).max() < EXACT
    assert found.landmarks == ("A", "C", "D")


def knee(bend=0.6, **more):
    """A prior of a hinge in a thigh's own coordinates: hip at the origin, markers KNE and GTR."""
    above, below, inwards = limb(np.full(10, bend))
    lower = sphere_moments(above + below)
    places = {"KNE": above, "GTR": np.array([0.0, -0.08, 0.0])}
    return Surroundings(places, more.get("upper"), lambda m: lower, 1.0), above + 0.054 * inwards


HINGE = {"hinge": 1, "by": 0.054, "toward": ("ANK",), "beside": 0.043}


def test_a_hinge_by_the_joint_above():
    there, truth = knee(upper=np.zeros(3))
    found = expected_joint([prior("KNE", **HINGE)], {}, there)
    assert np.linalg.norm(found.mean - truth) < 0.001
    assert found.landmarks == ("KNE",)


def test_a_root_has_no_joint_above_and_a_landmark_stands_for_it():
    there, truth = knee()
    assert expected_joint([prior("KNE", **HINGE)], {}, there) is None
    found = expected_joint([prior("KNE", **HINGE, upper=("GTR",), aside=0.08)], {}, there)
    assert np.linalg.norm(found.mean - truth) < 0.001
    assert found.landmarks == ("KNE", "GTR")
    assert expected_joint([prior("KNE", **HINGE, upper=("GTR", "Z"))], {}, there) is None


def test_the_joint_above_counts_before_what_stands_for_it():
    there, truth = knee(upper=np.zeros(3))
    found = expected_joint([prior("KNE", **HINGE, upper=("GTR",), aside=0.5)], {}, there)
    assert np.linalg.norm(found.mean - truth) < 0.001


def test_a_limb_in_line_with_its_marker_has_no_way_inward():
    """Hip, marker and ankle on a line: any way round it would do, and along it none is right."""
    places = {"KNE": np.array([0.0, 0.0, -0.4])}
    lower = sphere_moments(np.tile([0.0, 0.0, -0.8], (10, 1)))
    there = Surroundings(places, np.zeros(3), lambda m: lower, 1.0)
    priors = [prior("KNE", **HINGE), prior("KNE", source="next")]
    assert expected_joint(priors, {}, there).source == "next"


def test_the_hinge_of_a_joint_is_found_behind_other_priors():
    priors = [prior("A", "B"), prior("A", line=("A", "B")), prior("KNE", **HINGE)]
    assert hinge_shift(priors) == ("KNE", Shift(**HINGE))
    assert hinge_shift(priors[:2]) is None


# --- the shipped files


@pytest.mark.parametrize("name", PRIORS)
def test_every_landmark_is_a_marker_of_the_parent_or_another_name_of_one(name):
    """Medial markers have as many names as there are labs: those are listed in [landmarks]."""
    skeleton = read_skeleton(name)
    known = set(skeleton.segment_of)
    whole = known | set(read_skeleton("human").segment_of)
    for segment in skeleton.segments:
        for one in segment.priors:
            used = [*one.mean, *(n for s in one.shifts for n in (*s.line, *s.across, *s.of))]
            for landmark in used:
                assert landmark in skeleton.landmarks or landmark in whole, landmark
            for shift in one.shifts:
                assert set(shift.toward) <= whole
                on = read_skeleton("human").segment_of
                assert all(on[m] == segment.name for m in shift.toward if m in on)
    for first, second, _ in skeleton.sizes:
        assert {first, second} <= whole
    shipped = {m for p in SHIPPED.glob("*.toml") for m in read_skeleton(p).segment_of}
    for sets in skeleton.landmarks.values():
        # At least one of its names is a marker of some shipped figure, or it would never be there.
        assert any(set(one) <= shipped for one in sets)


@pytest.mark.parametrize("name", PRIORS)
@pytest.mark.parametrize("stature", [1.4, 1.75, 2.05])
def test_each_prior_is_right_within_three_sd_on_a_body_that_walks(name, stature):
    skeleton = read_skeleton(name)
    k = stature / 1.75
    figure, markers = figure_of(skeleton), markers_of(skeleton, figure_of(skeleton))
    recording = filmed(name, figure, markers)
    seen = 0
    for segment in skeleton.segments:
        if segment.joint is None:
            continue
        truth = k * np.array(recording.constants[segment.joint])
        there = surroundings(skeleton, segment, recording, markers, k)
        for one in segment.priors:
            found = expected_joint([one], skeleton.landmarks, there)
            if found is None:
                continue
            seen += 1
            # In each direction, as the sd is.
            assert np.abs(found.mean - truth).max() < 3 * k * one.sd, (segment.joint, one)
    assert seen >= sum(bool(s.priors) for s in skeleton.segments)


def filmed(name, figure, markers):
    motion = (
        circumduct(ranges_of(read_skeleton(name)), 4, 50, 1) if name == "hand" else walk(4, 50, 1)
    )
    root = figure.segments[0].name
    turns = {s: r for s, r in motion.rotations.items() if s != root}
    return record(figure, markers, Motion(motion.rate, motion.shift, turns), Faults(), seed=1)


def surroundings(skeleton, segment, recording, markers, k):
    """The true frame of a segment's parent, of a body k times the standard size."""
    pose = recording.poses[segment.parent]

    def lower(names):
        if not set(names) <= set(segment.markers):
            return None
        at = np.mean([recording.points[:, recording.labels.index(n)] for n in names], axis=0)
        return sphere_moments(k * np.einsum("fji,fj->fi", pose.rotation, at - pose.origin))

    places = {m: k * np.array(markers[m][1]) for m in skeleton[segment.parent].markers}
    upper = np.zeros(3) if skeleton[segment.parent].parent else None
    return Surroundings(places, upper, lower, k)


def test_left_and_right_of_the_human_are_mirror_images():
    """Of the file's own text: L for R, Left for Right, hinges and lines the other way round."""
    skeleton = read_skeleton("human")

    def other(text):
        return (
            text.replace("Right", "?").replace("Left", "Right").replace("?", "Left")
            if "Left" in text or "Right" in text
            else {"R": "L", "L": "R"}.get(text[0], text[0]) + text[1:]
        )

    paired = [s for s in skeleton.segments if "Left" in s.name]
    assert len(paired) == 6
    for segment in paired:
        twin = skeleton[other(segment.name)]
        assert segment.looseness == twin.looseness
        assert segment.movement.replace("left", "right") == twin.movement
        assert len(segment.priors) == len(twin.priors)
        for one, two in zip(segment.priors, twin.priors, strict=True):
            assert tuple(map(other, one.mean)) == two.mean or set(map(other, one.mean)) == set(
                two.mean
            )
            assert (one.sd, one.source, len(one.shifts)) == (two.sd, two.source, len(two.shifts))
            for a, b in zip(one.shifts, two.shifts, strict=True):
                assert a.hinge == -b.hinge
                assert (a.ratio, a.by, a.beside, a.aside) == (b.ratio, b.by, b.beside, b.aside)
                assert tuple(map(other, a.toward)) == b.toward
                assert tuple(map(other, a.upper)) == b.upper


def test_hips_lie_below_the_pelvis_markers_and_knees_inward():
    skeleton, k = read_skeleton("human"), 1.0
    figure = figure_of(skeleton)
    markers = markers_of(skeleton, figure)
    recording = filmed("human", figure, markers)

    def at(joint):
        segment = next(s for s in skeleton.segments if s.joint == joint)
        there = surroundings(skeleton, segment, recording, markers, k)
        return expected_joint(segment.priors, skeleton.landmarks, there).mean

    front = np.array(markers["RFWT"][1])
    for side, sign in (("Right", -1), ("Left", 1)):
        hip = at(f"{side}Hip")
        assert hip[2] < front[2] - 0.05
        assert front[0] - 0.15 < hip[0] < front[0]
        assert 0.05 < sign * hip[1] < abs(front[1])
        marker = np.array(markers[f"{side[0]}KNE"][1])
        assert sign * (marker - at(f"{side}Knee"))[1] > 0.04
        marker = np.array(markers[f"{side[0]}ANK"][1])
        assert sign * (marker - at(f"{side}Ankle"))[1] > 0.03
        marker = np.array(markers[f"{side[0]}ELB"][1])
        assert sign * (marker - at(f"{side}Elbow"))[1] > 0.03
        assert at(f"{side}Shoulder")[2] < markers[f"{side[0]}SHO"][1][2] - 0.03
    assert at("Waist")[2] > at("LeftHip")[2] + 0.05


# --- like: what a figure takes from another


def written(folder, text, name="mine"):
    path = folder / f"{name}.toml"
    path.write_text(text)
    return path


MINE = """
name = "mine"
like = "human"
[landmarks]
RightKneeInside = [["X"]]
[[segment]]
name = "Thigh"
markers = ["RKNE", "A", "B"]
[[segment]]
name = "Shank"
parent = "Thigh"
joint = "RightKnee"
markers = ["RANK"]
looseness = 1.5
[[segment]]
name = "Foot"
parent = "Shank"
joint = "RightAnkle"
markers = ["RTOE"]
prior = []
"""


def test_a_joint_takes_what_it_does_not_say_itself(tmp_path):
    mine, human_ = read_skeleton(written(tmp_path, MINE)), read_skeleton("human")
    knee_, ankle = mine["Shank"], mine["Foot"]
    assert knee_.priors == human_["LowerRightLeg"].priors
    assert knee_.movement == human_["LowerRightLeg"].movement
    assert knee_.looseness == 1.5
    assert ankle.priors == ()
    assert ankle.looseness == human_["RightFoot"].looseness
    assert mine.sizes == human_.sizes
    assert mine.landmarks == {**human_.landmarks, "RightKneeInside": (("X",),)}
    # What it is made of stays its own.
    assert mine["Thigh"].markers == ("RKNE", "A", "B")
    assert knee_.rest is None


def test_a_joint_of_another_name_takes_nothing(tmp_path):
    mine = read_skeleton(written(tmp_path, MINE.replace('"RightAnkle"', '"Hock"')))
    assert (mine["Foot"].looseness, mine["Foot"].movement) == (1.0, "")


def test_own_sizes_stand_for_all(tmp_path):
    text = MINE.replace("[landmarks]", 'sizes = [["A", "B", 0.1]]\n[landmarks]')
    assert read_skeleton(written(tmp_path, text)).sizes == (("A", "B", 0.1),)


def test_a_file_beside_it_comes_before_a_shipped_one(tmp_path):
    written(tmp_path, MINE)
    second = MINE.replace('like = "human"', 'like = "mine.toml"').replace("looseness = 1.5", "")
    assert read_skeleton(written(tmp_path, second, "second"))["Shank"].looseness == 1.5


def test_the_shipped_files_are_like_the_human():
    human_ = {s.joint: s for s in read_skeleton("human").segments}
    for name in ("lower_body", "upper_body", "right_leg", "left_leg", "right_arm", "left_arm"):
        for segment in read_skeleton(name).segments:
            if segment.joint:
                assert segment.priors == human_[segment.joint].priors
                assert segment.movement == human_[segment.joint].movement != ""


@pytest.mark.parametrize(
    ("like", "message"),
    [
        ('"humam"', r"3:1: like: no such skeleton 'humam'"),
        ('"nothing.toml"', r"3:1: like: no such skeleton 'nothing.toml'"),
        ("3", r"3:1: like: the name of a skeleton is needed, not 3"),
        ('"mine.toml"', r"3:1: like: 'mine.toml' leads back to this file"),
    ],
)
def test_like_nothing(tmp_path, like, message):
    path = written(tmp_path, MINE.replace('like = "human"', f"like = {like}"))
    with pytest.raises(SkeletonError, match=rf"mine\.toml:{message}"):
        read_skeleton(path)


def test_a_circle_of_files_is_found_and_what_is_wrong_there_said_there(tmp_path):
    written(tmp_path, MINE.replace('"human"', '"second.toml"'))
    second = written(tmp_path, MINE.replace('"human"', '"mine.toml"'), "second")
    with pytest.raises(SkeletonError, match=r"mine\.toml:3:1: like: 'second.toml' leads back"):
        read_skeleton(second)
    written(tmp_path, MINE.replace("looseness = 1.5", "looseness = -1"))
    with pytest.raises(SkeletonError, match=r"mine\.toml:14:1: looseness"):
        read_skeleton(second)


# --- what is wrong in a table

BASE = """name = "t"
[[segment]]
name = "A"
markers = ["a", "b", "c"]
[[segment]]
name = "B"
parent = "A"
joint = "J"
markers = ["d"]
"""


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("prior = 3", "prior: a table is needed, not 3"),
        ('prior = {mean = ["a"], sd = 0.1, sauce = "x"}', "unknown key 'sauce'"),
        ('prior = {mean = ["a"]}', "sd is a length in metres above 0, not None"),
        ('prior = {mean = ["a"], sd = 0}', "sd is a length in metres above 0, not 0"),
        ('prior = {mean = ["a"], sd = true}', "sd is a length in metres above 0, not True"),
        ('prior = {mean = ["a"], sd = nan}', "sd is a length in metres above 0, not nan"),
        ('prior = {mean = ["a"], sd = inf}', "sd is a length in metres above 0, not inf"),
        ('prior = {mean = ["a"], sd = 0.1, source = 7}', "source: a text is needed, not 7"),
        ("prior = {sd = 0.1}", "a prior starts at the mean of landmarks"),
        ("prior = {mean = [], sd = 0.1}", "a prior starts at the mean of landmarks"),
        ('prior = {mean = "a", sd = 0.1}', "mean: a list of names is needed, not 'a'"),
        ('prior = {mean = ["a"], sd = 0.1, shift = 3}', "shift: a list is needed, not 3"),
        ('prior = {mean = ["a"], sd = 0.1, shift = [3]}', "shift: a list of tables is needed"),
        *(
            (f'prior = {{mean = ["a"], sd = 0.1, shift = [{{{shift}}}]}}', message)
            for shift, message in [
                ('lime = ["a", "b"]', "unknown key 'lime'"),
                ('line = ["a"]', r"line is 2 landmarks, not \['a'\]"),
                ('line = ["a", "b"], of = ["a"]', r"of is 2 landmarks, not \['a'\]"),
                ('across = ["a", "b", "c"]', "across is 4 landmarks"),
                ("by = 0.1", "a shift has one direction: line, across or hinge"),
                ('line = ["a", "b"], hinge = 1, by = 0.1', "a shift has one direction"),
                ("hinge = 2", "hinge is 1 or -1, not 2"),
                ("hinge = true", "hinge is 1 or -1, not True"),
                ("hinge = 1, by = 0.1", "a shift along a hinge needs markers of the child"),
                ('hinge = 1, toward = ["d"]', "a shift along a hinge needs its length in metres"),
                ('hinge = 1, toward = ["d"], by = -0.1', "needs its length in metres"),
                ('line = ["a", "b"], ratio = "x"', "ratio is a number, not 'x'"),
                ('line = ["a", "b"], by = nan', "by is a number, not nan"),
                ('hinge = 1, by = 0.1, toward = ["d"], upper = "a"', "upper: a list of names"),
                ('hinge = 1, by = 0.1, toward = ["d"], aside = []', r"aside is a number, not \[\]"),
            ]
        ),
        ("looseness = 0", "looseness is a number above 0, not 0"),
        ("looseness = inf", "looseness is a number above 0, not inf"),
        ("movement = 3", "movement: a text is needed, not 3"),
    ],
)
def test_a_wrong_prior_is_said_with_its_place(tmp_path, line, message):
    path = written(tmp_path, BASE + line + "\n")
    with pytest.raises(SkeletonError, match=rf"mine\.toml:10:\d+: .*{message}"):
        read_skeleton(path)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("landmarks = 3", "landmarks: a table is needed, not 3"),
        ("landmarks = {P = 3}", "P: a list of lists of markers is needed, not 3"),
        ('landmarks = {P = ["a"]}', r"P: a list of lists of markers is needed, not \['a'\]"),
        ("landmarks = {P = []}", "P: a list of lists of markers is needed"),
        ("landmarks = {P = [[]]}", "P: a list of lists of markers is needed"),
        ("landmarks = {P = [[1]]}", "P: a list of lists of markers is needed"),
        ("sizes = 3", "sizes: a list is needed, not 3"),
        ("sizes = [3]", r"\[MARKER, MARKER, METRES\] is needed, not 3"),
        ('sizes = [["a", "b"]]', r"\[MARKER, MARKER, METRES\] is needed"),
        ('sizes = [["a", 1, 0.1]]', r"\[MARKER, MARKER, METRES\] is needed"),
        ('sizes = [["a", "b", 0]]', "a size is a length in metres above 0, not 0"),
        ('sizes = [["a", "b", inf]]', "a size is a length in metres above 0, not inf"),
    ],
)
def test_wrong_landmarks_and_sizes_are_said_with_their_place(tmp_path, line, message):
    path = written(tmp_path, line + "\n" + BASE)
    with pytest.raises(SkeletonError, match=rf"mine\.toml:1:\d+: .*{message}"):
        read_skeleton(path)


def test_an_unknown_key_names_the_nearest(tmp_path):
    path = written(tmp_path, BASE + 'prior = {mean = ["a"], sd = 0.1, sorce = "x"}\n')
    with pytest.raises(SkeletonError) as caught:
        read_skeleton(path)
    assert "did you mean source?" in str(caught.value) + str(caught.value.hint)


def test_the_second_of_several_priors_is_found_too(tmp_path):
    text = BASE + '[[segment.prior]]\nmean = ["a"]\nsd = 0.1\n[[segment.prior]]\nmean = ["b"]\n'
    with pytest.raises(SkeletonError, match=r"mine\.toml:\d+:\d+: sd is a length"):
        read_skeleton(written(tmp_path, text))
    found = read_skeleton(written(tmp_path, text + "sd = 0.2\n"))["B"].priors
    assert [p.mean for p in found] == [("a",), ("b",)]

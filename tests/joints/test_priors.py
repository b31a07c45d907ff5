"""Where anatomy puts a joint: sizes, priors by their landmarks, and those of the shipped figures.

Exact geometry is held to 1e-9 m: some tens of operations on numbers of order 1. Seeds are named where
numbers are drawn.
"""

from dataclasses import replace

import numpy as np
import pytest
from limbs import limb

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
from mocap_skel.figure.prior_tables import Prior, Shift
from mocap_skel.figure.skeleton import SHIPPED, read_skeleton
from mocap_skel.joints.hinge import Turning, hinge_shift
from mocap_skel.joints.priors import SIZES, Surroundings, expected_joint, subject_size
from mocap_skel.spherefit import sphere_moments

EXACT = 1e-9
PRIORS = [name for name in sorted(p.stem for p in SHIPPED.glob("*.toml")) if name != "quadruped"]


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


def test_an_error_of_a_step_lies_along_it():
    """4 mm of the step along the line A B beside 3 mm everywhere: 5 mm along it."""
    places = {"A": np.zeros(3), "B": np.array([0.0, 0.2, 0.0])}
    step = Shift(line=("A", "B"), ratio=0.5, sd=0.004)
    found = expected_joint(
        [Prior(("A",), 0.003, "s", (step,))], {}, Surroundings(places, None, lambda _: None, 2.0)
    )
    assert found.covariance == pytest.approx(4 * np.diag([9e-6, 25e-6, 9e-6]))


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


def test_a_joint_above_that_nobody_knows_says_no_way_inward():
    """An error e of it turns the way by e / length, and moves the joint by that times its depth: up to the prior's sd."""
    there, _ = knee(upper=np.zeros(3))
    enough = 0.01 * np.linalg.norm(there.places["KNE"]) / 0.054
    priors = [prior("KNE", **HINGE), prior("KNE", source="next")]
    for error, source in ((0.99 * enough, "s"), (1.01 * enough, "next")):
        doubtful = replace(there, upper_error=error)
        assert expected_joint(priors, {}, doubtful).source == source
    by_trochanter = prior("KNE", **HINGE, upper=("GTR",), aside=0.08)
    assert expected_joint([by_trochanter], {}, doubtful).landmarks == ("KNE", "GTR")


def test_a_limb_in_line_with_its_marker_has_no_way_inward():
    """Hip, marker and ankle on a line: any way round it would do, and along it none is right."""
    places = {"KNE": np.array([0.0, 0.0, -0.4])}
    lower = sphere_moments(np.tile([0.0, 0.0, -0.8], (10, 1)))
    there = Surroundings(places, np.zeros(3), lambda m: lower, 1.0)
    priors = [prior("KNE", **HINGE), prior("KNE", source="next")]
    assert expected_joint(priors, {}, there).source == "next"


@pytest.mark.parametrize(("degrees", "way"), [(59, "next"), (61, "s")])
def test_the_way_inward_is_square_to_the_bone_above_within_30_degrees(degrees, way):
    """A straight limb whose ends force the way: cos 60° of it along the bone is the limit."""
    # Hip, marker and ankle in line: the depth alone has the way, -depth / length along the bone.
    length = 0.054 / np.cos(np.radians(degrees))
    places = {"KNE": np.array([0.0, 0.0, -length])}
    ankle = np.array([0.3, 0.0, -length])
    lower = sphere_moments(np.tile(ankle, (10, 1)))
    there = Surroundings(places, np.zeros(3), lambda m: lower, 1.0)
    found = expected_joint([prior("KNE", **HINGE), prior("KNE", source="next")], {}, there)
    assert found.source == way


def test_the_step_inward_is_as_long_as_the_subject_is_large():
    there, _ = knee(upper=np.zeros(3))
    for size in (1.0, 1.3):
        places = {name: size * place for name, place in there.places.items()}
        lower = sphere_moments(size * np.tile(there.lower(()).mean, (10, 1)))
        grown = Surroundings(places, np.zeros(3), lambda m, lower=lower: lower, size)
        step = expected_joint([prior("KNE", **HINGE)], {}, grown).mean - places["KNE"]
        assert np.linalg.norm(step) == pytest.approx(size * 0.054)


def test_the_hinge_of_a_joint_is_found_behind_other_priors():
    """Behind one between two markers too, which has a depth of its own."""
    priors = [prior("A", "B"), prior("A", "B", **HINGE), prior("A", line=("A", "B"))]
    assert hinge_shift([*priors, prior("KNE", **HINGE)]) == ("KNE", Shift(**HINGE))
    assert hinge_shift(priors) is None


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


# --- joints without a landmark


def test_a_joint_on_the_line_from_the_markers_below_to_the_joint_above():
    """A wrist 8 cm before the hand's marker, which is 33 cm from the elbow."""
    hand = np.array([0.0, 0.33, 0.0])
    lower = sphere_moments(np.tile(hand, (50, 1)))
    around = Surroundings({"A": np.zeros(3)}, np.zeros(3), lambda _: lower, 1.0)
    prior = Prior((), 0.02, "s", (Shift(toward=("FIN",), by=0.08),))
    found = expected_joint([prior], {}, around)
    assert found.mean == pytest.approx([0, 0.25, 0])
    assert found.covariance == pytest.approx(0.02**2 * np.eye(3))
    assert found.landmarks == ("FIN",)
    # Without the joint above, or so near to it, there is no such place.
    for other in (None, np.array([0.0, 0.3, 0.0])):
        assert expected_joint([prior], {}, replace(around, upper=other)) is None


def patch(facing, depth, where, seed=0):
    """Twelve markers on a flat patch of a limb along z that faces a way, so deep outside its bone."""
    rng = np.random.default_rng(seed)
    facing = np.asarray(facing, dtype=float)
    across = np.cross(facing, [0.0, 0.0, 1.0])
    u, v = rng.uniform(-1, 1, (2, 12, 1))
    return depth * facing + [0.0, 0.0, where] + 0.03 * u * across + 0.08 * v * np.array([0, 0, 1.0])


@pytest.mark.parametrize("degrees", [0, 45, 90])
def test_a_knee_without_a_landmark_lies_as_far_inward_as_its_patches_face_outward(degrees):
    """A right knee, whose axis inward is y: patches on the outer side are 6.5 cm beside it, those in front 0."""
    angle = np.deg2rad(degrees)
    facing = [np.sin(angle), -np.cos(angle), 0.0]
    thigh, shank = patch(facing, 0.065, 0.2), patch(facing, 0.065, -0.2, seed=1)
    bent = Turning(np.diag([0.3, 0.0, 0.3]), np.array([0.0, 0.999, 0.0]))
    lower = sphere_moments(np.tile(shank.mean(axis=0), (50, 1)))
    around = Surroundings(
        {f"T{i}": p for i, p in enumerate(thigh)}, None, lambda _: lower, 1.0,
        turn=lambda _: bent, cluster=(shank, shank),
    )  # fmt: skip
    prior = Prior((), 0.02, "s", (Shift(hinge=1, by=0.065),))
    found = expected_joint([prior], {}, around)
    # Twelve markers show which way a patch faces to some degrees.
    assert found.mean[1] == pytest.approx(0, abs=0.004)
    assert found.covariance[1, 1] == pytest.approx(0.02**2, rel=0.01)
    assert found.covariance[0, 0] > 0.1
    still = replace(bent, spread=np.zeros((3, 3)))
    assert expected_joint([prior], {}, replace(around, turn=lambda _: still)) is None
    assert expected_joint([prior], {}, replace(around, cluster=None)) is None

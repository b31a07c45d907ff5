"""The motion's part of a guess: distances from moments, rigid groups, joints between them."""

from dataclasses import replace

import numpy as np
import pytest
from recordings import SAMPLES, clip_of

from mocap_skel import artificial as art
from mocap_skel import associate, fit_skeleton, read_association, read_clip
from mocap_skel.errors import CallError, FitError
from mocap_skel.labels.guess import check_sure, guess_association, in_words
from mocap_skel.labels.guess.figure import figure_texts, find_figure
from mocap_skel.labels.guess.hinges import common_point
from mocap_skel.labels.guess.rigid import distances, rigid_groups
from mocap_skel.segments.pose import Pose

SIGMA = 0.001
HUMAN = art.human()
PLUG_IN_GAIT = art.marker_set("plug_in_gait")
CMU = art.marker_set("cmu")
RECORDING = art.record(
    HUMAN, CMU, art.range_of_motion(12, 50, seed=3), art.Faults(sigma=SIGMA), seed=3
)
CLIP = clip_of(RECORDING)


def renamed(clip, names):
    return replace(clip, labels=tuple(names.get(label, label) for label in clip.labels))


def segments(guess):
    return {line.label: line.segment for line in guess.used}


def test_spreads_of_distances_are_those_of_the_squared_distances():
    rng = np.random.default_rng(1)
    points = rng.normal(size=(700, 9, 3)) + 5.0
    points[rng.random((700, 9)) < 0.2] = np.nan
    found = distances(points)
    for i in range(9):
        for j in set(range(9)) - {i}:
            square = ((points[:, i] - points[:, j]) ** 2).sum(axis=1)
            square = square[np.isfinite(square)]
            assert found.count[i, j] == len(square)
            # Cancellation leaves 1e-16 of the fourth power of a few metres.
            np.testing.assert_allclose(found.mean[i, j], np.sqrt(square.mean()), rtol=1e-12)
            np.testing.assert_allclose(
                found.spread[i, j], square.std() / (2 * np.sqrt(square.mean())), rtol=1e-10
            )


def test_a_rigid_pair_far_from_the_origin_has_the_spread_of_its_noise():
    rng = np.random.default_rng(2)
    path = np.cumsum(rng.normal(size=(2000, 1, 3)), axis=0) * 0.01 + 10.0
    points = path + np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]])
    assert distances(points).spread[0, 1] < 1e-7
    points += SIGMA * rng.standard_normal(points.shape)
    # The noise of two markers along their line; 1/sqrt(2N) is the standard error of a deviation.
    want = np.sqrt(2) * SIGMA
    assert abs(distances(points).spread[0, 1] - want) < 4 * want / np.sqrt(4000)


def test_pairs_that_are_never_together_have_no_spread():
    points = np.random.default_rng(3).normal(size=(40, 3, 3))
    points[:20, 0] = points[20:, 1] = np.nan
    found = distances(points)
    assert np.isnan(found.spread[0, 1]) and found.count[0, 1] == 0
    assert np.isfinite(found.spread[0, 2])


def test_groups_are_the_true_segments():
    found = rigid_groups(distances(RECORDING.points).spread)
    truth = {}
    for column, (segment, _) in enumerate(CMU.values()):
        truth.setdefault(segment, []).append(column)
    assert sorted(found) == sorted(truth.values())


def test_no_marker_one_marker_and_markers_that_are_never_seen():
    assert rigid_groups(np.empty((0, 0))) == []
    assert rigid_groups(np.full((1, 1), np.nan)) == [[0]]
    assert rigid_groups(np.full((3, 3), np.nan)) == [[0], [1], [2]]


def test_a_common_point_of_two_frames_is_found():
    rng = np.random.default_rng(4)
    turns = [np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(80)]
    first = np.array([q * np.linalg.det(q) for q in turns[:40]])
    second = np.array([q * np.linalg.det(q) for q in turns[40:]])
    origin = rng.normal(size=(40, 3))
    c, d = np.array([0.1, -0.2, 0.3]), np.array([0.05, 0.1, 0.0])
    other = origin + first @ c - second @ d
    centre, residual = common_point(Pose(first, origin), Pose(second, other))
    # The prior is a millimetre against half a metre.
    np.testing.assert_allclose(centre, c, atol=1e-5)
    assert residual < 1e-5
    assert common_point(Pose(first[:5], origin[:5]), Pose(second[:5], other[:5])) is None


# names and motion together


@pytest.mark.parametrize("lost", ["RFHD", "STRN", "RFWT", "LWRA", "RMT5"])
def test_a_marker_without_a_name_goes_where_it_moves(lost):
    guess = guess_association(renamed(CLIP, {lost: "nobody"}))
    line = next(line for line in guess.lines if line.label == "nobody")
    assert (line.segment, line.confidence, line.standard) == (CMU[lost][0], "likely", False)


def test_a_marker_that_could_be_on_an_empty_neighbour_stays_open():
    """Without the hand's only marker's name, the forearm is not the only segment it can be on."""
    names = {label: f"obj{i}" for i, label in enumerate(CMU) if CMU[label][0] == "LowerLeftArm"}
    guess = guess_association(renamed(CLIP, names))
    assert not any(line.used for line in guess.lines if line.label in names.values())


def test_swapped_names_of_distant_segments_are_a_contradiction():
    swapped = renamed(CLIP, {"LFHD": "RANK", "RANK": "LFHD"})
    guess = guess_association(swapped)
    against = {line.label for line in guess.lines if line.contradicted}
    assert against == {"LFHD", "RANK"}
    assert not against & set(segments(guess))
    with pytest.raises(CallError, match="contradict each other: "):
        check_sure(guess)


def test_a_clip_that_stands_still_proves_nothing_and_contradicts_nothing():
    still = read_clip(SAMPLES / "nearly_still.c3d")
    guess = guess_association(renamed(still, {"LTHI": "nobody"}))
    assert not any(line.contradicted for line in guess.lines)
    assert "nobody" not in segments(guess)
    assert len(guess.used) == len(still.labels) - 1


def test_points_that_keep_a_distance_exactly_are_computed():
    column = CLIP.labels.index("LFHD")
    pose = RECORDING.poses["Head"]
    axes = [pose.place(np.array(p)) for p in ((0.0, 0, 0.1), (0.1, 0, 0.1), (0.0, 0.1, 0.1))]
    more = replace(
        CLIP,
        points=np.concatenate([CLIP.points, np.stack(axes, axis=1)], axis=1),
        labels=(*CLIP.labels, "AX1", "AX2", "AX3"),
        subjects=(*CLIP.subjects, "", "", ""),
    )
    lines = {line.label: line for line in guess_association(more).lines}
    assert all(lines[name].computed and not lines[name].used for name in ("AX1", "AX2", "AX3"))
    assert lines["LFHD"].used and column >= 0


def test_a_double_that_is_seen_elsewhere_at_the_same_time_is_unsure():
    column = CLIP.labels.index("LFHD")
    elsewhere = np.roll(CLIP.points[:, column], 250, axis=0) + [1.0, 0, 0]
    both = np.stack([elsewhere, CLIP.points[:, column]], axis=1)
    both[200:, 1] = np.nan
    points = np.concatenate([CLIP.points, both], axis=1)
    points[:200, column] = np.nan
    names = (*CLIP.labels, "RFHD_2", "LFHD_2")
    clip = replace(CLIP, points=points, labels=names, subjects=("",) * len(names))
    lines = {line.label: line for line in guess_association(clip).lines}
    assert lines["RFHD_2"].confidence == "unsure"
    assert (lines["LFHD_2"].used, lines["LFHD_2"].segment) == (True, "Head")


def test_labels_of_two_subjects_are_one_line_each():
    clip = read_clip(SAMPLES / "two_dancers.c3d")
    guess = guess_association(clip)
    assert len(guess.lines) == len(set(clip.labels)) == 41
    assert all(line.confidence == "high" for line in guess.lines)
    assert len(associate(clip, guess.association())) == 2
    one = guess_association(clip, "Ben")
    assert segments(one) == segments(guess)


@pytest.mark.parametrize("name", ["range_of_motion", "gaps", "two_dancers"])
def test_bundled_clips_are_guessed_as_their_association_files_say(name):
    clip = read_clip(SAMPLES / f"{name}.c3d")
    known = read_association("plug_in_gait" if name == "gaps" else "cmu")
    want = {r.label: (r.marker, r.segment) for r in known.rules if r.label in clip.labels}
    guess = guess_association(clip)
    check_sure(guess)
    assert {x.label: (x.marker, x.segment) for x in guess.used} == want


def test_a_clip_without_a_pelvis_is_not_sure():
    hips = {label: f"obj{i}" for i, label in enumerate(CMU) if CMU[label][0] == "Hips"}
    with pytest.raises(CallError, match="Hips needs three markers"):
        check_sure(guess_association(renamed(_still_hips(), hips)))


def _still_hips():
    """The clip without the pelvis's samples: motion cannot place what is not seen."""
    points = CLIP.points.copy()
    points[:, [i for i, label in enumerate(CMU) if CMU[label][0] == "Hips"]] = np.nan
    return replace(CLIP, points=points)


def test_labels_that_say_nothing_are_refused_with_the_way_out():
    nameless = renamed(CLIP, {label: f"point_{i}" for i, label in enumerate(CLIP.labels)})
    with pytest.raises(CallError) as refusal:
        guess_association(nameless)
    assert "--by-motion" in refusal.value.hint


# markers that are not where their names say


def one_of_two():
    """Anna's clip without her name, and Ben's points in the same order."""
    clip = read_clip(SAMPLES / "two_dancers.c3d")
    column = dict(zip(zip(clip.subjects, clip.labels, strict=True), range(82), strict=True))
    labels = [label for whose, label in column if whose == "Anna"]
    anna, ben = ([column[whose, label] for label in labels] for whose in ("Anna", "Ben"))
    alone = replace(clip, points=clip.points[:, anna], labels=tuple(labels), subjects=("",) * 41)
    return alone, clip.points[:, ben]


@pytest.mark.parametrize("label", ["LTOE", "LKNE", "LFWT", "C7", "LFIN", "RELB", "LFHD", "RANK"])
@pytest.mark.parametrize("what", ["the other's", "a reflector"])
def test_a_marker_that_moves_with_nothing_is_the_only_one_that_is_contradicted(label, what):
    clip, other = one_of_two()
    column = clip.labels.index(label)
    points = clip.points.copy()
    still = np.nanmean(points[0], axis=0) + [3.0, 0, 0]
    points[:, column] = other[:, column] if what == "the other's" else still
    guess = guess_association(replace(clip, points=points))
    assert [line.label for line in guess.lines if line.contradicted] == [label]
    assert label not in segments(guess) and len(guess.used) == 40
    with pytest.raises(CallError, match=f"contradict each other: {label}"):
        check_sure(guess)


@pytest.mark.parametrize("suffix", ["2", "_2"])
def test_a_second_person_under_numbered_labels_is_left_out(suffix):
    clip, other = one_of_two()
    both = replace(
        clip,
        points=np.concatenate([clip.points, other], axis=1),
        labels=(*clip.labels, *(label + suffix for label in clip.labels)),
        subjects=("",) * 82,
    )
    guess = guess_association(both)
    check_sure(guess)
    assert set(segments(guess)) == set(clip.labels)
    assert "left out" in in_words(guess)


def test_a_few_numbered_markers_of_someone_else_are_asked_for():
    clip, other = one_of_two()
    more = {"LFHD2": "LFHD", "LFWT2": "LFWT", "LKNE2": "LKNE", "STRN2": "STRN"}
    more |= {f"HEAD{i}": name for i, name in enumerate(("LFHD", "RFHD", "LBHD", "RBHD"), 1)}
    columns = [clip.labels.index(label) for label in more.values()]
    both = replace(
        clip,
        points=np.concatenate([clip.points, other[:, columns]], axis=1),
        labels=(*clip.labels, *more),
        subjects=("",) * (41 + len(more)),
    )
    guess = guess_association(both)
    lines = {line.label: line for line in guess.lines}
    assert all(lines[label].confidence == "unsure" for label in more)
    assert "a second person or an object?" in lines["LFWT2"].reason
    assert "a second person under the same labels" in in_words(guess)
    assert set(segments(guess)) == set(clip.labels)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("LTHI", "LSHN"), ("LELB", "LWRA"), ("LUPA", "LFRM"), ("LSHO", "LFHD"),
        ("LFWT", "LTHI"), ("LFIN", "RFIN"), ("LANK", "LHEE"),
    ],
)  # fmt: skip
def test_exchanged_neighbours_are_a_contradiction(one, other):
    guess = guess_association(renamed(CLIP, {one: other, other: one}))
    against = {line.label for line in guess.lines if line.contradicted}
    assert {one, other} <= against
    assert not against & set(segments(guess))
    with pytest.raises(CallError, match="contradict each other"):
        check_sure(guess)


@pytest.mark.parametrize("markers", ["cmu", "plug_in_gait"])
@pytest.mark.parametrize("moves", [art.range_of_motion, art.dance, art.walk])
@pytest.mark.parametrize("slide", [0.0, 0.005])
def test_true_names_are_never_contradicted(markers, moves, slide):
    faults = art.Faults(sigma=SIGMA, slide=slide)
    clip = clip_of(
        art.record(HUMAN, art.marker_set(markers), moves(10, 50, seed=4), faults, seed=4)
    )
    guess = guess_association(clip)
    check_sure(guess)
    assert len(guess.used) == len(clip.labels)
    assert all(line.confidence == "high" for line in guess.lines)


def test_a_marker_that_fits_the_neighbour_clearly_better_is_said_to():
    """A knee marker that sits on the shank, with a thigh of four that can tell."""
    shank = RECORDING.poses["LowerLeftLeg"]
    thigh = RECORDING.poses["UpperLeftLeg"]
    rng = np.random.default_rng(11)
    places = [(0.05, 0.05, -0.2), (-0.05, 0.05, -0.25), (0.02, -0.05, -0.15)]
    extra = [thigh.place(np.array(p)) for p in places]
    points = np.concatenate([CLIP.points, np.stack(extra, axis=1)], axis=1)
    knee = CLIP.labels.index("LKNE")
    points[:, knee] = shank.place(np.array((0.0, 0.05, -0.06)))
    points[:, [knee, -3, -2, -1]] += SIGMA * rng.standard_normal((len(points), 4, 3))
    names = (*CLIP.labels, "LTH1", "LTH2", "LTH3")
    clip = replace(CLIP, points=points, labels=names, subjects=("",) * len(names))
    lines = {line.label: line for line in guess_association(clip).lines}
    assert "moves rather with LowerLeftLeg" in lines["LKNE"].reason
    assert lines["LKNE"].confidence != "high"


# a figure without names


def nameless(clip, count=None):
    columns = range(len(clip.labels) if count is None else count)
    return replace(
        clip,
        points=clip.points[:, list(columns)],
        labels=tuple(f"m{i}" for i in columns),
        subjects=("",) * len(columns),
    )


def compared(figure, truth):
    """Segments found whole and joints found right: truth is label -> true segment."""
    sets = {}
    for label, segment in truth.items():
        if label not in figure.left_out:
            sets.setdefault(segment, set()).add(label)
    name = {
        s.name: true for s in figure.segments for true, of in sets.items() if of == set(s.labels)
    }
    parents = {s.name: s.parent for s in HUMAN.segments}
    right = sum(
        parents.get(name.get(s.name)) == name.get(s.parent, "")
        or parents.get(name.get(s.parent)) == name.get(s.name, "")
        for s in figure.segments
        if s.parent
    )
    return len(name), len(sets), right


@pytest.mark.parametrize(
    ("markers", "moves"),
    [
        (CMU, art.range_of_motion(14, 50, seed=3)),
        (PLUG_IN_GAIT, art.range_of_motion(14, 50, seed=5)),
        (CMU, art.dance(14, 50, seed=7)),
    ],
    ids=["cmu", "plug_in_gait", "dance"],
)
def test_the_figure_of_an_artificial_clip_is_the_true_one(markers, moves):
    faults = art.Faults(sigma=SIGMA)
    clip = nameless(clip_of(art.record(HUMAN, markers, moves, faults, seed=9)))
    truth = {f"m{i}": segment for i, (segment, _) in enumerate(markers.values())}
    figure = find_figure(clip)
    assert compared(figure, truth) == (15, 15, 14)
    assert len(figure.segments[0].labels) >= 3


@pytest.mark.parametrize("name", ["range_of_motion", "gaps"])
def test_bundled_clips_with_their_labels_erased(name):
    clip = read_clip(SAMPLES / f"{name}.c3d")
    known = read_association("plug_in_gait" if name == "gaps" else "cmu")
    of = {r.label: r.segment for r in known.rules}
    truth = {f"m{i}": of[label] for i, label in enumerate(clip.labels)}
    figure = find_figure(nameless(clip))
    found, there, right = compared(figure, truth)
    # In gaps, LTHI is never seen: a thigh of one marker has no frame for the shank to hang on.
    lost = {"LTHI", "LTIB", "LANK", "LHEE", "LTOE"} if name == "gaps" else set()
    assert {clip.labels[int(label[1:])] for label in figure.left_out} == lost
    assert found == there == (13 if name == "gaps" else 15)
    assert right == there - 1


def test_the_figures_files_are_read_and_fitted(tmp_path):
    clip = nameless(CLIP)
    toml, text = figure_texts(find_figure(clip), "fig.toml")
    (tmp_path / "fig.toml").write_text(toml)
    (tmp_path / "fig.txt").write_text(text)
    known = read_association(tmp_path / "fig.txt")
    fit = fit_skeleton(clip, associate(clip, known)[0], known.skeleton)
    assert len(fit.joints) == 14
    assert all(joint.shown == "yes" for joint in fit.joints)


def test_no_figure_where_nothing_keeps_its_distance():
    rng = np.random.default_rng(6)
    scattered = replace(
        CLIP,
        points=np.cumsum(rng.normal(size=(300, 5, 3)), axis=0),
        labels=tuple("abcde"),
        subjects=("",) * 5,
    )
    with pytest.raises(FitError, match="no three markers"):
        find_figure(scattered)


def test_a_figure_is_one_subjects():
    clip = read_clip(SAMPLES / "two_dancers.c3d")
    with pytest.raises(CallError, match="one subject's"):
        find_figure(clip)
    assert len(find_figure(clip, "Anna").segments) == 15

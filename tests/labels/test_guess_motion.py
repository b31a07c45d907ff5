"""The motion's part of a guess: distances from moments, rigid groups, and what they say to the names."""

from dataclasses import replace

import numpy as np
import pytest
from labelled import CLIP, CMU, HUMAN, RECORDING, SIGMA, more, on, one_of_two, renamed, segments
from recordings import SAMPLES, clip_of

from mocap_skel import artificial as art
from mocap_skel import associate, read_association, read_clip
from mocap_skel.errors import CallError
from mocap_skel.labels.guess import check_sure, guess_association, in_words
from mocap_skel.labels.guess.rigid import LEAST_FRAMES, distances, rigid_groups


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


def test_a_few_frames_together_say_nothing():
    points = np.random.default_rng(3).normal(size=(40, 3, 3))
    points[LEAST_FRAMES - 1 :, 0] = np.nan
    points[LEAST_FRAMES:, 1] = np.nan
    found = distances(points)
    assert found.count[0, 1:].tolist() == [LEAST_FRAMES - 1] * 2
    assert np.isnan(found.spread[0, 1:]).all()
    assert found.count[1, 2] == LEAST_FRAMES and np.isfinite(found.spread[1, 2])


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
    axes = {f"AX{i}": on("Head", place) for i, place in enumerate(0.1 * np.eye(3))}
    lines = {line.label: line for line in guess_association(more(CLIP, axes)).lines}
    assert all(lines[name].computed and not lines[name].used for name in axes)
    assert sum(line.used for line in lines.values()) == len(CLIP.labels)


def test_in_a_clip_without_noise_exact_distances_mean_nothing():
    clip = clip_of(art.record(HUMAN, CMU, art.range_of_motion(5, 50, seed=3), seed=3))
    guess = guess_association(renamed(clip, {"RFHD": "nobody"}))
    assert segments(guess)["nobody"] == "Head"
    assert not any(line.computed for line in guess.lines)


def test_a_double_that_is_seen_elsewhere_at_the_same_time_is_unsure():
    track = CLIP.points[:, CLIP.labels.index("LFHD")]
    elsewhere, later = np.roll(track, 250, axis=0) + [1.0, 0, 0], track.copy()
    clip = more(CLIP, {"RFHD_2": elsewhere, "LFHD_2": later})
    # The one breaks off where the other goes on.
    clip.points[:200, CLIP.labels.index("LFHD")] = clip.points[200:, -1] = np.nan
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


def test_labels_that_say_nothing_are_refused_with_the_way_out():
    nameless = renamed(CLIP, {label: f"point_{i}" for i, label in enumerate(CLIP.labels)})
    with pytest.raises(CallError) as refusal:
        guess_association(nameless)
    assert "--by-motion" in refusal.value.hint


# markers that are not where their names say


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
    names = [label + suffix for label in clip.labels]
    both = more(clip, dict(zip(names, other.swapaxes(0, 1), strict=True)))
    guess = guess_association(both)
    check_sure(guess)
    assert set(segments(guess)) == set(clip.labels)
    assert "left out" in in_words(guess)


def test_a_few_numbered_markers_of_someone_else_are_asked_for():
    clip, other = one_of_two()
    copies = {"LFHD2": "LFHD", "LFWT2": "LFWT", "LKNE2": "LKNE", "STRN2": "STRN"}
    copies |= {f"HEAD{i}": name for i, name in enumerate(("LFHD", "RFHD", "LBHD", "RBHD"), 1)}
    both = more(clip, {name: other[:, clip.labels.index(of)] for name, of in copies.items()})
    guess = guess_association(both)
    lines = {line.label: line for line in guess.lines}
    assert all(lines[label].confidence == "unsure" for label in copies)
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
    rng = np.random.default_rng(11)
    places = {
        "LTH1": (0.05, 0.05, -0.2),
        "LTH2": (-0.05, 0.05, -0.25),
        "LTH3": (0.02, -0.05, -0.15),
    }
    clip = more(CLIP, {name: on("UpperLeftLeg", place, rng) for name, place in places.items()})
    clip.points[:, CLIP.labels.index("LKNE")] = on("LowerLeftLeg", (0.0, 0.05, -0.06), rng)
    lines = {line.label: line for line in guess_association(clip).lines}
    assert "moves rather with LowerLeftLeg" in lines["LKNE"].reason
    assert lines["LKNE"].confidence != "high"

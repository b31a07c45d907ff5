"""Names weighed by distances that are made by hand: each limit from both of its sides.

Unless a test says otherwise, two markers of a segment keep their distance within 1 mm, and two of different
segments change it by 10 cm.
"""

import numpy as np
import pytest

from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.labels.guess import motion
from mocap_skel.labels.guess.motion import weigh
from mocap_skel.labels.guess.names import HIGH, LIKELY, OPEN, UNSURE, NameGuess
from mocap_skel.labels.guess.rigid import Distances

HUMAN = read_skeleton("human")
INSIDE, BETWEEN = 0.001, 0.1
MILLIMETRE = 0.001
FRAMES = 100
# Five markers on each of two neighbours and on a segment far from both, as the names have them.
CHEST = {f"C{i}": "Chest" for i in range(5)}
HIPS = {f"H{i}": "Hips" for i in range(5)}
FOOT = {f"F{i}": "LeftFoot" for i in range(5)}
BODY = CHEST | HIPS | FOOT


def judged(places, spreads, *, guesses=None, means=None, counts=None, inside=INSIDE):
    """Verdicts by label.

    Args:
        places: label → the segment that its name says, with HIGH confidence.
        spreads: (label, label or segment) → metres, in place of INSIDE and BETWEEN.
        guesses: label → guess, for labels whose names say something else.
        means, counts: likewise, in place of 30 cm and all frames.
        inside: in place of INSIDE.
    """
    named = {name: NameGuess(name, s, "", HIGH, "by name") for name, s in places.items()}
    named |= guesses or {}
    labels = list(named)
    at = [named[label].segment for label in labels]

    def matrix(same, between, said):
        values = np.where(np.equal.outer(np.array(at), np.array(at)), same, between).astype(float)
        for (label, other), value in (said or {}).items():
            for i in (k for k in range(len(labels)) if other in (labels[k], at[k])):
                values[labels.index(label), i] = values[i, labels.index(label)] = value
        np.fill_diagonal(values, np.nan)
        return values

    found = Distances(
        matrix(FRAMES, FRAMES, counts), matrix(0.3, 0.3, means), matrix(inside, BETWEEN, spreads)
    )
    return dict(zip(labels, weigh(list(named.values()), found, HUMAN, FRAMES), strict=True))


def nobody(spreads, places=BODY, **options):
    """The guess for a label that says nothing."""
    guess = {"nobody": NameGuess("nobody", "", "", OPEN, "nothing")}
    said = {("nobody", place): value for place, value in spreads.items()}
    return judged(places, said, guesses=guess, **options)["nobody"].guess


def test_a_body_that_moves_as_its_names_say_is_certain():
    verdicts = judged(BODY, {})
    assert not any(v.contradicted for v in verdicts.values())
    # Of the neighbours a marker's distances change as well: the name is the better for it.
    assert all("moves with it (1.0 mm)" in v.guess.reason for v in verdicts.values())


# a name that says nothing


# With the chest's other neighbours.
WHOLE = BODY | {f"{s}{i}": s for s in ("Head", "UpperLeftArm", "UpperRightArm") for i in range(2)}


@pytest.mark.parametrize(
    ("inside", "best", "second", "placed"),
    [
        (1, 2.0, 7.1, True), (1, 2.0, 6.9, False),  # 5 mm more
        (1, 2.4, 20, True), (1, 2.6, 20, False),  # 2.5 times what two of the segment do
        (4, 9.0, 23, True), (4, 9.0, 22, False),  # 2.5 times as much
        (5, 9.9, 99, True), (5, 10.1, 99, False),  # skin's centimetre
    ],
)  # fmt: skip
def test_a_marker_goes_to_the_segment_that_it_fits_clearly_best(inside, best, second, placed):
    spreads = {"Chest": best * MILLIMETRE, "Hips": second * MILLIMETRE}
    found = nobody(spreads, WHOLE, inside=inside * MILLIMETRE)
    assert (found.segment, found.confidence) == (("Chest", LIKELY) if placed else ("", OPEN))


def test_two_segments_that_a_marker_may_be_on_are_named():
    assert nobody({"Chest": 0.002, "Hips": 0.006}).reason == "nothing; moves with Chest or Hips"


def test_what_hardly_moves_says_nothing():
    spreads = dict.fromkeys(("Hips", "LeftFoot", "Head", "UpperLeftArm", "UpperRightArm"), 0.0049)
    found = nobody({"Chest": 0.0005} | spreads, WHOLE)
    assert (found.segment, found.reason) == ("", "nothing")


def test_a_neighbour_without_a_marker_may_be_meant():
    found = nobody({"Chest": INSIDE}, {k: v for k, v in WHOLE.items() if v != "Head"})
    assert (found.segment, found.confidence) == ("", OPEN)
    assert "moves with Chest, but so might Head" in found.reason


# a marker of another body


@pytest.mark.parametrize(
    ("confidence", "spread", "lost"),
    [
        (HIGH, motion.ABSURD - MILLIMETRE, False), (HIGH, motion.ABSURD + MILLIMETRE, True),
        (LIKELY, motion.TOO_MUCH - MILLIMETRE, False), (LIKELY, motion.TOO_MUCH + MILLIMETRE, True),
    ],
)  # fmt: skip
def test_a_marker_is_lost_that_keeps_its_distance_to_nothing(confidence, spread, lost):
    guess = {"C9": NameGuess("C9", "Chest", "", confidence, "by name")}
    verdict = judged(BODY, {("C9", "Chest"): spread}, guesses=guess)["C9"]
    assert verdict.guess.lost == lost
    assert verdict.contradicted == (lost and confidence == HIGH)
    assert (verdict.guess.confidence == UNSURE) == lost


@pytest.mark.parametrize(("metres", "lost"), [(0.95, False), (1.05, True)])
def test_no_marker_of_a_segment_is_farther_away_than_a_body_is_long(metres, lost):
    far = {("C0", place): metres for place in ("Chest", "Hips", "LeftFoot")}
    verdict = judged(BODY, {}, means=far)["C0"]
    assert (verdict.guess.lost, verdict.contradicted) == (lost, lost)


@pytest.mark.parametrize(("together", "known"), [(4, False), (5, True)])
def test_markers_that_are_hardly_seen_together_say_nothing(together, known):
    """The least is a twentieth of the frames."""
    rare = {("C0", place): together for place in ("Chest", "Hips", "LeftFoot")}
    assert judged(BODY, {("C0", "Chest"): BETWEEN}, counts=rare)["C0"].contradicted == known


# a name against the movement


@pytest.mark.parametrize(
    ("own", "other", "against"), [(11, 4, True), (9, 1, False), (11, 5, False)]
)
def test_a_name_falls_where_a_far_segment_fits_clearly_better(own, other, against):
    spreads = {("C0", "Chest"): own * MILLIMETRE, ("C0", "LeftFoot"): other * MILLIMETRE}
    verdict = judged(BODY, spreads)["C0"]
    assert verdict.contradicted == against
    assert ("moves with LeftFoot" in verdict.guess.reason) == against


def test_a_neighbour_that_fits_better_is_only_said():
    verdict = judged(BODY, {("C0", "Chest"): 0.009, ("C0", "Hips"): 0.003})["C0"]
    assert (verdict.contradicted, verdict.guess.confidence) == (False, LIKELY)
    assert "moves rather with Hips" in verdict.guess.reason


# exchanged markers


def crosswise(*pairs):
    """Verdicts where C_i and H_j fit the other's segment, each better by a factor."""
    spreads = {}
    for i, j, first, second in pairs:
        spreads |= {(f"C{i}", "Chest"): 0.004, (f"C{i}", "Hips"): 0.004 / first}
        spreads |= {(f"H{j}", "Hips"): 0.004, (f"H{j}", "Chest"): 0.004 / second}
    # What the pair's markers do to each other must not count.
    spreads |= {(f"C{i}", f"H{j}"): BETWEEN for i, j, *_ in pairs}
    found = judged(BODY, spreads)
    return {k for k, v in found.items() if "look exchanged" in v.guess.reason}, found


@pytest.mark.parametrize(
    ("first", "second", "exchanged"),
    [(2.1, 2.0, True), (1.9, 2.0, False), (4.0, 1.1, True), (8.0, 1.02, False)],
)
def test_two_are_exchanged_where_each_fits_the_others_place_better(first, second, exchanged):
    labels, found = crosswise((0, 0, first, second))
    assert labels == ({"C0", "H0"} if exchanged else set())
    assert found["C0"].contradicted == exchanged


def test_the_clearest_pair_is_taken_first():
    """C0 could be exchanged with H0 or, more clearly, with H1."""
    labels, found = crosswise((0, 0, 2.5, 2.0), (0, 1, 2.5, 3.5))
    assert labels == {"C0", "H1"}
    assert "it and H1 look exchanged" in found["C0"].guess.reason

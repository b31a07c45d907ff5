"""Sentences about a fit: whom to trust, whose sides differ, what to film. On fits made by hand."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from handmade import FRAMES, fit_of, joint, leg

from mocap_skel.joints.joint_fit import unfitted
from mocap_skel.results.tables import joint_rows
from mocap_skel.results.verdict import error_95, verdict


def said(fit):
    return verdict(fit, joint_rows(fit))


def test_one_joint_and_both_sides_are_named_as_one_would_say_it():
    fit = fit_of(joint("LeftKnee"), joint("RightKnee"), joint("LeftHip"))
    assert said(fit)[0] == "Known to 2 cm (95 %): both knees, left hip."


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("ThumbCMC", "thumb CMC"),
        ("LeftElbow", "left elbow"),
        ("Waist", "waist"),
        ("knee_L", "knee L"),
        ("Joint2", "joint2"),
    ],
)
def test_names_become_words(name, words):
    assert said(fit_of(joint(name))) == (f"Known to 2 cm (95 %): {words}.",)


def test_a_name_that_ends_in_s_has_a_plural_too():
    fit = fit_of(joint("LeftCarpus"), joint("RightCarpus"))
    assert said(fit)[0] == "Known to 2 cm (95 %): both carpuses."


@pytest.mark.parametrize(
    ("se", "start"),
    [
        (0.0, "Known to 2 cm (95 %): knee."),
        (0.0099, "Known to 2 cm (95 %): knee."),
        (0.0101, "Known to 5 cm: knee."),
        (0.0251, "Not to be trusted: knee."),
    ],
)
def test_levels_are_two_standard_errors_in_the_worst_direction(se, start):
    fit = fit_of(joint("Knee", se))
    assert error_95(fit.joints[0]) == pytest.approx(2 * se)
    assert said(fit)[0] == start


def test_levels_stand_in_one_sentence_the_best_first():
    fit = fit_of(
        joint("Neck", 0.04),
        joint("Waist", 0.02),
        joint("Knee"),
        unfitted("Hip", "Root", "HipPart", FRAMES, "x"),
    )
    assert said(fit)[0] == (
        "Known to 2 cm (95 %): knee; known to 5 cm: waist; not to be trusted: neck; not fitted: hip."
    )


def test_a_place_holder_is_not_to_be_trusted_however_small_its_errors():
    holder = replace(joint("Hip"), shown="no")
    found = said(fit_of(holder, joint("Knee")))
    assert found[0] == "Known to 2 cm (95 %): knee; not to be trusted: hip."
    # With a prior the errors are those of an estimate.
    expected = replace(joint("Hip", landmarks=["A"]), shown="no")
    assert said(fit_of(expected))[0] == "Known to 2 cm (95 %): hip."


def test_nothing_fitted():
    fit = fit_of(unfitted("LeftKnee", "Root", "LeftKneePart", FRAMES, "no marker"))
    assert error_95(fit.joints[0]) == float("inf")
    assert said(fit) == ("Not fitted: left knee.",)


def test_a_figure_without_joints_has_no_verdict():
    assert said(fit_of()) == ()


def test_what_is_from_anatomy_is_said_below_a_half():
    fit = fit_of(
        joint("LeftHip", share=0.49, landmarks=["A"]),
        joint("RightHip", share=0.0, landmarks=["A"]),
        joint("Knee", share=0.5, landmarks=["A"]),
        joint("Neck", share=0.1),
    )
    assert said(fit)[1] == "More from anatomy than from the movement: both hips."


def test_a_place_holder_is_never_to_be_trusted_however_small_its_error():
    """Without anatomy, and where the movement shows nothing, the error is that of nothing."""
    holder = replace(joint("Knee", se=0.001), shown="no")
    from_anatomy = replace(joint("Hip", se=0.001, landmarks=["A"]), shown="no")
    assert said(fit_of(holder, from_anatomy))[0] == (
        "Known to 2 cm (95 %): hip; not to be trusted: knee."
    )


# --- movements


def test_movements_are_asked_for_the_worst_joints_first_and_three_at_most():
    errors = {"A": 0.02, "B": 0.08, "C": 0.03, "D": 0.05, "E": 0.001}
    fit = fit_of(
        *(joint(name, se) for name, se in errors.items()),
        movements={name: f"move {name.lower()}" for name in errors},
    )
    assert said(fit)[-1] == "To know more, film: move b; move d; move c."


def test_a_movement_that_was_made_is_not_asked_for_again():
    """What is left of the error is skin's, which the same movement brings again."""
    wide = {"weakest_sd": 0.04, "residual": 0.004}
    hip, knee = (joint(name, 0.02) for name in ("Hip", "Knee"))
    movements = {"Hip": "swing", "Knee": "bend"}
    assert said(fit_of(replace(hip, **wide), knee, movements=movements))[-1] == (
        "To know more, film: bend."
    )
    assert len(said(fit_of(replace(hip, **wide), movements=movements))) == 1
    # A small one is, and so is one about a single axis.
    small = replace(hip, weakest_sd=0.01, residual=0.004)
    line = replace(hip, hinge=True, **wide)
    for poor in (small, line):
        assert said(fit_of(poor, movements=movements))[-1] == "To know more, film: swing."


def test_the_same_movement_is_asked_for_once():
    fit = fit_of(joint("A", 0.1), joint("B", 0.2), movements={"A": "dance", "B": "dance"})
    assert said(fit)[-1] == "To know more, film: dance."


def test_no_movement_shows_a_joint_without_a_pose_above_or_a_marker_below():
    """Markers do, and the notes say so."""
    lost = unfitted("Knee", "Thigh", "Shank", FRAMES, "Thigh has no pose")
    below = replace(joint("Ankle", se=0.02), samples=0)
    seen = joint("Neck", se=0.02)
    movements = {"Knee": "bend", "Ankle": "circle", "Neck": "nod"}
    thigh = joint("Hip")
    thigh = replace(thigh, child="Thigh")
    fit = fit_of(thigh, lost, below, seen, movements=movements)
    assert said(fit)[-1] == "To know more, film: nod."


def test_well_known_joints_ask_for_nothing():
    fit = fit_of(joint("A"), movements={"A": "dance"})
    assert len(said(fit)) == 1


# --- the two sides


def test_bones_that_differ_are_named_by_the_joint_at_their_end():
    fit = fit_of(*leg("Left", 0.40), *leg("Right", 0.44))
    # 0.04 of the mean 0.42 is 9.5 %
    assert said(fit)[1] == (
        "Bones whose two sides differ in length, measured up to the joint: ankle 10 %."
    )


def test_it_does_not_matter_which_side_is_the_longer_one():
    fit = fit_of(*leg("Left", 0.44), *leg("Right", 0.40))
    assert said(fit)[1].endswith("measured up to the joint: ankle 10 %.")


def test_small_differences_are_natural():
    fit = fit_of(*leg("Left", 0.40), *leg("Right", 0.4199))
    assert len(said(fit)) == 1


def test_one_side_alone_has_nothing_to_differ_from():
    assert len(said(fit_of(*leg("Left", 0.40)))) == 1


def test_a_fit_from_a_stub_needs_no_more_than_its_worst_error():
    assert error_95(SimpleNamespace(fitted=True, worst_error=0.004)) == pytest.approx(0.008)

"""Which way is inward in a limb that hangs, by the trunk."""

import numpy as np
import pytest

from mocap_skel.figure.prior_tables import Shift
from mocap_skel.joints.hanging import RAISED, inward_of_hanging

DOWN, LEFT, FRONT = np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])
ARM = Shift(
    hinge=-1, by=0.04, toward=("RWRA",), turned=0.25, inside=0.66, straight=("RSHO", "LSHO"),
    hanging=("C7", "T10"),
)  # fmt: skip


def told(shift, line, bone, below, down):
    return inward_of_hanging(
        shift, line[None], bone, below[None], None if down is None else down[None]
    )


@pytest.mark.parametrize(("hinge", "line"), [(-1, LEFT), (1, -LEFT)])
def test_both_hanging_arms_are_turned_inward(hinge, line):
    shift = Shift(hinge=hinge, by=0.04, turned=0.25, inside=0.66, hanging=("C7", "T10"))
    inward, error = told(shift, line, 0.3 * DOWN, 0.25 * DOWN, 0.4 * DOWN)
    # The outer side of the elbow points outward and forward, so inward is inward and back.
    np.testing.assert_allclose(inward, np.cos(0.66) * line - np.sin(0.66) * FRONT, atol=1e-12)
    assert error == pytest.approx(0.25)


@pytest.mark.parametrize("angle", [0.3, 1.0])
def test_an_arm_that_is_raised_or_bent_may_turn_by_as_much(angle):
    away = np.cos(angle) * DOWN + np.sin(angle) * FRONT
    for bone, below in ((away, away), (DOWN, away)):
        assert told(ARM, LEFT, bone, below, DOWN)[1] == pytest.approx(np.hypot(0.25, angle))


def test_where_nobody_sees_what_is_down_the_arm_may_be_raised():
    assert told(ARM, LEFT, DOWN, DOWN, None)[1] == pytest.approx(np.hypot(0.25, RAISED))


def test_a_line_without_a_posture_is_taken_as_it_is():
    leg = Shift(hinge=1, by=0.05, turned=0.35, straight=("RFWT", "LFWT"))
    inward, error = told(leg, 0.2 * LEFT, None, DOWN, None)
    np.testing.assert_allclose(inward, LEFT)
    assert error == 0.35


def test_a_moving_arm_knows_less_and_missing_frames_do_not_count():
    line = np.array([LEFT, FRONT, LEFT])
    line[2] = np.nan
    inward, error = inward_of_hanging(ARM, line, DOWN, np.tile(DOWN, (3, 1)), np.tile(DOWN, (3, 1)))
    assert np.linalg.norm(inward) == pytest.approx(np.sqrt(0.5))
    assert error == pytest.approx(0.25)
    assert inward_of_hanging(ARM, line[2:], DOWN, DOWN[None], DOWN[None]) is None

"""Gait cycles: normalised, and added up, by values known otherwise."""

import numpy as np
import pytest
from walks import walked

from mocap_skel.angles.joint_angles import Angles, JointAngles, joint_angles
from mocap_skel.events import Event
from mocap_skel.figure.angle_table import angle_table
from mocap_skel.gait.cycles import cycles_of, mean_cycles, mean_rows, stride_rows, strides
from mocap_skel.gait.events import foot_events

RULES = {rule.name: rule for rule in angle_table().angles}


def angles_of(function, joint="LeftKnee", frames=301, rate=100.0, first=1):
    """Angles that are a function of time in all three columns."""
    numbers = np.arange(first, first + frames)
    time = (numbers - 1) / rate
    degrees = np.repeat(function(time)[:, None], 3, axis=1)
    values = JointAngles(RULES[joint], degrees, 0 * degrees, np.zeros(frames, dtype=bool))
    return Angles(numbers, time, (values,), ())


def strikes(*seconds, side="Left", rate=100.0):
    return [Event(t, round(t * rate) + 1, "Foot Strike", side) for t in seconds]


def test_a_cycle_has_the_values_of_its_percents():
    """A straight line over time is a straight line over the cycle, also between frames."""
    found = strides(strikes(0.503, 1.7), [])
    (cycle,) = cycles_of(angles_of(lambda t: 10 * t), found, ["LeftKnee"], "a.c3d")
    assert np.allclose(cycle.degrees[:, 0], np.linspace(5.03, 17.0, 101), atol=1e-9)


def test_mean_and_deviation_over_cycles():
    """Three cycles at 1, 2 and 6: mean 3, standard deviation √7."""
    steps = angles_of(lambda t: np.select([t < 1.0, t < 2.0], [1.0, 2.0], 6.0))
    found = strides(strikes(0.0, 1.0, 2.0, 3.0), [])
    (mean,) = mean_cycles(cycles_of(steps, found, ["LeftKnee"], "a.c3d"))
    assert np.allclose(mean.mean[:100], 3.0) and np.allclose(mean.sd[:100], np.sqrt(7.0))
    assert (mean.count == 3).all() and len(mean_rows([mean])) == 303


def test_missing_frames_are_missing_in_their_cycle_only():
    angles = angles_of(lambda t: np.where((t > 0.495) & (t < 0.545), np.nan, 1.0 + (t >= 1.5)))
    found = strides(strikes(0.5, 1.5, 2.5), [])
    (mean,) = mean_cycles(cycles_of(angles, found, ["LeftKnee"], "a.c3d"))
    assert mean.count[0, 0] == 1 and mean.count[50, 0] == 2
    assert mean.mean[0, 0] == 2.0 and np.isnan(mean.sd[0, 0])


def test_strides_cut_by_the_ends_of_the_clip_or_not_seen_give_no_cycle():
    nothing = angles_of(lambda t: np.full_like(t, np.nan))
    assert not list(cycles_of(nothing, strides(strikes(0.5, 1.5), []), ["LeftKnee"], "a"))


def test_headings_of_other_turns_are_brought_together():
    heading = angles_of(lambda t: 10 * (t % 1.0) + 720.0 * (t >= 1.0), "Hips")
    found = strides(strikes(0.0, 0.99, side="Right") + strikes(1.0, 1.99, side="Right"), [])
    (mean,) = mean_cycles(cycles_of(heading, found, ["Hips"], "a"))
    assert mean.side == "right" and len(mean.cycles) == 2
    assert np.nanmax(mean.sd[1:-1]) < 1e-9


def test_a_joint_takes_the_strikes_of_its_side_and_a_middle_one_those_of_both():
    found = strides(strikes(0.1, 1.1) + strikes(0.6, 1.6, side="Right"), [])
    left = list(cycles_of(angles_of(np.sin), found, ["LeftKnee", "RightKnee"], "a"))
    assert [(cycle.joint, cycle.stride.side) for cycle in left] == [("LeftKnee", "left")]
    both = mean_cycles(cycles_of(angles_of(np.sin, "Waist"), found, ["Waist"], "a"))
    assert [one.side for one in both] == ["left", "right"]


def test_when_the_foot_leaves():
    events = sorted(
        [*strikes(0.0, 1.0, 2.2), Event(0.6, 61, "Foot Off", "Left"), Event(1.9, 191, "Foot Off", "Left")],
        key=lambda e: e.time,
    )  # fmt: skip
    assert [stride.off for stride in strides(events, [])] == pytest.approx([60.0, 75.0])


def test_the_cycles_of_a_generated_walk_are_one_cycle():
    """A walk that repeats itself: all cycles are the same to the noise, 1.08 s long, and the foot leaves at 62 %."""
    _, clip, fit = walked(8)
    found = foot_events(fit, clip)
    own = strides(found.of_feet, [])
    means = mean_cycles(cycles_of(joint_angles(fit), own, ["LeftKnee", "RightKnee"], "walk"))
    for mean in means:
        assert (
            np.nanmax(mean.sd[:, 0]) < 3.0
        )  # a frame of doubt in a strike, where the knee bends at 400 degrees a second
        assert 45 < mean.mean[:, 0].max() < 65 and 60 <= mean.mean[:, 0].argmax() <= 80
    for row in stride_rows(means):
        assert row["stride_s"] == pytest.approx(1.08, abs=0.01)
        assert row["off_percent"] == pytest.approx(62.0, abs=3.0)

"""Tables for a terminal: what stands in which column, and that a line fits."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from handmade import fit_of, joint

from mocap_skel.joints.joint_fit import unfitted
from mocap_skel.report.terminal import (
    WIDTH,
    calibration_table,
    joint_table,
    rows_table,
    sentence,
    table,
)

WHY = "moves only 0.6 cm in one direction, little above its noise, and turns about one axis only"


def a_knee(**changes):
    """A joint of which every number is another one."""
    known = {
        "samples": 400, "method": "MGDK", "share": 0.254, "residual": 0.0021, "sigma": 0.0013,
        "weakest_sd": 0.0342, "angle": np.radians(37.2), "radius": np.array([0.222, 0.428]),
        "markers": ("LTIB", "LANK"), "shown": "weak", "reason": WHY,
    }  # fmt: skip
    return replace(joint("LeftKnee", se=0.0074), **(known | changes))


def cells(text, head):
    """Column → what stands under its name in a row, for columns of which no cell is longer than the name."""
    lines = text.splitlines()
    (start,) = (i for i, line in enumerate(lines) if line.startswith("joint"))
    at = lines[start].index(head)
    return lines[start + 1][at : at + len(head)].strip()


def test_a_narrow_table_has_the_joints_own_numbers_in_this_order():
    lines = joint_table(fit_of(a_knee()), "walk.c3d").splitlines()
    assert lines[0] == "walk.c3d: 5 frames at 100 Hz, marker noise 1.00 mm"
    assert re.split(" {2,}", lines[1]) == [
        "joint", "shown", "method", "motion %", "s.e. mm", "residual mm", "why",
    ]  # fmt: skip
    assert lines[2].split()[:6] == ["LeftKnee", "weak", "MGDK", "25", "7.4", "2.1"]
    assert lines[-1] == "1 of 1 joints fitted; shown: 0 yes, 1 weak, 0 no"


def test_a_long_reason_goes_on_under_its_own_column_and_nothing_is_lost():
    lines = joint_table(fit_of(a_knee()), "walk.c3d").splitlines()
    at = lines[1].index("why")
    assert len(lines) > 4 and max(map(len, lines)) <= WIDTH == 100
    assert " ".join(line[at:] for line in lines[2:-1]) == WHY
    assert {line[:at].strip() for line in lines[3:-1]} == {""}


def test_a_wide_table_has_all_columns_and_one_line_a_joint():
    text = joint_table(fit_of(a_knee()), "walk.c3d", wide=True)
    assert text.splitlines()[2].split("  ")[-1] == WHY
    for head, value in {
        "motion %": "25", "s.e. mm": "7.4", "residual mm": "2.1", "markers": "2", "samples": "400",
        "radius cm": "22.2/42.8", "sigma mm": "1.3", "weakest cm": "3.4", "theta": "37°",
    }.items():  # fmt: skip
        assert cells(text, head) == value, head


def test_what_is_not_there_is_a_dash_and_does_not_count_as_fitted():
    lost = unfitted("Neck", "Root", "Head", 5, "no marker on Head")
    nothing = a_knee(radius=np.empty(0), residual=np.nan, sigma=np.nan, shown="no", reason="")
    lines = joint_table(fit_of(lost, nothing), "c", wide=True).splitlines()
    assert lines[2].split() == ["Neck", *["-"] * 12, "no", "marker", "on", "Head"]
    assert lines[3].split() == [
        "LeftKnee", "no", "MGDK", "25", "7.4", "-", "2", "400", "-", "-", "3.4", "37°", "-",
    ]  # fmt: skip
    # A joint that was not fitted is none of the "no".
    assert lines[-1] == "1 of 2 joints fitted; shown: 0 yes, 0 weak, 1 no"


def test_the_subject_stands_in_the_first_line():
    fit = replace(fit_of(a_knee()), subject="Anna", sigma=0.00123)
    assert joint_table(fit, "c").startswith("c Anna: 5 frames at 100 Hz, marker noise 1.23 mm\n")


def test_a_joint_with_a_name_of_any_length_keeps_room_for_its_reason():
    text = table(("joint", "why"), [("J" * 95, "hardly moves at all here")], frozenset({0, 1}), 100)
    assert text.splitlines()[1:] == ["J" * 95 + "  hardly moves at all", " " * 97 + "here"]


def test_columns_of_numbers_end_and_columns_of_words_start_at_their_heads():
    rows = [("ab", "1"), ("c", "234")]
    assert table(("w", "n"), rows, frozenset({0})) == "w     n\nab    1\nc   234"


def test_a_sentence_is_broken_between_words_only_and_goes_on_indented():
    words = "To know more, film: " + "; ".join(["swing the right-hand leg in a circle"] * 5)
    lines = sentence(words).splitlines()
    assert len(lines) == 3 and max(map(len, lines)) <= WIDTH
    assert all(line.startswith("  ") and line[2] != " " for line in lines[1:])
    assert " ".join(line.strip() for line in lines) == words


def test_the_rows_of_a_study_have_four_digits_and_a_dash_for_none():
    rows = [
        {"joint": "Hip", "sd_x": 0.123456, "n": 12345},
        {"joint": "K", "sd_x": np.nan, "n": None},
    ]
    assert rows_table(rows) == "joint    sd x      n\nHip    0.1235  12345\nK           -      -"
    assert rows_table([]) == ""


@pytest.mark.parametrize("wide", [False, True])
def test_a_calibration_tells_how_much_each_clip_gave(wide):
    shares = {"hip.c3d": 0.614, "walk.c3d": 0.382, "still.c3d": 0.004}
    clips = [SimpleNamespace(clip=name, frames=100) for name in shares]
    done = SimpleNamespace(
        calibration=SimpleNamespace(clips=clips),
        joints=[SimpleNamespace(joint=a_knee(), shares=shares)],
    )
    lines = calibration_table(done, wide=wide).splitlines()
    assert lines[0] == (
        "3 clips of one actor: hip.c3d 100 frames, walk.c3d 100 frames, still.c3d 100 frames"
    )
    assert lines[1].split()[-1] == "from" and lines[2].endswith("  hip.c3d 61 %, walk.c3d 38 %")
    assert ("theta" in lines[1]) == wide

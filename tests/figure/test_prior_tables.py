"""Priors in a skeleton file: what a figure takes from another, and what is wrong in a table."""

import pytest

from mocap_skel.errors import SkeletonError
from mocap_skel.figure.own_names import in_own_names
from mocap_skel.figure.skeleton import read_skeleton

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
        (
            "prior = {sd = 0.1, shift = [{line = ['A', 'B'], by = 1}]}",
            "a prior starts at the mean of landmarks, or is one step along a hinge",
        ),
        (
            "prior = {mean = ['A'], sd = 0.1, shift = [{hinge = 1, by = 1, toward = ['B'], straight = ['A', 'B']}]}",
            "straight needs how far it may be off in radians",
        ),
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
                (
                    'hinge = 1, by = 0.1, toward = ["d"], plane = 1',
                    "plane: true or false is needed",
                ),
                ('line = ["a", "b"], plane = true', "plane is for a shift along a hinge"),
                ('hinge = 1, by = 0.1, toward = ["d"], hanging = ["a"]', "hanging is 2 landmarks"),
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


def test_a_figure_in_own_names_has_them_in_every_step_of_its_priors():
    """Each name that a step of a prior may hold is renamed, wherever it stands."""
    human = read_skeleton("human")
    names = {marker for segment in human.segments for marker in segment.markers}
    renamed = in_own_names(human, {name: f"my {name}" for name in names})
    for segment in renamed.segments:
        for prior in segment.priors:
            held = set(prior.mean)
            for shift in prior.shifts:
                held |= {
                    *shift.line,
                    *shift.across,
                    *shift.of,
                    *shift.toward,
                    *shift.upper,
                    *shift.straight,
                    *shift.hanging,
                }
            assert not held & names, segment.name

"""Skeleton files: what they may say, and what goes wrong where."""

import pytest

from mocap_skel.errors import SkeletonError
from mocap_skel.figure.prior_tables import Shift
from mocap_skel.figure.skeleton import (
    SHIPPED,
    read_skeleton,
    shipped_skeletons,
    shipped_with_root,
)

LEG = """name = "leg"   # a comment with "T1" and parent = "x"
[[segment]]
name = "Shank"
parent = "Thigh"
joint = "Knee"
markers = [
    "S1", # "S2" is below
    "S2",
]
ends = ["S2"]
prior = {mean = ["T3"], sd = 0.02, source = "me"}

[[segment]]
name = "Thigh"
markers = ["T1", "T2", "T3"]
"""


@pytest.mark.parametrize(
    ("old", "new", "place", "what", "hint"),
    [
        ('parent = "Thigh"', 'parent = "Tigh"', "4:10", "unknown 'Tigh'", "did you mean Thigh?"),
        ('ends = ["S2"]', 'ends = ["S1", "S3"]', "10:15", "'S3'", "did you mean S2 or S1?"),
        ("ends =", "end =", "10:1", "unknown key 'end'", "did you mean ends?"),
        ("sd = 0.02", "sx = 0.02", "11:25", "unknown key 'sx'", "did you mean sd?"),
        ("sd = 0.02", "sd = -1", "11:25", "sd is a length", None),
        ('"T2", "T3"', '"T2", "S2"', "15:24", "marker 'S2' stands in it 2 times", None),
        ('"T2", "T3"', '"T2", "T2"', "15:24", "marker 'T2' stands in it 2 times", None),
        ('name = "Thigh"', 'name = "Shank"', "14:8", "segment 'Shank'", None),
        ('name = "Thigh"\n', "", "13:1", "without a name", None),
        ('joint = "Knee"\n', "", "4:1", "belong together", None),
        ('joint = "Knee"', 'joint = "Thigh"', "5:9", "names a segment and a joint", None),
        ('parent = "Thigh"\njoint = "Knee"\n', "", "11:1", "exactly one root", None),
        ('["T1", "T2", "T3"]', '"T1"', "15:1", "a list of names", None),
        ('name = "leg"', 'nam = "leg"', "1:1", "unknown key 'nam'", "did you mean name?"),
        ("[[segment]]\nname = \"Sh", "[[segment\nname = \"Sh", "2:10", "]]", None),
        ('"T3"]\n', '"T3"', "15:28", "Unclosed array", None),
        ('parent = "Thigh"', '# parent = "Tigh"\nparent = "Tigh"', "5:10", "unknown 'Tigh'", "did you mean Thigh?"),
        ('name = "Thigh"', 'name = ""', "14:1", "a segment without a name", None),
        ('joint = "Knee"', 'joint = ""', "5:1", "a joint without a name", None),
        ('"T2", "T3"', '"T2", ""', "15:1", "markers: a list of names is needed, not ['T1', 'T2', '']", None),
        ('name = "Thigh"', 'name = "Thigh"\nparent = "Shank"\njoint = "Hip"', "2:1", "exactly one root", None),
        ('ends = ["S2"]', "looseness = 0", "10:1", "looseness is a number above 0, not 0", None),
        ('ends = ["S2"]', "rest = [0, 1]", "10:1", "rest: three numbers are needed", None),
        ('ends = ["S2"]', "rest = [0, true, 1]", "10:1", "three numbers are needed", None),
        ('ends = ["S2"]', "rest_joint = [0, nan, 1]", "10:1", "not [0, nan, 1]", None),
        ('ends = ["S2"]', 'rest = "up"', "10:1", "not 'up'", None),
        ('ends = ["S2"]', "rest_axis = [0, 0, 0]", "10:1", "rest_axis: a direction is needed", None),
        ('name = "Thigh"', 'name = "Thigh"\nrest_axis = [1, 0, 0]', "15:1", "the root has none", None),
        ('name = "Thigh"', 'name = "Thigh"\nrest_joint = [1, 0, 0]', "15:1", "the root has none", None),
    ],
)  # fmt: skip
def test_errors_in_a_skeleton_file_name_line_and_column(tmp_path, old, new, place, what, hint):
    path = tmp_path / "leg.toml"
    assert old in LEG
    path.write_text(LEG.replace(old, new))
    with pytest.raises(SkeletonError) as error:
        read_skeleton(path)
    assert error.value.message.startswith(f"{path}:{place}: ")
    assert what in error.value.message
    assert error.value.hint == hint


def test_tables_written_inline_are_read_and_their_errors_named(tmp_path):
    path = tmp_path / "leg.toml"
    path.write_text(
        'segment = [{name = "A", markers = ["a"]}, {name = "B", parent = "C", joint = "J"}]'
    )
    with pytest.raises(SkeletonError, match=r"leg\.toml:1:\d+: segment 'B' hangs from unknown 'C'"):
        read_skeleton(path)


def test_segments_that_hang_in_a_circle(tmp_path):
    path = tmp_path / "leg.toml"
    path.write_text(
        LEG + '[[segment]]\nname="A"\nparent="B"\njoint="x"\n'
        '[[segment]]\nname="B"\nparent="A"\njoint="y"\n'
    )
    with pytest.raises(SkeletonError, match="in a circle: A, B"):
        read_skeleton(path)


# what a file says


def test_the_standard_human_has_the_51_names_of_table_1():
    human = read_skeleton("human")
    assert len(human.segment_of) == 51
    assert (len(human.segments), len(human.joints), len(human.leaves)) == (15, 14, 5)
    assert human.segment_of["RFTShould"] == "Chest"
    assert human.segment_of["RPelvis"] == "Hips"


def test_a_skeleton_file_gives_any_tree_parents_first(tmp_path):
    (tmp_path / "leg.toml").write_text(LEG)
    leg = read_skeleton(tmp_path / "leg.toml")
    assert [s.name for s in leg.segments] == ["Thigh", "Shank"]
    assert (leg.joints, leg.root.name) == (("Knee",), "Thigh")
    assert [s.name for s in leg.leaves] == ["Shank"]
    assert leg["Shank"].ends == ("S2",)
    assert leg["Shank"].priors[0].sd == 0.02


def test_branches_stay_together_in_the_order_of_the_file(tmp_path):
    """Wherever in it the parents stand."""
    hung = {"Tip": "Arm", "Arm": "Body", "Toe": "Leg", "Leg": "Body", "Ear": "Body"}
    text = "".join(
        f'[[segment]]\nname = "{name}"\nparent = "{parent}"\njoint = "of {name}"\n'
        for name, parent in hung.items()
    )
    (tmp_path / "thing.toml").write_text(f'{text}[[segment]]\nname = "Body"\n')
    found = read_skeleton(tmp_path / "thing.toml")
    assert [s.name for s in found.segments] == ["Body", "Arm", "Tip", "Leg", "Toe", "Ear"]
    # Without a name of its own a figure is called as its file.
    assert found.name == "thing"


PRIOR = """
rest = [0.5, -1, 2]
rest_joint = [0, 0, 0]
rest_axis = [1, 2.5, 3]
looseness = 3
movement = "bend it"
[[segment.prior]]
mean = ["T1", "T2"]
sd = 0.015
source = "someone"
shift = [
    { line = ["T1", "T2"], ratio = 0.3, of = ["T2", "T3"], by = 0.01 },
    { across = ["T1", "T2", "T3", "T4"], ratio = 0.2 },
    { hinge = -1, by = 0.05, toward = ["S1"], beside = 0.04, upper = ["T3"], aside = 0.08 },
]
"""


def test_every_value_of_a_segment_is_kept_as_it_is_written(tmp_path):
    (tmp_path / "leg.toml").write_text(
        LEG.partition("prior =")[0] + PRIOR + LEG[LEG.rindex("[[") :]
    )
    shank = read_skeleton(tmp_path / "leg.toml")["Shank"]
    assert (shank.rest, shank.rest_joint, shank.rest_axis) == ((0.5, -1, 2), (0, 0, 0), (1, 2.5, 3))
    assert (shank.looseness, shank.movement) == (3, "bend it")
    (prior,) = shank.priors
    assert (prior.mean, prior.sd, prior.source) == (("T1", "T2"), 0.015, "someone")
    assert prior.shifts == (
        Shift(line=("T1", "T2"), ratio=0.3, of=("T2", "T3"), by=0.01),
        Shift(across=("T1", "T2", "T3", "T4"), ratio=0.2),
        Shift(hinge=-1, by=0.05, toward=("S1",), beside=0.04, upper=("T3",), aside=0.08),
    )


# the shipped ones


def test_a_shipped_skeleton_is_what_its_file_says():
    for name, figure in shipped_skeletons().items():
        assert read_skeleton(name) is figure
        assert read_skeleton(SHIPPED / f"{name}.toml") == figure


def test_a_file_beside_the_caller_comes_before_a_shipped_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "human").write_text(LEG)
    assert read_skeleton("human").name == "leg"


@pytest.mark.parametrize(
    ("seen", "names"),
    [
        (("Hips", "Chest"), ["human"]), (("Hips", "RightFoot"), ["human", "lower_body"]),
        (("RightFoot", "UpperRightLeg"), ["right_leg"]), (("Head",), ["head"]), (("RightFoot",), []),
    ],
)  # fmt: skip
def test_the_figures_that_start_at_what_is_seen_and_have_most_of_it(seen, names):
    assert shipped_with_root(seen) == names

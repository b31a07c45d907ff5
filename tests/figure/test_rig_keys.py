"""What a skeleton file says for a rigid figure: the freedom of a joint, and the markers of a sole."""

import pytest

from mocap_skel.errors import SkeletonError
from mocap_skel.figure.skeleton import read_skeleton

LEG = """name = "leg"
[[segment]]
name = "Thigh"
markers = ["T1", "T2", "T3"]
[[segment]]
name = "Shank"
parent = "Thigh"
joint = "Knee"
markers = ["S1", "HEE"]
"""


def leg(tmp_path, *lines):
    path = tmp_path / "leg.toml"
    path.write_text(LEG + "\n".join(lines) + "\n")
    return path


def test_a_joint_is_a_ball_and_nothing_stands_unless_it_is_said(tmp_path):
    shank = read_skeleton(leg(tmp_path))["Shank"]
    assert (shank.freedom, shank.sole) == ("ball", ())
    shank = read_skeleton(leg(tmp_path, 'freedom = "hinge"', 'sole = ["HEE"]'))["Shank"]
    assert (shank.freedom, shank.sole) == ("hinge", ("HEE",))


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (
            'freedom = "screw"',
            "leg.toml:10:.*freedom is one of ball, hinge, universal, not 'screw'",
        ),
        ('sole = ["TOE"]', "leg.toml:10:.*sole 'TOE' of 'Shank' is not one of its markers"),
        ("sole = 3", "leg.toml:10:.*sole: a list of names is needed"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(tmp_path, line, said):
    with pytest.raises(SkeletonError, match=said):
        read_skeleton(leg(tmp_path, line))


@pytest.mark.parametrize("name", ["human", "lower_body", "right_leg", "left_leg"])
def test_knees_of_the_shipped_figures_are_hinges_and_their_feet_stand(name):
    figure = read_skeleton(name)
    hinges = {s.joint for s in figure.segments if s.freedom == "hinge"}
    assert hinges == {j for j in figure.joints if j.endswith("Knee")}
    soles = [s for s in figure.segments if s.sole]
    assert [s.name for s in soles] == [s.name for s in figure.segments if s.name.endswith("Foot")]

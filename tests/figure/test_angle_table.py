"""The table of angles is about the standard human, and left is the mirror image of right."""

import pytest

from mocap_skel.figure.angle_table import angle_table
from mocap_skel.figure.skeleton import read_skeleton

TABLE, HUMAN = angle_table(), read_skeleton("human")
SEGMENTS = {segment.name for segment in HUMAN.segments}


def test_every_segment_has_axes_and_every_joint_has_angles():
    assert set(TABLE.frames) == SEGMENTS
    names = [rule.name for rule in TABLE.angles]
    assert set(HUMAN.joints) <= set(names) and len(set(names)) == len(names)
    titles = [title for rule in TABLE.angles for title in rule.titles]
    assert len(set(titles)) == 3 * len(names)


def test_angles_are_those_of_the_joint_between_their_segments():
    for rule in TABLE.angles:
        if rule.parent:
            segment = HUMAN[rule.child]
            assert (segment.joint, segment.parent) == (rule.name, rule.parent)
        else:
            assert rule.name == rule.child


@pytest.mark.parametrize("name", sorted(SEGMENTS))
def test_a_way_is_about_two_axes_and_places_that_the_figure_knows(name):
    for way in TABLE.frames[name].ways:
        assert {way.axis, way.other} < {"x", "y", "z"} and way.axis != way.other
        for place in (*way.names, *([way.hinge] if way.hinge else [])):
            assert place in HUMAN.joints or place in HUMAN.landmarks, place
        assert bool(way.beside) + bool(way.hinge) + bool(way.bend) == 1


def test_every_landmark_of_the_figure_is_of_markers_on_one_segment():
    for name, sets in HUMAN.landmarks.items():
        owners = {HUMAN.segment_of.get(marker) for markers in sets for marker in markers}
        assert len(owners - {None}) <= 1, name


def test_the_left_side_is_the_right_one_with_sideways_lines_turned_round():
    for name in SEGMENTS:
        if "Right" in name:
            left = TABLE.frames[name.replace("Right", "Left")]
            for here, there in zip(TABLE.frames[name].ways, left.ways, strict=True):
                swap = [n.replace("Right", "Left") for n in here.names]
                assert sorted(swap) == sorted(there.names)
                if here.beside and here.other == "z":
                    assert there.beside
                    starts = tuple(n.replace("Right", "Left") for n in here.beside.start)
                    assert there.beside.end == starts
    for rule in TABLE.angles:
        assert rule.mirrored == rule.name.startswith("Left")

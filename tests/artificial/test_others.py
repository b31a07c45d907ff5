"""Figures from skeleton files: they stand on the floor, both sides alike, markers on their segments."""

from itertools import combinations

import numpy as np
import pytest

from mocap_skel import artificial as art
from mocap_skel import read_skeleton
from mocap_skel.figure.skeleton import SHIPPED

NAMES = sorted(path.stem for path in SHIPPED.glob("*.toml"))


@pytest.mark.parametrize("name", NAMES)
def test_a_figure_of_a_file_has_its_tree_and_stands_on_the_floor(name):
    skeleton = read_skeleton(name)
    figure = art.figure_of(skeleton)
    assert [(s.name, s.parent, s.joint or None) for s in figure.segments] == [
        (s.name, s.parent, s.joint or None) for s in skeleton.segments
    ]
    poses = figure.poses(art.Motion(1.0, np.zeros((1, 3)), {}))
    heights = [poses[s.name].origin[0, 2] for s in figure.segments[1:] or figure.segments]
    heights += [poses[leaf.name].place(figure.bones[leaf.name])[0, 2] for leaf in skeleton.leaves]
    assert min(heights) == pytest.approx(0.0, abs=1e-12)
    # No joint lies on another: siblings are apart, and bones have a length.
    places = [poses[s.name].origin[0] for s in figure.segments[1:]]
    assert all(np.linalg.norm(a - b) > 0.01 for a, b in combinations(places, 2))


@pytest.mark.parametrize("name", NAMES)
def test_every_marker_of_a_file_sits_on_its_segment_near_its_bone(name):
    skeleton = read_skeleton(name)
    figure = art.figure_of(skeleton)
    markers = art.markers_of(skeleton, figure)
    owner = {marker: s.name for s in skeleton.segments for marker in s.markers}
    assert {marker: segment for marker, (segment, _) in markers.items()} == owner
    for segment, place in markers.values():
        bone = np.linalg.norm(figure.bones[segment])
        assert 0 < np.linalg.norm(place) <= 1.3 * max(bone, 0.25)


def test_ranges_of_the_right_are_those_of_the_left_mirrored():
    ranges = art.ranges_of(read_skeleton("human"))
    for left in (name for name in ranges if "Left" in name):
        x, y, z = ranges[left]
        right = ranges[left.replace("Left", "Right")]
        assert right == ((-x[1], -x[0]), y, (-z[1], -z[0]))
    assert ranges["UpperLeftArm"] == ((8, 105), (-95, 30), (-40, 40))


def test_what_a_file_invents_hangs_by_rule(tmp_path):
    """An only child straight down; three on a cone of half the length to the side, 120 degrees apart."""
    lines = ['name = "thing"']
    for name, parent in (("Body", ""), ("A", "Body"), ("B", "Body"), ("C", "Body"), ("D", "A")):
        tree = f'parent = "{parent}"\njoint = "J{name}"\n' if parent else ""
        names = ", ".join(f'"{name}{i}"' for i in range(3))
        lines.append(f'[[segment]]\nname = "{name}"\n{tree}markers = [{names}]')
    (tmp_path / "thing.toml").write_text("\n".join(lines))
    figure = art.figure_of(read_skeleton(str(tmp_path / "thing.toml")))
    offsets = {joint: np.array(segment.offset) for joint, segment in figure.joints.items()}
    np.testing.assert_allclose(offsets["JD"], [0, 0, -0.3 * 0.85], atol=1e-12)
    cone = np.array([offsets[f"J{name}"] for name in "ABC"])
    np.testing.assert_allclose(cone[:, 2], -0.85 * 0.3, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(cone[:, :2], axis=1), 0.15, atol=1e-12)
    np.testing.assert_allclose(cone[:, :2].sum(axis=0), 0.0, atol=1e-12)

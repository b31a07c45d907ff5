"""What is drawn, line by line: pictures of fits made by hand."""

from dataclasses import replace

import numpy as np
import pytest
from actors import actor
from handmade import FRAMES, fit_of, joint, leg
from matplotlib.colors import same_color

from mocap_skel.report.looks import LOOKS
from mocap_skel.report.pose_figures import Actor, pose_figure
from mocap_skel.report.time_figures import (
    _line,
    bones_figure,
    limits,
    residuals_figure,
    tracks_figure,
)
from mocap_skel.segments.pose import Pose

SIDES = ("Right", "Left")


def hips(**changes):
    """Right and left hip, 30 cm apart along x, the right one nearer to where x points."""
    return tuple(
        replace(joint(f"{s}Hip", at=(x, 0.0, 1.0)), **changes)
        for s, x in zip(SIDES, (0.15, -0.15), strict=True)
    )


def actor_of(*joints, height=0.1, **more):
    """A figure with one marker, so high above the lab's zero in every frame."""
    marker = np.tile([0.0, 0.0, height], (FRAMES, 1))
    segments = [j.child for j in joints]
    return Actor(fit_of(*joints, segments=segments), {"Root": {"A": marker}, **more})


def balls(axes):
    """The marks of joints: those in the colour of a verdict."""
    colours = [look.colour for look in LOOKS.values()]
    return [
        line
        for line in axes.lines
        if line.get_linestyle() == "None" and line.get_color() in colours
    ]


class TestPose:
    @pytest.mark.parametrize("shown", ["yes", "weak", "no"])
    def test_a_joint_and_the_legend_have_the_look_of_the_verdict(self, shown):
        drawn, _ = pose_figure([actor_of(*hips(shown=shown))], [0], "front", "")
        look = LOOKS[shown]
        (legend,) = drawn.legends
        names = [text.get_text() for text in legend.get_texts()]
        assert names[0] == f"joint, shown: {shown}"
        for ball in (*balls(drawn.axes[0]), legend.legend_handles[0]):
            assert same_color(ball.get_color(), look.colour) and ball.get_marker() == look.mark
            face = ball.get_markerfacecolor()
            assert same_color(face, look.colour if look.filled else "white")

    def test_what_is_nearer_to_the_viewer_is_drawn_later(self):
        # From the right side the right hip hides the left one.
        drawn, _ = pose_figure([actor_of(*hips())], [0], "side", "")
        right, left = balls(drawn.axes[0])
        assert right.get_zorder() > left.get_zorder()
        # Its ellipse is below its ball, and above what is behind.
        ellipses = [p for p in drawn.axes[0].patches if type(p).__name__ == "Ellipse"]
        assert right.get_zorder() > max(e.get_zorder() for e in ellipses)

    @pytest.mark.parametrize(
        ("height", "floor"), [(0.1, 0.0), (-0.05, 0.0), (0.9, 0.9), (-0.5, -0.5)]
    )
    def test_the_floor_is_the_labs_zero_where_the_lowest_marker_comes_near_it(self, height, floor):
        drawn, caption = pose_figure([actor_of(*hips(), height=height)], [0], "front", "")
        (grid,) = (c for c in drawn.axes[0].collections if type(c).__name__ == "LineCollection")
        # In the front view heights stay heights.
        assert {round(float(y), 9) for line in grid.get_segments() for y in line[:, 1]} == {floor}
        assert ("the lab's floor" if floor == 0.0 else "the lowest marker's height") in caption

    def test_an_ellipse_is_cut_where_its_longest_axis_is_too_long(self):
        long = hips(covariance=np.diag([0.3, 0.001, 0.001]) ** 2)
        drawn, caption = pose_figure([actor_of(*long)], [0], "front", "")
        assert "dashed: cut at" in caption and "(RightHip, LeftHip)" in caption
        short = hips(covariance=np.diag([0.003, 0.001, 0.001]) ** 2)
        drawn, caption = pose_figure([actor_of(*short)], [0], "front", "")
        assert "dashed" not in caption
        wide = [p.width for p in drawn.axes[0].patches if type(p).__name__ == "Ellipse"]
        assert wide == pytest.approx([2 * 2 * 0.003] * 4)

    def test_a_plate_does_not_cross_itself_and_its_bones_are_its_edges(self):
        one = actor()
        drawn, _ = pose_figure([one], [0], "front", "")
        plates = [p.get_xy()[:-1] for p in drawn.axes[0].patches if type(p).__name__ == "Polygon"]
        assert sorted(map(len, plates)) == [3, 4]
        bones = [
            line.get_xydata() for line in drawn.axes[0].lines if len(line.get_path_effects()) == 2
        ]
        for plate in plates:
            # Corners that turn the same way all around: no two edges cross.
            edges = np.roll(plate, -1, axis=0) - plate
            after = np.roll(edges, -1, axis=0)
            turns = edges[:, 0] * after[:, 1] - edges[:, 1] * after[:, 0]
            assert len({*np.sign(turns)}) == 1
            for start, stop in zip(plate, np.roll(plate, -1, axis=0), strict=True):
                ends = np.array([[start, stop], [stop, start]])
                assert any(np.allclose(bone, e) for bone in bones for e in ends)


class TestOverTime:
    def test_a_track_that_the_movement_does_not_show_is_dotted(self):
        right, left = hips()
        drawn, caption = tracks_figure(actor_of(right, replace(left, shown="no")), "")
        for axes in drawn.axes:
            assert [line.get_linestyle() for line in axes.lines] == ["-", ":"]
        assert drawn.axes[0].get_ylabel() == "Hip\n(R yes, L no)"
        assert "does the movement show the joint" in caption
        assert "shown: no" in drawn.legends[0].get_texts()[-1].get_text()

    def test_x_y_and_z_stand_side_by_side(self):
        right, left = hips()
        drawn, _ = tracks_figure(actor_of(right, left), "")
        for axes, value in zip(drawn.axes, right.centre, strict=True):
            np.testing.assert_array_equal(axes.lines[0].get_ydata(), [value] * FRAMES)
        assert [axes.get_title() for axes in drawn.axes] == ["x, m", "y, m", "z (up), m"]

    def test_a_bone_is_in_centimetres_with_its_median_and_standard_deviation(self):
        right, left = leg("Right", 0.40), leg("Left", 0.0)
        below = np.zeros((FRAMES, 3))
        below[:, 2] = 0.40, 0.42, 0.46, np.nan, 0.42
        left = (left[0], replace(left[1], track=left[0].track - below))
        drawn, _ = bones_figure(actor_of(*right, *left), "")
        (axes,) = (a for a in drawn.axes if a.get_title() == "Knee - Ankle")
        # As in test_rows.py: median 42, standard deviation 2.18 cm.
        told = [text.get_text() for text in axes.get_legend().get_texts()]
        assert told == ["R 40.0 ± 0.0", "L 42.0 ± 2.2"]
        # The last length is a dot, for it stands alone after a gap.
        _, _, lengths, _, median = axes.lines
        np.testing.assert_allclose(lengths.get_ydata(), [40, 42, 46, np.nan, 42])
        assert (
            median.get_ydata()[0] == pytest.approx(42.0)
            and median.get_color() == lengths.get_color()
        )

    def test_a_sample_between_two_gaps_is_a_dot_and_no_other_is(self):
        axes = tracks_figure(actor_of(*hips()), "")[0].axes[0]
        before = len(axes.lines)
        values = np.array([np.nan, 1.0, np.nan, 2.0, 3.0])
        _line(axes, np.arange(5.0), values, "black", False)
        line, dots = axes.lines[before:]
        np.testing.assert_array_equal(line.get_ydata(), values)
        np.testing.assert_array_equal(dots.get_xydata(), [[1.0, 1.0]])

    @pytest.mark.parametrize("outlier", [-50.0, 50.0])
    def test_values_outside_of_an_axis_are_said_to_be_there(self, outlier):
        axes = tracks_figure(actor_of(*hips()), "")[0].axes[0]
        values = np.concatenate([np.linspace(0.0, 1.0, 999), [outlier]])
        assert limits(axes, values, 0.1, 0.002) is True
        # 0.58 of what lies between the quantiles to either side of its middle.
        assert axes.get_ylim() == pytest.approx((-0.08, 1.08), abs=0.005)
        assert limits(axes, values, 0.1, 0.0) is False
        assert limits(axes, np.array([0.2, np.nan]), 0.1, 0.0) is False
        assert axes.get_ylim() == pytest.approx((0.142, 0.258))

    def test_the_right_joint_stands_left_of_the_left_one_with_lines_at_its_noise(self):
        markers = {j.child: {"M": j.track + [0.0, 0.0, 0.4]} for j in hips()}
        both = [replace(j, markers=("M",), sigma=0.0015, residual=0.002) for j in hips()]
        for joints in (both, both[::-1]):
            drawn, _ = residuals_figure(actor_of(*joints, **markers), "")
            titles = [axes.get_title() for axes in drawn.axes if axes.get_title()]
            assert [title.split()[0] for title in titles] == ["RightHip", "LeftHip"]
            assert titles[0].endswith("(yes): rms 2.0 mm, σ 1.5 mm")
            lines = [float(line.get_ydata()[0]) for line in drawn.axes[0].lines[1:]]
            assert lines == [-1.5, 1.5]

    def test_residuals_are_those_along_time_of_each_marker(self):
        (right, left) = (replace(j, markers=("M",), sigma=0.001) for j in hips())
        away = np.array([0.40, 0.41, 0.39, 0.40, 0.40])
        markers = {j.child: {"M": j.track + np.outer(away, [0.0, 0.0, 1.0])} for j in hips()}
        drawn, _ = residuals_figure(actor_of(right, left, **markers), "")
        np.testing.assert_allclose(
            drawn.axes[0].lines[0].get_ydata(), [0, 10, -10, 0, 0], atol=1e-9
        )


def test_a_turned_parent_turns_the_ellipse_of_its_joint():
    """A quarter turn about the line of sight exchanges the picture's right and up."""
    right, left = hips(covariance=np.diag([0.004, 0.001, 0.002]) ** 2)
    one = actor_of(right, left)
    quarter = np.tile([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]], (FRAMES, 1, 1))
    pose = Pose(quarter, np.zeros((FRAMES, 3)))
    root = replace(one.fit.segments["Root"], pose=pose)
    turned = replace(one, fit=replace(one.fit, segments={**one.fit.segments, "Root": root}))
    for who, upright in ((one, False), (turned, True)):
        drawn, _ = pose_figure([who], [0], "front", "")
        first = next(p for p in drawn.axes[0].patches if type(p).__name__ == "Ellipse")
        assert first.width == pytest.approx(2 * 2 * 0.004) and first.height == pytest.approx(0.008)
        assert abs(np.cos(np.radians(first.angle))) == pytest.approx(
            0.0 if upright else 1.0, abs=1e-9
        )

"""Where a figure is looked at from: the figure's own front, the same for the page and for pictures."""

from dataclasses import replace

import numpy as np
import pytest
from actors import actor, actor_of, film
from handmade import fit_of, joint
from recordings import clip_of

from mocap_skel.clip import AXES, turn_between
from mocap_skel.report.view import VIEWS, first_front, right_of, view_of


@pytest.mark.parametrize("name", VIEWS)
def test_a_view_is_a_right_handed_turn(name):
    axes = view_of(name, [actor().fit], [0]).axes
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)


def test_front_has_the_figures_right_on_the_left_and_its_head_above():
    tracks = dict(actor().fit.tracks())
    view = view_of("front", [actor().fit], [0])
    right, left = (view.project(tracks[f"{s}Hip"][0]) for s in ("Right", "Left"))
    assert right[0] < left[0]
    assert view.project(tracks["Neck"][0])[1] > right[1]
    # The side view is from the right, facing right: the right hip is the nearer one.
    beside = view_of("side", [actor().fit], [0])
    near, far = (beside.depth(tracks[f"{s}Hip"][0]) for s in ("Right", "Left"))
    assert near > far


def test_an_ellipsoids_outline_is_the_farthest_that_it_reaches():
    view = view_of("oblique", [actor().fit], [0])
    rng = np.random.default_rng(5)
    root = rng.standard_normal((3, 3))
    (long, short), angle = view.ellipse(root @ root.T)
    ball = rng.standard_normal((20000, 3))
    flat = view.project((ball / np.linalg.norm(ball, axis=1)[:, None]) @ root.T)
    along = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    # 20000 points leave no hole of more than a few degrees: 1 - cos(3°) is 0.14 %.
    assert np.abs(flat @ along).max() == pytest.approx(long, rel=2e-3)
    assert np.abs(flat @ [-along[1], along[0]]).max() == pytest.approx(short, rel=2e-3)


# --- which way a figure faces


def from_above(degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def facing(clip, frame):
    """(3,) from the markers at the back of the waist to those in front, level with the floor."""
    places = {label: clip.points[frame, i] for i, label in enumerate(clip.labels)}
    ahead = places["LFWT"] + places["RFWT"] - places["LBWT"] - places["RBWT"]
    ahead[AXES.index(clip.up)] = 0.0
    return ahead / np.linalg.norm(ahead)


@pytest.mark.parametrize(("degrees", "up"), [(0, "z"), (130, "z"), (250, "y")])
def test_the_front_is_where_the_face_is(degrees, up):
    clip = clip_of(film())
    axes = turn_between("z", up) @ from_above(degrees)
    clip = replace(clip, points=clip.points @ axes.T, up=up)
    fit = actor_of(clip).fit
    # Markers stand a centimetre or so beside where they belong: on 20 cm of a waist 0.98 is 11 degrees.
    assert first_front(fit) @ facing(clip, 0) > 0.98
    for frame in (0, 300):
        view = view_of("front", [fit], [frame])
        assert view.own and view.axes[2] @ facing(clip, frame) > 0.98
    # A picture of the first frame and the page look at it from the same side.
    np.testing.assert_allclose(first_front(fit), view_of("front", [fit], [0]).axes[2], atol=1e-12)


def hips(*across, up="z"):
    """A fit whose right hip is so far from the left one, frame by frame; NaN = the right one is not seen."""
    across = np.array(across, dtype=float)
    left = joint("LeftHip", at=(1.0, 2.0, 3.0))
    left = replace(left, track=np.tile([1.0, 2.0, 3.0], (len(across), 1)))
    right = replace(joint("RightHip"), track=left.track + across)
    frames = np.arange(1, len(across) + 1)
    return replace(fit_of(right, left), frame_numbers=frames, up=up)


NOT_SEEN = (np.nan, np.nan, np.nan)


def test_the_right_is_the_hips_line_level_with_the_floor_and_of_length_one():
    fit = hips((0.3, 0.0, 0.1), NOT_SEEN, (0.0, -0.2, 0.0), (0.01, 0.0, 0.3))
    # The last one lies on the side: its line of hips is nearly upright and tells no front.
    np.testing.assert_allclose(
        right_of(fit), [[1, 0, 0], NOT_SEEN, [0, -1, 0], NOT_SEEN], atol=1e-12
    )
    # Right along x and up along z: the front is y.
    np.testing.assert_allclose(first_front(fit), [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(
        first_front(hips(NOT_SEEN, (0, 0, 2), up="y")), [1, 0, 0], atol=1e-12
    )


def test_where_the_hips_are_not_seen_the_next_pair_tells_the_right():
    fit = hips(NOT_SEEN, (0.3, 0.0, 0.0))
    here = (replace(joint(f"{s}Knee", parent="LeftHipPart"), track=np.tile([0.0, y, 0.0], (2, 1)))
            for s, y in (("Left", 0.2), ("Right", -0.2)))  # fmt: skip
    # Hips come first, whatever the order of the joints.
    fit = replace(fit, joints=(*here, *fit.joints))
    np.testing.assert_allclose(right_of(fit), [[0, -1, 0], [1, 0, 0]], atol=1e-12)


def test_figures_that_look_in_all_directions_are_seen_as_the_first_one_is():
    around = [hips((np.cos(a), np.sin(a), 0.0)) for a in np.radians([20, 140, 260])]
    view = view_of("side", around, [0])
    np.testing.assert_allclose(view.axes[2], [np.cos(np.radians(20)), np.sin(np.radians(20)), 0])
    # Two that look nearly the same way are seen from between.
    view = view_of("side", [hips((1, 0, 0)), hips((0, 1, 0))], [0])
    np.testing.assert_allclose(view.axes[2], [0.5**0.5, 0.5**0.5, 0])


def test_a_figure_without_two_sides_is_seen_along_the_labs_axes():
    fit = fit_of(joint("Neck"))
    view = view_of("front", [fit], [0])
    assert not view.own
    np.testing.assert_array_equal(view.axes[2], [0, 1, 0])
    np.testing.assert_array_equal(first_front(fit), [0, 1, 0])


def test_the_oblique_view_is_from_the_front_right_and_a_little_above():
    axes = view_of("oblique", [hips((1, 0, 0))], [0]).axes
    # 35 degrees to the right of y, 15 degrees up.
    towards = [np.cos(np.radians(15)) * np.sin(np.radians(35)),
               np.cos(np.radians(15)) * np.cos(np.radians(35)), np.sin(np.radians(15))]  # fmt: skip
    np.testing.assert_allclose(axes[2], towards, atol=1e-12)
    assert axes[1] @ [0, 0, 1] == pytest.approx(np.cos(np.radians(15)))
    np.testing.assert_allclose(view_of("top", [hips((1, 0, 0))], [0]).axes, np.eye(3), atol=1e-12)

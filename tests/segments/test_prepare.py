"""A clip's markers made ready: what is left out, what is counted, what is found. On boxes that turn."""

import numpy as np
import pytest
from poses import rotations

from mocap_skel.clip import Clip
from mocap_skel.segments.prepare import prepare

PLACES = {
    "A": (0.0, 0.0, 0.0), "B": (0.3, 0.0, 0.0), "C": (0.0, 0.2, 0.0), "D": (0.0, 0.0, 0.1),
    "E": (1.0, 0.0, 0.0), "F": (1.0, 0.4, 0.0),
}  # fmt: skip
# Not in the clip's order: the points have to follow the figure's.
BOX, STICK = {"D": 3, "A": 0, "C": 2, "B": 1}, {"F": 5, "E": 4}
FRAMES = 400


@pytest.fixture
def points():
    """(frames, 6, 3): all in one slow turn, noise of 0.1 mm."""
    rng = np.random.default_rng(3)
    angle = np.linspace(0.0, 2.0, FRAMES)
    cos, sin, zero = np.cos(angle), np.sin(angle), 0.0 * angle
    turn = np.array([[cos, -sin, zero], [sin, cos, zero], [zero, zero, zero + 1.0]])
    clean = np.einsum("ijf,mj->fmi", turn, np.array(list(PLACES.values())))
    return clean + 1e-4 * rng.normal(size=clean.shape)


def clip_of(points):
    return Clip(
        "box", points, tuple(PLACES), ("",) * len(PLACES), 100.0, 1, "m", "z", {}, ()
    )  # fmt: skip


def prepared(points, **options):
    return prepare(clip_of(points), {"Box": BOX, "Stick": STICK}, **options)


def test_points_stand_in_the_order_of_the_segments_own_markers(points):
    found = prepared(points)
    assert found.markers("Box") == ("D", "A", "C", "B")
    for segment, columns in (("Box", BOX), ("Stick", STICK)):
        np.testing.assert_array_equal(found.of(segment), points[:, list(columns.values())])
    for marker, column in {**BOX, **STICK}.items():
        np.testing.assert_array_equal(found.track(marker), points[:, column])
    assert found.track("G") is None


def test_distances_are_those_of_the_figure(points):
    found = prepared(points)
    # Noise of 0.1 mm in both ends; a median of 400.
    for a, b in (("A", "B"), ("B", "C"), ("D", "F")):
        assert found.distance(a, b) == pytest.approx(
            np.linalg.norm(np.subtract(PLACES[a], PLACES[b])), abs=1e-4
        )
    points[:200, 0] = np.nan
    points[200:, 1] = np.nan
    assert prepared(points).distance("A", "B") is None
    assert prepared(points).distance("A", "G") is None


def test_a_marker_that_left_is_missing_there_and_counted(points):
    points[100:110, 1] += [0.2, 0.1, 0.0]
    points[300, 4] = np.nan
    before = points.copy()
    found = prepared(points)
    expected = np.zeros((FRAMES, 4), dtype=bool)
    expected[100:110, 3] = True
    assert set(found.masks) == {"Box"}
    np.testing.assert_array_equal(found.masks["Box"], expected)
    np.testing.assert_array_equal(np.isnan(found.of("Box")).all(axis=2), expected)
    # A jump is a sample that was seen, a gap is not.
    assert found.samples == 6 * FRAMES - 1
    assert found.frames == FRAMES
    np.testing.assert_array_equal(points, before)


def test_two_markers_are_searched_too(points):
    points[200:220, 4] += [0.3, 0.0, 0.0]
    expected = np.zeros((FRAMES, 2), dtype=bool)
    expected[200:220, 1] = True
    np.testing.assert_array_equal(prepared(points).masks["Stick"], expected)


def test_the_shape_and_the_noise_are_those_without_what_was_left_out(points):
    jumped = points.copy()
    jumped[100:160, 1] += [0.2, 0.1, 0.0]
    clean, found, unsearched = (
        prepared(points), prepared(jumped), prepared(jumped, search=False),
    )  # fmt: skip
    # 15 % of one marker's samples are less: the level of 0.1 mm is known to 1/√(2 · 6 · 340), 2 %.
    assert found.sigma == pytest.approx(clean.sigma, rel=0.1)
    assert clean.sigma == pytest.approx(1e-4, rel=0.1)
    assert unsearched.masks == {}
    np.testing.assert_array_equal(unsearched.of("Box")[:, 3], jumped[:, 1])
    assert set(found.shapes) == {"Box"}
    at = found.shapes["Box"][0].template
    away = np.linalg.norm(at[:, None] - at[None], axis=2)
    want = np.array([PLACES[m] for m in BOX])
    np.testing.assert_allclose(away, np.linalg.norm(want[:, None] - want, axis=2), atol=1e-4)


def test_markers_that_no_frame_shows_are_lost_and_no_part_of_the_segment(points):
    points[:, [2, 4, 5]] = np.nan
    found = prepared(points)
    assert found.lost == {"Box": ("C",), "Stick": ("F", "E")}
    assert found.markers("Box") == ("D", "A", "B")
    assert found.markers("Stick") == ()
    assert found.of("Stick").shape == (FRAMES, 0, 3)
    assert found.of("Hat").shape == (FRAMES, 0, 3)
    assert found.markers("Hat") == ()


def test_more_samples_can_be_left_out_and_the_rest_stays_as_it_is(points):
    points[100:110, 1] += [0.2, 0.1, 0.0]
    first = prepared(points)
    more = np.zeros((FRAMES, 4), dtype=bool)
    more[105:120, 0] = True
    found = first.without("Box", more)
    np.testing.assert_array_equal(found.masks["Box"], first.masks["Box"] | more)
    np.testing.assert_array_equal(np.isnan(found.of("Box")[..., 0]), found.masks["Box"])
    assert not np.isnan(first.of("Box")[110:120, 0]).any()
    assert found.of("Stick") is first.of("Stick")
    assert found.samples == first.samples
    assert first.without("Box", None) is first
    other = first.without("Stick", more[:, :2])
    np.testing.assert_array_equal(other.masks["Stick"], more[:, :2])
    np.testing.assert_array_equal(other.masks["Box"], first.masks["Box"])


def test_a_noise_that_is_given_is_taken(points):
    assert prepared(points, sigma=0.004).sigma == 0.004
    assert prepared(points, noise="matrix").noise.matrix.shape == (3, 3)
    turn = rotations(np.random.default_rng(1), 1)[0]
    matrix = turn @ np.diag([1e-6, 4e-6, 9e-6]) @ turn.T
    assert prepared(points, sigma=matrix).sigma == pytest.approx(np.sqrt(14e-6 / 3))

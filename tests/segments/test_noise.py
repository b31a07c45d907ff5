"""The noise of a clip's markers: a level from the rigidity of the segments, a whole matrix from the same.

Tolerances. The matrix of F frames with M markers rests on F (M - 2) free samples of the noise, a pose
takes those of two; such a covariance is off by √((tr² Σ + tr Σ²) / (F (M - 2))) in Frobenius' norm
(Wishart), `wishart` below. Unfolding what the pose took costs a little more: `UNFOLDED`. Monte-Carlo means get
four standard errors.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mocap_skel.segments.noise import NOISES, ClipNoise, clip_noise, rigid_noise_matrix
from mocap_skel.segments.pose import Pose
from mocap_skel.segments.shape import find_shape

EPS = np.finfo(float).eps
LAWS = settings(derandomize=True, deadline=None, max_examples=15, database=None)
# Of these templates the pose takes up to 2.5 times more of some noise than of other; weights that differ
# by κ cost (1 + κ)²/4κ in the variance (Kantorovich), 1.1 in the root for 2.5.
UNFOLDED = 1.1
SPREAD = (0.001, 0.001, 0.003)


def wishart(covariance, frames, markers):
    """Relative error of a covariance from its free samples, Frobenius."""
    square = np.trace(covariance) ** 2 + np.trace(covariance @ covariance)
    return np.sqrt(square / (frames * (markers - 2))) / np.linalg.norm(covariance)


def skewed(seed=1, spread=SPREAD):
    """A noise covariance along no axis of the lab."""
    turn = Rotation.random(random_state=seed).as_matrix()
    return turn @ np.diag(np.square(spread)) @ turn.T


def turns(rng, frames, how="any"):
    """Rotations (frames, 3, 3) of a segment: any, about one axis, or none."""
    if how == "any":
        return Rotation.random(frames, random_state=rng).as_matrix()
    angles = np.linspace(0.0, 6.0 if how == "one axis" else 0.0, frames)
    return Rotation.from_rotvec(angles[:, None] * [0.0, 0.6, 0.8]).as_matrix()


def film(rng, template, rotations, covariance):
    """Markers (frames, M, 3) of a rigid segment, with noise."""
    points = np.einsum("fij,mj->fmi", rotations, template)
    root = np.linalg.cholesky(covariance)
    return points + rng.normal(size=points.shape) @ root.T


def swap(rng, points, share):
    """The first two markers change places in a share of the frames."""
    bad = rng.choice(len(points), round(share * len(points)), replace=False)
    points[bad[:, None], [[0, 1]]] = points[bad[:, None], [[1, 0]]]


def estimated(points):
    return rigid_noise_matrix(points, *find_shape(points))


def relative(found, covariance):
    return np.linalg.norm(found - covariance, axis=(-2, -1)) / np.linalg.norm(covariance)


class TestRigidMatrix:
    @pytest.mark.parametrize("swapped", [0.0, 0.02])
    @pytest.mark.parametrize("markers", [4, 5, 8])
    def test_a_turning_segment_shows_the_whole_matrix(self, markers, swapped):
        rng = np.random.default_rng(markers)
        covariance, trials, frames = skewed(), 25, 400
        found = []
        for _ in range(trials):
            template = 0.1 * rng.normal(size=(markers, 3))
            points = film(rng, template, turns(rng, frames), covariance)
            swap(rng, points, swapped)
            found.append(estimated(points))
        law = wishart(covariance, frames, markers)
        error = np.sqrt((relative(np.array(found), covariance) ** 2).mean())
        # Two of the six numbers carry nearly all of the error: of 2 × 25 squares a root mean square
        # varies by 1/√(2 × 50), ten per cent, four of which are allowed.
        assert 0.6 <= error / law <= UNFOLDED + 0.4
        bias = relative(np.mean(found, axis=0), covariance)
        # The one frame in a thousand that is cut off for wild would hold one per cent of the variance.
        assert bias <= 4 * UNFOLDED * law / np.sqrt(trials) + 0.01

    @pytest.mark.parametrize("how", ["none", "one axis", "any"])
    @pytest.mark.parametrize("template", ["square", "nearly a line", "five"])
    def test_a_segment_that_does_not_turn_is_as_good_where_its_markers_show_the_noise(
        self, template, how
    ):
        places = {
            "square": [[1, 1, 0], [1, -1, 0], [-1, -1, 0], [-1, 1, 0]],
            "nearly a line": [[0, 0, 0], [1, 0.2, 0], [2, 0, 0.3], [3, 0.1, 0]],
            "five": [[1, 1, 0], [1, -1, 0.5], [-1, -1, 0], [-1, 1, -0.5], [0, 0, 1]],
        }[template]
        rng, covariance, frames = np.random.default_rng(3), skewed(), 2000
        found = estimated(film(rng, 0.05 * np.array(places), turns(rng, frames, how), covariance))
        assert np.isfinite(found).all()
        # One estimate: four times its law.
        law = wishart(covariance, frames, len(places))
        assert relative(found, covariance) <= 4 * UNFOLDED * law

    def test_noise_that_is_the_same_in_all_directions_is_the_unit_matrix(self):
        rng, covariance = np.random.default_rng(4), 1e-6 * np.eye(3)
        found = estimated(film(rng, 0.1 * rng.normal(size=(5, 3)), turns(rng, 1000), covariance))
        assert relative(found, covariance) <= 4 * UNFOLDED * wishart(covariance, 1000, 5)

    def test_without_noise_there_is_none(self):
        rng = np.random.default_rng(5)
        template = 0.1 * rng.normal(size=(5, 3))
        found = estimated(np.einsum("fij,mj->fmi", turns(rng, 100), template))
        # A pose is orthonormal to some eps; a decimetre's rounding, squared.
        assert np.abs(found).max() <= (64 * EPS * 0.1) ** 2

    @LAWS
    @given(st.integers(0, 2**32 - 1), st.integers(4, 7), st.sampled_from(["any", "none"]))
    def test_it_is_symmetric_and_never_negative(self, seed, markers, how):
        rng = np.random.default_rng(seed)
        # Next to nothing along one direction: what chance would make negative is cut at zero.
        covariance = skewed(seed, (1e-3, 1e-3, 1e-9))
        points = film(rng, 0.1 * rng.normal(size=(markers, 3)), turns(rng, 30, how), covariance)
        found = estimated(points)
        np.testing.assert_allclose(found, found.T, rtol=0, atol=8 * EPS * np.abs(found).max())
        assert np.linalg.eigvalsh(found)[0] >= -8 * EPS * np.abs(found).max()

    @LAWS
    @given(st.integers(0, 2**32 - 1))
    def test_it_turns_with_the_lab_and_scales_with_the_square_of_the_unit(self, seed):
        rng = np.random.default_rng(seed)
        points = film(rng, 0.1 * rng.normal(size=(5, 3)), turns(rng, 60), skewed())
        lab = Rotation.random(random_state=rng).as_matrix()
        found = estimated(points)
        turned = estimated(points @ lab.T + rng.uniform(-1, 1, 3))
        # A metre's rounding in residuals of a millimetre.
        allowed = 64 * EPS * 1e3 * np.abs(found).max()
        np.testing.assert_allclose(turned, lab @ found @ lab.T, rtol=0, atol=allowed)
        np.testing.assert_allclose(estimated(1e3 * points), 1e6 * found, rtol=0, atol=1e6 * allowed)

    def test_the_order_of_markers_and_of_frames_is_nothing(self):
        rng = np.random.default_rng(6)
        # An odd number of frames: of an even one the upper median depends on the sign of an axis.
        points = film(rng, 0.1 * rng.normal(size=(5, 3)), turns(rng, 61), skewed())
        found = estimated(points)
        allowed = 64 * EPS * 1e3 * np.abs(found).max()
        for other in (points[:, rng.permutation(5)], points[rng.permutation(61)]):
            np.testing.assert_allclose(estimated(other), found, rtol=0, atol=allowed)

    def test_three_markers_leave_too_little(self):
        rng = np.random.default_rng(7)
        assert (
            estimated(film(rng, 0.1 * rng.normal(size=(3, 3)), turns(rng, 500), skewed())) is None
        )

    def test_a_fourth_marker_that_is_never_seen_is_none(self):
        rng = np.random.default_rng(8)
        points = film(rng, 0.1 * rng.normal(size=(4, 3)), turns(rng, 500), skewed())
        points[:, 2] = np.nan
        assert estimated(points) is None

    def test_fewer_than_twenty_whole_frames_are_too_few(self):
        rng = np.random.default_rng(9)
        points = film(rng, 0.1 * rng.normal(size=(5, 3)), turns(rng, 200), 1e-6 * np.eye(3))
        assert estimated(points[:19]) is None
        # Fifteen whole frames at either end: of thirty no more than some are cut off for wild.
        points[15:-15, 0] = np.nan
        assert estimated(points).shape == (3, 3)
        points[10:, 0] = np.nan
        assert estimated(points) is None


class TestClipNoise:
    def test_a_frame_sees_the_matrix_along_its_own_axes(self):
        covariance = skewed()
        turn = Rotation.random(random_state=2).as_matrix()
        pose = Pose(np.tile(turn, (4, 1, 1)), np.zeros((4, 3)))
        pose.rotation[2], pose.origin[2] = np.nan, np.nan
        found = ClipNoise(0.002, covariance).in_frame(pose)
        expected = turn.T @ covariance @ turn / 0.002**2
        np.testing.assert_allclose(found, expected, rtol=0, atol=8 * EPS * expected.max())

    def test_a_frame_that_turns_all_round_sees_the_same_noise_in_all_directions(self):
        frames = 3000
        rotations = turns(np.random.default_rng(3), frames)
        sigma = np.sqrt(np.trace(skewed()) / 3)
        found = ClipNoise(sigma, skewed()).in_frame(Pose(rotations, np.zeros((frames, 3))))
        # An entry of RᵀΣR lies in a range as wide as the eigenvalues', so it varies by half of that at
        # most (Popoviciu); the mean of all frames by a share of 1/√frames, four of which are allowed.
        width = (SPREAD[2] ** 2 - SPREAD[0] ** 2) / sigma**2
        np.testing.assert_allclose(found, np.eye(3), rtol=0, atol=4 * width / 2 / np.sqrt(frames))

    def test_a_level_has_no_directions(self):
        pose = Pose(turns(np.random.default_rng(4), 10), np.zeros((10, 3)))
        assert ClipNoise(0.001).in_frame(pose) is None
        assert ClipNoise(0.0, np.zeros((3, 3))).in_frame(pose) is None

    def segments(self, **markers):
        """Points and shapes of segments with so many markers, noise of `SPREAD`."""
        rng = np.random.default_rng(5)
        points = {
            name: film(rng, 0.1 * rng.normal(size=(m, 3)), turns(rng, 800), skewed())
            for name, m in markers.items()
        }
        shapes = {n: found for n, x in points.items() if (found := find_shape(x)) is not None}
        return points, shapes

    def test_a_noise_that_is_given_is_taken(self):
        points, shapes = self.segments(a=5, b=4)
        for how in NOISES:
            assert clip_noise(points, shapes, 0.004, how).sigma == 0.004
            assert clip_noise(points, shapes, 0.004, how).matrix is None
            given_matrix = clip_noise(points, shapes, skewed(), how)
            assert given_matrix.sigma == pytest.approx(np.sqrt(np.trace(skewed()) / 3))
            np.testing.assert_array_equal(given_matrix.matrix, skewed())

    def test_the_matrix_of_a_clip_is_that_of_its_cameras(self):
        points, shapes = self.segments(a=5, b=4, c=3)
        found = clip_noise(points, shapes, None, "matrix")
        # The level is a median over frames, scaled by the χ² of equal noise: for one direction of three
        # times the noise it is low, by 12 % at worst as seen; the form of the matrix is not affected.
        assert found.sigma == pytest.approx(np.sqrt(np.trace(found.matrix) / 3), rel=1e-12)
        form = found.matrix / np.trace(found.matrix) * np.trace(skewed())
        assert relative(form, skewed()) <= 4 * UNFOLDED * wishart(skewed(), 800, 4)
        assert found.sigma == pytest.approx(np.sqrt(np.trace(skewed()) / 3), rel=0.15)
        assert not found.each and not found.note

    def test_the_level_is_that_of_the_lower_third(self):
        """Skin and swapped markers only add; the very first may be what software has filled in."""
        points, found = self.segments(a=5)
        shape, pose = found["a"]
        levels = (0.003, 0.0, 0.001, 0.002, 0.05, 0.01)
        shapes = {str(i): (replace(shape, sigma=level), pose) for i, level in enumerate(levels)}
        assert clip_noise(points, shapes, None, "rigid").sigma == 0.002

    def test_the_matrix_has_the_size_of_the_level(self):
        """The one segment that shows the matrix is twice as restless as the two that give the level."""
        points, shapes = self.segments(a=3, b=3, c=5)
        points["c"] = points["c"].mean(axis=1, keepdims=True) + 2 * (
            points["c"] - points["c"].mean(axis=1, keepdims=True)
        )
        shapes["c"] = find_shape(points["c"])
        level = clip_noise(points, shapes, None, "rigid").sigma
        assert level == pytest.approx(shapes["a"][0].sigma, rel=0.15)
        assert shapes["c"][0].sigma > 1.5 * level
        # The level is a median, the matrix a mean, as above.
        assert clip_noise(points, shapes, None, "matrix").sigma == pytest.approx(level, rel=0.15)

    def test_segments_of_three_markers_have_a_level_and_say_so(self):
        found = clip_noise(*self.segments(a=3, b=3), None, "matrix")
        assert found.matrix is None and found.sigma > 0
        assert "four markers" in found.note

    def test_each_marker_for_itself_is_left_to_the_joints(self):
        points, shapes = self.segments(a=5, b=4)
        rigid, marker = (clip_noise(points, shapes, None, how) for how in ("rigid", "marker"))
        assert marker.each and not rigid.each
        assert marker.sigma == rigid.sigma

    def test_a_clip_without_a_rigid_segment_has_no_noise_that_is_known(self):
        for how in NOISES:
            assert clip_noise({"a": np.zeros((50, 2, 3))}, {}, None, how).sigma == 0.0

    def test_no_noise_along_one_direction_is_a_covariance(self):
        """However it lies: rounding may make its zero a negative number."""
        for seed in range(8):
            found = clip_noise({}, {}, skewed(seed, (0.001, 0.001, 0.0)), "rigid")
            assert found.sigma == pytest.approx(0.001 * np.sqrt(2 / 3))

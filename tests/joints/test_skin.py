"""The error that skin makes of a centre: its laws, its invariances, and its constants by hand."""

from dataclasses import replace

import numpy as np
import pytest
from centres import EXACT
from hypothesis import given, settings
from hypothesis import strategies as st

from mocap_skel.artificial.rotations import from_vector
from mocap_skel.artificial.spheres import cap
from mocap_skel.joints.samples import Gathered, JointSamples, gather
from mocap_skel.joints.skin import COMMON, SLIDE, Skin, along_axis, skin_error
from mocap_skel.joints.sphere import Sphere
from mocap_skel.spherefit import SphereFit, fit_sphere, radial_variance, smooth_share

vectors = st.tuples(*[st.floats(-3, 3)] * 3).map(np.array)


def sphere_of(points, residual=None, smooth=1.0, noise=0.0, leverage=0.0, fit=None):
    """The fit of points (frames, M, 3), with given numbers a marker in place of its own.

    The fit is `fit` where there is one, and the residual's variance `residual`.
    """
    rows, count = np.swapaxes(points, 0, 1), points.shape[1]
    seen = gather(JointSamples(points, 1e-6, 1e-6, EXACT), None)
    fit = fit or fit_sphere(rows, "sgdk", sigma=1e-6, moments=seen.own.moments)
    eye = np.broadcast_to(np.eye(3), (count, 3, 3))
    own = replace(seen.own, smooth=np.full(count, smooth), leverage=leverage * eye)
    variance = radial_variance(own.moments, fit) if residual is None else np.full(count, residual)
    known = Gathered(seen.samples, own, None)
    return Sphere(known, fit, noise * eye, np.ones(count), "best", variance, 0.0)


def skin_of(points, residual=None, looseness=1.0, **more):
    return skin_error(sphere_of(points, residual, **more), looseness)


def sphere_points(frames=800, seed=3, angle=0.8, radii=(0.3, 0.4)):
    """Markers on concentric caps about the origin, (frames, M, 3)."""
    rng = np.random.default_rng(seed)
    return np.stack([cap(rng, (frames,), angle, r) for r in radii], axis=1)


def test_nothing_smooth_nothing_lost():
    """Noise from frame to frame averages out: skin has no part in it but what chance may hide."""
    residual, frames = 1e-4, 800
    found = skin_of(sphere_points(frames), residual=residual, smooth=0.0)
    # Two standard errors of a correlation, 1/√N, are no evidence against that share of skin.
    assert 0 < found.slide <= SLIDE**2 * residual * 2 / np.sqrt(frames)
    assert skin_of(sphere_points(frames), residual=0.0, smooth=0.0).slide < 1e-20


def test_the_covariance_is_symmetric_and_positive():
    found = skin_of(sphere_points(), residual=1e-4, leverage=0.5)
    assert isinstance(found, Skin)
    assert np.abs(found.covariance - found.covariance.T).max() < 1e-15
    assert np.linalg.eigvalsh(found.covariance)[0] > 0


def test_errors_go_as_the_skin():
    """Twice the residual, four times the variance."""
    one = skin_of(sphere_points(), residual=1e-6)
    two = skin_of(sphere_points(), residual=4e-6)
    # What chance may hide of it grows more slowly, for a usual slide bounds it.
    assert 3.9 * one.slide < two.slide <= 4 * one.slide
    # The prior 1/reach² holds back a share of 1e-4, the pulls do not hang on the residual that is given.
    apart = [f.covariance - f.slide * np.eye(3) for f in (one, two)]
    assert (np.linalg.eigvalsh(4.001 * apart[0] - apart[1]) > -1e-15).all()


@pytest.mark.parametrize("size", [0.5, 2.0, 10.0])
def test_a_larger_body_has_errors_as_much_larger(size):
    one = skin_of(sphere_points(), residual=1e-5, leverage=0.3)
    large = skin_of(size * sphere_points(), residual=size**2 * 1e-5, leverage=0.3)
    assert large.covariance == pytest.approx(size**2 * one.covariance, rel=1e-6, abs=1e-15)
    assert large.slide == pytest.approx(size**2 * one.slide, rel=1e-6)


@pytest.mark.parametrize("turn", [(0.3, 0, 0), (1.0, -2.0, 0.5), (0, 0, np.pi / 2)])
def test_turning_the_frame_turns_the_error(turn):
    rotation = from_vector(np.array(turn, dtype=float))
    points = sphere_points() + [0.1, 0.2, 0.0]
    one = skin_of(points, residual=1e-5, leverage=0.3)
    turned = skin_of(points @ rotation.T, residual=1e-5, leverage=0.3)
    assert np.abs(turned.covariance - rotation @ one.covariance @ rotation.T).max() < 1e-12
    assert turned.slide == pytest.approx(one.slide, rel=1e-7)


def test_more_frames_do_not_mend_it():
    few = skin_of(sphere_points(500), residual=1e-5)
    many = skin_of(sphere_points(8000), residual=1e-5)
    # Within what 500 points say of a cap, √(2/500) of a variance, a few times over.
    assert np.diag(many.covariance) == pytest.approx(np.diag(few.covariance), rel=0.2)
    assert many.slide == pytest.approx(few.slide, rel=0.2)


def test_a_wider_movement_mends_it():
    narrow, wide = (skin_of(sphere_points(angle=a), residual=1e-5) for a in (0.4, 1.6))
    assert np.trace(wide.covariance) < 0.25 * np.trace(narrow.covariance)


def test_looseness_is_metres_for_a_radian():
    points = sphere_points()
    ankle, knee = (skin_of(points, residual=1e-5, looseness=k) for k in (2.0, 3.0))
    assert knee.slide == pytest.approx(9 / 4 * ankle.slide)
    grown = knee.covariance - ankle.covariance
    assert grown == pytest.approx((knee.slide - ankle.slide) * np.eye(3), abs=1e-12)


def test_a_direction_that_was_not_solved_is_no_worse_for_skin():
    """A hinge: the sphere fit says itself that it knows nothing along the axis."""
    bend = np.linspace(0, 1.5, 300)
    arc = np.stack([0.4 * np.cos(bend), 0 * bend, 0.4 * np.sin(bend)], axis=-1)[:, None]
    found = skin_of(arc, residual=1e-5)
    assert found.covariance[1, 1] == pytest.approx(found.slide, rel=1e-6)


@settings(max_examples=50, deadline=None)
@given(vectors)
def test_the_unsolved_direction_does_not_hang_on_rounding(turn):
    """However the frame lies: a direction that rounding takes for shown would be off by the whole reach."""
    bend = np.linspace(0, 1.5, 50)
    arc = np.stack([0.4 * np.cos(bend), 0 * bend, 0.4 * np.sin(bend)], axis=-1)[:, None]
    rotation = from_vector(turn)
    one, turned = skin_of(arc, residual=1e-5), skin_of(arc @ rotation.T, residual=1e-5)
    assert np.trace(turned.covariance) == pytest.approx(np.trace(one.covariance), rel=1e-6)


def test_a_marker_at_the_centre_breaks_nothing():
    place = np.array([0.1, 0.2, 0.3])
    fit = fit_sphere(np.swapaxes(sphere_points(20, radii=(0.3,)), 0, 1), "sgdk", sigma=1e-6)
    found = skin_of(np.tile(place, (20, 1, 1)), 0.0, fit=replace(fit, centre=place))
    assert np.isfinite(found.covariance).all()


# --- by hand: the numbers of the error model are those of docs/priors.md


def by_hand(widths, residual, smooth, *, count=10_000, arm=0.3, leverage=0.0, noise=0.0):
    """A marker at `arm` above a centre in the origin whose directions cover `widths` radians, evenly."""
    points = np.tile([0.0, 0.0, arm], (count, 1, 1))
    seen = gather(JointSamples(points, 1e-6, 1e-6, EXACT), None)
    spread = np.diag([*np.square(widths) / 12, 0.01]) * arm**2
    moments = replace(seen.own.moments, covariance=spread[None])
    own = replace(
        seen.own, moments=moments, smooth=np.array([smooth]), leverage=leverage * np.eye(3)[None]
    )
    fit = SphereFit(
        np.zeros(3), np.array([arm]), np.eye(3), np.diag(spread), np.asarray(3), np.asarray(0.0)
    )
    return Sphere(
        Gathered(seen.samples, own, None), fit, noise * np.eye(3)[None], np.ones(1), "best",
        np.array([residual]), 0.0,
    )  # fmt: skip


def test_the_slide_is_metres_a_radian_over_the_places():
    """0.8 by 1.2 rad are 2 x 3 places of 0.4; less than a place is one. Centre and radius take four of them."""
    tau2 = 1e-8
    for widths, left in (((0.8, 1.2), 2), ((0.2, 1.2), 1), ((0.1, 0.3), 1)):
        for looseness, rate in ((1.0, COMMON), (2.0, 2 * SLIDE)):
            found = skin_error(by_hand(widths, tau2, 1.0, count=10**6), looseness)
            # What chance may hide, 2/√N of it, is next to nothing.
            assert found.slide == pytest.approx(rate**2 * tau2 / left, rel=0.06)


def test_a_usual_slide_is_two_centimetres_a_radian_for_a_metre_of_reach():
    """However little is smooth: white residuals of 10 cm would hide any slide, so it is the usual one."""
    for widths, places in (((0.8, 1.2), 6), ((0.1, 0.3), 1)):
        found = skin_error(by_hand(widths, 0.01, 0.0, count=16))
        usual, concealed = (0.02 * 0.3 / places**2) ** 2, SLIDE**2 * 0.01 * 2 / np.sqrt(16)
        assert found.slide == pytest.approx(usual * concealed / (usual + concealed), rel=1e-9)
        assert found.slide == pytest.approx(usual, rel=1e-3)


def test_chance_hides_two_standard_errors_of_white_noise():
    """So little of it that far less than the usual slide can be there."""
    found = skin_error(by_hand((0.1, 0.3), 1e-12, 0.0, count=400))
    assert found.slide == pytest.approx(SLIDE**2 * 1e-12 * 2 / 20, rel=1e-4)


def test_a_centre_is_known_by_the_places_that_its_markers_were_in():
    """((n - 4) C / τ² + 1 / reach²)⁻¹ with the scatter of the directions, and what the slide adds everywhere."""
    tau2, count = 1e-6, 10**6
    found = skin_error(by_hand((0.8, 1.2), tau2, 1.0, count=count))
    hidden = found.slide - COMMON**2 * tau2 / 2
    cap = np.array([0.8**2 / 12, 1.2**2 / 12, 0.01])
    known = 6 * cap / (3 * tau2 + hidden * cap.sum()) + 1 / 0.3**2
    rest = found.covariance - found.slide * np.eye(3)
    assert rest == pytest.approx(np.diag(1 / known), rel=1e-6, abs=1e-12)


def test_what_a_fit_takes_of_the_skin_is_missing_in_its_residuals():
    """Of M n values it takes 3 + M; many markers are left with most, one marker on few places with nothing."""
    for markers, places, left in ((1, 6, 2), (1, 2, 1), (7, 6, 32)):
        one = by_hand((0.8, 1.2) if places == 6 else (0.4, 0.8), 1e-8, 1.0, count=10**6)
        assert skin_error(_times(one, markers)).taken == pytest.approx(markers * places / left)


def _times(sphere, markers):
    """A fit of so many markers that move as its one."""
    every = np.zeros(markers, dtype=int)
    own = sphere.seen.own[every]
    return replace(
        sphere, seen=Gathered(sphere.seen.samples, own, None), noise=sphere.noise[every],
        weights=sphere.weights[every], variance=sphere.variance[every],
        fit=replace(sphere.fit, radius=sphere.fit.radius[every]),
    )  # fmt: skip


def test_along_its_axis_a_joint_is_known_by_the_swing_that_is_no_skins():
    """Skin of 1 mm carries the markers by 7 mm across: all of a swing of 4 mm, a hundredth of one of 7 cm."""
    axis = np.array([1.0, 0.0, 0.0])
    for swing, share in ((0.004, 1.0), (0.07, 0.01)):
        sphere = by_hand((swing / 0.3 * np.sqrt(12), 0.8), 1e-6, 1.0)
        found = along_axis(sphere, skin_error(sphere, 3.0), axis)
        assert found == pytest.approx((share * 0.3) ** 2 * np.outer(axis, axis), rel=1e-9)
    still = by_hand((0.2, 0.8), 1e-6, 0.0)
    assert along_axis(still, skin_error(still, 3.0), axis) == pytest.approx(0.0, abs=1e-12)


def slipping(slips, frames=4000, smooth=1.0):
    """Markers (frames, M, 3) around a centre in the origin, each fixed on a limb that is `slips` (M, 3) off it.

    Each alone would put the centre at its slip; the fit finds the mean, for all move alike.
    """
    rng = np.random.default_rng(11)
    turns = from_vector(rng.uniform(-0.6, 0.6, (frames, 3)))
    places = 0.3 * np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    points = np.einsum("fij,pj->fpi", turns, places) + slips
    return sphere_of(points, 0.0, smooth)


def test_markers_that_contradict_each_other_tell_the_error_of_their_mean():
    """Slips of 1 cm along each axis, drawn alike for six markers: a mean of four is off by half of it."""
    sd, levels = 0.01, []
    for seed in range(40):
        slips = sd * np.random.default_rng(seed).standard_normal((6, 3))
        found = skin_error(slipping(slips, 300))
        levels.append(np.trace(found.covariance - found.slide * np.eye(3)) / 3)
    # Along each axis four of the six move. One of six draws is the places', of which no residual is left; and of
    # 15 draws Student's variance is 15/13.
    assert np.mean(levels) == pytest.approx(15 / 13 * 5 / 6 * sd**2 / 4, rel=0.2)


def test_markers_that_agree_or_are_noise_say_nothing_of_it():
    agree = skin_error(slipping(np.zeros((6, 3)), 300))
    assert np.trace(agree.covariance) < 1e-12
    # Of noise, its own bound is the error.
    slips = 0.01 * np.random.default_rng(1).standard_normal((6, 3))
    noise = skin_error(slipping(slips, 300, smooth=0.0))
    assert np.trace(noise.covariance) < 1e-9


def test_what_is_taken_away_is_no_cover():
    """Noise that a fit takes away spreads the directions, but shows no places."""
    spread, noise = 0.3**2 * 0.8**2 / 12, 0.3**2 * 0.4**2 / 12
    found = skin_error(by_hand((0.8, 0.4), 1e-10, 1.0, noise=noise, count=10**6))
    # √(0.8² - 0.4²) rad are left of one way, nothing of the other.
    places = np.sqrt(0.8**2 - 0.4**2) / 0.4
    assert noise < spread and found.places == pytest.approx(places, rel=0.02)


# --- the smooth share


def test_white_noise_is_not_smooth():
    """The correlation of neighbours is within 2/√N of zero in 95 of 100, and that is taken off: 50 markers."""
    share = smooth_share(np.random.default_rng(5).standard_normal((2000, 50)))
    assert (share < 2 / np.sqrt(2000)).all()
    assert (share == 0).mean() > 0.9


@pytest.mark.parametrize("rho", [0.5, 0.9, 0.99])
def test_a_series_that_remembers_is_smooth_by_its_memory(rho):
    """AR(1): the correlation of neighbours, less the 2/√N; its own error is below 1/√N, taken five times."""
    rng, frames = np.random.default_rng(6), 20000
    e = np.empty((frames, 3))
    e[0] = rng.standard_normal(3)
    step = np.sqrt(1 - rho**2) * rng.standard_normal((frames, 3))
    for i in range(1, frames):
        e[i] = rho * e[i - 1] + step[i]
    assert smooth_share(e) == pytest.approx(rho - 2 / np.sqrt(frames), abs=5 / np.sqrt(frames))


def test_gaps_are_no_neighbours():
    e = np.sin(np.linspace(0, 20, 3000))[:, None] * np.ones((1, 2))
    e[::7, 0] = np.nan
    e[::2, 1] = np.nan
    share = smooth_share(e)
    assert share[0] == pytest.approx(1.0, abs=0.06)
    # No two frames follow each other.
    assert share[1] == 0


def test_nothing_seen_and_nothing_moving_are_not_smooth():
    assert (smooth_share(np.full((10, 2), np.nan)) == 0).all()
    assert (smooth_share(np.zeros((10, 2))) == 0).all()
    assert (smooth_share(np.ones((1, 2))) == 0).all()


@settings(max_examples=30, deadline=None)
@given(st.floats(1e-6, 1e6))
def test_the_unit_does_not_matter(size):
    e = np.cumsum(np.random.default_rng(7).standard_normal((300, 2)), axis=0)
    assert smooth_share(size * e) == pytest.approx(smooth_share(e), abs=1e-9)

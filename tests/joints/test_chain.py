"""The steps of a joint's fit: what each adds to the one before, and that without its input it adds nothing."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from centres import CENTRE, EXACT, RADIUS, cap, centre_of, on_sphere

from mocap_skel.joints.priors import Expected
from mocap_skel.joints.samples import Frame
from mocap_skel.joints.skin import COMMON, SLIDE
from mocap_skel.joints.two_sided import SharedPoint
from mocap_skel.spherefit import methods as methods_module
from mocap_skel.spherefit import mle

ANGLE, FRAMES, SWELL = 0.8, 400, 0.002
# Anatomy that knows next to nothing: the steps of a prior are there, and move nothing by themselves.
VAGUE = Expected(CENTRE, 1e4 * np.eye(3), ("A",), "s")


def on_skin(seed=0):
    """A marker on a cap whose skin swells slowly by SWELL, root mean square: (FRAMES, 1, 3)."""
    rays = cap(ANGLE, FRAMES)[np.random.default_rng(seed).permutation(FRAMES)]
    slow = SWELL * np.sqrt(2) * np.sin(np.linspace(0, 15, FRAMES))
    return (CENTRE + (RADIUS + slow)[:, None] * rays)[:, None]


# Neighbours of the swelling are correlated by cos(15/400); twice the standard error is taken off.
SMOOTH = np.cos(15 / FRAMES) - 2 / np.sqrt(FRAMES)


def slide_by_law(rate=COMMON):
    """(rate τ)² / n, with the places n = (√12 sd of the directions / 0.4 rad)² of an even cap.

    The fit of a centre and a radius leaves n - 4 of n values in the residuals.
    """
    middle = (1 + np.cos(ANGLE)) / 2
    across = (1 - (1 + np.cos(ANGLE) + np.cos(ANGLE) ** 2) / 3) / 2
    places = 12 * across / middle**2 / 0.4**2
    return (rate * SWELL) ** 2 * SMOOTH / (places - 4)


def test_a_pure_fit_keeps_its_centre_and_has_skin_in_its_error():
    points = on_skin()
    ball, ankle, knee = (centre_of(points, 0.0002, looseness=k) for k in (1.0, 2.0, 3.0))
    assert (ball.centre == ball.motion).all()
    assert (ball.share, ball.landmarks, ball.source) == (1.0, (), "")
    # The slide goes with the square of the looseness, the same in all directions.
    slide = (knee.covariance - ankle.covariance) / 5
    assert slide == pytest.approx(slide[0, 0] * np.eye(3), abs=1e-9 * slide[0, 0])
    # The centre is off by 1 mm of 400, and τ² by the part of a period that is left: a few percent.
    assert slide[0, 0] == pytest.approx(slide_by_law(SLIDE), rel=0.06)
    assert np.linalg.eigvalsh(ball.covariance)[0] > slide_by_law()


def test_beside_a_prior_that_knows_nothing_the_centre_is_the_motions():
    found = centre_of(on_skin(), 0.0002, expected=VAGUE)
    assert found.centre == pytest.approx(found.motion, abs=1e-6)


def test_a_joint_that_does_not_move_belongs_to_anatomy():
    """Skin on a person who stands still is smooth and 0.1 mm: it shows nothing of the joint, however small."""
    rng, place = np.random.default_rng(2), CENTRE + [0.0, 0.0, 0.02]
    breath = 0.0005 * np.sin(np.linspace(0, 20, FRAMES))[:, None, None]
    ways = rng.standard_normal((1, 3, 3))
    rays = cap(0.002, 3)[None]
    points = CENTRE + RADIUS * rays + breath * ways + 1e-5 * rng.standard_normal((FRAMES, 3, 3))
    prior = Expected(place, 0.01**2 * np.eye(3), ("A",), "s")
    found = centre_of(points, 1e-5, expected=prior)
    assert found.weakest_sd < 0.0005
    # A share of 0.03 at most: (0.5 mm / 3 mm)², however sure the motion claims to be.
    assert np.linalg.norm(found.centre - place) < 0.03 * np.linalg.norm(found.motion - place)
    assert np.linalg.norm(found.centre - place) < 0.001


def test_a_sure_prior_decides_and_radius_and_residual_are_about_its_place():
    sigma, place = 0.0005, CENTRE + [0.03, 0, 0]
    points = on_sphere(1.0, 500, np.random.default_rng(1), sigma, markers=2)
    found = centre_of(
        points, sigma, expected=Expected(place, 1e-18 * np.eye(3), ("A", "B"), "Wu 2005")
    )
    # 1e-9 m beside the motion's 1e-4.
    np.testing.assert_allclose(found.centre, place, rtol=0, atol=1e-9)
    # The bound of such a cap is 4σ/√N (test_centre); five of it.
    np.testing.assert_allclose(found.motion, CENTRE, rtol=0, atol=5 * 4 * sigma / np.sqrt(500))
    away = np.linalg.norm(points - found.centre, axis=-1)
    # Noise makes the mean square larger by 3σ², 5e-6 of it.
    np.testing.assert_allclose(found.radius, np.sqrt((away**2).mean(axis=0)), rtol=1e-5)
    np.testing.assert_allclose(found.residual, np.sqrt(away.var(axis=0).mean()), rtol=1e-9)
    assert (found.landmarks, found.source) == (("A", "B"), "Wu 2005")
    # The movement shows what it shows.
    assert (found.shown, found.method) == ("yes", "MGDK")


@pytest.mark.parametrize("held", [0.0, 0.6])
def test_anatomy_claims_no_more_than_its_markers_keep_their_distance(held):
    """What moves by more than skin against its joint is elsewhere, and so may be what anatomy starts from."""
    points = on_sphere(1.0, 500, np.random.default_rng(1), 0.0005, markers=2)
    points[: int(held * len(points)), 0] = CENTRE + [0.9, 0.2, 0]
    sure = Expected(CENTRE, 0.015**2 * np.eye(3), ("A",), "s")
    found = centre_of(points, 0.0005, expected=sure)
    away = np.linalg.norm(points - found.centre, axis=-1)
    residual = np.sqrt(away.var(axis=0).mean())
    if held:
        assert residual > 0.1 and found.worst_error >= np.sqrt(residual**2 - 0.01**2)
    else:
        assert residual < 0.01 and found.worst_error <= 0.015


def test_where_nobody_sees_the_frame_turn_the_error_is_the_reach():
    points = on_skin()
    seen, unseen = (centre_of(points, 0.0002, Frame(None, limit, "w")) for limit in ("weak", "no"))
    reach = np.linalg.norm(points.mean(axis=0))
    np.testing.assert_allclose(
        unseen.covariance - seen.covariance, reach**2 * np.eye(3), rtol=1e-9, atol=1e-12
    )


def test_the_shared_point_counts_beside_a_prior_only_and_slides_with_the_skin():
    points, place = on_skin(), CENTRE + [0.0, 0.02, 0.0]
    exact = SharedPoint(place, np.eye(3), 1e-12)
    pure = centre_of(points, 0.0002, shared=exact)
    assert (pure.centre == pure.motion).all()
    alone = centre_of(points, 0.0002, expected=VAGUE)
    found = centre_of(points, 0.0002, expected=VAGUE, shared=exact)
    # It is as sure as the slide lets it be; both count by their information.
    mine, its = np.linalg.inv(pure.covariance), np.eye(3) / slide_by_law()
    law = np.linalg.solve(mine + its, mine @ alone.centre + its @ place)
    # 5 % of the slide's law, of 2 cm.
    assert np.linalg.norm(found.centre - law) < 0.05 * 0.02
    assert np.linalg.norm(found.centre - place) > 0.005


class TestNoAnswer:
    @pytest.fixture(autouse=True)
    def _two_steps(self, monkeypatch):
        monkeypatch.setattr(methods_module, "mle", partial(mle, most=2))

    def test_an_estimator_that_does_not_converge_shows_nothing(self):
        points = on_sphere(0.3, 50, np.random.default_rng(2), 0.01)
        found = centre_of(points, method="mle")
        assert (found.shown, found.reason) == ("no", "MLE did not converge")

    def test_beside_a_prior_it_leaves_the_joint_to_anatomy(self):
        points = on_sphere(0.3, 50, np.random.default_rng(2), 0.01)
        prior = Expected(CENTRE + 0.01, 4e-4 * np.eye(3), ("A",), "s")
        found = centre_of(points, method="mle", expected=prior)
        assert (found.method, found.shown, found.share) == ("PRIOR", "no", 0.0)
        assert found.reason == "MLE did not converge"
        assert (found.centre == prior.mean).all() and (found.covariance == prior.covariance).all()
        assert found.samples == 0 and np.isnan(found.radius).all() and len(found.radius) == 1
        assert found.landmarks == ("A",) and found.source == "s" and found.evidence is None


class TestOtherClips:
    """Two markers; this clip sees the first only, the other both."""

    @pytest.fixture(autouse=True)
    def alike(self, monkeypatch):
        """Clips that count alike: how much each counts is tests/pipeline/test_pooling.py's."""
        monkeypatch.setattr("mocap_skel.joints.centre.by_skin", lambda clips, _: [1.0] * len(clips))

    def test_a_marker_of_other_clips_only_has_its_radius_and_adds_its_samples(self):
        rng = np.random.default_rng(3)
        here, there = (on_sphere(1.0, n, rng, 0.001, markers=2) for n in (300, 500))
        here[:, 1] = np.nan
        other = centre_of(there, 0.001).evidence
        found = centre_of(here, 0.001, pooled=other)
        # A radius of N samples is known to 4σ/√N on such a cap (test_centre), five of which.
        assert found.radius == pytest.approx(
            [RADIUS, 1.2 * RADIUS], abs=5 * 0.001 / np.sqrt(500) * 4
        )
        assert found.samples == 300 + 2 * 500
        # What the clip knows itself stays apart, or it would be pooled twice.
        assert found.evidence.count.tolist() == [300, 0]
        assert found.effective == pytest.approx(
            found.evidence.effective.sum() + other.effective.sum(), rel=1e-12
        )

    def test_the_residual_is_that_of_all_samples(self):
        rng = np.random.default_rng(4)
        here, there = on_sphere(1.0, 200, rng, 0.001), on_sphere(1.0, 600, rng, 0.003)
        found = centre_of(here, 0.001, pooled=centre_of(there, 0.003).evidence)
        away = [np.linalg.norm(p - found.centre, axis=-1).ravel() for p in (here, there)]
        errors = np.concatenate([a - a.mean() for a in away])
        # From moments it is of first order in σ/r, 3/400, and divides by N - 1.
        assert found.residual == pytest.approx(errors.std(), rel=0.01)
        assert found.residual == pytest.approx(0.001 * np.sqrt((200 + 9 * 600) / 800), rel=0.1)


def test_markers_that_err_together_count_as_one():
    """Same rays, same errors: the pulls add up to (r₁ + r₂)² where independent ones had r₁² + r₂²."""
    rng = np.random.default_rng(5)
    rays = cap(1.0, 2000)[rng.permutation(2000)]
    error = 0.002 * rng.standard_normal(2000)
    radii = np.array([0.4, 0.3])
    together = np.stack([CENTRE + (r + error)[:, None] * rays for r in radii], axis=1)
    apart = np.stack([CENTRE + (r + rng.permutation(error))[:, None] * rays for r in radii], axis=1)
    alike = radii.sum() ** 2 / (radii**2).sum()
    one, two = (centre_of(points, 0.002).effective for points in (together, apart))
    # Chance in the sum of 2000: 5 %; and the lags of chance, 2/√2000 each.
    assert two / one == pytest.approx(alike, rel=0.1)


def test_nothing_of_a_frame_that_is_exact():
    """`EXACT` has no lever: all that is taken away is the marker's own noise."""
    found = centre_of(on_sphere(1.0, 200, np.random.default_rng(6), 0.001), 0.001, EXACT).evidence
    assert (found.leverage == 0).all()
    assert (found.skew == 0).all()
    assert (replace(found, sigma=0.0).noise == np.eye(3)).all()

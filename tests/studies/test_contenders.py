"""Each contender of the studies is the estimator that its label names, on all sets of a batch."""

import numpy as np
import pytest
from spheres import cap

from mocap_skel.artificial.spheres import cap as even_cap
from mocap_skel.spherefit import (
    gdke,
    isotropic,
    lls,
    marker_noise,
    mgdk,
    mle,
    pratt,
    sgdk,
    sphere_moments,
)
from mocap_skel.spherefit.least_squares import mle_answer
from mocap_skel.studies import contenders
from mocap_skel.studies.contenders import CONTENDERS

SIGMA = 0.03


def fixed_point(x):
    m = sphere_moments(x)[None]
    return mgdk(m, 1.0, isotropic(marker_noise(m, bounded=False).sigma, 3)).centre


# What each should give for the points (N, 3) of one set, whose noise is SIGMA.
ALONE = {
    "gdke": lambda x: gdke(sphere_moments(x)).centre,
    "ugdk": lambda x: mgdk(sphere_moments(x), SIGMA).centre,
    "ugdk_fixed_point": fixed_point,
    "sgdk": lambda x: sgdk(sphere_moments(x), SIGMA).centre,
    "igdk": lambda x: mgdk(sphere_moments(x), SIGMA).centre,
    "lls": lambda x: lls(x).centre,
    "pratt": lambda x: pratt(sphere_moments(x)).centre,
    "mle": lambda x: mle(x).centre,
    "mle_from_mean": lambda x: mle(x, start=x.mean(axis=0)).centre,
}


@pytest.fixture(scope="module")
def points():
    rng = np.random.default_rng(8)
    return cap(rng, (4, 300), 40.0) + [0.0, 0.0, 2.0] + SIGMA * rng.normal(size=(4, 300, 3))


def test_every_contender_is_tried():
    assert set(ALONE) == set(CONTENDERS)


@pytest.mark.parametrize("key", ALONE)
def test_a_contender_is_the_estimator_of_its_name(points, key):
    found = CONTENDERS[key].centres(points, SIGMA)
    # The answers of two estimators differ by a hundredth and more here.
    np.testing.assert_allclose(found, [ALONE[key](x) for x in points], rtol=0, atol=1e-6)


def test_the_fixed_point_is_the_one_that_may_run_away():
    """Of small caps with much noise some take all of their depth for noise, which Pratt's bound forbids."""
    rng = np.random.default_rng(10)
    x = cap(rng, (400, 100), 20.0) + SIGMA * rng.normal(size=(400, 100, 3))
    free = CONTENDERS["ugdk_fixed_point"].centres(x, SIGMA)
    assert np.linalg.norm(free, axis=1).max() > 100


def test_the_mle_that_starts_from_the_mean_does_so(points, monkeypatch):
    starts = []

    def look(x, start):
        starts.append(start)
        return mle_answer(x, start)

    monkeypatch.setattr(contenders, "mle_answer", look)
    CONTENDERS["mle_from_mean"].centres(points, SIGMA)
    np.testing.assert_array_equal(starts, points.mean(axis=1))


def test_a_fit_that_has_not_converged_is_no_answer(monkeypatch):
    x = even_cap(np.random.default_rng(1), (2, 100), 1.0)
    monkeypatch.setattr("mocap_skel.spherefit.least_squares.PLANE", 0.0)
    assert np.isnan(CONTENDERS["mle"].centres(x, 0.0)).all()


def test_a_contender_has_a_centre_for_every_set_or_nan():
    rng = np.random.default_rng(8)
    points = even_cap(rng, (3, 60), 1.5) + [0.0, 0.0, 2.0]
    points[1, :, 2] = 1.0
    points[1, :, :2] *= 0.0
    for key, contender in CONTENDERS.items():
        if key in ("mle_from_mean", "sgdk"):
            continue
        centres = contender.centres(points, 0.0)
        assert centres.shape == (3, 3), key
        np.testing.assert_allclose(centres[[0, 2]], [[0, 0, 2]] * 2, rtol=0, atol=1e-9)
        assert np.isnan(centres[1]).all(), key

"""The sphere fits that a fit may use: what each of them promises, and joints that it cannot fit."""

import re
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from arms import HINGE, TWO_ARMS, TWO_ARMS_MARKERS, association, two_arms_moving
from centres import centre_of
from commands import STILL
from fitted import ROUNDING, full_range, full_range_fit, joints, lengths
from recordings import constant_error, fit_clip, fit_recording

from mocap_skel import read_clip
from mocap_skel.artificial import Faults
from mocap_skel.errors import FitError
from mocap_skel.joints.choices import BEST, SHAPED
from mocap_skel.segments.noise import NOISES
from mocap_skel.spherefit import METHODS, mgdk, mle, sphere_moments
from mocap_skel.spherefit import methods as methods_module

HALF = Faults(sigma=0.0005)
PLAIN = tuple(method for method in METHODS if method not in SHAPED)


class TestMethods:
    @pytest.mark.parametrize("method", SHAPED)
    def test_the_thesiss_own_keep_the_promise(self, method):
        fit = full_range_fit(method=method)
        error = lengths(fit, full_range())
        # What the project promises for 1 mm of noise (test_accuracy).
        assert len(error) == 14
        assert error.max() <= 0.002
        assert np.median(error) <= 0.0005
        assert {joint.shown for joint in fit.joints} == {"yes"}

    @pytest.mark.parametrize("method", PLAIN)
    def test_the_others_are_near_but_for_what_the_parents_frame_does(self, method):
        fit = full_range_fit(method=method)
        assert all(joint.fitted for joint in fit.joints)
        for joint, error in zip(fit.joints, lengths(fit, full_range()), strict=True):
            if joint.joint.endswith(("Elbow", "Knee")):
                # The noise of a frame on two markers, which these do not know: 3 to 5 mm (docs), and
                # four standard errors.
                assert error <= 0.005 + 4 * joint.worst_error
            else:
                assert error <= 0.002

    @pytest.mark.parametrize("method", PLAIN)
    def test_what_they_leave_of_the_frames_noise_is_its_square(self, method):
        """With half of the very same noise a quarter of the bias, and half of what chance does."""
        full, half = full_range_fit(method=method), full_range_fit(HALF, method=method)
        for a, b in zip(full.joints, half.joints, strict=True):
            if a.joint.endswith(("Elbow", "Knee")):
                bias = constant_error(full, full_range(), a)
                quarter = constant_error(half, full_range(HALF), b)
                # e(σ) = b σ² + n σ, so that e(σ) - 4 e(σ/2) is -n σ: chance alone, four standard errors.
                assert np.linalg.norm(bias - 4 * quarter) <= 4 * a.worst_error
                # The standard error counts what is smooth in the residuals too, and so some of the bias.
                assert np.linalg.norm(bias) > 3 * a.worst_error

    @pytest.mark.parametrize("method", ["ugdk", "mgdk"])
    def test_ugdk_and_mgdk_are_what_is_best_where_everything_is_shown(self, method):
        for a, b in zip(full_range_fit(method=method).joints, full_range_fit().joints, strict=True):
            np.testing.assert_allclose(a.centre, b.centre, rtol=0, atol=ROUNDING)
            assert a.method == b.method == ("UGDK" if len(a.markers) == 1 else "MGDK")
        assert {len(joint.markers) == 1 for joint in full_range_fit().joints} == {True, False}

    @pytest.mark.parametrize("method", [m for m in METHODS if m not in ("ugdk", "mgdk")])
    def test_a_joint_says_what_fitted_it(self, method):
        assert {joint.method for joint in full_range_fit(method=method).joints} == {method.upper()}

    def test_gdke_and_lls_are_one_answer(self):
        for a, b in zip(
            full_range_fit(method="gdke").joints, full_range_fit(method="lls").joints, strict=True
        ):
            np.testing.assert_allclose(a.centre, b.centre, rtol=0, atol=ROUNDING)
            np.testing.assert_allclose(a.radius, b.radius, rtol=0, atol=ROUNDING)
            assert a.sigma == b.sigma == 0.0

    def test_sgdk_of_a_whole_ball_is_mgdk(self):
        for a, b in zip(full_range_fit(method="sgdk").joints, full_range_fit().joints, strict=True):
            np.testing.assert_allclose(a.centre, b.centre, rtol=0, atol=ROUNDING)

    def test_igdk_is_mgdk_with_one_level_and_no_lever(self):
        rng = np.random.default_rng(6)
        height = rng.uniform(0.3, 1.0, 500)
        turn = rng.uniform(0, 2 * np.pi, 500)
        side = np.sqrt(1 - height**2)
        ball = np.column_stack([side * np.cos(turn), side * np.sin(turn), height])
        inside = np.stack([0.2 * ball, 0.3 * ball], axis=1) + [0.3, 0.0, 0.1]
        inside += 0.001 * rng.normal(size=inside.shape)
        # A frame on one marker has no lever: all that is left is one level for all.
        found = centre_of(inside, 0.001, method="igdk")
        same = mgdk(sphere_moments(inside.swapaxes(0, 1)), found.sigma)
        assert 0 < found.sigma <= 0.001
        np.testing.assert_allclose(found.centre, same.centre, rtol=0, atol=ROUNDING)

    def test_igdk_of_a_figure_is_mgdk_where_frames_are_wide(self):
        for a, b in zip(full_range_fit(method="igdk").joints, full_range_fit().joints, strict=True):
            if a.parent in ("Hips", "Chest"):
                # Wide frames of four and of seven markers: their noise is less than what chance does.
                assert np.linalg.norm(a.centre - b.centre) <= 4 * b.worst_error

    @pytest.mark.parametrize("method", METHODS)
    def test_without_noise_every_method_is_exact(self, method):
        clean = full_range(None)
        recording = replace(
            clean,
            points=clean.points[::4],
            truth={joint: track[::4] for joint, track in clean.truth.items()},
        )
        fit = fit_recording(recording, method=method)
        # The MLE's tolerance is 1e-13 of the residuals' sum of squares, its root 3e-7 of a metre's.
        assert lengths(fit, recording).max() <= (1e-9 if method == "mle" else ROUNDING)

    def test_an_mle_that_does_not_converge_is_no_joint(self, monkeypatch):
        monkeypatch.setattr(methods_module, "mle", partial(mle, most=2))
        fit = fit_recording(full_range(), method="mle", prior="none")
        assert {joint.shown for joint in fit.joints} == {"no"}
        assert {joint.reason for joint in fit.joints} == {"MLE did not converge"}
        assert any("place holders" in note for note in fit.notes)

    def test_markers_that_the_mle_never_sees_do_not_trouble_it(self):
        recording = full_range()
        points = recording.points.copy()
        points[:, recording.labels.index("RTHI")] = np.nan
        fit = fit_recording(replace(recording, points=points), method="mle")
        assert joints(fit)["RightHip"].markers == ("RKNE",)
        assert joints(fit)["RightHip"].shown == "yes"


REST = ((0, 0),) * 3
RANGES = {"not at all": REST, "a hinge": HINGE, "1°": ((-1, 1),) * 3}
ALL_WAYS = [
    (method, noise)
    for method in (BEST, *METHODS)
    for noise in NOISES
    if noise == "rigid" or method in (BEST, "mgdk")
]


@pytest.fixture(scope="module")
def arms(tmp_path_factory):
    """The association of a trunk with two arms."""
    return association(TWO_ARMS, TWO_ARMS_MARKERS, tmp_path_factory.mktemp("arms"))


class TestDegenerateJoints:
    @pytest.mark.parametrize(
        ("right", "sigma", "method", "noise"),
        [
            *(
                (r, s, BEST, "rigid")
                for r in RANGES
                for s in (0.0, 0.0003)
                if (r, s) != ("1°", 0.0)
            ),
            *(("a hinge", 0.0003, *way) for way in ALL_WAYS[1:]),
        ],
    )
    def test_a_joint_that_is_not_shown_is_none_and_says_why(
        self, arms, right, sigma, method, noise
    ):
        fit = fit_recording(two_arms_moving(RANGES[right], sigma), arms, method=method, noise=noise)
        left, not_shown = fit.joints
        assert left.shown == "yes"
        assert not_shown.shown == "no"
        if not_shown.fitted:
            assert re.search("moves|turns about one axis only", not_shown.reason)
        else:
            assert not_shown.reason.startswith(f"{method.upper()}: the ")
            assert any(f"RightJoint ({method.upper()}: " in note for note in fit.notes)

    @pytest.mark.parametrize("method", ["gdke", "ugdk", "mgdk", "lls", "mle", "pratt"])
    def test_a_joint_at_rest_has_no_sphere(self, arms, method):
        """But best and sgdk, which leave out what is not shown, and igdk, which sees rounding."""
        fit = fit_recording(two_arms_moving(RANGES["not at all"]), arms, method=method)
        assert not fit.joints[1].fitted
        assert "do not span a sphere" in fit.joints[1].reason
        assert "Right" not in fit.segments

    def test_a_clip_without_any_sphere_says_so(self, arms):
        recording = two_arms_moving(RANGES["not at all"], left=RANGES["not at all"])
        with pytest.raises(FitError, match="no joint can be fitted: GDKE: the points do not span"):
            fit_recording(recording, arms, method="gdke")
        assert all(joint.shown == "no" for joint in fit_recording(recording, arms).joints)

    @pytest.mark.parametrize(("method", "noise"), ALL_WAYS)
    def test_someone_who_stands_still_shows_no_joint_to_any_method(self, method, noise):
        fit = fit_clip(read_clip(STILL), method=method, noise=noise)
        assert {joint.shown for joint in fit.joints} == {"no"}
        for joint in fit.joints:
            if not joint.fitted:
                assert joint.reason.startswith(f"{method.upper()}: ") or joint.reason.endswith(
                    "has no pose"
                )

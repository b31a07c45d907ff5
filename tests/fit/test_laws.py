"""What must not change a fit, or must change it in a known way: the lab, the unit, the order, the side."""

from dataclasses import replace

import numpy as np
import pytest
from fitted import (
    ROUNDING,
    SHORT,
    assert_same_evidence,
    assert_same_fit,
    joints,
    seen,
    short,
    short_fit,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings import fit_clip, fit_recording
from scipy.spatial.transform import Rotation

from mocap_skel import read_clip
from mocap_skel.artificial import Faults, merge, write_c3d

LAWS = settings(derandomize=True, deadline=None, max_examples=5, database=None)


class TestLaws:
    """What must not change the result."""

    @LAWS
    @given(st.integers(0, 2**32 - 1))
    def test_moving_and_turning_the_lab_moves_the_tracks_with_it_and_nothing_else(self, seed):
        rng = np.random.default_rng(seed)
        turn = Rotation.random(random_state=rng).as_matrix()
        shift = rng.uniform(-5, 5, 3)
        recording = short()
        fit = fit_recording(replace(recording, points=recording.points @ turn.T + shift))
        assert_same_evidence(short_fit(), fit)
        for (name, a), (_, b) in zip(short_fit().tracks(), fit.tracks(), strict=True):
            np.testing.assert_allclose(
                a @ turn.T + shift, b, rtol=0, atol=ROUNDING, equal_nan=True, err_msg=name
            )

    @pytest.mark.parametrize("unit", ["cm", "dm", "m"])
    def test_the_unit_of_the_file_changes_nothing(self, tmp_path, unit):
        for name in ("mm", unit):
            write_c3d(short(), tmp_path / f"{name}.c3d", name)
        a, b = (fit_clip(read_clip(tmp_path / f"{name}.c3d")) for name in ("mm", unit))
        # Each file rounds coordinates of up to 2 m to 24 bits, 2^-24 m at most. The fit multiplies noise
        # by four (1 mm with gaps leaves 4 mm), frames by six more, as for ROUNDING.
        assert_same_evidence(a, b, tolerance=4 * 6 * 2.0**-24, counts=False)
        for (name, x), (_, y) in zip(a.tracks(), b.tracks(), strict=True):
            np.testing.assert_array_equal(seen(x), seen(y), err_msg=name)

    @LAWS
    @given(st.integers(0, 2**32 - 1))
    def test_the_order_of_markers_changes_nothing(self, seed):
        recording = short()
        order = np.random.default_rng(seed).permutation(len(recording.labels))
        shuffled = replace(
            recording,
            points=recording.points[:, order],
            labels=tuple(recording.labels[i] for i in order),
        )
        assert_same_fit(short_fit(), fit_recording(shuffled))

    @LAWS
    @given(st.integers(0, 2**32 - 1))
    def test_the_order_of_frames_changes_no_constant(self, seed):
        recording = short()
        order = np.random.default_rng(seed).permutation(len(recording.points))
        pure = fit_recording(recording, prior="none")
        fit = fit_recording(replace(recording, points=recording.points[order]), prior="none")
        # Independent samples are counted by how errors hang together in time.
        assert_same_evidence(pure, fit, counts=False)
        for (name, a), (_, b) in zip(pure.tracks(), fit.tracks(), strict=True):
            np.testing.assert_allclose(
                a[order], b, rtol=0, atol=ROUNDING, equal_nan=True, err_msg=name
            )

    def test_backwards_in_time_all_evidence_is_the_same(self):
        recording = short()
        fit = fit_recording(replace(recording, points=recording.points[::-1]))
        assert_same_evidence(short_fit(), fit)

    def test_markers_of_something_else_change_nothing(self):
        recording = short()
        rng = np.random.default_rng(5)
        other = rng.normal(size=(len(recording.points), 3, 3))
        more = replace(
            recording,
            points=np.concatenate([other[:, :1], recording.points, other[:, 1:]], axis=1),
            labels=("ball", *recording.labels, "wand1", "*17"),
        )
        assert_same_fit(short_fit(), fit_recording(more))

    def test_a_second_subject_changes_nothing(self):
        other = replace(short(Faults(sigma=0.003, slide=0.02), seed=9))
        both = merge({"Ben": other, "Anna": short()})
        fit = fit_recording(both, subject="Anna")
        assert fit.subject == "Anna"
        assert_same_fit(short_fit(), fit)
        assert fit_recording(both, subject="Ben").sigma != fit.sigma

    @pytest.mark.parametrize("sigma", [0.0, 0.001])
    def test_mirrored_data_give_mirrored_joints(self, sigma):
        recording = short(replace(SHORT, sigma=sigma))
        fit = fit_recording(recording)

        def other_side(name):
            if name.startswith(("Left", "Right")):
                return name.replace("Left", "?").replace("Right", "Left").replace("?", "Right")
            return name

        def other_marker(name):
            twin = {"L": "R", "R": "L"}.get(name[0], name[0]) + name[1:]
            return twin if twin in recording.labels or twin[1:] in ("TIB", "ARM") else name

        labels = tuple(map(other_marker, recording.labels))
        assert sorted(labels) == sorted(recording.labels) and labels != recording.labels
        mirrored = fit_recording(
            replace(recording, points=recording.points * [1, -1, 1], labels=labels)
        )
        found = joints(mirrored)
        # An upper median of negated values is the next one below: a step of σ √(2π) / N with noise,
        # here of a third of the 300 frames at least, times the lever of six.
        tolerance = ROUNDING + 6 * sigma * np.sqrt(2 * np.pi) / 100
        for joint in fit.joints:
            twin = found[other_side(joint.joint)]
            np.testing.assert_allclose(
                joint.track * [1, -1, 1], twin.track, rtol=0, atol=tolerance, err_msg=joint.joint
            )
            radius = dict(zip(twin.markers, twin.radius, strict=True))
            np.testing.assert_allclose(
                joint.radius, [radius[other_marker(m)] for m in joint.markers], atol=tolerance
            )
            assert (joint.shown, joint.samples) == (twin.shown, twin.samples)

    def test_a_figure_of_twice_the_size_has_joints_twice_as_far(self):
        recording = short()
        fit = fit_recording(replace(recording, points=2 * recording.points))
        assert fit.sigma == pytest.approx(2 * short_fit().sigma, rel=1e-9)
        for a, b in zip(short_fit().joints, fit.joints, strict=True):
            np.testing.assert_allclose(2 * a.centre, b.centre, rtol=0, atol=ROUNDING)
            np.testing.assert_allclose(2 * a.standard_error, b.standard_error, rtol=1e-9)
            assert a.angle == pytest.approx(b.angle, rel=1e-9)

    def test_two_runs_are_the_same_to_the_bit(self):
        assert_same_fit(short_fit(), fit_recording(short()))

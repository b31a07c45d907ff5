"""Faults of artificial clips: outliers and swaps, as many and where they were asked for."""

import numpy as np
import pytest
from faulty import faulty

from mocap_skel.artificial import Swap


class TestFaults:
    def test_outliers_are_as_many_and_as_far_as_asked(self):
        recording, plain = faulty(0, outliers=0.02, outlier_burst=5), faulty(0)
        away = np.linalg.norm(recording.points - plain.points, axis=2)
        np.testing.assert_allclose(away[recording.wrong], 0.5, atol=1e-12)
        assert (away[~recording.wrong] == 0).all()
        # 49,200 samples in bursts of 5: 0.02 ± 4 * √(0.02 * 2 * 5 / 49200) = ± 0.008.
        assert recording.wrong.mean() == pytest.approx(0.02, abs=0.008)

    def test_a_swap_exchanges_two_markers(self):
        recording, plain = faulty(0, swaps=(Swap("LKNE", "RKNE", 10, 20),)), faulty(0)
        left, right = (plain.labels.index(label) for label in ("LKNE", "RKNE"))
        np.testing.assert_array_equal(recording.points[10:20, left], plain.points[10:20, right])
        np.testing.assert_array_equal(recording.points[20:, left], plain.points[20:, left])
        assert recording.wrong.sum() == 20

    def test_a_clip_without_them_has_no_wrong_samples(self):
        assert faulty(0).wrong.size == 0

    def test_missing_samples_are_not_wrong(self):
        recording = faulty(0, outliers=0.1, dropout=0.3)
        assert np.isfinite(recording.points[recording.wrong]).all()

    @pytest.mark.parametrize(
        "faults",
        [{"outliers": 1.0}, {"outlier_burst": 0.5}, {"swaps": (Swap("LKNE", "NONE"),)}],
    )
    def test_refused(self, faults):
        with pytest.raises(ValueError, match=r"outlier|not in the set"):
            faulty(0, **faults)

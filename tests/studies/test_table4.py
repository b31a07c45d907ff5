"""The thesis's table of methods (Table 4) and its counts of operations."""

import sys

import numpy as np
import pytest
from findings import EPS

from mocap_skel.studies import table4
from mocap_skel.studies.contenders import CONTENDERS, Contender
from mocap_skel.studies.flops import figure_flops, frame_flops


@pytest.fixture(scope="module")
def rows():
    return {row.name: row for row in table4.methods(seed=1, trials=20)}


class TestTable4:
    def test_it_has_the_thesiss_seven_and_pratt(self, rows):
        assert set(rows) == {"MLE", "LLS", "GDKE", "UGDK", "SGDK", "MGDK", "IGDK", "Pratt"}
        assert all(row.for_it and row.against_it for row in rows.values())
        flops = {name: row.flops for name, row in rows.items() if row.flops}
        assert flops == {"LLS": 236, "GDKE": 26, "UGDK": 26, "MGDK": 26, "IGDK": 123}

    def test_times_are_by_gdkes(self, rows):
        assert rows["GDKE"].time == 1.0
        # What takes hundreds of milliseconds against one or two is slower on any machine.
        assert rows["MLE"].time > 3 and rows["LLS"].time > 2

    def test_errors_are_by_the_bound(self, rows):
        for row in rows.values():
            whole, cap45, cap20 = row.errors
            # 20 trials in three directions: 1/√120, four of which are allowed.
            assert whole == pytest.approx(1.0, abs=4 / np.sqrt(120))
            # LLS is GDKE: nothing is better than what the bound allows by chance.
            assert min(cap45, cap20) > 1 - 4 / np.sqrt(2 * 20)
        for name in ("MLE", "Pratt"):
            assert rows[name].errors[2] < 1.5 * (1 + 4 / np.sqrt(2 * 20))
        assert rows["GDKE"].errors[2] == pytest.approx(rows["LLS"].errors[2], rel=1e-6)
        assert rows["GDKE"].errors[2] > 5

    def test_each_condition_has_its_noise_and_digits_are_shares_of_the_radius(self, monkeypatch):
        """An estimator that is a centimetre off a sphere of ten, 10 m away, has lost a tenth."""
        asked = []

        def off(points, noise):
            asked.append(noise)
            return np.tile([0.01, 0.0, 10.0], (len(points), 1))

        monkeypatch.setitem(CONTENDERS, "gdke", Contender("GDKE", off))
        monkeypatch.setattr(table4, "_WORDS", {"GDKE": ("gdke", "for", "against")})
        monkeypatch.setattr(table4, "time_methods", lambda *call: {"gdke": 0.5})
        (row,) = table4.methods(trials=2)
        assert row.digits == pytest.approx(0.1)
        assert asked == [0.01, 0.01, 0.03, 0.0]
        # By hand: √(0.01² + 10²) over the bound of a whole sphere, 3 σ/√1000.
        assert row.errors[0] == pytest.approx(np.hypot(0.01, 10) / (3 * 0.01 / np.sqrt(1000)))

    def test_times_are_shares_of_gdkes_and_a_missing_library_leaves_its_row_empty(
        self, monkeypatch
    ):
        monkeypatch.setitem(sys.modules, "scipy.optimize", None)
        monkeypatch.setattr(
            table4, "time_methods", lambda x, noise, names: {n: 1.0 + (n == "lls") for n in names}
        )
        rows = {row.name: row for row in table4.methods(trials=2)}
        assert (rows["MLE"].time, rows["MLE"].errors, rows["MLE"].digits) == (None, None, None)
        assert (rows["LLS"].time, rows["GDKE"].time) == (2.0, 1.0)

    def test_lls_loses_digits_far_from_the_origin(self, rows):
        assert rows["LLS"].digits > 100 * rows["GDKE"].digits
        # A centimetre-wide cap's rounding at ten metres: 2⁻⁵³ × 10 m / 0.1 m, times r²/λ_min = 48.
        assert all(row.digits < 48 * 100 * EPS for name, row in rows.items() if name != "LLS")


class TestFlops:
    def test_the_thesiss_figure_takes_708(self):
        assert figure_flops(14, 5) == 708

    def test_a_segments_system(self):
        assert [frame_flops(m) for m in (1, 2, 3, 4, 9)] == [54, 57, 39, 39, 39]

    def test_a_system_that_needs_its_parents_costs_that_too(self):
        assert frame_flops(2, parent=39) == 57 + 39
        assert frame_flops(1, parent=frame_flops(2, 39)) == 54 + 57 + 39
        assert frame_flops(3, parent=39) == 39

    def test_segments_of_two_markers_or_one_add_their_joint(self):
        for more in ({"two": 4}, {"one": 4}, {"two": 1, "one": 3}):
            assert figure_flops(14, 5, **more) == 708 + 4 * 18
        # (247) is (239) and a point.
        assert frame_flops(2) == frame_flops(3) + 18

    @pytest.mark.parametrize("markers", [0, -1])
    def test_no_marker_is_no_system(self, markers):
        with pytest.raises(ValueError, match="without a marker"):
            frame_flops(markers)

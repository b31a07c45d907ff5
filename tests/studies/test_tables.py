"""What the studies found, as rows, CSV and text."""

import csv
import io
import json

import numpy as np
from findings import a_score, a_trial, mirrored, scattered

from mocap_skel.export.tables_csv import rows_csv
from mocap_skel.report.terminal import rows_table
from mocap_skel.studies import accuracy, speed, tables
from mocap_skel.studies.accuracy import Plan, score_markers, score_noise
from mocap_skel.studies.resample import Group, Law, summarise


class TestTables:
    def test_rows_as_csv_have_nine_digits_and_empty_cells_for_what_is_not_known(self):
        rows = [
            {"name": "a, b", "x": 0.1 + 0.2, "y": None, "n": 3},
            {"name": "", "x": float("nan"), "y": 1e-300, "n": 10**12},
        ]
        assert rows_csv(rows) == 'name,x,y,n\n"a, b",0.3,,3\n,,1e-300,1000000000000\n'

    def test_numpys_numbers_are_numbers_too(self):
        text = rows_csv([{"x": np.float64(1) / 3, "y": np.float64("nan"), "z": np.int64(2)}])
        assert text == "x,y,z\n0.333333333,,2\n"

    def test_rows_for_the_terminal_are_set_out_in_columns(self):
        rows = [
            {"joint": "Hip", "sd_x": 0.00012345678, "n": 4, "thesis": None},
            {"joint": "LeftKnee", "sd_x": float("nan"), "n": 12, "thesis": 2.0},
        ]
        assert rows_table(rows).splitlines() == [
            "joint          sd x   n  thesis",
            "Hip       0.0001235   4       -",
            "LeftKnee          -  12       2",
        ]

    def test_every_table_is_plain_numbers_and_words(self):
        rng = np.random.default_rng(9)
        found = summarise(scattered(rng, 20) + scattered(rng, 20, at=(0.3, 0, 0), frame="x y z"))
        trials = [a_trial(), a_trial(50_000)]
        every = [
            tables.answer_rows(found, found.answers), tables.mean_rows(found.groups, {}),
            tables.deviation_rows(found.groups), tables.law_rows(found.laws, {}),
            tables.trial_rows(trials), tables.ratio_rows(speed.ratios(trials)),
            tables.score_rows([a_score("gdke", 2.0)]),
            tables.noise_rows(score_noise(Plan(count=30, trials=2))[:2]),
            tables.marker_rows(score_markers(Plan(count=30, trials=2))[:2]),
        ]  # fmt: skip
        for rows in every:
            assert rows
            assert json.loads(json.dumps(rows)) == rows or "NaN" in json.dumps(rows)
            assert len({tuple(row) for row in rows}) == 1
            read = list(csv.DictReader(io.StringIO(rows_csv(rows))))
            assert [list(row) for row in read] == [list(row) for row in rows]

    def test_an_answers_row_tells_its_cluster_and_its_deviation(self):
        found = summarise(mirrored([100, 400], lambda n: 0.2 / n))
        rows = tables.answer_rows(found, found.answers)
        assert list(rows[0])[:4] == ["pass", "level", "frames", "joint"]
        assert [row["cluster"] for row in rows] == [1] * 4
        np.testing.assert_allclose([row["deviation"] for row in rows], [0.002] * 2 + [0.0005] * 2)

    def test_scores_go_by_the_names_of_the_estimators(self):
        (row,) = tables.score_rows([a_score("ugdk_fixed_point", 2.0)])
        assert row["method"] == "UGDK, σ by fixed point" and row["breaks"] is True
        (row, *_) = tables.noise_rows(
            [accuracy.NoiseScore(45.0, (1.0, 2.0, 3.0), "x", None, 0.0, 1.0, 0.0)]
        )
        assert (row["sigma_x"], row["sigma_y"], row["sigma_z"]) == (1.0, 2.0, 3.0)

    def test_every_column_has_its_own_value(self):
        one, two, three = (np.array([k, k + 0.1, k + 0.2]) for k in (1.0, 2.0, 3.0))
        group = Group("Hip", 2, 7, "a b c", "MGDK", one, two, three)
        (row,) = tables.mean_rows([group], {"Hip": "weak"})
        assert row == {
            "joint": "Hip", "cluster": 2, "answers": 7, "mean_x": 1.0, "mean_y": 1.1, "mean_z": 1.2,
            "shown": "weak", "method": "MGDK", "frame": "a b c",
        }  # fmt: skip
        (row,) = tables.deviation_rows([group])
        assert [row[f"sd_{axis}"] for axis in "xyz"] == [2.0, 2.1, 2.2]
        assert [row[f"sd_about_one_mean_{axis}"] for axis in "xyz"] == [3.0, 3.1, 3.2]
        laws = [Law(name, 9, -0.5, 0.1, -0.4, 0.01, 0.9) for name in ("Hip", "all")]
        rows = tables.law_rows(laws, {"Hip": "no"})
        assert [row["shown"] for row in rows] == ["no", ""]
        score = accuracy.MarkersScore((0.1, 0.2), 30.0, "how", 1.0, 2.0, 0.5, 0.0)
        (row,) = tables.marker_rows([score])
        assert (row["sigma_1"], row["sigma_2"]) == (0.1, 0.2)

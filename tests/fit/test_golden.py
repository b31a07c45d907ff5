"""The command line on the bundled clips against tests/golden, which `make golden` rewrites.

Text is compared exactly. Numbers differ between machines: BLAS and LAPACK sum in an order that hangs
on the processor, medians can step from one sample to the next, and the files hold micrometres. So
lengths may differ by 2e-5 m, far below any effect that a person would call a change, degrees and
effective sample counts (a sum that ends at the first correlation below zero) by a thousandth.

Where the verdict is "no", the motion does not determine the numbers: a direction may be solved or
left out by the last bit of an eigenvalue, and a centre is noise over noise. There the verdict, its
reason and the pattern of what is missing are the result; the numbers are not compared.
"""

import csv
import io
import re

import golden
import numpy as np
import pytest

METRES = 2e-5
SHARE = 1e-3
TEXT = ("joint", "parent", "child", "markers", "samples", "shown", "method", "prior",
        "determined", "angles")  # fmt: skip
LENGTHS = (
    "x",
    "y",
    "z",
    "se_x",
    "se_y",
    "se_z",
    "radius",
    "residual",
    "sigma",
    "weakest_sd",
    "bone",
    "bone_sd",
)
SHARES = ("effective_samples", "theta_deg", "from_motion", "side_difference",
          "axis_x", "axis_y", "axis_z", "axis_se_deg")  # fmt: skip
# Degrees, rounded to hundredths; they are medians over frames.
ERRORS = ("angles_se_deg",)
# Clips and their subjects, as the files are named.
NAMES = ("range_of_motion", "two_dancers.Anna", "two_dancers.Ben", "nearly_still", "gaps")


@pytest.fixture(scope="module")
def fresh():
    return golden.results()


def rows(text):
    return list(csv.DictReader(io.StringIO(text)))


def kept(name):
    return (golden.FOLDER / name).read_text(encoding="utf-8")


def numbers(cell):
    return [float(part) for part in cell.split()]


def unknown(name):
    """Joints with the verdict "no", and the leaves whose pose may rest on them."""
    joints = rows(kept(f"{name}.joints.csv"))
    no = {row["joint"] for row in joints if row["shown"] == "no"}
    return no | {row["child"] for row in joints if row["shown"] == "no"}


def test_the_same_files_are_made(fresh):
    assert sorted(fresh) == sorted(path.name for path in golden.FOLDER.glob("*.csv"))
    assert sorted(fresh) == sorted(f"{n}.{t}.csv" for n in NAMES for t in ("joints", "skeleton"))


@pytest.mark.parametrize("name", NAMES)
def test_the_joints_are_the_same(fresh, name):
    found, expected = (
        rows(text) for text in (fresh[f"{name}.joints.csv"], kept(f"{name}.joints.csv"))
    )
    assert [list(row) for row in found] == [list(row) for row in expected]
    assert set(found[0]) == {*TEXT, *LENGTHS, *SHARES, *ERRORS, "reason"}
    for row, old in zip(found, expected, strict=True):
        where = f"{name}, {old['joint']}"
        for column in TEXT:
            assert row[column] == old[column], f"{where}: {column}"
        # A reason may quote a number.
        assert re.sub(r"\d+", "#", row["reason"]) == re.sub(r"\d+", "#", old["reason"]), where
        for column in (*LENGTHS, *SHARES, *ERRORS):
            assert len(row[column].split()) == len(old[column].split()), f"{where}: {column}"
        if old["shown"] == "no":
            continue
        for column, tolerance in (
            *((c, {"rtol": 0, "atol": METRES}) for c in LENGTHS),
            *((c, {"rtol": SHARE, "atol": 2e-4}) for c in SHARES),
            *((c, {"rtol": SHARE, "atol": 0.011}) for c in ERRORS),
        ):
            np.testing.assert_allclose(
                numbers(row[column]),
                numbers(old[column]),
                **tolerance,
                err_msg=f"{where}: {column}",
            )


@pytest.mark.parametrize("name", NAMES)
def test_the_tracks_are_the_same(fresh, name):
    found, expected = (
        rows(text) for text in (fresh[f"{name}.skeleton.csv"], kept(f"{name}.skeleton.csv"))
    )
    assert [list(row) for row in found] == [list(row) for row in expected]
    left_out = unknown(name)
    for row, old in zip(found, expected, strict=True):
        where = f"{name}, frame {old['frame']}"
        assert (row["frame"], row["time"]) == (old["frame"], old["time"])
        for column in list(old)[2:]:
            assert bool(row[column]) == bool(old[column]), f"{where}: {column}"
            if old[column] and column[:-2] not in left_out:
                assert float(row[column]) == pytest.approx(float(old[column]), abs=METRES), (
                    f"{where}: {column}"
                )


def test_the_comparison_is_not_empty():
    """Most joints of the clips that were made to show them are compared by number."""
    compared = {
        name: sum(row["shown"] != "no" for row in rows(kept(f"{name}.joints.csv")))
        for name in NAMES
    }
    assert compared["range_of_motion"] == 14
    assert min(compared["two_dancers.Anna"], compared["two_dancers.Ben"], compared["gaps"]) >= 10
    for name in NAMES:
        lines = kept(f"{name}.skeleton.csv").splitlines()
        assert len(lines) >= 4
        # First frame 101 in the dance, 1 in the others, and every 100th from there.
        first = 101 if name.startswith("two") else 1
        assert [int(line.split(",")[0]) for line in lines[1:]] == list(
            range(first, first + 100 * (len(lines) - 1), 100)
        )


def test_one_command_writes_them_and_clears_the_old(tmp_path, monkeypatch, fresh):
    monkeypatch.setattr(golden, "FOLDER", tmp_path / "golden")
    monkeypatch.setattr(golden, "results", lambda: fresh)
    (tmp_path / "golden").mkdir()
    (tmp_path / "golden" / "gone.joints.csv").write_text("old")
    golden.main()
    assert {p.name: p.read_text(encoding="utf-8") for p in (tmp_path / "golden").iterdir()} == fresh

"""Recordings on disk: C3D that other readers understand, the truth as CSV, the command."""

import csv
import struct

import ezc3d
import numpy as np
import pytest
from standard_human import CMU, EXACT, HUMAN, JOINTS, NOISY, SIGMA

from mocap_skel import artificial as art
from mocap_skel.artificial.__main__ import main


@pytest.mark.parametrize("unit", list(art.UNITS))
def test_c3d_round_trip(tmp_path, unit):
    faults = art.Faults(sigma=SIGMA, dropout=0.3)
    clip = art.record(HUMAN, CMU, art.dance(1, 62.5), faults, first_frame=500)
    path = tmp_path / "clip.c3d"
    art.write_c3d(clip, path, unit)
    words = struct.unpack("<10H", path.read_bytes()[:20])
    assert (words[1], words[3], words[4]) == (41, 500, 499 + len(clip.points))
    back = ezc3d.c3d(str(path))
    point = back["parameters"]["POINT"]
    assert tuple(point["LABELS"]["value"]) == clip.labels
    assert point["UNITS"]["value"] == [unit]
    assert (point["X_SCREEN"]["value"], point["Y_SCREEN"]["value"]) == (["+X"], ["+Z"])
    assert point["RATE"]["value"][0] == 62.5
    points = back["data"]["points"][:3].transpose(2, 1, 0) / art.UNITS[unit]
    # Single precision: half a unit in the last place of coordinates up to 2 m.
    np.testing.assert_allclose(points, clip.points, atol=2.0**-23)
    missing = np.isnan(clip.points[..., 0])
    assert missing.any()
    np.testing.assert_array_equal(back["data"]["meta_points"]["residuals"][0].T < 0, missing)
    raw = np.frombuffer(path.read_bytes(), "<f4", clip.points.size // 3 * 4, (words[8] - 1) * 512)
    raw = raw.reshape(*missing.shape, 4)
    np.testing.assert_array_equal(raw[missing], np.tile([0, 0, 0, -1], (missing.sum(), 1)))
    assert list(tmp_path.iterdir()) == [path]


def test_c3d_of_several_subjects(tmp_path):
    one = art.record(HUMAN, CMU, art.still(0.2, 50))
    two = art.record(HUMAN, CMU, art.still(0.2, 50, 1), place=(0, 2, 0))
    clip = art.merge({"Anna": one, "Ben": two})
    assert clip.points.shape == (10, 82, 3)
    np.testing.assert_array_equal(clip.truth["Ben:Neck"], two.truth["Neck"])
    np.testing.assert_array_equal(clip.points[:, clip.labels.index("Ben:LFHD")], two.points[:, 0])
    art.write_c3d(clip, tmp_path / "two.c3d")
    parameters = ezc3d.c3d(str(tmp_path / "two.c3d"))["parameters"]
    assert parameters["SUBJECTS"]["NAMES"]["value"] == ["Anna", "Ben"]
    assert parameters["SUBJECTS"]["LABEL_PREFIXES"]["value"] == ["Anna:", "Ben:"]
    assert list(parameters["SUBJECTS"]["USES_PREFIXES"]["value"]) == [1, 1]
    assert list(parameters["SUBJECTS"]["USED"]["value"]) == [2]
    assert parameters["POINT"]["LABELS"]["value"][41] == "Ben:LFHD"


def test_c3d_of_more_than_255_labels(tmp_path):
    many = {f"M{i:03d}": ("Hips", (0.001 * i, 0.0, 0.0)) for i in range(300)}
    clip = art.record(HUMAN, many, art.still(0.1, 50))
    art.write_c3d(clip, tmp_path / "many.c3d")
    back = ezc3d.c3d(str(tmp_path / "many.c3d"))
    point = back["parameters"]["POINT"]
    assert (*point["LABELS"]["value"], *point["LABELS2"]["value"]) == clip.labels
    assert back["data"]["points"].shape == (4, 300, 5)


def test_c3d_longer_than_its_header_can_count(tmp_path):
    frames, first = 66000, 77
    motion = art.Motion(100.0, np.linspace(0, 1, frames)[:, None] * np.ones(3), {})
    clip = art.record(HUMAN, {"CLAV": CMU["CLAV"]}, motion, first_frame=first)
    path = tmp_path / "long.c3d"
    art.write_c3d(clip, path)
    raw = path.read_bytes()
    words = struct.unpack("<10H", raw[:20])
    assert words[3:5] == (first, 65535)
    stored = np.frombuffer(raw, "<f4", frames * 4, (words[8] - 1) * 512).reshape(frames, 4)
    np.testing.assert_allclose(stored[:, :3], 1000 * clip.points[:, 0], rtol=2.0**-23)
    trial = ezc3d.c3d(str(path))["parameters"]["TRIAL"]
    ends = [trial[f"ACTUAL_{end}_FIELD"]["value"].astype(int) for end in ("START", "END")]
    assert [low % 65536 + 65536 * high for low, high in ends] == [first, first + frames - 1]


def test_c3d_refuses_what_it_cannot_hold(tmp_path):
    clip = art.record(HUMAN, CMU, art.still(0.1, 50), first_frame=65536)
    with pytest.raises(ValueError, match="65535"):
        art.write_c3d(clip, tmp_path / "x.c3d")
    with pytest.raises(ValueError, match="inch"):
        art.write_c3d(EXACT, tmp_path / "x.c3d", "inch")
    with pytest.raises(OSError, match="cannot be written"):
        art.write_c3d(NOISY, tmp_path / "nowhere" / "x.c3d")
    assert list(tmp_path.iterdir()) == []


def read_csv(path):
    with path.open(newline="", encoding="utf-8") as lines:
        head, *rows = csv.reader(lines)
    return head, rows


def test_truth_csv(tmp_path):
    clip = art.record(HUMAN, CMU, art.dance(0.5, 120), first_frame=31)
    art.write_truth(clip, tmp_path / "truth.csv")
    head, rows = read_csv(tmp_path / "truth.csv")
    assert head == ["frame", "time", *(f"{joint}_{axis}" for joint in JOINTS for axis in "xyz")]
    assert [row[0] for row in rows] == [str(31 + i) for i in range(60)]
    assert rows[0][1] == "0.250000"
    assert all(len(cell.split(".")[1]) == 5 for row in rows for cell in row[2:])
    table = np.array(rows, dtype=float)[:, 2:].reshape(60, 14, 3)
    truth = np.stack(list(clip.truth.values()), axis=1)
    np.testing.assert_allclose(table, truth, atol=0.5e-5 + 1e-12)


def test_truth_csv_of_one_subject_among_several(tmp_path):
    ann, anna = (art.record(HUMAN, CMU, art.still(0.1, 50, seed)) for seed in (1, 2))
    both = art.merge({"Ann": ann, "Anna": anna})
    for clip, kwargs, alone in [
        (anna, {}, anna),
        (both, {"subject": "Anna"}, anna),
        (both, {"subject": "Ann"}, ann),
        (art.merge({"A": anna}), {}, anna),
    ]:
        art.write_truth(clip, tmp_path / "truth.csv", **kwargs)
        head, rows = read_csv(tmp_path / "truth.csv")
        assert head[2] == "Waist_x"
        assert len(head) == 44
        waist = np.array(rows, dtype=float)[:, 2:5]
        np.testing.assert_allclose(waist, alone.truth["Waist"], atol=0.5e-5 + 1e-12)
    for clip, subject in [(both, None), (both, "Cleo"), (anna, "Anna")]:
        with pytest.raises(ValueError, match="no subject"):
            art.write_truth(clip, tmp_path / "truth.csv", subject)


def test_command_writes_clip_and_truths(tmp_path, capsys):
    out = tmp_path / "clip.c3d"
    call = [str(out), "--motion", "dance", "--seconds", "1", "--rate", "50", "--sigma", "1mm"]
    call += ["--slide", "0.5cm", "--dropout", "0.2", "--subjects", "Anna,B/n", "--seed", "5"]
    assert main(call) == 0
    printed = capsys.readouterr().out
    assert "seed = 5\n" in printed
    assert "sigma = 0.001\n" in printed
    assert "slide = 0.005\n" in printed
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"clip.c3d", "clip.Anna.truth.csv", "clip.B_n.truth.csv"}
    first = out.read_bytes()
    with pytest.raises(SystemExit, match="2"):
        main(call)
    assert "--overwrite" in capsys.readouterr().err
    assert main([*call, "--overwrite"]) == 0
    assert out.read_bytes() == first


def test_every_fault_of_the_command_reaches_the_recording(tmp_path, monkeypatch):
    seen = []

    def watch(*call, **options):
        seen.append((call[3], options))
        return art.record(*call, **options)

    monkeypatch.setattr("mocap_skel.artificial.__main__.record", watch)
    call = [str(tmp_path / "x.c3d"), "--seconds", "1", "--rate", "20", "--subjects", "Anna,Ben"]
    call += ["--sigma", "1mm", "--correlated", "0.2 cm", "--slide", "0.003", "--dropout", "0.1"]
    call += ["--burst", "3", "--lost", "C7,T10", "--outliers", "0.01", "--outlier-burst", "4"]
    assert main([*call, "--seed", "7", "--first-frame", "5"]) == 0
    faults = art.Faults(
        sigma=0.001, correlated=0.002, slide=0.003, dropout=0.1, burst=3.0, lost=("C7", "T10"),
        outliers=0.01, outlier_burst=4.0,
    )  # fmt: skip
    assert [found for found, _ in seen] == [faults, faults]
    # Each subject has its own motion, its own faults, and stands two metres to the left of the last.
    assert [options for _, options in seen] == [
        {"seed": 7, "first_frame": 5, "place": (0.0, 0.0, 0.0)},
        {"seed": 8, "first_frame": 5, "place": (0.0, 2.0, 0.0)},
    ]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--figure", "quadruped", "--motion", "walk"], "--motion is for the human only"),
        (["--figure", "quadruped", "--stature", "1.8"], "--stature is for the human only"),
        (["--sigma", "1inch"], "not a length"),
        (["--subjects", "Anna,Anna"], "two subjects"),
        (["--dropout", "2"], "share"),
        (["--lost", "TAIL"], "TAIL"),
        (["--seconds", "0"], "no motion"),
    ],
)
def test_command_refuses_in_one_line(tmp_path, capsys, options, message):
    with pytest.raises(SystemExit, match="2"):
        main([str(tmp_path / "clip.c3d"), *options])
    assert message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []

"""The table rig quality: what stands in which row, what is marked, and that a line fits."""

import json

import pytest
from commands import STILL, call

from mocap_skel.report.looks import ALARM
from mocap_skel.report.rig_table import rig_summary, rig_table
from mocap_skel.results.rig_rows import RIG_TABLE, rig_rows
from mocap_skel.rig.quality import Quality, SegmentQuality


def of_segment(name, **changes):
    known = {
        "joint": "Knee", "marker_rms": 0.0081, "filtered_rms": 0.0062, "worst": 0.0314,
        "worst_marker": "RTHI", "worst_frame": 1203, "turn_speed": 712.4, "turn_frame": 1300,
        "skating": None, "marker_skating": None, "floor_distance": None, "filled": 0,
        "guessed": 0.0, "repaired": 0, "absent": 0,
    }  # fmt: skip
    return SegmentQuality(name, **(known | changes))


def quality(*segments, figure=2000):
    return Quality(segments, 0.0081, 0.0062, 0.003, 2000, figure)


def test_only_what_a_person_should_look_at_has_a_row_unless_it_is_wide():
    found = quality(
        of_segment("Hips", joint=None),
        of_segment("Shin", worst=0.0934, repaired=3, look_at=("worst", "repaired")),
    )
    *title, head, row = rig_table(found, ("bvh", "glb")).splitlines()
    assert " ".join(map(str.strip, title)) == (
        "rig quality (bvh, glb): markers 8.1 mm off (6.2 filtered), soles 0.3 cm from the floor, "
        f"{ALARM.sign} look at 1 of 2 segments"
    )
    assert head.split() == [
        "segment",
        "rms",
        "worst",
        "frame",
        "deg/s",
        "frame",
        "repaired",
        "marker",
    ]
    assert row.split() == ["Shin", "8.1", "▲93", "1203", "712", "1300", "▲3", "RTHI"]
    wide = rig_table(found, ("bvh",), wide=True).splitlines()
    assert [line.split()[0] for line in wide[-2:]] == ["Hips", "Shin"]
    assert "filtered" in wide[-3] and "guessed s" in wide[-3]


def test_a_row_with_all_that_can_be_said_fits_99_characters():
    everything = of_segment(
        "UpperRightArm", marker_rms=0.0288, worst=0.186, turn_speed=1512.0, turn_frame=12345,
        worst_frame=12345, skating=0.363, marker_skating=0.2, floor_distance=0.123, filled=1145,
        guessed=0.83, repaired=1145, absent=1145,
        look_at=("marker_rms", "worst", "turn_speed", "skating", "floor_distance", "guessed",
                 "repaired", "absent"),
    )  # fmt: skip
    *_, row = lines = rig_table(quality(everything), ("bvh",)).splitlines()
    assert max(map(len, lines)) <= 99
    assert row.count(ALARM.sign) == 8
    assert row.split()[1:] == [
        "▲28.8", "▲186", "12345", "▲1512", "12345", "▲363", "▲12.3", "▲1145", "▲1145", "▲1145", "RTHI",
    ]  # fmt: skip


def test_a_figure_without_a_fault_is_one_sentence():
    good = quality(of_segment("Hips"), figure=1990)
    assert " ".join(map(str.strip, rig_table(good, ("csv",)).splitlines())) == (
        f"rig quality (csv): {rig_summary(good)}"
    )
    assert rig_summary(good) == (
        "markers 8.1 mm off (6.2 filtered), soles 0.3 cm from the floor, whole in 1990 of 2000 "
        "frames, nothing to look at"
    )
    assert rig_summary(Quality((), None, None, None, 5, 5)) == "nothing to look at"


def test_rows_have_metres_and_what_to_look_at():
    (row,) = rig_rows(quality(of_segment("Shin", worst=0.09341234, look_at=("worst",))))
    assert row["worst"] == 0.093412 and row["turn_speed"] == 712.4
    assert row["floor_distance"] is None and row["look_at"] == ("worst",)


@pytest.mark.parametrize(
    ("told", "formats"),
    [
        (("csv",), []),
        (("csv", "--rigid"), [["csv"]]),
        # The same figure is told once; that of tracks has no filter and its own bones.
        (("csv", "--rigid", "-f", "bvh", "-f", "trc"), [["csv", "trc"], ["bvh"]]),
    ],
)
def test_a_fit_prints_each_rigid_figure_that_is_asked_for_once(tmp_path, told, formats):
    call_ = ("fit", STILL, "-a", "cmu", "-f", *told, "-o", "out", "-q", "--overwrite")
    done = call(*call_, "--json", cwd=tmp_path)
    assert done.returncode == 0
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    figures = [row for row in rows if row.get("table") == RIG_TABLE]
    found = list(dict.fromkeys(tuple(row["formats"]) for row in figures))
    assert [list(one) for one in found] == formats
    assert len(figures) == 15 * len(formats) and len(rows) - len(figures) == 14
    said = call(*call_, cwd=tmp_path).stdout
    assert said.count("rig quality (") == len(formats)

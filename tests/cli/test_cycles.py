"""mocap-skel cycles, --format events, and events in --json, as a user calls them."""

import csv
import json

import pytest
from commands import STILL, call, files, run
from recordings import CLIPS, SAMPLES
from walks import recording_of

from mocap_skel.artificial import write_c3d
from mocap_skel.artificial.gait import gait


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two walks of one person, on the floor and on a treadmill, and files with events."""
    place = tmp_path_factory.mktemp("walks")
    for name, treadmill in (("floor", False), ("belt", True)):
        write_c3d(recording_of(gait(4, 100, treadmill=treadmill).motion), place / f"{name}.c3d")
    return place


def rows(path):
    with path.open() as file:
        return list(csv.DictReader(file))


def test_several_clips_and_both_sides_become_tables_and_a_picture(folder, tmp_path):
    done = run(
        "cycles", folder / "floor.c3d", folder / "belt.c3d", "--assoc", "cmu", "--joint", "Knee",
        "-j", "Hips", "-o", "out", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert files(tmp_path) == [
        f"out/Knee-Hips.cycles{end}" for end in (".csv", ".each.csv", ".png")
    ]
    means = rows(tmp_path / "out" / "Knee-Hips.cycles.csv")
    assert list(means[0]) == ["joint", "angle", "side", "percent", "mean", "sd", "cycles"]
    knee = [row for row in means if (row["joint"], row["angle"]) == ("LeftKnee", "flexion")]
    assert [int(row["percent"]) for row in knee] == list(range(101))
    each = rows(tmp_path / "out" / "Knee-Hips.cycles.each.csv")
    own = {
        (row["clip"], row["start"], row["stop"]) for row in each
        if (row["joint"], row["percent"]) == ("LeftKnee", "0")
    }  # fmt: skip
    assert int(knee[0]["cycles"]) == len(own) >= 4
    assert {clip for clip, *_ in own} == {"floor.c3d", "belt.c3d"}
    assert {(row["side"]) for row in means if row["joint"] == "Hips"} == {"left", "right"}
    assert "the ground goes back at 1." in done.stderr
    assert "foot contacts are found" in done.stderr
    again = run(
        "cycles", folder / "floor.c3d", "-j", "Knee", "-j", "Hips", "-o", "out", cwd=tmp_path
    )
    assert again.returncode == 2
    assert "--overwrite" in again.stderr


def test_the_means_as_json_without_a_picture(folder, tmp_path):
    done = call(
        "cycles", folder / "floor.c3d", "--assoc", "cmu", "-j", "LeftKnee", "--picture", "none",
        "--static", folder / "floor.c3d", "--json", "-q", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert {line["joint"] for line in lines} == {"LeftKnee"}
    assert files(tmp_path) == ["LeftKnee.cycles.csv", "LeftKnee.cycles.each.csv"]


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        ((STILL,), 3, "no gait cycle of LeftHip, RightHip"),
        ((STILL,), 3, "none are found: no foot swings"),
        ((STILL, "--events", "file"), 3, "the file has no foot events"),
        ((STILL, "--joint", "Kne"), 2, "did you mean Knee"),
        ((SAMPLES / "two_dancers.c3d",), 2, "choose with --subject: Anna, Ben"),
    ],
)  # fmt: skip
def test_without_cycles_the_reason_is_said(arguments, code, words, tmp_path):
    done = call("cycles", *arguments, "--assoc", "cmu", "-q", cwd=tmp_path)
    assert done.returncode == code
    assert words in done.stderr
    assert not files(tmp_path)


def test_a_clip_without_a_cycle_does_not_keep_the_others(folder, tmp_path):
    done = call("cycles", STILL, folder / "floor.c3d", "--assoc", "cmu", "-j", "Knee", cwd=tmp_path)
    assert done.returncode == 0
    assert (
        "nearly_still.c3d: no cycle: the file has no foot events, and none are found" in done.stderr
    )
    assert {row["clip"] for row in rows(tmp_path / "Knee.cycles.each.csv")} == {"floor.c3d"}


def test_clips_of_one_name_are_told_apart_and_one_given_twice_is_refused(folder, tmp_path):
    own = [tmp_path / day / "walk.c3d" for day in ("monday", "friday")]
    for path in own:
        path.parent.mkdir()
        path.write_bytes((folder / "floor.c3d").read_bytes())
    rest = ("--assoc", "cmu", "-j", "Knee", "--picture", "none", "-q", "-o", tmp_path / "out")
    done = call("cycles", *own, *rest, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[1].split()[3] == "2"
    each = rows(tmp_path / "out" / "Knee.cycles.each.csv")
    assert {row["clip"] for row in each} == {str(path) for path in own}
    done = call("cycles", own[0], own[1], own[0], *rest[:-1], "other", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert f"{own[0]}: given twice" in done.stderr and not (tmp_path / "other").exists()


def test_a_broken_clip_does_not_lose_the_others(folder, tmp_path):
    """Not one that is cut off, nor one that needs --subject; without any that can be used nothing is written."""
    cut, none = tmp_path / "cut.c3d", tmp_path / "none.c3d"
    cut.write_bytes((folder / "floor.c3d").read_bytes()[:-200_000])
    bad = (cut, SAMPLES / "two_dancers.c3d")
    rest = ("--assoc", "cmu", "-j", "Knee", "--picture", "none", "-q", "-o", "out")
    done = call("cycles", *bad, folder / "floor.c3d", *rest, cwd=tmp_path)
    assert done.returncode == 1
    assert f"error: {cut}: " in done.stderr and "choose with --subject" in done.stderr
    assert done.stderr.endswith("mocap-skel: 2 of 3 clips failed\n")
    each = rows(tmp_path / "out" / "Knee.cycles.each.csv")
    assert {row["clip"] for row in each} == {"floor.c3d"}
    (tmp_path / "same.c3d").write_bytes(bad[1].read_bytes())
    for clips, code in (((*bad, none), 3), ((bad[1], tmp_path / "same.c3d"), 2), ((STILL, cut), 3)):
        done = call("cycles", *clips, *rest[:-1], "other", cwd=tmp_path)
        assert (done.returncode, done.stdout) == (code, "")
        assert done.stderr.count("mocap-skel: error: ") == len(clips)
    assert not (tmp_path / "other").exists()


def test_found_events_as_a_table_and_on_the_page_and_in_the_picture(folder, tmp_path):
    walk = folder / "floor.c3d"
    done = call("fit", walk, "--assoc", "cmu", "--format", "events", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    table = rows(tmp_path / "floor.events.csv")
    assert list(table[0]) == [
        "frame", "time", "event", "side", "context", "subject", "source", "method",
    ]  # fmt: skip
    assert {(row["source"], row["event"]) for row in table} == {
        ("found", "Foot Strike"), ("found", "Foot Off"),
    }  # fmt: skip
    assert {row["method"] for row in table} == {"Zeni 2008", "standing foot"}
    assert "events: the file has no foot events" in done.stderr
    assert call("report", walk, "--assoc", "cmu", "-q", cwd=tmp_path).returncode == 0
    page = (tmp_path / "floor.report.html").read_text()
    assert page.count('<rect class="event"') == len(table)
    assert f'data-frame="{table[0]["frame"]}"' in page
    assert "Foot Strike (found)" in page
    picture = call("draw", walk, "--assoc", "cmu", "--plot", "angles", "-o", "a.svg", cwd=tmp_path)
    assert picture.returncode == 0
    assert "foot contacts that were found" in (tmp_path / "a.svg").read_text()


def test_where_there_are_no_events_the_table_is_empty_and_why_is_said(tmp_path):
    done = call("fit", STILL, "--assoc", "cmu", "--format", "events", cwd=tmp_path)
    assert done.returncode == 0
    assert "events: the file has no foot events, and none are found" in done.stderr
    table = (tmp_path / "nearly_still.events.csv").read_text()
    assert table == "frame,time,event,side,context,subject,source,method\n"


@pytest.mark.real
def test_events_of_a_real_file_in_every_output(tmp_path):
    clip = CLIPS / "functional_hip" / "FunctionalWalk.c3d"
    done = call("fit", clip, "--json", "-q", cwd=tmp_path)
    events = [json.loads(line) for line in done.stdout.splitlines() if '"events"' in line]
    assert [(e["frame"], e["side"]) for e in events][:2] == [(544, "right"), (556, "left")]
    looked = call("inspect", clip, cwd=tmp_path)
    assert "11 events in frames 544 to 863: Foot Strike, Foot Off" in looked.stdout
    assert len(json.loads(call("inspect", clip, "--json", cwd=tmp_path).stdout)["events"]) == 11

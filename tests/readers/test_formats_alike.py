"""A recording gives the same joints whatever kind of file it lies in, with every command."""

from __future__ import annotations

import json

import numpy as np
import pytest
from commands import call, run
from table_files import Marked, motive, nexus, plain, qualisys, trc

from mocap_skel import associate, fit_skeleton, read_association, read_clip
from mocap_skel.artificial import Faults, human, marker_set, record, walk, write_c3d
from mocap_skel.readers.registry import read_raw

# Of a text with five decimals of a millimetre.
ROUNDING = 1e-8


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A walk with noise and gaps as C3D and as every other kind of file."""
    folder = tmp_path_factory.mktemp("files")
    faults = Faults(sigma=0.001, dropout=0.02)
    recording = record(human(), marker_set("cmu"), walk(6, 100, seed=3), faults, seed=3)
    write_c3d(recording, folder / "walk.c3d")
    clip = read_clip(folder / "walk.c3d")
    file = Marked(clip.points * 1000, clip.labels)
    commas = file.but(sep=",", unit="Millimeters")
    (folder / "walk.trc").write_text(trc(file))
    (folder / "walk.tsv").write_text(qualisys(file, frame=True, time=True))
    (folder / "walk.csv").write_text(plain(commas, spell="{label}_{axis} [mm]"))
    (folder / "take.csv").write_text(motive(commas))
    (folder / "nexus.csv").write_text(nexus(file.but(sep=",")))
    y_up = file.but(points=file.points[..., [1, 2, 0]])
    (folder / "y_up.trc").write_text(trc(y_up))
    return folder


def fitted(path):
    known = read_association("cmu")
    clip = read_clip(path)
    return fit_skeleton(clip, associate(clip, known)[0], known.skeleton)


@pytest.mark.parametrize(
    "name", ["walk.trc", "walk.tsv", "walk.csv", "take.csv", "nexus.csv", "y_up.trc"]
)
def test_the_joints_are_those_of_the_c3d(files, name):
    expected, found = fitted(files / "walk.c3d"), fitted(files / name)
    for one, other in zip(expected.joints, found.joints, strict=True):
        track = other.track[:, [2, 0, 1]] if name == "y_up.trc" else other.track
        # The sphere fits divide by what the movement spreads: some ten times the rounding.
        np.testing.assert_allclose(track, one.track, atol=1e3 * ROUNDING)
        assert (one.joint, one.shown, one.method) == (other.joint, other.shown, other.method)
    np.testing.assert_array_equal(found.frame_numbers, expected.frame_numbers)
    assert found.rate == expected.rate == 100


def test_which_way_is_up_is_told_by_the_body(files):
    for name, up in (("walk.trc", "z"), ("y_up.trc", "y"), ("take.csv", "z"), ("walk.tsv", "z")):
        done = run("inspect", name, "--assoc", "cmu", "--json", cwd=files)
        assert json.loads(done.stdout.splitlines()[0])["up"] == up


def test_every_command_takes_them(files, tmp_path):
    for name in ("y_up.trc", "take.csv"):
        path = files / name
        done = run(
            "fit", path, "--assoc", "cmu", "--format", "trc", "--format", "bvh", cwd=tmp_path
        )
        assert done.returncode == 0
        for command in (
            ["assoc", "guess", path, "-o", f"{name}.txt"],
            ["assoc", "check", path, "--assoc", "cmu"],
            ["assoc", "page", path, "-o", f"{name}.html"],
            ["calibrate", path, "--assoc", "cmu", "-o", f"{name}.json"],
            ["draw", path, "--assoc", "cmu", "--frame", "7", "-o", f"{name}.png"],
            ["report", path, "--assoc", "cmu"],
        ):
            assert call(*command, cwd=tmp_path).returncode == 0, command
    # A TRC of joints is a file of points like any other.
    joints = read_clip(tmp_path / "y_up.skeleton.trc")
    assert joints.labels[:2] == ("Waist", "Neck") and joints.frames == 600


def test_a_copy_as_c3d_needs_a_c3d(files, tmp_path):
    done = run("fit", files / "walk.trc", "--assoc", "cmu", "--format", "c3d", cwd=tmp_path)
    assert done.returncode == 3
    assert "walk.trc: a copy with the skeleton's points needs an unpacked C3D file" in done.stderr


@pytest.mark.parametrize("first", [0, 1, 100])
@pytest.mark.parametrize(
    ("write", "name", "zero"),
    [
        (trc, "part.trc", 1), (plain, "part.csv", 1), (motive, "part.csv", 0),
        (lambda file: qualisys(file, frame=True, time=True), "part.tsv", 1),
    ],
)  # fmt: skip
def test_frames_and_times_of_a_part_of_a_take_are_those_in_the_file(
    tmp_path, write, name, zero, first
):
    """Motive's frame 0 is at 0 s, as frame 1 is in the files of others."""
    file = Marked(np.ones((9, 1, 3)) * np.arange(1, 10)[:, None, None], ("LASI",), 120, first)
    (tmp_path / name).write_text(write(file.but(sep="\t" if name != "part.csv" else ",")))
    clip = read_clip(tmp_path / name)
    assert (clip.first_frame, clip.zero_frame, clip.rate) == (first, zero, 120)


def test_results_of_a_late_take_of_motive_have_its_frames_and_times(files, tmp_path):
    clip = read_clip(files / "walk.c3d")
    file = Marked(clip.points * 1000, clip.labels, first=100, sep=",", unit="Millimeters")
    (tmp_path / "take.csv").write_text(motive(file))
    fit = fitted(tmp_path / "take.csv")
    assert fit.frame_numbers[0] == 100
    np.testing.assert_allclose(fit.time, 1 + np.arange(600) / 100, rtol=1e-14)
    done = run("fit", "take.csv", "--assoc", "cmu", "--format", "csv", "--format", "trc",
               "--format", "angles", "--format", "events", cwd=tmp_path)  # fmt: skip
    assert done.returncode == 0
    for suffix in ("skeleton.csv", "angles.csv"):
        assert (tmp_path / f"take.{suffix}").read_text().splitlines()[1].startswith("100,1.000000,")
    events = (tmp_path / "take.events.csv").read_text().splitlines()[1:]
    assert events
    for frame, time in (row.split(",")[:2] for row in events):
        assert float(time) == int(frame) / 100
    again = read_clip(tmp_path / "take.skeleton.trc")
    assert (again.first_frame, again.zero_frame) == (100, 0)
    assert run("report", "take.csv", "--assoc", "cmu", cwd=tmp_path).returncode == 0
    page = (tmp_path / "take.report.html").read_text()
    assert '"firstFrame":100,"zeroFrame":0.0,' in page.replace(", ", ",").replace(": ", ":")


def test_times_of_a_clock_are_counted_from_the_first_frame(tmp_path):
    rows = [f"{1.7e9 + i / 50:.2f},1,2,{3 + i}" for i in range(9)]
    (tmp_path / "clock.csv").write_text("\n".join(["time,LASI_x,LASI_y,LASI_z", *rows]))
    clip = read_clip(tmp_path / "clock.csv", unit="mm")
    assert (clip.first_frame, clip.zero_frame, clip.rate) == (1, 1, 50)
    assert "its times are those of a clock: they are counted from the first frame" in clip.notes


@pytest.mark.real
@pytest.mark.parametrize(
    ("name", "sep", "labels", "rate", "first"),
    [
        ("walk_free.trc", "\t", ("R.ASIS", "L.ASIS"), 60, 185),
        ("blanks.trc", "\t", ("LTH3", "T10"), 250, 1),
        ("crlf.trc", "\t", ("R.ASIS", "L.ASIS"), 60, 1),
        ("motive_unlabeled.csv", ",", ("Unlabeled 1036", "Unlabeled 1037"), 360, 0),
        ("qualisys_new_numbers.tsv", "\t", ("New 0000", "New 0002"), 100, 1),
    ],
)
def test_files_of_real_programs(shared_clips, name, sep, labels, rate, first):
    """Against a reading by hand: rows whose first cell is a whole number."""
    path = shared_clips / "other_formats" / name
    raw = read_raw(path)
    rows = [line.split(sep) for line in path.read_text(errors="replace").splitlines()]
    rows = [row for row in rows if row[0].strip().isdigit() and len(row) > 10][-len(raw.points) :]
    size = raw.points[0].size
    cells = [[cell.strip() or "nan" for cell in (row[2:] + [""] * size)[:size]] for row in rows]
    np.testing.assert_array_equal(raw.points, np.array(cells, float).reshape(raw.points.shape))
    clip = read_clip(path)
    assert (clip.labels[:2], clip.rate, clip.first_frame, clip.unit) == (labels, rate, first, "mm")

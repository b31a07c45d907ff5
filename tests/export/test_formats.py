"""TRC and Parquet, by plain parsers and by pyarrow and pandas; what the command line makes of them."""

import subprocess
import sys
from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from recordings import ASSOCIATIONS, SAMPLES, fit_sample, rendered
from trc_files import read_trc

from mocap_skel import points_table, read_clip
from mocap_skel.results.tables import joint_rows

parquet = pytest.importorskip("pyarrow.parquet")


@pytest.mark.parametrize("name", ["gaps", "range_of_motion"])
def test_trc_holds_the_tracks_with_y_up(name):
    fit = fit_sample(name)
    made = rendered("trc", fit)
    text, notes = made.files[".skeleton.trc"], made.notes
    head, names, frames, time, points = read_trc(text)
    assert names == [title for title, _ in fit.tracks()]
    assert np.array_equal(frames, fit.frame_numbers)
    np.testing.assert_allclose(time, fit.time, atol=5.1e-7)
    want = np.stack([track for _, track in fit.tracks()], axis=1)[..., [1, 2, 0]]
    # Written to the micrometre; missing stays missing.
    np.testing.assert_allclose(points, want, atol=5.1e-7)
    assert head["Units"] == "m" and float(head["DataRate"]) == fit.rate
    assert int(head["NumFrames"]) == len(frames) and int(head["NumMarkers"]) == len(names)
    assert int(head["OrigDataStartFrame"]) == fit.frame_numbers[0]
    assert notes == ("TRC: y up, its x, y, z are the clip's y, z, x",)


def test_trc_obeys_up_and_takes_the_markers_along():
    fit, clip = fit_sample("range_of_motion"), read_clip(SAMPLES / "range_of_motion.c3d")
    made = rendered("trc", fit, clip, up="z", markers=True)
    _, names, _, _, points = read_trc(made.files[".skeleton.trc"])
    assert made.notes == ()
    assert set(clip.labels) <= set(names)
    label = clip.labels[3]
    np.testing.assert_allclose(points[:, names.index(label)], clip.points[:, 3], atol=5.1e-7)
    np.testing.assert_allclose(points[:, 0], fit.joints[0].track, atol=5.1e-7)


def test_trc_has_the_markers_of_its_own_subject_and_the_frames_of_the_clip():
    fit, clip = fit_sample("two_dancers", "Ben"), read_clip(SAMPLES / "two_dancers.c3d")
    text = rendered("trc", fit, clip, up="z", markers=True).files[".skeleton.trc"]
    head, names, frames, _, points = read_trc(text)
    own = [i for i, subject in enumerate(clip.subjects) if subject == "Ben"]
    assert names[20:] == [clip.labels[i] for i in own] and len(own) == 41
    np.testing.assert_allclose(points[:, 20:], clip.points[:, own], atol=5.1e-7)
    assert frames[0] == 101 and head["OrigDataStartFrame"] == "101"


def test_trc_names_are_one_word_and_no_two_the_same():
    clip = read_clip(SAMPLES / "nearly_still.c3d")
    clip = replace(clip, labels=("LeftHip", "LeftHip_2", "my  own marker", *clip.labels[3:]))
    made = rendered("trc", fit_sample("nearly_still"), clip, markers=True)
    _, names, _, _, points = read_trc(made.files[".skeleton.trc"])
    assert names[20:23] == ["LeftHip_2", "LeftHip_2_2", "my_own_marker"]
    assert len(set(names)) == len(names)
    # y up: x, y, z are the clip's y, z, x.
    np.testing.assert_allclose(points[:, 20], clip.points[:, 0][:, [1, 2, 0]], atol=5.1e-7)
    said = "TRC: markers whose name a joint has get a number: LeftHip_2, LeftHip_2_2"
    assert said in made.notes


def written(name, folder, **options):
    for suffix, content in rendered("parquet", fit_sample(name), **options).files.items():
        (folder / f"clip{suffix}").write_bytes(content)
    return folder / "clip.skeleton.parquet", folder / "clip.joints.parquet"


def test_parquet_is_long_and_says_unit_and_axes(tmp_path):
    fit = fit_sample("gaps")
    path, _ = written("gaps", tmp_path)
    table = parquet.read_table(path)
    tracks = list(fit.tracks())
    assert table.column_names == [
        "clip",
        "subject",
        "frame",
        "time",
        "point",
        "kind",
        "x",
        "y",
        "z",
    ]
    assert len(table) == len(tracks) * len(fit.frame_numbers)
    said = {k.decode(): v.decode() for k, v in table.schema.metadata.items()}
    assert said["unit"] == "m" and said["up"] == fit.up and float(said["rate"]) == fit.rate
    values = np.stack([track for _, track in tracks], axis=1).reshape(-1, 3)
    for axis, name in enumerate("xyz"):
        column = table[name]
        assert column.null_count == np.isnan(values[:, axis]).sum() > 0
        np.testing.assert_array_equal(column.to_numpy(), values[:, axis])
    kinds = dict(zip(table["point"].to_pylist(), table["kind"].to_pylist(), strict=True))
    assert kinds["Hips"] == "origin" and kinds["LeftHip"] == "joint" and kinds["Head"] == "end"


def test_parquet_and_pandas_have_the_same_table(tmp_path):
    import pandas

    path, _ = written("range_of_motion", tmp_path)
    found = pandas.read_parquet(path).astype({"x": float})
    ours = points_table(fit_sample("range_of_motion"))
    assert list(found.columns) == list(ours.columns)
    for name in ours.columns:
        assert found[name].tolist() == ours[name].tolist(), name


def test_parquet_turns_with_up(tmp_path):
    path, _ = written("range_of_motion", tmp_path, up="y")
    table = parquet.read_table(path)
    fit = fit_sample("range_of_motion")
    assert table.schema.metadata[b"up"] == b"y"
    count = len(list(fit.tracks()))
    np.testing.assert_array_equal(table["y"].to_numpy()[::count], fit.joints[0].track[:, 2])


@pytest.mark.parametrize("name", ["nearly_still", "range_of_motion"])
def test_joints_parquet_has_typed_columns(name, tmp_path):
    _, path = written(name, tmp_path)
    table = parquet.read_table(path)
    fit = fit_sample(name)
    rows = [{"clip": fit.clip, "subject": fit.subject, **row} for row in joint_rows(fit)]
    assert table.to_pylist() == rows
    types = {field.name: str(field.type) for field in table.schema}
    assert types["radius"].startswith("list<") and "double" in types["radius"]
    assert types["samples"] == "int64" and types["x"] == "double" and types["reason"] == "string"


def test_columns_keep_their_type_where_nothing_is_known():
    fit = fit_sample("nearly_still")
    nothing = {"markers": (), "radius": np.empty(0), "centre": np.full(3, np.nan)}
    bare = replace(fit, joints=tuple(replace(joint, **nothing) for joint in fit.joints))
    content = rendered("parquet", bare).files[".joints.parquet"]
    table = parquet.read_table(BytesIO(content))
    types = {field.name: str(field.type) for field in table.schema}
    assert "string" in types["markers"] and "double" in types["radius"]
    assert types["x"] == "double" and table["x"].null_count == 14


def mocap_skel(*arguments, **options):
    command = [sys.executable, "-m", "mocap_skel", "fit", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, **options)


def test_all_formats_in_one_call(tmp_path):
    formats = ("csv", "c3d", "trc", "parquet")
    chosen = [part for name in formats for part in ("-f", name)]
    name = "two_dancers"
    path = SAMPLES / f"{name}.c3d"
    done = mocap_skel(path, "--assoc", ASSOCIATIONS[name], "-o", tmp_path, *chosen)
    assert done.returncode == 0, done.stderr.decode()
    ends = [
        "angles.parquet",
        "joints.csv",
        "joints.parquet",
        "skeleton.c3d",
        "skeleton.csv",
        "skeleton.parquet",
    ]
    want = [f"{name}.{who}.{end}" for who in ("Anna", "Ben") for end in [*ends, "skeleton.trc"]]
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(want)
    # An output is a clip like any other, and its added points are left out of it.
    again = mocap_skel(
        tmp_path / f"{name}.Ben.skeleton.c3d", "--assoc", ASSOCIATIONS[name], "--subject", "Ben",
        "-o", "-",
    )  # fmt: skip
    assert again.returncode == 0
    assert b"joint centres of an earlier fit" in again.stderr
    head, *rows = (tmp_path / f"{name}.Ben.skeleton.csv").read_text().splitlines()
    assert again.stdout.decode().splitlines() == [head, *rows]


def test_bytes_go_to_standard_output_as_they_are(tmp_path):
    path = SAMPLES / "nearly_still.c3d"
    done = mocap_skel(path, "--assoc", "cmu", "-f", "c3d", "-o", "-", "-q")
    assert done.returncode == 0
    target = tmp_path / "copy.c3d"
    target.write_bytes(done.stdout)
    assert read_clip(target).labels == read_clip(path).labels


def test_a_missing_library_is_one_line_before_any_work(tmp_path):
    (tmp_path / "pyarrow.py").write_text("raise ImportError('not here')")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from mocap_skel.cli import main; main()"
    command = [sys.executable, "-c", code, "fit", "nowhere.c3d", "--assoc", "cmu", "-f", "parquet"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.strip().count("\n") == 0
    assert "pip install 'mocap-skel[parquet]'" in done.stderr and "nowhere" not in done.stderr


@pytest.mark.real
def test_trc_of_a_real_clip_with_missing_ends(shared_clips, tmp_path):
    path = shared_clips / "functional_hip" / "FunctionalWalk.c3d"
    done = mocap_skel(
        path, "--assoc", "plug_in_gait_clusters", "-f", "trc", "-f", "csv", "-o", tmp_path
    )
    assert done.returncode == 0
    _, names, _, _, points = read_trc((tmp_path / "FunctionalWalk.skeleton.trc").read_text())
    table = np.genfromtxt(
        tmp_path / "FunctionalWalk.skeleton.csv",
        delimiter=",",
        skip_header=1,
        filling_values=np.nan,
    )
    want = table[:, 2:].reshape(len(table), len(names), 3)[..., [1, 2, 0]]
    np.testing.assert_array_equal(points, want)


def test_a_c3d_keeps_the_axes_of_its_file_and_says_so():
    path = SAMPLES / "nearly_still.c3d"
    made = rendered("c3d", fit_sample("nearly_still"), read_clip(path), path, up="y")
    assert made.notes[0] == "C3D: a copy keeps the file's axes, z up"
    assert len(made.files[".skeleton.c3d"]) > path.stat().st_size
    as_it_is = rendered("c3d", fit_sample("nearly_still"), read_clip(path), path, up="z")
    assert as_it_is == rendered("c3d", fit_sample("nearly_still"), read_clip(path), path)
    assert as_it_is.files == made.files and not as_it_is.notes

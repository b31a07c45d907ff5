"""A unit or an axis that the body contradicts is told by the commands that read a clip."""

import json

import numpy as np
import pytest
from c3d_bytes import c3d_file
from commands import STILL, call, files

from mocap_skel.artificial import human, marker_set, record, walk
from mocap_skel.clip import turn_between


@pytest.mark.parametrize("told", [("--assoc", "cmu"), ()])
def test_a_wrong_unit_stops_the_fit_and_inspect_warns_of_it(tmp_path, told):
    hint = "with --unit mm it is 1.69 m"
    fit = call("fit", STILL, *told, "--unit", "m", "-o", "out", cwd=tmp_path)
    assert fit.returncode == 2
    assert hint in fit.stderr
    assert not files(tmp_path)
    seen = call("inspect", STILL, *told, "--unit", "m", "--json", cwd=tmp_path)
    assert seen.returncode == 0
    (warning,) = json.loads(seen.stdout)["warnings"]
    assert hint in warning


@pytest.mark.parametrize("up", ["x", "-y"])
def test_a_fit_without_options_stands_upright_in_the_files_axes(tmp_path, up):
    recording = record(human(), marker_set("cmu"), walk(3, 60, seed=2), seed=2)
    turn = turn_between(up, "z")
    path = c3d_file(
        tmp_path / "walk.c3d",
        1000 * recording.points @ turn,
        rate=60.0,
        LABELS=list(recording.labels),
    )
    done = call("fit", path, "--format", "csv", "--format", "bvh", "-o", "out", cwd=tmp_path)
    assert done.returncode == 0
    assert done.stderr.count(f"{up} is taken to point up: the body is upright along it") == 1
    lines = (tmp_path / "out" / "walk.bvh").read_text().splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("Frame Time")) + 1
    assert 60 < float(lines[start].split()[1]) < 130
    table = np.genfromtxt(tmp_path / "out" / "walk.skeleton.csv", delimiter=",", names=True)
    hip = np.stack([table[f"LeftHip_{axis}"] for axis in "xyz"], axis=1)
    # The centre is found, not given: 2 cm.
    np.testing.assert_allclose(hip @ turn.T, recording.truth["LeftHip"], rtol=0, atol=0.02)
    stated = call("fit", path, "--clip-up", up, "--format", "bvh", "-o", "again", cwd=tmp_path)
    assert "taken to point up" not in stated.stderr
    assert (tmp_path / "again" / "walk.bvh").read_text().splitlines() == lines

"""Figures other than the standard human: skeleton files, clips generated of them, and what the command makes of both.

Accuracy has a law. A frame that is fitted to n markers with noise σ puts a point c (from their middle) wrong by
σ²(3/n + tr([c]ₓ J⁻¹ [c]ₓᵀ)) in the square, with J = Σ(|m|² I - m mᵀ) the markers' own inertia; a joint's
constant averages over all frames and adds little to it. Seeds are 1 unless a test says otherwise.
"""

import csv
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pybvh
import pytest
from recordings import constant_error, fit_recording

from mocap_skel import read_association
from mocap_skel.artificial import (
    Faults,
    circumduct,
    figure_of,
    human,
    marker_set,
    markers_of,
    range_of_motion,
    ranges_of,
    record,
    write_c3d,
)
from mocap_skel.errors import RootError
from mocap_skel.figure.skeleton import SHIPPED, read_skeleton

ROOT = Path(__file__).parents[2]
SIGMA = 0.001
# Each has an association file of its own name; the other leg and the other arm are in docs/skeletons.md.
FIGURES = ("right_leg", "left_arm", "hand", "quadruped")


def run(*arguments, cwd):
    done = subprocess.run(
        [sys.executable, "-m", *map(str, arguments)],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert "Traceback" not in done.stderr + done.stdout
    return done


def film(name, seed=1, seconds=20, **faults):
    skeleton = read_skeleton(name)
    figure = figure_of(skeleton)
    motion = circumduct(ranges_of(skeleton), seconds, 60, seed)
    return record(figure, markers_of(skeleton, figure), motion, Faults(**faults), seed=seed)


def tracks(path):
    """Joint -> (frames, 3) of a CSV file."""
    with path.open() as file:
        rows = list(csv.DictReader(file))
    names = list(dict.fromkeys(key[:-2] for key in rows[0] if key[-2:] == "_x"))
    number = {
        name: [[float(r[f"{name}_{a}"] or "nan") for a in "xyz"] for r in rows] for name in names
    }
    return {name: np.array(track) for name, track in number.items()}


def frame_noise(name, joint):
    """RMS over frames of a joint's track, by the law above."""
    skeleton = read_skeleton(name)
    figure = figure_of(skeleton)
    child = figure.joints[joint]
    own = [p for segment, p in markers_of(skeleton, figure).values() if segment == child.parent]
    middle = np.mean(own, axis=0)
    markers = np.array(own) - middle
    inertia = (markers**2).sum() * np.eye(3) - markers.T @ markers
    x, y, z = np.array(child.offset) - middle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return SIGMA * np.sqrt(3 / len(own) + np.trace(cross @ np.linalg.inv(inertia) @ cross.T))


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """Each figure filmed and fitted by the two commands, once: folder, standard output and joint rows."""
    done = {}

    def fit(name):
        if name not in done:
            folder = tmp_path_factory.mktemp(name)
            made = run(
                "mocap_skel.artificial", "clip.c3d", "--figure", name,
                "--sigma", "1mm", "--rate", "60", "--seed", "1", cwd=folder,
            )  # fmt: skip
            assert made.returncode == 0, made.stderr
            ran = run(
                "mocap_skel", "fit", "clip.c3d", "--assoc", name,
                "--format", "csv", "--format", "bvh", "--json", cwd=folder,
            )  # fmt: skip
            assert ran.returncode == 0, ran.stderr
            lines = map(json.loads, ran.stdout.splitlines())
            rows = {row["joint"]: row for row in lines if row["table"] == "joints"}
            done[name] = folder, rows
        return done[name]

    return fit


@pytest.mark.parametrize("name", FIGURES)
def test_joints_that_move_in_all_directions_are_as_near_as_the_noise_allows(fitted, name):
    folder, rows = fitted(name)
    truth, found = tracks(folder / "clip.truth.csv"), tracks(folder / "clip.skeleton.csv")
    assert list(rows) == list(truth)
    shown = [joint for joint, row in rows.items() if row["shown"] == "yes"]
    assert shown == list(rows) or name == "hand"
    for joint in shown:
        rms = np.sqrt(np.nanmean(((found[joint] - truth[joint]) ** 2).sum(axis=1)))
        # A fifth for the constant's own error, and for the law, which is of first order.
        assert rms < 1.2 * frame_noise(name, joint), joint


@pytest.mark.parametrize("name", ["lower_body", "upper_body"])
def test_half_bodies_as_well(name, tmp_path):
    recording = film(name, sigma=SIGMA)
    path = tmp_path / "own.txt"
    labels = "".join(f"{m} {m}\n" for m in read_skeleton(name).segment_of)
    path.write_text(f"@skeleton {name}\n{labels}")
    fit = fit_recording(recording, read_association(path))
    for joint in fit.joints:
        # The constant holds no frame's noise: what accuracy.py gives for whole bodies.
        assert np.linalg.norm(constant_error(fit, recording, joint)) < 0.002, joint.joint
        assert joint.shown == "yes"


def test_fingers_get_honest_verdicts(fitted):
    """A base joint bends and spreads; beyond it are hinges, seen by two markers and by one."""
    folder, rows = fitted("hand")
    truth, found = tracks(folder / "clip.truth.csv"), tracks(folder / "clip.skeleton.csv")
    hinges = [j for j in rows if re.search("PIP|DIP|IP$|ThumbMCP", j)]
    assert len(hinges) == 10
    for joint, row in rows.items():
        away = np.sqrt(np.nanmean(((found[joint] - truth[joint]) ** 2).sum(axis=1)))
        if joint in hinges:
            assert row["shown"] == "no" and row["reason"], joint
        else:
            assert row["shown"] in ("yes", "weak"), joint
            assert away < 1.2 * frame_noise("hand", joint), joint


@pytest.mark.parametrize("name", FIGURES)
def test_the_bvh_of_every_figure_loads_elsewhere(fitted, name):
    folder, rows = fitted(name)
    path = folder / "clip.bvh"
    read = pybvh.read_bvh_file(path)
    assert read.frame_count == 1200
    skeleton = read_skeleton(name)
    assert read.joint_names == [skeleton.root.name, *skeleton.joints]
    # bvhio may hang on a bad file, so it runs in a process of its own.
    code = "import bvhio, sys; print(len(bvhio.readAsHierarchy(sys.argv[1]).layout()))"
    done = subprocess.run(
        [sys.executable, "-c", code, str(path)], capture_output=True, text=True, timeout=60
    )
    assert done.stdout.strip() == str(1 + len(rows)), done.stderr


TREE = """
[[segment]]
name = "Body"
markers = ["B1", "B2", "B3", "B4"]
[[segment]]
name = "Arm1"
parent = "Body"
joint = "Shoulder1"
markers = ["A1", "A2", "A3"]
[[segment]]
name = "Arm2"
parent = "Body"
joint = "Shoulder2"
markers = ["A4", "A5", "A6"]
[[segment]]
name = "Tip"
parent = "Arm2"
joint = "Elbow2"
markers = ["T1", "T2"]
"""


def test_a_tree_of_ones_own_can_be_filmed_and_fitted(tmp_path):
    (tmp_path / "thing.toml").write_text(TREE)
    labels = "".join(f"{m} {m}\n" for m in re.findall('"([ABT][0-9])"', TREE))
    (tmp_path / "thing.txt").write_text(f"@skeleton thing.toml\n{labels}")
    made = run(
        "mocap_skel.artificial", "clip.c3d", "--figure", "thing.toml", "--sigma", "1mm",
        "--rate", "60", cwd=tmp_path,
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    done = run("mocap_skel", "fit", "clip.c3d", "--assoc", "thing.txt", "--json", cwd=tmp_path)
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert {row["joint"]: row["shown"] for row in rows} == {
        "Shoulder1": "yes", "Shoulder2": "yes", "Elbow2": "yes",
    }  # fmt: skip


def test_the_generator_is_exact_without_faults():
    """Joint distances are the bones', markers keep their distances, and nothing is below the floor."""
    figure = figure_of(read_skeleton("quadruped"))
    recording = film("quadruped", seconds=2)
    knee, hock = recording.truth["LeftStifle"], recording.truth["LeftHock"]
    length = np.linalg.norm(figure.joints["LeftHock"].offset)
    np.testing.assert_allclose(np.linalg.norm(hock - knee, axis=1), length, rtol=1e-12)
    pelvis = [recording.labels.index(m) for m in ("RILC", "SACR")]
    apart = np.linalg.norm(np.diff(recording.points[:, pelvis], axis=1)[:, 0], axis=1)
    np.testing.assert_allclose(apart, apart[0], rtol=1e-12)
    still = figure.poses(circumduct({}, 0.1, 10))
    assert min(p.place(figure.bones[s])[0, 2] for s, p in still.items()) == pytest.approx(0)


@pytest.mark.parametrize("path", sorted(SHIPPED.glob("*.toml")), ids=lambda p: p.stem)
def test_every_shipped_figure_can_be_filmed(path):
    skeleton = read_skeleton(path.stem)
    recording = film(path.stem, seconds=0.5)
    assert list(recording.truth) == list(skeleton.joints)
    assert set(recording.labels) == set(skeleton.segment_of)
    again = film(path.stem, seconds=0.5)
    np.testing.assert_array_equal(recording.points, again.points)


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (["--figure", "quadrupe"], "no such skeleton file (did you mean quadruped?)"),
        (["--figure", "hand", "--motion", "walk"], "--motion is for the human only"),
        (["--figure", "hand", "--stature", "1.8m"], "--stature is for the human only"),
    ],
)
def test_a_wrong_figure_is_refused_in_one_line(tmp_path, arguments, what):
    done = run("mocap_skel.artificial", "x.c3d", *arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert what in done.stderr
    assert not list(tmp_path.iterdir())


# --- clips that hold only a part of a figure


def part_of_a_human(keep, extra=None):
    markers = marker_set("plug_in_gait") | (extra or {})
    chosen = {label: place for label, place in markers.items() if keep(place[0])}
    return record(human(), chosen, range_of_motion(20, 60, seed=1), Faults(sigma=SIGMA), seed=1)


def right_leg(segment):
    return segment == "RightFoot" or "RightLeg" in segment


CLUSTER = {
    "RF01": ("UpperRightLeg", (0.06, -0.03, -0.20)),
    "RF02": ("UpperRightLeg", (0.07, -0.02, -0.30)),
}


def test_a_leg_alone_under_a_file_of_the_human_is_fitted_as_a_leg_and_said(tmp_path):
    recording = part_of_a_human(right_leg, CLUSTER)
    write_c3d(recording, tmp_path / "leg.c3d")
    call = ("mocap_skel", "fit", "leg.c3d", "--assoc", "plug_in_gait_clusters", "--json")
    done = run(*call, cwd=tmp_path)
    assert "shows no three markers of Hips: of the figure right_leg" in done.stderr
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert [(r["joint"], r["shown"]) for r in rows if "joint" in r] == [
        ("RightKnee", "yes"), ("RightAnkle", "yes"),
    ]  # fmt: skip
    refused = run(*call, "--skeleton", "human", "--overwrite", cwd=tmp_path)
    assert refused.returncode == 3
    assert "the clip shows UpperRightLeg: try --skeleton right_leg" in refused.stderr
    told = run(*call, "--skeleton", "right_leg", "--overwrite", cwd=tmp_path)
    assert [json.loads(line) for line in told.stdout.splitlines() if '"joint"' in line] == [
        row for row in rows if "joint" in row
    ]


def test_a_root_that_no_shipped_figure_has_is_named():
    recording = part_of_a_human(lambda segment: segment in ("Head", "RightFoot"))
    with pytest.raises(RootError) as error:
        fit_recording(recording, "plug_in_gait")
    assert error.value.seen == ("Head",)


def test_joints_without_markers_are_reported_and_the_others_fitted():
    recording = part_of_a_human(lambda segment: segment == "Hips" or right_leg(segment))
    fit = fit_recording(recording, "plug_in_gait", prior="none")
    fitted = [j.joint for j in fit.joints if j.fitted]
    assert fitted == ["RightHip", "RightKnee", "RightAnkle"]
    assert len(fit.joints) == 14
    assert any("Waist (no marker on Chest)" in note for note in fit.notes)

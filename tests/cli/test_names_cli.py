"""Clips with the names that people have, as a user calls the program on them."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from commands import call, files

from mocap_skel import artificial as art
from mocap_skel.artificial.write import write_c3d

MOTION = art.range_of_motion(8, 50, seed=2)


def recorded(path, rename=lambda label: label, keep=lambda segment: True, ghosts=0, seed=2):
    """A short generated clip, with other labels, of some segments only, or with noise under ghosts' names."""
    markers = {x: at for x, at in art.marker_set("cmu").items() if keep(at[0])}
    for side in ("Left", "Right"):
        if keep(f"Upper{side}Leg"):
            markers[f"{side[0]}GTR"] = (f"Upper{side}Leg", (0.06, 0.02, -0.05))
    clip = art.record(art.human(), markers, MOTION, art.Faults(sigma=0.001), seed=seed)
    noise = np.random.default_rng(seed).normal(size=(len(clip.points), ghosts, 3))
    labels = (*map(rename, clip.labels), *(f"Unlabeled {n}" for n in range(ghosts)))
    clip = replace(clip, labels=labels, points=np.concatenate([clip.points, noise], axis=1))
    write_c3d(clip, path, "mm")
    return path


def joints(folder, name):
    with (folder / name).open() as file:
        return {row["joint"]: row for row in csv.DictReader(file)}


def test_a_prefix_a_suffix_and_ghosts_change_nothing(tmp_path):
    recorded(tmp_path / "plain.c3d")
    assert call("fit", "plain.c3d", "-q", cwd=tmp_path).returncode == 0
    plain = joints(tmp_path, "plain.joints.csv")
    for name, way in (("before", "Lab 01_{}"), ("behind", "{} Zoe")):
        clip = recorded(tmp_path / f"{name}.c3d", way.format, ghosts=20)
        for options in ([], ["--assoc", "cmu"]):
            done = call("fit", clip.name, *options, "--format", "csv", "--format", "c3d",
                        "--overwrite", cwd=tmp_path)  # fmt: skip
            assert done.returncode == 0
            assert done.stderr.count("20 unlabelled trajectories are set aside") == 1
            found = joints(tmp_path, f"{name}.joints.csv")
            for joint, row in plain.items():
                away = [float(found[joint][a]) - float(row[a]) for a in "xyz"]
                # The trochanters have no line in cmu: without them the thigh is another frame.
                if not options:
                    assert np.abs(away).max() < 1e-4


def test_several_parts_are_several_subjects(tmp_path):
    clip = recorded(tmp_path / "legs.c3d", keep=lambda s: "Leg" in s or "Foot" in s)
    done = call("fit", clip.name, "-o", "out", "--format", "csv", "--format", "bvh", cwd=tmp_path)
    assert done.returncode == 0
    assert "of the figure left_leg and right_leg" in done.stderr
    assert {*joints(tmp_path / "out", "legs.right_leg.joints.csv")} == {"RightKnee", "RightAnkle"}
    assert "legs.left_leg.bvh" in files(tmp_path / "out")
    one = call("fit", clip.name, "--skeleton", "right_leg", "-o", "one", cwd=tmp_path)
    assert one.returncode == 0
    assert {*joints(tmp_path / "one", "legs.joints.csv")} == {"RightKnee", "RightAnkle"}


def test_a_head_alone_is_written_in_every_format(tmp_path):
    clip = recorded(tmp_path / "head.c3d", keep=lambda s: s == "Head")
    formats = [x for name in ("csv", "bvh", "glb", "trc", "c3d") for x in ("--format", name)]
    done = call("fit", clip.name, *formats, "-o", "out", cwd=tmp_path)
    assert done.returncode == 0
    assert "of the figure head" in done.stderr and len(files(tmp_path / "out")) == 6


def test_a_few_doubts_are_named_and_strict_stops(tmp_path):
    swapped = {"LFHD": "RANK", "RANK": "LFHD"}
    clip = recorded(tmp_path / "swapped.c3d", lambda label: swapped.get(label, label))
    done = call("fit", clip.name, cwd=tmp_path)
    assert done.returncode == 0
    said = done.stderr.partition("names and motion contradict each other: ")[2].splitlines()[0]
    assert "RANK (" in said and "LFHD (" in said
    strict = call("fit", clip.name, "--strict", "-o", "strict", cwd=tmp_path)
    assert strict.returncode == 2 and len(strict.stderr.splitlines()) == 1
    assert not (tmp_path / "strict").exists()


@pytest.mark.parametrize("wrong", ["phoenix_channels", "right_arm"])
@pytest.mark.parametrize("command", ["fit", "calibrate", "report"])
def test_a_wrong_file_is_2_and_names_the_right_one(tmp_path, command, wrong):
    clip = recorded(tmp_path / "walk.c3d")
    done = call(command, clip.name, "--assoc", wrong, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert "--assoc cmu has 41 labels of it" in done.stderr and len(done.stderr.splitlines()) == 1
    assert files(tmp_path) == ["walk.c3d"]


def test_calibrate_check_and_inspect_guess_as_fit_does(tmp_path):
    clip = recorded(tmp_path / "one.c3d", "Ann_{}".format)
    other = recorded(tmp_path / "two.c3d", "Ann_{}".format, seed=3)
    done = call("calibrate", clip.name, other.name, cwd=tmp_path)
    assert done.returncode == 0 and (tmp_path / "actor.json").exists()
    assert done.stderr.count("no --assoc, so it is guessed") == 2
    check = call("assoc", "check", clip.name, "--json", cwd=tmp_path)
    rows = [json.loads(line) for line in check.stdout.splitlines()]
    assert {row["verdict"] for row in rows} == {"ok"} and len(rows) == 43
    assert "no --assoc, so it is guessed" in check.stderr
    facts = json.loads(call("inspect", clip.name, "--json", cwd=tmp_path).stdout)
    assert facts["subjects"] == ["Ann"]
    assert {r["label"]: r["segment"] for r in facts["markers"]}["LFHD"] == "Head"


def test_a_single_frame_says_so(tmp_path):
    clip = art.record(art.human(), art.marker_set("cmu"), MOTION, art.Faults(sigma=0.001), seed=2)
    write_c3d(replace(clip, points=clip.points[:1]), tmp_path / "static.c3d", "mm")
    for options in ([], ["--assoc", "cmu"]):
        done = call("fit", "static.c3d", *options, cwd=tmp_path)
        assert done.returncode == 3 and len(done.stderr.splitlines()) == 1
        assert "static.c3d: no joint can be fitted: it has a single frame" in done.stderr

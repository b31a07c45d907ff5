"""`--rig full` as a user gets it: joints by the names that animators know, in every format."""

import csv

import numpy as np
import pybvh
import pytest
from bvh_files import CM, LENGTH, joint_names_of, text_of
from commands import ROM, run
from recordings import fit_sample, rendered

from mocap_skel.rig.animation import Choice, animate

SIDES = {"Left": "l", "Right": "r"}
# Of Mixamo's characters and of Unreal's mannequin, without fingers and twist bones.
MIXAMO = {"Hips", "Spine", "Spine1", "Spine2", "Neck", "Head"} | {
    side + bone
    for side in SIDES
    for bone in ("Shoulder", "Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot", "ToeBase")
}
UNREAL = {"pelvis", "spine_01", "spine_02", "spine_03", "neck_01", "head"} | {
    f"{bone}_{side}"
    for side in SIDES.values()
    for bone in ("clavicle", "upperarm", "lowerarm", "hand", "thigh", "calf", "foot", "ball")
}
ADDED = {
    "Spine1", "Spine2", "Neck", "LeftShoulder", "RightShoulder", "LeftToeBase", "RightToeBase",
    "spine_02", "spine_03", "neck_01", "clavicle_l", "clavicle_r", "ball_l", "ball_r",
}  # fmt: skip


@pytest.mark.parametrize(("naming", "names"), [("mixamo", MIXAMO), ("unreal", UNREAL)])
@pytest.mark.parametrize("rig", ["full", "markers"])
def test_every_joint_has_the_name_that_animators_know(naming, names, rig):
    made = rendered("bvh", fit_sample("range_of_motion"), names=naming, rig=rig)
    found = [name.removeprefix("mixamorig:") for name in joint_names_of(made.files[".bvh"])]
    assert sorted(found) == sorted(names if rig == "full" else names - ADDED)
    assert not any("no mixamo name" in note or "no unreal name" in note for note in made.notes)


def test_a_reader_has_its_joints_where_the_model_has_them(tmp_path):
    fit = fit_sample("range_of_motion")
    path = tmp_path / "full.bvh"
    path.write_text(text_of(fit, rig="full", up=fit.up))
    read = pybvh.read_bvh_file(path)
    made = animate(fit, Choice(smooth=0.0, even=False, full=True))
    joints = made.motion.poses.joints(made.motion.model.bones)
    ((start, stop),) = made.motion.stretches
    positions = read.node_positions() / CM
    for s, segment in enumerate(made.motion.model.segments):
        track = positions[:, read.node_index[segment.joint or segment.name]]
        # Six more joints in a row than the constants of `bvh_files` are for.
        np.testing.assert_allclose(track, joints[:, s, start:stop].T, atol=2 * LENGTH)


def test_the_command_writes_it_in_every_format(tmp_path):
    told = ("--rig", "full", "--rigid", "--names", "unreal", "-q")
    done = run(
        "fit", ROM, "--assoc", "cmu", "-o", tmp_path, *told,
        *(word for name in ("bvh", "csv", "trc", "c3d") for word in ("--format", name)), cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert set(joint_names_of((tmp_path / f"{ROM.stem}.bvh").read_text())) == UNREAL
    with open(tmp_path / f"{ROM.stem}.joints.csv", newline="") as text:
        rows = {row["joint"]: row for row in csv.DictReader(text)}
    assert rows["LeftClavicle"]["shown"] == "no" and rows["LeftClavicle"]["se_x"] == ""
    assert float(rows["LeftClavicle"]["bone_sd"]) < 1e-5
    assert rows["LeftShoulder"]["parent"] == "LeftShoulderGirdle"
    for suffix in (".skeleton.csv", ".skeleton.trc"):
        assert "LeftToeBase" in (tmp_path / f"{ROM.stem}{suffix}").read_text()
    assert b"LeftToeBase" in (tmp_path / f"{ROM.stem}.skeleton.c3d").read_bytes()
    plain = run("fit", ROM, "--assoc", "cmu", "--format", "csv", "-o", "plain", "-q", cwd=tmp_path)
    assert plain.returncode == 0
    assert "Clavicle" not in (tmp_path / "plain" / f"{ROM.stem}.joints.csv").read_text()

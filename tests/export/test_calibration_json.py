"""A calibration's file: what people read in it, and what is not believed of one that somebody changed."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from recordings import SAMPLES, known

from mocap_skel.errors import CallError
from mocap_skel.export.calibration_json import calibration_json, read_calibration
from mocap_skel.pipeline.calibrate import calibrate
from mocap_skel.pipeline.job import Job


@cache
def calibrated():
    return calibrate([SAMPLES / "nearly_still.c3d"], Job(known("cmu")))


def content():
    return json.loads(calibration_json(calibrated().calibration, calibrated().joints))


def test_people_find_each_joint_with_its_place_and_how_well_it_is_known():
    found = content()["joints"]
    assert content()["unit"] == "m" and list(found)[:2] == ["Waist", "Neck"]
    for one in calibrated().joints:
        said = found[one.joint.joint]
        assert (said["parent"], said["child"]) == (one.joint.parent, one.joint.child)
        assert said["shown"] == one.joint.shown and said["markers"] == list(one.joint.markers)
        np.testing.assert_array_equal(said["centre"], one.joint.centre)
        np.testing.assert_array_equal(said["covariance"], one.joint.covariance)
        assert said["in_the_frame_of_clip"] == "nearly_still.c3d"
        assert said["shares"] == {"nearly_still.c3d": pytest.approx(1.0)}


def test_what_a_fit_uses_comes_back_to_the_last_bit(tmp_path):
    path = tmp_path / "actor.json"
    path.write_text(calibration_json(calibrated().calibration, calibrated().joints))
    (before,), (after,) = calibrated().calibration.clips, read_calibration(path).clips
    assert (after.clip, after.frames, after.rate) == (before.clip, 300, before.rate)
    assert after.segments.keys() == before.segments.keys()
    for name, joint in before.joints.items():
        for key in ("noise", "leverage", "skew", "still", "effective", "smooth"):
            np.testing.assert_array_equal(
                getattr(after.joints[name].evidence, key), getattr(joint.evidence, key)
            )
        assert after.joints[name].markers == joint.markers


def twice(c):
    c["clips"].append(c["clips"][0])


def hip(c):
    return c["clips"][0]["joints"]["LeftHip"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (twice, r"clips\[1\].digest is that of another clip: it would count twice"),
        (lambda c: hip(c).update(parent="Chest"), "has no joint LeftHip from Chest to UpperLeftLeg"),
        (lambda c: c["clips"][0]["joints"].update(Tail=hip(c)), "has no joint Tail from Hips"),
        (lambda c: hip(c)["markers"]["LTHI"].update(effective=float("nan")), "must be numbers"),
        (lambda c: hip(c)["markers"]["LTHI"].update(skew=[0, 0, float("inf")]), "must be numbers"),
        (
            lambda c: hip(c).update(shared={"centre": [0, 0, 0], "turns": [1, 2], "residual": 0}),
            r"LeftHip.shared.turns must be numbers of shape \(3, 3\)",
        ),
        (lambda c: hip(c).update(markers={}), "LeftHip.markers is empty"),
        (lambda c: c.update(skeleton=True), "skeleton must be a str, got True"),
        (lambda c: c.update(clips={}), "clips must be a list"),
        (lambda c: c["clips"][0].update(frames=-1), "frames must not be negative, got -1"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_with_its_place(tmp_path, change, words):
    changed = content()
    change(changed)
    path = tmp_path / "actor.json"
    path.write_text(json.dumps(changed))
    with pytest.raises(CallError, match=words) as caught:
        read_calibration(path, known("cmu").skeleton)
    assert caught.value.message.startswith(f"{path}: ")


def test_a_calibration_of_another_figure_is_refused(tmp_path):
    path = tmp_path / "actor.json"
    path.write_text(calibration_json(calibrated().calibration, calibrated().joints))
    other = known("plug_in_gait").skeleton
    assert read_calibration(path, other).skeleton == other.name
    with pytest.raises(CallError, match="is of the skeleton 'human', not of 'dog'"):
        read_calibration(path, replace(other, name="dog"))

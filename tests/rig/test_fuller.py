"""The full rig: joints that animators know, where generated figures have them, and how they move."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from recordings import clip_of, fit_clip, fit_recording
from scipy.spatial.transform import Rotation

from mocap_skel.artificial import Faults, human, marker_set, record, walk
from mocap_skel.artificial.motion import circumduct
from mocap_skel.artificial.others import figure_of, markers_of, ranges_of
from mocap_skel.figure.full_rig import full_rig
from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.labels.association import Association, Rule
from mocap_skel.rig.animation import Choice, animate, animation_notes
from mocap_skel.rig.feet import point_track
from mocap_skel.rig.freedoms import Shared
from mocap_skel.rig.motion import residuals
from mocap_skel.rig.rigging import rig_of
from mocap_skel.rig.rigid_fit import rigid_fit

SHRUG = 15.0
ARM = ("UpperRightArm", "LowerRightArm", "RightHand")


@cache
def recording():
    faults = Faults(sigma=0.001, slide=0.003)
    return record(human(), marker_set("cmu"), walk(5, 100), faults, seed=4)


@cache
def fit():
    return fit_recording(recording())


@cache
def animation(**told):
    return animate(fit(), Choice(**{"smooth": 0.0, "full": True, **told}))


def index(made):
    return {s.joint or s.name: i for i, s in enumerate(made.motion.model.segments)}


def rms(made):
    away = np.concatenate([r.ravel() for r in residuals(made.motion.model, made.motion.poses)])
    return np.sqrt(np.nanmean(away**2))


def rest_places(made):
    """Joint → its place in the T-pose, x to the left, y up, z forward."""
    found = {}
    model = made.motion.model
    for name, i in index(made).items():
        parent = model.bones.parents[i]
        above = np.zeros(3) if parent < 0 else list(found.values())[parent]
        found[name] = above if parent < 0 else above + made.rest[parent] @ model.bones.offsets[i]
    return found


def test_it_has_all_joints_and_explains_the_markers_no_worse_than_without_them():
    made, plain = animation(), animation(full=False)
    assert set(full_rig().joints) <= set(index(made)) and not made.lacking
    assert len(index(made)) == len(index(plain)) + 7
    assert rms(made) < rms(plain)
    bones = made.motion.model.bones
    joints = made.motion.poses.joints(bones)
    for s, parent in enumerate(bones.parents[1:], 1):
        assert np.ptp(np.linalg.norm(joints[:, s] - joints[:, parent], axis=0)) < 1e-12


def test_joints_that_the_clip_shows_stay_where_they_are():
    ours, theirs = animation(even=False), animation(even=False, full=False)
    for name, s in index(theirs).items():
        tracks = [
            m.motion.poses.joints(m.motion.model.bones)[:, index(m)[name]] for m in (ours, theirs)
        ]
        assert np.median(np.linalg.norm(tracks[0] - tracks[1], axis=0)) < 0.02, (name, s)


def test_the_rest_pose_is_a_symmetric_t():
    at = rest_places(animation())
    for name, place in at.items():
        if "Left" in name:
            # The rest pose is found again for the even bones, a little turned.
            np.testing.assert_allclose(
                at[name.replace("Left", "Right")], place * [-1, 1, 1], atol=2e-3, err_msg=name
            )
    spine = ["Waist", "MiddleSpine", "UpperSpine", "Neck", "SkullBase"]
    heights = [at[name][1] for name in spine]
    assert heights == sorted(heights) and np.abs([at[name][0] for name in spine]).max() < 5e-3
    assert 0.015 < at["LeftClavicle"][0] < 0.04 < at["LeftShoulder"][0]
    toe = at["LeftToeBase"] - at["LeftAnkle"]
    assert toe[2] > 0.1 and abs(toe[0]) < 1e-9
    made = animation()
    s = index(made)["LeftToeBase"]
    forward = made.rest[s] @ made.motion.model.ends[s]
    assert forward[2] > 0.04 and abs(forward[0]) < 1e-9


def test_the_spine_shares_its_turn_in_equal_parts():
    """Within what markers on skin pull it aside: a walking trunk turns by some 10 degrees."""
    made = animation()
    model = made.motion.model
    rows = [one for one in model.freedoms if isinstance(one, Shared)]
    assert [len(row.segments) for row in rows] == [3, 2]
    (row, _), local = rows, made.motion.poses.local
    first, second, third = (local(model.bones, s).transpose(2, 0, 1) for s in row.segments)
    parts = Rotation.from_matrix(
        np.stack([first, second, third @ row.rest.T], axis=1).reshape(-1, 3, 3)
    )
    vectors = np.degrees(parts.as_rotvec().reshape(-1, 3, 3))
    assert np.linalg.norm(vectors.sum(axis=1), axis=1).max() > 5.0
    uneven = np.linalg.norm(vectors - vectors.mean(axis=1, keepdims=True), axis=2)
    assert np.median(uneven) < 1.0


def shrugged():
    """The recording with its right arm and acromion turned about the sternoclavicular joint, up and down again.

    Also by how many degrees.
    """
    made = recording()
    angle = SHRUG * np.sin(2 * np.pi * np.arange(len(made.points)) / 200)
    clavicle, neck = (made.points[:, made.labels.index(label)] for label in ("CLAV", "C7"))
    shoulder = made.truth["RightShoulder"]
    middle = clavicle + 0.15 * (shoulder - clavicle)
    forward = (clavicle - neck) / np.linalg.norm(clavicle - neck, axis=1)[:, None]
    turn = Rotation.from_rotvec(np.radians(angle)[:, None] * forward)
    points = made.points.copy()
    for label, (where, _) in marker_set("cmu").items():
        if where in ARM or label == "RSHO":
            at = made.labels.index(label)
            points[:, at] = middle + turn.apply(points[:, at] - middle)
    return replace(made, points=points), angle


def test_a_collar_bone_follows_a_shrug():
    moved, angle = shrugged()
    fitted = fit_recording(moved)
    off = {}
    for full in (True, False):
        made = animate(fitted, Choice(smooth=0.0, even=False, full=full))
        off[full] = rms(made)
        if full:
            s = index(made)["RightClavicle"]
            local = made.motion.poses.local(made.motion.model.bones, s).transpose(2, 0, 1)
            vectors = np.degrees(Rotation.from_matrix(local).as_rotvec())
            vectors -= vectors.mean(axis=0)
            turned = vectors @ np.linalg.svd(vectors, full_matrices=False)[2][0]
    # The rest is the pull towards the chest, and the chest's own fit.
    assert abs(np.corrcoef(turned, angle)[0, 1]) > 0.95
    assert 0.9 * SHRUG < 0.5 * np.ptp(turned) < 1.15 * SHRUG
    assert off[True] < 0.5 * off[False], off


def test_toes_lie_on_the_floor_where_their_foot_rolls_over_them():
    made = animation()
    model = made.motion.model
    for side in ("Left", "Right"):
        s = index(made)[f"{side}ToeBase"]
        height = made.vertical @ point_track(model.bones, made.motion.poses, s, model.ends[s])
        assert height.min() > made.feet.floor - 0.02
        local = made.motion.poses.local(model.bones, s)
        bent = np.degrees(np.arccos(np.clip((np.trace(local) - 1) / 2, -1, 1)))
        # Straight with the foot in the air, bent at each step.
        assert np.quantile(bent, 0.3) < 1e-3 and 10 < bent.max() < 80


@pytest.mark.parametrize("told", [{"lock": True}, {"even": False}])
def test_locked_feet_and_uneven_sides_have_it_as_well(told):
    made = animation(**told)
    assert np.isfinite(made.motion.poses.turn).all() and rms(made) < 0.02
    assert made.motion.stretches == [(0, 500)]


def test_a_gap_is_bridged_and_added_joints_have_none_of_their_own():
    points = recording().points.copy()
    for label, (where, _) in marker_set("cmu").items():
        if where in ("Head", "Chest"):
            points[200:240, recording().labels.index(label)] = np.nan
    made = animate(
        fit_recording(replace(recording(), points=points)), Choice(smooth=0.0, full=True)
    )
    assert made.motion.stretches == [(0, 500)]
    ours, theirs = (m.motion.poses.joints(m.motion.model.bones) for m in (made, animation()))
    assert np.linalg.norm(ours - theirs, axis=0).max() < 0.15
    said = " ".join(animation_notes(made))
    assert "Chest 201-240" in said and not any(n in said for n in made.motion.model.added)


def test_a_head_that_is_hardly_there_goes_with_its_neck():
    points = recording().points.copy()
    for label, (where, _) in marker_set("cmu").items():
        if where == "Head":
            points[50:, recording().labels.index(label)] = np.nan
    made = animate(
        fit_recording(replace(recording(), points=points)), Choice(smooth=0.0, full=True)
    )
    assert not {"Neck", "SkullBase"} & set(index(made)) and "LeftClavicle" in index(made)
    assert made.motion.stretches == [(0, 500)]


@pytest.mark.parametrize("name", ["lower_body", "quadruped", "hand", "upper_body"])
def test_a_figure_gets_what_it_has_segments_for_and_the_rest_is_said(name):
    skeleton = read_skeleton(name)
    figure = figure_of(skeleton)
    motion = circumduct(ranges_of(skeleton), 5, 60, seed=1)
    clip = clip_of(
        record(figure, markers_of(skeleton, figure), motion, Faults(sigma=0.001), seed=1)
    )
    where = skeleton.segment_of
    rules = tuple(Rule(m, m, where[m], i) for i, m in enumerate(clip.labels, 1))
    other = fit_clip(clip, Association(name, skeleton, rules, ()))
    made = animate(other, Choice(smooth=0.0, full=True))
    new = {joint for joint in full_rig().joints if joint in index(made)}
    want = {
        "lower_body": {"RightToeBase", "LeftToeBase"},
        "upper_body": {"SkullBase", "RightClavicle", "LeftClavicle"},
    }.get(name, set())
    assert new == want and set(made.lacking) == set(full_rig().joints) - want
    assert any(made.lacking[0] in note for note in animation_notes(made))
    rig_of(made, made.motion.stretches[0])


def test_as_a_fit_again_it_has_the_new_tracks_and_no_evidence_for_them():
    made = animation(even=False)
    again = rigid_fit(fit(), made.motion)
    tracks, places = dict(again.tracks()), made.motion.poses.joints(made.motion.model.bones)
    for name, s in index(made).items():
        if name != "Hips":
            np.testing.assert_allclose(tracks[name], places[:, s].T, atol=1e-12)
    joints = {joint.joint: joint for joint in again.joints}
    assert {name for name, j in joints.items() if not j.samples} == set(full_rig().joints)
    for joint in again.joints:
        # The constant place in the parent's frame, and the track, are one.
        own = again.segments[joint.parent].pose.to_lab(joint.centre)
        assert np.abs(own - joint.track).max() < 0.2
        assert joint.parent == again.skeleton[joint.child].parent
    assert "LeftToes" in tracks and "LeftFoot" not in tracks

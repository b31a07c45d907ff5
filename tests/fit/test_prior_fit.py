"""A whole fit with priors: what they leave alone, what they mend, and that no choice of the clip's sways them."""

import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from recordings import ROOT, clip_of, constant_error, fit_clip, fit_recording, fit_sample, known

from mocap_skel import associate, fit_skeleton, read_association, read_clip
from mocap_skel.artificial import (
    Faults,
    Motion,
    figure_of,
    human,
    marker_set,
    markers_of,
    record,
    walk,
)
from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.labels.association import Rule

SIGMA = 0.001


@pytest.fixture(scope="module")
def walking():
    """Ten seconds of level walking, 1 mm noise and 5 mm of sliding skin, seed 4."""
    faults = Faults(sigma=SIGMA, slide=0.005)
    return record(human(), marker_set("cmu"), walk(10, 60, 4), faults, seed=4)


@pytest.fixture(scope="module")
def walked(walking):
    return fit_recording(walking)


def joint(fit, name):
    return next(j for j in fit.joints if j.joint == name)


def turned_into(fit, recording):
    """Joint → error of its constant, metres."""
    return {j.joint: np.linalg.norm(constant_error(fit, recording, j)) for j in fit.joints}


# --- what a prior is for, and what it leaves alone


def test_none_is_what_the_motion_gives():
    """The thesis's pure fit: each joint its sphere's centre, nothing from anatomy."""
    pure = fit_clip(read_clip(ROOT / "sample_data" / "range_of_motion.c3d"), "cmu", prior="none")
    for one in pure.joints:
        assert (one.centre == one.motion).all()
        assert one.share == 1.0
        assert one.landmarks == ()
        assert one.source == ""


def test_the_first_joints_motion_is_the_same_with_and_without_a_prior():
    """Of those that hang from the root, whose frame rests on no joint."""
    pure = fit_clip(read_clip(ROOT / "sample_data" / "range_of_motion.c3d"), "cmu", prior="none")
    both = fit_sample("range_of_motion")
    for name in ("Waist", "RightHip", "LeftHip"):
        assert joint(both, name).motion == pytest.approx(joint(pure, name).motion, abs=1e-12)
        assert joint(both, name).landmarks != ()


def test_a_well_shown_joint_belongs_to_its_motion():
    """A minute's range of motion with 1 mm noise: no joint goes 1 mm from where the motion has it."""
    for one in fit_sample("range_of_motion").joints:
        assert one.share > 0.9, one.joint
        assert np.linalg.norm(one.centre - one.motion) < 0.001, one.joint


def test_a_walk_with_skin_is_mended(walking, walked):
    """Each joint lies within its prior's three sd; and as a whole, less far from the truth than without."""
    pure = turned_into(fit_recording(walking, prior="none"), walking)
    mended = turned_into(walked, walking)
    assert np.median(list(mended.values())) < np.median(list(pure.values()))
    assert max(mended.values()) < max(pure.values())
    sds = {s.joint: max(p.sd for p in s.priors) for s in walked.skeleton.segments if s.priors}
    for name, error in mended.items():
        assert error < 3 * sds[name], name


def test_no_such_prior(walking):
    with pytest.raises(ValueError, match=r"prior must be one of .*'skeleton'.*got 'harrington'"):
        fit_recording(walking, prior="harrington")


# --- what must not matter


def test_a_clip_of_twice_the_size_has_twice_the_skeleton(walking, walked):
    """As in a wrong unit: all of it scales, for a prior is in the subject's own size. 1e-6: iterated fits."""
    clip = replace(clip_of(walking), points=2.0 * walking.points)
    large = fit_clip(clip)
    for one, two in zip(walked.joints, large.joints, strict=True):
        assert two.landmarks == one.landmarks
        # Noise searches have floors in metres; 10 µm is a hundredth of the noise.
        assert np.abs(two.track - 2 * one.track).max() < 2e-5, one.joint


def test_a_mirrored_clip_has_mirrored_joints(walking):
    """Left for right and y for -y: the same fit of the same numbers.

    Of an odd number of frames, whose median is the same from both ends.
    """
    clip = clip_of(walking)
    clip = replace(clip, points=clip.points[:-1])
    walked = fit_clip(clip)
    other = {"L": "R", "R": "L"}
    swapped = {"RBAC"}
    labels = tuple(
        label if label in swapped else other.get(label[0], label[0]) + label[1:]
        for label in clip.labels
    )
    mirrored = replace(clip, points=clip.points * [1.0, -1.0, 1.0], labels=labels)
    found = fit_clip(mirrored)

    def twin(name):
        for a, b in (("Left", "Right"), ("Right", "Left")):
            if a in name:
                return name.replace(a, b)
        return name

    for one in walked.joints:
        two = joint(found, twin(one.joint))
        # Rounding: sums over 599 frames of lengths of metres, and inverses of condition 1e4.
        assert np.nanmax(np.abs(two.track * [1.0, -1.0, 1.0] - one.track)) < 1e-9, one.joint
        assert two.share == pytest.approx(one.share, abs=1e-9)
        assert np.trace(two.covariance) == pytest.approx(np.trace(one.covariance), rel=1e-6)


def test_the_order_of_markers_does_not_matter(walking, walked):
    clip = clip_of(walking)
    order = np.random.default_rng(8).permutation(len(clip.labels))
    shuffled = replace(
        clip,
        points=clip.points[:, order],
        labels=tuple(clip.labels[i] for i in order),
        subjects=tuple(clip.subjects[i] for i in order),
    )
    for one, two in zip(walked.joints, fit_clip(shuffled).joints, strict=True):
        assert two.track == pytest.approx(one.track, abs=1e-12)
        assert two.landmarks == one.landmarks


# --- joints that only anatomy shows


def test_a_joint_without_markers_below_it_is_from_anatomy(walking):
    """No foot: the ankle's landmark is the shank's own marker, and the hinge has nothing to point along."""
    clip = clip_of(walking)
    feet = {"RHEE", "RTOE", "RMT5"}
    keep = [i for i, label in enumerate(clip.labels) if label not in feet]
    cut = replace(
        clip,
        points=clip.points[:, keep],
        labels=tuple(clip.labels[i] for i in keep),
        subjects=tuple(clip.subjects[i] for i in keep),
    )
    fit = fit_clip(cut)
    ankle = joint(fit, "RightAnkle")
    assert (ankle.method, ankle.samples, ankle.share) == ("PRIOR", 0, 0.0)
    assert ankle.shown == "no"
    assert ankle.reason == "no marker on RightFoot"
    assert ankle.landmarks == ("RANK",)
    assert "RightFoot" not in fit.segments
    # Its surface marker, 4 cm from the joint; sd 4 cm in each direction.
    error = np.linalg.norm(ankle.track - walking.truth["RightAnkle"], axis=1)
    assert np.median(error) < 3 * 0.04
    pure = joint(fit_clip(cut, prior="none"), "RightAnkle")
    assert not pure.fitted
    assert pure.landmarks == ()


def test_medial_markers_of_the_association_are_used(walking):
    """Under any of their names: the joint lies in the middle of the two, whatever the motion shows."""
    figure = human()
    markers = {
        **marker_set("cmu"),
        "RMFE": ("UpperRightLeg", (-0.002, 0.051, -0.434)),
    }
    recording = record(figure, markers, walk(10, 60, 4), Faults(sigma=SIGMA, slide=0.005), seed=4)
    association = known("cmu")
    rule = Rule("RMFE", "RMFE", "UpperRightLeg", 99)
    fit = fit_recording(recording, replace(association, rules=(*association.rules, rule)))
    knee = joint(fit, "RightKnee")
    assert knee.landmarks == ("RKNE", "RMFE")
    assert knee.source == "epicondyles"
    middle = np.mean(
        [recording.clean[:, recording.labels.index(name)] for name in ("RKNE", "RMFE")], axis=0
    )
    # Skin slides by some 5 mm, and the prior's sd is 10.
    assert np.median(np.linalg.norm(knee.track - middle, axis=1)) < 0.02
    assert np.linalg.norm(constant_error(fit, recording, knee)) < 0.02


def test_the_shared_point_is_for_segments_with_a_pose_of_their_own(walking, walked):
    def shared(fit):
        return {j.joint for j in fit.joints if j.evidence and j.evidence.shared is not None}

    # Three markers or more: trunk, head, forearms, feet.
    expected = {"Waist", "Neck", "LeftElbow", "RightElbow", "LeftAnkle", "RightAnkle"}
    assert shared(walked) == expected
    assert shared(fit_recording(walking, prior="none")) == set()
    # A third marker gives the thigh a pose of its own, and so its hip a shared point.
    markers = {**marker_set("cmu"), "RMFE": ("UpperRightLeg", (-0.002, 0.051, -0.434))}
    recording = record(human(), markers, walk(4, 60, 4), Faults(sigma=SIGMA), seed=4)
    association = known("cmu")
    rule = Rule("RMFE", "RMFE", "UpperRightLeg", 99)
    fit = fit_recording(recording, replace(association, rules=(*association.rules, rule)))
    assert len(fit.segments["UpperRightLeg"].template) == 3
    assert shared(fit) == {*expected, "RightHip"}


@pytest.mark.parametrize(
    ("lost", "name", "source"),
    [
        ((), "LeftElbow", "ANSUR width"),
        (("LWRB",), "LeftElbow", "ANSUR width"),
        (("LWRA", "LWRB"), "LeftElbow", "its surface marker"),
        (("LTOE",), "LeftAnkle", "ANSUR width"),
        (("LTOE", "LMT5"), "LeftAnkle", "its surface marker"),
    ],
)
def test_a_hinge_needs_all_the_markers_that_its_bone_points_to(walking, lost, name, source):
    """Else the next prior counts: another marker, or the joint's own alone."""
    clip = clip_of(walking)
    points = clip.points.copy()
    points[:, [clip.labels.index(label) for label in lost]] = np.nan
    assert joint(fit_clip(replace(clip, points=points)), name).source == source


@pytest.mark.parametrize(("name", "side"), [("right_leg", "Right"), ("left_leg", "Left")])
@pytest.mark.parametrize("lost", [(), ("KNM",), ("KNM", "GTR")])
def test_a_leg_whose_thigh_is_the_root_knows_its_knee(name, side, lost):
    """By the epicondyles, else by the trochanter in place of the hip, else by the surface marker."""
    skeleton = read_skeleton(name)
    figure = figure_of(skeleton)
    motion = walk(10, 60, 4)
    turns = {**motion.rotations, f"Upper{side}Leg": motion.rotations[f"Upper{side}Leg"]}
    recording = record(
        figure, markers_of(skeleton, figure), Motion(60, motion.shift, turns),
        Faults(sigma=SIGMA, slide=0.003, lost=tuple(side[0] + m for m in lost)), seed=4,
    )  # fmt: skip
    fit = fit_recording(recording, name)
    knee = joint(fit, f"{side}Knee")
    letter = side[0]
    landmarks, limit = {
        0: ((f"{letter}KNE", f"{letter}KNM"), 0.02),
        1: ((f"{letter}KNE", f"{letter}GTR"), 0.03),
        2: ((f"{letter}KNE",), 0.10),
    }[len(lost)]
    assert knee.landmarks == landmarks
    # Two sd of that prior.
    assert np.linalg.norm(constant_error(fit, recording, knee)) < limit


def test_no_prior_in_a_figure_is_no_prior():
    """The quadruped has none: with and without, the same."""
    skeleton = read_skeleton("quadruped")
    assert not any(s.priors for s in skeleton.segments)
    assert skeleton.sizes == ()


# --- the command line


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    folder = tmp_path_factory.mktemp("prior")

    def rows(prior):
        return subprocess.run(
            [
                sys.executable, "-m", "mocap_skel", "fit", str(ROOT / "sample_data/nearly_still.c3d"),
                "--assoc", "cmu", "--json", "-q", "-o", prior, *(["--prior", prior] if prior else []),
            ],
            cwd=folder, capture_output=True, text=True, timeout=60,
        )  # fmt: skip

    return rows


def joints_of(done):
    assert done.returncode == 0, done.stderr
    lines = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    return [line for line in lines if "joint" in line]


def test_prior_none_on_the_command_line(told):
    rows = joints_of(told("none"))
    assert len(rows) == 14
    assert all(row["from_motion"] == 1.0 and row["prior"] == "" for row in rows)


def test_the_skeletons_priors_by_default(told):
    rows = {row["joint"]: row for row in joints_of(told("skeleton"))}
    hip = rows["LeftHip"]
    assert hip["from_motion"] < 0.1
    assert hip["prior"] == "RFWT LFWT RBWT LBWT (Harrington 2007)"


def test_a_wrong_prior_on_the_command_line_is_a_wrong_call(told):
    done = told("davis")
    assert done.returncode == 2
    assert "davis" in done.stderr
    assert "Traceback" not in done.stderr


def test_associate_and_fit_take_the_same_figure(walking):
    """From Python: the association's own skeleton, priors and all."""
    association = read_association("cmu", "lower_body")
    clip = clip_of(walking)
    fit = fit_skeleton(clip, associate(clip, association)[0], association.skeleton)
    whole = fit_recording(walking)
    assert joint(fit, "LeftHip").landmarks == joint(whole, "LeftHip").landmarks
    assert joint(fit, "LeftKnee").source == "width in gait labs"


@pytest.mark.real
@pytest.mark.parametrize("side", ["R", "L"])
@pytest.mark.parametrize(
    ("medial", "limit"), [(True, 0.02), (False, 0.03)], ids=["medial", "trochanter"]
)
def test_a_real_leg_on_its_own_has_its_knee_between_the_epicondyles(
    shared_clips, tmp_path, side, medial, limit
):
    """With the medial marker in the fit and without it: within two sd of the prior that then counts."""
    thigh = "UpperRightLeg" if side == "R" else "UpperLeftLeg"
    lines = [f"@skeleton {'right' if side == 'R' else 'left'}_leg", f"{side}GT {side}GTR"]
    lines += [f"{side}LFE {side}KNE", f"{side}LM {side}ANK", f"{side}CAL {side}HEE"]
    lines += [f"{side}THI{i} {side}THI{i} {thigh}" for i in (1, 2, 3)]
    lines += [f"{side}LEG{i} {side}LEG{i} {thigh.replace('Upper', 'Lower')}" for i in (1, 2, 3)]
    lines += [f"{side}MFE {side}MFE {thigh}"] if medial else []
    path = tmp_path / "leg.txt"
    path.write_text("\n".join(lines))
    clip = read_clip(shared_clips / "functional_knee" / "right_knee.c3d")
    knee = fit_clip(clip, read_association(path)).joints[0]
    assert knee.landmarks == (f"{side}KNE", f"{side}MFE" if medial else f"{side}GTR")
    ends = [clip.points[:, clip.labels.index(side + name)] for name in ("LFE", "MFE")]
    away = np.linalg.norm(knee.track - np.mean(ends, axis=0), axis=1)
    assert np.nanmedian(away) < limit


# --- the documentation


def test_the_console_blocks_of_the_priors_page_are_true(tmp_path):
    """Every command of docs/priors.md runs and prints what the page shows."""
    shutil.copytree(ROOT / "sample_data", tmp_path / "sample_data")
    text = (ROOT / "docs" / "priors.md").read_text()
    shown = 0
    for block in re.findall(r"```console\n(.*?)```", text, re.S):
        for part in re.split(r"^\$ ", block, flags=re.M)[1:]:
            line, _, expected = part.partition("\n")
            command = re.sub(r"^mocap-skel", f"{sys.executable} -m mocap_skel", line)
            done = subprocess.run(
                command, shell=True, cwd=tmp_path, capture_output=True, text=True, timeout=60
            )
            assert (done.stdout + done.stderr).strip() == expected.strip(), line
            shown += 1
    assert shown == 2


def test_the_priors_page_names_the_source_of_every_prior():
    text = (ROOT / "docs" / "priors.md").read_text()
    for segment in read_skeleton("human").segments:
        for prior in segment.priors:
            name, _, year = prior.source.partition(" ")
            if year.isdigit():
                assert re.search(rf"^- {name}, .*\({year}\)", text, re.M), prior.source

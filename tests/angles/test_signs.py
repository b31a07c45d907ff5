"""What the signs of the angles mean, seen on the body: which way a marker goes; and left and right are alike."""

from dataclasses import replace

import numpy as np
import pytest
from anatomy import JOINTS, association_of, filmed, waves
from recordings import clip_of, fit_clip

from mocap_skel import joint_angles

FREE, EACH = 1000, 20
SIDED = [
    # joint, angle, a marker that moves, and where it goes: forward, up, or to the middle of the body
    ("Hip", "flexion", "KNE", "forward"),
    ("Hip", "adduction", "ANK", "middle"),
    ("Hip", "rotation", "TOE", "middle"),
    ("Knee", "flexion", "ANK", "back"),
    ("Knee", "adduction", "ANK", "middle"),
    ("Knee", "rotation", "TOE", "middle"),
    ("Ankle", "flexion", "TOE", "up"),
    ("Ankle", "adduction", "MT5", "down"),
    ("Ankle", "rotation", "TOE", "middle"),
    ("Shoulder", "elevation", "ELB", "outside"),
    ("Elbow", "flexion", "WRA", "forward"),
    ("Elbow", "carrying", "FIN", "outside"),
    # The thumb is outside at rest, as the palms face forward.
    ("Elbow", "pronation", "WRA", "forward"),
    ("Wrist", "flexion", "FIN", "forward"),
    ("Wrist", "deviation", "FIN", "middle"),
]
MIDDLE = [
    ("Hips", "rotation", "LFWT", "back"),
    ("Hips", "obliquity", "RFWT", "up"),
    ("Hips", "tilt", "RFWT", "down"),
    ("Waist", "flexion", "C7", "forward"),
    ("Waist", "bending", "C7", "right"),
    ("Waist", "rotation", "CLAV", "left"),
    ("Neck", "flexion", "RFHD", "down"),
    ("Neck", "bending", "RFHD", "right"),
    ("Neck", "rotation", "RFHD", "left"),
]
CASES = [(f"{s}{j}", a, f"{s[0]}{m}", way) for s in ("Right", "Left") for j, a, m, way in SIDED]
CASES += MIDDLE
LIMBS = ("Hip", "Knee", "Ankle", "Shoulder", "Elbow", "Wrist")


def along(way, name):
    """The direction in the lab (x forward, y to the left, z up)."""
    inward = 1.0 if name.startswith("Right") else -1.0
    return np.array({
        "forward": (1, 0, 0), "back": (-1, 0, 0), "up": (0, 0, 1), "down": (0, 0, -1), "left": (0, 1, 0),
        "right": (0, -1, 0), "middle": (0, inward, 0), "outside": (0, -inward, 0),
    }[way])  # fmt: skip


@pytest.fixture(scope="module")
def one_by_one(tmp_path_factory):
    """A clip whose first part shows all joints; then one angle after the other is 15 degrees, all others 0."""
    from mocap_skel.figure.angle_table import angle_table

    rules = {rule.name: rule for rule in angle_table().angles}
    frames = FREE + EACH * len(CASES)
    joints = {}
    for i, name in enumerate((*JOINTS, "Hips")):
        angles = np.zeros((frames, 3))
        start = (
            ((0, 30), (0, 30), (0, 30)) if "Shoulder" in name else ((-20, 20), (-20, 20), (-20, 20))
        )
        angles[:FREE] = waves(start, FREE, i)
        for n, (joint, part, *_) in enumerate(CASES):
            if joint == name:
                column = rules[name].parts.index(part)
                angles[FREE + n * EACH : FREE + (n + 1) * EACH, column] = 15
        joints[name] = angles
    recording, _ = filmed(frames, joints=joints)
    association = association_of(tmp_path_factory.mktemp("signs"))
    return recording, joint_angles(fit_clip(clip_of(recording), association))


@pytest.mark.parametrize(("name", "part", "marker", "way"), CASES)
def test_a_positive_angle_moves_a_marker_where_the_page_says(one_by_one, name, part, marker, way):
    recording, angles = one_by_one
    n = CASES.index((name, part, marker, way))
    there = slice(FREE + n * EACH, FREE + (n + 1) * EACH)
    # At rest all angles are 0: where another joint on another limb moves.
    rest = next(
        FREE + m * EACH
        for m, (other, *_) in enumerate(CASES)
        if other.startswith("Left" if name.startswith("Right") else "Right")
    )
    track = recording.points[:, recording.labels.index(marker)]
    assert (track[there][0] - track[rest]) @ along(way, name) > 0.002
    joint = angles[name]
    found = joint.degrees[there, joint.rule.parts.index(part)]
    np.testing.assert_allclose(found, 15, atol=0.01)


def test_a_mirrored_person_has_the_same_angles_on_the_other_side(tmp_path):
    recording, _ = filmed(seed=3)
    association = association_of(tmp_path)
    clip = clip_of(recording)
    swap = str.maketrans("LR", "RL")
    names = tuple(
        label[0].translate(swap) + label[1:] if label not in ("CLAV",) else label
        for label in clip.labels
    )
    mirrored = replace(clip, points=clip.points * [1.0, -1.0, 1.0], labels=names)
    here, there = (joint_angles(fit_clip(one, association)) for one in (clip, mirrored))
    for joint in here.joints:
        name = joint.rule.name
        if name.startswith(("Left", "Right")):
            other = name.replace("Left", "_").replace("Right", "Left").replace("_", "Right")
            want, sign = there[other].degrees, np.ones(3)
        else:
            want = there[name].degrees
            # Bending forward stays; to the side and round it is the other way.
            sign = np.array(
                [1.0 if part in ("flexion", "tilt") else -1.0 for part in joint.rule.parts]
            )
        off = (joint.degrees - sign * want + 180) % 360 - 180
        assert np.nanmax(np.abs(off)) < 0.01, name

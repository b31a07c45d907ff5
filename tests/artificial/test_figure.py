"""Figures, marker sets and motions: rigid segments, joints that hold together, what bodies do."""

from itertools import combinations

import numpy as np
import pytest
from standard_human import (
    CMU,
    EXACT,
    HUMAN,
    JOINTS,
    NOISY,
    ROM,
    SIGMA,
    child_markers,
    hinged,
    sphere_centre,
)

from mocap_skel import artificial as art
from mocap_skel.artificial.figure import floor_contacts
from mocap_skel.artificial.rotations import from_vector, half_sine


def test_the_standard_human_is_the_documented_tree():
    parents = {segment.name: segment.parent for segment in HUMAN.segments}
    assert len(parents) == 15
    assert [
        "Waist",
        "Neck",
        *("RightShoulder", "RightElbow", "RightWrist"),
        *("LeftShoulder", "LeftElbow", "LeftWrist"),
        *("RightHip", "RightKnee", "RightAnkle"),
        *("LeftHip", "LeftKnee", "LeftAnkle"),
    ] == JOINTS
    assert HUMAN.joints["LeftWrist"].parent == "LowerLeftArm"
    assert parents["UpperRightLeg"] == parents["Chest"] == "Hips"
    assert len(set(parents) - set(parents.values())) == 5


def test_marker_sets_have_the_vendors_labels_on_the_right_segments():
    assert [len(labels) for labels in art.LABELS.values()] == [41, 39]
    for marker, segment in [
        ("LKNE", "UpperLeftLeg"),
        ("RANK", "LowerRightLeg"),
        ("LELB", "UpperLeftArm"),
        ("RWRA", "LowerRightArm"),
        ("LSHO", "Chest"),
        ("RBAC", "Chest"),
        ("LMT5", "LeftFoot"),
    ]:
        assert CMU[marker][0] == segment
    knee = np.array(HUMAN.joints["LeftKnee"].offset)
    assert 0.045 < np.linalg.norm(CMU["LKNE"][1] - knee) < 0.06


def test_the_right_side_is_not_the_mirror_image_of_the_left():
    """Lengths by hand: a mix-up of the sides must show."""
    for joint, left, right in (
        ("Elbow", 0.3255, 0.3295),
        ("Wrist", 0.2555, 0.2525),
        ("Knee", 0.429, 0.424),
        ("Ankle", 0.431, 0.436),
    ):
        assert HUMAN.joints[f"Left{joint}"].offset == (0.0, 0.0, -left)
        assert HUMAN.joints[f"Right{joint}"].offset == pytest.approx((0.0, 0.0, -right))
    for label, lower in (("UPA", 0.035), ("THI", 0.04), ("SHN", 0.03), ("KNE", 0.0)):
        (_, (x, y, z)), (segment, right) = CMU[f"L{label}"], CMU[f"R{label}"]
        assert right == pytest.approx((x, -y, z - lower))
        assert "Right" in segment


def test_a_bones_end_is_its_own_where_it_has_one_and_else_its_first_childs_joint():
    trunk = art.Segment("Trunk", end=(0.0, 0.0, 0.5))
    arm = art.Segment("Arm", "Trunk", "Shoulder", (0.0, 0.2, 0.4))
    hand = art.Segment("Hand", "Arm", "Wrist", (0.0, 0.0, -0.3))
    bones = art.Figure((trunk, arm, hand)).bones
    assert [bones[name].tolist() for name in ("Trunk", "Arm", "Hand")] == [
        [0.0, 0.0, 0.5], [0.0, 0.0, -0.3], [0.0, 0.0, 0.0]
    ]  # fmt: skip


def test_stature_scales_the_body_and_its_markers():
    tall = art.record(art.human(3.5), art.marker_set("cmu", 3.5), art.still(0.1, 10))
    short = art.record(HUMAN, CMU, art.still(0.1, 10))
    for joint in JOINTS:
        np.testing.assert_allclose(tall.constants[joint], 2 * short.constants[joint])
    span = np.ptp(tall.clean[0], axis=0) / np.ptp(short.clean[0], axis=0)
    np.testing.assert_allclose(span, 2.0, rtol=0.01)


def test_segments_are_rigid_and_joints_hold_together():
    by_segment: dict[str, list[int]] = {}
    for i, (segment, _) in enumerate(CMU.values()):
        by_segment.setdefault(segment, []).append(i)
    assert set(by_segment) == {segment.name for segment in HUMAN.segments}
    for rows in by_segment.values():
        for a, b in combinations(rows, 2):
            distance = np.linalg.norm(EXACT.points[:, a] - EXACT.points[:, b], axis=1)
            # A dozen products of rotations, each good to one eps.
            assert np.ptp(distance) < 1e-13
    for joint, child in HUMAN.joints.items():
        track = EXACT.poses[child.parent].place(EXACT.constants[joint])
        np.testing.assert_allclose(track, EXACT.truth[joint], atol=1e-14)
        turn = EXACT.poses[child.name].rotation
        relative = EXACT.poses[child.parent].rotation.swapaxes(1, 2) @ turn
        np.testing.assert_allclose(relative, ROM.rotations[child.name], atol=1e-14)
        np.testing.assert_allclose(
            turn @ turn.swapaxes(1, 2), np.broadcast_to(np.eye(3), turn.shape), atol=1e-14
        )
        np.testing.assert_allclose(np.linalg.det(turn), 1.0, atol=1e-14)


@pytest.mark.parametrize("joint", JOINTS)
def test_range_of_motion_shows_every_joint(joint):
    exact = child_markers(HUMAN, CMU, EXACT, joint, EXACT.points)
    centre, weakest = sphere_centre(exact)
    np.testing.assert_allclose(centre, EXACT.constants[joint], atol=1e-9)
    assert weakest >= 0.012
    noisy = child_markers(HUMAN, CMU, NOISY, joint, NOISY.points)
    centre, _ = sphere_centre(noisy, SIGMA**2)
    assert np.linalg.norm(centre - EXACT.constants[joint]) < 0.001


def test_motions_stay_within_what_bodies_do():
    def bend(motion, child):
        return np.rad2deg(np.arccos(motion.rotations[child][:, 2, 2]))

    for side in ("Left", "Right"):
        assert 110 < bend(ROM, f"Lower{side}Leg").max() < 121
        assert 125 < bend(ROM, f"Lower{side}Arm").max() < 141
        dance = art.dance(10, 60, seed=3)
        assert 40 < bend(dance, f"Lower{side}Leg").max() < 70
        # The shank turns about its own axis when the knee is bent, hardly when it is straight.
        half = half_sine(ROM.rotations[f"Lower{side}Leg"])
        turn = 2 * np.arctan2(half[:, 2], np.sqrt(1 - (half**2).sum(axis=1)))
        bent = bend(ROM, f"Lower{side}Leg")
        assert np.rad2deg(np.abs(turn[bent > 40])).max() > 20
        assert np.rad2deg(np.abs(turn[bent < 5])).max() < 10
    feet = [i for i, label in enumerate(CMU) if label[1:] in ("HEE", "TOE")]
    for make in (art.dance, art.walk):
        film = art.record(HUMAN, CMU, make(8, 60, 2))
        assert np.abs(film.clean[:, feet, 2].min(axis=1) - 0.03).max() < 0.04
        assert film.truth["Neck"][:, 2].min() > 1.3
    # Changes of foot are rounded off, which lifts and dips the lowest point by centimetres.
    low = [EXACT.poses[segment].place(point)[:, 2] for segment, point in floor_contacts()]
    assert np.abs(np.min(low, axis=0)).max() < 0.1
    assert np.abs(np.min(low, axis=0)).mean() < 0.02
    quiet = art.record(HUMAN, CMU, art.still(10, 60, 2))
    assert np.ptp(quiet.clean, axis=0).max() < 0.15
    toes = quiet.clean[:, [i for i, label in enumerate(CMU) if label[1:] == "TOE"]]
    assert np.ptp(toes, axis=0).max() < 0.02


def angles(motion, name):
    """A segment's angles, degrees: the swing takes the z axis to where it is, the rest is twist."""
    rotation = motion.rotations[name]
    z = rotation[:, :, 2]
    axis = np.stack([-z[:, 1], z[:, 0], np.zeros(len(z))], axis=1)
    sine = np.linalg.norm(axis, axis=1, keepdims=True)
    swing = np.arctan2(sine, z[:, 2:]) * np.divide(axis, sine, out=axis * 0, where=sine > 0)
    twist = art.to_vector(from_vector(swing).swapaxes(1, 2) @ rotation)[:, 2:]
    return np.degrees(swing + twist * [0.0, 0.0, 1.0])


@pytest.mark.parametrize("left", list(art.ROM_DEGREES))
def test_range_of_motion_fills_the_ranges_of_both_sides(left):
    """The right side's x and z have the other sign; the knee's turn is damped, the root turns in the lab."""
    if left == "Hips":
        return
    film = art.range_of_motion(60, 30, seed=1)
    for name in {left, left.replace("Left", "Right")}:
        sign = [-1, 1, -1] if "Right" in name else [1, 1, 1]
        found = angles(film, name) * sign
        for axis, (low, high) in enumerate(art.ROM_DEGREES[left]):
            if not (left == "LowerLeftLeg" and axis == 2):
                # A sine of a wandering phase comes near both ends within a minute.
                allowed = 0.05 * (high - low) + 1e-6
                assert found[:, axis].min() == pytest.approx(low, abs=allowed)
                assert found[:, axis].max() == pytest.approx(high, abs=allowed)


def test_limbs_bend_the_way_that_bodies_do():
    """Where the bone below a joint points, in the parent's axes: x is ahead. Upwards is never far behind."""

    def ahead(name):
        return ROM.rotations[name] @ [0.0, 0.0, -1.0]

    for side in ("Left", "Right"):
        thigh, shank, forearm = (
            ahead(f"{n}") for n in (f"Upper{side}Leg", f"Lower{side}Leg", f"Lower{side}Arm")
        )
        assert thigh[:, 0].max() > 0.9 and -0.4 < thigh[:, 0].min() < -0.2
        assert shank[:, 0].max() < 0.1 and shank[:, 0].min() < -0.9
        assert forearm[:, 0].min() > -0.1 and forearm[:, 0].max() > 0.9
        outwards = thigh[:, 1] if side == "Left" else -thigh[:, 1]
        assert outwards.max() > 0.6 and outwards.min() > -0.2


def test_the_third_angle_turns_a_limb_about_its_own_axis():
    rng = np.random.default_rng(3)
    bent = rng.uniform(-1, 1, (50, 3))
    straight = art.swing_twist(bent * [1, 1, 0])
    turned = art.swing_twist(bent)
    # The limb points where it pointed; what is across it turns by the angle.
    np.testing.assert_allclose(turned[:, :, 2], straight[:, :, 2], atol=1e-14)
    relative = straight.swapaxes(1, 2) @ turned
    np.testing.assert_allclose(art.to_vector(relative), bent * [0, 0, 1], atol=1e-12)


def test_a_walk_goes_round_its_circle_at_its_speed_and_looks_where_it_goes():
    film = art.walk(13, 50)
    path = film.shift[:, :2]
    step = np.diff(path, axis=0)
    np.testing.assert_allclose(np.linalg.norm(step, axis=1) * 50, 1.2, rtol=1e-3)
    # To the left about (0, 2.5), once round in 13.1 s.
    np.testing.assert_allclose(np.linalg.norm(path - [0, 2.5], axis=1), 2.5, rtol=1e-9)
    assert step[0, 0] > 0 and path[1:50, 1].min() > 0
    # The pelvis's own x axis, tilted by a few degrees, runs along the path.
    ahead = film.rotations["Hips"][:-1, :2, 0]
    cosine = (ahead * step).sum(axis=1) / np.linalg.norm(step, axis=1)
    assert cosine.min() > np.cos(np.radians(8))
    # One foot after the other: the knees bend in turn.
    left, right = (
        np.degrees(np.arccos(film.rotations[f"Lower{s}Leg"][:, 2, 2])) for s in ("Left", "Right")
    )
    assert np.corrcoef(left, right)[0, 1] < 0


def test_a_dance_turns_all_round():
    """Each turn is a whole one: after them the pelvis looks ahead again."""
    film = art.dance(5, 50, seed=1)
    yaw = np.unwrap(np.arctan2(*film.rotations["Hips"][:, [1, 0], 0].T))
    # One turn in five seconds, 360 degrees but for the hips' own 12 each way.
    assert abs(abs(yaw[-1] - yaw[0]) - 2 * np.pi) < np.radians(2 * 15)


def test_half_sine_is_the_axis_times_the_sine_of_half_the_angle():
    rng = np.random.default_rng(0)
    axis = rng.standard_normal((50, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    angle = np.linspace(0, 3.1, 50)[:, None]
    # Near a half turn the axis is the skew part over a cosine of 0.02, hence not 1e-15.
    np.testing.assert_allclose(
        half_sine(from_vector(axis * angle)), axis * np.sin(angle / 2), atol=1e-12
    )


def test_a_rotation_vector_comes_back():
    vector = np.random.default_rng(1).uniform(-1.5, 1.5, (200, 3))
    vector[0] = 0.0
    # The sine of half the angle loses digits towards a half turn: √eps at most.
    np.testing.assert_allclose(art.to_vector(art.from_vector(vector)), vector, atol=1e-7)


def test_any_figure_moves():
    dog = art.Figure(
        (
            art.Segment("Trunk", offset=(0, 0, 0.6)),
            art.Segment("Thigh", "Trunk", "Hip", (-0.3, 0.1, 0.0)),
            art.Segment("Shank", "Thigh", "Stifle", (0.05, 0.0, -0.2)),
        )
    )
    markers = {
        "W1": ("Trunk", (0.1, 0.0, 0.1)),
        "T1": ("Thigh", (0.0, 0.05, -0.1)),
        "S1": ("Shank", (0.0, 0.03, -0.1)),
        "S2": ("Shank", (0.0, 0.03, -0.2)),
    }
    ranges = {
        "Thigh": ((-20, 20), (-50, 20), (-15, 15)),
        "Shank": ((-5, 5), (0, 80), (-10, 10)),
    }
    clip = art.record(
        dog, markers, art.circumduct(ranges, 10, 50), art.Faults(slide=0.01), place=(1, 2, 0)
    )
    np.testing.assert_array_equal(clip.poses["Trunk"].origin[0], [1, 2, 0.6])
    assert np.isfinite(clip.points).all()
    for joint in ("Hip", "Stifle"):
        centre, _ = sphere_centre(child_markers(dog, markers, clip, joint, clip.clean))
        np.testing.assert_allclose(centre, clip.constants[joint], atol=1e-9)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: art.Figure(()), "root"),
        (lambda: art.Figure((art.Segment("A"), art.Segment("B"))), "root"),
        (lambda: art.Figure((art.Segment("A"), art.Segment("B", "C", "J"))), "after its parent"),
        (lambda: art.Figure((art.Segment("A"), art.Segment("B", "A"))), "joint name"),
        (lambda: art.Figure((art.Segment("A"), art.Segment("A", "A", "J"))), "two segments"),
        (lambda: art.human(-1), "stature"),
        (lambda: art.marker_set("helen_hayes"), "plug_in_gait"),
        (lambda: art.still(0, 100), "no motion"),
        (lambda: art.Faults(sigma=-1), "negative"),
        (lambda: art.Faults(dropout=1), "share"),
        (lambda: art.Faults(burst=0.5), "one frame"),
        (lambda: art.Faults(correlation_time=0), "positive"),
        (lambda: art.Faults(outliers=1.0), "share"),
        (lambda: art.Faults(outlier_burst=0.5), "outlier_burst"),
        (lambda: art.Faults(outlier_size=-0.1), "outlier_size"),
        (lambda: art.record(HUMAN, CMU, ROM, art.Faults(swaps=(art.Swap("C7", "XYZ"),))), "XYZ"),
        (lambda: art.record(HUMAN, {}, ROM), "at least one marker"),
        (lambda: art.record(HUMAN, {"X": ("Tail", (0, 0, 0))}, ROM), "Tail"),
        (lambda: art.record(HUMAN, CMU, ROM, art.Faults(lost=("XYZ",))), "XYZ"),
        (lambda: art.merge({}), "nothing"),
        (lambda: art.merge({"A:B": EXACT}), "A:B"),
        (
            lambda: art.merge({"A": EXACT, "B": art.record(HUMAN, CMU, art.still(1, 9))}),
            "agree",
        ),
    ],
)
def test_wrong_input_is_named(wrong, message):
    with pytest.raises(ValueError, match=message):
        wrong()


def test_misplaced_markers_lie_within_the_length_and_on_their_segments():
    placed = art.misplaced(CMU, 0.01, seed=2)
    away = [np.subtract(placed[m][1], CMU[m][1]) for m in CMU]
    assert [s for s, _ in placed.values()] == [s for s, _ in CMU.values()]
    far = np.linalg.norm(away, axis=1)
    assert far.max() <= 0.01
    # Evenly in the ball: 1/8 of them in its half, 41 markers.
    assert (far < 0.005).mean() <= 1 / 8 + 4 * np.sqrt(7 / 64 / 41)
    assert np.median(far) == pytest.approx(0.01 * 0.5 ** (1 / 3), rel=0.1)


def test_a_joint_that_glides_is_where_the_glide_puts_it_and_its_bone_follows():
    glide = {"LowerLeftLeg": np.linspace(0, 0.01, 61)[:, None] * [1.0, 0.0, 0.0]}
    plain = hinged(90)
    motion = art.Motion(plain.rate, plain.shift, plain.rotations, glide)
    still, moving = (art.record(HUMAN, CMU, m) for m in (plain, motion))
    for joint in ("LeftKnee", "LeftAnkle"):
        away = moving.truth[joint] - still.truth[joint]
        np.testing.assert_allclose(away, glide["LowerLeftLeg"], atol=1e-12)

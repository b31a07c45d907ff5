"""The T-pose: where the joints of the bundled figures are in it, and how the segments stand, by hand and by their markers."""

from dataclasses import replace

import numpy as np
import pytest
from bvh_files import BUNDLED
from recordings import fit_sample
from rigs import rig_of
from scipy.spatial.transform import Rotation

from mocap_skel.figure.skeleton import Segment
from mocap_skel.results.axes import turned
from mocap_skel.rig import rest_pose as module
from mocap_skel.rig.kinematics import rest_places
from mocap_skel.rig.rest_pose import Bone, hinge_axis, mean_rotation, rest_pose

# From axes with that one up to y up.
UPRIGHT = {
    "x": np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]),
    "y": np.eye(3),
    "z": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
}
SIDES = (("Left", 1.0), ("Right", -1.0))


@pytest.fixture(scope="module", params=BUNDLED, ids=["one", "dancer"])
def fit(request):
    return turned(fit_sample(*request.param), "y")


def rest_of(rig, upright):
    """Joint → its place from its parent in the rest pose; the end behind it as "end of" it."""
    places = dict(zip(rig.names, rig.offsets @ upright.T, strict=True))
    return places | {f"end of {rig.names[i]}": upright @ end for i, end in rig.ends.items()}


class TestTPose:
    @pytest.mark.parametrize("up", ["x", "y", "z"])
    def test_it_is_a_t_pose_whatever_the_axes_are(self, fit, up):
        offset = rest_of(rig_of(turned(fit, up))[0], UPRIGHT[up])
        exact = {"rtol": 0, "atol": 1e-9}
        for side, x in SIDES:
            for arm in (f"{side}Elbow", f"{side}Wrist", f"end of {side}Wrist"):
                np.testing.assert_allclose(offset[arm][1:], 0, err_msg=arm, **exact)
                assert x * offset[arm][0] > 0.05
            for leg in (f"{side}Knee", f"{side}Ankle"):
                np.testing.assert_allclose(offset[leg][[0, 2]], 0, err_msg=leg, **exact)
                assert offset[leg][1] < -0.3
            foot = offset[f"end of {side}Ankle"]
            assert foot[2] > 0.05 and abs(foot[0]) <= 1e-9 and -foot[2] < foot[1] <= 0
            # Distances are the fitted ones: the hips of both bundled figures are 17 cm apart or more.
            assert x * offset[f"{side}Hip"][0] > 0.07 and x * offset[f"{side}Shoulder"][0] > 0.14
        np.testing.assert_allclose(offset["end of Neck"][[0, 2]], 0, **exact)
        level = offset["LeftHip"] - offset["RightHip"]
        assert abs(level[1]) < 0.01 and abs(level[2]) < 0.01

    def test_bones_keep_their_fitted_lengths(self, fit):
        rig, _, _ = rig_of(fit)
        for joint in fit.joints:
            own = fit.segments[joint.parent].joint
            length = np.linalg.norm(joint.centre - (0 if own is None else own))
            found = np.linalg.norm(rig.offsets[rig.names.index(joint.joint)])
            assert found == pytest.approx(length, abs=1e-12)

    def test_it_stands_on_the_floor(self, fit):
        joints, ends = rest_places(rig_of(fit)[0])
        lowest = min(joints[:, 1].min(), *(end[1] for end in ends.values()))
        assert lowest == pytest.approx(0, abs=1e-12)
        np.testing.assert_array_equal(joints[0, [0, 2]], 0)

    def test_knees_bend_about_the_sideways_axis(self, fit):
        rig, segments, _ = rig_of(fit)
        checked = []
        for i, segment in enumerate(segments):
            axis = hinge_axis(rig.rotation[i]) if segment.rest_axis is not None else None
            if axis is not None:
                # The rig's bones are turned by degrees from their markers, which gave the axis. An axis has no sign.
                assert abs(axis @ segment.rest_axis) > np.cos(np.radians(15)), segment.name
                checked.append(segment.name)
        # The elbows of both figures turn about two axes.
        assert checked == ["LowerRightLeg", "LowerLeftLeg"]

    @pytest.mark.parametrize("sign", [1.0, -1.0])
    def test_segments_have_their_outer_markers_outside_whatever_the_sign_of_an_axis(
        self, fit, sign, monkeypatch
    ):
        """An eigenvector may have either sign; a limb turned half round about its bone looks the same to all
        that only asks for joints."""
        monkeypatch.setattr(
            module,
            "hinge_axis",
            lambda turns: None if (a := hinge_axis(turns)) is None else sign * a,
        )
        rig, segments, _ = rig_of(fit)
        world = []
        for parent, turn in zip(rig.parents, rig.rotation, strict=True):
            world.append(turn if parent < 0 else world[parent] @ turn)
        for side, x in SIDES:
            # The lateral markers of knee and ankle.
            for name, marker in (
                (f"Upper{side}Leg", f"{side[0]}KNE"),
                (f"Lower{side}Leg", f"{side[0]}ANK"),
            ):
                i = [s.name for s in segments].index(name)
                own = fit.segments[name]
                # From the segment's own axes to the rest pose: what both rotations differ by, in the mean.
                rest = mean_rotation(world[i].swapaxes(1, 2) @ own.pose.rotation)
                (below,) = (joint.centre for joint in fit.joints if joint.parent == name)
                assert x * (rest @ (own.template[marker] - below))[0] > 0.02, marker

    def test_the_sign_of_a_hinges_axis_changes_nothing(self, fit, monkeypatch):
        rigs = []
        for sign in (1.0, -1.0):
            monkeypatch.setattr(
                module,
                "hinge_axis",
                lambda turns, sign=sign: None if (a := hinge_axis(turns)) is None else sign * a,
            )
            rigs.append(rig_of(fit)[0])
        np.testing.assert_allclose(rigs[0].rotation, rigs[1].rotation, rtol=0, atol=1e-12)
        np.testing.assert_allclose(rigs[0].offsets, rigs[1].offsets, rtol=0, atol=1e-12)

    def test_a_figure_without_directions_rests_in_its_average_pose(self):
        fit = fit_sample("range_of_motion")
        segments = tuple(
            replace(s, rest=None, rest_joint=None, rest_axis=None) for s in fit.skeleton.segments
        )
        plain = replace(fit, skeleton=replace(fit.skeleton, segments=segments))
        rig, _, notes = rig_of(plain)
        assert any("average" in note and "Hips" in note for note in notes)
        assert not any("average" in note for note in rig_of(fit)[2])
        # Its turns away from rest have no mean: each joint's average turn is none.
        for turns in rig.rotation[1:]:
            assert Rotation.from_matrix(mean_rotation(turns)).magnitude() < np.radians(3)


def about(axis, degrees):
    return Rotation.from_rotvec(np.radians(degrees) * np.asarray(axis, float)).as_matrix()


def swinging(axis, degrees, frames=41):
    """Turns to and fro about an axis."""
    return np.stack([about(axis, d) for d in np.linspace(-degrees, degrees, frames)])


def segment(name, parent, **keys):
    return Segment(name, parent, None if parent is None else f"{name} joint", (), **keys)


def limb(hinge, wanted, twist=0.0, degrees=30):
    """A root that stands still, a bone along its own z that is to lie along x, a hinge at its end."""
    stand = np.broadcast_to(np.eye(3), (41, 3, 3))
    # On the average the bone is in its T-pose, but for a twist about itself.
    upper = about([1, 0, 0], twist) @ about([0, 1, 0], 90) @ np.eye(3)
    lower = upper @ swinging(hinge, degrees)
    at = np.zeros(3)
    return [
        Bone(segment("Root", None), -1, at, at, None, stand),
        Bone(segment("Upper", "Root", rest=(1.0, 0, 0)), 0, at, at, None, np.broadcast_to(upper, (41, 3, 3))),
        Bone(segment("Lower", "Upper", rest_axis=wanted), 1, at, np.array([0, 0, 0.3]), None, lower),
    ]  # fmt: skip


class TestDirections:
    """Segments whose own axes are the lab's, so that a rotation to the rest pose is told by what it turns."""

    up = np.array([0.0, 1, 0])
    still = np.broadcast_to(np.eye(3), (5, 3, 3))

    def bone(self, name, rest, end):
        at = np.zeros(3)
        return Bone(segment(name, "Root", rest=rest), 0, at, at, np.array(end), self.still)

    def test_what_points_the_other_way_comes_round_by_the_front(self):
        at, (x, y, _) = np.zeros(3), np.eye(3)
        straight = [
            self.bone(n, tuple(v), v) for n, v in (("A", x), ("B", -x), ("C", -y), ("D", -y))
        ]
        wrong = [self.bone("raised", tuple(-y), y), self.bone("crossed", tuple(x), -x)]
        root = Bone(segment("Root", None), -1, at, at, None, self.still)
        turns, _ = rest_pose([root, *straight, *wrong], self.up)
        for turn in turns[:5]:
            np.testing.assert_allclose(turn, np.eye(3), rtol=0, atol=1e-9)
        # Half a turn about the sideways axis, and half a turn about the vertical.
        np.testing.assert_allclose(turns[5], np.diag([1, -1, -1]), rtol=0, atol=1e-9)
        np.testing.assert_allclose(turns[6], np.diag([-1, 1, -1]), rtol=0, atol=1e-9)

    @pytest.mark.parametrize("twist", [0.0, 35.0, 160.0])
    def test_joints_of_a_branching_segment_go_to_their_places_and_the_rest_is_the_clips(
        self, twist
    ):
        """From its joint to the one beyond goes its own z, which is to be y; about that only the clip decides."""
        at, own = np.zeros(3), about([0, 1, 0], twist) @ about([1, 0, 0], -90)
        trunk = Bone(
            segment("Trunk", "Root"), 0, np.array([0.1, 0, 0]), at, None,
            np.broadcast_to(own, (5, 3, 3)),
        )  # fmt: skip
        head = segment("Head", "Trunk", rest_joint=(0.0, 0.3, 0.0))
        beyond = Bone(head, 1, at, np.array([0.1, 0, 0.3]), None, trunk.rotation)
        root = Bone(segment("Root", None), -1, at, at, None, self.still)
        turns, _ = rest_pose([root, trunk, beyond], self.up)
        np.testing.assert_allclose(turns[1], own, rtol=0, atol=1e-9)


class TestTwist:
    """The bone's own z goes to x; its hinge, y of its own, to the file's axis, by less than a right angle."""

    up = np.array([0.0, 1, 0])

    @pytest.mark.parametrize("twist", [0.0, 40.0, -70.0])
    @pytest.mark.parametrize("axis", [(0, 1.0, 0), (0, -1.0, 0)])
    def test_a_hinge_is_turned_onto_its_axis_the_short_way(self, twist, axis):
        bones = limb([0, 1.0, 0], axis, twist)
        turns, average = rest_pose(bones, self.up)
        np.testing.assert_allclose(turns[1], about([0, 1, 0], 90), rtol=0, atol=1e-9)
        assert average == ["Root", "Lower"]

    def test_a_twist_beyond_a_right_angle_goes_on_to_half_a_turn(self):
        turns, _ = rest_pose(limb([0, 1.0, 0], (0, 1.0, 0), 110), self.up)
        want = about([1, 0, 0], 180) @ about([0, 1, 0], 90)
        np.testing.assert_allclose(turns[1], want, rtol=0, atol=1e-9)

    def test_an_axis_along_the_bone_tells_nothing_of_its_twist(self):
        # 30 degrees from the bone; the cosine is over 0.7.
        bones = limb([0, 0.5, np.sqrt(0.75)], (0, 1.0, 0), 40)
        turns, _ = rest_pose(bones, self.up)
        np.testing.assert_allclose(turns[1], bones[1].rotation[0], rtol=0, atol=1e-9)

    def test_neither_does_an_axis_that_the_file_puts_along_the_bone(self):
        bones = limb([0, 1.0, 0], (1.0, 0.5, 0), 40)
        turns, _ = rest_pose(bones, self.up)
        np.testing.assert_allclose(turns[1], bones[1].rotation[0], rtol=0, atol=1e-9)

    def test_a_joint_that_hardly_turns_tells_nothing_either(self):
        # From end to end even: the root mean square is 1/√3 of the most, here 4.6° = 0.08.
        bones = limb([0, 1.0, 0], (0, 1.0, 0), 40, degrees=8)
        turns, _ = rest_pose(bones, self.up)
        np.testing.assert_allclose(turns[1], bones[1].rotation[0], rtol=0, atol=1e-9)


class TestHingeAxis:
    def test_it_is_the_axis_of_the_turns_up_to_its_sign(self):
        axis = np.array([0.48, -0.6, 0.64])
        start = about([1, 0, 0], 70)
        found = hinge_axis(swinging(axis, 40) @ start)
        np.testing.assert_allclose(np.abs(found @ axis), 1, rtol=0, atol=1e-12)

    def test_a_ball_has_none(self):
        x, y = np.eye(3)[:2]
        both = np.concatenate([swinging(x, 40), swinging(y, 30)])
        assert hinge_axis(both) is None
        assert hinge_axis(np.concatenate([swinging(x, 40), swinging(y, 10)])) is not None

    def test_missing_frames_are_left_out(self):
        turns = swinging([0, 0, 1], 40)
        gappy = turns.copy()
        gappy[[3, 37]] = np.nan
        np.testing.assert_allclose(np.abs(hinge_axis(gappy)), [0, 0, 1], rtol=0, atol=1e-9)
        assert hinge_axis(np.full((5, 3, 3), np.nan)) is None

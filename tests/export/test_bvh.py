"""BVH text read back by two independent readers, against the fit that it was made from.

Tolerances. The file holds centimetres and degrees with six decimals: half of 1e-8 m and of 1e-6
degrees = 9e-9 rad each. Three angles a joint and six joints in a row make 1.6e-7 rad, and 1 m of
chain 2e-7 m. `bvhio` computes in single precision: 2^-24 of the 1,000 degrees that an angle without
wrapping can reach are 1e-6 rad, of which a chain has 18; 0.01 mm is what the project promises.
"""

import json
import re
import subprocess
import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pybvh
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings import fit_recording, fit_sample
from scipy.spatial.transform import Rotation, Slerp

from mocap_skel.artificial import Faults, human, marker_set, range_of_motion, record
from mocap_skel.errors import ExportError
from mocap_skel.export import WRITERS, Options
from mocap_skel.export.bvh import LONGEST_GAP, SHORTEST_END, bvh
from mocap_skel.export.euler import ORDERS, euler_angles
from mocap_skel.export.joint_names import joint_names
from mocap_skel.figure.skeleton import Segment
from mocap_skel.results.axes import turned
from mocap_skel.rig.gaps import fill_positions, fill_rotations, runs
from mocap_skel.rig.kinematics import forward, rest_places
from mocap_skel.rig.rest_pose import hinge_axis
from mocap_skel.rig.rigging import rig_of
from mocap_skel.segments.pose import Pose

LAWS = settings(derandomize=True, deadline=None, max_examples=40, database=None)
ANGLE, LENGTH, SINGLE = 1.6e-7, 3e-7, 1e-5
CM = 100.0
BUNDLED = [("range_of_motion", None), ("two_dancers", "Anna")]


def write(fit, **options):
    return WRITERS["bvh"](fit, Options(**options))


def text_of(fit, **options):
    return write(fit, **options).files[".bvh"]


@pytest.fixture(scope="module", params=BUNDLED, ids=["one", "dancer"])
def case(request, tmp_path_factory):
    """A fit with y up, its text, and the path of the file."""
    name, subject = request.param
    fit = fit_sample(name, subject)
    path = tmp_path_factory.mktemp("bvh") / f"{name}.bvh"
    path.write_text(text_of(fit))
    return turned(fit, "y"), path.read_text(), path


@cache
def recording():
    motion = range_of_motion(5, 60, seed=2)
    faults = Faults(sigma=0.0005)
    return record(human(), marker_set("cmu"), motion, faults, seed=2, first_frame=101)


def on(*segments):
    return [label for label, (where, _) in marker_set("cmu").items() if where in segments]


def fit_without(labels, frames):
    """The artificial clip with some markers missing in some of its 300 frames."""
    clip = recording()
    points = clip.points.copy()
    for label in labels:
        points[frames, clip.labels.index(label)] = np.nan
    return fit_recording(replace(clip, points=points))


def motion_of(text):
    return np.array([line.split() for line in text.splitlines() if re.match(r"-?\d", line)], float)


def chain(fit):
    """Positions (frames, 3) of every node, by the model's own forward kinematics."""
    rig, segments, _ = rig_of(fit)
    joints, ends = forward(rig)
    at = {s.name: track for s, track in zip(segments, joints, strict=True)}
    return at | {f"end of {segments[i].name}": track for i, track in ends.items()}


def node_of(fit):
    """Segment → the name of its node in the file."""
    joint_of = {joint.child: joint.joint for joint in fit.joints}
    return {s.name: joint_of.get(s.name, s.name) for s in fit.skeleton.segments}


# bvhio may hang on a bad file, so it runs in a process of its own.
BVHIO = """
import json, sys
import bvhio
root = bvhio.readAsHierarchy(sys.argv[1])
found = {}
for frame in map(int, sys.argv[2:]):
    root.loadPose(frame)
    for joint, _, _ in root.layout():
        found.setdefault(joint.Name, []).append(list(joint.PositionWorld))
print(json.dumps(found))
"""


class TestReadBack:
    def test_two_readers_agree(self, case):
        _, _, path = case
        first = pybvh.read_bvh_file(path)
        frames = range(0, first.frame_count, 50)
        done = subprocess.run(
            [sys.executable, "-c", BVHIO, str(path), *map(str, frames)],
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert done.returncode == 0, done.stderr
        second = json.loads(done.stdout)
        assert set(second) == set(first.joint_names)
        positions = first.node_positions()[list(frames)]
        for name, track in second.items():
            apart = np.linalg.norm(positions[:, first.node_index[name]] - track, axis=1) / CM
            assert apart.max() <= SINGLE

    def test_positions_are_those_of_the_models_forward_kinematics(self, case):
        fit, _, path = case
        read = pybvh.read_bvh_file(path)
        positions = read.node_positions() / CM
        expected, node = chain(fit), node_of(fit)
        names = {name: node.get(name) for name in expected if name in node}
        names |= {f"end of {s.name}": f"EndSite{node[s.name]}" for s in fit.skeleton.leaves}
        assert set(names.values()) == set(read.node_index)
        for name, there in names.items():
            np.testing.assert_allclose(
                positions[:, read.node_index[there]],
                expected[name],
                rtol=0,
                atol=LENGTH,
                err_msg=there,
            )

    def test_rotations_are_the_models(self, case):
        fit, _, path = case
        read = pybvh.read_bvh_file(path)
        _, local = read.to_rotmat()
        rig, _, _ = rig_of(fit)
        for name, turn in zip(rig.names, rig.rotation, strict=True):
            there = local[:, read.joint_index[name]]
            apart = Rotation.from_matrix(there.swapaxes(1, 2) @ turn).magnitude()
            assert apart.max() <= ANGLE <= 1e-5, name

    def test_segments_turn_as_their_markers_do(self, case):
        """A bone is turned from its markers to the next joint by the joints' wandering, millimetres on a
        limb, and a constant turn from frame to rest pose cancels between two frames."""
        fit, _, path = case
        read = pybvh.read_bvh_file(path)
        _, local = read.to_rotmat()
        node, world = node_of(fit), {}
        for segment in fit.skeleton.segments:
            turn = local[:, read.joint_index[node[segment.name]]]
            world[segment.name] = turn if segment.parent is None else world[segment.parent] @ turn
            fitted = fit.segments[segment.name].pose.rotation
            now = world[segment.name]
            constant = now.swapaxes(1, 2) @ fitted
            apart = Rotation.from_matrix(constant[:1].swapaxes(1, 2) @ constant).magnitude()
            # 6 mm on a hand of 9 cm; the root's own frame is its markers'.
            assert np.sqrt((apart**2).mean()) <= (0.07 if segment.parent else ANGLE), segment.name

    def test_it_is_within_5_mm_of_the_joints_of_skeleton_csv(self, case):
        fit, _, path = case
        read = pybvh.read_bvh_file(path)
        positions, tracks = read.node_positions() / CM, dict(fit.tracks())
        node = node_of(fit)
        names = {name: name for name in read.joint_names}
        names |= {s.name: f"EndSite{node[s.name]}" for s in fit.skeleton.leaves}
        square = {
            name: ((positions[:, read.node_index[there]] - tracks[name]) ** 2).sum(axis=1).mean()
            for name, there in names.items()
        }
        # Bones keep their length in the file, so joints far down a limb are off by their frames'
        # noise; the promise is for the figure.
        assert len(square) == 20
        assert np.sqrt(np.mean(list(square.values()))) <= 0.005
        # At the joints of the root's own segment nothing has been added up yet.
        for name in ("Hips", "Waist", "LeftHip", "RightHip"):
            assert np.sqrt(square[name]) <= LENGTH


class TestFormat:
    def test_the_text_keeps_to_the_rules(self, case):
        fit, text, _ = case
        assert text.isascii() and text.endswith("\n") and "\r" not in text
        head, motion = text.split("MOTION\n")
        for line in text.splitlines():
            assert not re.search(r"  | $|\t.*\S\t", line)
        assert not re.search(r"\d[eE][-+]?\d|nan|inf|-0\.000000(?!\d)", text, re.IGNORECASE)
        frames, time, *rows = motion.splitlines()
        assert frames == f"Frames: {len(fit.frame_numbers)}"
        assert re.fullmatch(r"Frame Time: \d+\.\d{8,}", time)
        # Eight decimals are a part in a million of a frame at 100 Hz.
        assert float(time.split()[2]) == pytest.approx(1 / fit.rate, abs=0.5e-8)
        assert len(rows) == len(fit.frame_numbers)
        channels = [int(n) for n in re.findall(r"CHANNELS (\d)", head)]
        assert channels == [6, *[3] * 14]
        assert {len(row.split(" ")) for row in rows} == {sum(channels)}
        assert head.count("{") == head.count("}") == 15 + 5

    def test_the_tree_is_the_skeletons(self, case):
        fit, text, _ = case
        depth, found = [], []
        for line in text.splitlines():
            words = line.split()
            if words[0] in ("ROOT", "JOINT"):
                found.append((words[1], depth[-1] if depth else None))
                name = words[1]
            elif words[0] == "End":
                name = None
            elif words[0] == "{":
                depth.append(name)
            elif words[0] == "}":
                depth.pop()
            elif words[0] == "MOTION":
                break
        node = node_of(fit)
        expected = {(node[s.name], s.parent and node[s.parent]) for s in fit.skeleton.segments}
        assert set(found) == expected and len(found) == 15

    def test_end_sites_have_a_length(self, case):
        _, text, _ = case
        ends = re.findall(r"End Site\s*\{\s*OFFSET (\S+) (\S+) (\S+)", text)
        assert len(ends) == 5
        for end in ends:
            assert np.linalg.norm(np.array(end, float)) >= CM * SHORTEST_END

    def test_y_is_up_and_lengths_are_centimetres(self, case):
        _, _, path = case
        read = pybvh.read_bvh_file(path)
        positions = read.node_positions()
        height = {name: positions[:, i, 1] for name, i in read.node_index.items()}
        # A human of 1.66 to 1.75 m: neck about 1.4 m up, hips 0.9, both less while bending; ankles
        # at least as high as they are over the sole.
        assert 100 <= np.median(height["Neck"]) <= 160
        assert np.median(height["Hips"]) < np.median(height["Neck"])
        assert -5 <= height["LeftAnkle"].min() <= 25

    def test_names_have_no_blanks(self):
        fit = fit_sample("nearly_still")
        named = replace(
            fit,
            skeleton=replace(
                fit.skeleton,
                segments=tuple(
                    replace(s, joint=s.joint and f"{s.joint} of it") for s in fit.skeleton.segments
                ),
            ),
        )
        names = re.findall(r"(?:ROOT|JOINT) (.*)", text_of(named))
        assert names[0] == "Hips"
        assert names[1:] and all(re.fullmatch(r"\w+_of_it", name) for name in names[1:])

    def test_an_end_point_on_the_joint_gets_a_length(self):
        fit = fit_sample("nearly_still")
        head = fit.segments["Head"]
        stub = replace(fit, segments=fit.segments | {"Head": replace(head, end=head.joint)})
        ends = re.findall(r"End Site\s*\{\s*OFFSET (\S+) (\S+) (\S+)", text_of(stub))
        assert min(np.linalg.norm(np.array(end, float)) for end in ends) >= CM * SHORTEST_END


class TestAngles:
    def test_they_are_continuous_away_from_gimbal_lock(self, case):
        """ω is the sum of three turns about axes, of which those of z and y are 90° - x apart: neither
        angle changes faster than ω / cos x, and so never by the 360° of a wrapped angle."""
        fit, text, _ = case
        angles = motion_of(text)[:, 3:].reshape(len(fit.frame_numbers), -1, 3)
        names = re.findall(r"(?:ROOT|JOINT) (\w+)", text)
        rig, _, _ = rig_of(fit)
        checked = 0
        for name, local in zip(rig.names, rig.rotation, strict=True):
            step = np.degrees(
                Rotation.from_matrix(local[:-1].swapaxes(1, 2) @ local[1:]).magnitude()
            )
            track = angles[:, names.index(name)]
            cosine = np.abs(np.cos(np.radians(track[:, 1])))
            cosine = np.minimum(cosine[:-1], cosine[1:])
            # A step is short where cos x changes little over it.
            free = (cosine > 0.3) & (step < 10)
            checked += free.sum()
            jump = np.abs(np.diff(track, axis=0)).max(axis=1)
            assert (jump[free] <= 1.5 * step[free] / cosine[free] + 1e-5).all(), name
        assert checked > 0.8 * angles.shape[0] * angles.shape[1]

    def test_no_angle_jumps_by_a_full_turn(self, case):
        _, text, _ = case
        steps = np.abs(np.diff(motion_of(text)[:, 3:], axis=0))
        # Six decimals on both sides.
        assert steps.max() <= 180 + 1e-6

    @pytest.mark.parametrize("order", ORDERS)
    def test_every_order_is_exactly_the_rotation(self, order):
        turn = Rotation.random(300, random_state=4).as_matrix()
        angles = euler_angles(turn, order)
        again = Rotation.from_euler(order, angles, degrees=True).as_matrix()
        np.testing.assert_allclose(again, turn, rtol=0, atol=1e-12)

    @pytest.mark.parametrize("order", ORDERS)
    @pytest.mark.parametrize("end", [360.0, -360.0])
    def test_through_gimbal_lock_no_channel_steps_more_than_the_motion(self, order, end):
        """The middle angle goes full circle, twice through lock, the others slowly: 400 steps of at most
        0.9° that come back as they were, half a turn more in two of them included."""
        t = np.linspace(0, 1, 401)[:, None]
        given = np.hstack([20 * np.sin(6 * t), end * t, 30 * t])
        turn = Rotation.from_euler(order, given, degrees=True).as_matrix()
        angles = euler_angles(turn, order)
        assert np.abs(np.diff(angles, axis=0)).max() <= np.abs(np.diff(given, axis=0)).max() + 1e-9
        again = Rotation.from_euler(order, angles, degrees=True).as_matrix()
        np.testing.assert_allclose(again, turn, rtol=0, atol=1e-12)

    @pytest.mark.parametrize("middle", [90.0, -90.0])
    def test_within_gimbal_lock_nothing_jumps(self, middle):
        t = np.linspace(0, 1, 200)[:, None]
        given = np.hstack([40 * t, np.full_like(t, middle), 80 * t])
        turn = Rotation.from_euler("ZXY", given, degrees=True).as_matrix()
        angles = euler_angles(turn, "ZXY")
        # Sum or difference is all that is left: 120° in 199 steps, all of it in one channel at most.
        assert np.abs(np.diff(angles, axis=0)).max() <= 120 / 199 + 1e-6
        again = Rotation.from_euler("ZXY", angles, degrees=True).as_matrix()
        np.testing.assert_allclose(again, turn, rtol=0, atol=1e-7)

    def test_an_unknown_order_is_refused(self):
        with pytest.raises(ValueError, match="order"):
            euler_angles(np.eye(3)[None], "ZXZ")


def rest_of(text, folder):
    """Joints and end points (3,) of a file's rest pose, its root at its OFFSET."""
    path = folder / "rest.bvh"
    path.write_text(text)
    read = pybvh.read_bvh_file(path)
    head, _ = text.split("MOTION")
    offsets = re.findall(r"(?:ROOT|JOINT|End) (\S+)\s*\{\s*OFFSET (\S+) (\S+) (\S+)", head)
    return {
        name: np.array(row[1:], float) for name, row in zip(read.node_index, offsets, strict=True)
    }


class TestRestPose:
    @pytest.mark.parametrize(("name", "subject"), BUNDLED)
    @pytest.mark.parametrize("up", ["x", "y", "z"])
    def test_it_is_a_t_pose_whatever_the_axes_are(self, name, subject, up, tmp_path):
        fit = fit_sample(name, subject)
        offset = rest_of(text_of(fit, up=up), tmp_path)
        turn = {"y": np.eye(3), "z": [[1, 0, 0], [0, 0, 1], [0, -1, 0]], "x": [[0, -1, 0], [1, 0, 0], [0, 0, 1]]}  # fmt: skip
        offset = {k: np.asarray(turn[up]) @ v for k, v in offset.items()}
        six = 1e-5
        for side, x in (("Left", 1.0), ("Right", -1.0)):
            for arm in (f"{side}Elbow", f"{side}Wrist", f"EndSite{side}Wrist"):
                np.testing.assert_allclose(offset[arm][1:], 0, atol=six, err_msg=arm)
                assert x * offset[arm][0] > 5
            for leg in (f"{side}Knee", f"{side}Ankle"):
                np.testing.assert_allclose(offset[leg][[0, 2]], 0, atol=six, err_msg=leg)
                assert offset[leg][1] < -30
            foot = offset[f"EndSite{side}Ankle"]
            assert foot[2] > 5 and abs(foot[0]) <= six and -foot[2] < foot[1] <= 0
            # Distances are the fitted ones: the hips of both bundled figures are 17 cm apart or more.
            assert x * offset[f"{side}Hip"][0] > 7 and x * offset[f"{side}Shoulder"][0] > 14
        np.testing.assert_allclose(offset["EndSiteNeck"][[0, 2]], 0, atol=six)
        level = offset["LeftHip"] - offset["RightHip"]
        assert abs(level[1]) < 1 and abs(level[2]) < 1

    def test_bones_keep_their_fitted_lengths(self, case):
        fit, text, path = case
        offset = rest_of(text, path.parent)
        for joint in fit.joints:
            own = fit.segments[joint.parent].joint
            length = np.linalg.norm(joint.centre - (0 if own is None else own))
            assert np.linalg.norm(offset[joint.joint]) / CM == pytest.approx(length, abs=LENGTH)

    def test_it_stands_on_the_floor(self, case):
        fit, _, _ = case
        joints, ends = rest_places(rig_of(fit)[0])
        assert min(joints[:, 1].min(), *(end[1] for end in ends.values())) == pytest.approx(0)
        np.testing.assert_array_equal(joints[0, [0, 2]], 0)

    def test_knees_bend_about_the_sideways_axis_and_elbows_about_the_vertical(self, case):
        fit, _, _ = case
        rig, segments, _ = rig_of(fit)
        for i, segment in enumerate(segments):
            if segment.rest_axis is None:
                continue
            axis = hinge_axis(rig.rotation[i])
            if axis is not None:
                # The rig's bones are turned by degrees from their markers, which gave the axis.
                assert abs(axis @ segment.rest_axis) > np.cos(np.radians(15)), segment.name

    def test_zero_channels_of_bvhio_are_it_too(self, case):
        fit, text, path = case
        zero = path.parent / "zero.bvh"
        lines = text.splitlines()
        at = next(i for i, line in enumerate(lines) if line.startswith("Frame Time"))
        count = len(lines[at + 1].split())
        lines = [*lines[: at + 1], " ".join(["0.000000"] * count)]
        zero.write_text("\n".join(lines).replace(f"Frames: {len(fit.frame_numbers)}", "Frames: 1") + "\n")  # fmt: skip
        done = subprocess.run(
            [sys.executable, "-c", BVHIO, str(zero), "0"],
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert done.returncode == 0, done.stderr
        found = {name: np.array(place[0]) for name, place in json.loads(done.stdout).items()}
        rig, _, _ = rig_of(fit)
        joints, _ = rest_places(rig)
        for name, place in zip(rig.names, joints - joints[0], strict=True):
            np.testing.assert_allclose(found[name] / CM, place, atol=SINGLE, err_msg=name)

    def test_a_figure_without_directions_rests_in_its_average_pose(self):
        fit = fit_sample("range_of_motion")
        plain = replace(
            fit.skeleton,
            segments=tuple(
                replace(s, rest=None, rest_joint=None, rest_axis=None)
                for s in fit.skeleton.segments
            ),
        )
        rendered = write(replace(fit, skeleton=plain))
        assert any("average" in note and "Hips" in note for note in rendered.notes)
        assert not any("average" in note for note in write(fit).notes)
        assert np.isfinite(motion_of(rendered.files[".bvh"])).all()


class TestOptions:
    @pytest.mark.parametrize("order", ORDERS)
    def test_rotation_orders_are_read_as_the_same_motion(self, order, tmp_path):
        fit = fit_sample("nearly_still")
        path = tmp_path / "order.bvh"
        path.write_text(text_of(fit, rotation_order=order))
        x, y, z = (f"{axis}rotation" for axis in order)
        assert f"CHANNELS 3 {x} {y} {z}\n" in path.read_text()
        read = pybvh.read_bvh_file(path)
        rig, _, _ = rig_of(turned(fit, "y"))
        joints, _ = forward(rig)
        positions = read.node_positions() / CM
        for name, track in zip(rig.names, joints, strict=True):
            np.testing.assert_allclose(positions[:, read.node_index[name]], track, atol=LENGTH)

    def test_scale_scales_lengths_and_not_angles(self):
        fit = fit_sample("nearly_still")
        cm, m = motion_of(text_of(fit)), motion_of(text_of(fit, scale=1.0))
        np.testing.assert_allclose(m[:, :3], cm[:, :3] / CM, atol=1e-6)
        np.testing.assert_array_equal(m[:, 3:], cm[:, 3:])

    def test_names(self):
        fit = fit_sample("nearly_still")
        found = {
            naming: re.findall(r"(?:ROOT|JOINT) (.*)", text_of(fit, names=naming))
            for naming in ("mocap", "mixamo", "cmu")
        }
        assert found["mocap"][:2] == ["Hips", "Waist"]
        assert {"Hips", "Spine", "Head", "LeftUpLeg", "LeftForeArm"} <= set(found["cmu"])
        assert found["mixamo"] == [f"mixamorig:{name}" for name in found["cmu"]]
        for names in found.values():
            assert len(set(names)) == len(names) == 15

    def test_a_joint_with_no_name_there_keeps_its_own(self):
        segments = (Segment("Tail 1", "Hips", "Tail base", ()), Segment("Hips", None, None, ()))
        names, notes = joint_names(segments, "mixamo")
        assert names == ("Tail_base", "mixamorig:Hips")
        assert len(notes) == 1 and "Tail base" in notes[0]
        with pytest.raises(ValueError, match="names"):
            joint_names(segments, "maya")

    def test_floor_puts_the_lowest_point_on_zero(self):
        fit = turned(fit_sample("nearly_still"), "y")
        up = np.array([0.0, 0.7, 0.0])
        raised = replace(
            fit,
            segments={
                name: replace(s, pose=Pose(s.pose.rotation, s.pose.origin + up))
                for name, s in fit.segments.items()
            },
        )
        _, _, notes = rig_of(raised)
        assert any("over zero" in note and "--floor" in note for note in notes)
        rig, _, notes = rig_of(raised, floor=True)
        assert not any("zero" in note for note in notes)
        joints, ends = forward(rig)
        assert min(joints[..., 1].min(), *(e[:, 1].min() for e in ends.values())) == pytest.approx(0)  # fmt: skip

    def test_the_root_can_rest_at_the_origin(self):
        fit = fit_sample("nearly_still")
        plain, zero = text_of(fit), text_of(fit, root_at_origin=True)
        assert re.search(r"ROOT Hips\s*\{\s*OFFSET 0\.000000 0\.000000 0\.000000\n", zero)
        np.testing.assert_array_equal(motion_of(plain), motion_of(zero))


class TestGaps:
    def test_a_short_gap_is_filled_and_listed(self):
        gap = slice(100, 112)
        fit = fit_without(on("Head"), gap)
        rendered = write(fit)
        # The clip's first frame is number 101.
        assert any("Head" in note and "201-212" in note for note in rendered.notes)
        found = motion_of(rendered.files[".bvh"])
        assert np.isfinite(found).all() and len(found) == 300
        whole = motion_of(text_of(fit_recording(recording())))
        # Twelve frames are 0.2 s: the head is near where it was.
        read = re.findall(r"(?:ROOT|JOINT) (\w+)", rendered.files[".bvh"])
        neck = 3 + 3 * read.index("Neck")
        away = (found - whole)[gap, neck : neck + 3]
        assert 0 < np.abs((away + 180) % 360 - 180).max() < 30

    def test_a_gap_in_the_root_is_filled_along_a_line(self):
        gap = slice(100, 106)
        fit = fit_without(["RFWT", "LFWT"], gap)
        rendered = write(fit)
        assert any("Hips" in note and "201-206" in note for note in rendered.notes)
        places = motion_of(rendered.files[".bvh"])[99:107, :3]
        # Six decimals, and the second difference takes each four times.
        np.testing.assert_allclose(np.diff(places, 2, axis=0)[:-1], 0, atol=4 * 0.5e-6)

    def test_single_frames_are_listed_as_such(self):
        fit = fit_without(on("Head"), [50, 60])
        assert any("151, 161" in note for note in write(fit).notes)

    def test_too_long_a_gap_is_refused(self):
        most = int(LONGEST_GAP * 60)
        fit = fit_without(on("Head"), slice(100, 100 + most))
        assert any("Head" in note for note in write(fit).notes)
        fit = fit_without(on("Head"), slice(100, 100 + most + 1))
        with pytest.raises(ExportError, match=r"Head has no pose for 0\.5 s"):
            write(fit)

    def test_missing_ends_need_trim(self):
        fit = fit_without(on("Head"), [0, 1, 2, 299])
        with pytest.raises(ExportError, match="101-103, 400") as caught:
            write(fit)
        assert "--trim" in caught.value.hint
        rendered = write(fit, trim=True)
        assert any("4 incomplete frames" in note for note in rendered.notes)
        assert "Frames: 296\n" in rendered.files[".bvh"]
        whole = motion_of(text_of(fit_recording(recording())))
        trimmed = motion_of(rendered.files[".bvh"])
        # The root does not depend on the head; centimetres, six decimals.
        np.testing.assert_allclose(trimmed[:, :3], whole[3:299, :3], atol=1e-6)

    def test_gaps_are_numbered_by_the_file_after_trimming_too(self):
        fit = fit_without(on("Head"), [0, 1, 2, 150])
        notes = write(fit, trim=True).notes
        assert any("Head" in note and re.search(r"\b251\b", note) for note in notes)

    def test_segments_that_are_never_seen_at_the_same_time_are_refused(self):
        clip = recording()
        points = clip.points.copy()
        for label in on("Head"):
            points[150:, clip.labels.index(label)] = np.nan
        for label in on("LeftFoot"):
            points[:150, clip.labels.index(label)] = np.nan
        fit = fit_recording(replace(clip, points=points))
        for trim in (False, True):
            with pytest.raises(ExportError, match="not seen at the same time"):
                write(fit, trim=trim)

    def test_the_bundled_clip_with_gaps_says_what_is_missing(self):
        fit = fit_sample("gaps")
        with pytest.raises(ExportError, match="not every segment has a pose") as caught:
            write(fit)
        assert "trim" in caught.value.hint

    def test_a_joint_that_is_not_fitted_is_left_out_and_listed(self):
        fit = fit_without(["LFIN"], slice(None))
        rendered = write(fit)
        assert any("without LeftWrist" in note for note in rendered.notes)
        text = rendered.files[".bvh"]
        assert "LeftWrist" not in text and "RightWrist" in text
        assert text.count("End Site") == 5
        ends = re.findall(r"End Site\s*\{\s*OFFSET (\S+) (\S+) (\S+)", text)
        assert min(np.linalg.norm(np.array(end, float)) for end in ends) >= CM * SHORTEST_END
        assert len(motion_of(text)[0]) == 6 + 13 * 3

    def test_a_branch_that_is_not_fitted_is_left_out_whole(self):
        fit = fit_without(on("UpperLeftArm"), slice(None))
        rendered = write(fit)
        (note,) = (note for note in rendered.notes if "without" in note)
        assert all(name in note for name in ("LeftShoulder", "LeftElbow", "LeftWrist"))
        assert rendered.files[".bvh"].count("JOINT") == 11

    def test_trim_is_what_the_writer_is_told(self):
        fit = turned(fit_without(on("Head"), [0]), "y")
        text, notes = bvh(fit, trim=True)
        assert "Frames: 299\n" in text
        assert notes == write(fit_without(on("Head"), [0]), trim=True).notes


class TestFilling:
    @LAWS
    @given(st.lists(st.booleans(), max_size=30))
    def test_runs_are_the_stretches_of_true(self, flags):
        found = runs(np.array(flags, dtype=bool))
        rebuilt = np.zeros(len(flags), dtype=bool)
        for start, stop in found:
            assert start < stop
            assert not rebuilt[max(start - 1, 0) : stop + 1].any()
            rebuilt[start:stop] = True
        assert rebuilt.tolist() == flags

    def test_runs_of_nothing_and_of_everything(self):
        assert runs(np.zeros(0, dtype=bool)) == []
        assert runs(np.zeros(3, dtype=bool)) == []
        assert runs(np.ones(3, dtype=bool)) == [(0, 3)]
        assert runs(np.array([True, False, True, True])) == [(0, 1), (2, 4)]

    @LAWS
    @given(st.integers(0, 2**32 - 1), st.floats(0, np.pi))
    def test_rotations_are_filled_as_by_slerp(self, seed, angle):
        rng = np.random.default_rng(seed)
        axis = rng.normal(size=3)
        ends = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))
        first = Rotation.random(random_state=rng)
        keys = Rotation.concatenate([first, first * ends])
        count = int(rng.integers(1, 20))
        track = np.full((count + 2, 3, 3), np.nan)
        track[0], track[-1] = keys.as_matrix()
        filled = fill_rotations(track)
        np.testing.assert_array_equal(filled[[0, -1]], track[[0, -1]])
        times = np.arange(count + 2) / (count + 1)
        # An angle's cosine is known to eps; near half a turn and near none its angle to √eps, the
        # axis at half a turn likewise.
        tolerance = 4 * np.sqrt(np.finfo(float).eps)
        step = Rotation.from_matrix(filled[:-1].swapaxes(1, 2) @ filled[1:]).magnitude()
        np.testing.assert_allclose(step, angle / (count + 1), rtol=0, atol=tolerance)
        if angle < np.pi - 1e-3:
            expected = Slerp([0.0, 1.0], keys)(times).as_matrix()
            np.testing.assert_allclose(filled, expected, rtol=0, atol=tolerance)
        unit = filled.swapaxes(1, 2) @ filled
        np.testing.assert_allclose(unit, np.broadcast_to(np.eye(3), unit.shape), atol=1e-12)
        assert (np.linalg.det(filled) > 0).all()

    @pytest.mark.parametrize(
        "axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0, 0.8), (-0.6, 0.8, 0)]
    )
    def test_half_a_turn_goes_one_way_or_the_other_at_constant_speed(self, axis):
        track = np.full((5, 3, 3), np.nan)
        track[0] = np.eye(3)
        track[4] = 2 * np.outer(axis, axis) - np.eye(3)
        filled = Rotation.from_matrix(fill_rotations(track))
        for k in range(1, 4):
            vector = filled[k].as_rotvec()
            assert np.linalg.norm(vector) == pytest.approx(k * np.pi / 4, abs=1e-12)
            assert abs(np.dot(vector / np.linalg.norm(vector), axis)) == pytest.approx(1, abs=1e-12)

    def test_no_turn_at_all_stays_where_it_is(self):
        track = np.full((4, 3, 3), np.nan)
        track[0] = track[3] = Rotation.from_rotvec([0.3, -0.2, 0.9]).as_matrix()
        np.testing.assert_allclose(fill_rotations(track), np.tile(track[0], (4, 1, 1)), atol=1e-15)

    def test_several_gaps_are_each_filled_between_their_own_ends(self):
        turn = Rotation.from_rotvec(np.linspace(0, 2, 21)[:, None] * [0.0, 0.6, 0.8]).as_matrix()
        gappy = turn.copy()
        gappy[[3, 4, 10, 15, 16, 17]] = np.nan
        # At constant speed about one axis, filling is undoing.
        np.testing.assert_allclose(fill_rotations(gappy), turn, rtol=0, atol=1e-14)
        line = np.linspace(0, 1, 21)[:, None] * [1.0, -2.0, 3.0]
        holes = line.copy()
        holes[[3, 4, 10, 15, 16, 17]] = np.nan
        np.testing.assert_allclose(fill_positions(holes), line, rtol=0, atol=1e-14)

    def test_what_is_complete_is_left_as_it_is(self):
        turn = Rotation.random(5, random_state=1).as_matrix()
        np.testing.assert_array_equal(fill_rotations(turn), turn)
        place = np.random.default_rng(1).normal(size=(5, 3))
        np.testing.assert_array_equal(fill_positions(place), place)

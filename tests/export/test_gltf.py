"""GLB read back by hand from the glTF 2.0 specification, against the rig that it was made from.

The file holds single precision: 2^-24 of 3 m are 2e-7 m, and of a quaternion 6e-8, twice that as an angle, six times
in a row over a chain of 1 m. 1e-5 m is what the project promises. Blender and three.js read it in
`make blender` and `make three`.
"""

import json
import struct
import sys
from dataclasses import replace

import numpy as np
import pytest
from figures import corners, moving, resting
from recordings import fit_sample
from rigs import rig_of
from scipy.spatial.transform import Rotation

from mocap_skel.errors import MissingExtraError
from mocap_skel.export.body import AROUND, RINGS, Capsule, body, capsules
from mocap_skel.export.gltf import glb, quaternions
from mocap_skel.results.axes import turned
from mocap_skel.rig.kinematics import Rig, forward, rest_places

pytest.importorskip("pygltflib")

PROMISED, SINGLE = 1e-5, 3e-7
BUNDLED = [("range_of_motion", None), ("two_dancers", "Anna")]
KINDS = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
SIZES = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}
CORNERS = 2 + 2 * RINGS * AROUND


class Read:
    """A GLB's JSON and binary chunk, taken apart by the specification's section 4."""

    def __init__(self, content):
        magic, version, length = struct.unpack_from("<4sII", content)
        assert (magic, version, length) == (b"glTF", 2, len(content))
        size, kind = struct.unpack_from("<I4s", content, 12)
        assert kind == b"JSON" and size % 4 == 0
        self.json = json.loads(content[20 : 20 + size])
        start = 20 + size
        size, kind = struct.unpack_from("<I4s", content, start)
        assert kind == b"BIN\0" and size % 4 == 0
        self.binary = content[start + 8 :]
        (buffer,) = self.json["buffers"]
        assert len(self.binary) == size and 0 <= size - buffer["byteLength"] < 4
        self.nodes = self.json["nodes"]

    def array(self, index):
        accessor = self.json["accessors"][index]
        view = self.json["bufferViews"][accessor["bufferView"]]
        width = SIZES[accessor["type"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        count = accessor["count"] * width
        found = np.frombuffer(self.binary, KINDS[accessor["componentType"]], count, start)
        return found.reshape(-1, width) if width > 1 else found

    def attribute(self, name):
        (part,) = self.json["meshes"][0]["primitives"]
        return self.array(part["attributes"][name])

    def tracks(self):
        """(node, path) → values, and the times they share."""
        (motion,) = self.json["animations"]
        found, times = {}, set()
        for channel in motion["channels"]:
            sampler = motion["samplers"][channel["sampler"]]
            assert sampler["interpolation"] == "LINEAR"
            times.add(sampler["input"])
            target = channel["target"]
            found[target["node"], target["path"]] = self.array(sampler["output"]).astype(float)
        return found, self.array(*times)

    def world(self, frames):
        """Rotation (frames, 3, 3) and place (frames, 3) of every node; the rest pose for no tracks."""
        tracks = self.tracks()[0] if frames else {}
        frames = frames or 1
        found = {}
        waiting = [
            (i, np.tile(np.eye(3), (frames, 1, 1)), np.zeros((frames, 3)))
            for i in self.json["scenes"][self.json["scene"]]["nodes"]
        ]
        while waiting:
            i, turn, place = waiting.pop()
            node = self.nodes[i]
            assert "rotation" not in node and "scale" not in node and "matrix" not in node
            there = tracks.get((i, "translation"), np.array([node.get("translation", [0, 0, 0])]))
            place = place + (turn @ there[:, :, None])[..., 0]
            if (i, "rotation") in tracks:
                turn = turn @ Rotation.from_quat(tracks[i, "rotation"]).as_matrix()
            found[i] = turn, place
            waiting += [(child, turn, place) for child in node.get("children", [])]
        return found

    def named(self, frames):
        return {
            self.nodes[i]["name"]: place
            for i, (_, place) in self.world(frames).items()
            if i in self.json["skins"][0]["joints"]
        }


@pytest.fixture(scope="module", params=BUNDLED, ids=["one", "dancer"])
def case(request):
    fit = turned(fit_sample(*request.param), "y")
    rig, _, _ = rig_of(fit)
    return rig, fit.rate, Read(glb(rig, fit.rate, title="walk"))


def chain(*bones, frames=2):
    """A rig at rest: (name, parent's name or None, offset), and (name, offset) for a limb's end."""
    joints = [bone for bone in bones if len(bone) == 3]
    names = tuple(name for name, _, _ in joints)
    offsets = np.array([offset for _, _, offset in joints], float)
    return Rig(
        names,
        tuple(-1 if parent is None else names.index(parent) for _, parent, _ in joints),
        offsets,
        {names.index(bone[0]): np.array(bone[1], float) for bone in bones if len(bone) == 2},
        np.tile(offsets[0], (frames, 1)),
        np.tile(np.eye(3), (len(names), frames, 1, 1)),
    )


def with_collar_bones():
    bones = [("Hips", None, (0, 1, 0)), ("Spine", "Hips", (0, 0.3, 0)), ("Neck", "Spine", (0, 0.22, 0)),
             ("Head", "Neck", (0, 0.1, 0)), ("Head", (0, 0.12, 0))]  # fmt: skip
    for side, x in (("L", 1), ("R", -1)):
        bones += [
            (f"{side}Collar", "Spine", (0.03 * x, 0.17, 0)),
            (f"{side}Arm", f"{side}Collar", (0.15 * x, 0, 0)),
            (f"{side}Fore", f"{side}Arm", (0.3 * x, 0, 0)),
            (f"{side}Fore", (0.3 * x, 0, 0)),
            (f"{side}Leg", "Hips", (0.09 * x, -0.05, 0)),
            (f"{side}Shank", f"{side}Leg", (0, -0.45, 0)),
            (f"{side}Foot", f"{side}Shank", (0, -0.44, 0)),
            (f"{side}Foot", (0, -0.06, 0.2)),
        ]
    return chain(*bones)


class TestMotion:
    def test_every_joint_and_end_is_where_the_model_has_it_in_every_frame(self, case):
        rig, _, read = case
        found, expected = read.named(len(rig.position)), moving(rig)
        assert set(found) == set(expected)
        for name, track in expected.items():
            assert np.abs(found[name] - track).max() <= PROMISED, name

    def test_the_rest_pose_is_the_rigs(self, case):
        rig, _, read = case
        found = read.named(0)
        for name, place in resting(rig).items():
            np.testing.assert_allclose(found[name][0], place, rtol=0, atol=SINGLE, err_msg=name)

    def test_times_are_seconds_from_zero(self, case):
        rig, rate, read = case
        times = read.tracks()[1]
        expected = np.arange(len(rig.position)) / rate
        np.testing.assert_allclose(times, expected, rtol=1e-7)
        assert (np.diff(times) > 0).all()

    def test_quaternions_are_unit_and_without_jumps_of_sign(self, case):
        rig, _, read = case
        tracks, _ = read.tracks()
        assert set(tracks) == {(0, "translation")} | {
            (i, "rotation") for i in range(len(rig.names))
        }
        for i in range(len(rig.names)):
            track = tracks[i, "rotation"]
            np.testing.assert_allclose(np.linalg.norm(track, axis=1), 1, rtol=0, atol=2e-7)
            # The dot product is the cosine of half the turn from frame to frame.
            step = Rotation.from_matrix(rig.rotation[i, :-1].swapaxes(1, 2) @ rig.rotation[i, 1:])
            cosine = (track[1:] * track[:-1]).sum(axis=1)
            np.testing.assert_allclose(cosine, np.cos(step.magnitude() / 2), rtol=0, atol=1e-6)

    @pytest.mark.parametrize("axis", [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, -2, 3]])
    def test_two_full_turns_come_back_to_the_same_quaternion(self, axis):
        """Through half turns, where w is 0, and a full one, where it is -1."""
        angle = np.linspace(0, 4 * np.pi, 145)
        turn = Rotation.from_rotvec(angle[:, None] * np.array(axis) / np.linalg.norm(axis))
        found = quaternions(turn.as_matrix())
        direction = np.array(axis) / np.linalg.norm(axis)
        expected = np.column_stack([np.sin(angle / 2)[:, None] * direction, np.cos(angle / 2)])
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)

    @pytest.mark.parametrize("up", ["x", "y", "z"])
    def test_whatever_is_up_becomes_y_and_the_rest_pose_faces_z(self, up):
        fit = turned(fit_sample("nearly_still"), up)
        rig, _, _ = rig_of(fit)
        read = Read(glb(rig, fit.rate, up=up))
        found, frames = read.named(len(rig.position)), moving(rig)
        for name, track in frames.items():
            height = track[:, "xyz".index(up)]
            np.testing.assert_allclose(found[name][:, 1], height, rtol=0, atol=PROMISED)
        upright = rig_of(turned(fit, "y"))[0]
        still = read.named(0)
        for name, place in resting(upright).items():
            np.testing.assert_allclose(still[name][0], place, rtol=0, atol=SINGLE)
        assert still["LeftAnkle_end"][0, 2] - still["LeftAnkle"][0, 2] > 0.05
        assert still["LeftWrist"][0, 0] > 0.4

    def test_an_unknown_axis_is_refused(self, case):
        with pytest.raises(ValueError, match="w"):
            glb(case[0], case[1], up="w")


class TestFile:
    def test_accessors_keep_the_rules(self, case):
        """Sections 3.6.2.4 and 3.7.2: aligned to their components, vertices to four bytes, inside their views;
        POSITION and times with their least and largest value; targets only for what a GPU reads."""
        _, _, read = case
        views = read.json["bufferViews"]
        (part,) = read.json["meshes"][0]["primitives"]
        bounded = {
            part["attributes"]["POSITION"],
            read.json["animations"][0]["samplers"][0]["input"],
        }
        end = 0
        for i, accessor in enumerate(read.json["accessors"]):
            array, view = read.array(i), views[accessor["bufferView"]]
            offset = view.get("byteOffset", 0)
            assert accessor.get("byteOffset", 0) == 0 and offset % 4 == 0 and offset >= end
            assert view["byteLength"] == array.nbytes and "byteStride" not in view
            end = offset + array.nbytes
            if i in bounded:
                rows = array.reshape(len(array), -1)
                assert accessor["min"] == rows.min(axis=0).tolist()
                assert accessor["max"] == rows.max(axis=0).tolist()
            if i in part["attributes"].values():
                assert view["target"] == 34962 and array.strides[0] % 4 == 0
            else:
                assert view.get("target") == (34963 if i == part["indices"] else None)
        assert end <= read.json["buffers"][0]["byteLength"]

    def test_the_scene_holds_the_figure_and_beside_it_the_skinned_body(self, case):
        rig, _, read = case
        (scene,) = read.json["scenes"]
        figure, shape = (read.nodes[i] for i in scene["nodes"])
        assert figure == {"name": "walk", "children": [0]}
        assert shape == {"name": "Body", "mesh": 0, "skin": 0}
        (skin,) = read.json["skins"]
        assert skin["joints"] == list(range(len(rig.names) + len(rig.ends)))
        assert [node["name"] for node in read.nodes[: len(rig.names)]] == list(rig.names)
        assert read.json["animations"][0]["name"] == "walk"
        assert read.json["asset"]["version"] == "2.0"
        assert read.json["asset"]["generator"].startswith("mocap-skel ")

    def test_without_a_body_or_a_frame_the_joints_are_left(self, case):
        rig, rate, _ = case
        read = Read(glb(rig, rate, mesh=False))
        assert not {"meshes", "materials"} & set(read.json)
        assert read.named(len(rig.position)).keys() == moving(rig).keys()
        still = replace(rig, position=rig.position[:0], rotation=rig.rotation[:, :0])
        read = Read(glb(still, rate))
        assert "animations" not in read.json
        assert read.json["scenes"][0]["nodes"] == [
            len(rig.names) + len(rig.ends) + i for i in (0, 1)
        ]
        one = replace(rig, position=rig.position[:1], rotation=rig.rotation[:, :1])
        assert Read(glb(one, rate)).tracks()[1].tolist() == [0.0]

    def test_a_rig_without_lengths_has_no_body(self):
        read = Read(glb(chain(("Only", None, (0, 1, 0))), 100.0))
        assert "meshes" not in read.json and len(read.json["skins"][0]["joints"]) == 1

    def test_without_the_library_one_line_says_what_to_install(self, case, monkeypatch):
        monkeypatch.setitem(sys.modules, "pygltflib", None)
        with pytest.raises(MissingExtraError, match="pygltflib") as caught:
            glb(case[0], case[1])
        assert "mocap-skel[gltf]" in str(caught.value.hint)


class TestBody:
    def test_the_skin_moves_the_body_with_the_joints(self, case):
        """Joint times inverse bind matrix times corner, as a GPU does it, against the model's kinematics."""
        rig, _, read = case
        frames = np.linspace(0, len(rig.position) - 1, 10).astype(int)
        chosen, expected = corners(rig, frames)
        world = read.world(len(rig.position))
        (skin,) = read.json["skins"]
        inverse = read.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2)
        joints, weights = read.attribute("JOINTS_0"), read.attribute("WEIGHTS_0")
        np.testing.assert_array_equal(weights, np.tile([255, 0, 0, 0], (len(weights), 1)))
        assert not joints[:, 1:].any()
        points = read.attribute("POSITION").astype(float)
        for at, place in zip(chosen, expected.swapaxes(0, 1), strict=True):
            joint = joints[at, 0]
            inside = inverse[joint] @ np.append(points[at], 1.0)
            assert inside[3] == 1.0
            turn, origin = world[skin["joints"][joint]]
            found = turn[frames] @ inside[:3] + origin[frames]
            np.testing.assert_allclose(found, place, rtol=0, atol=PROMISED)

    def test_every_bone_is_a_capsule_from_joint_to_joint(self, case):
        """In the file: a corner less its normal times the ball's radius is a joint, or the end of a limb."""
        rig, _, read = case
        points, normals = read.attribute("POSITION"), read.attribute("NORMAL")
        parts = capsules(rig)
        assert len(points) == CORNERS * len(parts)
        places, ends = rest_places(rig)
        known = np.concatenate([places, *([end] for end in ends.values())])
        bones = set()
        for k, part in enumerate(parts):
            mine = slice(k * CORNERS, (k + 1) * CORNERS)
            first = np.arange(CORNERS) <= RINGS * AROUND
            inner = points[mine] - np.where(first, *part.radii)[:, None] * normals[mine]
            free = points[mine, 1] > known[:, 1].min() + 1e-6
            for half, centre in ((first, part.start), (~first, part.end)):
                assert np.linalg.norm(known - centre, axis=1).min() == 0
                apart = np.linalg.norm(inner[half & free] - centre, axis=1)
                assert apart.size and apart.max() <= SINGLE
            np.testing.assert_array_equal(read.attribute("JOINTS_0")[mine, 0], part.joint)
            bones.add((part.joint, *np.round(part.end, 9)))
        for i, parent in enumerate(rig.parents):
            assert parent < 0 or (parent, *np.round(places[i], 9)) in bones
        for i, end in ends.items():
            assert (i, *np.round(end, 9)) in bones

    def test_triangles_face_outward_and_normals_are_unit(self, case):
        _, _, read = case
        points = read.attribute("POSITION").astype(float)
        normals = read.attribute("NORMAL").astype(float)
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, rtol=0, atol=2e-7)
        (part,) = read.json["meshes"][0]["primitives"]
        triangles = read.array(part["indices"]).reshape(-1, 3).astype(int)
        assert triangles.max() == len(points) - 1
        a, b, c = points[triangles].swapaxes(0, 1)
        facing = (np.cross(b - a, c - a) * normals[triangles].sum(axis=1)).sum(axis=1)
        assert (facing > 0).all()
        # Closed: each edge is passed once in each direction. A ball's halves share places, not corners.
        _, same = np.unique(
            np.column_stack([points, np.arange(len(points)) // CORNERS]),
            axis=0,
            return_inverse=True,
        )
        triangles = same.reshape(-1)[triangles]
        edges = np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)])
        assert {tuple(e) for e in edges.tolist()} == {tuple(e) for e in edges[:, ::-1].tolist()}
        assert len(np.unique(edges, axis=0)) == len(edges)

    @pytest.mark.parametrize(
        ("length", "radii"), [(0.4, (0.1, 0.1)), (0.5, (0.12, 0.05)), (0.0, (0.1, 0.1))]
    )
    def test_a_capsules_volume_is_two_balls_and_the_cone_that_touches_them(self, length, radii):
        """By Gauss's theorem over its triangles; they lie inside, so it is less. A polygon of sixteen corners has
        sin(x) / x of its circle, x = 22.5°; in three dimensions it is no worse than that to the third."""
        shape = body([Capsule(0, np.array([0.3, 0, 0]), np.array([0.3, length, 0]), radii)])
        a, b, c = shape.points[shape.triangles].swapaxes(0, 1)
        volume = float((a * np.cross(b, c)).sum()) / 6
        # As a body of revolution, x² summed up along the axis over its outline.
        (big, small), steps = radii, np.linspace(-radii[0], length + radii[1], 20001)
        sine = (big - small) / length if length else 0.0
        cosine = np.sqrt(1 - sine**2)
        outline = np.zeros_like(steps)
        for radius, centre in ((big, 0.0), (small, length)):
            outline = np.maximum(outline, radius**2 - (steps - centre) ** 2)
        cone = (steps >= big * sine) & (steps <= length + small * sine)
        outline[cone] = (((big - steps * sine) / cosine) ** 2)[cone]
        exact = np.pi * np.sum((outline[1:] + outline[:-1]) * np.diff(steps)) / 2
        assert (np.sin(np.pi / 8) / (np.pi / 8)) ** 3 * exact < volume < exact

    def test_it_is_a_person(self, case):
        """Trunk thicker than thighs, thighs than arms, hands thinnest; one ball, the head, on top; soles on the
        floor of the rest pose, and a height of 1.5 to 2 m."""
        rig, _, read = case
        parts = capsules(rig)
        name = [rig.names[part.joint] for part in parts]
        radius = {}
        for part, joint in zip(parts, name, strict=True):
            radius[joint] = max(radius.get(joint, 0.0), *part.radii)
        balls = [part for part in parts if part.ball]
        assert len(balls) == 1 and rig.names[balls[0].joint] == "Neck"
        assert 0.07 < balls[0].radii[0] < 0.13
        assert radius["Waist"] > radius["LeftHip"] > radius["LeftShoulder"] > radius["LeftWrist"]
        assert min(radius, key=radius.get) in ("LeftWrist", "RightWrist")
        points = read.attribute("POSITION")
        assert points[:, 1].min() == pytest.approx(0, abs=1e-6)
        top = balls[0].end + [0, balls[0].radii[0], 0]
        assert points[:, 1].max() == pytest.approx(top[1], abs=1e-6) and 1.5 < top[1] < 2.0

    def test_a_collar_bone_belongs_to_the_trunk(self):
        rig = with_collar_bones()
        places, _ = rest_places(rig)
        at = rig.names.index
        spans = {(rig.names[p.joint], *np.round([*p.start, *p.end], 6)) for p in capsules(rig)}

        def there(joint, start, end):
            return (joint, *np.round([*places[at(start)], *places[at(end)]], 6)) in spans

        assert there("Spine", "Spine", "LArm") and there("LCollar", "LCollar", "LArm")
        assert there("Spine", "LArm", "RArm") or there("Spine", "RArm", "LArm")
        assert not there("Spine", "LCollar", "RCollar")

    def test_a_single_limb_is_a_body_too(self):
        """A chest, a shoulder near to it, an elbow and a wrist: the chest is held by nothing."""
        arm = chain(
            ("Chest", None, (0, 0, 0)), ("Shoulder", "Chest", (0.15, 0, 0)),
            ("Elbow", "Shoulder", (0.3, 0, 0)), ("Elbow", (0.3, 0, 0)),
        )  # fmt: skip
        spans = [(part.joint, part.start[0], part.end[0]) for part in capsules(arm)]
        assert spans == [
            (0, 0.0, 0.15),
            (1, 0.15, pytest.approx(0.45)),
            (2, *map(pytest.approx, (0.45, 0.75))),
        ]

    def test_a_dog_has_no_ball_and_a_hand_no_soles(self):
        dog = chain(
            ("Pelvis", None, (0, 0.6, 0)), ("Neck", "Pelvis", (0, 0.05, 0.6)), ("Neck", (0, 0.1, 0.2)),
            ("Left", "Pelvis", (0.1, -0.1, 0)), ("Left", (0, -0.5, 0)), ("Right", "Pelvis", (-0.1, -0.1, 0)),
            ("Right", (0, -0.5, 0)),
        )  # fmt: skip
        parts = capsules(dog)
        assert not any(part.ball for part in parts)
        assert sum(part.floor is not None for part in parts) == 2
        hand = chain(
            ("Palm", None, (0, 0, 0)), ("Thumb", "Palm", (0.03, 0, 0.03)), ("Thumb", (0.03, 0, 0.03)),
            ("Index", "Palm", (0.02, 0, 0.09)), ("Index", (0, 0, 0.08)),
        )  # fmt: skip
        assert all(part.floor is None and max(part.radii) < 0.03 for part in capsules(hand))


def test_the_helpers_agree_with_forward_kinematics(case):
    """`moving` names what `forward` gives, joints first."""
    rig, _, _ = case
    joints, ends = forward(rig)
    tracks = list(moving(rig).values())
    np.testing.assert_array_equal(np.stack(tracks[: len(joints)]), joints)
    assert len(tracks) == len(joints) + len(ends)

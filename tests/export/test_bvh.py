"""BVH text read back by two independent readers, against the fit that it was made from.

`bvhio` computes in single precision: 2^-24 of the 1,000 degrees that an angle without wrapping can reach are
1e-6 rad, of which a chain has 18; 0.01 mm is what the project promises.
"""

import json
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pybvh
import pytest
from bvh_files import (
    ANGLE,
    BUNDLED,
    CM,
    LENGTH,
    end_sites_of,
    fit_without,
    joint_names_of,
    motion_of,
    on,
    text_of,
    whole,
    write,
)
from recordings import fit_sample
from rigs import rig_of
from scipy.spatial.transform import Rotation

from mocap_skel.export.euler import ORDERS
from mocap_skel.export.formats.bvh import ORDERS as BVH_ORDERS
from mocap_skel.export.formats.bvh import scale_of
from mocap_skel.export.joint_names import joint_names
from mocap_skel.figure.skeleton import Segment
from mocap_skel.results.axes import turned
from mocap_skel.rig.kinematics import forward, rest_places
from mocap_skel.rig.rigging import SHORTEST_END

SINGLE = 1e-5


@pytest.fixture(scope="module", params=BUNDLED, ids=["one", "dancer"])
def case(request, tmp_path_factory):
    """A fit with y up, its text, and the path of the file."""
    name, subject = request.param
    fit = turned(fit_sample(name, subject), "y")
    path = tmp_path_factory.mktemp("bvh") / f"{name}.bvh"
    path.write_text(text_of(fit))
    return fit, path.read_text(), path


def angles_between(a, b):
    """(frames,) radians between vectors (frames, 3) and one (3,)."""
    cosine = a @ b / np.linalg.norm(a, axis=1) / np.linalg.norm(b)
    return np.arccos(np.clip(cosine, -1.0, 1.0))


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


def by_bvhio(path, *frames):
    done = subprocess.run(
        [sys.executable, "-c", BVHIO, str(path), *map(str, frames)],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


class TestReadBack:
    def test_two_readers_agree(self, case):
        _, _, path = case
        first = pybvh.read_bvh_file(path)
        frames = range(0, first.frame_count, 50)
        second = by_bvhio(path, *frames)
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
        """Rigid bones turn from what a segment's own markers show by the joints' wandering, millimetres on a
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
            if segment.parent is None:
                apart = Rotation.from_matrix(constant[:1].swapaxes(1, 2) @ constant).magnitude()
            else:
                # The turn about the bone is hardly seen where its markers lie along it.
                own = fit.segments[segment.name]
                toward = np.mean(list(own.template.values()), axis=0) - own.joint
                apart = angles_between(constant @ toward, constant[0] @ toward)
            # 6 mm on a hand of 9 cm; the root, held by five joints and markers, keeps within a degree.
            assert np.sqrt((apart**2).mean()) <= (0.07 if segment.parent else 0.0175), segment.name

    def test_it_is_within_5_mm_of_the_joints_of_skeleton_csv(self, case):
        fit, _, path = case
        read = pybvh.read_bvh_file(path)
        positions, tracks = read.node_positions() / CM, dict(fit.tracks())
        node = node_of(fit)
        names = {name: name for name in read.joint_names}
        # A foot ends on its sole, under the markers.
        leaves = [s for s in fit.skeleton.leaves if not s.sole]
        names |= {s.name: f"EndSite{node[s.name]}" for s in leaves}
        square = {
            name: ((positions[:, read.node_index[there]] - tracks[name]) ** 2).sum(axis=1).mean()
            for name, there in names.items()
        }
        # Bones keep their length in the file; the promise is for the figure.
        assert len(square) == 18
        assert np.sqrt(np.mean(list(square.values()))) <= 0.005


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
        ends = end_sites_of(text)
        assert len(ends) == 5
        assert (np.linalg.norm(ends, axis=1) >= CM * SHORTEST_END).all()

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
        names = joint_names_of(text_of(named))
        assert names[0] == "Hips"
        assert names[1:] and all(re.fullmatch(r"\w+_of_it", name) for name in names[1:])


class TestAngles:
    def test_they_are_continuous_away_from_gimbal_lock(self, case):
        """ω is the sum of three turns about axes, of which those of z and y are 90° - x apart: neither
        angle changes faster than ω / cos x, and so never by the 360° of a wrapped angle."""
        fit, text, _ = case
        angles = motion_of(text)[:, 3:].reshape(len(fit.frame_numbers), -1, 3)
        names = joint_names_of(text)
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
        texts = text_of(fit), text_of(fit, scale=1.0)
        np.testing.assert_allclose(
            *(end_sites_of(t) * s for t, s in zip(texts, (1, CM), strict=True)), atol=1e-4
        )
        cm, m = map(motion_of, texts)
        np.testing.assert_allclose(m[:, :3], cm[:, :3] / CM, atol=1e-6)
        np.testing.assert_array_equal(m[:, 3:], cm[:, 3:])

    def test_names(self):
        fit = fit_sample("nearly_still")
        found = {
            naming: joint_names_of(text_of(fit, names=naming))
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

    def test_names_that_are_the_same_without_blanks_get_a_number(self):
        segments = [Segment(name, None, joint, ()) for name, joint in
                    (("Hips", None), ("A", "a b"), ("B", "a_b"), ("C", " a  b "))]  # fmt: skip
        assert joint_names(segments, "mocap") == (("Hips", "a_b", "a_b_2", "a_b_3"), ())

    @pytest.mark.parametrize("naming", ["mixamo", "unreal", "cmu"])
    def test_a_joint_called_like_a_segment_does_not_take_its_name(self, naming):
        # A joint at the head's end, called Head, and one at the top of the spine that belongs to no chest.
        own = (
            Segment("Hips", None, None, ()),
            Segment("Chest", "Hips", "Waist", ()),
            Segment("Head", "Chest", "Neck", ()),
            Segment("Hat", "Head", "Head", ()),
            Segment("Pack", "Chest", "UpperSpine", ()),
        )
        names, _ = joint_names(own, naming)
        plain, _ = joint_names(own[:3], naming)
        assert names[:3] == plain and len(set(names)) == 5
        # Its own name stays; a number stands behind it where that is taken.
        assert names[3] == ("Head" if naming != "cmu" else "Head_2") and names[4] == "UpperSpine"

    def test_joints_with_no_name_there_are_told(self):
        fit = fit_sample("nearly_still")
        figure = fit.skeleton
        renamed = tuple(
            replace(s, **{key: "Skull" for key in ("name", "joint") if s.name == "Head"})
            for s in figure.segments
        )
        own = {("Skull" if name == "Head" else name): s for name, s in fit.segments.items()}
        other = replace(fit, skeleton=replace(figure, segments=renamed), segments=own)
        made = write(other, names="cmu")
        assert "BVH: no cmu name for Skull; it stays" in made.notes
        assert "Skull" in joint_names_of(made.files[".bvh"])

    def test_the_root_can_rest_at_the_origin(self):
        fit = fit_sample("nearly_still")
        plain, zero = text_of(fit), text_of(fit, root_at_origin=True)
        assert re.search(r"ROOT Hips\s*\{\s*OFFSET 0\.000000 0\.000000 0\.000000\n", zero)
        np.testing.assert_array_equal(motion_of(plain), motion_of(zero))

    @pytest.mark.parametrize(
        ("typed", "units"),
        [("cm", 100.0), ("M", 1.0), (" mm ", 1000.0), ("1", 100.0), ("2.54", 254.0)],
    )
    def test_a_scale_is_units_in_a_metre(self, typed, units):
        assert scale_of(typed) == pytest.approx(units, rel=1e-15)

    def test_inches_are_inches(self):
        # A metre is 39.37 inches.
        assert scale_of("in") == pytest.approx(39.3700787, abs=1e-7)

    @pytest.mark.parametrize("typed", ["", "parsec", "0", "-1", "nan", "inf", "1e7", "1e-4"])
    def test_a_scale_that_is_none_is_refused(self, typed):
        with pytest.raises(ValueError, match="a unit"):
            scale_of(typed)

    def test_the_orders_of_the_help_are_those_of_the_angles(self):
        assert sorted(BVH_ORDERS) == sorted(ORDERS) and BVH_ORDERS[0] == "ZXY"


class TestRestPose:
    def test_offsets_and_end_sites_are_the_rest_pose_of_the_rig(self, case):
        fit, text, _ = case
        head, _ = text.split("MOTION")
        rig, _, _ = rig_of(fit)
        rows = re.findall(r"(ROOT|JOINT|End) (\S+)\s*\{\s*OFFSET (\S+) (\S+) (\S+)", head)
        want = []
        for i, (name, offset) in enumerate(zip(rig.names, rig.offsets, strict=True)):
            want.append((name, offset))
            if i in rig.ends:
                want.append(("Site", rig.ends[i]))
        # A joint's End Site stands behind it where it has no children, and only those have one.
        assert [row[1] for row in rows] == [name for name, _ in want]
        found = np.array([row[2:] for row in rows], float)
        np.testing.assert_allclose(found / CM, [place for _, place in want], atol=LENGTH)

    def test_zero_channels_of_bvhio_are_it_too(self, case):
        fit, text, path = case
        zero = path.parent / "zero.bvh"
        lines = text.splitlines()
        at = next(i for i, line in enumerate(lines) if line.startswith("Frame Time"))
        count = len(lines[at + 1].split())
        lines = [*lines[: at + 1], " ".join(["0.000000"] * count)]
        zero.write_text("\n".join(lines).replace(f"Frames: {len(fit.frame_numbers)}", "Frames: 1") + "\n")  # fmt: skip
        found = {name: np.array(place[0]) for name, place in by_bvhio(zero, 0).items()}
        rig, _, _ = rig_of(fit)
        joints, _ = rest_places(rig)
        for name, place in zip(rig.names, joints - joints[0], strict=True):
            np.testing.assert_allclose(found[name] / CM, place, atol=SINGLE, err_msg=name)


class TestGaps:
    """A gap takes no file away: it is bridged and said, or the frames around it are left out and named."""

    def test_frames_at_an_end_are_held_or_trimmed(self):
        fit = fit_without(on("Head"), [0, 1, 2, 299])
        held, trimmed = write(fit), write(fit, trim=True)
        assert any("held in the nearest pose: Head 101-103, 400" in note for note in held.notes)
        assert "Frames: 300\n" in held.files[".bvh"] and "Frames: 296\n" in trimmed.files[".bvh"]
        assert any("frames 101-103, 400 are left out" in note for note in trimmed.notes)

    def test_a_bridged_gap_has_numbers_near_what_was_there(self):
        gap = slice(100, 112)
        made = write(fit_without(on("Head"), gap))
        # The clip's first frame is number 101.
        assert any("by the motion before and after: Head 201-212" in note for note in made.notes)
        found = motion_of(made.files[".bvh"])
        assert np.isfinite(found).all() and len(found) == 300
        # Twelve frames are 0.2 s: the head is near where it was.
        neck = 3 + 3 * joint_names_of(made.files[".bvh"]).index("Neck")
        away = (found - motion_of(text_of(whole())))[gap, neck : neck + 3]
        assert 0 < np.abs((away + 180) % 360 - 180).max() < 30

    def test_too_long_a_gap_divides_the_clip(self):
        fit = fit_without(on("Head"), slice(100, 160))
        longest, every = write(fit, max_gap=0.5), write(fit, max_gap=0.5, stretches="all")
        assert list(longest.files) == [".bvh"] and "Frames: 140\n" in longest.files[".bvh"]
        assert list(every.files) == [".1.bvh", ".2.bvh"]
        assert "Frames: 100\n" in every.files[".1.bvh"]
        (note,) = [n for n in every.notes if "left out" in n]
        assert "frames 201-260 " in note and "Neck" in note

    def test_the_bundled_clip_with_gaps_is_written(self):
        made = write(fit_sample("gaps"))
        assert np.isfinite(motion_of(made.files[".bvh"])).all()
        # Its marker LTHI is never seen, so the left thigh turns by the markers beside it.
        assert any(note.startswith("BVH: filled") for note in made.notes)

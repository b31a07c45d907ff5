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
from conftest import fit_recording, fit_sample
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from mocap_skel.artificial import Faults, human, marker_set, range_of_motion, record
from mocap_skel.axes import turned
from mocap_skel.errors import ExportError
from mocap_skel.export import WRITERS, Options
from mocap_skel.export.bvh import LONGEST_GAP, SHORTEST_END, bvh
from mocap_skel.export.gaps import fill_positions, fill_rotations, runs

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
    """Positions (frames, 3) of every node by joint name, along the fitted rigid segments."""
    at = {fit.skeleton.root.name: fit.segments[fit.skeleton.root.name].pose.origin}
    origin = {fit.skeleton.root.name: np.zeros(3)}
    for joint in fit.joints:
        if joint.child not in fit.segments:
            continue
        away = joint.centre - origin[joint.parent]
        at[joint.child] = at[joint.parent] + fit.segments[joint.parent].pose.rotation @ away
        origin[joint.child] = fit.segments[joint.child].joint
    for leaf in fit.skeleton.leaves:
        segment = fit.segments[leaf.name]
        at[f"end of {leaf.name}"] = at[leaf.name] + segment.pose.rotation @ (
            segment.end - origin[leaf.name]
        )
    return at


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

    def test_positions_are_the_chain_of_the_fitted_rigid_segments(self, case):
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

    def test_rotations_are_those_of_the_fitted_segments(self, case):
        fit, _, path = case
        read = pybvh.read_bvh_file(path)
        _, local = read.to_rotmat()
        node, world = node_of(fit), {}
        for segment in fit.skeleton.segments:
            turn = local[:, read.joint_index[node[segment.name]]]
            world[segment.name] = turn if segment.parent is None else world[segment.parent] @ turn
            fitted = fit.segments[segment.name].pose.rotation
            # Relative to the rest pose, which is the first frame.
            expected = fitted @ fitted[0].T
            apart = Rotation.from_matrix(world[segment.name].swapaxes(1, 2) @ expected).magnitude()
            assert apart.max() <= ANGLE <= 1e-5, segment.name

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
        node, checked = node_of(fit), 0
        for segment in fit.skeleton.segments:
            own = fit.segments[segment.name].pose.rotation
            world = own @ own[0].T
            if segment.parent is not None:
                above = fit.segments[segment.parent].pose.rotation
                world = (above @ above[0].T).swapaxes(1, 2) @ world
            step = np.degrees(
                Rotation.from_matrix(world[:-1].swapaxes(1, 2) @ world[1:]).magnitude()
            )
            track = angles[:, names.index(node[segment.name])]
            cosine = np.cos(np.radians(track[:, 1]))
            cosine = np.minimum(cosine[:-1], cosine[1:])
            # A step is short where cos x changes little over it.
            free = (cosine > 0.3) & (step < 10)
            checked += free.sum()
            jump = np.abs(np.diff(track, axis=0)).max(axis=1)
            assert (jump[free] <= 1.5 * step[free] / cosine[free] + 1e-5).all(), segment.name
        assert checked > 0.8 * angles.shape[0] * angles.shape[1]

    def test_no_angle_jumps_by_a_full_turn(self, case):
        _, text, _ = case
        steps = np.abs(np.diff(motion_of(text)[:, 3:], axis=0))
        # Six decimals on both sides.
        assert steps.max() <= 180 + 1e-6

    def test_the_first_frame_is_the_rest_pose(self, case):
        _, text, _ = case
        np.testing.assert_allclose(motion_of(text)[0, 3:], 0.0, atol=1e-6)


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
        np.testing.assert_allclose(trimmed[0, 3:], 0.0, atol=1e-6)

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

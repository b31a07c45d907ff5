"""OpenSim's model and motion, by forward kinematics of their text alone, against the rig that they were made from.

tests/opensim_check.py (`make opensim`) asks OpenSim itself.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bvh_files import fit_without, on, whole
from commands import ROM, call, files
from osim_files import Model, radians, read_motion, rig_of, sample, vector, written
from recordings import clip_of, fit_clip, fit_sample, known
from scipy.spatial.transform import Rotation
from trc_files import read_trc

from mocap_skel import associate, read_clip
from mocap_skel.artificial import Faults, circumduct, figure_of, markers_of, ranges_of, record
from mocap_skel.export.body_masses import HUMAN, SPINE, WHOLE, masses
from mocap_skel.export.coordinates import _hinge_frames
from mocap_skel.export.registry import Source, choose
from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.labels.association import Association, Rule
from mocap_skel.rig.freedoms import Hinge

# Metres and radians: the files have 8 decimals of a metre and of a degree; seven joints in a row, 2 m of chain.
PLACE = 1e-6
CASES = [
    ("range_of_motion", None, "markers"),
    ("range_of_motion", None, "full"),
    ("two_dancers", "Anna", "markers"),
    ("gaps", None, "full"),
]


@pytest.fixture(scope="module", params=CASES, ids=lambda case: "-".join(filter(None, case)))
def case(request):
    """A fit, whether its rig is the full one, its model and its motion."""
    name, subject, rig = request.param
    made = sample(name, subject, rig=rig)
    model, motion = Model(made.files[".osim"]), read_motion(made.files[".mot"])
    return fit_sample(name, subject), rig == "full", model, motion, made


class TestKinematics:
    def test_joints_and_markers_are_where_the_rig_has_them(self, case):
        fit, full, model, motion, _ = case
        rig, joints, markers = rig_of(fit, full)
        bodies = model.bodies_at(radians(motion, motion.names))
        assert [segment.name for segment in rig.segments] == list(model.bodies)
        for segment, track in zip(rig.segments, joints, strict=True):
            np.testing.assert_allclose(bodies[segment.name][1], track, rtol=0, atol=PLACE)
        found = model.markers_at(bodies)
        for there, track in zip(found.values(), markers.values(), strict=True):
            np.testing.assert_allclose(there, track, rtol=0, atol=PLACE)

    def test_its_bones_are_constant_and_those_of_the_fit(self, case):
        """No joint has a translation but the root, and a bone is as long as the fit's."""
        fit, full, model, *_ = case
        for name, joint in model.joints.items():
            free = joint.find("frames/PhysicalOffsetFrame/socket_parent").text == "/ground"
            assert len(joint.findall("coordinates/Coordinate")) == (6 if free else 3), name
        if full:
            return
        length = {joint.joint: joint.centre for joint in fit.joints}
        for name in ("LeftKnee", "RightElbow"):
            upper = next(joint for joint in fit.joints if joint.joint == name)
            above = fit.segments[upper.parent].joint
            place = vector(model.joints[name].find("frames/PhysicalOffsetFrame"), "translation")
            want = np.linalg.norm(length[name] - above)
            assert np.linalg.norm(place) == pytest.approx(want, abs=1e-9)

    def test_all_zero_is_a_t_pose_that_looks_along_x(self, case):
        model = case[2]
        zero = {name: np.zeros(1) for name in model.coordinates()}
        places = {name: place[0] for name, (_, place) in model.bodies_at(zero).items()}
        head, foot = places["Head"] - places["Hips"], places["LeftFoot"] - places["Hips"]
        assert head[1] > 0.3 > -0.5 > foot[1]
        right = places["RightHand"] - places["LeftHand"]
        assert right[2] > 0.9 and np.linalg.norm(right[:2]) < 0.1
        # A foot points forward: so its centre of mass lies before the ankle.
        assert vector(model.bodies["RightFoot"], "mass_center")[0] > 0.03

    def test_it_stands_on_y_as_the_clip_does(self, case):
        fit, _, model, motion, made = case
        assert vector(model.model, "gravity").tolist() == [0.0, -9.80665, 0.0]
        height = np.median(motion.values[:, motion.names.index("Hips_ty")])
        pelvis = fit.segments["Hips"].pose.origin[:, 2]
        assert height == pytest.approx(np.nanmedian(pelvis), abs=0.01)
        assert "OSIM: y up, its x, y, z are the clip's y, z, x" in made.notes


class TestMotion:
    def test_its_head_says_what_is_in_it(self, case):
        _, _, model, motion, _ = case
        assert motion.head["version"] == "1"
        assert int(motion.head["nRows"]) == len(motion.values)
        assert int(motion.head["nColumns"]) == motion.values.shape[1] + 1
        assert motion.names == model.coordinates() and len(set(motion.names)) == len(motion.names)

    def test_time_is_the_clips_and_grows(self, case):
        fit, _, _, motion, _ = case
        np.testing.assert_allclose(motion.time, fit.time[: len(motion.time)], rtol=0, atol=5.1e-9)
        assert (np.diff(motion.time) > 0).all()

    def test_angles_go_on_without_full_turns(self, case):
        """A joint turns by 1500 degrees a second at most; half a turn from frame to frame would be a jump."""
        motion = case[3]
        turns = [name[-3:] not in ("_tx", "_ty", "_tz") for name in motion.names]
        assert np.abs(np.diff(motion.values[:, turns], axis=0)).max() < 180.0

    def test_the_second_of_three_turns_keeps_away_from_a_right_angle_or_the_notes_say_so(
        self, case
    ):
        _, _, model, motion, made = case
        notes = "\n".join(made.notes)
        near = notes.partition("near gimbal lock")[2]
        for name in model.joints:
            names, axes, order = model.axes(name)
            np.testing.assert_array_equal(np.abs(axes).sum(axis=1), 1.0)
            assert sorted(order) == ["X", "Y", "Z"]
            second = np.radians(motion.values[:, motion.names.index(names[1])])
            if np.degrees(np.arcsin(np.abs(np.sin(second)).max())) > 70.0:
                assert name.removeprefix("ground_") in near

    def test_both_sides_turn_in_one_order(self, case):
        model = case[2]
        for name in model.joints:
            if "Left" in name:
                assert model.axes(name)[2] == model.axes(name.replace("Left", "Right"))[2]

    def test_the_pose_of_the_first_frame_is_the_models_own(self, case):
        _, _, model, motion, _ = case
        own = [float(one.find("default_value").text) for one in model.model.iter("Coordinate")]
        values = radians(motion, motion.names)
        first = [values[name][0] for name in motion.names]
        # The motion has 8 decimals.
        np.testing.assert_allclose(own, first, rtol=0, atol=5.1e-9)

    def test_a_knee_turns_about_its_hinge_first_and_little_else(self):
        made = sample("two_dancers", "Anna")
        model, motion = Model(made.files[".osim"]), read_motion(made.files[".mot"])
        for side in ("Left", "Right"):
            names, _, order = model.axes(f"{side}Knee")
            assert names == [f"{side}Knee_{end}" for end in ("hinge", "stray1", "stray2")]
            assert order == "ZXY"
            hinge, *others = (motion.values[:, motion.names.index(name)] for name in names)
            assert np.ptp(hinge) > 25.0
            # A rig's hinge strays by 5 degrees (`rig.model.STRAY`).
            assert all(np.sqrt(np.mean(other**2)) < 5.0 for other in others)
            # Its axis points to the right: a shank that goes back turns against it.
            assert hinge.min() < -20.0

    @pytest.mark.parametrize("seed", range(20))
    def test_the_axes_of_a_hinge_are_third_in_both_its_frames(self, seed):
        """Also where the rest pose has them opposite, to which there is no shortest turn."""
        rng = np.random.default_rng(seed)
        above, below = rng.normal(size=(2, 3))
        below = -above if seed == 0 else below
        above, below = above / np.linalg.norm(above), below / np.linalg.norm(below)
        body = Rotation.random(2, rng).as_matrix()
        axes = _hinge_frames(body, 0, Hinge(1, above, below, 1.0))
        for frame, turn, axis in zip(axes, body, (above, below), strict=True):
            np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-12)
            assert np.linalg.det(frame) == pytest.approx(1.0)
            assert abs(frame[:, 2] @ turn @ axis) == pytest.approx(1.0, abs=1e-9)
        # Both the same way round, along the nearest body axis.
        ways = [f[:, 2] @ b @ a for f, b, a in zip(axes, body, (above, below), strict=True)]
        assert ways[0] * ways[1] == pytest.approx(1.0, abs=1e-9)
        assert axes[0][np.abs(axes[0][:, 2]).argmax(), 2] > 0


class TestMarkers:
    def test_the_trc_has_the_models_markers_as_they_were_recorded(self):
        made, clip = sample("range_of_motion"), read_clip(ROM)
        _, names, frames, time, points = read_trc(made.files[".markers.trc"])
        assert names == list(Model(made.files[".osim"]).markers)
        assert np.array_equal(frames, clip.frame_numbers)
        np.testing.assert_allclose(time, read_motion(made.files[".mot"]).time, atol=1e-6)
        for i, name in enumerate(names):
            want = clip.points[:, clip.labels.index(name)][:, [1, 2, 0]]
            there = np.isfinite(points[:, i, 0])
            assert there.mean() > 0.99
            np.testing.assert_allclose(points[there, i], want[there], atol=5.1e-7)

    def test_they_are_called_as_in_the_clip(self):
        """A lab's other marker files have the lab's labels; OpenSim takes no blanks and no strokes."""
        clip = read_clip(ROM)
        at = clip.labels.index("RTOE")
        own = fit_sample("range_of_motion")
        (subject,) = associate(clip, known("cmu"))
        odd = [*clip.labels]
        odd[at], odd[at - 1] = "big toe/right *", "big toe right"
        renamed = replace(clip, labels=tuple(odd))
        (chosen,) = choose("osim")
        made = chosen.render(own, Source(renamed, Path("a <walk> & more.c3d"), subject))
        names = list(Model(made.files[".osim"]).markers)
        _, columns, *_ = read_trc(made.files[".markers.trc"])
        assert names == columns and {"big_toe_right_", "big_toe_right"} <= set(names)
        assert Model(made.files[".osim"]).model.get("name") == "a_walk_more"


def kilograms(name, parts=HUMAN, whole=70.0):
    return whole * parts[name].mass / WHOLE


class TestMasses:
    @pytest.mark.parametrize("rig", ["markers", "full"])
    def test_they_add_up_to_the_bodys(self, rig):
        made = sample("range_of_motion", rig=rig, mass=70.0)
        model = Model(made.files[".osim"])
        assert model.mass() == pytest.approx(70.0, abs=1e-6)
        assert "OSIM: masses by de Leva 1996" in made.notes

    def test_they_are_de_levas(self):
        """By hand, from his table 4: a thigh has 14.16 % in men, 14.78 % in women."""
        model = Model(sample("range_of_motion", mass=70.0).files[".osim"])
        want = {
            "UpperLeftLeg": 0.1447,
            "LowerRightLeg": 0.0457,
            "Head": 0.0681,
            "Chest": 0.31195,
        }
        for name, share in want.items():
            mass = float(model.bodies[name].find("mass").text)
            assert mass == pytest.approx(70.0 * share, rel=1e-4)
        # The centre of a thigh: 40.95 % (men), 36.12 % (women) of the way from the hip to the knee.
        knee = vector(model.joints["LeftKnee"].find("frames/PhysicalOffsetFrame"), "translation")
        centre = vector(model.bodies["UpperLeftLeg"], "mass_center")
        np.testing.assert_allclose(centre, 0.38535 * knee, atol=1e-4)
        # Across the bone, its radius of gyration is 0.35 of the bone, along it 0.155.
        moments = np.linalg.eigvalsh(model.inertia("UpperLeftLeg"))
        radii = np.sqrt(moments / (70.0 * 0.1447)) / np.linalg.norm(knee)
        np.testing.assert_allclose(radii, [0.1555, 0.3465, 0.3490], atol=2e-4)

    @pytest.mark.parametrize("told", [{}, {"mass": 70.0}, {"mass": 70.0, "rig": "full"}])
    def test_every_body_could_be_one(self, told):
        """Principal moments are positive, and none is larger than the others together."""
        model = Model(sample("range_of_motion", **told).files[".osim"])
        for name in model.bodies:
            moments = np.linalg.eigvalsh(model.inertia(name))
            assert moments[0] > 0 and moments[2] <= moments[0] + moments[1], name

    def test_without_a_mass_the_body_has_one_kilogram_and_the_notes_say_so(self):
        made = sample("range_of_motion")
        assert Model(made.files[".osim"]).mass() == pytest.approx(1.0, abs=1e-9)
        assert "OSIM: masses are those of a body of 1 kg; --mass says the real one" in made.notes

    def test_the_parts_of_a_spine_are_the_whole_trunk_less_the_pelvis(self):
        assert sum(part.mass for part in SPINE.values()) == pytest.approx(HUMAN["Chest"].mass)
        assert 2 * sum(
            part.mass for name, part in HUMAN.items() if "Left" in name
        ) + sum(HUMAN[name].mass for name in ("Head", "Chest", "Hips")) == pytest.approx(WHOLE)  # fmt: skip

    def test_a_bone_that_he_does_not_know_takes_a_little_of_the_one_before_it(self):
        names, joints = ["RightFoot", "Horn"], ["", "HornBase"]
        offsets, ends = np.array([[0.0, 0, 0], [0.1, -0.05, 0]]), {1: np.array([0.05, 0.0, 0.0])}
        found, known_ = masses(names, joints, [-1, 0], offsets, ends, 100.0)
        whole = kilograms("RightFoot", whole=100.0)
        assert known_
        assert [one.mass for one in found] == pytest.approx([0.99 * whole, 0.01 * whole])


def generated(name, rig="markers"):
    """A fit of five seconds of a shipped figure."""
    skeleton = read_skeleton(name)
    figure = figure_of(skeleton)
    motion = circumduct(ranges_of(skeleton), 5, 60, seed=1)
    clip = clip_of(
        record(figure, markers_of(skeleton, figure), motion, Faults(sigma=0.001), seed=1)
    )
    where = skeleton.segment_of
    rules = tuple(Rule(m, m, where[m], i) for i, m in enumerate(clip.labels, 1))
    return fit_clip(clip, Association(name, skeleton, rules, ()))


class TestOtherFigures:
    @pytest.mark.parametrize("rig", ["markers", "full"])
    @pytest.mark.parametrize(
        "name", ["right_leg", "lower_body", "left_arm", "head", "quadruped", "hand"]
    )
    def test_their_joints_are_where_the_rig_has_them(self, name, rig):
        fit = generated(name)
        made = written(fit, rig=rig)
        model, motion = Model(made.files[".osim"]), read_motion(made.files[".mot"])
        segments, joints, _ = rig_of(fit, rig == "full")
        assert list(model.bodies) == [segment.name for segment in segments.segments]
        bodies = model.bodies_at(radians(motion, motion.names))
        for body, track in zip(model.bodies, joints, strict=True):
            np.testing.assert_allclose(bodies[body][1], track, rtol=0, atol=PLACE)

    @pytest.mark.parametrize("name", ["right_leg", "lower_body", "upper_body", "head"])
    def test_a_part_of_a_body_has_its_part_of_the_mass(self, name):
        made = written(generated(name), mass=70.0)
        model = Model(made.files[".osim"])
        want = sum(kilograms(segment) for segment in model.bodies)
        assert model.mass() == pytest.approx(want, abs=1e-6)
        assert any(f"{want:.1f} kg of 70" in note for note in made.notes)

    @pytest.mark.parametrize("name", ["quadruped", "hand"])
    def test_a_figure_that_de_leva_does_not_know_shares_its_mass_out(self, name):
        made = written(generated(name), mass=30.0)
        model = Model(made.files[".osim"])
        for body in model.bodies.values():
            want = 30.0 / len(model.bodies)
            assert float(body.find("mass").text) == pytest.approx(want, abs=1e-9)
        assert any("shared out equally" in note for note in made.notes)


class TestGaps:
    def test_a_long_gap_parts_the_motion_and_not_the_model(self):
        fit = fit_without(on("Head"), slice(100, 160))
        longest = written(fit, max_gap=0.5)
        every = written(fit, max_gap=0.5, stretches="all")
        assert set(longest.files) == {".osim", ".mot", ".markers.trc"}
        ends = {f".{i}{end}" for i in (1, 2) for end in (".mot", ".markers.trc")}
        assert set(every.files) == {".osim", *ends}
        first, second = (read_motion(every.files[f".{i}.mot"]) for i in (1, 2))
        alone = read_motion(longest.files[".mot"])
        assert len(alone.time) == max(len(first.time), len(second.time))
        # The frames that the file counts: 101 is the first.
        assert first.time[0] == pytest.approx(100 / 60, abs=1e-8)
        _, _, frames, *_ = read_trc(every.files[".2.markers.trc"])
        assert second.time[0] == pytest.approx((frames[0] - 1) / 60, abs=1e-8)
        assert any("are left out" in note for note in longest.notes)

    def test_a_marker_that_is_missing_is_missing_in_the_trc_alone(self):
        fit = fit_without(["LFHD"], slice(50, 80))
        made = written(fit)
        _, names, _, _, points = read_trc(made.files[".markers.trc"])
        there = np.isfinite(points[:, names.index("LFHD"), 0])
        assert not there[50:80].any() and there[:50].all()
        assert len(read_motion(made.files[".mot"]).time) == len(whole().time)


def test_the_command_writes_a_model_for_each_subject(tmp_path):
    clip = ROM.with_name("two_dancers.c3d")
    done = call("fit", clip, "-a", "cmu", "-f", "osim", "--mass", "70", "-o", "out", cwd=tmp_path)
    assert done.returncode == 0
    ends = (".markers.trc", ".mot", ".osim")
    want = sorted(f"two_dancers.{who}{end}" for who in ("Anna", "Ben") for end in ends)
    assert files(tmp_path / "out") == want


@pytest.mark.parametrize("mass", ["0", "-70", "seventy", "nan", "1e9"])
def test_a_mass_that_is_none_is_refused(mass, tmp_path):
    done = call("fit", ROM, "-a", "cmu", "-f", "osim", f"--mass={mass}", cwd=tmp_path)
    assert done.returncode == 2 and "in kilograms, like 70" in done.stderr

"""Several clips of one actor: evidence that merges, markers that were put on again, the file, the commands."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from centres import centre_of
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings import clip_of, constant_error, fit_clip, fit_recording, known

from mocap_skel.artificial import (
    Faults,
    Motion,
    human,
    marker_set,
    range_of_motion,
    record,
    still,
    swing_twist,
    write_c3d,
)
from mocap_skel.cli import group
from mocap_skel.errors import CallError
from mocap_skel.export.calibration_json import calibration_json, read_calibration
from mocap_skel.fit import fit_skeleton
from mocap_skel.joints.calibration import Template, aligned
from mocap_skel.joints.evidence import Evidence, merged, moved
from mocap_skel.labels.association import associate
from mocap_skel.labels.calibrated import association_of, labels_of
from mocap_skel.pipeline.calibrate import calibrate
from mocap_skel.pipeline.job import Job
from mocap_skel.spherefit import merge_moments, moved_moments, sphere_moments

FAULTS = Faults(sigma=0.001)
SIDES = ("Left", "Right")


@cache
def half(side, seed=0):
    """Only one side and the pelvis move; noise of 1 mm."""
    motion, rest = range_of_motion(6, 100, seed=seed), still(6, 100)
    turns = {
        name: turn
        if side in name or name == "Hips"
        else rest.rotations.get(name, np.broadcast_to(np.eye(3), turn.shape))
        for name, turn in motion.rotations.items()
    }
    moving = Motion(motion.rate, motion.shift, turns)
    return record(human(), marker_set("cmu"), moving, FAULTS, seed=seed)


def clip(side, move=None):
    found = replace(clip_of(half(side, SIDES.index(side))), name=side)
    if move:
        label, way = move
        points = found.points.copy()
        column = found.labels.index(label)
        pose = half(side, SIDES.index(side)).poses["UpperLeftLeg"]
        points[:, column] += pose.rotation @ np.array(way)
        found = replace(found, points=points)
    return found


def calibrated(clips, tmp_path, prior="none"):
    paths = []
    for one in clips:
        paths.append(tmp_path / f"{one.name}.c3d")
        write_c3d(replace_points(one), paths[-1])
    return calibrate(paths, Job(known("cmu"), prior=prior))


def replace_points(one):
    return replace(half(one.name, SIDES.index(one.name)), points=one.points)


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    return calibrated([clip(s) for s in SIDES], tmp_path_factory.mktemp("both"))


def random_rotation(rng):
    return swing_twist(rng.uniform(-1, 1, (1, 3)))[0]


def points(rng, count):
    return rng.normal(size=(3, count, 3)) * 0.1 + rng.normal(size=(3, 1, 3))


def evidence(rng, moments):
    def matrices():
        half_of = rng.normal(size=(3, 3, 3))
        return half_of @ half_of.swapaxes(1, 2)

    return Evidence(
        moments, 0.001, matrices(), matrices(), rng.normal(size=(3, 3)), matrices(),
        moments.count / 4, rng.uniform(size=3),
    )  # fmt: skip


def assert_same(a, b, rtol=1e-9):
    for name in ("noise", "leverage", "skew", "still", "effective", "smooth"):
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=rtol, atol=1e-9)
    for name in ("count", "mean", "covariance", "third", "fourth"):
        np.testing.assert_allclose(
            getattr(a.moments, name), getattr(b.moments, name), rtol=rtol, atol=1e-12
        )


class TestEvidence:
    @settings(max_examples=25, deadline=None)
    @given(seed=st.integers(0, 10_000), cut=st.integers(2, 38))
    def test_moments_move_as_their_points_do_and_merge_to_those_of_all(self, seed, cut):
        rng = np.random.default_rng(seed)
        x, turn, shift = points(rng, 40), random_rotation(rng), rng.normal(size=3)
        want = sphere_moments(x @ turn.T + shift)
        parts = [moved_moments(sphere_moments(p), turn, shift) for p in (x[:, :cut], x[:, cut:])]
        found = merge_moments(*parts)
        for name in ("count", "mean", "covariance", "third", "fourth"):
            # Squares of coordinates of a few metres, to the fourth power, in doubles.
            np.testing.assert_allclose(getattr(found, name), getattr(want, name), atol=1e-12)

    @settings(max_examples=25, deadline=None)
    @given(seed=st.integers(0, 10_000))
    def test_the_order_does_not_matter_nor_where_it_is_merged(self, seed):
        rng = np.random.default_rng(seed)
        a, b, c = (evidence(rng, sphere_moments(points(rng, n))) for n in (10, 25, 40))
        a = replace(a, sigma=0.002)
        assert_same(merged(a, b), merged(b, a))
        assert_same(merged(merged(a, b), c), merged(a, merged(b, c)))
        turn, shift = random_rotation(rng), rng.normal(size=3)
        assert_same(
            merged(moved(a, turn, shift), moved(b, turn, shift)), moved(merged(a, b), turn, shift)
        )

    def test_halves_of_one_clip_give_the_centre_of_the_whole(self, monkeypatch):
        """The same frames, cut in two and counted alike: only the noise's own 1/N differs."""
        monkeypatch.setattr("mocap_skel.joints.centre.by_skin", lambda clips, _: [1.0] * len(clips))
        from mocap_skel.joints.samples import Frame
        from mocap_skel.segments.shape import find_shape

        recording = half("Left")
        clip_fit = fit_recording(recording, prior="none", sigma=0.001)
        pose = clip_fit.segments["Hips"].pose
        columns = [recording.labels.index(m) for m in ("LTHI", "LKNE")]
        inside = pose.to_segment(recording.points[:, columns])
        hips = [recording.labels.index(m) for m in clip_fit.segments["Hips"].template]
        frame = Frame(find_shape(recording.points[:, hips])[0])
        for sigma, allowed in ((0.0, 1e-9), (0.001, 2e-6)):
            whole = centre_of(inside, sigma, frame, own=0.001)
            first = centre_of(inside[:250], sigma, frame, own=0.001)
            pooled = centre_of(inside[250:], sigma, frame, own=0.001, pooled=first.evidence)
            # Lever and noise are averages over N or N - 1: of a shift of millimetres, one part in 250.
            np.testing.assert_allclose(pooled.centre, whole.centre, atol=allowed)
            assert pooled.samples == whole.samples


class TestPooling:
    def test_two_clips_that_each_show_half_the_joints_show_all(self, both):
        for side in SIDES:
            recording = half(side, SIDES.index(side))
            alone = fit_recording(recording, prior="none")
            # The file holds 32-bit floats, so this is not the very clip that the calibration knows.
            itself = both.calibration.clips[SIDES.index(side)]
            calibration = both.calibration.without(itself.digest)
            pooled = fit_recording(recording, prior="none", calibration=calibration)
            for before, after in zip(alone.joints, pooled.joints, strict=True):
                if not any(s in after.joint for s in SIDES):
                    continue  # what no clip moves, no calibration knows
                error = np.linalg.norm(constant_error(pooled, recording, after))
                assert error < 0.01, (side, after.joint, error)
                if side not in after.joint:
                    assert before.shown == "no" and after.shown != "no"
                    assert "calibration (1 clip)" in after.reason

    def test_the_better_clip_gives_most_and_the_shares_are_all_there_is(self, both):
        for found in both.joints:
            assert sum(found.shares.values()) == pytest.approx(1.0)
            for side in SIDES:
                if side in found.joint.joint:
                    assert found.shares[f"{side}.c3d"] > 0.8, (found.joint.joint, found.shares)

    def test_the_order_of_the_clips_does_not_matter(self, both, tmp_path):
        other = calibrated([clip(s) for s in SIDES[::-1]], tmp_path)
        for a, b in zip(both.joints, other.joints, strict=True):
            assert a.clip == b.clip
            np.testing.assert_allclose(a.joint.centre, b.joint.centre, atol=1e-9)

    @settings(max_examples=3, deadline=None)
    @given(seed=st.integers(0, 100))
    def test_a_lab_that_is_turned_changes_nothing(self, both, seed):
        rng = np.random.default_rng(seed)
        turn, shift = random_rotation(rng), rng.normal(size=3)
        one = clip("Left")
        elsewhere = replace(one, points=one.points @ turn.T + shift)
        calibration = both.calibration.without(both.calibration.clips[0].digest)
        a, b = (fit_clip(c, prior="none", calibration=calibration) for c in (one, elsewhere))
        for mine, theirs in zip(a.joints, b.joints, strict=True):
            if mine.shown == "yes":
                np.testing.assert_allclose(mine.centre, theirs.centre, atol=1e-7)

    def test_a_clip_of_the_calibration_counts_once(self, both):
        calibration, first = both.calibration, both.calibration.clips[0]
        twice = replace(calibration, clips=(*calibration.clips, calibration.clips[1]))
        assert len(calibration.without(first.digest).clips) == 1
        assert len(twice.without(calibration.clips[1].digest).clips) == 1

    def test_a_thigh_marker_that_was_moved_is_refused(self, both):
        changed = clip("Left", move=("LTHI", (0.0, 0.0, 0.02)))
        fit = fit_clip(changed, prior="none", calibration=both.calibration)
        alone = fit_clip(changed, prior="none")
        said = [n for n in fit.notes if "re-attached" in n]
        assert any("UpperLeftLeg" in n and "LTHI" in n and "20 mm" in n for n in said), said
        knees = [next(j for j in f.joints if j.joint == "LeftKnee") for f in (fit, alone)]
        assert "calibration" not in knees[0].reason
        # The other side is as it was.
        right = next(j for j in fit.joints if j.joint == "RightKnee")
        assert "calibration" in right.reason and right.shown != "no"

    def test_a_thigh_marker_that_was_moved_keeps_its_own_radius_at_the_hip(self, both):
        """The hip is where it was, and the other clips tell of it; not of this marker's distance."""
        changed = clip("Left", move=("LTHI", (0.0, 0.0, 0.02)))
        before = fit_clip(changed, prior="none")
        after = fit_clip(changed, prior="none", calibration=both.calibration)
        alone, hip = (next(j for j in f.joints if j.joint == "LeftHip") for f in (before, after))
        assert "calibration (2 clips)" in hip.reason
        assert hip.samples == 3 * alone.samples
        # The radius of 0.2 m is known to 1 mm / √1200 and what the centre's error adds, 0.4 mm; one
        # that is shared with the old place would be off by a share of 2 cm.
        np.testing.assert_allclose(hip.radius, alone.radius, rtol=0, atol=1e-3)
        assert hip.residual == pytest.approx(alone.residual, rel=0.1)
        assert np.linalg.norm(constant_error(after, half("Left"), hip)) < 0.002

    def test_a_pelvis_marker_that_was_moved_is_said_once_for_all_joints_of_the_pelvis(self, both):
        changed, pose = clip("Left"), half("Left").poses["Hips"]
        points = changed.points.copy()
        points[:, changed.labels.index("LFWT")] += pose.rotation @ [0.04, 0.0, 0.0]
        fit = fit_clip(replace(changed, points=points), prior="none", calibration=both.calibration)
        said = [note for note in fit.notes if "re-attached" in note]
        assert [note.partition(":")[0] for note in said] == [
            "Hips of Left.c3d is not used", "Hips of Right.c3d is not used",
        ]  # fmt: skip
        assert all("LFWT re-attached" in note for note in said)
        told = {joint.joint for joint in fit.joints if "calibration" in joint.reason}
        assert told.isdisjoint({"Waist", "LeftHip", "RightHip"})
        # The right thigh stands on a hip that nothing shows now; the left one on its own.
        assert {"LeftKnee", "Neck"} <= told

    def test_the_independent_samples_of_all_clips_add_up(self, both):
        itself, other = both.calibration.clips
        without = both.calibration.without(itself.digest)
        fit = fit_clip(clip("Left"), prior="none", calibration=without)
        told = [j for j in fit.joints if j.joint in other.joints and "calibration" in j.reason]
        assert len(told) >= 10
        for joint in told:
            theirs = other.joints[joint.joint].evidence
            own = joint.evidence
            # A clip that hardly moves the joint counts less: what it has of skin is all that it shows.
            known = sorted((own.effective.sum(), theirs.effective.sum()))
            assert known[0] < joint.effective <= sum(known) * (1 + 1e-9)
            assert joint.samples == own.count.sum() + theirs.count.sum()

    def test_fewer_markers_are_aligned_by_what_is_left(self):
        rng = np.random.default_rng(5)
        places = {name: rng.normal(size=3) * 0.1 for name in "abcde"}
        turn, shift = random_rotation(rng), rng.normal(size=3)
        theirs = Template(places, None)
        ours = Template({n: turn @ p + shift for n, p in places.items() if n != "c"}, None)
        (rotation, origin), note = aligned(theirs, ours)
        np.testing.assert_allclose(rotation, turn, atol=1e-12)
        np.testing.assert_allclose(origin, shift, atol=1e-12)
        assert note == ""
        assert aligned(theirs, Template({"a": places["a"]}, None)) == (None, "")

    def test_methods_that_need_samples_are_refused(self, both):
        one, association = clip("Left"), known("cmu")
        with pytest.raises(ValueError, match="needs every sample"):
            fit_skeleton(
                one, associate(one, association)[0], association.skeleton, method="lls",
                calibration=both.calibration,
            )  # fmt: skip


class TestFile:
    def test_what_is_written_is_read(self, both, tmp_path):
        path = tmp_path / "actor.json"
        path.write_text(calibration_json(both.calibration, both.joints))
        read = read_calibration(path, known("cmu").skeleton)
        assert calibration_json(read, both.joints) == path.read_text()
        assert json.loads(path.read_text())["format"] == "mocap-skel calibration 1"

    def test_a_file_that_calls_shown_by_its_old_name_is_read(self, both, tmp_path):
        content = json.loads(calibration_json(both.calibration, both.joints))
        for joint in content["joints"].values():
            joint["known"] = joint.pop("shown")
        path = tmp_path / "actor.json"
        path.write_text(json.dumps(content))
        read = read_calibration(path, known("cmu").skeleton)
        assert calibration_json(read, both.joints) == calibration_json(
            both.calibration, both.joints
        )

    @pytest.mark.parametrize(
        ("change", "words"),
        [
            (lambda c: c.update(format="other"), "format 'other'"),
            (lambda c: c.update(skeleton="hand"), "of the skeleton 'hand'"),
            (lambda c: c.update(unit="mm"), "unit must be 'm'"),
            (lambda c: c["labels"].pop("source"), "labels lacks 'source'"),
            (lambda c: c["labels"]["markers"].update(X=["Y"]), "labels.markers.X must be a marker"),
            (lambda c: c.update(more=1), "unknown key 'more'"),
            (lambda c: c.pop("clips"), "lacks 'clips'"),
            (lambda c: c["clips"][0].pop("rate"), r"clips\[0\] lacks 'rate'"),
            (lambda c: c["clips"][0]["joints"].update(Tail=3), r"joints.Tail must be a dict"),
            (lambda c: c["clips"][0]["segments"].pop("Hips"), "no segment Hips"),
            (
                lambda c: c["clips"][0]["joints"]["LeftHip"]["markers"]["LTHI"].update(mean=[1]),
                r"clips\[0\].joints.LeftHip.markers.LTHI.mean must be numbers of shape \(3,\)",
            ),
            (
                lambda c: c["clips"][0]["joints"]["LeftHip"].update(sigma=-1),
                "sigma must not be negative",
            ),
        ],
    )
    def test_what_is_wrong_is_said_with_its_place(self, both, tmp_path, change, words):
        content = json.loads(calibration_json(both.calibration, both.joints))
        change(content)
        path = tmp_path / "actor.json"
        path.write_text(json.dumps(content))
        with pytest.raises(CallError, match=words) as error:
            read_calibration(path, known("cmu").skeleton)
        assert str(path) in error.value.message

    def test_no_file_and_no_json(self, tmp_path):
        with pytest.raises(CallError, match="No such file"):
            read_calibration(tmp_path / "nothing.json")
        path = tmp_path / "actor.json"
        path.write_text("{")
        with pytest.raises(CallError, match="is no calibration"):
            read_calibration(path)


class TestLabels:
    def test_what_several_clips_say_is_added_up_and_contradictions_are_named(self):
        one = known("cmu")
        fewer = replace(one, rules=one.rules[1:], ignored=("X1", one.rules[0].label))
        odd = replace(one.rules[2], marker=one.rules[3].marker, segment=one.rules[3].segment)
        other = replace(one, rules=(one.rules[0], odd))
        labels, notes = labels_of([fewer, other])
        assert labels.markers == {r.label: (r.marker, r.segment) for r in one.rules}
        assert labels.ignored == ("X1", *one.ignored)
        assert notes[0].startswith(f"labels that are not the same marker in all clips: {odd.label}")
        assert labels_of([fewer, one])[1] == ()

    def test_a_calibration_without_names_or_without_its_skeleton_says_what_to_do(self, both):
        calibration, path = both.calibration, Path("actor.json")
        with pytest.raises(CallError, match="does not say which label") as error:
            association_of(replace(calibration, labels=None), path)
        assert "--assoc that it was made with" in error.value.hint
        gone = replace(calibration.labels, figure="gone.toml", source="mine.txt")
        with pytest.raises(CallError, match=r"its skeleton 'gone\.toml', named in mine") as error:
            association_of(replace(calibration, labels=gone), path)
        assert error.value.hint == "give --assoc with mine.txt, or --skeleton with that file"
        part = association_of(replace(calibration, labels=gone), path, "right_leg")
        assert {rule.segment for rule in part.rules} == set(part.skeleton.segment_of.values())


class TestCommand:
    def run(self, *arguments):
        return CliRunner().invoke(group, [str(a) for a in arguments])

    def test_calibrate_then_fit(self, tmp_path):
        paths = []
        for side in SIDES:
            paths.append(tmp_path / f"{side}.c3d")
            write_c3d(half(side, SIDES.index(side)), paths[-1])
        broken, actor = tmp_path / "broken.c3d", tmp_path / "actor.json"
        broken.write_bytes(b"nothing")
        done = self.run("calibrate", *paths, broken, "-a", "cmu", "-o", actor)
        # click hands back what the command returns only through the exit code of `main`.
        assert "broken.c3d" in done.output and f"wrote {actor}" in done.output, done.output
        assert "Left.c3d" in done.output and actor.exists()
        again = self.run("calibrate", *paths, "-a", "cmu", "-o", actor)
        assert isinstance(again.exception, CallError) and "exists already" in str(again.exception)
        rows = self.run(
            "calibrate", *paths, "-a", "cmu", "-o", actor, "--overwrite", "--json", "-q"
        )
        lines = [json.loads(line) for line in rows.output.splitlines()]
        assert {row["joint"] for row in lines} >= {"LeftHip", "RightKnee"}
        assert all(set(row["shares"]) <= {"Left.c3d", "Right.c3d"} for row in lines)
        fit = self.run(
            "fit", paths[0], "-a", "cmu", "--calibration", actor, "-o", tmp_path, "--json"
        )
        assert "calibration (1 clip)" in fit.output
        # It knows which label is which marker, whether a file said it or the guess.
        actor.unlink()
        for words in (["-a", "cmu"], []):
            self.run("calibrate", *paths, *words, "-o", actor, "--overwrite")
            call = ("fit", paths[0], "--calibration", actor, "-o", tmp_path / "b", "--overwrite")
            assert self.run(*call, "--json").output == fit.output
        same = self.run("calibrate", paths[0], paths[0], "-a", "cmu", "-o", tmp_path / "b.json")
        assert "same recording" in str(same.exception)
        assert not (tmp_path / "b.json").exists()

    def test_several_subjects_need_a_choice(self, tmp_path):
        from recordings import ASSOCIATIONS, SAMPLES

        call = (
            "calibrate", SAMPLES / "two_dancers.c3d", "-a", ASSOCIATIONS["two_dancers"], "-o",
            tmp_path / "a.json",
        )  # fmt: skip
        assert "choose with --subject" in self.run(*call).exception.hint
        assert "wrote" in self.run(*call, "--subject", "Anna").output

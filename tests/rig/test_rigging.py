"""From a fit to a figure of rigid bones: which joints it has, which frames, what is filled, and what is said."""

import re
from dataclasses import replace

import numpy as np
import pytest
from bvh_files import fit_without, on, whole, without
from recordings import fit_recording, fit_sample

from mocap_skel.errors import ExportError
from mocap_skel.results.axes import turned
from mocap_skel.rig.kinematics import forward
from mocap_skel.rig.rigging import LONGEST_GAP, SHORTEST_END, rig_of
from mocap_skel.segments.pose import Pose

# From axes with y up to those with z up.
UPRIGHT = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])


def notes_of(fit, **options):
    return rig_of(fit, **options)[2]


def lengths(rig):
    return [np.linalg.norm(end) for end in rig.ends.values()]


def test_each_branch_is_in_one_piece_and_parents_come_first():
    rig, segments, _ = rig_of(fit_sample("range_of_motion"))
    assert rig.parents[0] == -1 and rig.names[0] == "Hips"
    below = {i: {i} for i in range(len(rig.parents))}
    for i in reversed(range(1, len(rig.parents))):
        assert rig.parents[i] < i
        below[rig.parents[i]] |= below[i]
    for i, own in below.items():
        assert own == set(range(i, i + len(own))), rig.names[i]
    # Of two that hang on one joint, that which stands first in the skeleton file comes first.
    names = [s.name for s in fit_sample("range_of_motion").skeleton.segments]
    for i in range(len(rig.parents)):
        own = [names.index(segments[c].name) for c in rig.children(i)]
        assert own == sorted(own)


class TestGaps:
    def test_a_gap_in_the_root_is_filled_along_a_line(self):
        gap = slice(100, 106)
        rig, _, notes = rig_of(fit_without(["RFWT", "LFWT"], gap))
        assert "Hips filled in frames 201-206" in notes
        steps = np.diff(rig.position[99:107], axis=0)
        np.testing.assert_allclose(steps, steps[:1].repeat(7, axis=0), atol=1e-12)

    def test_single_frames_are_listed_as_such(self):
        assert "Head filled in frames 151, 161" in notes_of(fit_without(on("Head"), [50, 60]))

    def test_too_long_a_gap_is_refused(self):
        most = int(LONGEST_GAP * 60)
        fit = fit_without(on("Head"), slice(100, 100 + most))
        assert "Head filled in frames 201-230" in notes_of(fit)
        fit = fit_without(on("Head"), slice(100, 100 + most + 1))
        with pytest.raises(ExportError, match=r"Head has no pose for 0\.5 s"):
            rig_of(fit)

    def test_missing_ends_need_trim(self):
        fit = fit_without(on("Head"), [0, 1, 2, 299])
        with pytest.raises(ExportError, match=r"in frames 101-103, 400$") as caught:
            rig_of(fit)
        assert "--trim" in caught.value.hint
        rig, _, notes = rig_of(fit, trim=True)
        assert "4 incomplete frames at the ends left out" in notes
        np.testing.assert_array_equal(rig.position, rig_of(whole())[0].position[3:299])

    def test_gaps_are_numbered_by_the_file_after_trimming_too(self):
        notes = notes_of(fit_without(on("Head"), [0, 1, 2, 150]), trim=True)
        assert "Head filled in frames 251" in notes

    @pytest.mark.parametrize("trim", [False, True])
    @pytest.mark.parametrize("together", [0, 1])
    def test_segments_that_are_not_seen_at_the_same_time_are_refused(self, trim, together):
        first = without(on("Head"), slice(150 + together, None))
        fit = fit_recording(without(on("LeftFoot"), slice(150), first))
        with pytest.raises(ExportError, match="not seen at the same time"):
            rig_of(fit, trim=trim)


class TestMissingJoints:
    def test_a_joint_that_is_not_fitted_is_left_out_and_listed(self):
        # Without anatomy, which would know the wrist.
        fit = fit_recording(without(["LFIN"], slice(None)), prior="none")
        rig, _, notes = rig_of(fit)
        assert "without LeftWrist" in notes
        assert "LeftWrist" not in rig.names and "RightWrist" in rig.names and len(rig.names) == 14
        assert len(rig.ends) == 5 and min(lengths(rig)) >= SHORTEST_END
        # The forearm ends in the middle of its markers.
        own = fit.segments["LowerLeftArm"]
        middle = np.mean([own.template[m] for m in ("LARM", "LWRA", "LWRB")], axis=0)
        end = rig.ends[rig.names.index("LeftElbow")]
        assert np.linalg.norm(end) == pytest.approx(np.linalg.norm(middle - own.joint), abs=1e-12)

    def test_a_limb_ends_at_a_joint_of_which_the_segment_beyond_has_no_pose(self):
        fit = fit_sample("nearly_still")
        segments = {name: own for name, own in fit.segments.items() if name != "LeftHand"}
        rig, _, notes = rig_of(replace(fit, segments=segments))
        assert {"without LeftWrist", "fitted, but no segment turns about them: LeftWrist"} <= set(
            notes
        )
        wrist = next(joint for joint in fit.joints if joint.joint == "LeftWrist")
        length = np.linalg.norm(wrist.centre - fit.segments["LowerLeftArm"].joint)
        end = rig.ends[rig.names.index("LeftElbow")]
        np.testing.assert_allclose(end, [length, 0, 0] @ UPRIGHT, atol=1e-9)

    def test_a_branch_that_is_not_fitted_is_left_out_whole(self):
        rig, _, notes = rig_of(fit_without(on("UpperLeftArm"), slice(None)))
        (note,) = (note for note in notes if "without" in note)
        assert all(name in note for name in ("LeftShoulder", "LeftElbow", "LeftWrist"))
        assert len(rig.names) == 12

    def test_an_end_point_on_the_joint_gets_a_length(self):
        fit = fit_sample("nearly_still")
        head = fit.segments["Head"]
        stub = replace(fit, segments=fit.segments | {"Head": replace(head, end=head.joint)})
        rig, _, _ = rig_of(stub)
        neck = rig.names.index("Neck")
        # It goes on as the bone before it, by a centimetre.
        np.testing.assert_allclose(
            rig.ends[neck], 0.01 * rig.offsets[neck] / np.linalg.norm(rig.offsets[neck]), atol=1e-15
        )


class TestFloor:
    def raised(self, height):
        fit = turned(fit_sample("nearly_still"), "y")
        up = np.array([0.0, height, 0.0])
        segments = {
            name: replace(s, pose=Pose(s.pose.rotation, s.pose.origin + up))
            for name, s in fit.segments.items()
        }
        return replace(fit, segments=segments)

    def lowest(self, rig):
        joints, ends = forward(rig)
        return min(joints[..., 1].min(), *(end[:, 1].min() for end in ends.values()))

    @pytest.mark.parametrize(("height", "where"), [(0.7, "over"), (-0.7, "under")])
    def test_a_figure_off_the_floor_is_told_and_put_there_on_request(self, height, where):
        fit = self.raised(height)
        plain, _, notes = rig_of(fit)
        (note,) = (note for note in notes if "--floor" in note)
        metres, said = re.search(r"is (\S+) m (over|under) zero", note).groups()
        assert said == where and float(metres) == pytest.approx(abs(self.lowest(plain)), abs=0.005)
        rig, _, notes = rig_of(fit, floor=True)
        assert not any("zero" in note for note in notes)
        assert self.lowest(rig) == pytest.approx(0, abs=1e-12)
        # Up and down only.
        np.testing.assert_array_equal(rig.position[:, [0, 2]], plain.position[:, [0, 2]])

    def test_a_figure_near_the_floor_is_not_worth_a_word(self):
        low = self.lowest(rig_of(self.raised(0.0))[0])
        for height, words in ((0.09, 0), (-0.09, 0), (0.11, 1)):
            notes = notes_of(self.raised(height - low))
            assert sum("--floor" in note for note in notes) == words


@pytest.mark.parametrize(("away", "told"), [(0.3, 1), (0.03, 1), (0.01, 0)])
def test_a_joint_that_bones_put_elsewhere_is_told_with_how_far(away, told):
    fit = fit_sample("nearly_still")
    wrist = next(joint for joint in fit.joints if joint.joint == "LeftWrist")
    # The track alone is moved, in one frame: it is what the note compares with the bones.
    track = wrist.track.copy()
    track[100, 2] += away
    moved = tuple(replace(j, track=track) if j is wrist else j for j in fit.joints)
    notes = [n for n in notes_of(replace(fit, joints=moved)) if "constant length" in n]
    assert len(notes) == told
    if told:
        far = float(re.search(r"LeftWrist (\S+) cm", notes[0])[1])
        assert far == pytest.approx(100 * away, abs=1)

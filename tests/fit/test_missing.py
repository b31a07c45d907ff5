"""What a fit does without: segments without markers, markers that are never seen, a root that is none."""

from dataclasses import replace

import numpy as np
import pytest
from arms import ALL, ARM, ARM_MARKERS, arm_recording, association
from fitted import ENDS, JOINTS, columns, joints, seen, short, without_markers
from recordings import fit_recording

from mocap_skel.artificial import Faults, marker_set
from mocap_skel.errors import FitError


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """The association of an arm, a figure of its own."""
    return association(ARM, ARM_MARKERS, tmp_path_factory.mktemp("arm"))


class TestWhatIsMissing:
    def test_a_segment_without_markers_ends_its_branch_and_the_rest_is_fitted(self):
        recording = short()
        chest = [name for name, (on, _) in marker_set("cmu").items() if on == "Chest"]
        keep = [i for i, label in enumerate(recording.labels) if label not in chest]
        fewer = replace(
            recording,
            points=recording.points[:, keep],
            labels=tuple(recording.labels[i] for i in keep),
        )
        # With σ given, the legs do not know of the chest at all.
        whole, fit = (fit_recording(r, sigma=0.001, prior="none") for r in (recording, fewer))
        found = joints(fit)
        assert found["Waist"].reason == "no marker on Chest"
        assert found["Neck"].reason == found["LeftShoulder"].reason == "Chest has no pose"
        assert found["LeftElbow"].reason == "UpperLeftArm has no pose"
        assert any("Waist" in note and "no marker on Chest" in note for note in fit.notes)
        gone = JOINTS[:8]
        assert [joint.joint for joint in fit.joints if not joint.fitted] == gone
        for name, joint in joints(whole).items():
            if name in gone:
                assert not seen(found[name].track).any()
                assert (found[name].shown, found[name].samples) == ("no", 0)
            else:
                np.testing.assert_array_equal(joint.track, found[name].track)
        tracks = dict(fit.tracks())
        assert list(tracks) == [*JOINTS, "Hips", *ENDS]
        assert not seen(tracks["Head"]).any()
        assert seen(tracks["LeftFoot"]).any()

    def test_a_marker_that_is_missing_in_every_frame_is_noted(self):
        fit = fit_recording(without_markers(short(), "LTHI", "STRN"))
        notes = [note for note in fit.notes if "missing in every frame" in note]
        for marker, segment in (("LTHI", "UpperLeftLeg"), ("STRN", "Chest")):
            assert any(marker in note and segment in note for note in notes)
        assert "STRN" not in fit.segments["Chest"].template
        assert joints(fit)["LeftHip"].markers == ("LKNE",)

    @pytest.mark.parametrize(
        ("lost", "left"),
        [
            (("RFWT", "LFWT"), "RBWT, LBWT"),
            (("RFWT", "LFWT", "RBWT"), "LBWT"),
            (("RFWT", "LFWT", "RBWT", "LBWT"), "none"),
        ],
    )
    def test_a_root_of_fewer_than_three_markers_is_refused_by_name(self, lost, left):
        with pytest.raises(FitError, match=rf"root segment Hips needs three markers.*has {left}$"):
            fit_recording(without_markers(short(), *lost))

    def test_a_root_whose_markers_stand_in_a_line_or_never_together_is_refused(self):
        recording = short(Faults(sigma=0.0001))
        points = recording.points.copy()
        at = columns(recording, "RFWT", "LFWT", "RBWT", "LBWT")
        shares = np.array([0.0, 0.3, 0.7, 1.0])[:, None]
        points[:, at] = points[:, at[:1]] * (1 - shares) + points[:, at[1:2]] * shares
        with pytest.raises(FitError, match="Hips"):
            fit_recording(replace(recording, points=points))
        never = recording
        for i, marker in enumerate(("RFWT", "LFWT", "RBWT", "LBWT")):
            # Each pair is seen now and then, three never.
            frame = np.arange(300) % 4
            never = without_markers(never, marker, frames=(frame == i) | (frame == (i + 1) % 4))
        with pytest.raises(FitError, match="seen together"):
            fit_recording(never)

    def test_a_child_that_is_never_seen_with_its_parent_is_not_fitted(self, arm):
        half = np.arange(400) < 200
        recording = without_markers(arm_recording(ALL), "H1", "H2", frames=half)
        recording = without_markers(recording, "F1", "F2", "F3", frames=~half)
        fit = fit_recording(recording, arm)
        assert not joints(fit)["Wrist"].fitted
        assert joints(fit)["Elbow"].fitted
        assert any(
            "Wrist" in note and "seen together in fewer than 4 frames" in note for note in fit.notes
        )

    def test_a_pelvis_alone_is_no_fit_though_anatomy_has_its_hips(self):
        pelvis = [name for name, (on, _) in marker_set("cmu").items() if on == "Hips"]
        others = [name for name in short().labels if name not in pelvis]
        with pytest.raises(FitError, match=r"no joint can be fitted: no marker on Chest; .*has no"):
            fit_recording(without_markers(short(), *others))
        # With a thigh there is something to fit, and the hip of the other side is anatomy's.
        others = [name for name in others if name not in ("LTHI", "LKNE")]
        fit = fit_recording(without_markers(short(), *others))
        hips = joints(fit)["LeftHip"], joints(fit)["RightHip"]
        assert [(hip.fitted, hip.samples > 0) for hip in hips] == [(True, True), (True, False)]

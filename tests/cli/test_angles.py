"""Joint angles as a user gets them: files, --static, and calls that cannot be."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest
from anatomy import JOINTS, association_of, filmed
from commands import ROM, STILL, call, files
from osim_files import read_motion
from recordings import CLIPS, SAMPLES, fit_sample, rendered

from mocap_skel import angles_table, joint_angles, read_clip, write_fit
from mocap_skel.artificial import Faults, write_c3d
from mocap_skel.errors import ExportError
from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.results.axes import turned


def read(text):
    """Names, and values (frames, columns), NaN = empty."""
    head, *rows = csv.reader(io.StringIO(text))
    return head, np.array([[float(cell or "nan") for cell in row] for row in rows])


def test_angles_csv_has_frames_times_and_three_columns_a_joint():
    fit = fit_sample("gaps")
    angles = joint_angles(fit)
    (text,) = rendered("angles", fit).files.values()
    head, values = read(text)
    assert head[:5] == ["frame", "time", "Hips_rotation", "Hips_obliquity", "Hips_tilt"]
    assert {"LeftKnee_flexion", "LeftKnee_adduction", "LeftKnee_rotation"} <= set(head)
    assert len(head) == 2 + 3 * len(angles.joints) and len(set(head)) == len(head)
    np.testing.assert_array_equal(values[:, 0], fit.frame_numbers)
    np.testing.assert_allclose(values[:, 1], fit.time, atol=5.1e-7)
    column = values[:, head.index("LeftKnee_flexion")]
    np.testing.assert_allclose(column, angles["LeftKnee"].degrees[:, 0], atol=5.1e-5)
    table = angles_table(fit)
    assert list(table.columns) == head[1:] and table.index.name == "frame"


@pytest.mark.parametrize("name", ["sto", "mot"])
def test_storage_files_have_the_angles_of_the_table(name):
    """Of every frame in which they are known: OpenSim's Storage stops at a nan, and says nothing."""
    fit = fit_sample("gaps")
    head, values = read(rendered("angles", fit).files[".angles.csv"])
    made = rendered(name, fit)
    text = made.files[f".angles.{name}"]
    motion = read_motion(text)
    kept = [head.index(title) for title in motion.names]
    known = np.isfinite(values[:, kept]).all(axis=1)
    assert 0 < known.sum() < len(known) and 2 < len(kept) < len(head) - 2
    rest = [i for i in range(2, len(head)) if i not in kept]
    assert (np.isnan(values[:, rest]).mean(axis=0) > 0.5).all()
    rows, columns = known.sum(), len(kept) + 1
    assert motion.head == {
        "version": "1", "nRows": str(rows), "nColumns": str(columns), "inDegrees": "yes"
    }  # fmt: skip
    assert text.startswith("gaps\nversion=1\n")
    np.testing.assert_allclose(motion.time, fit.time[known], atol=5.1e-9)
    np.testing.assert_array_equal(motion.values, values[np.ix_(known, kept)])
    lost, left = made.notes[-2:]
    assert (
        all(head[i] in lost for i in rest[:2])
        and f": {(~known).sum()} of {len(known)} frames" in left
    )


def test_a_clip_without_a_whole_frame_is_no_storage_file():
    fit = fit_sample("nearly_still")
    gone = {
        name: replace(one, pose=replace(one.pose, rotation=one.pose.rotation * np.nan))
        for name, one in fit.segments.items()
    }
    with pytest.raises(ExportError, match="no frame in which all angles are known, and a STO has"):
        rendered("sto", replace(fit, segments=gone))


def test_the_rigid_figure_has_angles_where_the_free_fit_has_gaps():
    fit = fit_sample("gaps")
    (free,), (rigid,) = (rendered("angles", fit, rigid=r).files.values() for r in (False, True))
    head, before = read(free)
    again, after = read(rigid)
    assert head == again
    column = head.index("RightElbow_flexion")
    assert np.isnan(before[:, column]).sum() > np.isnan(after[:, column]).sum()
    both = np.isfinite(before[:, column] + after[:, column])
    assert np.median(np.abs(before - after)[both, column]) < 2


def test_another_axis_up_leaves_every_angle_as_it_is():
    fit = fit_sample("range_of_motion")
    plain, other = (rendered("angles", fit, up=up).files[".angles.csv"] for up in (None, "y"))
    assert plain == other


def test_a_static_clip_with_another_axis_up_gives_the_same_zero():
    fit, still = fit_sample("range_of_motion"), fit_sample("nearly_still")
    plain = joint_angles(fit, still)
    for here, there in ((fit, turned(still, "y")), (turned(fit, "x"), still)):
        other = joint_angles(here, there)
        for joint in plain.joints:
            np.testing.assert_allclose(other[joint.rule.name].degrees, joint.degrees, atol=1e-6)


def test_a_static_clip_in_which_somebody_moves_is_told():
    """Such as the functional trial, given in place of the standing one."""
    fit = fit_sample("range_of_motion")
    said = [note for note in joint_angles(fit, fit).notes if "does not stand still" in note]
    assert len(said) == 1 and "Waist, Neck, RightShoulder" in said[0]
    still = joint_angles(fit, fit_sample("nearly_still")).notes
    assert not [note for note in still if "does not stand still" in note]


def test_a_figure_without_angles_is_told_so():
    fit = fit_sample("nearly_still")
    palm = {"Palm": fit.segments["Head"]}
    hand = replace(fit, segments=palm, skeleton=read_skeleton("hand"), joints=())
    with pytest.raises(ExportError, match="no joint of the figure hand has angles"):
        rendered("angles", hand)


@pytest.fixture(scope="module")
def standing(tmp_path_factory):
    """Files of somebody who moves, and of the same person who stands with a bent knee; their association."""
    folder = tmp_path_factory.mktemp("static")
    association_of(folder)
    still = {name: np.zeros((120, 3)) for name in (*JOINTS, "Hips")}
    still["RightKnee"] = np.tile([12.0, 0.0, 0.0], (120, 1))
    faults = Faults(sigma=0.0001)
    for name, recording in (
        ("moves", filmed(600, faults=faults)[0]),
        ("stands", filmed(120, faults=faults, joints=still)[0]),
    ):
        write_c3d(recording, folder / f"{name}.c3d")
    return folder


def test_static_takes_the_standing_pose_as_zero(standing, tmp_path):
    common = ("moves.c3d", "-a", "anatomy.txt", "-f", "angles", "-f", "parquet", "-q", "-o")
    assert call("fit", *common, tmp_path / "a", cwd=standing).returncode == 0
    done = call("fit", *common, tmp_path / "b", "--static", "stands.c3d", cwd=standing)
    assert done.returncode == 0
    (head, plain), (_, zeroed) = (
        read((tmp_path / name / "moves.angles.csv").read_text()) for name in "ab"
    )
    column = head.index("RightKnee_flexion")
    # Turns about other axes are small, so taking a turn off is nearly taking an angle off.
    np.testing.assert_allclose(np.median(plain[:, column] - zeroed[:, column]), 12, atol=1)
    assert files(tmp_path / "a") == files(tmp_path / "b")


def test_parquet_has_the_angles_in_long_form_with_their_errors(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    fit = fit_sample("gaps")
    write_fit(fit, read_clip(SAMPLES / "gaps.c3d"), tmp_path, "parquet")
    table = parquet.read_table(tmp_path / "gaps.angles.parquet")
    assert table.column_names == [
        "clip", "subject", "frame", "time", "joint", "angle", "degrees", "standard_error",
    ]  # fmt: skip
    angles = joint_angles(fit)
    knee = (np.array(table["joint"]) == "LeftKnee") & (np.array(table["angle"]) == "flexion")
    ours = table["degrees"].to_numpy()[knee]
    np.testing.assert_array_equal(ours, angles["LeftKnee"].degrees[:, 0])
    assert table["standard_error"].null_count == sum(
        np.isnan(joint.standard_error).sum() for joint in angles.joints
    )


@pytest.mark.parametrize(
    ("arguments", "words", "code"),
    [
        (["--static", "gone.c3d"], "gone.c3d", 3),
        (["--static", ROM, "--subject", "Ann"], "Ann", 2),
    ],
)
def test_a_static_clip_that_cannot_be_is_one_clear_message(tmp_path, arguments, words, code):
    done = call("fit", STILL, "-a", "cmu", "-f", "angles", *arguments, cwd=tmp_path)
    assert done.returncode == code and words in done.stderr and not files(tmp_path)


def test_a_picture_of_a_pose_takes_no_static_clip(tmp_path):
    done = call("draw", ROM, "-a", "cmu", "--static", STILL, cwd=tmp_path)
    assert done.returncode == 2 and "--static is for --plot angles, not for pose" in done.stderr


@pytest.mark.real
def test_a_real_static_trial_is_taken_as_neutral(shared_clips, tmp_path):
    folder = CLIPS / "plug_in_gait"
    done = call(
        "fit", folder / "HC055A34.c3d", "--static", folder / "HC055A01.c3d", "-f", "angles", "-o", tmp_path,
        cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0
    head, values = read((tmp_path / "HC055A34.angles.csv").read_text())
    # The inner ankle markers of the static trial give the shank its axes.
    assert "LowerLeftLeg: outward" not in done.stderr
    assert np.isfinite(values[:, head.index("LeftAnkle_flexion")]).all()

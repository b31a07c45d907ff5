"""C3D write-back: the copy is the input with more points, for every reader there is."""

import struct
import warnings
from dataclasses import replace
from pathlib import Path

import c3d
import ezc3d
import numpy as np
import pytest
from recordings import ASSOCIATIONS, SAMPLES, fit_clip

from mocap_skel import read_clip
from mocap_skel.errors import ExportError
from mocap_skel.export.c3d_copy import c3d_copy
from mocap_skel.export.parameters import Parameters
from mocap_skel.export.registry import choose
from mocap_skel.labels.association import read_association
from mocap_skel.pipeline.clip_files import process
from mocap_skel.pipeline.job import Job
from mocap_skel.readers.formats.c3d.contents import texts
from mocap_skel.readers.formats.c3d.machine import encoded, numbers
from mocap_skel.readers.formats.c3d.section import BLOCK
from mocap_skel.readers.formats.c3d.survey import survey

NAME = "nearly_still"


def copied(path, folder, association="cmu", subject=None, **options):
    """A fit of a clip, its copy, and the notes."""
    clip = read_clip(path)
    fit = fit_clip(clip, association, subject)
    content, notes = c3d_copy(fit, clip, path, **options)
    target = folder / f"{path.stem}.skeleton.c3d"
    target.write_bytes(content)
    return fit, clip, target, notes


def entries(path):
    found = survey(path)
    data = path.read_bytes()[found.section.start :]
    walk = Parameters(data, found.section.machine)
    return {(e.group, e.key): (e.length, e.name, e.content) for e in walk._entries}


def frames(path):
    """Points and analog values of every frame as bytes."""
    found = survey(path)
    layout = found.layout
    flat = np.fromfile(path, np.uint8, layout.declared * layout.stride, offset=layout.start)
    rows = np.pad(flat, (0, layout.declared * layout.stride - len(flat)))
    rows = rows.reshape(layout.declared, layout.stride)
    own = 4 * layout.points * layout.width
    return rows[:, :own], rows[:, own:]


def by_ezc3d(path):
    content = ezc3d.c3d(str(path))
    data, point = content["data"], content["parameters"]["POINT"]
    points = data["points"][:3].transpose(2, 1, 0)
    missing = data["meta_points"]["residuals"][0].T < 0
    names = [n for key in ("LABELS", "LABELS2") if key in point for n in point[key]["value"]]
    return points, missing, names, data["analogs"]


def by_c3d(path):
    with path.open("rb") as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        reader = c3d.Reader(file)
        read = [(p, a) for _, p, a in reader.read_frames(copy=True)]
        keys = [k for k in ("LABELS", "LABELS2") if reader.get("POINT").get(k) is not None]
        names = [n.strip() for k in keys for n in reader.get("POINT").get(k).string_array]
    points = np.stack([p for p, _ in read])
    return points[..., :3], points[..., 3] < 0, names, np.stack([a for _, a in read])


def by_us(path):
    found = survey(path)
    data = found.read(0, found.layout.declared)
    points = data[..., :3] * (found.scale if found.layout.width == 2 else 1)
    return points, data[..., 3] < 0, texts(found.section.groups["POINT"], "LABELS"), frames(path)[1]


READERS = {"ezc3d": by_ezc3d, "c3d": by_c3d, "ours": by_us}


def check_copy(source, target, fit, clip, readers=READERS):
    """Nothing of the input is lost, and the tracks are there; returns the widest difference, metres."""
    for before, after, own in zip(frames(source), frames(target), (True, False), strict=True):
        assert np.array_equal(before, after[:, : before.shape[1]] if own else after)
    old, new = entries(source), entries(target)
    changed = {key for (_, key), entry in old.items() if new[_, key] != entry}
    allowed = ("USED", "DATA_START", "LABELS", "DESCRIPTIONS", "JOINT_CENTRES", "SEGMENT_AXES")
    assert all(key.startswith(allowed) for key in changed), changed
    there, here = survey(target), survey(source)
    assert there.first_frame == here.first_frame and there.header.frames == here.header.frames
    # Points a frame and the block of the first one; events stand further on.
    a, b = source.read_bytes()[:BLOCK], target.read_bytes()[:BLOCK]
    assert {at for at in range(BLOCK) if a[at] != b[at]} <= {2, 3, 16, 17}
    metres = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}[clip.unit]
    step = here.scale * metres / 2 if here.layout.width == 2 else 0.0
    count, worst = here.layout.points, 0.0
    for read in readers.values():
        was, now = read(source), read(target)
        assert np.array_equal(was[0], now[0][:, :count], equal_nan=True)
        assert np.array_equal(was[1], now[1][:, :count])
        assert [n.strip() for n in was[2][:count]] == now[2][:count]
        assert np.array_equal(was[3], now[3], equal_nan=True)
        for place, (name, track) in enumerate(fit.tracks(), count):
            assert now[2][place].rpartition(":")[2] == name
            seen = np.isfinite(track[:, 0])
            assert np.array_equal(now[1][:, place], ~seen)
            away = np.abs(now[0][seen, place] * metres - track[seen])
            # Half a step of integers, or the rounding of 32 bits.
            limit = step * 1.01 + 2e-7 * np.abs(track[seen])
            assert (away <= limit).all(), name
            worst = max(worst, away.max(initial=0.0))
    return worst


@pytest.mark.parametrize("name", ["nearly_still", "gaps", "two_dancers"])
def test_the_copy_is_the_input_with_more_points_for_all_readers(name, tmp_path):
    source = SAMPLES / f"{name}.c3d"
    fit, clip, target, _ = copied(source, tmp_path, ASSOCIATIONS[name], axes=True)
    assert check_copy(source, target, fit, clip) < 1e-6


def test_added_points_are_no_markers_when_the_copy_is_read_again(tmp_path):
    fit, clip, target, _ = copied(
        SAMPLES / "two_dancers.c3d", tmp_path, ASSOCIATIONS["two_dancers"], axes=True
    )
    again = read_clip(target)
    assert again.labels == clip.labels and again.subjects == clip.subjects
    np.testing.assert_array_equal(again.points, clip.points)
    (reason,) = again.left_out
    assert reason == "joint centres of an earlier fit"
    axes = [j.joint for j in fit.joints if j.turns_on is not None]
    assert axes and len(again.left_out[reason]) == (
        len(list(fit.tracks())) + 4 * len(fit.segments) + len(axes)
    )
    assert (
        f"{fit.subject}:{axes[0]}_A" in again.left_out[reason]
        or f"{axes[0]}_A" in again.left_out[reason]
    )
    # Labels carry the subject.
    labels = texts(survey(target).section.groups["POINT"], "JOINT_CENTRES")
    assert labels[0] == f"{fit.subject}:Waist"


def test_a_label_that_is_there_already_gets_a_number(tmp_path):
    _, clip, target, _ = copied(SAMPLES / f"{NAME}.c3d", tmp_path)
    _, _, second, notes = copied(target, tmp_path)
    assert any("Waist_2" in note for note in notes)
    names = texts(survey(second).section.groups["POINT"], "LABELS")
    assert len(set(names)) == len(names) and "LeftHip" in names and "LeftHip_2" in names
    again = read_clip(second)
    assert again.labels == clip.labels
    assert "LeftHip_2" in again.left_out["joint centres of an earlier fit"]


def test_axes_are_a_tenth_of_a_metre_forward_up_and_to_the_right(tmp_path):
    fit, clip, target, _ = copied(SAMPLES / f"{NAME}.c3d", tmp_path, axes=True)
    points, _, names, _ = by_us(target)
    at = {n: points[:, names.index(f"Hips_{n}")].astype(float) / 1000 for n in "OXYZ"}
    x, y, z = (10 * (at[n] - at["O"]) for n in "XYZ")
    np.testing.assert_allclose(np.cross(x, y), z, atol=1e-4)
    marker = {label: clip.points[:, i] for i, label in enumerate(clip.labels)}
    right = marker["RFWT"] - marker["LFWT"]
    right /= np.linalg.norm(right, axis=1)[:, None]
    # The markers have noise, and the axes are those of all of them.
    assert (np.einsum("fi,fi->f", z, right) > 0.999).all()
    ahead = marker["RFWT"] + marker["LFWT"] - marker["RBWT"] - marker["LBWT"]
    assert (np.einsum("fi,fi->f", x, ahead) > 0).all() and (y[:, 2] > 0.8).all()
    knee = next(joint for joint in fit.joints if joint.joint == "LeftKnee")
    origin = points[:, names.index("LowerLeftLeg_O")] / 1000
    assert np.median(np.linalg.norm(origin - knee.track, axis=1)) < 0.003


def test_descriptions_say_which_joint_is_known(tmp_path):
    fit, _, target, _ = copied(SAMPLES / f"{NAME}.c3d", tmp_path)
    group = survey(target).section.groups["POINT"]
    said = dict(zip(texts(group, "LABELS"), texts(group, "DESCRIPTIONS"), strict=True))
    for joint in fit.joints:
        assert said[joint.joint] == f"joint centre by mocap-skel, shown: {joint.shown}"


def test_labels_past_255_go_on_in_a_second_list():
    text = bytes([0, 0, 1, 84]) + b"\x05\xffPOINT\x03\x00\x00"
    walk = Parameters(text + b"\0\0", "INTEL")
    names = [f"P{i}".encode() for i in range(300)]
    walk.set_texts("LABELS", names)
    assert [row.strip() for row in walk.texts("LABELS")] == names
    assert len(walk._rows(walk._find("LABELS2"))) == 45
    longer = [*walk.texts("LABELS"), b"A much longer name"]
    walk.set_texts("LABELS", longer)
    assert [row.strip() for row in walk.texts("LABELS")] == [*names, b"A much longer name"]
    assert Parameters(walk.to_bytes(), "INTEL").texts("LABELS") == walk.texts("LABELS")


@pytest.mark.parametrize("machine", ["INTEL", "DEC", "MIPS"])
@pytest.mark.parametrize("kind", ["f4", "i2"])
def test_numbers_are_written_as_they_are_read(machine, kind):
    values = np.array([0, -1, 1, 1234, -32768, 32767], kind)
    assert np.array_equal(numbers(encoded(values, kind, machine), kind, machine), values)


def as_integers(path, target, machine="INTEL"):
    """A clip with float points and without analog data, with its points as integers of 0.1 mm."""
    found = survey(path)
    data = found.read(0, found.layout.declared).astype(np.float64)
    data[..., :3] = np.where(data[..., 3:] < 0, 0, np.round(data[..., :3] / 0.1))
    content = bytearray(path.read_bytes()[: found.layout.start])
    struct.pack_into("<f", content, 12, 0.1)
    at = content.index(b"SCALE", BLOCK) + len(b"SCALE") + 2
    assert content[at] == 4
    struct.pack_into("<f", content, at + 2 + content[at + 1], 0.1)
    body = data.astype("<i2").tobytes()
    target.write_bytes(bytes(content) + body + bytes(-len(body) % BLOCK))
    return target


def test_integers_stay_integers_and_the_rounding_is_told(tmp_path):
    source = as_integers(SAMPLES / "gaps.c3d", tmp_path / "whole.c3d")
    fit, clip, target, notes = copied(source, tmp_path, ASSOCIATIONS["gaps"])
    assert survey(target).layout.width == 2
    assert 0 < check_copy(source, target, fit, clip) <= 0.051e-3
    assert any("rounded to 0.1 mm" in note for note in notes)


def test_what_its_integers_cannot_hold_is_missing_and_counted(tmp_path):
    """Integers of 0.1 mm end at 3276.7 mm; beyond them a joint would wrap round to the other side of the lab."""
    source = as_integers(SAMPLES / "gaps.c3d", tmp_path / "whole.c3d")
    clip = read_clip(source)
    fit = fit_clip(clip, ASSOCIATIONS["gaps"])
    track = np.zeros_like(fit.joints[0].track)
    track[:6, 1] = [3.2767, 3.2768, -3.2768, -3.2769, 5.0, 1000.0]
    moved = replace(fit, joints=(replace(fit.joints[0], track=track), *fit.joints[1:]))
    made, notes = c3d_copy(moved, clip, source)
    target = tmp_path / "copy.c3d"
    target.write_bytes(made)
    assert "C3D: samples that its integers cannot hold, left out: 4" in notes
    for read in READERS.values():
        points, missing, _, _ = read(target)
        own = survey(source).layout.points
        assert missing[:7, own].tolist() == [False, True, False, True, True, True, False]
        np.testing.assert_allclose(points[[0, 2], own, 1], [3276.7, -3276.8], rtol=1e-6)


def test_damage_is_refused_in_one_line_and_no_copy_is_written(tmp_path):
    whole = (SAMPLES / f"{NAME}.c3d").read_bytes()
    cut = tmp_path / "cut.c3d"
    cut.write_bytes(whole[: len(whole) * 2 // 3])
    job = Job(read_association("cmu"), choose("c3d"), tmp_path / "out", salvage=True)
    with pytest.raises(ExportError, match=r"cut\.c3d: it says \d+ frames, of which \d+ were read"):
        process(cut, job)
    assert not (tmp_path / "out").exists()


def test_another_unit_than_the_file_says_is_the_files_own_numbers(tmp_path):
    source = SAMPLES / f"{NAME}.c3d"
    clip = read_clip(source, unit="cm")
    wide = fit_clip(clip, "cmu")
    made, _ = c3d_copy(wide, clip, source)
    target = tmp_path / "wide.c3d"
    target.write_bytes(made)
    count = survey(source).layout.points
    waist = by_us(target)[0][:, count]
    np.testing.assert_allclose(waist, next(wide.tracks())[1] * 100, rtol=1e-6, atol=1e-3)


# With the readers that can read the original.
ALL = ("ezc3d", "c3d", "ours")
REAL = [
    ("cmu/01_01.c3d", "cmu", ("ezc3d", "ours")),
    ("cmu/basketball.c3d", "cmu", ALL),
    ("hdm05/HDM_dg_06-03_03_120.c3d", "cmu", ALL),
    ("functional_hip/FunctionalLHip.c3d", "plug_in_gait_clusters", ALL),
    ("functional_hip/FunctionalWalk.c3d", "plug_in_gait_clusters", ALL),
    ("plug_in_gait/HC055A34.c3d", "plug_in_gait", ALL),
    ("two_subjects/kinematics_tennis_serve_2players.c3d", "plug_in_gait", ALL),
    ("odd_files/sub_labels.c3d", "plug_in_gait", ALL),
    # Its analog offsets are floats: the libraries refuse it as soon as they see them.
    ("odd_files/Dance.c3d", "phoenix_channels", ("ours",)),
    ("odd_files/Eb015pi.c3d", "lower_body_plates", ALL),
    ("odd_files/Eb015si.c3d", "lower_body_plates", ("c3d", "ours")),
]


@pytest.mark.real
@pytest.mark.parametrize(
    ("clip", "association", "readers"), REAL, ids=[Path(one[0]).stem for one in REAL]
)
def test_real_recordings_are_copied_whole(shared_clips, tmp_path, clip, association, readers):
    source = shared_clips / clip
    fit, read, target, _ = copied(source, tmp_path, association)
    chosen = {name: READERS[name] for name in readers}
    assert check_copy(source, target, fit, read, chosen) < 6e-5


@pytest.mark.real
def test_damaged_parameters_are_not_written_anew(shared_clips):
    path = shared_clips / "odd_files" / "bad_parameter_section.c3d"
    clip = read_clip(path)
    with pytest.raises(ExportError, match="damaged parameters"):
        c3d_copy(fit_clip(clip, "numbered_points"), clip, path)

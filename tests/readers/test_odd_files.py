"""Files as they are found: pointers, counts and parameters that are wrong, each kind written byte by byte."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from c3d_bytes import (
    BLOCK,
    blocks_between,
    c3d_file,
    change,
    is_right,
    notes,
    tracks,
    value_of,
)
from recordings import CLIPS
from references import read_alike

from mocap_skel.errors import ClipError
from mocap_skel.readers import read_clip
from mocap_skel.readers.formats.c3d.survey import survey

# --- Pointers -----------------------------------------------------------------------------------


@pytest.mark.parametrize("scale", [-1.0, 0.1])
def test_parameters_that_do_not_follow_the_header(path, scale):
    c3d_file(path, tracks(), scale=scale)
    blocks_between(path, 2, 3)
    (data,) = struct.unpack_from("<H", path.read_bytes(), 16)
    change(path, 0, "B", 5)
    change(path, 16, "<H", data + 3)
    value_of(path, "DATA_START", "<h", data + 3)
    clip = is_right(path, tolerance=0.06)
    assert clip.labels == ("M1", "M2", "M3", "M4")
    assert clip.notes == ()


def test_points_that_do_not_follow_the_parameters(path):
    c3d_file(path, tracks())
    (data,) = struct.unpack_from("<H", path.read_bytes(), 16)
    blocks_between(path, data, 4)
    change(path, 16, "<H", data + 4)
    value_of(path, "DATA_START", "<h", data + 4)
    assert is_right(path).notes == ()


@pytest.mark.parametrize("pointer", [1, 3, 0x7F, 255])
@pytest.mark.parametrize("moved", [0, 3])
def test_a_pointer_to_the_parameters_that_is_wrong(path, pointer, moved):
    c3d_file(path, tracks())
    (data,) = struct.unpack_from("<H", path.read_bytes(), 16)
    blocks_between(path, 2, moved)
    change(path, 0, "B", pointer)
    change(path, 16, "<H", data + moved)
    value_of(path, "DATA_START", "<h", data + moved)
    clip = is_right(path)
    assert clip.labels == ("M1", "M2", "M3", "M4")
    said = f"the header says the parameters are in block {pointer}, they are in {2 + moved}"
    assert said in notes(clip)


@pytest.mark.parametrize("where", ["header", "DATA_START", "both"])
@pytest.mark.parametrize("block", [0, 1, 2, 5, 60000])
def test_a_pointer_to_the_points_that_is_wrong(path, where, block):
    c3d_file(path, tracks())
    if where != "DATA_START":
        change(path, 16, "<H", block)
    if where != "header":
        value_of(path, "DATA_START", "<H", block)
    if where == "both" and block == 5:
        # A place in the file that both name is believed: the rest of it is too short.
        with pytest.raises(ClipError, match="cut off"):
            read_clip(path)
        return
    clip = is_right(path)
    assert clip.labels == ("M1", "M2", "M3", "M4")
    assert ("for the block where the points start" in notes(clip)) == (
        where != "DATA_START" or block > 0
    )


def test_zeros_before_the_header(path):
    c3d_file(path, tracks())
    path.write_bytes(bytes(BLOCK) + path.read_bytes())
    clip = is_right(path)
    assert clip.labels[0] == "M1"
    assert clip.notes == ("512 zeros stand before its header; read with numpy",)
    path.write_bytes(bytes(4000))
    with pytest.raises(ClipError, match="not a C3D file"):
        read_clip(path)


# --- What the header and the parameters do not agree on ------------------------------------------


@pytest.mark.parametrize("where", ["header", "USED"])
@pytest.mark.parametrize("points", [1, 3, 5, 300])
@pytest.mark.parametrize("scale", [-1.0, 0.1])
def test_a_number_of_points_that_is_wrong(path, where, points, scale):
    c3d_file(path, tracks(), scale=scale)
    if where == "header":
        change(path, 2, "<H", points)
    else:
        value_of(path, "USED", "<h", points)
    clip = is_right(path, tolerance=0.06)
    assert f"says {points} points a frame, it is 4" in notes(clip)


@pytest.mark.parametrize("points", [0, 4])
def test_points_in_one_place_only(path, points):
    change(c3d_file(path, tracks()), 2, "<H", points)
    value_of(path, "USED", "<h", 4 - points)
    assert is_right(path).labels == ("M1", "M2", "M3", "M4")


def test_zero_points_are_said_to_be_none(path):
    c3d_file(path, np.ones((10, 0, 3)), analogs=4)
    with pytest.raises(ClipError, match=r"clip\.c3d: no points in it \(points: 0, frames: 10\)"):
        read_clip(path)


@pytest.mark.parametrize(("stands", "said"), [(-1.0, 0.1), (0.1, -0.1)])
@pytest.mark.parametrize("where", ["header", "SCALE", "both"])
def test_a_kind_of_numbers_that_is_wrong(path, stands, said, where):
    c3d_file(path, tracks(), scale=stands)
    if where != "SCALE":
        change(path, 12, "<f", said)
    if where != "header":
        value_of(path, "SCALE", "<f", said)
    clip = is_right(path, tolerance=0.06)
    assert f"says that the points are {'floats' if said < 0 else 'integers'}, which" in notes(clip)
    # That says it all; the scales differ by their sign only.
    assert "the first is taken" not in notes(clip)


@pytest.mark.parametrize(
    ("header", "samples", "used"),
    [(24, 4, 0), (24, 0, 6), (6, 4, 6), (0, 4, 6), (24, 4, 5), (24, 1, 6), (0, 0, 0)],
)
@pytest.mark.parametrize("scale", [-1.0, 0.1])
def test_analog_values_that_the_header_counts_in_another_way(path, header, samples, used, scale):
    """Among them the kind that ezc3d misreads in silence: its stride leaves values out."""
    c3d_file(path, tracks(), analogs=24, scale=scale)
    change(path, 4, "<H", header)
    change(path, 18, "<H", samples)
    data = path.read_bytes()
    change(path, data.index(b"USED", data.index(b"USED") + 4) + 8, "<h", used)
    clip = is_right(path, tolerance=0.06)
    assert "read with" in notes(clip)
    assert "analog values a frame, it is 24" in notes(clip)


@pytest.mark.parametrize("samples", [4, 0])
def test_channels_times_samples_are_the_analog_values(path, samples):
    """Six channels at four times the rate of the points; some headers leave the four out."""
    c3d_file(path, tracks(), analogs=24, ANALOG__USED=6, ANALOG__RATE=400.0)
    change(path, 18, "<H", samples)
    assert survey(path).contradictions == ()
    assert is_right(path).notes == ()


def test_more_frames_than_there_is_room_for_are_told_once(path):
    clip = is_right(c3d_file(path, tracks(), FRAMES=90))
    assert clip.notes == ("the file says 90 frames and has 60; read with py-c3d",)


@pytest.mark.parametrize("said", [(61, 60), (60, 61), (0, 60), (60, 0), (60, 31), (59, 60)])
def test_a_number_of_frames_that_is_wrong(path, said):
    by_parameters, by_header = said
    c3d_file(path, tracks(), FRAMES=by_parameters, last=by_header)
    is_right(path)


@pytest.mark.parametrize(("size", "noted"), [(0, False), (200, False), (600, True), (4000, True)])
def test_a_tail_is_noted_and_is_no_frame(path, size, noted):
    # 3,840 bytes of points: a tail of 200 ends in the same block as the padding may.
    c3d_file(path, tracks(), tail=np.random.default_rng(3).bytes(size))
    said = "the file goes on after the 60 frames that it says it has"
    assert is_right(path).notes == ((said,) if noted else ())


def test_a_rate_of_zero_in_the_parameters_or_in_the_header(path):
    assert is_right(c3d_file(path, tracks(), RATE=0.0)).rate == 100.0
    assert is_right(c3d_file(path, tracks(), rate=0.0, RATE=50.0)).rate == 50.0


@pytest.mark.parametrize("value", [0, 32767, 60000, 65535])
def test_more_frames_than_a_signed_word_holds(path, value):
    points = tracks(max(60, value), 1)
    clip = is_right(c3d_file(path, points), points)
    assert clip.notes == ()


def test_cameras_and_residuals_in_one_word(path):
    residuals = np.full((60, 4), 0x7F05)
    residuals[3, 1], residuals[4, 2] = -1, -256
    c3d_file(path, tracks(), residuals=residuals, scale=0.1)
    clip = read_clip(path)
    assert np.argwhere(np.isnan(clip.points[..., 0])).tolist() == [[3, 1], [4, 2]]


def test_events_in_the_header_are_nobodys_points(path):
    c3d_file(path, tracks())
    change(path, 298, "<HH", 12345, 2)
    change(path, 304, "<ff", 0.5, 1.5)
    change(path, 396, "8s", b"RHS LTO ")
    clip = is_right(path)
    assert clip.notes == ("events outside its frames, which are left out: 1 of 2",)
    assert [(event.time, event.label) for event in clip.events] == [(0.5, "RHS")]


# --- What is wrong with analog channels is nobody's trouble ----------------------------------------


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("OFFSET", np.zeros(2)),
        *[("OFFSET", None), ("SCALE", np.ones(1)), ("LABELS", np.ones(2)), ("USED", None)],
        *[("RATE", None), ("GEN_SCALE", None), ("GEN_SCALE", np.zeros(0)), ("SCALE", np.zeros(0))],
    ],
)
def test_what_may_crash_ezc3d_is_read(path, name, value):
    """An empty list of scales ends the process of ezc3d 1.7 by SIGSEGV."""
    c3d_file(path, tracks(), analogs=2, **{f"ANALOG__{name}": value})
    assert "read with" not in " ".join(is_right(path).notes)


def test_rotations_beside_the_points_are_no_trouble(path):
    c3d_file(path, tracks(), ROTATION__USED=2)
    assert is_right(path).notes == ()


# --- Real recordings ----------------------------------------------------------------------------


@pytest.mark.real
@pytest.mark.parametrize(
    ("name", "shape", "reader"),
    [
        ("Dance", (499, 40), "py-c3d"),
        ("Eb015pi", (450, 26), ""),
        ("Eb015si", (450, 26), ""),
        ("MotionMonitorC3D", (840, 8), "numpy"),
        ("bad_parameter_section", (332, 45), "numpy"),
        ("duplicate_labels", (1050, 48), ""),
        ("sub_labels", (333, 50), ""),
    ],
)
def test_odd_files_are_read(shared_clips, name, shape, reader):
    clip = read_clip(shared_clips / "odd_files" / f"{name}.c3d")
    assert clip.points.shape[:2] == shape
    assert f"read with {reader}" in notes(clip) if reader else "read with" not in notes(clip)
    # A person moves some centimetres a frame at most; misread files jump by a metre.
    steps = np.linalg.norm(np.diff(clip.points, axis=0), axis=-1)
    assert np.nanmedian(steps) < 0.03


@pytest.mark.real
@pytest.mark.parametrize("path", sorted(CLIPS.rglob("*.c3d")), ids=lambda path: path.stem)
def test_every_shared_clip_is_read_alike_by_all(path):
    first = survey(path)
    if first.doubts or first.contradictions:
        assert read_clip(path).frames == first.layout.frames
    else:
        # ezc3d has no way to read MIPS numbers.
        read_alike(path, ezc3d=first.section.machine != "MIPS")

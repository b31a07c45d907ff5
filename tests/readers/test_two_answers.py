"""Where a file says nothing, or two things, of what matters: frames, residuals, scale, rate; and what is no clip."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from c3d_bytes import c3d_file, change, is_right, notes, tracks, words

from mocap_skel import artificial as art
from mocap_skel.errors import CallError, ClipError
from mocap_skel.readers import read_clip

COUNT = 120
FORTY = tracks(COUNT, 40)
FIELDS = {"ACTUAL_START_FIELD": words(5000), "ACTUAL_END_FIELD": words(5000 + COUNT - 1)}


# --- Frames that the header does not count: PhaseSpace ------------------------------------------


@pytest.mark.parametrize(
    "numbers", [(0, 0), (1, 0), (1, 1), (0, 65535), (1, 65535), (1, 700), (0, COUNT)]
)
@pytest.mark.parametrize("frames", [None, 0, -1, COUNT])
@pytest.mark.parametrize("group", ["TRIAL", "POINT"])
def test_frames_that_are_counted_in_the_fields_only(path, numbers, frames, group):
    fields = {(f"TRIAL__{k}" if group == "TRIAL" else k): v for k, v in FIELDS.items()}
    change(c3d_file(path, FORTY, FRAMES=frames, **fields), 6, "<HH", *numbers)
    is_right(path, FORTY)


@pytest.mark.parametrize("numbers", [(0, 0), (1, 0), (1, 1), (0, 65535), (1, 65535), (0, COUNT)])
@pytest.mark.parametrize("frames", [None, 0])
def test_frames_that_are_counted_nowhere_are_those_there_are(path, numbers, frames):
    change(c3d_file(path, FORTY, FRAMES=frames), 6, "<HH", *numbers)
    is_right(path, FORTY)


def test_as_many_frames_as_16_bits_hold_in_a_file_that_ends_in_a_frame_are_cut_off(path):
    change(c3d_file(path, FORTY, FRAMES=None), 6, "<HH", 1, 65535)
    data = path.read_bytes()
    # 640 bytes a frame: 36 of them are left of the 119th.
    path.write_bytes(data[: len(data) - 2 * 640 + 36])
    with pytest.raises(ClipError, match="cut off: it says 65535 frames and ends after 118"):
        read_clip(path)


def test_residuals_that_call_every_point_missing_say_nothing(path):
    c3d_file(path, FORTY, residuals=np.full((COUNT, 40), -1.0))
    assert "every residual says that its point is missing" in notes(is_right(path, FORTY))


def test_analog_values_of_the_header_without_a_group_for_them_are_none(path):
    change(c3d_file(path, FORTY), 4, "<H", 160)
    is_right(path, FORTY)


# --- Two scales ---------------------------------------------------------------------------------


def walker(path, by_parameters, by_header):
    """A person of 39 markers in integers of 0.1 mm; returns its size in metres as it was read."""
    clip = art.record(art.human(), art.marker_set("cmu"), art.walk(1, 60), seed=2)
    c3d_file(path, clip.points * 1000, scale=0.1, SCALE=by_parameters)
    change(path, 12, "<f", by_header)
    read = read_clip(path)
    return float(
        np.ptp(read.points[..., 2], axis=1).mean() / np.ptp(clip.points[..., 2], axis=1).mean()
    ), read


@pytest.mark.parametrize("wrong", [0.1 / 2.56, 0.1 * 2.56, 0.01, 1.0])
@pytest.mark.parametrize("right_in", ["parameters", "header"])
def test_of_two_scales_the_one_that_makes_a_person(path, wrong, right_in):
    size, clip = walker(path, *((0.1, wrong) if right_in == "parameters" else (wrong, 0.1)))
    assert size == pytest.approx(1, abs=1e-3)
    assert "differ: the markers span" in notes(clip) and "by the size of the body" in notes(clip)


def test_of_two_scales_that_both_make_a_person_that_of_the_parameters(path):
    size, clip = walker(path, 0.1, 0.11)
    assert size == pytest.approx(1, abs=1e-3)
    assert "POINT:SCALE 0.1 is taken, as their size does not tell" in notes(clip)


# --- Rates --------------------------------------------------------------------------------------


@pytest.mark.parametrize("rate", [1e-30, 0.5, 1e6, 1e38, np.inf, np.nan, 0.0])
def test_a_rate_that_no_recording_has_is_asked_about(path, rate):
    c3d_file(path, tracks(), rate=rate)
    with pytest.raises(CallError, match=r"clip\.c3d: .*frame rate") as error:
        read_clip(path)
    assert "--rate" in error.value.hint
    assert read_clip(path, rate=120).rate == 120


@pytest.mark.parametrize("rate", [1e-30, 1e38])
def test_of_two_rates_the_one_that_may_be(path, rate):
    c3d_file(path, tracks(), rate=100.0, RATE=rate)
    clip = is_right(path)
    assert clip.rate == 100 and "the second is taken" in notes(clip)


# --- What is no clip ----------------------------------------------------------------------------


def test_a_file_of_rotations_only_says_so(path):
    c3d_file(path, np.ones((10, 0, 3)), ROTATION__USED=21)
    with pytest.raises(ClipError, match="it holds rotations of segments and no markers"):
        read_clip(path)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("walk.XLSX", "a spreadsheet"),
        ("walk.bvh", "it holds a skeleton, no markers"),
        ("walk.fbx", "it holds a skeleton, no markers"),
        ("walk.c3d.zip", "a packed file"),
    ],
)
def test_other_files_are_told_what_to_do_instead(tmp_path, name, says):
    path = tmp_path / name
    path.write_text("HIERARCHY\n")
    with pytest.raises(CallError, match=f"{name}: {says}") as error:
        read_clip(path)
    assert error.value.hint


def test_standard_input_is_no_clip(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(CallError, match=r"^-: a clip is not read from standard input"):
        read_clip("-")


# --- What would take all memory -----------------------------------------------------------------


@pytest.mark.parametrize(("used", "rate"), [(0, 1e9), (0, 3e38), (24, 1e9)])
def test_analog_samples_for_which_there_are_no_bytes_are_nobodys_memory(path, used, rate):
    """ezc3d takes 100 bytes for each: 12 GB for a file of 0.6 MB."""
    c3d_file(path, FORTY, analogs=24)
    given = {"SCALE": np.ones(24), "OFFSET": np.zeros(24, int), "GEN_SCALE": 1.0}
    more = {f"ANALOG__{name}": value for name, value in given.items()}
    c3d_file(
        path, FORTY, analogs=used, **{**more, "ANALOG__USED": used, "ANALOG__RATE": float(rate)}
    )
    tracemalloc.start()
    is_right(path, FORTY)
    assert tracemalloc.get_traced_memory()[1] < 20 * FORTY.nbytes
    tracemalloc.stop()

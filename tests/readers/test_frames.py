"""Numbers and counts of frames, which a C3D header has only 16 bits for; files that are cut off."""

from __future__ import annotations

import numpy as np
import pytest
from c3d_bytes import BLOCK, c3d_file, cloud, signed, words
from references import by_ezc3d, by_us, read_alike

from mocap_skel import artificial as art
from mocap_skel.errors import ClipError
from mocap_skel.readers import read_clip
from mocap_skel.readers.formats.c3d import frames


@pytest.mark.parametrize("first", [1, 187, 40000, 65000])
def test_first_frame_of_the_header(path, first):
    clip = read_clip(c3d_file(path, cloud(), first=first))
    assert (clip.first_frame, clip.notes) == (first, ())
    assert read_clip(c3d_file(path, cloud(), first=0, last=19)).first_frame == 1


@pytest.mark.parametrize("reader", [by_ezc3d, by_us])
@pytest.mark.parametrize("clamped", [False, True])
def test_first_frame_past_16_bits(path, reader, clamped):
    first = 70000
    c3d_file(
        path,
        cloud(),
        first=0xFFFF if clamped else first,
        last=0xFFFF if clamped else (first + 19) & 0xFFFF,
        TRIAL__ACTUAL_START_FIELD=words(first),
        TRIAL__ACTUAL_END_FIELD=words(first + 19),
    )
    raw = reader(path)
    assert (raw.first_frame, len(raw.points)) == (first, 20)
    assert read_clip(path).notes == ()


@pytest.mark.parametrize("reader", [by_ezc3d, by_us])
def test_a_cut_clip_that_keeps_the_numbers_of_its_take(path, reader):
    c3d_file(
        path,
        cloud(),
        first=300,
        TRIAL__ACTUAL_START_FIELD=words(1),
        TRIAL__ACTUAL_END_FIELD=words(90000),
        LONG_FRAMES=90000.0,
    )
    raw = reader(path)
    assert (raw.first_frame, len(raw.points)) == (300, 20)
    assert read_clip(path).notes == ()


@pytest.mark.parametrize("reader", [by_ezc3d, by_us])
def test_a_cut_clip_that_keeps_the_32_bit_start_of_its_take(path, reader):
    """It does not go with the header's number as far as that goes: 90,000 is 24,464 there."""
    c3d_file(path, cloud(), first=300, TRIAL__ACTUAL_START_FIELD=words(90000))
    assert (reader(path).first_frame, read_clip(path).first_frame) == (300, 300)
    c3d_file(path, cloud(), first=24464, TRIAL__ACTUAL_START_FIELD=words(90000))
    assert (reader(path).first_frame, read_clip(path).first_frame) == (90000, 90000)


def test_a_file_that_is_cut_off_past_16_bits_keeps_its_numbers(path):
    c3d_file(
        path,
        cloud(500),
        first=70000,
        last=(70000 + 499) & 0xFFFF,
        TRIAL__ACTUAL_START_FIELD=words(70000),
        TRIAL__ACTUAL_END_FIELD=words(70000 + 499),
    )
    path.write_bytes(path.read_bytes()[: -BLOCK * 10])
    with pytest.raises(ClipError, match="it says 500 frames and ends after 394 whole ones"):
        read_clip(path)
    # 48 bytes a frame: of 47 blocks 37 are left.
    clip = read_clip(path, salvage=True)
    assert list(clip.frame_numbers[[0, -1]]) == [70000, 70393]
    np.testing.assert_allclose(clip.points, cloud(500)[: clip.frames] / 1000, rtol=1e-6)


@pytest.mark.parametrize(
    ("claims", "first", "long", "room", "found"),
    [
        # A longer count is believed where 16 bits cannot number its last frame, and there is room for it.
        ([20], 65507, 30, 30, 30),
        ([20], 65506, 30, 30, 20),
        ([20], 65507, 30, 29, 20),
        # The most that 16 bits can say is "as many or more": the size of the file tells.
        ([0xFFFF], 1, 0, 70000, 70000),
        ([0xFFFF], 1, 0, 100, 0xFFFF),
        ([0xFFFF, 0xFFFF], 1, 0, 70000, 70000),
        ([0xFFFF, 50], 1, 0, 100, 50),
        # Of two counts the first for which there is room; without any, the smaller one: the file is cut.
        ([60, 31], 1, 0, 70, 60),
        ([60, 31], 1, 0, 40, 31),
        ([60, 31], 1, 0, 10, 31),
        ([], 1, 0, 10, 10),
    ],
)
def test_the_number_of_frames_of_counts_that_differ(claims, first, long, room, found):
    groups = {"POINT": {"LONG_FRAMES": float(long)}}
    assert frames.frame_count(claims, first, groups, room, lambda n: False) == found
    # An end without a start counts nothing.
    groups["TRIAL"] = {"ACTUAL_END_FIELD": words(room)}
    assert frames.frame_count(claims, first, groups, room, lambda n: False) == found
    # One that ends where the file ends settles it.
    if len(claims) == 2 and min(claims) > 1:
        assert (
            frames.frame_count(claims, first, groups, room, lambda n: n == claims[1]) == claims[1]
        )


@pytest.mark.parametrize(
    ("groups", "first", "found"),
    [
        ({"ACTUAL_START_FIELD": [-5536, 0]}, 60000, 60000),
        ({"ACTUAL_START_FIELD": [4464, 1]}, 4464, 70000),
        ({"ACTUAL_START_FIELD": [4464.0, 1.0]}, 4464, 70000),
        ({"ACTUAL_START_FIELD": 70000.0}, 4464, 70000),
        ({"ACTUAL_START_FIELD": [np.nan, np.inf]}, 7, 7),
        ({"ACTUAL_START_FIELD": ["7", "0"]}, 7, 7),
        ({}, 7, 7),
    ],
)
def test_the_ways_to_write_a_long_number(groups, first, found):
    assert frames.first_frame(first, {"POINT": {}, "TRIAL": groups}) == found


LONG = 70000


@pytest.mark.parametrize(
    "more",
    [
        {f"TRIAL__ACTUAL_{at}_FIELD": words(n) for at, n in (("START", 1), ("END", LONG))},
        {"LONG_FRAMES": float(LONG)},
        {"FRAMES": float(LONG)},
        {"FRAMES": signed(LONG), "LONG_FRAMES": float(LONG), "last": LONG & 0xFFFF},
        {"FRAMES": -1},
    ],
    ids=["trial", "long", "float", "wrapped", "size"],
)
def test_more_than_65535_frames(path, more):
    points = cloud(count=LONG)
    clip = read_clip(c3d_file(path, points, **({"FRAMES": signed(0xFFFF)} | more)))
    assert clip.points.shape == (LONG, 3, 3)
    np.testing.assert_allclose(clip.points, points / 1000, rtol=1e-6)
    assert clip.notes == ()


def test_exactly_65535_frames_are_no_more(path):
    clip = read_clip(c3d_file(path, cloud(count=0xFFFF, markers=1)))
    assert (len(clip.points), clip.notes) == (0xFFFF, ())


def recording(count, first):
    points = cloud(count) / 1000
    return art.Recording(points, ("A", "B", "C"), 100.0, first, points, {}, {}, {})


def test_artificial_clips_past_frame_65535(path):
    art.write_c3d(recording(10000, 60000), path)
    clip = read_clip(path)
    assert (len(clip.points), clip.first_frame, clip.notes) == (10000, 60000, ())
    read_alike(path)
    # A group ROTATION, which ezc3d writes, makes ezc3d stop at 65535 frames.
    art.write_c3d(recording(LONG, 1), path)
    clip = read_clip(path)
    assert clip.points.shape == (LONG, 3, 3)
    np.testing.assert_allclose(clip.points, cloud(LONG) / 1000, atol=1e-6)
    assert clip.notes == ()


def test_frames_of_missing_points_at_the_end(path):
    residuals = np.zeros((20, 3))
    residuals[-5:] = -1
    points = cloud()
    points[-5:] = 0
    clip = read_clip(c3d_file(path, points, residuals=residuals))
    assert (len(clip.points), clip.missing()[0]) == (20, 0.25)


def test_padding_is_no_frame(path):
    clip = read_clip(c3d_file(path, cloud(count=100, markers=1), FRAMES=-1))
    assert (len(clip.points), clip.notes) == (100, ())
    read_alike(path)


def test_a_file_that_is_cut_off_is_named_and_salvaged_on_demand(path):
    c3d_file(path, cloud(count=500))
    whole = path.read_bytes()
    # 48 bytes a frame; the last block holds 448 bytes of it.
    start = len(whole) - BLOCK * 47
    for left, rest in ((290, 0), (290, 47), (499, 32), (1, 3)):
        path.write_bytes(whole[: start + 48 * left + rest])
        says = f"cut off: it says 500 frames and ends after {left} whole ones"
        with pytest.raises(ClipError, match=rf"clip\.c3d: {says}") as error:
            read_clip(path)
        assert error.value.hint == "--salvage reads those"
        clip = read_clip(path, salvage=True)
        np.testing.assert_allclose(clip.points, cloud(count=500)[:left] / 1000, rtol=1e-6)
        assert clip.notes == (f"{says}, which are read; read with py-c3d",)
    path.write_bytes(whole[: start + 20])
    with pytest.raises(ClipError, match="ends after 0 whole ones") as error:
        read_clip(path, salvage=True)
    assert error.value.hint is None


def test_a_missing_pad_or_missing_analogs_at_the_end_cost_no_frame(path):
    c3d_file(path, cloud(), analogs=5)
    whole = path.read_bytes()
    data = 20 * (12 + 5) * 4
    start = len(whole) - -(-data // BLOCK) * BLOCK
    for less in (0, 20):
        path.write_bytes(whole[: start + data - less])
        clip = read_clip(path)
        np.testing.assert_allclose(clip.points, cloud() / 1000, rtol=1e-6)
    path.write_bytes(whole[: start + data - 21])
    with pytest.raises(ClipError, match="20 frames and ends after 19 whole"):
        read_clip(path)

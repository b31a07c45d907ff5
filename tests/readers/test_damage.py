"""Damage that no counter tells: lost bytes, tails of zeros, coordinates that cannot be."""

from __future__ import annotations

import numpy as np
import pytest
from c3d_bytes import (
    BLOCK,
    c3d_file,
    is_right,
    notes,
    tracks,
)
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mocap_skel import artificial as art
from mocap_skel.errors import ClipError
from mocap_skel.readers import read_clip
from mocap_skel.readers.formats.c3d import shifts
from mocap_skel.readers.formats.c3d.survey import survey


def test_coordinates_that_are_nowhere(path):
    points = tracks()
    points[5, 1], points[7:9, 2, 0] = 1e20, -3e7
    clip = read_clip(c3d_file(path, points))
    assert np.isnan(clip.points[..., 0]).sum() == 3
    assert "samples farther off than 1e+07 that count as missing: 3" in notes(clip)
    # One number for everything that was not seen.
    points = tracks()
    points[:50, 1] = 9.9e18
    clip = read_clip(c3d_file(path, points))
    assert clip.missing()[1] == pytest.approx(50 / 60)
    points[:50, 1] *= np.linspace(1, 2, 150).reshape(50, 3)
    with pytest.raises(ClipError, match=r"clip\.c3d: damaged: coordinates such as .*e\+19 in it"):
        read_clip(c3d_file(path, points))


# What a clip says of eight markers in ten frames at (0, 0, 0).
NO_PLACE = ("samples at exactly (0, 0, 0) that count as missing: 80",)


def spans(path, data, at, message, before):
    """The file is refused as damaged, and --salvage reads the frames before."""
    path.write_bytes(data)
    with pytest.raises(ClipError, match=message) as error:
        read_clip(path)
    assert "--salvage reads" in error.value.hint
    clip = read_clip(path, salvage=True)
    assert before - 3 <= clip.frames <= before
    np.testing.assert_allclose(clip.points * 1000, tracks(200, 8)[: clip.frames], atol=0.06)
    assert "are read" in notes(clip)


@pytest.mark.parametrize(("scale", "analogs"), [(-1.0, 0), (-1.0, 5), (0.1, 0), (0.1, 5)])
@pytest.mark.parametrize("count", [4, 7, 16, 18, 52])
@pytest.mark.parametrize("way", ["lost", "inserted"])
def test_bytes_lost_or_inserted_among_the_points(path, scale, analogs, count, way):
    data = c3d_file(path, tracks(200, 8), scale=scale, analogs=analogs).read_bytes()
    found = survey(path)
    at = found.layout.start + 90 * found.layout.stride + 37
    if way == "lost":
        data = data[:at] + data[at + count :] + bytes(count)
    else:
        data = data[:at] + bytes(count) + data[at:-count]
    spans(path, data, at, r"clip\.c3d: damaged: bytes are lost or inserted at frame \d\d", 91)


def test_points_that_jump_all_at_once_are_no_lost_bytes(path):
    """Two takes in one, a figure that turns about at once, labels that are exchanged in pairs."""
    points = tracks(200, 8)
    for other in (points[100:] + 3000, -points[100:], points[100:, [1, 0, 3, 2, 5, 4, 7, 6]]):
        joined = np.concatenate([points[:100], other])
        assert is_right(c3d_file(path, joined), joined).notes == ()
    rng = np.random.default_rng(4)
    noise = rng.normal(0, 900, (200, 8, 3))
    assert is_right(c3d_file(path, noise), noise).notes == ()


@pytest.mark.parametrize(("scale", "zeros"), [(-1.0, 0), (0.1, 0), (-1.0, BLOCK)])
def test_a_tail_of_zeros_is_one_of_a_file_that_is_cut_off(path, scale, zeros):
    """Also where zeros stand before the header."""
    data = c3d_file(path, tracks(200, 8), scale=scale).read_bytes()
    found = survey(path)
    at = found.layout.start + 90 * found.layout.stride + 21
    cut = bytes(zeros) + data[:at] + bytes(len(data) - at)
    spans(path, cut, at, "nothing but zeros from frame 92 on, as in a file", 91)


def test_ten_blank_frames_at_the_end_are_nobodys_loss_and_eleven_are(path):
    data = c3d_file(path, tracks(200, 8), first=1001).read_bytes()
    layout = survey(path).layout
    for blank in (10, 11):
        at = layout.start + (200 - blank) * layout.stride
        path.write_bytes(data[:at] + bytes(len(data) - at))
        if blank == 10:
            assert (read_clip(path).frames, read_clip(path).notes) == (200, NO_PLACE)
    with pytest.raises(ClipError, match="nothing but zeros from frame 1190 on"):
        read_clip(path)


def test_where_all_is_blank_but_the_first_frame_nothing_is_left(path):
    data = c3d_file(path, tracks(200, 8)).read_bytes()
    layout = survey(path).layout
    at = layout.start + layout.stride
    path.write_bytes(data[:at] + bytes(len(data) - at))
    with pytest.raises(ClipError, match="nothing but zeros from frame 2 on") as error:
        read_clip(path, salvage=True)
    assert error.value.hint is None


def test_the_frame_at_which_bytes_are_lost_has_the_files_own_number(path):
    data = c3d_file(path, tracks(200, 8), first=1001).read_bytes()
    layout = survey(path).layout
    at = layout.start + 90 * layout.stride + 37
    path.write_bytes(data[:at] + data[at + 16 :] + bytes(16))
    with pytest.raises(ClipError, match=r"bytes are lost or inserted at frame 109[0-2], from"):
        read_clip(path)


def test_a_file_whose_way_of_saying_missing_is_zeros(path):
    points = tracks(200, 8)
    points[30:60, 2] = points[90:] = 0
    c3d_file(path, points)
    clip = read_clip(path)
    assert clip.frames == 200
    assert "nothing but zeros from frame 91 on: is the file cut off there?" in notes(clip)
    # Analog channels that stop with the points tell.
    data = c3d_file(path, points + 0.0, analogs=4).read_bytes()
    found = survey(path)
    frames = np.frombuffer(data, "<f4", 200 * 36, found.layout.start).reshape(200, 36).copy()
    frames[:90, 32:] = 0.5
    frames[90:] = 0
    start = found.layout.start
    path.write_bytes(data[:start] + frames.tobytes() + data[start + frames.nbytes :])
    with pytest.raises(ClipError, match="as in a file that is cut off"):
        read_clip(path)


def test_noise_among_the_points_is_damage(path):
    data = bytearray(c3d_file(path, tracks(200, 8)).read_bytes())
    found = survey(path)
    at = found.layout.start + 90 * found.layout.stride + 21
    data[at : at + 600] = np.random.default_rng(5).bytes(600)
    path.write_bytes(data)
    with pytest.raises(
        ClipError, match=r"damaged: coordinates such as .* frames from \d\d"
    ) as error:
        read_clip(path)
    assert error.value.hint == "--salvage reads the other frames"
    clip = read_clip(path, salvage=True)
    assert "where every marker counts as missing" in notes(clip)
    lost = np.isnan(clip.points).all(axis=(1, 2))
    assert lost[90:95].all() and lost.sum() <= 11
    np.testing.assert_allclose(clip.points[~lost] * 1000, tracks(200, 8)[~lost], atol=1e-3)


def test_followers_are_counted_where_enough_values_are_there():
    before = np.arange(1.0, 25.0)
    there = np.array(
        [before, before + 0.4, before + np.arange(24), np.where(before < 14, before, 0)]
    )
    # By hand: all; all; 0 only of the differences 0 to 23; those 13 that are no zeros.
    assert shifts._followers(there, before, 0.5).tolist() == [1, 1, 1 / 24, 1]
    # Of 24 values 11 are too few.
    assert shifts._followers(np.where(before < 12, before, 0)[None], before, 0.5).tolist() == [0]


FEW = tracks(30, 6)


@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    # Behind the 27th stand two whole frames, too few to tell.
    frame=st.integers(1, 26),
    within=st.integers(0, 47),
    count=st.sampled_from([1, 2, 3, 4, 6, 8, 12, 20]),
    lost=st.booleans(),
    kept=st.booleans(),
)
def test_bytes_lost_or_inserted_in_a_small_file_of_integers(path, frame, within, count, lost, kept):
    """Two bytes at frame 5 would misread 99 % of the samples behind; whether the size stays or not."""
    sound = c3d_file(path, FEW, scale=0.1).read_bytes()
    at = survey(path).layout.start + 48 * frame + within
    whole = sound[:at] + (sound[at + count :] if lost else bytes(count) + sound[at:])
    path.write_bytes((whole + bytes(count if lost else 0))[: len(sound)] if kept else whole)
    with pytest.raises(ClipError, match=r"cut off|damaged: (bytes|coord)|nothing but zeros"):
        read_clip(path)


@pytest.mark.parametrize("scale", [-1.0, 0.1])
def test_points_that_begin_at_another_place_than_they_should(path, scale):
    """What follows is a file without any jump: the residuals tell, which stand where coordinates should."""
    points = tracks(200, 8)
    sound = c3d_file(path, points, scale=scale).read_bytes()
    start = survey(path).layout.start
    path.write_bytes(
        (sound[:start] + sound[start + (4 if scale < 0 else 2) :]).ljust(len(sound), b"\0")
    )
    with pytest.raises(
        ClipError, match="damaged: bytes are lost or inserted before its second frame"
    ):
        read_clip(path)


@pytest.mark.parametrize("dropout", [0.1, 0.4])
@pytest.mark.parametrize("every", [1, 3, 7])
def test_fast_movement_with_many_gaps_is_no_lost_bytes(path, every, dropout):
    motion = art.range_of_motion(8, 60, seed=1)
    clip = art.record(
        art.human(), art.marker_set("cmu"), motion, art.Faults(sigma=0.001, dropout=dropout), seed=2
    )
    points = np.nan_to_num(clip.points * 1000)
    for some in (points[::every], points[::every, :12]):
        assert "damaged" not in notes(read_clip(c3d_file(path, some, scale=0.1)))

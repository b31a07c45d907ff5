"""What a file means: units, missing samples, rate, vertical axis, each written byte by byte."""

from __future__ import annotations

import numpy as np
import pytest
from c3d_bytes import c3d_file, cloud, notes
from references import read_alike

from mocap_skel import artificial as art
from mocap_skel.errors import CallError, ClipError
from mocap_skel.readers import read_clip, units
from mocap_skel.readers.clean import clean
from mocap_skel.readers.raw import RawClip

# --- Plain files --------------------------------------------------------------------------------


def test_a_plain_file_has_no_notes(path):
    points = cloud()
    clip = read_clip(c3d_file(path, points, first=41, TRIAL__NAME="walk"))
    np.testing.assert_allclose(clip.points, points / 1000, rtol=1e-6)
    assert clip.points.dtype == np.float64
    assert clip.labels == ("M1", "M2", "M3")
    assert clip.subjects == ("", "", "")
    assert (clip.rate, clip.first_frame, clip.unit, clip.up) == (100.0, 41, "mm", "z")
    assert (clip.left_out, clip.notes, clip.name) == ({}, (), str(path))
    assert list(clip.frame_numbers[[0, -1]]) == [41, 60]


def test_an_artificial_clip_comes_back(path):
    faults = art.Faults(sigma=0.001, dropout=0.2)
    clip = art.record(art.human(), art.marker_set("cmu"), art.walk(2, 100), faults, seed=3)
    art.write_c3d(clip, path, unit="cm")
    found = read_clip(str(path))
    # float32 in centimetres, some metres from the origin
    np.testing.assert_allclose(found.points, clip.points, atol=1e-6)
    assert found.labels == clip.labels
    assert found.unit == "cm"
    assert found.missing().mean() == pytest.approx(0.2, abs=0.03)


# --- Units --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("said", "metres"),
    [
        *[("mm", 1e-3), ("MM", 1e-3), ("[mm]", 1e-3), (" mm ", 1e-3), ("Millimeters", 1e-3)],
        *[("millimetres", 1e-3), ("mill", 1e-3), ("cm", 1e-2), ("centimeter", 1e-2)],
        *[("cent", 1e-2), ("dm", 0.1), ("decimetre", 0.1), ("deci", 0.1), ("m", 1.0), ("M", 1.0)],
        *[("mete", 1.0), ("meters", 1.0), ("metre", 1.0), ("in", 0.0254), ("inches", 0.0254)],
        *[("ft", 0.3048), ("feet", 0.3048), ("foot", 0.3048)],
        *[("", None), ("mic", None), ("micrometer", None), ("money", None), ("invalid", None)],
        *[("m/s", None), ("deg", None), ("mi", None), ("met", None), ("42", None)],
    ],
)
def test_unit_names(said, metres):
    assert units.metres_in(said) == metres


@pytest.mark.parametrize(("unit", "metres"), [("mm", 1e-3), ("cm", 1e-2), ("dm", 0.1), ("m", 1.0)])
def test_every_unit_means_the_same_metres(path, unit, metres):
    clip = read_clip(c3d_file(path, cloud() * 1e-3 / metres, UNITS=unit))
    np.testing.assert_allclose(clip.points, cloud() / 1000, rtol=1e-6)
    assert (clip.unit, clip.notes) == (unit, ())


def test_a_unit_that_is_cut_short(path):
    clip = read_clip(c3d_file(path, cloud() / 1000, UNITS="mete"))
    assert (clip.unit, clip.notes) == ("m", ())


@pytest.mark.parametrize(("unit", "per_metre"), [("mm", 1000), ("cm", 100), ("m", 1)])
@pytest.mark.parametrize("said", ["  ", "furlongs", None, 3.0, ["", "mm"]])
def test_without_a_known_unit_the_size_decides(path, unit, per_metre, said):
    clip = read_clip(c3d_file(path, cloud(markers=8) / 1000 * per_metre, UNITS=said))
    assert clip.unit == unit
    np.testing.assert_allclose(clip.points, cloud(markers=8) / 1000, rtol=1e-6)
    assert f"{unit} by the size" in notes(clip)
    assert "--unit" in notes(clip)
    assert ("'furlongs' is unknown" if said == "furlongs" else "no unit") in notes(clip)


def test_one_marker_without_unit_is_taken_as_mm_and_said_so(path):
    clip = read_clip(c3d_file(path, cloud(markers=1), UNITS=None))
    assert clip.unit == "mm"
    assert "no size to tell it by: taken as mm" in notes(clip)


def test_the_unit_asked_for_wins(path):
    c3d_file(path, cloud(), UNITS="m")
    clip = read_clip(path, unit="Millimetres")
    np.testing.assert_allclose(clip.points, cloud() / 1000, rtol=1e-6)
    assert (clip.unit, clip.notes) == ("mm", ())
    with pytest.raises(CallError, match="'parsecs' is no length unit") as error:
        read_clip(path, unit="parsecs")
    assert "mm" in error.value.hint


def cleaned(points, salvage=False, unit="mm", **raw):
    """Points (frames, markers, 3) as a clip, without any file."""
    points = np.array(points, dtype=float)
    labels = tuple(f"M{i}" for i in range(points.shape[1]))
    return clean(RawClip(points, labels, 100.0, unit, **raw), "clip", None, None, salvage)


def apart(*lengths):
    """Two markers that are so far apart in each frame."""
    return [[[5, 5, 5], [5 + length, 5, 5]] for length in lengths]


@pytest.mark.parametrize(
    ("span", "noted"), [(0.019, True), (0.021, False), (99, False), (101, True)]
)
def test_a_size_that_cannot_be_is_noted(span, noted):
    """From two markers of a finger to a football field."""
    clip = cleaned(apart(span), unit="m")
    said = f"the markers span {span:g} m if the unit is 'm' as the file says; if that cannot be, "
    assert clip.notes == ((f"{said}give another --unit",) if noted else ())
    assert clip.unit == "m"


def test_a_size_is_that_of_the_frame_in_the_middle():
    """Neither frames in which a marker has gone astray nor those in which two are one decide the unit."""
    clip = cleaned(apart(1, 2, 1800, 1801, 1802, 9e5, 9e5), unit="")
    assert clip.notes == (
        "no unit in the file: mm by the size of the figure, 1.80 m; if that cannot be, give --unit",
    )


# --- Missing samples ----------------------------------------------------------------------------


def test_missing_by_residual_zeros_and_no_number(path):
    points, residuals = cloud(), np.zeros((20, 3))
    residuals[0, 0], residuals[1, 0] = -1, -0.25
    points[2, 1] = 0
    points[3, 1] = -0.0
    points[4, 2, 1] = np.nan
    points[5, 2, 0] = np.inf
    points[6, 2] = [0, 1, 0]
    points[7, 0], residuals[7, 0] = 0, -1
    c3d_file(path, points, residuals=residuals)
    clip = read_clip(path)
    gone = np.zeros((20, 3), bool)
    gone[[0, 1, 7, 2, 3, 4, 5], [0, 0, 0, 1, 1, 2, 2]] = True
    np.testing.assert_array_equal(np.isnan(clip.points), np.repeat(gone[..., None], 3, axis=2))
    # Those that the residual marks as well are no surprise.
    assert "samples at exactly (0, 0, 0) that count as missing: 2" in notes(clip)
    read_alike(path)


def test_a_marker_that_is_never_seen_stays_as_a_column(path):
    points = cloud()
    points[:, 1] = 0
    clip = read_clip(c3d_file(path, points))
    assert list(clip.missing()) == [0, 1, 0]


def test_what_a_residual_marks_is_missing_wherever_the_file_puts_it(path):
    residuals = np.zeros((20, 3))
    residuals[4, 1] = -1
    c3d_file(path, cloud(), residuals=residuals)
    assert np.argwhere(np.isnan(read_clip(path).points[..., 0])).tolist() == [[4, 1]]


@pytest.mark.parametrize("axis", range(3))
def test_a_place_is_judged_by_all_three_coordinates(axis):
    points = cloud()
    points[3, 1] = 0
    points[3, 1, axis] = -5
    points[4, 2, axis] = -2e7
    clip = cleaned(points)
    assert np.argwhere(np.isnan(clip.points).any(axis=2)).tolist() == [[4, 2]]
    assert clip.notes == ("samples farther off than 1e+07 that count as missing: 1",)


def test_two_samples_that_are_nowhere_are_an_oddity_whatever_they_say():
    points = cloud()
    points[5, 1], points[12, 0] = (1e9, -4e9, 2e9), (3e9, 5e9, 6e9)
    clip = cleaned(points)
    assert np.argwhere(np.isnan(clip.points[..., 0])).tolist() == [[5, 1], [12, 0]]
    assert clip.notes == ("samples farther off than 1e+07 that count as missing: 2",)


def test_damage_takes_two_frames_on_either_side_with_it():
    points = cloud()
    points[10, :, 0] = 1e9, -4e9, 2e9
    with pytest.raises(ClipError) as error:
        cleaned(points, first_frame=101)
    said = "damaged: coordinates such as -4e+09 in it, 5 frames from 109 to 113"
    assert (error.value.message, error.value.hint) == (said, "--salvage reads the other frames")
    clip = cleaned(points, salvage=True, first_frame=101)
    lost = np.isnan(clip.points).all(axis=(1, 2))
    assert np.flatnonzero(lost).tolist() == [8, 9, 10, 11, 12]
    np.testing.assert_allclose(clip.points[~lost], cloud()[~lost] / 1000, rtol=1e-15)
    assert clip.notes == (f"{said}, where every marker counts as missing",)
    # Where it is everywhere, nothing is left to be read.
    with pytest.raises(ClipError, match="damaged") as error:
        cleaned(points[8:13], salvage=True)
    assert error.value.hint is None


@pytest.mark.parametrize("value", [0.0, np.nan])
def test_all_missing_is_an_error(path, value):
    with pytest.raises(ClipError, match=r"clip\.c3d: every marker is missing in every frame"):
        read_clip(c3d_file(path, np.full((5, 2, 3), value)))


# --- Rate and vertical axis ----------------------------------------------------------------------


@pytest.mark.parametrize("rate", [0.0, -100.0])
def test_no_frame_rate_is_an_error_that_names_the_option(path, rate):
    c3d_file(path, cloud(), rate=rate)
    with pytest.raises(CallError, match=r"clip\.c3d: no frame rate") as error:
        read_clip(path)
    assert "--rate" in error.value.hint
    assert read_clip(path, rate=59.94).rate == 59.94


def test_the_rate_of_the_header_and_the_rate_asked_for(path):
    assert read_clip(c3d_file(path, cloud(), rate=120.0, RATE=0.0)).rate == 120.0
    assert read_clip(c3d_file(path, cloud(), rate=120.0, RATE=None)).rate == 120.0
    assert read_clip(path, rate=60).rate == 60.0
    clip = read_clip(c3d_file(path, cloud(), rate=120.0, RATE=100.0))
    assert clip.rate == 100.0
    assert clip.notes == ("POINT:RATE is 100 Hz, the header's 120; the first is taken",)


@pytest.mark.parametrize("rate", [0, -1, np.nan, np.inf, 0.0099, 100001])
def test_a_rate_that_is_none(path, rate):
    assert read_clip(c3d_file(path, cloud()), rate=0.01).rate == 0.01
    assert read_clip(path, rate=1e5).rate == 1e5
    with pytest.raises(CallError, match=r"a frame rate is a number from 0\.01"):
        read_clip(c3d_file(path, cloud()), rate=rate)


@pytest.mark.parametrize(
    ("said", "up", "noted"),
    [
        *[(None, "z", False), ("+Z", "z", False), ("+Y", "y", False), ("+X", "x", False)],
        *[("+y", "y", False), ("Y", "y", False), ("-Z", "z", True), ("-Y", "y", True)],
        *[("up", "z", True), (1.0, "z", False)],
    ],
)
def test_up_axis(path, said, up, noted):
    clip = read_clip(c3d_file(path, cloud(), Y_SCREEN=said))
    assert clip.up == up
    assert ("Y_SCREEN" in notes(clip)) == noted

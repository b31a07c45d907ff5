"""The door for C3D files: every rule of what a file means, on files written byte by byte."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest
from c3d_bytes import (
    BLOCK,
    MACHINES,
    c3d_file,
    cloud,
    notes,
    same,
    signed,
)
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from recordings import CLIPS

from mocap_skel import artificial as art
from mocap_skel import readers
from mocap_skel.errors import CallError, ClipError
from mocap_skel.readers import read_clip, units
from mocap_skel.readers.c3d import frames, with_c3d, with_ezc3d


@pytest.fixture
def path(tmp_path):
    return tmp_path / "clip.c3d"


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


@pytest.mark.parametrize("factor", [1, 1e-6])
def test_a_size_that_cannot_be_is_noted(path, factor):
    clip = read_clip(c3d_file(path, cloud() * factor, UNITS="m"))
    assert clip.unit == "m"
    assert "if the unit is 'm' as the file says" in notes(clip)


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
    same(with_ezc3d.read(path), with_c3d.read(path))


def test_a_marker_that_is_never_seen_stays_as_a_column(path):
    points = cloud()
    points[:, 1] = 0
    clip = read_clip(c3d_file(path, points))
    assert list(clip.missing()) == [0, 1, 0]


@pytest.mark.parametrize("value", [0.0, np.nan])
def test_all_missing_is_an_error(path, value):
    with pytest.raises(ClipError, match=r"clip\.c3d: every marker is missing in every frame"):
        read_clip(c3d_file(path, np.full((5, 2, 3), value)))


# --- Labels, subjects ---------------------------------------------------------------------------


def labelled(path, *labels, **more):
    points = cloud(markers=len(labels))
    return read_clip(c3d_file(path, points, LABELS=list(labels), **more))


def test_labels_are_trimmed(path):
    assert labelled(path, "  LFHD ", "RFHD", "C7 \0\0").labels == ("LFHD", "RFHD", "C7")


def test_doubles_are_told_apart_without_taking_a_name_that_is_there(path):
    clip = labelled(path, "A", "A", "A_2", "B", "A", "B")
    assert clip.labels == ("A", "A_3", "A_2", "B", "A_4", "B_2")
    assert "more than once" in notes(clip)
    assert "A, B" in notes(clip)


def test_the_same_label_of_two_subjects_is_no_double(path):
    clip = labelled(path, "Ann:LFHD", "Bob:LFHD", "LFHD")
    assert (clip.labels, clip.notes) == (("LFHD",) * 3, ())
    assert clip.subject_names == ("Ann", "Bob", "")


def test_blanks_are_called_by_their_place(path):
    clip = labelled(path, "*1", "", "point_4", "", "Ann:")
    assert clip.labels == ("point_2", "point_4", "point_4_2", "point_5")
    assert clip.subjects == ("", "", "", "Ann")
    assert "points without a label: 3" in notes(clip)


def test_a_double_cannot_take_the_name_of_a_blank_or_the_other_way_round(path):
    labels = labelled(path, "point", "", "point", "point").labels
    assert labels[0] == "point"
    assert len(set(labels)) == 4


def test_many_doubles_take_no_time(path):
    points = np.full((1, 4000, 3), 5.0) + np.arange(4000)[:, None]
    more = {f"LABELS{i}": ["A"] * 255 for i in range(2, 17)}
    clip = read_clip(c3d_file(path, points, LABELS=["A"] * 255, **more))
    assert len(set(clip.labels)) == 4000


@pytest.mark.parametrize(
    ("text", "subject", "label"),
    [
        ("Ann:LFHD", "Ann", "LFHD"),
        (" Ann Lee : L FHD ", "Ann Lee", "L FHD"),
        ("A:B:LFHD", "A:B", "LFHD"),
        (":LFHD", "", "LFHD"),
        ("Zoë:Schädel", "Zoë", "Schädel"),
        ("An\x1b[1mn:L\x07", "An?[1mn", "L?"),
    ],
)
def test_prefixes(path, text, subject, label):
    clip = labelled(path, text, "C7")
    assert (clip.subjects[0], clip.labels[0]) == (subject, label)


def test_labels_in_latin_1_can_be_printed(path):
    c3d_file(path, cloud(markers=1), LABELS="Schädel".encode("latin-1"))
    assert read_clip(path).labels == ("Schädel",)
    same(with_ezc3d.read(path), with_c3d.read(path))


def test_more_points_than_labels_and_more_labels_than_points(path):
    c3d_file(path, cloud(), LABELS=["A", "B"])
    assert read_clip(path).labels == ("A", "B", "point_3")
    c3d_file(path, cloud(), LABELS=["A", "B", "C", "A", "B"])
    clip = read_clip(path)
    assert (clip.labels, clip.notes) == (("A", "B", "C"), ())


def test_labels_as_one_text_and_no_labels(path):
    assert read_clip(c3d_file(path, cloud(markers=1), LABELS="LFHD")).labels == ("LFHD",)
    clip = read_clip(c3d_file(path, cloud(), LABELS=None))
    assert clip.labels == ("point_1", "point_2", "point_3")


def test_parameter_names_in_small_letters(path):
    clip = read_clip(c3d_file(path, cloud(), LABELS=None, Labels=["A", "B", "C"]))
    assert clip.labels == ("A", "B", "C")


def test_more_than_255_labels(path):
    names = [f"P{i}" for i in range(600)]
    figure = art.human()
    at = {name: ("Head", (0.001 * i, 0.0, 0.1)) for i, name in enumerate(names)}
    art.write_c3d(art.record(figure, at, art.still(0.1, 100)), path)
    clip = read_clip(path)
    assert clip.labels == tuple(names)
    same(with_ezc3d.read(path), with_c3d.read(path))


# --- What is no marker --------------------------------------------------------------------------


def test_unlabelled_points_are_left_out_even_twice(path):
    clip = labelled(path, "*12", "A", "Ann:*3", "*12", "*", "B*1")
    assert clip.labels == ("A", "*", "B*1")
    assert clip.left_out == {"unlabelled": ("*12", "*3", "*12")}
    assert "unlabelled): 3: *12, *3, *12" in notes(clip)


@pytest.mark.parametrize(
    "group", ["ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "MODELED_MARKERS", "REACTIONS"]
)
def test_model_outputs_by_list(path, group):
    clip = labelled(path, "A", "XYZ", "B", "XYZ", **{group: ["XYZ", "ABC"]})
    assert clip.labels == ("A", "B")
    assert clip.left_out == {"model output": ("XYZ", "XYZ")}


def test_model_outputs_listed_with_and_without_prefix(path):
    lists = {"ANGLES": ["Ann:P1", "Q1"], "ANGLES2": ["Z1"]}
    clip = labelled(path, "Ann:P1", "Bob:P1", "Ann:Q1", "Bob:Z1", **lists)
    assert clip.left_out == {"model output": ("P1", "Q1", "Z1")}
    assert (clip.labels, clip.subjects) == (("P1",), ("Bob",))


def test_type_groups_name_the_lists(path):
    more = {"TYPE_GROUPS": ["ODDITIES", "ODD", "LABELS", "MARKER"], "ODDITIES": ["B"]}
    clip = labelled(path, "A", "B", "ODD", **more)
    assert clip.labels == ("A", "ODD")
    assert clip.left_out == {"model output": ("B",)}


@pytest.mark.parametrize(
    ("label", "is_marker"),
    [
        *[("LHipAngles", False), ("RAbsAnkleAngle", False), ("LAnkleForce", False)],
        *[("LKneeMoment", False), ("RHipPower", False), ("LNormalisedGRF", False)],
        *[("RGroundReactionForce2", False), ("LInferiorAngle", True), ("LFHD", True)],
        *[("PowerPack", True), ("GRFX", True)],
    ],
)
def test_model_outputs_by_name(path, label, is_marker):
    assert (label in labelled(path, label, "C7").labels) == is_marker


def bones(seed=0, stretch=1.0, count=20):
    """A bone of Plug-in Gait in any pose: origin and three axes, (frames, 4, 3), millimetres."""
    rng = np.random.default_rng(seed)
    turns, _ = np.linalg.qr(rng.standard_normal((count, 3, 3)))
    origin = rng.uniform(300, 900, (count, 1, 3))
    arms = 150 * turns * np.array([1, 1, stretch])[:, None]
    return np.concatenate([origin, origin + arms], axis=1)


def four(stem, subject=""):
    return [f"{subject}{stem}{end}" for end in "OALP"]


def test_bones_are_model_outputs_per_subject(path):
    points = np.concatenate([cloud(markers=2), bones(1), bones(2)], axis=1)
    names = ["C7", "Ann:C7", *four("LFE"), "Ann:HEDO", "Ann:HEDA", "Ann:HEDL", "Bob:HEDP"]
    clip = read_clip(c3d_file(path, points, LABELS=names))
    assert clip.left_out == {"model output": tuple(four("LFE"))}
    assert clip.labels == ("C7", "C7", "HEDO", "HEDA", "HEDL", "HEDP")
    names[-1] = "Ann:HEDP"
    clip = read_clip(c3d_file(path, points, LABELS=names))
    assert clip.left_out == {"model output": (*four("LFE"), *four("HED"))}


def test_bones_with_gaps_and_coarse_coordinates(path):
    points = np.concatenate([cloud(count=200, markers=1), bones(count=200)], axis=1)
    points[:90, 2] = 0
    clip = read_clip(c3d_file(path, points, scale=1.0, LABELS=["C7", *four("PEL")]))
    assert clip.labels == ("C7",)


@pytest.mark.parametrize("four_points", [cloud(markers=4), bones(stretch=1.5)])
def test_markers_named_like_bones_are_kept(path, four_points):
    clip = read_clip(c3d_file(path, four_points, LABELS=four("LSH")))
    assert clip.labels == tuple(four("LSH"))


def test_nothing_but_model_outputs_is_an_error(path):
    with pytest.raises(ClipError, match=r"clip\.c3d: no marker among its points, 2 of them"):
        labelled(path, "LHipAngles", "*1")


# --- Frame numbers, counts, rate, axes ----------------------------------------------------------


def words(value):
    return np.array([signed(value), value >> 16])


@pytest.mark.parametrize("first", [1, 187, 40000, 65000])
def test_first_frame_of_the_header(path, first):
    clip = read_clip(c3d_file(path, cloud(), first=first))
    assert (clip.first_frame, clip.notes) == (first, ())
    assert read_clip(c3d_file(path, cloud(), first=0, last=19)).first_frame == 1


@pytest.mark.parametrize("reader", [with_ezc3d.read, with_c3d.read])
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
    assert (raw.first_frame, len(raw.points), raw.length) == (first, 20, 20)
    assert read_clip(path).notes == ()


@pytest.mark.parametrize("reader", [with_ezc3d.read, with_c3d.read])
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
    assert (raw.first_frame, len(raw.points), raw.length) == (300, 20, 20)
    assert read_clip(path).notes == ()


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
    ("case", "more"),
    [
        (
            "trial",
            {f"TRIAL__ACTUAL_{at}_FIELD": words(n) for at, n in (("START", 1), ("END", LONG))},
        ),
        ("long", {"LONG_FRAMES": float(LONG)}),
        ("float", {"FRAMES": float(LONG)}),
        ("wrapped", {"FRAMES": signed(LONG), "LONG_FRAMES": float(LONG), "last": LONG & 0xFFFF}),
        ("size", {"FRAMES": -1}),
    ],
)
def test_more_than_65535_frames(path, case, more):
    points = cloud(count=LONG)
    clip = read_clip(c3d_file(path, points, **({"FRAMES": signed(0xFFFF)} | more)))
    assert clip.points.shape == (LONG, 3, 3)
    np.testing.assert_allclose(clip.points, points / 1000, rtol=1e-6)
    # ezc3d reads the first and the last to the end of the file, with the padding of its last block.
    told = {
        "float": "not an INT; read with py-c3d",
        "wrapped": "ezc3d reads 4464 of its 70000 frames",
    }
    assert told.get(case, "") in notes(clip)
    assert bool(clip.notes) == (case in told)


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
    same(with_ezc3d.read(path), with_c3d.read(path))
    # A group ROTATION, which ezc3d writes, makes it stop at 65535 frames.
    art.write_c3d(recording(LONG, 1), path)
    clip = read_clip(path)
    assert clip.points.shape == (LONG, 3, 3)
    np.testing.assert_allclose(clip.points, cloud(LONG) / 1000, atol=1e-6)
    assert clip.notes == ("ezc3d reads 65535 of its 70000 frames; read with py-c3d",)


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
    same(with_ezc3d.read(path), with_c3d.read(path))


def test_where_only_the_first_reader_can_the_loss_is_noted(path, monkeypatch):
    def refuse(path):
        raise ClipError("py-c3d cannot read it: for a reason")

    monkeypatch.setattr(with_c3d, "read", refuse)
    art.write_c3d(recording(LONG, 1), path)
    clip = read_clip(path)
    assert len(clip.points) == 0xFFFF
    assert "only 65535 of the file's 70000 frames are read" in notes(clip)
    assert "for a reason" in notes(clip)


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


@pytest.mark.parametrize("rate", [0.0, -100.0])
def test_no_frame_rate_is_an_error_that_names_the_option(path, rate):
    c3d_file(path, cloud(), rate=rate)
    with pytest.raises(ClipError, match=r"clip\.c3d: no frame rate") as error:
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


@pytest.mark.parametrize("rate", [0, -1, np.nan, np.inf])
def test_a_rate_that_is_none(path, rate):
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


@pytest.mark.parametrize("reader", [with_ezc3d.read, with_c3d.read])
def test_a_residual_of_minus_zero_is_a_point(path, reader):
    residuals = np.full((20, 3), -0.0)
    residuals[4, 1] = -1
    raw = reader(c3d_file(path, cloud(), residuals=residuals))
    assert np.argwhere(raw.invalid).tolist() == [[4, 1]]


# --- Not a C3D ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "an empty file"),
        (b"name,x,y,z\n" * 100, "not a C3D file"),
        (b"\2\x50" + bytes(509), "not a C3D file"),
        (b"\2\x51" + bytes(2000), "not a C3D file"),
    ],
    ids=["empty", "text", "511 bytes", "wrong key"],
)
def test_not_a_c3d(path, content, message):
    path.write_bytes(content)
    with pytest.raises(ClipError, match=rf"clip\.c3d: {message}"):
        read_clip(path)


def test_no_file_and_a_folder(tmp_path):
    with pytest.raises(ClipError, match=r"none\.c3d: No such file"):
        read_clip(tmp_path / "none.c3d")
    with pytest.raises(ClipError, match=f"{tmp_path.name}: "):
        read_clip(tmp_path)


def test_a_file_without_parameters_is_named_and_no_library_sees_it(path, capfd, monkeypatch):
    monkeypatch.setattr(with_ezc3d, "read", None)
    path.write_bytes(b"\2\x50" + bytes(3000))
    with pytest.raises(ClipError, match=r"clip\.c3d: no parameters in block 2, where its header"):
        read_clip(path)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("shape", [(10, 0, 3), (0, 3, 3)])
def test_no_points_is_an_error(path, shape):
    with pytest.raises(ClipError, match=r"clip\.c3d: "):
        read_clip(c3d_file(path, np.ones(shape)))


# --- The second reader --------------------------------------------------------------------------


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("scale", [-0.1, 0.05])
@pytest.mark.parametrize("analogs", [0, 5])
def test_every_machine_and_kind_of_number(path, machine, scale, analogs, capfd):
    points, residuals = cloud(), np.zeros((20, 3))
    residuals[3, 1] = -1
    c3d_file(
        path, points, residuals=residuals, scale=scale, machine=machine, analogs=analogs, first=300
    )
    raw = with_c3d.read(path)
    if machine != "MIPS":
        same(with_ezc3d.read(path), raw)
    points[3, 1] = np.nan
    np.testing.assert_allclose(raw.points, points, rtol=1e-6, atol=max(scale, 0) / 2)
    assert (raw.rate, raw.first_frame) == (100.0, 300)
    clip = read_clip(path)
    assert ("MIPS numbers; read with" in notes(clip)) == (machine == "MIPS")
    assert capfd.readouterr() == ("", "")


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 9),
    first=st.integers(1, 65000),
    kind=st.sampled_from([(m, s, a) for m in ("INTEL", "DEC") for s in (-1, 0.1) for a in (0, 3)]),
)
def test_both_readers_agree(path, seed, count, first, kind):
    rng = np.random.default_rng(seed)
    machine, scale, analogs = kind
    points = rng.choice([0.0, *rng.normal(0, 500, 20)], (count, 4, 3))
    residuals = rng.choice([-1.0, 0.0, 3.0], (count, 4))
    c3d_file(
        path,
        points,
        residuals=residuals,
        machine=machine,
        scale=scale,
        analogs=analogs,
        first=first,
    )
    same(with_ezc3d.read(path), with_c3d.read(path))


def test_both_readers_agree_on_an_artificial_clip(path):
    faults = art.Faults(sigma=0.001, dropout=0.2)
    one = art.record(art.human(), art.marker_set("cmu"), art.walk(2, 100), faults, first_frame=77)
    art.write_c3d(art.merge({"Ann": one, "Bob": one}), path)
    same(with_ezc3d.read(path), with_c3d.read(path))


def test_the_second_reader_against_its_own_librarys_loop(path):
    import c3d

    residuals = np.zeros((20, 3))
    residuals[4, 2] = -1
    c3d_file(path, cloud(), residuals=residuals, analogs=2, UNITS="mm", DESCRIPTIONS=["a"] * 3)
    raw = with_c3d.read(path)
    with path.open("rb") as file, pytest.warns(UserWarning, match="ANALOG"):
        theirs = np.array([points for _, points, _ in c3d.Reader(file).read_frames()])
    np.testing.assert_array_equal(raw.invalid, theirs[..., 3] == -1)
    np.testing.assert_array_equal(raw.points[~raw.invalid], theirs[~raw.invalid][:, :3])


def test_damaged_parameters_are_refused_and_never_get_out(path):
    """Any byte of the parameters changed: a clip or a ClipError, nothing else, nothing printed."""
    whole = c3d_file(path, cloud(count=3)).read_bytes()
    rng = np.random.default_rng(5)
    for at in rng.integers(BLOCK, 2 * BLOCK, 300):
        path.write_bytes(whole[:at] + bytes([rng.integers(256)]) + whole[at + 1 :])
        with suppress(ClipError):
            assert with_c3d.read(path).points.shape[2] == 3


# --- Real recordings ----------------------------------------------------------------------------


def real(name):
    path = CLIPS / name
    if not path.exists():
        pytest.skip(f"no {path}")
    return path


@pytest.mark.real
@pytest.mark.parametrize(
    "name",
    [
        *["cmu/basketball", "functional_hip/FunctionalLHip", "functional_hip/FunctionalWalk"],
        *["functional_knee/right_knee", "hdm05/HDM_dg_06-03_03_120", "odd_files/Eb015pi"],
        *["odd_files/duplicate_labels", "odd_files/sub_labels", "plug_in_gait/HC055A01"],
        *["plug_in_gait/HC055A34", "two_subjects/kinematics_tennis_serve_2players"],
    ],
)
def test_both_readers_agree_on_real_clips(name):
    path = real(f"{name}.c3d")
    first, second = with_ezc3d.read(path), with_c3d.read(path)
    same(first, second)


@pytest.mark.real
def test_the_same_trial_in_two_byte_orders():
    intel = read_clip(real("odd_files/Eb015pi.c3d"))
    sgi = read_clip(real("odd_files/Eb015si.c3d"))
    np.testing.assert_array_equal(intel.points, sgi.points)
    for name in ("labels", "subjects", "rate", "first_frame", "unit", "up", "left_out"):
        assert getattr(intel, name) == getattr(sgi, name)
    assert "MIPS" in notes(sgi)


@pytest.mark.real
def test_what_ezc3d_refuses():
    clip = read_clip(real("odd_files/Dance.c3d"))
    assert clip.points.shape == (499, 40, 3)
    assert "OFFSET" in notes(clip)


@pytest.mark.real
@pytest.mark.parametrize(
    ("name", "markers", "left_out"),
    [
        *[("cmu/01_01", 42, 0), ("cmu/basketball", 41, 0), ("hdm05/HDM_dg_06-03_03_120", 41, 3)],
        *[("functional_hip/FunctionalLHip", 74, 0), ("functional_hip/FunctionalWalk", 74, 72)],
        *[("functional_knee/right_knee", 73, 0), ("odd_files/sub_labels", 50, 64)],
        *[("plug_in_gait/HC055A01", 125, 188), ("plug_in_gait/HC055A34", 103, 188)],
        *[("two_subjects/kinematics_tennis_serve_2players", 78, 0)],
    ],
)
def test_markers_of_real_clips(name, markers, left_out):
    clip = read_clip(real(f"{name}.c3d"))
    assert len(clip.labels) == markers
    assert sum(map(len, clip.left_out.values())) == left_out
    # Plug-in Gait's set, or the like of it, has nothing that looks like a bone.
    assert {"LFHD", "C7", "LKNE"} & set(clip.labels) or "right_knee" in name


@pytest.mark.real
def test_zeros_of_a_real_clip():
    assert "missing: 59926" in notes(read_clip(real("functional_hip/FunctionalLHip.c3d")))


def test_the_door_is_the_only_way():
    assert readers.__all__ == ["read_clip"]

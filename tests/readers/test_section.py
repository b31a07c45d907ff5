"""The parameter section: read as far as it makes sense, and what is wrong with it is told."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from c3d_bytes import (
    BLOCK,
    c3d_file,
    change,
    is_right,
    notes,
    place,
    tracks,
)
from references import by_ezc3d, read_alike

from mocap_skel.readers import read_clip
from mocap_skel.readers.formats.c3d import section, with_c3d
from mocap_skel.readers.formats.c3d.survey import survey


@pytest.mark.parametrize("blocks", [0, 1, 40, 255])
def test_a_number_of_parameter_blocks_that_is_wrong(path, blocks):
    # Longer than the one block that it may say.
    c3d_file(path, tracks(), DESCRIPTIONS=["what a marker is called by some"] * 40)
    change(path, BLOCK + 2, "B", blocks)
    assert is_right(path).labels == ("M1", "M2", "M3", "M4")


def test_parameters_whose_end_nothing_tells_are_read_to_their_end_mark(path):
    c3d_file(path, tracks(), DESCRIPTIONS=["what a marker is called by some"] * 40)
    change(path, BLOCK + 2, "B", 0)
    change(path, 16, "<H", 0)
    found = survey(path).section
    assert (found.faults, found.groups["POINT"]["LABELS"]) == ((), ["M1", "M2", "M3", "M4"])
    assert len(found.groups["POINT"]["DESCRIPTIONS"]) == 40


@pytest.mark.parametrize(
    ("machine", "number"),
    [
        *[(machine, number) for machine in ("INTEL", "DEC", "MIPS") for number in (0, 87)],
        *[("INTEL", 1), ("DEC", 2), ("MIPS", 3)],
    ],
)
def test_a_machine_that_is_not_named(path, machine, number):
    c3d_file(path, tracks(), machine=machine)
    change(path, BLOCK + 3, "B", number)
    clip = is_right(path)
    assert clip.labels == ("M1", "M2", "M3", "M4")
    assert f"taken for {machine}" in notes(clip)


@pytest.mark.parametrize(("machine", "number"), [("INTEL", 85), ("DEC", 84)])
def test_a_machine_that_it_is_not(path, machine, number):
    # As the other machine's, the rates are next to nothing, or below zero.
    for rate in (100.0, 59.94):
        c3d_file(path, tracks(), machine=machine, rate=rate)
        change(path, BLOCK + 3, "B", number)
        assert f"taken for {machine}" in notes(is_right(path))
    # Without a rate nothing tells, and what it says is believed.
    c3d_file(path, tracks(), machine=machine, rate=0.0, RATE=100.0)
    assert is_right(path).notes == ()


@pytest.mark.parametrize("name", [b"\0\1\2\3", b"NAM\n", b"\xffAM\xc3"])
def test_a_name_that_cannot_be_printed(path, name):
    data = c3d_file(path, tracks(), TRIAL__NAME="walk").read_bytes()
    path.write_bytes(data.replace(b"NAME", name))
    assert is_right(path).labels == ("M1", "M2", "M3", "M4")


@pytest.mark.parametrize("scale", [0.05, -0.05])
def test_a_scale_that_the_header_has_otherwise(path, scale):
    """Where the two differ and the size does not tell, POINT:SCALE holds, as it holds for most programs."""
    change(c3d_file(path, tracks(), scale=2 * scale), 12, "<f", scale)
    said = (
        "POINT:SCALE 0.1 and the header's 0.05 differ: the markers span 2.33 m by the first, 1.16 m by the "
        "second; POINT:SCALE 0.1 is taken, as their size does not tell",
    )
    # That of floats is no number that anything is multiplied with.
    assert is_right(path, tolerance=0.06).notes == (said if scale > 0 else ())


def test_integers_without_a_scale(path):
    # Nothing says that they are integers, but as floats they would be none.
    change(c3d_file(path, tracks().round(), scale=1.0, SCALE=None), 12, "<f", 0.0)
    assert "no scale for integer points: taken as 1" in notes(is_right(path, tracks().round()))


@pytest.mark.parametrize("said", [(60, 31), (50, 60)])
def test_two_numbers_of_frames_for_which_there_is_room(path, said):
    by_parameters, by_header = said
    c3d_file(path, tracks(), FRAMES=by_parameters, last=by_header)
    said = f"POINT:FRAMES is {by_parameters}, the header's {by_header}; 60 frames are taken"
    assert said in notes(is_right(path))


def test_analog_data_that_nobody_needs_are_no_note(path):
    c3d_file(path, tracks(), analogs=24, machine="MIPS")
    change(path, 18, ">H", 0)
    assert "py-c3d cannot" not in notes(is_right(path))


def test_a_group_without_a_record(path):
    data = c3d_file(path, tracks()).read_bytes()
    record = b"\5\xffPOINT\3\0\0"
    assert record in data
    path.write_bytes(data.replace(record, b"\5\xf9WRONG\3\0\0"))
    clip = is_right(path)
    assert clip.labels == ("M1", "M2", "M3", "M4")
    assert "POINT has no record of its own" in notes(clip)


def test_two_groups_of_one_number_or_name(path):
    """The first is the file's own."""
    data = c3d_file(path, tracks(), TRIAL__UNITS="cm").read_bytes()
    for other in (b"\5\xffOTHER", b"\5\xfdPOINT"):
        path.write_bytes(data.replace(b"\5\xfdTRIAL", other))
        point = survey(path).section.groups["POINT"]
        assert (point["LABELS"], point["UNITS"]) == (["M1", "M2", "M3", "M4"], ["mm"])


def test_of_two_parameters_of_one_name_the_later_holds(path):
    """As ezc3d has it."""
    c3d_file(path, tracks(), UNITS="cm", Units="mm")
    assert survey(path).section.groups["POINT"]["UNITS"] == ["mm"]
    assert by_ezc3d(path).parameters["POINT"]["UNITS"] == ["mm"]
    assert is_right(path).unit == "mm"


def test_no_group_of_points_at_all(path):
    data = c3d_file(path, tracks(), LABELS=None, UNITS=None, FRAMES=None).read_bytes()
    path.write_bytes(data.replace(b"\5\xffPOINT", b"\5\xffOTHER"))
    clip = is_right(path)
    assert (clip.labels[0], clip.rate, clip.first_frame) == ("point_1", 100.0, 1)


@pytest.mark.parametrize("step", [0, 1, 3, 5000, 65535])
@pytest.mark.parametrize("name", ["UNITS", "FRAMES"])
def test_a_step_to_the_next_parameter_that_is_wrong(path, step, name):
    c3d_file(path, tracks())
    change(path, place(path, name) - 2, "<H", step)
    clip = read_clip(path)
    if step == 0:
        # That is how the last one says so.
        assert clip.frames == 60
        return
    np.testing.assert_allclose(clip.points * 1000, tracks(), atol=1e-3)
    assert clip.labels == ("M1", "M2", "M3", "M4")
    assert f"parameter {name} is not as long as it says" in notes(clip)


def test_parameters_that_run_into_the_points(path):
    labels = ["a label of sixty-four letters, which is very long for a label, A"] * 3
    data = c3d_file(path, tracks(), TRIAL__LABELS=labels).read_bytes()
    (block,) = struct.unpack_from("<H", data, 16)
    at = data.index(labels[0].encode())
    gone = BLOCK * (block - 1)
    # The section as if it had been one block shorter.
    assert gone - BLOCK < at + 192
    c3d_file(path, tracks(), TRIAL__NAME="A" * 120)
    size = struct.unpack_from("<h", path.read_bytes(), place(path, "NAME") - 2)[0]
    change(path, place(path, "NAME") - 2, "<h", size + 900)
    change(path, place(path, "NAME"), "<bBBB", -1, 2, 120, 9)
    clip = is_right(path)
    assert clip.labels == ("M1", "M2", "M3", "M4")
    assert "read with numpy" in notes(clip)


def test_where_both_ways_to_the_next_parameter_may_be_right_the_content_wins(path):
    """Its step leads into a text which looks like a parameter."""
    text = b"so\4\1HIDE\7\0\2\0\1\0\0 and on"
    c3d_file(path, tracks(), TRIAL__NAME=text, TRIAL__LAST="here")
    assert survey(path).section.faults == ()
    # The step counts itself, the type, the number of dimensions, one dimension, and "so".
    change(path, place(path, "NAME") - 2, "<H", 7)
    found = survey(path).section
    assert found.faults == ("parameter NAME is not as long as it says",)
    assert "HIDE" not in found.groups["POINT"]
    assert found.groups["TRIAL"]["LAST"] == ["here"]
    is_right(path)


def test_descriptions_and_names_as_long_as_they_may_be(path):
    name = "N" * 127
    c3d_file(path, tracks(), described="what it is", **{f"TRIAL__{name}": "walk"})
    found = survey(path).section
    assert found.faults == ()
    assert found.groups["TRIAL"] == {name: ["walk"]}
    read_alike(path)
    assert is_right(path).notes == ()


def test_a_description_that_runs_past_the_end(path):
    # The parameters fill one block and so much of it that 255 bytes more are too many.
    c3d_file(path, tracks(), TRIAL__TEXT="x" * 200, TRIAL__NAME="walk")
    change(path, place(path, "NAME") + 3 + len("walk"), "B", 255)
    found = survey(path).section
    assert found.faults[0] == "parameter NAME runs past the end"
    assert found.groups["TRIAL"].keys() == {"TEXT"}
    assert notes(is_right(path)).startswith("parameter NAME runs past the end; ")


@pytest.mark.parametrize("kind", [0, 3, 7, -2])
def test_a_parameter_of_no_type(path, kind):
    c3d_file(path, tracks(), TRIAL__NAME="walk")
    change(path, place(path, "NAME"), "b", kind)
    assert is_right(path).labels == ("M1", "M2", "M3", "M4")


@pytest.mark.parametrize("group", [0, 100, -100])
def test_a_parameter_of_no_group(path, group):
    c3d_file(path, tracks(), TRIAL__NAME="walk")
    change(path, place(path, "NAME") - 7, "b", group)
    assert is_right(path).labels == ("M1", "M2", "M3", "M4")


def test_fewer_labels_than_points_and_empty_lists(path):
    points = tracks(markers=6)
    c3d_file(path, points, LABELS=["A", "B"], UNITS=" ")
    clip = is_right(path, points)
    assert clip.labels == ("A", "B", "point_3", "point_4", "point_5", "point_6")


def test_the_walk_gives_what_py_c3d_gives(path, samples):
    """Both read the same parameters where py-c3d can."""
    for file in (*sorted(samples.glob("*.c3d")), c3d_file(path, tracks(), machine="MIPS")):
        found = survey(file)
        assert found.section.faults == found.doubts == found.contradictions == ()
        theirs = with_c3d.read(file)
        assert theirs.reader == "py-c3d"
        for group, entries in theirs.parameters.items():
            ours = found.section.groups.get(group, {})
            assert ours.keys() == entries.keys()
            for name, value in entries.items():
                assert list(ours[name]) == list(value), name


def test_a_pipe_of_bytes_cannot_be_read_past():
    """The walk ends on any bytes whatever."""
    rng = np.random.default_rng(4)
    for _ in range(300):
        head = b"\2\x50" + rng.bytes(510) + b"\1\x50" + bytes([rng.integers(9), 84])
        head += bytes([5, 255]) + b"POINT" + rng.bytes(1500)
        header, found = section.read(head)
        assert found.end <= len(head) and header.frames >= 0

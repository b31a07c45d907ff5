"""Events of C3D files, as different vendors write them."""

import struct

import numpy as np
import pytest
from c3d_bytes import c3d_file, cloud, notes
from recordings import CLIPS

from mocap_skel.events import Event
from mocap_skel.readers import read_clip

VICON = {
    "EVENT__USED": 3,
    "EVENT__CONTEXTS": ["Right", "Left", "General"],
    "EVENT__LABELS": ["Foot Off", "Foot Strike", "Clap"],
    "EVENT__SUBJECTS": ["Ann", "Ann", ""],
    "EVENT__TIMES": np.array([[0.0, 0.14], [0.0, 0.02], [0.0, 0.1]]).T.astype("f4"),
}


def told(clip):
    return [(event.frame, event.label, event.side, event.foot) for event in clip.events]


def pairs(*rows):
    """TIMES as the file has it: for each event minutes and seconds, one after the other."""
    return np.array(rows, dtype="f4").T


@pytest.mark.parametrize("machine", ["INTEL", "DEC", "MIPS"])
def test_events_of_the_group_in_their_order_in_time(tmp_path, machine):
    times = VICON["EVENT__TIMES"]
    # The bytes of an array stand column by column.
    group = {**VICON, "EVENT__TIMES": times.T.reshape(times.shape)}
    clip = read_clip(c3d_file(tmp_path / "a.c3d", cloud(), machine=machine, **group))
    assert told(clip) == [
        (3, "Foot Strike", "left", "strike"), (11, "Clap", "", ""), (15, "Foot Off", "right", "off"),
    ]  # fmt: skip
    assert [(e.time, e.context, e.subject, e.source) for e in clip.events] == [
        (0.02, "Left", "Ann", "file"), (0.1, "General", "", "file"), (0.14, "Right", "Ann", "file"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    "times",
    [
        np.array([1.0, 2.5, 1.0, 2.6]),  # minutes and seconds of each event
        np.array([62.5, 62.6]),  # seconds alone
        np.array([1.0, 1.0, 2.5, 2.6]),  # all minutes, then all seconds
    ],
)
def test_times_in_minutes_and_seconds_or_in_seconds(tmp_path, times):
    group = {"EVENT__LABELS": ["LHS", "LTO"], "EVENT__TIMES": times.astype("f4")}
    clip = read_clip(c3d_file(tmp_path / "a.c3d", cloud(), first=6250, **group))
    assert told(clip) == [(6251, "LHS", "left", "strike"), (6261, "LTO", "left", "off")]


def test_times_that_count_from_the_clips_first_frame_are_said_to(tmp_path):
    group = {"EVENT__LABELS": ["RHS"], "EVENT__TIMES": np.array([0.0, 0.1], dtype="f4")}
    clip = read_clip(c3d_file(tmp_path / "a.c3d", cloud(), first=300, **group))
    assert [(e.frame, round(e.time, 6)) for e in clip.events] == [(310, 3.09)]
    assert "count from its first frame" in notes(clip)


def test_events_outside_the_frames_are_left_out_and_counted(tmp_path):
    group = {
        "EVENT__LABELS": ["RHS", "RTO"],
        "EVENT__TIMES": np.array([0.0, 0.1, 0.0, 9.0], dtype="f4"),
    }
    clip = read_clip(c3d_file(tmp_path / "a.c3d", cloud(), **group))
    assert [event.label for event in clip.events] == ["RHS"]
    assert "events outside its frames, which are left out: 1 of 2" in notes(clip)


def test_a_group_without_times_says_how_many_events_it_loses(tmp_path):
    clip = read_clip(
        c3d_file(tmp_path / "a.c3d", cloud(), EVENT__USED=2, EVENT__LABELS=["RHS", "RTO"])
    )
    assert not clip.events
    assert "events that cannot be read: 2 of 2" in notes(clip)


def test_a_group_that_is_there_and_empty_says_nothing(tmp_path):
    clip = read_clip(c3d_file(tmp_path / "a.c3d", cloud(), EVENT__USED=0))
    assert not clip.events and not clip.notes


def test_more_events_than_a_parameter_holds(tmp_path):
    seconds = np.linspace(0.0, 2.99, 300)
    flat = np.stack([0 * seconds, seconds], axis=1).ravel().astype("f4")
    # A dimension is one byte.
    group = {
        "EVENT__LABELS": ["RHS"] * 255, "EVENT__LABELS2": ["LHS"] * 45,
        "EVENT__TIMES": flat[:510].reshape(2, 255), "EVENT__TIMES2": flat[510:].reshape(2, 45),
    }  # fmt: skip
    clip = read_clip(c3d_file(tmp_path / "a.c3d", cloud(300), **group))
    assert len(clip.events) == 300
    assert [(e.frame, e.side) for e in clip.events[::299]] == [(1, "right"), (300, "left")]


@pytest.mark.parametrize("machine", ["INTEL", "MIPS"])
def test_events_of_the_header_where_there_is_no_group(tmp_path, machine):
    path = c3d_file(tmp_path / "a.c3d", cloud(), machine=machine)
    data, order = bytearray(path.read_bytes()), ">" if machine == "MIPS" else "<"
    data[298:302] = struct.pack(order + "2H", 12345, 2)
    data[304:312] = struct.pack(order + "2f", 0.04, 0.12)
    data[396:404] = b"LHS RTO "
    path.write_bytes(data)
    clip = read_clip(path)
    assert told(clip) == [(5, "LHS", "left", "strike"), (13, "RTO", "right", "off")]


@pytest.mark.parametrize(
    ("label", "context", "side", "foot"),
    [
        ("Foot Strike", "Left", "left", "strike"), ("Foot Off", "Right", "right", "off"),
        ("Heel Strike", "L", "left", "strike"), ("toe-off", "R", "right", "off"),
        ("Left Foot Strike", "", "left", "strike"), ("R_Initial_Contact", "", "right", "strike"),
        ("LON", "", "left", "strike"), ("ROFF", "", "right", "off"), ("eRHS", "", "right", "strike"),
        ("L_FC", "", "left", "strike"), ("RIC", "", "right", "strike"), ("HS", "Left", "left", "strike"),
        ("TO2", "Right", "right", "off"), ("Event", "Right", "right", ""), ("Start", "General", "", ""),
        ("Rattle", "", "", ""), ("Lift", "", "", ""), ("foot contact right", "", "right", "strike"),
    ],
)  # fmt: skip
def test_whose_foot_does_what(label, context, side, foot):
    event = Event(0.0, 1, label, context)
    assert (event.side, event.foot) == (side, foot)


@pytest.mark.real
def test_real_files_have_the_events_that_another_reader_finds():
    import ezc3d

    for name in ("functional_hip/FunctionalWalk", "odd_files/sub_labels", "plug_in_gait/HC055A01"):
        path = CLIPS / f"{name}.c3d"
        group = ezc3d.c3d(str(path))["parameters"]["EVENT"]
        minutes, seconds = np.ravel(group["TIMES"]["value"], "F").reshape(-1, 2).T
        theirs = sorted(
            zip(
                60 * minutes + seconds,
                group["LABELS"]["value"],
                group["CONTEXTS"]["value"],
                strict=True,
            )
        )
        ours = [(event.time, event.label, event.context) for event in read_clip(path).events]
        assert [one[1:] for one in ours] == [one[1:] for one in theirs]
        assert np.allclose([one[0] for one in ours], [one[0] for one in theirs], atol=1e-6)


@pytest.mark.real
def test_a_real_file_whose_group_is_damaged_has_those_of_its_header():
    clip = read_clip(CLIPS / "odd_files" / "bad_parameter_section.c3d")
    assert [(e.label, e.frame) for e in clip.events][:2] == [("LHS", 93), ("RFO", 98)]

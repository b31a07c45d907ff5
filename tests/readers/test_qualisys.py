"""TSV files of Qualisys Track Manager."""

from __future__ import annotations

import numpy as np
import pytest
from table_files import marked, qualisys, rounded

from mocap_skel.errors import CallError, ClipError
from mocap_skel.readers import read_clip

FILE = marked(rate=200.0)


def reads(path, text, file=FILE):
    path.write_text(text)
    clip = read_clip(path)
    np.testing.assert_allclose(clip.points, rounded(file) * 1e-3, rtol=1e-13)
    assert (clip.labels, clip.rate, clip.unit, clip.up_by) == (file.labels, file.rate, "mm", "")
    return clip


@pytest.mark.parametrize("name", ["walk.tsv", "walk.txt", "walk"])
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"frame": True},
        {"time": True},
        {"frame": True, "time": True},
        {"frame": True, "time": True, "titles": True},
        {"titles": True},
        {"tail": "\t"},
        {"frame": True, "tail": "\t"},
        {"frame": True, "time": True, "tail": "\t"},
        {"before": {"FILE_VERSION": ["2.0.0"], "EVENT": ["Start", "7", "0.03"]}},
    ],
)
def test_with_and_without_frames_times_titles_and_tabs(tmp_path, name, options):
    file = FILE.but(first=41) if options.get("frame") else FILE
    clip = reads(tmp_path / name, qualisys(file, **options), file)
    assert clip.notes == () and clip.up == "z"
    assert clip.first_frame == file.first


def test_a_last_marker_that_is_never_seen_is_no_tab(tmp_path):
    points = FILE.points.copy()
    points[:, -1] = np.nan
    file = FILE.but(points=points)
    for options in ({}, {"frame": True}, {"frame": True, "time": True}):
        reads(tmp_path / "walk.tsv", qualisys(file, **options), file)


def test_zeros_decimal_commas_and_line_ends(tmp_path):
    file = FILE.but(comma=True)
    text = qualisys(file, frame=True, time=True).replace("\n", "\r\n")
    reads(tmp_path / "walk.tsv", "\ufeff" + text, file)
    zeros = FILE.but(points=np.nan_to_num(FILE.points))
    (tmp_path / "zeros.tsv").write_text(qualisys(zeros))
    clip = read_clip(tmp_path / "zeros.tsv")
    np.testing.assert_allclose(clip.points, rounded(FILE) * 1e-3)


def test_its_events_are_read(tmp_path):
    lines = "EVENT\tLeft heel strike\t7\t0,03\nEVENT\tright toe off\t15\t0.07\n"
    text = qualisys(FILE, frame=True).replace("MARKER_NAMES", lines + "MARKER_NAMES")
    clip = reads(tmp_path / "walk.tsv", text)
    assert [(e.frame, e.time, e.side, e.foot) for e in clip.events] == [
        (7, 0.03, "left", "strike"), (15, 0.07, "right", "off"),
    ]  # fmt: skip
    clip = reads(tmp_path / "walk.tsv", text.replace("0.07", "soon"))
    assert len(clip.events) == 1 and clip.notes == ("events that cannot be read: 1 of 2",)


def test_what_it_refuses(tmp_path):
    path = tmp_path / "walk.tsv"
    path.write_text(qualisys(FILE, before={"DATA_INCLUDED": ["6D"]}))
    with pytest.raises(ClipError, match="it holds 6D data, no markers"):
        read_clip(path)
    path.write_text(qualisys(FILE, before={"MARKER_NAMES": None}))
    with pytest.raises(ClipError, match="no line MARKER_NAMES in its header"):
        read_clip(path)
    path.write_text(qualisys(FILE, before={"MARKER_NAMES": ["A", "B"]}))
    with pytest.raises(ClipError, match="its rows have 12 cells, and 2 markers need 6"):
        read_clip(path)
    # A camera that something outside triggers has no rate that QTM knows.
    path.write_text(qualisys(FILE, before={"FREQUENCY": ["EXT"]}))
    with pytest.raises(CallError, match="no frame rate in it"):
        read_clip(path)
    path.write_text(qualisys(FILE, before={"FREQUENCY": ["EXT"]}, frame=True, time=True))
    assert read_clip(path).rate == 200
    path.write_text(qualisys(FILE)[:-20])
    with pytest.raises(ClipError, match=r"cut off in line 31, after \d+ cells of 12: 19 whole"):
        read_clip(path)
    path.write_text(qualisys(FILE, said=500))
    assert "the header says 500 frames, and there are 20" in read_clip(path).notes[0]

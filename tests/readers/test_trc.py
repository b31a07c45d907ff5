"""TRC files: points that are known, written as programs write them and as people break them."""

from __future__ import annotations

import gzip
import re

import numpy as np
import pytest
from table_files import marked, rounded, trc

from mocap_skel.errors import CallError, ClipError
from mocap_skel.readers import read_clip

FILE = marked()


@pytest.fixture
def path(tmp_path):
    return tmp_path / "walk.trc"


def reads(path, text, file=FILE, encoding="utf-8", **options):
    """The clip, which has the file's points."""
    path.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
    clip = read_clip(path, **options)
    np.testing.assert_allclose(clip.points, rounded(file) * 1e-3, rtol=1e-13)
    assert clip.labels == file.labels
    assert (clip.rate, clip.first_frame, clip.unit) == (file.rate, file.first, "mm")
    return clip


def test_the_points_of_a_file_and_what_it_says(path):
    clip = reads(path, trc(FILE))
    assert (clip.name, clip.notes, clip.left_out) == (str(path), (), {})
    # OpenSim has y up; a file does not say it, and the body may know better.
    assert (clip.up, clip.up_by) == ("y", "")


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\r"),
        lambda text: "\ufeff" + text,
        lambda text: text.replace("\n", "\t\n"),
        lambda text: text.replace("\n", "\t\t\t\n"),
        lambda text: text + "\n\n  \n",
        lambda text: text.replace("\n1\t", "\n\n\n1\t", 1),
        lambda text: text.replace("\t", ","),
        lambda text: text.rstrip("\n"),
        lambda text: text.replace("\t", "\t  "),
        lambda text: text.replace("Frame#", "frame #"),
        lambda text: text.replace("NumFrames", "Frames"),
    ],
)
def test_line_ends_tabs_blank_lines_and_the_like_change_nothing(path, change):
    last = FILE.points.copy()
    last[-1, -1] = 1.0
    file = FILE.but(points=last)
    assert reads(path, change(trc(file)), file).notes == ()


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_names_with_umlauts_in_any_encoding(path, encoding):
    file = FILE.but(labels=("Schädel", "Hüfte", "LKNE", "C7"))
    clip = reads(path, trc(file), file, encoding)
    assert bool(clip.notes) == (encoding == "latin-1")


@pytest.mark.parametrize("sep", ["\t", ";"])
def test_decimal_commas(path, sep):
    file = FILE.but(sep=sep, comma=True)
    text = trc(file, rate="100,00")
    reads(path, text, file)
    # With exponents, as MATLAB writes them.
    head = text.index("\n1" + sep)
    reads(path, text[:head] + re.sub(r"(,\d+)", r"\1E+00", text[head:]), file)


def test_blanks_part_the_cells_of_a_file_without_gaps(path):
    file = FILE.but(points=np.nan_to_num(FILE.points, nan=7.0), sep=" ")
    text = trc(file, names=file.labels)
    reads(path, text, file)
    # Of a row with gaps, nothing tells which marker is missing: the next would take its place.
    path.write_text(trc(FILE.but(sep=" "), names=FILE.labels))
    with pytest.raises(
        ClipError, match="columns; blanks part them, so nothing tells which are missing"
    ):
        read_clip(path)
    clip, whole = read_clip(path, salvage=True), np.isfinite(FILE.points).all(axis=(1, 2))
    assert np.isnan(clip.points[~whole]).all()
    np.testing.assert_allclose(clip.points[whole], rounded(FILE)[whole] / 1000)


@pytest.mark.parametrize("word", ["NaN", "nan", "NULL", "-nan(ind)", "N/A", "#N/A", "--", " "])
def test_words_for_missing(path, word):
    text = trc(FILE)
    seen = text.replace("\t\t\t\t", f"\t{word}\t{word}\t{word}\t")
    head = text.index("\n1\t")
    reads(path, text[:head] + seen[head - len(text):] if len(seen) == len(text) else
          text[:head] + text[head:].replace("\t\t\t", f"\t{word}\t{word}\t{word}"))  # fmt: skip


def test_several_spellings_of_the_names(path):
    reads(path, trc(FILE, names=list(FILE.labels)))
    two = FILE.but(labels=("Ann:LASI", "Ann:RASI", "Ben:LASI", "Ben:RASI"))
    path.write_text(trc(two))
    clip = read_clip(path)
    assert clip.subjects == ("Ann", "Ann", "Ben", "Ben") and clip.labels[2:] == ("LASI", "RASI")
    path.write_text(trc(FILE.but(labels=("LASI", "", "LASI", "C7"))))
    clip = read_clip(path)
    assert clip.labels == ("LASI", "point_2", "LASI_2", "C7") and clip.doubles == ((0, 2),)
    each = [f"{label}_{axis}" for label in FILE.labels for axis in "xyz"]
    reads(path, trc(FILE, names=each))
    lines = trc(FILE, names=each).splitlines(keepends=True)
    reads(path, "".join(lines[:4] + lines[6:]))
    path.write_text(trc(FILE, names=["LASI", "RASI", "C7"]))
    with pytest.raises(ClipError, match="3 marker names in its header, and axes of 4 markers"):
        read_clip(path)


def test_units(path):
    path.write_text(trc(FILE, unit="m"))
    assert "if the unit is 'm' as the file says" in read_clip(path).notes[0]
    np.testing.assert_allclose(read_clip(path, unit="mm").points, rounded(FILE) * 1e-3)
    path.write_text(trc(FILE, unit="furlongs"))
    assert "unit 'furlongs' is unknown: mm by the size" in read_clip(path).notes[0]


def test_counts_that_are_not_true(path):
    assert reads(path, trc(FILE, said=99)).notes == (
        "the header says 99 frames, and there are 20: those are read",
    )
    path.write_text(trc(FILE).replace("\t4\tmm", "\t1000000000\tmm"))
    assert read_clip(path).notes == ("NumMarkers is 1000000000, and 4 markers have columns",)
    path.write_text(trc(FILE.but(points=FILE.points[:0])))
    with pytest.raises(ClipError, match=r"no points in it \(points: 4, frames: 0\)"):
        read_clip(path)


def test_the_rate_of_a_header_of_times_and_of_the_call(path):
    file = FILE.but(rate=59.94, decimals=6)
    path.write_text(trc(file, rate=""))
    assert read_clip(path).rate == pytest.approx(59.94, abs=1e-4)
    # Times in milliseconds of 60 Hz are not even, and the rate is.
    path.write_text(trc(FILE.but(rate=60.0, decimals=3), rate="0"))
    assert read_clip(path).rate == 60.0
    text = trc(FILE, rate="-")
    lines = [line.split("\t") for line in text.splitlines()]
    for line in lines[6:]:
        line[1] = ""
    path.write_text("\n".join("\t".join(line) for line in lines) + "\n")
    with pytest.raises(CallError, match="no frame rate in it"):
        read_clip(path)
    assert read_clip(path, rate=50).rate == 50
    path.write_text(trc(FILE, rate="200"))
    clip = read_clip(path)
    assert clip.rate == 200 and "200 Hz by the header, 100 Hz by its times" in clip.notes[0]


def test_frames_that_are_not_there_are_missing(path):
    rows = trc(FILE.but(first=31)).splitlines(keepends=True)
    del rows[9:12]
    path.write_text("".join(rows))
    clip = read_clip(path)
    expected = rounded(FILE)
    expected[3:6] = np.nan
    np.testing.assert_allclose(clip.points, expected * 1e-3, rtol=1e-13)
    assert clip.first_frame == 31
    assert clip.notes[-1].startswith("3 frames without a row, the first of them 34: ")
    # Every other frame of a recording at 100 Hz: the times know.
    rows = trc(FILE).splitlines(keepends=True)
    path.write_text("".join(rows[:6] + rows[6::2]))
    clip = read_clip(path)
    assert clip.frames == 10 and clip.rate == pytest.approx(50)
    assert "frame numbers rise by 2" in clip.notes[1]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("\n20\t", "\n7000000\t", "line 26: frame 7000000 follows frame 19"),
        (
            "\n7\t0.06000\t",
            "\n7\t0.06000\tfive\t",
            r"line 13: 15 cells where the header has 14 columns",
        ),
    ],
)
def test_a_wrong_row_is_named(path, old, new, message):
    path.write_text(trc(FILE).replace(old, new))
    with pytest.raises(ClipError, match=message):
        read_clip(path)


def test_a_wrong_cell_is_named_and_salvage_reads_the_rest(path):
    lines = trc(FILE).splitlines()
    cells = lines[11].split("\t")
    for word, shown in (
        ("12.3.4", "12.3.4"),
        ("True", "True"),
        ("0x1F", "0x1F"),
        ("\x1b[2J", r"\?\[2J"),
    ):
        cells[9] = word
        path.write_text("\n".join([*lines[:11], "\t".join(cells), *lines[12:]]) + "\n")
        with pytest.raises(
            ClipError, match=rf"line 12, column 10 \(LKNE y\): '{shown}' is no number"
        ):
            read_clip(path)
        clip = read_clip(path, salvage=True)
        expected = rounded(FILE)
        expected[5] = np.nan
        np.testing.assert_allclose(clip.points, expected * 1e-3, rtol=1e-13)
        assert "1 row that is not whole, first in line 12" in clip.notes[0]


def test_a_cut_file_is_refused_and_salvage_reads_whole_frames(path):
    file = FILE.but(points=np.nan_to_num(FILE.points, nan=7.0))
    text = trc(file)
    ends = [i for i, c in enumerate(text) if c == "\n"]
    for cut in range(ends[10] + 1, ends[11]):
        path.write_text(text[:cut])
        if cut == ends[10] + 1:
            # Cut where a row ends: the header's count is all that tells.
            assert "the header says 20 frames, and there are 5" in read_clip(path).notes[0]
            continue
        with pytest.raises(ClipError, match=r"cut off in line 12.*: 5 whole frames before it"):
            read_clip(path)
        np.testing.assert_allclose(read_clip(path, salvage=True).points, rounded(file)[:5] * 1e-3)
    # A whole last row without its end, of a header that says more: edited by hand.
    path.write_text(trc(file, said=900)[:-1])
    assert read_clip(path).notes == (
        "the header says 900 frames, and there are 20: those are read",
    )
    # In the very last number: one decimal fewer than in all rows before.
    path.write_text(text[:-2])
    with pytest.raises(ClipError, match="cut off in line 26, in its last number: 19 whole frames"):
        read_clip(path)


def test_rows_that_end_early_lack_their_last_markers(path):
    points = FILE.points.copy()
    points[3:, 2:] = np.nan
    file = FILE.but(points=points)
    text = "".join(line.rstrip("\t") + "\n" for line in trc(file).splitlines())
    clip = reads(path, text, file)
    assert "rows with fewer cells than the header has columns, first in line" in clip.notes[0]
    row = text.splitlines()[8]
    path.write_text(text.replace(row, row.rpartition("\t")[0]))
    with pytest.raises(ClipError, match=r"line 9: [0-9]+ cells where the header has 14 columns"):
        read_clip(path)


def test_packed_with_gzip(tmp_path):
    path = tmp_path / "walk.trc.gz"
    content = gzip.compress(trc(marked(frames=400)).encode())
    reads(path, content, marked(frames=400))
    path.write_bytes(content[:-300])
    with pytest.raises(ClipError, match=r"walk\.trc\.gz: a damaged gzip file: Compressed file"):
        read_clip(path)
    clip = read_clip(path, salvage=True)
    assert 300 < clip.frames < 400
    np.testing.assert_allclose(clip.points, rounded(marked(frames=400))[: clip.frames] * 1e-3)

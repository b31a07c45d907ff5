"""Plain tables: columns of x, y and z in many spellings, with a unit or without."""

from __future__ import annotations

import numpy as np
import pytest
from table_files import marked, plain, rounded

from mocap_skel.errors import CallError, ClipError
from mocap_skel.readers import read_clip

FILE = marked(sep=",", rate=50.0)
SUBJECTS = FILE.but(labels=("Ann:LASI", "Ann:LKNE", "Ben:LASI", "Ben:LKNE"))


def reads(path, text, file=FILE, **options):
    path.write_text(text, "utf-8")
    clip = read_clip(path, **options)
    np.testing.assert_allclose(clip.points, rounded(file) * 1e-3, rtol=1e-13)
    return clip


@pytest.mark.parametrize(
    "spell",
    [
        "{label}_{axis}", "{label}.{AXIS}", "{label} {AXIS}", "{label}-{axis}", "{label}:{axis}",
        "{label}_{axis} [mm]", "{label}_{axis} (mm)", "{label}_{axis}_mm", "{label} [mm] {AXIS}",
        "{label}{AXIS}", '"{label}_{axis}"',
    ],
)  # fmt: skip
def test_spellings_of_the_columns(tmp_path, spell):
    clip = reads(tmp_path / "walk.csv", plain(FILE, spell=spell))
    assert clip.labels == FILE.labels
    assert (clip.rate, clip.unit, clip.up, clip.first_frame) == (50, "mm", "z", 1)
    assert ("mm by the size" in " ".join(clip.notes)) == ("mm" not in spell)
    clip = reads(tmp_path / "walk.csv", plain(SUBJECTS, spell=spell), SUBJECTS)
    assert clip.subject_names == ("Ann", "Ben")


@pytest.mark.parametrize(("sep", "comma"), [(",", False), (";", True), ("\t", True), ("\t", False)])
@pytest.mark.parametrize("name", ["walk.csv", "walk.tsv", "walk.txt", "walk"])
def test_delimiters_and_decimal_commas(tmp_path, name, sep, comma):
    file = FILE.but(sep=sep, comma=comma)
    text = "# made by a script\n\n" + plain(file, spell="{label}_{axis} [mm]")
    reads(tmp_path / name, "\ufeff" + text.replace("\n", "\r\n"), file)


def test_quoted_decimal_commas_between_commas(tmp_path):
    file = FILE.but(sep=";", comma=True)
    rows = plain(file).splitlines()
    text = rows[0].replace(";", ",") + "\n"
    for row in rows[1:]:
        text += ",".join(f'"{cell}"' for cell in row.split(";")) + "\n"
    reads(tmp_path / "walk.csv", text, file, unit="mm")
    # Without quotes nobody can tell which comma parts cells.
    (tmp_path / "walk.csv").write_text("\n".join(rows).replace(";", ",") + "\n")
    with pytest.raises(ClipError, match=r"line 2: [0-9]+ cells where the header has 14 columns"):
        read_clip(tmp_path / "walk.csv")


def test_units(tmp_path):
    path = tmp_path / "walk.csv"
    reads(path, plain(FILE), unit="mm")
    row = ",".join(["", "s", *["mm"] * 12])
    assert reads(path, plain(FILE, below=[row])).notes == ()
    in_column = [
        f"{line},{'unit' if i == 0 else 'mm'}" for i, line in enumerate(plain(FILE).splitlines())
    ]
    assert reads(path, "\n".join(in_column) + "\n").notes == ()
    metres = FILE.but(points=FILE.points / 1000)
    path.write_text(plain(metres, spell="{label}_{axis} [m]"))
    np.testing.assert_allclose(read_clip(path).points, rounded(metres))
    mixed = plain(FILE, spell="{label}_{axis} [mm]").replace("C7_x [mm]", "C7_x [cm]")
    path.write_text(mixed)
    with pytest.raises(ClipError, match="columns in different units: cm, mm"):
        read_clip(path)


def test_frames_and_times_in_any_words_or_none(tmp_path):
    path = tmp_path / "walk.csv"
    for frame, time in (("Frame#", "Time (s)"), ("Frame Number", "t"), (None, "seconds")):
        assert reads(path, plain(FILE, frame=frame, time=time), unit="mm").rate == 50
    thousand = FILE.but(rate=0.05)
    assert reads(path, plain(thousand, time="time [ms]"), unit="mm").rate == 50
    for frame in ("frame", None):
        path.write_text(plain(FILE, frame=frame, time=None))
        with pytest.raises(CallError, match=r"walk\.csv: no frame rate in it"):
            read_clip(path, unit="mm")
        assert reads(path, plain(FILE, frame=frame, time=None), unit="mm", rate=50).rate == 50
    # Times alone know that rows are not there.
    rows = plain(FILE, frame=None).splitlines(keepends=True)
    path.write_text("".join(rows[:8] + rows[10:]))
    expected = rounded(FILE)
    expected[7:9] = np.nan
    clip = read_clip(path, unit="mm")
    np.testing.assert_allclose(clip.points, expected * 1e-3)
    assert "2 frames without a row, the first of them 8" in clip.notes[0]
    path.write_text("".join(rows[:3] + [rows[3].replace("0.04", "0.055")] + rows[4:]))
    assert "its times are not even" in read_clip(path, unit="mm").notes[0]


def test_frame_numbers_that_do_not_rise_are_not_used(tmp_path):
    text = plain(FILE).replace("\n9,", "\n8,")
    assert "do not rise by whole steps, line 10" in reads(tmp_path / "a.csv", text).notes[0]
    text = plain(FILE).replace("\n9,", "\n,")
    assert "line 10 has no frame number" in reads(tmp_path / "a.csv", text).notes[0]


def test_columns_that_are_no_markers_are_named(tmp_path):
    path = tmp_path / "walk.csv"
    lines = plain(FILE, spell="{label}_{axis} [mm]").splitlines()
    extra = "Fx,Fy,Fz,subject,gaze_x,gaze_y,gaze_z,gaze_w"
    values = "1,2,3,Ann,0,0,0,1"
    path.write_text(
        "\n".join([f"{lines[0]},{extra}", *(f"{x},{values}" for x in lines[1:])]) + "\n"
    )
    clip = read_clip(path)
    assert clip.labels == FILE.labels
    assert clip.notes == (
        "8 columns that are no coordinates of a marker: subject, gaze_w, Fx, Fy, Fz, gaze_x, gaze_y, gaze_z",
    )


def test_two_columns_of_one_name_are_two_trajectories(tmp_path):
    clip = reads(
        tmp_path / "walk.csv", plain(FILE.but(labels=("LASI", "C7", "LASI", "LKNE"))), unit="mm"
    )
    assert clip.labels == ("LASI", "C7", "LASI_2", "LKNE")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a,b,c\n1,2,3\n", r"no columns of markers in line 1: a, b, c \.\.\."),
        ("LASI_x,LASI_y,C7_x,C7_y,C7_z\n1,2,3,4,5\n", "LASI has no column of z"),
        ("LASI_x,LASI_y,LASI_z\n", r"no points in it \(points: 1, frames: 0\)"),
        ("LASI_x,LASI_y,LASI_z\n1,2\n", "line 2: 2 cells where the header has 3 columns"),
        ("LASI_x,LASI_y,LASI_z\n1,2,3,4\n", "line 2: 4 cells where the header has 3 columns"),
        ("LASI_x,LASI_y,LASI_z\n1,x,3\n", r"line 2, column 2 \(LASI y\): 'x' is no number"),
        ("#\n#\n", "no line of columns' names in it"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(tmp_path, text, message):
    path = tmp_path / "walk.csv"
    path.write_text(text)
    with pytest.raises(ClipError, match=message):
        read_clip(path)


@pytest.mark.parametrize("name", ["walk.skeleton.csv", "walk.joints.csv", "walk.truth.csv"])
def test_joints_of_our_own_are_no_markers(tmp_path, name):
    path = tmp_path / name
    path.write_text(plain(FILE))
    with pytest.raises(
        ClipError, match="it holds joints that mocap-skel found, no markers"
    ) as error:
        read_clip(path)
    assert error.value.hint == "give the file of the markers that they were found in"

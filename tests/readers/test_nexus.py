"""CSV files of Vicon Nexus: trajectories among blocks of all else that it exports."""

from __future__ import annotations

import numpy as np
import pytest
from table_files import NEXUS_DEVICES, NEXUS_EVENTS, NEXUS_MODEL, marked, nexus, rounded

from mocap_skel.errors import ClipError
from mocap_skel.readers import read_clip

FILE = marked(labels=("Ann:LASI", "Ann:RASI", "Patient 2:C7", "*12"), first=101, sep=",")


def reads(path, text, file=FILE, columns=(0, 1, 2), **told):
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    clip = read_clip(path, **told)
    np.testing.assert_allclose(clip.points, rounded(file)[:, columns] * 1e-3, rtol=1e-13)
    assert (clip.labels, clip.subjects) == (("LASI", "RASI", "C7"), ("Ann", "Ann", "Patient 2"))
    assert clip.left_out == {"unlabelled": ("*12",)}
    assert (clip.rate, clip.first_frame, clip.zero_frame, clip.unit) == (100, 101, 1, "mm")
    return clip


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("", ""), ("\n\n", "\n"), (NEXUS_DEVICES, ""), ("", NEXUS_MODEL),
        (NEXUS_DEVICES + NEXUS_MODEL + "\n", "\n" + NEXUS_EVENTS), (NEXUS_EVENTS, NEXUS_MODEL),
        (NEXUS_MODEL.replace("Model Outputs", "Eye Tracks") + "\n", ""),
    ],
)  # fmt: skip
def test_the_trajectories_among_other_blocks_in_any_order(tmp_path, before, after):
    clip = reads(tmp_path / "walk.csv", nexus(FILE, before=before, after=after))
    words = [
        word
        for word in ("Devices", "Model outputs", "Eye tracks")
        if word.split()[0] in before + after
    ]
    said = [note for note in clip.notes if note.startswith("blocks that hold no markers")]
    assert said == (
        [f"blocks that hold no markers, which are not read: {', '.join(words)}"] if words else []
    )
    found = [(e.frame, e.label, e.context, e.subject) for e in clip.events]
    events = [(106, "Foot Strike", "Left", "Ann"), (111, "Foot Off", "Right", "Ann")]
    assert found == (events if "Foot" in before + after else [])


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("bom", [b"", b"\xef\xbb\xbf"])
@pytest.mark.parametrize(("sep", "comma"), [(",", False), (";", True), ("\t", True), ("\t", False)])
def test_line_ends_byte_marks_and_decimal_commas(tmp_path, end, bom, sep, comma):
    file = FILE.but(sep=sep, comma=comma)
    text = nexus(file, before=NEXUS_EVENTS.replace(",", sep) if not comma else "").replace(
        "\n", end
    )
    clip = reads(tmp_path / "walk.txt", bom + text.encode())
    assert len(clip.events) == (0 if comma else 2)


@pytest.mark.parametrize(
    "text",
    [
        nexus(FILE, fast=True),
        # As a spreadsheet saves it again.
        nexus(FILE, before=NEXUS_DEVICES.replace("\n\n", "\n" + "," * 13 + "\n"), ends=("," * 13, "," * 13)),
        nexus(FILE).replace("Trajectories\n100", '"Trajectories"\n"100"'),
        # Of Vicon Workstation.
        nexus(FILE, rate="100,Hz").replace("Trajectories", "TRAJECTORIES").replace("Frame,Sub Frame", "Field #,"),
        nexus(FILE, after="\n\n\n"),
    ],
)  # fmt: skip
def test_other_spellings(tmp_path, text):
    reads(tmp_path / "walk.csv", text)


def test_gaps_are_missing_and_the_unit_is_that_of_its_row(tmp_path):
    file = FILE.but(points=FILE.points.copy(), decimals=6)
    file.points[3, :] = np.nan
    clip = reads(tmp_path / "walk.csv", nexus(file), file)
    assert np.isnan(clip.points[3]).all()
    metres = file.but(points=file.points / 1000, unit="m", decimals=9)
    (tmp_path / "m.csv").write_text(nexus(metres))
    again = read_clip(tmp_path / "m.csv")
    assert again.unit == "m"
    np.testing.assert_allclose(again.points, clip.points, atol=1e-9)


WRONG = [
    (NEXUS_DEVICES + NEXUS_MODEL, "no block Trajectories in it, only Devices, Model outputs"),
    (nexus(FILE, after="\n" + nexus(FILE)), "a second block Trajectories in line 27"),
    (nexus(FILE).replace("Frame,Sub", "Bild,Sub"), "no line of axes below its Trajectories (line 1)"),
    (nexus(FILE).replace("X,Y,Z", "X,Y,W", 1), "line 4: Ann:LASI lacks y or z"),
    (nexus(FILE).replace("X,Y,Z", "A,B,C"), "line 4: no columns X, Y, Z of trajectories"),
    (nexus(FILE).replace("mm,mm,mm", "m,m,m", 1), "trajectories in different units: m, mm"),
    (nexus(FILE, before=NEXUS_DEVICES).replace("\n103,0,", "\n103,0,x", 1), "line 16, column 3 (Ann:LASI x)"),
    (nexus(FILE, after=NEXUS_MODEL).replace("\n103,0,", "\n103,0,1,2,", 1), "line 8: 16 cells"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "why"), WRONG)
def test_what_is_wrong_is_said_with_its_line(tmp_path, text, why):
    (tmp_path / "walk.csv").write_text(text)
    with pytest.raises(ClipError) as caught:
        read_clip(tmp_path / "walk.csv")
    assert why in str(caught.value)

"""CSV files of Motive: markers among all else that it exports."""

from __future__ import annotations

import numpy as np
import pytest
from table_files import marked, motive, rounded

from mocap_skel.errors import ClipError
from mocap_skel.readers import read_clip

FILE = marked(
    labels=("Ann:LASI", "Ann:RASI", "Racket:Marker1", "Unlabeled 1189"),
    rate=120.0, first=0, unit="Millimeters", sep=",",
)  # fmt: skip


def turned(name, kind="Rigid Body", error=True, seed=1):
    """The columns of a rigid body or a bone: rotation, position, error."""
    values = np.random.default_rng(seed).normal(size=(8, 20))
    columns = [(kind, name, "Rotation", axis, values[i]) for i, axis in enumerate("XYZW")]
    columns += [(kind, name, "Position", axis, 300 + values[4 + i]) for i, axis in enumerate("XYZ")]
    return columns + ([(kind, name, "Mean Marker Error", "", values[7])] if error else [])


def placed(name, kind="Rigid Body Marker"):
    """The columns of a marker where its body has it, with its quality."""
    axes = [(kind, name, "Position", axis, np.full(20, 5.0 + i)) for i, axis in enumerate("XYZ")]
    return [*axes, (kind, name, "Marker Quality", "", np.full(20, 0.9))]


BODIES = [
    *turned("Racket"), *placed("Racket:Marker 001"), *placed("Racket:Marker 002"),
    *turned("Ball", seed=2), *turned("Ann:Hip", "Bone", error=False),
    *placed("Ann:LASI", "Bone Marker"),
]  # fmt: skip


def reads(path, text, file=FILE, columns=(0, 1, 2)):
    path.write_text(text)
    clip = read_clip(path)
    np.testing.assert_allclose(clip.points, rounded(file)[:, columns] * 1e-3, rtol=1e-13)
    return clip


@pytest.mark.parametrize("version", ["1.2", "1.21", "1.22", "1.23", "1.24", "1.25"])
@pytest.mark.parametrize("named", [True, False])
def test_the_markers_among_bodies_bones_rotations_and_qualities(tmp_path, version, named):
    new = version in ("1.24", "1.25") and named
    text = motive(FILE, columns=BODIES, version=version, named=named, parent=new, code=new)
    clip = reads(tmp_path / "take.csv", text)
    assert clip.labels == ("LASI", "RASI", "Marker1")
    assert clip.subjects == ("Ann", "Ann", "Racket")
    assert clip.left_out == {"unlabelled": ("Unlabeled 1189",)}
    assert (clip.rate, clip.first_frame, clip.unit, clip.up, clip.up_by) == (120, 0, "mm", "y", "")
    assert clip.notes[0].endswith("places them: 3; those measured are read")


@pytest.mark.parametrize(
    "file",
    [
        FILE.but(sep=";", comma=True),
        FILE.but(sep="\t", comma=True),
        FILE.but(unit="Meters", points=FILE.points / 1000, decimals=6),
        FILE.but(unit="Centimeters", points=FILE.points / 10),
    ],
)
def test_decimal_commas_and_units(tmp_path, file):
    text = motive(file, columns=BODIES)
    (tmp_path / "take.csv").write_text("\ufeff" + text.replace("\n", "\r\n"), "utf-8")
    clip = read_clip(tmp_path / "take.csv")
    metres = {"Meters": 1, "Centimeters": 1e-2}.get(file.unit, 1e-3)
    np.testing.assert_allclose(clip.points, rounded(file)[:, :3] * metres, rtol=1e-12)


def test_markers_that_only_their_body_places_are_read_and_named(tmp_path):
    file = FILE.but(points=FILE.points[:, :2], labels=FILE.labels[:2])
    path = tmp_path / "take.csv"
    path.write_text(motive(file, columns=BODIES))
    clip = read_clip(path)
    assert clip.subjects == ("Racket", "Racket", "Ann", "Ann")
    np.testing.assert_allclose(clip.points[:, 2:], rounded(file) * 1e-3)
    assert "only as Motive's rigid body or bone places them: 2: Racket:Marker 001" in clip.notes[1]


def test_a_file_without_markers_says_what_it_holds(tmp_path):
    path = tmp_path / "take.csv"
    none = FILE.but(points=FILE.points[:, :0], labels=())
    path.write_text(motive(none, columns=[*turned("Racket"), *turned("Ann:Hip", "Bone")]))
    with pytest.raises(ClipError, match="no markers in it, only Bone, Rigid Body") as error:
        read_clip(path)
    assert error.value.hint == "export it from Motive with Markers switched on"


def test_damage(tmp_path):
    path = tmp_path / "take.csv"
    text = motive(FILE, columns=BODIES)
    path.write_text(text[:-30])
    with pytest.raises(ClipError, match=r"cut off in line 27, after \d+ cells of .*: 19 whole"):
        read_clip(path)
    assert read_clip(path, salvage=True).frames == 19
    rows = text.splitlines(keepends=True)
    path.write_text("".join(rows[:6]))
    with pytest.raises(ClipError, match="no line of columns in its header"):
        read_clip(path)
    path.write_text("".join(rows[:2] + rows[6:]))
    with pytest.raises(ClipError, match="no lines of types and names in its header"):
        read_clip(path)
    path.write_text(motive(FILE, columns=BODIES[:-4], said=40))
    assert "the header says 40 frames, and there are 20" in " ".join(read_clip(path).notes)
    # Column 5 of a position without its y.
    path.write_text(motive(FILE, columns=[*placed("Ann:C7", "Marker")[::2]]))
    with pytest.raises(ClipError, match="column 3: Ann:C7 has no x, y and z beside each other"):
        read_clip(path)

"""The door and the register: which reader reads a file, what is said of one that none can read, and a new format."""

from __future__ import annotations

import gzip
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from c3d_bytes import c3d_file, cloud
from recordings import ROOT, SAMPLES

from mocap_skel import readers
from mocap_skel.errors import CallError, ClipError
from mocap_skel.readers import read_clip, registry

PAGE = (ROOT / "docs" / "formats.md").read_text()
# The module of the page that says how a format is added.
(TOY,) = re.findall(r"```python\n(.*?)```", PAGE[PAGE.index("## Adding an input") :], re.S)
ALL = "it reads .c3d, .csv, .gz, .toy, .trc, .tsv or .txt"
CONTENT = "TOY 50 cm\nAnn:LFHD Ann:RFHD C7\n100 0 0 200 0 0 0 0 0\n100 1 0 nan nan nan 0 50 150\n"


@pytest.fixture
def toy(monkeypatch):
    """A format TOY for the length of a test."""
    registry.formats()
    monkeypatch.setattr(registry, "_registered", dict(registry._registered))
    exec(TOY, {"__name__": "toy"})


# --- A new format: one module, and this test of it ------------------------------------------------


def test_a_new_format_goes_all_the_way_to_a_clip(tmp_path, toy):
    path = tmp_path / "walk.toy"
    path.write_text(CONTENT)
    clip = read_clip(path)
    # (0, 0, 0) is no place of a marker, in any format.
    seen = [[[1, 0, 0], [2, 0, 0], [np.nan] * 3], [[1, 0.01, 0], [np.nan] * 3, [0, 0.5, 1.5]]]
    np.testing.assert_allclose(clip.points, seen, rtol=1e-15)
    assert clip.labels == ("LFHD", "RFHD", "C7")
    assert clip.subjects == ("Ann", "Ann", "")
    assert (clip.name, clip.rate, clip.unit, clip.up) == (str(path), 50.0, "cm", "z")
    assert (clip.first_frame, clip.left_out) == (1, {})
    assert clip.notes == ("samples at exactly (0, 0, 0) that count as missing: 1",)
    in_metres = read_clip(path, unit="m", rate=25)
    np.testing.assert_allclose(in_metres.points, 100 * np.array(seen), rtol=1e-15)
    assert in_metres.rate == 25.0
    with pytest.raises(CallError, match=r"^'parsecs' is no length unit"):
        read_clip(path, unit="parsecs")


def test_salvage_means_nothing_to_a_format_that_cannot(tmp_path, toy):
    path = tmp_path / "walk.toy"
    path.write_text(CONTENT)
    assert "TOY files are read whole or not at all" in read_clip(path, salvage=True).notes[0]
    c3d_file(path, cloud())
    assert read_clip(path, salvage=True).notes == ()


@pytest.mark.parametrize(
    ("content", "message", "hint"),
    [
        (CONTENT.replace("50 cm", "often cm"), "no sound TOY file: could not convert", None),
        (CONTENT + "1 2 3\n", "no sound TOY file: setting an array", None),
        ("TOY 50\n", "no sound TOY file: not enough values", None),
        ("TOY 50 cm\nC7\n", r"no points in it \(points: 1, frames: 0\)", None),
        ("TOY 0 cm\nC7\n1 2 3\n", "no frame rate in it", "give it with --rate"),
        (
            b"TOY 50 cm\nSch\xe4del\n1 2 3\n",
            r"not a text file in UTF-8 \(byte 13\)",
            "save it as UTF-8",
        ),
        ("", "an empty file", None),
    ],
)
def test_what_a_new_format_refuses_is_one_line_with_the_files_name(
    tmp_path, toy, content, message, hint
):
    path = tmp_path / "walk.toy"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    kind = CallError if "--rate" in (hint or "") else ClipError
    with pytest.raises(kind, match=rf"^{re.escape(str(path))}: {message}") as error:
        read_clip(path)
    assert error.value.hint == hint
    assert error.value.message.count("walk.toy") == 1 and "\n" not in error.value.message


def test_the_content_wins_over_the_suffix(tmp_path, toy):
    text, recorded = tmp_path / "text.C3D", tmp_path / "recorded.toy"
    text.write_text(CONTENT)
    c3d_file(recorded, cloud())
    assert read_clip(text).labels == ("LFHD", "RFHD", "C7")
    np.testing.assert_allclose(read_clip(recorded).points, cloud() / 1000, rtol=1e-6)
    bare = tmp_path / "bare"
    shutil.copy(recorded, bare)
    assert read_clip(bare).frames == 20


@pytest.mark.parametrize(
    ("name", "message", "hint"),
    [
        ("walk.toy", "not a TOY file", None),
        ("walk.TOY", "not a TOY file", None),
        ("walk.c3d", "not a C3D file", None),
        ("walk.xyz", "no kind of file that mocap-skel reads", ALL),
        ("walk", "no kind of file that mocap-skel reads", ALL),
    ],
)
def test_what_no_format_knows_is_told_with_those_that_there_are(tmp_path, toy, name, message, hint):
    path = tmp_path / name
    path.write_text("what is this?\n")
    with pytest.raises(ClipError) as error:
        read_clip(path)
    assert (error.value.message, error.value.hint) == (f"{path}: {message}", hint)


def test_where_the_first_bytes_do_not_tell_the_suffix_does(tmp_path, toy):
    @registry.register("table", suffixes=(".tab", ".list"), sniff=lambda head: None)
    def read(path, salvage):
        return registry.RawClip(cloud(), ("A", "B", "C"), 100.0, "mm")

    for name in ("a.tab", "b.LIST"):
        (tmp_path / name).write_text("A,B,C\n")
        assert read_clip(tmp_path / name).labels == ("A", "B", "C")
    (tmp_path / "c.dat").write_text("A,B,C\n")
    with pytest.raises(ClipError, match="no kind of file that mocap-skel reads"):
        read_clip(tmp_path / "c.dat")
    # A table that begins as C3D files do is none, and one called .c3d is nothing else.
    words = "XPelvis,YPelvis,ZPelvis\n" + "1.0,2.0,3.0\n" * 100
    (tmp_path / "d.tab").write_text(words)
    (tmp_path / "e.c3d").write_text(words)
    assert read_clip(tmp_path / "d.tab").labels == ("A", "B", "C")
    with pytest.raises(ClipError, match="no parameters in block 88"):
        read_clip(tmp_path / "e.c3d")


def test_a_packed_file_is_as_its_content(tmp_path):
    path = tmp_path / "still.c3d.gz"
    packed = gzip.compress((SAMPLES / "nearly_still.c3d").read_bytes())
    path.write_bytes(packed)
    found, whole = read_clip(path), read_clip(SAMPLES / "nearly_still.c3d")
    np.testing.assert_array_equal(found.points, whole.points)
    assert (found.name, found.labels, found.notes) == (str(path), whole.labels, ())
    path.write_bytes(gzip.compress(b"no clip"))
    with pytest.raises(ClipError, match=r"still\.c3d\.gz: not a C3D file"):
        read_clip(path)
    path.write_bytes(packed[:-20])
    with pytest.raises(ClipError, match=r"still\.c3d\.gz: a damaged gzip file: Compressed file"):
        read_clip(path)


def test_two_formats_of_one_name_are_a_mistake(toy):
    with pytest.raises(ValueError, match="there are two formats 'TOY'"):
        exec(TOY, {"__name__": "toy"})


def test_a_module_in_the_folder_is_all_that_the_program_needs(tmp_path):
    """The page's module, put beside the others, and the command line reads the format."""
    ignored = shutil.ignore_patterns("__pycache__", "page")
    shutil.copytree(ROOT / "mocap_skel", tmp_path / "mocap_skel", ignore=ignored)
    (tmp_path / "mocap_skel" / "readers" / "formats" / "toy.py").write_text(TOY)
    (tmp_path / "walk.toy").write_text(CONTENT)
    done = subprocess.run(
        [sys.executable, "-m", "mocap_skel", "inspect", "walk.toy"],
        cwd=tmp_path, env={"PYTHONPATH": str(tmp_path)}, capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert done.stdout.startswith("walk.toy: 2 frames at 50 Hz, first frame 1, unit cm, z up\n")


# --- Files that no reader can read ----------------------------------------------------------------


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
    with pytest.raises(CallError, match=f"{tmp_path.name}: a folder is no clip"):
        read_clip(tmp_path)


@pytest.mark.skipif(not Path("/dev/fd").is_dir(), reason="a pipe has no name")
def test_a_pipe_is_refused_before_it_is_read_empty(path):
    """Its bytes come once; the format is known by the first of them, and the reader would get the rest."""
    reading, writing = os.pipe()
    os.write(writing, c3d_file(path, cloud()).read_bytes())
    os.close(writing)
    with pytest.raises(ClipError, match=f"^/dev/fd/{reading}: a pipe or a device, and no file"):
        read_clip(f"/dev/fd/{reading}")
    os.close(reading)


def test_a_file_without_parameters_is_named(path, capfd):
    path.write_bytes(b"\2\x50" + bytes(3000))
    with pytest.raises(ClipError, match=r"clip\.c3d: no parameters in block 2, where its header"):
        read_clip(path)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("shape", [(10, 0, 3), (0, 3, 3)])
def test_no_points_is_an_error(path, shape):
    with pytest.raises(ClipError, match=r"clip\.c3d: "):
        read_clip(c3d_file(path, np.ones(shape)))


def test_the_door_is_the_only_way():
    assert readers.__all__ == ["read_clip"]

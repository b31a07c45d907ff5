"""The door: which reader reads a file, and what is said of one that none can read."""

from __future__ import annotations

import numpy as np
import pytest
from c3d_bytes import c3d_file

from mocap_skel import readers
from mocap_skel.errors import ClipError
from mocap_skel.readers import read_clip
from mocap_skel.readers.c3d import with_ezc3d


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


def test_the_door_is_the_only_way():
    assert readers.__all__ == ["read_clip"]

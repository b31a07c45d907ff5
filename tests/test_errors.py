"""The ground: foreign errors become ours in one place, texts are read, libraries are missed in one line."""

import pickle
import struct

import pytest

from mocap_skel.errors import (
    AssociationError,
    CallError,
    ClipError,
    MissingExtraError,
    OutputError,
    RootError,
    SkeletonError,
    ours,
    reason,
    refusals,
)
from mocap_skel.export.calibration_json import read_calibration
from mocap_skel.export.files import check_folder, check_free, write_all
from mocap_skel.extras import extra
from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.labels.association import read_association
from mocap_skel.text import counted, listed, nearest, read_text


def told(place, kind, error, foreign=None):
    """Message and hint of what `ours` makes of an error."""
    with pytest.raises(kind) as raised, ours(place, kind, foreign):
        raise error
    assert str(raised.value) == raised.value.message
    return raised.value.message, raised.value.hint


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (OSError(2, "No such file"), "walk.c3d: No such file"),
        # Of a file that the system names, that name is told: a folder in the way, say.
        (OSError(20, "Not a directory", "out/x"), "out/x: Not a directory"),
        (OSError("not seekable"), "walk.c3d: not seekable"),
        (ClipError("no points"), "walk.c3d: no points"),
        (ClipError("walk.c3d: no points"), "walk.c3d: no points"),
        (ClipError("walk.c3d:3:1: no number"), "walk.c3d:3:1: no number"),
        (ClipError("walk.c3d.gz is packed"), "walk.c3d: walk.c3d.gz is packed"),
    ],
)
def test_an_error_gets_the_name_of_its_file_once(error, message):
    assert told("walk.c3d", ClipError, error) == (message, None)


def test_text_that_is_none_says_where_and_what_to_do():
    bad = UnicodeDecodeError("utf-8", b"ab\xff", 2, 3, "invalid start byte")
    message = "map.txt: not a text file in UTF-8 (byte 2)"
    assert told("map.txt", AssociationError, bad) == (message, "save it as UTF-8")


def test_what_a_caller_says_of_an_error_comes_first():
    foreign = refusals((struct.error, OSError), "damaged")
    assert told("a.c3d", ClipError, struct.error("short\n read"), foreign)[0] == (
        "a.c3d: damaged: short read"
    )
    assert told(None, ClipError, OSError(5, "Bad"), foreign)[0] == "damaged: [Errno 5] Bad"
    assert reason(AssertionError()) == "AssertionError"


def test_errors_of_another_kind_and_those_that_nobody_expects_pass_as_they_are():
    for error in (CallError("--rate"), ZeroDivisionError("division"), MemoryError()):
        with pytest.raises(type(error)) as raised, ours("walk.c3d", ClipError):
            raise error
        assert raised.value is error
        assert "walk" not in str(error)


def test_a_named_error_keeps_what_it_knows_and_can_be_sent():
    """To another process, as the errors of a child are."""
    with pytest.raises(RootError) as raised, ours("walk.c3d", RootError):
        raise RootError("no Hips", "another root", ("Chest",))
    again = pickle.loads(pickle.dumps(raised.value))
    assert (again.message, again.hint, again.seen) == (
        "walk.c3d: no Hips",
        "another root",
        ("Chest",),
    )
    with pytest.raises(ClipError) as raised, ours("walk.c3d", ClipError):
        raise OSError(2, "No such file")
    assert isinstance(raised.value.__cause__, OSError)


LONG = "a" * 300


@pytest.mark.parametrize(
    ("kind", "read"),
    [
        (AssociationError, lambda folder: read_association(folder / LONG)),
        (AssociationError, lambda folder: read_association(folder / "long.txt")),
        (SkeletonError, lambda folder: read_skeleton(folder / LONG)),
        (SkeletonError, lambda folder: read_skeleton(folder / "long.toml")),
        (CallError, lambda folder: read_calibration(folder / LONG)),
        (AssociationError, lambda folder: read_text(folder / LONG, AssociationError)),
        (OutputError, lambda folder: check_free([folder / LONG], overwrite=True)),
        (OutputError, lambda folder: check_folder(folder / LONG)),
        (OutputError, lambda folder: write_all({folder / LONG: ""}, overwrite=True)),
        (OutputError, lambda folder: write_all({folder / LONG / "x": ""}, overwrite=True)),
    ],
)
def test_a_name_that_the_system_cannot_look_at_is_one_line(tmp_path, kind, read):
    """Not trouble with standard output, which is what is left of an OSError at the last door."""
    (tmp_path / "long.txt").write_text(f"@skeleton {LONG}\nLFWT LFWT\n")
    (tmp_path / "long.toml").write_text(f'like = "{LONG}"\n[[segment]]\nname = "Hips"\n')
    with pytest.raises(kind, match=r"^[^\n]*: File name too long$") as error:
        read(tmp_path)
    assert str(tmp_path) in error.value.message
    assert {path.name for path in tmp_path.iterdir()} == {"long.txt", "long.toml"}


def test_a_figure_that_a_file_names_is_missed_in_its_line_and_one_of_the_call_is_not(tmp_path):
    path = tmp_path / "map.txt"
    path.write_text("# my own\n@skeleton nix\nLFWT LFWT\n")
    with pytest.raises(SkeletonError) as error:
        read_association(path)
    assert error.value.message == f"{path}:2: nix: no such skeleton file"
    with pytest.raises(SkeletonError) as error:
        read_association(path, "nux")
    assert error.value.message == "nux: no such skeleton file"


def test_a_text_with_and_without_a_byte_order_mark(tmp_path):
    for mark in (b"", b"\xef\xbb\xbf"):
        (tmp_path / "map.txt").write_bytes(mark + "Zoë\n".encode())
        assert read_text(tmp_path / "map.txt", AssociationError) == "Zoë\n"


def test_words_for_people():
    assert [counted(n, "label") for n in (0, 1, 2)] == ["0 labels", "1 label", "2 labels"]
    assert [counted(n, "axis", "axes") for n in (1, 2)] == ["1 axis", "2 axes"]
    assert listed("ABCDEFGH") == "A, B, C, D, E, F, G, H"
    assert listed("ABCDEFGHIJ") == "A, B, C, D, E, F, G, H and 2 more"
    assert listed("ABC", 1) == "A and 2 more"
    assert nearest("lfwt", ["RFWT", "LFWT"]) == "did you mean LFWT or RFWT?"
    assert nearest("lfwt", ["RFWT", "LFWT"], 0.8) == "did you mean LFWT?"
    assert nearest("C7", ["LFWT"]) is None


def test_a_library_that_is_missing_is_one_line_with_what_to_do():
    assert extra("struct", "plot") is struct
    with pytest.raises(MissingExtraError, match=r"^this needs nosuchlib, which is not") as error:
        extra("nosuchlib.inner", "plot")
    assert error.value.hint == "pip install 'mocap-skel[plot]'"

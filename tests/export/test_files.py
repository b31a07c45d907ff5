"""Files that are written whole or not at all, and never over an input."""

import os
import re
import stat
from pathlib import Path

import pytest
from commands import files
from hypothesis import given, settings
from hypothesis import strategies as st

from mocap_skel.errors import OutputError
from mocap_skel.export.files import check_free, safe_name, write_all


def without_links(*_):
    raise PermissionError(1, "Operation not permitted")


class TestWriteAll:
    def test_contents_are_there_to_the_byte(self, tmp_path):
        write_all({tmp_path / "a.csv": "x\ny\n", tmp_path / "new" / "b.csv": "ü"}, overwrite=False)
        assert (tmp_path / "a.csv").read_bytes() == b"x\ny\n"
        assert (tmp_path / "new" / "b.csv").read_bytes() == "ü".encode()
        assert files(tmp_path) == ["a.csv", "new/b.csv"]

    def test_an_existing_file_stays_and_nothing_else_is_written(self, tmp_path):
        (tmp_path / "b").write_text("mine")
        with pytest.raises(OutputError, match="b: exists already") as caught:
            write_all({tmp_path / "a": "1", tmp_path / "b": "2"}, overwrite=False)
        assert "--overwrite" in caught.value.hint
        assert files(tmp_path) == ["b"]
        assert (tmp_path / "b").read_text() == "mine"
        write_all({tmp_path / "a": "1", tmp_path / "b": "2"}, overwrite=True)
        assert (tmp_path / "b").read_text() == "2"

    def test_a_folder_in_the_way_is_refused_even_with_overwrite(self, tmp_path):
        (tmp_path / "b").mkdir()
        with pytest.raises(OutputError, match="b: is a folder"):
            write_all({tmp_path / "a": "1", tmp_path / "b": "2"}, overwrite=True)
        assert files(tmp_path) == []

    def test_a_file_in_place_of_the_folder_is_refused(self, tmp_path):
        (tmp_path / "out").write_text("mine")
        with pytest.raises(OutputError, match="out"):
            write_all({tmp_path / "a": "1", tmp_path / "out" / "b": "2"}, overwrite=True)
        assert files(tmp_path) == ["out"]

    @pytest.mark.parametrize("overwrite", [False, True])
    def test_a_second_file_that_cannot_be_written_takes_the_first_with_it(
        self, tmp_path, monkeypatch, overwrite
    ):
        import mocap_skel.export.files as module

        if overwrite:
            (tmp_path / "a").write_text("old")
        original, made = module.mkstemp, []

        def full_disk(*args, **options):
            made.append(options.get("prefix"))
            if len(made) == 2:
                raise OSError(28, "No space left on device", str(tmp_path / ".temporary"))
            return original(*args, **options)

        monkeypatch.setattr(module, "mkstemp", full_disk)
        with pytest.raises(OutputError, match="b: No space left on device"):
            write_all({tmp_path / "a": "1", tmp_path / "b": "2"}, overwrite)
        assert len(made) == 2
        assert files(tmp_path) == (["a"] if overwrite else [])
        if overwrite:
            assert (tmp_path / "a").read_text() == "old"

    def test_a_second_file_that_cannot_be_renamed_takes_the_first_with_it(
        self, tmp_path, monkeypatch
    ):
        """Where nothing may be replaced, too: on a disk without links."""
        original, moved = Path.replace, []

        def refused(self, target):
            moved.append(target)
            if len(moved) == 2:
                raise OSError(13, "Permission denied", str(target))
            return original(self, target)

        monkeypatch.setattr(Path, "replace", refused)
        monkeypatch.setattr(os, "link", without_links)
        with pytest.raises(OutputError, match="b: Permission denied"):
            write_all({tmp_path / "a": "1", tmp_path / "b": "2"}, overwrite=False)
        assert files(tmp_path) == []

    def test_an_interrupt_leaves_nothing_behind(self, tmp_path, monkeypatch):
        def interrupted(self, target):
            raise KeyboardInterrupt

        monkeypatch.setattr(Path, "replace", interrupted)
        monkeypatch.setattr(os, "link", without_links)
        with pytest.raises(KeyboardInterrupt):
            write_all({tmp_path / "a": "1", tmp_path / "b": "2"}, overwrite=False)
        assert files(tmp_path) == []

    def test_a_name_too_long_is_one_clear_error(self, tmp_path):
        with pytest.raises(OutputError):
            write_all({tmp_path / ("x" * 300): "1"}, overwrite=False)
        assert files(tmp_path) == []

    @pytest.mark.parametrize("mask", [0o022, 0o077, 0o002])
    def test_permissions_are_what_the_umask_allows(self, tmp_path, mask):
        old = os.umask(mask)
        try:
            write_all({tmp_path / "a": "1"}, overwrite=False)
            # It looks at the mask by setting it; it has to set it back.
            assert os.umask(mask) == mask
        finally:
            os.umask(old)
        assert stat.S_IMODE((tmp_path / "a").stat().st_mode) == 0o666 & ~mask

    def test_check_free_writes_nothing(self, tmp_path):
        check_free([tmp_path / "deep" / "a"], overwrite=False)
        assert list(tmp_path.iterdir()) == []


class TestSafeName:
    @pytest.mark.parametrize(
        ("name", "safe"),
        [
            ("Derrick", "Derrick"),
            ("../../x", "x"),
            ("..", "subject"),
            ("", "subject"),
            ("   ", "subject"),
            ("/etc/passwd", "etc_passwd"),
            ("C:\\temp\\x", "C_temp_x"),
            (".hidden", "hidden"),
            ("Jürgen Groß", "Jürgen_Groß"),
            ("花子", "花子"),
            ("a\0b\nc", "a_b_c"),
            ("Player 1 (left)", "Player_1_left"),
        ],
    )
    def test_known_names(self, name, safe):
        assert safe_name(name) == safe

    @settings(derandomize=True, deadline=None, max_examples=60, database=None)
    @given(st.text(max_size=30))
    def test_no_name_leaves_the_folder(self, name):
        safe = safe_name(name)
        assert safe
        assert Path(safe).name == safe
        assert not safe.startswith(".")
        assert not re.search(r"[\s/\\:\0*?\"<>|]", safe)
        assert safe_name(safe) == safe

"""One clip by itself may take no more memory than one of many: what needs more is one line, and nothing is written."""

from __future__ import annotations

import errno
import resource
import shutil
from pathlib import Path

import numpy as np
import pytest
from recordings import SAMPLES

from mocap_skel.cli import main
from mocap_skel.errors import ClipError
from mocap_skel.labels import guess
from mocap_skel.labels.association import read_association
from mocap_skel.pipeline import clip_files, job, limits
from mocap_skel.pipeline.clip_files import process
from mocap_skel.pipeline.job import Job

pytestmark = pytest.mark.skipif(
    not Path("/proc/self/statm").exists(), reason="memory is limited on Linux only"
)


@pytest.fixture
def clip(tmp_path):
    return Path(shutil.copy(SAMPLES / "nearly_still.c3d", tmp_path / "clip.c3d"))


def test_a_clip_by_itself_that_needs_too_much_is_one_line(clip, tmp_path, monkeypatch):
    monkeypatch.setattr(limits, "MEMORY", limits.GIGABYTE // 2)
    monkeypatch.setattr(clip_files, "render", lambda *_: np.ones(limits.GIGABYTE, np.uint8))
    before = resource.getrlimit(resource.RLIMIT_AS)
    with pytest.raises(ClipError, match=r"clip\.c3d: needs more than 0\.5 GB of memory$"):
        process(clip, Job(read_association("cmu"), folder=tmp_path / "out"))
    assert resource.getrlimit(resource.RLIMIT_AS) == before
    assert not (tmp_path / "out").exists()


def too_much(*_, **__):
    return np.ones(limits.GIGABYTE, np.uint8)


@pytest.mark.parametrize(
    "words", [["inspect"], ["assoc", "check"], ["assoc", "guess"], ["calibrate", "--assoc", "cmu"]]
)
def test_the_limit_holds_while_markers_are_named_and_in_every_fit(clip, words, monkeypatch, capsys):
    monkeypatch.setattr(limits, "MEMORY", limits.GIGABYTE // 2)
    if words[0] == "calibrate":
        monkeypatch.setattr(job, "fit_skeleton", too_much)
        words = [*words, "-o", str(clip.with_name("out.json"))]
    else:
        monkeypatch.setattr(guess, "guess_association", too_much)
    with pytest.raises(SystemExit, match="3"):
        main([*words, str(clip)])
    assert "clip.c3d: needs more than 0.5 GB of memory\n" in capsys.readouterr().err
    assert list(clip.parent.iterdir()) == [clip]


def test_the_limit_grows_with_the_file_and_ends_with_the_work(clip):
    assert limits.memory_for(clip) == 2 * limits.GIGABYTE
    with clip.open("ab") as file:
        file.truncate(limits.GIGABYTE)
    assert limits.memory_for(clip) == 20 * limits.GIGABYTE
    assert limits.memory_for(clip.with_name("none.c3d")) == 2 * limits.GIGABYTE
    before = resource.getrlimit(resource.RLIMIT_AS)
    with pytest.raises(KeyError), limits.limited(clip):  # noqa: PT012
        assert resource.getrlimit(resource.RLIMIT_AS)[0] > 0
        raise KeyError
    assert resource.getrlimit(resource.RLIMIT_AS) == before


@pytest.mark.parametrize(
    ("error", "is_want"),
    [
        (MemoryError(), True),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), True),
        (OSError(errno.ENOENT, "No such file"), False),
        (ImportError("libx.so: failed to map segment from shared object"), True),
        (ImportError("no module named x"), False),
    ],
)
def test_want_of_memory_has_many_names(error, is_want):
    assert limits.starved(error) == is_want


def test_a_limit_that_the_user_has_set_is_never_raised(clip):
    before = resource.getrlimit(resource.RLIMIT_AS)
    reserved, _ = limits.used_memory()
    own = reserved + limits.GIGABYTE // 2
    resource.setrlimit(resource.RLIMIT_AS, (own, before[1]))
    try:
        with limits.limited(clip):
            assert resource.getrlimit(resource.RLIMIT_AS)[0] == own
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)

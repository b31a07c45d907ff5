"""No command writes over a file that it reads, whatever its options and whatever path leads there."""

import os
import shutil

import pytest
from commands import STILL, files
from recordings import ROOT

from mocap_skel.cli import main

MAP = ROOT / "association_files" / "cmu.txt"
# Command → the file that it writes for walk.c3d, and its options.
CALLS = {
    "calibrate": ("actor.json", ["calibrate", "-a", "cmu", "-o", "{target}"]),
    "fit": ("walk.joints.csv", ["fit", "-a", "cmu", "-o", "{folder}"]),
    "fit c3d": ("walk.skeleton.c3d", ["fit", "-a", "cmu", "-f", "c3d", "-o", "{folder}"]),
    "report": ("walk.report.html", ["report", "-a", "cmu", "-o", "{folder}"]),
    "draw": ("pose.png", ["draw", "-a", "cmu", "-o", "{target}"]),
    "draw in a folder": ("walk.pose.png", ["draw", "-a", "cmu", "-o", "{folder}"]),
    "guess": ("lab.txt", ["assoc", "guess", "-o", "{target}"]),
    "guess by motion": ("figure.toml", ["assoc", "guess", "--by-motion", "-o", "{target}"]),
    "study": (
        "walk.resample.answers.csv",
        ["study", "resample", "-a", "cmu", "--levels", "1", "--no-figures", "-o", "{folder}"],
    ),
}
WAYS = {
    "hard link": lambda clip, target: os.link(clip, target),
    "symbolic link": lambda clip, target: target.symlink_to(clip),
    "relative link": lambda clip, target: target.symlink_to(os.path.relpath(clip, target.parent)),
    "link to it": lambda clip, target: (shutil.move(clip, target), clip.symlink_to(target)),
}


@pytest.fixture
def call(capsys):
    """The exit code of a call, and what it printed."""

    def run(*arguments):
        with pytest.raises(SystemExit) as end:
            main([str(a) for a in arguments])
        printed = capsys.readouterr()
        return end.value.code, printed.out + printed.err

    return run


@pytest.fixture
def refused(call):
    """What a call says that would write over an input."""

    def run(*arguments):
        code, said = call(*arguments, "--overwrite", "-q")
        assert code == 2 and "is an input of this call (use another -o)" in said, said
        assert "wrote" not in said
        return said

    return run


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("command", CALLS)
def test_a_result_that_is_the_clip_by_another_name_is_refused(tmp_path, refused, command, way):
    clip, folder = tmp_path / "in" / "walk.c3d", tmp_path / "out"
    clip.parent.mkdir()
    folder.mkdir()
    shutil.copy(STILL, clip)
    name, options = CALLS[command]
    target = folder / name
    WAYS[way](clip, target)
    said = refused(*(part.format(target=target, folder=folder) for part in options), clip)
    assert f"{target}: is an input" in said
    for path in (clip, target):
        assert path.read_bytes() == STILL.read_bytes()
    assert files(tmp_path) == ["in/walk.c3d", f"out/{name}"]


@pytest.mark.parametrize("spelt", ["{clip}", "{folder}/../in/walk.c3d", "{folder}/./walk.c3d"])
@pytest.mark.parametrize("command", [("calibrate", "-a", "cmu"), ("assoc", "guess")])
def test_a_clip_that_is_named_as_the_result_stays(tmp_path, refused, command, spelt):
    clip = tmp_path / "in" / "walk.c3d"
    clip.parent.mkdir()
    shutil.copy(STILL, clip)
    refused(*command, clip, "-o", spelt.format(clip=clip, folder=clip.parent))
    assert clip.read_bytes() == STILL.read_bytes()


def test_each_clip_of_a_call_is_an_input(tmp_path, call):
    one, two = tmp_path / "walk.c3d", tmp_path / "walk.skeleton.c3d"
    for path in (one, two):
        shutil.copy(STILL, path)
    code, said = call("fit", one, two, "-a", "cmu", "-f", "c3d", "-o", tmp_path, "--overwrite")
    assert code == 1 and f"{two}: is an input of this call" in said
    # The other has a result of its own.
    assert files(tmp_path) == ["walk.c3d", "walk.skeleton.c3d", "walk.skeleton.skeleton.c3d"]
    assert one.read_bytes() == two.read_bytes() == STILL.read_bytes()


def test_association_skeleton_and_calibration_are_inputs_too(tmp_path, call, refused):
    own, figure, actor = (tmp_path / name for name in ("map.txt", "figure.toml", "actor.json"))
    shutil.copy(MAP, own)
    shutil.copy(ROOT / "mocap_skel" / "figure" / "skeletons" / "human.toml", figure)
    calibrate = ("calibrate", STILL, "-a", own, "--skeleton", figure)
    assert call(*calibrate, "-o", actor)[0] == 0
    before = actor.read_bytes()
    refused(*calibrate, "-o", own)
    refused(*calibrate, "-o", figure)
    os.link(actor, tmp_path / "nearly_still.joints.csv")
    refused("fit", STILL, "-a", own, "--calibration", actor, "-o", tmp_path)
    assert own.read_bytes() == MAP.read_bytes()
    assert actor.read_bytes() == before


def test_what_is_no_input_is_still_replaced(tmp_path, call):
    old = tmp_path / "actor.json"
    old.write_text("old")
    assert call("calibrate", STILL, "-a", "cmu", "-o", old, "--overwrite")[0] == 0
    assert old.read_text() != "old"

"""What a clip's results were made with: the side file of `--format about`, the line of `--json`, the metadata of others."""

import hashlib
import json

import pytest
from commands import run
from recordings import SAMPLES

from mocap_skel import __version__, associate, fit_skeleton, read_association, read_clip, write_fit

STILL = SAMPLES / "nearly_still.c3d"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("about")
    call = ["fit", STILL, "--assoc", "cmu", "--prior", "none", "--format", "bvh", "--smooth", "6"]
    done = run(*call, "--format", "about", "-o", "out", "--json", "-q", cwd=folder)
    assert done.returncode == 0, done.stderr
    return json.loads((folder / "out/nearly_still.about.json").read_text()), done.stdout


def test_it_names_clip_version_options_and_labels(made):
    about, _ = made
    assert about["sha256"] == hashlib.sha256(STILL.read_bytes()).hexdigest()
    assert about["version"] == __version__
    assert about["options"]["assoc"] == "cmu.txt"
    assert about["options"]["prior"] == "none"
    assert about["options"]["formats"] == {"bvh": {"smooth": 6.0}, "about": {}}
    assert about["markers"]["UpperRightArm"]["RELB"] == "RELB"


def test_json_ends_with_the_same_version_and_options(made):
    about, printed = made
    last = json.loads(printed.splitlines()[-1])
    assert last["table"] == "about"
    assert {key: last[key] for key in ("version", "options")} == {
        key: about[key] for key in ("version", "options")
    }


def test_from_python_it_has_the_formats_options(tmp_path):
    clip, known = read_clip(STILL), read_association("cmu")
    fit = fit_skeleton(clip, associate(clip, known)[0], known.skeleton)
    _, about = write_fit(fit, clip, tmp_path, ["bvh", "about"], trim=True)
    told = json.loads(about.read_text())
    assert (told["version"], told["options"]) == (
        __version__,
        {"formats": {"bvh": {"trim": True}, "about": {}}},
    )

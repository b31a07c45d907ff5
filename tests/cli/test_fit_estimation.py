"""The options of `fit` that say how it estimates: method, noise, sigma."""

import json
import re

import numpy as np
import pytest
from commands import ROM, STILL, files, run, without
from recordings import fit_clip

from mocap_skel import read_clip


def test_the_method_is_in_the_results_and_needs_no_scipy(tmp_path):
    call = ["fit", STILL, "--assoc", "cmu", "--method", "lls", "--json", "-q"]
    done = without("scipy", *call, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert [row["method"] for row in rows] == ["LLS"] * 14
    assert (tmp_path / "nearly_still.joints.csv").read_text().count(",LLS,") == 14


def test_a_joint_that_the_method_cannot_fit_is_a_row_with_the_reason(tmp_path):
    call = ["fit", STILL, "--assoc", "cmu", "--method", "ugdk"]
    done = run(*call, "--prior", "none", cwd=tmp_path)
    assert done.returncode == 0
    assert "12 of 14 joints fitted" in done.stdout
    assert re.search(r"^RightWrist +- .* UGDK: the noise is no smaller", done.stdout, re.M)
    assert "joints not fitted: RightWrist (UGDK: " in done.stderr
    done = run(*call, "--overwrite", cwd=tmp_path)
    assert "joints from anatomy alone: RightWrist (UGDK: " in done.stderr
    assert re.search(r"^RightWrist +no +PRIOR .* UGDK: the noise is no smaller", done.stdout, re.M)


def test_three_lengths_are_the_noise_along_the_axes(tmp_path):
    call = ["fit", STILL, "--assoc", "cmu", "--sigma", "1mm,0.1cm,3mm", "--json"]
    done = run(*call, cwd=tmp_path)
    assert done.returncode == 0
    fit = fit_clip(read_clip(STILL), sigma=np.diag(np.square((0.001, 0.001, 0.003))))
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    for row, joint in zip(rows, fit.joints, strict=True):
        # Micrometres.
        np.testing.assert_allclose([row[k] for k in "xyz"], joint.centre, rtol=0, atol=0.6e-6)


@pytest.mark.parametrize("noise", ["matrix", "marker"])
def test_the_noise_is_estimated_as_asked(tmp_path, noise):
    done = run("fit", STILL, "--assoc", "cmu", "--noise", noise, "-q", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    clip = read_clip(STILL)
    fit = fit_clip(clip, noise=noise)
    x, y, z = fit.joints[0].centre
    row = (tmp_path / "nearly_still.joints.csv").read_text().splitlines()[1].split(",")
    np.testing.assert_allclose([float(v) for v in row[3:6]], [x, y, z], rtol=0, atol=0.6e-6)


@pytest.mark.parametrize(
    ("options", "what"),
    [
        (["--method", "gdke", "--noise", "matrix"], "gdke takes no noise matrix"),
        (["--method", "pratt", "--noise", "marker"], "pratt takes no noise matrix"),
        (["--method", "lls", "--sigma", "1mm,1mm,3mm"], "lls takes no noise: leave sigma out"),
        (["--noise", "marker", "--sigma", "1mm"], "leave one of them out"),
        (["--method", "lss"], "'lss' is not one of"),
        (["--sigma", "1mm,2mm"], "one length, or three for x, y and z"),
        (["--sigma", "1mm,1mm,3"], "with its unit"),
        (["--sigma", "1mm,,3mm"], "with its unit"),
    ],
)
def test_options_that_do_not_go_together_are_2_and_one_message(tmp_path, options, what):
    done = run("fit", STILL, "--assoc", "cmu", *options, cwd=tmp_path)
    assert done.returncode == 2
    assert what in done.stderr
    assert len([line for line in done.stderr.splitlines() if "rror: " in line]) == 1
    assert (done.stdout, files(tmp_path)) == ("", [])


def test_an_mle_without_scipy_is_one_line_that_says_what_to_install(tmp_path):
    """However many clips there are."""
    call = ["fit", STILL, ROM, "--assoc", "cmu", "--method", "mle"]
    done = without("scipy", *call, cwd=tmp_path)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert "pip install 'mocap-skel[mle]'" in done.stderr
    assert (done.stdout, files(tmp_path)) == ("", [])

"""A clip with a negated axis on the command line: refused with what to do, right with --mirror."""

import numpy as np
import pytest
from click.testing import CliRunner
from recordings import ROOT

from mocap_skel import read_clip
from mocap_skel.artificial import Faults, human, marker_set, record, walk, write_c3d
from mocap_skel.cli.fit import command


@pytest.fixture(scope="module")
def mirrored(tmp_path_factory):
    """A file whose y is negated, and the recording as it was."""
    recording = record(human(), marker_set("cmu"), walk(3, 60), Faults(sigma=0.001))
    path = tmp_path_factory.mktemp("mirrored") / "walk.c3d"
    truth = recording.points.copy()
    recording.points[..., 1] *= -1
    write_c3d(recording, path)
    return path, truth


def run(path, *options):
    call = [str(path), *options]
    return CliRunner().invoke(command, call, standalone_mode=False, catch_exceptions=False)


@pytest.mark.parametrize("options", [(), ("--assoc", str(ROOT / "association_files/cmu.txt"))])
def test_a_mirrored_clip_is_refused_and_the_hint_says_why(mirrored, tmp_path, options):
    done = run(mirrored[0], *options, "-o", str(tmp_path))
    assert done.return_value == 2
    assert "the body is mirrored" in done.stderr and "--mirror x" in done.stderr
    assert not list(tmp_path.iterdir())


def test_mirror_negates_the_axis_and_a_copy_keeps_the_files_own(mirrored, tmp_path):
    path, truth = mirrored
    assert np.allclose(read_clip(path, mirror="y").points, truth, atol=1e-6, equal_nan=True)
    done = run(path, "--mirror", "y", "-f", "c3d", "-f", "csv", "-o", str(tmp_path))
    assert done.return_value == 0
    assert "y is negated, as --mirror says" in done.stderr
    copy = read_clip(tmp_path / "walk.skeleton.c3d")
    assert np.allclose(copy.points, truth * [1, -1, 1], atol=1e-6, equal_nan=True)


def test_labels_can_be_trusted_all_the_same(mirrored, tmp_path):
    done = run(mirrored[0], "--trust-labels", "-o", str(tmp_path))
    assert done.return_value == 0
    assert "the body looks mirrored" in done.stderr

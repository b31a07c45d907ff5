"""What points up comes from a body that stands; one that lies, crawls or walks on its hands turns nothing over."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from c3d_bytes import c3d_file
from commands import call
from recordings import clip_of, fit_clip, known, rendered

from mocap_skel import associate, read_clip
from mocap_skel.artificial import Faults, human, marker_set, record, still, walk
from mocap_skel.clip import UPS, turn_between, vertical
from mocap_skel.errors import CallError
from mocap_skel.report.scene import scene
from mocap_skel.results.upright import upright, upright_by_names


@cache
def recorded(motion):
    made = motion(4, 60, seed=1)
    recording = record(human(), marker_set("cmu"), made, Faults(sigma=0.001), seed=1)
    return replace(clip_of(recording, motion.__name__), up_by="")


def as_if(clip, up, **said):
    """The clip in axes of which `up` points up, though it says z."""
    return replace(clip, points=clip.points @ turn_between(up, "z"), up="z", **said)


def decided(clip):
    cmu = known("cmu")
    return upright(clip, associate(clip, cmu), cmu.skeleton)


def hips_of(fit):
    """Centimetres over zero, the lowest and the highest in a BVH with y up."""
    lines = rendered("bvh", fit).files[".bvh"].splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("Frame Time")) + 1
    heights = [float(line.split()[1]) for line in lines[start:] if line]
    return min(heights), max(heights)


@pytest.mark.parametrize("up", UPS)
def test_axes_turn_without_a_mirror_and_up_goes_up(up):
    turn = turn_between(up, "y")
    np.testing.assert_array_equal(turn @ vertical(up), [0, 1, 0])
    np.testing.assert_array_equal(turn @ turn.T, np.eye(3))
    assert np.linalg.det(turn) == 1.0


@pytest.mark.parametrize("up", UPS)
def test_a_walker_is_upright_in_any_axes_and_the_same_figure(up):
    clip = as_if(recorded(walk), up)
    found = decided(clip)
    assert found.up == upright_by_names(clip).up == up
    assert len(found.notes) == (up != "z")
    fit, there = fit_clip(found), fit_clip(recorded(walk))
    back = turn_between(up, "z")
    for one, other in zip(fit.joints, there.joints, strict=True):
        np.testing.assert_allclose(one.track @ back.T, other.track, rtol=0, atol=1e-6)
    lowest, highest = hips_of(fit)
    assert 80 < lowest <= highest < 120


@pytest.mark.parametrize("up", ["y", "-x"])
def test_the_page_shows_a_body_the_right_way_up(up):
    clip = decided(as_if(recorded(walk), up))
    (assignment,) = associate(clip, known("cmu"))
    about = scene(clip, assignment, fit_clip(clip)).about
    height = {m["label"]: about["middle"][m["point"]][about["up"]] for m in about["markers"]}
    assert height["LFHD"] > height["LFWT"] > height["LTOE"] > about["floor"] - 0.05


@pytest.mark.parametrize("said", ["", "file"])
def test_a_walk_in_other_axes_is_believed_though_the_file_says_z(said):
    found = decided(as_if(recorded(walk), "y", up_by=said))
    assert (found.up, found.up_by) == ("y", "body")
    assert ("not z as the file says" in found.notes[0]) == bool(said)


def test_who_stands_on_zero_in_other_axes_is_believed_where_the_file_says_nothing():
    clip = as_if(recorded(still), "y")
    assert decided(clip).up == "y"
    in_doubt = decided(replace(clip, up_by="file"))
    assert in_doubt.up == "z"
    assert "if it stands there, --clip-up y" in in_doubt.notes[0]


WAYS = {
    "lies": [0, 0, 0], "crawls": [1, 0, 0], "is dragged aside": [0, 1, 0],
    "handstand": [0, 0, 0], "walks on its hands": [1, 0, 0],
}  # fmt: skip


@pytest.mark.parametrize("said", ["", "file"])
@pytest.mark.parametrize("kind", WAYS)
def test_a_body_that_does_not_stand_turns_nothing_over(kind, said):
    clip = recorded(still)
    turn = np.diag([1.0, -1.0, -1.0]) if "hand" in kind else turn_between("x", "z")
    points = clip.points @ turn
    points += [0.4, 0.2, 0.05 - np.nanmin(points[..., 2])]
    points += np.linspace(0, 3, len(points))[:, None, None] * WAYS[kind]
    assert decided(replace(clip, points=points, up_by=said)).up == "z"


def test_what_the_call_states_is_not_looked_at():
    clip = as_if(recorded(walk), "y", up_by="call")
    assert decided(clip) is clip


@pytest.mark.parametrize(
    ("told", "up", "noted"),
    [((), "-y", 1), (("--clip-up", "-y"), "-y", 0), (("--clip-up", "z"), "z", 0)],
)
def test_the_option_states_it_and_the_note_goes(tmp_path, told, up, noted):
    clip = as_if(recorded(walk), "-y")
    path = c3d_file(tmp_path / "walk.c3d", 1000 * clip.points, LABELS=list(clip.labels))
    facts = json.loads(call("inspect", path, "--json", *told, cwd=tmp_path).stdout)
    assert facts["up"] == up
    assert sum("point up" in note for note in facts["notes"]) == noted


def test_what_is_no_axis_is_told(tmp_path):
    path = c3d_file(tmp_path / "a.c3d", np.ones((3, 2, 3)))
    with pytest.raises(CallError, match="what points up is one of x, y, z, -x"):
        read_clip(path, up="w")

"""What the page's viewer gets, against what stands in the clip."""

from dataclasses import replace

import numpy as np
import pytest
from handmade import fit_of, joint
from recordings import SAMPLES, fit_sample, known

from mocap_skel import associate, read_clip
from mocap_skel.joints.joint_fit import unfitted
from mocap_skel.report import scene as scenes
from mocap_skel.report.scene import scene, unpack
from mocap_skel.segments.left_out import LeftOut


def dancers():
    """A clip of two subjects from frame 101 on, and Ben's part in it."""
    clip = read_clip(SAMPLES / "two_dancers.c3d")
    (ben,) = associate(clip, known("cmu"), "Ben")
    return clip, ben, fit_sample("two_dancers", "Ben")


def places_of(made):
    """(points, 3, frames) in the lab."""
    rows = unpack(made.packed, made.about["frames"])[: 3 * made.about["points"]]
    return (
        made.step * rows.reshape(-1, 3, made.about["frames"])
        + np.array(made.about["middle"])[..., None]
    )


def test_a_page_shows_one_subject_and_the_points_that_are_nobodys_markers_only():
    clip, ben, fit = dancers()
    del ben.columns["Head"]["LFHD"]
    markers = scene(clip, ben, fit).about["markers"]
    assert len(markers) == 41 and {clip.subjects[m["column"]] for m in markers} == {"Ben"}
    # The assigned ones first.
    assert [m["label"] for m in markers if not m["segment"]] == [markers[-1]["label"]] == ["LFHD"]


def test_stretches_that_are_left_out_have_the_files_own_frame_numbers():
    clip, ben, fit = dancers()
    gone = LeftOut("LFHD", "Head", "LFHD", np.array([103, 104, 107]), "")
    markers = scene(clip, ben, replace(fit, left_out=(gone,))).about["markers"]
    stretches = {m["label"]: m["leftOut"] for m in markers if m["leftOut"]}
    # From the first frame to the one after the last.
    assert stretches == {"LFHD": [[103, 105], [107, 108]]}


def test_of_a_long_clip_every_third_frame_is_shown(monkeypatch):
    clip, ben, fit = dancers()
    points = 41 + len(dict(fit.tracks())) + 2 * sum(j.turns_on is not None for j in fit.joints)
    monkeypatch.setattr(scenes, "MOST_SAMPLES", clip.frames * points // 3 + 1)
    made = scene(clip, ben, fit)
    assert (made.every, made.about["every"], made.about["frames"]) == (3, 3, 234)
    # The rate stays the clip's: the viewer counts frames by `every`.
    assert (made.about["rate"], made.about["firstFrame"]) == (50.0, 101)
    waist = fit.joints[0].track[::3]
    np.testing.assert_allclose(places_of(made)[0].T, waist, atol=made.step / 2 + 1e-6)
    axes = unpack(made.packed, 234)[3 * points :][:3] / 32767
    shown = fit.segments[made.about["segments"][0]].pose.rotation[::3, :, 0]
    np.testing.assert_allclose(axes.T, shown, atol=1 / 32767)


@pytest.mark.parametrize(("lowest", "floor"), [(-0.2, -0.2), (-0.04, 0.0), (0.14, 0.0), (0.5, 0.5)])
def test_the_floor_is_zero_or_the_lowest_place_of_the_figure(lowest, floor):
    heights = np.array([*[[lowest, 1.0]] * 3, [np.nan, 1.7]])
    assert scenes.floor_height(heights) == pytest.approx(floor)


def test_a_bone_has_the_verdict_of_the_worse_of_its_ends():
    hip, knee = joint("Hip"), replace(joint("Knee", parent="HipPart"), shown="weak")
    ankle = replace(joint("Ankle", parent="KneePart"), shown="no")
    toe = unfitted("Toe", "AnklePart", "ToePart", 5, "")
    fit = fit_of(hip, knee, ankle, toe, segments=("HipPart", "KneePart", "AnklePart"))
    names = [name for name, _ in fit.tracks()]
    bones = {(names[b["from"]], names[b["to"]]): b["shown"] for b in scenes._bones(fit, names)}
    assert bones == {
        ("Root", "Hip"): "yes", ("Hip", "Knee"): "weak", ("Knee", "Ankle"): "no",
        ("Ankle", "Toe"): "no", ("Toe", "ToePart"): "no",
    }  # fmt: skip


def test_a_joint_that_was_not_fitted_is_told_from_one_that_is_not_shown():
    lost, holder = (
        unfitted("Neck", "Root", "Head", 5, "no marker"),
        replace(joint("Hip"), shown="no"),
    )
    assert scenes._joint(lost, ["Neck"], ["Root"])["shown"] == "none"
    about = scenes._joint(holder, ["Neck", "Hip"], ["Root"])
    assert (about["shown"], about["point"], about["ellipsoid"]["segment"]) == ("no", 1, 0)
    assert "ellipsoid" not in scenes._joint(lost, ["Neck"], ["Root"])

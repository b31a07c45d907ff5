"""A fit with another axis up is the same figure."""

import csv
import io

import numpy as np
import pytest
from recordings import fit_sample, gappy, rendered

from mocap_skel.clip import AXES
from mocap_skel.export.tables_csv import skeleton_csv
from mocap_skel.results.axes import turned


def rows(text):
    return list(csv.reader(io.StringIO(text)))


@pytest.mark.parametrize("up", AXES)
def test_a_turned_fit_is_the_same_figure_with_another_axis_up(up):
    fit, other = gappy(), turned(gappy(), up)
    assert other.up == up
    # The vertical coordinate goes where it should, and the others keep their turn: right-handed.
    move = [AXES.index("z"), (AXES.index("z") + 1) % 3, (AXES.index("z") + 2) % 3]
    to = [AXES.index(up), (AXES.index(up) + 1) % 3, (AXES.index(up) + 2) % 3]
    for (name, before), (_, after) in zip(fit.tracks(), other.tracks(), strict=True):
        # A pose turned and then applied rounds otherwise than a track that is turned: by a few
        # eps of metres.
        np.testing.assert_allclose(
            after[:, to], before[:, move], rtol=0, atol=1e-14, equal_nan=True, err_msg=name
        )
    for name, segment in other.segments.items():
        rotation = segment.pose.rotation[segment.pose.known]
        np.testing.assert_allclose(np.linalg.det(rotation), 1.0, rtol=0, atol=1e-12)
        for joint in other.joints:
            if joint.parent == name and joint.fitted:
                np.testing.assert_allclose(
                    segment.pose.to_lab(joint.centre),
                    joint.track,
                    rtol=0,
                    atol=1e-14,
                    equal_nan=True,
                )
    # The constants and the evidence are in segments' frames, which do not know of the lab.
    for before, after in zip(fit.joints, other.joints, strict=True):
        for name in set(vars(before)) - {"track"}:
            np.testing.assert_array_equal(getattr(before, name), getattr(after, name))


def test_there_and_back_is_where_it_was():
    for up in AXES:
        back = turned(turned(gappy(), up), "z")
        for (name, a), (_, b) in zip(gappy().tracks(), back.tracks(), strict=True):
            np.testing.assert_array_equal(a, b, err_msg=name)


def test_the_clips_own_axis_is_no_turn():
    assert turned(gappy(), None) is gappy()
    assert turned(gappy(), "z") is gappy()


def test_the_csv_is_turned_on_request_only():
    as_is, y_up = (rendered("csv", gappy(), up=up) for up in (None, "y"))
    assert as_is.files[".skeleton.csv"] == str(skeleton_csv(gappy()))
    z, y = (rows(r.files[".skeleton.csv"]) for r in (as_is, y_up))
    assert z[0] == y[0]
    at = z[0].index("Hips_x")
    for a, b in zip(z[1:], y[1:], strict=True):
        # (x, y, z) with z up is (y, z, x) with y up.
        assert b[at : at + 3] == [a[at + 1], a[at + 2], a[at]]
    assert as_is.files[".joints.csv"] == y_up.files[".joints.csv"]


def test_bvh_is_y_up_unless_told():
    fit = fit_sample("nearly_still")
    default, y, z = (rendered("bvh", fit, up=up).files[".bvh"] for up in (None, "y", "z"))
    assert default == y != z

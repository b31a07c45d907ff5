"""Measures of the person: what of a C3D's PROCESSING group is read, and what cannot be is said."""

import numpy as np
import pytest
from c3d_bytes import c3d_file

from mocap_skel import read_clip
from mocap_skel.readers.formats.c3d.person import person


def recorded(path, *labels, **said):
    points = 1000 + np.random.default_rng(0).normal(size=(30, len(labels), 3)).cumsum(axis=0)
    c3d_file(path, points, LABELS=list(labels), **said)
    return read_clip(path)


@pytest.mark.parametrize("unit", ["mm", "m"])
def test_vicons_measures_are_millimetres_whatever_the_points_are(tmp_path, unit):
    clip = recorded(
        tmp_path / "a.c3d", "LKNE", "LANK", "LTHI", UNITS=unit,
        PROCESSING__LKneeWidth=np.array([99.0]), PROCESSING__RKNEEWIDTH=np.array([101.5]),
        PROCESSING__InterAsisDistance=np.array([254.0]), PROCESSING__MarkerDiameter=np.array([14.0]),
        PROCESSING__LAnkleWidth=np.array([0.0]), PROCESSING__LKNEEROTATION=np.array([3.0]),
    )  # fmt: skip
    assert clip.measures == pytest.approx(
        {
            "left_knee_width": 0.099,
            "right_knee_width": 0.1015,
            "inter_asis": 0.254,
            "marker_diameter": 0.014,
        }
    )


def test_a_measure_in_another_unit_is_not_used_but_said(tmp_path):
    clip = recorded(
        tmp_path / "a.c3d", "LKNE", "LANK", "LTHI", PROCESSING__LKNEEWIDTH=np.array([9.9])
    )
    assert clip.measures == {}
    assert "measures in the file that no person has, not used: left_knee_width 9.9 mm" in clip.notes


def test_measures_of_one_person_are_not_used_for_two(tmp_path):
    clip = recorded(
        tmp_path / "a.c3d", "Ann:LKNE", "Ben:LKNE", "Ben:LANK",
        PROCESSING__LKNEEWIDTH=np.array([99.0]),
    )  # fmt: skip
    assert clip.measures == {}
    assert any("measures of one person" in note for note in clip.notes)


def test_names_may_hold_blanks_and_values_need_not_be_numbers():
    found, said = person(
        {"PROCESSING": {"MARKER DIAMETER": [14.0], "LKNEEWIDTH": ["text"], "RKNEEWIDTH": [np.nan]}}
    )
    assert (found, said) == ({"marker_diameter": 0.014}, ())
    assert person({}) == ({}, ())

"""One person on two days is one, and two people are two: bones, shapes, and the command that refuses them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from recordings import clip_of, known

from mocap_skel import artificial as art
from mocap_skel.errors import CallError
from mocap_skel.joints.calibration import Template
from mocap_skel.joints.strangers import Body, strangers
from mocap_skel.labels.association import associate
from mocap_skel.pipeline.calibrate import _body, calibrate
from mocap_skel.pipeline.job import Job


def person(seed, *, size=1.0, proportions=0.0, put_back=0.0):
    """Six segments of four markers, and six bones known to 1 cm."""
    rng = np.random.default_rng(7)
    places = rng.uniform(-0.15, 0.15, (6, 4, 3))
    bones = np.array([0.41, 0.42, 0.40, 0.43, 0.30, 0.27])
    rng = np.random.default_rng(seed)
    places = size * places * np.exp(rng.normal(0, proportions, (6, 1, 3)))
    places = places + rng.normal(0, put_back, places.shape)
    bones = size * bones * np.exp(rng.normal(0, 0.01, 6))
    segments = {
        f"S{i}": Template(dict(zip("ABCD", p, strict=True)), None, 0.003)
        for i, p in enumerate(places)
    }
    return Body(f"clip{seed}", segments, {f"S{i}": (float(b), 0.01) for i, b in enumerate(bones)})


@pytest.mark.parametrize("first", range(0, 40, 2))
def test_markers_put_back_to_a_centimetre_make_no_other_person(first):
    groups, why = strangers([person(first, put_back=0.01), person(first + 1, put_back=0.01)])
    assert (len(groups), why) == (1, "")


def test_where_most_segments_are_as_they_were_nothing_else_tells():
    one, two = person(1), person(1, size=1.0)
    bent = {
        **two.segments,
        "S0": Template({m: 3 * p for m, p in two.segments["S0"].markers.items()}, None),
    }
    longer = {name: (1.2 * length, sd) for name, (length, sd) in two.bones.items()}
    assert strangers([one, replace(two, clip="b", segments=bent, bones=longer)])[1] == ""


def test_three_people_of_different_size_are_named_with_their_clips():
    bodies = [
        person(1, put_back=0.01),
        person(2, size=1.12, put_back=0.01),
        person(3, put_back=0.01),
    ]
    groups, why = strangers([*bodies, person(4, size=0.88, put_back=0.01)])
    assert groups == [["clip1", "clip3"], ["clip2"], ["clip4"]]
    assert why.startswith("the bones of clip2 are 1") and why.endswith(
        "% longer than those of clip1"
    )


def test_people_of_one_size_differ_in_their_shapes():
    _, why = strangers([person(1), person(2, proportions=0.3)])
    assert why.startswith("distances of markers on 6 segments differ by")


@pytest.mark.parametrize("first", range(0, 20, 2))
def test_a_larger_person_is_another_though_most_distances_differ_by_millimetres(first):
    """By 7 %: of 4 to 20 cm that is less than putting markers on again, on all of them alike it is not."""
    one, two = person(first, put_back=0.004), person(first + 1, size=1.07, put_back=0.004)
    _, why = strangers([one, two])
    assert "% longer than those of" in why
    # The same bones above markers that stayed as they were: the joints are badly known.
    assert strangers([one, replace(two, segments=one.segments)])[1] == ""


def test_a_limb_alone_tells_nothing():
    one, two = person(1), person(2, size=1.2)
    few = {name: two.segments[name] for name in ("S0", "S1")}
    assert strangers([one, replace(two, segments=few, bones={"S0": two.bones["S0"]})])[1] == ""


@cache
def day(stature, number, put_back=0.01):
    """A walk of a person whose markers are put on anew, 1 cm off along each axis."""
    rng = np.random.default_rng(number)
    places = art.marker_set("cmu", stature)
    places = {
        m: (s, tuple(np.array(p) + rng.normal(0, put_back, 3))) for m, (s, p) in places.items()
    }
    return art.record(
        art.human(stature), places, art.walk(3, 60), art.Faults(sigma=0.001), seed=number
    )


def written(tmp_path, *days):
    paths = [tmp_path / f"{stature:g}_{number}.c3d" for stature, number, *_ in days]
    for path, one in zip(paths, days, strict=True):
        art.write_c3d(day(*one), path)
    return paths


def test_a_calibration_of_one_actor_on_two_days(tmp_path):
    done = calibrate(written(tmp_path, (1.7, 1), (1.7, 2)), Job(known("cmu")))
    assert len(done.calibration.clips) == 2


def test_a_calibration_of_three_people_is_refused(tmp_path):
    paths = written(tmp_path, (1.6, 1), (1.77, 2), (1.77, 3), (1.95, 4))
    with pytest.raises(CallError, match="these clips show 3 people, not one: ") as error:
        calibrate(paths, Job(known("cmu")))
    assert "1.6_1.c3d | 1.77_2.c3d, 1.77_3.c3d | 1.95_4.c3d" in error.value.message
    assert error.value.hint == "a calibration is of one actor: calibrate each by itself"


def test_a_calibration_of_two_people_of_like_stature_with_the_same_marker_set_is_refused(tmp_path):
    with pytest.raises(CallError, match=r"the bones of 1\.88_2\.c3d are . % longer"):
        calibrate(written(tmp_path, (1.75, 1, 0.0), (1.88, 2, 0.0)), Job(known("cmu")))


def test_the_bones_of_a_clip_are_those_of_its_figure():
    """The thigh and the shank of the generated human, which the walk and anatomy know to some centimetres."""
    clip = clip_of(day(1.77, 2))
    job = Job(known("cmu"))
    bones = _body(job.fit(clip, associate(clip, job.known)[0]), "walk").bones
    figure = art.human(1.77)
    for segment, joint in (("UpperLeftLeg", "LeftKnee"), ("LowerLeftLeg", "LeftAnkle")):
        length, error = bones[f"{segment} to {joint}"]
        true = float(np.linalg.norm(figure.joints[joint].offset))
        assert abs(length - true) < 2.5 * error < 0.1

"""Foot contacts: found where they are on generated walks, and where nobody walks none."""

import numpy as np
import pytest
from recordings import CLIPS, fit_sample
from walks import walked

from mocap_skel.artificial.figure import human
from mocap_skel.artificial.gait import BALL, HEEL, SOLE, gait
from mocap_skel.errors import FitError
from mocap_skel.gait.contacts import find_contacts, turning_points
from mocap_skel.gait.events import foot_events

# Seconds. A sole slows down so fast that it passes the speed that counts as standing less than 0.01 before its strike;
# a difference over two frames tells it one or two frames later. A toe passes the speed of the pelvis, which is
# where it turns round, some 0.03 after it has left.
STRIKE, OFF = 0.035, 0.045


def times(events, side, foot):
    return np.array([e.time for e in events if (e.side, e.foot) == (side, foot)])


@pytest.mark.parametrize("treadmill", [False, True])
def test_a_foot_of_the_generated_walk_stands_between_its_contacts(treadmill):
    walk = gait(4, 200, treadmill=treadmill)
    poses = human().poses(walk.motion)
    ground = np.array([-1.2 if treadmill else 0.0, 0.0, 0.0])
    for side in ("left", "right"):
        heel, ball = (poses[f"{side.title()}Foot"].place((x, 0.0, -SOLE)) for x in (HEEL, BALL))
        speeds = [
            np.linalg.norm(200 * np.gradient(place, axis=0) - ground, axis=1)
            for place in (heel, ball)
        ]
        stands = np.minimum(*speeds) < 1e-6
        at = np.arange(800) / 200
        for strike in walk.strikes[side]:
            off = strike + 0.62 * 1.08
            inside = (at > strike + 0.01) & (at < off - 0.01)
            assert stands[inside].mean() > 0.97  # all but where it changes from heel to ball
            assert not stands[(at > off + 0.01) & (at < strike + 1.07)].any()
        assert min(heel[:, 2].min(), ball[:, 2].min()) > -1e-9


@pytest.mark.parametrize(
    "how",
    [
        {}, {"treadmill": True}, {"heading": 130.0}, {"rate": 50}, {"rate": 250, "treadmill": True},
        {"markers": "plug_in_gait", "heading": -75.0},
    ],
    ids=str,
)  # fmt: skip
def test_contacts_are_found_where_they_are(how):
    walk, clip, fit = walked(**how)
    found = find_contacts(fit)
    assert abs(found.ground - (-1.2 if how.get("treadmill") else 0.0)) < 0.05
    slack = 1.0 / clip.rate
    for side in ("left", "right"):
        for foot, true, near in (("strike", walk.strikes, STRIKE), ("off", walk.offs, OFF)):
            own = times(found.events, side, foot)
            # The first and the last may be cut by the ends of the clip.
            inner = [t for t in true[side] if 0.3 < t < fit.time[-1] - 0.3]
            away = np.array([np.abs(own - t).min() for t in inner])
            assert away.max() < near + slack
            assert all(np.abs(true[side] - t).min() < near + slack for t in own)
    assert {e.source for e in found.events} == {"found"}
    assert {e.method for e in found.events if e.foot == "off"} == {"Zeni 2008"}


@pytest.mark.parametrize("name", ["range_of_motion", "nearly_still", "gaps"])
def test_where_nobody_walks_none_are_found_and_why_is_said(name):
    found = find_contacts(fit_sample(name))
    assert not found.events
    assert found.why_none


@pytest.mark.parametrize("subject", ["Anna", "Ben"])
def test_steps_on_the_spot_are_no_gait(subject):
    assert not find_contacts(fit_sample("two_dancers", subject)).events


@pytest.mark.parametrize("frames", [1, 2, 5, 39, 60])
def test_a_clip_cut_short_has_no_contacts_and_no_warning(frames):
    from dataclasses import replace

    from recordings import fit_clip

    _, clip, _ = walked()
    cut = replace(clip, points=clip.points[:frames])
    try:
        fit = fit_clip(cut)
    except FitError:
        return
    assert not find_contacts(fit).events


def test_a_walk_whose_feet_are_never_seen_has_no_contacts_and_no_warning():
    from dataclasses import replace

    from recordings import fit_clip

    _, clip, _ = walked()
    points = clip.points.copy()
    points[5:, [label[1:] in ("HEE", "TOE", "MT5", "ANK") for label in clip.labels]] = np.nan
    assert not find_contacts(fit_clip(replace(clip, points=points))).events


def test_turning_points_need_their_fall_and_their_rise():
    track = np.array([0.0, 0.5, 1.0, 0.9, 0.95, 0.2, 0.0, 0.6, 0.5])
    assert turning_points(track, 0.3, 0.05) == [2, 7]
    assert turning_points(track, 0.3, 0.2) == [2]
    assert turning_points(np.linspace(1.0, 0.0, 20), 0.3, 0.05) == []
    gap = np.concatenate([track, [np.nan], track])
    assert turning_points(gap, 0.3, 0.05) == [2, 7, 12, 17]


def test_events_of_the_file_go_before_found_ones():
    from dataclasses import replace

    from mocap_skel.events import Event

    _, clip, fit = walked()
    told = (Event(1.0, 101, "Foot Strike", "Left"), Event(2.1, 211, "Foot Strike", "Left"))
    both = replace(clip, events=told)
    assert foot_events(fit, both).events == told
    assert not foot_events(fit, both).notes
    found = foot_events(fit, both, "found")
    assert {event.source for event in found.events} == {"found"}
    assert "events of the file do not count" in found.notes[0]
    assert foot_events(fit, clip, "file").notes == ("the file has no foot events",)
    # Of no foot: it is carried, and foot contacts are found beside it.
    clap = replace(clip, events=(Event(1.0, 101, "Clap", "General"),))
    assert {event.source for event in foot_events(fit, clap).events} == {"file", "found"}


@pytest.mark.real
def test_found_contacts_lie_beside_the_events_of_real_files(capsys):
    """Strikes and offs of three files, set by people: medians within two frames, none farther than 50 ms."""
    from mocap_skel.pipeline.job import Job, fit_file

    for name in ("functional_hip/FunctionalWalk", "odd_files/sub_labels", "odd_files/Eb015pi"):
        found = fit_file(CLIPS / f"{name}.c3d", Job(None))
        fit = found.subjects[0][1]
        ours, theirs = find_contacts(fit).events, found.clip.events
        away = []
        for event in theirs:
            own = [e.frame for e in ours if (e.side, e.foot) == (event.side, event.foot)]
            away.append(min((n - event.frame for n in own), key=abs))
        with capsys.disabled():
            print(f"\n{name}: found less the file's, frames at {fit.rate:g} Hz: {away}")
        assert np.median(np.abs(away)) <= 2
        assert np.abs(away).max() <= 0.05 * fit.rate


@pytest.mark.real
@pytest.mark.parametrize(
    "name",
    [
        "cmu/01_01", "two_subjects/kinematics_tennis_serve_2players",
        "functional_hip/FunctionalLHip", "functional_knee/right_knee",
    ],
)  # fmt: skip
def test_real_clips_of_climbing_serving_and_calibration_have_no_gait(name):
    from mocap_skel.pipeline.job import Job, fit_file

    for _, fit in fit_file(CLIPS / f"{name}.c3d", Job(None)).subjects:
        assert not find_contacts(fit).events

"""The check of an association on two segments made by hand: which marker is at fault, and in how many frames."""

import numpy as np

from mocap_skel.artificial.rotations import from_vector
from mocap_skel.clip import Clip
from mocap_skel.figure.skeleton import Segment, Skeleton
from mocap_skel.labels.association import Assignment
from mocap_skel.results.marker_check import check_association

FRAMES = 400
# Metres from the joint that A and B share; J is the marker upon it.
OF_A = {
    "A1": (0.0, 0.1, 0.3),
    "A2": (0.2, 0.0, 0.4),
    "A3": (-0.2, 0.0, 0.35),
    "W": (0.1, -0.15, 0.3),
}
OF_B = {"B1": (0.0, 0.1, -0.3), "B2": (0.15, 0.0, -0.4), "B3": (-0.15, 0.0, -0.35)}


def check(given, *, last_seen=FRAMES):
    """A stands, B turns about the joint in all directions; `given` is the segment of the association for W.

    W is missing from the frame `last_seen` on.
    """
    rng = np.random.default_rng(11)
    turn = from_vector(1.2 * np.sin(np.outer(np.arange(FRAMES), [0.11, 0.07, 0.05])))
    tracks = {name: np.tile(at, (FRAMES, 1)) for name, at in OF_A.items()}
    tracks |= {name: turn @ np.array(at) for name, at in OF_B.items()}
    tracks["J"] = np.zeros((FRAMES, 3))
    points = np.stack(list(tracks.values()), axis=1)
    points += rng.normal(0.0, 0.001, points.shape)
    labels = tuple(tracks)
    points[last_seen:, labels.index("W")] = np.nan
    clip = Clip("c", points, labels, ("",) * len(labels), 100.0, 101, "m", "z", {}, ())
    skeleton = Skeleton(
        "two", (Segment("A", None, None, (*OF_A, "J")), Segment("B", "A", "Joint", (*OF_B, "W")))
    )
    columns = {"A": [name for name in (*OF_A, "J") if name != "W"], "B": list(OF_B)}
    columns[given].append("W")
    of = {
        segment: {name: labels.index(name) for name in names} for segment, names in columns.items()
    }
    found = check_association(clip, Assignment("", of, (), ()), skeleton)
    return {one.marker: one for one in found.markers}


def told(found):
    return {
        name: (one.verdict, one.partner, one.moves_with)
        for name, one in found.items()
        if one.verdict != "ok"
    }


def test_markers_at_their_own_segments_are_right():
    assert told(check("A")) == {}


def test_a_marker_upon_the_joint_is_no_partner_of_a_wrong_one():
    """It moves with both segments: exchanging it with W would mend W as well, but there is nothing wrong with it."""
    found = check("B")
    assert told(found) == {"W": ("wrong segment", "", "A")}
    # A residual of a marker that stands while its segment turns is no noise of 1 mm.
    assert found["W"].residual > 0.03 > 0.003 > found["B1"].residual


def test_the_share_out_of_place_is_of_the_frames_in_which_the_marker_is_seen():
    found = check("B", last_seen=100)["W"]
    assert found.verdict == "wrong segment" and found.share == len(found.frames) / 100
    # The clip begins with frame 101.
    assert 101 <= found.frames[0] <= found.frames[-1] <= 200
    assert found.share > 0.5


def test_a_marker_that_is_seen_in_a_few_frames_only_is_not_judged():
    # Two markers have to be seen together in 5 % of the frames, 20 of 400.
    assert told(check("B", last_seen=30)) == {"W": ("wrong segment", "", "A")}
    assert told(check("B", last_seen=10)) == {}

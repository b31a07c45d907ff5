"""A figure without names: rigid groups, the joints between them, and the files that say so."""

from dataclasses import replace

import numpy as np
import pytest
from labelled import CLIP, CMU, HUMAN, SIGMA, renamed
from recordings import SAMPLES, clip_of

from mocap_skel import artificial as art
from mocap_skel import associate, fit_skeleton, read_association, read_clip
from mocap_skel.artificial.rotations import from_vector
from mocap_skel.errors import CallError, FitError
from mocap_skel.labels.guess.figure import Figure, FoundSegment, figure_texts, find_figure
from mocap_skel.labels.guess.hinges import common_point, hang
from mocap_skel.segments.pose import Pose

PLUG_IN_GAIT = art.marker_set("plug_in_gait")


def test_a_common_point_of_two_frames_is_found():
    rng = np.random.default_rng(4)
    turns = [np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(80)]
    first = np.array([q * np.linalg.det(q) for q in turns[:40]])
    second = np.array([q * np.linalg.det(q) for q in turns[40:]])
    origin = rng.normal(size=(40, 3))
    c, d = np.array([0.1, -0.2, 0.3]), np.array([0.05, 0.1, 0.0])
    other = origin + first @ c - second @ d
    centre, residual = common_point(Pose(first, origin), Pose(second, other))
    # The prior is a millimetre against half a metre.
    np.testing.assert_allclose(centre, c, atol=1e-5)
    assert residual < 1e-5
    assert common_point(Pose(first[:5], origin[:5]), Pose(second[:5], other[:5])) is None


def nameless(clip, count=None):
    columns = range(len(clip.labels) if count is None else count)
    return replace(
        clip,
        points=clip.points[:, list(columns)],
        labels=tuple(f"m{i}" for i in columns),
        subjects=("",) * len(columns),
    )


def compared(figure, truth):
    """Segments found whole and joints found right: truth is label -> true segment."""
    sets = {}
    for label, segment in truth.items():
        if label not in figure.left_out:
            sets.setdefault(segment, set()).add(label)
    name = {
        s.name: true for s in figure.segments for true, of in sets.items() if of == set(s.labels)
    }
    parents = {s.name: s.parent for s in HUMAN.segments}
    right = sum(
        parents.get(name.get(s.name)) == name.get(s.parent, "")
        or parents.get(name.get(s.parent)) == name.get(s.name, "")
        for s in figure.segments
        if s.parent
    )
    return len(name), len(sets), right


@pytest.mark.parametrize(
    ("markers", "moves"),
    [
        (CMU, art.range_of_motion(14, 50, seed=3)),
        (PLUG_IN_GAIT, art.range_of_motion(14, 50, seed=5)),
        (CMU, art.dance(14, 50, seed=7)),
    ],
    ids=["cmu", "plug_in_gait", "dance"],
)
def test_the_figure_of_an_artificial_clip_is_the_true_one(markers, moves):
    faults = art.Faults(sigma=SIGMA)
    clip = nameless(clip_of(art.record(HUMAN, markers, moves, faults, seed=9)))
    truth = {f"m{i}": segment for i, (segment, _) in enumerate(markers.values())}
    figure = find_figure(clip)
    assert compared(figure, truth) == (15, 15, 14)
    # Five segments hang on the chest or the hips, on no other more than two.
    assert {truth[label] for label in figure.segments[0].labels} <= {"Chest", "Hips"}


@pytest.mark.parametrize("name", ["range_of_motion", "gaps"])
def test_bundled_clips_with_their_labels_erased(name):
    clip = read_clip(SAMPLES / f"{name}.c3d")
    known = read_association("plug_in_gait" if name == "gaps" else "cmu")
    of = {r.label: r.segment for r in known.rules}
    truth = {f"m{i}": of[label] for i, label in enumerate(clip.labels)}
    figure = find_figure(nameless(clip))
    found, there, right = compared(figure, truth)
    # In gaps, LTHI is never seen: a thigh of one marker has no frame for the shank to hang on.
    lost = {"LTHI", "LTIB", "LANK", "LHEE", "LTOE"} if name == "gaps" else set()
    assert {clip.labels[int(label[1:])] for label in figure.left_out} == lost
    assert found == there == (13 if name == "gaps" else 15)
    assert right == there - 1


def test_the_figures_files_are_read_and_fitted(tmp_path):
    clip = nameless(CLIP)
    toml, text = figure_texts(find_figure(clip), "fig.toml")
    (tmp_path / "fig.toml").write_text(toml)
    (tmp_path / "fig.txt").write_text(text)
    known = read_association(tmp_path / "fig.txt")
    fit = fit_skeleton(clip, associate(clip, known)[0], known.skeleton)
    assert len(fit.joints) == 14
    assert all(joint.shown == "yes" for joint in fit.joints)


def test_no_figure_where_nothing_keeps_its_distance():
    rng = np.random.default_rng(6)
    scattered = replace(
        CLIP,
        points=np.cumsum(rng.normal(size=(300, 5, 3)), axis=0),
        labels=tuple("abcde"),
        subjects=("",) * 5,
    )
    with pytest.raises(FitError, match="no three markers"):
        find_figure(scattered)


def wandering(rng, frames=400, step=0.02):
    """A body that turns and wanders: rotations (frames, 3, 3) and places (frames, 3)."""
    turns = from_vector(np.cumsum(rng.normal(0, 0.1, (frames, 3)), axis=0))
    return turns, np.cumsum(rng.normal(0, step, (frames, 3)), axis=0)


def cloud(body, centre, rng, count=4, sigma=SIGMA):
    """Markers (frames, count, 3) about a place fixed in a body."""
    turn, place = body
    fixed = np.array(centre) + rng.uniform(-0.1, 0.1, (count, 3))
    points = np.einsum("fij,mj->fmi", turn, fixed) + place[:, None]
    return points + sigma * rng.standard_normal(points.shape)


def hung(body, joint, rng):
    """Another body that turns about a point fixed in this one, which is its own origin."""
    turn, place = body
    return wandering(rng, len(turn))[0], place + turn @ np.array(joint)


def test_of_neighbours_that_fit_alike_the_nearest_is_taken():
    """Three groups on one stiff body: a joint between any two leaves only noise, most of it the nearest's."""
    rng = np.random.default_rng(8)
    body = wandering(rng)
    points = np.concatenate(
        [
            cloud(body, (x, 0, 0), rng, 3, sigma)
            for x, sigma in ((0, 1e-3), (0.5, 2e-3), (1.0, 5e-4))
        ],
        axis=1,
    )
    joints = hang(points, [[0, 1, 2], [3, 4, 5], [6, 7, 8]])
    assert [(joint.parent, joint.child) for joint in joints] == [(0, 1), (1, 2)]


def test_what_hangs_on_a_loose_group_is_left_out_with_it():
    """Trunk and head are one figure; an object in the room with two parts of its own hangs on nothing."""
    rng = np.random.default_rng(9)
    trunk, thing = wandering(rng), wandering(rng)
    parts = {
        "T": cloud(trunk, (0, 0, 0), rng, 6),
        "H": cloud(hung(trunk, (0, 0, 0.3), rng), (0, 0, 0.1), rng),
        "A": cloud(thing, (0, 0, 0), rng, 5),
        "B": cloud(hung(thing, (0, 0.2, 0), rng), (0, 0.1, 0), rng),
        "C": cloud(hung(thing, (0, -0.2, 0), rng), (0, -0.1, 0), rng),
    }
    names = tuple(f"{name}{i}" for name, points in parts.items() for i in range(points.shape[1]))
    clip = replace(
        CLIP,
        points=np.concatenate(list(parts.values()), axis=1),
        labels=names,
        subjects=("",) * len(names),
    )
    figure = find_figure(clip)
    assert [{label[0] for label in s.labels} for s in figure.segments] == [{"T"}, {"H"}]
    assert figure.left_out == {name: "hangs on nothing" for name in names if name[0] in "ABC"}


def test_labels_that_cannot_be_placed_or_written_are_left_out_with_the_reason():
    names = {"LFHD": 'L"FHD', "RFHD": "hardly", "C7": "ignore"}
    clip = nameless(CLIP)
    labels = tuple(names.get(label, label) for label in CLIP.labels)
    points = clip.points.copy()
    hardly = labels.index("hardly")
    points[:, hardly] = np.nan
    points[:29, hardly] = clip.points[:29, hardly]  # of 600 frames, a twentieth is 30
    figure = find_figure(replace(clip, points=points, labels=labels))
    assert figure.left_out == {
        "hardly": "hardly ever seen", 'L"FHD': "a label with a quote cannot stand in a file",
    }  # fmt: skip
    assert [row["reason"] for row in figure.rows() if row["segment"] is None] == [
        *figure.left_out.values()
    ]
    assert len(figure.rows()) == 41


def test_a_label_called_ignore_is_a_marker_of_the_written_figure(tmp_path):
    clip = renamed(nameless(CLIP), {"m3": "ignore", "m4": "@skeleton", "m5": "a b"})
    toml, text = figure_texts(find_figure(clip), "my figure.toml")
    (tmp_path / "my figure.toml").write_text(toml)
    (tmp_path / "my.txt").write_text(text)
    found = read_association(tmp_path / "my.txt")
    assert {rule.label for rule in found.rules} == set(clip.labels)
    assert found.ignored == ()


def test_a_joint_that_is_not_fixed_in_both_segments_is_called_doubtful():
    parts = (
        FoundSegment("trunk", None, None, ("a", "b", "c"), None),
        FoundSegment("arm", "trunk", "sharp", ("d",), 0.009),
        FoundSegment("leg", "trunk", "dull", ("e",), 0.011),
    )
    figure = Figure("clip", parts, {"f": "hangs on nothing"})
    assert figure.in_words() == (
        "5 of 6 labels on 3 segments, 2 joints; doubtful (no point is fixed in both segments): dull; "
        "left out: f"
    )
    toml, text = figure_texts(figure, "fig.toml")
    assert 'joint = "sharp"  # 9.0 mm\n' in toml and 'joint = "dull"  # 11.0 mm: doubtful\n' in toml
    assert "# f  # hangs on nothing" in text


def test_a_figure_is_one_subjects():
    clip = read_clip(SAMPLES / "two_dancers.c3d")
    with pytest.raises(CallError, match="one subject's"):
        find_figure(clip)
    assert len(find_figure(clip, "Anna").segments) == 15

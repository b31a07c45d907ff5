"""The validation harness in benchmarks/: the published methods on known truth, and references that it finds."""

import json
from dataclasses import replace

import numpy as np
import pytest
import spheres
import validate
from click.testing import CliRunner
from validation import asf_amc, published, references

from mocap_skel.artificial import (
    Faults,
    from_vector,
    human,
    marker_set,
    range_of_motion,
    record,
    write_c3d,
)
from mocap_skel.segments.pose import Pose
from mocap_skel.spherefit import gdke, mgdk, pratt, sphere_moments

CENTRE = np.array([0.3, -0.2, 1.1])


def cloud(noise, markers=3, frames=400, seed=3, degrees=60.0):
    """(frames, M, 3): noisy caps of different radii about CENTRE."""
    rng = np.random.default_rng(seed)
    sides = [
        spheres.cap(rng, (frames,), degrees, 0.1 + 0.1 * p) @ spheres.rotation(rng).T
        for p in range(markers)
    ]
    return CENTRE + np.stack(sides, axis=1) + noise * rng.normal(size=(frames, markers, 3))


def two_segments(noise, frames=300, seed=5):
    """Poses of two segments that turn about one point, its place in both, and its track."""
    rng = np.random.default_rng(seed)
    turns = [np.stack([spheres.rotation(rng) for _ in range(frames)]) for _ in range(2)]
    one, two = np.array([0.1, -0.4, 0.05]), np.array([-0.02, 0.3, 0.1])
    track = rng.normal(size=(frames, 3))
    poses = [
        Pose(r, track - r @ c + noise * rng.normal(size=(frames, 3)))
        for r, c in zip(turns, (one, two), strict=True)
    ]
    return poses, one, two, track


@pytest.mark.parametrize("method", published.SPHERES)
@pytest.mark.parametrize("markers", [1, 3])
def test_exact_spheres_give_their_centre(method, markers):
    points = cloud(0.0, markers)
    np.testing.assert_allclose(published.SPHERES[method](points), CENTRE, atol=1e-9)
    # Missing samples of exact data change nothing.
    points[::3, 0] = np.nan
    np.testing.assert_allclose(published.SPHERES[method](points), CENTRE, atol=1e-9)


def test_score_finds_the_point_of_an_exact_joint():
    (parent, child), one, two, track = two_segments(0.0)
    found = published.score(parent, child)
    np.testing.assert_allclose(found, [one, two], atol=1e-9)
    np.testing.assert_allclose(published.score_track(parent, child, found), track, atol=1e-9)


def test_score_averages_noise_away():
    (parent, child), one, two, _ = two_segments(0.001, frames=2000)
    found = published.score(parent, child)
    # Random turns: each constant has the noise of two origins over √frames; six times that.
    assert np.abs(np.array(found) - [one, two]).max() < 6 * 0.001 * np.sqrt(2 / 2000)


def test_gamage_and_lasenby_is_our_mgdk_without_noise():
    points = cloud(0.003)
    moments = sphere_moments(np.swapaxes(points, 0, 1))
    ours = mgdk(moments, 0.0)
    np.testing.assert_allclose(published.gamage_lasenby(points), ours.centre, atol=1e-11)
    np.testing.assert_allclose(ours.centre, gdke(moments).centre, atol=1e-14)


@pytest.mark.parametrize("markers", [1, 3])
def test_chang_and_pollard_is_our_pratt(markers):
    points = cloud(0.003, markers)
    found = published.chang_pollard(points)
    ours = pratt(sphere_moments(np.swapaxes(points, 0, 1))).centre
    # N and N - 1 in the moments' denominators are all the difference.
    np.testing.assert_allclose(found, ours, atol=2e-5 if markers > 1 else 1e-5)


def test_halvorsen_takes_the_bias_away_and_is_near_pratt():
    points = cloud(0.003, 1, degrees=40.0, frames=4000)
    biased, found = published.gamage_lasenby(points), published.halvorsen(points)
    near = pratt(sphere_moments(np.swapaxes(points, 0, 1))).centre
    bias = np.linalg.norm(biased - CENTRE)
    assert bias > 0.002
    assert np.linalg.norm(found - CENTRE) < bias / 4
    assert np.linalg.norm(found - near) < bias / 10


def test_what_a_method_cannot_know_is_nan():
    nothing = np.full((20, 2, 3), np.nan)
    flat = Pose(np.full((20, 3, 3), np.nan), np.full((20, 3), np.nan))
    for method in published.SPHERES.values():
        assert np.isnan(method(nothing)).all()
    assert np.isnan(published.score(flat, flat)).all()
    # On a noisy line Halvorsen's rounds run away.
    rng = np.random.default_rng(2)
    line = np.linspace(0, 0.01, 50)[:, None, None] + 0.01 * rng.normal(size=(50, 1, 3))
    assert not np.linalg.norm(published.halvorsen(line)) < 1e-9


@pytest.mark.parametrize(
    ("label", "expected"),
    [
        ("LKNEin", ("Left", "KNEIN")),
        ("R.Knee.Med", ("Right", "KNEEMED")),
        ("Left_HJC", ("Left", "HJC")),
        ("RightHipCenterScore", ("Right", "HIPCENTERSCORE")),
    ],
)
def test_sides_of_labels(label, expected):
    assert expected in references.sided(label)


ASF = """:version 1.10
:units
  mass 1.0
  length 0.45
  angle deg
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 0 0
   orientation 0 0 0
:bonedata
  begin
     id 1
     name lhipjoint
     direction 1 0 0
     length 2
     axis 0 0 0 XYZ
  end
  begin
     id 2
     name lfemur
     direction 0 -1 0
     length 7
     axis 0 0 20 XYZ
     dof rx ry rz
     limits (-160.0 20.0)
            (-70.0 70.0)
            (-60.0 70.0)
  end
:hierarchy
  begin
    root lhipjoint
    lhipjoint lfemur
  end
"""
AMC = """#!OML:ASF H\u00e4mmerle
:FULLY-SPECIFIED
:DEGREES
1
root 1 2 3 0 0 0
lfemur 0 0 0
2
root 1 2 3 0 0 90
lfemur 90 0 0
"""


def test_asf_and_amc_by_hand(tmp_path):
    (tmp_path / "s.asf").write_text(ASF, encoding="latin-1")
    (tmp_path / "s_1.amc").write_text(AMC, encoding="latin-1")
    (tmp_path / "s_10.amc").write_text(AMC, encoding="latin-1")
    clip = tmp_path / "s_1.c3d"
    assert asf_amc.beside(clip) == (tmp_path / "s.asf", tmp_path / "s_1.amc")
    skeleton = asf_amc.read_asf(tmp_path / "s.asf")
    tracks = asf_amc.joint_tracks(skeleton, asf_amc.read_amc(tmp_path / "s_1.amc"))
    metre = 0.0254 / 0.45
    assert skeleton.length("lfemur") == pytest.approx(7 * metre)
    # y of the C3D is x here, z is y, x is z. The second frame turns the body by 90° about z.
    np.testing.assert_allclose(tracks["LeftHip"] / metre, [[3, 3, 2], [3, 1, 4]], atol=1e-12)
    np.testing.assert_allclose(tracks["LeftKnee"][0] / metre, [3, 3, -5], atol=1e-12)
    # The thigh's own axes are turned by 20° about z: a quarter turn about its x.
    a, b = np.radians(20), np.radians(90)
    turn = asf_amc.turns(np.array([0, 0, a]))
    thigh = turn @ asf_amc.turns(np.array([b, 0, 0])) @ turn.T @ [0, -7, 0]
    thigh = asf_amc.turns(np.array([0, 0, b])) @ thigh
    expected = np.array([1, 4, 3]) + thigh
    np.testing.assert_allclose(tracks["LeftKnee"][1] / metre, expected[[2, 0, 1]], atol=1e-12)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A clip with medial markers, joint centres in it, 2 cm off one of them, and a file that is no clip."""
    folder = tmp_path_factory.mktemp("clips")
    faults = Faults(sigma=0.001)
    recording = record(human(), marker_set("cmu"), range_of_motion(15, 60, seed=4), faults, seed=4)
    extra = {}
    for side, word in (("L", "Left"), ("R", "Right")):
        lateral = recording.clean[:, recording.labels.index(f"{side}KNE")]
        extra[f"{side}KNM"] = 2 * recording.truth[f"{word}Knee"] - lateral
    pelvis = recording.poses["Hips"].rotation
    extra["LHJC"] = recording.truth["LeftHip"]
    extra["RHJC"] = recording.truth["RightHip"] + pelvis @ [0.0, 0.0, 0.02]
    wide = {"RightElbowJointCenter": recording.truth["RightElbow"] + [0.0, 2.0, 0.0]}
    extra |= wide
    points = np.concatenate([recording.points, np.stack(list(extra.values()), axis=1)], axis=1)
    filmed = replace(recording, points=points, labels=(*recording.labels, *extra))
    write_c3d(filmed, folder / "film.c3d", unit="cm")
    (folder / "broken.c3d").write_bytes(b"no clip at all")
    return folder


def run(*arguments):
    return CliRunner().invoke(validate.main, [*map(str, arguments)])


def test_the_harness_finds_references_and_measures_them(folder):
    done = run(folder, "--json", "--half", "-q")
    assert done.exit_code == 1, done.output
    content = json.loads(done.stdout)
    broken, film = content["clips"]
    assert broken["failed"] and not broken["errors"]
    found = {(e["joint"], e["kind"]): e for e in film["errors"]}
    assert all(
        label in film["head"] for label in ("cmu", "41 markers", "LKNM", "RKNM", "LHJC", "RHJC")
    )
    # The true ones within the noise of a parent's frame, a few millimetres; that 2 cm off, 2 cm off.
    for joint, kind in (
        ("LeftKnee", "midpoint"),
        ("RightKnee", "midpoint"),
        ("LeftHip", "centre label"),
    ):
        row = found[joint, kind]
        assert row["counts"] and row["shown"] == "yes"
        assert row["errors"]["ours"] < 0.5
        # The published ones do not know of the noise of the parent's frame: knees slide by it.
        assert row["errors"]["Chang-Pollard"] < 1.0
    wrong = found["RightHip", "centre label"]
    assert wrong["errors"]["ours"] == pytest.approx(2.0, abs=0.3)
    assert wrong["within_axes"] is False and wrong["within_ellipsoid"] is False
    assert ("RightElbow", "centre label") not in found
    assert any("RightElbow" in note and "left out" in note for note in film["notes"])
    # SCoRE needs three markers of the child.
    assert found["LeftKnee", "midpoint"]["errors"]["SCoRE"] is None
    assert not found["LeftWrist", "shared midpoint"]["counts"]
    halves = {h["joint"]: h["distances"] for h in film["halves"]}
    assert len(halves) == 14 and halves["LeftHip"]["ours"] < 3.0
    total = next(
        t for t in content["totals"] if t["group"] == "all joints" and t["method"] == "ours"
    )
    assert (total["n"], total["of"]) == (4, 4)


def test_the_table_and_csv_and_files(folder, tmp_path):
    out = tmp_path / "table.txt"
    assert run(folder, "--only", "film", "-q", "-o", out).exit_code == 0
    text = out.read_text(encoding="utf-8")
    assert "RightHip" in text and "inside 2 s.e., all joints:" in text
    again = run(folder, "--only", "film", "-q", "-o", out)
    assert again.exit_code == 2 and "--overwrite" in again.output
    rows = run(folder, "--only", "film", "-q", "--csv").stdout.splitlines()
    assert rows[0].startswith("table,clip,subject,what,reference") and len(rows) > 30


def test_bones_that_were_seen_are_the_first_table_in_millimetres(tmp_path):
    """A person's film with its true hips beside it, one moved by 2 cm: ours is off by that, in millimetres."""
    recording = record(
        human(), marker_set("cmu"), range_of_motion(8, 60, seed=4), Faults(sigma=0.001), seed=4
    )
    write_c3d(recording, tmp_path / "ANNA_film.c3d")
    rows = ["frame,joint,x,y,z"]
    for joint, off in (("LeftHip", 0.0), ("RightHip", 0.02)):
        rows += [
            f"{f + 1},{joint},{x + off:.6f},{y:.6f},{z:.6f}"
            for f, (x, y, z) in enumerate(recording.truth[joint])
        ]
    (tmp_path / "ANNA_film.truth.csv").write_text("\n".join(rows), encoding="utf-8")
    text = run(tmp_path, "-q").stdout
    assert text.startswith("bones seen: 2 joints of 1 persons\n")
    lines = text.splitlines()
    near, far = (next(x for x in lines if joint in x).split() for joint in ("LeftHip", "RightHip"))
    assert float(near[2]) < 5
    assert float(far[2]) == pytest.approx(20, abs=5)
    median = next(x for x in lines if x.startswith("median")).split()
    assert median[1:3] == ["Hip,", "2"]
    assert float(median[3]) == pytest.approx(0.5 * (float(near[2]) + float(far[2])), abs=0.11)


def test_sara_finds_the_axis_of_an_exact_hinge():
    rng = np.random.default_rng(6)
    axis, place = np.array([0.6, 0.0, 0.8]), np.array([0.1, 0.2, 0.3])
    turn = from_vector(rng.uniform(-1, 1, (200, 1)) * axis)
    parent = Pose(np.stack([spheres.rotation(rng) for _ in range(200)]), rng.normal(size=(200, 3)))
    own = np.array([0.0, 0.1, -0.2])
    away = np.einsum("fij,fj->fi", parent.rotation, place - turn @ own)
    origin = parent.origin + away
    child = Pose(parent.rotation @ turn, origin)
    point, found = published.sara(parent, child)
    assert abs(found @ axis) == pytest.approx(1, abs=1e-9)
    # A point of the axis: beside the true one by nothing across it.
    assert np.linalg.norm(np.cross(point - place, axis)) < 1e-9


def test_harrington_and_hara_by_hand():
    """A pelvis 24 cm wide and 14 cm deep, x to the front, y to the left; a leg of 0.9 m."""
    pelvis = {
        "LFWT": np.array([0.0, 0.12, 0.0]), "RFWT": np.array([0.0, -0.12, 0.0]),
        "LBWT": np.array([-0.14, 0.05, 0.0]), "RBWT": np.array([-0.14, -0.05, 0.0]),
    }  # fmt: skip
    back, down, out = 0.24 * 0.14 + 0.0099, 0.30 * 0.24 + 0.0109, 0.33 * 0.24 + 0.0073
    assert published.harrington(pelvis, "Left") == pytest.approx([-back, out, -down])
    assert published.harrington(pelvis, "Right") == pytest.approx([-back, -out, -down])
    found = published.hara(pelvis, "Left", 0.9)
    assert found == pytest.approx([0.011 - 0.0567, 0.008 + 0.0774, -0.009 - 0.0702])
    assert np.isnan(published.harrington({}, "Left")).all()
    assert np.isnan(published.hara(pelvis, "Left", float("nan"))).all()


def test_wrong_calls_are_one_line(tmp_path):
    for arguments in ((tmp_path / "nowhere",), (tmp_path,), (tmp_path, "--assoc", "nonsense")):
        done = run(*arguments)
        assert done.exit_code == 2
        assert done.output.startswith("error: ") and done.output.count("\n") == 1


@pytest.mark.real
def test_the_functional_hip_is_carried_into_the_walk(shared_clips):
    done = run(shared_clips / "functional_hip", "--json", "-q")
    walk = json.loads(done.stdout)["clips"][1]
    carried = {e["joint"]: e for e in walk["errors"] if e["kind"] == "carried"}
    assert carried["LeftHip"]["errors"]["ours"] < 1.0
    assert "LeftHipCenterScore" in walk["head"]

"""The generator against the laws that it promises: rigid segments, spheres, noise, gaps, files."""

from __future__ import annotations

import csv
import struct
from itertools import combinations
from pathlib import Path

import ezc3d
import numpy as np
import pytest

from mocap_skel import artificial as art
from mocap_skel.artificial.__main__ import main
from mocap_skel.artificial.figure import floor_contacts
from mocap_skel.artificial.rotations import from_vector, half_sine

SIGMA = 0.001
HUMAN = art.human()
CMU = art.marker_set("cmu")
ROM = art.range_of_motion(14, 100, seed=4)
EXACT = art.record(HUMAN, CMU, ROM)
NOISY = art.record(HUMAN, CMU, ROM, art.Faults(sigma=SIGMA), seed=4)
JOINTS = list(HUMAN.joints)


def child_markers(figure, markers, recording, joint, points):
    """Tracks of the markers on a joint's child segment in the parent's true frame."""
    child = figure.joints[joint]
    parent = recording.poses[child.parent]
    rows = [i for i, (segment, _) in enumerate(markers.values()) if segment == child.name]
    shifted = points[:, rows] - parent.origin[:, None]
    return np.einsum("fji,fmj->mfi", parent.rotation, shifted)


def sphere_centre(tracks, noise=0.0):
    """MGDK: the shared centre, and the weakest standard deviation of the mean covariance."""
    total, right, covariances = np.zeros((3, 3)), np.zeros(3), []
    for track in tracks:
        mean = track.mean(axis=0)
        d = track - mean
        covariance = d.T @ d / (len(d) - 1)
        third = d.T @ (d**2).sum(axis=1) / (len(d) - 1)
        clean = covariance - noise * np.eye(3)
        total += clean
        right += clean @ mean + third / 2
        covariances.append(covariance)
    weakest = np.sqrt(np.linalg.eigvalsh(np.mean(covariances, axis=0))[0])
    return np.linalg.solve(total, right), weakest


def test_the_standard_human_is_the_documented_tree():
    parents = {segment.name: segment.parent for segment in HUMAN.segments}
    assert len(parents) == 15
    assert [
        "Waist",
        "Neck",
        *("RightShoulder", "RightElbow", "RightWrist"),
        *("LeftShoulder", "LeftElbow", "LeftWrist"),
        *("RightHip", "RightKnee", "RightAnkle"),
        *("LeftHip", "LeftKnee", "LeftAnkle"),
    ] == JOINTS
    assert HUMAN.joints["LeftWrist"].parent == "LowerLeftArm"
    assert parents["UpperRightLeg"] == parents["Chest"] == "Hips"
    assert len(set(parents) - set(parents.values())) == 5


def test_marker_sets_have_the_vendors_labels_on_the_right_segments():
    assert [len(labels) for labels in art.LABELS.values()] == [41, 39]
    for marker, segment in [
        ("LKNE", "UpperLeftLeg"),
        ("RANK", "LowerRightLeg"),
        ("LELB", "UpperLeftArm"),
        ("RWRA", "LowerRightArm"),
        ("LSHO", "Chest"),
        ("RBAC", "Chest"),
        ("LMT5", "LeftFoot"),
    ]:
        assert CMU[marker][0] == segment
    knee = np.array(HUMAN.joints["LeftKnee"].offset)
    assert 0.045 < np.linalg.norm(CMU["LKNE"][1] - knee) < 0.06


def test_stature_scales_the_body_and_its_markers():
    tall = art.record(art.human(3.5), art.marker_set("cmu", 3.5), art.still(0.1, 10))
    short = art.record(HUMAN, CMU, art.still(0.1, 10))
    for joint in JOINTS:
        np.testing.assert_allclose(tall.constants[joint], 2 * short.constants[joint])
    span = np.ptp(tall.clean[0], axis=0) / np.ptp(short.clean[0], axis=0)
    np.testing.assert_allclose(span, 2.0, rtol=0.01)


def test_segments_are_rigid_and_joints_hold_together():
    by_segment: dict[str, list[int]] = {}
    for i, (segment, _) in enumerate(CMU.values()):
        by_segment.setdefault(segment, []).append(i)
    assert set(by_segment) == {segment.name for segment in HUMAN.segments}
    for rows in by_segment.values():
        for a, b in combinations(rows, 2):
            distance = np.linalg.norm(EXACT.points[:, a] - EXACT.points[:, b], axis=1)
            # A dozen products of rotations, each good to one eps.
            assert np.ptp(distance) < 1e-13
    for joint, child in HUMAN.joints.items():
        track = EXACT.poses[child.parent].place(EXACT.constants[joint])
        np.testing.assert_allclose(track, EXACT.truth[joint], atol=1e-14)
        turn = EXACT.poses[child.name].rotation
        relative = EXACT.poses[child.parent].rotation.swapaxes(1, 2) @ turn
        np.testing.assert_allclose(relative, ROM.rotations[child.name], atol=1e-14)
        np.testing.assert_allclose(
            turn @ turn.swapaxes(1, 2), np.broadcast_to(np.eye(3), turn.shape), atol=1e-14
        )
        np.testing.assert_allclose(np.linalg.det(turn), 1.0, atol=1e-14)


@pytest.mark.parametrize("joint", JOINTS)
def test_range_of_motion_shows_every_joint(joint):
    exact = child_markers(HUMAN, CMU, EXACT, joint, EXACT.points)
    centre, weakest = sphere_centre(exact)
    np.testing.assert_allclose(centre, EXACT.constants[joint], atol=1e-9)
    assert weakest >= 0.012
    noisy = child_markers(HUMAN, CMU, NOISY, joint, NOISY.points)
    centre, _ = sphere_centre(noisy, SIGMA**2)
    assert np.linalg.norm(centre - EXACT.constants[joint]) < 0.001


def test_motions_stay_within_what_bodies_do():
    def bend(motion, child):
        return np.rad2deg(np.arccos(motion.rotations[child][:, 2, 2]))

    for side in ("Left", "Right"):
        assert 110 < bend(ROM, f"Lower{side}Leg").max() < 121
        assert 125 < bend(ROM, f"Lower{side}Arm").max() < 141
        dance = art.dance(10, 60, seed=3)
        assert 40 < bend(dance, f"Lower{side}Leg").max() < 70
        # The shank turns about its own axis when the knee is bent, hardly when it is straight.
        half = half_sine(ROM.rotations[f"Lower{side}Leg"])
        turn = 2 * np.arctan2(half[:, 2], np.sqrt(1 - (half**2).sum(axis=1)))
        bent = bend(ROM, f"Lower{side}Leg")
        assert np.rad2deg(np.abs(turn[bent > 40])).max() > 20
        assert np.rad2deg(np.abs(turn[bent < 5])).max() < 10
    feet = [i for i, label in enumerate(CMU) if label[1:] in ("HEE", "TOE")]
    for make in (art.dance, art.walk):
        film = art.record(HUMAN, CMU, make(8, 60, 2))
        assert np.abs(film.clean[:, feet, 2].min(axis=1) - 0.03).max() < 0.04
        assert film.truth["Neck"][:, 2].min() > 1.3
    # Changes of foot are rounded off, which lifts and dips the lowest point by centimetres.
    low = [EXACT.poses[segment].place(point)[:, 2] for segment, point in floor_contacts()]
    assert np.abs(np.min(low, axis=0)).max() < 0.1
    assert np.abs(np.min(low, axis=0)).mean() < 0.02
    quiet = art.record(HUMAN, CMU, art.still(10, 60, 2))
    assert np.ptp(quiet.clean, axis=0).max() < 0.15
    toes = quiet.clean[:, [i for i, label in enumerate(CMU) if label[1:] == "TOE"]]
    assert np.ptp(toes, axis=0).max() < 0.02


def test_white_noise_has_its_sigma_and_no_memory():
    error = (NOISY.points - NOISY.clean).reshape(len(NOISY.points), -1)
    # Five standard errors of a standard deviation, a mean and a correlation.
    assert abs(error.std() / SIGMA - 1) < 5 / np.sqrt(2 * error.size)
    assert abs(error.mean()) < 5 * SIGMA / np.sqrt(error.size)
    lag = (error[1:] * error[:-1]).mean() / SIGMA**2
    assert abs(lag) < 5 / np.sqrt(error.size)
    np.testing.assert_array_equal(NOISY.clean, EXACT.points)


def test_correlated_noise_forgets_with_its_time_constant():
    rate, constant = 100, 0.25
    faults = art.Faults(correlated=SIGMA, correlation_time=constant)
    clip = art.record(HUMAN, CMU, art.still(60, rate), faults, seed=2)
    error = (clip.points - clip.clean).reshape(len(clip.points), -1)
    independent = error.size / (2 * constant * rate)
    for lag in (0, 10, 25, 50):
        product = (error[lag:] * error[: len(error) - lag]).mean() / SIGMA**2
        expected = np.exp(-lag / (constant * rate))
        assert abs(product - expected) < 5 * np.sqrt(2 / independent)


def test_drop_outs_have_their_share_and_their_length():
    share, burst = 0.2, 15.0
    clip = art.record(
        HUMAN,
        CMU,
        art.still(100, 60),
        art.Faults(dropout=share, burst=burst, lost=("C7", "LKNE")),
        seed=7,
    )
    gone = np.isnan(clip.points)
    assert (gone.all(axis=2) == gone.any(axis=2)).all()
    lost = [label in ("C7", "LKNE") for label in clip.labels]
    assert gone[:, lost].all()
    gone = gone[:, np.logical_not(lost), 0]
    assert not gone.all(axis=0).any()
    memory = 1 - 1 / burst - share / (burst * (1 - share))
    error = np.sqrt(share * (1 - share) / gone.size * (1 + memory) / (1 - memory))
    assert abs(gone.mean() - share) < 5 * error
    starts = (gone[1:] & ~gone[:-1]).sum()
    assert abs(gone[1:].sum() / starts - burst) < 5 * burst / np.sqrt(starts)
    columns = np.corrcoef(gone.T) - np.eye(gone.shape[1])
    assert abs(columns).max() < 6 * np.sqrt(burst / len(gone) * 2)


def test_a_share_that_leaves_no_room_for_short_bursts_is_still_kept():
    clip = art.record(HUMAN, CMU, art.still(50, 60), art.Faults(dropout=0.95, burst=1.0))
    # Runs of 19 missing frames; 41 · 3000 / 40 independent samples of 0.95.
    assert abs(np.isnan(clip.points[..., 0]).mean() - 0.95) < 5 * np.sqrt(0.95 * 0.05 / 3000)


def test_skin_slides_along_the_surface_as_far_as_the_joint_bends():
    amplitude = 0.005
    single = art.record(HUMAN, CMU, ROM, art.Faults(slide=amplitude), seed=9)
    double = art.record(HUMAN, CMU, ROM, art.Faults(slide=2 * amplitude), seed=9)
    moved = single.points - single.clean
    np.testing.assert_allclose(double.points - double.clean, 2 * moved, atol=1e-15)
    size = np.linalg.norm(moved, axis=2)
    # Each marker and the segment below the joint that is nearest to it.
    for label, child in [("LKNE", "LowerLeftLeg"), ("LTHI", "UpperLeftLeg"), ("RANK", "RightFoot")]:
        track = size[:, single.labels.index(label)]
        bent = np.sqrt(2) * np.linalg.norm(half_sine(ROM.rotations[child]), axis=1)
        assert (track <= amplitude * (bent + 0.2) + 1e-15).all(), label
        assert track.max() > 0.3 * amplitude * bent.max()
    segment, (x, y, _) = CMU["LUPA"]
    turn = single.poses[segment].rotation
    inside = np.einsum("fji,fj->fi", turn, moved[:, single.labels.index("LUPA")])
    # The upper arm's bone is its z axis, so that the skin's normal is (x, y, 0).
    np.testing.assert_allclose(inside @ [x, y, 0.0], 0.0, atol=1e-15)
    # The elbow is nearest: its half sine moves at half its speed, the drift at 0.1 Hz at most.
    elbow = ROM.rotations["LowerLeftArm"]
    turned = np.linalg.norm(half_sine(elbow[:-1].swapaxes(1, 2) @ elbow[1:]), axis=1)
    steps = np.linalg.norm(np.diff(inside, axis=0), axis=1)
    assert (steps <= amplitude * (np.sqrt(2) * turned + 0.2 * 2 * np.pi * 0.1 / ROM.rate)).all()


def test_half_sine_is_the_axis_times_the_sine_of_half_the_angle():
    rng = np.random.default_rng(0)
    axis = rng.standard_normal((50, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    angle = np.linspace(0, 3.1, 50)[:, None]
    # Near a half turn the axis is the skew part over a cosine of 0.02, hence not 1e-15.
    np.testing.assert_allclose(
        half_sine(from_vector(axis * angle)), axis * np.sin(angle / 2), atol=1e-12
    )


def test_seeds_reproduce_and_each_fault_has_its_own_stream():
    faults = art.Faults(sigma=SIGMA, correlated=SIGMA, slide=0.005, dropout=0.2)

    def film(motion_seed, seed, faults=faults):
        motion = art.dance(2, 60, motion_seed)
        return art.record(HUMAN, CMU, motion, faults, seed=seed)

    first = film(1, 1)
    np.testing.assert_array_equal(film(1, 1).points, first.points)
    assert not np.array_equal(film(1, 2).points, first.points, equal_nan=True)
    np.testing.assert_array_equal(film(1, 2).clean, first.clean)
    assert not np.array_equal(film(2, 1).clean, first.clean)
    quieter = film(1, 1, art.Faults(sigma=SIGMA / 2, dropout=0.2))
    np.testing.assert_array_equal(np.isnan(quieter.points), np.isnan(first.points))


def test_any_figure_moves():
    dog = art.Figure(
        (
            art.Segment("Trunk", offset=(0, 0, 0.6)),
            art.Segment("Thigh", "Trunk", "Hip", (-0.3, 0.1, 0.0)),
            art.Segment("Shank", "Thigh", "Stifle", (0.05, 0.0, -0.2)),
        )
    )
    markers = {
        "W1": ("Trunk", (0.1, 0.0, 0.1)),
        "T1": ("Thigh", (0.0, 0.05, -0.1)),
        "S1": ("Shank", (0.0, 0.03, -0.1)),
        "S2": ("Shank", (0.0, 0.03, -0.2)),
    }
    ranges = {
        "Thigh": ((-20, 20), (-50, 20), (-15, 15)),
        "Shank": ((-5, 5), (0, 80), (-10, 10)),
    }
    clip = art.record(
        dog, markers, art.circumduct(ranges, 10, 50), art.Faults(slide=0.01), place=(1, 2, 0)
    )
    np.testing.assert_array_equal(clip.poses["Trunk"].origin[0], [1, 2, 0.6])
    assert np.isfinite(clip.points).all()
    for joint in ("Hip", "Stifle"):
        centre, _ = sphere_centre(child_markers(dog, markers, clip, joint, clip.clean))
        np.testing.assert_allclose(centre, clip.constants[joint], atol=1e-9)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: art.Figure(()), "root"),
        (lambda: art.Figure((art.Segment("A"), art.Segment("B"))), "root"),
        (lambda: art.Figure((art.Segment("A"), art.Segment("B", "C", "J"))), "after its parent"),
        (lambda: art.Figure((art.Segment("A"), art.Segment("B", "A"))), "joint name"),
        (lambda: art.Figure((art.Segment("A"), art.Segment("A", "A", "J"))), "two segments"),
        (lambda: art.human(-1), "stature"),
        (lambda: art.marker_set("helen_hayes"), "plug_in_gait"),
        (lambda: art.still(0, 100), "no motion"),
        (lambda: art.Faults(sigma=-1), "negative"),
        (lambda: art.Faults(dropout=1), "share"),
        (lambda: art.Faults(burst=0.5), "one frame"),
        (lambda: art.Faults(correlation_time=0), "positive"),
        (lambda: art.record(HUMAN, {}, ROM), "at least one marker"),
        (lambda: art.record(HUMAN, {"X": ("Tail", (0, 0, 0))}, ROM), "Tail"),
        (lambda: art.record(HUMAN, CMU, ROM, art.Faults(lost=("XYZ",))), "XYZ"),
        (lambda: art.merge({}), "nothing"),
        (lambda: art.merge({"A:B": EXACT}), "A:B"),
        (
            lambda: art.merge({"A": EXACT, "B": art.record(HUMAN, CMU, art.still(1, 9))}),
            "agree",
        ),
    ],
)
def test_wrong_input_is_named(wrong, message):
    with pytest.raises(ValueError, match=message):
        wrong()


@pytest.mark.parametrize("unit", list(art.UNITS))
def test_c3d_round_trip(tmp_path, unit):
    faults = art.Faults(sigma=SIGMA, dropout=0.3)
    clip = art.record(HUMAN, CMU, art.dance(1, 62.5), faults, first_frame=500)
    path = tmp_path / "clip.c3d"
    art.write_c3d(clip, path, unit)
    words = struct.unpack("<10H", path.read_bytes()[:20])
    assert (words[1], words[3], words[4]) == (41, 500, 499 + len(clip.points))
    back = ezc3d.c3d(str(path))
    point = back["parameters"]["POINT"]
    assert tuple(point["LABELS"]["value"]) == clip.labels
    assert point["UNITS"]["value"] == [unit]
    assert (point["X_SCREEN"]["value"], point["Y_SCREEN"]["value"]) == (["+X"], ["+Z"])
    assert point["RATE"]["value"][0] == 62.5
    points = back["data"]["points"][:3].transpose(2, 1, 0) / art.UNITS[unit]
    # Single precision: half a unit in the last place of coordinates up to 2 m.
    np.testing.assert_allclose(points, clip.points, atol=2.0**-23)
    missing = np.isnan(clip.points[..., 0])
    assert missing.any()
    np.testing.assert_array_equal(back["data"]["meta_points"]["residuals"][0].T < 0, missing)
    raw = np.frombuffer(path.read_bytes(), "<f4", clip.points.size // 3 * 4, (words[8] - 1) * 512)
    raw = raw.reshape(*missing.shape, 4)
    np.testing.assert_array_equal(raw[missing], np.tile([0, 0, 0, -1], (missing.sum(), 1)))
    assert list(tmp_path.iterdir()) == [path]


def test_c3d_of_several_subjects(tmp_path):
    one = art.record(HUMAN, CMU, art.still(0.2, 50))
    two = art.record(HUMAN, CMU, art.still(0.2, 50, 1), place=(0, 2, 0))
    clip = art.merge({"Anna": one, "Ben": two})
    assert clip.points.shape == (10, 82, 3)
    np.testing.assert_array_equal(clip.truth["Ben:Neck"], two.truth["Neck"])
    np.testing.assert_array_equal(clip.points[:, clip.labels.index("Ben:LFHD")], two.points[:, 0])
    art.write_c3d(clip, tmp_path / "two.c3d")
    parameters = ezc3d.c3d(str(tmp_path / "two.c3d"))["parameters"]
    assert parameters["SUBJECTS"]["NAMES"]["value"] == ["Anna", "Ben"]
    assert parameters["SUBJECTS"]["LABEL_PREFIXES"]["value"] == ["Anna:", "Ben:"]
    assert list(parameters["SUBJECTS"]["USES_PREFIXES"]["value"]) == [1, 1]
    assert list(parameters["SUBJECTS"]["USED"]["value"]) == [2]
    assert parameters["POINT"]["LABELS"]["value"][41] == "Ben:LFHD"


def test_c3d_of_more_than_255_labels(tmp_path):
    many = {f"M{i:03d}": ("Hips", (0.001 * i, 0.0, 0.0)) for i in range(300)}
    clip = art.record(HUMAN, many, art.still(0.1, 50))
    art.write_c3d(clip, tmp_path / "many.c3d")
    back = ezc3d.c3d(str(tmp_path / "many.c3d"))
    point = back["parameters"]["POINT"]
    assert (*point["LABELS"]["value"], *point["LABELS2"]["value"]) == clip.labels
    assert back["data"]["points"].shape == (4, 300, 5)


def test_c3d_longer_than_its_header_can_count(tmp_path):
    frames, first = 66000, 77
    motion = art.Motion(100.0, np.linspace(0, 1, frames)[:, None] * np.ones(3), {})
    clip = art.record(HUMAN, {"CLAV": CMU["CLAV"]}, motion, first_frame=first)
    path = tmp_path / "long.c3d"
    art.write_c3d(clip, path)
    raw = path.read_bytes()
    words = struct.unpack("<10H", raw[:20])
    assert words[3:5] == (first, 65535)
    stored = np.frombuffer(raw, "<f4", frames * 4, (words[8] - 1) * 512).reshape(frames, 4)
    np.testing.assert_allclose(stored[:, :3], 1000 * clip.points[:, 0], rtol=2.0**-23)
    trial = ezc3d.c3d(str(path))["parameters"]["TRIAL"]
    ends = [trial[f"ACTUAL_{end}_FIELD"]["value"].astype(int) for end in ("START", "END")]
    assert [low % 65536 + 65536 * high for low, high in ends] == [first, first + frames - 1]


def test_c3d_refuses_what_it_cannot_hold(tmp_path):
    clip = art.record(HUMAN, CMU, art.still(0.1, 50), first_frame=65536)
    with pytest.raises(ValueError, match="65535"):
        art.write_c3d(clip, tmp_path / "x.c3d")
    with pytest.raises(ValueError, match="inch"):
        art.write_c3d(EXACT, tmp_path / "x.c3d", "inch")
    with pytest.raises(OSError, match="cannot be written"):
        art.write_c3d(NOISY, tmp_path / "nowhere" / "x.c3d")
    assert list(tmp_path.iterdir()) == []


def read_csv(path: Path) -> tuple[list[str], list[list[str]]]:
    with path.open(newline="", encoding="utf-8") as lines:
        head, *rows = csv.reader(lines)
    return head, rows


def test_truth_csv(tmp_path):
    clip = art.record(HUMAN, CMU, art.dance(0.5, 120), first_frame=31)
    art.write_truth(clip, tmp_path / "truth.csv")
    head, rows = read_csv(tmp_path / "truth.csv")
    assert head == ["frame", "time", *(f"{joint}_{axis}" for joint in JOINTS for axis in "xyz")]
    assert [row[0] for row in rows] == [str(31 + i) for i in range(60)]
    assert rows[0][1] == "0.250000"
    assert all(len(cell.split(".")[1]) == 5 for row in rows for cell in row[2:])
    table = np.array(rows, dtype=float)[:, 2:].reshape(60, 14, 3)
    truth = np.stack(list(clip.truth.values()), axis=1)
    np.testing.assert_allclose(table, truth, atol=0.5e-5 + 1e-12)


def test_truth_csv_of_one_subject_among_several(tmp_path):
    ann, anna = (art.record(HUMAN, CMU, art.still(0.1, 50, seed)) for seed in (1, 2))
    both = art.merge({"Ann": ann, "Anna": anna})
    for clip, kwargs in [(anna, {}), (both, {"subject": "Anna"}), (art.merge({"A": anna}), {})]:
        art.write_truth(clip, tmp_path / "truth.csv", **kwargs)
        head, rows = read_csv(tmp_path / "truth.csv")
        assert head[2] == "Waist_x"
        assert len(head) == 44
        waist = np.array(rows, dtype=float)[:, 2:5]
        np.testing.assert_allclose(waist, anna.truth["Waist"], atol=0.5e-5 + 1e-12)
    for clip, subject in [(both, None), (both, "Cleo"), (anna, "Anna")]:
        with pytest.raises(ValueError, match="no subject"):
            art.write_truth(clip, tmp_path / "truth.csv", subject)


def test_command_writes_clip_and_truths(tmp_path, capsys):
    out = tmp_path / "clip.c3d"
    call = [str(out), "--motion", "dance", "--seconds", "1", "--rate", "50", "--sigma", "1mm"]
    call += ["--slide", "0.5cm", "--dropout", "0.2", "--subjects", "Anna,B/n", "--seed", "5"]
    assert main(call) == 0
    printed = capsys.readouterr().out
    assert "seed = 5\n" in printed
    assert "sigma = 0.001\n" in printed
    assert "slide = 0.005\n" in printed
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"clip.c3d", "clip.Anna.truth.csv", "clip.B_n.truth.csv"}
    first = out.read_bytes()
    with pytest.raises(SystemExit, match="2"):
        main(call)
    assert "--overwrite" in capsys.readouterr().err
    assert main([*call, "--overwrite"]) == 0
    assert out.read_bytes() == first


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--sigma", "1inch"], "not a length"),
        (["--subjects", "Anna,Anna"], "two subjects"),
        (["--dropout", "2"], "share"),
        (["--lost", "TAIL"], "TAIL"),
        (["--seconds", "0"], "no motion"),
    ],
)
def test_command_refuses_in_one_line(tmp_path, capsys, options, message):
    with pytest.raises(SystemExit, match="2"):
        main([str(tmp_path / "clip.c3d"), *options])
    assert message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def hinged(degrees, frames=61):
    """A figure whose left knee alone bends by so much, and its motion."""
    turn = np.deg2rad(degrees) * np.linspace(0, 1, frames)[:, None] * [0.0, 1.0, 0.0]
    return art.Motion(60.0, np.zeros((frames, 3)), {"LowerLeftLeg": art.from_vector(turn)})


def moved(motion, markers, **faults):
    """How far soft tissue carries markers, in their segments' axes, (frames, markers, 3)."""
    clip = art.record(HUMAN, markers, motion, art.Faults(**faults), seed=3)
    turn = np.stack([clip.poses[s].rotation for s, _ in markers.values()], axis=1)
    return np.einsum("fmji,fmj->fmi", turn, clip.points - clip.clean)


PAIR = {
    "A": ("LowerLeftLeg", (0.0, 0.05, -0.05)),
    "B": ("LowerLeftLeg", (0.0, -0.05, -0.08)),
}


class TestSoftTissue:
    def test_carries_a_marker_along_the_bone_in_proportion_to_the_angle(self):
        slide = moved(hinged(90), PAIR, tissue=(0.002, 0.015), together=0.0)
        far = np.abs(slide[-1, :, 2])
        assert ((far >= 0.002) & (far <= 0.015)).all()
        np.testing.assert_allclose(slide[..., :2], 0.0, atol=1e-12)
        share = np.linspace(0, 1, 61)[:, None]
        np.testing.assert_allclose(slide[..., 2], share * slide[-1, :, 2], atol=1e-12)

    def test_of_one_segment_may_move_at_once(self):
        slide = moved(hinged(90), PAIR, tissue=(0.01, 0.01), together=1.0)
        np.testing.assert_allclose(slide[:, 0], slide[:, 1], atol=1e-12)

    def test_wobbles_as_much_as_it_is_said_and_the_same_in_the_same_pose(self):
        turn = np.random.default_rng(5).normal(0, 1.0, (500, 3))
        there = art.from_vector(np.vstack([turn, turn]))
        motion = art.Motion(60.0, np.zeros((1000, 3)), {"LowerLeftLeg": there})
        markers = {
            f"{i}": ("LowerLeftLeg", (0.05 * np.cos(i), 0.05 * np.sin(i), -0.1)) for i in range(60)
        }
        wobble = moved(motion, markers, wobble=0.004, together=0.0)
        np.testing.assert_allclose(wobble[:500], wobble[500:], atol=1e-12)
        # Two axes along the skin for each of 60 independent markers of unit-mean-square waves.
        ratio = (wobble**2).sum(axis=-1).mean() / (2 * 0.004**2)
        assert ratio == pytest.approx(1.0, abs=4 / np.sqrt(60))

    @pytest.mark.parametrize(
        "wrong", [{"tissue": (0.01, 0.002)}, {"wobble": -1.0}, {"together": 1.5}]
    )
    def test_out_of_range_is_refused(self, wrong):
        with pytest.raises(ValueError, match=r"tissue|together"):
            art.Faults(**wrong)


def test_misplaced_markers_lie_within_the_length_and_on_their_segments():
    placed = art.misplaced(CMU, 0.01, seed=2)
    away = [np.subtract(placed[m][1], CMU[m][1]) for m in CMU]
    assert [s for s, _ in placed.values()] == [s for s, _ in CMU.values()]
    assert 0.005 < np.linalg.norm(away, axis=1).max() <= 0.01


def test_a_joint_that_glides_is_where_the_glide_puts_it_and_its_bone_follows():
    glide = {"LowerLeftLeg": np.linspace(0, 0.01, 61)[:, None] * [1.0, 0.0, 0.0]}
    plain = hinged(90)
    motion = art.Motion(plain.rate, plain.shift, plain.rotations, glide)
    still, moving = (art.record(HUMAN, CMU, m) for m in (plain, motion))
    for joint in ("LeftKnee", "LeftAnkle"):
        away = moving.truth[joint] - still.truth[joint]
        np.testing.assert_allclose(away, glide["LowerLeftLeg"], atol=1e-12)


def test_a_rotation_vector_comes_back():
    vector = np.random.default_rng(1).uniform(-1.5, 1.5, (200, 3))
    vector[0] = 0.0
    # The sine of half the angle loses digits towards a half turn: √eps at most.
    np.testing.assert_allclose(art.to_vector(art.from_vector(vector)), vector, atol=1e-7)

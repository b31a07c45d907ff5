"""Clips as people have them, as a user calls `fit` on them: what is wrong with each is said, or does no harm.

The clips are made here, so the true joints are known. A joint that the call tells as known to 2 or 5 cm is never
farther from its place (`fitted` checks every one). Seeds and lengths are small, since `fit` runs for each.
"""

import csv
import re
from dataclasses import dataclass

import numpy as np
import pytest
from c3d_bytes import c3d_file
from commands import call, files

from mocap_skel import artificial as art
from mocap_skel.artificial.markers import place_of
from mocap_skel.clip import turn_between

RATE = 60.0
MOVES = {
    "walk": art.walk(5, RATE, seed=8),
    "still": art.still(4, RATE, seed=8),
    "rom": art.range_of_motion(6, RATE, seed=8),
}
PIG = art.marker_set("plug_in_gait")
# Metres by which a joint of a leg may be off here: anatomy's own error, where a walk shows little.
RIGHT = 0.03
LEGS = tuple(s + j for s in ("Left", "Right") for j in ("Hip", "Knee", "Ankle"))
OTHER = {"L": "R", "R": "L"}
RNG = np.random.default_rng(8)


@dataclass
class Film:
    """A generated clip for a test to spoil: labels, metres, and the true joints."""

    labels: list[str]
    points: np.ndarray
    truth: dict[str, np.ndarray]

    def column(self, label):
        """(frames, 3), a view."""
        return self.points[:, self.labels.index(label)]

    def rename(self, way):
        self.labels = [way(label) for label in self.labels]
        return self

    def swap(self, one, other):
        return self.rename(lambda x: {one: other, other: one}.get(x, x))

    def turn(self, matrix):
        self.points = self.points @ matrix
        self.truth = {joint: track @ matrix for joint, track in self.truth.items()}
        return self

    def more(self, labels, points):
        self.labels = [*self.labels, *labels]
        self.points = np.concatenate([self.points, points], axis=1)
        return self


def film(motion="walk", *more, keep=lambda label: True):
    markers = {x: at for x, at in PIG.items() if keep(x)} | {x: place_of(x) for x in more}
    clip = art.record(art.human(), markers, MOVES[motion], art.Faults(sigma=0.001), seed=8)
    return Film(list(clip.labels), clip.points.copy(), dict(clip.truth))


def fit(folder, made, *options, scale=1000.0, unit="mm"):
    c3d_file(folder / "a.c3d", scale * made.points, rate=RATE, LABELS=made.labels, UNITS=unit)
    return call("fit", "a.c3d", *options, "-o", "out", cwd=folder)


def told(sentences):
    """Joint → metres to which the sentences below the table say that it is known."""
    known = {}
    for cm, names in re.findall(
        r"nown to (\d) cm(?: \(95 %\))?: ([^;.]*)", " ".join(sentences.split())
    ):
        for words in re.split(r", | and ", names):
            joint = words.title().replace(" ", "")
            sides = ["Left", "Right"] if joint.startswith("Both") else [""]
            joint = re.sub("^Both(.*)s$", r"\1", joint)
            known |= {side + joint: int(cm) / 100 for side in sides}
    return known


def off(folder, made, name="a"):
    """Joint → metres, the median over the frames, between its place in the result and its true one."""
    with (folder / "out" / f"{name}.skeleton.csv").open() as file:
        rows = list(csv.DictReader(file))
    found = {}
    for joint, track in made.truth.items():
        if f"{joint}_x" in rows[0]:
            here = [[float(row[f"{joint}_{a}"] or "nan") for a in "xyz"] for row in rows]
            away = np.linalg.norm(np.array(here) - track, axis=1)
            if np.isfinite(away).any():
                found[joint] = float(np.nanmedian(away))
    return found


def fitted(folder, made, *options, right=LEGS):
    """Fit a clip: what is told as known is, and some joints are right. Gives standard error and what is known."""
    done = fit(folder, made, *options)
    assert done.returncode == 0, done.stderr
    away, known = off(folder, made), told(done.stdout)
    assert known
    assert not {j: (away[j], cm) for j, cm in known.items() if away[j] > cm}
    assert not {j: away[j] for j in right if not away[j] < RIGHT}
    return done.stderr, known


def refused(folder, made, *options, code=2, **file):
    done = fit(folder, made, *options, **file)
    assert done.returncode == code and len(done.stderr.splitlines()) == 1
    assert files(folder) == ["a.c3d"]
    return done.stderr


@pytest.mark.parametrize("motion", MOVES)
@pytest.mark.parametrize("options", [(), ("--assoc", "plug_in_gait")])
def test_a_clean_clip_raises_no_alarm(tmp_path, motion, options):
    said, _ = fitted(tmp_path, film(motion), *options)
    assert not re.search("exchang|wrongly|mirror|left out|count as missing|spike|point up", said)


@pytest.mark.parametrize("options", [(), ("--assoc", "plug_in_gait")])
@pytest.mark.parametrize(
    ("one", "other", "joint"),
    [
        ("RTHI", "RKNE", "RightKnee"), ("LANK", "LTOE", "LeftAnkle"), ("LHEE", "LTOE", "LeftAnkle"),
        ("LSHO", "RSHO", "LeftShoulder"), ("LWRA", "LFIN", "LeftWrist"), ("C7", "LSHO", "LeftShoulder"),
    ],
)  # fmt: skip
def test_two_exchanged_labels_are_named_and_their_joint_is_not_known(
    tmp_path, one, other, joint, options
):
    said, known = fitted(tmp_path, film().swap(one, other), *options, right=())
    assert re.search(f"{one}\\b.*exchanged|exchanged.*{one}\\b", said)
    assert joint not in known


@pytest.mark.parametrize("other", ["RBHD", "LSHO", "LANK"])
def test_no_joint_is_known_below_one_that_an_exchange_takes_away(tmp_path, other):
    """Without its shoulder's marker, which stands still, an upper arm turns about a place holder."""
    _, known = fitted(tmp_path, film("still").swap("RSHO", other), right=())
    assert not {"RightShoulder", "RightElbow"} & {*known}


@pytest.mark.parametrize("motion", ["walk", "still"])
@pytest.mark.parametrize(
    ("part", "joint"),
    [
        (("UPA", "ELB", "FRM", "WRA", "WRB", "FIN"), "LeftElbow"),
        (("THI", "KNE", "TIB", "ANK", "HEE", "TOE"), "LeftKnee"),
        (("HEE", "TOE"), "LeftAnkle"), (("FHD", "BHD"), "Neck"),
    ],
)  # fmt: skip
def test_left_and_right_of_a_limb_exchanged(tmp_path, motion, part, joint):
    made = film(motion).rename(lambda x: OTHER[x[0]] + x[1:] if x[1:] in part else x)
    said, known = fitted(tmp_path, made, right=())
    assert "left and right of the" in said and "look exchanged" in said
    assert joint not in known


@pytest.mark.parametrize(("axis", "up"), [(0, "z"), (1, "y"), (2, "z"), (1, "-x")])
def test_a_mirrored_body_stops_with_what_to_do_and_is_right_then(tmp_path, axis, up):
    made = film().turn(turn_between(up, "z"))
    negate = np.ones(3)
    negate[axis] = -1
    made.points = made.points * negate
    assert "--mirror" in refused(tmp_path, made)
    fitted(tmp_path, made, "--mirror", "xyz"[axis])


@pytest.mark.parametrize(
    "name", ["Sacrum", "V.Sacral", "SACR", "S2", "MPSI", "L5S1", "sacrum_marker"]
)
def test_a_sacrum_gives_the_hips_their_anatomy(tmp_path, name):
    made = film("still")
    made.column("LPSI")[:] = (made.column("LPSI") + made.column("RPSI")) / 2
    keep = [i for i, label in enumerate(made.labels) if label != "RPSI"]
    made.labels, made.points = [made.labels[i] for i in keep], made.points[:, keep]
    _, known = fitted(tmp_path, made.rename(lambda x: name if x == "LPSI" else x))
    assert {"LeftHip", "RightHip"} <= {*known}


def test_without_a_sacrum_neither_hip_nor_knee_is_known(tmp_path):
    """A fifth lumbar vertebra is no sacrum; the thigh's frame then rests on a place holder."""
    made = film("still")
    made.column("LPSI")[:] = (made.column("LPSI") + made.column("RPSI")) / 2
    made = made.rename(lambda x: {"LPSI": "LV5", "RPSI": "*1"}.get(x, x))
    _, known = fitted(tmp_path, made, right=())
    assert not {"LeftHip", "RightHip", "LeftKnee", "RightKnee"} & {*known}


@pytest.mark.parametrize("exchanged", [False, True])
@pytest.mark.parametrize(
    ("lateral", "medial"),
    [
        ("{s}.Knee.Lat", "{s}.Knee.Med"), ("{s}KNE", "{s}MKNE"), ("LFE{s}", "MFE{s}"),
        ("{s}LatCond", "{s}MedCond"), ("{s}KNE_O", "{s}KNE_I"), ("{s}LEPI", "{s}MEPI"),
    ],
)  # fmt: skip
def test_medial_and_lateral_by_name_and_by_place(tmp_path, lateral, medial, exchanged):
    made = film("still", "LKNM", "RKNM")
    names = (medial, lateral) if exchanged else (lateral, medial)
    new = {
        s + x: way.format(s=s) for s in "LR" for x, way in zip(("KNE", "KNM"), names, strict=True)
    }
    made = made.rename(lambda x: new.get(x, x))
    if exchanged:  # and first in the file
        made.labels, made.points = made.labels[::-1], made.points[:, ::-1]
    said, _ = fitted(tmp_path, made)
    away = off(tmp_path, made)
    # Between the two epicondyles, where the generator has the knee within millimetres.
    assert max(away["LeftKnee"], away["RightKnee"]) < 0.01
    assert ("exchanged, as places say" in said) == exchanged


def held(track, start, stop):
    track[start:stop] = track[start - 1]


def constant(track, start, stop):
    track[start:stop] = -0.001


def line(track, start, stop):
    way = np.linspace(0, 1, stop - start + 2)[1:-1, None]
    track[start:stop] = track[start - 1] + way * (track[stop] - track[start - 1])


def glides_on(track, start, stop):
    track[start:stop] = track[start - 1] + 0.002 * np.arange(1, stop - start + 1)[:, None]


@pytest.mark.parametrize("fill", [held, constant, line, glides_on])
@pytest.mark.parametrize(("label", "start", "stop"), [("LKNE", 90, 130), ("RTOE", 120, 299)])
def test_samples_that_nobody_measured_are_named_and_do_no_harm(tmp_path, fill, label, start, stop):
    made = film()
    fill(made.column(label), start, stop)
    said, _ = fitted(tmp_path, made, "--assoc", "plug_in_gait")
    assert f"{label}: " in said and "count as missing" in said


@pytest.mark.parametrize("label", ["LASI", "LKNE"])
def test_what_is_nearly_held_makes_no_joint_known(tmp_path, label):
    """A filter over a held sample leaves a thousandth of a millimetre, so that nothing repeats."""
    made = film()
    track = made.column(label)
    track[120:] = track[119] + 1e-6 * RNG.standard_normal((len(track) - 120, 3))
    fitted(
        tmp_path, made, "--assoc", "plug_in_gait", right=("RightKnee",) if label == "LKNE" else ()
    )


@pytest.mark.parametrize("label", ["LKNE", "RELB", "RFIN", "LWRA", "RTIB", "LTOE"])
def test_a_spike_of_one_frame_is_named(tmp_path, label):
    made = film()
    made.column(label)[150] += 0.09
    said, _ = fitted(tmp_path, made, "--assoc", "plug_in_gait")
    assert re.search(f"{label}: 1 sample.* 151", said)


@pytest.mark.parametrize(
    ("scale", "unit", "hint"),
    [(100, "mm", "cm"), (1, "mm", "m"), (1000, "m", "mm"), (1000 / 25.4, "mm", "in")],
)
def test_a_unit_that_cannot_be_is_asked_for(tmp_path, scale, unit, hint):
    assert f"with --unit {hint} it is 1.7" in refused(tmp_path, film(), scale=scale, unit=unit)
    done = fit(tmp_path, film(), "--unit", hint, scale=scale, unit=unit)
    assert done.returncode == 0 and off(tmp_path, film())["LeftHip"] < RIGHT


@pytest.mark.parametrize(
    "ghost",
    ["*{}", "Unlabeled {}", "Active {}", "C_{}", "U_{}", "New {:04d}", "uname*{}", "_{:04d}", "{}"],
)
def test_trajectories_without_a_name_do_not_stop_a_complete_set(tmp_path, ghost):
    made = film()
    tracks = 1.5 * RNG.standard_normal((len(made.points), 45, 3))
    said, _ = fitted(tmp_path, made.more([ghost.format(n + 1) for n in range(45)], tracks))
    assert "unlabelled trajectories are set aside" in said


@pytest.mark.parametrize("options", [(), ("--assoc", "plug_in_gait")])
@pytest.mark.parametrize("way", ["Subject1_{}", "01_{}", "John Doe {}", "{}-P1"])
def test_a_name_around_the_labels_changes_nothing(tmp_path, way, options):
    fitted(tmp_path, film().rename(way.format), *options)


@pytest.mark.parametrize(
    "ways", [("1{}", "2{}"), ("A{}", "B{}"), ("{}_a", "{}_b"), ("Ann {}", "Ann B {}")]
)
def test_two_people_are_two(tmp_path, ways):
    one, other = film(), film("rom")
    count, away = len(one.points), np.array([1.5, 0.5, 0.0])
    labels = [
        way.format(x) for way, who in zip(ways, (one, other), strict=True) for x in who.labels
    ]
    points = np.concatenate([one.points, other.points[:count] + away], axis=1)
    done = fit(tmp_path, Film(labels, points, {}))
    assert done.returncode == 0
    names = sorted(
        f.removesuffix(".skeleton.csv") for f in files(tmp_path / "out") if "skeleton" in f
    )
    other.truth = {joint: track[:count] + away for joint, track in other.truth.items()}
    for name, who in zip(names, (one, other), strict=True):
        found = off(tmp_path, who, name)
        assert not {joint: found[joint] for joint in LEGS if not found[joint] < RIGHT}


@pytest.mark.parametrize("options", [(), ("--assoc", "plug_in_gait")])
@pytest.mark.parametrize("first", [False, True])
def test_of_two_under_one_label_the_one_that_moves_with_its_segment(tmp_path, first, options):
    made = film()
    i = made.labels.index("LKNE")
    made.labels.insert(i if first else len(made.labels), "LKNE")
    stray = made.points[:, [made.labels.index("RFIN")]] + 0.02
    at = i if first else made.points.shape[1]
    made.points = np.insert(made.points, [at], stray, axis=1)
    said, known = fitted(tmp_path, made, *options)
    assert "LKNE stands 2 times in the file" in said and "LeftKnee" in known


@pytest.mark.parametrize(
    ("keep", "said"),
    [
        (lambda x: x[1:] in ("THI", "KNE", "TIB", "ANK", "HEE", "TOE"), "right_leg starts at UpperRightLeg, where only RTHI, RKNE"),
        (lambda x: x[0] == "R" and x[1:] in ("UPA", "ELB", "FRM", "WRA", "WRB"), "right_arm starts at UpperRightArm, where only RUPA, RELB"),
    ],
)  # fmt: skip
def test_a_limb_that_cannot_be_fitted_says_what_is_missing(tmp_path, keep, said):
    assert said in refused(tmp_path, film(keep=keep))


def test_an_arm_is_fitted_of_its_own_accord(tmp_path):
    arm = ("RUPA", "RELB", "RFRM", "RWRA", "RWRB", "RFIN")
    made = film("rom", "RMEP", keep=arm.__contains__)
    said, known = fitted(tmp_path, made, right=("RightElbow",))
    assert "of the figure right_arm" in said and known["RightElbow"] == 0.02

"""Markers that stand in another's place, and mirrored bodies: said when they are there, and only then."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from recordings import SAMPLES, clip_of, known

from mocap_skel import associate, fit_skeleton, read_clip
from mocap_skel.artificial import (
    Faults,
    dance,
    human,
    marker_set,
    range_of_motion,
    record,
    still,
    walk,
)
from mocap_skel.artificial.rotations import from_vector
from mocap_skel.errors import LabelError
from mocap_skel.segments.misplaced import find_misplaced

MOTIONS = {"walk": walk, "still": still, "dance": dance, "rom": range_of_motion}
# Exchanges that move no joint by 2 cm: nothing of the fit rests on which of the two is which.
HARMLESS = frozenset(
    frozenset(pair.split("/"))
    for pair in (
        "RFHD/LBHD", "LFHD/RBHD", "RWRA/RWRB", "LWRA/LWRB"
    )
)  # fmt: skip


@cache
def recorded(motion, markers="cmu", seconds=3, **faults):
    moved = MOTIONS[motion](seconds, 60, seed=1)
    return record(human(), marker_set(markers), moved, Faults(sigma=0.001, **faults), seed=1)


def exchanged(clip, *pairs):
    """The clip with the labels of each pair exchanged."""
    other = dict(pairs) | {second: first for first, second in pairs}
    return replace(clip, labels=tuple(other.get(label, label) for label in clip.labels))


def found(clip, markers="cmu"):
    association = known(markers)
    columns = associate(clip, association)[0].columns
    return find_misplaced(clip.points, columns, association.skeleton)


def same_segment():
    """Pairs of one segment or of a segment and its parent, of one side, by the labels of the CMU set."""
    figure = known("cmu").skeleton
    of = {rule.label: rule.segment for rule in known("cmu").rules}
    parent = {segment.name: segment.parent for segment in figure.segments}
    limb = [label for label in of if label[:1] == "R" and "Right" in of[label]]
    return [
        (first, second)
        for i, first in enumerate(limb)
        for second in limb[i + 1 :]
        if of[first] in (of[second], parent[of[second]]) or of[second] == parent[of[first]]
    ]


class TestExchanges:
    @pytest.mark.parametrize("motion", ["walk", "still"])
    def test_every_two_neighbours_of_a_limb_are_told_or_harm_nothing(self, motion):
        clip = clip_of(recorded(motion))
        wrong = {}
        for pair in same_segment():
            said = set(found(exchanged(clip, pair)).segment)
            # Two markers of the elbow's two sides fit either way round where the elbow hardly bends.
            names = {
                "RTIB" if label == "RSHN" else "RARM" if label == "RFRM" else label
                for label in pair
            }
            if frozenset(pair) in HARMLESS:
                continue
            if not names <= said and pair != ("RELB", "RWRA"):
                wrong[pair] = said
            assert said, pair
        assert wrong == {}

    @pytest.mark.parametrize("motion", ["walk", "still"])
    @pytest.mark.parametrize(
        "name", ["FWT", "BWT", "THI", "KNE", "SHN", "ANK", "TOE", "SHO", "UPA", "ELB", "WRA", "FHD"]
    )
    def test_left_and_right_of_one_marker(self, motion, name):
        said = found(exchanged(clip_of(recorded(motion)), (f"L{name}", f"R{name}")))
        standard = name.replace("SHN", "TIB")
        assert set(said.segment) == {f"L{standard}", f"R{standard}"}
        assert said.mirrored == ""

    @pytest.mark.parametrize(
        ("part", "names"),
        [
            ("arms", ("UPA", "ELB", "FRM", "WRA", "WRB", "FIN")),
            ("legs", ("THI", "KNE", "SHN", "ANK", "HEE", "TOE", "MT5")),
            ("head", ("FHD", "BHD")),
        ],
    )
    def test_left_and_right_of_a_part(self, part, names):
        pairs = [(f"L{name}", f"R{name}") for name in names]
        said = found(exchanged(clip_of(recorded("still")), *pairs))
        assert len(said.segment) == 2 * len(names)
        assert said.sentences[0].startswith(f"left and right of the {part} look exchanged")

    @pytest.mark.parametrize("motion", ["walk", "dance", "rom"])
    @pytest.mark.parametrize(
        "names",
        [
            ("WRA", "WRB", "FIN"),
            ("WRA", "WRB"),
            ("FRM", "WRA", "WRB"),
            ("UPA", "ELB"),
            ("ELB", "FRM"),
            ("THI", "KNE"),
            ("SHN", "ANK"),
            ("ANK", "HEE", "TOE", "MT5"),
            ("HEE", "TOE", "MT5"),
            ("FHD", "BHD"),
        ],
        ids="/".join,
    )
    def test_left_and_right_in_the_middle_of_a_limb_name_these_and_no_neighbour(
        self, motion, names
    ):
        pairs = [(f"L{name}", f"R{name}") for name in names]
        said = found(exchanged(clip_of(recorded(motion, seconds=6)), *pairs))
        standard = {n.replace("SHN", "TIB").replace("FRM", "ARM") for n in names}
        assert set(said.segment) == {f"{side}{name}" for side in "LR" for name in standard}
        assert all("look exchanged" in sentence for sentence in said.sentences)

    @pytest.mark.parametrize("motion", ["walk", "still"])
    @pytest.mark.parametrize("axis", [0, 1, 2])
    def test_a_negated_axis_and_exchanged_sides_are_one_finding(self, motion, axis):
        clip = clip_of(recorded(motion))
        signs = np.where(np.arange(3) == axis, -1.0, 1.0)
        sides = [(label, f"R{label[1:]}") for label in clip.labels if label[0] == "L"]
        for mirrored in (replace(clip, points=clip.points * signs), exchanged(clip, *sides)):
            said = found(mirrored)
            assert "left-handed axes" in said.mirrored and not said.sentences


class TestNoFalseAlarm:
    @pytest.mark.parametrize("markers", ["cmu", "plug_in_gait"])
    @pytest.mark.parametrize("motion", list(MOTIONS))
    @pytest.mark.parametrize("faults", [{}, {"slide": 0.01}, {"dropout": 0.1}], ids=str)
    def test_generated_clips(self, markers, motion, faults):
        said = found(clip_of(recorded(motion, markers, **faults)), markers)
        assert (said.sentences, said.mirrored) == ((), "")

    def test_single_postures_at_any_turn(self):
        """Every joint anywhere in its range at once, lying, upside down: geometry alone has to be sure."""
        clip = clip_of(recorded("rom", seconds=40))
        turns = from_vector(np.random.default_rng(2).normal(scale=2.0, size=(120, 3)))
        for frame, turn in zip(range(0, 2400, 20), turns, strict=True):
            points = np.repeat(clip.points[frame : frame + 1] @ turn.T, 3, axis=0)
            said = found(replace(clip, points=points))
            assert (frame, said.sentences, said.mirrored) == (frame, (), "")

    @pytest.mark.parametrize("name", ["range_of_motion", "nearly_still", "gaps"])
    def test_bundled_clips(self, name):
        association = known("right_leg" if name == "gaps" else "cmu")
        clip = read_clip(SAMPLES / f"{name}.c3d")
        columns = associate(clip, association)[0].columns
        assert not find_misplaced(clip.points, columns, association.skeleton).sentences


class TestTheFit:
    def fit(self, clip, **options):
        association = known("cmu")
        return fit_skeleton(clip, associate(clip, association)[0], association.skeleton, **options)

    def test_markers_in_doubt_are_left_out_and_their_joints_not_shown(self):
        fit = self.fit(exchanged(clip_of(recorded("rom", seconds=8)), ("RANK", "RHEE")))
        assert fit.notes[0].startswith("left out of the fit: RANK and RHEE look exchanged")
        joints = {joint.joint: joint for joint in fit.joints}
        in_doubt = {name for name, joint in joints.items() if joint.doubt}
        assert in_doubt == {"RightKnee", "RightAnkle"}
        assert all(joints[name].shown != "yes" for name in in_doubt)
        assert "RANK" in joints["RightKnee"].reason
        assert "RANK" not in fit.segments["LowerRightLeg"].template

    def test_a_mirrored_body_stops_and_is_fitted_where_it_is_asked_for(self):
        clip = clip_of(recorded("walk"))
        mirrored = replace(clip, points=clip.points * [1.0, -1.0, 1.0])
        with pytest.raises(LabelError, match="the body is mirrored") as caught:
            self.fit(mirrored)
        assert "--mirror x" in caught.value.hint
        assert any("mirrored" in note for note in self.fit(mirrored, trust=True).notes)

    def test_a_root_without_its_markers_stops(self):
        clip = exchanged(clip_of(recorded("walk")), ("LFWT", "RFWT"))
        with pytest.raises(LabelError, match="LFWT and RFWT look exchanged"):
            self.fit(clip)

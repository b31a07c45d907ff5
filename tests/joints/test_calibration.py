"""What a calibration gives to another clip's joint: whose markers count as the same, and how much comes from where.

All on templates and moments that are made by hand: a parent of four markers, a child of three about a joint.
"""

from dataclasses import replace

import numpy as np
import pytest
from poses import rotations
from scipy.spatial.transform import Rotation

from mocap_skel.joints.calibration import (
    REATTACHED,
    SPREADS,
    Calibration,
    ClipEvidence,
    JointEvidence,
    Template,
    aligned,
    calibration_note,
    credited,
    pooled_evidence,
    share_of,
    template_of,
)
from mocap_skel.joints.evidence import Evidence, information
from mocap_skel.joints.joint_fit import unfitted
from mocap_skel.segments.shape import find_shape
from mocap_skel.spherefit import sphere_moments

PARENT = {
    "P1": np.array([0.1, 0.0, 0.0]), "P2": np.array([-0.1, 0.05, 0.0]),
    "P3": np.array([0.0, -0.1, 0.02]), "P4": np.array([0.02, 0.0, 0.1]),
}  # fmt: skip
CHILD = {
    "K1": np.array([0.0, 0.0, -0.2]), "K2": np.array([0.1, 0.0, -0.3]),
    "K3": np.array([0.0, 0.1, -0.4]),
}  # fmt: skip
CENTRE = np.array([0.02, 0.1, -0.1])


def evidence_of(child, frames, seed, centre=CENTRE):
    """Of a child that turns by up to 0.6 rad about each axis; every fourth sample counts for itself."""
    turns = Rotation.from_rotvec(np.random.default_rng(seed).uniform(-0.6, 0.6, (frames, 3)))
    turns = turns.as_matrix()
    points = centre + np.einsum("fij,mj->mfi", turns, np.array(list(child.values())))
    count = len(child)
    moments = sphere_moments(points)
    eye = np.tile(np.eye(3), (count, 1, 1))
    return Evidence(
        moments, 0.001, eye, 0 * eye, np.zeros((count, 3)), 1e-6 * eye, moments.count / 4,
        np.zeros(count),
    )  # fmt: skip


def clip_of(name, frames, seed, *, parent=PARENT, child=CHILD, turn=None, shift=(0.0, 0.0, 0.0)):
    """A clip whose coordinates of the parent are turned and shifted against ours."""
    turn = np.eye(3) if turn is None else turn
    own = {marker: turn @ place + shift for marker, place in parent.items()}
    known = evidence_of(
        {m: turn @ p for m, p in child.items()}, frames, seed, turn @ CENTRE + shift
    )
    joint = JointEvidence("Pelvis", "Thigh", tuple(child), known)
    segments = {"Pelvis": Template(own, None), "Thigh": Template(child, None)}
    return ClipEvidence(name, "", frames, 100.0, name, segments, {"Hip": joint})


def pooled(*clips, parent=PARENT, child=CHILD):
    return pooled_evidence(
        Calibration("figure", clips), "Hip", Template(parent, None), Template(child, None), list(child)
    )  # fmt: skip


class TestPooled:
    @pytest.fixture(autouse=True)
    def alike(self, monkeypatch):
        """Clips that count alike: how much each counts is tests/pipeline/test_pooling.py's."""
        monkeypatch.setattr(
            "mocap_skel.joints.calibration.by_skin", lambda clips, _: [1.0] * len(clips)
        )

    def test_clips_of_the_same_markers_are_one_in_our_coordinates(self):
        turn, shift = rotations(np.random.default_rng(5), 1)[0], np.array([0.3, -0.2, 0.1])
        found, notes = pooled(clip_of("a", 40, 1), clip_of("b", 100, 2, turn=turn, shift=shift))
        assert notes == ()
        assert (found.markers, found.clips) == (tuple(CHILD), ("a", "b"))
        np.testing.assert_array_equal(found.evidence.count, [140] * 3)
        np.testing.assert_allclose(found.evidence.effective, [35.0] * 3)
        # All samples of both clips lie on one sphere about one centre: |y - c|² has no spread.
        m = found.evidence.moments
        away = m.mean - CENTRE
        radius = np.array([np.linalg.norm(p) for p in CHILD.values()])
        square = np.trace(m.covariance, axis1=1, axis2=2) * 139 / 140 + (away**2).sum(axis=1)
        np.testing.assert_allclose(square, radius**2, rtol=1e-12)

    @pytest.mark.parametrize("marker", CHILD)
    def test_a_moved_marker_of_the_child_has_a_radius_of_its_own(self, marker):
        moved = {**CHILD, marker: CHILD[marker] + [0.0, 0.0, 0.03]}
        clips = clip_of("a", 40, 1), clip_of("b", 100, 2, child=moved)
        found, notes = pooled(*clips)
        (note,) = notes
        assert note.startswith(f"Thigh of b has radii of its own: {marker} re-attached")
        assert found.markers == (*CHILD, *(f"{name} (b)" for name in CHILD))
        np.testing.assert_array_equal(found.evidence.count, [40] * 3 + [100] * 3)
        for name in ("mean", "covariance", "third"):
            whole = getattr(found.evidence.moments, name)
            parts = [getattr(c.joints["Hip"].evidence.moments, name) for c in clips]
            np.testing.assert_allclose(whole, np.concatenate(parts), rtol=0, atol=1e-12)

    def test_a_moved_marker_of_the_parent_leaves_the_clip_out(self):
        moved = {**PARENT, "P2": PARENT["P2"] + [0.0, 0.04, 0.0]}
        found, notes = pooled(clip_of("a", 40, 1), clip_of("b", 100, 2, parent=moved))
        (note,) = notes
        assert note.startswith("Pelvis of b is not used: P2 re-attached")
        assert found.clips == ("a",)
        np.testing.assert_array_equal(found.evidence.count, [40] * 3)
        nothing, (note,) = pooled(clip_of("b", 100, 2, parent=moved))
        assert nothing is None and "P2" in note

    def test_markers_of_other_clips_stand_behind_our_own(self):
        fewer = {"K3": CHILD["K3"]}
        found, _ = pooled(clip_of("a", 40, 1), child=fewer)
        assert found.markers == ("K3", "K1", "K2")
        ours = clip_of("a", 40, 1).joints["Hip"].evidence.moments.mean[[2, 0, 1]]
        np.testing.assert_allclose(found.evidence.moments.mean, ours, rtol=0, atol=1e-12)

    def test_a_clip_without_the_joint_or_without_a_common_place_knows_nothing(self):
        no_joint = replace(clip_of("a", 40, 1), joints={})
        strangers = {f"X{i}": place for i, place in enumerate(PARENT.values())}
        assert pooled(no_joint) == (None, ())
        assert pooled(clip_of("b", 40, 1, parent=strangers)) == (None, ())


class TestAligned:
    TURN = rotations(np.random.default_rng(7), 1)[0]
    SHIFT = np.array([0.4, 0.1, -0.3])

    def ours(self, places):
        return {name: self.TURN @ p + self.SHIFT for name, p in places.items()}

    def test_two_markers_and_the_joint_are_enough(self):
        places = {name: PARENT[name] for name in ("P1", "P2")}
        theirs = Template(places, CENTRE)
        ours = Template(self.ours(places), self.TURN @ CENTRE + self.SHIFT)
        (turn, shift), _ = aligned(theirs, ours)
        np.testing.assert_allclose(turn, self.TURN, atol=1e-9)
        np.testing.assert_allclose(shift, self.SHIFT, atol=1e-9)
        assert aligned(theirs, replace(ours, joint=None)) == (None, "")

    def test_the_joint_tells_the_turn_about_two_markers_and_does_not_pull_them(self):
        """A joint that is 2 cm off, in another direction from the markers than along their line."""
        places = {name: PARENT[name] for name in ("P1", "P2")}
        ours = Template(self.ours(places), self.TURN @ (CENTRE + [0.0, 0.0, 0.02]) + self.SHIFT)
        (turn, shift), _ = aligned(Template(places, CENTRE), ours)
        for name, place in places.items():
            # A weight of a thousandth: of 2 cm some 0.02 mm.
            np.testing.assert_allclose(turn @ place + shift, ours.markers[name], atol=5e-5)

    @pytest.mark.parametrize(
        ("rigid", "limit"), [(0.0, REATTACHED), (0.01, SPREADS * 0.01 * 2**0.5)]
    )
    def test_distances_may_differ_by_what_skin_does(self, rigid, limit):
        """15 mm, or three standard deviations of both clips' own shapes together: 42 mm for 1 cm each."""
        along = (PARENT["P1"] - PARENT["P2"]) / np.linalg.norm(PARENT["P1"] - PARENT["P2"])
        pair = {name: PARENT[name] for name in ("P1", "P2")}
        for by, same in ((0.99 * limit, True), (1.01 * limit, False)):
            moved = {**pair, "P1": pair["P1"] + by * along}
            place, note = aligned(
                Template(pair, CENTRE, rigid), Template(moved, CENTRE, rigid)
            )  # fmt: skip
            assert (place is not None) == same
            # Of two markers either may be the one.
            assert (note == "") == same
            if not same:
                assert note == f"P1, P2 re-attached, distances differ by {1e3 * by:.0f} mm"


class TestTemplate:
    def test_of_two_markers_the_distance_is_all_there_is(self):
        points = np.zeros((5, 2, 3))
        points[:, 1] = np.array([[0.0, 0.3, 0.4]])
        points[3, 0] = np.nan
        found = template_of(("A", "B"), points, None)
        assert found.markers.keys() == {"A", "B"}
        assert np.linalg.norm(found.markers["A"] - found.markers["B"]) == pytest.approx(0.5)
        assert (found.joint, found.rigid) == (None, 0.0)
        points[:3, 1] = np.nan
        points[4, 1] = np.nan
        assert template_of(("A", "B"), points, None).markers == {}

    def test_of_three_it_is_their_shape(self):
        rng = np.random.default_rng(1)
        points = np.einsum("fij,mj->fmi", rotations(rng, 50), np.array(list(PARENT.values())))
        points += 0.001 * rng.normal(size=points.shape)
        shape, _ = find_shape(points)
        found = template_of(tuple(PARENT), points, shape)
        np.testing.assert_array_equal(list(found.markers.values()), shape.template)
        assert found.rigid == shape.sigma
        assert template_of(("A",), points[:, :1], None).markers == {}


class TestShares:
    def test_the_share_is_that_of_the_information(self):
        """Three times as many frames of the same movement know three times as much: three quarters."""
        one, three = (evidence_of(CHILD, n, 3) for n in (1000, 3000))
        told = [np.trace(information(e, CENTRE)) for e in (one, three)]
        assert told[1] / told[0] == pytest.approx(3, rel=0.1)
        assert share_of(three, one, CENTRE) == pytest.approx(0.75, abs=0.02)
        assert share_of(one, three, CENTRE) == pytest.approx(0.25, abs=0.02)
        assert share_of(one, None, CENTRE) == pytest.approx(1.0, abs=1e-3)

    def test_a_centre_says_it_and_keeps_the_radii_of_its_own_markers(self):
        found, _ = pooled(clip_of("a", 3000, 3), child={"K1": CHILD["K1"]})
        own = evidence_of(CHILD, 1000, 4)
        centre = replace(
            unfitted("Hip", "Pelvis", "Thigh", 3, "hardly moves"), centre=CENTRE, evidence=own,
            radius=np.array([0.2, 0.3, 0.4]),
        )  # fmt: skip
        said, words = credited(centre, found, 1)
        share = round(100 * share_of(found.evidence, own, CENTRE))
        assert words == f"calibration (1 clip) {share} %"
        assert said.reason == f"hardly moves; {words}"
        np.testing.assert_array_equal(said.radius, [0.2])
        both, _ = pooled(clip_of("a", 50, 3), clip_of("b", 60, 4))
        assert credited(replace(centre, reason=""), both, 3)[0].reason.startswith(
            "calibration (2 clips) "
        )

    def test_the_note_names_the_joints_or_says_that_there_are_none(self):
        used = {"Hip": "calibration (1 clip) 75 %", "Knee": "calibration (1 clip) 4 %"}
        assert calibration_note(used) == (
            "from the calibration: Hip: calibration (1 clip) 75 %, Knee: calibration (1 clip) 4 %"
        )
        assert calibration_note({}).startswith("nothing of the calibration could be used")

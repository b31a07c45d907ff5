"""What a fit is against time: bone lengths, radial residuals, gaps, the frame to draw."""

from dataclasses import replace

import numpy as np
import pytest
from actors import SIGMA, actor, actor_of, film, recording
from handmade import FRAMES, fit_of, joint
from recordings import clip_of

from mocap_skel.artificial import Swap
from mocap_skel.results.series import best_frame, bones, by_sides, radial, side, sideless


def test_bones_have_the_true_length_and_keep_it_but_for_noise():
    found = {(bone.start, bone.end): bone for bone in bones(actor().fit)}
    true = recording().truth
    checked = 0
    for (start, end), bone in found.items():
        if end in true:
            length = np.linalg.norm(true[start] - true[end], axis=1).mean()
            assert bone.median == pytest.approx(length, abs=2 * SIGMA), (start, end)
            assert np.nanstd(bone.length) < 2 * SIGMA, (start, end)
            checked += 1
    # Waist to neck and shoulders, and upper and lower parts of four limbs.
    assert checked == 3 + 8
    assert [b.end for b in found.values() if b.end == b.segment] == [
        s.name for s in actor().fit.skeleton.leaves
    ]


@pytest.mark.parametrize("swap", [False, True])
def test_residuals_are_those_of_the_fit(swap):
    swaps = (Swap("RKNE", "LKNE", 100, 160),) if swap else ()
    one_actor = actor_of(clip_of(film(dropout=0.02, swaps=swaps)))
    assert bool(one_actor.fit.left_out) == swap
    for one in radial(one_actor.fit, one_actor.markers):
        seen = one.errors[np.isfinite(one.errors)]
        assert one.joint.samples == len(seen)
        # Both sum the same numbers, in another order.
        assert np.sqrt(np.mean(seen**2)) == pytest.approx(one.joint.residual, rel=1e-9)
        lengths = np.linalg.norm(one.directions, axis=-1)
        np.testing.assert_allclose(lengths[np.isfinite(lengths)], 1.0, rtol=1e-12)


def test_a_gap_stays_a_gap():
    gaps = 0
    for own in actor().markers.values():
        for name, track in own.items():
            column = next(
                i for i, label in enumerate(recording().labels)
                if np.array_equal(recording().points[:, i], track, equal_nan=True)
            )  # fmt: skip
            gaps += int(np.isnan(track[:, 0]).sum())
            assert name and np.isnan(recording().points[np.isnan(track[:, 0]), column]).all()
    assert gaps == np.isnan(recording().points[..., 0]).sum() > 0


def test_sides_are_told_by_name():
    assert [side(n) for n in ("LeftKnee", "UpperRightLeg", "Neck")] == ["left", "right", ""]
    assert sideless("UpperRightLeg") == sideless("UpperLeftLeg") == "UpperLeg"
    assert by_sides(["Neck", "RightHip", "LeftHip"]) == {"Neck": [0], "Hip": [1, 2]}


def test_the_frame_to_draw_is_the_middlemost_of_those_in_which_most_is_seen():
    frame = best_frame([(actor().fit, actor().markers)])
    missing = np.array(
        [np.isnan(t[:, 0]) for own in actor().markers.values() for t in own.values()]
    ).sum(axis=0)
    best = np.flatnonzero(missing == missing.min())
    middle = (len(missing) - 1) / 2
    assert missing[frame] == missing.min()
    assert abs(frame - middle) <= np.abs(best - middle).min()


def test_errors_are_distances_less_their_mean_and_directions_point_at_the_markers():
    """By hand: the parent's frame is the lab's, the centre at (0, 0, 1)."""
    hip = replace(joint("Hip", at=(0.0, 0.0, 1.0)), markers=("A", "B"))
    a = np.array([[0, 0, 3], [0, 0, 3], [0, 0, 3], [0, 0, 5], [np.nan] * 3], dtype=float)
    b = np.array([[1, 0, 1]] * FRAMES, dtype=float)
    (one,) = radial(fit_of(hip), {hip.child: {"B": b, "A": a, "C": 9 * a}})
    assert one.joint is hip
    # A is 2, 2, 2 and 4 from the centre, 2.5 in the mean; B stays at 1.
    np.testing.assert_allclose(one.errors[:, 0], [-0.5, -0.5, -0.5, 1.5, np.nan])
    np.testing.assert_allclose(one.errors[:, 1], 0.0, atol=1e-15)
    np.testing.assert_allclose(one.directions[:4, 0], [[0, 0, 1]] * 4)
    np.testing.assert_allclose(one.directions[:, 1], [[1, 0, 0]] * FRAMES)


def test_a_joint_without_markers_of_its_own_is_left_out():
    assert radial(fit_of(joint("Hip")), {}) == ()

"""What cameras, labelling and skin do to markers: noise, drop-outs, slide, soft tissue, seeds."""

import numpy as np
import pytest
from standard_human import CMU, EXACT, HUMAN, NOISY, ROM, SIGMA, hinged

from mocap_skel import artificial as art
from mocap_skel.artificial.faults import missing_samples
from mocap_skel.artificial.rotations import half_sine


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


def test_a_clip_may_start_within_a_drop_out():
    gone = missing_samples(2, 5000, 0.3, 10.0, np.random.default_rng(1))
    assert np.abs(gone.mean(axis=1) - 0.3).max() <= 4 * np.sqrt(0.3 * 0.7 / 5000)


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


def test_where_no_joint_moves_only_a_slow_drift_of_a_fifth_is_left():
    """Along each axis a sine of 0.2/√3; the skin takes away what is off it."""
    standing = art.Motion(10.0, np.zeros((2000, 3)), {})
    clip = art.record(HUMAN, CMU, standing, art.Faults(slide=0.01), seed=2)
    away = clip.points - clip.clean
    # Two of three axes, half of a sine's square: 200 s hold two turns of the slowest wave.
    assert np.sqrt((away**2).sum(axis=2).mean()) == pytest.approx(0.002 / np.sqrt(3), rel=0.1)
    assert np.abs(np.linalg.norm(away, axis=2)).max() <= 0.002


def test_a_bend_of_90_degrees_slides_by_the_named_length_at_most():
    """sin(45°) √2 = 1, less what is off the skin; the drift on top."""
    markers = {
        f"{i}": ("LowerLeftLeg", (0.05 * np.cos(i), 0.05 * np.sin(i), -0.1)) for i in range(200)
    }
    clip = art.record(HUMAN, markers, hinged(90), art.Faults(slide=0.01), seed=4)
    far = np.linalg.norm((clip.points - clip.clean)[-1], axis=1)
    assert far.max() <= 0.01 * (1 + 0.2)
    # Directions at random, two of three axes: the root mean square, known to 1/√(2 × 200) or so.
    assert np.sqrt((far**2).mean()) == pytest.approx(0.01 * np.sqrt(2 / 3), rel=4 / np.sqrt(400))


def test_an_outlier_lies_as_far_as_asked_and_keeps_its_direction_while_it_stays():
    faults = art.Faults(outliers=0.1, outlier_size=0.3, outlier_burst=20)
    clip = art.record(HUMAN, CMU, art.still(20, 50), faults, seed=3)
    away = clip.points - clip.clean
    np.testing.assert_allclose(np.linalg.norm(away, axis=2), 0.3 * clip.wrong, atol=1e-12)
    stays = clip.wrong[1:] & clip.wrong[:-1]
    np.testing.assert_allclose(away[1:][stays], away[:-1][stays], atol=1e-12)
    # Every stay has its own: half of the directions are up.
    starts = clip.wrong[1:] & ~clip.wrong[:-1]
    up = (away[1:][starts][:, 2] > 0).mean()
    assert abs(up - 0.5) <= 4 * 0.5 / np.sqrt(starts.sum())


def test_swapped_labels_are_wrong_for_both_and_for_as_long_as_they_are_swapped():
    swap = art.Swap("LKNE", "RKNE", start=4, stop=9)
    faults = art.Faults(swaps=(swap,), lost=("C7",), dropout=0.3)
    clip = art.record(HUMAN, CMU, art.still(2, 10), faults, seed=1)
    left, right, lost = (clip.labels.index(label) for label in ("LKNE", "RKNE", "C7"))
    seen = np.isfinite(clip.points[..., 0])
    swapped = (np.arange(20) >= 4) & (np.arange(20) < 9)
    for here, there in ((left, right), (right, left)):
        np.testing.assert_array_equal(clip.wrong[:, here], swapped & seen[:, here])
        place = np.where(swapped[:, None], clip.clean[:, there], clip.clean[:, here])
        np.testing.assert_array_equal(clip.points[seen[:, here], here], place[seen[:, here]])
    assert not seen[:, lost].any() and clip.wrong.sum() <= 10


def test_the_wrong_samples_of_several_subjects_stand_side_by_side():
    plain = art.record(HUMAN, CMU, art.still(1, 10))
    swap = art.Faults(swaps=(art.Swap("LKNE", "RKNE"),))
    other = art.record(HUMAN, CMU, art.still(1, 10), swap)
    both = art.merge({"Anna": plain, "Ben": other})
    assert both.wrong.shape == (10, 82)
    assert [both.labels[i] for i in np.flatnonzero(both.wrong.any(axis=0))] == [
        "Ben:LKNE",
        "Ben:RKNE",
    ]
    assert art.merge({"Anna": plain, "Ben": plain}).wrong.size == 0


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

    def test_carries_a_marker_as_far_as_is_said_at_90_degrees(self):
        slide = moved(hinged(90), PAIR, tissue=(0.01, 0.01), together=0.0)
        np.testing.assert_allclose(np.abs(slide[-1, :, 2]), 0.01, atol=1e-12)

    def test_half_of_the_variance_in_common_is_the_root_of_a_half_of_each_way(self):
        """0.01 m by its own way, 0.01 m by the segment's, with or against each other."""
        markers = {f"{i}": ("LowerLeftLeg", (0.0, 0.05, -0.05 - 0.01 * i)) for i in range(8)}
        slide = moved(hinged(90), markers, tissue=(0.01, 0.01), together=0.5)[-1, :, 2]
        both = 2 * 0.01 * np.sqrt(0.5)
        assert set(np.abs(slide).round(9)) == {0.0, round(both, 9)}

    def test_a_quarter_in_common_is_half_of_the_segments_way(self):
        slide = moved(hinged(90), PAIR, tissue=(0.01, 0.01), together=0.25)[-1, :, 2]
        own, common = 0.01 * np.sqrt(0.75), 0.01 * np.sqrt(0.25)
        for value in np.abs(slide):
            assert min(abs(value - (own + common)), abs(value - (own - common))) < 1e-12

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
        # Twelve waves of normal size on two axes, so that a marker's mean square varies by √(2/24); and half
        # as much again for the poses, of which the waves see some ten that differ.
        assert ratio == pytest.approx(1.0, abs=4 * 1.5 * np.sqrt(2 / 24 / 60))

    @pytest.mark.parametrize(
        "wrong", [{"tissue": (0.01, 0.002)}, {"wobble": -1.0}, {"together": 1.5}]
    )
    def test_out_of_range_is_refused(self, wrong):
        with pytest.raises(ValueError, match=r"tissue|together"):
            art.Faults(**wrong)

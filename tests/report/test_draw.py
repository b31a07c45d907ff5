"""`mocap-skel draw`: the numbers against the truth of generated clips, and pictures that are really there.

Lengths between two joints of a generated figure vary by noise only. A frame fitted to n markers with noise σ puts
a joint that is no farther from them than they are from each other wrong by about σ; a bone has two ends and three
directions, of which its length sees one: within 2 σ.
"""

import subprocess
import sys

import numpy as np
import pytest
from commands import files, run, without
from matplotlib.image import imread
from recordings import ROOT, SAMPLES, clip_of, known

from mocap_skel import associate, fit_skeleton, read_clip
from mocap_skel.artificial import (
    Faults,
    Swap,
    human,
    marker_set,
    range_of_motion,
    record,
)
from mocap_skel.report.looks import LOOKS
from mocap_skel.report.pose_figures import ERRORS, Actor, pose_figure
from mocap_skel.report.time_figures import bones_figure, residuals_figure, tracks_figure
from mocap_skel.report.view import VIEWS, view_of
from mocap_skel.results.series import (
    best_frame,
    bones,
    by_sides,
    marker_tracks,
    radial,
    side,
    sideless,
)

SIGMA = 0.001
ROM = SAMPLES / "range_of_motion.c3d"
STILL = SAMPLES / "nearly_still.c3d"


def actor_of(clip, association="cmu", **options):
    found = known(association)
    assignment = associate(clip, found)[0]
    fit = fit_skeleton(clip, assignment, found.skeleton, **options)
    return Actor(fit, marker_tracks(clip, assignment, fit))


def film(**faults):
    motion = range_of_motion(20, 30, seed=1)
    return record(human(), marker_set("cmu"), motion, Faults(sigma=SIGMA, **faults), seed=1)


@pytest.fixture(scope="module")
def recording():
    return film(dropout=0.05)


@pytest.fixture(scope="module")
def actor(recording):
    # A landmark's prior moves a joint off the sphere's centre, by up to the skin errors it is weighed with;
    # the laws here are those of the movement alone.
    return actor_of(clip_of(recording), prior="none")


class TestSeries:
    def test_bones_have_the_true_length_and_keep_it_but_for_noise(self, recording, actor):
        found = {(bone.start, bone.end): bone for bone in bones(actor.fit)}
        true = recording.truth
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
            s.name for s in actor.fit.skeleton.leaves
        ]

    @pytest.mark.parametrize("swap", [False, True])
    def test_residuals_are_those_of_the_fit(self, swap):
        swaps = (Swap("RKNE", "LKNE", 100, 160),) if swap else ()
        actor = actor_of(clip_of(film(dropout=0.02, swaps=swaps)))
        assert bool(actor.fit.left_out) == swap
        for one in radial(actor.fit, actor.markers):
            seen = one.errors[np.isfinite(one.errors)]
            assert one.joint.samples == len(seen)
            # Both sum the same numbers, in another order.
            assert np.sqrt(np.mean(seen**2)) == pytest.approx(one.joint.residual, rel=1e-9)
            lengths = np.linalg.norm(one.directions, axis=-1)
            np.testing.assert_allclose(lengths[np.isfinite(lengths)], 1.0, rtol=1e-12)

    def test_a_gap_stays_a_gap(self, recording, actor):
        gaps = 0
        for own in actor.markers.values():
            for name, track in own.items():
                column = next(
                    i for i, label in enumerate(recording.labels)
                    if np.array_equal(recording.points[:, i], track, equal_nan=True)
                )  # fmt: skip
                gaps += int(np.isnan(track[:, 0]).sum())
                assert name and np.isnan(recording.points[np.isnan(track[:, 0]), column]).all()
        assert gaps == np.isnan(recording.points[..., 0]).sum() > 0

    def test_sides_are_told_by_name(self):
        assert [side(n) for n in ("LeftKnee", "UpperRightLeg", "Neck")] == ["left", "right", ""]
        assert sideless("UpperRightLeg") == sideless("UpperLeftLeg") == "UpperLeg"
        assert by_sides(["Neck", "RightHip", "LeftHip"]) == {"Neck": [0], "Hip": [1, 2]}

    def test_the_frame_to_draw_is_the_middlemost_of_those_in_which_most_is_seen(self, actor):
        frame = best_frame([(actor.fit, actor.markers)])
        missing = np.array(
            [np.isnan(t[:, 0]) for own in actor.markers.values() for t in own.values()]
        ).sum(axis=0)
        best = np.flatnonzero(missing == missing.min())
        middle = (len(missing) - 1) / 2
        assert missing[frame] == missing.min()
        assert abs(frame - middle) <= np.abs(best - middle).min()


class TestView:
    @pytest.mark.parametrize("name", VIEWS)
    def test_a_view_is_a_right_handed_turn(self, actor, name):
        axes = view_of(name, [actor.fit], [0]).axes
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(axes) == pytest.approx(1.0)

    def test_front_has_the_figures_right_on_the_left_and_its_head_above(self, actor):
        tracks = dict(actor.fit.tracks())
        view = view_of("front", [actor.fit], [0])
        right, left = (view.project(tracks[f"{s}Hip"][0]) for s in ("Right", "Left"))
        assert right[0] < left[0]
        assert view.project(tracks["Neck"][0])[1] > right[1]
        # The side view is from the right, facing right: the right hip is the nearer one.
        beside = view_of("side", [actor.fit], [0])
        near, far = (beside.depth(tracks[f"{s}Hip"][0]) for s in ("Right", "Left"))
        assert near > far

    def test_an_ellipsoids_outline_is_the_farthest_that_it_reaches(self, actor):
        view = view_of("oblique", [actor.fit], [0])
        rng = np.random.default_rng(5)
        root = rng.standard_normal((3, 3))
        (long, short), angle = view.ellipse(root @ root.T)
        ball = rng.standard_normal((20000, 3))
        flat = view.project((ball / np.linalg.norm(ball, axis=1)[:, None]) @ root.T)
        along = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        # 20000 points leave no hole of more than a few degrees: 1 - cos(3°) is 0.14 %.
        assert np.abs(flat @ along).max() == pytest.approx(long, rel=2e-3)
        assert np.abs(flat @ [-along[1], along[0]]).max() == pytest.approx(short, rel=2e-3)


class TestPose:
    def test_every_joint_marker_and_bone_is_drawn_once(self, actor):
        frame = best_frame([(actor.fit, actor.markers)])
        drawn, caption = pose_figure([actor], [frame], "oblique", "a $name_ of a file")
        (axes,) = drawn.axes
        marks = [line for line in axes.lines if line.get_linestyle() == "None"]
        colours = [look.colour for look in LOOKS.values()]
        assert sum(line.get_color() in colours for line in marks) == 14
        points = sum(len(line.get_xdata()) for line in marks if line.get_color() not in colours)
        seen = sum(np.isfinite(t[frame, 0]) for m in actor.markers.values() for t in m.values())
        assert points == seen
        # Fill and line of each of the 14 ellipses; hips and chest are plates.
        assert sum(type(p).__name__ == "Ellipse" for p in axes.patches) == 28
        assert sum(type(p).__name__ == "Polygon" for p in axes.patches) == 2
        assert axes.get_aspect() == 1.0
        assert "2 standard errors" in caption and "0.5 m at the lab's floor" in caption

    def test_ellipses_are_two_standard_errors_long_in_the_lab(self, actor):
        frame = best_frame([(actor.fit, actor.markers)])
        drawn, _ = pose_figure([actor], [frame], "front", "")
        view = view_of("front", [actor.fit], [frame])
        ellipses = [p for p in drawn.axes[0].patches if type(p).__name__ == "Ellipse"]
        for joint in actor.fit.joints:
            turn = actor.fit.segments[joint.parent].pose.rotation[frame]
            flat = view.axes[:2] @ turn
            widest = ERRORS * np.sqrt(np.linalg.eigvalsh(flat @ joint.covariance @ flat.T)[1])
            at = view.project(joint.track[frame])
            own = min(ellipses, key=lambda e: np.linalg.norm(np.array(e.center) - at))
            assert own.width / 2 == pytest.approx(widest, rel=1e-6)

    def test_a_huge_ellipsoid_is_cut_and_said(self):
        actor = actor_of(read_clip(STILL), prior="none")
        drawn, caption = pose_figure([actor], [0], "oblique", "")
        widths = [p.width for p in drawn.axes[0].patches if type(p).__name__ == "Ellipse"]
        assert "dashed: cut at" in caption
        # A sixteenth of the diagonal of a person, to the centimetre.
        assert max(widths) / 2 < 0.16

    def test_a_sheet_has_a_panel_a_frame_at_one_scale(self, actor):
        drawn, _ = pose_figure([actor], [0, 100, 200, 300, 400], "side", "")
        shown = [axes for axes in drawn.axes if axes.get_title()]
        spans = {round(float(np.ptp(axes.get_xlim())), 9) for axes in shown}
        assert len(shown) == 5 and len(spans) == 1


def test_plots_against_time_show_every_joint_bone_and_marker(actor):
    drawn, _ = tracks_figure(actor, "clip")
    # Waist and Neck alone, six pairs; x, y, z.
    assert len(drawn.axes) == 8 * 3
    assert sum(len(axes.lines) > 0 for axes in drawn.axes) == 24
    drawn, _ = bones_figure(actor, "clip")
    texts = [t.get_text() for axes in drawn.axes for t in axes.get_legend().get_texts()]
    assert len(drawn.axes) == 9 and len(texts) == len(bones(actor.fit))
    drawn, _ = residuals_figure(actor, "clip")
    titles = [axes.get_title() for axes in drawn.axes if axes.get_title()]
    assert len(titles) == 14
    knee = next(joint for joint in actor.fit.joints if joint.joint == "RightKnee")
    assert any(f"RightKnee ({knee.shown}): rms {1e3 * knee.residual:.1f}" in t for t in titles)


class TestCommand:
    @pytest.mark.parametrize("plot", ["pose", "tracks", "bones", "residuals"])
    def test_a_picture_is_written_and_not_blank(self, tmp_path, plot):
        done = run("draw", ROM, "--assoc", "cmu", "--plot", plot, cwd=tmp_path)
        assert (done.returncode, done.stdout) == (0, f"wrote range_of_motion.{plot}.png\n")
        pixels = imread(tmp_path / f"range_of_motion.{plot}.png")[..., :3]
        assert min(pixels.shape[:2]) > 500
        assert 0.01 < (pixels.min(axis=2) < 0.9).mean() < 0.5

    def test_the_suffix_tells_the_kind_and_the_same_call_gives_the_same_bytes(self, tmp_path):
        for kind, start in (("svg", b"<?xml"), ("pdf", b"%PDF-")):
            calls = [
                run("draw", STILL, "-a", "cmu", "-o", f"{n}.{kind}", cwd=tmp_path) for n in "ab"
            ]
            assert [c.returncode for c in calls] == [0, 0]
            made = [(tmp_path / f"{n}.{kind}").read_bytes() for n in "ab"]
            assert made[0].startswith(start) and made[0] == made[1]

    def test_both_subjects_stand_in_one_pose_and_each_has_its_own_plots(self, tmp_path):
        two = SAMPLES / "two_dancers.c3d"
        done = run("draw", two, "-a", "cmu", "--sheet", "3", "-o", "two.svg", cwd=tmp_path)
        assert done.returncode == 0
        text = (tmp_path / "two.svg").read_text()
        assert text.count("<!-- Anna -->") == text.count("<!-- Ben -->") == 3
        assert "frame 101" in text and "frame 800" in text
        wrong = run("draw", two, "-a", "cmu", "--plot", "bones", cwd=tmp_path)
        assert wrong.returncode == 2 and "--subject: Anna, Ben" in wrong.stderr
        one = run("draw", two, "-a", "cmu", "--plot", "bones", "--subject", "Ben", cwd=tmp_path)
        assert one.stdout == "wrote two_dancers.Ben.bones.png\n"

    @pytest.mark.parametrize(
        ("arguments", "what"),
        [
            (["--frame", "0"], "no frame 0: it has frames 1 to"),
            (["-o", "pose.gif"], "pose.gif: its suffix does not tell"),
            (["-o", "there.png"], "there.png: exists already"),
            (["--frame", "1", "--sheet", "4"], "--frame and --sheet do not go together"),
            (["--plot", "bones", "--view", "top"], "--view is for --plot pose"),
            (["--plot", "pie"], "'pie' is not one of"),
            (["--subject", "Bo"], "no subject 'Bo'"),
        ],
    )
    def test_a_wrong_call_is_2_with_one_clear_message(self, tmp_path, arguments, what):
        (tmp_path / "there.png").write_text("mine")
        done = run("draw", STILL, "-a", "cmu", *arguments, cwd=tmp_path)
        assert done.returncode == 2 and what in done.stderr
        assert (tmp_path / "there.png").read_text() == "mine"
        assert files(tmp_path) == ["there.png"]

    def test_without_matplotlib_one_line_names_the_install(self, tmp_path):
        done = without("matplotlib", "draw", "gone.c3d", "-a", "cmu", cwd=tmp_path)
        assert done.returncode == 2
        assert len(done.stderr.splitlines()) == 1
        assert "pip install 'mocap-skel[plot]'" in done.stderr

    def test_help_has_an_example_and_loads_neither_numpy_nor_matplotlib(self):
        code = (
            "import sys; from mocap_skel.cli import group\n"
            "try: group.main(['draw', '--help'], 'mocap-skel')\n"
            "except SystemExit: print({'numpy', 'matplotlib', 'pandas'} & set(sys.modules))"
        )
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True
        )
        assert "Example: mocap-skel draw walk.c3d --assoc cmu --frame 120 -o pose.png" in " ".join(
            done.stdout.split()
        )
        assert done.stdout.endswith("set()\n")

"""`mocap-skel draw`: every joint, marker and bone is there, at its place, and pictures are really files."""

import subprocess
import sys

import numpy as np
import pytest
from actors import actor, actor_of
from commands import ROM, STILL, call, files, without
from matplotlib.image import imread
from recordings import ROOT, SAMPLES

from mocap_skel import read_clip
from mocap_skel.report.looks import LOOKS
from mocap_skel.report.pose_figures import ERRORS, pose_figure
from mocap_skel.report.time_figures import bones_figure, residuals_figure, tracks_figure
from mocap_skel.report.view import view_of
from mocap_skel.results.series import best_frame, bones


class TestPose:
    def test_every_joint_marker_and_bone_is_drawn_once(self):
        frame = best_frame([(actor().fit, actor().markers)])
        drawn, caption = pose_figure([actor()], [frame], "oblique", "a $name_ of a file")
        (axes,) = drawn.axes
        marks = [line for line in axes.lines if line.get_linestyle() == "None"]
        colours = [look.colour for look in LOOKS.values()]
        assert sum(line.get_color() in colours for line in marks) == 14
        points = sum(len(line.get_xdata()) for line in marks if line.get_color() not in colours)
        seen = sum(np.isfinite(t[frame, 0]) for m in actor().markers.values() for t in m.values())
        assert points == seen
        # Fill and line of each of the 14 ellipses; hips and chest are plates.
        assert sum(type(p).__name__ == "Ellipse" for p in axes.patches) == 28
        assert sum(type(p).__name__ == "Polygon" for p in axes.patches) == 2
        assert axes.get_aspect() == 1.0
        assert "2 standard errors" in caption and "0.5 m at the lab's floor" in caption

    def test_ellipses_are_two_standard_errors_long_in_the_lab(self):
        frame = best_frame([(actor().fit, actor().markers)])
        drawn, _ = pose_figure([actor()], [frame], "front", "")
        view = view_of("front", [actor().fit], [frame])
        ellipses = [p for p in drawn.axes[0].patches if type(p).__name__ == "Ellipse"]
        for joint in actor().fit.joints:
            turn = actor().fit.segments[joint.parent].pose.rotation[frame]
            flat = view.axes[:2] @ turn
            widest = ERRORS * np.sqrt(np.linalg.eigvalsh(flat @ joint.covariance @ flat.T)[1])
            at = view.project(joint.track[frame])
            own = min(ellipses, key=lambda e: np.linalg.norm(np.array(e.center) - at))
            assert own.width / 2 == pytest.approx(widest, rel=1e-6)

    def test_a_huge_ellipsoid_is_cut_and_said(self):
        still = actor_of(read_clip(STILL), prior="none")
        drawn, caption = pose_figure([still], [0], "oblique", "")
        widths = [p.width for p in drawn.axes[0].patches if type(p).__name__ == "Ellipse"]
        assert "dashed: cut at" in caption
        # A sixteenth of the diagonal of a person, to the centimetre.
        assert max(widths) / 2 < 0.16

    def test_a_sheet_has_a_panel_a_frame_at_one_scale(self):
        drawn, _ = pose_figure([actor()], [0, 100, 200, 300, 400], "side", "")
        shown = [axes for axes in drawn.axes if axes.get_title()]
        spans = {round(float(np.ptp(axes.get_xlim())), 9) for axes in shown}
        assert len(shown) == 5 and len(spans) == 1


def test_plots_against_time_show_every_joint_bone_and_marker():
    drawn, _ = tracks_figure(actor(), "clip")
    # Waist and Neck alone, six pairs; x, y, z.
    assert len(drawn.axes) == 8 * 3
    assert sum(len(axes.lines) > 0 for axes in drawn.axes) == 24
    drawn, _ = bones_figure(actor(), "clip")
    texts = [t.get_text() for axes in drawn.axes for t in axes.get_legend().get_texts()]
    assert len(drawn.axes) == 9 and len(texts) == len(bones(actor().fit))
    drawn, _ = residuals_figure(actor(), "clip")
    titles = [axes.get_title() for axes in drawn.axes if axes.get_title()]
    assert len(titles) == 14
    knee = next(joint for joint in actor().fit.joints if joint.joint == "RightKnee")
    assert any(f"RightKnee ({knee.shown}): rms {1e3 * knee.residual:.1f}" in t for t in titles)


class TestCommand:
    @pytest.mark.parametrize("plot", ["pose", "tracks", "angles", "bones", "residuals"])
    def test_a_picture_is_written_and_not_blank(self, tmp_path, plot):
        done = call("draw", ROM, "--assoc", "cmu", "--plot", plot, cwd=tmp_path)
        assert (done.returncode, done.stdout) == (0, f"wrote range_of_motion.{plot}.png\n")
        pixels = imread(tmp_path / f"range_of_motion.{plot}.png")[..., :3]
        assert min(pixels.shape[:2]) > 500
        assert 0.01 < (pixels.min(axis=2) < 0.9).mean() < 0.5

    def test_the_suffix_tells_the_kind_and_the_same_call_gives_the_same_bytes(self, tmp_path):
        for kind, start in (("svg", b"<?xml"), ("pdf", b"%PDF-")):
            calls = [
                call("draw", STILL, "-a", "cmu", "-o", f"{n}.{kind}", cwd=tmp_path) for n in "ab"
            ]
            assert [c.returncode for c in calls] == [0, 0]
            made = [(tmp_path / f"{n}.{kind}").read_bytes() for n in "ab"]
            assert made[0].startswith(start) and made[0] == made[1]

    def test_both_subjects_stand_in_one_pose_and_each_has_its_own_plots(self, tmp_path):
        two = SAMPLES / "two_dancers.c3d"
        done = call("draw", two, "-a", "cmu", "--sheet", "3", "-o", "two.svg", cwd=tmp_path)
        assert done.returncode == 0
        text = (tmp_path / "two.svg").read_text()
        assert text.count("<!-- Anna -->") == text.count("<!-- Ben -->") == 3
        assert "frame 101" in text and "frame 800" in text
        wrong = call("draw", two, "-a", "cmu", "--plot", "bones", cwd=tmp_path)
        assert wrong.returncode == 2 and "--subject: Anna, Ben" in wrong.stderr
        one = call("draw", two, "-a", "cmu", "--plot", "bones", "--subject", "Ben", cwd=tmp_path)
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
        done = call("draw", STILL, "-a", "cmu", *arguments, cwd=tmp_path)
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

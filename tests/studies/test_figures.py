"""The figures of the studies: their axes, lines, legends and bytes."""

import struct
import zlib
from dataclasses import replace

import numpy as np
import pytest
from findings import CHEAP, GRID, a_score, a_trial, answer, scattered

from mocap_skel.report import figures
from mocap_skel.studies import accuracy, speed
from mocap_skel.studies import figures as study_figures
from mocap_skel.studies.contenders import CONTENDERS
from mocap_skel.studies.resample import summarise


@pytest.fixture
def drawn(monkeypatch):
    """The figures that are turned into PNG, to be looked at before they are pixels."""
    seen = []

    def watched(figure, caption):
        seen.append(figure)
        return figures.png(figure, caption)

    monkeypatch.setattr(study_figures, "png", watched)
    return seen


@pytest.fixture
def sketched(monkeypatch):
    """The same without the pixels, which take most of the time."""
    seen = []
    monkeypatch.setattr(study_figures, "png", lambda figure, caption: seen.append(figure))
    return seen


def size(png):
    """Width and height of a whole PNG; its text chunks tell nothing of who made it when."""
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    kinds, at = [], 8
    while at < len(png):
        (length,), kind = struct.unpack(">I", png[at : at + 4]), png[at + 4 : at + 8]
        body = png[at + 4 : at + 8 + length]
        assert struct.unpack(">I", png[at + 8 + length : at + 12 + length])[0] == zlib.crc32(body)
        kinds.append(kind)
        at += 12 + length
    assert kinds[0] == b"IHDR" and kinds[-1] == b"IEND"
    return struct.unpack(">II", png[16:24])


def legend(figure):
    return [text.get_text() for each in figure.legends for text in each.get_texts()]


CAPTION = "two joints, seed 3: mocap-skel study resample walk.c3d --assoc cmu"


class TestFigures:
    def summary(self):
        rng = np.random.default_rng(10)
        return summarise(scattered(rng, 40) + scattered(rng, 40, joint="LeftHip"))

    def test_figure_24_has_every_joint_and_both_laws(self, drawn):
        summary = self.summary()
        png = study_figures.deviations_figure(summary, CAPTION)
        (figure,) = drawn
        assert size(png) == (1200, 780)
        (axes,) = figure.axes
        assert axes.get_xscale() == axes.get_yscale() == "log"
        assert "samples" in axes.get_xlabel()
        assert axes.get_ylabel().endswith("(cm)")
        joints, (fitted, law) = legend(figure)[:2], legend(figure)[2:]
        assert joints == ["LeftKnee", "LeftHip"]
        assert f"{summary.laws[-1].slope:.2f}" in fitted
        assert "independent" in law and "-0.5" in law
        assert figure.get_supxlabel().replace("\n", " ") == CAPTION
        assert "24" in axes.get_title()
        # Points in centimetres, and the share that lies within one.
        knee = axes.lines[0]
        np.testing.assert_allclose(knee.get_ydata(), 100 * summary.deviation[:40])
        np.testing.assert_array_equal(knee.get_xdata(), [a.samples for a in summary.answers[:40]])
        assert any("within 1 cm" in text.get_text() for text in axes.texts)

    def test_the_lines_of_figure_24_are_the_laws(self, sketched):
        summary = self.summary()
        study_figures.deviations_figure(summary, CAPTION)
        lines = {line.get_label(): line for line in sketched[0].axes[0].lines}
        for label, slope in (
            (legend(sketched[0])[2], summary.laws[-1].slope),
            (legend(sketched[0])[3], -0.5),
        ):
            x, y = np.log(lines[label].get_data())
            assert (y[1] - y[0]) / (x[1] - x[0]) == pytest.approx(slope)
            # Through the deviation at 200 samples, in centimetres.
            at = np.exp(np.interp(np.log(200), x, y))
            assert at == pytest.approx(100 * summary.laws[-1].at_enough)
        # And the thesis's claim: within a centimetre from 200 samples on.
        across, upright = sketched[0].axes[0].lines[-2:]
        assert set(across.get_ydata()) == {1.0} and set(upright.get_xdata()) == {200}

    def test_figures_26_and_27_have_every_estimator(self, drawn):
        trials = [a_trial(100), a_trial(20_000), a_trial(50_000, noise=1e6)]
        times = study_figures.times_figure(trials, CAPTION)
        ratios = study_figures.ratios_figure(trials, 10_000, CAPTION)
        for png, figure in zip((times, ratios), drawn, strict=True):
            assert size(png) == (1080, 720)
            assert legend(figure) == [CONTENDERS[m].label for m in speed.METHODS]
            assert figure.axes[0].get_xscale() == figure.axes[0].get_yscale() == "log"
        one, two = (figure.axes[0] for figure in drawn)
        assert one.get_xlabel() == "points" and one.get_ylabel().endswith("(ms)")
        assert two.get_xlabel().endswith("(m)") and "GDKE" in two.get_ylabel()
        np.testing.assert_array_equal(one.lines[0].get_ydata(), [1.0] * 3)
        # The set of a hundred points does not decide.
        np.testing.assert_array_equal(two.lines[0].get_xdata(), [0.1, 1e6])
        assert "26" in one.get_title() and "27" in two.get_title()

    def test_the_map_has_a_field_an_estimator_and_marks_where_it_breaks(self, drawn):
        small = replace(GRID, count=60, trials=4)
        scores = [s for cell in small.cells for s in accuracy.score_cell(small, cell)]
        png = study_figures.accuracy_figure(scores, CAPTION)
        (figure,) = drawn
        width, height = size(png)
        assert 1000 < width < 2000 and 300 < height < 1000
        maps = [axes for axes in figure.axes if axes.get_title()]
        assert [axes.get_title() for axes in maps] == [CONTENDERS[m].label for m in CHEAP]
        for axes, method in zip(maps, CHEAP, strict=True):
            assert axes.get_xlabel().endswith("(degrees)") and axes.get_ylabel() == "σ / r"
            assert [t.get_text() for t in axes.get_xticklabels()] == [
                "20",
                "45",
                "80",
                "135",
                "180",
            ]
            assert [t.get_text() for t in axes.get_yticklabels()] == [
                "0.001",
                "0.01",
                "0.05",
                "0.1",
            ]
            mine = [s for s in scores if s.method == method]
            # A cell's middle is half a cell beyond its number.
            crosses = {
                (line.get_xdata()[0] - 0.5, line.get_ydata()[0] - 0.5)
                for line in axes.lines
                if line.get_marker() == "x"
            }
            place = {
                (small.angles.index(s.angle_deg), small.noises.index(s.noise)): s for s in mine
            }
            assert crosses == {cell for cell, s in place.items() if s.breaks}
            # Grey where the bound itself is over half a radius.
            (mesh,) = axes.collections
            grey = {
                (column, row) for row, column in np.argwhere(np.ma.getmaskarray(mesh.get_array()))
            }
            assert grey == {cell for cell, s in place.items() if s.bound > 0.5}
            assert grey
            # The criterion of 45 degrees, sin²(22.5°)/√3 = 0.0845, between the noises 0.05 and 0.1.
            (line,) = (line for line in axes.lines if line.get_color() == "red")
            height = np.interp(1.5, line.get_xdata(), line.get_ydata())
            expected = 2.5 + np.log(0.0845 / 0.05) / np.log(0.1 / 0.05)
            assert height == pytest.approx(expected, abs=0.01)
        (bar,) = (axes for axes in figure.axes if axes not in maps)
        assert "bound" in bar.get_ylabel()
        assert "criterion" in figure.get_suptitle()

    def test_a_map_of_one_cell_is_a_map(self):
        assert size(study_figures.accuracy_figure([a_score("gdke", 2.0)], CAPTION)) > (300, 300)
        assert size(study_figures.accuracy_figure([a_score("gdke", np.nan, failed=1.0)], "")) > (
            1,
            1,
        )

    def test_nine_estimators_take_three_rows(self, sketched):
        scores = [a_score(key, 1.0 + k) for k, key in enumerate(CONTENDERS)]
        study_figures.accuracy_figure(scores, CAPTION)
        titles = [axes.get_title() for axes in sketched[0].axes if axes.get_title()]
        assert titles == [contender.label for contender in CONTENDERS.values()]

    def test_the_same_figure_is_the_same_bytes(self):
        one, two = (study_figures.deviations_figure(self.summary(), CAPTION) for _ in range(2))
        assert one == two

    def test_a_long_caption_is_broken_into_lines(self, drawn):
        words = " ".join(["word"] * 60)
        study_figures.times_figure([a_trial()], words)
        text = drawn[0].get_supxlabel()
        assert text.replace("\n", " ") == words
        assert len(text.splitlines()) > 1

    def test_no_figure_shows_a_clip_of_one_place(self):
        """All answers alike: nothing that a logarithmic axis could show, but no crash either."""
        summary = summarise([answer((0.1, 0.2, 0.3), n) for n in (100, 300, 900)])
        assert size(study_figures.deviations_figure(summary, CAPTION)) == (1200, 780)

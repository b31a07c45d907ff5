"""Joint angles of real clips beside those that Plug-in Gait left in them; the script that prints the table."""

import re

import angles as benchmark
import numpy as np
import pytest
from recordings import ROOT

# Clips of which Plug-in Gait's angles are about joints that move, in the folder of real recordings.
WALKS = (
    "plug_in_gait/HC055A34.c3d",
    "functional_hip/FunctionalWalk.c3d",
    "odd_files/sub_labels.c3d",
)


@pytest.mark.real
@pytest.mark.parametrize("name", WALKS)
def test_flexions_are_those_of_plug_in_gait(shared_clips, name):
    lines = {line.name: line for line in benchmark.lines_of(shared_clips / name)}
    for side in ("Left", "Right"):
        for joint in ("Hip", "Knee"):
            line = lines[f"{side}{joint}_flexion"]
            assert line.correlation >= 0.99 and line.rms <= 5, line.text()
        assert lines[f"{side}Ankle_flexion"].rms <= 5, lines[f"{side}Ankle_flexion"].text()


@pytest.mark.real
@pytest.mark.parametrize("name", WALKS)
def test_differences_from_plug_in_gait_are_what_the_errors_say(shared_clips, name):
    # Plug-in Gait errs as well, and it is no truth: three standard errors of ours hold most of it.
    lines = list(benchmark.lines_of(shared_clips / name))
    off = [abs(line.offset) / line.error for line in lines]
    assert np.median(off) < 1 and np.mean(np.array(off) < 3) > 0.9


def test_a_line_has_the_numbers_that_it_was_given():
    time = np.linspace(0, 10, 400)
    own, other = 30 * np.sin(time) + 7, 30 * np.sin(time) + np.cos(3 * time)
    line = benchmark._line("walk", "LeftKnee_flexion", own, other, 2.5)
    assert line.offset == pytest.approx(np.mean(own - other))
    assert line.rms == pytest.approx(np.sqrt(np.mean((own - other - line.offset) ** 2)))
    assert line.correlation == pytest.approx(np.corrcoef(own, other)[0, 1])
    assert line.text().split()[:3] == ["walk", "LeftKnee_flexion", "400"]


@pytest.mark.real
def test_the_page_of_angles_shows_what_the_benchmark_prints(shared_clips):
    """Each cell is the least and the largest of the six legs, to the digits that it shows."""
    page = (ROOT / "docs" / "angles.md").read_text()
    lines = [line for name in WALKS for line in benchmark.lines_of(shared_clips / name)]
    rows = re.findall(r"^\| ((?:hip|knee|ankle) \w+) \| (.*) \|$", page, re.M)
    assert len(rows) == 7
    for title, cells in rows:
        joint, part = title.split()
        own = [line for line in lines if line.name.endswith(f"{joint.title()}_{part}")]
        assert len(own) == 6
        told = ("correlation", "rms", "offset", "error")
        for cell, name in zip(cells.split(" | "), told, strict=True):
            values = [getattr(line, name) for line in own]
            shown = cell.split(" to ")
            for text, value in zip((shown[0], shown[-1]), (min(values), max(values)), strict=True):
                digit = 10.0 ** -len(text.partition(".")[2])
                # Half a digit of rounding, and as much for another machine.
                assert abs(float(text) - value) <= digit, (title, name, cell, value)

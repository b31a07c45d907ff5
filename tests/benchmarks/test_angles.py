"""Joint angles of real clips beside those that Plug-in Gait left in them; the script that prints the table."""

import angles as benchmark
import numpy as np
import pytest

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

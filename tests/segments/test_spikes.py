"""A marker that is thrown for one frame is found by its own path; quick movement is not."""

import numpy as np
import pytest

from mocap_skel.artificial import Faults, human, marker_set, record, walk
from mocap_skel.segments.pose import by_rows
from mocap_skel.segments.spikes import spikes

CLIP = record(human(), marker_set("plug_in_gait"), walk(4, 120), Faults(sigma=0.001), seed=3)


@pytest.mark.parametrize("label", ["RELB", "LFIN", "LKNE"])
@pytest.mark.parametrize("height", [0.09, 0.15])
@pytest.mark.parametrize("axis", range(3))
def test_a_spike_is_found_and_its_neighbours_are_not(label, height, axis):
    points = CLIP.points.copy()
    points[300, CLIP.labels.index(label), axis] += height
    left = spikes(by_rows(points))
    assert [(CLIP.labels[m], f) for m, f in np.argwhere(left)] == [(label, 300)]


def test_a_blow_a_bounce_and_a_quick_swing_are_no_spikes():
    time = np.arange(-100, 101) / 100
    paths = np.zeros((3, 3, len(time)))
    paths[0, 0] = np.where(time < 0, 0.0, 10.0 * time)
    paths[1, 0] = 10.0 * np.abs(time)
    paths[2, 0] = 0.3 * np.sin(2 * np.pi * 8 * time)
    assert spikes(paths) is None

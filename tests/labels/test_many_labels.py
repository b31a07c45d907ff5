"""The memory of a guess does not grow with the square of the labels."""

from __future__ import annotations

import tracemalloc

import numpy as np

from mocap_skel import artificial as art
from mocap_skel.clip import Clip
from mocap_skel.labels.guess import guess_association
from mocap_skel.labels.guess.rigid import MOST


def test_three_thousand_labels_take_no_more_than_the_figure_needs():
    walk = art.record(art.human(), art.marker_set("cmu"), art.walk(1, 60), seed=1)
    rng = np.random.default_rng(3)
    others = rng.uniform(-1, 1, (60, 3000, 3))
    others[20:, ::2] = np.nan
    points = np.concatenate([walk.points, others], axis=1)
    labels = (*walk.labels, *(f"X{i}" for i in range(3000)))
    clip = Clip(
        name="many", points=points, labels=labels, subjects=("",) * len(labels), rate=60.0,
        first_frame=1, unit="m", up="z", left_out={}, notes=(),
    )  # fmt: skip
    tracemalloc.start()
    guess = guess_association(clip)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # A table of all pairs would be 74 MB, and there were hundreds of them.
    assert most < 64e6
    assert {line.label for line in guess.used} == set(walk.labels)
    asides = [line for line in guess.lines if "not compared" in line.reason]
    assert len(asides) == len(labels) - MOST

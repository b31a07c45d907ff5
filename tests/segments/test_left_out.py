"""The record of samples that were left out: which markers, in which order, and who stood in whose place."""

import numpy as np
import pytest
from faulty import FIRST, faulty
from recordings import fit_recording

from mocap_skel.artificial import Swap
from mocap_skel.segments.left_out import NOTED, LeftOut, notes


def one(marker, *frames, partner=""):
    return LeftOut(marker, "Thigh", marker, np.array(frames), partner)


@pytest.mark.parametrize(
    ("frames", "where"),
    [
        ((7,), "1 sample in frame 7"),
        ((7, 8, 9), "3 samples in frames 7-9"),
        ((7, 9), "2 samples in frames 7-9 (2 stretches)"),
        ((1, 2, 5, 6, 9), "5 samples in frames 1-9 (3 stretches)"),
    ],
)
def test_a_marker_tells_its_frames_and_their_stretches(frames, where):
    assert one("A", *frames).sentence() == f"A: {where} left its segment"


def test_the_label_is_named_where_it_differs_and_the_partner_where_there_is_one():
    found = LeftOut("LTIB", "Shank", "LSHN", np.array([3]), "RTIB")
    assert found.sentence() == (
        "LTIB (label LSHN): 1 sample in frame 3 left its segment: swapped with RTIB?"
    )


def test_the_notes_count_all_and_name_the_first():
    found = tuple(one(f"M{i}", *range(20 - i)) for i in range(NOTED + 2))
    first, *rest = notes(found, 1000)
    count = sum(20 - i for i in range(NOTED + 2))
    assert first == f"left out of the fit as marker trouble: {count} of 1000 samples (16 %)"
    assert [note.split(":")[0] for note in rest[:-1]] == [f"M{i}" for i in range(NOTED)]
    assert rest[-1] == "2 more markers with 23 such samples"
    assert notes((), 1000) == []


def test_the_markers_with_the_most_samples_come_first():
    swaps = Swap("LKNE", "RKNE", 300, 310), Swap("LFIN", "RFIN", 600, 700)
    found = fit_recording(faulty(5, swaps=swaps)).left_out
    assert [len(one.frames) for one in found] == [100, 100, 10, 10]
    assert {one.marker for one in found[:2]} == {"LFIN", "RFIN"}
    np.testing.assert_array_equal(found[2].frames, FIRST + np.arange(300, 310))


def test_a_swap_takes_two():
    """One marker in the other's place, and that one somewhere else: no exchange of labels."""
    recording = faulty(5)
    left, right = (recording.labels.index(name) for name in ("LKNE", "RKNE"))
    points, some = recording.points, slice(300, 327)
    points[some, right] = points[some, left]
    points[some, left] += [0.3, 0.2, 0.4]
    found = fit_recording(recording).left_out
    assert {one.marker: one.partner for one in found} == {"LKNE": "", "RKNE": ""}

"""The table and the JSON rows of `mocap-skel assoc check`."""

import numpy as np

from mocap_skel.report.check_table import check_row, check_table
from mocap_skel.results.marker_check import AssociationCheck, MarkerCheck


def one(marker="LKNE", **changes):
    known = {
        "subject": "Anna", "label": f"{marker}_label", "segment": "UpperLeftLeg", "residual": 0.0123,
        "share": 0.254, "frames": np.array([103, 104, 250]), "partner": "", "moves_with": "", "verdict": "loose",
    }  # fmt: skip
    return MarkerCheck(marker=marker, **(known | changes))


def test_a_row_has_metres_shares_and_the_files_own_frames():
    assert check_row(one(), "walk.c3d") == {
        "clip": "walk.c3d", "subject": "Anna", "marker": "LKNE", "label": "LKNE_label",
        "segment": "UpperLeftLeg", "residual": 0.0123, "out_of_place": 0.254, "first": 103, "last": 250,
        "verdict": "loose", "partner": None, "moves_with": None,
    }  # fmt: skip
    nothing = check_row(one(residual=np.nan, frames=np.zeros(0, dtype=int), share=0.0), "c")
    assert [nothing[name] for name in ("residual", "first", "last")] == [None] * 3


def test_the_table_has_millimetres_and_per_cent_and_ends_with_what_to_do():
    swapped = one(
        "RKNE",
        verdict="swapped",
        partner="LKNE",
        residual=np.nan,
        share=0.0,
        frames=np.zeros(0, int),
    )
    moved = one("LANK", verdict="wrong segment", moves_with="LowerLeftLeg", subject="Anna")
    lines = check_table(
        AssociationCheck((one(), swapped, moved), still=False), "walk.c3d"
    ).splitlines()
    assert lines[1].split() == [
        "LKNE", "LKNE_label", "UpperLeftLeg", "12.3", "25", "%", "103", "250", "loose",
    ]  # fmt: skip
    assert lines[2].split()[3:] == ["-", "-", "-", "-", "swapped", "with", "LKNE"]
    assert lines[3].endswith("wrong segment? it moves with LowerLeftLeg")
    assert lines[4] == (
        "walk.c3d Anna: 3 markers checked; the association looks wrong: LKNE and RKNE are exchanged: "
        "exchange their labels; LANK (LANK_label) moves with LowerLeftLeg"
    )

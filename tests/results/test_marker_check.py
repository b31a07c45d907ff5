"""The check of an association: does each marker move with its segment."""

import json
from functools import cache

import numpy as np
import pytest
from click.testing import CliRunner
from faulty import faulty
from recordings import ROOT, clip_of

from mocap_skel import associate, read_association
from mocap_skel.artificial import Faults, Swap, human, marker_set, record, still, write_c3d
from mocap_skel.cli.assoc_check import command
from mocap_skel.results.marker_check import check_association


def association(tmp_path, *edits):
    """The shipped CMU file with lines changed: (label, label) exchanged, or (label, marker, segment)."""
    lines = []
    for line in (ROOT / "association_files" / "cmu.txt").read_text().splitlines():
        words = line.split()
        for edit in edits:
            if len(words) < 2 or words[0] not in edit[: 1 if len(edit) == 3 else 2]:
                continue
            if len(edit) == 3:
                line = " ".join(edit)
            else:
                line = f"{edit[1 - edit.index(words[0])]} {words[1]}"
        lines.append(line)
    path = tmp_path / "map.txt"
    path.write_text("\n".join(lines))
    return path


def check(recording, path):
    known = read_association(path)
    seen = clip_of(recording)
    return check_association(seen, associate(seen, known)[0], known.skeleton)


@cache
def checked_clip():
    return faulty(3, slide=0.005, dropout=0.05)


def verdicts(found):
    return {
        one.marker: (one.verdict, one.partner or one.moves_with)
        for one in found.markers
        if one.verdict != "ok"
    }


class TestCheck:
    def test_the_right_file_is_right(self, tmp_path):
        found = check(checked_clip(), association(tmp_path))
        assert verdicts(found) == {}
        assert found.summary() == (
            "41 markers checked: every marker that can be judged moves with its segment"
        )
        # Noise of 1 mm makes 1.4 mm in a distance, 5 mm of skin adds what it adds.
        assert all(0 < one.residual < 0.01 for one in found.markers)

    @pytest.mark.parametrize(
        ("first", "second"),
        [
            ("LTHI", "RTHI"),
            ("LKNE", "RKNE"),
            ("LWRA", "LELB"),
            ("LFIN", "RFIN"),
            ("LANK", "LHEE"),
            ("LFHD", "RSHO"),
        ],
    )
    def test_exchanged_lines(self, tmp_path, first, second):
        found = check(checked_clip(), association(tmp_path, (first, second)))
        assert verdicts(found) == {first: ("swapped", second), second: ("swapped", first)}
        assert f"{min(first, second)} and {max(first, second)} are exchanged" in found.summary()
        # The elbow turns about its own marker: that one hardly leaves either place.
        assert max(one.share for one in found.markers if one.partner) > 0.1

    def test_two_exchanges_at_once(self, tmp_path):
        edits = ("LTHI", "RTHI"), ("LWRA", "RWRA")
        found = check(checked_clip(), association(tmp_path, *edits))
        assert {m: p for m, (_, p) in verdicts(found).items()} == {
            "LTHI": "RTHI", "RTHI": "LTHI", "LWRA": "RWRA", "RWRA": "LWRA",
        }  # fmt: skip

    @pytest.mark.parametrize(
        ("marker", "given", "right"),
        [
            ("LWRA", "UpperLeftArm", "LowerLeftArm"),
            ("C7", "Head", "Chest"),
            ("LFHD", "Hips", "Head"),
        ],
    )
    def test_a_marker_of_another_segment(self, tmp_path, marker, given, right):
        found = check(checked_clip(), association(tmp_path, (marker, marker, given)))
        assert verdicts(found) == {marker: ("wrong segment", right)}
        assert f"{marker} ({marker}) moves with {right}" in found.summary()

    def test_a_swap_for_a_while_is_not_the_files_fault(self, tmp_path):
        recording = faulty(5, swaps=(Swap("LKNE", "RKNE", 300, 327),))
        found = check(recording, association(tmp_path))
        assert verdicts(found) == {
            "LKNE": ("swapped at times", "RKNE"),
            "RKNE": ("swapped at times", "LKNE"),
        }
        knee = next(one for one in found.markers if one.marker == "LKNE")
        assert (knee.frames[0], knee.frames[-1]) == (401, 427)
        assert knee.share == pytest.approx(27 / 1200)

    def test_a_clip_that_hardly_moves_tells_nothing(self, tmp_path):
        standing = record(human(), marker_set("cmu"), still(5, 60, seed=3), Faults(sigma=0.001))
        found = check(standing, association(tmp_path, ("LWRA", "LWRB")))
        assert found.still and "moves too little" in found.summary()

    def test_what_needs_no_movement_is_told_all_the_same(self, tmp_path):
        standing = record(human(), marker_set("cmu"), still(5, 60, seed=3), Faults(sigma=0.001))
        found = check(standing, association(tmp_path, ("LTHI", "RTHI")))
        assert verdicts(found) == {"LTHI": ("swapped", "RTHI"), "RTHI": ("swapped", "LTHI")}
        standing.points[..., 0] *= -1
        assert "the body is mirrored" in check(standing, association(tmp_path)).summary()

    def test_markers_that_are_never_seen_are_said_to_be(self, tmp_path):
        recording = faulty(3, lost=("LTOE", "LMT5", "RFIN"))
        found = check(recording, association(tmp_path))
        assert verdicts(found) == dict.fromkeys(("LTOE", "LMT5", "RFIN"), ("not seen", ""))

    def test_a_marker_that_is_hardly_seen_is_not_judged(self, tmp_path):
        recording = faulty(3)
        recording.points[12:, recording.labels.index("LFHD")] = np.nan
        assert verdicts(check(recording, association(tmp_path))) == {}

    def test_one_leg_alone_can_be_checked(self, tmp_path):
        labels = marker_set("cmu")
        leg = {"LTHI", "LKNE", "LSHN", "LANK", "LHEE", "LTOE", "LMT5"}
        recording = faulty(3, lost=tuple(label for label in labels if label not in leg))
        assert {
            m
            for m, (v, _) in verdicts(check(recording, association(tmp_path))).items()
            if v != "not seen"
        } == set()
        swapped = check(recording, association(tmp_path, ("LANK", "LHEE")))
        assert {m for m, (v, _) in verdicts(swapped).items() if v != "not seen"} == {"LANK", "LHEE"}

    def test_the_command(self, tmp_path):
        write_c3d(faulty(3), tmp_path / "c.c3d")
        call = [str(tmp_path / "c.c3d"), "--assoc", str(association(tmp_path, ("LTHI", "RTHI")))]
        done = CliRunner().invoke(command, call, standalone_mode=False)
        assert done.return_value == 0
        lines = done.stdout.splitlines()
        assert lines[0].split() == (
            [
                "marker",
                "label",
                "segment",
                "residual",
                "mm",
                "out",
                "of",
                "place",
                "first",
                "last",
                "verdict",
            ]
        )
        assert any(line.endswith("swapped with RTHI") for line in lines)
        assert lines[-1].endswith("LTHI and RTHI are exchanged: exchange their labels")
        done = CliRunner().invoke(command, [*call, "--json"], standalone_mode=False)
        rows = [json.loads(line) for line in done.stdout.splitlines()]
        assert len(rows) == 41
        swapped = next(row for row in rows if row["marker"] == "LTHI")
        assert (swapped["label"], swapped["verdict"], swapped["partner"]) == (
            "RTHI", "swapped", "RTHI",
        )  # fmt: skip

"""`mocap-skel assoc` and `fit` without --assoc, as a user runs them."""

import json
import re
import shlex
from dataclasses import replace

import pytest
from commands import ROM, files, run
from recordings import SAMPLES

from mocap_skel import artificial as art
from mocap_skel import read_association
from mocap_skel.artificial.write import write_c3d


def recorded(path, rename=lambda label: label, **changes):
    """A short generated clip with other labels, as a file."""
    motion = art.range_of_motion(8, 50, seed=2)
    figure, markers = art.human(), art.marker_set("cmu")
    clip = art.record(figure, markers, motion, art.Faults(sigma=0.001), seed=2)
    labels = tuple(rename(label) for label in clip.labels)
    write_c3d(replace(clip, labels=labels, **changes), path, "mm")
    return path


def test_a_guess_goes_to_standard_output_and_can_be_read_and_fitted(tmp_path):
    done = run("assoc", "guess", ROM, cwd=tmp_path)
    assert done.returncode == 0
    assert "41 of 41 labels placed" in done.stderr
    (tmp_path / "mine.txt").write_text(done.stdout)
    rules = {r.label: (r.marker, r.segment) for r in read_association(tmp_path / "mine.txt").rules}
    known = {r.label: (r.marker, r.segment) for r in read_association("cmu").rules}
    assert rules == known
    assert run("fit", ROM, "--assoc", "mine.txt", "-o", "out", cwd=tmp_path).returncode == 0


def test_every_line_tells_its_confidence_and_reason(tmp_path):
    clip = recorded(tmp_path / "odd.c3d", lambda x: {"T10": "pixel", "LFWT": "LKAX"}.get(x, x))
    done = run("assoc", "guess", clip, cwd=tmp_path)
    lines = {x.lstrip("# ").split()[0]: x for x in done.stdout.splitlines() if "  # " in x}
    assert len(lines) == 41
    assert all("# high: " in x or "# likely: " in x for x in lines.values() if x[0] != "#")
    assert lines["LKAX"].startswith("# LKAX") and "# unsure: " in lines["LKAX"]
    assert lines["pixel"].split()[:3] == ["pixel", "pixel", "Chest"]
    assert "# likely: the name says nothing; keeps its distance to Chest within" in lines["pixel"]


def test_a_guess_never_overwrites_unasked(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    done = run("assoc", "guess", ROM, "-o", "mine.txt", cwd=tmp_path)
    assert done.returncode == 2
    assert "exists already" in done.stderr
    assert (tmp_path / "mine.txt").read_text() == "mine"
    done = run("assoc", "guess", ROM, "-o", "mine.txt", "--overwrite", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, "wrote mine.txt\n")


def test_a_guess_as_json_is_one_line_a_label(tmp_path):
    done = run("assoc", "guess", SAMPLES / "two_dancers.c3d", "--json", "-q", cwd=tmp_path)
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(rows) == 41
    assert {"label", "marker", "segment", "confidence", "reason"} <= set(rows[0])
    assert done.stderr == ""


def test_fit_without_assoc_says_what_it_took_and_gives_the_same_joints(tmp_path):
    guessed = run("fit", ROM, "-o", "a", cwd=tmp_path)
    named = run("fit", ROM, "--assoc", "cmu", "-o", "b", cwd=tmp_path)
    assert guessed.returncode == 0
    assert "no --assoc, so it is guessed from names and motion: 41 of 41 labels" in guessed.stderr
    table = "range_of_motion.joints.csv"
    assert (tmp_path / "a" / table).read_text() == (tmp_path / "b" / table).read_text()
    assert named.returncode == 0


def test_fit_without_assoc_stops_where_it_is_not_sure(tmp_path):
    clip = recorded(
        tmp_path / "numbers.c3d", lambda label: f"P{sum(map(ord, label))}_{label[::-1]}x"
    )
    done = run("fit", clip, "-o", "out", cwd=tmp_path)
    assert done.returncode == 2
    assert "assoc guess" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    swapped = {"LFHD": "RANK", "RANK": "LFHD"}
    clip = recorded(tmp_path / "swapped.c3d", lambda label: swapped.get(label, label))
    done = run("fit", clip, "--strict", "-o", "out", cwd=tmp_path)
    assert done.returncode == 2
    assert "contradict each other" in done.stderr
    assert f"mocap-skel assoc guess {clip} -o" in done.stderr
    assert not (tmp_path / "out").exists()


def test_fit_without_assoc_knows_the_clips_subjects(tmp_path):
    done = run("fit", SAMPLES / "two_dancers.c3d", "--subject", "Zoe", cwd=tmp_path)
    assert done.returncode == 2
    assert "no subject 'Zoe' in it" in done.stderr and "it has Anna, Ben" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_hints_are_commands_that_run(tmp_path):
    numbers = iter(range(1, 100))
    clip = recorded(tmp_path / "my first clip.c3d", lambda _: f"*{next(numbers)}")
    refused = run("fit", clip.name, "--unit", "mm", cwd=tmp_path)
    assert refused.returncode == 2
    hint = re.search(r"mocap-skel (assoc guess .* -o figure)", refused.stderr)
    words = shlex.split(hint[1])
    assert words[2:] == [clip.name, "--by-motion", "--unit", "mm", "-o", "figure"]
    assert run(*words, cwd=tmp_path).returncode == 0
    swapped = {"LFHD": "RANK", "RANK": "LFHD"}
    clip = recorded(tmp_path / "a swap.c3d", lambda label: swapped.get(label, label))
    clip.write_bytes(clip.read_bytes()[:-700])
    refused = run("fit", clip.name, "--salvage", "--strict", cwd=tmp_path)
    assert refused.returncode == 2
    words = shlex.split(re.search(r"mocap-skel (assoc guess .*) writes it", refused.stderr)[1])
    assert "--salvage" in words
    assert run(*words, cwd=tmp_path).returncode == 0
    assert (tmp_path / "assoc.txt").exists()
    check = run("assoc", "check", clip.name, "--assoc", "assoc.txt", "--salvage", cwd=tmp_path)
    assert check.returncode == 0


def test_show_refuses_a_file_that_is_no_association(tmp_path):
    (tmp_path / "toml.txt").write_text("# mine\n[segment]\nname = 3 4 5 6\n")
    done = run("assoc", "show", "toml.txt", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert "toml.txt:2:" in done.stderr or "toml.txt:3:" in done.stderr


def test_studies_still_want_an_association(tmp_path):
    done = run("study", "resample", ROM, cwd=tmp_path)
    assert done.returncode == 2
    assert "--assoc is missing" in done.stderr


def test_unlabelled_points_become_a_figure_that_can_be_fitted(tmp_path):
    numbers = iter(range(1, 100))
    clip = recorded(tmp_path / "bare.c3d", lambda _: f"*{next(numbers)}")
    assert run("assoc", "guess", clip, cwd=tmp_path).returncode == 2
    done = run("assoc", "guess", clip, "--by-motion", "-o", "fig", cwd=tmp_path)
    assert done.returncode == 0
    assert "41 of 41 labels on 15 segments, 14 joints" in done.stderr
    assert files(tmp_path) == ["bare.c3d", "fig.toml", "fig.txt"]
    fitted = run("fit", clip, "--assoc", "fig.txt", "-o", "out", cwd=tmp_path)
    assert fitted.returncode == 0
    assert "14 of 14 joints fitted" in fitted.stdout


def test_a_figure_needs_a_base_and_writes_both_files_or_none(tmp_path):
    assert run("assoc", "guess", ROM, "--by-motion", cwd=tmp_path).returncode == 2
    (tmp_path / "fig.txt").write_text("mine")
    done = run("assoc", "guess", ROM, "--by-motion", "-o", "fig", cwd=tmp_path)
    assert done.returncode == 2
    assert files(tmp_path) == ["fig.txt"]


def test_list_show_and_standard(tmp_path):
    listed = run("assoc", "list", cwd=tmp_path).stdout
    assert "cmu" in listed and "Vicon Plug-in Gait" in listed and "LABEL" not in listed
    rows = [json.loads(x) for x in run("assoc", "list", "--json", cwd=tmp_path).stdout.splitlines()]
    assert all(row["what"] for row in rows)
    shown = run("assoc", "show", "cmu", cwd=tmp_path).stdout
    assert shown.startswith("# The 41 markers of the CMU")
    wrong = run("assoc", "show", "cmuu", cwd=tmp_path)
    assert wrong.returncode == 2 and "did you mean cmu?" in wrong.stderr
    standard = run("assoc", "standard", cwd=tmp_path).stdout.splitlines()
    assert len(standard) == 52
    assert standard[1].split() == ["RFWT", "Hips", "anterior", "right", "top"]


def test_labels_that_need_quotes_are_quoted(tmp_path):
    names = {"RSHO": "r should", "T10": "T10#x", "C7": "ignore", "STRN": "@mine"}
    clip = recorded(tmp_path / "q.c3d", lambda x: names.get(x, x))
    assert run("assoc", "guess", clip, "-o", "q.txt", cwd=tmp_path).returncode == 0
    rules = {r.label: r.segment for r in read_association(tmp_path / "q.txt").rules}
    assert {rules[name] for name in names.values()} == {"Chest"}
    fitted = run("fit", clip, "--assoc", "q.txt", "-q", cwd=tmp_path)
    assert "14 of 14 joints fitted" in fitted.stdout


@pytest.mark.real
@pytest.mark.parametrize(
    ("clip", "association"),
    [
        ("cmu/01_01", "cmu"), ("hdm05/HDM_dg_06-03_03_120", "cmu"),
        ("two_subjects/kinematics_tennis_serve_2players", "plug_in_gait"),
        ("functional_hip/FunctionalLHip", "plug_in_gait_clusters"),
    ],
)  # fmt: skip
def test_real_clips_are_guessed_as_their_association_files_say(shared_clips, clip, association):
    from mocap_skel import read_clip
    from mocap_skel.labels.guess import check_sure, guess_association

    read = read_clip(shared_clips / f"{clip}.c3d")
    rules = [r for r in read_association(association).rules if r.label in read.labels]
    guess = guess_association(read)
    check_sure(guess)
    placed = {x.label: (x.marker if x.standard else "", x.segment) for x in guess.used}
    standard = set(guess.skeleton.segment_of)
    right = sum(
        placed.get(r.label) == (r.marker if r.marker in standard else "", r.segment) for r in rules
    )
    assert right >= 0.95 * len(rules)

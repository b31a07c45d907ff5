"""The studies from their call to their files: what is written, what stops them, how they go on."""

import sys
from dataclasses import asdict, replace
from functools import cache

import numpy as np
import pytest
from findings import answer, contents, rows_of, there
from recordings import ROOT, known

from mocap_skel.artificial import (
    Faults,
    circumduct,
    figure_of,
    markers_of,
    ranges_of,
    record,
    write_c3d,
)
from mocap_skel.errors import CallError, MissingExtraError, OutputError
from mocap_skel.export.files import write_all
from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.labels.association import read_association
from mocap_skel.pipeline import study as studies
from mocap_skel.pipeline.job import Job, fit_file
from mocap_skel.pipeline.study import Resampling, Where
from mocap_skel.report.terminal import rows_table
from mocap_skel.studies import accuracy, speed
from mocap_skel.studies.accuracy import Plan, score_cell
from mocap_skel.studies.resample import Group, Law, Summary, refits


@cache
def arm():
    """300 frames of one arm: two joints are enough for what a study does with its answers."""
    skeleton = read_skeleton("left_arm")
    figure = figure_of(skeleton)
    motion = circumduct(ranges_of(skeleton), 10, 30, seed=1)
    return record(figure, markers_of(skeleton, figure), motion, Faults(sigma=0.001), seed=1)


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    """The arm as a file."""
    path = tmp_path_factory.mktemp("clips") / "short.c3d"
    write_c3d(arm(), path)
    return path


# As the command line has it.
JOB = Job(association=known("left_arm"), prior="none")
SMALL = Resampling(passes=2, levels=2, seed=5)
PARTS = ["answers", "deviations", "means", "power_law"]


def resample(clip, folder, plan=SMALL, job=JOB, **where):
    return studies.resample(clip, job, plan, Where(folder, figures=False, workers=1, **where))


def watch_refits(monkeypatch, stop=None, error=KeyboardInterrupt):
    """Count the passes that are refitted; in one of them the study breaks off."""
    done = []

    def watched(clip, fit, passed, levels, seed):
        if passed == stop:
            raise error
        done.append((passed, list(levels)))
        return refits(clip, fit, passed, levels, seed)

    monkeypatch.setattr(studies, "refits", watched)
    return done


def other_columns(folder):
    """The arm's association with two markers of the upper arm exchanged."""
    folder.mkdir()
    text = (ROOT / "association_files" / "left_arm.txt").read_text()
    lines = {"LUPA  LUPA": "LUPA  LUPB", "LUPB  LUPB": "LUPB  LUPA"}
    path = folder / "left_arm.txt"
    path.write_text("\n".join(lines.get(line, line) for line in text.splitlines()))
    return read_association(path)


def another_of_that_name(folder):
    """Another recording of the arm under the same file name."""
    folder.mkdir()
    write_c3d(replace(arm(), points=arm().points[:, :, [1, 0, 2]]), folder / "short.c3d")
    return folder / "short.c3d"


class TestResampleStudy:
    def test_it_writes_its_four_tables(self, short, tmp_path):
        found = resample(short, tmp_path / "out")
        assert there(tmp_path) == [f"short.resample.{part}.csv" for part in PARTS]
        order = ("answers", "means", "deviations", "power_law")
        assert [p.name for p in found.files] == [f"short.resample.{part}.csv" for part in order]
        for path in found.files:
            rows = rows_of(path)
            table = found.tables[path.name.split(".")[2]]
            assert len(rows) == len(table) and list(rows[0]) == list(table[0])
        assert len(found.tables["answers"]) == 2 * 2 * 2
        assert [row["joint"] for row in found.tables["power_law"]] == [
            "LeftElbow",
            "LeftWrist",
            "all",
        ]
        assert "seed 5" in found.words[0] and "300 frames" in found.words[0]

    def test_the_tables_of_means_and_deviations_are_those_of_the_answers(self, short, tmp_path):
        resample(short, tmp_path)
        rows = rows_of(tmp_path / "short.resample.answers.csv")
        elbow = np.array([[float(r[k]) for k in "xyz"] for r in rows if r["joint"] == "LeftElbow"])
        (mean,), (sd,) = (
            [
                r
                for r in rows_of(tmp_path / f"short.resample.{name}.csv")
                if r["joint"] == "LeftElbow"
            ]
            for name in ("means", "deviations")
        )
        # Nine digits.
        np.testing.assert_allclose(
            [float(mean[f"mean_{k}"]) for k in "xyz"], elbow.mean(axis=0), rtol=1e-7
        )
        np.testing.assert_allclose(
            [float(sd[f"sd_{k}"]) for k in "xyz"], elbow.std(axis=0, ddof=1), rtol=1e-4
        )
        assert [sd[f"sd_{k}"] for k in "xyz"] == [sd[f"sd_about_one_mean_{k}"] for k in "xyz"]

    def test_after_an_interruption_it_goes_on_where_it_was(self, short, tmp_path, monkeypatch):
        plan = replace(SMALL, passes=3)
        with monkeypatch.context() as patch:
            first = watch_refits(patch, stop=1, error=RuntimeError)
            with pytest.raises(RuntimeError):
                resample(short, tmp_path / "a", plan)
        assert first == [(0, [0, 1])]
        # Nothing but what is put by, in a folder that nobody sees.
        (store,) = (tmp_path / "a").iterdir()
        assert store.name.startswith(".short.resample-")
        assert there(store) == ["pass0.json"]
        with monkeypatch.context() as patch:
            rest = watch_refits(patch)
            resample(short, tmp_path / "a", plan)
        assert [passed for passed, _ in rest] == [1, 2]
        resample(short, tmp_path / "b", plan)
        # As if nothing had happened, and nothing else is left.
        assert contents(tmp_path / "a") == contents(tmp_path / "b")

    def test_a_pass_of_several_tasks_is_kept_when_it_is_whole(self, short, tmp_path, monkeypatch):
        monkeypatch.setattr(studies, "_AT_ONCE", 2)
        plan, levels = Resampling(passes=2, levels=3, seed=0), [[0, 1], [2]]
        with monkeypatch.context() as patch:
            first = watch_refits(patch, stop=1)
            with pytest.raises(KeyboardInterrupt):
                resample(short, tmp_path, plan)
        assert first == [(0, part) for part in levels]
        with monkeypatch.context() as patch:
            rest = watch_refits(patch)
            resample(short, tmp_path, plan)
        assert rest == [(1, part) for part in levels]

    def test_another_study_does_not_take_what_is_put_by(self, short, tmp_path, monkeypatch):
        with monkeypatch.context() as patch:
            watch_refits(patch, stop=1)
            with pytest.raises(KeyboardInterrupt):
                resample(short, tmp_path / "out")
        (store,) = (tmp_path / "out").iterdir()
        for other in (
            {"plan": replace(SMALL, seed=6)},
            {"plan": replace(SMALL, levels=3)},
            {"job": replace(JOB, method="gdke")},
            {"job": replace(JOB, sigma=0.002)},
            {"job": replace(JOB, noise="matrix")},
            {"job": replace(JOB, pose="triad")},
            {"job": replace(JOB, association=other_columns(tmp_path / "labels"))},
            {"clip": another_of_that_name(tmp_path / "clips")},
        ):
            with monkeypatch.context() as patch:
                # Had it taken the first pass, it would be in the second, and not stop.
                watch_refits(patch, stop=0)
                with pytest.raises(KeyboardInterrupt):
                    resample(**{"clip": short, "folder": tmp_path / "out"} | other)
        assert list((tmp_path / "out").iterdir()) == [store]

    @pytest.mark.parametrize("damage", ["[{", '[{"joint": "LeftElbow"}]', "[1, 2]"])
    def test_a_damaged_pass_is_done_again(self, short, tmp_path, monkeypatch, damage):
        with monkeypatch.context() as patch:
            watch_refits(patch, stop=1)
            with pytest.raises(KeyboardInterrupt):
                resample(short, tmp_path / "a")
        (put_by,) = (tmp_path / "a").glob("*/pass0.json")
        put_by.write_text(damage)
        with monkeypatch.context() as patch:
            done = watch_refits(patch)
            resample(short, tmp_path / "a")
        assert [passed for passed, _ in done] == [0, 1]
        resample(short, tmp_path / "b")
        assert contents(tmp_path / "a") == contents(tmp_path / "b")

    def test_a_study_of_fewer_passes_after_one_of_more_is_no_error(
        self, short, tmp_path, monkeypatch
    ):
        """Two of three passes are put by; the user is content with one."""
        with monkeypatch.context() as patch:
            watch_refits(patch, stop=2)
            with pytest.raises(KeyboardInterrupt):
                resample(short, tmp_path, replace(SMALL, passes=3))
        found = resample(short, tmp_path, replace(SMALL, passes=1))
        assert len(found.files) == 4

    def test_a_result_that_is_there_stops_it_before_any_work(self, short, tmp_path, monkeypatch):
        (tmp_path / "short.resample.means.csv").write_text("mine")
        done = watch_refits(monkeypatch)
        with pytest.raises(OutputError, match="exists already"):
            resample(short, tmp_path)
        assert done == []
        assert contents(tmp_path) == {"short.resample.means.csv": b"mine"}
        resample(short, tmp_path, overwrite=True)
        assert len(there(tmp_path)) == 4

    def test_a_folder_that_cannot_be_made_stops_it_before_any_work(
        self, short, tmp_path, monkeypatch
    ):
        (tmp_path / "out").write_text("a file")
        done = watch_refits(monkeypatch)
        with pytest.raises(OutputError, match="out"):
            resample(short, tmp_path / "out")
        assert done == []
        assert contents(tmp_path) == {"out": b"a file"}

    def test_refits_that_fail_and_joints_without_a_marker_are_told(self, tmp_path, monkeypatch):
        def lossy(*call):
            return [a for a in refits(*call) if a.level != 1]

        monkeypatch.setattr(studies, "refits", lossy)
        points = arm().points.copy()
        points[:, [label in ("LFIN", "LHMB", "LHMC") for label in arm().labels]] = np.nan
        path = tmp_path / "few.c3d"
        write_c3d(replace(arm(), points=points), path)
        found = resample(path, tmp_path / "out", Resampling(1, 3))
        assert "3 refits" in found.words[0] and "1 pass," in found.words[0]
        assert found.words[1] == "1 of them could not be fitted"
        shown = {row["joint"]: row["shown"] for row in found.tables["means"]}
        assert shown == {"LeftElbow": "yes"}
        rows = [row for row in found.tables["answers"] if row["joint"] == "LeftWrist"]
        empty = [(row["samples"], row["cluster"], row["deviation"]) for row in rows]
        assert empty == [(0, None, None)] * 2
        assert any("LeftWrist" in note for note in found.notes)

    def test_samples_that_the_whole_clips_fit_leaves_out_stay_out_of_every_refit(self, tmp_path):
        """Refits do not search for outliers: frames that are drawn show no steps."""
        skeleton = read_skeleton("left_arm")
        figure = figure_of(skeleton)
        motion = circumduct(ranges_of(skeleton), 10, 60, seed=1)
        faults = Faults(sigma=0.001, outliers=0.02, outlier_burst=5)
        clip = record(figure, markers_of(skeleton, figure), motion, faults, seed=1, first_frame=51)
        write_c3d(clip, tmp_path / "wild.c3d")
        whole = fit_file(tmp_path / "wild.c3d", JOB).subjects[0][1]
        assert sum(len(left.frames) for left in whole.left_out) > 50
        found = resample(tmp_path / "wild.c3d", tmp_path / "out", Resampling(1, 1))
        for row, joint in zip(found.tables["answers"], whole.joints, strict=True):
            # Single precision of the file, and what is left out decides which samples make a template.
            np.testing.assert_allclose([row[k] for k in "xyz"], joint.centre, rtol=0, atol=1e-4)
            assert row["samples"] < 600

    def test_the_verdicts_are_those_of_the_whole_clip(self, tmp_path):
        """A wrist that is held still has answers, and the movement does not show it."""
        skeleton = read_skeleton("left_arm")
        figure = figure_of(skeleton)
        ranges = ranges_of(skeleton) | {"LeftHand": ((0, 1), (0, 1), (0, 1))}
        motion = circumduct(ranges, 10, 30, seed=1)
        clip = record(figure, markers_of(skeleton, figure), motion, Faults(sigma=0.001), seed=1)
        write_c3d(clip, tmp_path / "stiff.c3d")
        found = resample(tmp_path / "stiff.c3d", tmp_path / "out", Resampling(1, 2))
        for table in ("means", "power_law"):
            shown = {row["joint"]: row["shown"] for row in found.tables[table]}
            assert (shown["LeftElbow"], shown["LeftWrist"]) == ("yes", "no")

    def test_labels_that_do_not_fit_are_told(self, tmp_path):
        renamed = tuple("ELBOW" if label == "LELB" else label for label in arm().labels)
        write_c3d(replace(arm(), labels=renamed), tmp_path / "other.c3d")
        found = resample(tmp_path / "other.c3d", tmp_path / "out", Resampling(1, 1))
        assert any("1 label not in the clip: LELB" in note for note in found.notes)

    def test_a_clip_of_two_takes_a_subject_and_its_name(self, samples, tmp_path):
        clip = samples / "two_dancers.c3d"
        pair = replace(JOB, association=known("cmu"))
        with pytest.raises(CallError, match="one subject") as error:
            resample(clip, tmp_path, job=pair)
        assert "Anna, Ben" in error.value.hint
        resample(clip, tmp_path, Resampling(1, 1), replace(pair, subject="Ben"))
        assert there(tmp_path) == [f"two_dancers.Ben.resample.{part}.csv" for part in PARTS]

    def test_a_single_refit_has_a_figure_as_well(self, short, tmp_path):
        """--levels 1 is allowed: no deviation, nothing to draw a law through."""
        where = Where(tmp_path, workers=1)
        found = studies.resample(short, JOB, Resampling(passes=1, levels=1), where)
        assert len(found.files) == 5

    def test_progress_sees_every_part_in_turn(self, short, tmp_path, monkeypatch):
        monkeypatch.setattr(studies, "_AT_ONCE", 2)
        seen = []

        def progress(parts, count):
            for part in parts:
                seen.append(count)
                yield part

        resample(short, tmp_path, Resampling(2, 3), progress=progress)
        # Two tasks a pass.
        assert seen == [4, 4, 4, 4]


def a_group(joint, cluster, answers):
    place = np.zeros(3)
    return Group(joint, cluster, answers, "a b c", "MGDK", place, place, place)


def test_what_a_resampling_study_says_in_words():
    """A second answer of one in twenty is an answer, less is an odd one; slopes and shares as they are."""
    found = [answer((0, 0, 0), joint=j) for j, n in (("Hip", 120), ("Knee", 200)) for _ in range(n)]
    groups = (
        a_group("Hip", 1, 114),
        a_group("Hip", 2, 6),
        a_group("Knee", 1, 191),
        a_group("Knee", 2, 9),
    )
    laws = (Law("all", 320, -0.45, 0.02, -0.52, 0.004, 0.975),)
    nothing = np.zeros(len(found))
    summary = Summary(tuple(found), nothing.astype(int), nothing, groups, laws)
    assert studies._in_words(summary, failed=3) == [
        "3 of them could not be fitted",
        "deviation falls with the samples as n^-0.45 ± 0.02; as (n N/(N - n))^-0.52 when it counts that all "
        "n come from one clip of N",
        "97.5 % of the answers from more than 200 samples lie within 1 cm of their joint's mean",
        "joints with several answers, each measured about its own mean: Hip (6 of 120)",
        "joints with odd answers, by other axes or another method: Knee (9 of 200)",
    ]
    unknown = replace(laws[0], slope=np.nan, near=np.nan)
    assert studies._in_words(replace(summary, groups=groups[:1], laws=(unknown,)), failed=0) == []


def test_the_accuracy_study_is_repeated_by_its_seed(tmp_path, monkeypatch):
    monkeypatch.setattr(accuracy, "SPREADS", accuracy.SPREADS[:1])
    plan = Plan(noises=(0.01, 0.1), angles=(45.0,), count=30, trials=2, seed=2)
    for folder in "ab":
        found = studies.run_accuracy(
            plan, Where(tmp_path / folder, figures=folder == "a", workers=1)
        )
    assert there(tmp_path / "b") == [
        f"accuracy.{name}.csv" for name in ("markers", "noise", "scores")
    ]
    assert "accuracy.map.png" in there(tmp_path / "a")
    for name, text in contents(tmp_path / "b").items():
        assert contents(tmp_path / "a")[name] == text
    assert [row["method"] for row in found.tables["scores"][:2]] == ["GDKE", "UGDK, true σ"]
    assert len(found.tables["scores"]) == 2 * len(accuracy.METHODS)
    assert "seed 2" in found.words[0]
    # As the terminal shows it: a dash where nothing is estimated.
    shown = rows_table(found.tables["noise"]).splitlines()
    assert len(shown) == 1 + 3 * 5
    assert shown[0].split()[:3] == ["sigma", "x", "sigma"] and " - " in shown[1]


def test_a_score_is_a_row_of_its_table(tmp_path):
    plan = Plan(noises=(0.01,), angles=(90.0,), count=50, trials=3, methods=("gdke",))
    (score,) = score_cell(plan, (0, 0))
    found = studies.run_accuracy(plan, Where(tmp_path, figures=False, workers=1))
    (row,) = found.tables["scores"]
    assert row == {**asdict(score), "method": "GDKE", "breaks": score.breaks}


class TestSpeedStudy:
    def test_the_time_of_a_sample_is_told_in_microseconds(self, tmp_path, monkeypatch):
        monkeypatch.setattr(speed, "time_of_a_sample", lambda: 25e-6)
        found = studies.run_speed(1, 100, 1, Where(tmp_path, figures=False))
        assert "IGDK one sample at a time: 25 microseconds a sample" in found.words

    def test_ratios_of_few_points_are_not_called_those_of_many(self, tmp_path):
        """`study speed --most-points 100` has no set of 10,000 points to take ratios over."""
        found = studies.run_speed(2, 100, 1, Where(tmp_path, figures=False))
        assert len(found.tables["ratios"]) == len(speed.METHODS)
        assert "10,000 points or more" not in " ".join(found.words)


class TestFiles:
    def test_bytes_are_written_as_they_are_beside_text(self, tmp_path):
        image = bytes(range(256))
        write_all({tmp_path / "a" / "x.png": image, tmp_path / "a" / "x.csv": "σ\n"}, False)
        assert (tmp_path / "a" / "x.png").read_bytes() == image
        assert (tmp_path / "a" / "x.csv").read_bytes() == "σ\n".encode()
        assert there(tmp_path) == ["x.csv", "x.png"]

    def test_one_that_is_there_stops_all(self, tmp_path):
        (tmp_path / "x.png").write_bytes(b"mine")
        with pytest.raises(OutputError, match="exists already"):
            write_all({tmp_path / "x.csv": "", tmp_path / "x.png": b"new"}, False)
        assert contents(tmp_path) == {"x.png": b"mine"}

    def test_names_are_known_before_the_work_and_checked(self, tmp_path):
        where = Where(tmp_path, figures=True)
        names = where.names("speed", ["trials"], ["figure26"])
        assert names == {
            "trials.csv": tmp_path / "speed.trials.csv",
            "figure26.png": tmp_path / "speed.figure26.png",
        }
        (tmp_path / "speed.figure26.png").write_bytes(b"")
        with pytest.raises(OutputError, match=r"figure26\.png: exists already"):
            where.names("speed", ["trials"], ["figure26"])
        assert list(replace(where, figures=False).names("speed", ["trials"], ["figure26"])) == [
            "trials.csv"
        ]
        assert len(replace(where, overwrite=True).names("speed", ["trials"], ["figure26"])) == 2

    def test_figures_are_refused_before_any_work(self, monkeypatch, tmp_path):
        monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
        with pytest.raises(MissingExtraError, match="matplotlib"):
            Where(tmp_path).names("x", [], ["y"])
        assert Where(tmp_path, figures=False).names("x", [], ["y"]) == {}

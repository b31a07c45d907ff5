"""The thesis's experiments as a library: resampling, speed, accuracy, the table, their figures.

Tolerances come from what is drawn: a share, a mean or a slope gets four of its standard errors. The
logarithm (base 10) of the length of a normal vector of three varies by `LOG`, so that a line through K
such lengths over x has a slope that is known to LOG / (σ_x √K).
"""

import csv
import io
import json
import struct
import sys
import zlib
from dataclasses import asdict, replace
from functools import cache, partial

import numpy as np
import pytest
from recordings import clip_of, fit_recording, known
from recordings import fit_clip as fit_with_anatomy

from mocap_skel.artificial import Faults, human, marker_set, range_of_motion, record, write_c3d
from mocap_skel.artificial.spheres import cap
from mocap_skel.errors import CallError, FitError, MissingExtraError, OutputError
from mocap_skel.export.files import write_all
from mocap_skel.export.tables_csv import rows_csv
from mocap_skel.extras import extra
from mocap_skel.pipeline import study as studies
from mocap_skel.pipeline.job import Job
from mocap_skel.pipeline.study import Resampling, Where
from mocap_skel.readers import read_clip
from mocap_skel.report import figures
from mocap_skel.report.terminal import rows_table
from mocap_skel.studies import accuracy, speed, table4, tables
from mocap_skel.studies import figures as study_figures
from mocap_skel.studies.accuracy import Plan, Score, score_cell, score_markers, score_noise
from mocap_skel.studies.contenders import CONTENDERS
from mocap_skel.studies.flops import figure_flops, frame_flops
from mocap_skel.studies.parallel import in_parallel
from mocap_skel.studies.resample import Answer, clusters, refits, summarise

EPS = np.finfo(float).eps
# Standard deviation of log10 of the length of a normal vector of three: ½ √ψ'(3/2) / ln 10.
LOG = 0.21


# --- resampling -------------------------------------------------------------------------------------


# The studies are of the thesis's pure fits.
fit_clip = partial(fit_with_anatomy, prior="none")


def answer(place, samples=500, joint="LeftKnee", frame="a b c", method="MGDK", passed=0, level=0):
    x, y, z = map(float, place)
    return Answer(passed, level, samples, joint, samples, method, frame, x, y, z)


def scattered(rng, count, scale=0.01, at=(0.0, 0.0, 0.0), whole=None, draw=None, **more):
    """Answers whose deviation falls as 1/√samples (10 to 1,000), or as for a clip of so many frames."""
    samples = np.round(10 ** rng.uniform(1, 3, count)).astype(int)
    found = []
    for n in samples:
        free = 1 / n - (1 / whole if whole else 0.0)
        away = rng.normal(size=3) if draw is None else draw(rng)
        found.append(answer(at + scale * np.sqrt(free) * away, int(n), **more))
    return found


def mirrored(samples, length, joint="LeftKnee"):
    """Two answers for each number of samples, so far to either side: their mean is known exactly."""
    rng = np.random.default_rng(0)
    found = []
    for n in samples:
        way = rng.normal(size=3)
        way *= length(n) / np.linalg.norm(way)
        found += [answer(way, n, joint), answer(-way, n, joint)]
    return found


class TestLaw:
    def test_an_exact_law_is_found_exactly(self):
        samples = [10, 30, 100, 200, 300, 1000, 3000]
        law = summarise(mirrored(samples, lambda n: 0.08 * n**-0.5)).laws[-1]
        assert law.slope == pytest.approx(-0.5, abs=1e-9)
        assert law.slope_error == pytest.approx(0.0, abs=1e-6)
        assert law.at_enough == pytest.approx(0.08 * 200**-0.5, rel=1e-9)
        assert (law.joint, law.answers) == ("all", 14)

    def test_scatter_has_the_slope_of_its_law_within_its_standard_error(self):
        count = 400
        for seed in range(5):
            found = summarise(scattered(np.random.default_rng(seed), count))
            one, law = found.laws
            assert (one.joint, law.joint) == ("LeftKnee", "all")
            assert one.slope == law.slope
            # Numbers of samples are even in their logarithm over two decades.
            expected = LOG / (2 / np.sqrt(12) * np.sqrt(count))
            # A standard deviation of 400 lengths is known to 1/√800.
            assert law.slope_error == pytest.approx(expected, rel=4 / np.sqrt(2 * count))
            assert abs(law.slope + 0.5) <= 4 * law.slope_error

    def test_drawn_from_a_clip_that_ends_the_law_is_that_of_what_is_left(self):
        whole, samples = 1000, range(100, 1000, 50)
        pairs = mirrored(samples, lambda n: 0.05 * np.sqrt(1 / n - 1 / whole))
        law = summarise([*pairs, answer((0, 0, 0), whole)]).laws[-1]
        assert law.finite_slope == pytest.approx(-0.5, abs=1e-9)
        assert law.slope < -0.8

    @pytest.mark.parametrize(("far", "share"), [(1, 0.9), (5, 0.5), (0, 1.0)])
    def test_the_share_within_a_centimetre_counts_what_has_more_than_200_samples(self, far, share):
        near = mirrored([201] * (10 - far), lambda n: 0.0099)
        away = mirrored([900] * far, lambda n: 0.0101)
        # These do not count: 200 are not more than 200.
        few = mirrored([200, 50], lambda n: 0.05)
        assert summarise(near + away + few).laws[-1].near == pytest.approx(share)

    def test_what_cannot_be_said_is_no_number(self):
        law = summarise(mirrored([150, 150], lambda n: 0.01)).laws[-1]
        assert np.isnan([law.slope, law.slope_error, law.finite_slope, law.near]).all()

    def test_numbers_that_hardly_differ_are_no_law(self):
        """0 to 4 % left out: a line through them would foretell anything."""
        law = summarise(
            [
                answer(np.random.default_rng(k).normal(size=3) / 100, 1380 - 14 * (k % 5))
                for k in range(40)
            ]
        ).laws[-1]
        assert np.isnan([law.slope, law.slope_error, law.at_enough]).all()
        assert law.near < 1.0

    def test_answers_that_agree_to_rounding_have_no_logarithm(self):
        law = summarise([answer((0.1, 0.2, 0.3), n) for n in (100, 300, 900)]).laws[-1]
        assert np.isnan(law.slope) and law.near == 1.0

    def test_each_joint_has_its_own_law(self):
        rng = np.random.default_rng(3)
        knee = mirrored([20, 100, 500], lambda n: n**-0.5 / 10)
        hip = mirrored([20, 100, 500], lambda n: n**-1.0 / 10, joint="LeftHip")
        both = [*knee, *hip]
        found = summarise([both[i] for i in rng.permutation(len(both))])
        laws = {law.joint: law.slope for law in found.laws}
        assert laws["LeftKnee"] == pytest.approx(-0.5) and laws["LeftHip"] == pytest.approx(-1.0)
        assert laws["LeftHip"] < laws["all"] < laws["LeftKnee"]

    def test_refits_without_an_answer_are_left_out(self):
        nothing = replace(answer((0, 0, 0), 0), x=np.nan, y=np.nan, z=np.nan)
        found = summarise([nothing, *mirrored([10, 100, 1000], lambda n: n**-0.5), nothing])
        assert len(found.answers) == len(found.deviation) == len(found.cluster) == 6
        with pytest.raises(FitError, match="no refit has an answer"):
            summarise([nothing])


def by_cluster(summary):
    return {group.cluster: group for group in summary.groups}


class TestClusters:
    def test_two_frames_of_the_parent_are_two_answers_about_two_means(self):
        """The thesis's ankles and elbows (6.1), whose table 3 has deviations from a mean of both."""
        rng = np.random.default_rng(1)
        one = scattered(rng, 120, 0.01, (0.3, 0.0, 0.0), frame="a b c")
        two = scattered(rng, 80, 0.01, (0.0, 0.3, 0.0), frame="a b d")
        found = summarise(
            [pair for both in zip(one, two, strict=False) for pair in both] + one[80:]
        )
        groups = by_cluster(found)
        assert [(groups[k].answers, groups[k].frame) for k in (1, 2)] == [
            (120, "a b c"), (80, "a b d")
        ]  # fmt: skip
        for own, made in zip((groups[1], groups[2]), (one, two), strict=True):
            places = np.array([(a.x, a.y, a.z) for a in made])
            np.testing.assert_allclose(own.mean, places.mean(axis=0), rtol=0, atol=8 * EPS)
            np.testing.assert_allclose(own.deviation, places.std(axis=0, ddof=1), rtol=1e-12)
        # 200 answers of two places 0.3 m apart: 0.3 √(p (1 - p)) along either axis.
        apart = 0.3 * np.sqrt(0.6 * 0.4)
        np.testing.assert_allclose(groups[1].single[:2], apart, rtol=0.02)
        assert (groups[1].single[:2] > 50 * groups[1].deviation[:2]).all()
        np.testing.assert_array_equal(groups[1].single, groups[2].single)
        # Every deviation is from the own mean: none is as large as the way to the other.
        assert found.deviation.max() < 0.03
        assert found.laws[0].near == 1.0

    def test_two_places_of_one_kind_are_found_by_the_gap_between_them(self):
        for seed in range(5):
            rng = np.random.default_rng(seed)
            found = summarise(
                scattered(rng, 90, 0.01) + scattered(rng, 60, 0.01, (0.0, 0.05, 0.05))
            )
            groups = by_cluster(found)
            assert {k: g.answers for k, g in groups.items()} == {1: 90, 2: 60}
            np.testing.assert_array_equal(found.cluster, [1] * 90 + [2] * 60)
            # σ / √n of 10 samples at least: the means of so many are well within a millimetre.
            np.testing.assert_allclose(groups[2].mean, (0.0, 0.05, 0.05), rtol=0, atol=0.001)

    def test_three_places_are_three(self):
        """Two of them near each other, the third far off: cut twice."""
        rng = np.random.default_rng(2)
        places = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.1, 0.0)]
        made = [scattered(rng, n, 0.01, at) for n, at in zip((50, 70, 60), places, strict=True)]
        found = summarise([a for part in made for a in part])
        np.testing.assert_array_equal(found.cluster, [3] * 50 + [1] * 70 + [2] * 60)

    @pytest.mark.parametrize("freedom", [1, 2, 3])
    def test_one_place_with_heavy_tails_stays_one(self, freedom):
        for seed in range(10):
            rng = np.random.default_rng(seed)
            made = scattered(rng, 200, 0.01, draw=lambda r: r.standard_t(freedom, size=3))
            assert {group.cluster for group in summarise(made).groups} == {1}

    def test_a_few_outliers_are_no_second_answer(self):
        rng = np.random.default_rng(3)
        # Fewer than one in twenty of those that decide, the better half.
        made = scattered(rng, 200, 0.01) + [answer((0.3, 0.0, 0.0), 900) for _ in range(4)]
        assert {group.cluster for group in summarise(made).groups} == {1}

    def test_kinds_that_mean_the_same_place_are_one_answer(self):
        """By another estimator or with other points of the parent, but to the same centre."""
        rng = np.random.default_rng(4)
        made = scattered(rng, 100, 0.01) + scattered(rng, 60, 0.01, method="SGDK")
        (group,) = summarise(made).groups
        assert (group.answers, group.method) == (160, "MGDK")

    def test_answers_of_few_samples_belong_to_the_nearest_mean(self):
        """Of few samples they lie anywhere, also right between the two."""
        rng = np.random.default_rng(5)
        one, two = (scattered(rng, 60, 0.01, (x, 0.0, 0.0)) for x in (0.0, 0.1))
        stray = [answer((x, 0.01, 0.0), 3) for x in (0.04, 0.06, -0.02, 0.13)]
        found = summarise(one + two + stray)
        a, b = found.cluster[0], found.cluster[60]
        assert a != b
        np.testing.assert_array_equal(found.cluster[120:], [a, b, a, b])

    def test_equal_answers_are_one_and_too_few_are_not_divided(self):
        place = np.tile([0.1, 0.2, 0.3], (40, 1))
        assert (clusters(place, np.arange(40.0), [0] * 40) == 0).all()
        two = np.array([[0.0, 0, 0], [0.0, 0, 0], [1.0, 0, 0], [1.0, 0, 0]])
        assert (clusters(two, np.ones(4), [0] * 4) == 0).all()

    def test_the_order_of_answers_is_nothing(self):
        rng = np.random.default_rng(6)
        made = scattered(rng, 70) + scattered(rng, 50, at=(0.1, 0.0, 0.0), frame="a b d")
        order = rng.permutation(120)
        found, other = summarise(made), summarise([made[i] for i in order])
        np.testing.assert_array_equal(found.cluster[order], other.cluster)
        # A mean summed in another order.
        np.testing.assert_allclose(found.deviation[order], other.deviation, rtol=0, atol=64 * EPS)

    def test_a_single_answer_has_no_deviation(self):
        (group,) = summarise([answer((0.1, 0.2, 0.3))]).groups
        assert np.isnan(group.deviation).all() and np.isnan(group.single).all()


@cache
def short_clip():
    """300 frames, every joint through its range."""
    return clip_of(short_recording())


@cache
def short_recording():
    motion = range_of_motion(10, 30, seed=1)
    return record(human(), marker_set("cmu"), motion, Faults(sigma=0.001), seed=1)


def places(answers):
    return np.array([(a.x, a.y, a.z) for a in answers])


class TestRefits:
    def test_nothing_left_out_is_the_plain_fit(self):
        fit = fit_recording(short_recording(), prior="none")
        found = refits(short_clip(), fit_clip, 3, [0], seed=9)
        assert [a.joint for a in found] == [joint.joint for joint in fit.joints]
        for a, joint in zip(found, fit.joints, strict=True):
            np.testing.assert_array_equal((a.x, a.y, a.z), joint.centre)
            assert (a.passed, a.level, a.frames, a.samples) == (3, 0, 300, 300)
            assert a.method == joint.method
            assert a.frame.split() == list(fit.segments[joint.parent].drawn_through)

    def test_a_draw_depends_on_seed_pass_and_level_only(self):
        clip = short_clip()
        both = refits(clip, fit_clip, 1, [50, 90], seed=4)
        assert refits(clip, fit_clip, 1, [90], seed=4) == both[14:]
        assert [a.frames for a in both] == [150] * 14 + [30] * 14
        for other in (refits(clip, fit_clip, 2, [90], 4), refits(clip, fit_clip, 1, [90], 5)):
            assert not np.array_equal(places(other), places(both[14:]))

    def test_frames_stay_in_order_and_none_comes_twice(self):
        seen = []

        def watch(part):
            seen.append(part)
            return fit_clip(part)

        refits(short_clip(), watch, 0, [40], seed=0)
        (part,) = seen
        where = [
            int(np.flatnonzero(short_clip().points[:, 0, 0] == x)[0]) for x in part.points[:, 0, 0]
        ]
        assert len(where) == 180
        assert (np.diff(where) > 0).all()

    def test_a_level_that_cannot_be_fitted_has_no_answers(self):
        """One frame of a hundred is left: no joint is to be found in it."""
        clip = replace(short_clip(), points=short_clip().points[:100])
        assert refits(clip, fit_clip, 0, [99], seed=0) == []
        assert {a.level for a in refits(clip, fit_clip, 0, [0, 99], seed=0)} == {0}

    def test_a_joint_without_an_answer_is_told_with_no_samples(self):
        points = short_clip().points.copy()
        points[:, short_clip().labels.index("RFIN")] = np.nan
        found = refits(replace(short_clip(), points=points), fit_clip, 0, [0], seed=0)
        (wrist,) = (a for a in found if a.joint == "RightWrist")
        assert wrist.samples == 0 and np.isnan((wrist.x, wrist.y, wrist.z)).all()

    def test_the_samples_are_those_of_a_marker_on_average(self):
        """The thigh's first marker is gone half of the time, the second shows the hip in every frame."""
        points = short_clip().points.copy()
        points[:150, short_clip().labels.index("RTHI")] = np.nan
        found = refits(replace(short_clip(), points=points), fit_clip, 0, [0], seed=0)
        (hip,) = (a for a in found if a.joint == "RightHip")
        assert hip.samples == 225

    def test_a_range_of_motion_clip_scatters_by_the_law(self, samples):
        slopes_are_those_of_the_law(read_clip(samples / "range_of_motion.c3d"))


def slopes_are_those_of_the_law(clip, levels=range(0, 100, 10), passes=2):
    """The clip's joints against answers that are drawn by the law itself, in the same plan.

    So few refits have a mean that is off, and with it all deviations: the slope that the law has in such a
    plan is measured, not -½. The joints of a refit share its frames; five branches at least (spine,
    arms, legs) are independent, so that the slope of all varies by that of one joint over √5.
    """
    rng, count = np.random.default_rng(0), 60
    drawn = [
        answer(np.sqrt(1 / n - 1 / clip.frames) * rng.normal(size=3), n, f"J{j}")
        for j in range(count)
        for _ in range(passes)
        for n in (clip.frames - round(clip.frames * level / 100) for level in levels)
    ]
    *each, expected = summarise(drawn).laws
    single = np.std([law.finite_slope for law in each])
    answers = [a for p in range(passes) for a in refits(clip, fit_clip, p, levels, seed=0)]
    found = summarise(answers)
    law = found.laws[-1]
    assert law.finite_slope == pytest.approx(expected.finite_slope, abs=4 * single / np.sqrt(5))
    assert law.slope < law.finite_slope < -0.2
    return found


@pytest.mark.real
def test_a_real_clip_scatters_by_the_law_within_a_centimetre(shared_clips):
    """The thesis's claim (6.1), on a clip of people climbing: most answers from over 200 samples."""
    found = slopes_are_those_of_the_law(read_clip(shared_clips / "cmu" / "01_01.c3d"))
    # Seen: 98 %.
    assert found.laws[-1].near >= 0.9


# --- the resampling study as a whole --------------------------------------------------------------


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    """The short recording as a file."""
    path = tmp_path_factory.mktemp("clips") / "short.c3d"
    write_c3d(short_recording(), path)
    return path


# As the command line has it.
JOB = Job(association=known("cmu"), prior="none")
SMALL = Resampling(passes=2, levels=2, seed=5)
PARTS = ["answers", "deviations", "means", "power_law"]


def there(folder):
    return sorted(p.name for p in folder.rglob("*") if p.is_file()) if folder.exists() else []


def rows_of(path):
    return list(csv.DictReader(io.StringIO(path.read_text())))


def contents(folder):
    return {p.name: p.read_bytes() for p in folder.iterdir()}


def study(clip, folder, plan=SMALL, job=JOB, **where):
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


class TestResampleStudy:
    def test_it_writes_its_four_tables(self, short, tmp_path):
        found = study(short, tmp_path / "out")
        assert there(tmp_path) == [f"short.resample.{part}.csv" for part in PARTS]
        assert [path.name for path in found.files] == [
            f"short.resample.{p}.csv" for p in PARTS[:1]
        ] + [f"short.resample.{p}.csv" for p in ("means", "deviations", "power_law")]
        for path in found.files:
            rows = rows_of(path)
            table = found.tables[path.name.split(".")[2]]
            assert len(rows) == len(table) and list(rows[0]) == list(table[0])
        assert len(found.tables["answers"]) == 2 * 2 * 14
        assert len(found.tables["power_law"]) == 15
        assert "seed 5" in found.words[0] and "300 frames" in found.words[0]

    def test_the_tables_of_means_and_deviations_are_those_of_the_answers(self, short, tmp_path):
        study(short, tmp_path)
        rows = rows_of(tmp_path / "short.resample.answers.csv")
        knee = np.array([[float(r[k]) for k in "xyz"] for r in rows if r["joint"] == "LeftKnee"])
        (mean,), (sd,) = (
            [
                r
                for r in rows_of(tmp_path / f"short.resample.{name}.csv")
                if r["joint"] == "LeftKnee"
            ]
            for name in ("means", "deviations")
        )
        # Nine digits.
        np.testing.assert_allclose(
            [float(mean[f"mean_{k}"]) for k in "xyz"], knee.mean(axis=0), rtol=1e-7
        )
        np.testing.assert_allclose(
            [float(sd[f"sd_{k}"]) for k in "xyz"], knee.std(axis=0, ddof=1), rtol=1e-4
        )
        assert [sd[f"sd_{k}"] for k in "xyz"] == [sd[f"sd_about_one_mean_{k}"] for k in "xyz"]

    def test_after_an_interruption_it_goes_on_where_it_was(self, short, tmp_path, monkeypatch):
        plan = replace(SMALL, passes=3)
        with monkeypatch.context() as patch:
            first = watch_refits(patch, stop=1, error=RuntimeError)
            with pytest.raises(RuntimeError):
                study(short, tmp_path / "a", plan)
        assert first == [(0, [0, 1])]
        # Nothing but what is put by, in a folder that nobody sees.
        (store,) = (tmp_path / "a").iterdir()
        assert store.name.startswith(".short.resample-")
        assert there(store) == ["pass0.json"]
        with monkeypatch.context() as patch:
            rest = watch_refits(patch)
            study(short, tmp_path / "a", plan)
        assert [passed for passed, _ in rest] == [1, 2]
        study(short, tmp_path / "b", plan)
        # As if nothing had happened, and nothing else is left.
        assert contents(tmp_path / "a") == contents(tmp_path / "b")

    def test_a_pass_of_several_tasks_is_kept_when_it_is_whole(self, short, tmp_path, monkeypatch):
        monkeypatch.setattr(studies, "_AT_ONCE", 2)
        plan, levels = Resampling(passes=2, levels=3, seed=0), [[0, 1], [2]]
        with monkeypatch.context() as patch:
            first = watch_refits(patch, stop=1)
            with pytest.raises(KeyboardInterrupt):
                study(short, tmp_path, plan)
        assert first == [(0, part) for part in levels]
        with monkeypatch.context() as patch:
            rest = watch_refits(patch)
            study(short, tmp_path, plan)
        assert rest == [(1, part) for part in levels]

    def test_another_study_does_not_take_what_is_put_by(self, short, tmp_path, monkeypatch):
        with monkeypatch.context() as patch:
            watch_refits(patch, stop=1)
            with pytest.raises(KeyboardInterrupt):
                study(short, tmp_path)
        (store,) = tmp_path.iterdir()
        for other in (
            {"plan": replace(SMALL, seed=6)},
            {"plan": replace(SMALL, levels=3)},
            {"job": replace(JOB, method="gdke")},
            {"job": replace(JOB, sigma=0.002)},
            {"job": replace(JOB, noise="matrix")},
            {"job": replace(JOB, pose="triad")},
            {"job": replace(JOB, unit="cm")},
        ):
            with monkeypatch.context() as patch:
                # Had it taken the first pass, it would be in the second, and not stop.
                watch_refits(patch, stop=0)
                with pytest.raises(KeyboardInterrupt):
                    study(short, tmp_path, **other)
        assert list(tmp_path.iterdir()) == [store]

    def test_a_damaged_pass_is_done_again(self, short, tmp_path, monkeypatch):
        with monkeypatch.context() as patch:
            watch_refits(patch, stop=1)
            with pytest.raises(KeyboardInterrupt):
                study(short, tmp_path / "a")
        (put_by,) = (tmp_path / "a").glob("*/pass0.json")
        put_by.write_text(put_by.read_text()[:100])
        with monkeypatch.context() as patch:
            done = watch_refits(patch)
            study(short, tmp_path / "a")
        assert [passed for passed, _ in done] == [0, 1]
        study(short, tmp_path / "b")
        assert contents(tmp_path / "a") == contents(tmp_path / "b")

    def test_a_study_of_fewer_passes_after_one_of_more_is_no_error(
        self, short, tmp_path, monkeypatch
    ):
        """Two of three passes are put by; the user is content with one."""
        with monkeypatch.context() as patch:
            watch_refits(patch, stop=2)
            with pytest.raises(KeyboardInterrupt):
                study(short, tmp_path, replace(SMALL, passes=3))
        found = study(short, tmp_path, replace(SMALL, passes=1))
        assert len(found.files) == 4

    def test_a_result_that_is_there_stops_it_before_any_work(self, short, tmp_path, monkeypatch):
        (tmp_path / "short.resample.means.csv").write_text("mine")
        done = watch_refits(monkeypatch)
        with pytest.raises(OutputError, match="exists already"):
            study(short, tmp_path)
        assert done == []
        assert contents(tmp_path) == {"short.resample.means.csv": b"mine"}
        study(short, tmp_path, overwrite=True)
        assert len(there(tmp_path)) == 4

    def test_a_folder_that_cannot_be_made_stops_it_before_any_work(
        self, short, tmp_path, monkeypatch
    ):
        (tmp_path / "out").write_text("a file")
        done = watch_refits(monkeypatch)
        with pytest.raises(OutputError, match="out"):
            study(short, tmp_path / "out")
        assert done == []
        assert contents(tmp_path) == {"out": b"a file"}

    def test_refits_that_fail_and_joints_without_a_marker_are_told(self, tmp_path, monkeypatch):
        def lossy(*call):
            return [a for a in refits(*call) if a.level != 1]

        monkeypatch.setattr(studies, "refits", lossy)
        points = short_clip().points.copy()
        points[:, short_clip().labels.index("RFIN")] = np.nan
        path = tmp_path / "few.c3d"
        write_c3d(replace(short_recording(), points=points), path)
        found = study(path, tmp_path / "out", Resampling(1, 3))
        assert "3 refits" in found.words[0] and "1 pass," in found.words[0]
        assert found.words[1] == "1 of them could not be fitted"
        shown = {row["joint"]: row["shown"] for row in found.tables["means"]}
        assert "RightWrist" not in shown and shown["LeftWrist"] == "yes"
        rows = [row for row in found.tables["answers"] if row["joint"] == "RightWrist"]
        empty = [(row["samples"], row["cluster"], row["deviation"]) for row in rows]
        assert empty == [(0, None, None)] * 2
        assert any("RightWrist" in note for note in found.notes)

    def test_a_clip_of_two_takes_a_subject_and_its_name(self, samples, tmp_path):
        clip = samples / "two_dancers.c3d"
        with pytest.raises(CallError, match="one subject") as error:
            study(clip, tmp_path)
        assert "Anna, Ben" in error.value.hint
        study(clip, tmp_path, Resampling(1, 1), replace(JOB, subject="Ben"))
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

        study(short, tmp_path, Resampling(2, 3), progress=progress)
        # Two tasks a pass.
        assert seen == [4, 4, 4, 4]


def test_one_worker_is_this_process_and_works_when_asked():
    done = []
    work = in_parallel(done.append, [1, 2, 3], 1)
    assert done == []
    next(work)
    assert done == [1]
    assert list(in_parallel(str, [3, 1, 2], 1)) == ["3", "1", "2"]
    assert list(in_parallel(str, [], None)) == []


# --- operations and points -------------------------------------------------------------------------


class TestFlops:
    def test_the_thesiss_figure_takes_708(self):
        assert figure_flops(14, 5) == 708

    def test_a_segments_system(self):
        assert [frame_flops(m) for m in (1, 2, 3, 4, 9)] == [54, 57, 39, 39, 39]

    def test_a_system_that_needs_its_parents_costs_that_too(self):
        assert frame_flops(2, parent=39) == 57 + 39
        assert frame_flops(1, parent=frame_flops(2, 39)) == 54 + 57 + 39
        assert frame_flops(3, parent=39) == 39

    def test_segments_of_two_markers_or_one_add_their_joint(self):
        for more in ({"two": 4}, {"one": 4}, {"two": 1, "one": 3}):
            assert figure_flops(14, 5, **more) == 708 + 4 * 18
        # (247) is (239) and a point.
        assert frame_flops(2) == frame_flops(3) + 18

    @pytest.mark.parametrize("markers", [0, -1])
    def test_no_marker_is_no_system(self, markers):
        with pytest.raises(ValueError, match="without a marker"):
            frame_flops(markers)


class TestCap:
    @pytest.mark.parametrize("degrees", [10, 90, 180])
    def test_points_lie_evenly_on_their_cap(self, degrees):
        count, angle = 20_000, np.radians(degrees)
        points = cap(np.random.default_rng(degrees), (2, count // 2), angle, 3.0).reshape(-1, 3)
        np.testing.assert_allclose(np.linalg.norm(points, axis=1), 3.0, rtol=8 * EPS)
        height = points[:, 2] / 3
        assert height.min() >= np.cos(angle) - 8 * EPS
        # Even on the sphere is even in height (Archimedes): mean and variance of a uniform number.
        low = np.cos(angle)
        spread = (1 - low) / np.sqrt(12)
        assert abs(height.mean() - (1 + low) / 2) <= 4 * spread / np.sqrt(count)
        # Its square varies by √(1/180) of the width's.
        allowed = 4 * (1 - low) ** 2 / np.sqrt(180 * count)
        assert abs(height.var() - spread**2) <= allowed
        across = points[:, :2].mean(axis=0) / 3
        assert np.abs(across).max() <= 4 * np.sqrt((1 - height**2).mean() / 2 / count)

    def test_a_seed_gives_the_same_points(self):
        one, two = (cap(np.random.default_rng(7), (5, 4), 1.0) for _ in range(2))
        np.testing.assert_array_equal(one, two)
        assert one.shape == (5, 4, 3)


# --- accuracy --------------------------------------------------------------------------------------

CHEAP = ("gdke", "ugdk", "pratt")
GRID = Plan(
    noises=(0.001, 0.01, 0.05, 0.1), angles=(20.0, 45.0, 80.0, 135.0, 180.0), count=400, trials=100,
    methods=CHEAP,
)  # fmt: skip


@cache
def grid():
    return {
        (s.method, s.noise, s.angle_deg): s
        for cell in GRID.cells
        for s in accuracy.score_cell(GRID, cell)
    }


def a_score(method, ratio, noise=0.01, angle=45.0, failed=0.0, criterion=True):
    return Score(method, noise, angle, 0.0, ratio * 0.1, 0.1, ratio, failed, criterion)


class TestAccuracy:
    def test_a_cell_depends_on_the_seed_and_itself_only(self):
        plan = replace(GRID, count=50, trials=5)
        again = score_cell(plan, (1, 2))
        assert again == score_cell(plan, (1, 2))
        assert again == score_cell(replace(plan, methods=(*CHEAP, "sgdk")), (1, 2))[:3]
        assert again == accuracy.score_cell(plan, plan.cells[1 * 5 + 2])
        for other in (score_cell(replace(plan, seed=1), (1, 2)), score_cell(plan, (1, 3))):
            assert [s.rmse for s in other] != [s.rmse for s in again]
        assert [s.method for s in again] == list(CHEAP)
        # Cells of the same noise and angle are drawn anew.
        twins = replace(plan, noises=(0.01, 0.01))
        assert [s.rmse for s in score_cell(twins, (0, 0))] != [
            s.rmse for s in score_cell(twins, (1, 0))
        ]

    def test_the_whole_plan_is_eight_noises_by_nine_angles(self):
        assert len(Plan().cells) == 72
        assert set(Plan().methods) < set(CONTENDERS)

    def test_the_criterion_is_the_thesiss(self):
        for (_, noise, degrees), found in grid().items():
            half = np.sin(np.radians(degrees) / 2)
            assert found.criterion == (noise < half**2 / np.sqrt(3))

    def test_ugdk_is_near_the_bound_wherever_the_criterion_is_met(self):
        met = [s for (method, _, _), s in grid().items() if method == "ugdk" and s.criterion]
        assert len(met) >= 15
        # A root mean square of 100 lengths that one direction decides is known to 1/√200.
        assert max(s.ratio for s in met) <= accuracy.BREAKS * (1 + 4 / np.sqrt(2 * GRID.trials))
        assert max(s.failed for s in met) == 0.0

    def test_nobody_beats_the_bound_on_a_whole_sphere_and_all_reach_it(self):
        for method in CHEAP:
            for noise in (0.001, 0.01):
                # Three directions alike: 1/√(2 × 3 × 100).
                allowed = 4 / np.sqrt(6 * GRID.trials)
                assert grid()[method, noise, 180.0].ratio == pytest.approx(1.0, abs=allowed)

    def test_gdke_is_drawn_to_the_data_where_they_cover_little(self):
        for noise, degrees in ((0.01, 20.0), (0.05, 45.0)):
            gdke, pratt = grid()["gdke", noise, degrees], grid()["pratt", noise, degrees]
            assert gdke.breaks and gdke.ratio > 3
            # The cap is about +z, so the pull is to +z, and it is nearly all of the error.
            assert 0.9 * gdke.rmse < gdke.bias <= gdke.rmse
            assert abs(pratt.bias) < 0.5 * gdke.bias

    def test_the_error_is_in_units_of_the_bound(self):
        for found in grid().values():
            assert found.ratio == pytest.approx(found.rmse / found.bound, rel=1e-12)
            assert found.breaks == (found.ratio > 1.5 or found.failed > 0.01)

    @pytest.mark.parametrize(
        ("found", "breaks"),
        [
            (a_score("gdke", 1.5), False),
            (a_score("gdke", 1.51), True),
            (a_score("gdke", 1.0, failed=0.02), True),
            (a_score("gdke", float("nan"), failed=1.0), True),
            # Half a radius off is no answer, whatever the bound is.
            (replace(a_score("gdke", 1.0), rmse=0.51), True),
        ],
    )
    def test_an_estimator_breaks_by_its_error_or_without_an_answer(self, found, breaks):
        assert found.breaks == breaks

    def test_verdicts_count_cells(self):
        scores = [
            a_score("gdke", 4.0), a_score("gdke", 9.0, 0.1, 20.0, criterion=False),
            a_score("gdke", 1.0, 0.01, 180.0),
            a_score("pratt", 1.0), a_score("pratt", 5.0, 0.1, 20.0, criterion=False),
            a_score("pratt", 1.1, 0.01, 180.0),
        ]  # fmt: skip
        gdke, pratt, against = accuracy.verdicts(scores)
        assert gdke.startswith("GDKE: ") and "2 of 3 cells" in gdke and "1 of the 2 that" in gdke
        assert pratt.startswith("Pratt: ") and "1 of 3 cells" in pratt and "0 of the 2" in pratt
        assert "Pratt beats GDKE" in against and "in 2 of 3 cells, 1 of them" in against
        assert "σ/r 0.01 at 45°" in against and "loses in 1 (σ/r 0.01 at 180°);" in against

    def test_verdicts_need_no_rivals(self):
        (only,) = accuracy.verdicts([a_score("ugdk", 1.0)])
        assert only.startswith("UGDK, true σ: ") and "0 of 1 cells" in only

    def test_no_answer_is_no_error_but_a_failure(self):
        """Sixteen points whose noise is larger than they spread: UGDK has no answer for many."""
        plan = Plan(noises=(0.5,), angles=(10.0,), count=16, trials=40, methods=("ugdk", "pratt"))
        ugdk, pratt = score_cell(plan, (0, 0))
        assert ugdk.failed > 0.1 and ugdk.breaks and not ugdk.criterion
        assert pratt.failed == 0.0


@pytest.fixture(scope="module")
def noise_scores():
    plan = Plan(count=400, trials=20)
    return {(s.angle_deg, s.spread, s.known): s for s in score_noise(plan)}


class TestNoiseStudy:
    def test_every_way_is_scored_in_every_cell(self, noise_scores):
        assert len(noise_scores) == 3 * 3 * 5
        known_by = {s.known for s in noise_scores.values() if s.matrix_error is not None}
        assert known_by == {
            "matrix from the radial residuals",
            "matrix from a rigid segment of five",
        }

    @pytest.mark.parametrize("spread", accuracy.SPREADS)
    def test_an_estimated_matrix_is_nearly_the_true_one_and_far_better_than_a_level(
        self, noise_scores, spread
    ):
        def rmse(how):
            return noise_scores[45.0, spread, how].rmse

        truth = rmse("the true matrix")
        # The same points, so that what chance does is the same: seen 1.03 and 1.3 at most, and 2.8 to 4.8.
        assert rmse("matrix from a rigid segment of five") <= 1.2 * truth
        assert rmse("matrix from the radial residuals") <= 1.6 * truth
        assert rmse("one level, the true one") >= 2 * truth

    def test_on_a_whole_sphere_the_noise_is_nothing_to_the_centre(self, noise_scores):
        for spread in accuracy.SPREADS:
            errors = [
                s.rmse
                for (angle, where, _), s in noise_scores.items()
                if (angle, where) == (180, spread)
            ]
            assert max(errors) / min(errors) < 1.05

    def test_a_rigid_segments_matrix_has_the_error_of_its_sample(self, noise_scores):
        for (_, spread, how), found in noise_scores.items():
            if how == "matrix from a rigid segment of five":
                truth = np.diag(np.square(spread))
                law = np.sqrt((np.trace(truth) ** 2 + np.trace(truth @ truth)) / (400 * (5 - 2)))
                law /= np.linalg.norm(truth)
                # Wishart; unfolding costs 1.1; 20 estimates of two numbers that count vary by 1/√80.
                assert 0.6 * law <= found.matrix_error <= (1.1 + 4 / np.sqrt(80)) * law

    @pytest.mark.parametrize("count", [10, 20])
    def test_a_segment_that_shows_no_matrix_in_so_few_frames_is_no_error(self, count):
        """The command takes 10 points and more; a matrix takes 20 frames, and outliers do not count."""
        found = score_noise(Plan(count=count, trials=8))
        assert len(found) == 3 * 3 * 5
        truth = [s.rmse for s in found if s.known == "the true matrix" and s.angle_deg == 180]
        assert np.isfinite(truth).all()

    def test_it_is_repeated_by_its_seed(self):
        plan = Plan(count=30, trials=2, seed=3)
        assert score_noise(plan) == score_noise(plan)
        assert score_noise(plan) != score_noise(replace(plan, seed=4))


@pytest.fixture(scope="module")
def ratios():
    plan = Plan(count=300, trials=200)
    return {(s.noises, s.angle_deg, s.how): s.ratio for s in score_markers(plan)}


class TestMarkersStudy:
    def test_weighted_by_what_is_estimated_it_is_at_the_bound(self, ratios):
        found = [
            r for (_, _, how), r in ratios.items() if how == "MGDK, estimated levels, weighted"
        ]
        assert len(found) == 9
        # The bound is for small noise; 200 trials know a ratio to 1/√400.
        assert max(found) <= 1.3
        assert min(found) >= 1 - 4 / np.sqrt(400)

    def test_one_level_for_both_is_far_from_it_where_the_noisy_marker_is_the_farther(self, ratios):
        for degrees in accuracy.MARKER_ANGLES:
            assert ratios[(0.005, 0.05), degrees, "MGDK, one level, alike"] > 3

    def test_of_two_alike_all_ways_are_alike(self, ratios):
        for degrees in (60.0, 120.0):
            assert (
                max(r for (n, a, _), r in ratios.items() if (n, a) == ((0.01, 0.01), degrees)) < 1.5
            )


# --- speed -----------------------------------------------------------------------------------------


def a_trial(points=20_000, noise=0.1, **seconds):
    every = dict.fromkeys(speed.METHODS, 1e-3) | seconds
    return speed.Trial(points, noise, 90.0, 1.0, every)


class TestSpeed:
    def test_what_is_drawn_is_repeated_and_in_the_thesiss_ranges(self, monkeypatch):
        monkeypatch.setattr(
            speed, "time_methods", lambda x, noise, methods: dict.fromkeys(methods, float(x.sum()))
        )
        first = list(speed.trials(40, 1000, seed=3))
        assert first == list(speed.trials(40, 1000, seed=3))
        assert first != list(speed.trials(40, 1000, seed=4))
        assert first[:5] == list(speed.trials(5, 1000, seed=3))
        assert all(10 <= t.points <= 1000 for t in first)
        assert all(1e-11 <= t.noise <= 1e12 for t in first)
        assert all(0 <= t.angle_deg <= 180 and 0 < t.radius <= 37 for t in first)
        # Even in the logarithm: half of 40 below the middle, with four standard deviations of √10.
        for values, middle in (
            ([t.points for t in first], 100),
            ([t.noise for t in first], 10**0.5),
        ):
            assert abs(sum(v < middle for v in values) - 20) <= 4 * np.sqrt(10)

    def test_every_estimator_is_timed_on_points_from_anywhere(self):
        """Noise of up to 10¹² m included: nobody may warn or break."""
        found = list(speed.trials(4, 100, seed=1))
        for trial in found:
            assert tuple(trial.seconds) == speed.METHODS
            assert all(0 < s < 10 for s in trial.seconds.values())

    def test_ratios_are_medians_and_quartiles_of_times_by_gdkes(self):
        done = [a_trial(20_000 + k, gdke=0.001, lls=0.001 * k) for k in (1, 2, 3, 4, 10)]
        found = {ratio.method: ratio for ratio in speed.ratios(done)}
        lls = found["lls"]
        assert (lls.lower, lls.median, lls.upper) == pytest.approx((2, 3, 4))
        assert (found["gdke"].lower, found["gdke"].median, found["gdke"].upper) == (1, 1, 1)

    def test_only_sets_of_many_points_count_unless_there_are_none(self):
        few = [a_trial(100 + k, lls=0.1) for k in range(9)]
        many = [a_trial(200_000, lls=0.005)]
        found = {ratio.method: ratio.median for ratio in speed.ratios(few + many)}
        assert found["lls"] == pytest.approx(5)
        found = {ratio.method: ratio.median for ratio in speed.ratios(few)}
        assert found["lls"] == pytest.approx(100)

    def test_what_many_is_depends_on_what_there_is(self):
        few, many = [a_trial(100), a_trial(300)], [a_trial(200_000)]
        assert speed.threshold(few + many) == speed.MANY == 200_000
        assert speed.threshold(few) == 100

    def test_a_sample_at_a_time_has_a_time(self):
        assert 0 < speed.time_of_a_sample(200) < 0.1

    def test_small_noise_is_below_one(self):
        done = [a_trial(20_000, 0.99, mle=0.07), a_trial(30_000, 1.0, mle=0.5)]
        found = {ratio.method: ratio.small_noise for ratio in speed.ratios(done)}
        assert found["mle"] == pytest.approx(70)
        loud = {ratio.method: ratio.small_noise for ratio in speed.ratios(done[1:])}
        assert np.isnan(loud["mle"])

    def test_the_power_is_that_of_the_points(self):
        done = [a_trial(n, lls=n * 1e-6, mle=n**1.5 * 1e-6) for n in (200_000, 400_000, 900_000)]
        found = {ratio.method: ratio.power for ratio in speed.ratios(done)}
        assert found["lls"] == pytest.approx(1.0)
        assert found["mle"] == pytest.approx(1.5)
        assert found["gdke"] == pytest.approx(0.0, abs=1e-9)
        assert np.isnan(speed.ratios(done[:1])[0].power)

    def test_sets_of_the_same_size_have_no_power(self):
        """Two of a hundred points at most are that now and then."""
        assert all(np.isnan(ratio.power) for ratio in speed.ratios([a_trial(43), a_trial(43)]))

    def test_the_thesiss_ratios_stand_beside_them(self):
        found = {ratio.method: ratio.thesis for ratio in speed.ratios([a_trial()])}
        assert found == dict.fromkeys(speed.METHODS) | {
            "lls": 11.05, "igdk": 2.17, "mle_from_mean": 80.0
        }  # fmt: skip
        assert tuple(found) == speed.METHODS

    def test_ratios_of_few_points_are_not_called_those_of_many(self, tmp_path):
        """`study speed --most-points 100` has no set of 10,000 points to take ratios over."""
        found = studies.run_speed(2, 100, 1, Where(tmp_path, figures=False))
        assert len(found.tables["ratios"]) == len(speed.METHODS)
        assert "10,000 points or more" not in " ".join(found.words)


def test_a_contender_has_a_centre_for_every_set_or_nan():
    rng = np.random.default_rng(8)
    points = cap(rng, (3, 60), 1.5) + [0.0, 0.0, 2.0]
    points[1, :, 2] = 1.0
    points[1, :, :2] *= 0.0
    for key, contender in CONTENDERS.items():
        if key in ("mle_from_mean", "sgdk"):
            continue
        centres = contender.centres(points, 0.0)
        assert centres.shape == (3, 3), key
        np.testing.assert_allclose(centres[[0, 2]], [[0, 0, 2]] * 2, rtol=0, atol=1e-9)
        assert np.isnan(centres[1]).all(), key


# --- table 4 ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def rows():
    return {row.name: row for row in table4.methods(seed=1, trials=20)}


class TestTable4:
    def test_it_has_the_thesiss_seven_and_pratt(self, rows):
        assert set(rows) == {"MLE", "LLS", "GDKE", "UGDK", "SGDK", "MGDK", "IGDK", "Pratt"}
        assert all(row.for_it and row.against_it for row in rows.values())
        flops = {name: row.flops for name, row in rows.items() if row.flops}
        assert flops == {"LLS": 236, "GDKE": 26, "UGDK": 26, "MGDK": 26, "IGDK": 123}

    def test_times_are_by_gdkes(self, rows):
        assert rows["GDKE"].time == 1.0
        # What takes hundreds of milliseconds against one or two is slower on any machine.
        assert rows["MLE"].time > 3 and rows["LLS"].time > 2

    def test_errors_are_by_the_bound(self, rows):
        for row in rows.values():
            whole, cap45, cap20 = row.errors
            # 20 trials in three directions: 1/√120, four of which are allowed.
            assert whole == pytest.approx(1.0, abs=4 / np.sqrt(120))
            # LLS is GDKE: nothing is better than what the bound allows by chance.
            assert min(cap45, cap20) > 1 - 4 / np.sqrt(2 * 20)
        for name in ("MLE", "Pratt"):
            assert rows[name].errors[2] < 1.5 * (1 + 4 / np.sqrt(2 * 20))
        assert rows["GDKE"].errors[2] == pytest.approx(rows["LLS"].errors[2], rel=1e-6)
        assert rows["GDKE"].errors[2] > 5

    def test_lls_loses_digits_far_from_the_origin(self, rows):
        assert rows["LLS"].digits > 100 * rows["GDKE"].digits
        # A centimetre-wide cap's rounding at ten metres: 2⁻⁵³ × 10 m / 0.1 m, times r²/λ_min = 48.
        assert all(row.digits < 48 * 100 * EPS for name, row in rows.items() if name != "LLS")


# --- tables, files, libraries ----------------------------------------------------------------------


class TestTables:
    def test_rows_as_csv_have_nine_digits_and_empty_cells_for_what_is_not_known(self):
        rows = [
            {"name": "a, b", "x": 0.1 + 0.2, "y": None, "n": 3},
            {"name": "", "x": float("nan"), "y": 1e-300, "n": 10**12},
        ]
        assert rows_csv(rows) == 'name,x,y,n\n"a, b",0.3,,3\n,,1e-300,1000000000000\n'

    def test_numpys_numbers_are_numbers_too(self):
        text = rows_csv([{"x": np.float64(1) / 3, "y": np.float64("nan"), "z": np.int64(2)}])
        assert text == "x,y,z\n0.333333333,,2\n"

    def test_rows_for_the_terminal_are_set_out_in_columns(self):
        rows = [
            {"joint": "Hip", "sd_x": 0.00012345678, "n": 4, "thesis": None},
            {"joint": "LeftKnee", "sd_x": float("nan"), "n": 12, "thesis": 2.0},
        ]
        assert rows_table(rows).splitlines() == [
            "joint          sd x   n  thesis",
            "Hip       0.0001235   4       -",
            "LeftKnee          -  12       2",
        ]

    def test_every_table_is_plain_numbers_and_words(self):
        rng = np.random.default_rng(9)
        found = summarise(scattered(rng, 20) + scattered(rng, 20, at=(0.3, 0, 0), frame="x y z"))
        trials = [a_trial(), a_trial(50_000)]
        every = [
            tables.answer_rows(found, found.answers), tables.mean_rows(found.groups, {}),
            tables.deviation_rows(found.groups), tables.law_rows(found.laws, {}),
            tables.trial_rows(trials), tables.ratio_rows(speed.ratios(trials)),
            tables.score_rows([a_score("gdke", 2.0)]),
            tables.noise_rows(score_noise(Plan(count=30, trials=2))[:2]),
            tables.marker_rows(score_markers(Plan(count=30, trials=2))[:2]),
        ]  # fmt: skip
        for rows in every:
            assert rows
            assert json.loads(json.dumps(rows)) == rows or "NaN" in json.dumps(rows)
            assert len({tuple(row) for row in rows}) == 1
            read = list(csv.DictReader(io.StringIO(rows_csv(rows))))
            assert [list(row) for row in read] == [list(row) for row in rows]

    def test_an_answers_row_tells_its_cluster_and_its_deviation(self):
        found = summarise(mirrored([100, 400], lambda n: 0.2 / n))
        rows = tables.answer_rows(found, found.answers)
        assert list(rows[0])[:4] == ["pass", "level", "frames", "joint"]
        assert [row["cluster"] for row in rows] == [1] * 4
        np.testing.assert_allclose([row["deviation"] for row in rows], [0.002] * 2 + [0.0005] * 2)

    def test_scores_go_by_the_names_of_the_estimators(self):
        (row,) = tables.score_rows([a_score("ugdk_fixed_point", 2.0)])
        assert row["method"] == "UGDK, σ by fixed point" and row["breaks"] is True
        (row, *_) = tables.noise_rows(
            [accuracy.NoiseScore(45.0, (1.0, 2.0, 3.0), "x", None, 0.0, 1.0, 0.0)]
        )
        assert (row["sigma_x"], row["sigma_y"], row["sigma_z"]) == (1.0, 2.0, 3.0)


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


class TestExtras:
    def test_a_library_that_is_there_is_given(self):
        assert extra("json", "any") is json

    def test_one_that_is_not_is_an_error_with_the_command_that_installs_it(self, monkeypatch):
        monkeypatch.setitem(sys.modules, "scipy.optimize", None)
        with pytest.raises(MissingExtraError, match="needs scipy, which is not installed") as error:
            extra("scipy.optimize", "mle")
        assert error.value.hint == "pip install 'mocap-skel[mle]'"

    def test_figures_are_refused_before_any_work(self, monkeypatch, tmp_path):
        monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
        with pytest.raises(MissingExtraError, match="matplotlib"):
            Where(tmp_path).names("x", [], ["y"])
        assert Where(tmp_path, figures=False).names("x", [], ["y"]) == {}


# --- figures ---------------------------------------------------------------------------------------


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
            crosses = [line for line in axes.lines if line.get_marker() == "x"]
            assert len(crosses) == sum(s.breaks for s in scores if s.method == method)
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


# --- the other two studies as a whole ----------------------------------------------------------------


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

"""The whole way of one clip, as the commands go it."""

import pytest
from commands import files
from recordings import clip_of, fit_clip, fit_sample

from mocap_skel import read_association, read_clip
from mocap_skel.artificial import Faults, human, marker_set, merge, range_of_motion, record
from mocap_skel.errors import ExportError, MocapSkelError, OutputError
from mocap_skel.export.registry import choose
from mocap_skel.export.tables_csv import skeleton_csv
from mocap_skel.pipeline.clip_files import process
from mocap_skel.pipeline.job import Job


class TestProcess:
    def job(self, folder, **options):
        return Job(read_association("cmu"), folder=folder, **options)

    def test_files_are_named_after_the_clip_and_the_subject(self, samples, tmp_path):
        done = process(
            samples / "two_dancers.c3d", self.job(tmp_path, formats=choose(["csv", "bvh"]))
        )
        assert files(tmp_path) == sorted(
            f"two_dancers.{who}{suffix}"
            for who in ("Anna", "Ben")
            for suffix in (".skeleton.csv", ".joints.csv", ".bvh")
        )
        assert set(done.files) == set(tmp_path.iterdir())
        assert [fit.subject for fit in done.fits] == ["Anna", "Ben"]
        for path, text in done.files.items():
            assert path.read_text() == str(text)
        anna = (tmp_path / "two_dancers.Anna.skeleton.csv").read_text()
        assert anna == str(skeleton_csv(fit_sample("two_dancers", "Anna")))

    def test_without_a_folder_nothing_is_written(self, samples, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        done = process(samples / "nearly_still.c3d", self.job(None))
        assert [path.name for path in done.files] == [
            "nearly_still.skeleton.csv", "nearly_still.joints.csv"
        ]  # fmt: skip
        assert files(tmp_path) == []

    def test_a_format_that_cannot_hold_the_clip_does_not_keep_the_others(
        self, samples, tmp_path, monkeypatch
    ):
        def refused(*_):
            raise ExportError("no such thing in a BVH")

        monkeypatch.setattr("mocap_skel.export.formats.bvh.rigs_of", refused)
        job = Job(read_association("cmu"), choose(["csv", "bvh"]), tmp_path)
        done = process(samples / "nearly_still.c3d", job)
        assert [error.message for error in done.failed] == ["no such thing in a BVH"]
        assert files(tmp_path) == ["nearly_still.joints.csv", "nearly_still.skeleton.csv"]
        alone = Job(read_association("cmu"), choose("bvh"), tmp_path / "alone")
        with pytest.raises(ExportError, match="no such thing"):
            process(samples / "nearly_still.c3d", alone)
        assert not (tmp_path / "alone").exists()

    def test_an_existing_result_is_refused_and_stays(self, samples, tmp_path):
        (tmp_path / "nearly_still.joints.csv").write_text("mine")
        with pytest.raises(OutputError, match="exists already"):
            process(samples / "nearly_still.c3d", self.job(tmp_path))
        assert files(tmp_path) == ["nearly_still.joints.csv"]
        assert (tmp_path / "nearly_still.joints.csv").read_text() == "mine"
        process(samples / "nearly_still.c3d", self.job(tmp_path, overwrite=True))
        assert files(tmp_path) == ["nearly_still.joints.csv", "nearly_still.skeleton.csv"]
        assert (tmp_path / "nearly_still.joints.csv").read_text().startswith("joint,")

    def test_a_clip_that_is_not_there_is_one_clear_error(self, tmp_path):
        with pytest.raises(MocapSkelError, match="No such file"):
            process(tmp_path / "clip.c3d", self.job(tmp_path))
        assert files(tmp_path) == []

    def test_subjects_whose_safe_names_agree_do_not_overwrite_each_other(
        self, tmp_path, monkeypatch
    ):
        from mocap_skel.pipeline import job

        one = record(
            human(), marker_set("cmu"), range_of_motion(2, 30, seed=1), Faults(sigma=0.001), seed=1
        )
        clip = clip_of(merge({"A/B": one, "A B": one}))
        monkeypatch.setattr(job, "read_clip", lambda *args, **options: clip)
        with pytest.raises(MocapSkelError, match="A_B"):
            process(tmp_path / "x.c3d", self.job(tmp_path))
        assert files(tmp_path) == []
        done = process(tmp_path / "x.c3d", self.job(tmp_path, subject="A/B"))
        assert {path.parent for path in done.files} == {tmp_path}
        assert files(tmp_path) == ["x.A_B.joints.csv", "x.A_B.skeleton.csv"]

    def test_a_clip_of_one_subject_is_not_named_after_it(self, tmp_path, monkeypatch):
        from mocap_skel.pipeline import job

        one = record(
            human(), marker_set("cmu"), range_of_motion(2, 30, seed=1), Faults(sigma=0.001), seed=1
        )
        monkeypatch.setattr(job, "read_clip", lambda *_, **__: clip_of(merge({"Anna": one})))
        (fit,) = process(tmp_path / "x.c3d", self.job(tmp_path)).fits
        assert fit.subject == "Anna"
        assert files(tmp_path) == ["x.joints.csv", "x.skeleton.csv"]

    def test_options_reach_the_fit(self, samples, tmp_path):
        path = samples / "nearly_still.c3d"
        done = process(path, self.job(tmp_path, sigma=0.002, pose="triad", rate=30.0))
        (fit,) = done.fits
        assert (fit.sigma, fit.rate) == (0.002, 30.0)
        again = fit_clip(read_clip(path, rate=30.0), sigma=0.002, pose="triad")
        assert str(done.files[tmp_path / "nearly_still.skeleton.csv"]) == str(skeleton_csv(again))

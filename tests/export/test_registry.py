"""A result format is one module: it registers itself, and call, help and Python take its options from there."""

import json
import re
from dataclasses import dataclass, fields
from textwrap import dedent

import pytest
from commands import STILL, files, program
from recordings import ROOT, fit_sample, rendered

from mocap_skel import read_clip, write_fit
from mocap_skel.cli.fit import command
from mocap_skel.errors import CallError, OutputError
from mocap_skel.export.registry import (
    Format,
    Options,
    Rendered,
    choose,
    formats,
    option,
    owners,
    register,
)

# All that a new format is.
TOY = '''
"""Toy: how many joints a fit has, in so many words."""

from __future__ import annotations

from dataclasses import dataclass

from mocap_skel.errors import ExportError
from mocap_skel.export.registry import Options, Rendered, option, register


@dataclass(frozen=True)
class ToyOptions(Options):
    greeting: str = option("hello", "how it greets.", choices=("hello", "goodbye"))
    times: int = option(1, "how often.", parse=int, metavar="N")
    loud: bool = option(False, "in capitals.")


@register(
    "toy",
    suffixes=(".toy.txt",),
    options=ToyOptions,
    makes="walk.toy.txt, a greeting",
    lacks="a toy has no place for a joint",
)
def write(fit, options, source):
    if options.times == 13:
        raise ExportError(f"{source.path}: a toy is not written 13 times", "try 12")
    text = options.times * f"{options.greeting} from {len(fit.joints)} joints of {source.clip.up}\\n"
    return Rendered({".toy.txt": text.upper() if options.loud else text}, ("toys are no results",))
'''


def beside_the_others(text, folder):
    """`mocap-skel fit` where a module lies beside the other formats."""
    more = folder / "more"
    more.mkdir()
    (more / "toy.py").write_text(text)
    start = f"import mocap_skel.export.formats as f\nf.__path__.append({str(more)!r})"
    return lambda *arguments: program(start, "fit", *arguments, cwd=folder)


@pytest.fixture
def fit_with_toy(tmp_path):
    return beside_the_others(TOY, tmp_path)


def test_the_example_of_the_architecture_page_is_all_that_a_format_is(tmp_path):
    page = (ROOT / "docs" / "architecture.md").read_text()
    part = page[page.index("## Adding a format") : page.index("## Conventions")]
    lines = [line for line in part.splitlines() if line.startswith("    ") or not line]
    fit = beside_the_others(dedent("\n".join(lines)), tmp_path)
    done = fit(STILL, "-a", "cmu", "-f", "greeting", "--loud", "-o", "-")
    assert done.stdout == "HELLO FROM 14 JOINTS\n"


class TestToy:
    def test_its_options_reach_it_and_its_notes_the_user(self, fit_with_toy, tmp_path):
        call = ("-a", "cmu", "-f", "toy", "--greeting", "goodbye", "--times", "2", "--loud")
        done = fit_with_toy(STILL, *call, "-o", "out")
        assert done.returncode == 0
        assert files(tmp_path / "out") == ["nearly_still.toy.txt"]
        text = (tmp_path / "out" / "nearly_still.toy.txt").read_text()
        assert text == 2 * "GOODBYE FROM 14 JOINTS OF Z\n"
        assert "toys are no results" in done.stderr

    def test_without_options_it_has_its_defaults_and_goes_to_standard_output(self, fit_with_toy):
        done = fit_with_toy(STILL, "-a", "cmu", "-f", "toy", "-o", "-", "-q")
        assert (done.returncode, done.stdout) == (0, "hello from 14 joints of z\n")

    def test_the_help_has_it(self, fit_with_toy):
        printed = " ".join(fit_with_toy("--help").stdout.split())
        assert "[csv|about|angles|bvh|c3d|events|glb|mot|osim|parquet|sto|toy|trc]" in printed
        assert "toy makes walk.toy.txt, a greeting;" in printed
        for said in (
            "--greeting [hello|goodbye] toy: how it greets. [default: hello]",
            "--times N toy: how often. [default: 1]",
            "--loud toy: in capitals.",
        ):
            assert said in printed

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (("--greeting", "hi"), "'hi' is not one of"),
            (("--times", "two"), "invalid literal for int()"),
            (("--times", "13"), "nearly_still.c3d: a toy is not written 13 times (try 12)"),
        ],
    )
    def test_what_it_cannot_take_is_one_clear_message(self, fit_with_toy, arguments, words):
        done = fit_with_toy(STILL, "-a", "cmu", "-f", "toy", *arguments)
        assert done.returncode in (2, 3) and words in done.stderr and not done.stdout

    def test_an_option_of_a_format_that_is_not_asked_for_has_no_effect(self, fit_with_toy):
        plain, other = (
            fit_with_toy(STILL, "-a", "cmu", "-f", "toy", "-o", "-", *more)
            for more in ((), ("--trim", "--axes", "--up", "x", "--scale", "m"))
        )
        assert plain.stdout == other.stdout and other.returncode == 0


class TestRegister:
    def test_two_formats_cannot_have_one_name(self):
        with pytest.raises(ValueError, match="two formats 'csv'"):
            register("csv", suffixes=(), options=Options, makes="", lacks="")(
                lambda *_: Rendered({})
            )
        assert formats()["csv"].suffixes == (".skeleton.csv", ".joints.csv")

    def test_formats_that_share_an_option_say_the_same_of_it(self):
        for name, has in owners():
            assert len({one.told[name].help for one in has.values()}) == 1, name
            assert len({one.told[name].choices for one in has.values()}) == 1, name

    def test_every_field_of_every_format_is_an_option_of_the_command(self):
        offered = {o.name for o in command.params}
        for one in formats().values():
            assert offered >= {f.name for f in fields(one.options)}

    @pytest.mark.parametrize("name", formats())
    def test_the_files_have_the_suffixes_that_it_registered(self, name):
        made = rendered(name, fit_sample("nearly_still"), read_clip(STILL), STILL)
        assert tuple(made.files) == formats()[name].suffixes

    @pytest.mark.parametrize("name", formats())
    def test_the_page_of_formats_says_what_each_cannot_hold(self, name):
        page = (ROOT / "docs" / "formats.md").read_text()
        row = next(line for line in page.splitlines() if line.startswith(f"- `{name}`: "))
        assert row == f"- `{name}`: {formats()[name].lacks}."
        assert re.fullmatch(r"a \w.*[^.]", formats()[name].lacks)

    def test_a_missing_library_is_told_with_its_extra(self):
        @dataclass(frozen=True)
        class Nothing(Options):
            pass

        bare = Format("x", (), Nothing, "", "", lambda *_: Rendered({}))
        bare.check_installed()
        needy = Format("x", (), Nothing, "", "", lambda *_: Rendered({}), ("no_such_library", "x"))
        with pytest.raises(CallError, match="no_such_library") as caught:
            needy.check_installed()
        assert "mocap-skel[x]" in caught.value.hint


class TestChoose:
    def test_each_format_gets_its_own_options_and_no_other(self):
        c3d, csv = choose(["c3d", "csv", "c3d"], axes=True, up="x")
        assert (c3d.format.name, csv.format.name) == ("c3d", "csv")
        assert c3d.options.axes and c3d.options.up == csv.options.up == "x"
        assert not hasattr(csv.options, "axes")

    def test_none_is_the_same_as_not_told(self):
        (bvh,) = choose("bvh", up=None)
        assert bvh.options.up == "y"

    @pytest.mark.parametrize(
        ("names", "told", "error", "words"),
        [
            ("cvs", {}, ValueError, "formats must be of .*'csv', 'about', 'angles'.* got 'cvs'"),
            (
                "csv",
                {"axes": True},
                TypeError,
                "'axes' here: csv takes up, rigid, max_gap, smooth, rig$",
            ),
            (
                ["csv", "c3d"],
                {"trim": 1},
                TypeError,
                "'trim' here: csv takes up, rigid, .*; c3d takes up, rigid, .*, axes",
            ),
            ("bvh", {"up": "w"}, ValueError, r"up must be one of \('x', 'y', 'z'\), got 'w'"),
            ("bvh", {"names": "maya"}, ValueError, "names must be one of .*'mixamo'.*'maya'"),
        ],
    )
    def test_what_no_format_knows_is_refused_with_what_they_do_know(
        self, names, told, error, words
    ):
        with pytest.raises(error, match=words):
            choose(names, **told)

    def test_a_new_option_is_a_field_with_its_help(self):
        @dataclass(frozen=True)
        class Own(Options):
            depth: int = option(3, "how deep.", parse=int)

        assert Own().depth == 3
        said = Format("x", (), Own, "", "", lambda *_: Rendered({})).told["depth"]
        assert (said.help, said.parse, said.choices) == ("how deep.", int, ())


class TestWriteFit:
    def test_it_writes_what_the_call_writes(self, tmp_path):
        from recordings import known

        from mocap_skel.pipeline.clip_files import process
        from mocap_skel.pipeline.job import Job

        clip = read_clip(STILL)
        paths = write_fit(
            fit_sample("nearly_still"),
            clip,
            tmp_path / "a",
            ["csv", "trc", "c3d"],
            up="x",
            axes=True,
        )
        job = Job(known("cmu"), choose(["csv", "trc", "c3d"], up="x", axes=True), tmp_path / "b")
        done = process(STILL, job)
        assert [p.name for p in paths] == [p.name for p in done.files]
        assert [p.parent for p in paths] == 4 * [tmp_path / "a"]
        for path, content in done.files.items():
            there = (tmp_path / "a" / path.name).read_bytes()
            assert there == (content if isinstance(content, bytes) else str(content).encode())

    def test_an_unknown_format_or_option_writes_nothing(self, tmp_path):
        clip, fit = read_clip(STILL), fit_sample("nearly_still")
        for call, error in (
            ({"formats": ["csv", "fbx"]}, ValueError),
            ({"formats": "csv", "trim": True}, TypeError),
        ):
            with pytest.raises(error):
                write_fit(fit, clip, tmp_path, **call)
        assert files(tmp_path) == []

    def test_the_clip_stays_and_so_does_what_is_there(self, tmp_path):
        source = tmp_path / "walk.c3d"
        source.write_bytes(STILL.read_bytes())
        (tmp_path / "walk.skeleton.c3d").hardlink_to(source)
        clip = read_clip(source)
        with pytest.raises(OutputError, match="is an input"):
            write_fit(fit_sample("nearly_still"), clip, tmp_path, "c3d", overwrite=True)
        assert source.read_bytes() == STILL.read_bytes()
        (tmp_path / "walk.joints.csv").write_text("mine")
        with pytest.raises(OutputError, match="exists already"):
            write_fit(fit_sample("nearly_still"), clip, tmp_path)
        write_fit(fit_sample("nearly_still"), clip, tmp_path, overwrite=True)
        assert (tmp_path / "walk.joints.csv").read_text().startswith("joint,")


def test_json_of_a_call_is_as_before_whatever_the_format(fit_with_toy):
    done = fit_with_toy(STILL, "-a", "cmu", "-f", "toy", "--json", "-q")
    assert len([json.loads(line) for line in done.stdout.splitlines()]) == 14

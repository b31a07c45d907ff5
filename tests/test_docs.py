"""The documentation is true: its commands run and print what it shows, its programs run, its lists are whole."""

import os
import re
import shutil
import subprocess
import sys

import pytest
from command_pages import PAGES as COMMAND_PAGES
from command_pages import default, metavar, pages
from doc_blocks import PAGES, python_of, rewritten, run_page, run_text
from recordings import ROOT, SAMPLES

import mocap_skel
from mocap_skel.cli import COMMANDS, group
from mocap_skel.export.registry import formats as known_formats
from mocap_skel.figure.skeleton import SHIPPED

# Words of the README, tables and code blocks too: a newcomer reads it whole.
LONGEST_README = 900


@pytest.mark.parametrize("page", PAGES)
def test_the_console_blocks_of_a_page_are_true(page, tmp_path):
    """Every `$ …` line prints what the page shows below it, and ends as the page shows."""
    shown = run_page(page, tmp_path)
    assert len(shown) == len(re.findall(r"^\$ ", (ROOT / page).read_text(), re.M))
    for each in shown:
        assert "Traceback" not in "\n".join(each.got)
        assert each.got == each.expected, each.line
        assert each.ends_as_shown, (each.line, each.code)


# Command, what the page shows of it, and whether it ends as a page without `echo $?` says: with 0.
LINES = [
    ("cat nothing_there | tail -n 1", "", False),
    ("cat nothing_there | grep -c x | tail -n 1", "", False),
    ("mocap-skel fit nothing_there.c3d --assoc cmu 2> why | cut -c 1-9", "", False),
    ("cut -c 1-36 why", "mocap-skel: error: nothing_there.c3d", True),
    ("yes | head -n 1 || test $? -eq 141", "y", True),
    ("echo no", "yes", True),
]


def test_the_runner_sees_what_fails_inside_a_pipe(tmp_path):
    text = "".join(f"$ {line}\n{shown}\n" if shown else f"$ {line}\n" for line, shown, _ in LINES)
    shown = run_text(f"```console\n{text}```", tmp_path)
    assert [each.line for each in shown] == [line for line, _, _ in LINES]
    assert [each.ends_as_shown for each in shown] == [good for _, _, good in LINES]
    assert [each.got == each.expected for each in shown] == [False, False, True, True, True, False]


def test_the_runner_lets_a_command_fail_only_where_the_page_says_so(tmp_path):
    text = (
        "```console\n$ false | cat\n$ echo $?\n1\n$ false | cat\n```\n```console\n$ echo $?\n0\n```"
    )
    shown = run_text(text, tmp_path)
    assert [(each.code, each.ends_as_shown, each.got) for each in shown] == [
        (1, True, []), (0, True, ["1"]), (1, False, []), (0, True, ["0"]),
    ]  # fmt: skip


def test_a_page_is_written_again_with_what_its_commands_print(tmp_path):
    page = "a\n```console\n$ echo one\n$ echo one two\n1 2\n```\nb `$ echo` c\n```console\n$ true\n```\n"
    want = page.replace("echo one\n$", "echo one\none\n$").replace("\n1 2\n", "\none two\n")
    assert rewritten(page, run_text(page, tmp_path)) == want


def test_the_readme_is_short():
    assert len((ROOT / "README.md").read_text().split()) < LONGEST_README


def test_the_python_of_its_page_runs(tmp_path):
    shutil.copy(SAMPLES / "range_of_motion.c3d", tmp_path / "walk.c3d")
    program = python_of("docs/python.md")
    assert "from mocap_skel import" in program
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        cwd=tmp_path, capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[0] == "Waist yes"
    assert (tmp_path / "out" / "walk.bvh").exists()


def test_the_shipped_figures_are_on_their_page():
    text = (ROOT / "docs" / "skeletons.md").read_text()
    for path in SHIPPED.glob("*.toml"):
        assert f"`{path.stem}`" in text
    for name, content in re.findall(r"```toml (\S+)\n(.*?)```", text, re.S):
        if name != "typo.toml":
            assert f'name = "{name.removesuffix(".toml")}"' in content


def test_every_command_has_its_page_and_that_is_its_help():
    there = {path.name: path.read_text() for path in COMMAND_PAGES.glob("*.md")}
    assert there == pages(), "make docs writes them again"
    assert set(there) == {f"{name}.md" for name in COMMANDS}


def together(text):
    return "".join(text.split())


def leaves(command, path):
    if not hasattr(command, "list_commands"):
        return [(path, command)]
    found = []
    for name in command.list_commands(None):
        found += leaves(command.get_command(None, name), (*path, name))
    return found


@pytest.mark.parametrize(
    ("path", "command"),
    leaves(group, ()),
    ids=lambda v: " ".join(v) if isinstance(v, tuple) else "",
)
def test_a_page_says_what_help_prints(path, command, capsys):
    with pytest.raises(SystemExit):
        group.main([*path, "--help"], "mocap-skel", terminal_width=90)
    # Lines are broken at hyphens as well.
    printed = together(capsys.readouterr().out)
    page = (COMMAND_PAGES / f"{path[0]}.md").read_text()
    for option in command.params:
        if option.param_type_name == "argument":
            continue
        assert max(option.opts, key=len) in printed
        assert together(option.help) in printed
        assert option.help.replace("|", "\\|") in page
        assert together(default(option)) in printed
        assert option.is_flag or metavar(option) in printed
    for paragraph in re.split(r"\n\s*\n", command.help):
        assert together(paragraph) in printed


def test_the_readme_lists_every_command_and_every_format():
    readme = (ROOT / "README.md").read_text()
    formats = (ROOT / "docs" / "formats.md").read_text()
    for name in COMMANDS:
        assert f"[`{name}`](docs/commands/{name}.md)" in readme
    for name in known_formats():
        assert re.search(rf"^\| `{name}` ", readme, re.M)
        assert re.search(rf"^\| `{name}` ", formats, re.M)


def test_architecture_names_every_module_of_the_package():
    text = (ROOT / "docs" / "architecture.md").read_text()
    package = ROOT / "mocap_skel"
    for path in [*package.glob("*.py"), *package.glob("*/__init__.py")]:
        name = path.parent.name + "/" if path.name == "__init__.py" else path.name
        if path.parent != package or path.name not in ("__init__.py", "__main__.py"):
            assert re.search(rf"\b{re.escape(name)}|\b{path.stem}\b", text), name


def places_to_change():
    """(row, file, name in it, or "" for the file as a whole) of the table in docs/architecture.md."""
    page = (ROOT / "docs" / "architecture.md").read_text()
    table = page[page.index("## Where to change what") : page.index("## Floors")]
    for what, where in re.findall(r"^\| ([^*|]+) \| ([^|]+) \|$", table, re.M):
        path = ""
        for word in re.findall(r"`([^`]+)`", where):
            if "/" in word or "." in word:
                path = word
                yield what, path, ""
            elif word.isidentifier():
                yield what, path, word


def test_the_table_of_places_to_change_is_true():
    """Its files are there, and the names are in them."""
    found = list(places_to_change())
    for what, path, name in found:
        file = ROOT / (path if path.startswith(("web/", "benchmarks/")) else f"mocap_skel/{path}")
        assert file.exists(), (what, path)
        if name:
            assert re.search(rf"\b{name}\b", file.read_text()), (what, path, name)
    assert len({what for what, _, _ in found}) >= 25


def test_links_lead_somewhere():
    for page in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]:
        prose = re.sub(r"```.*?```|`[^`\n]*`", "", page.read_text(), flags=re.S)
        for target in re.findall(r"\]\(([^)#]+)[^)]*\)", prose):
            assert target.startswith("https:") or (page.parent / target).exists(), (page, target)


def test_the_package_is_typed_and_gives_what_it_lists():
    assert (ROOT / "mocap_skel" / "py.typed").exists()
    assert sorted(mocap_skel.__all__) == sorted(mocap_skel._PUBLIC)
    source = (ROOT / "mocap_skel" / "__init__.py").read_text()
    seen = source[source.index("if TYPE_CHECKING:") : source.index("_PUBLIC")]
    for name in mocap_skel.__all__:
        assert getattr(mocap_skel, name).__name__ == name
        assert re.search(rf"\b{name}\b", seen), f"{name}: type checkers do not see it"


def completed(words, shell="bash"):
    """What the shell is offered for the last word of a line."""
    words = words.split(" ")
    env = {
        **os.environ,
        "_MOCAP_SKEL_COMPLETE": f"{shell}_complete",
        "COMP_WORDS": " ".join(words),
        "COMP_CWORD": str(len(words) - 1),
    }
    done = subprocess.run(
        [sys.executable, "-m", "mocap_skel"], env=env, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shell_gets_its_script(shell):
    if shell == "bash" and shutil.which("bash") is None:
        pytest.skip("no bash")
    env = {**os.environ, "_MOCAP_SKEL_COMPLETE": f"{shell}_source"}
    done = subprocess.run(
        [sys.executable, "-m", "mocap_skel"], env=env, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    assert f"_MOCAP_SKEL_COMPLETE={shell}_complete" in done.stdout
    assert "mocap-skel" in done.stdout


def test_the_shell_completes_commands_options_and_shipped_names():
    assert completed("mocap-skel dr") == ["plain,draw"]
    assert "plain,--rotation-order" in completed("mocap-skel fit --ro")
    assert "plain,parquet" in completed("mocap-skel fit --format ")
    assert "plain,plug_in_gait" in completed("mocap-skel fit --assoc plu")
    # A file of one's own is completed by the shell itself.
    assert completed("mocap-skel report --skeleton lower") == ["plain,lower_body", "file,lower"]

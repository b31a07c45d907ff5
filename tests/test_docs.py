"""The documentation is true: its commands run and print what it shows, its programs run, its lists are whole."""

import os
import re
import shutil
import subprocess
import sys

import pytest
from command_pages import PAGES as COMMAND_PAGES
from command_pages import default, metavar, pages
from doc_blocks import PAGES, python_of, run_page
from recordings import ROOT, SAMPLES

import mocap_skel
from mocap_skel.cli import COMMANDS, group
from mocap_skel.export.registry import formats as known_formats
from mocap_skel.figure.skeleton import SHIPPED


@pytest.mark.parametrize(("page", "least"), [*zip(PAGES, (6, 9, 2, 16), strict=True)])
def test_the_console_blocks_of_a_page_are_true(page, least, tmp_path):
    """Every `$ …` line runs, in order; what the page shows below it is what it prints."""
    shown = run_page(page, tmp_path)
    assert len(shown) >= least
    for each in shown:
        assert "Traceback" not in each.errors
        if each.expected:
            assert each.got == each.expected, each.line
        if not PAGES[page]:
            assert each.code == 0, (each.line, each.errors)


@pytest.mark.parametrize("page", ["README.md", "docs/quick_start.md"])
def test_the_python_of_a_page_runs(page, tmp_path):
    shutil.copy(SAMPLES / "range_of_motion.c3d", tmp_path / "walk.c3d")
    program = python_of(page)
    assert "from mocap_skel import" in program
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        cwd=tmp_path, capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
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

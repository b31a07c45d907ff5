"""What the pages show, run. As a program it writes the pages' console blocks again, to be reviewed as a diff."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent
BLOCK = re.compile(r"```console\n(.*?)```", re.S)
# Every page that shows commands.
PAGES = [
    str(path.relative_to(ROOT))
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
    if BLOCK.search(path.read_text())
]
# A command after which the page shows the exit status; any other has to end with 0.
STATUS = "echo $?"
# The commands of the pages, whatever is installed on this machine.
PROGRAMS = {"python": "", "mocap-skel": "-m mocap_skel"}


@dataclass(frozen=True)
class Shown:
    """A command of a console block, what the page says it prints, and what it does print.

    Attributes:
        line: the command.
        code: its exit status; of a pipe that of the last part that failed.
        told: the page shows the status, so that it may be another than 0.
        expected: the lines that the page shows.
        got: the lines of its standard output, then those of its standard error.
    """

    line: str
    code: int
    told: bool
    expected: list[str]
    got: list[str]

    @property
    def ends_as_shown(self):
        """Whether it ends with 0, or the page shows how it ends."""
        return self.code == 0 or self.told


def run_page(page, folder):
    """Run a page's console blocks in order in a folder that has the bundled clips and the page's own files."""
    text = (ROOT / page).read_text()
    shutil.copytree(ROOT / "sample_data", folder / "sample_data", dirs_exist_ok=True)
    for name, content in re.findall(r"```(?:toml|text) (\S+)\n(.*?)```", text, re.S):
        (folder / name).write_text(content)
    return run_text(text, folder)


def run_text(text, folder):
    """Run the console blocks of a text in order."""
    programs = folder / ".programs"
    programs.mkdir()
    for name, start in PROGRAMS.items():
        path = programs / name
        path.write_text(f'#!/bin/sh\nexec "{sys.executable}" {start} "$@"\n')
        path.chmod(0o755)
    shown = []
    for block in BLOCK.findall(text):
        commands = list(commands_of(block))
        told = [line == STATUS for line, _ in commands[1:]] + [False]
        code = 0
        for (line, expected), status in zip(commands, told, strict=True):
            shown.append(run_line(line, expected, status, code, folder))
            code = shown[-1].code
    return shown


def commands_of(block):
    """(command, what the page shows below it) of a console block."""
    for part in re.split(r"^\$ ", block, flags=re.M)[1:]:
        line, _, expected = part.partition("\n")
        yield line, expected


def run_line(line, expected, told, before, folder):
    """Run a command as a shell with `set -o pipefail` does, after one that ended with `before`."""
    # A page does not depend on the width of who reads it, nor on a reporter's own settings.
    path = f"{folder / '.programs'}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", f"(exit {before}); {line}"],
        cwd=folder, env={**os.environ, "COLUMNS": "80", "PATH": path},
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    return Shown(
        line, done.returncode, told, lines_of(expected), lines_of(done.stdout + done.stderr)
    )


def lines_of(text):
    return [line.rstrip() for line in text.strip("\n").splitlines()]


def rewritten(text, shown):
    """A page with its console blocks as the commands print them now."""
    left = iter(shown)

    def block(found):
        lines = []
        for _ in commands_of(found[1]):
            each = next(left)
            lines += [f"$ {each.line}", *each.got]
        return "\n".join(["```console", *lines, "```"])

    return BLOCK.sub(block, text)


def python_of(page):
    """The Python blocks of a page, one program."""
    return "\n".join(re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.S))


def main():
    failed = False
    for page in PAGES:
        path = ROOT / page
        with tempfile.TemporaryDirectory() as folder:
            shown = run_page(page, Path(folder))
        for each in shown:
            if each.expected != each.got:
                print(f"{page}: {each.line}")
            if not each.ends_as_shown:
                failed = True
                print(f"{page}: {each.line}: ends with {each.code}", file=sys.stderr)
        path.write_text(rewritten(path.read_text(), shown))
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())

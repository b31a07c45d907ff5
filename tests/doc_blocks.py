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
# Page → whether its blocks show standard error as well.
PAGES = {
    "README.md": False,
    "docs/quick_start.md": False,
    "docs/calibration.md": False,
    "docs/skeletons.md": True,
}


@dataclass(frozen=True)
class Shown:
    """A command of a console block, what the page says it prints, and what it does print."""

    line: str
    code: int
    expected: list[str]
    got: list[str]
    errors: str


def run_page(page, folder):
    """Run a page's console blocks in order in a folder that has the bundled clips and the page's own files."""
    text = (ROOT / page).read_text()
    shutil.copytree(ROOT / "sample_data", folder / "sample_data", dirs_exist_ok=True)
    for name, content in re.findall(r"```(?:toml|text) (\S+)\n(.*?)```", text, re.S):
        (folder / name).write_text(content)
    return [run_line(*each, PAGES[page], folder) for each in lines_of(text)]


def lines_of(text):
    for block in re.findall(r"```console\n(.*?)```", text, re.S):
        for part in re.split(r"^\$ ", block, flags=re.M)[1:]:
            line, _, expected = part.partition("\n")
            yield line, expected


def run_line(line, expected, errors, folder):
    words = re.sub(r"^(\w+=\S+ )?mocap-skel", r"\1python -m mocap_skel", line)
    command = re.sub(r"^(\w+=\S+ )?python", rf"\1{sys.executable}", words)
    # A page does not depend on the width of who reads it, nor on a reporter's own settings.
    env = {**os.environ, "COLUMNS": "80"}
    done = subprocess.run(
        command, shell=True, cwd=folder, env=env, capture_output=True, text=True, timeout=120
    )
    said = done.stdout + (done.stderr if errors else "")
    trimmed = [[s.rstrip() for s in text.strip().splitlines()] for text in (expected, said)]
    return Shown(line, done.returncode, *trimmed, done.stderr)


def python_of(page):
    """The Python blocks of a page, one program."""
    return "\n".join(re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.S))


def main():
    for page in PAGES:
        path = ROOT / page
        with tempfile.TemporaryDirectory() as folder:
            text = path.read_text()
            for shown in run_page(page, Path(folder)):
                if shown.expected and shown.expected != shown.got:
                    old = "\n".join([f"$ {shown.line}", *shown.expected])
                    assert old in text, f"{page}: {shown.line}: cannot be found again"
                    text = text.replace(old, "\n".join([f"$ {shown.line}", *shown.got]))
                    print(f"{page}: {shown.line}")
            path.write_text(text)


if __name__ == "__main__":
    sys.exit(main())

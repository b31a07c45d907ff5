"""The shell lines of docs/cluster.md run, where no cluster is needed for them."""

import json
import os
import re
import shutil
import subprocess
import sys

import pytest
from commands import STILL
from recordings import ROOT

PAGE = (ROOT / "docs" / "cluster.md").read_text()


def block(name):
    """A file of the page."""
    return re.search(rf"```\w+ {re.escape(name)}\n(.*?)```", PAGE, re.S)[1]


@pytest.fixture
def shell(tmp_path):
    """Runs lines in a folder with three clips."""
    (tmp_path / "bin").mkdir()
    program = tmp_path / "bin" / "mocap-skel"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m mocap_skel "$@"\n')
    program.chmod(0o755)
    for name in ("a", "b c", "day 2/a"):
        clip = tmp_path / "recordings" / f"{name}.c3d"
        clip.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(STILL, clip)

    def run(lines, **variables):
        path = f"{program.parent}{os.pathsep}{os.environ['PATH']}"
        done = subprocess.run(
            ["bash", "-eu", "-o", "pipefail", "-c", lines], cwd=tmp_path,
            env={**os.environ, "PATH": path, **variables}, capture_output=True, text=True, timeout=120,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr

    return run


def names(folder, of="manifest.jsonl"):
    return sorted(json.loads(x)["name"] for x in (folder / of).read_text().splitlines())


def test_the_tasks_of_the_array_have_each_clip_once(shell, tmp_path):
    shell("find recordings -name '*.c3d' > clips.txt")
    # The tasks that have a clip; the others have an empty list.
    for task in ("1", "2", "3"):
        shell(block("fit.sbatch"), SLURM_ARRAY_TASK_ID=task)
    shell("cat out/*/manifest.jsonl > manifest.jsonl")
    assert names(tmp_path) == ["a", "b c", "day 2/a"]
    assert len(list((tmp_path / "out").rglob("day 2/a.joints.csv"))) == 1


def test_a_list_with_zero_bytes_is_one_batch(shell, tmp_path):
    shell(re.search(r"^    (find .*-print0.*)$", PAGE, re.M)[1])
    assert names(tmp_path / "out") == ["a", "b c", "day 2/a"]


def test_the_rules_of_the_workflow_make_the_files_that_they_promise(shell, tmp_path):
    rule = re.search(r"rule fit:.*?'''(mocap-skel .*?)'''", block("Snakefile"), re.S)[1]
    line = rule.replace("{input:q}", "'recordings/day 2/a.c3d'")
    shell(line.replace("{output[0]:q}", "'out/day 2/a.joints.csv'"))
    for promised in re.findall(r'"out/\{clip\}(\S+)"', block("Snakefile").partition("rule fit")[2]):
        assert (tmp_path / "out" / "day 2" / f"a{promised}").exists()
    batch = re.search(r'shell: "(mocap-skel .*?)"\n', block("Snakefile.batch"))[1]
    shell(
        batch.replace("{input:q}", "recordings")
        .replace("{threads}", "2")
        .replace("-o out", "-o all")
    )
    assert (tmp_path / "all" / "summary.csv").exists()

"""Damaged files: none crashes, hangs, or eats memory, and none that lost points gives a result.

`make fuzz N=10000` tries more of them; a failure names the seeds, and `mutations.mutation(seed)` makes
such a file again.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
import warnings
from collections import Counter

import numpy as np
import pytest
from mutations import KINDS, NAMES, mutation, whole
from recordings import ASSOCIATIONS

from mocap_skel.errors import MocapSkelError
from mocap_skel.labels.association import read_association
from mocap_skel.pipeline.clip_files import render
from mocap_skel.pipeline.isolation import GIGABYTE, TaskError, Worker
from mocap_skel.pipeline.job import Job
from mocap_skel.readers import read_clip

N = int(os.environ.get("MOCAP_SKEL_FUZZ", "200"))
FIRST = int(os.environ.get("MOCAP_SKEL_FUZZ_FIRST", "0"))
SECONDS = 30


def fitted(path, association):
    """What comes of a file when nothing stands between us and it: in a child, but not for its sake."""
    began = time.perf_counter()
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            done = render(path, Job(read_association(association)))
            outcome = f"fitted, {'with' if done.notes else 'without'} notes"
        except MocapSkelError as error:
            outcome = type(error).__name__
            if "\n" in error.message or (outcome == "ClipError" and str(path) not in error.message):
                raise RuntimeError(error.message) from error
    import resource

    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return outcome, time.perf_counter() - began, memory, [str(one.message) for one in told]


def test_no_damaged_file_gets_through(tmp_path, capsys):
    bad: list[str] = []
    outcomes: Counter[str] = Counter()
    longest, most = (0.0, -1), (0, -1)
    with Worker() as worker:
        for seed in range(FIRST, FIRST + N):
            damaged = mutation(seed)
            path = tmp_path / "damaged.c3d"
            path.write_bytes(damaged.data)
            try:
                worker.start(
                    fitted, path, ASSOCIATIONS[damaged.clip], memory=2 * GIGABYTE, seconds=SECONDS
                )
                outcome, seconds, memory, told = worker.result()
            except TaskError as error:
                bad.append(f"seed {seed} ({damaged.kind}): {error}")
                continue
            except Exception as error:
                bad.append(f"seed {seed} ({damaged.kind}): {error!r} {error.__notes__}")
                continue
            outcomes[outcome] += 1
            longest, most = max(longest, (seconds, seed)), max(most, (memory, seed))
            if damaged.cut and outcome.startswith("fitted"):
                bad.append(f"seed {seed} ({damaged.kind}): a result of lost points")
            bad += [f"seed {seed} ({damaged.kind}): warned: {warning}" for warning in told]
    with capsys.disabled():
        print(
            f"\nfuzz: seeds {FIRST} to {FIRST + N - 1}: {dict(outcomes)}; longest {longest[0]:.2f} s "
            f"(seed {longest[1]}), most memory {most[0] / 1e6:.0f} MB (seed {most[1]})"
        )
    assert not bad, "\n".join(bad)
    assert most[0] < 2 * GIGABYTE
    assert outcomes.total() == N


def run(*arguments, folder):
    done = subprocess.run(
        [sys.executable, "-m", "mocap_skel", *map(str, arguments)],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert "Traceback" not in done.stderr and "bug" not in done.stderr
    assert all(line.startswith("mocap-skel: ") for line in done.stderr.splitlines()), done.stderr
    return done


def test_many_damaged_files_in_one_call(tmp_path):
    made = {}
    for seed in range(10_000, 10_024):
        damaged = mutation(seed)
        made[seed] = damaged
        (tmp_path / f"s{seed}.c3d").write_bytes(damaged.data)
    (tmp_path / "sound.c3d").write_bytes(whole("nearly_still").data)
    clips = sorted(path.name for path in tmp_path.glob("*.c3d"))
    done = run("fit", *clips, "--assoc", "cmu", "-o", "out", folder=tmp_path)
    assert done.returncode == 1
    written = {path.name.split(".")[0] for path in (tmp_path / "out").iterdir()}
    assert "sound" in written
    for seed, damaged in made.items():
        if damaged.cut:
            assert f"s{seed}" not in written
            assert f"error: s{seed}.c3d: " in done.stderr
    assert not list(tmp_path.rglob("*.part"))


@pytest.mark.parametrize("name", NAMES[2:])
def test_a_cut_clip_by_itself(tmp_path, name):
    sound = whole(name)
    (tmp_path / "clip.c3d").write_bytes(sound.data[: sound.start + 40 * sound.stride + 7])
    association = ASSOCIATIONS[name]
    call = ["fit", "clip.c3d", "--assoc", association, "-o", "out"]
    done = run(*call, folder=tmp_path)
    assert done.returncode == 3
    assert done.stderr == (
        "mocap-skel: error: clip.c3d: cut off: it says 60 frames and ends after 40 whole ones "
        "(--salvage reads those)\n"
    )
    assert not (tmp_path / "out").exists()
    done = run("inspect", "clip.c3d", "--salvage", folder=tmp_path)
    assert done.returncode == 0 and "40 frames at" in done.stdout
    assert "cut off: it says 60 frames" in done.stdout
    (tmp_path / "sound.c3d").write_bytes(sound.data)
    np.testing.assert_array_equal(
        read_clip(tmp_path / "clip.c3d", salvage=True).points,
        read_clip(tmp_path / "sound.c3d").points[:40],
    )
    done = run(*call, "--salvage", folder=tmp_path)
    assert done.returncode == 0 and "which are read" in done.stderr
    assert len(list((tmp_path / "out").iterdir())) >= 2


def test_every_kind_of_damage_is_among_them_and_a_seed_makes_it_again():
    assert {mutation(seed).kind for seed in range(300)} == set(KINDS)
    assert mutation(7) == mutation(7) != mutation(8)
    assert sum(mutation(seed).cut for seed in range(300)) > 60
    for name in NAMES:
        assert len(whole(name).data) % 512 == 0

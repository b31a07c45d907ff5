"""Damaged association, skeleton and calibration files: each is read, or refused on one line that names it.

`make fuzz N=10000` tries more of them; a failure names the seeds, and `damaged(kind, seed)` makes such a file again.
"""

from __future__ import annotations

import os
import re
from collections import Counter

import numpy as np
import pytest
from commands import call, tiny
from recordings import ROOT

from mocap_skel.errors import MocapSkelError
from mocap_skel.export.calibration_json import read_calibration
from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.labels.association import read_association
from mocap_skel.pipeline.clip_files import render
from mocap_skel.pipeline.isolation import GIGABYTE, TaskError, Worker
from mocap_skel.pipeline.job import Job

N = int(os.environ.get("MOCAP_SKEL_FUZZ", "80"))
FIRST = int(os.environ.get("MOCAP_SKEL_FUZZ_FIRST", "0"))
# With so few of the calibrations that are read, a clip is fitted as well.
FITTED = 8
NUMBER = re.compile(rb"-?\d+(\.\d+)?(e-?\d+)?")
VALUES = (
    b"-1", b"0", b"1e-300", b"1e29", b"1e308", b"1e400", b"9" * 400, b"9" * 5000, b"NaN", b"null", b'"x"',
    b"[]", b"{}", b"true", b"[" * 10_000 + b"]" * 10_000,
)  # fmt: skip
BYTES = b"\0\x1b\x07\x7f\x85\xff\xc3\"'[]{}#=@\n\r\t,.-"


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """A whole file of each kind: its end and its bytes."""
    folder = tmp_path_factory.mktemp("sound")
    assert call("calibrate", tiny(), "-a", "cmu", "-q", "-o", "a.json", cwd=folder).returncode == 0
    return {
        "association": (".txt", (ROOT / "association_files/cmu.txt").read_bytes()),
        "skeleton": (".toml", (ROOT / "mocap_skel/figure/skeletons/human.toml").read_bytes()),
        "calibration": (".json", (folder / "a.json").read_bytes()),
    }


def damaged(data: bytes, seed: int) -> bytes:
    """The file with one to four faults."""
    rng = np.random.default_rng(seed)
    for _ in range(rng.integers(1, 5)):
        at = int(rng.integers(len(data) + 1))
        size = int(2 ** rng.integers(0, 9))
        match rng.integers(7):
            case 0:
                data = data[:at]
            case 1:
                data = data[:at] + data[at + size :]
            case 2:
                data = data[:at] + data[at : at + size] * int(rng.integers(2, 40)) + data[at:]
            case 3:
                data = (
                    data[:at] + bytes(rng.choice([*BYTES], size=min(size, 8)).tolist()) + data[at:]
                )
            case 4:
                data = data[:at] + rng.bytes(min(size, 8)) + data[at + 8 :]
            case _:
                numbers = list(NUMBER.finditer(data))
                if numbers:
                    one = numbers[rng.integers(len(numbers))]
                    value = VALUES[rng.integers(len(VALUES))]
                    data = data[: one.start()] + value + data[one.end() :]
    return data


def outcome(kind, path, fit):
    """What comes of a file; a calibration is used as well."""
    try:
        if kind == "association":
            read_association(path)
        elif kind == "skeleton":
            read_skeleton(path)
        else:
            association = read_association("cmu")
            known = read_calibration(path, association.skeleton)
            if fit:
                render(tiny(), Job(association, calibration=known))
    except MocapSkelError as error:
        if "\n" in error.message or str(path) not in error.message:
            raise RuntimeError(f"no good message: {error.message!r:.300}") from error
        return type(error).__name__
    return "read"


@pytest.mark.parametrize("kind", ["association", "skeleton", "calibration"])
def test_no_damaged_file_gets_through(tmp_path, sound, kind, capsys):
    end, data = sound[kind]
    bad: list[str] = []
    outcomes: Counter[str] = Counter()
    with Worker() as worker:
        for seed in range(FIRST, FIRST + N):
            path = tmp_path / f"damaged{end}"
            path.write_bytes(damaged(data, seed))
            fit = seed % FITTED == 0
            worker.start(outcome, kind, path, fit, memory=2 * GIGABYTE, seconds=30.0)
            try:
                outcomes[worker.result()] += 1
            except TaskError as error:
                bad.append(f"seed {seed}: {error}")
            except Exception as error:
                bad.append(f"seed {seed}: {error!r} {error.__notes__}")
    with capsys.disabled():
        print(f"\nfuzz: {kind} files, seeds {FIRST} to {FIRST + N - 1}: {dict(outcomes)}")
    assert not bad, "\n".join(bad)
    assert outcomes.total() == N
    assert damaged(data, 7) == damaged(data, 7) != damaged(data, 8)

"""Tables that are damaged, or that claim too much: one line is said, in little time and memory."""

from __future__ import annotations

import gzip
import time

import numpy as np
import pytest
from table_files import NEXUS_DEVICES, NEXUS_MODEL, marked, motive, nexus, plain, qualisys, trc

from mocap_skel.errors import ClipError, MocapSkelError
from mocap_skel.pipeline.isolation import GIGABYTE, Worker
from mocap_skel.readers import read_clip
from mocap_skel.readers.tables import rows, source

FILE = marked(frames=12, labels=("Ann:LASI", "Ann:RASI"))
COMMAS = FILE.but(sep=",", unit="Millimeters")
FILES = {
    "a.trc": trc(FILE), "a.csv": motive(COMMAS), "a.tsv": qualisys(FILE, frame=True, time=True),
    "b.csv": plain(COMMAS, spell="{label}_{axis} [mm]"),
    "c.csv": nexus(FILE.but(sep=","), before=NEXUS_DEVICES, after=NEXUS_MODEL),
}  # fmt: skip


def damaged(content, rng):
    """The bytes of a file with something done to them."""
    data = bytearray(content)
    at, size = int(rng.integers(len(data))), int(rng.integers(1, 200))
    kind = rng.integers(7)
    if kind == 0:
        del data[at:]
    elif kind == 1:
        data[at : at + size] = rng.bytes(size)
    elif kind == 2:
        del data[at : at + size]
    elif kind == 3:
        data[at:at] = data[at : at + size]
    elif kind == 4:
        data[at : at + 1] = b"\t,;\n\r\"'.-e9x\0 "[int(rng.integers(15)) :][:1] * int(
            rng.integers(1, 40)
        )
    elif kind == 5:
        lines = bytes(data).split(b"\n")
        rng.shuffle(lines)
        data = bytearray(b"\n".join(lines))
    else:
        for place in rng.integers(0, len(data), 20):
            data[place] = int(rng.integers(256))
    return bytes(data)


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("salvage", [False, True])
def test_no_damage_gives_more_than_a_line(tmp_path, name, salvage):
    rng = np.random.default_rng(5)
    path = tmp_path / name
    sound = FILES[name].encode()
    refused = []
    for _ in range(150):
        path.write_bytes(damaged(sound, rng))
        try:
            clip = read_clip(path, salvage=salvage)
            assert clip.points.shape[2] == 3 and len(clip.labels) == clip.points.shape[1]
        except MocapSkelError as error:
            refused.append(error.message)
    assert 5 < len(refused) < 150
    for message in refused:
        assert message.isprintable() and len(message) < 400
        assert message.startswith(f"{path}: ")


def test_random_bytes_and_packed_nonsense(tmp_path):
    rng = np.random.default_rng(6)
    for name in (*FILES, "a.trc.gz"):
        path = tmp_path / name
        for start in (
            b"",
            b"PathFileType\t4\n",
            b"Format Version,1.23\n",
            b"NO_OF_FRAMES\t4\n",
            b"\x1f\x8b\x08",
        ):
            path.write_bytes(start + rng.bytes(5000))
            with pytest.raises(MocapSkelError) as error:
                read_clip(path)
            assert error.value.message.startswith(f"{path}: ")


def test_a_file_that_is_packed_twice_is_refused(tmp_path):
    path = tmp_path / "walk.trc.gz"
    path.write_bytes(gzip.compress(gzip.compress(FILES["a.trc"].encode())))
    with pytest.raises(ClipError, match="packed twice"):
        read_clip(path)


def test_what_a_packed_file_holds_is_told_by_its_own_name(tmp_path):
    path = tmp_path / "walk.bvh.gz"
    path.write_bytes(gzip.compress(b"HIERARCHY\n"))
    with pytest.raises(ClipError) as error:
        read_clip(path)
    assert error.value.message == f"{path}: inside: it holds a skeleton, no markers"


CLAIMS = {
    "frames.trc": trc(FILE, said=10**15),
    "markers.trc": trc(FILE).replace("\t2\tmm", f"\t{10**15}\tmm"),
    "rate.trc": trc(FILE, rate="1e308"),
    "far.trc": trc(FILE).replace("\n12\t", f"\n{10**8}\t"),
    "wide.trc": trc(FILE).replace("\n5\t", "\n5" + "\t" * 3_000_000),
    "long.csv": plain(COMMAS) + "\n" * 20_000_000,
    "cell.csv": plain(COMMAS).replace("\n5,", "\n" + "5" * 10_000_000 + ","),
    "names.csv": ",".join(f"m{i}_{a}" for i in range(300_000) for a in "xyz") + "\n1,2,3\n",
    "frames.tsv": qualisys(FILE, said=10**15, before={"NO_OF_MARKERS": [10**15]}),
    "lines.tsv": "NO_OF_FRAMES\t4\n" * 1_000_000,
}


def outcome(path):
    began = time.perf_counter()
    try:
        read_clip(path)
        said = "read"
    except MocapSkelError as error:
        said = error.message
    return said, time.perf_counter() - began


def test_no_claim_takes_memory_or_time(tmp_path):
    with Worker() as worker:
        for name, content in CLAIMS.items():
            path = tmp_path / name
            path.write_text(content)
            worker.start(outcome, path, memory=2 * GIGABYTE, seconds=30)
            said, seconds = worker.result()
            assert seconds < 10, name
            assert said == "read" or said.startswith(f"{path}: "), said


def test_what_is_too_large_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "a.trc.gz"
    path.write_bytes(gzip.compress(FILES["a.trc"].encode()))
    monkeypatch.setattr(source, "LARGEST", 1000)
    with pytest.raises(ClipError, match="more than 0 MB when it is unpacked"):
        read_clip(path)
    monkeypatch.undo()
    path = tmp_path / "a.trc"
    path.write_text(FILES["a.trc"])
    monkeypatch.setattr(rows, "MOST_CELLS", 50)
    with pytest.raises(ClipError, match="a table of 0 million cells"):
        read_clip(path)
    monkeypatch.setattr(rows, "MOST_POINTS", 1)
    with pytest.raises(ClipError, match="2 trajectories; more than 1 are not read"):
        read_clip(path)
    monkeypatch.setattr(source, "LARGEST", 1000)
    with pytest.raises(ClipError, match="a text of more than 0 MB"):
        read_clip(path)

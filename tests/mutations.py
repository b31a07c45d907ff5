"""Damaged copies of the bundled clips, each made from one seed."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

BLOCK = 512
SAMPLES = Path(__file__).parent.parent / "sample_data"
NAMES = ("nearly_still", "range_of_motion", "gaps", "two_dancers")
# A copy is cut down to so many frames: hundreds of them have to be read in seconds.
FRAMES = 60


@dataclass(frozen=True)
class Whole:
    """A sound clip: its bytes, where its points start, bytes of a frame, frames."""

    data: bytes
    start: int
    stride: int
    frames: int


@dataclass(frozen=True)
class Mutation:
    """A damaged clip.

    Attributes:
        seed: makes it again.
        clip: which bundled one it was.
        kind: what was done to it.
        data: its bytes.
        cut: whether points are lost that the file still says it has, so that no result may come of it.
    """

    seed: int
    clip: str
    kind: str
    data: bytes
    cut: bool


@cache
def whole(name: str) -> Whole:
    """A bundled clip, cut down as its own header and parameters would have it."""
    data = bytearray((SAMPLES / f"{name}.c3d").read_bytes())
    points, analogs, first, _ = struct.unpack_from("<4H", data, 2)
    block, _ = struct.unpack_from("<2H", data, 16)
    assert analogs == 0 and data[515] == 84
    start, stride = (block - 1) * BLOCK, 16 * points
    struct.pack_into("<H", data, 8, first + FRAMES - 1)
    at = data.index(b"FRAMES", BLOCK) + len(b"FRAMES") + 2
    kind, dimensions = data[at], data[at + 1]
    assert kind in (2, 4)
    form = "<h" if kind == 2 else "<f"
    struct.pack_into(form, data, at + 2 + dimensions, FRAMES)
    # The last block is padded as the format wants it.
    end = start + FRAMES * stride
    kept = bytes(data[:end]) + bytes(-end % BLOCK)
    return Whole(kept, start, stride, FRAMES)


def mutation(seed: int) -> Mutation:
    """One damaged clip."""
    rng = np.random.default_rng(seed)
    clip = NAMES[rng.integers(len(NAMES))]
    base = whole(clip)
    kinds = list(KINDS)
    kind = kinds[rng.integers(len(kinds))]
    data = KINDS[kind](bytearray(base.data), base, rng)
    # Damage of the header or the parameters may hide how much there ought to be; the rest cannot.
    told = data[: base.start] == base.data[: base.start]
    cut = told and len(data) < base.start + base.frames * base.stride
    return Mutation(seed, clip, kind, bytes(data), cut)


def _header(data, base, rng):
    for at in rng.integers(0, 24, rng.integers(1, 4)):
        data[at] = rng.integers(256)
    return data


def _header_word(data, base, rng):
    at = int(rng.choice([2, 4, 6, 8, 10, 16, 18]))
    struct.pack_into("<H", data, at, int(rng.choice([0, 1, 2, 255, 32767, 32768, 65535])))
    return data


def _header_float(data, base, rng):
    value = rng.choice([0.0, -0.0, 1.0, 0.01, np.nan, np.inf, -np.inf, 1e30, -1e-30])
    struct.pack_into("<f", data, int(rng.choice([12, 20])), value)
    return data


def _parameters(data, base, rng):
    for at in rng.integers(BLOCK, base.start, 2 ** rng.integers(0, 7)):
        data[at] = rng.integers(256)
    return data


def _entry(data, base, rng):
    """A byte near the front of a parameter: length, group, name, offset, type, dimensions."""
    names = [b"USED", b"FRAMES", b"SCALE", b"RATE", b"LABELS", b"UNITS", b"DATA_START", b"POINT"]
    at = data.find(names[rng.integers(len(names))], BLOCK)
    for place in rng.integers(max(BLOCK, at - 2), at + 18, rng.integers(1, 3)):
        data[place] = rng.choice([0, 1, 127, 128, 255, rng.integers(256)])
    return data


def _counts(data, base, rng):
    """Huge counts in the header and in the parameters at once."""
    count = int(rng.choice([60000, 65535, 32768, 5000]))
    at = data.find(b"USED", BLOCK)
    struct.pack_into("<H", data, at + 8, count)
    if rng.random() < 0.7:
        struct.pack_into("<H", data, 2, count)
    if rng.random() < 0.3:
        struct.pack_into("<H", data, 8, 65535)
    return data


def _points(data, base, rng):
    for at in rng.integers(base.start, len(data), 2 ** rng.integers(0, 10)):
        data[at] = rng.integers(256)
    return data


def _truncate(data, base, rng):
    return data[: rng.integers(len(data))]


def _truncate_points(data, base, rng):
    return data[: rng.integers(base.start, len(data))]


def _truncate_at_frame(data, base, rng):
    return data[: base.start + base.stride * rng.integers(base.frames)]


def _truncate_at_block(data, base, rng):
    return data[: BLOCK * rng.integers(len(data) // BLOCK)]


def _zeros(data, base, rng):
    at = BLOCK * int(rng.integers(len(data) // BLOCK))
    size = BLOCK * int(2 ** rng.integers(0, 5))
    data[at : at + size] = bytes(len(data[at : at + size]))
    return data


def _splice(data, base, rng):
    """A piece of another clip, or of this one, put in or put over."""
    other = whole(NAMES[rng.integers(len(NAMES))]).data
    at, there = rng.integers(len(data)), rng.integers(len(other))
    piece = other[there : there + 2 ** rng.integers(0, 15)]
    end = at + (len(piece) if rng.random() < 0.5 else 0)
    return data[:at] + piece + data[end:]


def _remove(data, base, rng):
    at = rng.integers(len(data))
    return data[:at] + data[at + 2 ** rng.integers(0, 15) :]


def _noise(data, base, rng):
    at = rng.integers(2, base.start)
    size = min(len(data) - at, 2 ** rng.integers(0, 12))
    data[at : at + size] = rng.bytes(size)
    return data


KINDS = {
    "header bytes": _header,
    "header word": _header_word,
    "header float": _header_float,
    "parameter bytes": _parameters,
    "parameter entry": _entry,
    "huge counts": _counts,
    "point bytes": _points,
    "cut anywhere": _truncate,
    "cut in the points": _truncate_points,
    "cut at a frame": _truncate_at_frame,
    "cut at a block": _truncate_at_block,
    "zeroed blocks": _zeros,
    "splice": _splice,
    "bytes removed": _remove,
    "noise in the parameters": _noise,
}

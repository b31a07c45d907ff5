"""C3D files by ezc3d and by py-c3d: what our own reading of them is held to, bit by bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ezc3d
import numpy as np

from mocap_skel.readers.formats.c3d import with_c3d
from mocap_skel.readers.formats.c3d.contents import Contents, decoded
from mocap_skel.readers.formats.c3d.frames import without_padding
from mocap_skel.readers.formats.c3d.points import contents
from mocap_skel.readers.formats.c3d.survey import survey


def by_us(path: Path) -> Contents:
    return contents(survey(path))


def by_ezc3d(path: Path) -> Contents:
    found, content = survey(path), ezc3d.c3d(str(path))
    points = content["data"]["points"][:3].transpose(2, 1, 0)
    # It takes the padding of the last block for frames.
    there = without_padding(points, found.layout.sure)
    invalid = (content["data"]["meta_points"]["residuals"][0] < 0).T[:there]
    groups = {name: _group(content["parameters"].get(name, {})) for name in ("POINT", "TRIAL")}
    points = np.where(invalid[..., None], np.nan, points[:there])
    return Contents(points, invalid, found.rate, found.first_frame, groups, "ezc3d")


def _group(entries: dict[str, Any]) -> dict[str, Any]:
    """Names in capitals with their values; texts as the file's author meant them."""
    group: dict[str, Any] = {}
    for name, entry in entries.items():
        if name == "__METADATA__":
            continue
        value = entry["value"]
        if isinstance(value, list):
            # Bytes that are no UTF-8 come through as lone surrogates.
            value = [decoded(str(text).encode("utf-8", "surrogateescape")) for text in value]
        # Beside a `Labels` ezc3d puts an empty LABELS of its own.
        if len(value) or name.upper() not in group:
            group[name.upper()] = value
    return group


def same(a: Contents, b: Contents) -> None:
    np.testing.assert_array_equal(a.invalid, b.invalid)
    np.testing.assert_array_equal(a.points, b.points)
    assert (a.rate, a.first_frame) == (b.rate, b.first_frame)
    for group, entries in b.parameters.items():
        # ezc3d writes its own count over the one and pads the other.
        for name in set(entries) - {"FRAMES", "DESCRIPTIONS", "DESCRIPTIONS2", "DESCRIPTIONS3"}:
            other = a.parameters[group][name]
            assert list(np.ravel(other)) == list(np.ravel(entries[name])), name


def read_alike(path: Path, *, ezc3d: bool = True) -> None:
    """We read a file as py-c3d and, if it can, ezc3d do."""
    ours = by_us(path)
    if ezc3d:
        same(by_ezc3d(path), ours)
    same(with_c3d.read(path), ours)

"""The first reader: ezc3d."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mocap_skel.errors import ClipError
from mocap_skel.readers.frames import cut_off, first_frame, frame_count, without_padding
from mocap_skel.readers.raw import RawClip, decoded, number

_BLOCK = 512


def read(path: Path) -> RawClip:
    """Read a file with ezc3d.

    Raises:
        ClipError: ezc3d refuses the file; the message is its reason, without the file's name.
    """
    import ezc3d

    try:
        content = ezc3d.c3d(str(path))
    # ezc3d throws C++ exceptions of many kinds, bad_alloc among them, through SWIG.
    except (
        RuntimeError, OSError, ValueError, TypeError, LookupError, MemoryError, ArithmeticError
    ) as error:  # fmt: skip
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ClipError(f"ezc3d cannot read it: {reason}") from error
    groups = {name: _group(content["parameters"].get(name, {})) for name in ("POINT", "TRIAL")}
    points = content["data"]["points"][:3].transpose(2, 1, 0)
    # ezc3d has put its own numbers into the header by now. It reads no file of the other byte order.
    begin, end = (int(word) for word in np.fromfile(path, "<u2", 5)[3:])
    said = max(0, end - begin + 1)
    first = first_frame(max(1, begin), groups)
    room = _room(path, groups["POINT"], content["data"])
    # It may take the padding of the last block for frames, and leave out frames of missing points.
    there = without_padding(points, said)
    return RawClip(
        path=str(path),
        points=np.ascontiguousarray(points[:there]),
        invalid=(content["data"]["meta_points"]["residuals"][0] < 0).T[:there],
        rate=number(groups["POINT"].get("RATE"))
        or float(content["header"]["points"]["frame_rate"]),
        first_frame=first,
        length=max(there, frame_count(max(there, said), first, groups, room)),
        parameters=groups,
        notes=cut_off(said, max(room, there)),
    )


def _group(entries: dict[str, Any]) -> dict[str, Any]:
    """Names in capitals with their values; texts as the file's author meant them."""
    group: dict[str, Any] = {}
    for name, entry in entries.items():
        if name == "__METADATA__":
            continue
        value = entry["value"]
        if isinstance(value, list):
            # Bytes that are no UTF-8 come through as lone surrogates, which nothing can print.
            value = [decoded(str(text).encode("utf-8", "surrogateescape")) for text in value]
        # Beside a `Labels` ezc3d puts an empty LABELS of its own.
        if len(value) or name.upper() not in group:
            group[name.upper()] = value
    return group


def _room(path: Path, point: dict[str, Any], data: Any) -> int:
    """Whole frames, as long as ezc3d took them to be, that fit into the file."""
    _, markers, frames = data["points"].shape
    values = 4 * markers + data["analogs"].size // max(1, frames)
    width = 4 if number(point.get("SCALE")) < 0 else 2
    start = max(0, int(number(point.get("DATA_START"))) - 1) * _BLOCK
    return int(max(0, path.stat().st_size - start) // max(1, values * width))

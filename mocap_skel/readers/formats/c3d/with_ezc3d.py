"""The first reader: ezc3d."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from mocap_skel.errors import ClipError, ours, refusals
from mocap_skel.readers.formats.c3d.contents import Contents, decoded
from mocap_skel.readers.formats.c3d.frames import without_padding
from mocap_skel.readers.formats.c3d.survey import Survey, survey

# ezc3d throws C++ exceptions of many kinds, bad_alloc among them, through SWIG.
_REFUSALS = refusals(
    (RuntimeError, OSError, ValueError, TypeError, LookupError, MemoryError, ArithmeticError),
    "ezc3d cannot read it",
)


def read(path: Path, found: Survey | None = None) -> Contents:
    """Read a file with ezc3d.

    Args:
        path: the file.
        found: what is known of it.

    Raises:
        ClipError: ezc3d refuses the file; the message is its reason, without the file's name.
    """
    import ezc3d

    found = found or survey(path)
    with ours(None, ClipError, _REFUSALS), _named(path) as name:
        content = ezc3d.c3d(name)
    groups = {name: _group(content["parameters"].get(name, {})) for name in ("POINT", "TRIAL")}
    points = content["data"]["points"][:3].transpose(2, 1, 0)
    # It may take the padding of the last block for frames, and leave out frames of missing points.
    there = without_padding(points, found.layout.sure)
    return Contents(
        points=np.ascontiguousarray(points[:there]),
        invalid=(content["data"]["meta_points"]["residuals"][0] < 0).T[:there],
        rate=found.rate,
        first_frame=found.first_frame,
        length=max(there, _length(found, there)),
        parameters=groups,
    )


@contextmanager
def _named(path: Path) -> Iterator[str]:
    """A name of the file that ezc3d takes: it has to be UTF-8."""
    try:
        str(path).encode()
    except UnicodeEncodeError:
        with path.open("rb") as file:
            other = Path(f"/proc/self/fd/{file.fileno()}")
            yield str(other if other.exists() else path)
    else:
        yield str(path)


def _length(found: Survey, there: int) -> int:
    """Frames that the file holds, the padding of its last block not counted for one."""
    layout = found.layout
    if layout.frames <= there:
        return there
    rest = found.read(there, layout.frames - there)
    return there + without_padding(rest, max(0, layout.sure - there))


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

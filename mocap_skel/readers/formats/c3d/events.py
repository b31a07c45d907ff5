"""Events of a C3D file: the EVENT group, or those in the header where there is no such group.

Format: The C3D File Format User Guide, Motion Lab Systems: "EVENT group" and "C3D header events".
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mocap_skel.readers.formats.c3d.contents import decoded, number, texts
from mocap_skel.readers.formats.c3d.frames import unsigned
from mocap_skel.readers.formats.c3d.machine import numbers
from mocap_skel.readers.formats.c3d.survey import Survey
from mocap_skel.readers.raw import RawEvent

_Array = NDArray[np.float64]

# The header's word 150 where its events have labels of four letters, and how many it holds.
_KEY, _MOST = 12345, 18
# Bytes of the header: that word, the number of events, their times, their labels.
_AT_KEY, _AT_TIMES, _AT_LABELS = 298, 304, 396


def events_of(found: Survey) -> tuple[tuple[RawEvent, ...], tuple[str, ...]]:
    """The events of a file, and what there is to say about them.

    Args:
        found: what is known of the file.
    """
    group = found.section.groups.get("EVENT", {})
    events, note = _of_group(group)
    return tuple(events or _of_header(found)), (note,) if note else ()


def _of_group(group: dict[str, Any]) -> tuple[list[RawEvent], str]:
    labels = texts(group, "LABELS")
    said = unsigned(group["USED"]) if len(np.atleast_1d(group.get("USED", ()))) else len(labels)
    if not said:
        return [], ""
    times = _times(group, max(said, len(labels)))
    count = min(said, len(labels), len(times))
    contexts, subjects = texts(group, "CONTEXTS"), texts(group, "SUBJECTS")
    events = [
        RawEvent(
            float(times[i]), labels[i],
            contexts[i] if i < len(contexts) else "", subjects[i] if i < len(subjects) else "",
        )
        for i in range(count)
        if np.isfinite(times[i]) and labels[i].isprintable()
    ]  # fmt: skip
    lost = said - len(events)
    return events, f"events that cannot be read: {lost} of {said}" if lost > 0 else ""


def _times(group: dict[str, Any], count: int) -> _Array:
    """(events,) seconds. Each event has minutes and seconds; some files give seconds alone."""
    flat = np.concatenate(_numbers(group, "TIMES")) if "TIMES" in group else np.empty(0)
    if len(flat) < 2 * count and len(flat) <= count:
        return flat
    pairs = flat[: len(flat) // 2 * 2].reshape(-1, 2)
    if not _minutes(pairs[:, 0]) and _minutes(flat[: len(pairs)]):
        # All minutes stand before all seconds.
        pairs = flat[: 2 * len(pairs)].reshape(2, -1).T
    return np.asarray(60.0 * pairs[:, 0] + pairs[:, 1])


def _minutes(values: _Array) -> bool:
    return bool((values >= 0).all() and (values == np.round(values)).all())


def _numbers(group: dict[str, Any], name: str) -> list[_Array]:
    """The numbers of a parameter and of its continuations: one holds up to 255 events."""
    names = [name, *(f"{name}{i}" for i in range(2, 258))]
    values = [group[part] for part in names if part in group and not isinstance(group[part], list)]
    return [np.asarray(value, dtype=np.float64).ravel() for value in values] or [np.empty(0)]


def _of_header(found: Survey) -> list[RawEvent]:
    """Events in the header: seconds, and labels of four letters."""
    with found.path.open("rb") as file:
        file.seek(found.base)
        head = file.read(512)
    machine = found.section.machine
    key, count = numbers(head[_AT_KEY : _AT_KEY + 4], "u2", machine)
    if key != _KEY or not 0 < count <= _MOST:
        return []
    times = numbers(head[_AT_TIMES : _AT_TIMES + 4 * int(count)], "f4", machine)
    labels = [
        decoded(head[at : at + 4]) for at in range(_AT_LABELS, _AT_LABELS + 4 * int(count), 4)
    ]
    return [
        RawEvent(number(time), label)
        for time, label in zip(times, labels, strict=True)
        if label and label.isprintable() and np.isfinite(time)
    ]

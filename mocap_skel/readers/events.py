"""From the moments that a file names to the events of a clip: which frame each is in."""

from __future__ import annotations

from collections.abc import Iterable

from mocap_skel.events import Event
from mocap_skel.readers.raw import RawEvent
from mocap_skel.text import printable


def events(
    raw: Iterable[RawEvent], rate: float, first_frame: int, frames: int, notes: list[str]
) -> tuple[Event, ...]:
    """The events of a clip in their order in time; a note says what is left out.

    Times count from frame 1, as Vicon writes them. Where no event would lie in the clip then, but all would if
    they counted from its first frame, they do.

    Args:
        raw: what the file names.
        rate: frames a second.
        first_frame, frames: the clip's.
        notes: what was decided is added to them.

    >>> events([RawEvent(0.5, "Foot Strike", "Left")], 100.0, 1, 300, [])[0].frame
    51
    >>> said = []
    >>> events([RawEvent(0.5, "Foot Strike", "Left")], 100.0, 400, 300, said)[0].frame, said
    (450, ['the times of its events are taken to count from its first frame'])
    """
    raw = sorted(raw, key=lambda event: event.time)
    numbers = [round(event.time * rate) + 1 for event in raw]

    def inside(number: int) -> bool:
        return first_frame <= number < first_frame + frames

    start = 0
    if raw and not any(map(inside, numbers)) and all(inside(n + first_frame - 1) for n in numbers):
        start = first_frame - 1
        notes.append("the times of its events are taken to count from its first frame")
    found = [
        # Files hold them as floats of 32 bits.
        Event(
            round(event.time + start / rate, 6),
            number + start,
            printable(event.label),
            printable(event.context),
            printable(event.subject),
        )
        for event, number in zip(raw, numbers, strict=True)
        if inside(number + start)
    ]
    if len(found) < len(raw):
        notes.append(
            f"events outside its frames, which are left out: {len(raw) - len(found)} of {len(raw)}"
        )
    return tuple(found)

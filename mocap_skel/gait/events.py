"""The foot events of a fit: those of its file, or found ones where the file has none."""

from __future__ import annotations

from dataclasses import dataclass

from mocap_skel.clip import Clip
from mocap_skel.events import Event
from mocap_skel.skeleton_fit import SkeletonFit

BY = ("auto", "file", "found")
"""Which events count: the file's, or found ones where it has none; the file's alone; found ones alone."""


@dataclass(frozen=True, eq=False)
class FootEvents:
    """Events of one subject.

    Attributes:
        events: in their order in time, those of the file that are of no foot too.
        notes: where they come from, or why there are none, one sentence each.
    """

    events: tuple[Event, ...]
    notes: tuple[str, ...]

    @property
    def of_feet(self) -> tuple[Event, ...]:
        """Those in which a foot of a known side strikes the ground or leaves it."""
        return tuple(event for event in self.events if event.side and event.foot)


EVENT_COLUMNS = ("frame", "time", "event", "side", "context", "subject", "source", "method")
"""Of events.csv, and the keys of an event in JSON; time in seconds."""


def event_row(event: Event) -> dict[str, object]:
    """An event as a row of events.csv and of JSON: see `EVENT_COLUMNS`."""
    return {
        "frame": event.frame, "time": event.time, "event": event.label, "side": event.side,
        "context": event.context, "subject": event.subject, "source": event.source, "method": event.method,
    }  # fmt: skip


def own_events(clip: Clip, subject: str) -> tuple[Event, ...]:
    """The events of the file that are of one subject: all but those of another one of the clip."""
    others = {name for name in clip.subject_names if name != subject}
    return tuple(event for event in clip.events if event.subject not in others - {""})


def foot_events(fit: SkeletonFit, clip: Clip, by: str = "auto") -> FootEvents:
    """The events of a fit.

    Args:
        fit: of one subject.
        clip: what was fitted.
        by: one of `BY`.

    Raises:
        ValueError: `by` is none of them.

    >>> from mocap_skel import associate, fit_skeleton, read_association, read_clip
    >>> clip, cmu = read_clip("sample_data/nearly_still.c3d"), read_association("cmu")
    >>> foot_events(fit_skeleton(clip, associate(clip, cmu)[0], cmu.skeleton), clip).notes
    ('the file has no foot events, and none are found: no foot swings and stands by turns',)
    """
    if by not in BY:
        raise ValueError(f"events are one of {BY}, got {by!r}")
    told = FootEvents(own_events(clip, fit.subject) if by != "found" else (), ())
    if told.of_feet:
        return told
    without = "the file has no foot events" if by != "found" else "events of the file do not count"
    if by == "file":
        return FootEvents(told.events, (without,))
    # Events of the file alone need none of what it imports.
    from mocap_skel.gait.contacts import find_contacts

    found = find_contacts(fit)
    events = tuple(sorted((*told.events, *found.events), key=lambda event: event.time))
    if not found.events:
        return FootEvents(events, (f"{without}, and none are found: {found.why_none}",))
    methods = " and ".join(sorted({event.method for event in found.events}))
    ground = f"; the ground goes back at {-found.ground:.2f} m/s" if found.ground < 0 else ""
    return FootEvents(
        events, (f"{without}: {len(found.events)} foot contacts are found ({methods}{ground})",)
    )

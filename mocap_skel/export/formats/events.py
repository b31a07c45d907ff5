"""Events: those of the file, and foot contacts that were found where it has none, as CSV."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mocap_skel.export.registry import Options, Rendered, Source, register

if TYPE_CHECKING:
    from mocap_skel.skeleton_fit import SkeletonFit

SUFFIX = ".events.csv"


@dataclass(frozen=True)
class EventOptions(Options):
    """Nothing can be told."""


@register(
    "events",
    suffixes=(SUFFIX,),
    options=EventOptions,
    makes=f"walk{SUFFIX}, the events of the file, or foot contacts of gait that were found",
    lacks="a table of events has moments only",
)
def write(fit: SkeletonFit, options: EventOptions, source: Source) -> Rendered:
    """The events of a subject; a head without rows, and a note why, where there are none."""
    from mocap_skel.export.tables_csv import rows_csv
    from mocap_skel.gait.events import EVENT_COLUMNS, event_row, foot_events

    del options
    found = foot_events(fit, source.clip)
    notes = tuple(f"events: {note}" for note in found.notes)
    return Rendered(
        {SUFFIX: rows_csv([event_row(event) for event in found.events], EVENT_COLUMNS)}, notes
    )

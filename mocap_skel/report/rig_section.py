"""The page's part about the rigid figure: how good it is, segment by segment, and how it was made."""

from __future__ import annotations

from collections.abc import Iterable

from mocap_skel.report.inline import text
from mocap_skel.report.looks import ALARM
from mocap_skel.report.moving import Moving
from mocap_skel.report.rig_table import COLUMNS, Column, alarming, rig_summary
from mocap_skel.rig.quality import Quality, SegmentQuality

# What a card on a phone has in its first line.
_FIRST = ("marker_rms", "turn_speed")


def rig_section(moving: Moving) -> str:
    """A summary, the table, and the notes folded; where there is no rigid figure, why not."""
    quality = moving.quality
    if quality is None:
        return "".join(f"<p>{text(note)}</p>" for note in moving.notes)
    summary = rig_summary(quality)
    return (
        f"<p>{text(summary[0].upper() + summary[1:])}. A number of a frame goes there.</p>"
        f'<div class="wide"><table id="rig-table">{_table(quality)}</table></div>'
        f"{_folded(moving.notes)}"
    )


def _folded(notes: Iterable[str]) -> str:
    items = "".join(f"<li>{text(note)}</li>" for note in notes)
    return f"<details><summary>How it was made</summary><ul>{items}</ul></details>" if items else ""


def _table(quality: Quality) -> str:
    # What no segment has says nothing.
    columns = [c for c in COLUMNS if any(c.show(one) for one in quality.segments)]
    head = "".join(f'<th scope="col">{text(column.title)}</th>' for column in columns)
    # What to look at stands first.
    ordered = sorted(quality.segments, key=lambda one: not one.look_at)
    rows = "".join(f"<tr>{''.join(_cell(c, one) for c in columns)}</tr>" for one in ordered)
    return f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody>"


def _cell(column: Column, one: SegmentQuality) -> str:
    shown = text(column.show(one))
    if column.head == "segment":
        return f'<th scope="row">{shown}</th>'
    alarm = alarming(column, one)
    classes = " ".join(
        name for name, is_so in (("alarm", alarm), ("first", column.value in _FIRST)) if is_so
    )
    if column.frame and shown:
        shown = f'<button data-frame="{shown}">{shown}</button>'
    sign = f'<span class="sign">{ALARM.sign}</span>' if alarm else ""
    of = f' class="{classes}"' if classes else ""
    return f'<td{of} data-head="{text(column.title)}">{sign}{shown}</td>'

"""The page's part about the rigid figure: how good it is, segment by segment, and how it was made."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from mocap_skel.report.inline import text
from mocap_skel.report.looks import ALARM
from mocap_skel.report.moving import Moving
from mocap_skel.report.rig_table import COLUMNS, Column, alarming, rig_summary
from mocap_skel.rig.quality import SegmentQuality
from mocap_skel.text import counted

# What a card on a phone has in its first line.
_FIRST = ("marker_rms", "turn_speed")


def rig_section(moving: Moving) -> str:
    """A summary, the segments to look at, the others and the notes folded; without a rigid figure, why there is none."""
    quality = moving.quality
    if quality is None:
        return "".join(f"<p>{text(note)}</p>" for note in moving.notes)
    summary = rig_summary(quality)
    # What no segment has says nothing.
    columns = [c for c in COLUMNS if any(c.show(one) for one in quality.segments)]
    others = [one for one in quality.segments if not one.look_at]
    return (
        f"<p>{text(summary[0].upper() + summary[1:])}. A number of a frame goes there.</p>"
        f"{_table(columns, quality.look_at)}{_others(columns, others, bool(quality.look_at))}{_folded(moving.notes)}"
    )


def _others(columns: Sequence[Column], rows: Sequence[SegmentQuality], some: bool) -> str:
    """The segments that nobody has to look at, folded."""
    if not rows:
        return ""
    title = f"{'The other' if some else 'All'} {counted(len(rows), 'segment')}"
    return f"<details><summary>{title}</summary>{_table(columns, rows)}</details>"


def _folded(notes: Iterable[str]) -> str:
    items = "".join(f"<li>{text(note)}</li>" for note in notes)
    return f"<details><summary>How it was made</summary><ul>{items}</ul></details>" if items else ""


def _table(columns: Sequence[Column], segments: Sequence[SegmentQuality]) -> str:
    if not segments:
        return ""
    head = "".join(f'<th scope="col">{text(column.title)}</th>' for column in columns)
    rows = "".join(f"<tr>{''.join(_cell(c, one) for c in columns)}</tr>" for one in segments)
    return f'<div class="wide"><table class="rig-table"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'


def _cell(column: Column, one: SegmentQuality) -> str:
    shown = text(column.show(one))
    if column.head == "segment":
        return f'<th scope="row">{shown}</th>'
    alarm = alarming(column, one)
    classes = " ".join(
        name for name, is_so in (("alarm", alarm), ("first", column.value in _FIRST)) if is_so
    )
    if column.frame and shown:
        shown = f'<button data-frame="{shown}" aria-label="Go to frame {shown}">{shown}</button>'
    sign = f'<span class="sign">{ALARM.sign}</span>' if alarm else ""
    of = f' class="{classes}"' if classes else ""
    return f'<td{of} data-head="{text(column.title)}">{sign}{shown}</td>'

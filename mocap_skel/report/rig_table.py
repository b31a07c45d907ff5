"""The table rig quality: how good the rigid figure is, segment by segment, for terminal and page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from mocap_skel.report.looks import ALARM
from mocap_skel.report.terminal import sentence, table
from mocap_skel.rig.quality import Quality, SegmentQuality
from mocap_skel.text import counted


@dataclass(frozen=True)
class Column:
    """A column of the table.

    Attributes:
        head: what stands above it in a terminal.
        title: what it is called where there is room.
        value: an attribute of a segment's quality, which decides whether a person should look at the cell.
        show: the cell's text; "" for what is not there.
        frame: the attribute that has the number of the frame that it is about; "" for none.
        wide: whether it is in the wide table only.
    """

    head: str
    title: str
    value: str
    show: Callable[[SegmentQuality], str]
    frame: str = ""
    wide: bool = False


def _scaled(
    value: str, factor: float, digits: int = 1, *, blank: bool = False
) -> Callable[[SegmentQuality], str]:
    def show(one: SegmentQuality) -> str:
        found = getattr(one, value)
        return "" if found is None or (blank and not found) else f"{factor * found:.{digits}f}"

    return show


def _plain(value: str) -> Callable[[SegmentQuality], str]:
    def show(one: SegmentQuality) -> str:
        return str(getattr(one, value) or "")

    return show


COLUMNS = (
    Column("segment", "segment", "", _plain("segment")),
    Column("joint", "joint", "", _plain("joint"), wide=True),
    Column("rms", "markers off, rms mm", "marker_rms", _scaled("marker_rms", 1e3)),
    Column("filtered", "filtered, rms mm", "", _scaled("filtered_rms", 1e3), wide=True),
    Column("worst", "worst mm", "worst", _scaled("worst", 1e3, 0)),
    Column("frame", "worst in frame", "", _plain("worst_frame"), "worst_frame"),
    Column("deg/s", "turns deg/s", "turn_speed", _scaled("turn_speed", 1.0, 0)),
    Column("frame", "turns in frame", "", _plain("turn_frame"), "turn_frame"),
    Column("skates", "skates mm/s", "skating", _scaled("skating", 1e3, 0)),
    Column("own", "its markers mm/s", "", _scaled("marker_skating", 1e3, 0), wide=True),
    Column("floor cm", "from floor cm", "floor_distance", _scaled("floor_distance", 1e2)),
    Column("filled", "frames filled", "", _plain("filled")),
    Column("guessed s", "guessed s", "guessed", _scaled("guessed", 1.0, 2, blank=True), wide=True),
    Column("repaired", "frames repaired", "repaired", _plain("repaired")),
    Column("lost", "frames without it", "absent", _plain("absent")),
    Column("marker", "worst marker", "", _plain("worst_marker")),
)
# Characters of a line of the narrow table: all columns, where names are as long as the human's.
LINE = 99
# Columns of text; the others are numbers.
_WORDS = ("segment", "joint", "marker")


def rig_table(quality: Quality, formats: Sequence[str], *, wide: bool = False) -> str:
    """A line that sums up a rigid figure, then one row a segment.

    Millimetres; what a person should look at has a sign before it.

    Args:
        quality: of the figure.
        formats: that hold it, by name.
        wide: all segments and all columns; else the segments that a person should look at, in `LINE` characters.
    """
    title = sentence(f"rig quality ({', '.join(formats)}): {rig_summary(quality)}", LINE)
    rows = quality.segments if wide else quality.look_at
    if not rows:
        return title
    cells = [(column, [marked(column, one) for one in rows]) for column in COLUMNS]
    # What no row has says nothing, and lines are short.
    kept = [(c, own) for c, own in cells if wide or (not c.wide and any(own))]
    left = frozenset(i for i, (column, _) in enumerate(kept) if column.head in _WORDS)
    body = list(zip(*(own for _, own in kept), strict=True))
    return f"{title}\n{table([c.head for c, _ in kept], body, left, 0 if wide else LINE)}"


def alarming(column: Column, one: SegmentQuality) -> bool:
    """Whether a person should look at a cell."""
    # A guess is a part of what is filled, which a narrow table has alone.
    return column.value in one.look_at or (column.head == "filled" and "guessed" in one.look_at)


def marked(column: Column, one: SegmentQuality) -> str:
    """A cell's text, with a sign before what a person should look at."""
    return f"{ALARM.sign if alarming(column, one) else ''}{column.show(one)}"


def rig_summary(quality: Quality) -> str:
    """How good a figure is, in part of a sentence."""
    parts = []
    if quality.marker_rms is not None:
        after = (
            "" if quality.filtered_rms is None else f" ({1e3 * quality.filtered_rms:.1f} filtered)"
        )
        parts.append(f"markers {1e3 * quality.marker_rms:.1f} mm off{after}")
    if quality.floor_distance is not None:
        parts.append(f"soles {100 * quality.floor_distance:.1f} cm from the floor")
    if quality.figure < quality.frames:
        parts.append(f"whole in {quality.figure} of {quality.frames} frames")
    some = quality.look_at
    look = f"{ALARM.sign} look at {len(some)} of {counted(len(quality.segments), 'segment')}"
    parts.append(look if some else "nothing to look at")
    return ", ".join(parts)

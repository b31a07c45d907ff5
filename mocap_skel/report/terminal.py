"""Plain-text tables for the terminal."""

from __future__ import annotations

import textwrap
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from mocap_skel.clip import Clip
from mocap_skel.joints.joint_fit import JointFit
from mocap_skel.skeleton_fit import SkeletonFit
from mocap_skel.text import counted, listed, visible

if TYPE_CHECKING:
    from mocap_skel.joints.calibration import Calibrated

# Characters of a line of the joint table and of the sentences below it.
WIDTH = 100
# Characters that a last column keeps, however long the names before it are. Picked by eye.
_LEAST = 20


def table(
    head: Sequence[str], rows: Sequence[Sequence[str]], left: frozenset[int], width: int = 0
) -> str:
    """Rows as columns with two blanks between them.

    Args:
        head: the name of each column.
        rows: the cells; each row is as long as the head.
        left: indices of the columns that are aligned at the left; the others are numbers.
        width: characters of a line. What is too long in the last column goes on below, in the same column.
            0 = a line may have any length.

    >>> print(table(("joint", "why"), [("Knee", "turns about one axis only")], frozenset({0, 1}), 28))
    joint  why
    Knee   turns about one axis
           only
    """
    widths = [max(len(row[i]) for row in [head, *rows]) for i in range(len(head))]
    if width:
        room = max(width - sum(widths[:-1]) - 2 * len(widths[:-1]), _LEAST)
        rows = [line for row in rows for line in _continued(row, room)]
    lines = (
        "  ".join(
            cell.ljust(column) if i in left else cell.rjust(column)
            for i, (cell, column) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in [head, *rows]
    )
    return "\n".join(lines)


def _continued(row: Sequence[str], room: int) -> Iterator[tuple[str, ...]]:
    """The row, and below it rows with the words that its last column has no room for."""
    *cells, last = row
    first, *more = textwrap.wrap(last, room, break_on_hyphens=False) or [""]
    yield (*cells, first)
    yield from ((*[""] * len(cells), words) for words in more)


def sentence(words: str, width: int = WIDTH) -> str:
    """A sentence in lines of so many characters; what follows the first is indented."""
    return textwrap.fill(
        words, width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False
    )


def rows_table(rows: Sequence[Mapping[str, object]]) -> str:
    """Rows of a study as a table. All have the columns of the first; numbers have four digits."""
    columns = list(rows[0]) if rows else []
    cells = [[_short(row[name]) for name in columns] for row in rows]
    words = (i for i, name in enumerate(columns) if rows and isinstance(rows[0][name], str))
    return table([name.replace("_", " ") for name in columns], cells, frozenset(words))


def _short(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if np.isfinite(value) else "-"
    return "-" if value is None else str(value)


# The columns of every joint table, and those that a wide one has besides.
_ALWAYS = ("joint", "shown", "method", "motion %", "s.e. mm", "residual mm")
_WIDE = ("markers", "samples", "radius cm", "sigma mm", "weakest cm", "theta", "axis ±")
JOINT_HEAD = (*_ALWAYS, *_WIDE, "why")


def joint_table(fit: SkeletonFit, clip: str, *, wide: bool = False) -> str:
    """A line about the clip, one row a joint with its evidence, a line that counts the joints.

    Args:
        fit: of one subject.
        clip: what the first line calls the clip.
        wide: all columns, in lines of any length; else the most important ones, in `WIDTH` characters.
    """
    who = f" {fit.subject}" if fit.subject else ""
    verdicts = Counter(joint.shown for joint in fit.joints if joint.fitted)
    counts = ", ".join(f"{verdicts[v]} {v}" for v in ("yes", "weak", "no"))
    title = (
        f"{clip}{who}: {len(fit.frame_numbers)} frames at {fit.rate:g} Hz, "
        f"marker noise {1e3 * fit.sigma:.2f} mm"
    )
    rows = _joints([joint_cells(joint) for joint in fit.joints], "why", wide)
    counted_joints = f"{sum(verdicts.values())} of {len(fit.joints)} joints fitted; shown: {counts}"
    return f"{title}\n{rows}\n{counted_joints}"


def joint_cells(joint: JointFit) -> tuple[str, ...]:
    """A joint's evidence as people read it, one cell a column of `JOINT_HEAD`.

    The standard error (s.e.) is that of the direction in which the centre is known least.
    """
    if not joint.fitted:
        return (joint.joint, *["-"] * (len(JOINT_HEAD) - 2), joint.reason)
    return (
        joint.joint,
        joint.shown,
        joint.method,
        f"{100 * joint.share:.0f}",
        f"{1e3 * joint.worst_error:.1f}",
        _number(1e3 * joint.residual, ".1f"),
        str(len(joint.markers)),
        str(joint.samples),
        "/".join(f"{100 * r:.1f}" for r in (joint.radius.min(), joint.radius.max()))
        if len(joint.radius)
        else "-",
        _number(1e3 * joint.sigma, ".1f"),
        _number(100 * joint.weakest_sd, ".1f"),
        _number(np.degrees(joint.angle), ".0f", "°"),
        "-"
        if joint.turns_on is None
        else _number(np.degrees(joint.turns_on.standard_error), ".0f", "°"),
        joint.reason,
    )


def _joints(rows: Sequence[tuple[str, ...]], last: str, wide: bool) -> str:
    """Rows of all columns as a wide or a narrow table; `last` is the name of the last column."""
    if not wide:
        rows = [(*row[: len(_ALWAYS)], row[-1]) for row in rows]
    head = (*_ALWAYS, *(_WIDE if wide else ()), last)
    return table(head, rows, frozenset({0, 1, 2, len(head) - 1}), 0 if wide else WIDTH)


def _number(value: float, form: str, unit: str = "") -> str:
    return f"{value:{form}}{unit}" if np.isfinite(value) else "-"


def calibration_table(done: Calibrated, *, wide: bool = False) -> str:
    """One row a joint of all clips together; the last column tells how much of it each clip gave.

    Args:
        done: what the clips show.
        wide: as in `joint_table`.
    """
    clips = done.calibration.clips
    rows = [(*joint_cells(one.joint)[:-1], _shares(one.shares)) for one in done.joints]
    frames = ", ".join(f"{visible(clip.clip)} {clip.frames} frames" for clip in clips)
    title = sentence(f"{counted(len(clips), 'clip')} of one actor: {frames}")
    return f"{title}\n{_joints(rows, 'from', wide)}"


def _shares(shares: Mapping[str, float]) -> str:
    """Clips that gave a part of a joint that can be written in whole per cent."""
    parts = [
        f"{visible(clip)} {100 * share:.0f} %" for clip, share in shares.items() if share >= 0.005
    ]
    return ", ".join(parts) or "-"


def clip_table(clip: Clip, markers: Sequence[dict[str, object]]) -> str:
    """A clip's facts, then one row a marker.

    Args:
        clip: as it was read.
        markers: the rows of `results.inspection.marker_rows`.
    """
    head = [
        f"{visible(clip.name)}: {clip.frames} frames at {clip.rate:g} Hz, first frame {clip.first_frame}, "
        f"unit {clip.unit}, {clip.up} up",
        f"{len(clip.labels)} markers, {100 * float(clip.missing().mean()):.1f} % of samples missing",
    ]
    subjects = [name for name in clip.subject_names if name]
    if subjects:
        head.append(f"subjects: {', '.join(subjects)}")
    if clip.events:
        labels = dict.fromkeys(event.label for event in clip.events)
        first, last = clip.events[0].frame, clip.events[-1].frame
        head.append(
            f"{counted(len(clip.events), 'event')} in frames {first} to {last}: {listed(labels)}"
        )
    head += [f"note: {note}" for note in clip.notes]
    columns = list(markers[0])
    rows = [[_cell(row[key]) for key in columns] for row in markers]
    names = [column.replace("_", " ") for column in columns]
    numeric = {"missing"}
    left = frozenset(i for i, column in enumerate(columns) if column not in numeric)
    return "\n".join([*head, table(names, rows, left)])


def _cell(value: object) -> str:
    return f"{100 * value:.1f} %" if isinstance(value, float) else str(value or "-")

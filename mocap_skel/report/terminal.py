"""Plain-text tables for the terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from mocap_skel.clip import Clip
from mocap_skel.joints.joint_fit import JointFit
from mocap_skel.skeleton_fit import SkeletonFit

if TYPE_CHECKING:
    from mocap_skel.joints.calibration import Calibrated


def table(head: Sequence[str], rows: Sequence[Sequence[str]], left: frozenset[int]) -> str:
    """Columns set out with blanks; those whose index is in `left` start at the left."""
    widths = [max(len(row[i]) for row in [head, *rows]) for i in range(len(head))]
    lines = (
        "  ".join(
            cell.ljust(width) if i in left else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in [head, *rows]
    )
    return "\n".join(lines)


def rows_table(rows: Sequence[Mapping[str, object]]) -> str:
    """Rows that all have the columns of the first, numbers to four digits."""
    columns = list(rows[0]) if rows else []
    cells = [[_short(row[name]) for name in columns] for row in rows]
    words = (i for i, name in enumerate(columns) if rows and isinstance(rows[0][name], str))
    return table([name.replace("_", " ") for name in columns], cells, frozenset(words))


def _short(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if np.isfinite(value) else "-"
    return "-" if value is None else str(value)


JOINT_HEAD = (
    "joint", "known", "method", "markers", "samples", "radius cm", "residual mm", "sigma mm",
    "weakest cm", "theta", "motion", "s.e. mm", "why",
)  # fmt: skip


def joint_table(fit: SkeletonFit, clip: str) -> str:
    """One line a joint with its evidence; the standard error is that of the worst direction."""
    who = f" {fit.subject}" if fit.subject else ""
    verdicts = Counter(joint.shown for joint in fit.joints if joint.fitted)
    counts = ", ".join(f"{verdicts[v]} {v}" for v in ("yes", "weak", "no"))
    head = (
        f"{clip}{who}: {len(fit.frame_numbers)} frames at {fit.rate:g} Hz, "
        f"{sum(verdicts.values())} of {len(fit.joints)} joints fitted; known: {counts}; "
        f"marker noise {1e3 * fit.sigma:.2f} mm"
    )
    rows = [joint_cells(joint) for joint in fit.joints]
    return f"{head}\n{table(JOINT_HEAD, rows, frozenset({0, 1, 2, 12}))}"


def joint_cells(joint: JointFit) -> tuple[str, ...]:
    """A joint's evidence as people read it, one cell a column of `JOINT_HEAD`."""
    if not joint.fitted:
        return (joint.joint, "-", "-", *["-"] * 9, joint.reason)
    return (
        joint.joint,
        joint.shown,
        joint.method,
        str(len(joint.markers)),
        str(joint.samples),
        "/".join(f"{100 * r:.1f}" for r in (joint.radius.min(), joint.radius.max()))
        if len(joint.radius)
        else "-",
        _known(1e3 * joint.residual, ".1f"),
        _known(1e3 * joint.sigma, ".1f"),
        _known(100 * joint.weakest_sd, ".1f"),
        _known(np.degrees(joint.angle), ".0f", "°"),
        f"{100 * joint.share:.0f} %",
        f"{1e3 * joint.worst_error:.1f}",
        joint.reason,
    )


def _known(value: float, form: str, unit: str = "") -> str:
    return f"{value:{form}}{unit}" if np.isfinite(value) else "-"


def calibration_table(done: Calibrated) -> str:
    """One line a joint of all clips together, and how much of it each clip gave."""
    names = [clip.clip for clip in done.calibration.clips]
    head = (*JOINT_HEAD[:-1], *names)
    rows = [
        (
            *joint_cells(found.joint)[:-1],
            *(f"{100 * found.shares.get(name, 0.0):.0f} %" for name in names),
        )
        for found in done.joints
    ]
    frames = ", ".join(f"{c.clip} {c.frames} frames" for c in done.calibration.clips)
    title = f"{len(names)} clip{'s' if len(names) > 1 else ''} of one actor: {frames}"
    return f"{title}\n{table(head, rows, frozenset({0, 1, 2}))}"


def clip_table(clip: Clip, markers: Sequence[dict[str, object]]) -> str:
    """A clip's facts, then one line a marker."""
    head = [
        f"{clip.name}: {clip.frames} frames at {clip.rate:g} Hz, first frame {clip.first_frame}, "
        f"unit {clip.unit}, {clip.up} up",
        f"{len(clip.labels)} markers, {100 * float(clip.missing().mean()):.1f} % of samples missing",
    ]
    subjects = [name for name in clip.subject_names if name]
    if subjects:
        head.append(f"subjects: {', '.join(subjects)}")
    head += [f"note: {note}" for note in clip.notes]
    columns = list(markers[0])
    rows = [[_cell(row[key]) for key in columns] for row in markers]
    names = [column.replace("_", " ") for column in columns]
    numeric = {"missing"}
    left = frozenset(i for i, column in enumerate(columns) if column not in numeric)
    return "\n".join([*head, table(names, rows, left)])


def _cell(value: object) -> str:
    return f"{100 * value:.1f} %" if isinstance(value, float) else str(value or "-")

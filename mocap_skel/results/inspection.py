"""The markers of a clip one by one: how much of each is missing, and what an association makes of it."""

from __future__ import annotations

from collections.abc import Sequence

from mocap_skel.clip import Clip
from mocap_skel.labels.association import Assignment


def marker_rows(clip: Clip, assignments: Sequence[Assignment]) -> list[dict[str, object]]:
    """One row a label of the clip.

    Args:
        clip: as it was read.
        assignments: which label is which marker, of every subject; empty without an association file.

    Returns:
        In each row `subject`, `label` and `missing`, the share of frames (0 to 1) in which it is missing. With
        assignments also `marker` and `segment`, None for a label that is no marker.
    """
    match = {
        column: (marker, segment)
        for assignment in assignments
        for segment, columns in assignment.columns.items()
        for marker, column in columns.items()
    }
    missing = clip.missing()
    rows = []
    for column, (label, subject) in enumerate(zip(clip.labels, clip.subjects, strict=True)):
        row: dict[str, object] = {
            "subject": subject,
            "label": label,
            "missing": round(float(missing[column]), 4),
        }
        if assignments:
            row["marker"], row["segment"] = match.get(column, (None, None))
        rows.append(row)
    return rows

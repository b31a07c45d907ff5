"""A clip's markers one by one, with what an association file makes of them."""

from __future__ import annotations

from collections.abc import Sequence

from mocap_skel.clip import Clip
from mocap_skel.labels.association import Assignment


def marker_rows(clip: Clip, assignments: Sequence[Assignment]) -> list[dict[str, object]]:
    """One row a marker: subject, label, share of frames in which it is missing, and its match.

    `marker` and `segment` are None for a label without a match; without assignments there are none.
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

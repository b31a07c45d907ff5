"""The table of `mocap-skel assoc check`, and the same as rows for JSON."""

from __future__ import annotations

import math

from mocap_skel.report.terminal import table
from mocap_skel.results.marker_check import AssociationCheck, MarkerCheck

_HEAD = ("marker", "label", "segment", "residual mm", "out of place", "first", "last", "verdict")


def check_table(check: AssociationCheck, clip: str) -> str:
    """One line a marker, then a line with what is wrong and what to do.

    Args:
        check: of one subject.
        clip: what the last line calls the clip.
    """
    subject = check.markers[0].subject if check.markers else ""
    head = f"{clip}{' ' if subject else ''}{subject}"
    rows = [_cells(one) for one in check.markers]
    return f"{table(_HEAD, rows, frozenset({0, 1, 2, 7}))}\n{head}: {check.summary()}"


def check_row(one: MarkerCheck, clip: str) -> dict[str, object]:
    """One marker as a row for JSON: lengths in metres, shares from 0 to 1, None = there is no value."""
    return {
        "clip": clip,
        "subject": one.subject,
        "marker": one.marker,
        "label": one.label,
        "segment": one.segment,
        "residual": round(one.residual, 6) if math.isfinite(one.residual) else None,
        "out_of_place": round(one.share, 6),
        "first": int(one.frames[0]) if len(one.frames) else None,
        "last": int(one.frames[-1]) if len(one.frames) else None,
        "verdict": one.verdict,
        "partner": one.partner or None,
        "moves_with": one.moves_with or None,
    }


def _cells(one: MarkerCheck) -> tuple[str, ...]:
    verdict = one.verdict
    if one.partner:
        verdict = verdict.replace("swapped", f"swapped with {one.partner}")
    elif one.moves_with:
        verdict += f"? it moves with {one.moves_with}"
    known = len(one.frames) > 0
    return (
        one.marker,
        one.label,
        one.segment,
        f"{1e3 * one.residual:.1f}" if math.isfinite(one.residual) else "-",
        f"{100 * one.share:.2g} %" if known else "-",
        str(one.frames[0]) if known else "-",
        str(one.frames[-1]) if known else "-",
        verdict,
    )

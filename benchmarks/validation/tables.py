"""The result as tables for the terminal, as CSV and as JSON."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from mocap_skel.report.terminal import table
from validation.estimates import METHODS, OURS
from validation.references import KINDS, TRUTH
from validation.scoring import ErrorRow, HalfRow, LengthRow


@dataclass
class ClipResult:
    """All that one clip gave.

    Attributes:
        name: the clip, with its folder.
        head: how it was read and associated.
        errors, lengths, halves: the rows.
        notes: one sentence each.
        failed: why nothing came of it, "" if something did.
    """

    name: str
    head: str = ""
    errors: list[ErrorRow] = field(default_factory=list)
    lengths: list[LengthRow] = field(default_factory=list)
    halves: list[HalfRow] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    failed: str = ""


def text(results: Sequence[ClipResult]) -> str:
    """Bones that were seen, every clip's tables, then the totals."""
    parts = bones_table(results)
    for one in results:
        lines = [f"{one.name}: {one.failed or one.head}"]
        lines += [f"note: {note}" for note in one.notes]
        if one.errors:
            lines.append(_error_table(one.errors))
        if one.lengths:
            lines.append(_length_table(one.lengths))
        if one.halves:
            lines.append(_half_table(one.halves))
        parts.append("\n".join(lines))
    return "\n\n".join([*parts, totals_text(results)]) + "\n"


def bones_table(results: Sequence[ClipResult]) -> list[str]:
    """How far each method is from bones that were seen, in millimetres, with the medians; nothing without any.

    Clips whose names begin alike, up to the first underscore, are of one person.
    """
    rows = [(one.name, r) for one in results for r in one.errors if r.kind == TRUTH]
    if not rows:
        return []
    people = {name.rpartition("/")[2].partition("_")[0] for name, _ in rows}
    cells = [
        (name.rpartition("/")[2], r.joint, *(_number(10 * r.errors[m]) for m in METHODS))
        for name, r in rows
    ]
    kinds = [r.joint.removeprefix("Left").removeprefix("Right") for _, r in rows]
    for kind in dict.fromkeys(kinds):
        here = [r for k, (_, r) in zip(kinds, rows, strict=True) if k == kind]
        medians = (_median([10 * r.errors[m] for r in here]) for m in METHODS)
        cells.append(("median", f"{kind}, {len(here)}", *(_number(m) for m in medians)))
    head = ("bones seen: error mm (RMS)", "joint", *METHODS)
    said = f"bones seen: {len(rows)} joints of {len(people)} persons"
    return [f"{said}\n{table(head, cells, frozenset({0, 1}))}"]


def _median(values: Sequence[float]) -> float:
    have = [v for v in values if np.isfinite(v)]
    return float(np.median(have)) if have else float("nan")


def _error_table(rows: Sequence[ErrorRow]) -> str:
    head = (
        "error cm (RMS)", "reference", "shown", *METHODS, "wander", "s.e.", "2 s.e.", "from",
    )  # fmt: skip
    cells = [
        (
            f"{r.subject + ':' if r.subject else ''}{r.joint}",
            r.kind if r.counts else f"({r.kind})",
            r.shown,
            *(_number(r.errors[m]) for m in METHODS),
            _number(r.wander),
            _number(r.worst_se),
            _yes(r.within_axes),
            r.source + ("" if r.own_parent else "; parent's pose is our fit's"),
        )
        for r in rows
    ]
    return table(head, cells, frozenset({0, 1, 2, len(head) - 2, len(head) - 1}))


def _length_table(rows: Sequence[LengthRow]) -> str:
    head = ("bone", "what", "mm", *METHODS)
    cells = [
        (
            f"{r.subject + ':' if r.subject else ''}{r.bone}",
            r.what,
            f"{r.reference:.0f}",
            *(_number(r.values[m]) for m in METHODS),
        )
        for r in rows
    ]
    return table(head, cells, frozenset({0, 1}))


def _half_table(rows: Sequence[HalfRow]) -> str:
    head = ("half against half mm", "shown", *METHODS)
    cells = [
        (
            f"{r.subject + ':' if r.subject else ''}{r.joint}",
            r.shown,
            *(_number(r.distances[m]) for m in METHODS),
        )
        for r in rows
    ]
    return table(head, cells, frozenset({0, 1}))


def totals(results: Sequence[ClipResult]) -> list[dict[str, Any]]:
    """One row a group and method: n, median, p90, worst; ours over the same cases beside it."""
    rows = [r for one in results for r in one.errors]
    counted = [r for r in rows if r.counts]
    groups: list[tuple[str, str, list[Mapping[str, float]]]] = [
        ("all joints", "cm", [r.errors for r in counted])
    ]
    for shown in ("yes", "weak", "no"):
        here = [r.errors for r in counted if r.shown == shown]
        groups.append((f"shown: {shown}", "cm", here))
    groups += [
        (kind, "cm", [r.errors for r in rows if r.kind == kind]) for kind in (*KINDS, "carried")
    ]
    bones = [r for one in results for r in one.lengths]
    groups += [
        (what, what[:2].strip(), [r.values for r in bones if r.what == what])
        for what in dict.fromkeys(r.what for r in bones)
    ]
    for shown in ("yes", "weak", "no", ""):
        here = [r.distances for one in results for r in one.halves if shown in ("", r.shown)]
        groups.append((f"halves, {'shown: ' + shown if shown else 'all'}", "mm", here))
    return [
        {"group": name, "unit": unit, "method": m, **_summary(values, m)}
        for name, unit, values in groups
        if values
        for m in METHODS
    ]


def _summary(values: Sequence[Mapping[str, float]], method: str) -> dict[str, Any]:
    have = [v for v in values if np.isfinite(v[method])]
    out: dict[str, Any] = {"n": len(have), "of": len(values)}
    if not have:
        return out
    mine = np.array([v[method] for v in have])
    ours = np.array([v[OURS] for v in have])
    out["median"], out["p90"] = float(np.median(mine)), float(np.quantile(mine, 0.9))
    out["mean"], out["worst"] = float(mine.mean()), float(mine.max())
    ours = ours[np.isfinite(ours)]
    out["ours_median"] = float(np.median(ours)) if len(ours) else float("nan")
    return out


def totals_text(results: Sequence[ClipResult]) -> str:
    """The totals, coverage of the standard errors, and what failed."""
    cells = [
        (
            row["group"] if row["method"] == OURS else "",
            row["unit"],
            row["method"],
            f"{row['n']}/{row['of']}",
            *(_number(row.get(key, np.nan)) for key in ("median", "p90", "mean", "worst")),
            _number(row.get("ours_median", np.nan)),
        )
        for row in totals(results)
    ]
    head = ("total", "unit", "method", "n", "median", "p90", "mean", "worst", "ours on the same")
    lines = [table(head, cells, frozenset({0, 1, 2})) if cells else "no reference found"]
    lines += [
        f"inside 2 s.e., {row['group']}: {row['axes']} of {row['n']} along every axis of the covariance, "
        f"{row['ellipsoid']} in the 95 % ellipsoid, {row['half']} in the 50 % one, {row['worst']} by the worst s.e."
        for row in coverage(results)
    ]
    failed = [one for one in results if one.failed]
    if failed:
        lines.append(f"not fitted: {', '.join(one.name for one in failed)}")
    return "\n".join(lines)


def coverage(results: Sequence[ClipResult]) -> list[dict[str, Any]]:
    """How many references lie within our standard errors, by verdict."""
    rows = [r for one in results for r in one.errors if r.counts and r.within_axes is not None]
    tests: dict[str, Callable[[ErrorRow], bool]] = {"all joints": lambda _: True}
    for shown in ("yes", "weak", "no"):
        tests[f"shown: {shown}"] = lambda r, shown=shown: r.shown == shown  # type: ignore[misc]
    out = []
    for group, test in tests.items():
        here = [r for r in rows if test(r)]
        if here:
            out.append(
                {
                    "group": group,
                    "n": len(here),
                    "axes": sum(bool(r.within_axes) for r in here),
                    "ellipsoid": sum(bool(r.within_ellipsoid) for r in here),
                    "half": sum(bool(r.within_half) for r in here),
                    "worst": sum(bool(r.within_worst) for r in here),
                }
            )
    return out


def as_json(results: Sequence[ClipResult]) -> str:
    """Everything as one object; NaN is null."""
    content = {
        "clips": [asdict(one) for one in results],
        "totals": totals(results),
        "coverage": coverage(results),
    }
    return json.dumps(_finite(content), ensure_ascii=False, indent=1, allow_nan=False) + "\n"


def as_csv(results: Sequence[ClipResult]) -> str:
    """One row a number: table, clip, subject, what, reference, shown, counts, method, value, unit."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(
        [
            "table",
            "clip",
            "subject",
            "what",
            "reference",
            "shown",
            "counts",
            "method",
            "value",
            "unit",
        ]
    )
    for one in results:
        for e in one.errors:
            row = ["error", e.clip, e.subject, e.joint, e.kind, e.shown, int(e.counts)]
            writer.writerows(_each(row, e.errors, "cm"))
        for b in one.lengths:
            row = ["bone", b.clip, b.subject, b.bone, b.what, "", ""]
            writer.writerows(_each(row, b.values, b.what[:2].strip()))
        for h in one.halves:
            row = ["half", h.clip, h.subject, h.joint, "", h.shown, ""]
            writer.writerows(_each(row, h.distances, "mm"))
    return out.getvalue()


def _each(row: list[Any], values: Mapping[str, float], unit: str) -> Iterable[list[Any]]:
    for method, value in values.items():
        yield [*row, method, f"{value:.4f}" if np.isfinite(value) else "", unit]


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(v) for v in value]
    if isinstance(value, float):
        return round(value, 6) if np.isfinite(value) else None
    return value


def _number(value: float) -> str:
    if not np.isfinite(value):
        return "-"
    return f"{value:.1f}" if value < 1e4 else ">10000"


def _yes(value: bool | None) -> str:
    return "-" if value is None else "in" if value else "out"

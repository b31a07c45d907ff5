"""What the studies found, as rows: their CSV, JSON and terminal tables are all made of these."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from mocap_skel.studies.accuracy import MarkersScore, NoiseScore, Score
from mocap_skel.studies.contenders import CONTENDERS
from mocap_skel.studies.resample import Answer, Group, Law, Summary
from mocap_skel.studies.speed import Ratio, Trial

Row = dict[str, Any]


def answer_rows(summary: Summary, answers: Iterable[Answer]) -> list[Row]:
    """One row a joint and refit, metres: all that figure 24 is drawn from; cluster and deviation None without a place."""
    told = zip(summary.cluster, summary.deviation, strict=True)
    known = dict(zip(summary.answers, told, strict=True))
    return [
        {
            "pass": answer.passed,
            **{key: value for key, value in asdict(answer).items() if key != "passed"},
            "cluster": int(known[answer][0]) if answer in known else None,
            "deviation": float(known[answer][1]) if answer in known else None,
        }
        for answer in answers
    ]


def mean_rows(groups: Iterable[Group], verdicts: Mapping[str, str]) -> list[Row]:
    """The thesis's table 2, metres; a joint of several answers has a row for each.

    `shown` says whether the movement of the whole clip shows the joint. Where it is "no", the scatter
    is that of a place holder.
    """
    return [
        {
            "joint": g.joint,
            "cluster": g.cluster,
            "answers": g.answers,
            **_axes("mean", g.mean),
            "shown": verdicts.get(g.joint, ""),
            "method": g.method,
            "frame": g.frame,
        }
        for g in groups
    ]


def deviation_rows(groups: Iterable[Group]) -> list[Row]:
    """The thesis's table 3, metres, about each cluster's own mean, and about one mean for all."""
    return [
        {
            "joint": g.joint,
            "cluster": g.cluster,
            "answers": g.answers,
            **_axes("sd", g.deviation),
            **_axes("sd_about_one_mean", g.single),
        }
        for g in groups
    ]


def law_rows(laws: Iterable[Law], verdicts: Mapping[str, str]) -> list[Row]:
    """The power law of each joint's deviations, metres, with the verdict of the whole clip."""
    return [{**asdict(law), "shown": verdicts.get(law.joint, "")} for law in laws]


def trial_rows(trials: Iterable[Trial]) -> list[Row]:
    """One row a point set, with the time of each estimator in seconds."""
    rows = []
    for trial in trials:
        row = asdict(trial)
        seconds = row.pop("seconds")
        rows.append({**row, **{f"{name}_seconds": value for name, value in seconds.items()}})
    return rows


def ratio_rows(ratios: Iterable[Ratio]) -> list[Row]:
    """One row an estimator: its time divided by GDKE's, and the thesis's."""
    return [_named(asdict(ratio)) for ratio in ratios]


def score_rows(scores: Iterable[Score]) -> list[Row]:
    """One row an estimator and cell, lengths in radii."""
    return [{**_named(asdict(score)), "breaks": score.breaks} for score in scores]


def noise_rows(scores: Iterable[NoiseScore]) -> list[Row]:
    """One row a way to know the noise matrix, lengths in radii."""
    rows = []
    for score in scores:
        row = asdict(score)
        x, y, z = row.pop("spread")
        rows.append({"sigma_x": x, "sigma_y": y, "sigma_z": z, **row})
    return rows


def marker_rows(scores: Iterable[MarkersScore]) -> list[Row]:
    """One row a way to fit two markers of different noise, lengths in the first's radius."""
    rows = []
    for score in scores:
        row = asdict(score)
        first, second = row.pop("noises")
        rows.append({"sigma_1": first, "sigma_2": second, **row})
    return rows


def _named(row: Row) -> Row:
    return {"method": CONTENDERS[row.pop("method")].label, **row}


def _axes(name: str, values: Sequence[float] | np.ndarray[Any, Any]) -> Row:
    return {f"{name}_{axis}": float(v) for axis, v in zip("xyz", values, strict=True)}

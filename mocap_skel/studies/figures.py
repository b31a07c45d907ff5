"""The figures of the studies, as PNG: the thesis's 24, 26 and 27, and where each estimator breaks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mocap_skel.report.figures import COLOURS, MARKS, figure, png
from mocap_skel.spherefit import largest_noise
from mocap_skel.studies.accuracy import BREAKS, NOTHING, Score
from mocap_skel.studies.contenders import CONTENDERS
from mocap_skel.studies.resample import ENOUGH, NEAR, Summary
from mocap_skel.studies.speed import METHODS, Trial


def deviations_figure(summary: Summary, caption: str) -> bytes:
    """Figure 24: every answer's deviation against its number of samples, with the fitted power law.

    Args:
        summary: of the answers.
        caption: below the figure.

    Returns:
        A PNG.
    """
    drawn = figure(10, 6.5)
    axes = drawn.subplots()
    samples = np.array([answer.samples for answer in summary.answers], dtype=np.float64)
    names = np.array([answer.joint for answer in summary.answers])
    # On its mean to rounding: nothing that a logarithmic axis could show.
    shown = (summary.deviation > 1e-9) & (samples > 0)
    for i, name in enumerate(dict.fromkeys(names)):
        mine = shown & (names == name)
        axes.plot(
            samples[mine], 100 * summary.deviation[mine], linestyle="none", label=name,
            marker=MARKS[i % len(MARKS)], markersize=3, color=COLOURS[i % len(COLOURS)], alpha=0.6,
        )  # fmt: skip
    law = summary.laws[-1]
    if np.isfinite(law.at_enough):
        ends = np.array([samples[shown].min(), samples[shown].max()])
        for slope, style, name in (
            (law.slope, "-", f"fitted: n^{law.slope:.2f}"),
            (-0.5, "--", "law of independent samples: n^-0.50"),
        ):
            line = 100 * law.at_enough * (ends / ENOUGH) ** slope
            axes.plot(ends, line, color="black", linestyle=style, label=name)
    axes.axhline(100 * NEAR, color="0.5", linewidth=0.8)
    axes.axvline(ENOUGH, color="0.5", linewidth=0.8)
    share = f"{100 * law.near:.0f} % within {100 * NEAR:g} cm" if np.isfinite(law.near) else ""
    axes.annotate(
        share, (1, 100 * NEAR), xycoords=("axes fraction", "data"), xytext=(-4, -4), ha="right",
        va="top", textcoords="offset points", fontsize=9,
    )  # fmt: skip
    axes.set(
        xscale="log", yscale="log", xlabel="samples (frames that show the joint)",
        ylabel="deviation from the joint's mean (cm)",
    )  # fmt: skip
    axes.set_title(
        "Deviation of joint constants against the number of samples (thesis figure 24)", fontsize=11
    )
    drawn.legend(loc="outside right upper", fontsize=8)
    return png(drawn, caption)


def times_figure(trials: Sequence[Trial], caption: str) -> bytes:
    """Figure 26: the time of each estimator against the number of points, as a PNG."""
    return _by_method(
        [trial.points for trial in trials],
        {method: [1e3 * trial.seconds[method] for trial in trials] for method in METHODS},
        caption,
        xlabel="points",
        ylabel="time of one fit (ms)",
        title="Time of the sphere fits (thesis figure 26)",
    )


def ratios_figure(trials: Sequence[Trial], least_points: int, caption: str) -> bytes:
    """Figure 27: the time divided by GDKE's against the noise, for sets of `least_points` or more, as a PNG."""
    many = [trial for trial in trials if trial.points >= least_points] or list(trials)
    return _by_method(
        [trial.noise for trial in many],
        {m: [trial.seconds[m] / trial.seconds["gdke"] for trial in many] for m in METHODS},
        caption,
        line=1.0,
        xlabel="noise standard deviation σ (m)",
        ylabel="time / GDKE's time",
        title=f"Time against GDKE's, {least_points:,} points or more (thesis figure 27)",
    )


def _by_method(
    x: Sequence[float],
    values: Mapping[str, Sequence[float]],
    caption: str,
    *,
    line: float | None = None,
    **words: str,
) -> bytes:
    """Each estimator's values against x, both axes logarithmic; an upright line at one x if wanted."""
    drawn = figure()
    axes = drawn.subplots()
    for i, (method, y) in enumerate(values.items()):
        axes.plot(
            x, y, linestyle="none", marker=MARKS[i], markersize=4, color=COLOURS[i],
            label=CONTENDERS[method].label, alpha=0.7,
        )  # fmt: skip
    if line is not None:
        axes.axvline(line, color="0.5", linewidth=0.8)
    axes.set(xscale="log", yscale="log", **words)
    axes.grid(alpha=0.3)
    drawn.legend(loc="outside right upper", fontsize=8)
    return png(drawn, caption)


def accuracy_figure(scores: Sequence[Score], caption: str) -> bytes:
    """A map for each estimator: its error over the bound, by coverage and noise, as a PNG.

    A red line is the thesis's criterion, a cross a cell in which the estimator breaks, grey one in which the
    bound itself is too large.
    """
    from matplotlib.colors import LogNorm

    methods = list(dict.fromkeys(score.method for score in scores))
    noises = sorted({score.noise for score in scores})
    angles = sorted({score.angle_deg for score in scores})
    table = {(s.method, s.noise, s.angle_deg): s for s in scores}
    rows = -(-len(methods) // 4)
    drawn = figure(3.6 * min(len(methods), 4), 3.2 * rows + 0.6)
    grid = drawn.subplots(rows, min(len(methods), 4), squeeze=False)
    angle_line = np.linspace(0.0, len(angles) - 1.0, 200)
    degrees = np.interp(angle_line, range(len(angles)), angles)
    # Cells are as wide as each other, so the line runs in the cells' own numbers.
    largest = largest_noise(1.0, np.radians(degrees))
    noise_line = np.interp(
        np.log(largest), np.log(noises), range(len(noises)), left=np.nan, right=np.nan
    )
    shown = None
    for axes in grid.flat[len(methods) :]:
        axes.set_axis_off()
    for axes, method in zip(grid.flat, methods, strict=False):
        ratio = np.array([[table[method, s, a].ratio for a in angles] for s in noises])
        failed = np.array([[table[method, s, a].breaks for a in angles] for s in noises])
        hopeless = np.array([[table[method, s, a].bound > NOTHING for a in angles] for s in noises])
        ratio = np.where(np.isfinite(ratio), np.clip(ratio, 1.0, 100.0), 100.0)
        axes.set_facecolor("0.6")
        shown = axes.pcolormesh(
            np.ma.masked_where(hopeless, ratio),
            norm=LogNorm(1.0, 100.0), cmap="viridis_r",
        )  # fmt: skip
        for row, column in np.argwhere(failed):
            axes.plot(column + 0.5, row + 0.5, marker="x", color="white", markersize=5)
        axes.plot(angle_line + 0.5, noise_line + 0.5, color="red", linewidth=1.5)
        axes.set_xticks(np.arange(len(angles)) + 0.5, [f"{a:g}" for a in angles], fontsize=7)
        axes.set_yticks(np.arange(len(noises)) + 0.5, [f"{s:g}" for s in noises], fontsize=7)
        axes.set(
            title=CONTENDERS[method].label, xlabel="half-angle θ (degrees)", ylabel="σ / r"
        )  # fmt: skip
    drawn.colorbar(shown, ax=grid, label="RMSE / Cramér-Rao bound", shrink=0.8)
    drawn.suptitle(
        f"Error of the centre against the bound; ×: over {BREAKS}, over {NOTHING} radii, or no answer; grey: "
        f"so is the bound; red: the criterion σ = (r/√3) sin²(θ/2), met below it"
    )
    return png(drawn, caption)

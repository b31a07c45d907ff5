"""The picture of gait cycles: mean and standard deviation of joint angles over 0 to 100 % of the cycle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mocap_skel.gait.cycles import PERCENT, MeanCycle
from mocap_skel.report.angle_figure import finish
from mocap_skel.report.figures import figure, plain
from mocap_skel.report.time_figures import SIDE_LOOK, legend
from mocap_skel.results.series import by_sides
from mocap_skel.text import counted, listed


def cycles_figure(means: Sequence[MeanCycle]) -> tuple[Any, str]:
    """Draw the mean of each angle with a band of one standard deviation to each side, left and right in one panel.

    Thin lines are single cycles; a dashed line is where the foot leaves the ground.

    Args:
        means: at least one.

    Returns:
        The matplotlib figure, and what its caption has to say.
    """
    groups = by_sides(one.joint for one in means)
    rows = len(groups)
    drawn = figure(10.0, 2.0 * rows + 1.2)
    grid = drawn.subplots(rows, 3, squeeze=False, sharex=True)
    for row, (name, members) in zip(grid, groups.items(), strict=True):
        for part, axes in enumerate(row):
            _panel(axes, [means[i] for i in members], part)
            axes.set_title(means[members[0]].parts[part], fontsize=8)
        row[0].set_ylabel(f"{plain(name)}\n(degrees)", fontsize=8)
    for axes in grid[-1]:
        axes.set_xlabel("gait cycle (%)", fontsize=8)
    clips = dict.fromkeys(cycle.clip for one in means for cycle in one.cycles)
    drawn.suptitle(plain(f"Gait cycles: {listed(clips, 4)}"), fontsize=11, x=0.01, ha="left")
    legend(drawn, list(dict.fromkeys(one.side for one in means)))
    return drawn, _caption(means)


def _caption(means: Sequence[MeanCycle]) -> str:
    most: dict[str, int] = {}
    for one in means:
        most[one.side] = max(most.get(one.side, 0), len(one.cycles))
    sources = dict.fromkeys(c.stride.start.source for one in means for c in one.cycles)
    words = {"file": "events of the file", "found": "foot contacts that were found"}
    return "; ".join(
        [
            f"from a foot strike to the next of the same foot, by {listed(words[s] for s in sources)}",
            listed(f"{side}: {counted(count, 'cycle')}" for side, count in most.items()),
            "line: mean; band: ± one standard deviation over cycles; thin: single cycles; dashed: the foot leaves the ground",
        ]
    )


def _panel(axes: Any, means: Sequence[MeanCycle], part: int) -> None:
    drawn = []
    for one in means:
        colour = SIDE_LOOK[one.side][0]
        mean, sd = one.mean[:, part], one.sd[:, part]
        if not np.isfinite(mean).any():
            continue
        for cycle in one.cycles:
            # Whole turns by which the mean is another.
            turns = np.round(np.nanmedian(cycle.degrees[:, part] - mean) / 360.0)
            values = cycle.degrees[:, part] - 360.0 * np.nan_to_num(turns)
            axes.plot(PERCENT, values, color=colour, linewidth=0.4, alpha=0.5)
            drawn.append(values)
        axes.fill_between(PERCENT, mean - sd, mean + sd, color=colour, alpha=0.2, linewidth=0)
        axes.plot(PERCENT, mean, color=colour, linewidth=1.4)
        drawn += [mean - sd, mean + sd]
        if np.isfinite(one.off):
            axes.axvline(one.off, color=colour, linestyle="--", linewidth=0.8)
    finish(axes, drawn)

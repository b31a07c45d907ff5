"""The picture of joint angles against time."""

from __future__ import annotations

from typing import Any

import numpy as np

from mocap_skel.angles.joint_angles import joint_angles
from mocap_skel.events import OFF
from mocap_skel.gait.events import FootEvents
from mocap_skel.report.figures import figure, plain
from mocap_skel.report.pose_figures import Actor
from mocap_skel.report.time_figures import SIDE_LOOK, caption, legend, limits, tidy, titled
from mocap_skel.results.series import by_sides, side
from mocap_skel.skeleton_fit import SkeletonFit
from mocap_skel.text import listed

# Degrees: no axis shows less, or noise would look like movement.
LEAST_SPAN = 20.0


def angles_figure(
    actor: Actor, title: str, static: SkeletonFit | None = None, events: FootEvents | None = None
) -> tuple[Any, str]:
    """Draw the three angles of every joint against time, left and right in one panel, with their standard errors.

    The band is one standard error to each side. It says how far a line may be shifted, not how it shakes.

    Args:
        actor: the fit that is drawn.
        title: of the clip.
        static: the same subject in a static clip, whose mean pose is neutral.
        events: of the same subject, which become lines.

    Returns:
        The matplotlib figure, and what its caption has to say.
    """
    found = joint_angles(actor.fit, static)
    groups = by_sides(joint.rule.name for joint in found.joints)
    rows = max(1, len(groups))
    drawn = figure(10.0, 1.25 * rows + 1.2)
    grid = drawn.subplots(rows, 3, squeeze=False, sharex=True)
    for row, (name, members) in zip(grid, groups.items(), strict=False):
        for part, axes in enumerate(row):
            _panel(axes, found.time, [found.joints[i] for i in members], part)
            _mark(axes, events, found.time)
            axes.set_title(found.joints[members[0]].rule.parts[part], fontsize=8)
        row[0].set_ylabel(f"{plain(name)}\n(degrees)", fontsize=8)
    for axes in grid[-1]:
        axes.set_xlabel("time (s)", fontsize=8)
    drawn.suptitle(titled("Joint angles", actor, title), fontsize=11, x=0.01, ha="left")
    legend(drawn, [joint.rule.name for joint in found.joints])
    there = {joint.rule.name for joint in found.joints}
    missing = [joint.joint for joint in actor.fit.joints if joint.joint not in there]
    return drawn, caption(
        actor, "band: ± one standard error: how far a line may be shifted as a whole, not how it shakes",
        "neutral: the static clip's mean pose" if static is not None else "",
        _told(events), missing and f"no angles: {listed(missing, 14)}",
    )  # fmt: skip


def _mark(axes: Any, events: FootEvents | None, time: Any) -> None:
    """A line for each event: of a foot that leaves the ground dashed, of one that strikes it not."""
    for event in events.events if events is not None else ():
        if time[0] <= event.time <= time[-1]:
            colour = SIDE_LOOK[event.side][0]
            line = "--" if event.foot == OFF else "-"
            axes.axvline(event.time, color=colour, linestyle=line, linewidth=0.5, alpha=0.6)


def _told(events: FootEvents | None) -> str:
    """What the lines are; "" without any."""
    if events is None or not events.events:
        return ""
    found = any(event.source == "found" for event in events.events)
    words = "foot contacts that were found" if found else "events of the file"
    return f"upright lines: {words}, dashed where a foot leaves the ground"


def _panel(axes: Any, time: Any, joints: list[Any], part: int) -> None:
    drawn = []
    for joint in joints:
        values, error = joint.degrees[:, part], joint.standard_error[:, part]
        if not np.isfinite(values).any():
            continue
        # Near gimbal lock the error grows beyond all bounds, and so would the axis.
        error = np.where(joint.locked, np.nan, error)
        colour = SIDE_LOOK[side(joint.rule.name)][0]
        axes.fill_between(
            time, values - error, values + error, color=colour, alpha=0.15, linewidth=0
        )
        axes.plot(time, values, color=colour, linewidth=0.9)
        drawn += [values, values - error, values + error]
    finish(axes, drawn)


def finish(axes: Any, drawn: list[Any]) -> None:
    """Make a panel of angles hold the values (degrees) that are drawn in it, or say that none is seen."""
    if drawn:
        limits(axes, np.concatenate(drawn), LEAST_SPAN, 0.0)
    else:
        axes.set_yticks([])
        axes.text(
            0.5, 0.5, "not seen", transform=axes.transAxes, ha="center", color="0.5", fontsize=8
        )
    tidy(axes)

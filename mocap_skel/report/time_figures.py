"""Pictures of a fit against time: places of joints, lengths of bones, distances of markers from joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mocap_skel.clip import AXES
from mocap_skel.report.figures import COLOURS, figure, plain
from mocap_skel.report.pose_figures import Actor
from mocap_skel.results.series import Radial, bones, by_sides, radial, side
from mocap_skel.segments.pose import Array
from mocap_skel.text import listed

# Right and left apart by colour (Okabe & Ito) and by line.
SIDE_LOOK = {"right": ("#0072B2", "-"), "left": ("#D55E00", "-"), "": ("0.2", "-")}
# Metres: no axis shows less, or noise would look like movement.
_LEAST_SPAN = 0.1
_LEAST_BONE_SPAN = 0.02
# Share of the samples at either end that an axis of bone lengths or residuals need not hold.
_OUTSIDE = 0.002
_MOST_MARKERS = 6


def tracks_figure(actor: Actor, title: str) -> tuple[Any, str]:
    """Draw x, y and z of every joint against time, left and right in one panel.

    Frames in which a joint is missing leave a gap in its line.

    Returns:
        The matplotlib figure, and what its caption has to say.
    """
    fit = actor.fit
    joints = [joint for joint in fit.joints if np.isfinite(joint.track).any()]
    groups = by_sides(joint.joint for joint in joints)
    drawn = figure(10.0, 1.15 * len(groups) + 1.2)
    grid = drawn.subplots(len(groups), 3, squeeze=False, sharex=True)
    for row, (name, members) in zip(grid, groups.items(), strict=True):
        for d, axes in enumerate(row):
            tracks = [joints[i].track[:, d] for i in members]
            for i, track in zip(members, tracks, strict=True):
                look = SIDE_LOOK[side(joints[i].joint)]
                _line(axes, fit.time, track, look[0], joints[i].shown == "no")
            limits(axes, np.concatenate(tracks), _LEAST_SPAN, 0.0)
            tidy(axes)
        shown = {side(joints[i].joint): joints[i].shown for i in members}
        told = ", ".join(f"{key[0].upper()} {v}" if key else v for key, v in shown.items())
        row[0].set_ylabel(f"{plain(name)}\n({told})", fontsize=8)
    for d, axes in enumerate(grid[0]):
        up = {AXES[d]: " (up)", f"-{AXES[d]}": " (down)"}.get(fit.up, "")
        axes.set_title(f"{AXES[d]}{up}, m", fontsize=9)
    for axes in grid[-1]:
        axes.set_xlabel("time (s)", fontsize=8)
    drawn.suptitle(titled("Joint centres", actor, title), fontsize=11, x=0.01, ha="left")
    legend(drawn, [joint.joint for joint in joints], "shown: no (not by the movement)")
    missing = [joint.joint for joint in fit.joints if joint not in joints]
    return drawn, caption(
        actor,
        "in brackets: does the movement show the joint",
        missing and f"not seen: {listed(missing, 14)}",
    )


def bones_figure(actor: Actor, title: str) -> tuple[Any, str]:
    """Draw the length of each bone against time with its median, left and right in one panel.

    Returns:
        The matplotlib figure, and what its caption has to say.
    """
    fit = actor.fit
    found = [bone for bone in bones(fit) if np.isfinite(bone.length).any()]
    groups = by_sides(f"{bone.start} - {bone.end}" for bone in found)
    columns = 3 if len(groups) > 4 else max(1, min(2, len(groups)))
    rows = max(1, -(-len(groups) // columns))
    drawn = figure(3.4 * columns + 0.6, 1.7 * rows + 1.2)
    grid = drawn.subplots(rows, columns, squeeze=False, sharex=True)
    clipped = False
    for axes in grid.flat[len(groups) :]:
        axes.set_axis_off()
    for axes, (name, members) in zip(grid.flat, groups.items(), strict=False):
        for i in members:
            bone = found[i]
            where = side(bone.start) or side(bone.end)
            colour = SIDE_LOOK[where][0]
            _line(axes, fit.time, 100 * bone.length, colour, False, 0.8)
            axes.axhline(
                100 * bone.median, color=colour, linestyle="--", linewidth=0.9,
                label=f"{where[:1].upper()} {100 * bone.median:.1f} ± "
                f"{100 * float(np.nanstd(bone.length)):.1f}".strip(),
            )  # fmt: skip
        lengths = np.concatenate([100 * found[i].length for i in members])
        clipped |= limits(axes, lengths, 100 * _LEAST_BONE_SPAN, _OUTSIDE, headroom=0.25)
        axes.legend(
            fontsize=7, loc="upper left", ncols=2, frameon=False, borderpad=0.1, handlelength=1.2
        )
        axes.set_title(plain(name), fontsize=8)
        tidy(axes)
    for axes in grid[:, 0]:
        axes.set_ylabel("length (cm)", fontsize=8)
    for i in range(columns):
        for bottom in [axes for axes in grid[:, i] if axes.axison][-1:]:
            bottom.set_xlabel("time (s)", fontsize=8)
            bottom.tick_params(labelbottom=True)
    drawn.suptitle(titled("Bone lengths", actor, title), fontsize=11, x=0.01, ha="left")
    legend(drawn, [bone.start for bone in found] + [bone.end for bone in found])
    return drawn, caption(
        actor, "dashed: median ± standard deviation in cm; end points of leaves under their segment's name",
        clipped and _left_outside(),
    )  # fmt: skip


def residuals_figure(actor: Actor, title: str) -> tuple[Any, str]:
    """Draw how far each marker is off its mean distance to the joint, against time and as a histogram.

    Returns:
        The matplotlib figure, and what its caption has to say.
    """
    fit = actor.fit
    found = radial(fit, actor.markers)
    order = _paired([one.joint.joint for one in found])
    rows = max(1, len(order))
    drawn = figure(11.0, 1.35 * rows + 1.0)
    grid = drawn.subplots(
        rows, 4, squeeze=False, sharex="col", gridspec_kw={"width_ratios": [6, 1, 6, 1]}
    )
    clipped = False
    for row, members in zip(grid, order, strict=False):
        for k in range(2):
            pair = row[2 * k], row[2 * k + 1]
            if k < len(members):
                clipped |= _residual_panel(*pair, fit.time, found[members[k]])
            else:
                for axes in pair:
                    axes.set_axis_off()
    for row in grid:
        row[0].set_ylabel("mm", fontsize=8)
    for k in (0, 2):
        bottom = [row[k] for row in grid if row[k].axison]
        if bottom:
            bottom[-1].set_xlabel("time (s)", fontsize=8)
            bottom[-1].tick_params(labelbottom=True)
    drawn.suptitle(
        titled("Radial residuals of the markers", actor, title), fontsize=11, x=0.01, ha="left"
    )
    missing = [joint.joint for joint in fit.joints if not joint.fitted]
    return drawn, caption(
        actor, "distance from the centre that the motion gives, less the marker's mean distance; dashed: ± σ, the noise taken "
        "away; at the side: all samples, and beyond it the markers by name",
        clipped and _left_outside(), missing and f"not fitted: {listed(missing, 14)}",
    )  # fmt: skip


def _residual_panel(axes: Any, beside: Any, time: Array, one: Radial) -> bool:
    joint = one.joint
    errors = 1e3 * one.errors
    for m in range(errors.shape[1]):
        colour = COLOURS[m % len(COLOURS)]
        _line(axes, time, errors[:, m], colour, False, 0.7)
        if m < _MOST_MARKERS:
            beside.annotate(
                plain(joint.markers[m]), (1.05, 0.98 - 0.16 * m), xycoords="axes fraction",
                color=colour, fontsize=6.5, va="top", annotation_clip=False,
            )  # fmt: skip
    if errors.shape[1] > _MOST_MARKERS:
        beside.annotate(
            f"+ {errors.shape[1] - _MOST_MARKERS} more", (1.05, 0.98 - 0.16 * _MOST_MARKERS),
            xycoords="axes fraction", fontsize=6.5, va="top", annotation_clip=False,
        )  # fmt: skip
    clipped = limits(axes, errors.ravel(), 4.0, _OUTSIDE, symmetric=True)
    low, high = axes.get_ylim()
    for sign in (-1, 1):
        for own in (axes, beside):
            own.axhline(
                sign * 1e3 * joint.sigma, color="black", linestyle="--", linewidth=0.8, zorder=3
            )
    seen = errors[np.isfinite(errors)]
    beside.hist(
        np.clip(seen, low, high), bins=np.linspace(low, high, 41), orientation="horizontal",
        color="0.6", density=True,
    )  # fmt: skip
    beside.set(ylim=(low, high), xticks=[], yticks=[])
    for spine in beside.spines.values():
        spine.set_visible(False)
    axes.set_title(
        f"{plain(joint.joint)} ({joint.shown}): rms {1e3 * joint.residual:.1f} mm, σ "
        f"{1e3 * joint.sigma:.1f} mm", fontsize=8,
    )  # fmt: skip
    tidy(axes)
    return clipped


def _paired(names: Sequence[str]) -> list[list[int]]:
    """Indices of names in rows of two: the right one beside the left one, the others in their order."""
    rows: list[list[int]] = []
    alone: list[int] = []
    for members in by_sides(names).values():
        sides = {side(names[i]): i for i in members}
        if len(members) == 2 and {"left", "right"} == sides.keys():
            rows.append([sides["right"], sides["left"]])
        else:
            alone += members
    return [alone[i : i + 2] for i in range(0, len(alone), 2)] + rows


def _line(
    axes: Any, time: Array, values: Array, colour: str, dotted: bool, width: float = 1.0
) -> None:
    """Draw a line with the gaps of the data; a sample between two gaps becomes a dot."""
    axes.plot(time, values, color=colour, linewidth=width, linestyle=":" if dotted else "-")
    seen = np.concatenate([[False], np.isfinite(values), [False]])
    alone = seen[1:-1] & ~seen[:-2] & ~seen[2:]
    if alone.any():
        axes.plot(
            time[alone], values[alone], linestyle="none", marker=".", markersize=2, color=colour
        )


def limits(
    axes: Any, values: Array, least: float, outside: float, *, symmetric: bool = False,
    headroom: float = 0.0,
) -> bool:  # fmt: skip
    """Set the limits of an axis so that it holds nearly all values, and return whether some are outside."""
    seen = values[np.isfinite(values)]
    if not len(seen):
        return False
    low, high = np.quantile(seen, [outside, 1 - outside])
    if symmetric:
        low, high = -max(abs(low), abs(high)), max(abs(low), abs(high))
    span = max(high - low, least)
    middle = (low + high) / 2
    low, high = middle - 0.58 * span, middle + 0.58 * span
    axes.set_ylim(low, high + headroom * span)
    return bool(((seen < low) | (seen > high)).any())


def tidy(axes: Any) -> None:
    """Small labels, a faint grid, no frame."""
    axes.tick_params(labelsize=7)
    axes.grid(alpha=0.25, linewidth=0.5)
    axes.margins(x=0.01)
    for name in ("top", "right"):
        axes.spines[name].set_visible(False)


def legend(drawn: Any, names: Sequence[str], dotted: str = "") -> None:
    """Say which colour is which side, for the sides of these names; and what dotted lines are."""
    from matplotlib.lines import Line2D

    sides = {side(name) for name in names}
    entries = [
        Line2D([], [], color=colour, label=name or "middle")
        for name, (colour, _) in SIDE_LOOK.items()
        if name in sides
    ]
    if dotted:
        entries.append(Line2D([], [], color="0.4", linestyle=":", label=dotted))
    drawn.legend(handles=entries, loc="outside upper right", ncols=4, fontsize=8, frameon=False)


def titled(what: str, actor: Actor, title: str) -> str:
    """The title of a picture: what it shows, of which clip, of whom."""
    subject = f", {actor.fit.subject}" if actor.fit.subject else ""
    return plain(f"{what}: {title}{subject}")


def caption(actor: Actor, *parts: str | bool | list[str]) -> str:
    """The text below a picture: its frames, and the parts that are texts."""
    numbers = actor.fit.frame_numbers
    told = [f"frames {numbers[0]} to {numbers[-1]} at {actor.fit.rate:g} Hz"]
    return "; ".join(told + [part for part in parts if isinstance(part, str) and part])


def _left_outside() -> str:
    return f"axes may leave out the outermost {200 * _OUTSIDE:g} % of the samples"

"""The page's part with joint angles against time: a picture a joint, one shown, with a line at the frame that is played."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from mocap_skel.angles.joint_angles import Angles, JointAngles
from mocap_skel.events import OFF, Event
from mocap_skel.report.angle_figure import LEAST_SPAN
from mocap_skel.report.inline import text
from mocap_skel.results.series import by_sides, side
from mocap_skel.segments.pose import Array

# The size of a panel and the space left of it and below it for numbers, in the picture's units.
WIDE, TALL, LEFT, BELOW = 320, 140, 34, 16
# Points of a line and of its band: what a screen shows of a clip of any length.
_POINTS, _BAND = 400, 60
# The joint that is shown first.
_FIRST = "Knee"


def angle_section(angles: Angles, events: Sequence[Event]) -> str:
    """A list of joints and the pictures of their angles; why there are none, where there are none.

    Args:
        angles: of the fit.
        events: of the same subject, which become lines.
    """
    groups = by_sides(joint.rule.name for joint in angles.joints)
    if not groups or len(angles.time) < 2:
        return "<p>No joint of this figure has angles that are defined.</p>"
    first = _FIRST if _FIRST in groups else next(iter(groups))
    choice = "".join(
        f"<option{' selected' if name == first else ''}>{text(name)}</option>" for name in groups
    )
    pictures = "".join(
        _picture(name, [angles.joints[i] for i in members], angles, events, shown=name == first)
        for name, members in groups.items()
    )
    numbers = angles.frame_numbers
    return (
        '<p>Degrees. <span class="right">Right</span>, <span class="left">left</span>, <span class="middle">middle</span>; '
        "the band is one standard error to each side: how far a line may be shifted as a whole. Upright lines are events, "
        "dashed where a foot leaves the ground. The strong line is the frame that the figure shows; pick a place to go there.</p>"
        f'<label>Joint <select id="angle-joint">{choice}</select></label>'
        f'<div id="angle-plots" data-first="{numbers[0]}" data-last="{numbers[-1]}" data-left="{LEFT}" '
        f'data-wide="{WIDE}">{pictures}</div>'
    )


def _picture(
    name: str,
    joints: Sequence[JointAngles],
    angles: Angles,
    events: Iterable[Event],
    *,
    shown: bool,
) -> str:
    marks = "".join(_mark(event, angles) for event in events)
    panels = "".join(_panel(joints, part, angles, marks) for part in range(3))
    hidden = "" if shown else " hidden"
    return f'<figure data-angles="{text(name)}"{hidden}>{panels}</figure>'


def _panel(joints: Sequence[JointAngles], part: int, angles: Angles, marks: str) -> str:
    title = text(joints[0].rule.parts[part])
    errors = [np.where(j.locked, np.nan, j.standard_error[:, part]) for j in joints]
    values = [joint.degrees[:, part] for joint in joints]
    known = np.concatenate(
        [v + s * np.nan_to_num(e) for v, e in zip(values, errors, strict=True) for s in (-1, 1)]
    )
    known = known[np.isfinite(known)]
    start = f'<svg viewBox="0 0 {WIDE} {TALL}" role="img" aria-label="{title} in degrees over time"><title>{title}</title>'
    if not len(known):
        return f'{start}<text x="{LEFT}" y="12">{title}: not seen</text></svg>'
    middle, span = float(known.max() + known.min()) / 2, max(float(np.ptp(known)), LEAST_SPAN)
    low, high = middle - 0.55 * span, middle + 0.55 * span

    def down(degrees: Array) -> Array:
        return np.asarray((TALL - BELOW) * (high - degrees) / (high - low))

    lines = "".join(
        _band(across(angles), down(v - e), down(v + e), side(j.rule.name))
        + _line(across(angles), down(v), side(j.rule.name))
        for j, v, e in zip(joints, values, errors, strict=True)
    )
    ticks = "".join(
        f'<line class="grid" x1="{LEFT}" x2="{WIDE}" y1="{y:.1f}" y2="{y:.1f}"/>'
        f'<text class="number" x="{LEFT - 3}" y="{y + 4:.1f}">{degrees:g}</text>'
        for degrees in _ticks(low, high)
        for y in [float(down(np.array(degrees)))]
    )
    return (
        f'{start}{ticks}<text x="{LEFT + 3}" y="12">{title}</text>{marks}{lines}'
        f'<line class="now" x1="{LEFT}" x2="{LEFT}" y1="0" y2="{TALL - BELOW}"/></svg>'
    )


def across(angles: Angles) -> Array:
    """(frames,): where each frame is in a panel, from the left."""
    numbers = angles.frame_numbers
    return np.asarray(LEFT + (WIDE - LEFT) * (numbers - numbers[0]) / (numbers[-1] - numbers[0]))


def _ticks(low: float, high: float) -> list[float]:
    """Round numbers of degrees, three to six of them."""
    steps = (5.0, 10.0, 20.0, 30.0, 45.0, 90.0, 180.0, 360.0, 720.0, 1800.0)
    step = next((s for s in steps if (high - low) / s <= 6), steps[-1])
    return list((np.arange(np.ceil(low / step) * step, high, step) + 0.0).tolist())


def _line(x: Array, y: Array, where: str) -> str:
    """A line with the gaps of the data."""
    step = max(1, len(x) // _POINTS)
    parts, pen = [], False
    for one, other in zip(x[::step].tolist(), y[::step].tolist(), strict=True):
        if not np.isfinite(other):
            pen = False
            continue
        parts.append(f"{'L' if pen else 'M'}{one:.1f} {other:.1f}")
        pen = True
    return f'<path class="{where or "middle"}" d="{"".join(parts)}"/>' if parts else ""


def _band(x: Array, above: Array, below: Array, where: str) -> str:
    """A polygon between two lines, a part for each stretch without gaps."""
    step = max(1, len(x) // _BAND)
    x, above, below = x[::step], above[::step], below[::step]
    known = np.isfinite(above) & np.isfinite(below)
    parts = []
    for run in np.split(np.arange(len(x)), np.flatnonzero(np.diff(known.astype(int))) + 1):
        if len(run) > 1 and known[run[0]]:
            there = [f"{x[i]:.1f} {above[i]:.1f}" for i in run]
            back = [f"{x[i]:.1f} {below[i]:.1f}" for i in run[::-1]]
            parts.append(f"M{'L'.join(there + back)}Z")
    return f'<path class="error {where or "middle"}" d="{"".join(parts)}"/>' if parts else ""


def _mark(event: Event, angles: Angles) -> str:
    at = event.frame - int(angles.frame_numbers[0])
    if not 0 <= at < len(angles.frame_numbers):
        return ""
    x = f"{across(angles)[at]:.1f}"
    off = " off" if event.foot == OFF else ""
    said = text(f"{event.context} {event.label}, frame {event.frame}".strip())
    return (
        f'<line class="event {event.side or "middle"}{off}" x1="{x}" x2="{x}" y1="0" y2="{TALL - BELOW}">'
        f"<title>{said}</title></line>"
    )

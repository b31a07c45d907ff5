"""The skeleton in one frame or several (thesis figure 25), with verdict and error of every joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mocap_skel.clip import AXES, vertical
from mocap_skel.joints.joint_fit import JointFit
from mocap_skel.report.ellipsoid import ERRORS, ellipsoid
from mocap_skel.report.figures import figure, plain
from mocap_skel.report.looks import LOOKS
from mocap_skel.report.view import View, view_of
from mocap_skel.results.series import Tracks, side
from mocap_skel.segments.pose import Array
from mocap_skel.skeleton_fit import SkeletonFit

BONE_GREYS = {"right": "0.15", "left": "0.55", "": "0.35"}
MARKER_COLOUR = "#009E73"
# Semi-axes longer than this share of the figure's size hide it: they are cut, and it is said.
_LONGEST = 1 / 16
# Metres above or below the lab's zero within which the lowest marker of a clip stands on its floor.
_ON_FLOOR = (-0.1, 0.25)
_NICE = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)


@dataclass(frozen=True, eq=False)
class Actor:
    """A subject to draw: its fit and its `marker_tracks`."""

    fit: SkeletonFit
    markers: Tracks

    def points(self, frame: int) -> Array:
        """(n, 3) all points of it that are seen in a frame: joints, ends, markers."""
        tracks = [track for _, track in self.fit.tracks()]
        tracks += [track for own in self.markers.values() for track in own.values()]
        points = np.array([track[frame] for track in tracks])
        return np.asarray(points[np.isfinite(points[:, 0])])


@dataclass(frozen=True, eq=False)
class _Scene:
    """What all panels of a picture share."""

    view: View
    cap: float
    floor: float
    step: float
    detail: float


def pose_figure(
    actors: Sequence[Actor], frames: Sequence[int], view: str, title: str
) -> tuple[Any, str]:
    """Draw the figures in some frames, each frame in a panel of its own.

    Bones go from joint to joint and from a leaf's joint to its end point, with thin lines to its markers.
    All panels have one scale and one view.

    Args:
        actors: the subjects, all in one lab.
        frames: counted from 0, one or more.
        view: one of `view.VIEWS`.
        title: above all panels.

    Returns:
        The matplotlib figure, and what its caption has to say.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    fits = [actor.fit for actor in actors]
    seen = [np.vstack([actor.points(frame) for actor in actors]) for frame in frames]
    size = max(
        (float(np.linalg.norm(np.ptp(own, axis=0))) for actor in actors for frame in frames
         if len(own := actor.points(frame))), default=1.0,
    )  # fmt: skip
    looking = view_of(view, fits, frames)
    floor, on_floor = _floor(actors)
    step = _nice(size / 4)
    cap = max(round(size * _LONGEST, 2), 0.01)
    scene = _Scene(looking, cap, floor, step, 1.0 if len(frames) == 1 else 0.7)
    half = _half_extent(seen, scene)
    columns = _columns(len(frames), half)
    drawn, panels = _panels(len(frames), columns, half)
    capped: dict[str, None] = {}
    kinds: set[str] = set()
    for axes, frame, points in zip(panels, frames, seen, strict=False):
        centre = _middle(points, scene)
        _ground(axes, points, scene)
        for actor in actors:
            whose = f"{actor.fit.subject} " if len(actors) > 1 else ""
            cut = _actor(axes, actor, frame, scene, kinds)
            capped |= dict.fromkeys(f"{whose}{joint}" for joint in cut)
            if len(actors) > 1:
                _name(axes, actor, frame, scene)
        axes.set(xlim=centre[0] + half[0] * np.array([-1, 1]), aspect="equal")
        axes.set(ylim=centre[1] + half[1] * np.array([-1.0, 1.0]))
        number, time = fits[0].frame_numbers[frame], fits[0].time[frame]
        axes.set_title(f"frame {number}, {time:.2f} s", fontsize=9)
    _scale(panels[0], scene)
    drawn.suptitle(plain(title), fontsize=11, x=0.01, ha="left")
    _legend(drawn, kinds, len(frames) > 1)
    words = [
        f"{view} view" + ("" if looking.own else " along the lab's axes"),
        (f"grid {step:g} m at " if view in ("oblique", "top") else "line: ")
        + ("the lab's floor" if on_floor else "the lowest marker's height"),
    ]
    if "ellipse" in kinds:
        words.append(f"ellipses: {ERRORS:g} standard errors of the joint centre")
    if capped:
        words.append(f"dashed: cut at {100 * scene.cap:.0f} cm ({', '.join(capped)})")
    return drawn, "; ".join(words)


def _columns(count: int, half: Array) -> int:
    """How many panels stand in a row, so that the page is a little wider than high; half = (2,) half a panel."""
    return int(np.clip(np.ceil(np.sqrt(1.3 * count * half[1] / half[0])), 1, min(count, 8)))


def _panels(count: int, columns: int, half: Array) -> tuple[Any, list[Any]]:
    """A page, no larger than a journal's, and its panels of one shape; half = (2,) half a panel."""
    rows = -(-count // columns)
    shape = half[0] / half[1]
    height = min(6.3 if count == 1 else 3.4, 7.5 / rows + 1.5)
    width = np.clip(height * shape, 2.0 if count > 1 else 3.6, 12.5 / columns)
    height = min(height, max(width / shape, 1.2))
    drawn = figure(width * columns + 1.5, (height + 0.25) * rows + 0.9)
    grid = drawn.subplots(rows, columns, squeeze=False)
    panels = list(grid.flat)
    for axes in panels:
        axes.set_axis_off()
    return drawn, panels


def _half_extent(seen: Sequence[Array], scene: _Scene) -> Array:
    """(2,) half the width and height of a panel that has room for the figures of every frame."""
    sizes = [np.ptp(_outline(points, scene), axis=0) for points in seen if len(points)]
    largest = np.max(sizes, axis=0) if sizes else np.ones(2)
    return np.asarray(0.5 * largest + scene.cap + 0.02 * largest.max())


def _outline(points: Array, scene: _Scene) -> Array:
    """The points in the picture, and their places on the floor below them."""
    return np.vstack([scene.view.project(points), scene.view.project(_on(points, scene))])


def _middle(points: Array, scene: _Scene) -> Array:
    if not len(points):
        return np.zeros(2)
    flat = _outline(points, scene)
    return np.asarray((flat.min(axis=0) + flat.max(axis=0)) / 2)


def _on(points: Array, scene: _Scene) -> Array:
    """Points put down onto the floor."""
    up = scene.view.up
    return np.asarray(points + (scene.floor - points @ up)[:, None] * up)


def _floor(actors: Sequence[Actor]) -> tuple[float, bool]:
    """The height of the floor, and whether that is the lab's zero.

    It is the lab's zero if the lowest marker comes near it, else the height of that marker.
    """
    up = vertical(actors[0].fit.up)
    heights = [t @ up for actor in actors for own in actor.markers.values() for t in own.values()]
    lowest = float(np.nanmin(np.stack(heights)))
    on_floor = _ON_FLOOR[0] <= lowest <= _ON_FLOOR[1]
    return (0.0 if on_floor else lowest), on_floor


def _nice(length: float) -> float:
    """The nearest of the lengths that are easy to read."""
    return min(_NICE, key=lambda nice: abs(np.log(nice / length)))


def _ground(axes: Any, points: Array, scene: _Scene) -> None:
    """A grid on the floor under the figures."""
    if not len(points):
        return
    across = [i for i in range(3) if not scene.view.up[i]]
    low = np.floor(points[:, across].min(axis=0) / scene.step - 0.3) * scene.step
    high = np.ceil(points[:, across].max(axis=0) / scene.step + 0.3) * scene.step
    lines = []
    for a, b in ((0, 1), (1, 0)):
        for at in np.arange(low[a], high[a] + scene.step / 2, scene.step):
            ends = np.tile(scene.floor * scene.view.up, (2, 1))
            ends[:, across[a]] = at
            ends[:, across[b]] = low[b], high[b]
            lines.append(scene.view.project(ends))
    from matplotlib.collections import LineCollection

    axes.add_collection(LineCollection(lines, colors="0.85", linewidths=0.6, zorder=1))


def _actor(axes: Any, actor: Actor, frame: int, scene: _Scene, kinds: set[str]) -> list[str]:
    """Draw one subject, and return the joints whose ellipsoids had to be cut."""
    for segment in actor.fit.skeleton.segments:
        _segment(axes, actor, segment.name, frame, scene, kinds)
    _markers(axes, actor, frame, scene, kinds)
    cut = []
    for joint in actor.fit.joints:
        at = joint.track[frame]
        if not np.isfinite(at).all():
            continue
        flat = scene.view.project(at)
        order = 6 + _nearness(scene, at)
        if _ellipse(axes, actor.fit, joint, frame, scene, order):
            cut.append(joint.joint)
        axes.plot(
            *flat, markersize=6 * scene.detail, zorder=order, linestyle="none", **_ball(joint.shown)
        )
        kinds |= {joint.shown, "ellipse"}
    return cut


def _ball(verdict: str) -> dict[str, Any]:
    """A joint's mark in the colour of its verdict."""
    look = LOOKS[verdict]
    return {
        "marker": look.mark,
        "color": look.colour,
        "markerfacecolor": look.colour if look.filled else "white",
        "markeredgecolor": "white" if look.filled else look.colour,
        "markeredgewidth": 0.6 if look.filled else 1.5,
    }


def _nearness(scene: _Scene, point: Array) -> float:
    """How near a point is to the viewer, from 0 to 1, so that it is drawn over what is farther away."""
    return float(0.5 + np.arctan(scene.view.depth(point)) / np.pi)


def _segment(
    axes: Any, actor: Actor, name: str, frame: int, scene: _Scene, kinds: set[str]
) -> None:
    fit = actor.fit
    tracks = dict(fit.tracks())
    segment = fit.skeleton[name]
    children = [s.joint for s in fit.skeleton.segments if s.parent == name and s.joint]
    start = tracks[segment.joint][frame] if segment.joint else None
    if not children:
        end = tracks[name][frame]
        own = list(actor.markers.get(name, {}).values())
        if start is not None:
            _lines(axes, start, [track[frame] for track in own], scene, 0.8, 0.6)
            _bone(axes, np.array([start, end]), name, scene, kinds)
        return
    corners = [tracks[child][frame] for child in children]
    if start is not None:
        corners = [start, *corners]
        for child in children:
            if len(children) > 1 and not side(child):
                _bone(axes, np.array([start, tracks[child][frame]]), name, scene, kinds)
    points = np.array([corner for corner in corners if np.isfinite(corner).all()])
    if start is None and len(points) < 3:
        origin = tracks[name][frame]
        points = np.array([*points, *([origin] if np.isfinite(origin).all() else [])])
    if len(points) == 2:
        _bone(axes, points, name, scene, kinds)
    elif len(points) > 2:
        _plate(axes, points, name, scene, kinds)


def _lines(
    axes: Any, start: Array, ends: Sequence[Array], scene: _Scene, width: float, alpha: float
) -> None:
    for end in ends:
        flat = scene.view.project(np.array([start, end]))
        axes.plot(*flat.T, color="0.6", linewidth=width * scene.detail, alpha=alpha, zorder=3)


def _bone(axes: Any, points: Array, name: str, scene: _Scene, kinds: set[str]) -> None:
    if not np.isfinite(points).all():
        return
    from matplotlib.patheffects import Normal, withStroke

    width = 3.0 * scene.detail
    kinds.add(side(name))
    axes.plot(
        *scene.view.project(points).T, color=BONE_GREYS[side(name)], linewidth=width,
        solid_capstyle="round", zorder=4 + _nearness(scene, points.mean(axis=0)),
        path_effects=[withStroke(linewidth=width + 1.5, foreground="white"), Normal()],
    )  # fmt: skip


def _plate(axes: Any, points: Array, name: str, scene: _Scene, kinds: set[str]) -> None:
    """Draw a segment with three joints or more as a plate; its corners are the joints, in order around the middle."""
    away = points - points.mean(axis=0)
    across = np.linalg.svd(away)[2][:2]
    order = np.argsort(np.arctan2(away @ across[1], away @ across[0]))
    kinds.add(side(name))
    axes.fill(
        *scene.view.project(points[order]).T, facecolor="0.5", alpha=0.15, linewidth=0,
        zorder=4 + _nearness(scene, points.mean(axis=0)) - 0.01,
    )  # fmt: skip
    for i in range(len(points)):
        _bone(axes, points[[order[i - 1], order[i]]], name, scene, kinds)


def _markers(axes: Any, actor: Actor, frame: int, scene: _Scene, kinds: set[str]) -> None:
    points = np.array([t[frame] for own in actor.markers.values() for t in own.values()])
    points = points[np.isfinite(points[:, 0])]
    if len(points):
        kinds.add("marker")
        axes.plot(
            *scene.view.project(points).T, linestyle="none", marker="o", color=MARKER_COLOUR,
            markersize=3.5 * scene.detail, markeredgecolor="white", markeredgewidth=0.4, zorder=5.5,
        )  # fmt: skip


def _ellipse(
    axes: Any, fit: SkeletonFit, joint: JointFit, frame: int, scene: _Scene, order: float
) -> bool:
    """Draw the outline of a joint's error ellipsoid, and return whether it had to be cut."""
    from matplotlib.patches import Ellipse

    found = ellipsoid(joint)
    if found is None:
        return False
    own, half = found
    # It is in the parent's frame, the picture is of the lab.
    vectors = fit.segments[joint.parent].pose.rotation[frame] @ own
    cut = bool(half.max() > scene.cap)
    half = np.minimum(half, scene.cap)
    (long, short), angle = scene.view.ellipse((vectors * half**2) @ vectors.T)
    colour = LOOKS[joint.shown].colour
    place = tuple(scene.view.project(joint.track[frame]))
    shape = {"xy": place, "width": 2 * long, "height": 2 * short, "angle": angle}
    axes.add_patch(Ellipse(**shape, facecolor=colour, alpha=0.15, linewidth=0, zorder=order - 1.5))
    axes.add_patch(
        Ellipse(
            **shape, fill=False, edgecolor=colour, linewidth=1.0 * scene.detail, zorder=order - 0.5,
            linestyle="--" if cut else "-",
        )
    )  # fmt: skip
    return cut


def _name(axes: Any, actor: Actor, frame: int, scene: _Scene) -> None:
    points = actor.points(frame)
    if len(points):
        flat = scene.view.project(points)
        top = flat[flat[:, 1].argmax()]
        axes.annotate(
            plain(actor.fit.subject), top, xytext=(0, 6), textcoords="offset points", ha="center",
            fontsize=9 if scene.detail == 1.0 else 7, zorder=9,
        )  # fmt: skip


def _scale(axes: Any, scene: _Scene) -> None:
    """Draw a bar of a known length and the lab's axes, below the figure."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    room = 0.16 * (top - bottom)
    for own in axes.figure.axes:
        low, high = own.get_ylim()
        own.set_ylim(low - room * (high - low) / (top - bottom), high)
    base = bottom - 0.7 * room
    axes.plot(
        [left, left + scene.step], [base, base], color="black", linewidth=2, solid_capstyle="butt"
    )
    axes.annotate(
        f"{scene.step:g} m", (left + scene.step / 2, base), xytext=(0, -3), ha="center", va="top",
        textcoords="offset points", fontsize=8,
    )  # fmt: skip
    arrow = 0.4 * room
    corner = np.array([right - 1.6 * arrow, base + 0.15 * room])
    tips = arrow * scene.view.axes[:2].T
    for i in np.argsort(-np.linalg.norm(tips, axis=1)):
        axis, tip = AXES[i], tips[i]
        length = np.linalg.norm(tip)
        longer = tips[np.linalg.norm(tips, axis=1) > length]
        # One that points nearly at the viewer, or hides on a longer one, cannot be read.
        cosine = longer @ tip / (np.linalg.norm(longer, axis=1) * max(length, 1e-12))
        if length < 0.3 * arrow or (cosine > 0.95).any():
            continue
        axes.annotate(
            "", corner + tip, xytext=corner,
            arrowprops={"arrowstyle": "->", "color": "0.3", "shrinkA": 0, "shrinkB": 0, "lw": 1.0},
        )  # fmt: skip
        axes.text(*(corner + 1.35 * tip), axis, fontsize=8, color="0.3", ha="center", va="center")


def _legend(drawn: Any, kinds: set[str], small: bool) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: list[Any] = []
    for verdict in LOOKS:
        if verdict in kinds:
            label = f"joint, shown: {verdict}"
            entries.append(
                Line2D([], [], linestyle="none", markersize=6, label=label, **_ball(verdict))
            )
    if "ellipse" in kinds:
        entries.append(
            Patch(facecolor="0.85", edgecolor="0.4", label=f"{ERRORS:g} s.e. of its centre")
        )
    if "marker" in kinds:
        entries.append(
            Line2D([], [], linestyle="none", marker="o", color=MARKER_COLOUR, markersize=4,
                   label="marker")
        )  # fmt: skip
    entries += [
        Line2D([], [], color=BONE_GREYS[name], linewidth=3, label=f"{name} side")
        for name in ("right", "left")
        if name in kinds
    ]
    if entries:
        drawn.legend(
            handles=entries, loc="outside right upper", fontsize=7 if small else 8, frameon=False
        )

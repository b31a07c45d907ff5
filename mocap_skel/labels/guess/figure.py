"""Find a figure in a clip whose labels say nothing: rigid segments and the joints between them."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np

from mocap_skel.clip import Clip
from mocap_skel.errors import CallError, FitError
from mocap_skel.labels.guess.hinges import Hinge, hang
from mocap_skel.labels.guess.rigid import distances, rigid_groups
from mocap_skel.labels.guess.text import quoted
from mocap_skel.text import counted, listed

# A marker that is seen less has no place.
LEAST_SEEN = 0.05
LEAST_FRAMES = 20
# Metres: two groups without a point that is so nearly fixed in both are no neighbours; and from where on a
# joint is said to be unsure.
LOOSE = 0.05
DOUBTFUL = 0.01


@dataclass(frozen=True)
class FoundSegment:
    """A rigid group of markers.

    Attributes:
        name: made up: segment_1, segment_2 ...
        parent, joint: the segment that it hangs on, and the joint between them; None for the root.
        labels: of its markers.
        residual: metres, how far the joint is from fixed in both segments; None for the root.
    """

    name: str
    parent: str | None
    joint: str | None
    labels: tuple[str, ...]
    residual: float | None


@dataclass(frozen=True)
class Figure:
    """A figure that was found in a clip.

    Attributes:
        clip: the clip's name.
        segments: parents first.
        left_out: labels that are on no segment → why.
    """

    clip: str
    segments: tuple[FoundSegment, ...]
    left_out: dict[str, str]

    def rows(self) -> list[dict[str, object]]:
        """One row for each label, as `--json` prints them."""
        rows: list[dict[str, object]] = [
            {
                "label": label, "segment": s.name, "joint": s.joint, "parent": s.parent,
                "residual": s.residual, "reason": "",
            }
            for s in self.segments for label in s.labels
        ]  # fmt: skip
        nothing = {"segment": None, "joint": None, "parent": None, "residual": None}
        return rows + [{"label": x, **nothing, "reason": why} for x, why in self.left_out.items()]

    def in_words(self) -> str:
        """The figure in one sentence."""
        placed = sum(len(s.labels) for s in self.segments)
        joints = [s for s in self.segments if s.joint]
        said = (
            f"{placed} of {counted(placed + len(self.left_out), 'label')} on "
            f"{counted(len(self.segments), 'segment')}, {counted(len(joints), 'joint')}"
        )
        doubtful = [str(s.joint) for s in joints if (s.residual or 0.0) > DOUBTFUL]
        if doubtful:
            said += f"; doubtful (no point is fixed in both segments): {listed(doubtful, 20)}"
        if self.left_out:
            said += f"; left out: {listed(self.left_out)}"
        return said


def find_figure(clip: Clip, subject: str | None = None) -> Figure:
    """Find the rigid segments of a clip and the joints between them, from the movement alone.

    Args:
        clip: the recording.
        subject: whose markers; may be left out where the clip has one only.

    Raises:
        CallError: several subjects and none chosen.
        FitError: no three markers move together.

    >>> from mocap_skel import read_clip
    >>> figure = find_figure(read_clip("sample_data/range_of_motion.c3d"))
    >>> figure.in_words()
    '41 of 41 labels on 15 segments, 14 joints'
    """
    names = clip.subject_names
    if subject is None and len(names) > 1:
        raise CallError(
            f"{clip.name}: a figure is one subject's", f"choose with --subject: {listed(names)}"
        )
    own = [i for i, whose in enumerate(clip.subjects) if subject in (None, whose)]
    left_out: dict[str, str] = {}
    columns = []
    least = max(LEAST_SEEN * clip.frames, LEAST_FRAMES)
    for i in own:
        if np.isfinite(clip.points[:, i, 0]).sum() < least:
            left_out[clip.labels[i]] = "hardly ever seen"
        elif '"' in clip.labels[i]:
            left_out[clip.labels[i]] = "a label with a quote cannot stand in a file"
        else:
            columns.append(i)
    points = clip.points[:, columns]
    groups = rigid_groups(distances(points).spread)
    hinges = hang(points, groups)
    if not hinges and not any(len(g) >= 3 for g in groups):
        raise FitError(
            f"{clip.name}: no figure without names: no three markers keep their distances",
            "three markers on a segment, and motion between the segments, are needed",
        )
    labels = [clip.labels[i] for i in columns]
    kept = _attached(hinges, LOOSE)
    order = _rooted(groups, kept)
    for i, group in enumerate(groups):
        if i not in {child for child, _, _ in order}:
            left_out.update((labels[k], "hangs on nothing") for k in group)
    return Figure(clip.name, tuple(_segments(order, groups, labels)), left_out)


def _attached(hinges: list[Hinge], limit: float) -> list[Hinge]:
    """The joints that hold, without those that hang on one that does not."""
    loose: set[int] = set()
    kept = []
    for hinge in hinges:
        if hinge.parent in loose or hinge.residual > limit:
            loose.add(hinge.child)
        else:
            kept.append(hinge)
    return kept


def _rooted(groups: list[list[int]], hinges: list[Hinge]) -> list[tuple[int, int, float]]:
    """(group, parent group, residual) from the root down: the group with most neighbours, then markers."""
    near: dict[int, list[tuple[int, float]]] = {}
    for hinge in hinges:
        near.setdefault(hinge.parent, []).append((hinge.child, hinge.residual))
        near.setdefault(hinge.child, []).append((hinge.parent, hinge.residual))
    framed = [i for i, g in enumerate(groups) if len(g) >= 3 and (i in near or not hinges)]
    root = max(framed, key=lambda i: (len(near.get(i, [])), len(groups[i])))
    order: list[tuple[int, int, float]] = []

    def walk(group: int, parent: int, residual: float) -> None:
        order.append((group, parent, residual))
        for child, off in near.get(group, []):
            if child != parent:
                walk(child, group, off)

    walk(root, -1, 0.0)
    return order


def _segments(
    order: list[tuple[int, int, float]], groups: list[list[int]], labels: list[str]
) -> list[FoundSegment]:
    """Name the groups and their joints, from the root down."""
    name = {group: f"segment_{n}" for n, (group, _, _) in enumerate(order, 1)}
    return [
        FoundSegment(
            name[group],
            name.get(parent),
            None if parent < 0 else f"joint_{n}",
            tuple(labels[k] for k in groups[group]),
            None if parent < 0 else residual,
        )
        for n, (group, parent, residual) in enumerate(order)
    ]


def figure_texts(figure: Figure, skeleton_file: str) -> tuple[str, str]:
    """The texts of a skeleton file and of an association file that names it.

    Args:
        figure: from `find_figure`.
        skeleton_file: the name of the first, for the second.
    """
    by = f"# {figure.clip}: found by mocap-skel assoc guess --by-motion, without names."
    toml = [
        by,
        "# Segments are markers that keep their distances; joints, points fixed in two of them.",
    ]
    toml.append('name = "by motion"')
    assoc = [by, f"@skeleton {quoted(skeleton_file)}", "# LABEL  MARKER"]
    for s in figure.segments:
        toml += ["", "[[segment]]", f"name = {json.dumps(s.name)}"]
        if s.parent is not None and s.residual is not None:
            doubt = ": doubtful" if s.residual > DOUBTFUL else ""
            toml.append(f"parent = {json.dumps(s.parent)}")
            toml.append(f"joint = {json.dumps(s.joint)}  # {1e3 * s.residual:.1f} mm{doubt}")
        toml.append(f"markers = {json.dumps(list(s.labels), ensure_ascii=False)}")
        assoc += ["", f"# {s.name}"]
        # The third column keeps a label that is called ignore from being one.
        assoc += [f"{quoted(x)}  {quoted(x)}  {s.name}" for x in s.labels]
    if figure.left_out:
        assoc += ["", "# Not placed"]
        assoc += [f"# {quoted(x)}  # {why}" for x, why in figure.left_out.items()]
    return "\n".join(toml) + "\n", "\n".join(assoc) + "\n"

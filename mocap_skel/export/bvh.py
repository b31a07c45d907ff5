"""Biovision hierarchy (BVH): the rigid poses of a fit as a tree of joints with Euler angles."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mocap_skel.errors import ExportError
from mocap_skel.export.gaps import fill_positions, fill_rotations, runs
from mocap_skel.fit import SegmentFit, SkeletonFit
from mocap_skel.pose import Array
from mocap_skel.text import listed

CENTIMETRES = 100.0
# Seconds: over a longer gap an interpolated limb is an invention.
LONGEST_GAP = 0.5
# Metres: shorter End Sites make nodes without length in common readers.
SHORTEST_END = 1e-3

_NO_GAPS = "a BVH cannot say that something is missing"


@dataclass(frozen=True, eq=False)
class _Node:
    """A joint of the file: it turns its segment about the joint towards the parent.

    Attributes:
        name: the joint, for the root its segment.
        segment: the segment's fit.
        centre: (3,) where the joint lies in the parent segment's coordinates.
        origin: (3,) where it lies in its own segment's coordinates.
        children: indices of the joints that hang from it.
    """

    name: str
    segment: SegmentFit
    centre: Array
    origin: Array
    children: tuple[int, ...]


def bvh(fit: SkeletonFit, *, trim: bool = False) -> tuple[str, tuple[str, ...]]:
    """The fit as BVH text: centimetres, degrees, rotation order ZXY, one node a fitted joint.

    The rest pose is the file's first frame; the offset of a joint from its parent joint is constant,
    so bones keep their length where the fitted joints wander.

    Args:
        fit: with y up.
        trim: leave out the frames at both ends that would need a pose beyond a segment's last one.

    Returns:
        The text, and notes that list joints left out and frames that were filled.

    Raises:
        ExportError: a segment has no pose over too long a time.
    """
    nodes, notes = _nodes(fit)
    known = np.stack([node.segment.pose.known for node in nodes])
    frames = known.shape[1]
    # From the frame in which the last segment shows up to the one in which the first is gone,
    # whatever is missing lies between two known poses.
    first = int(known.argmax(axis=1).max())
    stop = frames - int(known[:, ::-1].argmax(axis=1).max())
    if stop - first < 2:
        worst = nodes[int(known.sum(axis=1).argmin())].segment.name
        raise ExportError(
            f"{fit.clip}: the segments are not seen at the same time ({worst} has the fewest frames); "
            f"{_NO_GAPS}"
        )
    if not trim and stop - first < frames:
        ends = [(0, first), (stop, frames)]
        raise ExportError(
            f"{fit.clip}: not every segment has a pose in frames {_spans(fit, ends)}; {_NO_GAPS}",
            "use --trim to leave them out",
        )
    if stop - first < frames:
        notes.append(f"BVH: {frames - (stop - first)} incomplete frames at the ends left out")
    for node, row in zip(nodes, known[:, first:stop], strict=True):
        gaps = [(start + first, end + first) for start, end in runs(~row)]
        longest = max((end - start for start, end in gaps), default=0)
        if longest > LONGEST_GAP * fit.rate:
            raise ExportError(
                f"{fit.clip}: {node.segment.name} has no pose for {longest / fit.rate:.1f} s; gaps "
                f"over {LONGEST_GAP} s are not filled, and {_NO_GAPS}"
            )
        if gaps:
            notes.append(f"BVH: {node.segment.name} filled in frames {_spans(fit, gaps)}")
    return "".join(_lines(nodes, fit, slice(first, stop))), tuple(notes)


def _nodes(fit: SkeletonFit) -> tuple[list[_Node], list[str]]:
    """The fitted joints, parents first, and notes on those that are not in the file."""
    joint_of = {joint.child: joint for joint in fit.joints}
    here = [s for s in fit.skeleton.segments if s.name in fit.segments]
    place = {s.name: i for i, s in enumerate(here)}
    nodes = []
    for s in here:
        found = fit.segments[s.name]
        joint = joint_of.get(s.name)
        nodes.append(
            _Node(
                name=(s.joint or s.name).replace(" ", "_"),
                segment=found,
                centre=np.zeros(3) if joint is None else joint.centre,
                origin=np.zeros(3) if found.joint is None else found.joint,
                children=tuple(place[c.name] for c in here if c.parent == s.name),
            )
        )
    absent = [s.joint for s in fit.skeleton.segments if s.joint and s.name not in fit.segments]
    return nodes, [f"BVH: without {listed(absent)}"] if absent else []


def _lines(nodes: list[_Node], fit: SkeletonFit, kept: slice) -> Iterator[str]:
    turns = [fill_rotations(node.segment.pose.rotation[kept]) for node in nodes]
    rest = [turn[0] for turn in turns]
    yield "HIERARCHY\n"
    yield from _hierarchy(nodes, rest, 0, np.zeros(3), 0)
    position = fill_positions(nodes[0].segment.pose.origin[kept])
    world = [turn @ start.T for turn, start in zip(turns, rest, strict=True)]
    rows = np.hstack([CENTIMETRES * position, *_angles(nodes, world, 0, np.eye(3)[None])])
    yield f"MOTION\nFrames: {len(rows)}\nFrame Time: {1.0 / fit.rate:.10f}\n"
    form = " ".join(["%.6f"] * rows.shape[1]) + "\n"
    yield (form * len(rows)) % tuple((np.round(rows, 6) + 0.0).ravel().tolist())


def _hierarchy(
    nodes: list[_Node], rest: list[Array], at: int, offset: Array, depth: int
) -> Iterator[str]:
    node, tab = nodes[at], "\t" * depth
    kind = "JOINT" if depth else "ROOT"
    place = "" if depth else "Xposition Yposition Zposition "
    yield f"{tab}{kind} {node.name}\n{tab}{{\n{tab}\tOFFSET {_vector(offset)}\n"
    yield f"{tab}\tCHANNELS {3 if depth else 6} {place}Zrotation Xrotation Yrotation\n"
    for child in node.children:
        away = rest[at] @ (nodes[child].centre - node.origin)
        yield from _hierarchy(nodes, rest, child, away, depth + 1)
    if not node.children:
        end = rest[at] @ (_end(node) - node.origin)
        yield f"{tab}\tEnd Site\n{tab}\t{{\n{tab}\t\tOFFSET {_vector(end)}\n{tab}\t}}\n"
    yield f"{tab}}}\n"


def _end(node: _Node) -> Array:
    """A point beyond the joint for a node without children."""
    end = node.segment.end
    if end is None:
        end = np.mean(list(node.segment.template.values()), axis=0)
    if np.linalg.norm(end - node.origin) < SHORTEST_END:
        end = node.origin + np.array([0.0, 10 * SHORTEST_END, 0.0])
    return np.asarray(end)


def _vector(v: Array) -> str:
    x, y, z = np.round(CENTIMETRES * v, 6) + 0.0
    return f"{x:.6f} {y:.6f} {z:.6f}"


def _angles(nodes: list[_Node], world: list[Array], at: int, above: Array) -> Iterator[Array]:
    """Euler angles (frames, 3) in degrees of a node and all below it, in the order of the hierarchy."""
    yield _euler_zxy(above.transpose(0, 2, 1) @ world[at])
    for child in nodes[at].children:
        yield from _angles(nodes, world, child, world[at])


def _euler_zxy(rotation: Array) -> Array:
    """Angles (frames, 3) in degrees with R = Rz Rx Ry, unwrapped; near x = ±90° z and y still trade places."""
    z = np.arctan2(-rotation[:, 0, 1], rotation[:, 1, 1])
    x = np.arcsin(np.clip(rotation[:, 2, 1], -1.0, 1.0))
    y = np.arctan2(-rotation[:, 2, 0], rotation[:, 2, 2])
    return np.degrees(np.unwrap(np.stack([z, x, y], axis=1), axis=0))


def _spans(fit: SkeletonFit, stretches: list[tuple[int, int]]) -> str:
    """Stretches (start, stop) in the file's own frame numbers."""
    numbers = fit.frame_numbers
    return listed(
        (
            str(numbers[start]) if stop - start == 1 else f"{numbers[start]}-{numbers[stop - 1]}"
            for start, stop in stretches
            if stop > start
        ),
        12,
    )

"""A rigid figure with the joints that animators know: spine, neck, collar bones, toes (`figure/full_rig.toml`).

No marker shows most of these joints. Each is placed by anatomy in the rest pose, and held by a pull of its own
(`freedoms`), so that every turn has an answer: joints in a row share their turn equally, collar bones and toes
keep their turn unless markers move them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mocap_skel.figure.full_rig import Between, Beyond, FullRig, Row
from mocap_skel.figure.skeleton import Segment
from mocap_skel.rig.blocks import multiply, transposed
from mocap_skel.rig.freedoms import Freedom, Shared, Spring, shares
from mocap_skel.rig.model import Model, mean_turn
from mocap_skel.rig.solver import Bones, Poses
from mocap_skel.segments.pose import Array

# Markers that show a segment's place and turn.
ENOUGH = 3
LEVEL = np.array([1.0, 0.0, 1.0])


@dataclass(eq=False)
class _Part:
    """A segment while the figure is put together; all as in `Model` and `Bones`."""

    segment: Segment
    parent: str
    offset: Array
    joint: Array
    places: Array
    weights: Array
    markers: tuple[str, ...]
    points: Array
    turn: Array
    rest: Array
    end: Array | None = None
    tip: Array | None = None
    local: Array | None = None
    loose: Array | None = None


def fuller(model: Model, rest: Sequence[Array], full: FullRig) -> tuple[Model, tuple[str, ...]]:
    """The figure with the joints of a full rig, where it has the segments that they belong to.

    Args:
        model: the figure.
        rest: of each segment the rotation (3, 3) from its axes to the character's in the rest pose.
        full: what is put in.

    Returns:
        The figure, breadth first; and the joints that it cannot have.
    """
    draft = _Draft(model, rest)
    lacking: list[str] = []
    for row in full.rows:
        lacking += () if draft.divide(row) else row.joints[1:]
    lacking += [one.joint for one in full.betweens if not draft.put_between(one)]
    lacking += [one.joint for one in full.beyonds if not draft.put_behind(one)]
    return draft.model(), tuple(lacking)


class _Draft:
    """Segments by name; each step puts some in."""

    def __init__(self, model: Model, rest: Sequence[Array]) -> None:
        self._old, self._names = model, [segment.name for segment in model.segments]
        self._springs: list[tuple[tuple[str, ...], Array, float]] = []
        bones = model.bones
        self.parts = {
            name: _Part(
                model.segments[i],
                self._names[bones.parents[i]] if i else "",
                bones.offsets[i],
                model.joints[i],
                bones.places[i],
                bones.weights[i],
                model.markers[i],
                model.points[i],
                model.start.turn[:, :, i],
                rest[i],
                model.ends.get(i),
                model.tips.get(i),
                model.rested.get(i),
                model.loose.get(i),
            )
            for i, name in enumerate(self._names)
        }
        root = self.parts[self._names[0]]
        root.local = root.rest

    def _has(self, segment: str, parent: str) -> bool:
        return segment in self.parts and self.parts[segment].parent == parent

    def _free(self, name: str) -> bool:
        """Whether nothing holds a segment's joint, which a row would do otherwise."""
        return self.parts[name].segment.freedom == "ball"

    def _carry(self, markers: Sequence[str], origin: str, to: str) -> None:
        """Give markers of a segment to another one of the same axes, as they lie from its joint."""
        old, new = self.parts[origin], self.parts[to]
        moved = np.array([marker in markers for marker in old.markers], dtype=bool)
        new.places, new.weights = old.places[moved] - new.offset, old.weights[moved]
        new.points = old.points[:, moved]
        new.markers = tuple(np.array(old.markers, dtype=object)[moved])
        old.places, old.weights = old.places[~moved], old.weights[~moved]
        old.points = old.points[:, ~moved]
        old.markers = tuple(np.array(old.markers, dtype=object)[~moved])

    def _add(self, name: str, joint: str, parent: str, offset: Array, turn: Array) -> None:
        """A segment without markers whose axes in the rest pose are its parent's."""
        above = self.parts[parent]
        self.parts[name] = _Part(
            Segment(name, parent, joint, ()), parent, offset, np.zeros(3), np.empty((0, 3)), np.empty(0),
            (), np.empty((turn.shape[2], 0, 3)), turn, above.rest, local=np.eye(3),
        )  # fmt: skip

    def divide(self, row: Row) -> bool:
        """Divide a joint into several; False if the figure has it not."""
        if not self._has(row.segment, row.parent) or not self._free(row.segment):
            return False
        child, above = self.parts[row.segment], self.parts[row.parent]
        toward = child.end
        if row.toward:
            there = self._has(row.toward, row.segment)
            toward = self.parts[row.toward].offset if there else None
        if toward is None:
            return False
        local = above.rest.T @ child.rest
        part = shares(above.turn, child.turn, local, len(row.joints))
        mean = mean_turn(multiply(transposed(above.turn), child.turn))
        # In a line on the clip's average, where the fit has the segment; each step in the axes of the bone before it.
        bent = shares(np.eye(3)[..., None], mean[..., None], local, len(row.joints))[..., 0]
        steps = [
            np.linalg.matrix_power(bent, k).T @ (share * (mean @ toward))
            for k, share in enumerate(np.diff(row.at, prepend=0.0))
        ]
        parent, turn = row.parent, above.turn
        first = child.offset
        for name, joint, step in zip(row.names, row.joints, steps, strict=False):
            turn = multiply(turn, part)
            self._add(name, joint, parent, first + step, turn)
            parent, first = name, np.zeros(3)
        shift = row.at[-1] * toward
        for other in self.parts.values():
            if other.parent == row.segment:
                other.offset = other.offset - shift
        child.segment = replace(child.segment, parent=parent, joint=row.joints[-1])
        child.parent, child.offset, child.joint = parent, steps[-1], child.joint + shift
        child.places = child.places - shift
        child.end = None if child.end is None else child.end - shift
        child.local, child.loose = local, None
        self._springs.append(((*row.names, row.segment), local, row.stray))
        return True

    def put_between(self, one: Between) -> bool:
        """Put a bone between a segment and its parent; False if the figure has not both."""
        if not self._has(one.segment, one.parent):
            return False
        child, above = self.parts[one.segment], self.parts[one.parent]
        seen = [above.places[above.markers.index(m)] for m in one.at if m in above.markers]
        seen += [
            other.offset
            for other in self.parts.values()
            if other.parent == one.parent and other.segment.joint == one.else_joint
        ]
        if not seen:
            return False
        place = seen[0] + one.share * (child.offset - seen[0])
        self._add(one.name, one.joint, one.parent, place, above.turn)
        if sum(marker not in one.markers for marker in above.markers) >= ENOUGH:
            self._carry(one.markers, one.parent, one.name)
        child.segment = replace(child.segment, parent=one.name)
        child.parent, child.offset = one.name, child.offset - place
        self._springs.append(((one.name,), np.eye(3), one.stray))
        return True

    def put_behind(self, one: Beyond) -> bool:
        """Put a bone behind the last one of a limb; False if the figure has no such."""
        above = self.parts.get(one.segment)
        if above is None or above.end is None:
            return False
        up, forward = above.rest.T @ [0.0, 1.0, 0.0], above.rest.T @ [0.0, 0.0, 1.0]
        place = above.end - one.below * up
        known = one.of in above.markers
        origin = above.places[above.markers.index(one.of)] if known else np.zeros(3)
        level = float(np.linalg.norm(LEVEL * (above.rest @ (place - origin))))
        length = (one.ratio if known else one.else_ratio) * level
        self._add(one.name, one.joint, one.segment, place, above.turn)
        self._carry(one.markers, one.segment, one.name)
        self.parts[one.name].end = length * forward
        above.tip, above.end = above.end, None
        self._springs.append(((one.name,), np.eye(3), one.stray))
        return True

    def model(self) -> Model:
        """The figure, its segments breadth first."""
        depth: dict[str, int] = {"": -1}
        # Parents stand before their children in the old order; new ones may stand behind theirs.
        waiting = list(self.parts)
        while waiting:
            ready = [name for name in waiting if self.parts[name].parent in depth]
            depth |= {name: depth[self.parts[name].parent] + 1 for name in ready}
            waiting = [name for name in waiting if name not in depth]
        order = sorted(self.parts, key=depth.__getitem__)
        index = {name: i for i, name in enumerate(order)} | {"": -1}
        parts = [self.parts[name] for name in order]
        bones = Bones(
            tuple(index[part.parent] for part in parts),
            np.stack([part.offset for part in parts]),
            tuple(part.places for part in parts),
            tuple(part.weights for part in parts),
        )
        turn = np.ascontiguousarray(np.stack([part.turn for part in parts], axis=2))
        return Model(
            tuple(part.segment for part in parts),
            bones,
            (*self._kept(index), *self._held(index)),
            tuple(part.markers for part in parts),
            tuple(part.points for part in parts),
            Poses(turn, self._old.start.root),
            {i: part.loose for i, part in enumerate(parts) if part.loose is not None},
            {i: part.end for i, part in enumerate(parts) if part.end is not None},
            np.stack([part.joint for part in parts]),
            {i: part.local for i, part in enumerate(parts) if part.local is not None},
            {i: part.tip for i, part in enumerate(parts) if part.tip is not None},
            frozenset(order) - frozenset(self._names),
        )

    def _kept(self, index: dict[str, int]) -> list[Freedom]:
        new = {i: index[name] for i, name in enumerate(self._names)}
        return [m for one in self._old.freedoms if (m := one.moved(new)) is not None]

    def _held(self, index: dict[str, int]) -> list[Freedom]:
        found: list[Freedom] = []
        for names, turn, stray in self._springs:
            at, stiffness = tuple(index[name] for name in names), 1.0 / np.radians(stray) ** 2
            found.append(
                Shared(at, turn, stiffness) if len(at) > 1 else Spring(at[0], turn, stiffness)
            )
        return found

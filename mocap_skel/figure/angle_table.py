"""Which segment has which anatomical axes and which joint which angles, as `angles.toml` has them."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

PATH = Path(__file__).parent / "angles.toml"
SIDES = ("Right", "Left")


@dataclass(frozen=True)
class Line:
    """From one place to another; each is the mean of joints and landmarks, by name."""

    start: tuple[str, ...]
    end: tuple[str, ...]


@dataclass(frozen=True)
class Way:
    """One way to an anatomical frame: an axis with a certain direction, and what fixes the turn about it.

    Attributes:
        axis: "x", "y" or "z": the one along `along`.
        along: its direction.
        other: the axis that fixes the turn.
        beside: its direction, where a line gives it.
        hinge: the joint whose axis gives it.
        bend: the three joints whose plane it is square to.
        sign: of that plane's normal.
        unseen: whether nothing shows the turn about `along`.
        says: what people are told of this way; "" for the definition itself.
    """

    axis: str
    along: Line
    other: str
    beside: Line | None = None
    hinge: str = ""
    bend: tuple[str, ...] = ()
    sign: float = 1.0
    unseen: bool = False
    says: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """Every place that it needs, once."""
        lines = [self.along, *([self.beside] if self.beside else [])]
        found = [name for line in lines for name in (*line.start, *line.end)]
        return tuple(dict.fromkeys([*found, *self.bend]))


@dataclass(frozen=True)
class FrameRule:
    """A segment's anatomical frame: ways to it, the best first, and the publication."""

    segment: str
    ways: tuple[Way, ...]
    source: str


@dataclass(frozen=True)
class AngleRule:
    """The angles of one joint, or of a segment in the lab.

    Attributes:
        name: what the angles are called by: the joint, or the segment.
        parent: the segment that is at rest; "" for the lab.
        child: the segment that turns.
        sequence: axes of the three turns, such as "ZXY".
        parts: names of the three angles.
        signs: of the three angles, on the right side.
        source: the publication.
        mirrored: whether it is of the left side: angles are those of the mirrored body.
    """

    name: str
    parent: str
    child: str
    sequence: str
    parts: tuple[str, str, str]
    signs: tuple[float, float, float]
    source: str
    mirrored: bool = False

    @property
    def titles(self) -> tuple[str, ...]:
        """The names of the angles as columns have them: LeftKnee_flexion."""
        return tuple(f"{self.name}_{part}" for part in self.parts)


@dataclass(frozen=True)
class AngleTable:
    """All of them.

    Attributes:
        frames: by segment.
        angles: in the order of the result.
        landmark_sd: metres, how well a landmark's marker is placed along each axis.
    """

    frames: Mapping[str, FrameRule]
    angles: tuple[AngleRule, ...]
    landmark_sd: float


@cache
def angle_table() -> AngleTable:
    """The table, read once.

    >>> knee = next(rule for rule in angle_table().angles if rule.name == "LeftKnee")
    >>> knee.sequence, knee.titles
    ('ZXY', ('LeftKnee_flexion', 'LeftKnee_adduction', 'LeftKnee_rotation'))
    """
    read = tomllib.loads(PATH.read_text(encoding="utf-8"))
    frames = (
        FrameRule(entry["segment"], tuple(_way(way, left) for way in entry["way"]), entry["source"])
        for entry, left in _both_sides(read["frame"])
    )
    angles = tuple(_angles(entry, left) for entry, left in _both_sides(read["angle"]))
    return AngleTable({rule.segment: rule for rule in frames}, angles, read["landmark_sd"])


def _angles(entry: dict[str, Any], left: bool) -> AngleRule:
    a, b, c = entry["parts"]
    p, q, r = entry["signs"]
    return AngleRule(
        entry["name"], entry["parent"], entry["child"], entry["sequence"], (a, b, c),
        (float(p), float(q), float(r)), entry["source"], left,
    )  # fmt: skip


def _both_sides(entries: Iterable[dict[str, Any]]) -> Iterator[tuple[dict[str, Any], bool]]:
    """Each table with its side's name put in, and whether it is the left one."""
    for entry in entries:
        named = _sided(entry, "")
        if named == entry:
            yield entry, False
            continue
        for side in SIDES:
            yield _sided(entry, side), side == "Left"


def _sided(value: Any, side: str) -> Any:
    if isinstance(value, str):
        return value.replace("{Side}", side)
    if isinstance(value, list):
        return [_sided(v, side) for v in value]
    if isinstance(value, dict):
        return {key: _sided(v, side) for key, v in value.items()}
    return value


def _way(entry: dict[str, Any], left: bool) -> Way:
    along, beside = entry["along"], entry["beside"]
    return Way(
        axis=along["axis"],
        along=_line(along, left),
        other=beside["axis"],
        beside=_line(beside, left) if "from" in beside else None,
        hinge=beside.get("hinge", ""),
        bend=tuple(beside.get("bend", ())),
        sign=float(beside.get("sign", 1)),
        unseen=entry.get("unseen", False),
        says=entry.get("says", ""),
    )


def _line(entry: dict[str, Any], left: bool) -> Line:
    """A line; the z axis of the left side is the mirror image, drawn the other way round."""
    ends = tuple(entry["from"]), tuple(entry["to"])
    return Line(*(reversed(ends) if left and entry["axis"] == "z" else ends))

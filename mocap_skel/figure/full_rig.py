"""The joints that animators know and no marker shows, as `full_rig.toml` has them."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

PATH = Path(__file__).parent / "full_rig.toml"


@dataclass(frozen=True)
class Row:
    """A joint divided into several in a row that share its turn equally.

    Attributes:
        segment, parent: what the joint links.
        names: of the new segments, from the parent on.
        joints: of all joints in the row; the first one stands where the divided one was.
        at: where they are, from the divided joint (0) to `toward` (1).
        stray: degrees that a joint's part may be from an equal one.
        toward: the segment whose joint the row leads to; "" for the segment's own end.
    """

    segment: str
    parent: str
    names: tuple[str, ...]
    joints: tuple[str, ...]
    at: tuple[float, ...]
    stray: float
    toward: str = ""


@dataclass(frozen=True)
class Between:
    """A bone put between a segment and its parent.

    Attributes:
        segment, parent: what it is put between.
        name, joint: its own, and its joint's towards the parent.
        at: markers of the parent, the best first; the joint is near the first one that is there.
        else_joint: the parent's joint that stands for them.
        share: of the way from there to the segment's joint, where the new joint is.
        markers: those of the parent that go with the new bone.
        stray: degrees; its standard deviation about the clip's average.
    """

    segment: str
    parent: str
    name: str
    joint: str
    at: tuple[str, ...]
    else_joint: str
    share: float
    markers: tuple[str, ...]
    stray: float


@dataclass(frozen=True)
class Beyond:
    """A bone put behind the last one of a limb, level where the limb stands.

    Attributes:
        segment: the last one.
        name, joint: its own, and its joint's.
        below: metres; so far is the joint under the limb's end.
        of: the marker from which its length is measured,
        ratio: as a share of the level distance to the joint;
        else_ratio: likewise from the segment's own joint, where that marker is missing.
        markers: those of the segment that go with the new bone.
        stray: degrees that it may turn against the segment.
    """

    segment: str
    name: str
    joint: str
    below: float
    of: str
    ratio: float
    else_ratio: float
    markers: tuple[str, ...]
    stray: float


@dataclass(frozen=True)
class FullRig:
    """All of them, in the order in which they are put in."""

    rows: tuple[Row, ...]
    betweens: tuple[Between, ...]
    beyonds: tuple[Beyond, ...]

    @property
    def joints(self) -> tuple[str, ...]:
        """The joints that are new in a figure."""
        return (
            *(joint for row in self.rows for joint in row.joints[1:]),
            *(one.joint for one in self.betweens),
            *(one.joint for one in self.beyonds),
        )


@cache
def full_rig() -> FullRig:
    """What comes with the program.

    >>> full_rig().joints[:3]
    ('MiddleSpine', 'UpperSpine', 'SkullBase')
    """
    data = tomllib.loads(PATH.read_text(encoding="utf-8"))
    return FullRig(
        tuple(Row(**_frozen(entry)) for entry in data["row"]),
        tuple(Between(**_frozen(entry)) for entry in data["between"]),
        tuple(Beyond(**_frozen(entry)) for entry in data["beyond"]),
    )


def _frozen(entry: dict[str, Any]) -> dict[str, Any]:
    return {key: tuple(v) if isinstance(v, list) else v for key, v in entry.items()}

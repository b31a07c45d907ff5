"""The figure to fit: linked segments in a tree, read from a TOML file (thesis 5.5.1, arbitrary figure)."""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from mocap_skel.errors import SkeletonError
from mocap_skel.text import nearest, read_text

SHIPPED = Path(__file__).parent / "skeletons"
STANDARD = "human"
T = TypeVar("T")


@dataclass(frozen=True)
class Prior:
    """What is known of a joint before any motion: the mean of landmarks, sd in metres, and whose word it is."""

    landmarks: tuple[str, ...]
    sd: float
    source: str


@dataclass(frozen=True)
class Segment:
    """A rigid part of the figure.

    Attributes:
        name: the segment.
        parent: the segment it hangs from, None for the root.
        joint: the joint towards the parent, None for the root.
        markers: the standard names of the markers that may sit on it.
        ends: the markers whose mean is its end point when it is a leaf; empty means all.
        prior: optional knowledge about the joint.
    """

    name: str
    parent: str | None
    joint: str | None
    markers: tuple[str, ...]
    ends: tuple[str, ...] = ()
    prior: Prior | None = None


@dataclass(frozen=True)
class Skeleton:
    """A tree of segments, every parent before its children, the root first."""

    name: str
    segments: tuple[Segment, ...]

    def __getitem__(self, name: str) -> Segment:
        return next(s for s in self.segments if s.name == name)

    @property
    def root(self) -> Segment:
        return self.segments[0]

    @property
    def leaves(self) -> tuple[Segment, ...]:
        parents = {s.parent for s in self.segments}
        return tuple(s for s in self.segments if s.name not in parents)

    @property
    def joints(self) -> tuple[str, ...]:
        return tuple(s.joint for s in self.segments if s.joint)

    @property
    def segment_of(self) -> Mapping[str, str]:
        """Segment of every standard marker name."""
        return {marker: s.name for s in self.segments for marker in s.markers}


def read_skeleton(source: str | Path) -> Skeleton:
    """Read a skeleton file, or a shipped skeleton by its bare name (``human``).

    Raises:
        SkeletonError: no such file, not TOML, or a tree that does not hold together.
    """
    path = Path(source)
    if not path.exists() and (SHIPPED / f"{source}.toml").exists():
        path = SHIPPED / f"{source}.toml"
    if not path.exists():
        known = ", ".join(sorted(p.stem for p in SHIPPED.glob("*.toml")))
        raise SkeletonError(f"{source}: no such skeleton file", f"shipped ones: {known}")
    try:
        data = tomllib.loads(read_text(path, SkeletonError))
    except tomllib.TOMLDecodeError as error:
        raise SkeletonError(f"{path}: {error}") from error
    return _build(data, str(path))


def _build(data: dict[str, Any], where: str) -> Skeleton:
    _keys(data, {"name", "segment"}, where)
    entries = data.get("segment")
    if not isinstance(entries, list) or not entries:
        raise SkeletonError(f"{where}: no [[segment]] in it")
    segments = [_segment(entry, f"{where}: segment {i}") for i, entry in enumerate(entries, 1)]
    _check_tree(segments, where)
    name = data.get("name", Path(where).stem)
    return Skeleton(_is(name, str, f"{where}: name", "a text"), tuple(_in_order(segments, where)))


def _segment(entry: Any, where: str) -> Segment:
    entry = _is(entry, dict, where, "a table")
    name = _is(entry.get("name"), str, f"{where}: name", "a text")
    where = f"{where} ({name})"
    _keys(entry, {"name", "parent", "joint", "markers", "ends", "prior"}, where)
    parent, joint = entry.get("parent"), entry.get("joint")
    if (parent is None) != (joint is None):
        raise SkeletonError(f"{where}: 'parent' and 'joint' belong together; the root has neither")
    markers = _names(entry.get("markers", []), f"{where}: markers")
    ends = _names(entry.get("ends", []), f"{where}: ends")
    for end in ends:
        if end not in markers:
            raise SkeletonError(f"{where}: end {end!r} is not one of its markers")
    if parent is not None:
        _is(parent, str, f"{where}: parent", "a text")
        _is(joint, str, f"{where}: joint", "a text")
    prior = entry.get("prior")
    return Segment(
        name, parent, joint, markers, ends, None if prior is None else _prior(prior, where)
    )


def _prior(entry: Any, where: str) -> Prior:
    where = f"{where}: prior"
    entry = _is(entry, dict, where, "a table")
    _keys(entry, {"mean", "sd", "source"}, where)
    sd = entry.get("sd")
    if isinstance(sd, bool) or not isinstance(sd, int | float) or not sd > 0:
        raise SkeletonError(f"{where}: sd is a length in metres above 0, not {sd!r}")
    source = _is(entry.get("source", ""), str, f"{where}: source", "a text")
    return Prior(_names(entry.get("mean", []), f"{where}: mean"), float(sd), source)


def _check_tree(segments: list[Segment], where: str) -> None:
    names = [s.name for s in segments]
    for kind, values in (
        ("segment", names),
        ("joint", [s.joint for s in segments if s.joint]),
        ("marker", [m for s in segments for m in s.markers]),
    ):
        for value, count in Counter(values).items():
            if count > 1:
                raise SkeletonError(f"{where}: {kind} {value!r} stands in it {count} times")
    roots = [s.name for s in segments if s.parent is None]
    if len(roots) != 1:
        raise SkeletonError(f"{where}: exactly one root (no parent) is needed, found {roots}")
    for s in segments:
        if s.parent is not None and s.parent not in names:
            raise SkeletonError(
                f"{where}: segment {s.name!r} hangs from unknown {s.parent!r}",
                nearest(s.parent, names),
            )
    # Both stand side by side as column names of skeleton.csv.
    shared = sorted(set(names) & {s.joint for s in segments if s.joint})
    if shared:
        raise SkeletonError(f"{where}: {shared[0]!r} names a segment and a joint; use two names")


def _in_order(segments: list[Segment], where: str) -> list[Segment]:
    """Parents before children, otherwise as written."""
    placed: list[Segment] = []
    waiting = list(segments)
    while waiting:
        done = {s.name for s in placed}
        ready = [s for s in waiting if s.parent is None or s.parent in done]
        if not ready:
            loop = ", ".join(s.name for s in waiting)
            raise SkeletonError(f"{where}: these segments hang in a circle: {loop}")
        # One at a time keeps a branch together, as the file has it.
        placed.append(ready[0])
        waiting.remove(ready[0])
    return placed


def _names(value: Any, where: str) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(v, str) and v for v in value):
        raise SkeletonError(f"{where}: a list of names is needed, not {value!r}")
    return tuple(value)


def _is(value: Any, kind: type[T], where: str, what: str) -> T:
    if not isinstance(value, kind):
        raise SkeletonError(f"{where}: {what} is needed, not {value!r}")
    return value


def _keys(entry: dict[str, Any], known: set[str], where: str) -> None:
    for key in entry:
        if key not in known:
            raise SkeletonError(f"{where}: unknown key {key!r}", nearest(key, sorted(known)))

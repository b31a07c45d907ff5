"""The figure to fit: segments that hang on each other, read from a TOML file (thesis 5.5.1, arbitrary figure)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

from mocap_skel.errors import SkeletonError, ours
from mocap_skel.figure.prior_tables import (
    Prior,
    read_landmarks,
    read_measured,
    read_priors,
    read_sizes,
)
from mocap_skel.figure.rest_keys import REST_KEYS, Vector, read_rest
from mocap_skel.figure.toml_checks import a_name, is_a, known_keys, names, number
from mocap_skel.figure.toml_places import Places
from mocap_skel.text import listed, nearest, parse_toml, printable, read_text

SHIPPED = Path(__file__).parent / "skeletons"
STANDARD = "human"
# Markers that a root's pose needs.
LEAST_ON_ROOT = 3
SEGMENT_KEYS = {
    "name", "parent", "joint", "markers", "ends", "prior", "looseness", "movement", "freedom",
    "sole", *REST_KEYS,
}  # fmt: skip
FREEDOMS = ("ball", "hinge", "universal")
# What a joint takes from the one of its name in another file (`like`), key → attribute.
TAKEN = {"prior": "priors", "looseness": "looseness", "movement": "movement", "freedom": "freedom"}


@dataclass(frozen=True)
class Segment:
    """A rigid part of the figure.

    Attributes:
        name: the segment.
        parent: the segment it hangs from, None for the root.
        joint: the joint towards the parent, None for the root.
        markers: the standard names of the markers that may sit on it.
        ends: the markers whose mean is its end point when it is a leaf; empty means all.
        priors: where anatomy has the joint, the best first; the first whose landmarks are there is used.
        looseness: how much the bones of the joint roll and glide, compared with a hip.
        movement: the movement that shows the joint, in words for the subject.
        rest: direction of its bone, from its joint to the next one or its end, in the T-pose. All directions
            of the T-pose are along the character's axes: x to its left, y up, z forward.
        rest_joint: where in the T-pose its joint lies in a parent with several joints, from the parent's joint;
            in any unit, for only the shape counts.
        freedom: how the joint of a rigid figure turns: "ball", "hinge" about the axis that the clip shows, or "universal"
            about the two axes that it shows.
        sole: markers that stand on the floor when the segment does.
        rest_axis: the axis that the joint bends about, where it is a hinge, in the T-pose.
    """

    name: str
    parent: str | None
    joint: str | None
    markers: tuple[str, ...]
    ends: tuple[str, ...] = ()
    priors: tuple[Prior, ...] = ()
    looseness: float = 1.0
    movement: str = ""
    rest: Vector | None = None
    rest_joint: Vector | None = None
    rest_axis: Vector | None = None
    freedom: str = "ball"
    sole: tuple[str, ...] = ()


@dataclass(frozen=True)
class Skeleton:
    """A tree of segments, every parent before its children, the root first.

    Attributes:
        name: the figure.
        segments: parents first.
        landmarks: name → sets of markers whose mean it is, the best first.
        sizes: two markers and their distance in metres in a person of 1.75 m.
        measures: of a person, by their full names: the two landmarks that each is between.
    """

    name: str
    segments: tuple[Segment, ...]
    landmarks: Mapping[str, tuple[tuple[str, ...], ...]] = field(default_factory=dict)
    sizes: tuple[tuple[str, str, float], ...] = ()
    measures: Mapping[str, tuple[str, str]] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Segment:
        """The segment of that name."""
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
    """Read a skeleton file: a path, or the name of a shipped one (``human``).

    Raises:
        SkeletonError: there is no such file, it is no TOML, a value in it is wrong, or its segments are no
            tree; names file, line and column.

    >>> leg = read_skeleton("right_leg")
    >>> leg.root.name, leg.joints
    ('UpperRightLeg', ('RightKnee', 'RightAnkle'))
    >>> leg["RightFoot"].parent
    'LowerRightLeg'
    """
    with ours(source, SkeletonError):
        path = Path(source)
        if not path.is_file() and (SHIPPED / f"{source}.toml").exists():
            return _shipped(str(source))
        if not path.exists():
            known = list(shipped_skeletons())
            hint = nearest(str(source), known, 0.6) or f"shipped ones: {', '.join(known)}"
            raise SkeletonError("no such skeleton file", hint)
    return _read(path)


def shipped_skeletons() -> dict[str, Skeleton]:
    """The skeletons that come with the program, by their names for `read_skeleton`.

    >>> list(shipped_skeletons())[:3]
    ['hand', 'head', 'human']
    """
    return {path.stem: _shipped(path.stem) for path in sorted(SHIPPED.glob("*.toml"))}


@cache
def _shipped(name: str) -> Skeleton:
    """A skeleton that comes with the program. Its file does not change, so it is read once."""
    return _read(SHIPPED / f"{name}.toml")


def _read(path: Path, readers: tuple[Path, ...] = ()) -> Skeleton:
    """Read a file; `readers` are those that it is read for, since they are `like` it."""
    text = read_text(path, SkeletonError)
    data = parse_toml(path, text, SkeletonError)
    return _build(data, Places(path, text), (*readers, path.resolve()))


def shipped_with_root(seen: Collection[str]) -> list[str]:
    """The shipped figures whose root is one of these segments, those that have the most of them.

    >>> shipped_with_root(["UpperRightLeg", "RightFoot"])
    ['right_leg']
    """
    counts = {
        name: sum(s.name in seen for s in figure.segments)
        for name, figure in shipped_skeletons().items()
        if figure.root.name in seen
    }
    return [name for name, count in counts.items() if count == max(counts.values())]


def _build(data: dict[str, Any], places: Places, readers: tuple[Path, ...]) -> Skeleton:
    """The skeleton of a file's data, checked."""
    known_keys(data, {"name", "like", "landmarks", "sizes", "measures", "segment"}, places, None)
    entries = data.get("segment")
    if not isinstance(entries, list) or not entries:
        raise SkeletonError(f"{places.of(None)}: no [[segment]] in it")
    segments = [_segment(entry, places, i) for i, entry in enumerate(entries)]
    _check_tree(segments, places)
    name = a_name(data.get("name", printable(places.path.stem)), places.of(None, "name"), "name")
    landmarks, sizes = read_landmarks(data, places), read_sizes(data, places)
    measures = read_measured(data, places)
    if "like" in data:
        model = _model(data["like"], places, readers)
        segments = [_taken(s, e, model) for s, e in zip(segments, entries, strict=True)]
        landmarks = {**model.landmarks, **landmarks}
        sizes = sizes if "sizes" in data else model.sizes
        measures = {**model.measures, **measures}
    return Skeleton(name, tuple(_in_order(segments, places)), landmarks, sizes, measures)


def _model(name: Any, places: Places, readers: tuple[Path, ...]) -> Skeleton:
    """The skeleton that a file is `like`: a file beside it, or a shipped one by its name."""
    here = places.of(None, "like")
    beside = places.path.parent / is_a(name, str, here, "like: the name of a skeleton")
    with ours(str(here), SkeletonError):
        path = beside if beside.is_file() else SHIPPED / f"{name}.toml"
        there = path.is_file()
    if not there:
        shipped = sorted(p.stem for p in SHIPPED.glob("*.toml"))
        raise SkeletonError(
            f"{here}: like: no such skeleton {name!r}",
            nearest(name, shipped) or f"a file beside this one, or one of: {', '.join(shipped)}",
        )
    if path.resolve() in readers:
        raise SkeletonError(f"{here}: like: {name!r} leads back to this file; leave it out")
    return _read(path, readers) if path == beside else _shipped(name)


def _taken(segment: Segment, entry: dict[str, Any], model: Skeleton) -> Segment:
    """Complete a segment: what it does not say itself it takes from the model's joint of the same name."""
    same = next((s for s in model.segments if s.joint and s.joint == segment.joint), None)
    if same is None:
        return segment
    taken = {key: getattr(same, key) for own, key in TAKEN.items() if own not in entry}
    return replace(segment, **taken)


def _segment(entry: Any, places: Places, i: int) -> Segment:
    """The i-th segment of a file, each of its values checked."""
    here = places.of(i)
    entry = is_a(entry, dict, here, "segment: a table")
    if "name" not in entry:
        raise SkeletonError(f"{here}: a segment without a name")
    name = a_name(entry["name"], places.of(i, "name"), "name")
    if not name:
        raise SkeletonError(f"{places.of(i, 'name')}: a segment without a name")
    known_keys(entry, SEGMENT_KEYS, places, i)
    parent, joint = entry.get("parent"), entry.get("joint")
    if (parent is None) != (joint is None):
        raise SkeletonError(
            f"{places.of(i, 'joint' if parent is None else 'parent')}: segment {name!r}: "
            "'parent' and 'joint' belong together; the root has neither"
        )
    markers = names(entry.get("markers", []), places, i, "markers")
    ends = names(entry.get("ends", []), places, i, "ends")
    _check_own(ends, markers, name, places, i, "ends")
    if parent is not None:
        a_name(parent, places.of(i, "parent"), "parent")
        if not a_name(joint, places.of(i, "joint"), "joint"):
            raise SkeletonError(f"{places.of(i, 'joint')}: a joint without a name")
    priors = read_priors(entry.get("prior"), places, i)
    looseness = number(
        entry.get("looseness", 1.0), places.of(i, "looseness"), "looseness is a number above 0",
        positive=True,
    )  # fmt: skip
    rest = read_rest(entry, places, i, root=parent is None)
    movement = is_a(entry.get("movement", ""), str, places.of(i, "movement"), "movement: a text")
    freedom = entry.get("freedom", "ball")
    if freedom not in FREEDOMS:
        raise SkeletonError(
            f"{places.of(i, 'freedom')}: freedom is one of {', '.join(FREEDOMS)}, not {freedom!r}"
        )
    sole = names(entry.get("sole", []), places, i, "sole")
    _check_own(sole, markers, name, places, i, "sole")
    return Segment(
        name, parent, joint, markers, ends, priors, looseness, movement, *rest, freedom, sole
    )


def _check_own(
    chosen: tuple[str, ...], markers: tuple[str, ...], name: str, places: Places, i: int, key: str
) -> None:
    """Refuse a marker that is none of the segment's."""
    for marker in chosen:
        if marker not in markers:
            what = "end" if key == "ends" else key
            raise SkeletonError(
                f"{places.of(i, key, marker)}: {what} {marker!r} of {name!r} is not one of its markers",
                nearest(marker, markers),
            )


def _check_tree(segments: list[Segment], places: Places) -> None:
    """Raise an error where a name stands twice, the root is not one, or a parent is not there."""
    all_names = [s.name for s in segments]
    for kind, key, values in (
        ("segment", "name", [(i, s.name) for i, s in enumerate(segments)]),
        ("joint", "joint", [(i, s.joint) for i, s in enumerate(segments) if s.joint]),
        ("marker", "markers", [(i, m) for i, s in enumerate(segments) for m in s.markers]),
    ):
        counts = Counter(value for _, value in values)
        last = {value: i for i, value in values}
        for value, count in counts.items():
            if count > 1:
                where = places.of(last[value], key, value)
                raise SkeletonError(f"{where}: {kind} {value!r} stands in it {count} times")
    roots = [i for i, s in enumerate(segments) if s.parent is None]
    if len(roots) != 1:
        found = listed(all_names[i] for i in roots) or "none"
        raise SkeletonError(
            f"{places.of(roots[1] if roots else 0)}: exactly one root (a segment without parent and "
            f"joint) is needed, found {found}"
        )
    for i, s in enumerate(segments):
        if s.parent is not None and s.parent not in all_names:
            raise SkeletonError(
                f"{places.of(i, 'parent', s.parent)}: segment {s.name!r} hangs from unknown "
                f"{s.parent!r}",
                nearest(s.parent, all_names) or f"its segments: {listed(all_names)}",
            )
    # Both stand side by side as column names of skeleton.csv.
    for i, s in enumerate(segments):
        if s.joint in all_names:
            raise SkeletonError(
                f"{places.of(i, 'joint', s.joint)}: {s.joint!r} names a segment and a joint; "
                "use two names"
            )


def _in_order(segments: list[Segment], places: Places) -> list[Segment]:
    """Sort segments: parents before children, otherwise as they are written."""
    placed: list[Segment] = []
    waiting = list(segments)
    while waiting:
        done = {s.name for s in placed}
        ready = [s for s in waiting if s.parent is None or s.parent in done]
        if not ready:
            loop = ", ".join(s.name for s in waiting)
            where = places.of(segments.index(waiting[0]), "parent")
            raise SkeletonError(f"{where}: these segments hang in a circle: {loop}")
        # One at a time keeps a branch together, as the file has it.
        placed.append(ready[0])
        waiting.remove(ready[0])
    return placed

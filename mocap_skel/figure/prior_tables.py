"""Priors in a skeleton file: where anatomy has a joint, as landmarks and steps from them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mocap_skel.errors import SkeletonError
from mocap_skel.figure.toml_checks import is_a, known_keys, names, number
from mocap_skel.figure.toml_places import Places
from mocap_skel.measures import MEASURES
from mocap_skel.text import nearest


@dataclass(frozen=True)
class Shift:
    """A step from the mean of a prior's landmarks: a direction, and how far.

    Attributes:
        line: two landmarks: the direction from the first to the second.
        across: four landmarks: the direction perpendicular to two lines, (first → second) × (third → fourth).
        hinge: 1 or -1: inward along the joint's hinge axis, to the side of (bone above) × (bone below) or
            to the other one; 0 for another direction.
        ratio: how far, as a share of the length of the (first) line.
        of: two other landmarks whose distance `ratio` is a share of.
        by: metres beside that, for a person of 1.75 m.
        toward: for a hinge: markers of the child far down its bone.
        beside: for a hinge: metres by which these lie beside the bone, on the landmark's side.
        upper: for a hinge: landmarks that stand for the bone's upper joint if the parent is the root, which has none.
        aside: for a hinge: metres by which these lie beside the bone, on the landmark's side.
        straight: for a hinge: two markers of the figure; the line from the first to the second points inward
            while the limb hangs straight.
        turned: for a hinge: radians by which a hanging limb turns away from that.
        inside: for a hinge: radians by which a hanging limb is turned about its length from that line, to the inside.
        hanging: for a hinge: two landmarks; the line from the first to the second points down. The farther the limb is
            from hanging along it, and the more it is bent, the less `straight` counts.
        plane: for a hinge: whether the child bends in a plane, so that what leaves the plane is skin that turns the
            parent's markers about its length.
        sd: metres by which the step's length is off, beside the prior's own error.
    """

    line: tuple[str, ...] = ()
    across: tuple[str, ...] = ()
    hinge: int = 0
    ratio: float = 0.0
    of: tuple[str, ...] = ()
    by: float = 0.0
    toward: tuple[str, ...] = ()
    beside: float = 0.0
    upper: tuple[str, ...] = ()
    aside: float = 0.0
    straight: tuple[str, ...] = ()
    turned: float = 0.0
    inside: float = 0.0
    hanging: tuple[str, ...] = ()
    plane: bool = False
    sd: float = 0.0


@dataclass(frozen=True)
class Prior:
    """Where anatomy has a joint.

    Attributes:
        mean: landmarks of the parent segment whose mean it starts from; none for one step along a hinge whose markers
            are all on the outer side of both segments (halfway between the middles of both, known along the axis
            alone), and for one step from the child's markers back to the parent's own joint.
        sd: how sure that is, in metres for a person of 1.75 m.
        source: where the numbers come from, for people.
        shifts: steps from that mean.
    """

    mean: tuple[str, ...]
    sd: float
    source: str
    shifts: tuple[Shift, ...] = ()


def read_priors(entry: Any, places: Places, i: int) -> tuple[Prior, ...]:
    """Read a segment's `prior`: one table, or several with the best first.

    Args:
        entry: the value in the file, None for none.
        places: of the file.
        i: the segment's index in it.

    Raises:
        SkeletonError: a table, a key or a value is wrong.
    """
    if entry is None:
        return ()
    entries = entry if isinstance(entry, list) else [entry]
    return tuple(_prior(each, places, i) for each in entries)


def _prior(entry: Any, places: Places, i: int) -> Prior:
    """One table of a prior."""
    entry = is_a(entry, dict, places.of(i, "prior"), "prior: a table")
    known_keys(entry, {"mean", "shift", "sd", "source"}, places, i, "prior.")
    sd = number(
        entry.get("sd"), places.of(i, "prior.sd"), "sd is a length in metres above 0", positive=True
    )
    source = is_a(entry.get("source", ""), str, places.of(i, "prior.source"), "source: a text")
    mean = names(entry.get("mean", []), places, i, "prior.mean")
    entries = is_a(entry.get("shift", []), list, places.of(i, "prior.shift"), "shift: a list")
    shifts = tuple(_shift(each, places, i, mean=bool(mean)) for each in entries)
    if not mean and [bool(shift.hinge or shift.toward) for shift in shifts] != [True]:
        raise SkeletonError(
            f"{places.of(i, 'prior.mean')}: a prior starts at the mean of landmarks, or is one step along a hinge "
            "or from markers of the child"
        )
    return Prior(mean, sd, source, shifts)


def _shift(entry: Any, places: Places, i: int, *, mean: bool) -> Shift:
    """One step of a prior: exactly one direction, with all that this direction needs.

    Args:
        entry: the table.
        places: of the file.
        i: the segment's index in it.
        mean: whether the prior starts at landmarks; else a hinge needs no markers of the child.
    """
    here = places.of(i, "prior.shift")
    entry = is_a(entry, dict, here, "shift: a list of tables")
    known = {
        "line", "across", "hinge", "ratio", "of", "by", "toward", "beside", "upper", "aside",
        "straight", "turned", "inside", "hanging", "plane", "sd",
    }  # fmt: skip
    known_keys(entry, known, places, i, "prior.shift.")
    points = {
        key: names(entry.get(key, []), places, i, f"prior.shift.{key}")
        for key in ("line", "across", "of", "toward", "upper", "straight", "hanging")
    }
    for key, count in (("line", 2), ("across", 4), ("of", 2), ("straight", 2), ("hanging", 2)):
        if len(points[key]) not in (0, count):
            raise SkeletonError(f"{here}: {key} is {count} landmarks, not {list(points[key])}")
    hinge = entry.get("hinge", 0)
    if hinge not in (-1, 0, 1) or isinstance(hinge, bool):
        raise SkeletonError(f"{here}: hinge is 1 or -1, not {hinge!r}")
    back = not mean and not hinge and points["toward"]
    if sum(map(bool, (points["line"], points["across"], hinge, back))) != 1:
        raise SkeletonError(f"{here}: a shift has one direction: line, across or hinge")
    if hinge and mean and not points["toward"]:
        raise SkeletonError(
            f"{here}: a shift along a hinge needs markers of the child, toward = [...]"
        )
    plane = is_a(entry.get("plane", False), bool, here, "plane: true or false")
    if plane and not (hinge and mean):
        raise SkeletonError(f"{here}: plane is for a shift along a hinge, from a landmark")
    numbers = {
        key: number(entry.get(key, 0.0), here, f"{key} is a number")
        for key in ("ratio", "by", "beside", "aside", "turned", "inside", "sd")
    }
    if hinge and not numbers["by"] > 0:
        raise SkeletonError(f"{here}: a shift along a hinge needs its length in metres, by = ...")
    if points["straight"] and not numbers["turned"] > 0:
        raise SkeletonError(
            f"{here}: straight needs how far it may be off in radians, turned = ..."
        )
    return Shift(
        line=points["line"], across=points["across"], of=points["of"], toward=points["toward"],
        hinge=hinge, ratio=numbers["ratio"], by=numbers["by"], beside=numbers["beside"],
        upper=points["upper"], aside=numbers["aside"], straight=points["straight"],
        turned=numbers["turned"], inside=numbers["inside"], hanging=points["hanging"], plane=plane, sd=numbers["sd"],
    )  # fmt: skip


def read_landmarks(
    data: Mapping[str, Any], places: Places
) -> dict[str, tuple[tuple[str, ...], ...]]:
    """Read the file's `landmarks`: name → sets of markers; the first set that a clip has is used.

    Raises:
        SkeletonError: it is no table of lists of lists of names.
    """
    here = places.of(None, "landmarks")
    found = is_a(data.get("landmarks", {}), dict, here, "landmarks: a table")
    landmarks = {}
    for name, sets in found.items():
        where = places.of(None, f"landmarks.{name}")
        sets = is_a(sets, list, where, f"{name}: a list of lists of markers")
        good = sets and all(
            isinstance(s, list) and s and all(isinstance(m, str) for m in s) for s in sets
        )
        if not good:
            raise SkeletonError(
                f"{where}: {name}: a list of lists of markers is needed, not {sets!r}"
            )
        landmarks[name] = tuple(tuple(s) for s in sets)
    return landmarks


def read_sizes(data: Mapping[str, Any], places: Places) -> tuple[tuple[str, str, float], ...]:
    """Read the file's `sizes`: two markers and their distance in metres in a person of 1.75 m.

    Raises:
        SkeletonError: it is no list of [MARKER, MARKER, METRES].
    """
    here = places.of(None, "sizes")
    found = is_a(data.get("sizes", []), list, here, "sizes: a list")
    sizes = []
    for entry in found:
        if (
            not isinstance(entry, list)
            or len(entry) != 3
            or not all(isinstance(name, str) for name in entry[:2])
        ):
            raise SkeletonError(f"{here}: sizes: [MARKER, MARKER, METRES] is needed, not {entry!r}")
        length = number(entry[2], here, "a size is a length in metres above 0", positive=True)
        sizes.append((entry[0], entry[1], length))
    return tuple(sizes)


def read_measured(data: Mapping[str, Any], places: Places) -> dict[str, tuple[str, str]]:
    """Read the file's `measures`: name of a measure → the two landmarks that it is between.

    Raises:
        SkeletonError: no such measure, or not two names.
    """
    here = places.of(None, "measures")
    found = is_a(data.get("measures", {}), dict, here, "measures: a table")
    measures = {}
    for name, ends in found.items():
        where = places.of(None, f"measures.{name}")
        if name not in MEASURES:
            raise SkeletonError(f"{where}: there is no measure {name!r}", nearest(name, MEASURES))
        if (
            not isinstance(ends, list)
            or len(ends) != 2
            or not all(isinstance(e, str) for e in ends)
        ):
            raise SkeletonError(f"{where}: {name}: two landmarks are needed, not {ends!r}")
        measures[name] = (ends[0], ends[1])
    return measures

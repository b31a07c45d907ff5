"""A figure with the measures of a person in place of the book's."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from mocap_skel.figure.prior_tables import Prior, Shift
from mocap_skel.figure.skeleton import Skeleton
from mocap_skel.text import listed

# Metres: the skeleton files' widths are for markers whose centres lie so far outside the skin.
RADIUS = 0.007
# Bone breadths vary by 7 % in people of one stature (Gordon 1989), and the subject's size is known to 10 %: a
# width outside three standard deviations of both is a slip of the pen.
LEAST, MOST = 0.7, 1.45
# Two places for a landmark differ by a centimetre or two (Della Croce 2005), and by this share of a distance.
APART, SHARE = 0.02, 0.15
# Anterior spine to malleolus, and stature, of the person of size 1, metres (Gordon 1989).
LEG, STATURE = 0.92, 1.75
# A size from one of these and one from the markers differ by no more than proportions do.
PROPORTIONS = 0.2


@dataclass(frozen=True)
class Measured:
    """A figure for one person.

    Attributes:
        skeleton: the figure, the measures of the person in it.
        notes: what was used, and what contradicts the markers, one sentence each.
    """

    skeleton: Skeleton
    notes: tuple[str, ...]


def size_by(measures: Mapping[str, float]) -> float | None:
    """The subject's size, 1 for a person of 1.75 m, by the height or the legs; None without either.

    >>> size_by({"height": 1.4})
    0.8
    """
    if "height" in measures:
        return round(measures["height"] / STATURE, 6)
    legs = [measures[name] for name in ("left_leg_length", "right_leg_length") if name in measures]
    return sum(legs) / len(legs) / LEG if legs else None


def with_measures(
    skeleton: Skeleton,
    measures: Mapping[str, float],
    size: float,
    distance: Callable[[str, str], float | None],
) -> Measured:
    """The figure whose priors have a person's own widths: half the joint's and the marker's radius.

    A measure that contradicts what the markers show, or what a person of that size can have, is not used.

    Args:
        skeleton: its `measures` say between which landmarks each is.
        measures: full name → metres.
        size: the subject's, 1 for a person of 1.75 m.
        distance: metres between two markers, None where they are not seen together.

    >>> from mocap_skel.figure.skeleton import read_skeleton
    >>> known = {"left_knee_width": 0.10, "marker_diameter": 0.014}
    >>> found = with_measures(read_skeleton("human"), known, 1.0, lambda a, b: None)
    >>> round(found.skeleton["LowerLeftLeg"].priors[1].shifts[0].by, 4)
    0.057
    >>> found.notes
    ('measures of the person in place of the table: left knee width 10 cm, marker diameter 1.4 cm',)
    """
    radius = measures.get("marker_diameter", 2 * RADIUS) / 2
    notes, used = [], []
    depths: dict[str, float] = {}
    spans: dict[frozenset[str], float] = {}
    for name, (first, second) in skeleton.measures.items():
        value = measures.get(name)
        if value is None:
            continue
        width = name.endswith("_width")
        seen = _between(skeleton, first, second, distance)
        markers = value + 2 * radius if width else value
        if seen is not None and abs(seen - markers) > APART + SHARE * markers:
            notes.append(
                f"{_words(name)} is said to be {_cm(value)}, but its markers are {_cm(seen)} apart: not used"
            )
            continue
        if not width:
            spans[frozenset((first, second))] = value
        elif seen is None:
            table = _table_width(skeleton, first)
            if table is not None and not LEAST <= value / (table * size) <= MOST:
                notes.append(
                    f"{_words(name)} is said to be {_cm(value)}; a person whose limbs measure like these has "
                    f"about {_cm(table * size)}: not used"
                )
                continue
            depths[first] = value / 2 + radius
        else:
            # Both sides of the joint have a marker: its middle needs no width.
            continue
        used.append(name)
    if "marker_diameter" in measures:
        used.append("marker_diameter")
    notes += _sizes(measures, size)
    if used:
        said = listed([f"{_words(name)} {_cm(measures[name])}" for name in used], 20)
        notes.insert(0, f"measures of the person in place of the table: {said}")
    own = {first for first, _ in skeleton.measures.values()}

    def prior(one: Prior) -> Prior:
        shifts = [
            _hinge(s, one.mean, depths, own, radius, size) if s.hinge else _span(s, spans, size)
            for s in one.shifts
        ]
        return replace(one, shifts=tuple(shifts))

    segments = [replace(s, priors=tuple(map(prior, s.priors))) for s in skeleton.segments]
    return Measured(replace(skeleton, segments=tuple(segments)), tuple(notes))


def _hinge(
    shift: Shift,
    mean: tuple[str, ...],
    depths: Mapping[str, float],
    own: set[str],
    radius: float,
    size: float,
) -> Shift:
    """The step inward by the person's own width; what the table has is for a marker of `RADIUS`."""
    # A prior without a landmark starts from the middles of the segments' markers, and no marker's radius counts.
    if not mean:
        return shift
    known = depths.get(mean[0])
    by = shift.by + (radius - RADIUS) / size if known is None else known / size
    (far, *others) = shift.toward
    if far in depths and not others:
        beside = depths[far] / size
    elif far in own and not others:
        # The outer marker of the next joint, whose width nobody has told.
        beside = shift.beside
    else:
        # As far beside the bone as the landmark is.
        beside = shift.beside * by / shift.by
    return replace(shift, by=by, beside=beside)


def _span(shift: Shift, spans: Mapping[frozenset[str], float], size: float) -> Shift:
    """A step by a share of a distance of landmarks that was measured on the person."""
    ends = shift.of or shift.line or shift.across[:2]
    value = spans.get(frozenset(ends))
    if value is None:
        return shift
    return replace(shift, ratio=0.0, of=(), by=shift.by + shift.ratio * value / size)


def _table_width(skeleton: Skeleton, marker: str) -> float | None:
    """The bone's breadth that the priors have at a marker, metres in a person of 1.75 m."""
    for segment in skeleton.segments:
        for prior in segment.priors:
            for shift in prior.shifts:
                if shift.hinge and prior.mean == (marker,):
                    return 2 * (shift.by - RADIUS)
    return None


def _between(
    skeleton: Skeleton, first: str, second: str, distance: Callable[[str, str], float | None]
) -> float | None:
    """Metres between two landmarks that are one marker each."""
    ends = [
        [markers[0] for markers in skeleton.landmarks.get(name, ((name,),)) if len(markers) == 1]
        for name in (first, second)
    ]
    found = [distance(a, b) for a in ends[0] for b in ends[1]]
    return next((d for d in found if d is not None), None)


def _sizes(measures: Mapping[str, float], size: float) -> list[str]:
    """A sentence where height or leg length contradicts the limbs of the clip."""
    told = size_by(measures)
    if told is None or abs(told / size - 1) <= PROPORTIONS:
        return []
    name = "height" if "height" in measures else "leg length"
    value = _cm(measures.get("height", told * LEG))
    return [f"{name} is said to be {value}, the limbs measure like those of {_cm(size * STATURE)}"]


def _words(name: str) -> str:
    return name.replace("inter_asis", "inter-ASIS distance").replace("_", " ")


def _cm(metres: float) -> str:
    return f"{100 * metres:.3g} cm"

"""Is the body as large as a body? A unit that does not go with the numbers makes it a giant or a dwarf."""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mocap_skel.clip import Clip
from mocap_skel.errors import CallError
from mocap_skel.labels.association import Assignment
from mocap_skel.labels.guess.columns import Columns, columns_by_names
from mocap_skel.readers.units import metres_in

Array = NDArray[np.float64]

# Metres of stature, from newborn to giant; where few distances tell of it they may be so many times as far off.
SHORTEST, TALLEST = 0.4, 2.6
_FEW, _ROOM = 4, 1.6
# The stature that a guessed unit comes nearest to.
_USUAL = 1.7
# Metres across the markers of a figure that is no human, from a mouse to an elephant, and the usual one.
_LEAST_ACROSS, _MOST_ACROSS, _USUAL_ACROSS = 0.02, 20.0, 1.0
# Units by how often files have them: of two that fit about as well the first is named.
_UNITS = ("mm", "cm", "m", "in", "ft", "dm")
# Frames that tell a distance well enough.
_FRAMES = 200

# Shares of stature between the middles of the markers of two segments that meet at a joint: medians over the generated
# walk, range of motion and stand in the sets cmu and plug_in_gait, whose bones are Drillis and Contini's.
# They bend with the joint and differ between marker sets by a third; a wrong unit is a factor of 2.5 at least.
_SIDES = ("Left", "Right")
_SHARES: dict[tuple[str, str], float] = {
    ("Hips", "Chest"): 0.21,
    ("Chest", "Head"): 0.16,
    **{("Chest", f"Upper{s}Arm"): 0.2 for s in _SIDES},
    **{(f"Upper{s}Arm", f"Lower{s}Arm"): 0.155 for s in _SIDES},
    **{(f"Lower{s}Arm", f"{s}Hand"): 0.09 for s in _SIDES},
    **{("Hips", f"Upper{s}Leg"): 0.25 for s in _SIDES},
    **{(f"Upper{s}Leg", f"Lower{s}Leg"): 0.235 for s in _SIDES},
    **{(f"Lower{s}Leg", f"{s}Foot"): 0.1 for s in _SIDES},
}


@dataclass(frozen=True)
class WrongSize:
    """A body that is no body's size.

    Attributes:
        message: how large it is in the clip's unit.
        hint: the option that would make it right.
    """

    message: str
    hint: str

    def __str__(self) -> str:
        return f"{self.message}; {self.hint}"

    def told(self, clip: str, subject: str) -> tuple[str, str]:
        """Message and hint of an error, with whom it is about."""
        return f"{clip}: {subject + ': ' if subject else ''}{self.message}", self.hint


def wrong_size(clip: Clip, columns: Columns) -> WrongSize | None:
    """Whether a subject's size says that the clip's unit is wrong; None for a body of a possible size.

    The stature is the median over what each two neighbouring segments imply, so a leg or an arm alone tells it, in any
    posture. Of a figure with other segments (an animal, a hand with its fingers) only a size that no such figure
    can have is wrong.

    Args:
        clip: as it was read.
        columns: segment → marker → its column in the clip, of one subject.

    >>> from mocap_skel import associate, read_association, read_clip
    >>> cmu = read_association("cmu")
    >>> for unit in ("mm", "m"):
    ...     clip = read_clip("sample_data/nearly_still.c3d", unit=unit)
    ...     found = wrong_size(clip, associate(clip, cmu)[0].columns)
    ...     print(found and (found.message, found.hint))
    None
    ('the body would be 1,687 m tall if the unit is m', 'with --unit mm it is 1.69 m')
    """
    points = _some(clip, columns)
    middles = {segment: _middle(of) for segment, of in points.items() if of.shape[1]}
    statures = [
        stature
        for (parent, child), share in _joined(middles)
        if np.isfinite(stature := _median_length(middles[child] - middles[parent]) / share)
    ]
    if statures:
        room = _ROOM if len(statures) < _FEW else 1.0
        limits = (SHORTEST / room, TALLEST * room)
        return _judged(clip.unit, float(np.median(statures)), limits, _USUAL, "tall")
    across = _across(list(points.values()))
    limits = (_LEAST_ACROSS, _MOST_ACROSS)
    return _judged(clip.unit, across, limits, _USUAL_ACROSS, "across") if across else None


def check_size(clip: Clip, assignment: Assignment) -> None:
    """Raise an error if a subject's size says that the clip's unit is wrong.

    Raises:
        CallError: it does; the hint has the unit that fits.
    """
    found = wrong_size(clip, assignment.columns)
    if found is not None:
        raise CallError(*found.told(clip.name, assignment.subject))


def check_size_by_names(clip: Clip, subject: str | None = None) -> None:
    """As `check_size`, before it is known which label is which marker.

    Raises:
        CallError: a subject's size says that the unit is wrong.
    """
    for whose, found in sizes_by_names(clip, subject):
        raise CallError(*found.told(clip.name, whose))


def sizes_by_names(clip: Clip, subject: str | None = None) -> Iterator[tuple[str, WrongSize]]:
    """The subjects whose size says that the unit is wrong, by what their labels alone say of the segments.

    Args:
        clip: as it was read; its movement is not looked at, since what moves with what is told in metres.
        subject: only this one.

    Yields:
        Name and size of each; none of whom too few labels are known to be sure.
    """
    for whose, columns in columns_by_names(clip, subject):
        found = wrong_size(clip, columns) if len(_joined(columns)) >= _FEW else None
        if found is not None:
            yield whose, found


def _joined(segments: Container[str]) -> list[tuple[tuple[str, str], float]]:
    """The pairs of segments that meet at a joint, with their share of stature, of which both are there."""
    return [(pair, share) for pair, share in _SHARES.items() if all(s in segments for s in pair)]


def _judged(
    unit: str, size: float, limits: tuple[float, float], usual: float, way: str
) -> WrongSize | None:
    if limits[0] <= size <= limits[1]:
        return None
    stated = metres_in(unit)
    assert stated is not None  # a clip's unit is one of those that the readers know
    sizes = {name: size * (metres_in(name) or stated) / stated for name in _UNITS}
    fitting = {n: s for n, s in sizes.items() if limits[0] <= s <= limits[1]}
    message = f"the body would be {_metres(size)} {way} if the unit is {unit}"
    if not fitting:
        return WrongSize(message, "is it the unit, or the labels? --unit states another unit")
    best = min(fitting, key=lambda name: round(abs(np.log(fitting[name] / usual)), 1))
    return WrongSize(message, f"with --unit {best} it is {fitting[best]:.3g} m")


def _metres(size: float) -> str:
    return f"{size:,.0f} m" if size >= 100 else f"{size:.3g} m"


def _some(clip: Clip, columns: Columns) -> dict[str, Array]:
    """Segment → its markers (frames, M, 3) in some hundred of the frames."""
    all_of_them = [column for of in columns.values() for column in of.values()]
    seen = np.flatnonzero(np.isfinite(clip.points[:, all_of_them, 0]).any(axis=1))
    frames = seen[:: 1 + len(seen) // _FRAMES]
    some = clip.points[frames]
    return {segment: some[:, list(of.values())] for segment, of in columns.items()}


def _middle(points: Array) -> Array:
    """(frames, 3) the mean of the markers that are seen, of (frames, M, 3)."""
    seen = np.isfinite(points[..., :1])
    total = np.where(seen, points, 0.0).sum(axis=1)
    count = seen.sum(axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _across(points: Sequence[Array]) -> float:
    """Median over the frames of the diagonal of the box around the markers, 0 where none is seen."""
    together = np.concatenate(points, axis=1) if points else np.empty((0, 0, 3))
    if not together.size:
        return 0.0
    extent = np.fmax.reduce(together, axis=1) - np.fmin.reduce(together, axis=1)
    return float(np.nan_to_num(_median_length(extent)))


def _median_length(vectors: Array) -> float:
    length = np.sqrt((vectors**2).sum(axis=1))
    length = length[np.isfinite(length)]
    return float(np.median(length)) if len(length) else float("nan")

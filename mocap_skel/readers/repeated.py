"""Samples that nobody measured: a marker that stands still, or glides on a straight line, while the body moves.

Programs fill a gap by holding the last place, by a constant such as (-1, -1, -1), or by a straight line at
uniform speed. A camera's noise never repeats, so a second difference that is zero in every coordinate is the sign
of all three. In a file of coarse numbers real markers repeat too: there a stretch has to be longer than chance
makes, by how often the other markers repeat, and the distances to the nearest markers have to contradict it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mocap_skel.text import counted, listed

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# A second difference of three numbers in single precision, each rounded by half a unit in the last place, of
# a number that is at most twice the middle one.
_ROUNDING = 8 * 2.0**-24
# A stretch that the distances to other markers contradict. In 22 public clips the longest in one place has
# 8 samples; a number picked above that.
_SHORTEST = 10
# A stretch that nothing but its length speaks against.
_ALONE = 25
# Seconds: a straight line across a shorter gap is a usual repair, and does no harm.
_LONG_LINE = 0.2
# Expected number of such stretches in a clip whose samples repeat by chance.
_CHANCE = 1e-6
# Markers whose distances tell whether a marker is where it should be.
MATES = 3
# Robust standard deviations, and share of itself, that a distance may be off its median.
SPREADS, _SMALL = 6.0, 0.05
# Share of the others' way that a marker of a body goes at least: one on the floor or on a plate goes none.
_TRAVELS = 0.1
# Steps that a marker does not make: so many times its usual one.
_JUMP = 5.0
# Frames that tell a distance well enough.
FRAMES = 200
# Markers that get a note of their own.
_NOTED = 8


@dataclass(frozen=True)
class _Stretch:
    """Samples `first` to `last` of a marker that lie on a line, at uniform speed; `constant`: in one place."""

    marker: int
    first: int
    last: int
    constant: bool
    filler: bool

    @property
    def length(self) -> int:
        return self.last - self.first + 1


def repeated(points: Array, subjects: Sequence[str], rate: float) -> Mask | None:
    """Samples that repeat their place, or run on a straight line at uniform speed, while the others move.

    Args:
        points: (frames, markers, 3) in the file's unit, NaN = missing.
        subjects: one a marker: only markers of the same subject are compared.
        rate: frames a second.

    Returns:
        The samples (frames, markers), or None where there are none. A marker that never moves at all is left as
        it is, since it may stand on the floor, unless its three coordinates are the same number.

    >>> import numpy as np
    >>> points = np.cumsum(np.random.default_rng(0).normal(size=(200, 5, 3)), axis=0)
    >>> points[120:150, 2] = points[119, 2]
    >>> frames, markers = np.nonzero(repeated(points, [""] * 5, 100.0))
    >>> print(frames.min(), frames.max(), set(markers.tolist()))
    120 149 {2}
    """
    frames, count = points.shape[:2]
    if frames < _SHORTEST or count < MATES:
        return None
    line = _on_a_line(points)
    if line is None:
        return None
    share = line.mean(axis=0)
    coarse = float(np.median(share)) > 0
    shortest = _longer_than_chance(line, share) if coarse else _SHORTEST
    stretches = list(_stretches(points, line, share))
    if not stretches:
        return None
    seen = np.isfinite(points[..., 0])
    body = _Body(points, np.asarray(subjects), _sums(line), _sums(seen), coarse=coarse)
    out = np.zeros((frames, count), dtype=np.bool_)
    fillers = set()
    for one in stretches:
        long_enough = one.length >= (shortest if one.constant else max(shortest, _LONG_LINE * rate))
        if (one.filler or long_enough) and body.contradicts(one):
            first, last = _edges(one, points)
            out[first : last + 1, one.marker] = True
            if one.filler:
                fillers.add(float(points[one.first, one.marker, 0]))
    # What a program writes for one gap it writes for the others, short ones too.
    for value in fillers:
        same = points[..., 0] == value
        out[same] |= (points[same] == value).all(axis=-1)
    return out if out.any() else None


REPEATED = (
    "repeated",
    "samples that repeat their place, or run on a straight line, while other markers move",
)
"""What such samples are called, in a word and in words."""


def sentences(
    out: Mask, labels: Sequence[str], seen: int, first_frame: int, kind: tuple[str, str] = REPEATED
) -> list[str]:
    """How many samples count as missing, and a sentence for each of the markers with the most.

    Args:
        out: (frames, markers), from `repeated` or `filled`.
        labels: one a marker.
        seen: samples in all.
        first_frame: the file's own number of the first frame.
        kind: what the samples are called.
    """
    total = out.sum(axis=0)
    order = np.argsort(-total, kind="stable")[: np.count_nonzero(total)].tolist()
    text = [
        f"{kind[1]}, count as missing: {total.sum()} of {seen} ({100 * total.sum() / seen:.2g} %)"
    ]
    for marker in order[:_NOTED]:
        at = np.flatnonzero(out[:, marker])
        stretches = 1 + int((np.diff(at) > 1).sum())
        where = f"frames {at[0] + first_frame}-{at[-1] + first_frame}"
        if stretches > 1:
            where += f" ({stretches} stretches)"
        text.append(f"{labels[marker]}: {counted(len(at), f'{kind[0]} sample')} in {where}")
    if len(order) > _NOTED:
        text.append(f"{kind[0]} samples also of {listed(labels[m] for m in order[_NOTED:])}")
    return text


def _on_a_line(points: Array) -> Mask | None:
    """(frames - 2, markers): whether a sample is the mean of its neighbours; None if there is hardly any."""
    line = np.zeros((len(points) - 2, points.shape[1]), dtype=np.bool_)
    with np.errstate(invalid="ignore"):
        x = np.ascontiguousarray(points[..., 0])
        step = np.diff(x, axis=0)
        # Nearly all samples are told by their first coordinate.
        np.less_equal(np.abs(step[1:] - step[:-1]), _ROUNDING * np.abs(x[1:-1]), out=line)
        at, marker = np.nonzero(line)
        if len(at) < _SHORTEST - 2:
            return None
        before, here, after = (points[at + i, marker, 1:] for i in range(3))
        flat = np.abs(after - 2 * here + before) <= _ROUNDING * np.abs(here)
    line[at, marker] = flat.all(axis=1)
    return line


def _longer_than_chance(line: Mask, share: Array) -> int:
    """Samples of a stretch that chance makes in none of many such clips.

    How often samples go on repeating is the median over the markers, so that up to half may be filled.
    """
    both = (line[1:] & line[:-1]).mean(axis=0)
    goes_on = float(np.median(both / np.maximum(share, 1.0 / len(line))))
    if goes_on >= 1:
        return len(line) + 3
    if goes_on <= 0:
        return _SHORTEST
    needed = np.log(_CHANCE / line.size) / np.log(goes_on)
    return max(_SHORTEST, int(np.ceil(needed)) + 2)


def _stretches(points: Array, line: Mask, share: Array) -> Iterator[_Stretch]:
    """All stretches of `_SHORTEST` samples or more."""
    for marker in np.flatnonzero(share * len(line) > _SHORTEST - 3).tolist():
        padded = np.concatenate([[False], line[:, marker], [False]])
        starts, stops = np.flatnonzero(padded[1:] != padded[:-1]).reshape(-1, 2).T
        for start, stop in zip(starts.tolist(), stops.tolist(), strict=True):
            first, last = start, stop + 1
            if last - first + 1 < _SHORTEST:
                continue
            a, b = points[first, marker], points[last, marker]
            constant = bool((np.abs(a - b) <= _ROUNDING * np.abs(a)).all())
            yield _Stretch(marker, first, last, constant, constant and a[0] == a[1] == a[2])


@dataclass(frozen=True, eq=False)
class _Body:
    """All markers, against which a stretch of one is judged.

    Attributes:
        points: (frames, markers, 3), NaN = missing.
        subjects: (markers,) names.
        on_line: (frames - 1, markers): in how many samples before each one a marker is on a line.
        seen: (frames + 1, markers): in how many samples before each one a marker is seen.
        coarse: whether real markers repeat too.
    """

    points: Array
    subjects: NDArray[np.str_]
    on_line: NDArray[np.int32]
    seen: NDArray[np.int32]
    coarse: bool

    def contradicts(self, one: _Stretch) -> bool:
        """Whether the marker cannot have been where a stretch has it."""
        seen = self.seen[one.last + 1] - self.seen[one.first]
        mates = (self.subjects == self.subjects[one.marker]) & (2 * seen > one.length)
        mates[one.marker] = False
        others = np.flatnonzero(mates)
        still = self.on_line[one.last - 1, others] - self.on_line[one.first, others]
        if len(others) < MATES or 2 * (2 * still > one.length).sum() >= len(others):
            return False
        if one.filler:
            return True
        outside = np.isfinite(self.points[:, one.marker, 0])
        outside[one.first : one.last + 1] = False
        if outside.sum() < 2 or not travels(self.points[outside], one.marker, others):
            return False
        alone = not self.coarse and one.length >= _ALONE
        return alone or _out_of_place(one, self.points, others, outside)


def _sums(mask: Mask) -> NDArray[np.int32]:
    """(n + 1, markers): how often the mask (n, markers) is true before each row."""
    sums = np.zeros((len(mask) + 1, mask.shape[1]), dtype=np.int32)
    np.cumsum(mask, axis=0, out=sums[1:])
    return sums


def travels(points: Array, marker: int, others: NDArray[np.intp]) -> bool:
    """Whether a marker goes as far as those of the body, or nearly: then it is no marker of the floor."""
    points = points[:: 1 + len(points) // FRAMES]
    ways = np.fmax.reduce(points, axis=0) - np.fmin.reduce(points, axis=0)
    length = np.sqrt((ways**2).sum(axis=1))
    known = length[others][np.isfinite(length[others])]
    return bool(len(known) and length[marker] > _TRAVELS * np.median(known))


def _out_of_place(one: _Stretch, points: Array, others: NDArray[np.intp], outside: Mask) -> bool:
    """Whether the distances to the nearest markers are what they never are outside the stretch."""
    frames = np.flatnonzero(outside)
    frames = frames[:: 1 + len(frames) // FRAMES]
    inside = np.arange(one.first, one.last + 1)
    inside = inside[:: 1 + len(inside) // FRAMES]
    usual = distances(points, one.marker, others, frames)
    enough = np.isfinite(usual).sum(axis=0) >= min(_SHORTEST, len(frames))
    if enough.sum() < MATES:
        return False
    usual, others = usual[:, enough], others[enough]
    middle = median(usual)
    nearest = np.argsort(middle)[:MATES]
    middle, usual = middle[nearest], usual[:, nearest]
    spread = 1.4826 * median(np.abs(usual - middle))
    limit = np.maximum(SPREADS * spread, _SMALL * middle) + MATES * _resolution(
        points, one, outside
    )
    off = np.abs(distances(points, one.marker, others[nearest], inside) - middle) > limit
    return int(off.any(axis=0).sum()) > MATES / 2


def median(values: Array) -> Array:
    """(columns,), of what is known in each. `np.nanmedian` takes ten times as long."""
    values = np.sort(values, axis=0)
    known, column = np.isfinite(values).sum(axis=0), np.arange(values.shape[1])
    return np.asarray(0.5 * (values[(known - 1) // 2, column] + values[known // 2, column]))


def _resolution(points: Array, one: _Stretch, outside: Mask) -> float:
    """The smallest step that a marker makes: that of the file's numbers, or of its noise."""
    steps = np.abs(np.diff(points[outside, one.marker], axis=0))
    return float(np.min(steps, where=steps > 0, initial=np.inf)) if (steps > 0).any() else 0.0


def distances(
    points: Array, marker: int, others: NDArray[np.intp], frames: NDArray[np.intp]
) -> Array:
    """(frames, others): how far a marker is from others, in the unit of the points."""
    apart = points[np.ix_(frames, others)] - points[frames, marker][:, None]
    return np.asarray(np.sqrt(np.einsum("fmi,fmi->fm", apart, apart)))


def _edges(one: _Stretch, points: Array) -> tuple[int, int]:
    """The first and the last sample that was never measured: an end from which the marker was held was."""
    track = points[:, one.marker]
    with np.errstate(invalid="ignore"):
        steps = np.linalg.norm(np.diff(track, axis=0), axis=1)
    moving = np.sort(steps[steps > 0])
    usual = moving[len(moving) // 2] if len(moving) else 0.0
    # A step that is not known (the clip begins, the marker was missing) is no step that it makes.
    into, before = (steps[one.first - i] if one.first >= i else np.nan for i in (1, 2))
    away, after = (steps[i] if i < len(steps) else np.nan for i in (one.last, one.last + 1))
    came = into <= _JUMP * np.fmax(usual, before) and not one.filler
    left = away <= _JUMP * np.fmax(usual, after) and not one.constant
    return one.first + int(came), one.last - int(left)

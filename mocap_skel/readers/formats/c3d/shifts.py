"""Bytes that are lost or inserted among the points: from there on, values stand at each other's places."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mocap_skel.readers.formats.c3d.layout import spread
from mocap_skel.readers.formats.c3d.survey import Survey
from mocap_skel.readers.raw import FARTHEST

Array = NDArray[np.float64]

_CHUNK = 1 << 22
# Points whose steps are measured, and places that are looked at, by each of three orders.
_POINTS, _PROOFS = 24, 10
# A step between numbers that are none; steps that are so many of those before are looked at, the first of them.
_FARTHER, _RISES = 1e30, 20.0
# Values of a frame that are looked for in the frames behind it.
_VALUES = 128
# Frames behind the damaged one that are compared with the one before it: what is inserted may fill some.
_BEHIND = (1, 3, 6)
# A value is another's follower where it differs by no more than so many times what most values do, or by
# such a part of their size where nothing moves.
_MOST, _MORE, _GRID = 0.8, 3.0, 2e-3
# At another place, it is one by half of that only: it is looked for at many.
_STRICT = 0.5
# Where only frames behind can tell what values do: no more than such a part of their range.
_FAST = 0.02
# Values spread over so many times that: with fewer, one that is near another's place is so by chance.
_APART = 8.0
# So many followers stand at other places, so many more than at their own. Labels exchanged in pairs reach half.
_MOVED, _BETTER = 0.75, 0.35
# Of fewer points an exchange of two may look like lost bytes; so many values have to tell.
_ENOUGH = 4
# The first value of four takes so few different ones, as a residual does, and the fourth so many, and smoothly.
_FEW, _MANY, _SMOOTH = 0.1, 0.4, 0.1


def shifted_at(found: Survey, frames: int) -> int | None:
    """The frame in which bytes are lost or inserted, counted from 0; None without.

    Such a place is one where most values jump at once, and where those from there on are the ones from
    before, some places further on in the file: no motion and no exchange of labels does that to all of them.

    Args:
        found: the file.
        frames: how many of its frames to look at.
    """
    if found.layout.points < _ENOUGH or frames < 10:
        return None
    some = found.read_some(spread(frames)).astype(np.float64)
    if _no_residuals(some, found, frames):
        return 0
    seen = np.flatnonzero((some[..., :3] != 0).any(axis=2).mean(axis=0) > 0.5)
    if len(seen) < _ENOUGH:
        return None
    steps = _steps(found, frames, seen[:: 1 + (len(seen) - 1) // _POINTS])
    # Far from what is usual, for the clip, for the frames around, or for those before: where bytes do not
    # make whole values, all frames behind jump as well.
    wide = np.pad(np.minimum(steps, _FARTHER), 3, mode="edge")
    low = np.sort(steps)[len(steps) // 20]
    around, since = np.minimum(wide[:-6], wide[6:]) + low, wide[:-6] + low
    with np.errstate(invalid="ignore", divide="ignore"):
        orders = steps, np.nan_to_num(steps / around, nan=0.0), np.nan_to_num(wide[3:-3] / since)
    places = {int(at) + 1 for order in orders for at in np.argsort(-order, kind="stable")[:_PROOFS]}
    places |= {int(at) + 1 for at in np.flatnonzero(orders[2] > _RISES)[:_PROOFS]}
    looked = {at: place for at in sorted(places) if (place := _looked_at(found, at, frames))}
    # The nearest frame first: from farther off, frames before the damaged one look so too.
    tried = ((at, behind) for behind in _BEHIND for at in looked)
    return next((at for at, behind in tried if _is_shift(looked[at], behind)), None)


def _steps(found: Survey, frames: int, seen: NDArray[np.intp]) -> Array:
    """(frames - 2,), the median change of a coordinate over two frames, around each frame but the ends."""
    size = max(3, _CHUNK // found.layout.stride)
    steps = []
    for start in range(0, frames - 2, size):
        points = found.read(start, min(size + 2, frames - start))[:, seen, :3].astype(np.float64)
        flat = points.reshape(len(points), -1)
        with np.errstate(invalid="ignore", over="ignore"):
            moved = np.abs(flat[2:] - flat[:-2])
        moved[~np.isfinite(moved)] = np.inf
        middle = moved.shape[1] // 2
        steps.append(np.partition(moved, middle, axis=1)[:, middle])
    return np.concatenate(steps)


@dataclass(frozen=True, eq=False)
class _Place:
    """A frame that may be damaged.

    Attributes:
        found: the file.
        bytes_: (frames, stride), the frames behind it.
        column, before: (values,) places and values of the frame before it.
        usual: how far values go in two frames.
    """

    found: Survey
    bytes_: NDArray[np.uint8]
    column: NDArray[np.intp]
    before: Array
    usual: float

    def limit(self, behind: int) -> float:
        """By how much a value's follower differs, so many frames behind."""
        size = np.sort(np.abs(self.before))[int(len(self.before) * _MOST)]
        return float(_MORE * self.usual * (1 + behind) / 2 + _GRID * size)

    def own(self, behind: int) -> float:
        """The part of the values that have a follower at their own place."""
        there = self.found.values(self.bytes_[behind - 1])[self.column]
        return float(_followers(there[None], self.before, self.limit(behind))[0])

    def moved(self, behind: int, places: NDArray[np.intp], skipped: int) -> Array:
        """(ways,): the same for other places in the bytes from that frame on, the first few of them skipped.

        Args:
            behind: how many frames.
            places: (ways, values).
            skipped: bytes, fewer than a value has.
        """
        layout = self.found.layout
        # What stands further on goes on in the next frame.
        bytes_ = self.bytes_[behind - 1 : behind + 1].ravel()
        bytes_ = np.concatenate([bytes_, np.zeros(2 * layout.stride - len(bytes_), np.uint8)])
        there = self.found.values(bytes_[skipped : len(bytes_) - layout.width + skipped])
        there = there[np.minimum(places, len(there) - 1)]
        if behind > len(self.bytes_):
            return np.ones(len(places))
        return _followers(there, self.before, _STRICT * self.limit(behind))


def _looked_at(found: Survey, at: int, frames: int) -> _Place | None:
    """A frame, if values may stand at other places behind it: few follow at their own."""
    layout = found.layout
    first = max(0, at - 3)
    last = min(frames, at + _BEHIND[-1] + 2)
    bytes_ = found.raw(first, last - first)
    column = np.arange(4 * layout.points).reshape(-1, 4)[:, :3].ravel()
    before = found.values(bytes_[at - 1 - first])[column]
    told = np.flatnonzero((before != 0) & (np.abs(before) < FARTHEST))
    # The two frames before, or behind, tell how far values go in two frames.
    pair = (0, 2) if at >= 3 else (min(at + 1, frames - 3), min(at + 3, frames - 1))
    one, other = (found.values(bytes_[n])[column] for n in pair)
    moved = np.abs(other - one)[(one != 0) & (other != 0)]
    if len(told) < 3 * _ENOUGH or len(moved) < 3 * _ENOUGH or last < at + 2:
        return None
    told = told[:: 1 + (len(told) - 1) // _VALUES]
    usual = float(np.sort(moved)[int(len(moved) * _MOST)])
    if at < 3:
        # Behind, they may be numbers that are none.
        usual = min(usual, _FAST * float(np.ptp(before[told])))
    place = _Place(found, bytes_[at + 1 - first :], column[told], before[told], usual)
    return place if place.own(1) <= 1 - _BETTER else None


def _is_shift(place: _Place, behind: int) -> bool:
    """Whether values follow at other places so many frames behind, and not at their own."""
    layout, limit = place.found.layout, place.limit(behind)
    if behind > len(place.bytes_) or not limit < np.ptp(place.before) / _APART:
        return False
    own = place.own(behind)
    if own > 1 - _BETTER:
        return False
    least = max(_MOVED, own + _BETTER)
    places = np.arange(layout.stride // layout.width)[:, None] + place.column
    for skipped in range(layout.width):
        share = place.moved(behind, places, skipped)
        ways = np.flatnonzero(share >= least)
        # And they stay there.
        if len(ways) and (place.moved(behind + 1, places[ways], skipped) >= least).any():
            return True
    return False


def _followers(there: Array, before: Array, limit: float) -> Array:
    """(ways,): the part of the values that differ by no more than a limit, missing ones (zeros) apart.

    Args:
        there: (ways, values).
        before: (values,).
        limit: how much.
    """
    good = there != 0
    with np.errstate(invalid="ignore", over="ignore"):
        near = good & (np.abs(there - before) <= limit)
    count = good.sum(axis=1)
    enough = count >= max(3 * _ENOUGH, len(before) // 2)
    return np.where(enough, near.sum(axis=1) / np.maximum(count, 1), 0.0)


def _no_residuals(some: Array, found: Survey, frames: int) -> bool:
    """Whether the residuals stand elsewhere from the start: the fourth values are tracks, others are not.

    Args:
        some: (frames, points, 4) of some frames.
        found: the file.
        frames: of the file.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        kinds = [len({*some[..., k].ravel().tolist()}) / some[..., k].size for k in range(4)]
        if min(kinds[:3]) > _FEW or kinds[3] < max(_MANY, 4 * min(kinds[:3])):
            return False
        at = spread(frames - 1)
        step = np.abs(found.read_some(at + 1)[..., 3] - found.read_some(at)[..., 3])
        wide = np.abs(some[..., 3] - _middle(some[..., 3]))
    return _middle(step) < _SMOOTH * _middle(wide)


def _middle(values: Array) -> float:
    # np.median would import numpy.ma, 20 ms of a cold start.
    return float(np.sort(values, axis=None)[values.size // 2])

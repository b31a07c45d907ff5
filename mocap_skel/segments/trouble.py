"""Marker trouble: samples of swapped, ghost, flipped or thrown markers, told from noise and from skin.

Two markers of a segment keep their distance, and a marker keeps its distance to its joint. Skin bends such
a signal smoothly, as far as centimetres; a marker that is somewhere else leaves in one step and comes
back in one. So a signal is cut at its abrupt steps, and a piece between two cuts is trouble if most of
it is out of place. Places are medians and limits come from the median deviation (Rousseeuw & Croux 1993):
both bear nearly half of the samples being wrong. Which of two markers moved is told by whose own step
was the less expected. Closed form, vectorised over frames.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from mocap_skel.segments.pose import Array, by_rows
from mocap_skel.segments.shape import median
from mocap_skel.segments.trimmed import robust_centre

Mask = NDArray[np.bool_]

# Robust standard deviations that a sample may be out of place; of Gaussian noise 2 in 10⁹ are more.
SPREADS = 6.0
# Median absolute deviation → standard deviation of Gaussian noise.
GAUSS = 1.4826
# Metres that skin may carry a marker at once (impacts; Leardini et al. 2005 find 1 to 3 cm over whole
# movements), and the share of the distance itself where segments are small, a hand's or a finger's.
SKIN = 0.02
SMALL = 0.25
# Every so many frames tell a segment's size.
SOME = 8
# Share of the limit that one step has to make: a shoe that bends as the foot lands goes there in several.
ABRUPT = 0.75
# Frames for which a marker that is not seen is thought to go on as before.
LONG_GAP = 5
# Share of the unexpected steps that makes one of two markers the one that left.
CLEAR = 2 / 3


@dataclass(frozen=True, eq=False)
class Excursions:
    """The pieces of one signal that are out of place.

    Attributes:
        frames: (K,) frames in which the signal is seen.
        starts, stops: (n,) the pieces as ranges of `frames`.
        limit: how far out a sample has to be, metres.
    """

    frames: NDArray[np.intp]
    starts: NDArray[np.intp]
    stops: NDArray[np.intp]
    limit: float

    def edges(self) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
        """The steps into and out of the pieces: piece, frame before, frame after."""
        piece = np.arange(len(self.starts))
        into, out = self.starts > 0, self.stops < len(self.frames)
        return (
            np.concatenate([piece[into], piece[out]]),
            self.frames[np.concatenate([self.starts[into] - 1, self.stops[out] - 1])],
            self.frames[np.concatenate([self.starts[into], self.stops[out]])],
        )

    def follows(self) -> Mask:
        """(n,): whether a piece begins where the one before it ends."""
        return np.append(False, self.starts[1:] == self.stops[:-1])

    def spread_out(self, values: Array) -> tuple[NDArray[np.intp], Array]:
        """Frames of the pieces and each one's value of (n,) values."""
        lengths = self.stops - self.starts
        at = np.repeat(self.starts - np.cumsum(lengths) + lengths, lengths)
        return self.frames[at + np.arange(lengths.sum())], np.repeat(values, lengths)


def out_of_shape(x: Array) -> tuple[Array, Mask | None]:
    """Samples at which markers of one segment have left its rigid shape.

    Args:
        x: (M, 3, F), two markers or more, NaN = missing.

    Returns:
        Squared median distances (M, M), m², and the samples (M, F), or None where there are none.

    Example:
        Two markers 30 cm apart, of which the second jumps by 10 cm for three frames.

        >>> import numpy as np
        >>> x = np.zeros((2, 3, 100))
        >>> x[1, 0] = 0.3
        >>> x[1, 0, 50:53] = 0.4
        >>> squares, left = out_of_shape(x)
        >>> print(np.sqrt(squares[0, 1]), np.argwhere(left).tolist())
        0.3 [[1, 50], [1, 51], [1, 52]]
    """
    count, _, frames = x.shape
    first, second = np.array(list(combinations(range(count), 2))).T
    between = x[first] - x[second]
    square = np.einsum("pdf,pdf->pf", between, between)
    middle = median(square)
    medians = np.zeros((count, count))
    medians[first, second] = medians[second, first] = middle
    distance, place = np.sqrt(square), np.sqrt(middle)
    bad = np.zeros(square.shape, dtype=np.bool_)
    blame = np.full(square.shape, 0.5)
    for pair, found in excursions(distance, place, np.minimum(SKIN, SMALL * place)):
        share = _blame(x[first[pair]], x[second[pair]], found)
        at, values = found.spread_out(share)
        bad[pair, at], blame[pair, at] = True, values
    exchanged = _exchanged(x, between, distance, middle, bad)
    left = np.zeros((count, frames), dtype=np.bool_)
    if exchanged is not None:
        for pair in np.flatnonzero(exchanged.any(axis=1)).tolist():
            left[[first[pair], second[pair]]] |= exchanged[pair]
        # The distances of the two to the others are explained by that.
        bad &= ~(left[first] | left[second])
    wild = bad.any(axis=0)
    if wild.any():
        off = np.abs(distance[:, wild] - place[:, None])
        left[:, wild] |= _vote(bad[:, wild], blame[:, wild], off, first, second, count)
    if not left.any():
        return medians, None
    return medians, left & np.isfinite(x[:, 0])


def off_sphere(inside: Array, lab: Array, centre: Array) -> Mask | None:
    """Samples at which markers are not at their distance from a joint, though the joint's frame is well.

    Args:
        inside: (frames, M, 3), the markers in the frame of the joint's parent.
        lab: (frames, M, 3), the same in the lab: only a step that is seen there too is the marker's own.
        centre: (3,), the joint as all samples together give it.

    Returns:
        The samples, (frames, M), or None where there are none.

    Example:
        A marker that swings about a joint at the origin, and is somewhere else in three frames.

        >>> import numpy as np
        >>> angle = np.linspace(0.0, 6.0, 300)
        >>> tilt = 0.5 + 0.3 * np.sin(5 * angle)
        >>> way = np.sin(tilt) * np.cos(angle), np.sin(tilt) * np.sin(angle), np.cos(tilt)
        >>> points = 0.3 * np.stack(way, axis=1)[:, None]
        >>> points[100:103] += 0.2
        >>> np.argwhere(off_sphere(points, points, np.zeros(3))).tolist()
        [[100, 0], [101, 0], [102, 0]]
    """
    away = inside - centre
    radius = np.ascontiguousarray(np.sqrt(np.einsum("fmi,fmi->fm", away, away)).T)
    widest = np.fmax.reduce(_changes(radius), axis=1, initial=0.0)
    some = by_rows(inside[::SOME])
    floor = np.minimum(SKIN, SMALL * median(np.sqrt(np.einsum("mif,mif->mf", some, some))))
    if not (widest > ABRUPT * floor).any():
        return None
    # Steps of skin do not pull a centre; where there are larger ones it is judged from a firmer place.
    if not (widest > SKIN).any() and not any(excursions(radius, median(radius), floor)):
        return None
    away = inside - robust_centre(by_rows(inside))
    radius = np.ascontiguousarray(np.sqrt(np.einsum("fmi,fmi->fm", away, away)).T)
    left = np.zeros(radius.shape, dtype=np.bool_)
    for m, found in excursions(radius, median(radius), floor):
        piece, before, after = found.edges()
        own = _impossible_steps(np.ascontiguousarray(lab[:, m].T))
        # The joint's frame may have been lost for longer than the marker.
        ranges = np.column_stack([before + 1, after + 1]).ravel()
        widest = np.maximum.reduceat(np.append(own, 0.0), ranges)[::2]
        seen = widest >= ABRUPT * np.abs(radius[m, after] - radius[m, before])
        # Pieces in a row are one stretch: it turns along with the limb, and its distance with that.
        stretch = np.cumsum(~found.follows())
        moved = np.bincount(stretch[piece[seen]], minlength=stretch[-1] + 1)[stretch]
        at, values = found.spread_out(moved.astype(np.float64))
        left[m, at] = values > 0
    return left.T if left.any() else None


def excursions(signals: Array, place: Array, floor: Array) -> Iterator[tuple[int, Excursions]]:
    """Rows with pieces that lie off their place as a whole, and are cut off by an abrupt step.

    Args:
        signals: (P, F), metres, NaN = missing.
        place: (P,), where they belong, metres.
        floor: (P,), what is never far off, metres.

    Example:
        >>> import numpy as np
        >>> signal = np.full((1, 50), 0.3)
        >>> signal[0, 20:25] = 0.5
        >>> ((row, found),) = excursions(signal, np.array([0.3]), np.array([0.02]))
        >>> print(row, found.starts, found.stops)
        0 [20] [25]
    """
    changes = _changes(signals)
    # Where no step makes enough of the least limit there is nothing to cut, and no limit needed.
    with np.errstate(invalid="ignore"):
        rows = np.flatnonzero(np.nanmax(changes, axis=1, initial=0.0) > ABRUPT * floor)
    if not len(rows):
        return
    spread = GAUSS * median(np.abs(signals[rows] - place[rows, None]))
    limits = np.maximum(SPREADS * spread, floor[rows])
    # Where a signal jumps about all the time its steps say nothing.
    usual = SPREADS * GAUSS * median(changes[rows])
    for row, limit, step in zip(rows.tolist(), limits.tolist(), usual.tolist(), strict=True):
        frames = np.flatnonzero(np.isfinite(signals[row]))
        # A gap gives skin the time for more.
        allowed = np.maximum(np.where(np.diff(frames) > 1, limit, ABRUPT * limit), step)
        cuts = np.flatnonzero(changes[row, frames[1:]] > allowed) + 1
        if not len(cuts):
            continue
        starts = np.concatenate([[0], cuts])
        stops = np.append(cuts, len(frames))
        off = np.abs(signals[row, frames] - place[row]) > limit
        bad = np.add.reduceat(off.astype(np.intp), starts) > (stops - starts) / 2
        if bad.any():
            # A marker may come back while a distance happens to be right: nothing cuts there.
            out = np.flatnonzero(off)
            first = out[np.searchsorted(out, starts[bad])]
            last = out[np.searchsorted(out, stops[bad]) - 1]
            yield row, Excursions(frames, first, last + 1, limit)


def _changes(signals: Array) -> Array:
    """(P, F): by how much each sample differs from the one seen before it; NaN for the first one."""
    changes = np.empty_like(signals)
    changes[:, :1] = np.nan
    np.abs(signals[:, 1:] - signals[:, :-1], out=changes[:, 1:])
    holed = np.flatnonzero(np.isnan(changes[:, 1:]).any(axis=1))
    if len(holed):
        part = signals[holed]
        last = np.where(np.isfinite(part), np.arange(part.shape[1]), 0)
        np.maximum.accumulate(last, axis=1, out=last)
        changes[holed, 1:] = np.abs(part[:, 1:] - np.take_along_axis(part, last[:, :-1], axis=1))
    return changes


def _unexpected(x: Array, before: NDArray[np.intp], after: NDArray[np.intp]) -> Array:
    """Lengths of the steps of x (3, F) between frames, less what the frame before them leads to expect.

    The smaller of step and innovation: where the frame before was wrong itself it leads nowhere.
    """
    step = x[:, after] - x[:, before]
    last = x[:, before] - x[:, np.maximum(before - 1, 0)]
    innovation = step - (after - before) * np.where(np.isfinite(last), last, 0.0)
    return np.asarray(np.sqrt(np.minimum((step**2).sum(axis=0), (innovation**2).sum(axis=0))))


def _impossible_steps(x: Array) -> Array:
    """(F,): the unexpected part of the step of x (3, F) into each frame, 0 where the marker often does that."""
    frames = np.flatnonzero(np.isfinite(x[0]))
    steps = np.zeros(x.shape[1])
    if len(frames) < 2:
        return steps
    own = _unexpected(x, frames[:-1], frames[1:])
    # Over a gap it may go on as it usually does; over a long one it does not go on for ever.
    usual = SPREADS * float(median(own)) * np.minimum(np.diff(frames), LONG_GAP)
    steps[frames[1:]] = np.where(own >= usual, own, 0.0)
    return steps


def _blame(x: Array, other: Array, found: Excursions) -> Array:
    """(n,): the first marker's blame for each piece, 0 to 1; 0.5 where it may be either, or both are out.

    Into and out of a stretch that is out of shape the marker that left steps by what nobody expects. Where
    one such piece follows on another a second marker has joined the first, or has come back.
    """
    piece, before, after = found.edges()
    own, others = _unexpected(x, before, after), _unexpected(other, before, after)
    count = len(found.starts)
    follows = found.follows()
    # Only steps from and to a frame in shape tell who is out; the others tell who changed.
    into = piece[: (found.starts > 0).sum()]
    clean = np.concatenate([~follows[into], ~np.append(follows[1:], False)[piece[len(into) :]]])
    sums = [np.bincount(piece, clean * v, count) for v in (own, others)]
    blame = sums[0] / np.maximum(sums[0] + sums[1], np.finfo(float).tiny)
    blame[sums[0] + sums[1] == 0] = 0.5
    chained = follows | np.append(follows[1:], False)
    if not chained.any():
        return np.asarray(blame)
    # A signal may change abruptly while its marker moves along, wherever that is: that is no step.
    share = own / np.maximum(own + others, np.finfo(float).tiny)
    share[own + others < ABRUPT * found.limit] = np.nan
    step, last = np.full((2, count), np.nan)
    step[into], last[piece[len(into) :]] = np.split(share, [len(into)])
    for start in np.flatnonzero(chained & ~follows).tolist():
        stop = start + 1
        while stop < count and follows[stop]:
            stop += 1
        steps = [*step[start:stop].tolist(), float(last[stop - 1])]
        if found.starts[start] == 0:  # what came before is not known: backwards from where it ends
            blame[start:stop] = _who_is_out(steps[:0:-1])[::-1]
        else:
            blame[start:stop] = _who_is_out(steps[:-1])
    return np.asarray(blame)


def _who_is_out(steps: list[float]) -> list[float]:
    """The first marker's blame for pieces in a row, from its share of the step before each of them.

    NaN: neither has stepped.
    """
    first = second = False
    found = []
    for share in steps:
        if share >= CLEAR:
            first = not (first and second)  # out alone it only went elsewhere
        elif share <= 1 - CLEAR:
            second = not (first and second)
        elif not (np.isnan(share) and (first or second)):
            first = second = True
        found.append(0.5 if first and second else float(first))
    return found


def _vote(
    bad: Mask,
    blame: Array,
    off: Array,
    first: NDArray[np.intp],
    second: NDArray[np.intp],
    count: int,
) -> Mask:
    """(M, F): the markers that left, from the pairs that are out of shape and the first one's blame.

    In every frame the marker with the most blame goes, and its pairs with it, until no pair is left
    that is out of shape. Of a last pair that could be either the one goes that is clearly off its distance
    to the others too, by `off` (P, F), metres; or both.
    """
    bad = bad.copy()
    left = np.zeros((count, bad.shape[1]), dtype=np.bool_)
    of_first = np.eye(count)[:, first]
    of_second = np.eye(count)[:, second]
    away = (of_first + of_second) @ np.nan_to_num(off)
    for _ in range(count):
        if not bad.any():
            break
        score = of_first @ np.where(bad, blame, 0.0) + of_second @ np.where(bad, 1.0 - blame, 0.0)
        worst = score.argmax(axis=0)
        total = bad.sum(axis=0)
        gone = np.zeros(left.shape, dtype=np.bool_)
        gone[worst, np.arange(len(worst))] = total > 0
        either = (total == 1) & (score.max(axis=0) < CLEAR)
        far = np.where(score[:, either] > 0, away[:, either], 0.0)
        gone[:, either] = (score[:, either] > 0) & (far > (1 - CLEAR) * far.sum(axis=0))
        left |= gone
        bad &= ~(gone[first] | gone[second])
    return left


def _exchanged(x: Array, between: Array, distance: Array, middle: Array, bad: Mask) -> Mask | None:
    """Pairs (P, F) whose two markers stand in each other's place though their distance is kept.

    No segment turns by more than 120 degrees, a chord of √3, in a time in which its usual turn is far
    below that; a pair that does was exchanged. Of the two ways round the rarer one is wrong.
    """
    turn = np.einsum("pdf,pdf->pf", between[..., 1:], between[..., :-1])
    with np.errstate(invalid="ignore"):
        wide = (turn < -0.5 * middle[:, None]).any(axis=1)
    pairs = np.flatnonzero(wide | np.isnan(turn).any(axis=1))
    both = list(combinations(range(len(x)), 2))
    found = None
    for pair in pairs:
        frames = np.flatnonzero(np.isfinite(distance[pair]) & ~bad[pair])
        if len(frames) < 2:
            continue
        u = between[pair][:, frames]
        back = (u[:, 1:] * u[:, :-1]).sum(axis=0) < -0.5 * middle[pair]
        if not back.any():
            continue
        turned = back
        gaps = np.diff(frames)
        chord = np.sqrt(((u[:, 1:] - u[:, :-1]) ** 2).sum(axis=0) / middle[pair]) / gaps
        usual = gaps * SPREADS * GAUSS * float(median(chord))
        short = usual <= np.sqrt(3.0)
        # With the labels put back, the pair has to turn no more than it usually does.
        rest = np.sqrt(((u[:, 1:] + u[:, :-1]) ** 2).sum(axis=0) / middle[pair])
        back = back & short & (rest <= np.maximum(usual, SMALL))
        if not back.any():
            continue
        off = np.abs(distance[pair] - np.sqrt(middle[pair]))
        limit = max(
            SPREADS * GAUSS * float(median(off)), min(SKIN, SMALL * float(np.sqrt(middle[pair])))
        )
        near = off[frames] <= limit
        # What is half way between the two stays where it is; if only one has left it does not.
        half = x[both[pair], :, :].mean(axis=0)
        calm = _unexpected(half, frames[:-1], frames[1:]) < 0.5 * np.sqrt(middle[pair])
        back &= near[1:] & near[:-1] & calm
        # Across a longer gap, or a turn that is no exchange, nothing is known: each part of the clip has
        # its own majority.
        lost = ~short | (turned & ~back)
        blocks = np.concatenate([[0], np.flatnonzero(lost) + 1, [len(frames)]])
        state = np.concatenate([[0], np.cumsum(back)]) % 2
        for start, stop in pairwise(blocks.tolist()):
            part = state[start:stop] == 1
            if 2 * part.sum() > len(part):
                part = ~part
            if part.any():
                found = np.zeros(bad.shape, dtype=np.bool_) if found is None else found
                found[pair, frames[start:stop][part]] = True
    return found

"""Which markers move with which segment: how well every two markers of a figure keep their distance."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Mapping
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from mocap_skel.figure.skeleton import Skeleton
from mocap_skel.segments.pose import Array, by_rows
from mocap_skel.segments.shape import median
from mocap_skel.segments.trouble import GAUSS

# Share of the frames that two markers have to be seen in together.
LEAST_TOGETHER = 0.05
# A marker is loose if it moves so many times as much as the usual one against its segment, but at least
# by a centimetre (skin does that), and belongs elsewhere if it is so many times as firm there.
LOOSE = 3.0
LEAST_LOOSE = 0.01
FIRMER = 2.5
# By how much the other one of an exchange has to gain at least: one of the two may be loose anywhere.
BETTER = 1.2
# Metres: how far apart markers move tells no more once it is far above what skin does.
FAR = 0.1
# Distances that are looked at together; more leave the cache.
AT_ONCE = 30_000
# Metres: what a broken rule of the body's order counts for beside the firmness of all markers.
DISORDER = 0.02
# So many loose markers are tried in other places at once.
MOST_BAD = 24
# What the neighbouring segments count for beside a marker's own.
NEIGHBOURS = 0.25


class Rigidity:
    """The markers of a subject, their segments, and how well each two of them keep their distance.

    Attributes:
        segments: names of the figure's segments.
        names: (standard name, column in the clip) of each marker.
        segment: (M,) the segment of each marker, as a place in `segments`; `exchange` and `move` put it right.
        given: (M,) the same, as the association has it.
        joined: (S, S) whether two segments share a joint.
        points: (F, M, 3) some of the clip's frames, metres.
        spread: (M, M) robust standard deviation of the distance of two markers, metres; NaN = not seen together.
        typical: metres, how much the usual marker moves against its segment's others.
    """

    def __init__(
        self, points: Array, columns: Mapping[str, Mapping[str, int]], skeleton: Skeleton, most: int
    ) -> None:
        """Measure the distances.

        Args:
            points: of the clip, (F, all markers, 3), metres, NaN = missing.
            columns: segment → marker → its column in `points`.
            skeleton: the figure.
            most: about so many frames are looked at, evenly through the clip.
        """
        self.segments = [segment.name for segment in skeleton.segments]
        of = [
            (self.segments.index(name), marker, column)
            for name, own in columns.items()
            for marker, column in own.items()
        ]
        self.segment = np.array([at for at, _, _ in of], dtype=np.intp)
        self.given = self.segment.copy()
        self.names = [(marker, column) for _, marker, column in of]
        # Evenly through the clip, but not so evenly that a cyclic movement shows one phase only.
        step = len(points) // most + 1
        self.points = points[::step][:, [column for _, column in self.names]]
        self.joined = np.zeros((len(self.segments), len(self.segments)), dtype=np.bool_)
        for i, segment in enumerate(skeleton.segments):
            if segment.parent is not None:
                j = self.segments.index(segment.parent)
                self.joined[i, j] = self.joined[j, i] = True
        self.spread = spreads(by_rows(self.points))
        capped = np.minimum(self.spread, FAR)
        self.known = np.isfinite(capped)
        self.cost = np.where(self.known, capped, 0.0)
        self.typical = float(median(self.own(self.segment)))

    @property
    def limit(self) -> float:
        """Metres: a marker that moves more against its segment is loose."""
        return max(LEAST_LOOSE, LOOSE * float(np.nan_to_num(self.typical)))

    def own(self, segment: NDArray[np.intp]) -> Array:
        """(M,) mean spread to the other markers of the same segment; NaN without any."""
        mates = (segment[:, None] == segment) & self.known
        count = mates.sum(axis=1)
        total = np.where(mates, self.cost, 0.0).sum(axis=1)
        return np.where(count > 0, total / np.maximum(count, 1), np.nan)

    def near(self, segment: NDArray[np.intp]) -> Array:
        """(M,) least spread to a marker of a neighbouring segment; NaN without any."""
        beside = self.joined[segment[:, None], segment] & self.known
        least = np.where(beside, self.cost, np.inf).min(axis=1)
        return np.where(np.isfinite(least), least, np.nan)

    def fit(self, segment: NDArray[np.intp]) -> Array:
        """(M,) how much each marker moves against its segment, or without others there its neighbour, metres."""
        own = self.own(segment)
        return np.where(np.isfinite(own), own, self.near(segment))

    def still(self) -> bool:
        """Whether markers of different segments keep their distances as well as those of one segment."""
        apart = (self.segment[:, None] != self.segment) & self.known
        values = self.cost[apart]
        if not len(values) or np.isnan(self.typical):
            return True
        return not float(median(values)) > LOOSE * self.typical

    def sides(self) -> dict[tuple[str, str], float]:
        """Two pairs, left and right, of one segment → 1 where their sides agree, -1 where they contradict each other.

        They contradict each other where, on both sides, a marker is much firmer with the other side's.
        """
        at = {name: m for m, (name, _) in enumerate(self.names)}
        stems = [name[1:] for name in at if name[0] == "L" and f"R{name[1:]}" in at]
        found = {}
        for one, other in combinations(stems, 2):
            a, b, c, d = (at[f"{side}{name}"] for name in (one, other) for side in "LR")
            if self.given[a] != self.given[c] or self.given[b] != self.given[d]:
                continue
            own = self.cost[[a, b], [c, d]]
            cross = self.cost[[a, b], [d, c]]
            if not (self.known[[a, b], [c, d]] & self.known[[a, b], [d, c]]).all():
                continue
            if own.min() > max(self.limit, FIRMER * cross.max()):
                found[one, other] = -1.0
            elif cross.min() > max(self.limit, FIRMER * own.max()):
                found[one, other] = 1.0
        return found

    def exchange(
        self, broken: Callable[[int, int], int], placed: Container[int] = ()
    ) -> dict[int, int]:
        """Exchange two markers of different segments, as long as that makes the figure much firmer.

        Args:
            broken: how many rules of the body's order are broken when two markers are exchanged as well.
            placed: markers that stay where they are.

        Returns:
            Exchanged markers, both ways. `segment` is then put right.
        """
        partner: dict[int, int] = {}
        for _ in range(len(self.names)):
            bad, score = self._bad(partner)
            bad = [m for m in bad if m not in placed]
            chosen, best = None, np.inf
            for pair, trial in self._exchanges(bad):
                if any(m in partner or m in placed for m in pair):
                    continue
                if self._firmer(pair, trial, score):
                    total = self._total(trial)
                    if total < self._total(self.segment):
                        total += DISORDER * broken(*pair)
                        if total < best:
                            best, chosen = total, (pair, trial)
            if chosen is None:
                break
            (first, second), self.segment = chosen
            partner |= {first: second, second: first}
        return partner

    def move(self, placed: Container[int]) -> set[int]:
        """Give single markers to other segments, as long as that makes the figure much firmer.

        Args:
            placed: markers that stay where they are.

        Returns:
            Markers of another segment. `segment` is then put right.
        """
        moved: set[int] = set()
        for _ in range(len(self.names)):
            bad, score = self._bad({*moved})
            bad = [m for m in bad if m not in placed]
            chosen, best = None, self._total(self.segment)
            for one, trial in self._moves(bad):
                if self._firmer(one, trial, score) and self._total(trial) < best:
                    best, chosen = self._total(trial), (one, trial)
            if chosen is None:
                break
            (marker,), self.segment = chosen
            moved.add(marker)
        return moved

    def _bad(self, done: Container[int]) -> tuple[list[int], Array]:
        """The markers that are loose where they are, the worst first; and how loose all are, metres."""
        score = self.fit(self.segment)
        bad = np.flatnonzero(np.nan_to_num(score) > self.limit)
        bad = bad[(-score[bad]).argsort(kind="stable")]
        # A file that fits nothing has many; the worst ones say enough of it.
        return [m for m in bad.tolist() if m not in done][:MOST_BAD], score

    def _firmer(self, markers: tuple[int, ...], trial: NDArray[np.intp], score: Array) -> bool:
        """Whether these markers are clearly firmer where a trial has them."""
        after = self.fit(trial)
        gains = [score[m] / max(after[m], np.finfo(float).tiny) for m in markers]
        sits = all(
            after[m] <= self.limit or gain > FIRMER for m, gain in zip(markers, gains, strict=True)
        )
        return sits and max(gains) > FIRMER and min(gains) > BETTER

    def _exchanges(self, bad: list[int]) -> Iterator[tuple[tuple[int, ...], NDArray[np.intp]]]:
        for m in bad:
            for other in np.flatnonzero(self.segment != self.segment[m]).tolist():
                # Next to a joint a marker moves with both segments and need not look bad.
                joined = self.joined[self.segment[m], self.segment[other]]
                if (other > m and other in bad) or (other not in bad and joined):
                    trial = self.segment.copy()
                    trial[[m, other]] = trial[[other, m]]
                    yield (m, other), trial

    def _moves(self, bad: list[int]) -> Iterator[tuple[tuple[int, ...], NDArray[np.intp]]]:
        for m in bad:
            for at in np.unique(self.segment).tolist():
                if at != self.segment[m]:
                    trial = self.segment.copy()
                    trial[m] = at
                    yield (m,), trial

    def _total(self, segment: NDArray[np.intp]) -> float:
        return float(np.nansum(self.own(segment)) + NEIGHBOURS * np.nansum(self.near(segment)))


def spreads(x: Array) -> Array:
    """(M, M) robust standard deviation of the distance between each two of the points x (M, 3, F).

    NaN for two that are hardly ever seen together.
    """
    count = len(x)
    spread = np.full((count, count), np.nan)
    first, second = np.triu_indices(count, 1)
    step = max(AT_ONCE // x.shape[2], 1)
    for start in range(0, len(first), step):
        i, j = first[start : start + step], second[start : start + step]
        away = x[i] - x[j]
        distance = np.sqrt(np.einsum("pdf,pdf->pf", away, away))
        off = np.abs(distance - median(distance)[:, None])
        enough = np.isfinite(distance).sum(axis=1) >= LEAST_TOGETHER * x.shape[2]
        spread[i, j] = spread[j, i] = np.where(enough, GAUSS * median(off), np.nan)
    return spread

"""Find markers that do not move with the segment to which the association gives them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mocap_skel.clip import Clip
from mocap_skel.errors import FitError
from mocap_skel.figure.skeleton import Skeleton
from mocap_skel.fit import fit_skeleton
from mocap_skel.labels.association import Assignment
from mocap_skel.segments.pose import Array, by_rows
from mocap_skel.segments.shape import median
from mocap_skel.segments.trouble import GAUSS, SKIN
from mocap_skel.skeleton_fit import SkeletonFit
from mocap_skel.text import counted, listed

# Frames that show how rigidly two markers move together well enough.
ENOUGH = 700
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
# What the neighbouring segments count for beside a marker's own.
NEIGHBOURS = 0.25


@dataclass(frozen=True, eq=False)
class MarkerCheck:
    """How one marker moves with its segment.

    Attributes:
        subject, label: in the clip.
        marker, segment: what the association makes of it.
        residual: robust standard deviation of its distances to its segment's other markers, of its
            distance to the joint if it is the only one, metres; NaN where nothing tells.
        share: share of its samples that are out of place.
        frames: the file's own numbers of these.
        partner: the marker with which it is exchanged, "" for none.
        moves_with: the segment with which it moves if that is another one, "" otherwise.
        verdict: "ok", "loose", "wrong segment", "swapped", "swapped at times", "leaves at times",
            "not seen".
    """

    subject: str
    label: str
    marker: str
    segment: str
    residual: float
    share: float
    frames: NDArray[np.int64]
    partner: str
    moves_with: str
    verdict: str


@dataclass(frozen=True, eq=False)
class AssociationCheck:
    """How all markers of one subject move with their segments.

    Attributes:
        markers: one a marker, in the skeleton's order.
        still: whether the clip moves too little to tell segments apart.
    """

    markers: tuple[MarkerCheck, ...]
    still: bool

    def summary(self) -> str:
        """What is wrong with the association and what to do, in one sentence."""
        wrong: dict[str, None] = {}
        for one in self.markers:
            if one.verdict == "swapped":
                first, second = sorted((one.marker, one.partner))
                wrong[f"{first} and {second} are exchanged: exchange their labels"] = None
            elif one.verdict == "wrong segment":
                wrong[f"{one.marker} ({one.label}) moves with {one.moves_with}"] = None
        count = counted(len(self.markers), "marker")
        if wrong:
            return f"{count} checked; the association looks wrong: {'; '.join(wrong)}"
        if self.still:
            return f"{count} checked: the clip moves too little to tell segments apart"
        notable = [
            f"{sum(one.verdict == v for one in self.markers)} {words}"
            for v, words in (
                ("swapped at times", "swapped at times"),
                ("leaves at times", "away at times"),
                ("loose", "loose"),
                ("not seen", "never seen"),
            )
            if any(one.verdict == v for one in self.markers)
        ]
        extra = f" ({listed(notable)})" if notable else ""
        return f"{count} checked{extra}: every marker that can be judged moves with its segment"


def check_association(clip: Clip, assignment: Assignment, skeleton: Skeleton) -> AssociationCheck:
    """Check how each marker of one subject moves with its segment.

    Two markers of a segment keep their distance, whatever the segment does. So the robust spread of all
    distances tells which markers move together. If exchanging two markers, or giving one to another segment, makes
    the segments much firmer, the association is wrong there. The frames in which a marker is out of place come from
    the fit with that put right.

    Args:
        clip: as it was read.
        assignment: which label is which marker, of one subject.
        skeleton: the figure.

    Returns:
        One verdict a marker; `AssociationCheck.summary` is the sentence for a person.

    >>> from mocap_skel import associate, read_association, read_clip
    >>> clip, cmu = read_clip("sample_data/range_of_motion.c3d"), read_association("cmu")
    >>> check_association(clip, associate(clip, cmu)[0], cmu.skeleton).summary()
    '41 markers checked: every marker that can be judged moves with its segment'
    """
    figure = _Figure(clip, assignment, skeleton)
    given = figure.segment.copy()
    typical = float(median(figure.own(given)))
    partner, moved = figure.mend(typical)
    right = figure.segment
    fit = _fit(clip, figure.assignment(assignment, right, partner), skeleton)
    away = {} if fit is None else {one.label: one for one in fit.left_out}
    radial = {} if fit is None else {j.child: j.residual for j in fit.joints if j.fitted}
    residuals = figure.own(right)
    wrong = set(partner) | moved
    at_fault = figure.own(given)
    found = []
    for m, (name, column) in enumerate(figure.names):
        seen = np.isfinite(clip.points[:, column, 0])
        segment = figure.segments[given[m]]
        one = away.get(clip.labels[column])
        frames = np.zeros(0, dtype=np.int64) if one is None else one.frames
        residual = float(at_fault[m] if m in wrong else residuals[m])
        if not np.isfinite(residual):
            residual = radial.get(segment, np.nan)
        other, goes = "", ""
        if not seen.any():
            verdict = "not seen"
        elif m in partner:
            verdict, other = "swapped", figure.names[partner[m]][0]
            goes = figure.segments[right[m]]
        elif m in moved:
            verdict, goes = "wrong segment", figure.segments[right[m]]
        elif one is not None and one.partner:
            verdict, other = "swapped at times", one.partner
        elif residual > max(LEAST_LOOSE, LOOSE * typical) and np.isfinite(residuals[m]):
            verdict = "loose"
        else:
            verdict = "ok" if one is None else "leaves at times"
        if m in wrong:
            frames = clip.frame_numbers[figure.out_of_place(m, given, wrong)]
        share = len(frames) / max(int(seen.sum()), 1)
        found.append(
            MarkerCheck(
                assignment.subject, clip.labels[column], name, segment, residual, share, frames,
                other, goes, verdict,
            )
        )  # fmt: skip
    return AssociationCheck(tuple(found), figure.still(typical))


def _fit(clip: Clip, assignment: Assignment, skeleton: Skeleton) -> SkeletonFit | None:
    try:
        return fit_skeleton(clip, assignment, skeleton)
    except FitError:  # a clip of one limb under the standard human, say
        return None


class _Figure:
    """The markers of a subject, their segments, and how well each two of them keep their distance."""

    def __init__(self, clip: Clip, assignment: Assignment, skeleton: Skeleton) -> None:
        self.segments = [segment.name for segment in skeleton.segments]
        of = [
            (self.segments.index(name), marker, column)
            for name, columns in assignment.columns.items()
            for marker, column in columns.items()
        ]
        self.segment = np.array([at for at, _, _ in of])
        self.names = [(marker, column) for _, marker, column in of]
        self.points = clip.points[:, [column for _, column in self.names]]
        self.joined = np.zeros((len(self.segments), len(self.segments)), dtype=np.bool_)
        for i, segment in enumerate(skeleton.segments):
            if segment.parent is not None:
                j = self.segments.index(segment.parent)
                self.joined[i, j] = self.joined[j, i] = True
        # Evenly through the clip, but not so evenly that a cyclic movement shows one phase only.
        step = len(self.points) // ENOUGH + 1
        self.spread = _spreads(by_rows(self.points[::step]))
        capped = np.minimum(self.spread, FAR)
        self.known = np.isfinite(capped)
        self.cost = np.where(self.known, capped, 0.0)

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

    def still(self, typical: float) -> bool:
        """Whether markers of different segments keep their distances as well as those of one segment."""
        apart = (self.segment[:, None] != self.segment) & self.known
        values = self.cost[apart]
        return not len(values) or not float(median(values)) > LOOSE * typical or np.isnan(typical)

    def mend(self, typical: float) -> tuple[dict[int, int], set[int]]:
        """Exchange two markers, or give one to another segment, as long as the figure gets much firmer.

        Returns:
            Exchanged markers, both ways, and markers of another segment. `segment` is then put right.
        """
        partner: dict[int, int] = {}
        moved: set[int] = set()
        limit = max(LEAST_LOOSE, LOOSE * np.nan_to_num(typical))
        for _ in range(len(self.names)):
            own, near = self.own(self.segment), self.near(self.segment)
            score = np.where(np.isfinite(own), own, near)
            bad = np.flatnonzero(np.nan_to_num(score) > limit)
            bad = bad[[m not in partner and m not in moved for m in bad]]
            chosen = None
            # An exchange explains two markers at once, so it is tried before moving one alone.
            for trials in (self._exchanges(bad.tolist()), self._moves(bad.tolist())):
                best = self._total(self.segment)
                for markers, trial in trials:
                    after_own = self.own(trial)
                    after = np.where(np.isfinite(after_own), after_own, self.near(trial))
                    gains = [score[m] / max(after[m], np.finfo(float).tiny) for m in markers]
                    sits = all(
                        after[m] <= limit or gain > FIRMER
                        for m, gain in zip(markers, gains, strict=True)
                    )
                    if sits and max(gains) > FIRMER and min(gains) > BETTER:
                        total = self._total(trial)
                        if total < best:
                            best, chosen = total, (markers, trial)
                if chosen is not None:
                    break
            if chosen is None:
                break
            markers, self.segment = chosen
            if len(markers) == 2:
                partner |= {markers[0]: markers[1], markers[1]: markers[0]}
            else:
                moved.add(markers[0])
        return partner, moved

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
        own, near = self.own(segment), self.near(segment)
        return float(np.nansum(own) + NEIGHBOURS * np.nansum(near))

    def assignment(
        self, given: Assignment, right: NDArray[np.intp], partner: dict[int, int]
    ) -> Assignment:
        """The assignment put right. Exchanged markers exchange their names; one that is moved keeps its name."""
        columns: dict[str, dict[str, int]] = {name: {} for name in self.segments}
        for m, (name, column) in enumerate(self.names):
            named = self.names[partner[m]][0] if m in partner else name
            columns[self.segments[right[m]]][named] = column
        return replace(given, columns={name: of for name, of in columns.items() if of})

    def out_of_place(self, m: int, segment: NDArray[np.intp], wrong: set[int]) -> NDArray[np.bool_]:
        """(F,) frames in which a wrong marker is farther from its usual place in its segment than skin moves it."""
        mates = [k for k in np.flatnonzero(segment == segment[m]).tolist() if k != m]
        mates = [k for k in mates if k not in wrong] or mates
        if not mates:
            beside = np.flatnonzero(self.joined[segment[m], segment] & self.known[m])
            mates = beside[self.cost[m, beside].argsort()[:1]].tolist()
        if not mates:
            return np.zeros(len(self.points), dtype=np.bool_)
        away = np.linalg.norm(self.points[:, mates] - self.points[:, [m]], axis=2).T
        off = np.abs(away - median(away)[:, None])
        return np.asarray(median(off.T) > SKIN)


def _spreads(x: Array) -> Array:
    """(M, M) robust standard deviation of the distance between each two of the points x (M, 3, F).

    NaN for two that are hardly ever seen together.
    """
    count = len(x)
    spread = np.full((count, count), np.nan)
    for i in range(count - 1):
        away = x[i + 1 :] - x[i]
        distance = np.sqrt(np.einsum("pdf,pdf->pf", away, away))
        off = np.abs(distance - median(distance)[:, None])
        enough = np.isfinite(distance).sum(axis=1) >= LEAST_TOGETHER * x.shape[2]
        found = np.where(enough, GAUSS * median(off), np.nan)
        spread[i, i + 1 :] = spread[i + 1 :, i] = found
    return spread

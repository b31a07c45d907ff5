"""Find markers that do not move with the segment to which the association gives them."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mocap_skel.clip import Clip
from mocap_skel.errors import FitError
from mocap_skel.figure.skeleton import Skeleton
from mocap_skel.fit import fit_skeleton
from mocap_skel.labels.association import Assignment
from mocap_skel.segments.misplaced import NOTHING, Misplaced, judged
from mocap_skel.segments.pose import Array
from mocap_skel.segments.rigidity import LEAST_LOOSE, LOOSE, Rigidity
from mocap_skel.segments.shape import median
from mocap_skel.segments.trouble import SKIN
from mocap_skel.skeleton_fit import SkeletonFit
from mocap_skel.text import counted, listed

# Frames that show how rigidly two markers move together well enough.
ENOUGH = 700


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
        misplaced: what is certainly wrong, with its evidence.
    """

    markers: tuple[MarkerCheck, ...]
    still: bool
    misplaced: Misplaced = NOTHING

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
        if self.misplaced.mirrored:
            return (
                f"{count} checked; the body is mirrored: {self.misplaced.mirrored}: try --mirror x"
            )
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
    figure = Rigidity(clip.points, assignment.columns, skeleton, ENOUGH)
    typical = figure.typical
    judgement = judged(figure)
    partner, moved = judgement.partner, judgement.moved
    given, right = figure.given, figure.segment
    fit = _fit(clip, _put_right(assignment, figure, partner), skeleton)
    away = {} if fit is None else {one.label: one for one in fit.left_out}
    radial = {} if fit is None else {j.child: j.residual for j in fit.joints if j.fitted}
    residuals = figure.own(right)
    wrong = {*partner, *moved}
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
            frames = clip.frame_numbers[_out_of_place(clip.points, figure, m, wrong)]
        share = len(frames) / max(int(seen.sum()), 1)
        found.append(
            MarkerCheck(
                assignment.subject, clip.labels[column], name, segment, residual, share, frames,
                other, goes, verdict,
            )
        )  # fmt: skip
    return AssociationCheck(tuple(found), figure.still(), judgement.misplaced)


def _fit(clip: Clip, assignment: Assignment, skeleton: Skeleton) -> SkeletonFit | None:
    try:
        return fit_skeleton(clip, assignment, skeleton, trust=True)
    except FitError:  # a clip of one limb under the standard human, say
        return None


def _put_right(given: Assignment, figure: Rigidity, partner: Mapping[int, int]) -> Assignment:
    """The assignment put right. Exchanged markers exchange their names; one that is moved keeps its name."""
    columns: dict[str, dict[str, int]] = {name: {} for name in figure.segments}
    for m, (name, column) in enumerate(figure.names):
        named = figure.names[partner[m]][0] if m in partner else name
        columns[figure.segments[figure.segment[m]]][named] = column
    return replace(given, columns={name: of for name, of in columns.items() if of})


def _out_of_place(
    points: Array, figure: Rigidity, m: int, wrong: Container[int]
) -> NDArray[np.bool_]:
    """(F,) frames in which a wrong marker is farther from its usual place in its segment than skin moves it."""
    own = figure.given
    mates = [k for k in np.flatnonzero(own == own[m]).tolist() if k != m]
    mates = [k for k in mates if k not in wrong] or mates
    if not mates:
        beside = np.flatnonzero(figure.joined[own[m], own] & figure.known[m])
        mates = beside[figure.cost[m, beside].argsort()[:1]].tolist()
    if not mates:
        return np.zeros(len(points), dtype=np.bool_)
    columns = [figure.names[k][1] for k in mates]
    away = np.linalg.norm(points[:, columns] - points[:, [figure.names[m][1]]], axis=2).T
    off = np.abs(away - median(away)[:, None])
    return np.asarray(median(off.T) > SKIN)

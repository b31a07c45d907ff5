"""Markers of the pelvis whose names say nothing: found by their place, where named ones are too few."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mocap_skel.figure.skeleton import LEAST_ON_ROOT
from mocap_skel.labels.guess.motion import CLEARLY, MOVES, RIGID, SHOWN, STILL, Verdict
from mocap_skel.labels.guess.names import HIGH, LIKELY, OPEN, UNSURE
from mocap_skel.labels.guess.rigid import LEAST_FRAMES, Distances

Array = NDArray[np.float64]

HIPS, THIGHS, CHEST = "Hips", ("UpperLeftLeg", "UpperRightLeg"), "Chest"
# Metres: no two markers of a pelvis are farther apart. The widest are those on the crest of one side and on the
# other side's spine in front.
WIDEST = 0.4
# Metres between the distances to the left and the right spine in front: a sacrum's hardly differ, those of a
# posterior spine by 5 cm in the artificial human and more on wide pelves.
MIDDLE = 0.025
# Cosine between "from the spines in front to the marker" and the body's front, in the median, that says "behind"; and
# that is enough by itself. The body's front is that of the feet and the chest, which turn against the pelvis.
BEHIND, CERTAIN = -0.5, -0.8
# (back, front) of markers that tell where the front is.
_FRONTS = (
    ("LHEE", "LTOE"),
    ("RHEE", "RTOE"),
    ("C7", "CLAV"),
    ("T10", "STRN"),
    ("LBHD", "LFHD"),
    ("RBHD", "RFHD"),
)
_BACKS = {"SACR", "LBWT", "RBWT", "RPelvis"}


def with_pelvis(verdicts: list[Verdict], found: Distances, points: Array) -> list[Verdict]:
    """The verdicts in which markers that their names do not tell are on the pelvis, where too few named ones are.

    Such a marker keeps its distances to those of the pelvis, as no thigh does; it is nearer to them than to the
    chest; and where nothing moves, it lies in the middle. One in the middle behind the spines in front is the sacrum,
    two beside it are the posterior spines.

    Args:
        verdicts: on the M markers of one subject, from `weigh`.
        found: the distances between them.
        points: (F, M, 3), metres, NaN = missing.
    """
    at: dict[str, int] = {}
    members: dict[str, list[int]] = {}
    for i, verdict in enumerate(verdicts):
        guess = verdict.guess
        if guess.segment and guess.confidence in (HIGH, LIKELY):
            members.setdefault(guess.segment, []).append(i)
            if guess.marker:
                at[guess.marker] = i
    own = members.get(HIPS, [])
    if not own or (len(own) >= LEAST_ON_ROOT and _BACKS & at.keys()):
        return verdicts
    behind = _behind(at, points)
    result = list(verdicts)
    for i, verdict in enumerate(verdicts):
        guess = verdict.guess
        unknown = guess.confidence in (OPEN, UNSURE) and guess.segment in ("", HIPS)
        if not unknown or guess.computed or guess.lost or verdict.contradicted:
            continue
        spread = _on_pelvis(i, own, members, at, found, behind)
        if spread is not None:
            reason = f"{guess.reason}; {MOVES} {HIPS} within {1e3 * spread:.1f} mm"
            placed = replace(guess, segment=HIPS, marker="", confidence=LIKELY, reason=reason)
            result[i] = Verdict(placed)
    # What motion alone has placed has no name yet.
    nameless = [
        i
        for i, verdict in enumerate(result)
        if verdict.guess.segment == HIPS
        and not verdict.guess.marker
        and MOVES in verdict.guess.reason
    ]
    there = [i for i in nameless if behind[i] < BEHIND]
    for i, name in _backs(there, at, found).items():
        guess = result[i].guess
        reason = f"{guess.reason} and lies behind"
        result[i] = Verdict(replace(guess, marker=name, reason=reason))
    return result


def _on_pelvis(
    i: int,
    own: list[int],
    members: Mapping[str, list[int]],
    at: Mapping[str, int],
    found: Distances,
    behind: Array,
) -> float | None:
    """Metres that a marker's distances to the pelvis vary by, if it is on it; None if it is not."""
    spread, mean = found.spread[i], found.mean[i]
    worst, far = float(np.max(spread[own])), float(np.max(mean[own]))
    # NaN compares as false.
    if not (worst <= RIGID and far <= WIDEST):
        return None
    chest = mean[members.get(CHEST, [])]
    if np.isfinite(chest).any() and float(np.nanmean(chest)) < float(np.mean(mean[own])):
        return None
    thighs = [k for name in THIGHS for k in members.get(name, [])]
    moved = spread[thighs][np.isfinite(spread[thighs])]
    if len(moved) and np.median(moved) > max(SHOWN, CLEARLY * max(worst, STILL)):
        return worst
    # Where nothing moves, a trochanter would be on the pelvis too.
    return worst if behind[i] < CERTAIN or _in_the_middle(i, at, found) else None


def _in_the_middle(i: int, at: Mapping[str, int], found: Distances) -> bool:
    """Whether a marker is as far from the left spine in front as from the right one."""
    if not {"LFWT", "RFWT"} <= at.keys():
        return False
    left, right = found.mean[i, at["LFWT"]], found.mean[i, at["RFWT"]]
    return bool(abs(left - right) < MIDDLE)


def _backs(behind: list[int], at: Mapping[str, int], found: Distances) -> dict[int, str]:
    """The landmarks that markers behind the spines in front are; none where one of them has its name."""
    if _BACKS & at.keys():
        return {}
    sacra = [i for i in behind if _in_the_middle(i, at, found)]
    if len(sacra) == 1:
        return {sacra[0]: "SACR"}
    left = [i for i in behind if found.mean[i, at["LFWT"]] < found.mean[i, at["RFWT"]] - MIDDLE]
    right = [i for i in behind if found.mean[i, at["RFWT"]] < found.mean[i, at["LFWT"]] - MIDDLE]
    if len(left) == len(right) == 1 and not sacra:
        return {left[0]: "LBWT", right[0]: "RBWT"}
    return {}


def _behind(at: Mapping[str, int], points: Array) -> Array:
    """How far behind the spines in front all M markers lie, as feet, chest and head tell the front: (M,) cosines.

    1 is straight in front, -1 straight behind; the median over the frames, 0 where too few tell.
    """
    ways = [
        points[:, at[front]] - points[:, at[back]]
        for back, front in _FRONTS
        if {back, front} <= at.keys()
    ]
    if not ways or not {"LFWT", "RFWT"} <= at.keys():
        return np.zeros(points.shape[1])
    front = np.sum(ways, axis=0)
    way = points - points[:, [at["LFWT"], at["RFWT"]]].mean(axis=1)[:, None]
    lengths = np.linalg.norm(way, axis=2) * np.linalg.norm(front, axis=1)[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = np.einsum("fmd,fd->fm", way, front) / lengths
    enough = np.isfinite(cosine).sum(axis=0) >= LEAST_FRAMES
    middle = np.zeros(points.shape[1])
    middle[enough] = np.nanmedian(cosine[:, enough], axis=0)
    return middle

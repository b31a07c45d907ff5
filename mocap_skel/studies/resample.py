"""How the joints' constants scatter when frames are left out at random (thesis 6.1)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mocap_skel.clip import Clip
from mocap_skel.errors import FitError
from mocap_skel.segments.pose import Array
from mocap_skel.skeleton_fit import SkeletonFit

# The thesis's claim (6.1): within so many metres for more than so many samples.
NEAR = 0.01
ENOUGH = 200
# Means that lie so many times their common scatter apart are two answers; and each must have so much of
# all answers at least, or it is an outlier. Picked by eye: heavy tails stay one answer, the thesis's ankles
# are two.
_APART = 6.0
SHARE = 0.05
# Numbers of samples have to differ by this factor before a line is put through them. Picked by eye.
_SPAN = 4.0


@dataclass(frozen=True)
class Answer:
    """One joint's constant from one refit of the whole figure.

    Attributes:
        passed: number of the pass, from 0.
        level: percent of the frames that were left out.
        frames: how many were left.
        joint: its name.
        samples: of a marker of the joint, on average; 0 without an answer.
        method: the estimator that was used.
        frame: the points that gave the parent's axes in that refit.
        x, y, z: metres, in the parent's frame of that refit; NaN without an answer.
    """

    passed: int
    level: int
    frames: int
    joint: str
    samples: int
    method: str
    frame: str
    x: float
    y: float
    z: float


def refits(
    clip: Clip, fit: Callable[[Clip], SkeletonFit], passed: int, levels: Sequence[int], seed: int
) -> list[Answer]:
    """Fit the whole figure again at each level, from the frames that are left.

    What is drawn depends on seed, pass and level only, so that any part of the study can be made alone.
    A level at which the figure cannot be fitted has no answers.

    Args:
        clip: the whole recording.
        fit: makes a skeleton of a clip.
        passed: number of the pass.
        levels: percent of the frames to leave out.
        seed: of the draw.

    Returns:
        One answer for each level and joint.

    Example:
        >>> from mocap_skel import associate, fit_skeleton, read_association, read_clip
        >>> from mocap_skel.studies.resample import refits
        >>> clip, known = read_clip("sample_data/range_of_motion.c3d"), read_association("cmu")
        >>> actor = associate(clip, known)[0]
        >>> answers = refits(clip, lambda part: fit_skeleton(part, actor, known.skeleton), 0, [90], 0)
        >>> len(answers), answers[0].joint, answers[0].frames
        (14, 'Waist', 138)
    """
    answers = []
    for level in levels:
        rng = np.random.default_rng([seed, passed, level])
        left = clip.frames - round(clip.frames * level / 100)
        kept = np.sort(rng.permutation(clip.frames)[:left])
        try:
            found = fit(replace(clip, points=clip.points[kept]))
        except FitError:
            continue
        for joint in found.joints:
            parent = found.segments.get(joint.parent)
            frame = "" if parent is None else " ".join(parent.drawn_through)
            samples = joint.samples // max(len(joint.markers), 1)
            x, y, z = map(float, joint.centre)
            answers.append(
                Answer(passed, level, left, joint.joint, samples, joint.method, frame, x, y, z)
            )
    return answers


@dataclass(frozen=True)
class Group:
    """Answers of one joint that mean the same point: a row of the thesis's tables 2 and 3.

    Attributes:
        joint: its name.
        cluster: 1, or 2 and more where the joint has several answers; the largest first.
        answers: how many.
        frame, method: of most of them.
        mean: (3,), metres.
        deviation: (3,), standard deviations about it (N - 1), metres.
        single: (3,), those of all the joint's answers about one mean, as the thesis's table 3 has them.
    """

    joint: str
    cluster: int
    answers: int
    frame: str
    method: str
    mean: Array
    deviation: Array
    single: Array


@dataclass(frozen=True)
class Law:
    """How the deviation falls with the number of samples: of a joint's answers, or of all joints ("all").

    Attributes:
        joint: its name.
        answers: how many.
        slope: of log deviation in log samples; -½ is the law of independent samples; NaN where samples
            hardly differ.
        slope_error: its standard error.
        finite_slope: the same against n N / (N - n): frames are drawn from a clip of N and not put
            back, so that the answers of nearly all frames lie closer together than -½ would have it.
        at_enough: deviation at `ENOUGH` samples by the fitted law, metres; NaN where no answer had so few.
        near: share within `NEAR` of those with more than `ENOUGH` samples; NaN if there are none.
    """

    joint: str
    answers: int
    slope: float
    slope_error: float
    finite_slope: float
    at_enough: float
    near: float


@dataclass(frozen=True, eq=False)
class Summary:
    """What the answers of all passes say.

    Attributes:
        answers: those with a place, in the order of passes and levels.
        cluster: (answers,) of each.
        deviation: (answers,) distance from its cluster's mean, metres.
        groups: the tables of means and standard deviations.
        laws: one a joint, then "all".
    """

    answers: tuple[Answer, ...]
    cluster: NDArray[np.int64]
    deviation: Array
    groups: tuple[Group, ...]
    laws: tuple[Law, ...]


def summarise(answers: Iterable[Answer]) -> Summary:
    """Clusters, means, deviations, and how these fall with the number of samples.

    Raises:
        FitError: not one refit has an answer.

    Example:
        >>> from mocap_skel.studies.resample import Answer, summarise
        >>> sides = [(n, side / n**0.5) for n in (10, 100, 1000) for side in (1, -1)]
        >>> answers = [Answer(0, 0, n, "Knee", n, "MGDK", "", x, 0.0, 0.0) for n, x in sides]
        >>> print(round(summarise(answers).laws[0].slope, 6))
        -0.5
    """
    found = tuple(answer for answer in answers if np.isfinite(answer.x))
    if not found:
        raise FitError("no refit has an answer for any joint")
    names = list(dict.fromkeys(answer.joint for answer in found))
    joint = np.array([names.index(answer.joint) for answer in found])
    places = np.array([(answer.x, answer.y, answer.z) for answer in found])
    samples = np.array([answer.samples for answer in found], dtype=np.float64)
    most = np.array([samples[joint == j].max() for j in range(len(names))])[joint]
    cluster = np.zeros(len(found), dtype=np.int64)
    deviation = np.zeros(len(found))
    groups, laws = [], []
    for number, name in enumerate(names):
        mine = np.flatnonzero(joint == number)
        kinds = [(found[i].frame, found[i].method) for i in mine]
        cluster[mine] = 1 + clusters(places[mine], samples[mine], kinds)
        single = _deviation(places[mine])
        for which in range(1, cluster[mine].max() + 1):
            rows = mine[cluster[mine] == which]
            mean = places[rows].mean(axis=0)
            deviation[rows] = np.linalg.norm(places[rows] - mean, axis=1)
            (frame, method), _ = Counter(
                (found[i].frame, found[i].method) for i in rows
            ).most_common(1)[0]
            own = _deviation(places[rows])
            groups.append(Group(name, which, len(rows), frame, method, mean, own, single))
        laws.append(_law(name, samples[mine], deviation[mine], most[mine]))
    laws.append(_law("all", samples, deviation, most))
    return Summary(found, cluster, deviation, tuple(groups), tuple(laws))


def _deviation(places: Array) -> Array:
    """(3,), standard deviations of places (K, 3) about their mean; NaN for a single one."""
    if len(places) < 2:
        return np.full(places.shape[1], np.nan)
    return np.asarray(places.std(axis=0, ddof=1))


def clusters(places: Array, samples: Array, kinds: Sequence[object]) -> NDArray[np.int64]:
    """Which of its joint's distinct answers each place belongs to, 0 the largest.

    Answers in other axes of the parent, or by another estimator, may be another quantity (the
    thesis's ankles and elbows, 6.1): what is known of each answer's kind divides them first. What is not
    known shows in the places: the answers from many samples scatter least, so the better half of a
    kind decides. They are cut at the widest gap along their longest axis, and each side again; the others
    belong to the nearest mean. Whatever divides them, two parts are distinct only if their means lie
    several times their scatter apart.

    Args:
        places: (K, 3), the answers, metres.
        samples: (K,) of each.
        kinds: K of them, equal where nothing is known that tells two answers apart.

    Returns:
        (K,).

    Example:
        >>> import numpy as np
        >>> from mocap_skel.studies.resample import clusters
        >>> rng = np.random.default_rng(0)
        >>> places = np.concatenate([rng.normal(size=(40, 3)), rng.normal(size=(20, 3)) + 50])
        >>> np.bincount(clusters(places, np.ones(60), [""] * 60)).tolist()
        [40, 20]
    """
    label = np.zeros(len(places), dtype=np.int64)
    count = 0
    for kind in dict.fromkeys(kinds):
        mine = np.flatnonzero([kind == other for other in kinds])
        better = _better_half(mine, samples)
        means = np.array([places[better[part]].mean(axis=0) for part in _parts(places[better])])
        away = np.linalg.norm(places[mine][:, None] - means, axis=2)
        label[mine] = count + away.argmin(axis=1)
        count += len(means)
    return _by_size(_merged(places, samples, _by_size(label)))


def _by_size(label: NDArray[np.int64]) -> NDArray[np.int64]:
    """The same parts, numbered from the largest."""
    _, number, size = np.unique(label, return_inverse=True, return_counts=True)
    return np.argsort(np.argsort(-size, kind="stable"), kind="stable")[number]


def _merged(places: Array, samples: Array, label: NDArray[np.int64]) -> NDArray[np.int64]:
    """Parts in the order of their sizes, those that are not distinct from a larger one joined to it."""
    label = label.copy()
    for part in range(1, label.max() + 1):
        for larger in range(part):
            sides = [
                _better_half(np.flatnonzero(label == which), samples) for which in (larger, part)
            ]
            if all(len(side) for side in sides) and not _distinct(places, sides):
                label[label == part] = larger
                break
    return label


def _better_half(rows: NDArray[np.int64], samples: Array) -> NDArray[np.int64]:
    """The rows that have as many samples as their median, or more."""
    return rows[samples[rows] >= np.median(samples[rows])] if len(rows) else rows


def _distinct(places: Array, sides: Sequence[NDArray[np.int64]]) -> bool:
    """Whether the means of two sets lie several times their common scatter apart."""
    means = [places[side].mean(axis=0) for side in sides]
    square = sum(((places[side] - m) ** 2).sum() for side, m in zip(sides, means, strict=True))
    scatter = np.sqrt(square / sum(map(len, sides)))
    # What rounding makes of answers that are all the same is no distance.
    rounding = 1e-9 * np.abs(places).max()
    return bool(np.linalg.norm(means[0] - means[1]) > _APART * scatter + rounding)


def _parts(places: Array) -> Iterator[NDArray[np.int64]]:
    """Indices of each cluster."""
    everything = np.arange(len(places))
    centred = places - places.mean(axis=0)
    least = max(3, int(np.ceil(SHARE * len(places))))
    if len(places) < 2 * least:
        yield everything
        return
    along = centred @ np.linalg.eigh(centred.T @ centred)[1][:, -1]
    order = np.argsort(along, kind="stable")
    gaps = np.diff(along[order])[least - 1 : len(places) - least]
    cut = least + int(gaps.argmax())
    sides = np.sort(order[:cut]), np.sort(order[cut:])
    if not _distinct(places, sides):
        yield everything
        return
    for side in sides:
        for part in _parts(places[side]):
            yield side[part]


def _law(name: str, samples: Array, deviation: Array, most: Array) -> Law:
    """The law of answers with so many samples of `most` and such deviations, all of shape (K,)."""
    # An answer on its mean to rounding is one of a kind: its logarithm says nothing.
    usable = (deviation > 1e-12) & (samples > 0)
    slope, error, offset = _line(np.log10(samples[usable]), np.log10(deviation[usable]))
    drawn = usable & (samples < most)
    n, whole = samples[drawn], most[drawn]
    finite = _line(np.log10(n * whole / (whole - n)), np.log10(deviation[drawn]))
    enough = samples > ENOUGH
    few = bool((samples[usable] <= ENOUGH).any())
    return Law(
        joint=name,
        answers=len(samples),
        slope=slope,
        slope_error=error,
        finite_slope=finite[0],
        at_enough=float(10 ** (offset + slope * np.log10(ENOUGH))) if few else float("nan"),
        near=float((deviation[enough] <= NEAR).mean()) if enough.any() else float("nan"),
    )


def _line(x: Array, y: Array) -> tuple[float, float, float]:
    """Slope, its standard error, and offset of the line through logarithms; NaN without a span in x."""
    if len(x) < 3 or not np.ptp(x) > np.log10(_SPAN):
        return float("nan"), float("nan"), float("nan")
    (slope, offset), covariance = np.polyfit(x, y, 1, cov=True)
    return float(slope), float(np.sqrt(covariance[0, 0])), float(offset)

"""Whether markers lie where they can lie on a body: order along limbs, left and right, front and back, mirrored.

No movement is needed. The rules are those of `figure/body_plan.py`; each counts only where it is broken by a wide
margin in nearly all frames, and an exchange is named only if it puts right all rules that its markers break.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from types import MappingProxyType

import numpy as np

from mocap_skel.figure.body_plan import FRONTS, LENGTHS, ORDER, PARTS, SIDES, SIZES
from mocap_skel.segments.pose import Array
from mocap_skel.segments.shape import median
from mocap_skel.text import listed

# A rule is broken where it is wrong by a tenth, and in so many of the frames. Picked by eye on generated clips, which keep
# every rule; tests/segments/test_misplaced.py tries the exchanges.
TENTH = 0.1
MOST = 0.9
# Share of a distance by which the other side has to be nearer than the own one.
NEARER = 0.03
# How much too long a bone is, and how well the other one has to fit, where lengths tell the sides.
TOO_LONG, FITTING = 1.3, 0.25
# Cosine of front against front: a trunk turns by less than 120 degrees.
BACKWARDS = -0.5
# Triple product of three unit vectors: less is too flat to show left-handedness.
FLAT = 0.2
# What nearness counts for beside likeness of the two sides, both as logarithms of distances.
COMPACT = 0.5

Tracks = Mapping[str, Array]
# Two pairs, by their names without L and R → how clearly their sides agree; negative where they contradict each other.
Edges = Mapping[tuple[str, str], float]


@dataclass(frozen=True)
class Exchange:
    """Markers that stand in each other's place.

    Attributes:
        pairs: standard names, two by two.
        evidence: what shows it, in words.
        part: "" for a single pair, or the part of the body whose sides are exchanged.
    """

    pairs: tuple[tuple[str, str], ...]
    evidence: str
    part: str = ""


def exchanged(tracks: Tracks) -> list[Exchange]:
    """Exchanges that the places of the markers show, but for those of left and right.

    Args:
        tracks: standard name → (frames, 3), metres, NaN = missing.

    Example:
        The ankle's marker is nearer to the shank's than to the knee's, unless two labels are exchanged.

        >>> import numpy as np
        >>> height = {"LKNE": 0.5, "LTIB": 0.1, "LANK": 0.35}
        >>> tracks = {name: np.tile([0.0, 0.0, z], (9, 1)) for name, z in height.items()}
        >>> [found] = exchanged(tracks)
        >>> found.pairs, found.evidence
        ((('LANK', 'LTIB'),), 'seen from LKNE, LANK (15 cm) should be farther than LTIB (40 cm)')
    """
    found = []
    tracks = dict(tracks)
    for search in (_order, _fronts):
        for one in list(search(tracks)):
            found.append(one)
            for first, second in one.pairs:
                tracks[first], tracks[second] = tracks[second], tracks[first]
    return found


def _distance(tracks: Tracks, first: str, second: str) -> Array:
    away = tracks[first] - tracks[second]
    return np.asarray(np.sqrt(np.einsum("fi,fi->f", away, away)))


def _far(tracks: Tracks, first: str, second: str) -> float:
    return float(median(_distance(tracks, first, second)))


def _clear(values: Array, limit: float) -> float:
    """The median of signed values; 0 where it is within the limit, or where the sign is not nearly always the same."""
    values = values[np.isfinite(values)]
    if not len(values):
        return 0.0
    middle = float(median(values))
    same = float((np.sign(values) == np.sign(middle)).mean())
    return middle if abs(middle) > limit and same >= MOST else 0.0


# --- order along a limb


def _order(tracks: Tracks) -> Iterator[Exchange]:
    """Pairs whose exchange puts every rule right that they break."""
    rules = _rules(tracks)
    while rules and (broken := _broken(tracks, rules)):
        best = _best_exchange(tracks, rules, broken)
        if best is None:
            return
        seen, nearer, farther = next(rule for rule in broken if set(best) & set(rule))
        yield Exchange(
            (best,),
            f"seen from {seen}, {farther} ({100 * _far(tracks, seen, farther):.0f} cm) should be farther "
            f"than {nearer} ({100 * _far(tracks, seen, nearer):.0f} cm)",
        )
        tracks = {**tracks, best[0]: tracks[best[1]], best[1]: tracks[best[0]]}


def disorder(tracks: Tracks) -> int:
    """How many rules of the order along limbs are clearly broken."""
    rules = _rules(tracks)
    return len(_broken(tracks, rules)) if rules else 0


def _rules(tracks: Tracks) -> list[tuple[str, str, str]]:
    """The rules of `ORDER`, for both sides, whose markers are all there."""
    found: dict[tuple[str, str, str], None] = {}
    for seen, nearer, farther in ORDER:
        for side, other in ("LR", "RL"):
            a, b, c = (
                name.replace("*", side).replace("~", other) for name in (seen, nearer, farther)
            )
            if a in tracks and b in tracks and c in tracks:
                found[a, b, c] = None
    return list(found)


def _broken(tracks: Tracks, rules: list[tuple[str, str, str]]) -> list[tuple[str, str, str]]:
    """The rules that are clearly broken, the clearest first."""
    pairs = sorted({tuple(sorted((rule[0], name))) for rule in rules for name in rule[1:]})
    at = {pair: i for i, pair in enumerate(pairs)}
    names = list(tracks)
    points = np.stack([tracks[name] for name in names])
    first, second = (
        np.array([names.index(pair[k]) for pair in pairs], dtype=np.intp) for k in (0, 1)
    )
    away = points[first] - points[second]
    squares = np.einsum("pfi,pfi->pf", away, away)
    near = squares[[at[tuple(sorted((a, b)))] for a, b, _ in rules]]
    far = squares[[at[tuple(sorted((a, c)))] for a, _, c in rules]]
    seen = np.isfinite(near) & np.isfinite(far)
    wrong = (seen & (far < near)).sum(axis=1) >= MOST * np.maximum(seen.sum(axis=1), 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = {i: float(median(np.log(far[i] / near[i]))) / 2 for i in np.flatnonzero(wrong)}
    return [rules[i] for i in sorted(ratio, key=lambda i: ratio[i]) if ratio[i] < -TENTH]


def _best_exchange(
    tracks: Tracks, rules: list[tuple[str, str, str]], broken: list[tuple[str, str, str]]
) -> tuple[str, str] | None:
    """The pair of markers after whose exchange no rule of theirs is broken, and the body is most like a body.

    That is: its two sides are most alike, and what belongs together is near.
    """
    names = list(dict.fromkeys(name for rule in rules for name in rule))
    at = {name: i for i, name in enumerate(names)}
    points = np.stack([tracks[name] for name in names])
    with np.errstate(divide="ignore"):
        middle = np.log([median(((points - one) ** 2).sum(axis=2)) for one in points]) / 2
    triples = np.array([[at[name] for name in rule] for rule in rules], dtype=np.intp)
    twins = np.array([[at.get(_twin(name), -1) for name in rule] for rule in rules], dtype=np.intp)
    both = (twins >= 0).all(axis=1)
    hurt = {name for rule in broken for name in rule}
    best, least = None, np.inf
    for first, second in combinations(names, 2):
        if not {first, second} & hurt:
            continue
        i, j = at[first], at[second]
        place = np.arange(len(names))
        place[[i, j]] = j, i
        a, b, c = place[triples].T
        near, far = middle[a, b], middle[a, c]
        touched = ((triples == i) | (triples == j)).any(axis=1)
        if (far <= near)[touched].any():
            continue
        x, y, z = place[np.maximum(twins, 0)].T
        unlike = np.abs(near - middle[x, y]) + np.abs(far - middle[x, z])
        cost = float(np.nansum(unlike[both]) + COMPACT * np.nansum(near + far))
        if cost < least:
            best, least = (first, second), cost
    return best


def _twin(name: str) -> str:
    """The same marker of the other side; one of the middle is its own."""
    return {"L": "R", "R": "L"}.get(name[0], name[0]) + name[1:]


# --- left and right


def sides(tracks: Tracks, firm: Edges = MappingProxyType({})) -> list[Exchange]:
    """Pairs of markers, and whole parts, whose left and right are exchanged against the rest of the body.

    Two pairs agree in their sides where each marker is with the one of its own side, and contradict each other
    where it is with the other's. What agrees is kept together. So one exchange explains all contradictions, and
    nothing is named that contradicts nothing.

    Args:
        tracks: standard name → (frames, 3), metres, NaN = missing.
        firm: two names without their L or R → positive where the movement shows that their sides agree, negative
            where they contradict each other (`Rigidity.sides`).

    Example:
        The knees' markers, whose labels are exchanged, are nearer to the other side's thigh.

        >>> import numpy as np
        >>> at = {"LTHI": (1, 7), "RTHI": (-1, 7), "LTIB": (1, 3), "RTIB": (-1, 3), "LKNE": (-1, 5), "RKNE": (1, 5)}
        >>> tracks = {name: np.tile([0.0, 0.1 * y, 0.1 * z], (9, 1)) for name, (y, z) in at.items()}
        >>> [found.pairs for found in sides(tracks)]
        [(('LKNE', 'RKNE'),)]
    """
    found = []
    edges = {edge: value for edge, value in {**_edges(tracks), **firm}.items() if value}
    for cluster in _contradicting(tracks, edges):
        across = [e for e, v in edges.items() if v < 0 and (e[0] in cluster) != (e[1] in cluster)]
        edge = min(across, key=lambda e: edges[e])
        one, other = edge if edge[0] in cluster else edge[::-1]
        near, far = _far(tracks, f"L{one}", f"R{other}"), _far(tracks, f"L{one}", f"L{other}")
        part, names = _part(tracks, cluster, {name for e in edges for name in e})
        found.append(
            Exchange(
                tuple((f"L{name}", f"R{name}") for name in sorted(names)),
                f"L{one} is {100 * far:.0f} cm from L{other} and {100 * near:.0f} cm from R{other}",
                part,
            )
        )
    return found


def _contradicting(tracks: Tracks, edges: Edges) -> list[frozenset[str]]:
    """The sets of names whose sides are exchanged; each agrees in itself."""
    names = sorted({name for edge in edges for name in edge})
    clusters: list[frozenset[str]] = [frozenset([name]) for name in names]
    for (one, other), value in edges.items():
        if value > 0:
            joined = [c for c in clusters if one in c or other in c]
            clusters = [c for c in clusters if c not in joined] + [frozenset().union(*joined)]
    of = {name: i for i, cluster in enumerate(clusters) for name in cluster}
    against: dict[int, set[int]] = {i: set() for i in range(len(clusters))}
    for (one, other), value in edges.items():
        if value < 0 and of[one] != of[other]:
            against[of[one]].add(of[other])
            against[of[other]].add(of[one])
    wrong: list[frozenset[str]] = []
    left = {i for i, others in against.items() if others}
    while left:
        sides = {min(left): 0}
        queue = list(sides)
        for i in queue:
            for j in sorted(against[i] - sides.keys()):
                sides[j] = 1 - sides[i]
                queue.append(j)
        left -= sides.keys()
        if any(sides[i] == sides[j] for i in sides for j in against[i]):
            continue
        halves = [[clusters[i] for i in sides if sides[i] == side] for side in (0, 1)]
        # Either half may be the exchanged one: that which makes right-handed axes, then the smaller one.
        wrong += min(
            halves,
            key=lambda half: (
                -_right_handed(_other_sides(tracks, [n for c in half for n in c])),
                sum(map(len, half)),
            ),
        )
    return wrong


def _part(
    tracks: Tracks, cluster: frozenset[str], known: Container[str]
) -> tuple[str, frozenset[str]]:
    """What exchanged pairs are called, "" for a single one; and all of them, also those of which nothing is known."""
    if len(cluster) == 1:
        return "", cluster
    for part, names in PARTS.items():
        there = [n for n in names if f"L{n}" in tracks and f"R{n}" in tracks]
        if cluster == {name for name in there if name in known}:
            return part, frozenset(there)
    whole = [part for part, names in PARTS.items() if cluster <= set(names)]
    smallest = min(whole, key=lambda part: len(PARTS[part]), default="the body")
    return f"some markers of {smallest}", cluster


def turned_head(tracks: Tracks) -> list[Exchange]:
    """The head, which turns too far for nearness: where its axes are left-handed, and all others right-handed.

    Args:
        tracks: standard name → (frames, 3), metres, with all other exchanges put right: one wrong marker turns the
            axes over, too.
    """
    hands = _hands(tracks)
    head = hands.pop("head", 0.0)
    others = [hand for hand in hands.values() if hand]
    if head >= 0 or len(others) < 2 or min(others) < 0:
        return []
    pairs = tuple((f"L{n}", f"R{n}") for n in PARTS["the head"] if f"L{n}" in tracks)
    words = "left, up and front make left-handed axes there and right-handed ones elsewhere"
    return [Exchange(pairs, words, "the head")]


def _other_sides(tracks: Tracks, pairs: Iterable[str]) -> Tracks:
    """The tracks with left and right of some pairs exchanged."""
    changed = dict(tracks)
    for name in pairs:
        changed |= {f"L{name}": tracks[f"R{name}"], f"R{name}": tracks[f"L{name}"]}
    return changed


def _right_handed(tracks: Tracks) -> int:
    """How many parts of the body have right-handed axes, less those that have left-handed ones."""
    return int(sum(_hands(tracks).values()))


def _edges(tracks: Tracks) -> dict[tuple[str, str], float]:
    """Two pairs → how clearly their sides agree; negative where they contradict each other."""
    found = {}
    for one, other in SIDES:
        if all(f"{side}{name}" in tracks for side in "LR" for name in (one, other)):
            found[one, other] = _agree(tracks, one, other)
    known = [
        _far(tracks, first, second) / length
        for first, second, length in SIZES
        if first in tracks and second in tracks
    ]
    known = [size for size in known if np.isfinite(size)]
    size = float(median(np.array(known))) if len(known) > 1 else np.nan
    for one, other, length in LENGTHS:
        if all(f"{side}{name}" in tracks for side in "LR" for name in (one, other)):
            own = [_far(tracks, f"{s}{one}", f"{s}{other}") / (length * size) for s in "LR"]
            swapped = [
                _far(tracks, f"{a}{one}", f"{b}{other}") / (length * size) for a, b in ("LR", "RL")
            ]
            wrong = min(own) > TOO_LONG and max(abs(x - 1) for x in swapped) < FITTING
            right = max(abs(x - 1) for x in own) < FITTING and min(swapped) > TOO_LONG
            found[one, other] = -NEARER if wrong else NEARER if right else 0.0
    return found


def _agree(tracks: Tracks, one: str, other: str) -> float:
    """How much nearer two pairs are on their own sides than across, as a share; 0 where that is not clear.

    Negative only if it is so for both sides: one marker alone that is elsewhere makes no exchange of sides.
    """
    same = [_distance(tracks, f"{side}{one}", f"{side}{other}") for side in "LR"]
    cross = [_distance(tracks, f"{a}{one}", f"{b}{other}") for a, b in ("LR", "RL")]
    apart, beside = cross[0] + cross[1], same[0] + same[1]
    both = _clear((apart - beside) / (apart + beside), NEARER)
    if both < 0 and any(_clear(c - s, 0.0) >= 0 for c, s in zip(cross, same, strict=True)):
        return 0.0
    return both


# --- front and back


def _fronts(tracks: Tracks) -> Iterator[Exchange]:
    """Pairs whose front is behind, against all the others."""
    ways = {
        (front, back): _unit(tracks[front] - tracks[back])
        for _, front, back in FRONTS
        if front in tracks and back in tracks
    }
    if len(ways) < 4:
        return
    total = np.nansum(list(ways.values()), axis=0)
    for pair, own in ways.items():
        rest = total - np.nan_to_num(own)
        if _clear(_cosine(own, rest), -BACKWARDS) >= 0:
            continue
        others = [v for p, v in ways.items() if p != pair]
        if all(_clear(_cosine(v, rest - np.nan_to_num(v)), 0.0) > 0 for v in others):
            front, back = pair
            yield Exchange(
                (pair,), f"{front} is behind {back}, by what is front in the other pairs"
            )


def _unit(v: Array) -> Array:
    return np.asarray(v / np.sqrt(np.einsum("fi,fi->f", v, v))[:, None])


def _cosine(v: Array, w: Array) -> Array:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.einsum("fi,fi->f", v, _unit(w)))


# --- a mirrored body


def mirrored(tracks: Tracks) -> str:
    """What shows that the body is mirrored, in words; "" where something speaks against it.

    Left, up and front of pelvis, chest, head and legs are each a left-handed set of axes. Two parts at least have
    to say so, and none the opposite.

    Args:
        tracks: standard name → (frames, 3), metres, NaN = missing.
    """
    hands = _hands(tracks)
    against = [part for part, hand in hands.items() if hand < 0]
    if len(against) < 2 or any(hand > 0 for hand in hands.values()):
        return ""
    return f"left, up and front of {listed(against)} make left-handed axes"


def _hands(tracks: Tracks) -> dict[str, float]:
    """Part of the body → 1 where its left, up and front are right-handed, -1 left-handed, 0 not clear."""
    hands = {}
    for part, (left, up, front) in _axes(tracks).items():
        with np.errstate(invalid="ignore", divide="ignore"):
            triple = np.einsum("fi,fi->f", np.cross(_unit(left), _unit(up)), _unit(front))
        triple = triple[np.abs(triple) > FLAT]
        enough = len(triple) > len(left) / 5
        hands[part] = float(np.sign(_clear(triple, 0.0))) if enough else 0.0
    return hands


def _axes(tracks: Tracks) -> dict[str, tuple[Array, Array, Array]]:
    """Part of the body → its left, up and front (frames, 3), by the labels."""

    def middle(*names: str) -> Array | None:
        found = [tracks[name] for name in names if name in tracks]
        return np.asarray(np.mean(found, axis=0)) if found else None

    def between(one: Array | None, other: Array | None) -> Array | None:
        return None if one is None or other is None else one - other

    chest = middle("C7", "CLAV", "T10", "STRN", "LSHO", "RSHO")
    pelvis = middle("LFWT", "RFWT", "LBWT", "RBWT", "SACR")
    hips = middle("LFWT", "RFWT")
    across = between(tracks.get("LFWT"), tracks.get("RFWT"))
    trunk = between(chest, pelvis)
    if trunk is None:
        trunk = between(pelvis, middle("LKNE", "RKNE"))
    found = {
        "pelvis": (across, trunk, between(hips, middle("LBWT", "RBWT", "SACR"))),
        "chest": (
            between(tracks.get("LSHO"), tracks.get("RSHO")),
            between(middle("C7", "CLAV"), middle("T10", "STRN")),
            between(middle("CLAV", "STRN"), middle("C7", "T10")),
        ),
        "head": (
            between(tracks.get("LFHD"), tracks.get("RFHD")),
            between(middle("LFHD", "RFHD", "LBHD", "RBHD"), middle("C7", "CLAV", "LSHO", "RSHO")),
            between(middle("LFHD", "RFHD"), middle("LBHD", "RBHD")),
        ),
    }
    for side, name in (("L", "left"), ("R", "right")):
        knee, ankle, hip = (tracks.get(f"{side}{m}") for m in ("KNE", "ANK", "FWT"))
        toe, heel = tracks.get(f"{side}TOE"), tracks.get(f"{side}HEE")
        found[f"{name} foot"] = (across, between(knee, ankle), between(toe, heel))
        found[f"{name} knee"] = (across, between(hip, knee), between(knee, ankle))
    return {
        part: (left, up, front)
        for part, (left, up, front) in found.items()
        if left is not None and up is not None and front is not None
    }

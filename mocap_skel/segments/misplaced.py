"""Find markers that stand in another's place, and bodies that are mirrored, before anything is fitted."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from mocap_skel.clip import Clip
from mocap_skel.errors import LabelError
from mocap_skel.figure.skeleton import LEAST_ON_ROOT, Skeleton
from mocap_skel.segments.body_order import (
    Exchange,
    disorder,
    exchanged,
    mirrored,
    sides,
    turned_head,
)
from mocap_skel.segments.pose import Array
from mocap_skel.segments.rigidity import Rigidity
from mocap_skel.text import listed

# About so many frames tell it; more cost time and show nothing else.
ENOUGH = 80

Columns = Mapping[str, Mapping[str, int]]


@dataclass(frozen=True)
class Misplaced:
    """Markers that certainly are not where the association has them.

    Attributes:
        segment: the association's segment of each such marker, standard name → segment.
        sentences: one for each exchange, and for each marker of another segment, with its evidence.
        mirrored: what shows that the whole body is mirrored, "" where it is not.
    """

    segment: Mapping[str, str]
    sentences: tuple[str, ...]
    mirrored: str

    def without(self, columns: Columns) -> dict[str, dict[str, int]]:
        """Segment → marker → column, without the misplaced ones."""
        return {
            name: {marker: i for marker, i in own.items() if marker not in self.segment}
            for name, own in columns.items()
        }

    def doubt(self, *segments: str) -> str:
        """Why a joint between these segments is in doubt, "" where it is not.

        >>> found = Misplaced({"RELB": "UpperRightArm", "RARM": "LowerRightArm"}, (), "")
        >>> found.doubt("UpperRightArm", "Chest")
        'in doubt: RELB is left out, it looks exchanged'
        """
        own = [marker for marker, segment in self.segment.items() if segment in segments]
        if not own:
            return ""
        verb, it = ("is", "it looks") if len(own) == 1 else ("are", "they look")
        return f"in doubt: {listed(own)} {verb} left out, {it} exchanged"


# Metres: a marker beside a joint may go with both segments: one on the shoulder blade moves with the arm, by the sine of
# 20 degrees of a collar bone of 15 cm.
GIRDLE = 0.05
NOTHING = Misplaced({}, (), "")


def checked_columns(
    clip: Clip, columns: Columns, skeleton: Skeleton, *, search: bool = True, trust: bool = False
) -> tuple[dict[str, dict[str, int]], Misplaced, tuple[str, ...]]:
    """The columns that may be fitted: without the markers that certainly are somewhere else.

    Args:
        clip: the recording.
        columns: segment → marker → its column.
        skeleton: the figure.
        search: whether anything is looked for.
        trust: leave nothing out, only say it.

    Returns:
        Segment → marker → column; what was left out; notes.

    Raises:
        LabelError: the whole body is mirrored, or the root is left without the markers that it needs.
    """
    if not search:
        return _plain(columns), NOTHING, ()
    found = find_misplaced(clip.points, columns, skeleton)
    if trust:
        body = [f"the body looks mirrored: {found.mirrored}"] if found.mirrored else []
        said = (*found.sentences, *body)
        return _plain(columns), NOTHING, tuple(f"{one} (fitted all the same)" for one in said)
    if found.mirrored:
        raise LabelError(
            f"{clip.name}: the body is mirrored: {found.mirrored}. Either an axis of the file is negated, or left "
            "and right are exchanged in all labels; the markers alone cannot tell which",
            "--mirror x (or y, z) negates an axis; otherwise exchange left and right in the association file; "
            "--trust-labels fits it as it is",
        )
    left = found.without(columns)
    root = skeleton.root.name
    if len(left.get(root, ())) < LEAST_ON_ROOT <= len(columns.get(root, ())):
        raise LabelError(
            f"{clip.name}: {'; '.join(found.sentences)}; without them {root} has no three markers",
            "exchange their labels in the association file; --trust-labels fits them as they are named",
        )
    return left, found, tuple(f"left out of the fit: {one}" for one in found.sentences)


def _plain(columns: Columns) -> dict[str, dict[str, int]]:
    return {name: dict(own) for name, own in columns.items()}


def find_misplaced(points: Array, columns: Columns, skeleton: Skeleton) -> Misplaced:
    """Compare the markers of one subject with how bodies move and are made.

    First left and right. Then rigidity: markers that move with another segment than theirs. Then, with that put right,
    what needs no movement: order along limbs, front and back. Then whether the body as a whole is mirrored.

    Args:
        points: of the clip, (frames, all markers, 3), metres, NaN = missing.
        columns: segment → marker → its column.
        skeleton: the figure.
    """
    return judged(Rigidity(points, columns, skeleton, ENOUGH)).misplaced


@dataclass(frozen=True, eq=False)
class Judged:
    """What rigidity and the body's order say of every marker, by its place in `Rigidity.names`.

    Attributes:
        partner: exchanged markers, both ways.
        moved: markers of another segment.
        misplaced: the same in words.
    """

    partner: dict[int, int]
    moved: set[int]
    misplaced: Misplaced


def judged(figure: Rigidity) -> Judged:
    """Find the exchanges; the figure's own `segment` is put right.

    Args:
        figure: the markers of one subject, just measured.
    """
    names = [name for name, _ in figure.names]
    at = {name: m for m, name in enumerate(names)}
    tracks = {name: figure.points[:, m] for name, m in at.items()}

    def put(first: str, second: str) -> None:
        tracks[first], tracks[second] = tracks[second], tracks[first]

    def broken(m: int, n: int) -> int:
        return disorder({**tracks, names[m]: tracks[names[n]], names[n]: tracks[names[m]]})

    partner: dict[int, int] = {}
    sentences = []

    def put_right(found: Iterable[Exchange]) -> None:
        for one in found:
            pairs = [(at[first], at[second]) for first, second in one.pairs]
            if any(m in partner for pair in pairs for m in pair):
                continue
            sentences.append(_sentence(one))
            for m, n in pairs:
                put(names[m], names[n])
                figure.segment[[m, n]] = figure.segment[[n, m]]
                partner.update({m: n, n: m})

    # Sides first: where those of a whole part are exchanged, what it is joined to would look exchanged.
    put_right(sides(tracks, figure.sides()))
    before = figure.fit(figure.segment)
    firmer = figure.exchange(broken, partner)
    partner |= firmer
    for m, n in firmer.items():
        if m < n:
            put(names[m], names[n])
            sentences.append(_moves(figure, m, n, before))
    put_right(exchanged(tracks))
    put_right(turned_head(tracks))
    moved = figure.move(partner)
    certain = {
        m
        for m in moved
        if not figure.joined[figure.segment[m], figure.given[m]] or before[m] > GIRDLE
    }
    for m in sorted(certain):
        away, own = figure.segments[figure.segment[m]], figure.segments[figure.given[m]]
        sentences.append(f"{names[m]} looks wrongly assigned: it moves with {away}, not {own}")
    wrong = sorted({*partner, *certain})
    segment = {names[m]: figure.segments[figure.given[m]] for m in wrong}
    return Judged(partner, moved, Misplaced(segment, tuple(sentences), mirrored(tracks)))


def _moves(figure: Rigidity, m: int, n: int, before: Array) -> str:
    first, second = figure.names[m][0], figure.names[n][0]
    after = figure.fit(figure.segment)
    m = max(m, n, key=lambda k: float(before[k]) / max(float(after[k]), 1e-9))
    return (
        f"{first} and {second} look exchanged: {figure.names[m][0]} keeps its distance to "
        f"{figure.segments[figure.segment[m]]} within {1e3 * after[m]:.1f} mm, to "
        f"{figure.segments[figure.given[m]]} within {1e3 * before[m]:.0f} mm"
    )


def _sentence(one: Exchange) -> str:
    if one.part:
        pairs = listed([f"{first}/{second}" for first, second in one.pairs], 4)
        return f"left and right of {one.part} look exchanged ({pairs}): {one.evidence}"
    first, second = one.pairs[0]
    return f"{first} and {second} look exchanged: {one.evidence}"

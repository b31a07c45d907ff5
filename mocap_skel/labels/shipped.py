"""Which of the shipped association files has a clip's labels."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from mocap_skel.clip import Clip
from mocap_skel.figure.skeleton import LEAST_ON_ROOT
from mocap_skel.labels.association import SHIPPED, Association, Rule, read_association
from mocap_skel.labels.guess.motion import Verdict, weigh
from mocap_skel.labels.guess.names import HIGH, NameGuess
from mocap_skel.labels.guess.rigid import MOST, distances, most_seen


@dataclass(frozen=True)
class Match:
    """How well an association file and a clip's labels go together.

    Attributes:
        name: of the shipped file, as `--assoc` takes it.
        association: what it says.
        labels: how many labels of the clip, seen in it, it gives a marker.
        share: of its own lines, those whose label the clip has, 0 to 1.
        on_root: how many of those labels are markers of its figure's root.
    """

    name: str
    association: Association
    labels: int
    share: float
    on_root: int

    @property
    def usable(self) -> bool:
        """Whether a fit has a place to start at."""
        return self.on_root >= LEAST_ON_ROOT


def match(name: str, clip: Clip, association: Association, subject: str | None = None) -> Match:
    """Count what an association file and a clip, or one subject of it, have in common.

    >>> from mocap_skel import read_clip
    >>> clip = read_clip("sample_data/range_of_motion.c3d")
    >>> match("cmu", clip, read_association("cmu")).labels
    41
    """
    found = seen_rules(clip, association, subject)
    root = association.skeleton.root.name
    return Match(
        name,
        association,
        len(found),
        len(found) / max(len(association.rules), 1),
        sum(rule.segment == root for rule in found),
    )


def seen_rules(clip: Clip, association: Association, subject: str | None = None) -> list[Rule]:
    """The lines of an association whose labels a clip, or one subject of it, has and shows.

    >>> from mocap_skel import read_clip
    >>> len(seen_rules(read_clip("sample_data/range_of_motion.c3d"), read_association("cmu")))
    41
    """
    there: NDArray[np.bool_] = np.asarray(np.isfinite(clip.points[..., 0]).any(axis=0))
    seen = {
        label
        for i, (label, whose) in enumerate(zip(clip.labels, clip.subjects, strict=True))
        if there[i] and subject in (None, whose)
    }
    return [rule for rule in association.rules if rule.label.rpartition(":")[2] in seen]


def best_match(clip: Clip, subject: str | None = None) -> Match | None:
    """The shipped file that has most of a clip's labels and can be fitted; None if there is none.

    >>> from mocap_skel import read_clip
    >>> best_match(read_clip("sample_data/range_of_motion.c3d")).name
    'cmu'
    """
    found = [match(name, clip, one, subject) for name, one in _all().items()]
    usable = [one for one in found if one.usable]
    return max(usable, key=lambda one: (one.labels, one.share), default=None)


def judged(clip: Clip, association: Association, subject: str | None = None) -> list[Verdict]:
    """What the movement says of the markers of an association, of the `MOST` of a subject that are seen longest."""
    rule_of = {rule.label: rule for rule in association.rules}
    found: list[Verdict] = []
    for name in clip.subject_names:
        own = [
            i
            for i, whose in enumerate(clip.subjects)
            if whose == name and subject in (None, name) and clip.labels[i] in rule_of
        ]
        if len(own) > MOST:
            own = [own[k] for k in most_seen(clip.points[:, own], np.zeros(len(own), dtype=bool))]
        if own:
            rules = [rule_of[clip.labels[i]] for i in own]
            guesses = [NameGuess(r.label, r.segment, r.marker, HIGH, "") for r in rules]
            apart = distances(clip.points[:, own])
            found += weigh(guesses, apart, association.skeleton, clip.frames)
    return found


@cache
def _all() -> dict[str, Association]:
    return {path.stem: read_association(path.stem) for path in sorted(SHIPPED.glob("*.txt"))}

"""The labels of a calibration: markers are named in the next clip as they were in the clips that it was made of."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mocap_skel.errors import CallError, SkeletonError
from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.joints.calibration import Calibration, Labels
from mocap_skel.labels.association import Association, Rule
from mocap_skel.text import listed


def labels_of(associations: Sequence[Association]) -> tuple[Labels, tuple[str, ...]]:
    """What the associations of several clips say together, the first one first; and a note on what contradicts it.

    Args:
        associations: one a clip, all of the same figure.

    >>> from mocap_skel import read_association
    >>> labels, notes = labels_of([read_association("cmu")])
    >>> labels.figure, labels.markers["LKNE"], notes
    ('human', ('LKNE', 'UpperLeftLeg'), ())
    """
    first = associations[0]
    markers: dict[str, tuple[str, str]] = {}
    ignored: dict[str, None] = {}
    against: dict[str, None] = {}
    for association in associations:
        label_of = {marker: label for label, (marker, _) in markers.items()}
        for rule in association.rules:
            named = rule.marker, rule.segment
            free = label_of.get(rule.marker, rule.label) == rule.label
            if not free or markers.setdefault(rule.label, named) != named:
                against[rule.label] = None
        ignored |= dict.fromkeys(association.ignored)
    for label in markers:
        ignored.pop(label, None)
    notes: tuple[str, ...] = ()
    if against:
        notes = (
            f"labels that are not the same marker in all clips: {listed(against)}; the calibration has those of "
            "the first: --assoc names them alike",
        )
    return Labels(Path(first.path).name, first.figure, markers, tuple(ignored)), notes


def association_of(
    calibration: Calibration, path: Path, skeleton: str | None = None
) -> Association:
    """The association that a calibration was made with, for a call that names none.

    Args:
        calibration: what `read_calibration` gave.
        path: its file, for messages.
        skeleton: the figure that the call asks for, a name or a file; None = the calibration's own.

    Raises:
        CallError: the calibration does not say which label is which marker, or its skeleton file is not there.
    """
    labels = calibration.labels
    if labels is None or not labels.markers:
        raise CallError(
            f"{path}: does not say which label is which marker",
            "give --calibration together with the --assoc that it was made with",
        )
    try:
        figure = read_skeleton(skeleton or labels.figure)
    except SkeletonError as error:
        raise CallError(
            f"{path}: its skeleton {labels.figure!r}, named in {labels.source}, cannot be read: {error.message}",
            f"give --assoc with {labels.source}, or --skeleton with that file",
        ) from error
    segments = {segment.name for segment in figure.segments}
    rules = tuple(
        Rule(label, marker, segment, 0)
        for label, (marker, segment) in labels.markers.items()
        if segment in segments
    )
    return Association(str(path), figure, rules, labels.ignored, skeleton or labels.figure)

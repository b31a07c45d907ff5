"""The clips of a folder and the association file that each deserves; no clip is named anywhere."""

from __future__ import annotations

from collections.abc import Iterator
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from mocap_skel.clip import Clip
from mocap_skel.errors import MocapSkelError
from mocap_skel.labels.association import (
    SHIPPED,
    Assignment,
    Association,
    associate,
    read_association,
)
from mocap_skel.labels.guess import guess_association

GUESS = "guess"
# Share of the labels that may be markers which a shipped file has to know.
LEAST_KNOWN = 0.5
# Markers that a root's pose needs.
ON_ROOT = 3


def clips_in(folder: Path) -> list[Path]:
    """All C3D files below a folder, or the one file."""
    if folder.is_file():
        return [folder]
    return sorted(p for p in folder.rglob("*") if p.suffix.lower() == ".c3d" and p.is_file())


def choose(clip: Clip, wanted: str | None = None) -> tuple[Association, tuple[Assignment, ...]]:
    """The association that places most markers, with the fewest that are missing; the guess where none fits.

    Args:
        clip: the recording, without what the fit must not see.
        wanted: a file, a shipped one by name, or "guess"; the best if None.

    Raises:
        MocapSkelError: nothing fits, or the wanted one does not.
    """
    if wanted == GUESS:
        return _guessed(clip)
    if wanted is not None:
        known = read_association(wanted)
        return known, associate(clip, known)
    best: tuple[tuple[int, int], Association, tuple[Assignment, ...]] | None = None
    for known, found in _candidates(clip):
        placed = sum(len(_seen(clip, one)) for one in found)
        score = (placed, -sum(len(one.absent) for one in found))
        if best is None or score > best[0]:
            best = (score, known, found)
    if best is not None and best[0][0] >= LEAST_KNOWN * _may_be(clip, best[1]):
        return best[1], best[2]
    try:
        return _guessed(clip)
    except MocapSkelError:
        if best is None:
            raise
        return best[1], best[2]


def _guessed(clip: Clip) -> tuple[Association, tuple[Assignment, ...]]:
    known = guess_association(clip).association()
    return known, associate(clip, known)


def _candidates(clip: Clip) -> Iterator[tuple[Association, tuple[Assignment, ...]]]:
    for path in sorted(SHIPPED.glob("*.txt")):
        try:
            known = read_association(path)
            found = tuple(
                one
                for one in associate(clip, known)
                if len(_on_root(clip, one, known.skeleton.root.name)) >= ON_ROOT
            )
        except MocapSkelError:
            continue
        if found:
            yield known, found


def _seen(clip: Clip, one: Assignment) -> list[int]:
    return [
        column
        for columns in one.columns.values()
        for column in columns.values()
        if np.isfinite(clip.points[:, column, 0]).any()
    ]


def _on_root(clip: Clip, one: Assignment, root: str) -> list[int]:
    columns = set(one.columns.get(root, {}).values())
    return [column for column in _seen(clip, one) if column in columns]


def _may_be(clip: Clip, known: Association) -> int:
    there = clip.missing() < 1
    return sum(
        bool(there[i]) and not any(fnmatchcase(label, p) for p in known.ignored)
        for i, label in enumerate(clip.labels)
    )

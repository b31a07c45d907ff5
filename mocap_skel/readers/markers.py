"""Which points of a file are markers, whose they are, and what they are called."""

from __future__ import annotations

import re
from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

from mocap_skel.readers.raw import RawClip
from mocap_skel.readers.unlabelled import unlabelled
from mocap_skel.text import listed, printable

# No "Angle" on its own: the scapula's inferior angle is a place for a marker.
_MODEL_NAME = re.compile(
    r"(Angles|(Ankle|Knee|Hip|Pelvis|Progression)Angle|Forces?|Moments?|Powers?|GRF)\d*$"
)
# The ends of a segment's axes are called by their axis; the origin first.
_BONE_ENDS, _AXIS_ENDS = "OALP", "XYZ"
_AXIS_TIP = re.compile(r"(.+?)[ _.-]?([XYZ])$", re.I)
_ORIGINS = ("", "O", "ORIGIN", "ORG", "0")
# Of the side of three axis tips, which 16-bit coordinates leave to a few per cent.
_EQUAL = 0.03
UNLABELLED = "unlabelled"
"""Why a trajectory that nobody has named is no marker: the key in `Clip.left_out`."""
# Fewer points without a name show no figure.
_LEAST_OF_A_FIGURE = 3


def names_and_subjects(raw: RawClip) -> tuple[list[str], list[str]]:
    """A name, "" where there is none, and a subject for every point, as the file has them."""
    count = raw.points.shape[1]
    found = [*raw.labels[:count], *[""] * (count - len(raw.labels))]
    names, subjects = [], []
    for text in found:
        subject, _, name = printable(text).rpartition(":")
        names.append(name.strip())
        subjects.append(subject.strip())
    return names, subjects


def markers(
    names: list[str], subjects: list[str], raw: RawClip
) -> tuple[NDArray[np.int64], dict[str, tuple[str, ...]]]:
    """Which points are markers, and the names of the others by the reason why not.

    Left out are trajectories that nobody has named (`*12`, `Unlabeled 12`), points in a list of model
    outputs or with the name of one, the bones of Plug-in Gait, the tips of a segment's axes, and what an
    earlier fit has written into the file. Where nothing has a name, three such trajectories and more are
    markers.
    """
    bones = _bones(names, subjects, raw.points) | _axis_tips(names, subjects, raw.points)
    keep: list[int] = []
    nameless: list[int] = []
    out: dict[str, list[str]] = defaultdict(list)
    for i, (name, subject) in enumerate(zip(names, subjects, strict=True)):
        by_list = name in raw.computed or f"{subject}:{name}" in raw.computed
        if unlabelled(name, subject):
            nameless.append(i)
            out[UNLABELLED].append(name)
        elif (f"{subject}:{name}" if subject else name) in raw.earlier:
            out["joint centres of an earlier fit"].append(name)
        elif by_list or i in bones or _MODEL_NAME.search(name):
            out["model output"].append(name)
        else:
            keep.append(i)
    if not keep and len(out[UNLABELLED]) >= _LEAST_OF_A_FIGURE:
        keep = nameless
        del out[UNLABELLED]
    left_out = {reason: tuple(found) for reason, found in out.items() if found}
    return np.array(keep, dtype=np.int64), left_out


def told_apart(
    names: list[str], subjects: list[str], places: NDArray[np.int64], notes: list[str]
) -> list[str]:
    """The markers' labels: blanks and doubles get one that no other marker of the subject has.

    Args:
        names: the markers', with blanks and doubles.
        subjects: the markers'.
        places: the markers' places in the file, from 0.
        notes: takes a sentence where a label is not the file's own.
    """
    given = set(zip(subjects, names, strict=True))
    taken: set[tuple[str, str]] = set()
    numbers: dict[tuple[str, str], int] = defaultdict(lambda: 2)
    labels: list[str] = []
    doubled: list[str] = []
    for name, subject, place in zip(names, subjects, places, strict=True):
        label = stem = name or f"point_{place + 1}"
        again = (subject, label) in taken or (not name and (subject, label) in given)
        if again and name:
            doubled.append(name)
        while again:
            label = f"{stem}_{numbers[subject, stem]}"
            numbers[subject, stem] += 1
            again = (subject, label) in given or (subject, label) in taken
        taken.add((subject, label))
        labels.append(label)
    if blank := names.count(""):
        notes.append(f"points without a label: {blank}; called point_N by their place in the file")
    if doubled:
        which = listed(dict.fromkeys(doubled))
        notes.append(f"labels that stand more than once are told apart as NAME_2, …: {which}")
    return labels


def doubles(names: list[str], subjects: list[str]) -> tuple[tuple[int, ...], ...]:
    """The places of markers that have the same name and subject, the first of each and its copies."""
    at: dict[tuple[str, str], list[int]] = defaultdict(list)
    for i, key in enumerate(zip(subjects, names, strict=True)):
        at[key].append(i)
    return tuple(tuple(same) for (_, name), same in at.items() if name and len(same) > 1)


def _bones(names: list[str], subjects: list[str], points: NDArray[np.float64]) -> set[int]:
    """Plug-in Gait's bones, which no list names: origin LFEO, ends of three axes LFEA, LFEL, LFEP."""
    stems: dict[tuple[str, str], dict[str, int]] = defaultdict(dict)
    for i, (name, subject) in enumerate(zip(names, subjects, strict=True)):
        if len(name) > 1 and name[-1] in _BONE_ENDS:
            stems[subject, name[:-1]][name[-1]] = i
    bones: set[int] = set()
    for ends in stems.values():
        if len(ends) == len(_BONE_ENDS) and _axes(points[:, [ends[end] for end in _BONE_ENDS]]):
            bones.update(ends.values())
    return bones


def _axis_tips(names: list[str], subjects: list[str], points: NDArray[np.float64]) -> set[int]:
    """The tips of segments' axes, PELVIS_X, PELVIS_Y and PELVIS_Z, with their origin if it has a name of theirs."""
    stems: dict[tuple[str, str], dict[str, int]] = defaultdict(dict)
    for i, (name, subject) in enumerate(zip(names, subjects, strict=True)):
        if found := _AXIS_TIP.fullmatch(name):
            stems[subject, _plain(found[1])][found[2].upper()] = i
    whole = {key: ends for key, ends in stems.items() if len(ends) == len(_AXIS_ENDS)}
    if not whole:
        return set()
    at = {(s, _plain(name)): i for i, (name, s) in enumerate(zip(names, subjects, strict=True))}
    tips: set[int] = set()
    for (subject, stem), ends in whole.items():
        three = [ends[end] for end in _AXIS_ENDS]
        origins = [at[subject, stem + o] for o in _ORIGINS if (subject, stem + o) in at]
        # At right angles and of one length from an origin, the tips are as far from each other.
        found_origin = next((o for o in origins if _axes(points[:, [o, *three]])), None)
        if found_origin is not None:
            tips.update([found_origin, *three])
        elif _equal_sides(points[:, three]):
            tips.update(three)
    return tips


def _plain(name: str) -> str:
    return re.sub(r"[^A-Z0-9]", "", name.upper())


def _equal_sides(three: NDArray[np.float64]) -> bool:
    """Whether three points are equally far from each other in nearly all frames, as no markers on skin are."""
    sides = np.stack([np.linalg.norm(three[:, i] - three[:, i - 1], axis=1) for i in range(3)])
    mean = sides.mean(axis=0)
    seen = mean > 0
    off = np.abs(sides[:, seen] / mean[seen] - 1).max(axis=0)
    return bool(2 * (off < _EQUAL).sum() >= len(off))


def _axes(four: NDArray[np.float64]) -> bool:
    """Whether the last three points, seen from the first, are equally long and at right angles.

    Files with 16-bit coordinates have it to a few per cent, and markers on skin never. Points that
    are missing throughout are nobody's loss.
    """
    arms = four[:, 1:] - four[:, :1]
    products = arms @ arms.swapaxes(1, 2)
    square = products.trace(axis1=1, axis2=2) / 3
    seen = square > 0
    off = np.abs(products[seen] / square[seen, None, None] - np.eye(3)).max(axis=(1, 2))
    return bool(2 * (off < 0.1).sum() >= len(off))

"""References for a clip's joints, found by themselves: bones that were seen or ASF/AMC beside it, labels inside it."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mocap_skel.clip import Clip
from mocap_skel.errors import MocapSkelError
from validation.asf_amc import LENGTHS, AcclaimError, beside, joint_tracks, read_amc, read_asf
from validation.points import all_points

Array = NDArray[np.float64]
TRUTH, ASF, FUNCTIONAL, MIDPOINT, CENTRE, BONES, SHARED = KINDS = (
    "bone seen", "ASF/AMC", "functional", "midpoint", "centre label", "PiG bone", "shared midpoint",
)  # fmt: skip
"""Of several references for one joint the first kind counts; a shared midpoint never does."""
# Metres between the two sides of a joint, from a child's wrist to a stout knee with its markers.
SIDES = (0.03, 0.20)


@dataclass(frozen=True, eq=False)
class Reference:
    """Where somebody else says that a joint is.

    Attributes:
        subject, joint: whose.
        kind: one of `KINDS`.
        source: the labels or files.
        track: (frames, 3) in the lab, metres, NaN = not known.
        counts: whether it is the best for its joint, and independent of the fit.
    """

    subject: str
    joint: str
    kind: str
    source: str
    track: Array
    counts: bool = False


@dataclass(frozen=True, eq=False)
class References:
    """All that is known of one clip.

    Attributes:
        found: the references.
        lengths: bone → metres, of the studio's skeleton.
        withheld: (subject, label) of what the fit must not see.
        notes: one sentence each.
    """

    found: tuple[Reference, ...]
    lengths: Mapping[str, float]
    withheld: frozenset[tuple[str, str]]
    notes: tuple[str, ...]


def find_references(path: Path, clip: Clip) -> References:
    """Look beside and inside a clip for joint centres."""
    notes: list[str] = []
    withheld: set[tuple[str, str]] = set()
    found: list[Reference] = []
    try:
        points = all_points(path, clip)
    except MocapSkelError as error:
        notes.append(f"model outputs not read: {error}")
        points = {
            key: clip.points[:, i]
            for i, key in enumerate(zip(clip.subjects, clip.labels, strict=True))
            if np.isfinite(clip.points[:, i, 0]).any()
        }
    for subject in dict.fromkeys(whose for whose, _ in points):
        own = {label: track for (whose, label), track in points.items() if whose == subject}
        found += _computed(subject, own)
        pairs, medial = _midpoints(subject, own)
        found += pairs
        withheld |= {(subject, label) for label in medial}
    withheld |= {
        key
        for key in zip(clip.subjects, clip.labels, strict=True)
        if _is_computed(key[1], {label for whose, label in points if whose == key[0]})
    }
    seen = path.with_name(f"{path.stem}.truth.csv")
    if seen.exists():
        found += _bones(seen, clip)
    lengths: dict[str, float] = {}
    files = beside(path)
    if files is not None:
        try:
            tracks, lengths = _studio(*files, clip)
            source = f"{files[0].name} + {files[1].name}"
            found += [Reference("*", j, ASF, source, t) for j, t in tracks.items()]
        except (AcclaimError, KeyError, IndexError) as error:
            notes.append(f"skeleton beside it not read: {error}")
    return References(tuple(found), lengths, frozenset(withheld), tuple(notes))


def _bones(path: Path, clip: Clip) -> list[Reference]:
    """Joints of bones that were seen, by pins or X-rays: rows of frame, joint, x, y, z in metres."""
    table = pd.read_csv(path)
    if list(table.columns) != ["frame", "joint", "x", "y", "z"]:
        return []
    found = []
    for joint, rows in table.groupby("joint"):
        track = np.full((clip.frames, 3), np.nan)
        at = rows["frame"].to_numpy() - clip.first_frame
        here = (at >= 0) & (at < clip.frames)
        track[at[here]] = rows[["x", "y", "z"]].to_numpy()[here]
        found.append(Reference("*", str(joint), TRUTH, path.name, track))
    return found


def without(clip: Clip, withheld: Iterable[tuple[str, str]]) -> Clip:
    """The clip without some (subject, label): the fit cannot use what it does not have."""
    gone = set(withheld)
    keep = [i for i, k in enumerate(zip(clip.subjects, clip.labels, strict=True)) if k not in gone]
    return replace(
        clip,
        points=clip.points[:, keep],
        labels=tuple(clip.labels[i] for i in keep),
        subjects=tuple(clip.subjects[i] for i in keep),
    )


def ranked(found: Iterable[Reference]) -> list[Reference]:
    """One subject's references, the best of each joint marked as the one that counts."""
    ordered = sorted(found, key=lambda r: KINDS.index(r.kind))
    best: set[str] = set()
    out = []
    for one in ordered:
        out.append(replace(one, counts=one.kind != SHARED and one.joint not in best))
        best.add(one.joint)
    return out


@cache
def _table() -> dict[str, Any]:
    return tomllib.loads((Path(__file__).parent / "landmarks.toml").read_text(encoding="utf-8"))


def sided(label: str) -> list[tuple[str, str]]:
    """(side, stem) that a label may be: "L.Knee_Med" is Left, KNEEMED."""
    plain = re.sub(r"[^A-Z0-9]", "", label.upper())
    found = []
    for word, side in (("LEFT", "Left"), ("RIGHT", "Right"), ("L", "Left"), ("R", "Right")):
        if plain.startswith(word) and len(plain) > len(word):
            found.append((side, plain[len(word) :]))
    return found


def _stems(labels: Iterable[str]) -> dict[tuple[str, str], str]:
    found: dict[tuple[str, str], str] = {}
    for label in labels:
        for key in sided(label):
            found.setdefault(key, label)
    return found


def _computed(subject: str, points: Mapping[str, Array]) -> list[Reference]:
    found = []
    stems = _stems(points)
    functional = _table()["functional"]
    for side in ("Left", "Right"):
        for row in _table()["joint"]:
            joint = f"{side}{row['name']}"
            labels = [stems[side, c] for c in row["centre"] if (side, c) in stems]
            if labels:
                found.append(Reference(subject, joint, CENTRE, labels[0], points[labels[0]]))
            labels = [
                stems[side, c + f]
                for c in row["centre"]
                for f in functional
                if (side, c + f) in stems
            ]
            if labels:
                tracks = np.stack([points[label] for label in labels])
                # Only where all of them are: their mean would jump else.
                mean = tracks.mean(axis=0)
                found.append(Reference(subject, joint, FUNCTIONAL, ", ".join(labels), mean))
            for code in row["bones"]:
                if (side, code) in stems and all((side, w) in stems for w in row["with"]):
                    label = stems[side, code]
                    found.append(Reference(subject, joint, BONES, label, points[label]))
    return found


def _is_computed(label: str, labels: set[str]) -> bool:
    """Whether a label is somebody's joint centre, of whatever method, known to us or not."""
    for side, stem in sided(label):
        for row in _table()["joint"]:
            if any(stem.startswith(c) for c in row["centre"]):
                return True
            if stem in row["bones"]:
                stems = _stems(labels)
                if all((side, w) in stems for w in row["with"]):
                    return True
    return False


def _midpoints(subject: str, points: Mapping[str, Array]) -> tuple[list[Reference], list[str]]:
    """Midpoints of two sides of a joint, and the medial labels that the fit has to do without."""
    found, withheld = [], []
    stems = _stems(points)
    for side in ("Left", "Right"):
        for row in _table()["joint"]:
            for lateral, medial in _pairs(row, side, stems):
                width = np.linalg.norm(points[lateral] - points[medial], axis=1)
                if not np.isfinite(width).any() or not SIDES[0] < np.nanmedian(width) < SIDES[1]:
                    continue
                shared = bool(row.get("shared"))
                middle = 0.5 * (points[lateral] + points[medial])
                kind = SHARED if shared else MIDPOINT
                found.append(
                    Reference(subject, f"{side}{row['name']}", kind, f"{lateral}, {medial}", middle)
                )
                withheld += [] if shared else [medial]
                break
    return found, withheld


def _pairs(
    row: Mapping[str, Any], side: str, stems: Mapping[tuple[str, str], str]
) -> list[tuple[str, str]]:
    here = [
        [stems[side, code] for code in row.get(kind, []) if (side, code) in stems]
        for kind in ("lateral", "medial")
    ]
    return [(a, b) for a in here[0] for b in here[1] if a != b]


def _studio(asf: Path, amc: Path, clip: Clip) -> tuple[dict[str, Array], dict[str, float]]:
    """Tracks (frames, 3) of the studio's joints in the clip's frames, and its bones' lengths."""
    skeleton = read_asf(asf)
    tracks = joint_tracks(skeleton, read_amc(amc))
    lengths = {k: skeleton.length(b) for k, b in LENGTHS.items() if b in skeleton.bones}
    count = len(next(iter(tracks.values())))
    # A take may be filmed at twice the rate that its skeleton is stored with, or the other way round.
    up, down = round(clip.frames / count), round(count / clip.frames)
    placed = {}
    for joint, track in tracks.items():
        out = np.full((clip.frames, 3), np.nan)
        if up >= 2:
            out[::up] = _cut(track, len(out[::up]))
        else:
            some = track[:: max(down, 1)]
            out[: len(some)] = some[: clip.frames]
        placed[joint] = out
    return placed, lengths


def _cut(track: Array, size: int) -> Array:
    out = np.full((size, 3), np.nan)
    out[: len(track)] = track[:size]
    return out

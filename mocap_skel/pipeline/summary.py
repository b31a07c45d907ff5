"""What a batch shows as a whole, made of its manifest: one row a clip, and one row a joint over all clips."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from mocap_skel.pipeline.manifest import WITH_RESULTS

SHOWN = ("yes", "weak", "no")
CLIP_COLUMNS = (
    "clip", "name", "status", "reason", "seconds", *SHOWN, "notes", "files", "sha256", "options",
)  # fmt: skip
_MEASURED = ("bone", "x", "y", "z")
# A name like 07_12, the 12th trial of subject 07, as the CMU database has them.
_TRIAL = re.compile(r"(\d+)_\d+")


def clip_row(line: Mapping[str, Any]) -> dict[str, Any]:
    """A line of the manifest as a row of manifest.csv: lists in one cell, joints counted by what is shown."""
    shown = Counter(joint["shown"] for joint in line["joints"])
    told = {
        **line,
        **{word: shown[word] for word in SHOWN},
        "notes": " | ".join(line["notes"]),
        "files": " | ".join(line["files"]),
        "options": json.dumps(line["options"]),
    }
    return {name: told[name] for name in CLIP_COLUMNS}


@dataclass
class _Running:
    """Count, mean and sum of squared deviations, value by value (Welford 1962)."""

    count: int = 0
    mean: float = 0.0
    squares: float = 0.0

    def add(self, value: float) -> None:
        self.count += 1
        away = value - self.mean
        self.mean += away / self.count
        self.squares += away * (value - self.mean)

    @property
    def sd(self) -> float | None:
        return math.sqrt(self.squares / (self.count - 1)) if self.count > 1 else None


@dataclass
class _Joint:
    """A joint of one actor over all clips."""

    shown: Counter[str] = field(default_factory=Counter)
    measured: dict[str, _Running] = field(
        default_factory=lambda: {n: _Running() for n in _MEASURED}
    )

    def add(self, row: Mapping[str, Any]) -> None:
        self.shown[row["shown"]] += 1
        for name, running in self.measured.items():
            if row[name] is not None:
                running.add(row[name])


def summary(lines: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """One row a joint over all clips with results, then one for each actor, where names tell who that is.

    Args:
        lines: of a manifest.

    Returns:
        Rows with the columns actor ("" = all clips), joint, clips; yes, weak and no, the shares of the clips whose movement shows it
        so; then mean and standard deviation over the clips of the bone's length and of x, y, z, the joint's place in
        its parent's frame, metres; None = there is none.
    """
    found: dict[tuple[str, str], _Joint] = {}
    for line in lines:
        if line["status"] not in WITH_RESULTS:
            continue
        for row in line["joints"]:
            for actor in {"", actor_of(line["name"], row["subject"])}:
                found.setdefault((actor, row["joint"]), _Joint()).add(row)
    # Joints stay in the order of the figure.
    ordered = sorted(found.items(), key=lambda item: item[0][0])
    return [{"actor": actor, "joint": name, **_columns(joint)} for (actor, name), joint in ordered]


def _columns(joint: _Joint) -> dict[str, Any]:
    clips = joint.shown.total()
    columns: dict[str, Any] = {"clips": clips}
    columns |= {word: round(joint.shown[word] / clips, 4) for word in SHOWN}
    for name, running in joint.measured.items():
        columns[f"{name}_mean"] = round(running.mean, 6) if running.count else None
        columns[f"{name}_sd"] = None if running.sd is None else round(running.sd, 6)
    return columns


def actor_of(name: str, subject: str) -> str:
    """Whom a clip shows, as far as names tell; "" where they do not.

    Args:
        name: of the clip, below the root of the batch.
        subject: as the clip has it.

    >>> actor_of("walk", "Anna"), actor_of("anna/monday/walk", ""), actor_of("07_12", ""), actor_of("walk", "")
    ('Anna', 'anna', '07', '')
    """
    if subject:
        return subject
    folder, below, _ = name.partition("/")
    if below:
        return folder
    trial = _TRIAL.fullmatch(name)
    return trial[1] if trial else ""


def in_words(rows: Iterable[Mapping[str, Any]]) -> Iterator[tuple[str, ...]]:
    """The rows of all clips together as people read them: per cent, and lengths in centimetres."""
    for row in rows:
        if not row["actor"]:
            shares = (f"{100 * row[word]:.0f}" for word in SHOWN)
            lengths = (_cm(row["bone_mean"]), _cm(row["bone_sd"]))
            yield row["joint"], str(row["clips"]), *shares, *lengths


HEAD = ("joint", "clips", "yes %", "weak %", "no %", "bone cm", "sd cm")


def _cm(metres: float | None) -> str:
    return "-" if metres is None else f"{100 * metres:.2f}"

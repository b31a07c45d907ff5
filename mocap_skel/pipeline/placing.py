"""Putting a clip's results into their places together with its line of the manifest, so that a kill in between is seen."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from shutil import rmtree
from typing import Any

from mocap_skel.errors import OutputError, ours
from mocap_skel.export.files import identity, put_all
from mocap_skel.export.interrupts import interrupts_held
from mocap_skel.pipeline.manifest import BROKEN, Manifest, check_line, check_names

# How the folder is called where results wait, and the file in it that says what is being put into its place.
STAGE = ".batch-"
_MOVING = "moving.json"


def sizes(parts: Mapping[Path, Path], folder: Path) -> dict[str, int]:
    """Result file, from a folder on → its bytes, of files that wait to be put.

    Raises:
        OutputError: one is not where a worker says that it has left it.
    """
    found = {}
    for target, part in parts.items():
        try:
            found[target.relative_to(folder).as_posix()] = part.stat().st_size
        except OSError as error:
            raise OutputError(
                f"{part}: {error.strerror}: a result is not where it was left",
                "workers on other machines have to share the folder of the results",
            ) from error
    return found


def put_with_line(
    manifest: Manifest,
    stage: Path,
    parts: Mapping[Path, Path],
    line: Mapping[str, Any],
    overwrite: bool,
) -> None:
    """Put the results of a clip into their places and add its line, both or neither, and without an interrupt.

    Args:
        manifest: of the folder of results.
        stage: where the results wait.
        parts: result file → where it waits, in a folder of the clip's own.
        line: of the manifest.
        overwrite: whether existing files may be replaced.

    Raises:
        OutputError: a file exists or cannot be written, or the line cannot.
    """
    names = {target: target.relative_to(manifest.folder).as_posix() for target in parts}
    entry: dict[str, Any] = {
        "line": line,
        "new": [name for target, name in names.items() if not os.path.lexists(target)],
        "parts": {names[target]: str(part.relative_to(stage)) for target, part in parts.items()},
    }
    moving = stage / _MOVING
    with interrupts_held():
        with ours(moving, OutputError):
            moving.write_text(json.dumps(entry), encoding="utf-8")
        put_all(parts, overwrite)
        try:
            manifest.append(line)
        except OutputError:
            _take_away(manifest.folder, entry["new"])
            raise
        moving.unlink(missing_ok=True)
    for own in {part.parent for part in parts.values()}:
        rmtree(own, ignore_errors=True)


def clean_up(manifest: Manifest) -> None:
    """Take away what a batch left that was killed: what waited, and files that were put while no line told of them.

    Raises:
        OutputError: the manifest cannot be written.
    """
    for stage in sorted(manifest.folder.glob(f"{STAGE}*")):
        entry = _moving(stage)
        if entry is not None:
            _undo(manifest, stage, entry)
        rmtree(stage, ignore_errors=True)


def _moving(stage: Path) -> dict[str, Any] | None:
    """What was being put into its place; None for nothing, or nothing yet, or what no batch has written."""
    path = stage / _MOVING
    try:
        # Whatever lies there, it is in a folder that others may write to.
        if stage.is_symlink() or not path.is_file():
            return None
        entry = json.loads(path.read_text(encoding="utf-8"))
        check_line(entry["line"])
        check_names(entry["new"])
        check_names(entry["parts"])
        check_names(entry["parts"].values())
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None
    return dict(entry)


def _undo(manifest: Manifest, stage: Path, entry: Mapping[str, Any]) -> None:
    line = entry["line"]
    known = manifest.finished(line["name"])
    if known is not None and (known.sha256, known.options, known.files) == (
        line["sha256"], line["options"], line["files"],
    ):  # fmt: skip
        return
    put = [
        name
        for name, part in entry["parts"].items()
        if _is_put(manifest.folder / name, stage / part)
    ]
    if put:
        _take_away(manifest.folder, [name for name in put if name in entry["new"]])
        reason = "the program was ended while it put the results into their places"
        broken = {"status": BROKEN, "reason": reason, "files": {}, "joints": []}
        manifest.append({**line, **broken})


def _is_put(target: Path, part: Path) -> bool:
    """Whether a file was on its way to its place: gone from where it waited, there under both names, or announced."""
    if not part.exists():
        return True
    at = identity(target)
    return at is not None and (at == identity(part) or target.stat().st_size == 0)


def _take_away(folder: Path, names: list[str]) -> None:
    for name in names:
        (folder / name).unlink(missing_ok=True)

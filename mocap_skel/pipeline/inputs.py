"""Which clips a batch is about, and where the results of each belong: files, folders, patterns, or a list of them."""

from __future__ import annotations

import glob
import os
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from mocap_skel.errors import CallError
from mocap_skel.export.registry import formats as results_of
from mocap_skel.readers.registry import formats
from mocap_skel.text import counted, stem

STANDARD_INPUT = "-"
# Results, association files and lists have these suffixes, too.
_TABLES = (".csv", ".tsv", ".txt")
_PACKED = ".gz"


@dataclass(frozen=True)
class Place:
    """A clip of a batch.

    Attributes:
        path: its file, as the call leads to it.
        name: where it lies below the root of the batch, without its suffix: "monday/walk". Its results have the
            same name below the folder of the results.
    """

    path: Path
    name: str


def find_clips(
    inputs: Sequence[str],
    *,
    lines: Iterable[str] = (),
    root: Path | None = None,
    without: Path | None = None,
) -> list[Place]:
    """The clips that the inputs of a call name, each once, in their order.

    Args:
        inputs: files; folders, whose clips are found by their suffixes, also in folders below; patterns (`*`, `?`,
            `[...]`, `**` for any folders); `-` for `lines`.
        lines: names of files, folders and patterns.
        root: the folder below which all of them lie; None = the deepest one that they share.
        without: a folder whose files are no inputs: the results.

    Raises:
        CallError: a pattern or folder without a clip, a clip outside the root, or two that would write the same files.

    >>> [place.name for place in find_clips(["sample_data/nearly*.c3d", "sample_data/gaps.c3d"])]
    ['nearly_still', 'gaps']
    """
    named = [word for one in inputs for word in (lines if one == STANDARD_INPUT else [one])]
    found: dict[str, Path] = {}
    above: list[str] = []
    for word in named:
        paths, folder = _clips_of(word, without)
        above += [folder] if folder else [str(_absolute(path).parent) for path in paths]
        for path in paths:
            found.setdefault(str(_absolute(path)), path)
    if not found:
        raise CallError(
            "no clip is named", "give files, folders or patterns; - reads a list of them"
        )
    top = _root(above) if root is None else str(_absolute(root))
    return _placed(found, top)


def _clips_of(word: str, without: Path | None) -> tuple[list[Path], str]:
    """The files that an input names, and the folder that it is, if it is one.

    Raises:
        CallError: a pattern or a folder without a clip.
    """
    path = Path(word)
    # os.path, as Path's own questions raise an error for a name that is too long for the system.
    if os.path.isdir(word):
        clips = _below(path, without)
        if not clips:
            raise CallError(
                f"{path}: no clip in this folder, by the suffixes {', '.join(_suffixes())}"
            )
        return clips, str(_absolute(path))
    if os.path.exists(word) or not glob.has_magic(word):
        return [path], ""
    matching = (Path(one) for one in sorted(glob.glob(word, recursive=True)))
    clips = [one for one in matching if one.is_file() and not _inside(one, without)]
    if not clips:
        raise CallError(f"{word}: no file is named like this")
    return clips, ""


def _below(folder: Path, without: Path | None) -> list[Path]:
    suffixes, results = _suffixes(), tuple(s for one in results_of().values() for s in one.suffixes)
    found: list[Path] = []
    for place, folders, names in os.walk(folder):
        folders[:] = sorted(
            name for name in folders if name[0] != "." and not _same(Path(place, name), without)
        )
        found += [
            Path(place, name)
            for name in sorted(names)
            if name[0] != "."
            and name.lower().endswith(suffixes)
            and not name.lower().endswith(results)
        ]
    return found


def _suffixes() -> tuple[str, ...]:
    """Of files that are clips and nothing else; tables may be anything, and are named by a pattern."""
    plain = [s for entry in formats() for s in entry.suffixes if s not in (*_TABLES, _PACKED)]
    return tuple(plain + [f"{suffix}{_PACKED}" for suffix in plain])


def _inside(path: Path, folder: Path | None) -> bool:
    # A batch may have the folder of its clips as that of its results.
    return folder is not None and _absolute(folder) in _absolute(path).parents[1:]


def _same(path: Path, folder: Path | None) -> bool:
    return folder is not None and _absolute(path) == _absolute(folder)


def _root(above: Sequence[str]) -> str:
    try:
        return os.path.commonpath(above)
    except ValueError:
        raise CallError(
            "the clips lie on several disks", "name their --root, disk by disk"
        ) from None


def _placed(found: dict[str, Path], top: str) -> list[Place]:
    places: list[Place] = []
    seen: dict[str, Path] = {}
    double: list[str] = []
    for absolute, path in found.items():
        relative = os.path.relpath(absolute, top)
        if relative.split(os.sep)[0] == os.pardir:
            raise CallError(f"{path}: it does not lie below the --root, {top}")
        name = Path(relative).with_name(stem(path)).as_posix()
        if name in seen:
            double.append(f"{seen[name]} and {path}")
        seen[name] = path
        places.append(Place(path, name))
    if double:
        more = f" ({counted(len(double), 'such pair')})" if len(double) > 1 else ""
        raise CallError(f"{double[0]} would write the same files{more}", "name fewer, by a pattern")
    return places


def _absolute(path: Path) -> Path:
    # Links stay what they are called: results are named after the names of clips.
    return Path(os.path.abspath(path))


def names_from(stream: bytes) -> list[str]:
    r"""Names of a list: one a line, or each ended by a zero byte, as `find -print0` writes them.

    >>> names_from(bytes([97, 10, 10, 98, 32, 99, 10])), names_from(bytes([97, 10, 98, 0]))
    (['a', 'b c'], ['a\nb'])
    """
    parts = stream.split(b"\0") if b"\0" in stream else stream.splitlines()
    return [os.fsdecode(part) for part in parts if part.strip()]


def from_standard_input() -> list[str]:
    """Those of standard input."""
    return names_from(sys.stdin.buffer.read())

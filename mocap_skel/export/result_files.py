"""The result files of one fit: in which formats, and what they are called."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from mocap_skel.clip import Clip
from mocap_skel.export import WRITERS, Options
from mocap_skel.export.files import safe_name, write_all
from mocap_skel.skeleton_fit import SkeletonFit


def write_fit(
    fit: SkeletonFit,
    clip: Clip,
    folder: str | Path = ".",
    formats: str | Iterable[str] = "csv",
    *,
    overwrite: bool = False,
    **told: Any,
) -> tuple[Path, ...]:
    """Write a fit as `mocap-skel fit` does: each file whole, or none at all.

    Args:
        fit: the skeleton of one subject.
        clip: what it was fitted to, as `read_clip` gave it; the files are named after it.
        folder: where they go; it is made if it is not there.
        formats: one of `export.WRITERS`, or several.
        overwrite: whether existing files may be replaced.
        told: what the formats can be told, the fields of `export.Options`: up="y", axes=True ...

    Returns:
        The files.

    Raises:
        ValueError: no such format.
        ExportError: a format cannot hold this fit.
        OutputError: a file is there already, or cannot be written.
    """
    names = (formats,) if isinstance(formats, str) else tuple(dict.fromkeys(formats))
    for name in names:
        if name not in WRITERS:
            raise ValueError(f"formats must be of {tuple(WRITERS)}, got {name!r}")
    path = Path(clip.name)
    options = replace(Options(clip=clip, path=path), **told)
    stem = stem_of(path, clip, fit)
    contents = {
        Path(folder) / f"{stem}{suffix}": content
        for name in names
        for suffix, content in WRITERS[name](fit, options).files.items()
    }
    write_all(contents, overwrite)
    return tuple(contents)


def stem_of(path: Path, clip: Clip, fit: SkeletonFit) -> str:
    """What a fit's files are called before the suffix: the clip, and the subject where it has several."""
    several = len(clip.subject_names) > 1 and fit.subject
    return f"{path.stem}.{safe_name(fit.subject)}" if several else path.stem

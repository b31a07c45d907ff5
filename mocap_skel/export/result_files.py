"""The result files of one fit: what they are called, and all of them at once."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from mocap_skel.clip import Clip
from mocap_skel.export.files import safe_name, write_all
from mocap_skel.export.registry import Source, choose, told_of
from mocap_skel.skeleton_fit import SkeletonFit
from mocap_skel.text import stem
from mocap_skel.version import __version__


def write_fit(
    fit: SkeletonFit,
    clip: Clip,
    folder: str | Path = ".",
    formats: str | Iterable[str] = "csv",
    *,
    overwrite: bool = False,
    static: SkeletonFit | None = None,
    **told: Any,
) -> tuple[Path, ...]:
    """Write a fit as `mocap-skel fit` does: each file whole, or none at all.

    Args:
        fit: the skeleton of one subject.
        clip: what it was fitted to, as `read_clip` gave it; the files are named after it. It is never
            written over.
        folder: where they go; it is made if it is not there.
        formats: the name of a format, or several: csv, about, angles, bvh, c3d, events, glb, osim, parquet, trc.
        overwrite: whether existing files may be replaced.
        static: the same subject in a static clip, whose mean pose is neutral for angles.
        told: what the formats can be told, the fields of their options: up="y", axes=True ... Lengths are
            metres, `scale` is the units of the file in a metre. docs/commands/fit.md says what each does.

    Returns:
        The files.

    Raises:
        ValueError: no such format, or an option has none of its choices.
        TypeError: none of these formats has such an option.
        ExportError: a format cannot hold this fit.
        MissingExtraError: a format's library is not installed.
        OutputError: a file is there already, or cannot be written.

    >>> from tempfile import TemporaryDirectory
    >>> from mocap_skel import associate, fit_skeleton, read_association, read_clip, write_fit
    >>> clip, known = read_clip("sample_data/nearly_still.c3d"), read_association("cmu")
    >>> fit = fit_skeleton(clip, associate(clip, known)[0], known.skeleton)
    >>> with TemporaryDirectory() as folder:
    ...     [path.name for path in write_fit(fit, clip, folder, ["csv", "bvh"], trim=True)]
    ['nearly_still.skeleton.csv', 'nearly_still.joints.csv', 'nearly_still.bvh']
    """
    chosen = choose(formats, **told)
    path = Path(clip.name)
    made = {"version": __version__, "formats": told_of(chosen)}
    source = Source(clip, path, static=static, options=lambda: made)
    stem = stem_of(path, clip, fit.subject)
    contents = {
        Path(folder) / f"{stem}{suffix}": content
        for one in chosen
        for suffix, content in one.render(fit, source).files.items()
    }
    write_all(contents, overwrite, [path])
    return tuple(contents)


def stem_of(path: Path, clip: Clip, subject: str) -> str:
    """What a subject's files are called before the suffix: the clip, and the subject where it has several."""
    several = len(clip.subject_names) > 1 and subject
    return f"{stem(path)}.{safe_name(subject)}" if several else stem(path)

"""mocap-skel assoc guess: an association file for a clip of an unknown marker set."""

from __future__ import annotations

import json
import shlex
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mocap_skel.cli import options, say, warn
from mocap_skel.errors import CallError

if TYPE_CHECKING:
    from mocap_skel.clip import Clip

# The files' texts, the rows for --json, a sentence for standard error.
Found = tuple[list[str], list[dict[str, object]], str]


@click.command(
    "guess",
    epilog="Example: mocap-skel assoc guess walk.c3d -o my_lab.txt",
)
@options.clip
@options.subject
@click.option(
    "-o", "--output", metavar="FILE", type=click.Path(path_type=Path),
    help="Write it there, not to standard output. With --by-motion: BASE, for BASE.txt and BASE.toml.",
)  # fmt: skip
@click.option(
    "--by-motion", is_flag=True,
    help="Do without names: find the rigid segments and the joints between them as a figure of its own.",
)  # fmt: skip
@options.overwrite
@options.unit
@options.rate
@options.salvage
@options.mirror
@options.clip_up
@options.as_json
@options.quiet
def guess(
    clip: Path,
    subject: str | None,
    output: Path | None,
    by_motion: bool,
    overwrite: bool,
    unit: str | None,
    rate: float | None,
    salvage: bool,
    mirror: str | None,
    clip_up: str | None,
    as_json: bool,
    quiet: bool,
) -> int:
    """Guess which label of CLIP is which marker, and write it as an association file.

    First by the names, then by the motion: which markers move together. Each line tells how sure it
    is and why; what is not sure is a comment in the file, for you to decide.

    Labels that say nothing at all (numbers, channels) take --by-motion: markers that keep their distances
    become segment_1, segment_2 ..., hung on each other where two share a fixed point.
    """
    from mocap_skel.export.files import check_free, write_all
    from mocap_skel.labels.association import check_subject
    from mocap_skel.labels.guess import repeated
    from mocap_skel.labels.subjects import with_subjects
    from mocap_skel.pipeline.limits import limited
    from mocap_skel.pipeline.telling import wrote
    from mocap_skel.readers import read_clip

    how = repeated(subject, unit, rate, salvage=salvage, mirror=mirror, clip_up=clip_up)
    if by_motion and output is None and not as_json:
        raise CallError(
            "--by-motion writes two files, a skeleton and an association: -o BASE is missing",
            f"{shlex.join(['mocap-skel', 'assoc', 'guess', str(clip), '--by-motion', *how])} -o figure makes "
            "figure.toml and figure.txt",
        )
    paths = [output] if output else []
    if output and by_motion:
        base = output.with_suffix("") if output.suffix in (".txt", ".toml") else output
        paths = [base.parent / f"{base.name}{suffix}" for suffix in (".toml", ".txt")]
    check_free(paths, overwrite, [clip])
    with limited(clip):
        read = read_clip(clip, unit=unit, rate=rate, salvage=salvage, mirror=mirror, up=clip_up)
        read = with_subjects(read)
        check_subject(read, subject)
        if by_motion:
            texts, rows, note = _by_motion(read, subject, paths)
        else:
            texts, rows, note = _by_names(read, subject, how)
    if paths:
        write_all(dict(zip(paths, texts, strict=True)), overwrite, [clip])
    if as_json:
        for row in rows:
            say(json.dumps({"clip": str(clip), **row}, allow_nan=False))
    elif paths:
        say(wrote(paths))
    else:
        say(texts[0], nl=False)
    if not quiet:
        warn(f"{clip}: {note}")
    return 0


def _by_names(clip: Clip, subject: str | None, how: list[str]) -> Found:
    from mocap_skel.labels.guess import guess_association, in_words
    from mocap_skel.labels.guess.text import association_text

    found = guess_association(clip, subject, how)
    return [association_text(found)], [asdict(line) for line in found.lines], in_words(found)


def _by_motion(clip: Clip, subject: str | None, paths: list[Path]) -> Found:
    from mocap_skel.labels.guess.figure import figure_texts, find_figure

    found = find_figure(clip, subject)
    name = paths[0].name if paths else "figure.toml"
    return list(figure_texts(found, name)), found.rows(), found.in_words()

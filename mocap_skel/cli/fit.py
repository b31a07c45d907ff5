"""mocap-skel fit: clips in, skeletons and joint statistics out."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import Any, cast

import click

from mocap_skel.cli import each, format_options, options
from mocap_skel.cli.jobs import Told, job_of
from mocap_skel.errors import CallError
from mocap_skel.export.registry import DEFAULT, choose
from mocap_skel.export.registry import formats as known_formats

HELP = """Fit a skeleton to each CLIP and write it.

{formats}

The joint table goes to standard output. Column 'shown' tells whether the movement shows the joint: yes,
weak or no.

Without --assoc, which label is which marker is guessed from names and motion, and said; where that
is not sure, nothing is fitted: mocap-skel assoc guess writes the file to correct. A few markers that
contradict their names are left out and named; with --strict they stop the call. With
--skeleton, the markers are guessed for that figure.

Markers whose labels are certainly exchanged are left out and named; a body that is mirrored is not fitted:
see --mirror and --trust-labels.

Exit codes: 0 all done, 1 some clips failed, 2 wrong call or association file, 3 nothing could
be fitted, 130 interrupted.
"""


def _what_formats_make() -> str:
    """A paragraph of the help."""
    makes = "; ".join(f"{name} makes {one.makes}" for name, one in known_formats().items())
    return fill(f"For walk.c3d, {makes}.", 100, break_on_hyphens=False)


@click.command(
    "fit",
    help=HELP.format(formats=_what_formats_make()),
    epilog="Example: mocap-skel fit walk.c3d --assoc cmu --format csv --format bvh -o out",
)
@options.clips
@options.which
@options.strict
@click.option(
    "--format", "-f", "formats", multiple=True, type=click.Choice(tuple(known_formats())),
    default=(DEFAULT,), show_default=True, help="Result format; repeat it for several.",
)  # fmt: skip
@options.output
@options.overwrite
@options.estimation
@options.static
@format_options.all_options
@options.reading
@options.wide
@options.as_json
@options.quiet
def command(
    clips: tuple[Path, ...],
    formats: tuple[str, ...],
    output: str,
    overwrite: bool,
    strict: bool,
    wide: bool,
    as_json: bool,
    quiet: bool,
    **told: Any,
) -> int:
    """Fit the clips; what the formats can be told comes from their register."""
    to_stdout = output == "-"
    if to_stdout and (len(clips) > 1 or len(set(formats)) > 1 or as_json):
        raise CallError(
            "-o - sends one clip in one format and nothing else", "give a folder for more"
        )
    each.check_names(clips)
    chosen = choose(formats, **format_options.told_of(told, formats))
    for one in chosen:
        one.format.check_installed()
    job = job_of(
        cast(Told, {key: told[key] for key in told.keys() - format_options.names()}),
        clips,
        formats=chosen,
        folder=each.folder_of(
            output, (s for one in known_formats().values() for s in one.suffixes)
        ),
        overwrite=overwrite,
        strict=strict,
    )
    return each.run(clips, job, as_json=as_json, quiet=quiet, wide=wide)
